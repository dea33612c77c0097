"""Spread of glint legs about the leg reflected by a calm surface: change of departure angles by a moving surface.

A facet of slope s reflects to the same position at another bounce point, so that its leg leaves the sonar at another
elevation and bearing. Scatterers far off a beam by their geometric direction are then received through its main lobe,
each of them seldom. Sampling follows the fourth moment of the gain over the distribution of slopes: the square root of
an echo's fourth moment is the allocation of least variance for intermittent echoes.

Approximations: slopes are those of the whole sea, a mixture of two normal distributions; spreads in elevation and in
bearing are uncorrelated; refraction and bubbles do not change the spread.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines import _glint_spread_kernel as kernel
from insonify.propagation.bed_roughness import BedRoughness, bed_roughness
from insonify.propagation.displaced_bounce import STEEPEST, displace_bounces, unfold_paths
from insonify.propagation.families import bounce_sequence
from insonify.propagation.propagation_model import DepartureCones
from insonify.propagation.wind_waves import shortest_wavenumber, wind_waves
from insonify.scene.scene import Scene
from insonify.sonar.beam import Beams

Floats = NDArray[np.float64]

MAX_DEVIATIONS = 1.5
"""Offset of a departure within which scatterers are included [standard deviations]; outside is 0.01 dB of energy."""
MIN_GLINT_FRACTION = 1e-6
"""Least fraction of a leg's energy in glints from which the spread of their slopes is computed [1]."""
_NODES = np.geomspace(0.01, 1e5, 141)
"""Horizontal distances at which spreads are computed for bounds [m]."""


class LegSpread(NamedTuple):
    """Amplitudes and directions of the coherent leg and the glints of one family at n distances."""

    coherent: Floats
    """Pressure of the coherent leg re that reflected by a calm surface [1], shape (n,)."""
    glints: Floats
    """Rms pressure of all glints together re the leg reflected by a calm surface [1], shape (n,)."""
    elevation_change: Floats
    """Change of a glint's elevation at the sonar per slope of the boundary along the path [rad], shape (n,).

    Over a rough seabed, times the rms slope of the glints.
    """
    bearing_change: Floats
    """Change of a glint's bearing at the sonar per slope of the boundary across the path [rad], (n,), as above."""


class RoughBoundary(NamedTuple):
    """Statistics of one rough boundary."""

    phase_per_height: float
    """Phase of a bounce at normal incidence per height of the boundary, 2 k [rad/m]."""
    variance: float
    """Variance of the height [m^2]."""
    slope: float
    """Rms slope of the boundary along one axis [1]."""
    roughness: BedRoughness | None = None
    """Roughness of the seabed; None: the boundary is the surface."""


@dataclass(frozen=True, slots=True)
class GlintSpread:
    """Slope statistics of the rough boundaries of a scene for sound of one frequency."""

    surface: RoughBoundary | None
    """The moving surface; None: it is flat."""
    bed: RoughBoundary | None
    """The rough seabed; None: it is smooth."""
    slopes: tuple[float, float, float]
    """Variance of the slope northwards, covariance with that eastwards, and variance of the latter [1].

    Over a rough seabed those of slopes of 1, the same in all directions, of which each leg has its own multiple.
    """
    water_depth: float
    """Depth of the reflecting bottom [m]."""

    def boundary(self, letter: str) -> RoughBoundary | None:
        """The rough boundary of a letter of a family, "S" or "B"; None for a smooth one."""
        return self.surface if letter == "S" else self.bed

    def spreads(self, family: str) -> bool:
        """Return True for a family with a reflection at a rough boundary."""
        return any(self.boundary(letter) is not None for letter in bounce_sequence(family))

    def legs(self, family: str, source_depth: float, distance: Floats, depth: float) -> LegSpread | None:
        """Spread of the legs of one family; None without a reflection at a rough boundary.

        Args:
            family: Name of the family.
            source_depth: Depth of this end of the sonar [m].
            distance: Horizontal distance of the far ends of the legs [m], shape (n,).
            depth: Depth of the far ends [m].
        """
        if not self.spreads(family):
            return None
        return _legs(self, family, source_depth, np.ascontiguousarray(distance, float).tobytes(), depth)

    def bound(
        self, beams: Beams, family: str, position: Floats, centre: Floats, cones: DepartureCones, depth: float
    ) -> Floats:
        """Upper bound of the gain of all beams for the glints of one family from neighbourhoods on a boundary [1].

        Args:
            beams: Beams of this end of the sonar.
            family: Name of a family with a rough bounce.
            position: North, east, depth of this end [m], shape (3,).
            centre: North and east of the neighbourhoods [m], shape (n, 2).
            cones: Departure cones of the legs for a calm surface, n of them.
            depth: Depth of the boundary [m].

        Returns:
            Largest magnitude of the pressure gain within `MAX_DEVIATIONS` of the departures, times the rms pressure of
            the glints, shape (n,).
        """
        legs = self.legs(family, float(position[2]), _NODES, depth)
        assert legs is not None
        away = centre - position[:2]
        distance = np.linalg.norm(away, axis=1)
        amplitude, tilt, turn = (
            np.interp(distance, _NODES, column) for column in (legs.glints, legs.elevation_change, legs.bearing_change)
        )
        horizontal = np.where(distance[:, None] > 1e-6, away / np.maximum(distance, 1e-6)[:, None], [1.0, 0.0])
        gain_bound = np.empty(len(centre))
        spread = kernel.GlintStatistics(tilt, turn, np.array(self.slopes), MAX_DEVIATIONS)
        kernel.glint_bounds(cones.axis, cones.half_angle, horizontal, spread, beams.kernel_majorants, gain_bound)
        return np.asarray(gain_bound * amplitude)


def glint_spread(scene: Scene, frequency: float) -> GlintSpread | None:
    """Spread of glint legs in one scene; None for one whose boundaries are smooth and still.

    Args:
        scene: The scene.
        frequency: Frequency of the sound [Hz].
    """
    surface, speed = scene.surface, float(scene.water.sound_speed_at(0.0))
    roughness = bed_roughness(scene.seabed, frequency, float(scene.water.sound_speed_at(scene.seabed.depth)))
    if surface.reflection == "flat" and roughness is None:
        return None
    variance = along = across = 0.0
    if surface.wind_speed is not None:
        waves = wind_waves(surface.wind_speed, shortest_wavenumber(frequency, speed))
        variance, (along, across) = float(waves.variance[-1]), waves.slope_moments[:2, -1]
    if surface.swell is not None:
        amplitude = surface.swell.height / 2
        variance += amplitude**2 / 2
        along += (2 * math.pi / surface.swell.length * amplitude) ** 2 / 2
    c, s = math.cos(surface.wave_direction), math.sin(surface.wave_direction)
    slopes = c * c * along + s * s * across, c * s * (along - across), s * s * along + c * c * across
    sea = None
    if surface.reflection != "flat":
        sea = RoughBoundary(4 * math.pi * frequency / speed, variance, math.sqrt((slopes[0] + slopes[2]) / 2))
    if roughness is None:
        return GlintSpread(sea, None, slopes, scene.seabed.depth)
    bed_speed, waves = float(scene.water.sound_speed_at(scene.seabed.depth)), roughness.waves
    bed = RoughBoundary(
        4 * math.pi * frequency / bed_speed, float(waves.variance[-1]), roughness.slope, roughness,
    )  # fmt: skip
    return GlintSpread(sea, bed, (1.0, 0.0, 1.0), scene.seabed.depth)


@lru_cache(maxsize=64)
def _legs(sea: GlintSpread, family: str, source_depth: float, distances: bytes, depth: float) -> LegSpread:
    """`GlintSpread.legs` of a family with a rough bounce, at distances given by their bytes."""
    distance = np.frombuffer(distances)
    points = np.column_stack([distance, 0 * distance, np.full(len(distance), depth)])
    rough = "S" * (sea.surface is not None) + "B" * (sea.bed is not None)
    lines = unfold_paths(family, np.array([0.0, 0.0, source_depth]), points, sea.water_depth, rough)
    bounces = [boundary for letter in bounce_sequence(family) if (boundary := sea.boundary(letter)) is not None]
    sine = lines.vertical_travel / lines.length * np.ones(len(distance))
    height: dict[RoughBoundary, Floats | float] = {}
    slopes_of: dict[RoughBoundary, Floats | float] = {}
    for boundary in set(bounces):
        height[boundary], slopes_of[boundary] = boundary.variance, boundary.slope
        if boundary.roughness is not None:
            longer = boundary.roughness.longer_waves(family, source_depth, lines.length * np.ones(len(distance)), sine)
            height[boundary] = np.maximum(boundary.variance - longer[0], 0.0)
            slope = np.sqrt(np.maximum(boundary.slope**2 - longer[1], 0.0))
            steepest = boundary.roughness.max_wavenumber / np.maximum(boundary.phase_per_height * sine, 1e-12)
            slopes_of[boundary] = _truncated(slope, steepest)
    quanta = [
        (boundary.phase_per_height * lines.vertical_travel / lines.length) ** 2 * height[boundary]
        for boundary in bounces
    ]
    is_one_boundary = len(set(bounces)) == 1
    total = len(quanta) * quanta[0] if is_one_boundary else sum(quanta)
    glint_fraction = -np.expm1(-total)  # of the energy
    # slopes are those of a boundary in the mean over all bounces, and the coherent ones have none
    steepest = np.max([np.max(boundary) for boundary in slopes_of.values()])
    incoherent = np.maximum(-np.expm1(-(quanta[0] if is_one_boundary else total)), MIN_GLINT_FRACTION)
    slope_factor = np.minimum(1 / np.sqrt(incoherent), STEEPEST / np.maximum(steepest, 1e-12))
    tilt, turn = np.zeros(len(distance)), np.zeros(len(distance))
    for row, boundary in enumerate(bounces):
        slope = np.clip(slopes_of[boundary] * slope_factor, 1e-6, STEEPEST)
        scale = 1.0 if sea.bed is None else slopes_of[boundary] ** 2
        for axis, sense in ((0, 1.0), (0, -1.0), (1, 1.0)):
            slopes = np.zeros((len(bounces), 2, len(distance)))
            slopes[row, axis] = sense * slope
            turned = displace_bounces(lines, slopes).departure_change
            if axis == 0:
                tilt += scale * (np.sum(turned**2, axis=1) / slope**2 / 2)
            else:
                turn += scale * (np.sum(turned[:, 1:2] ** 2, axis=1) / slope**2)
    return LegSpread(
        np.exp(-total / 2), np.sqrt(glint_fraction), np.sqrt(tilt) * slope_factor, np.sqrt(turn) * slope_factor
    )


def _truncated(slope: Floats, steepest: Floats) -> Floats:
    """Rms slope along one axis of Gaussian slopes, without those steeper than a limit in any direction [1]."""
    part = np.maximum(steepest**2 / (2 * np.maximum(slope, 1e-12) ** 2), 1e-6)
    return np.asarray(slope * np.sqrt(np.maximum(1 - part / np.expm1(np.minimum(part, 700.0)), 0.0)))


@lru_cache(maxsize=32)
def _table(majorant: bytes, per_unit: float) -> Floats:
    """`spread_gain_tables` of one pattern, given by its bytes."""
    bound = np.frombuffer(majorant)
    if not len(bound):
        return np.empty((0, 0))
    # the largest of every few rows, on both sides of the axis; beyond the table its last value
    step = kernel.ROWS_PER_SPREAD_ROW
    rows = int(np.ceil(len(bound) / step)) + 1
    half = np.pad(bound, (0, rows * step - len(bound)), mode="edge")[::step] ** 4
    spread = kernel.MIN_SPREAD_ROWS * 2.0 ** np.arange(
        max(2, math.ceil(math.log2(kernel.MAX_SPREAD * per_unit / kernel.MIN_SPREAD_ROWS)) + 1)
    )
    padding = int(np.ceil(4 * kernel.MIXTURE_DEVIATIONS[-1] * spread[-1] / step))
    line = np.concatenate([np.pad(half[:0:-1], (padding, 0), mode="edge"), np.pad(half, (0, padding), mode="edge")])
    size = 2 ** math.ceil(math.log2(2 * len(line)))
    turned, wave = np.fft.rfft(line, size), 2 * np.pi * np.fft.rfftfreq(size) / step
    table = np.empty((len(spread), rows))
    middle = padding + len(half) - 1
    for row, width in enumerate(spread):
        window = sum(np.exp(-0.5 * (part * width * wave) ** 2) for part in kernel.MIXTURE_DEVIATIONS) / len(
            kernel.MIXTURE_DEVIATIONS
        )
        table[row] = np.fft.irfft(turned * window, size)[middle : middle + rows]
    return np.maximum(table, half[-1] * 1e-6) ** 0.25


def spread_gain_tables(beams: Beams) -> tuple[Floats, Floats, Floats, Floats]:
    """Fourth root of the mean fourth power of each pattern of some beams, over spreads of directions, as tables.

    Returns:
        Of the four patterns of `Beams.majorants`, shape (spreads, rows): spreads double from
        `_glint_spread_kernel.MIN_SPREAD_ROWS` rows of the majorant's table, of which each row here represents
        `ROWS_PER_SPREAD_ROW`.
    """
    a, b, c, d = (
        _table(bound.tobytes(), float(per)) for bound, per in zip(beams.majorants, beams.per_unit, strict=True)
    )
    return a, b, c, d
