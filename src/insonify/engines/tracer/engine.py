"""The tracer: rays of the transmit beam, followed from mirror to mirror; at every hit, what of it gets back.

A ray stands for a solid angle. Where it meets the bed, the surface or a body, the law there scatters some of it
towards the receiver, by every family of mirrors that leads back; the rest of its way is the mirror's. What an
interface mirrors is carried by the ray that goes on, what it scatters by the way back: nothing by both. How this
engine finds its paths shares nothing with the other one.

Expected intensities only, in water of one sound speed. Shadows end hard.
"""

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from insonify.engines.tracer._trace_kernel import BED, SURFACE
from insonify.engines.tracer.bundle import Ping, Rays
from insonify.engines.tracer.connection import echoes, point_echoes
from insonify.engines.tracer.course import course
from insonify.engines.tracer.launch import Fan, fan
from insonify.engines.tracer.mirrors import folded, letters
from insonify.engines.tracer.world import World, frame
from insonify.propagation.choice import PathChoice
from insonify.records.echoes import Echoes
from insonify.scene.scene import Scene
from insonify.scene.solid import world_triangles
from insonify.scene.target import PointTarget
from insonify.sonar.beam import Beams
from insonify.sonar.stance import Stance

Floats = NDArray[np.float64]

PARTS = 16
"""Parts that a ping's rays are shared into: fixed, so that sums do not depend on the number of threads."""
MOST_WINDOWS = 64
"""Bodies times families that rays are aimed at [1]."""
NEPER = np.log(10) / 10

Block = Callable[[], list[Echoes]]


class Tracer:
    """The engine for one scene and one choice of paths."""

    def __init__(self, scene: Scene, choice: PathChoice, seed: int) -> None:
        """Make a scene ready for rays.

        Args:
            scene: What is traced.
            choice: Families, number of rays, what faces mirror.
            seed: Of the scenario.

        Raises:
            ValueError: The scene asks for what straight rays cannot tell; with the way out.
        """
        if scene.water.layered:
            raise ValueError(
                "paths.engine is tracer, whose rays are straight, but water.profile bends them. Write engine: paths, "
                "or give the water one sound_speed."
            )
        self.scene, self.choice, self.seed = scene, choice, seed
        self.world = World(scene)

    def blocks(self, stance: Stance, *, even: bool = True) -> list[Block]:
        """The rays of one ping, in parts that are traced when they are called.

        Args:
            stance: The sonar at this ping.
            even: Rays know expectations only; drawn scatterers are the other engine's.

        Returns:
            Blocks in a fixed order, however many threads will trace them.
        """
        if not even:
            raise ValueError("the tracer has no phases: write field: incoherent, or paths.engine: paths")
        ping = self.ping(stance)
        return [*(partial(self._trace, ping, part) for part in range(PARTS)), partial(self._points, ping)]

    def pairs(self, stance: Stance, block: Block) -> list[Echoes]:
        """What comes back of one block.

        Args:
            stance: The sonar at this ping.
            block: One of `blocks(stance)`.
        """
        return block()

    def ping(self, stance: Stance) -> Ping:
        """One ping in the lattice's frame.

        Args:
            stance: The sonar at this ping.
        """
        scene, turn = self.scene, frame(self.world.lattice).T
        transmit, receive = (self.world.placed(place) for place in (stance.transmit_place, stance.receive_place))
        sending, hearing = (one.turned(one.axes @ turn) for one in (stance.transmit_beams, stance.receive_beams))
        speed = scene.water.sound_speed
        laws = {
            BED: scene.seabed.law(stance.frequency, speed),
            SURFACE: scene.surface.law(stance.frequency),
        }
        heard = speed * max(stance.heard_delays[1], 0.0) / 2 + float(np.linalg.norm(transmit - receive))
        thrown = self._fan(stance, transmit, sending, hearing, {k for k, law in laws.items() if law is not None})
        sheet = self.world.sheet(transmit, 2 * heard)
        attenuation = float(scene.water.absorption(stance.frequency)) * NEPER
        return Ping(scene, self.choice, stance, sheet, thrown, transmit, receive, sending, hearing, laws, attenuation)

    def _trace(self, ping: Ping, part: int) -> list[Echoes]:
        """All that comes back of one part of the rays."""
        way, solid_angle = ping.fan.rays(self.seed, ping.stance.ping, self.choice.rays, part, PARTS)
        n = len(way)
        start = np.tile(ping.transmit, (n, 1))
        rays = Rays("", start, way, np.zeros(n), way, solid_angle, np.ones(n))
        loud = (ping.transmit_beams.gain(way) ** 2).max(axis=0) > 0
        return [echo for hits in course(ping, rays.take(loud)) for echo in echoes(ping, hits)]

    def _points(self, ping: Ping) -> list[Echoes]:
        """All that comes back of point targets."""
        points = [target for target in self.scene.targets if isinstance(target, PointTarget)]
        if "target" not in self.choice.causes:
            return []
        places = [self.world.placed(np.array([target.position])) for target in points]
        return [echo for one, place in zip(points, places, strict=True) for echo in point_echoes(ping, one, place)]

    def _fan(self, stance: Stance, place: Floats, transmit: Beams, receive: Beams, answering: set[int]) -> Fan:
        """How rays are thrown: over the boundaries that answer, as far as is heard, and at bodies."""
        bed = self.scene.seabed.depth
        first, last = (self.scene.water.sound_speed * max(delay, 0.0) / 2 for delay in stance.heard_delays)
        reaches: list[tuple[float, float, float, float]] = []
        for kind, letter, cause, depth in ((BED, "B", "seabed", bed), (SURFACE, "S", "surface", 0.0)):
            if kind not in answering or cause not in self.choice.causes:
                continue
            ways = [family for family in self.choice.followed if not family.endswith(letter)]
            climbs = {family: abs(depth - folded(family, place[2], bed)) for family in ways}
            for family, climb in climbs.items():
                # The way back may be by another family, longer or shorter than the way out.
                near = first - (max(climbs.values()) ** 2 - climb**2) / (4 * max(first, 1.0))
                far = last + (climb**2 - min(climbs.values()) ** 2) / (4 * max(last, 1.0))
                reaches.append((climb, _sense(family, float(depth - place[2])), max(near, 0.0), far))
        return fan(transmit, receive, reaches, list(self._sights(place, last, transmit, receive)))

    def _sights(self, place: Floats, last: float, transmit: Beams, receive: Beams) -> Iterator[tuple[Floats, bool]]:
        """Every body as each family sees it: rays to the corners around it, and whether their sense is turned."""
        floor, left = 10 ** (self.choice.beam_floor_db / 10), MOST_WINDOWS
        for body in self.scene.occluders if "target" in self.choice.causes else ():
            surface = self.world.placed(world_triangles(body, self.scene.seabed).vertices)
            corners = np.array(np.meshgrid(*zip(surface.min(axis=0), surface.max(axis=0), strict=True)))
            for family in self.choice.followed:
                image = np.array([place[0], place[1], folded(family, place[2], self.scene.seabed.depth)])
                rays = corners.reshape(3, 8).T - image
                turned = len(letters(family)) % 2 == 1
                ways = np.vstack([rays, rays.mean(axis=0)]) * np.array([1, 1, -1 if turned else 1])
                reach = np.linalg.norm(ways, axis=1)
                ways /= np.maximum(reach, 1e-9)[:, None]
                loud = np.max(transmit.gain(ways) ** 2 * np.max(receive.gain(ways) ** 2, axis=0))
                if reach.min() <= last and loud > floor and left:
                    left -= 1
                    yield rays, turned


def _sense(family: str, below: float) -> float:
    """Whether rays of a family leave downwards (1) or upwards (-1)."""
    if letters(family):
        return 1.0 if letters(family)[0] == "B" else -1.0
    return 1.0 if below > 0 else -1.0
