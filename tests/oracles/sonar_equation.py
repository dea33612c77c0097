"""The sonar equation for a flat Lambert bed.

Direct paths and two equal uniform lines, in closed form and quadrature.
"""

import numpy as np

from oracles.time_series import pulse_spectrum


def pulse_energy(*, duration, fraction, band, bandwidth=0.0, matched_filter=False):
    """Integral of the recorded pulse's square magnitude [s], by Parseval over the band."""
    offset = np.linspace(-0.625, 0.625, 2001) * band
    received = pulse_spectrum(offset, duration=duration, fraction=fraction, bandwidth=bandwidth, band=band,
                           matched_filter=matched_filter)  # fmt: skip
    return np.trapezoid(np.abs(received) ** 2, offset)


def energy_width(cosine, length, wavelength):
    """Integral over azimuth of the two-way power of two uniform lines [rad], at the cosine of the elevation."""
    azimuth = np.linspace(-np.pi / 2, np.pi / 2, 400_001)
    power = np.sinc(length / wavelength * np.multiply.outer(np.atleast_1d(cosine), np.sin(azimuth))) ** 4
    return np.trapezoid(power, azimuth, axis=-1)


def bed_reverberation(time, *, level_db, strength_db, height, speed, absorption, duration, energy, length, wavelength):
    """Mean-square pressure of the bed's echo [uPa^2]: SL - 2 TL + S + 10 log A.

    mu sin^2(theta) / R^4 over an annulus c T / 2 (R / x) deep and x times the energy width wide.
    """
    slant = speed * (time - duration / 2) / 2  # the echo's centre of energy stands half a pulse after its delay
    sine, cosine = height / slant, np.sqrt(1 - (height / slant) ** 2)
    width = np.interp(cosine, grid := np.linspace(cosine.min(), 1, 5), energy_width(grid, length, wavelength))
    area = speed * energy / 2 * slant * width
    lost = slant**4 * 10 ** (2 * absorption * slant / 10)
    return 10 ** ((level_db + strength_db) / 10) * sine**2 * area / lost
