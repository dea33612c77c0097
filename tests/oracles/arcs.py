"""Rays in water whose sound speed grows evenly with depth: arcs of circles, in closed form by Snell's constant.

Legs that go one way between their bounces, so that depth gives where a ray is. Shares no code with the project.
Source: arcs of constant gradient, as in Urick (1983), Principles of Underwater Sound, ch. 5; not verified.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.optimize import brentq


@dataclass(frozen=True)
class Arcs:
    """Water of speed c0 + g z between the surface and a flat bed."""

    surface_speed: float
    gradient: float
    depth: float

    def speed(self, z):
        """Sound speed at a depth [m/s]."""
        return self.surface_speed + self.gradient * z

    def sine(self, p, z):
        """Sine of the grazing angle of a ray of Snell's constant p [s/m] at a depth."""
        return np.sqrt(1 - (p * self.speed(z)) ** 2)

    def run(self, p, depths):
        """Horizontal distance along a ray that reaches these depths in turn [m]."""
        if self.gradient == 0:
            c = self.surface_speed
            return sum(abs(b - a) for a, b in pairwise(depths)) * p * c / self.sine(p, 0.0)
        return sum(abs(self.sine(p, a) - self.sine(p, b)) / (p * abs(self.gradient)) for a, b in pairwise(depths))

    def time(self, p, depths):
        """Travel time along it [s]."""
        if self.gradient == 0:
            c = self.surface_speed
            return sum(abs(b - a) for a, b in pairwise(depths)) / (c * self.sine(p, 0.0))
        logs = [np.log((1 + self.sine(p, z)) / self.speed(z)) for z in depths]
        return sum(abs(b - a) for a, b in pairwise(logs)) / abs(self.gradient)

    def turns(self, family, source, point):
        """Depths of both ends and of the bounces between, in turn."""
        bounces = [] if family == "D" else [0.0 if letter == "S" else self.depth for letter in family]
        return [source, *bounces, point]

    def steepness(self, depths, distance):
        """Snell's constant of the ray that reaches these depths in turn over a distance [s/m]; None: no straight one.

        The farther it goes, the flatter it is, up to the one that grazes the fastest depth it reaches.
        """
        flattest = (1 - 1e-12) / max(self.speed(z) for z in depths)
        if self.run(flattest, depths) < distance:
            return None
        return brentq(lambda p: self.run(p, depths) - distance, 1e-9, flattest, xtol=1e-18, rtol=1e-14)
