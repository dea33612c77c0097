"""Labels on the axes of an image, by the same change of range as the image's levels.

A cell spans samples of the recording. Their majority determines its object, pair of families and masks;
intensities are means over the span, as the levels of the image are.
"""

from typing import Any, Literal, get_args

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from insonify.processing.bin_overlap import sums_between_edges
from insonify.processing.slant_range_correction import ground_cell_edges
from insonify.records.labels import COLUMNS, NO_ROW, over_pings

Floats = NDArray[np.float64]
Vote = Literal["majority", "any"]


def image_labels(labels: xr.Dataset, image: xr.Dataset, *, masks: Vote = "majority") -> xr.Dataset:
    """Labels of a recording on the axes of an image of that recording.

    Args:
        labels: Labels over (ping, channel, time), as from `insonify.formats.label_store.open_labels`, some of these, or
            those of a single ping, as from `insonify.labels`.
        image: Image from `insonify.processing.sidescan` of the same recording, in slant range or on the ground.
        masks: "majority": a mask is set where at least half of a cell's span is; "any": where any part of it is.

    Returns:
        The same variables of `insonify.records.labels.COLUMNS` over (ping, across) instead of (ping, channel, time).
        Masks by `masks`; objects and pairs by majority of the span; intensities as means over it [uPa^2]; positions,
        distances and grazing angles of the sample in its middle. Where a cell reaches beyond the recording, or its
        ping has no labels, masks are False, objects and pairs 255, numbers NaN.

    Raises:
        ValueError: An unknown value of `masks`.

    Example:
        >>> scenario = insonify.load_scenario("sidescan.yaml")
        >>> image = sidescan(insonify.simulate(scenario, pings=40), geometry="ground", altitude=8.0)
        >>> labels = image_labels(insonify.labels(scenario, ping=40), image).isel(ping=0)
        >>> shadow = labels["across"].values[labels["shadow"].values]  # of a crate at 29 to 31 m, 1.5 m tall
        >>> print(shadow.min().round(), shadow.max().round())
        31.0 38.0
    """
    if masks not in get_args(Vote):
        raise ValueError(f"masks is {masks!r}; choose one of {', '.join(get_args(Vote))}")
    selected = over_pings(labels).sel(ping=image["ping"])
    is_labelled = selected["done"].values
    slant = np.asarray(selected["time"].values, float) * float(image.attrs["sound_speed"]) / 2
    altitude = image["altitude"].values if image.attrs["geometry"] == "ground" else np.zeros(len(is_labelled))
    names = [name for name in COLUMNS if name in selected]
    out = {name: _empty_variable(name, selected, image.sizes["across"]) for name in names}
    for channel in np.unique(image["channel"].values):
        at = np.flatnonzero(image["channel"].values == channel)
        at = at[np.argsort(np.abs(image["across"].values[at]))]
        across = np.abs(image["across"].values[at])
        columns = {name: _with_time_last(selected[name].isel(channel=channel)) for name in names}
        for ping in np.flatnonzero(is_labelled & np.isfinite(altitude)):
            edges = ground_cell_edges(slant, float(altitude[ping]), across)
            for name, values in columns.items():
                out[name][ping][..., at] = _on_cells(name, values[ping], edges, 0.5 if masks == "majority" else 0.0)
    return _dataset(out, selected, image)


def _with_time_last(column: xr.DataArray) -> NDArray[Any]:
    """Values of a column, ping first and time last."""
    return np.asarray(column.transpose("ping", ..., "time").values)


def _empty_variable(name: str, template: xr.Dataset, columns: int) -> NDArray[Any]:
    """Array for a variable, ping first and columns last, filled with its value for unknown cells."""
    dims, kind, _, _ = COLUMNS[name]
    fill: Any = np.nan if np.issubdtype(kind, np.floating) else False if kind is np.bool_ else NO_ROW
    extra_sizes = [template.sizes[dim] for dim in dims if dim not in ("ping", "channel", "time")]
    return np.full((template.sizes["ping"], *extra_sizes, columns), fill, kind)


def _on_cells(name: str, values: NDArray[Any], edges: Floats, min_fraction: float) -> NDArray[Any]:
    """One variable of one ping on the cells of an image, (..., samples) to (..., cells)."""
    _, kind, units, _ = COLUMNS[name]
    count = values.shape[-1]
    inside = (edges[:-1] >= 0) & (edges[1:] <= count)
    if kind is np.bool_:
        fraction = _mean(values, edges)
        return np.asarray(inside & (fraction >= min_fraction) & (fraction > 1e-9))
    if kind is np.uint8:
        labels = np.unique(values)
        votes = np.array([_mean(values == label, edges) for label in labels])
        return np.where(inside, labels[np.argmax(votes, axis=0)], NO_ROW)
    if units == "uPa^2":
        rows = values.reshape(-1, count).astype(float)
        means = np.array([_mean(row, edges) for row in rows]).reshape(*values.shape[:-1], -1)
        return np.where(inside, means, np.nan)
    middle = np.clip((edges[:-1] + edges[1:]) / 2, 0, count - 1).astype(int)
    return np.where(inside, values[..., middle], np.nan)


def _mean(values: NDArray[Any], edges: Floats) -> Floats:
    """Mean between edges in units of samples, (samples,) to (cells,)."""
    sums = sums_between_edges(np.asarray(values, float), edges)
    return np.asarray(sums / np.maximum(np.diff(edges), 1e-300))


def _dataset(out: dict[str, NDArray[Any]], template: xr.Dataset, image: xr.Dataset) -> xr.Dataset:
    """Dataset of the variables with the axes of image and labels."""
    variables = {}
    for name in out:
        dims, _, units, meaning = COLUMNS[name]
        extra_dims = [dim for dim in dims if dim not in ("ping", "channel", "time")]
        column = xr.DataArray(
            out[name], dims=("ping", *extra_dims, "across"), attrs={"units": units, "long_name": meaning}
        )
        variables[name] = column.transpose("ping", "across", "axis") if name == "position" else column
    coords = {name: image[name] for name in ("ping", "across", "along", "altitude", "channel") if name in image.coords}
    coords |= {name: template[name] for name in ("object", "pair", "axis") if name in template.coords}
    return xr.Dataset(
        variables, coords, {"geometry": image.attrs["geometry"], "sound_speed": image.attrs["sound_speed"]}
    )
