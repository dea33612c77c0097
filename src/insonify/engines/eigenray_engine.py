"""Eigenray engine: all ordered pairs of a transmit leg and a receive leg at every scatterer.

For one ping the scene supplies scatterers in blocks. Propagation computes the legs to each from both ends of the
sonar. Each ordered pair of legs scatters with the strength that the object's law gives. Synthesis sums the pairs.
"""

from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify.engines.boundary_echoes import (
    boundary_echo_families,
    boundary_echo_pairs,
    from_receiver,
    sediment_roughness_factor,
    surface_law_has_facets,
    without_glints,
)
from insonify.engines.engine_caches import EngineCaches
from insonify.engines.face_reflection import (
    face_families,
    face_rows,
    is_in_reach,
    legs_off_face,
    lit_points,
    reflecting_faces,
    reflects_to,
)
from insonify.engines.facet_subdivision import legs_at_sides
from insonify.engines.hull_reflection import hull_families, with_hull
from insonify.engines.memory_budget import points_at_once, points_of_legs
from insonify.engines.multiple_bed_scattering import counted_once, without_face_echoes
from insonify.engines.pair_cross_sections import cross_sections
from insonify.engines.pair_importance import PairSelection, keep_probabilities_at, pair_energy_fractions, select_pairs
from insonify.engines.ping_scatterers import Block, ping_scatterers, slice_footprint
from insonify.engines.polar_grid import MAX_CELL_WIDTH
from insonify.engines.radials import bearing_gain_bound
from insonify.engines.relief_reflections import reflect_off_relief, relief_roughness_factor
from insonify.engines.relief_specular_points import family_specular_points, with_specular_points
from insonify.engines.terrain_occlusion import TerrainOcclusion
from insonify.propagation.delay_field import DelayField
from insonify.propagation.families import DIRECT, bottom_bounces, families_reaching
from insonify.propagation.image_sources import StraightRays
from insonify.propagation.knife_edge import diffract_at_edges
from insonify.propagation.path_settings import PathSettings
from insonify.propagation.propagation_model import PropagationModel
from insonify.propagation.refracted_rays import RefractedRays
from insonify.propagation.surface_reflection import SonarEnd, apply_surface_reflection, repeated_glint_weight
from insonify.recent_results import Identity
from insonify.records.legs import Legs, have_same_geometry, joined_legs, legs_to_points
from insonify.records.pairs import Pairs, PairSampling, SeparableStrengths, Strengths
from insonify.scattering.kirchhoff_facet import KirchhoffFacet
from insonify.scattering.kirchhoff_patch import KirchhoffPatch
from insonify.scattering.lambert import Lambert
from insonify.scene.flat_faces import FlatFace
from insonify.scene.scatterers import BOUNDARY_ECHO, Law, Scatterers
from insonify.scene.scene import Scene
from insonify.sonar.ping_geometry import PingGeometry
from insonify.sonar.two_way_beam import two_way_width

Floats = NDArray[np.float64]

FACE_SEED = 0x9E3779B1
"""Factor on the index of a face (from 1) in the seed of its random bounces, so that each face has its own."""
MANY_CHANNELS = 24
"""Number of channels from which weak pairs are sampled over a flat seabed too: there echoes cost more than legs."""
BOUNDARY_ECHO_PROFILE_WIDTH = 1e-3
"""Least width of the azimuth slices in which the seabed occludes boundary echoes, whatever the beams [rad]."""


@dataclass(frozen=True, slots=True)
class EigenrayEngine:
    """Eigenrays of one scene with one set of path settings.

    Example:
        >>> from insonify.simulator import build_simulator
        >>> changes = {"paths.contributions": ["target"], "paths.families": ["D", "S"]}
        >>> simulator = build_simulator(insonify.load_scenario("sidescan.yaml").with_(changes))
        >>> pairs = list(simulator.engine.all_pairs(simulator.ping_geometry(40)))
        >>> [(one.scatterers.object, one.names()) for one in pairs]
        [('buoy', [('D', 'D'), ('D', 'S'), ('S', 'D'), ('S', 'S')])]
    """

    scene: Scene
    path_settings: PathSettings
    seed: int
    rays: PropagationModel
    """Propagation model of the scene."""
    caches: EngineCaches = field(default_factory=EngineCaches, compare=False, repr=False)
    """Results of the last pings."""
    delay_field: DelayField | None = None
    """Random travel-time delays of inhomogeneous water; None: none, as for an expected intensity."""
    approximate_edges: bool = False
    """True: diffraction around targets without weak ripples and fine details, see `diffract_at_edges`."""

    def blocks(self, ping_geometry: PingGeometry, *, quadrature: bool = False) -> list[Block]:
        """Scatterers of one ping, as blocks that are generated when called.

        Args:
            ping_geometry: The sonar at this ping.
            quadrature: True: quadrature points for an expectation. False: random scatterers fixed to the world.

        Returns:
            Blocks, in an order that does not depend on the number of threads.
        """
        if not self.path_settings.contributions:
            return []
        return ping_scatterers(
            self.scene, self.path_settings, self.seed, ping_geometry, self.rays, quadrature=quadrature,
            caches=self.caches,
        ).blocks()  # fmt: skip

    def pairs(self, ping_geometry: PingGeometry, block: Block, *, include_negligible: bool = True) -> Pairs:
        """Transmit and receive legs of one block, and the scattering strength of each ordered pair.

        Args:
            ping_geometry: The sonar at this ping.
            block: One of `blocks(ping_geometry)`.
            include_negligible: True: pairs weak against simultaneous arrivals are evaluated too, see `select_pairs`.
        """
        scatterers = block()
        return self.path_pairs(
            ping_geometry, scatterers, None if include_negligible else self._pair_selection(ping_geometry, scatterers)
        )

    def pair_batches(
        self, ping_geometry: PingGeometry, block: Block, *, include_negligible: bool = True
    ) -> Iterator[Pairs]:
        """Pairs of one block in batches of bounded memory, see `points_at_once`.

        Args:
            ping_geometry: The sonar at this ping.
            block: One of `blocks(ping_geometry)`.
            include_negligible: See `pairs`.
        """
        hull = len(hull_families(self.path_settings.followed_families)) if ping_geometry.hull is not None else 0
        for scatterers, face_count in self._by_faces(ping_geometry, block()):
            further = hull + face_count * len(face_families(self.path_settings))
            size = points_at_once(self.scene, self.path_settings, scatterers, further)
            for start in range(0, max(len(scatterers), 1), size):
                batch = scatterers if len(scatterers) <= size else scatterers.take(slice(start, start + size))
                yield from self._pairs_within_budget(ping_geometry, batch, include_negligible)

    def _pairs_within_budget(
        self, ping_geometry: PingGeometry, scatterers: Scatterers, include_negligible: bool
    ) -> Iterator[Pairs]:
        """Pairs of scatterers, in parts where explicit waves or refraction make more legs than counted beforehand."""
        selection = None if include_negligible else self._pair_selection(ping_geometry, scatterers)
        if scatterers.boundary == BOUNDARY_ECHO:
            yield self.path_pairs(ping_geometry, scatterers, selection)
            return
        transmit, receive = self._legs(ping_geometry, scatterers, selection)
        size = points_of_legs(max(len(transmit.families), len(receive.families)), drawn=scatterers.has_random_phase)
        if len(scatterers) <= size:
            yield self._pairs(ping_geometry, scatterers, transmit, receive, selection)
            return
        for start in range(0, len(scatterers), size):
            rows = slice(start, start + size)
            points, legs = scatterers.take(rows), legs_to_points((transmit, receive), rows)
            selection = None if include_negligible else self._pair_selection(ping_geometry, points)
            yield self._pairs(ping_geometry, points, *legs, selection)

    def path_pairs(
        self, ping_geometry: PingGeometry, scatterers: Scatterers, selection: PairSelection | None = None
    ) -> Pairs:
        """Transmit and receive legs of scatterers, and the scattering strength of each ordered pair.

        Args:
            ping_geometry: The sonar at this ping.
            scatterers: End points of the legs.
            selection: Families and the scatterers at which their pairs are evaluated; None: all of both.
        """
        if scatterers.boundary == BOUNDARY_ECHO:
            return self.caches.boundary_echoes.get(
                self._boundary_echo_key(ping_geometry), lambda: self._boundary_echoes(ping_geometry, scatterers)
            )
        return self._pairs(ping_geometry, scatterers, *self._legs(ping_geometry, scatterers, selection), selection)

    def _legs(
        self, ping_geometry: PingGeometry, scatterers: Scatterers, selection: PairSelection | None
    ) -> tuple[Legs, Legs]:
        """Transmit and receive legs of scatterers; arguments are those of `path_pairs`."""
        transmit = self._end_legs(
            ping_geometry.transmit_position, scatterers, ping_geometry, selection, elements=ping_geometry.is_monostatic
        )
        receive = transmit
        if not ping_geometry.is_monostatic:
            end = ping_geometry.receive_position
            receive = self._end_legs(end, scatterers, ping_geometry, selection, elements=True)
        ends = ping_geometry.transmit_position, ping_geometry.receive_position
        if self.scene.is_rough(transmit.families):
            new_transmit, new_receive = self._reflected(transmit, ends[0], scatterers, ping_geometry)
            if transmit is not receive:
                _, new_receive = self._reflected(receive, ends[1], scatterers, ping_geometry)
            transmit, receive = new_transmit, new_receive
        if self.path_settings.edge_diffraction == "knife-edge":
            new_transmit = self._diffracted(transmit, ends[0], scatterers, ping_geometry)
            if ping_geometry.is_monostatic and have_same_geometry(transmit, receive):
                receive = new_transmit if transmit is receive else replace(receive, visibility=new_transmit.visibility)
            else:
                receive = self._diffracted(receive, ends[1], scatterers, ping_geometry)
            transmit = new_transmit
        if ping_geometry.hull is not None:
            families = hull_families(self.path_settings.followed_families)
            transmit, receive = self._with_hull(transmit, receive, families, scatterers, ping_geometry, self.seed)
        return self._with_faces(transmit, receive, scatterers, ping_geometry)

    def _pairs(
        self, ping_geometry: PingGeometry, scatterers: Scatterers, transmit: Legs, receive: Legs,
        selection: PairSelection | None,
    ) -> Pairs:  # fmt: skip
        """Pairs of all legs of scatterers; arguments are those of `path_pairs`, and the legs."""
        pair = np.array([(i, j) for i in range(len(transmit.families)) for j in range(len(receive.families))], np.int64)
        pair = pair.reshape(-1, 2)
        weight = repeated_glint_weight(transmit, receive, pair)
        pair, weight = pair[weight > 0], weight[weight > 0]
        sampling = None if selection is None else selection.sampling_of(*_names(transmit, receive, pair))
        is_slice = self.path_settings.geometry == "slice" and scatterers.boundary != "target"
        strengths = self._pair_strengths(scatterers, transmit, receive, pair, weight, ping_geometry.frequency, sampling)
        transmit, receive = legs_at_sides(transmit, receive, scatterers, self.scene)
        if is_slice:
            width = _slice_width(ping_geometry, transmit, receive, pair)
            strengths = Pairs(scatterers, transmit, receive, pair, strengths).strength * width
        return Pairs(scatterers, transmit, receive, pair, strengths)

    def _boundary_echo_key(self, ping_geometry: PingGeometry) -> tuple[Hashable, ...]:
        """Key of the boundary echoes of a ping; sides with arrays at the same positions share them."""
        return (
            ping_geometry.ping, ping_geometry.time, ping_geometry.frequency, ping_geometry.transmit_position.tobytes(),
            ping_geometry.receive_position.tobytes(), self.delay_field is None,
            None if ping_geometry.elements is None else ping_geometry.element_extent,
            None if ping_geometry.hull is None else Identity(ping_geometry),
        )  # fmt: skip

    def _boundary_echoes(self, ping_geometry: PingGeometry, transmitter: Scatterers) -> Pairs:
        """Paths from the transmitter to the receiver by reflections alone, see `insonify.engines.boundary_echoes`."""
        end, is_bistatic = ping_geometry.receive_position, ping_geometry.receive_track_extent is not None
        families = from_receiver(boundary_echo_families(self.path_settings, two_platforms=is_bistatic))
        receive = self._echoes_over_seabed(ping_geometry, transmitter, families)
        if self.scene.surface.reflection != "flat":
            _, receive = self._reflected(receive, end, transmitter, ping_geometry, follow_bed=False)
            if surface_law_has_facets(self.scene, self.path_settings):
                receive = without_glints(receive)
        if self.path_settings.edge_diffraction == "knife-edge":
            receive = self._diffracted(receive, end, transmitter, ping_geometry, approximate=False)
        if ping_geometry.hull is not None:
            echoes = hull_families(families, echoes=True)
            _, receive = self._with_hull(receive, receive, echoes, transmitter, ping_geometry, None)
        if self.scene.seabed.terrain is None:  # the roughness of relief is in its legs
            top = 0.0 if ping_geometry.hull is None else float(ping_geometry.hull.centre[2])
            wavelength = self._wavelength(ping_geometry, end)
            receive = receive.times(
                sediment_roughness_factor(receive, end, self.scene.seabed, wavelength, hull_depth=top)
            )
        return boundary_echo_pairs(transmitter, receive)

    def _echoes_over_seabed(
        self, ping_geometry: PingGeometry, transmitter: Scatterers, families: tuple[str, ...]
    ) -> Legs:
        """Legs from the receiver to the transmitter, by specular points of relief where these are known."""
        end, start, terrain = ping_geometry.receive_position, ping_geometry.transmit_position, self.scene.seabed.terrain
        wavelength = self._wavelength(ping_geometry, end)
        legs = self._legs_over_mean_plane(end, transmitter, ping_geometry, families, elements=True)
        points = family_specular_points(legs, end, start, self.scene, wavelength, self.caches.specular_points)
        if terrain is not None:
            is_needed = np.array([[found is None] for found in points])
            if not ping_geometry.is_monostatic or end[2] >= terrain.span[0]:
                legs = self._with_terrain(legs, transmitter, ping_geometry, end, None)
            elif any(bottom_bounces(legs.families[row]) for row in np.flatnonzero(is_needed)):
                # on vertical paths from one position there is nothing but the bounces
                legs = self._with_terrain(legs, transmitter, ping_geometry, end, is_needed)
        legs = self._with_water_delays(legs, transmitter, ping_geometry, end)
        if terrain is not None and terrain.relief.is_waves and self.scene.seabed.reflecting_interface == "rough":
            legs = legs.times(relief_roughness_factor(legs, end, terrain, wavelength, terrain.depth))
        return with_specular_points(legs, points, end, start, self.scene, wavelength)

    def _with_hull(
        self, transmit: Legs, receive: Legs, families: tuple[str, ...], scatterers: Scatterers,
        ping_geometry: PingGeometry, seed: int | None,
    ) -> tuple[Legs, Legs]:  # fmt: skip
        """Transmit and receive legs under the hull, see `insonify.engines.hull_reflection`."""

        def under(transmit: Legs, receive: Legs, position: Floats) -> tuple[Legs, Legs]:
            assert ping_geometry.hull is not None
            end = SonarEnd(position, ping_geometry.time, ping_geometry.transmit_position)
            plate, frequency = ping_geometry.hull, ping_geometry.frequency
            return with_hull((transmit, receive), families, self.rays, plate, end, scatterers, frequency, seed)

        first = under(transmit, receive, ping_geometry.transmit_position)
        if ping_geometry.is_monostatic:
            return first
        return first[0], under(receive, receive, ping_geometry.receive_position)[1]

    def faces(self, ping_geometry: PingGeometry) -> tuple[FlatFace, ...]:
        """Faces of targets that reflect sound to other scatterers."""
        return reflecting_faces(self.scene, self.path_settings, ping_geometry.frequency)

    def _by_faces(self, ping_geometry: PingGeometry, scatterers: Scatterers) -> Iterator[tuple[Scatterers, int]]:
        """Scatterers of a block that no face reflects sound to, and the others; each with the number of such faces."""
        faces, by_faces, count = self.faces(ping_geometry), np.zeros(len(scatterers), bool), 0
        for face in faces:
            insonified = self._insonified_by_face(face, ping_geometry.transmit_position, scatterers, ping_geometry)
            if not ping_geometry.is_monostatic:
                insonified |= self._insonified_by_face(face, ping_geometry.receive_position, scatterers, ping_geometry)
            by_faces, count = by_faces | insonified, count + bool(insonified.any())
        if not faces or by_faces.all() or not by_faces.any():
            yield scatterers, count
            return
        yield scatterers.take(~by_faces), 0
        yield scatterers.take(by_faces), count

    def _insonified_by_face(
        self, face: FlatFace, position: Floats, scatterers: Scatterers, ping_geometry: PingGeometry
    ) -> NDArray[np.bool_]:
        """True for scatterers to which a face may reflect sound from one end of the sonar, shape (n,)."""
        if not reflects_to(face, scatterers) or not is_in_reach(face, self.scene, ping_geometry):
            return np.zeros(len(scatterers), bool)
        max_rise = self.scene.seabed.depth * self.path_settings.max_reflections
        wavelength = self._wavelength(ping_geometry, position)
        return lit_points(face, position, scatterers.position, wavelength, max_rise=max_rise)

    def _with_faces(
        self, transmit: Legs, receive: Legs, scatterers: Scatterers, ping_geometry: PingGeometry
    ) -> tuple[Legs, Legs]:
        """Transmit and receive legs with those by way of faces, see `insonify.engines.face_reflection`."""
        faces, families = self.faces(ping_geometry), face_families(self.path_settings)
        same_end = transmit is receive
        for number, face in enumerate(faces):

            def reflected(position: Floats, face: FlatFace = face, number: int = number) -> tuple[Legs, Legs] | None:
                insonified = self._insonified_by_face(face, position, scatterers, ping_geometry)
                if not insonified.any():
                    return None
                points, image = scatterers.take(insonified), face.image(position)
                legs = legs_off_face(face, self.rays, position, points, families, ping_geometry.frequency)
                legs = self._with_water_delays(legs, points, ping_geometry, image)
                terrain = self.scene.seabed.terrain
                if terrain is not None and (
                    self.scene.seabed.reflecting_interface == "smooth" or not terrain.relief.is_waves
                ):
                    wavelength = self._wavelength(ping_geometry, position)
                    legs = legs.times(relief_roughness_factor(legs, image, terrain, wavelength, terrain.depth))
                both = legs, legs
                if self.scene.is_rough(legs.families):
                    end = SonarEnd(image, ping_geometry.time, face.image(ping_geometry.transmit_position))
                    seed = self.seed ^ (FACE_SEED * (number + 1))
                    both = apply_surface_reflection(legs, self.scene, seed, points, ping_geometry.frequency, end)
                transmit_rows = face_rows(both[0], face, number, len(faces), insonified)
                if both[1] is both[0]:
                    return transmit_rows, transmit_rows
                return transmit_rows, face_rows(both[1], face, number, len(faces), insonified)

            sent = reflected(ping_geometry.transmit_position)
            received = sent if ping_geometry.is_monostatic else reflected(ping_geometry.receive_position)
            if sent is not None:
                transmit = joined_legs(transmit, sent[0])
            if received is not None:
                receive = joined_legs(receive, received[1])
            same_end = same_end and (sent is None or (received is sent and sent[0] is sent[1]))
            if same_end:
                receive = transmit
        return transmit, receive

    def family_keep_probabilities(
        self, ping_geometry: PingGeometry, distance: Floats
    ) -> tuple[tuple[str, ...], Floats] | None:
        """Families that reach the seabed, and the probabilities with which their pairs are evaluated at a scatterer.

        Args:
            ping_geometry: The sonar at this ping.
            distance: Ground range from the midpoint of both ends [m], shape (n,).

        Returns:
            Families, f of them, and keep probabilities [1], shape (f, f, n); None: all are 1.
        """
        seabed = self.scene.seabed
        law = seabed.law(ping_geometry.frequency, float(self.scene.water.sound_speed_at(seabed.depth)))
        fractions = None if law is None else self._energy_fractions(ping_geometry, law)
        if fractions is None:
            return None
        return fractions[0], np.asarray(keep_probabilities_at(*fractions, ping_geometry, distance), float)

    def _pair_selection(self, ping_geometry: PingGeometry, scatterers: Scatterers) -> PairSelection | None:
        """Selection of pairs at scatterers of the seabed; None where every pair is evaluated."""
        if scatterers.boundary != "seabed" or isinstance(scatterers.law, KirchhoffFacet | KirchhoffPatch):
            return None
        fractions = self._energy_fractions(ping_geometry, scatterers.law)
        if fractions is None:
            return None
        return select_pairs(*fractions, ping_geometry, scatterers.position, scatterers.scatterer_id, self.seed)

    def _energy_fractions(self, ping_geometry: PingGeometry, law: Law) -> tuple[tuple[str, ...], Floats] | None:
        """Families that reach the seabed, and their `pair_energy_fractions`; None where they do not apply."""
        terrain = self.scene.seabed.terrain
        is_straight, is_bistatic = isinstance(self.rays, StraightRays), ping_geometry.receive_track_extent is not None
        if (
            ((terrain is None or terrain.span[0] == terrain.span[1]) and ping_geometry.channel_count < MANY_CHANNELS)
            or is_bistatic
            or not self.path_settings.importance_sampling
            or ping_geometry.hull is not None
            or self.faces(ping_geometry)
        ):
            return None
        families = families_reaching("seabed", self.path_settings.followed_families)
        if families[:1] != (DIRECT,) or self.path_settings.geometry == "slice":
            return None
        beams = ping_geometry.transmit_beams, ping_geometry.receive_beams
        depths = ping_geometry.transmit_position[2], ping_geometry.receive_position[2]
        key = (families, depths, ping_geometry.recorded_delays, *(beam.axes.tobytes() for beam in beams))
        fractions = self.caches.energy_fractions.get(
            key,
            lambda: pair_energy_fractions(
                self.scene, terrain, ping_geometry, families, law, None if is_straight else self.rays
            ),
        )
        return families, np.asarray(fractions, float)

    def _end_legs(
        self, position: Floats, scatterers: Scatterers, ping_geometry: PingGeometry, selection: PairSelection | None,
        *, elements: bool,
    ) -> Legs:  # fmt: skip
        """Legs between one end and the scatterers, with reflections at flat boundaries and terrain.

        Args:
            position: Position (north, east, depth) of that end [m], shape (3,).
            scatterers: End points of the legs.
            ping_geometry: The sonar at this ping.
            selection: Families and the scatterers at which they are followed; None: all of both.
            elements: True: array elements about that end receive them.
        """
        families = self.path_settings.followed_families if selection is None else selection.families
        followed = None if selection is None else selection.needed
        legs = self._legs_over_mean_plane(position, scatterers, ping_geometry, families, followed, elements=elements)
        needed = None if followed is None else followed[[families.index(family) for family in legs.families]]
        return self._with_water_delays(
            self._with_terrain(legs, scatterers, ping_geometry, position, needed), scatterers, ping_geometry, position
        )

    def _legs_over_mean_plane(
        self, position: Floats, scatterers: Scatterers, ping_geometry: PingGeometry, families: tuple[str, ...],
        needed: NDArray[np.bool_] | None = None, *, elements: bool,
    ) -> Legs:  # fmt: skip
        """Legs of some families between one end and the scatterers over the mean seabed; see `_end_legs`."""
        legs = self.rays.legs(position, scatterers, families, ping_geometry.frequency, needed=needed)
        if elements and ping_geometry.elements is not None:
            legs = self.rays.with_aperture_expansion(legs, position, scatterers, ping_geometry.element_extent)
        return legs

    def _pair_strengths(
        self, scatterers: Scatterers, transmit: Legs, receive: Legs, pair: NDArray[np.int64], weight: Floats,
        frequency: float, sampling: PairSampling | None,
    ) -> Strengths | SeparableStrengths:  # fmt: skip
        """Scattering amplitude of each ordered pair, for pressure, 0 where it is not evaluated [m], shape (p, n)."""
        if isinstance(scatterers.law, KirchhoffFacet | KirchhoffPatch):
            return np.asarray(self._specular(scatterers, transmit, receive, pair, frequency) * weight[:, None])
        root = np.sqrt(scatterers.area)
        if isinstance(scatterers.law, Lambert):
            return SeparableStrengths(transmit, receive, pair, _leg_factors(scatterers.law), root, weight, sampling)
        amplitude_weight = None if sampling is None else sampling.amplitude_weight
        section = cross_sections(scatterers, scatterers.law, transmit, receive, pair, amplitude_weight)
        interface = self.scene.seabed.interface_law(
            frequency, float(self.scene.water.sound_speed_at(self.scene.seabed.depth))
        )
        if scatterers.boundary == "seabed" and interface is not None:
            by_targets = self.path_settings.followed_families if "target" in self.path_settings.contributions else ()
            section = counted_once(section, transmit, receive, pair, scatterers.normal, interface)
            section = without_face_echoes(section, transmit, receive, pair, scatterers.normal, interface, by_targets)
        strength = np.sqrt(section) * root
        if amplitude_weight is not None:
            strength *= amplitude_weight
        return np.asarray(strength if (weight == 1).all() else strength * weight[:, None])

    def _specular(
        self, scatterers: Scatterers, transmit: Legs, receive: Legs, pair: NDArray[np.int64], frequency: float
    ) -> NDArray[np.complex128]:
        """Scattering amplitude of smooth faces [m], shape (p, n)."""
        assert scatterers.corners is not None
        if transmit.arrival is receive.arrival and transmit.length is receive.length:
            # reciprocal: the two orders of a pair are evaluated once
            unique, inverse = np.unique(np.sort(pair, axis=1), axis=0, return_inverse=True)
            if len(unique) < len(pair):
                return self._specular(scatterers, transmit, receive, unique, frequency)[inverse.ravel()]
        wavenumber = 2 * np.pi * frequency / self.scene.water.sound_speed_at(scatterers.position[:, 2])
        legs = (
            scatterers.normal, transmit.arrival[pair[:, 0]], receive.arrival[pair[:, 1]], transmit.length[pair[:, 0]],
            receive.length[pair[:, 1]], wavenumber,
        )  # fmt: skip
        if isinstance(scatterers.law, KirchhoffFacet):
            echo = scatterers.law.echoes(scatterers.corners, *legs)
            return echo if scatterers.relative_reflection is None else echo * scatterers.relative_reflection
        assert isinstance(scatterers.law, KirchhoffPatch)
        return scatterers.law.echoes(scatterers.corners, scatterers.area, *legs)

    def _with_water_delays(
        self, legs: Legs, scatterers: Scatterers, ping_geometry: PingGeometry, position: Floats
    ) -> Legs:
        """Add the random delays of inhomogeneous water to legs."""
        if self.delay_field is None:
            return legs
        return self.delay_field.with_delays(legs, position, scatterers.position, ping_geometry.time)

    def _reflected(
        self, legs: Legs, position: Floats, scatterers: Scatterers, ping_geometry: PingGeometry, *,
        follow_bed: bool = True,
    ) -> tuple[Legs, Legs]:  # fmt: skip
        """Transmit and receive legs from one end, reflected at a moving surface and a rough seabed, at their times."""
        end = SonarEnd(position, ping_geometry.time, ping_geometry.transmit_position)
        return apply_surface_reflection(
            legs, self.scene, self.seed, scatterers, ping_geometry.frequency, end, follow_bed=follow_bed
        )

    def _diffracted(
        self, legs: Legs, position: Floats, scatterers: Scatterers, ping_geometry: PingGeometry, *,
        approximate: bool = True,
    ) -> Legs:  # fmt: skip
        """Legs from one end, diffracted at the edges of targets; diffraction at terrain crests is included already."""
        return diffract_at_edges(
            legs, scatterers, position, self.scene, self._wavelength(ping_geometry, position),
            infinitely_wide=self.path_settings.geometry == "slice", approximate=approximate and self.approximate_edges,
        )  # fmt: skip

    def _with_terrain(
        self, legs: Legs, scatterers: Scatterers, ping_geometry: PingGeometry, position: Floats,
        needed: NDArray[np.bool_] | None,
    ) -> Legs:  # fmt: skip
        """Apply terrain occlusion and relief reflections to legs."""
        terrain = self.scene.seabed.terrain
        if terrain is None or not len(scatterers):  # a block of water may lie wholly below the seabed
            return legs

        def build_occlusion() -> TerrainOcclusion:
            separation = float(np.linalg.norm(ping_geometry.transmit_position - ping_geometry.receive_position))
            launches = self.rays.launch_angles(float(position[2]))
            wavelength = self._wavelength(ping_geometry, position)
            if is_boundary_echo:
                return TerrainOcclusion(
                    terrain, position, launches, farthest=separation + 2 * terrain.depth, wavelength=wavelength,
                    min_profile_width=BOUNDARY_ECHO_PROFILE_WIDTH,
                )  # fmt: skip
            farthest = self.scene.water.max_sound_speed * ping_geometry.recorded_delays[1] / 2 + separation
            width = min(two_way_width(ping_geometry.transmit_beams, ping_geometry.receive_beams), MAX_CELL_WIDTH)
            gain_bound = None
            if self.path_settings.importance_sampling:
                gain_bound = bearing_gain_bound(
                    ping_geometry, terrain.depth, families_reaching("seabed", self.path_settings.followed_families),
                    self.rays if isinstance(self.rays, RefractedRays) else None,
                )  # fmt: skip
            return TerrainOcclusion(
                terrain, position, launches, farthest=farthest, wavelength=wavelength, min_profile_width=width / 3,
                gain_bound=gain_bound,
            )  # fmt: skip

        is_boundary_echo = scatterers.boundary == BOUNDARY_ECHO
        bearing = None if is_boundary_echo else ping_geometry.first_beam_bearing
        key = (ping_geometry.ping, position.tobytes(), bearing)
        soft = self.path_settings.edge_diffraction == "knife-edge"
        occlusion = self.caches.terrain_occlusion.get(key, build_occlusion)
        return reflect_off_relief(legs, scatterers, position, occlusion, self.scene, soft=soft, needed=needed)

    def _wavelength(self, ping_geometry: PingGeometry, position: Floats) -> float:
        """Wavelength at one end of the sonar [m]; the same for transmitter and receiver."""
        return float(self.scene.water.sound_speed_at(float(position[2]))) / ping_geometry.frequency

    def all_pairs(self, ping_geometry: PingGeometry, *, quadrature: bool = False) -> Iterator[Pairs]:
        """Pairs of every block of one ping in turn, for a coherent recording or an expectation."""
        for block in self.blocks(ping_geometry, quadrature=quadrature):
            yield self.pairs(ping_geometry, block, include_negligible=quadrature)


def _names(transmit: Legs, receive: Legs, pair: NDArray[np.int64]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Transmit and receive families of each ordered pair."""
    return tuple(transmit.families[i] for i in pair[:, 0]), tuple(receive.families[j] for j in pair[:, 1])


def _slice_width(ping_geometry: PingGeometry, transmit: Legs, receive: Legs, pair: NDArray[np.int64]) -> Floats:
    """Root of the beam width that each point of a boundary represents in a slice [m^0.5], shape (p, n).

    The footprint at the geometric mean of both legs' lengths: exact for equal lengths.
    """
    product = transmit.length[pair[:, 0]] * receive.length[pair[:, 1]]
    return np.asarray(np.sqrt(slice_footprint(ping_geometry)) * product**0.25)


@lru_cache(maxsize=16)
def _leg_factors(law: Lambert) -> Floats:
    """Factor of one leg in a separable law (linear in the sine of grazing angle), at sines of 0 and 1 [1]."""
    horizontal, forward = np.array(np.pi / 2), np.array(np.pi)
    facing = law.cross_section(horizontal, horizontal, forward)
    return np.asarray(law.cross_section(np.array([0.0, np.pi / 2]), horizontal, forward) / np.sqrt(facing))
