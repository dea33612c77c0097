"""Recordings that xarray's own `to_netcdf` can write: complex pressure as two real variables.

NetCDF has no complex type. Lists among the attributes become text, one entry a line, which netCDF 3 can store too.
"""

from collections.abc import Hashable, Mapping
from typing import Any

import numpy as np
import xarray as xr

REAL, IMAGINARY = "_real", "_imag"
"""Ends of the names of the two parts of a complex variable."""
LISTED = "insonify_lists"
"""Attribute that names the attributes which are lists, one entry a line."""


class Recording(xr.Dataset):
    """Recorded sound as a dataset; complex variables are written to netCDF files as real and imaginary part."""

    __slots__ = ()

    def to_netcdf(self, *args: Any, **options: Any) -> Any:
        """Write to a netCDF file, complex variables as two real ones such as `pressure_real` and `pressure_imag`.

        `insonify.read_netcdf` reads the recording back, bit-identical.

        Args:
            *args: Arguments of `xarray.Dataset.to_netcdf`.
            **options: Options of `xarray.Dataset.to_netcdf`; with `auto_complex=True` pressure stays one complex
                variable, as the package netCDF4 writes it.
        """
        if options.get("auto_complex"):
            return super().to_netcdf(*args, **options)
        if encoding := options.get("encoding"):
            options["encoding"] = self._encoding_of_parts(encoding)
        return xr.Dataset.to_netcdf(split_complex(self), *args, **options)

    def _encoding_of_parts(self, encoding: Mapping[Hashable, Any]) -> dict[Hashable, Any]:
        """Encodings in which both parts of a complex variable have the encoding of the variable."""
        return {
            part: settings
            for name, settings in encoding.items()
            for part in (real_imaginary_names(str(name)) if name in self and np.iscomplexobj(self[name]) else (name,))
        }


def as_recording(dataset: xr.Dataset) -> Recording:
    """The same dataset as a recording; nothing is loaded."""
    return Recording(dataset.data_vars, dataset.coords, dataset.attrs)


def real_imaginary_names(name: str) -> tuple[str, str]:
    """Names of the real and of the imaginary part of a variable."""
    return f"{name}{REAL}", f"{name}{IMAGINARY}"


def split_complex(recording: xr.Dataset) -> xr.Dataset:
    """The dataset with each complex variable as two real ones and each list attribute as text.

    Raises:
        ValueError: A variable has the name of another variable's real or imaginary part.
    """
    parts = recording.copy()
    for name, variable in recording.variables.items():
        if not np.issubdtype(variable.dtype, np.complexfloating):
            continue
        values = variable.values
        for part, numbers, meaning in zip(
            real_imaginary_names(str(name)), (values.real, values.imag), ("real", "imaginary"), strict=True
        ):
            if part in recording.variables:
                raise ValueError(f"the recording has {name} and {part}. Rename the second one.")
            attributes = dict(variable.attrs)
            if "long_name" in attributes:
                attributes["long_name"] = f"{attributes['long_name']}, {meaning} part"
            parts[part] = (variable.dims, np.ascontiguousarray(numbers), attributes)
        parts = parts.drop_vars(str(name))
    lists = [str(name) for name, value in recording.attrs.items() if isinstance(value, list | tuple)]
    texts = {name: "\n".join(map(str, recording.attrs[name])) for name in lists}
    return parts.assign_attrs(texts | ({LISTED: " ".join(lists)} if lists else {}))


def join_complex(dataset: xr.Dataset) -> xr.Dataset:
    """Inverse of `split_complex`: complex variables and list attributes restored.

    Args:
        dataset: A dataset as `split_complex` returns it.
    """
    for name in [str(name) for name in dataset.variables]:
        base = name.removesuffix(REAL)
        real, imaginary = real_imaginary_names(base)
        if name != real or imaginary not in dataset.variables:
            continue
        attributes = {key: text.removesuffix(", real part") if isinstance(text, str) else text
                 for key, text in dataset[real].attrs.items()}  # fmt: skip
        values = np.empty(dataset[real].shape, np.result_type(dataset[real].dtype, np.complex64))
        values.real, values.imag = dataset[real].values, dataset[imaginary].values
        dataset = dataset.assign({base: (dataset[real].dims, values, attributes)}).drop_vars([real, imaginary])
    lists = str(dataset.attrs.pop(LISTED, "")).split()
    return dataset.assign_attrs({name: str(dataset.attrs[name]).split("\n") for name in lists})
