"""Level of a recording, coherent or incoherent, simulated or real."""

import numpy as np
import xarray as xr

from insonify.units import level_db


def recorded_level(recording: xr.Dataset) -> xr.DataArray:
    """Level of a recording [dB re 1 uPa].

    Args:
        recording: `pressure` [uPa] or `intensity` [uPa^2] over any dimensions.

    Returns:
        10 log10 of the mean-square pressure, of the same dimensions; -inf where it is zero.
    """
    field = recording["pressure" if "pressure" in recording else "intensity"]
    power = np.abs(field.values.astype(np.complex128)) ** 2 if "pressure" in recording else field.values
    attributes = {"units": "dB re 1 uPa", "long_name": "level of the received pressure"}
    return xr.DataArray(level_db(power), field.coords, field.dims, "level_db", attributes)
