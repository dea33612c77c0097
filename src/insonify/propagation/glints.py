"""Glints: legs reflected by a rough boundary, the moving surface or the seabed.

Waves leave a coherent part of a leg, exp(-2 Gamma^2) of the flat boundary's pressure for every bounce with
Gamma = k sigma sin(grazing), and turn the rest into glints: legs by other bounce points, where the boundary has
the required slope, each with a phase that varies at its own frequency. Powers of both add up to that of the flat
boundary, less what bubbles absorb and the seabed's law scatters. A glint is a sum of waves, see `glint_kernel`: its
slope, frequency shift and phase come from the same waves, so that delays, angles, and coherence over position and time
are consistent.

A glint of the surface has one frequency, whereas the sea has a band: after its lifetime another glint replaces it;
otherwise a synthetic aperture would focus each to a sharp point. The glints of each scatterer change at times of their
own.

The seabed's roughness is constant: another glint replaces one of its own after the bounce point has moved over a
distance, not after a time. Where a family is reflected by both boundaries, a glint has all its bounces, of which at
least one is incoherent.

Scatterers with random phases take two glints each, because many share a resolution cell. Others take several. No echo
uses one glint for both legs, which is rare among the many that each stands for; see
`surface_reflection.repeated_glint_weight`.
"""

import math
from collections import Counter
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify import random_keys
from insonify.propagation._displaced_bounce_kernel import SurfaceBounces
from insonify.propagation.bed_roughness import BedRoughness, bed_roughness
from insonify.propagation.displaced_bounce import UnfoldedPaths, vertical_travel_to_bounces
from insonify.propagation.families import bottom_bounces, bounce_sequence, first_boundary, image_depth, surface_bounces
from insonify.propagation.glint_kernel import (
    STAGGER,
    CalmPaths,
    GlintLegs,
    GlintPoints,
    GlintSource,
    apply_glints_to_row,
)
from insonify.propagation.wind_waves import WindWaves, shortest_wavenumber, wind_waves
from insonify.records.legs import GlintPhasors, Legs, LegStatus
from insonify.scattering.bubbles import bubble_loss_db
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene

Floats = NDArray[np.float64]

RANDOM_PHASE_GLINTS, FIXED_PHASE_GLINTS = 2, 6
"""Glints of each ray to a scatterer with a random phase; glints to one without, shared by the rays of a family."""
GLINT_BITS = 4
"""Bits of a glint's identifier that number it among those of its ray."""
HULL_FAMILY_OFFSET = 32
"""Family number, in a glint's identifier, at which families below a hull begin: above those of twelve bounces."""
LIFETIME_FACTOR, REFERENCE_SINE = 32.0, 0.2
"""Lifetime of a glint over the time in which its phase changes by 1 rad rms at this sine of the grazing angle [1]."""
CELL_FACTOR = 16.0
"""Side of a seabed glint's cell over the distance in which its phase changes by 1 rad rms at the same angle [1]."""
EXPLICIT_LIFETIME_FACTOR = 2.0
"""Lifetime of glints of the short waves on explicit ones re that of others: long waves decorrelate a leg first [1]."""
MIN_COHERENT_FACTOR = 1e-3
"""Largest coherent pressure ratio of the legs of a row at which the row is left out [1]."""
GRADIENT_COUNTER = STAGGER + 1
"""Fourth counter of the random numbers for a glint's phase gradient over the surface."""
LEG_COLUMNS = (
    "delay", "length", "spreading", "absorption", "reflection_coefficient", "caustics", "visibility", "departure",
    "arrival", "grazing_sine", "status", "occluder",
)  # fmt: skip
"""Columns of legs that every row has."""


class SonarEnd(NamedTuple):
    """One end of the sonar, at transmission or reception.

    Example:
        >>> receiver = SonarEnd(np.array([0.0, 5.0, 10.0]), ping_time=2.0, transmitter=np.array([0.0, -5.0, 10.0]))
        >>> receiver.transmit_position.tolist(), SonarEnd(receiver.position, 2.0).transmit_position.tolist()
        ([0.0, -5.0, 10.0], [0.0, 5.0, 10.0])
    """

    position: Floats
    """Position: north, east, depth [m], shape (3,)."""
    ping_time: float
    """Start of the ping [s]."""
    transmitter: Floats | None = None
    """Position of the transmitter of the received sound [m], shape (3,); None: the same position."""

    @property
    def transmit_position(self) -> Floats:
        """Position of the transmitter of the received sound [m], shape (3,)."""
        return self.position if self.transmitter is None else self.transmitter


class CoherentReflection(NamedTuple):
    """Coherent reflection of n legs of one family: columns of shape (n,); 0 for a boundary that is smooth or absent."""

    phase_per_height: Floats
    """Phase per height of one surface bounce, 2 k sin(grazing) [rad/m]."""
    bed_phase_per_height: Floats
    """Phase per height of one bottom bounce [rad/m]."""
    long_variance: Floats
    """Variance of the seabed's waves that are longer than the Fresnel zone [m^2]."""
    mean_quanta: Floats
    """Mean number of quanta of all bounces together, 4 Gamma^2 for each [1]."""
    transmission: Floats
    """Pressure ratio by bubbles and by what the seabed's law scatters, of all bounces together; 1 without loss [1]."""
    bed_quanta: Floats
    """Mean number of quanta of one bottom bounce [1]."""

    @property
    def coherent_factor(self) -> Floats:
        """Coherent part of the pressure, exp(-2 Gamma^2) for each bounce, without other losses [1]."""
        return np.asarray(np.exp(-self.mean_quanta / 2))


class GlintBouncePoints(NamedTuple):
    """Bounce points of legs on explicit waves; those of one family to one scatterer share their glints."""

    position: Floats
    """North and east re the origin of the waves [m], shape (f, n, 2); undefined for legs that do not exist."""
    decorrelation_distance: float
    """Distance at which the short waves at two bounce points are uncorrelated [m]."""


@dataclass(frozen=True, slots=True)
class GlintSurface:
    """Rough boundaries of one scene, the surface or the seabed or both, for sound of one frequency."""

    scene: Scene
    seed: int
    frequency: float
    """Frequency of the sound [Hz]."""
    waves: WindWaves | None
    """Wind waves of the surface that make glints; None: it makes none."""
    bed: BedRoughness | None = None
    """Roughness of the seabed; None: it is smooth."""
    grazing_sines: Floats | None = None
    """Sine of the grazing angle at the surface of every leg [1], (f, n); None: that of a flat surface."""
    bounce_points: GlintBouncePoints | None = None
    """Bounce points on explicit waves; None: those of a calm surface, each ray with its own glints."""
    under_hull: bool = False
    """True: the hull takes the surface's part; families have other glints than those of the same name by the sea."""

    @property
    def axes(self) -> Floats:
        """Unit vectors (north, east) along the waves' direction, and to the right of it, shape (2, 2)."""
        c, s = math.cos(self.scene.surface.wave_direction), math.sin(self.scene.surface.wave_direction)
        return np.array([[c, s], [-s, c]])

    @property
    def bed_axes(self) -> Floats:
        """Unit vectors (north, east) along both axes of the seabed's cells, shape (2, 2)."""
        _, _, c, s = self.scene.seabed.scatterer_grid.frame
        return np.array([[c, s], [-s, c]])

    @property
    def glint_lifetime(self) -> float:
        """Lifetime of a surface glint [s], long compared with the coherence time of its phase; inf without waves."""
        if self.waves is None:
            return math.inf
        per_height = 4 * math.pi * self.frequency / float(self.scene.water.sound_speed_at(0.0)) * REFERENCE_SINE
        factor = LIFETIME_FACTOR if self.bounce_points is None else EXPLICIT_LIFETIME_FACTOR * LIFETIME_FACTOR
        return factor / max(per_height * math.sqrt(self.waves.slope_moments[2, -1]), 1e-9)

    @property
    def rough_boundaries(self) -> str:
        """Letters of the boundaries that are rough."""
        return "S" * (self.waves is not None) + "B" * (self.bed is not None)

    @property
    def cell_size(self) -> float:
        """Side of the cells of the seabed within which a bounce point keeps its glint [m]; infinite if it is smooth."""
        if self.bed is None:
            return math.inf
        speed = float(self.scene.water.sound_speed_at(self.scene.seabed.depth))
        return CELL_FACTOR / max(4 * math.pi * self.frequency / speed * REFERENCE_SINE * self.bed.slope, 1e-9)

    def legs(self, legs: Legs, scatterers: Scatterers, sonar_end: SonarEnd) -> tuple[Legs, Legs]:
        """Legs by rough boundaries: rows of the coherent part, followed by rows of glints.

        Transmit and receive legs are reflected by the same glints, those of the surface at different times.

        Args:
            legs: Legs reflected by flat boundaries, f families to n points.
            scatterers: Ends of the legs.
            sonar_end: End of the sonar at which the legs begin.

        Returns:
            Transmit legs and receive legs.
        """
        rough = self.rough_boundaries
        rough_rows = [row for row, family in enumerate(legs.families) if set(rough) & set(bounce_sequence(family))]
        if not rough_rows:
            return legs, legs
        reflection = {row: self.coherent_reflection(legs, row, sonar_end) for row in rough_rows}
        coherent_rows = [
            row
            for row in range(len(legs.families))
            if row not in reflection or reflection[row].coherent_factor.max(initial=0.0) > MIN_COHERENT_FACTOR
        ]
        glint_count = RANDOM_PHASE_GLINTS
        if not scatterers.has_random_phase:
            glint_count = max(RANDOM_PHASE_GLINTS, FIXED_PHASE_GLINTS // (1 + max(legs.branch)))
        glints = [(row, number) for row in rough_rows for number in range(glint_count)]
        result = leg_rows(legs, coherent_rows + [row for row, _ in glints])
        n = len(scatterers)
        phasor = np.ones((2, len(result.families), n), complex)
        quanta = None if self.bed is None else np.zeros((2, len(result.families), n))
        for to, row in enumerate(coherent_rows):
            if row in reflection:
                result.reflection_coefficient[to] *= reflection[row].coherent_factor * reflection[row].transmission
        for to, (row, number) in enumerate(glints, len(coherent_rows)):
            energy = -np.expm1(-reflection[row].mean_quanta) / glint_count  # of one glint, re the reflected one
            result.reflection_coefficient[to] *= np.sqrt(energy) * reflection[row].transmission
            if quanta is not None:
                quanta[:, to] = reflection[row].bed_quanta, reflection[row].mean_quanta
            code = self._code(legs, row, number)
            self._apply_glints(result, to, code, reflection[row], scatterers, sonar_end, phasor)
            if self.bounce_points is not None:
                phasor[:, to] *= self._surface_phasor(self.bounce_points, row, scatterers.scatterer_id, code)
        bounce_id = (*(-1,) * len(coherent_rows), *(self._code(legs, row, number) for row, number in glints))
        result = replace(result, branch=_numbered(legs, coherent_rows, glints))
        transmit, receive = (replace(result, glints=GlintPhasors(bounce_id, phasors, quanta)) for phasors in phasor)
        return transmit, receive

    def coherent_reflection(self, legs: Legs, row: int, sonar_end: SonarEnd) -> CoherentReflection:
        """Coherent reflection of one row of legs.

        Args:
            legs: Legs reflected by flat boundaries.
            row: A row with a bounce on a rough boundary.
            sonar_end: End of the sonar at which the legs begin.
        """
        sequence, count = bounce_sequence(legs.families[row]), legs.delay.shape[1]
        zeros = np.zeros(count)
        phase, quanta, transmission = zeros, zeros, np.ones(count)
        if self.waves is not None and surface_bounces(sequence):
            sine = (
                calm_grazing_sine(legs, row, self.scene, float(sonar_end.position[2]))
                if self.grazing_sines is None
                else self.grazing_sines[row]
            )
            surface_speed, bounces = float(self.scene.water.sound_speed_at(0.0)), surface_bounces(sequence)
            phase = 4 * math.pi * self.frequency / surface_speed * sine
            wind = self.scene.surface.wind_speed
            assert wind is not None  # guaranteed by the surface
            bubbles_db = bubble_loss_db(wind, self.frequency, np.arcsin(np.minimum(sine, 1.0)))
            quanta, transmission = bounces * phase**2 * self.waves.variance[-1], 10 ** (-bounces * bubbles_db / 20)
        if self.bed is None or not bottom_bounces(sequence):
            return CoherentReflection(phase, zeros, zeros, quanta, transmission, zeros)
        depth, bounces = self.scene.seabed.depth, bottom_bounces(sequence)
        sine = calm_grazing_sine(legs, row, self.scene, float(sonar_end.position[2]), depth)
        bed_phase = 4 * math.pi * self.frequency / float(self.scene.water.sound_speed_at(depth)) * sine
        long_variance, _ = self.bed.longer_waves(
            legs.families[row], float(sonar_end.position[2]), legs.length[row], sine
        )
        bed_quanta, scattered = self.bed.mean_quanta(bed_phase, sine, long_variance)
        quanta, transmission = quanta + bounces * bed_quanta, transmission * (1 - scattered) ** (bounces / 2)
        return CoherentReflection(phase, bed_phase, long_variance, quanta, transmission, bed_quanta)

    def _code(self, legs: Legs, row: int, number: int) -> int:
        """Identifier of one glint of a row's ray and family, the same for transmit and receive legs.

        Bounce points of one family on explicit waves share glints: they appear and vanish in pairs, which changes their
        order.
        """
        sequence = bounce_sequence(legs.families[row])
        branch = 0 if self.bounce_points is not None else legs.branch[row]
        family = 2 * len(sequence) + (first_boundary(sequence) == "bottom") + HULL_FAMILY_OFFSET * self.under_hull
        return (family << 8 | branch << GLINT_BITS) | number

    def _surface_phasor(
        self, bounces: GlintBouncePoints, row: int, scatterer_id: NDArray[np.uint64], code: int
    ) -> NDArray[np.complex128]:
        """Phasor of one glint over the surface [1], shape (n,): equal for merging bounces, independent at a distance.

        Each scatterer and glint has its own wavenumber, so small that a slowly moving bounce keeps its phase.
        """
        low = (scatterer_id & np.uint64(0xFFFFFFFF)).astype(np.int64)
        high = (scatterer_id >> np.uint64(32)).astype(np.int64)
        uniform = random_keys.uniforms(self.seed, random_keys.GLINT, low, high, code, GRADIENT_COUNTER)[:, :2]
        wavenumber = math.pi / bounces.decorrelation_distance * math.sqrt(3) * (2 * uniform - 1) @ self.axes
        return np.asarray(np.exp(1j * np.sum(wavenumber * bounces.position[row], axis=1)))

    def _mean_target_phase(
        self, phase: Floats, image: float, scatterers: Scatterers, sonar_end: SonarEnd, depth: float
    ) -> float:
        """Phase per height of one bounce [rad/m], one value for all parts of a target.

        Args:
            phase: Phase per height for each point [rad/m], shape (n,).
            image: Depth of the family's image source [m].
            scatterers: Points of one target, n of them.
            sonar_end: End of the sonar.
            depth: Depth of the boundary that reflects [m].
        """
        if scatterers.centre is None or (self.grazing_sines is not None and self.bounce_points is None):
            return float(phase.mean())
        ray = scatterers.centre - np.array([*sonar_end.position[:2], image])
        sonar_speed, boundary_speed = (
            float(speed) for speed in self.scene.water.sound_speed_at(np.array([sonar_end.position[2], depth]))
        )
        speed_ratio = boundary_speed / sonar_speed if self.bounce_points is None else 1.0
        cosine = min(float(np.hypot(ray[0], ray[1])) / float(np.linalg.norm(ray)) * speed_ratio, 1.0)
        return 4 * math.pi * self.frequency / boundary_speed * math.sqrt(max(1 - cosine**2, 1e-12))

    def _apply_glints(
        self, legs: Legs, row: int, code: int, reflection: CoherentReflection, scatterers: Scatterers,
        sonar_end: SonarEnd, phasor: NDArray[np.complex128],
    ) -> None:  # fmt: skip
        """Turn one row of legs by flat boundaries into glints, in place; fill its row of the phasors, (2, rows, n)."""
        family, bed = legs.families[row], self.scene.seabed.depth
        sequence, depth = bounce_sequence(family), float(sonar_end.position[2])
        phase, image = reflection.phase_per_height, image_depth(family, depth, bed)
        bed_phase, long_variance = reflection.bed_phase_per_height, reflection.long_variance
        bed_quanta = reflection.bed_quanta
        if self.bounce_points is not None:
            # the angle at a calm surface: with that of a moving bounce, the random waves would change
            climb = np.maximum(np.abs(scatterers.position[:, 2] - image), 1e-6)
            distance = np.linalg.norm(scatterers.position[:, :2] - sonar_end.position[:2], axis=1)
            phase = (
                4
                * math.pi
                * self.frequency
                / float(self.scene.water.sound_speed_at(0.0))
                * climb
                / np.hypot(climb, distance)
            )
        if not scatterers.has_random_phase:  # facets of one target share the waves, or they would decorrelate
            phase = np.full_like(phase, self._mean_target_phase(phase, image, scatterers, sonar_end, 0.0))
            bed_phase = np.full_like(phase, self._mean_target_phase(bed_phase, image, scatterers, sonar_end, bed))
            long_variance, bed_quanta = (np.full_like(phase, column.mean()) for column in (long_variance, bed_quanta))
        points = GlintPoints(
            scatterers.scatterer_id, np.ascontiguousarray(scatterers.position),
            np.ascontiguousarray(scatterers.normal), phase, bed_phase, long_variance, bed_quanta,
        )  # fmt: skip
        key = random_keys.stream_key(self.seed, random_keys.GLINT)
        rough = self.rough_boundaries
        travel_to_bounces = np.array(vertical_travel_to_bounces(family, depth, bed, rough))
        on_bed = np.array([letter == "B" for letter in sequence if letter in rough])
        paths = CalmPaths(
            sonar_end.position, sonar_end.transmit_position, sonar_end.ping_time, image,
            SurfaceBounces(sequence[0] == "S", len(sequence) % 2 == 1, travel_to_bounces), on_bed, self.frequency,
            float(self.scene.water.sound_speed_at(depth)), float(self.scene.water.absorption(self.frequency)),
        )  # fmt: skip
        columns = GlintLegs(
            legs.delay[row], legs.length[row], legs.absorption[row], legs.departure[row], legs.arrival[row],
            legs.grazing_sine[row], legs.status[row], legs.visibility[row],
        )  # fmt: skip
        waves = self.waves if self.bed is None else self.bed.waves
        assert waves is not None  # legs touch no rough boundary otherwise
        source = GlintSource(
            waves if self.waves is None else self.waves, self.axes, self.glint_lifetime, key, code, waves,
            self.bed_axes, math.inf if self.bed is None else self.bed.max_wavenumber, self.cell_size,
        )  # fmt: skip
        apply_glints_to_row(points, source, paths, columns, phasor[0, row], phasor[1, row])


def glint_surface(scene: Scene, seed: int, frequency: float, *, follow_bed: bool = True) -> GlintSurface:
    """Boundaries of a scene that make glints: a statistical surface, a rough seabed.

    Args:
        scene: The scene.
        seed: Seed of the scenario.
        frequency: Frequency of the sound [Hz].
        follow_bed: False: the seabed counts as smooth.
    """
    wind, waves = scene.surface.wind_speed, None
    if wind is not None and scene.surface.reflection == "statistical":
        waves = wind_waves(wind, shortest_wavenumber(frequency, float(scene.water.sound_speed_at(0.0))))
    speed = float(scene.water.sound_speed_at(scene.seabed.depth))
    return GlintSurface(
        scene, seed, frequency, waves, bed_roughness(scene.seabed, frequency, speed) if follow_bed else None
    )


def calm_grazing_sine(legs: Legs, row: int, scene: Scene, sonar_depth: float, depth: float = 0.0) -> Floats:
    """Sine of the grazing angle of one row of legs at a flat boundary at a depth [m] by Snell's law [1], shape (n,)."""
    sonar_speed, boundary_speed = scene.water.sound_speed_at(np.array([sonar_depth, depth]))
    cosine = np.hypot(legs.departure[row, :, 0], legs.departure[row, :, 1])
    return np.asarray(np.sqrt(np.maximum(1 - np.minimum(cosine * boundary_speed / sonar_speed, 1.0) ** 2, 1e-12)))


def bounce_times(
    paths: UnfoldedPaths, delay: Floats, scene: Scene, scatterers: Scatterers, sonar_end: SonarEnd
) -> tuple[Floats, Floats]:
    """Times of each surface bounce of transmit legs and of receive legs [s], shape (bounces, n).

    Args:
        paths: The legs of one family.
        delay: Travel time of each leg [s], shape (n,).
        scene: The scene.
        scatterers: Ends of the legs.
        sonar_end: End of the sonar at which the legs begin.
    """
    # Receive legs are timed after a direct transmit leg: other transmit legs differ by milliseconds.
    transmit_delay = np.linalg.norm(scatterers.position - sonar_end.transmit_position, axis=1) / float(
        scene.water.sound_speed_at(sonar_end.position[2])
    )
    to_bounce = paths.bounce_fractions() * delay
    return sonar_end.ping_time + to_bounce, sonar_end.ping_time + transmit_delay + delay - to_bounce


def leg_rows(legs: Legs, rows: list[int], points: NDArray[np.int64] | None = None) -> Legs:
    """Select rows of legs, repeated ones too, to some of their points or to all, as copies of the columns."""
    selection = np.array(rows, np.intp) if points is None else (np.array(rows)[:, None], points)
    columns = {name: getattr(legs, name)[selection] for name in LEG_COLUMNS}
    caustic = None if legs.caustic is None else legs.caustic[selection]
    expansion = legs.aperture_expansion
    if expansion is not None:
        expansion = expansion[rows] if points is None else expansion[rows][..., points]
    return replace(
        legs, families=tuple(legs.families[row] for row in rows), branch=tuple(legs.branch[row] for row in rows),
        caustic=caustic, aperture_expansion=expansion, **columns,
    )  # fmt: skip


def _numbered(legs: Legs, coherent_rows: list[int], glints: list[tuple[int, int]]) -> tuple[int, ...]:
    """Branches of the selected rows, and of the glints, which are further rays of their family."""
    branches = [legs.branch[row] for row in coherent_rows]
    next_branch = Counter(legs.families)
    for row, _ in glints:
        branches.append(next_branch[legs.families[row]])
        next_branch[legs.families[row]] += 1
    return tuple(branches)


def update_grazing(legs: Legs, row: int, normal: Floats) -> None:
    """Update the grazing angles of one row after a change of its directions of arrival, in place.

    Legs that now arrive from behind the points' interfaces are removed; points with a normal of 0 have none, (n, 3).
    """
    has_interface = ~np.all(normal == 0, axis=1)
    sine = -np.sum(legs.arrival[row] * normal, axis=1)
    legs.grazing_sine[row] = np.clip(sine, -1.0, 1.0)
    behind = (sine <= 0) & has_interface
    clear = legs.status[row] == LegStatus.CLEAR
    legs.status[row][clear & behind] = LegStatus.FACING_AWAY
    legs.visibility[row][behind] = 0.0
