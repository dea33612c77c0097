"""The engine: every leg out, met at a scatterer by every leg back.

For one ping the scene offers its scatterers in blocks; propagation reaches each from both ends; each
ordered pair of legs scatters with the strength that the owner's law gives it. What comes out is
heard by synthesis.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify.engines.memory_budget import points_at_once
from insonify.engines.pair_importance import PairSelection, keep_probabilities_at, pair_energy_fractions, select_pairs
from insonify.engines.ping_scatterers import Block, ping_scatterers, slice_footprint
from insonify.engines.polar_grid import MAX_CELL_WIDTH
from insonify.engines.quadrature_points import LayoutCache
from insonify.engines.radials import straight_gain_bound
from insonify.engines.relief_reflections import reflect_off_relief
from insonify.engines.terrain_occlusion import OcclusionCache, TerrainOcclusion
from insonify.propagation.delay_field import DelayField
from insonify.propagation.families import DIRECT, families_reaching
from insonify.propagation.image_sources import StraightRays
from insonify.propagation.knife_edge import diffract_at_edges
from insonify.propagation.path_settings import PathSettings
from insonify.propagation.propagation_model import PropagationModel
from insonify.propagation.surface_reflection import SonarEnd, apply_surface_reflection, repeated_glint_weight
from insonify.records.legs import Legs
from insonify.records.pairs import Pairs, PairSampling, SeparableStrengths, Strengths
from insonify.scattering.compiled_law import CompiledLaw
from insonify.scattering.kirchhoff_facet import KirchhoffFacet
from insonify.scattering.kirchhoff_patch import KirchhoffPatch
from insonify.scattering.lambert import Lambert
from insonify.scene.scatterers import Law, Scatterers
from insonify.scene.scene import Scene
from insonify.scene.terrain.array_cache import ArrayCache
from insonify.sonar.ping_geometry import PingGeometry
from insonify.sonar.two_way_beam import two_way_width

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class EigenrayEngine:
    """The engine for one scene and one choice of paths."""

    scene: Scene
    choice: PathSettings
    seed: int
    rays: PropagationModel
    """How sound travels in the scene."""
    terrain_occlusion: OcclusionCache = field(default_factory=lambda: OcclusionCache(4), compare=False, repr=False)
    """What the ground hides from the last few places."""
    energy_fraction_cache: ArrayCache = field(default_factory=lambda: ArrayCache(1 << 20), compare=False, repr=False)
    """What families have of all that is heard of the ground at the last attitudes."""
    layouts: LayoutCache = field(default_factory=LayoutCache, compare=False, repr=False)
    """Even points about the sonar in its last attitudes."""
    delay_field: DelayField | None = None
    """What uneven water adds to travel times; None: nothing, and an expectation takes its mean."""

    def blocks(self, ping_geometry: PingGeometry, *, quadrature: bool = False) -> list[Block]:
        """The scatterers of one ping, as blocks that are drawn when they are called.

        Args:
            ping_geometry: The sonar at this ping.
            quadrature: Points laid out evenly for an expectation, not drawn ones that belong to their places.

        Returns:
            Blocks in a fixed order, however many threads will draw them.
        """
        if not self.choice.contributions:
            return []
        seen = ping_scatterers(
            self.scene, self.choice, self.seed, ping_geometry, self.rays, quadrature=quadrature, layouts=self.layouts
        )
        return seen.blocks()

    def pairs(self, ping_geometry: PingGeometry, block: Block, *, include_negligible: bool = True) -> Pairs:
        """Legs out and back of one block, and the strength of each ordered pair.

        Args:
            ping_geometry: The sonar at this ping.
            block: One of `blocks(ping_geometry)`.
            include_negligible: Whether pairs are met everywhere that others drown at all times, see `select_pairs`.
        """
        scatterers = block()
        return self.path_pairs(
            ping_geometry, scatterers, None if include_negligible else self._pair_selection(ping_geometry, scatterers)
        )

    def pair_batches(
        self, ping_geometry: PingGeometry, block: Block, *, include_negligible: bool = True
    ) -> Iterator[Pairs]:
        """Pairs of one block, a part of it at a time: the memory that they take is bounded, see `points_at_once`.

        Args:
            ping_geometry: The sonar at this ping.
            block: One of `blocks(ping_geometry)`.
            include_negligible: As of `pairs`.
        """
        scatterers = block()
        size = points_at_once(self.scene, self.choice, scatterers)
        for start in range(0, max(len(scatterers), 1), size):
            some = scatterers if len(scatterers) <= size else scatterers.take(slice(start, start + size))
            yield self.path_pairs(
                ping_geometry, some, None if include_negligible else self._pair_selection(ping_geometry, some)
            )

    def path_pairs(
        self, ping_geometry: PingGeometry, scatterers: Scatterers, selection: PairSelection | None = None
    ) -> Pairs:
        """Legs out and back of any scatterers, and the strength of each ordered pair.

        Args:
            ping_geometry: The sonar at this ping.
            scatterers: The points to reach.
            selection: Families that are followed, and where their pairs are met; None: all that are chosen, everywhere.
        """
        out = self._end_legs(
            ping_geometry.transmit_position, scatterers, ping_geometry, selection, elements=ping_geometry.is_monostatic
        )
        back = out
        if not ping_geometry.is_monostatic:
            back = self._end_legs(ping_geometry.receive_position, scatterers, ping_geometry, selection, elements=True)
        if self.scene.surface.reflection != "flat":
            out, back = self._with_surface_reflection(out, back, scatterers, ping_geometry)
        if self.choice.edge_diffraction == "knife-edge":
            out, back = self._with_diffraction(out, back, scatterers, ping_geometry)
        pair = np.array([(i, j) for i in range(len(out.families)) for j in range(len(back.families))], np.int64)
        pair = pair.reshape(-1, 2)
        weight = repeated_glint_weight(out, back, pair)
        pair, weight = pair[weight > 0], weight[weight > 0]
        sampling = None if selection is None else selection.sampling_of(*_names(out, back, pair))
        wide = self.choice.geometry == "slice" and scatterers.boundary != "target"
        answer = self._pair_strengths(scatterers, out, back, pair, weight, ping_geometry.frequency, sampling)
        if wide:
            answer = Pairs(scatterers, out, back, pair, answer).strength * _slice_width(ping_geometry, out, back, pair)
        return Pairs(scatterers, out, back, pair, answer)

    def family_keep_probabilities(
        self, ping_geometry: PingGeometry, distance: Floats
    ) -> tuple[tuple[str, ...], Floats] | None:
        """Families that reach the seabed, and at what share of its scatterers drawn pings meet their pairs.

        Args:
            ping_geometry: The sonar at this ping.
            distance: Over ground from the middle between both ends [m], shape (n,).

        Returns:
            Families, f of them, and shares [1], shape (f, f, n); None: all pairs are met everywhere.
        """
        seabed = self.scene.seabed
        law = seabed.law(ping_geometry.frequency, float(self.scene.water.sound_speed_at(seabed.depth)))
        told = None if law is None else self._energy_fractions(ping_geometry, law)
        return (
            None
            if told is None
            else (told[0], np.asarray(keep_probabilities_at(*told, ping_geometry, distance), float))
        )

    def _pair_selection(self, ping_geometry: PingGeometry, scatterers: Scatterers) -> PairSelection | None:
        """What is heard of the ground at some scatterers; None where nothing is known of that."""
        if scatterers.boundary != "seabed" or isinstance(scatterers.law, KirchhoffFacet | KirchhoffPatch):
            return None
        told = self._energy_fractions(ping_geometry, scatterers.law)
        return (
            None
            if told is None
            else select_pairs(*told, ping_geometry, scatterers.position, scatterers.scatterer_id, self.seed)
        )

    def _energy_fractions(self, ping_geometry: PingGeometry, law: Law) -> tuple[tuple[str, ...], Floats] | None:
        """Families that reach the bed, and of `pair_energy_fractions` what they have of all that is heard of it."""
        bed = self.scene.seabed.terrain
        straight, apart = isinstance(self.rays, StraightRays), ping_geometry.receive_track_extent is not None
        if bed is None or bed.span[0] == bed.span[1] or apart or not straight or not self.choice.importance_sampling:
            return None
        families = families_reaching("seabed", self.choice.followed_families)
        if families[:1] != (DIRECT,) or self.choice.geometry == "slice":
            return None
        beams = ping_geometry.transmit_beams, ping_geometry.receive_beams
        depths = ping_geometry.transmit_position[2], ping_geometry.receive_position[2]
        key = (families, depths, ping_geometry.recorded_delays, *(beam.axes.tobytes() for beam in beams))
        part = self.energy_fraction_cache.get(
            key, lambda: pair_energy_fractions(self.scene, bed, ping_geometry, families, law)
        )
        return families, np.asarray(part, float)

    def _end_legs(
        self,
        place: Floats,
        scatterers: Scatterers,
        ping_geometry: PingGeometry,
        heard: PairSelection | None,
        *,
        elements: bool,
    ) -> Legs:
        """Legs between one end and the scatterers, off level mirrors and uneven ground.

        Args:
            place: North, east, depth of that end [m], shape (3,).
            scatterers: The points to reach.
            ping_geometry: The sonar at this ping.
            heard: Families that are followed, and where; None: all that are chosen, everywhere.
            elements: Whether elements about that end hear them.
        """
        families = self.choice.followed_families if heard is None else heard.families
        legs = self.rays.legs(place, scatterers, families, ping_geometry.frequency)
        if elements and ping_geometry.elements is not None:
            legs = self.rays.with_aperture_expansion(legs, place, scatterers, ping_geometry.element_extent)
        wanted = None if heard is None else heard.wanted
        return self._with_water_delays(
            self._with_terrain(legs, scatterers, ping_geometry, place, wanted), scatterers, ping_geometry, place
        )

    def _pair_strengths(
        self, scatterers: Scatterers, out: Legs, back: Legs, pair: NDArray[np.int64], weight: Floats, frequency: float,
        sampling: PairSampling | None,
    ) -> Strengths | SeparableStrengths:  # fmt: skip
        """Pressure that each ordered pair scatters to 1 m re incident pressure [m], where it is met, (p, n)."""
        if isinstance(scatterers.law, KirchhoffFacet | KirchhoffPatch):
            return np.asarray(self._specular(scatterers, out, back, pair, frequency) * weight[:, None])
        root = np.sqrt(scatterers.area)
        if isinstance(scatterers.law, Lambert):
            return SeparableStrengths(out, back, pair, _contributions(scatterers.law), root, weight, sampling)
        amplitude_weight = None if sampling is None else sampling.amplitude_weight
        strength = np.sqrt(_cross_section(scatterers, scatterers.law, out, back, pair, amplitude_weight)) * root
        if amplitude_weight is not None:
            strength *= amplitude_weight
        return np.asarray(strength if (weight == 1).all() else strength * weight[:, None])

    def _specular(
        self, scatterers: Scatterers, out: Legs, back: Legs, pair: NDArray[np.int64], frequency: float
    ) -> NDArray[np.complex128]:
        """Pressure that smooth faces send back to 1 m re incident pressure [m], shape (p, n)."""
        assert scatterers.corners is not None
        if out.arrival is back.arrival and out.length is back.length:
            # reciprocal: the two orders of a pair are evaluated once
            low, where = np.unique(np.sort(pair, axis=1), axis=0, return_inverse=True)
            if len(low) < len(pair):
                return self._specular(scatterers, out, back, low, frequency)[where.ravel()]
        wavenumber = 2 * np.pi * frequency / self.scene.water.sound_speed_at(scatterers.position[:, 2])
        arriving, leaving = out.arrival[pair[:, 0]], back.arrival[pair[:, 1]]
        if isinstance(scatterers.law, KirchhoffFacet):
            return scatterers.law.echoes(scatterers.corners, scatterers.normal, arriving, leaving, wavenumber)
        assert isinstance(scatterers.law, KirchhoffPatch)
        return scatterers.law.echoes(
            scatterers.corners, scatterers.area, scatterers.normal, arriving, leaving, out.length[pair[:, 0]],
            back.length[pair[:, 1]], wavenumber,
        )  # fmt: skip

    def _with_water_delays(
        self, legs: Legs, scatterers: Scatterers, ping_geometry: PingGeometry, place: Floats
    ) -> Legs:
        """The legs as uneven water delays them; in even water, as they are."""
        return (
            legs
            if self.delay_field is None
            else self.delay_field.with_delays(legs, place, scatterers.position, ping_geometry.time)
        )

    def _with_surface_reflection(
        self, out: Legs, back: Legs, scatterers: Scatterers, ping_geometry: PingGeometry
    ) -> tuple[Legs, Legs]:
        """The legs as a moving surface leaves them, each end's at its own times."""

        def moved(legs: Legs, place: Floats) -> tuple[Legs, Legs]:
            end = SonarEnd(place, ping_geometry.time, ping_geometry.transmit_position)
            return apply_surface_reflection(legs, self.scene, self.seed, scatterers, ping_geometry.frequency, end)

        first = moved(out, ping_geometry.transmit_position)
        return first[0], (first if out is back else moved(back, ping_geometry.receive_position))[1]

    def _with_diffraction(
        self, out: Legs, back: Legs, scatterers: Scatterers, ping_geometry: PingGeometry
    ) -> tuple[Legs, Legs]:
        """The legs with what bends around the edges of targets; that of the ground is in them already."""

        def bent(legs: Legs, place: Floats) -> Legs:
            wide = self.choice.geometry == "slice"
            return diffract_at_edges(
                legs, scatterers, place, self.scene, self._wavelength(ping_geometry, place), infinitely_wide=wide
            )

        first = bent(out, ping_geometry.transmit_position)
        return first, (first if out is back else bent(back, ping_geometry.receive_position))

    def _with_terrain(
        self,
        legs: Legs,
        scatterers: Scatterers,
        ping_geometry: PingGeometry,
        place: Floats,
        wanted: NDArray[np.bool_] | None,
    ) -> Legs:
        """The legs as relief leaves them; over a flat bed, as they are."""
        bed = self.scene.seabed.terrain
        if bed is None or not len(scatterers):  # a block of water may lie all under the ground
            return legs

        def walked() -> TerrainOcclusion:
            apart = float(np.linalg.norm(ping_geometry.transmit_position - ping_geometry.receive_position))
            farthest = self.scene.water.max_sound_speed * ping_geometry.recorded_delays[1] / 2 + apart
            width = min(two_way_width(ping_geometry.transmit_beams, ping_geometry.receive_beams), MAX_CELL_WIDTH)
            launches = self.rays.launch_angles(float(place[2]))
            wavelength = self._wavelength(ping_geometry, place)
            heard = None
            if isinstance(self.rays, StraightRays) and self.choice.importance_sampling:
                heard = straight_gain_bound(
                    ping_geometry, bed.depth, families_reaching("seabed", self.choice.followed_families)
                )
            return TerrainOcclusion(
                bed,
                place,
                launches,
                farthest=farthest,
                wavelength=wavelength,
                min_profile_width=width / 3,
                gain_bound=heard,
            )

        key = (ping_geometry.ping, place.tobytes(), ping_geometry.first_beam_bearing)
        soft = self.choice.edge_diffraction == "knife-edge"
        return reflect_off_relief(
            legs, scatterers, place, self.terrain_occlusion.get(key, walked), self.scene, soft=soft, wanted=wanted
        )

    def _wavelength(self, ping_geometry: PingGeometry, place: Floats) -> float:
        """Wavelength at one end of the sonar [m]: an edge does not care whether that end sends or hears."""
        return float(self.scene.water.sound_speed_at(float(place[2]))) / ping_geometry.frequency

    def all_pairs(self, ping_geometry: PingGeometry, *, quadrature: bool = False) -> Iterator[Pairs]:
        """Every block of one ping in turn: what a recording of drawn scatterers is made of, or an expectation."""
        for block in self.blocks(ping_geometry, quadrature=quadrature):
            yield self.pairs(ping_geometry, block, include_negligible=quadrature)


def _names(out: Legs, back: Legs, pair: NDArray[np.int64]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Families out and back of each ordered pair."""
    return tuple(out.families[i] for i in pair[:, 0]), tuple(back.families[j] for j in pair[:, 1])


def _slice_width(ping_geometry: PingGeometry, out: Legs, back: Legs, pair: NDArray[np.int64]) -> Floats:
    """Root of the width of the beam that each point of a boundary stands for [m^0.5], (p, n).

    The footprint at the geometric mean of both legs: exact where they are alike.
    """
    reach = out.length[pair[:, 0]] * back.length[pair[:, 1]]
    return np.asarray(np.sqrt(slice_footprint(ping_geometry)) * reach**0.25)


@lru_cache(maxsize=8)
def _contributions(law: Lambert) -> Floats:
    """What one direction contributes to a law that is a product of two, linear in sines, at sines of 0 and 1."""
    level, straight = np.array(np.pi / 2), np.array(np.pi)
    facing = law.cross_section(level, level, straight)
    return np.asarray(law.cross_section(np.array([0.0, np.pi / 2]), level, straight) / np.sqrt(facing))


def _cross_section(
    scatterers: Scatterers, law: Law, out: Legs, back: Legs, pair: NDArray[np.int64],
    amplitude_weight: NDArray[np.float32] | None = None,
) -> Floats:  # fmt: skip
    """Cross section of each ordered pair, (p, n); legs that are not there, and pairs not met, weigh nothing later."""
    i, j = pair.T
    if out.arrival is back.arrival:
        # every law is reciprocal: each two legs are asked about once
        low, where = np.unique(np.sort(pair, axis=1), axis=0, return_inverse=True)
        if len(low) < len(pair):
            first = (
                None if amplitude_weight is None else amplitude_weight[np.unique(where.ravel(), return_index=True)[1]]
            )
            return _cross_section(scatterers, law, out, back, low, first)[where.ravel()]
    if isinstance(law, CompiledLaw):
        return _compiled_sections(law, scatterers.normal, out, back, pair, amplitude_weight)
    # On a level boundary all legs to and from one place share one bearing.
    level = scatterers.boundary != "target" and bool(np.all(scatterers.normal[:, :2] == 0))
    backscatter_curves = out is back and level
    azimuth = np.array(np.pi) if backscatter_curves else _azimuth(scatterers.normal, out.arrival[i], back.arrival[j])
    return np.asarray(law.cross_section(np.abs(out.grazing[i]), np.abs(back.grazing[j]), azimuth))


def _compiled_sections(
    law: CompiledLaw,
    normal: Floats,
    out: Legs,
    back: Legs,
    pair: NDArray[np.int64],
    amplitude_weight: NDArray[np.float32] | None,
) -> Floats:
    """Cross sections by a compiled law, asked only where a pair is met, (p, n)."""
    made = np.zeros((len(pair), len(normal)))
    for row, (i, j) in enumerate(pair):
        met = (
            slice(None)
            if amplitude_weight is None or amplitude_weight[row].all()
            else np.flatnonzero(amplitude_weight[row])
        )
        made[row, met] = law.cross_section(out.arrival[i, met].T, -back.arrival[j, met].T, normal[met].T)
    return made


def _azimuth(normal: Floats, arriving: Floats, leaving: Floats) -> Floats:
    """Bistatic azimuth between two rays that both point to the scatterer, in its plane: pi where they coincide."""
    a, b = (ray - np.sum(ray * normal, axis=-1, keepdims=True) * normal for ray in (arriving, leaving))
    cross = np.sum(np.cross(a, b) * normal, axis=-1)
    return np.asarray(np.pi - np.abs(np.arctan2(cross, np.sum(a * b, axis=-1))))
