"""Tracer: rays of the transmit beam, followed from reflection to reflection, with receive legs from every hit.

A ray represents a solid angle. Where it hits the seabed, the surface or a body, the scattering law there scatters part
of its energy towards the receiver, along every family of receive legs; the reflected part continues. Reflected energy
is carried by the continued ray, scattered energy by the receive leg: none is counted twice. The search for paths
shares no code with the eigenray engine.

Expected intensities only. Shadows end hard.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from insonify.engines.tracer._trace_kernel import BED, SURFACE
from insonify.engines.tracer.connection import boundary_echo_energies, echoes, point_echoes
from insonify.engines.tracer.facet_echoes import facet_boundary_echoes
from insonify.engines.tracer.facet_scattering import facet_surface
from insonify.engines.tracer.launch_sampling import LaunchSampler, PathLength, launch_sampler
from insonify.engines.tracer.ray_bundle import RayBundle, TracedPing
from insonify.engines.tracer.ray_tracing import is_followed, trace_hits
from insonify.engines.tracer.surface_vertices import SurfaceVertices, surface_vertices
from insonify.engines.tracer.tracing_scene import TracingScene, grid_rotation, open_water_hits
from insonify.propagation.families import bounce_sequence, image_depth
from insonify.propagation.path_settings import PathSettings
from insonify.propagation.propagation_model import PropagationModel
from insonify.propagation.sound_speed_layers import SoundSpeedLayers
from insonify.records.echo_energies import EchoEnergies
from insonify.records.legs import LegStatus
from insonify.scattering.point_target import PointTargetLaw
from insonify.scene.scatterers import BOUNDARY_ECHO, Law, Scatterers
from insonify.scene.scene import Scene
from insonify.scene.solid import world_triangles
from insonify.scene.target import PointTarget
from insonify.sonar.beam import Beams
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.float64]

PARTS = 16
"""Number of parts of the rays of a ping: fixed, so that sums do not depend on the number of threads."""
MAX_WINDOWS = 64
"""Largest number of combinations of a body and a family towards which rays are aimed [1]."""
MAX_OVERHEAD_TANGENT = 0.5
"""Tangent of the angle from the vertical within which rays are aimed at a moving surface overhead [1]."""
AIM_FREQUENCY = 1e5
"""Frequency given for legs of which only the directions are used: these do not depend on frequency [Hz]."""
INTENSITY_EXPONENT_PER_DB = np.log(10) / 10
"""Absorption exponent of intensity per decibel: a loss of x dB is a factor exp(-x times this) [1/dB]."""

Block = Callable[[], list[EchoEnergies]]


class Tracer:
    """The tracer for one scene and one set of path settings.

    Example:
        >>> from insonify.simulator import build_simulator
        >>> paths = {"engine": "tracer", "contributions": ["target"], "families": ["D", "S"]}
        >>> scenario = insonify.load_scenario("sidescan.yaml").with_({"field": "incoherent", "paths": paths})
        >>> simulator = build_simulator(scenario)
        >>> for echo in simulator.tracer.exact_paths(simulator.ping_geometry(40)):
        ...     print(echo.object, echo.transmit_chain, echo.receive_chain, (1e3 * echo.delay).round(1), "ms")
        buoy D D [36.2] ms
        buoy D S [45.2] ms
        buoy S D [45.2] ms
        buoy S S [54.3] ms
    """

    def __init__(
        self, scene: Scene, path_settings: PathSettings, seed: int, propagation_model: PropagationModel | None = None
    ) -> None:
        """Prepare a scene for tracing.

        Args:
            scene: The scene.
            path_settings: Families, number of rays, specular fraction of targets.
            seed: Seed of the scenario.
            propagation_model: Eigenrays of layered water, for connections; not used in water of one sound speed.

        Raises:
            ValueError: The water is layered, and there is no propagation model.
        """
        if scene.water.layered and propagation_model is None:
            raise ValueError("water.profile refracts, and there is no propagation_model. Give that of the scene.")
        self.scene, self.path_settings, self.seed = scene, path_settings, seed
        self.tracing_scene, self.rays = TracingScene(scene), propagation_model if scene.water.layered else None

    def blocks(self, ping_geometry: PingGeometry, *, quadrature: bool = True) -> list[Block]:
        """The rays of one ping, in parts that are traced when they are called.

        Args:
            ping_geometry: The sonar at this ping.
            quadrature: Not used: rays give expectations only; random scatterers belong to the eigenray engine.

        Returns:
            Blocks, in an order that does not depend on the number of threads.
        """
        if not quadrature:
            raise ValueError("the tracer has no phases: write field: incoherent, or paths.engine: eigenrays")
        ping = self.ping(ping_geometry)
        is_moving, passes_faces = ping.facets is not None, bool(self.scene.occluders) and is_followed(ping, "T")
        is_exchanged = not ping_geometry.is_monostatic and (is_moving or passes_faces)
        exchanged = self._exchanged_ping(ping) if is_moving or is_exchanged else ping
        pings = [(ping, exchanged)]
        if is_exchanged:
            pings.append((exchanged, ping))
        rays = [partial(self._trace, *two_pings, part) for two_pings in pings for part in range(PARTS)]
        return [*rays, partial(self._exact_paths, ping)]

    def exact_paths(self, ping_geometry: PingGeometry) -> list[EchoEnergies]:
        """Paths of one ping without random rays: to point targets, and boundary echoes.

        Args:
            ping_geometry: The sonar at this ping.
        """
        return self._exact_paths(self.ping(ping_geometry))

    def pair_batches(
        self, ping_geometry: PingGeometry, block: Block, *, include_negligible: bool = True
    ) -> Iterator[list[EchoEnergies]]:
        """Energies of the rays of one block, all at once.

        Args:
            ping_geometry: The sonar at this ping.
            block: One of `blocks(ping_geometry)`.
            include_negligible: Without effect: every ray counts.
        """
        yield block()

    def ping(self, ping_geometry: PingGeometry) -> TracedPing:
        """One ping in the scatterer grid's frame.

        Args:
            ping_geometry: The sonar at this ping.
        """
        scene, world_from_grid = self.scene, grid_rotation(self.tracing_scene.scatterer_grid).T
        transmit, receive = (
            self.tracing_scene.to_grid_frame(position)
            for position in (ping_geometry.transmit_position, ping_geometry.receive_position)
        )
        transmit_beams, receive_beams = (
            beams.rotated(beams.axes @ world_from_grid)
            for beams in (ping_geometry.transmit_beams, ping_geometry.receive_beams)
        )
        laws = {
            BED: scene.seabed.law(ping_geometry.frequency, float(scene.water.sound_speed_at(scene.seabed.depth))),
            SURFACE: scene.surface.law(ping_geometry.frequency, float(scene.water.sound_speed_at(0.0))),
        }
        one_way_range = scene.water.max_sound_speed * max(ping_geometry.recorded_delays[1], 0.0) / 2 + float(
            np.linalg.norm(transmit - receive)
        )
        launch_sampler = self._launch_sampler(ping_geometry, transmit, transmit_beams, receive_beams, laws)
        intersector = self.tracing_scene.intersector(transmit, 2 * one_way_range)
        attenuation = float(scene.water.absorption(ping_geometry.frequency)) * INTENSITY_EXPONENT_PER_DB
        return TracedPing(
            scene, self.path_settings, ping_geometry, intersector, launch_sampler, transmit, receive, transmit_beams,
            receive_beams, laws, attenuation, self.rays, facet_surface(scene, self.seed, ping_geometry.frequency),
        )  # fmt: skip

    def _exchanged_ping(self, ping: TracedPing) -> TracedPing:
        """The ping with rays from the receiver."""
        beams = ping.receive_beams, ping.transmit_beams
        return ping.exchanged(self._launch_sampler(ping.ping_geometry, ping.receive, *beams, ping.laws))

    def _trace(self, ping: TracedPing, exchanged: TracedPing, part: int) -> list[EchoEnergies]:
        """Echoes of one part of the rays; rays of the ping with both ends exchanged find points of a moving surface."""
        vertices, energies = self._surface_vertices(exchanged, part), list[EchoEnergies]()
        for hits in trace_hits(ping, self._rays(ping, part, self.seed)):
            energies += [*echoes(ping, hits, vertices), *facet_boundary_echoes(ping, hits)]
        return energies

    def _surface_vertices(self, exchanged: TracedPing, part: int) -> list[SurfaceVertices]:
        """Points of a moving surface that one part of the rays from the receiver reaches."""
        if exchanged.facets is None:
            return []
        rays = self._rays(exchanged, part, self.seed + 1)
        # one part of the rays stands for all of them
        return surface_vertices(exchanged, replace(rays, solid_angle=PARTS * rays.solid_angle), self.seed)

    def _rays(self, ping: TracedPing, part: int, seed: int) -> RayBundle:
        """One part of the rays that leave the transmitter."""
        number, count = ping.ping_geometry.ping, self.path_settings.rays
        direction, solid_angle = ping.launch_sampler.rays(seed, number, count, part, PARTS)
        n = len(direction)
        start, receiver = np.tile(ping.transmit, (n, 1)), np.tile(ping.receive, (n, 1))
        zeros = np.zeros(n)
        rays = RayBundle(
            "", start, direction, zeros, zeros, direction, solid_angle, np.ones(n), receiver, np.zeros((n, 6))
        )
        return rays.take((ping.transmit_beams.gain(direction) ** 2).max(axis=0) > 0)

    def _exact_paths(self, ping: TracedPing) -> list[EchoEnergies]:
        """Echoes of point targets, and boundary echoes."""
        points = [target for target in self.scene.targets if isinstance(target, PointTarget)]
        if "target" not in self.path_settings.contributions:
            points = []
        positions = [self.tracing_scene.to_grid_frame(np.array([target.position])) for target in points]
        exact = [
            echo
            for point, position in zip(points, positions, strict=True)
            for echo in point_echoes(ping, point, position)
        ]
        return [*exact, *boundary_echo_energies(ping)]

    def _launch_sampler(
        self, ping_geometry: PingGeometry, position: Floats, transmit: Beams, receive: Beams,
        laws: Mapping[int, Law | None],
    ) -> LaunchSampler:  # fmt: skip
        """Sampler of launch directions towards scattering boundaries within the recorded window, and towards bodies."""
        bed = self.scene.seabed.depth
        first, last = (self.scene.water.sound_speed * max(delay, 0.0) / 2 for delay in ping_geometry.recorded_delays)
        boundary_paths: list[tuple[PathLength, float, float]] = []
        for kind, letter, contribution, depth in ((BED, "B", "seabed", bed), (SURFACE, "S", "surface", 0.0)):
            if laws[kind] is None or contribution not in self.path_settings.contributions:
                continue
            families = [family for family in self.path_settings.followed_families if not family.endswith(letter)]
            vertical_distances = {family: abs(depth - image_depth(family, position[2], bed)) for family in families}
            for family, vertical_distance in vertical_distances.items():
                # The receive leg may be of another family, longer or shorter than the transmit leg.
                near = first - (max(vertical_distances.values()) ** 2 - vertical_distance**2) / (4 * max(first, 1.0))
                far = last + (vertical_distance**2 - min(vertical_distances.values()) ** 2) / (4 * max(last, 1.0))
                vertical_sign = _vertical_sign(family, float(depth - position[2]))
                path_length: PathLength = partial(_straight_path_length, vertical_distance, vertical_sign)
                if self.rays is not None:
                    path_length = partial(self._refracted_path_length, position, bounce_sequence(family) + letter, far)
                boundary_paths.append((path_length, max(near, 0.0), far))
        windows = [*self._body_windows(position, last, transmit, receive)]
        windows += self._overhead_window(position, first, last)
        return launch_sampler(transmit, receive, boundary_paths, windows)

    def _overhead_window(self, position: Floats, first: float, last: float) -> Iterator[tuple[Floats, bool]]:
        """Window for `launch_sampler` about the surface overhead, whose facets return boundary echoes.

        Args:
            position: Position of the sonar [m], shape (3,).
            first: Shortest one-way path that is recorded [m].
            last: Longest one-way path that is recorded [m].
        """
        depth, is_moving = float(position[2]), self.scene.surface.reflection == "statistical"
        is_recorded = first < (1 + MAX_OVERHEAD_TANGENT) * depth and last > depth
        if is_moving and BOUNDARY_ECHO in self.path_settings.contributions and is_recorded:
            sides = -MAX_OVERHEAD_TANGENT, MAX_OVERHEAD_TANGENT
            corners = np.array(np.meshgrid(sides, sides, (-1.0, -1.0))).reshape(3, 8).T
            yield corners, False

    def _refracted_path_length(self, position: Floats, chain: str, farthest: float, directions: Floats) -> Floats:
        """Path length of refracted rays over a flat seabed to the last reflection of a chain [m], shape (n,).

        Infinite for rays that have other reflections.
        """
        water, bed = self.tracing_scene.water, self.scene.seabed.depth
        assert water is not None  # straight rays have `_straight_path_length`
        knot_count = int(np.searchsorted(water.depth, bed, side="right"))
        origin, length = np.tile(position, (len(directions), 1)), np.zeros(len(directions))
        reaches_all = np.ones(len(directions), bool)
        for letter in chain:
            layers = SoundSpeedLayers(water.depth[:knot_count], water.speed[:knot_count])
            hits = open_water_hits(origin, directions, farthest, bed, layers)
            reaches_all &= hits.kind == (BED if letter == "B" else SURFACE)
            origin, length = hits.position, length + hits.distance
            directions = hits.direction * np.array([1, 1, -1])
        return np.where(reaches_all, length, np.inf)

    def _body_windows(
        self, position: Floats, last: float, transmit: Beams, receive: Beams
    ) -> Iterator[tuple[Floats, bool]]:
        """Windows for `launch_sampler`: vectors to the corners of bodies' bounding boxes, and True where z is reversed.

        Args:
            position: Position of the sonar in the scatterer grid's frame [m], shape (3,).
            last: Longest one-way path that is recorded [m].
            transmit: Transmit beams in that frame.
            receive: Receive beams in that frame.

        Yields:
            Vectors from the sonar's image to the 8 corners [m], or launch directions of refracted rays [1], shape
            (k, 3); True if the reflections of the family reverse the vertical component.
        """
        min_gain, remaining = 10 ** (self.path_settings.beam_cutoff_db / 10), MAX_WINDOWS
        for body in self.scene.occluders if "target" in self.path_settings.contributions else ():
            surface = self.tracing_scene.to_grid_frame(world_triangles(body, self.scene.seabed).vertices)
            corners = np.array(np.meshgrid(*zip(surface.min(axis=0), surface.max(axis=0), strict=True)))
            for family in self.path_settings.followed_families:
                image = np.array([position[0], position[1], image_depth(family, position[2], self.scene.seabed.depth)])
                corner_rays = corners.reshape(3, 8).T - image
                is_flipped = len(bounce_sequence(family)) % 2 == 1
                directions = np.vstack([corner_rays, corner_rays.mean(axis=0)])
                directions *= np.array([1, 1, -1 if is_flipped else 1])
                slant_range = np.linalg.norm(directions, axis=1)
                directions /= np.maximum(slant_range, 1e-9)[:, None]
                gain = np.max(transmit.gain(directions) ** 2 * np.max(receive.gain(directions) ** 2, axis=0))
                if slant_range.min() <= last and gain > min_gain and remaining:
                    remaining -= 1
                    yield from self._refracted_windows(position, family, corners, corner_rays, is_flipped)

    def _refracted_windows(
        self, position: Floats, family: str, corners: Floats, corner_rays: Floats, is_flipped: bool
    ) -> Iterator[tuple[Floats, bool]]:
        """Departures of rays of a family towards the corners of a bounding box; straight ones in water of one speed."""
        if self.rays is None:
            yield corner_rays, is_flipped
            return
        ends = corners.reshape(3, 8).T.copy()
        ends[:, 2] = np.clip(ends[:, 2], 0.0, self.scene.seabed.depth)
        points = Scatterers(
            "target", "target", PointTargetLaw(0.0), ends, np.zeros((8, 3)), np.ones(8), np.ones(8, complex),
            np.zeros(8, np.uint64),
        )  # fmt: skip
        legs = self.rays.open_water().legs(position, points, (family,), AIM_FREQUENCY)
        for row in range(len(legs.families)):
            reached = legs.departure[row][legs.status[row] == LegStatus.CLEAR]
            if len(reached):
                yield reached, False


def _straight_path_length(vertical_distance: float, vertical_sign: float, directions: Floats) -> Floats:
    """Slant range at which straight rays have risen or fallen by a vertical distance [m], shape (n,).

    Args:
        vertical_distance: The vertical distance [m].
        vertical_sign: Sign of their vertical direction at the sonar: 1 downwards, -1 upwards.
        directions: Their directions [1], shape (n, 3).
    """
    down = directions[:, 2]
    with np.errstate(divide="ignore"):
        return np.asarray(np.where(vertical_sign * down > 0, vertical_distance / (vertical_sign * down), np.inf))


def _vertical_sign(family: str, vertical_offset: float) -> float:
    """Sign of the vertical direction in which rays of a family leave: 1 downwards, -1 upwards."""
    if bounce_sequence(family):
        return 1.0 if bounce_sequence(family)[0] == "B" else -1.0
    return 1.0 if vertical_offset > 0 else -1.0
