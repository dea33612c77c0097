"""The APL-UW handbook's seabed (TR 9407, 1994, eqs. 29-66), one angle at a time, in its own centimetres and degrees.

A second program of the same pages: scalars, no project code. Kirchhoff's constants, the composite level alone, and all.
"""

import cmath
import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Bed:
    """A sediment under sound of one wavenumber, as the handbook counts."""

    rho: float
    """Density ratio."""
    nu: float
    """Speed ratio."""
    delta: float
    """Loss parameter."""
    sigma2: float
    """Volume parameter [1/dB]."""
    gamma: float
    """Spectral exponent."""
    w2: float
    """Spectral strength [cm^4]."""
    k: float
    """Wavenumber of the sound [1/cm]."""


def of_sediment(sediment, frequency, sound_speed):
    """Bed of a project's sediment: metres turned into centimetres by hand, K^-gamma counted in 1/cm."""
    gamma = sediment.spectral_exponent
    w2 = sediment.spectral_strength * 1e8 / 100**gamma
    numbers = sediment.density_ratio, sediment.speed_ratio, sediment.loss, sediment.volume_parameter
    return Bed(*numbers, gamma, w2, 2 * math.pi * frequency / (100 * sound_speed))


def slope(bed):
    """Rms slope of the large scales [rad], eq. 46."""
    a = bed.gamma / 2 - 1
    return math.sqrt((2 * math.pi * bed.w2) ** (1 / a) / (2 * (1 - a)) * (bed.k**2 / a) ** ((1 - a) / a))


def composite(bed, degrees):
    """Cross section of gratings and of the inside, both averaged over slopes and shadowed, eqs. 41-52 and 65-66."""
    return _averaged(bed, _gratings, degrees) + _averaged(bed, _inside, degrees)


def whole(bed, degrees):
    """Cross section of everything, eqs. 35-66."""
    a = bed.gamma / 2 - 1
    cosine = math.cos(math.radians(degrees))
    growth, aa, _ = _kirchhoff_numbers(bed)
    c4 = 1000 ** (1 / (1 + a)) * (aa * growth**2) ** (1 / a)
    x = (cosine - (1 / c4 + 4) ** -0.25) / 0.0125
    y = (math.degrees(math.atan(slope(bed))) - 7) / 0.5
    medium = _f(x) * _kirchhoff(bed, degrees) + (1 - _f(x)) * _averaged(bed, _gratings, degrees)
    rough = _f(y) * medium + (1 - _f(y)) * _large(bed, degrees)
    return rough + _averaged(bed, _inside, degrees)


def _f(x):
    return 1 / (1 + math.exp(max(min(x, 40.0), -40.0)))


def _below(bed, theta):
    """Vertical wavenumber ratio P and reflection R, eqs. 29-33."""
    kappa = (1 + 1j * bed.delta) / bed.nu
    p = cmath.sqrt(kappa**2 - math.cos(theta) ** 2)
    y = bed.rho * math.sin(theta) / p
    return p, (y - 1) / (y + 1)


def _kirchhoff_numbers(bed):
    g, a = math.gamma, bed.gamma / 2 - 1
    structure = 2 * math.pi * bed.w2 * g(2 - a) * 2 ** (-2 * a) / (a * (1 - a) * g(1 + a))
    first = (8 * a * a * g(1 / (2 * a) + 0.5) / (g(0.5) * g(1 / a) * g(1 / (2 * a)))) ** (2 * a)
    second = first ** (0.5 + 1 / (2 * a)) * g(1 / a) / (2 * a)
    return structure * 2 ** (1 - 2 * a) * bed.k ** (2 * (1 - a)), first, second


def _kirchhoff(bed, degrees):
    if degrees < 40:
        return 0.0
    a, theta = bed.gamma / 2 - 1, math.radians(degrees)
    q, first, second = _kirchhoff_numbers(bed)
    spread = math.cos(theta) ** (4 * a) + first * q * q * math.sin(theta) ** 4
    mirror = abs(_below(bed, math.pi / 2)[1]) ** 2
    return second * q * mirror / (8 * math.pi * spread ** ((1 + a) / (2 * a)))


def _gratings(bed, theta):
    s, c2 = math.sin(theta), math.cos(theta) ** 2
    kappa = (1 + 1j * bed.delta) / bed.nu
    p, _ = _below(bed, theta)
    y = ((bed.rho - 1) ** 2 * c2 + bed.rho**2 - kappa**2) / (bed.rho * s + p) ** 2
    wave = math.sqrt(4 * bed.k**2 * c2 + (bed.k / 10) ** 2)
    return 4 * bed.k**4 * s**4 * abs(y) ** 2 * bed.w2 * wave**-bed.gamma


def _inside(bed, theta):
    p, r = _below(bed, theta)
    through = abs(1 - r * r) ** 2 * math.sin(theta) ** 2
    return 5 * bed.delta * bed.sigma2 * through / (bed.nu * math.log(10) * abs(p) ** 2 * p.imag)


def _averaged(bed, law, degrees):
    s = slope(bed)
    total = 0.0
    for weight, place in ((0.295410, 1.224745), (1.181636, 0.0), (0.295410, -1.224745)):
        tilted = min(degrees - math.degrees(s) * place, 90.0)
        total += weight * law(bed, math.radians(max(tilted, 1e-3))) if tilted > 0 else 0.0
    t = math.tan(math.radians(degrees)) / s
    seen = 1.0
    if t <= 2:
        q = (math.exp(-t * t) / math.sqrt(math.pi) - t * (1 - math.erf(t))) / (4 * t)
        seen = (1 - math.exp(-2 * q)) / (2 * q)
    return seen * total / math.sqrt(math.pi)


def _large(bed, degrees):
    s = slope(bed)
    critical = math.degrees(math.acos(1 / bed.nu)) if bed.nu >= 1.001 else 2.5613
    c = 1 + 0.81 * critical**2 / degrees**2
    level = 0.04682 * s**1.25 * bed.nu**3.25 * ((1 - 2 / bed.rho) / bed.nu**2 + 1) ** 2
    level /= 1 + 3.54 * math.degrees(s) / critical
    mirror = abs(_below(bed, math.pi / 2)[1]) ** 2
    nadir = 1 + (degrees - 90) ** 2 / (2.6 * math.degrees(s) ** 2)
    return level * math.sin(math.pi / c) ** (0.7263 * s ** (-1 / 3)) + 0.0260 * mirror / (s * s * nadir**1.9 * c)
