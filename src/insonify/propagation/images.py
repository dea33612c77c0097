"""Legs in water of one sound speed: straight lines from image sources.

Between two flat boundaries the path of every family unfolds to a straight line from an image of
the sonar (Allen & Berkley 1979, J. Acoust. Soc. Am. 65, 943, for the idea; the paper's figure 10
for the geometry), so delay, directions and spreading are exact.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import Water
from insonify.propagation._cone_kernel import cones
from insonify.propagation._image_kernel import straight_legs
from insonify.propagation.families import bounces, families_for, image_depth
from insonify.propagation.launches import StraightLaunches
from insonify.propagation.rays import Cones, Reach
from insonify.propagation.solids import shade_by_solids
from insonify.records.legs import Legs, Status
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene

Floats = NDArray[np.float64]


def image_legs(
    scene: Scene, place: NDArray[np.float64], scatterers: Scatterers, families: tuple[str, ...], frequency: float, *,
    level: bool = True,
) -> Legs:  # fmt: skip
    """The legs between one end of the sonar and some scatterers.

    Args:
        scene: Water, boundaries and occluders.
        place: North, east, depth of that end [m], shape (3,).
        scatterers: The points to reach, n of them.
        families: Families to follow; those that would count a scatterer twice are left out.
        frequency: Frequency of the absorption [Hz].
        level: Whether the bottom mirrors as its mean plane does; if not, that is left to who knows how its ground
            lies, and bottom bounces count as 1.

    Returns:
        Legs of shape (families kept, n).
    """
    kept = families_for(scatterers.boundary, families)
    f, n = len(kept), len(scatterers)
    delay, length, spreading, absorption, grazing = np.empty((5, f, n))
    departure, arrival = np.empty((2, f, n, 3))
    status, occluder = np.empty((f, n), np.uint8), np.empty((f, n), np.int16)
    depth = scene.seabed.depth
    images = np.array([image_depth(name, place[2], depth) for name in kept])
    strings = [bounces(name) for name in kept]
    count = np.array([len(string) for string in strings])
    starts_up = np.array([string.startswith("S") for string in strings])
    straight_legs(
        place, images, count, starts_up, depth, scene.water.sound_speed, scatterers.position, scatterers.normal,
        scene.bodies, scatterers.occluder, delay, length, spreading, departure, arrival, grazing, status, occluder,
    )  # fmt: skip
    shade_by_solids(scene, place, scatterers, images, count, starts_up, status, occluder)
    np.multiply(length, -_absorbed(scene.water, frequency), out=absorption)
    return Legs(
        families=kept,
        branch=(0,) * f,
        delay=delay,
        length=length,
        spreading=spreading,
        absorption=np.exp(absorption, out=absorption),
        boundary=_boundary(scene, strings, departure[..., 2], level=level),
        caustics=np.zeros((f, n), np.uint8),
        visibility=(status == Status.CLEAR).astype(float),
        departure=departure,
        arrival=arrival,
        grazing=np.arcsin(grazing, out=grazing),
        status=status,
        occluder=occluder,
    )


@lru_cache(maxsize=16)
def _absorbed(water: Water, frequency: float) -> float:
    """What water takes of the logarithm of the pressure [1/m]."""
    return float(np.log(10) / 20 * water.absorption(frequency))


def _boundary(scene: Scene, strings: list[str], sine: NDArray[np.float64], *, level: bool) -> NDArray[np.complex128]:
    """Product of the mirrors' coefficients along each family, shape of `sine`: of the angle with the boundaries."""
    product = np.ones(sine.shape, complex)
    for row, string in enumerate(strings):
        for letter, boundary in (("S", scene.surface), ("B", scene.seabed)):
            if letter in string and (level or letter == "S"):
                # the surface mirrors alike at any angle
                once = boundary.mirror(sine[row] if letter == "S" else np.arcsin(np.minimum(np.abs(sine[row]), 1.0)))
                for _ in range(string.count(letter)):
                    product[row] *= once
    return product


@cones.stand_in
def _cones(
    place: Floats, down: float, centre: Floats, radius: Floats, rise: float, way: Floats, margin: Floats
) -> None:
    """Cones of straight rays to neighbourhoods, as the kernel `cones`."""
    way[:, :2], way[:, 2] = centre - place[:2], down
    length, around = np.sqrt(np.sum(way**2, axis=1)), radius + rise
    way /= length[:, None]
    margin[:] = np.where(around < length, np.arcsin(np.minimum(1.0, around / length)), np.pi)


@dataclass(frozen=True)
class StraightRays:
    """Rays in water of one sound speed."""

    scene: Scene

    def legs(self, place: Floats, scatterers: Scatterers, families: tuple[str, ...], frequency: float) -> Legs:
        """Legs from image sources; see `Rays.legs`. Of ground with relief the coefficient comes later."""
        bed = self.scene.seabed.bed
        level = bed is None or bed.span[0] == bed.span[1]
        return image_legs(self.scene, place, scatterers, families, frequency, level=level)

    def around(self, legs: Legs, place: Floats, scatterers: Scatterers, reach: tuple[float, float]) -> Legs:
        """The legs as they are: spheres about image sources say it all; see `Rays.around`."""
        return legs

    def reach(
        self, depths: tuple[float, float], boundary_depth: float, families: tuple[str, ...],
        delays: tuple[float, float], apart: float, *, rise: float = 0.0,
    ) -> Reach:  # fmt: skip
        """Distances heard, by Pythagoras from the nearest and the farthest image; see `Rays.reach`."""
        middle, bottom = sum(depths) / 2, self.scene.seabed.depth
        climbs = [abs(boundary_depth - image_depth(name, middle, bottom)) for name in families]
        shortest, longest = (self.scene.water.sound_speed * delay for delay in delays)
        # a bounce off ground that stands higher or lower moves the image by twice as much
        moved = [rise * (1 + 2 * name.count("B")) for name in families]
        least, most = (
            choose(climb + side * move for climb, move in zip(climbs, moved, strict=True))
            for side, choose in ((-1, min), (1, max))
        )
        nearest = np.sqrt(max(0.0, max(0.0, shortest - apart) ** 2 - most**2))
        beyond = (longest + apart) ** 2 - max(0.0, least) ** 2
        return Reach(min(climbs), float(nearest), float(np.sqrt(beyond)) if beyond > 0 else -1.0)

    def launches(self, source_depth: float) -> StraightLaunches:
        """Straight ones; see `Rays.launches`."""
        return StraightLaunches(source_depth, self.scene.seabed.depth)

    def cones(
        self, family: str, place: Floats, centre: Floats, radius: Floats, boundary_depth: float, *, rise: float = 0.0
    ) -> Cones:
        """Cones about the straight lines to the centres; see `Rays.cones`."""
        climb = boundary_depth - image_depth(family, place[2], self.scene.seabed.depth)
        turned = -climb if len(bounces(family)) % 2 else climb
        way, margin = np.empty((len(centre), 3)), np.empty(len(centre))
        cones(place, turned, centre, radius, rise, way, margin)
        return Cones(way, margin, np.ones(len(centre), bool))
