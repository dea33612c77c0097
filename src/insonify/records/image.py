"""Image: levels over pings and across-track distances, as a labelled dataset."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray as xr

Floats = NDArray[np.float64]
Geometry = Literal["slant", "ground"]

LONG_NAMES = {
    "slant": "slant range of a direct echo, port negative",
    "ground": "distance across the track on a flat seabed, port negative",
}


def image_dataset(
    level: Floats, across: Floats, along: Floats, *, geometry: Geometry, gain: str, altitude: Floats,
    pings: NDArray[np.int64], attributes: dict[str, Any] | None = None,
) -> xr.Dataset:  # fmt: skip
    """A sidescan image as a labelled dataset.

    Args:
        level: Level [dB], shape (ping, across); -inf where the intensity is zero, NaN where nothing was recorded.
        across: Distance of each column from the track, port negative [m], shape (across,).
        along: Distance run at each ping by the logged navigation [m], shape (ping,).
        geometry: Whether `across` is slant range or distance on the ground.
        gain: Name of the gain that was applied.
        altitude: Height above the seabed that the slant-range correction used at each ping [m], shape (ping,).
        pings: Number of each ping, shape (ping,).
        attributes: Further attributes of the dataset.

    Returns:
        `level_db` over (ping, across) [dB], with `along` and `altitude` beside it.
    """
    import xarray as xr

    for name, rows, expected in (("across", across, level.shape[1]), ("along", along, level.shape[0])):
        if len(rows) != expected:
            raise ValueError(f"image: {name} has {len(rows)} rows; level has {expected}")
    return xr.Dataset(
        {"level_db": (("ping", "across"), level, {"units": "dB", "long_name": f"level, gain {gain}"})},
        coords={
            "ping": ("ping", pings, {"units": "1", "long_name": "number of the ping"}),
            "across": ("across", across, {"units": "m", "long_name": LONG_NAMES[geometry]}),
            "along": ("ping", along, {"units": "m", "long_name": "distance run, by the logged navigation"}),
            "altitude": ("ping", altitude, {"units": "m", "long_name": "height above the seabed"}),
        },
        attrs={"geometry": geometry, "gain": gain, **(attributes or {})},
    )
