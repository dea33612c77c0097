"""Level of a recording, coherent or incoherent, simulated or real."""

import numpy as np
import xarray as xr

from insonify.units import level_db


def recorded_level(recording: xr.Dataset) -> xr.DataArray:
    """Level of a recording [dB re 1 uPa].

    Args:
        recording: `pressure` [uPa], `intensity` [uPa^2] or, without both, `recorded` numbers over any dimensions.

    Returns:
        10 log10 of the mean-square pressure, of the same dimensions; -inf where it is zero. Recorded levels are as they
        are, recorded counts in dB re 1.

    Example:
        >>> import xarray as xr
        >>> recording = xr.Dataset({"pressure": ("time", [1e3j, 1e4], {"units": "uPa"})})
        >>> recorded_level(recording).values.round(1).tolist(), recorded_level(recording).attrs["units"]
        ([60.0, 80.0], 'dB re 1 uPa')
    """
    name = next(name for name in ("pressure", "intensity", "recorded") if name in recording)
    field, meaning = recording[name], "recorded numbers" if name == "recorded" else "received pressure"
    units = "dB re 1" if field.attrs.get("units") == "1" else "dB re 1 uPa"
    attributes = {"units": units, "long_name": f"level of the {meaning}"}
    if str(field.attrs.get("units")).startswith("dB"):
        return field.rename("level_db").assign_attrs(attributes)
    power = field.values if name == "intensity" else np.abs(field.values.astype(np.complex128)) ** 2
    return xr.DataArray(level_db(power), field.coords, field.dims, "level_db", attributes)
