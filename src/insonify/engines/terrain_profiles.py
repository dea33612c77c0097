"""Terrain profiles: slices of azimuth about one end of the sonar, and the seabed along the middle line of each.

Profiles are sampled on the map of the seabed, with cells that follow the cutoff wavelength alone: shadows do not depend
on the density of scatterers. A slice is a quarter of the shortest terrain wave wide at its end, or a third of the
finest beam where that is wider. A point of the seabed is visible where the seabed of its slice's middle line is.

Where the gain is less than a tenth of the largest at a distance, few scatterers are kept, see `beam_importance`: there
slices are merged by fours, so that each holds as many as one in the main lobe.
"""

from collections.abc import Callable
from functools import lru_cache
from itertools import pairwise
from threading import Lock
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines import _terrain_diffraction_kernel as crests
from insonify.engines import _terrain_profile_kernel as kernel
from insonify.propagation.families import bottom_bounces, image_depth, last_boundary
from insonify.propagation.launch_angles import LaunchAngles, StraightLaunchAngles
from insonify.recent_results import Identity, RecentResults
from insonify.scene.heightmap_cache import HeightmapTiles
from insonify.scene.seabed_terrain import SeabedTerrain

Floats = NDArray[np.floating[Any]]
Integers = NDArray[np.int64]
GainBound = Callable[[NDArray[np.float64], float, tuple[float, float]], NDArray[np.float64]]
"""Upper bound of the two-way pressure gain [1] about some bearings [rad], given the width of each [rad] and the nearest
and farthest horizontal distance [m]; infinite where it is not known."""

PROFILES_PER_WAVE = 4
"""Number of slices across the shortest terrain wave, at the outer edge of a zone."""
FIRST_ZONE = 128
"""Number of slices of the innermost zone; each zone farther out reaches twice as far and has twice as many."""
PROFILES_PER_BATCH = 64
"""Largest number of profiles that are sampled and stored together."""
SAMPLES_PER_CHECK = 256
"""Number of samples of a line that are tested before the test may end early."""
LOW_GAIN = 0.1
"""Two-way pressure gain re the largest at its distance, below which slices are merged [1]."""
MERGE_POWER = 2
"""Base-2 logarithm of the number of slices that are merged into one."""
MERGE_GROUP = 1 << kernel.MERGE_BLOCK_LOG2
"""Number of consecutive slices with one decision about merging."""
PROFILES_PER_SECTOR = 4 * MERGE_GROUP
"""Number of slices whose gain is bounded together, before that of each `MERGE_GROUP` in the strongest of these."""


class TerrainProfiles:
    """Seabed along some lines, from the sonar outwards, and the launch angles that reach it."""

    def __init__(
        self, depth: Floats, bearing: Floats, distance: Floats, launches: LaunchAngles, wavelength: float
    ) -> None:
        """Prepare without any launch angle.

        Args:
            depth: Depths of the seabed at even distances [m], shape (lines, samples).
            bearing: Bearing of each line re the heading of the scatterer grid [rad], shape (lines,).
            distance: Horizontal distances of the samples: one step, two steps, ... [m], shape (samples,).
            launches: Launch angles as a function of position.
            wavelength: Acoustic wavelength [m].
        """
        self.depth, self.bearing, self._launches, self._wavelength = depth, bearing, launches, wavelength
        self._distance = distance
        self._horizons: dict[str, crests.LaunchHorizon] = {}
        self._unobstructed: dict[str, bool] = {}
        self._shallowest: Floats | None = None
        self._lock = Lock()

    @property
    def shallowest(self) -> Floats:
        """Least depth along each line [m], shape (lines,)."""
        if self._shallowest is None:
            least = self.depth.min(axis=1)  # several times as fast as a search past unknown depths
            self._shallowest = np.asarray(np.fmin.reduce(self.depth, axis=1) if np.isnan(least).any() else least)
        return self._shallowest

    def unobstructed(self, family: str) -> bool:
        """Return True if surely no seabed along the lines is hidden from rays of a family that arrive from above."""
        with self._lock:
            if family not in self._unobstructed:
                self._unobstructed[family] = self._never_rises(family)
            return self._unobstructed[family]

    def _never_rises(self, family: str) -> bool:
        """Evaluate `unobstructed` without the cache."""
        rays = self._launches
        if not isinstance(rays, StraightLaunchAngles):
            largest_fall = rays.largest_unobstructed_fall(family, float(self._distance[0]), self.depth.shape[1])
            return largest_fall is not None and bool(crests.falls_within(self.depth, largest_fall))
        if bottom_bounces(family):
            return False
        image = np.float32(image_depth(family, rays.source_depth, rays.water_depth))
        return bool(crests.surely_unobstructed(self.depth, self._distance, image, SAMPLES_PER_CHECK))

    def horizon(self, family: str) -> crests.LaunchHorizon:
        """The launch horizon of rays of a family."""
        with self._lock:
            if family not in self._horizons:
                slope = self._launches.launch_slope(family, self._distance, self.depth).astype(np.float32, copy=False)
                self._horizons[family] = crests.launch_horizon(
                    slope, self._distance, last_boundary(family) == "bottom", self._wavelength
                )
            return self._horizons[family]


ProfileGroup = tuple[TerrainProfiles, Integers, Integers]
"""Lines of one batch, the indices of points whose slices they represent, and the row of the line of each point."""


_MERGED: RecentResults[NDArray[np.uint8]] = RecentResults(8)


class AzimuthProfiles:
    """Terrain profiles about one end of the sonar at one ping, sampled when they are needed."""

    def __init__(
        self, terrain: SeabedTerrain, position: Floats, launches: LaunchAngles, *, farthest: float, wavelength: float,
        min_profile_width: float,
        gain_bound: GainBound | None = None,
    ) -> None:  # fmt: skip
        """Prepare without any profile; arguments are those of `terrain_occlusion.TerrainOcclusion`."""
        self._terrain, self._launches, self._wavelength = terrain, launches, wavelength
        self._scatterer_grid, self.step = terrain.relief.resolved.scatterer_grid, terrain.heightmap_cell_size
        self._sonar = self._scatterer_grid.from_world(np.asarray(position, float)[:2])
        across = max(terrain.relief.shortest_wavelength / PROFILES_PER_WAVE, self.step)
        zones = azimuth_zones(across, farthest, min_profile_width, self.step)
        self.edges, self.counts, self.starts, self._firsts, self._runs, self._distance = zones
        self.merged = np.zeros(int(self.starts[-1]) // MERGE_GROUP, np.uint8)
        if gain_bound is not None:
            key = Identity(gain_bound), self._scatterer_grid.heading, self.edges.tobytes(), self.counts.tobytes()
            self.merged = _MERGED.get(key, lambda: self._low_gain_groups(gain_bound))
        self._batch, self._row = np.full((2, int(self.starts[-1])), -1, np.int32)
        self._batches: list[TerrainProfiles] = []
        self._lock = Lock()

    def _low_gain_groups(self, gain_bound: GainBound) -> NDArray[np.uint8]:
        """Base-2 logarithm of the number of slices with one profile, by `MERGE_GROUP`; 0 where gains are not low."""
        result, inner = np.zeros_like(self.merged), 0.0
        for start, count, outer in zip(self.starts, self.counts, self.edges, strict=False):
            width, zone, sectors = 2 * np.pi / count, (inner, float(outer)), np.arange(0, count, PROFILES_PER_SECTOR)

            def bound(first: Integers, slices: int, width: float = width, zone: tuple[float, float] = zone) -> Floats:
                return gain_bound(
                    np.asarray((first + slices / 2) * width + self._scatterer_grid.heading), slices * width, zone
                )

            gain, group_gain = bound(sectors, PROFILES_PER_SECTOR), np.zeros(count // MERGE_GROUP)
            strongest = sectors[gain >= LOW_GAIN * gain.max()]
            groups = (strongest[:, None] + np.arange(0, PROFILES_PER_SECTOR, MERGE_GROUP)).ravel()
            group_gain[groups // MERGE_GROUP] = bound(groups, MERGE_GROUP)
            first, is_low = int(start) // MERGE_GROUP, group_gain < LOW_GAIN * group_gain.max()
            result[first : first + len(is_low)] = np.where(is_low, MERGE_POWER, 0)
            inner = float(outer)
        return result

    def group_points(self, sonar: Floats, position: Floats) -> tuple[Floats, list[ProfileGroup]]:
        """Group points by the batch that holds the profile of their slice.

        Args:
            sonar: North and east of the sonar [m], shape (2 or more,).
            position: North and east of the points [m], shape (n, 2 or more).

        Returns:
            Their horizontal distances [m], shape (n,), and the groups.
        """
        distance, slice_of = np.empty(len(position)), np.empty(len(position), np.int64)
        to_sample = np.zeros(len(self._batch), bool)
        missing = kernel.profiles_of(
            sonar, position,
            kernel.AzimuthSlices(
                self._scatterer_grid.heading, self.edges, self.counts, self.starts, self.merged, self._batch
            ),
            distance, slice_of, to_sample,
        )  # fmt: skip
        if missing:
            self._build(np.flatnonzero(to_sample))
        points, rows = np.empty((2, len(slice_of)), np.int64)
        starts = np.empty(len(self._batches) + 1, np.int64)
        kernel.group_by_profile(slice_of, self._batch, self._row, starts, points, rows)
        return distance, [
            (profiles, points[start:stop], rows[start:stop])
            for profiles, (start, stop) in zip(self._batches, pairwise(starts.tolist()), strict=False)
            if stop > start
        ]

    def _build(self, slices: Integers) -> None:
        """Sample the profiles of some slices, each from the sonar to the outer edge of its zone.

        Args:
            slices: Indices of the slices, of merged ones the first, increasing, shape (n,).
        """
        with self._lock:
            slices = slices[self._batch[slices] < 0]  # another thread may have sampled them
            zone_starts = np.searchsorted(slices, self.starts).tolist()
            batches = [
                (slices[first : min(first + PROFILES_PER_BATCH, stop)], zone)
                for zone, (start, stop) in enumerate(pairwise(zone_starts))
                for first in range(start, stop, PROFILES_PER_BATCH)
            ]
            for (batch, _), profiles in zip(batches, self._sampled(batches), strict=True):
                self._batches.append(profiles)
                self._row[batch] = np.arange(len(batch))
                self._batch[batch] = len(self._batches) - 1

    def _sampled(self, batches: list[tuple[Integers, int]]) -> list[TerrainProfiles]:
        """Profiles of some slices, each of one zone; nearer samples are those of the wider slices of nearer zones."""
        profiles, sampled, ends = [], [], [self._sonar[None]]
        for slices, zone in batches:
            firsts = self._firsts[: zone + 2]
            bearing, direction = np.empty((len(slices), zone + 1)), np.empty((len(slices), zone + 1, 2))
            kernel.profile_bearings(slices, zone, self.counts, self.starts, self.merged, bearing, direction)
            depth = np.empty((len(slices), int(firsts[-1])), np.float32)
            done = np.zeros(self._runs[zone], bool)
            ends.append(self._sonar + direction[:, -1] * (self.step * depth.shape[1]))
            sampled.append((kernel.ProfileLines(self._sonar, direction, self.step, firsts), done, depth))
            distance = self._distance[: depth.shape[1]]
            profiles.append(TerrainProfiles(depth, bearing[:, -1], distance, self._launches, self._wavelength))

        def sample(heightmap: HeightmapTiles, missing: NDArray[np.bool_]) -> bool:
            plane = self._terrain.depth
            complete = [
                kernel.sample_profiles(lines, plane, heightmap, missing, done, depth) for lines, done, depth in sampled
            ]
            return all(complete)

        self._terrain.read_heightmap(np.concatenate(ends), sample)
        return profiles


class AzimuthZones(NamedTuple):
    """Zones of distance, z of them, with slices of azimuth; lines to points in a zone end at its outer edge."""

    edges: Floats
    """Outer edges [m], shape (z,)."""
    counts: Integers
    """Number of slices in each zone, shape (z,)."""
    starts: Integers
    """Index of the first slice of each zone, and the number of slices, shape (z + 1,)."""
    firsts: Integers
    """Index of the first sample of a line in each zone, and the number of samples, shape (z + 1,)."""
    runs: tuple[int, ...]
    """Number of runs of `SAMPLES_PER_RUN` samples up to the outer edge of each zone, z of them."""
    distance: Floats
    """Horizontal distances of the samples [m], shape (samples,)."""


@lru_cache(maxsize=16)
def azimuth_zones(across: float, farthest: float, min_profile_width: float, step: float) -> AzimuthZones:
    """Zones about one end of the sonar.

    Args:
        across: Width below which slices are not divided [m].
        farthest: Distance that the last zone reaches to [m].
        min_profile_width: Least width of a slice [rad].
        step: Distance of the samples along a line [m].
    """
    innermost = FIRST_ZONE * across / (2 * np.pi)
    zones = max(0, int(np.ceil(np.log2(max(farthest, innermost) / innermost))))
    edges = innermost * 2.0 ** np.arange(zones + 1)
    edges[-1] = min(edges[-1], max(farthest, innermost))
    widest = 2 ** max(0, int(np.ceil(np.log2(2 * np.pi / min_profile_width / FIRST_ZONE))))
    counts = FIRST_ZONE * np.minimum(2 ** np.arange(zones + 1), widest)
    is_last = np.append(counts[1:] != counts[:-1], True)  # consecutive zones with the same slices are one
    edges, counts = edges[is_last], counts[is_last]
    firsts = np.concatenate([[0], np.ceil(edges / step).astype(np.int64) + 1])
    runs = np.cumsum(-(-np.diff(firsts) // kernel.SAMPLES_PER_RUN))
    distance = ((np.arange(firsts[-1]) + 1) * step).astype(np.float32)
    starts = np.concatenate([[0], np.cumsum(counts)])
    return AzimuthZones(edges, counts, starts, firsts, tuple(runs.tolist()), distance)
