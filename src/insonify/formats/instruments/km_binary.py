"""Invalid values of KM binary, the format of motion sensors within KMALL (#SKM) and EK80 (MRU1) files.

The status of each sample has a bit for each kind of value that is invalid. Sources: EK80 on-line help, "KM Binary";
for KMALL, revisions H and I, the comments on `KMbinary_def` in the source of MB-System.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

_BITS = {
    "latitude": 0, "longitude": 0, "velocity_north": 0, "velocity_east": 0, "roll": 1, "pitch": 1, "yaw": 2, "heave": 3,
    "velocity_down": 3,
}  # fmt: skip
"""Bit that marks a value as invalid; the vertical velocity has that of heave up to revision H of KMALL."""


def without_invalid(samples: NDArray[Any]) -> NDArray[Any]:
    """Copy of samples in which values that their status marks as invalid are NaN.

    Args:
        samples: Records with a field `status`, shape (n,).
    """
    result = samples.copy()
    for name in set(_BITS) & set(result.dtype.names or ()):
        result[name][result["status"] >> _BITS[name] & 1 > 0] = np.nan
    return result
