"""Run lengths of a mask in the compressed form of COCO.

Source: the COCO application interface, maskApi.c: columns one after the other, runs of zeros and ones in turn from
zeros; from the third run on, less the one two before it; in groups of five bits with a sixth for more, from "0" on.
"""

import numpy as np
from numpy.typing import NDArray


def run_lengths(mask: NDArray[np.bool_]) -> list[int]:
    """Runs of False and True in turn, columns one after the other, from False on."""
    flat = mask.ravel(order="F")
    edges = np.flatnonzero(flat[1:] != flat[:-1]) + 1
    runs = np.diff(np.concatenate([[0], edges, [flat.size]])).tolist()
    return [0, *runs] if flat.size and flat[0] else runs


def compressed_run_lengths(mask: NDArray[np.bool_]) -> dict[str, object]:
    """Mask as the field `segmentation` of an annotation of COCO: size and counts."""
    runs, text = run_lengths(mask), list[str]()
    for index, run in enumerate(runs):
        rest = run - runs[index - 2] if index > 2 else run
        more = True
        while more:
            group, rest = rest & 31, rest >> 5
            more = rest != (-1 if group & 16 else 0)
            text.append(chr(48 + group + 32 * more))
    return {"size": [int(size) for size in mask.shape], "counts": "".join(text)}
