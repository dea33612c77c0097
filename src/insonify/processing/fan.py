"""Fan image: the series of many beams, laid out by bearing and range (the paper's figure 14)."""

import numpy as np
import xarray as xr

from insonify.processing.level import recorded_level


def fan_image(recording: xr.Dataset, *, sound_speed: float, facing: float, ping: int = 0) -> xr.Dataset:
    """The image that the beams of one ping make together.

    Args:
        recording: A recording of several channels, each a beam.
        sound_speed: Sound speed that turns time into slant range [m/s].
        facing: Bearing of boresight [rad].
        ping: Row of the ping in the recording.

    Returns:
        `level_db` over (beam, range) [dB re 1 uPa], with bearing [rad] of each beam, slant range [m], and
        north and east [m] of each sample as if it lay in the plane of the sonar, which stands at (0, 0).
    """
    level = recorded_level(recording).isel(ping=ping).values
    bearing = facing + recording["steer"].values
    slant_range = sound_speed * recording["time"].values / 2
    return xr.Dataset(
        {
            "level_db": (("beam", "range"), level, {"units": "dB re 1 uPa", "long_name": "received level"}),
        },
        coords={
            "bearing": ("beam", bearing, {"units": "rad", "long_name": "bearing of the beam, clockwise from north"}),
            "range": ("range", slant_range, {"units": "m", "long_name": "slant range"}),
            "north": (("beam", "range"), np.outer(np.cos(bearing), slant_range), {"units": "m", "long_name": "north"}),
            "east": (("beam", "range"), np.outer(np.sin(bearing), slant_range), {"units": "m", "long_name": "east"}),
        },
    )
