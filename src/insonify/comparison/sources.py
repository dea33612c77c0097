"""Sources of samples: a file, a folder, a dataset, or samples themselves."""

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from insonify.comparison.instrument_samples import group_samples, instrument_samples
from insonify.comparison.recording_samples import image_samples, recording_samples
from insonify.comparison.samples import Samples
from insonify.formats.instruments import InstrumentFile, open_instrument
from insonify.formats.locations import is_url
from insonify.formats.netcdf_file import read_netcdf
from insonify.formats.store_description import StoreError
from insonify.formats.zarr_store import open_recording

Source = str | Path | xr.Dataset | InstrumentFile | Samples
"""Whatever samples can be taken from."""


def samples_of(source: Source, group: str | None = None, frequency: float = np.nan) -> Samples:
    """Samples of a source.

    Args:
        source: File of an instrument, folder, URL or netCDF file of ours, dataset, or samples.
        group: Group of data, such as "38 kHz", "water column" or "port".
        frequency: Frequency of the other source [Hz], by which a group is chosen where none is named.

    Raises:
        StoreError: The source cannot be read, or has no such group.
    """
    if isinstance(source, Samples):
        return source
    if isinstance(source, InstrumentFile):
        return instrument_samples(source, group, frequency)
    if isinstance(source, xr.Dataset):
        return _dataset_samples(source, str(source.attrs.get("title", "dataset")), group)
    path = Path(source)
    if is_url(source) or path.is_dir():
        return _dataset_samples(open_recording(source), path.name, group)
    if path.suffix.lower() in (".nc", ".nc4"):
        return _dataset_samples(read_netcdf(path), path.name, group)
    with open_instrument(path) as file:
        return instrument_samples(file, group, frequency)


def _dataset_samples(dataset: xr.Dataset, name: str, group: str | None) -> Samples:
    if "pressure" in dataset or "intensity" in dataset:
        return recording_samples(dataset, name, group)
    if "level_db" in dataset and "across" in dataset.dims:
        return image_samples(dataset, name)
    if "ping" in dataset.dims:
        return group_samples(dataset, name)
    known: Any = ", ".join(map(str, dataset.data_vars)) or "nothing"
    raise StoreError(f"{name} holds {known}. Give a recording (pressure or intensity), an image (level_db) or pings "
                     "of an instrument")  # fmt: skip
