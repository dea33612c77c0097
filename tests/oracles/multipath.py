"""Reverberation of a flat boundary by every pair of folded legs, as one sum over rings of the boundary.

Each pair of families has its own clock: at a time of the recording it receives one ring, whose width and depth follow
from the lengths of both legs. Nothing is sampled, and no code is shared with the project.
"""

from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np

from oracles.water import fold, letters


@dataclass(frozen=True)
class Leg:
    """All legs of one family to the points of one radius."""

    length: np.ndarray
    """From the sonar to the ring [m]."""
    sine: np.ndarray
    """Of the grazing angle, at the ring and at every boundary on the way [1]."""
    power: np.ndarray
    """Intensity at the ring re 1 m, phase aside [1]."""


@dataclass(frozen=True)
class Sonar:
    """Two equal uniform lines at one place, and the pulse as it is recorded."""

    depth: float
    level_db: float
    aperture: float
    """Length over wavelength [1]."""
    energy: float
    """Integral of the recorded pulse's square magnitude [s]."""
    middle: float
    """Centre of energy of the pulse after its start [s]."""


def leg(family, radius, *, source, target, depth, mirror, absorption):
    """The legs of one family from a source depth to the points of a level boundary.

    Args:
        family: Name, bounces from the sonar outward.
        radius: Horizontal distances [m], shape (n,).
        source: Depth of the sonar [m].
        target: Depth of the boundary that scatters [m].
        depth: Depth of the bottom [m].
        mirror: Bottom's coefficient as a function of the sine of the grazing angle.
        absorption: Loss [dB/m].
    """
    walked = [fold((0, 0, source), (x, 0, target), family, depth) for x in radius]
    length = np.array([path.length for path in walked])
    sine = np.array([path.sine for path in walked])
    bounced = np.abs(mirror(sine)) ** (2 * letters(family).count("B"))
    return Leg(length, sine, bounced / length**2 * 10 ** (-absorption * length / 10))


def ring_width(out, back, radius, aperture):
    """Energy width of the ring that both legs see [m]: radius times the integral of both beams' power."""
    azimuth = np.linspace(-np.pi / 2, np.pi / 2, 8_001)
    cosines = [radius / leg.length for leg in (out, back)]
    rows = []
    for x, first, second in zip(radius, *cosines, strict=True):
        seen = np.sinc(aperture * first * np.sin(azimuth)) * np.sinc(aperture * second * np.sin(azimuth))
        rows.append(x * np.trapezoid(seen**2, azimuth))
    return np.array(rows)


def pair_intensity(time, pair, sonar, *, strength_db, speed, span, **water):
    """Mean-square pressure that one pair of families brings, both orders together [uPa^2].

    Legs out and back by one way have a clock of their own and add as energy; the two orders of a mixed pair
    arrive together from each point, (2 A)^2, four times the energy of one.

    Args:
        time: Time of each sample of the recording [s].
        pair: Two families.
        sonar: The sonar.
        strength_db: Lambert's strength [dB].
        speed: Speed of sound [m/s].
        span: Least and largest radius considered [m].
        water: For `leg`.
    """
    radius = np.geomspace(*span, 60)
    out, back = (leg(family, radius, source=sonar.depth, **water) for family in pair)
    clock = (out.length + back.length) / speed
    depth_of_ring = speed / (radius / out.length + radius / back.length)
    scattered = 10 ** ((sonar.level_db + strength_db) / 10) * out.sine * back.sine * out.power * back.power
    echo = scattered * ring_width(out, back, radius, sonar.aperture) * depth_of_ring * sonar.energy
    both = 1 if pair[0] == pair[1] else 4
    return both * np.exp(np.interp(np.asarray(time) - sonar.middle, clock, np.log(echo)))


def reverberation(time, families, sonar, **water):
    """Sum over all unordered pairs of families [uPa^2], shape of time."""
    return sum(pair_intensity(time, pair, sonar, **water) for pair in combinations_with_replacement(families, 2))
