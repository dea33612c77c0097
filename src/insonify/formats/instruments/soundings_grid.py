"""Bathymetry of the soundings of a recording of a real instrument, as a grid beside its scenario."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from insonify.formats.instruments.instrument_file import InstrumentFile
from insonify.formats.instruments.navigation_text import active_rows
from insonify.formats.instruments.scenario_values import PINGS_READ
from insonify.frames import pose_rotation
from insonify.scene.terrain.bathymetry_file import DEEPEST, metres_per_degree

Floats = NDArray[np.float64]

MOST_NODES = 1_000_000
"""Most nodes of a grid; cells grow until it has no more."""
FINEST_CELL = 0.25
"""Smallest side of a cell [m]."""
_REACH = 1.3  # longest slant range that is recorded, re that of the soundings
_FARTHEST = 1e5  # m from the first fix: where a local plane is no chart any more, and damaged soundings may lie


@dataclass(frozen=True, slots=True, eq=False)
class SoundingsGrid:
    """Depths on nodes, in metres from an origin."""

    north: Floats
    """Distance of each row north of the origin [m], shape (rows,)."""
    east: Floats
    """Distance of each column east of the origin [m], shape (columns,)."""
    depth: Floats
    """Depth below the water surface [m], shape (rows, columns)."""

    def write(self, path: Path) -> None:
        """Write a numpy file, which a relief of kind grid reads; refuse to replace one."""
        with path.open("xb") as file:
            np.savez_compressed(file, north=self.north, east=self.east, depth=self.depth.astype(np.float32))


def soundings_grid(file: InstrumentFile, latitude: float, longitude: float) -> SoundingsGrid | None:
    """Depths of the soundings of a file: medians in cells, linear between them, the nearest one beyond them.

    Args:
        file: The file.
        latitude: Latitude of north 0 [deg].
        longitude: Longitude of east 0 [deg].

    Returns:
        Grid out to the range that is recorded; None without soundings or their positions, or where 95 % of the depths
        are within the uncertainty of soundings about their median: a flat seabed.

    Source of the uncertainty: IHO (2020), S-44 ed. 6.0.0, table 1, special order: the root of 0.25 m squared and 0.75 %
    of the depth squared (not verified).
    """
    if "soundings" not in file.groups:
        return None
    parts = [_positions(file, first, latitude, longitude) for first in range(0, file.groups["soundings"], PINGS_READ)]
    north, east, depth, slant = np.concatenate(parts, axis=1)
    known = (np.hypot(north, east) < _FARTHEST) & (np.abs(depth) < DEEPEST)  # False of NaN
    north, east, depth = north[known], east[known], depth[known]
    if depth.size < 3:
        return None
    typical = float(np.median(depth))
    if np.quantile(np.abs(depth - typical), 0.95) <= np.hypot(0.25, 0.0075 * typical):
        return None
    reach = _REACH * float(slant[slant < _FARTHEST].max(initial=0.0))
    return _gridded(north, east, depth, reach)


def _positions(file: InstrumentFile, first: int, latitude: float, longitude: float) -> Floats:
    """North, east, depth and slant range of the soundings of some pings [m], shape (4, soundings); NaN if not known."""
    data = file.read("soundings", slice(first, first + PINGS_READ))
    metres = metres_per_degree(latitude)
    depth = data["depth"].values.astype(float)
    if "delta_latitude" in data:
        coordinates = [np.degrees(data[name].values[:, None] + data[f"delta_{name}"].values)
                  for name in ("latitude", "longitude")]  # fmt: skip
    else:
        fixes, coordinates = active_rows(file.navigation()), [np.full(depth.shape, np.nan)] * 2
        if fixes is not None and fixes.sizes["time"] > 1 and {"forward", "starboard"} <= set(data.variables):
            turn = pose_rotation(data["heading"].values)
            across = np.stack([data["forward"].values, data["starboard"].values], axis=-1)
            moved = np.einsum("pij,pbj->ibp", turn[:, :2, :2], across).transpose(0, 2, 1)
            coordinates = [
                np.degrees(np.interp(data["time"].values, fixes["time"].values, fixes[name].values))[:, None]
                + offset / size
                for name, offset, size in zip(("latitude", "longitude"), moved, metres, strict=True)
            ]
    with np.errstate(over="ignore"):  # positions of a damaged file
        axes = zip(coordinates, (latitude, longitude), metres, strict=True)
        north, east = ((degrees - zero) * size for degrees, zero, size in axes)
    speed = data["sound_speed"].values[:, None] if "sound_speed" in data else 1500.0
    slant = data["travel_time"].values.astype(float) * speed / 2 if "travel_time" in data else depth
    return np.stack([values.ravel() for values in np.broadcast_arrays(north, east, depth, slant)])


def _gridded(north: Floats, east: Floats, depth: Floats, reach: float) -> SoundingsGrid:
    """Grid of scattered depths that extends so far beyond them [m]."""
    from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator
    from scipy.stats import binned_statistic_2d

    size = [float(np.ptp(north)), float(np.ptp(east))]
    cell = max(FINEST_CELL, 2 * np.sqrt(max(size[0], 1.0) * max(size[1], 1.0) / depth.size))
    cell = max(cell, np.sqrt((size[0] + 2 * reach) * (size[1] + 2 * reach) / MOST_NODES))
    edges = [np.arange(values.min() - reach - cell, values.max() + reach + 2 * cell, cell) for values in (north, east)]
    middle, _, _, _ = binned_statistic_2d(north, east, depth, "median", bins=edges)
    rows, columns = (edge[:-1] + cell / 2 for edge in edges)
    filled = np.argwhere(np.isfinite(middle))
    points, values = np.column_stack([rows[filled[:, 0]], columns[filled[:, 1]]]), middle[np.isfinite(middle)]
    mesh = np.meshgrid(rows, columns, indexing="ij")
    whole = NearestNDInterpolator(points, values)(*mesh)
    if np.linalg.matrix_rank(points - points.mean(axis=0), tol=cell / 2) == 2:
        between = LinearNDInterpolator(points, values)(*mesh)
        whole = np.where(np.isfinite(between), between, whole)
    return SoundingsGrid(rows, columns, np.asarray(whole, float))
