"""Recordings wherever they are stored: a folder, an object store or a netCDF file."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import xarray as xr

from insonify.formats.locations import is_url
from insonify.formats.netcdf_file import opened_netcdf, read_netcdf
from insonify.formats.store_description import SOUND, StoreError
from insonify.formats.zarr_store import open_recording
from insonify.records.netcdf_recording import REAL

NETCDF = (".nc", ".nc4")
"""Suffixes of netCDF files."""


def is_netcdf(where: str | Path) -> bool:
    """Return True for a netCDF file, by its suffix.

    Args:
        where: Folder, URL or file.
    """
    return not is_url(where) and Path(where).suffix.lower() in NETCDF and not Path(where).is_dir()


def stored_recording(where: str | Path) -> xr.Dataset:
    """Open a recording in a folder or an object store, or read one from a netCDF file.

    Args:
        where: Folder of the recording, its URL, or a netCDF file of `write_netcdf` or `to_netcdf`.

    Returns:
        As from `open_recording`.

    Raises:
        StoreError: There is no recording, or it is damaged; the message gives the remedy.
    """
    if not is_netcdf(where):
        return open_recording(where)
    with outlined(where):
        dataset = read_netcdf(where)
    return dataset if "done" in dataset else dataset.assign(done=("ping", np.ones(dataset.sizes["ping"], bool)))


@contextmanager
def outlined(where: str | Path) -> Iterator[tuple[str, xr.Dataset]]:
    """Name of the recorded quantity, and the stored variables, whose values are read on access.

    Args:
        where: Folder of the recording, its URL, or a netCDF file; complex variables of a file have the end `REAL`.

    Raises:
        StoreError: There is no recording, or it is damaged; the message gives the remedy.
    """
    if is_netcdf(where):
        with opened_netcdf(where) as dataset:
            yield _quantity(dataset, where), dataset
    else:
        dataset = open_recording(where)
        yield _quantity(dataset, where), dataset


def _quantity(dataset: xr.Dataset, where: str | Path) -> str:
    """Name of the variable with the recorded quantity, refused where there is none."""
    stored = next((part for name in SOUND for part in (name, name + REAL) if part in dataset.variables), None)
    if stored is None or not {"time", "steer"} <= set(dataset.variables):
        convention = dataset.attrs.get("sonar_convention_name")
        held = f"groups of {convention}" if convention else ", ".join(map(str, dataset.data_vars)) or "no variable"
        raise StoreError(f"{where} is a netCDF file with {held}, and no recording of insonify. Read it with xarray or "
                         "ncdump -h. Files with recordings are those of insonify export OUT FILE.nc")  # fmt: skip
    for axis in ("ping", "channel"):
        if axis not in dataset.dims:
            raise StoreError(f"{where} holds one {axis}, selected by number, and a recording has an axis of them. "
                             f"Write recording.isel({axis}=[0]).to_netcdf(FILE), with brackets")  # fmt: skip
    return stored
