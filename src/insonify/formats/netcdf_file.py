"""Recordings as netCDF files: complex pressure, which netCDF does not know, as two variables of real numbers.

Any program that reads netCDF reads them; `read_netcdf` gives the recording back, bit by bit.
"""

from importlib.util import find_spec
from pathlib import Path
from typing import Literal

import numpy as np
import xarray as xr

from insonify.data_file import insist_on_an_answer
from insonify.formats.zarr_store import StoreError

REAL, IMAGINARY = "_real", "_imag"
"""Ends of the names of the two parts of a complex variable."""
LISTED = "insonify_lists"
"""Attribute that names the attributes which are lists, one entry a line."""

MOST_NUMBERS = 1 << 30
"""Most numbers of a variable that is read into memory: 8 GB of pressure [1]."""


def write_netcdf(recording: xr.Dataset, path: str | Path) -> Path:
    """Write a recording, an image, soundings or labels to a netCDF file.

    Complex variables become two real ones, such as `pressure_real` and `pressure_imag`; lists among the attributes
    become text of one line an entry. Everything else stays as it is. The file is netCDF 4 where the package netCDF4
    is installed (the extra `io`), else netCDF 3.

    Args:
        recording: As from `insonify.simulate` or `open_recording`.
        path: File to write, such as "harbour.nc"; it is replaced.

    Returns:
        The path.

    Raises:
        ValueError: A variable bears the name of another one's part.
    """
    target, engine = Path(path), _engine()
    _split(recording).to_netcdf(target, engine=engine)
    return target


def read_netcdf(path: str | Path) -> xr.Dataset:
    """A recording from a netCDF file that `write_netcdf` wrote, in memory.

    Args:
        path: The file.

    Returns:
        The dataset as it was, complex variables whole again.

    Raises:
        StoreError: There is no such file, or it is no netCDF file.
    """
    if not Path(path).is_file():
        raise StoreError(f"{path}: there is no such file")
    try:
        insist_on_an_answer(path)
        with xr.open_dataset(path, engine=_engine(), decode_times=False) as file:
            if (count := max((variable.size for variable in file.variables.values()), default=0)) > MOST_NUMBERS:
                raise ValueError(f"it promises {count} numbers, and {MOST_NUMBERS} is the most")
            held = file.load()
    except Exception as fault:  # a reader of foreign files may fail in any way
        said = " ".join(str(fault).split())[:200] or type(fault).__name__
        raise StoreError(f"{path} cannot be read as netCDF: {said}") from None
    for name in [str(name) for name in held.variables]:
        base, other = name.removesuffix(REAL), f"{name.removesuffix(REAL)}{IMAGINARY}"
        if name.endswith(REAL) and other in held.variables:
            whole = held[name].values + 1j * held[other].values
            about = {key: text.removesuffix(", real part") if isinstance(text, str) else text
                     for key, text in held[name].attrs.items()}  # fmt: skip
            held = held.assign({base: (held[name].dims, whole, about)}).drop_vars([name, other])
    lists = str(held.attrs.pop(LISTED, "")).split()
    return held.assign_attrs({name: str(held.attrs[name]).split("\n") for name in lists})


def _engine() -> Literal["netcdf4", "scipy"]:
    """Library that reads and writes files: netCDF 4 where it is installed."""
    return "netcdf4" if find_spec("netCDF4") else "scipy"


def _split(recording: xr.Dataset) -> xr.Dataset:
    """The dataset without anything that netCDF cannot hold."""
    held = recording.copy()
    for name, variable in recording.variables.items():
        if not np.iscomplexobj(variable.values):
            continue
        for end, part, meaning in (
            (REAL, variable.values.real, "real"),
            (IMAGINARY, variable.values.imag, "imaginary"),
        ):
            if f"{name}{end}" in recording.variables:
                raise ValueError(f"the recording has {name} and {name}{end}. Rename the second one.")
            about = dict(variable.attrs)
            if "long_name" in about:
                about["long_name"] = f"{about['long_name']}, {meaning} part"
            held[f"{name}{end}"] = (variable.dims, np.ascontiguousarray(part), about)
        held = held.drop_vars(str(name))
    lists = [str(name) for name, value in recording.attrs.items() if isinstance(value, list | tuple)]
    texts = {name: "\n".join(map(str, recording.attrs[name])) for name in lists}
    return held.assign_attrs(texts | ({LISTED: " ".join(lists)} if lists else {}))
