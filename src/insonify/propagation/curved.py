"""Legs in layered water: every ray of every family, bent, turned, and limited where rays cross.

Rays come from the exact solver, or from its tables where the engine asks for millions. What is made of them is the
same: directions from the horizontal slowness, which a ray keeps all the way; grazing angles at both boundaries from
it too; absorption over the length of the path, by the water's one coefficient at all depths.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._curved_kernel import DEPTH, RANGE, bearings, curved_row, cut_row
from insonify.propagation._eigenray_kernel import (
    AMPLITUDE,
    COLUMNS,
    FOLD,
    FOLD_BEND,
    FOLD_SHARE,
)
from insonify.propagation._table_nodes import LOWEST_FREQUENCY
from insonify.propagation.beside import beside
from insonify.propagation.caustic import fold_factor
from insonify.propagation.curved_launches import CurvedLaunches
from insonify.propagation.curved_reach import Sweep, cones, heard, sweep
from insonify.propagation.curved_solids import shade_bent_row, solid_bounds
from insonify.propagation.families import bounces, families_for, image_depth
from insonify.propagation.found import Found, Tables, exact_rays
from insonify.propagation.layers import Column, column
from insonify.propagation.rays import Cones, Domain, Reach
from insonify.records.legs import Legs, Status
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class CurvedRays:
    """Rays in water whose sound speed changes with depth."""

    scene: Scene
    domain: Domain
    column: Column
    sweeps: dict[tuple[str, float, float], Sweep] = field(default_factory=dict, repr=False)
    launched: dict[float, CurvedLaunches] = field(default_factory=dict, repr=False)
    tables: Tables = field(init=False, repr=False)
    bodies: Floats = field(init=False, repr=False)
    """Occluding boxes, shape (boxes, 8), see `insonify.scene.box.box_body`."""
    solids: Floats = field(init=False, repr=False)
    """Bounds of all other occluding bodies, see `solid_bounds`."""

    def __post_init__(self) -> None:
        """Begin without any table: each is made when it is first asked for."""
        object.__setattr__(self, "bodies", self.scene.bodies)
        object.__setattr__(self, "solids", solid_bounds(self.scene))
        ground = self.scene.seabed.bed
        span = (self.column.mirror_depth,) * 2 if ground is None else (max(ground.span[0], 0.0), ground.span[1])
        bodies = len(self.bodies) + len(self.solids) > 0
        object.__setattr__(self, "tables", Tables(self.column, self.domain, bodies, span))

    def legs(self, place: Floats, scatterers: Scatterers, families: tuple[str, ...], frequency: float) -> Legs:
        """Legs of every ray; see `Rays.legs`."""
        kept = families_for(scatterers.boundary, families)
        shared = np.empty((5, len(scatterers)))
        bearings(self.column.depth, self.column.speed, place, scatterers.position, shared)
        depth, ranges = shared[DEPTH], shared[RANGE]
        if frequency >= LOWEST_FREQUENCY:
            found = [self.tables.rays(f, scatterers.boundary, float(place[2]), depth, ranges) for f in kept]
        else:  # folds reach further than tables know of
            found = [exact_rays(self.column, f, float(place[2]), depth, ranges) for f in kept]
        return self._assemble(place, scatterers, shared, found, frequency)

    def around(self, legs: Legs, place: Floats, scatterers: Scatterers, reach: tuple[float, float]) -> Legs:
        """The legs with what rays from four places beside that end say; see `Rays.around`."""
        points = scatterers.position

        def ask(family: str, depth: float, ranges: Floats) -> Found:
            if not self.tables.quick(family, scatterers.boundary, depth):
                n = len(ranges)
                return Found(family, np.zeros((n, 1, COLUMNS)), np.zeros(n, np.int64), np.zeros(n, np.uint8))
            return self.tables.rays(family, scatterers.boundary, depth, points[:, 2], ranges)

        return replace(legs, beside=beside(legs, place, points, self.scene.water, reach, self.column.water_depth, ask))

    def reach(
        self, depths: tuple[float, float], boundary_depth: float, families: tuple[str, ...],
        delays: tuple[float, float], apart: float, *, rise: float = 0.0,
    ) -> Reach:  # fmt: skip
        """Distances heard, from rays to all distances; see `Rays.reach`."""
        levels = self._levels(boundary_depth, rise)
        ends = dict.fromkeys(depths)
        sweeps = [self._sweep(name, depth, level) for name in families for depth in ends for level in levels]
        nearest, farthest = heard(sweeps, delays, apart / self.scene.water.slowest)
        # The ground is sampled as under straight rays: the same places, whatever the water.
        images = [image_depth(name, sum(depths) / 2, self.column.mirror_depth) for name in families]
        return Reach(min(abs(boundary_depth - image) for image in images), nearest, farthest)

    def cones(
        self, family: str, place: Floats, centre: Floats, radius: Floats, boundary_depth: float, *, rise: float = 0.0
    ) -> Cones:
        """Cones about all rays between the nearest and the farthest of each neighbourhood; see `Rays.cones`."""
        levels = self._levels(boundary_depth, rise)
        sweeps = [self._sweep(family, float(place[2]), level) for level in levels]
        return cones(sweeps, centre - place[:2], radius)

    def launches(self, source_depth: float) -> CurvedLaunches:
        """Bent ones, kept for the pings that share the sonar's depth; see `Rays.launches`."""
        found = self.launched.get(source_depth)
        if found is None:  # threads may both make it, and get the same
            if len(self.launched) > MOST_LAUNCHED:
                self.launched.clear()
            highest = min(self.tables.ground[0], *self.domain.point_depths)
            farthest = max(self.domain.farthest, 1.0)
            found = CurvedLaunches(self.column, source_depth, farthest, (highest, self.tables.ground[1]))
            self.launched[source_depth] = found
        return found

    def _levels(self, boundary_depth: float, rise: float) -> list[float]:
        """Depths between which a boundary lies, all in the water of the profile [m]."""
        if rise == 0:
            return [boundary_depth]
        bottom = self.column.water_depth
        return sorted({min(max(boundary_depth + side * rise, 0.0), bottom) for side in (-1, -0.5, 0, 0.5, 1)})

    def _sweep(self, family: str, depth: float, boundary_depth: float) -> Sweep:
        """The family's rays to all distances on a boundary, kept for the pings that share the sonar's depth."""
        key = (family, depth, boundary_depth)
        if key not in self.sweeps:
            if len(self.sweeps) > MOST_SWEEPS:
                self.sweeps.clear()
            farthest = max(self.domain.farthest, 1.0)
            self.sweeps[key] = sweep(self.column, family, depth, boundary_depth, farthest)
        return self.sweeps[key]

    def _assemble(
        self, place: Floats, scatterers: Scatterers, shared: Floats, found: list[Found], frequency: float
    ) -> Legs:
        """Rows of legs from rays."""
        rows = [(one, branch) for one in found for branch in range(one.branches)]
        shape = len(rows), len(scatterers)
        delay, length, spreading, slowness, grazing = np.empty((5, *shape))
        departure, arrival = np.empty((2, *shape, 3))
        caustics, status = np.empty((2, *shape), np.uint8)
        occluder = np.full(shape, -1, np.int16)
        water, speed = self.column, float(np.interp(place[2], self.column.depth, self.column.speed))
        for row, (one, branch) in enumerate(rows):
            curved_row(
                shared, scatterers.normal, place[2], speed, branch, one.rays, one.count, one.missing, delay[row],
                length[row], spreading[row], caustics[row], slowness[row], departure[row], arrival[row], grazing[row],
                status[row],
            )  # fmt: skip
            if len(self.bodies):
                string = bounces(one.family)
                cut_row(
                    water.depth, water.speed, water.plane, place, scatterers.position, shared, len(string),
                    string.startswith("S"), slowness[row], departure[row], self.bodies, scatterers.occluder,
                    status[row], occluder[row],
                )  # fmt: skip
            if len(self.solids):
                shade_bent_row(
                    self.scene, water, self.solids, place, scatterers, shared, one.family, slowness[row],
                    departure[row], status[row], occluder[row],
                )  # fmt: skip
        caustic = _at_caustics(rows, caustics, spreading, frequency)
        families = tuple(one.family for one, _ in rows)
        return Legs(
            families=families,
            branch=tuple(branch for _, branch in rows),
            delay=delay,
            length=length,
            spreading=spreading,
            absorption=10 ** (-self.scene.water.absorption(frequency) * length / 20),
            boundary=self._boundary(families, slowness),
            caustics=caustics,
            visibility=(status == Status.CLEAR).astype(float),
            departure=departure,
            arrival=arrival,
            grazing=grazing,
            status=status,
            occluder=occluder,
            caustic=caustic,
        )

    def _boundary(self, families: tuple[str, ...], slowness: Floats) -> NDArray[np.complex128]:
        """Product of the mirrors' coefficients of each row, at the grazing angle that its slowness has there."""
        product = np.ones(slowness.shape, complex)
        top = self.column.speed[0]
        bottom = float(np.interp(self.column.mirror_depth, self.column.depth, self.column.speed))
        for row, family in enumerate(families):
            string = bounces(family)
            if "S" in string:
                product[row] *= self.scene.surface.mirror(_grazing(slowness[row], top)) ** string.count("S")
            if "B" in string:
                product[row] *= self.scene.seabed.mirror(_grazing(slowness[row], bottom)) ** string.count("B")
        return product


MOST_LAUNCHED = 8
"""Depths of the sonar whose launches are kept."""
MOST_SWEEPS = 256
"""Sweeps that are kept: a platform that heaves makes new ones with every ping."""


def curved_rays(scene: Scene, domain: Domain) -> CurvedRays:
    """The rays of a layered ocean.

    Args:
        scene: Water with a profile, boundaries and occluders.
        domain: What a survey needs of them.

    Raises:
        ValueError: The profile does not reach from the surface to the seabed.
    """
    depth, bed = scene.seabed.depth, scene.seabed.bed
    profile = scene.water.profile_to(depth)
    deepest = depth if bed is None else max(depth, bed.span[1])
    # below what was measured the water is as it was there, as for all else that asks for its speed
    return CurvedRays(scene, domain, column(profile.extended(deepest), deepest, plane=depth))


def _grazing(slowness: Floats, speed: float) -> Floats:
    """Grazing angle of rays at a boundary [rad]; at low angles 1 - (p c)^2 would have no digits left."""
    cosine = slowness * speed
    return np.arcsin(np.sqrt(np.clip((1 - cosine) * (1 + cosine), 0.0, 1.0)))


def _at_caustics(
    rows: list[tuple[Found, int]], caustics: NDArray[np.uint8], spreading: Floats, frequency: float
) -> NDArray[np.complex128] | None:
    """Limit the spreading of rays that end near a fold; the phase of all rows, or None where there is none."""
    phase = _QUARTER_TURNS[caustics % 4] if caustics.any() else None
    for row, (one, branch) in enumerate(rows):
        if branch >= one.rays.shape[1] or not one.folds:
            continue
        near = np.flatnonzero((one.count > branch) & (one.rays[:, branch, FOLD_SHARE] != 0))
        if near.size:
            phase = np.ones(spreading.shape, complex) if phase is None else phase
            ray = one.rays[near, branch]
            factor = fold_factor(np.abs(ray[:, FOLD]), ray[:, FOLD_BEND], ray[:, FOLD_SHARE], frequency)
            loud = np.where(np.isfinite(ray[:, AMPLITUDE]), ray[:, AMPLITUDE], 0.0) * factor
            spreading[row, near] = np.abs(loud)
            phase[row, near] *= np.exp(1j * np.angle(factor))
    return phase


_QUARTER_TURNS = np.array([1, 1j, -1, -1j])
