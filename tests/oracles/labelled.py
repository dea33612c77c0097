"""Labelled images of drawn blobs, without any acoustics."""

import numpy as np

from insonify.annotations import ImageAxis, LabelledImage


def blobs(rng, shape, count):
    """Masks of some blobs, with holes and parts that touch at corners, as instances; the later ones on top."""
    layer = np.zeros(shape, np.int32)
    rows, columns = np.indices(shape)
    for instance in range(1, count + 1):
        centre, radius = rng.uniform(0, shape), rng.uniform(1, max(shape) / 4)
        distance = np.hypot(rows - centre[0], columns - centre[1])
        layer[(distance < radius) & (distance > radius * rng.choice([-1, 0.5])) & (rng.random(shape) < 0.9)] = instance
    return layer


def labelled_image(seed=0, *, shape=(40, 61), targets=3, index=0, **changes):
    """Image of noise with blobs in each class."""
    rng = np.random.default_rng(seed)
    level = rng.normal(-20, 6, shape).astype(np.float32)
    about = {
        "index": index, "name": f"image{index:03d}", "projection": "slant", "image": level, "expected": level - 1,
        "layers": np.stack([blobs(rng, shape, targets) for _ in range(3)]),
        "instance_names": tuple(f"target {number}" for number in range(targets)),
        "rows": ImageAxis("distance along the track", "m", np.arange(shape[0])[::-1] * 0.5),
        "columns": ImageAxis("slant range", "m", np.arange(shape[1]) * 0.1), "pings": np.arange(shape[0])[::-1],
    }  # fmt: skip
    return LabelledImage(**about | changes)
