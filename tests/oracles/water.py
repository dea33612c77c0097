"""Paths between two flat boundaries, folded one bounce at a time, and boxes in their way.

The scatterer is mirrored, never the source; the path is then walked from the sonar, turning at each boundary.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Path:
    """One folded path: its corners from sonar to point, its length and its two ends' directions."""

    corners: np.ndarray
    length: float
    departure: np.ndarray
    arrival: np.ndarray

    @property
    def sine(self) -> float:
        """Sine of the grazing angle at every level boundary."""
        return abs(self.departure[2])


def letters(family):
    """Boundaries in the order reached, from the sonar outward."""
    return "" if family == "D" else family


def fold(source, point, family, water_depth):
    """The path of one family, as a polyline of shape (bounces + 2, 3)."""
    source, point = np.asarray(source, float), np.asarray(point, float)
    image = point.copy()
    for letter in reversed(letters(family)):
        image[2] = -image[2] if letter == "S" else 2 * water_depth - image[2]
    way = image - source
    corners, heading, here = [source], way.copy(), source.copy()
    travelled = 0.0
    for letter in letters(family):
        level = 0.0 if letter == "S" else water_depth
        step = (level - here[2]) / heading[2]
        here = here + step * heading
        travelled += step
        corners.append(here)
        heading = heading * np.array([1, 1, -1])
    corners.append(here + (1 - travelled) * heading)
    length = float(np.linalg.norm(way))
    return Path(np.array(corners), length, way / length, heading / length)


@dataclass(frozen=True)
class Block:
    """An upright box: centre of its footprint, heading, half sides, depths of top and base."""

    centre: tuple
    heading: float
    half: tuple
    top: float
    base: float

    def within(self, place):
        """Places in the box's own axes, from its middle, in half sides: inside where all are below 1."""
        c, s = np.cos(self.heading), np.sin(self.heading)
        north, east, depth = (np.asarray(place, float) - [*self.centre, (self.top + self.base) / 2]).T
        along, across = c * north + s * east, c * east - s * north
        return np.stack([along / self.half[0], across / self.half[1], depth / ((self.base - self.top) / 2)], axis=-1)


def deepest(path, block, samples=4000):
    """How far inside the box a path gets, by walking along it: below 1 it has been inside (any step of the way)."""
    part = np.linspace(0, 1, samples)[:, None]
    walked = np.concatenate([a + part * (b - a) for a, b in zip(path.corners[:-1], path.corners[1:], strict=True)])
    return float(np.abs(block.within(walked)).max(axis=1).min())


def cut(path, block, margin=1e-9):
    """True where some segment has more than a touch inside the box, by clipping each segment to three slabs."""
    for a, b in zip(block.within(path.corners[:-1]), block.within(path.corners[1:]), strict=True):
        low, high = 0.0, 1.0
        for start, step in zip(a, b - a, strict=True):
            if abs(step) < 1e-14:
                if abs(start) >= 1:
                    high = -1.0
                continue
            ends = sorted(((-1 - start) / step, (1 - start) / step))
            low, high = max(low, ends[0]), min(high, ends[1])
        if high - low > margin:
            return True
    return False
