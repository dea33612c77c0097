"""Recordings as netCDF files: complex pressure, which netCDF does not support, as two real variables.

Any program that reads netCDF reads the files; `read_netcdf` returns the bit-identical recording.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal

import xarray as xr

from insonify.data_file import require_readable_hdf5
from insonify.formats.zarr_store import StoreError
from insonify.records.netcdf_recording import as_recording, join_complex, split_complex
from insonify.records.recording import FIELDS

MAX_NUMBERS = 1 << 30
"""Largest size of a variable that is read into memory: 8 GB of pressure [1]."""


def write_netcdf(recording: xr.Dataset, path: str | Path) -> Path:
    """Write a recording, an image, soundings or labels to a netCDF file.

    Complex variables become two real ones, such as `pressure_real` and `pressure_imag`; lists among the attributes
    become text with one line for each entry. Everything else is unchanged. The file is netCDF 4 where the package
    netCDF4 is installed (the extra `io`), else netCDF 3.

    Args:
        recording: As from `insonify.simulate` or `open_recording`.
        path: File to write, such as "harbour.nc"; it is replaced.

    Returns:
        The path.

    Raises:
        ValueError: A variable has the name of a part of a complex variable.

    Example:
        >>> recording = insonify.simulate(insonify.load_scenario("sidescan.yaml"), pings=[0])
        >>> insonify.write_netcdf(recording, "ping.nc").name
        'ping.nc'
    """
    target, engine = Path(path), _engine()
    xr.Dataset.to_netcdf(split_complex(recording), target, engine=engine)
    return target


def read_netcdf(path: str | Path) -> xr.Dataset:
    """Read a recording from a netCDF file of `write_netcdf` or of the recording's `to_netcdf` into memory.

    Args:
        path: File to read.

    Returns:
        The dataset as it was written, with complex variables.

    Raises:
        StoreError: The file does not exist, or is not a netCDF file.

    Example:
        >>> recording = insonify.simulate(insonify.load_scenario("sidescan.yaml"), pings=[0])
        >>> insonify.read_netcdf(insonify.write_netcdf(recording, "ping.nc")).identical(recording)
        True
    """
    with opened_netcdf(path) as file:
        if (count := max((variable.size for variable in file.variables.values()), default=0)) > MAX_NUMBERS:
            raise ValueError(f"it declares {count} numbers; {MAX_NUMBERS} is the most")
        dataset = file.load()
    dataset = join_complex(dataset)
    return as_recording(dataset) if {*FIELDS, "recorded"} & set(dataset.variables) else dataset


@contextmanager
def opened_netcdf(path: str | Path) -> Iterator[xr.Dataset]:
    """Open a netCDF file as it is, complex variables in two parts; values are read on access.

    Raises:
        StoreError: The file does not exist, or cannot be read.
    """
    if not Path(path).is_file():
        raise StoreError(f"{path}: there is no such file")
    try:
        require_readable_hdf5(path)
        complex_too: dict[str, Any] = {"auto_complex": True} if _engine() == "netcdf4" else {}
        with xr.open_dataset(path, engine=_engine(), decode_times=False, **complex_too) as file:
            yield file
    except StoreError:
        raise
    except Exception as fault:  # a reader of foreign files may fail in any way
        message = " ".join(str(fault).split())[:200] or type(fault).__name__
        raise StoreError(f"{path} cannot be read as netCDF: {message}") from None


def _engine() -> Literal["netcdf4", "scipy"]:
    """Library that reads and writes the files: netCDF4 where it is installed."""
    return "netcdf4" if find_spec("netCDF4") else "scipy"
