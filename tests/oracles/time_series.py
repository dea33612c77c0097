"""What a sonar receives, written out in float64.

Apertures summed point by point, pulses integrated, echoes added by frequency. Shares no code with the project.
"""

import numpy as np
from scipy.special import roots_legendre

STEPS = 64
NODES, WEIGHTS = roots_legendre(400)


def shading(name, place):
    """Weight along an aperture of unit length."""
    return {
        "uniform": np.ones_like(place),
        "cosine": np.cos(np.pi * place),
        "hann": np.cos(np.pi * place) ** 2,
        "hamming": 0.54 + 0.46 * np.cos(2 * np.pi * place),
    }[name]


def row(extent, elements, name, cosine, steered):
    """Beam of one row of sound: far-field sum over its points, over the sum of the weights.

    Args:
        extent: Length in wavelengths.
        elements: Number of points, None for a continuous aperture (Gauss-Legendre).
        name: Shading.
        cosine: Direction cosine along the row, shape (n,).
        steered: Direction cosine it is steered to.
    """
    if elements is None:
        place, weight = NODES / 2, WEIGHTS / 2 * shading(name, NODES / 2)
    else:
        place = (np.arange(elements) + 0.5) / elements - 0.5
        weight = shading(name, place)
    phase = np.exp(2j * np.pi * extent * np.outer(np.asarray(cosine) - steered, place))
    return (phase @ weight / weight.sum()).real


def tukey(time, duration, fraction):
    """Tukey window over 0..duration that rises and falls in `fraction` of it, both ends together."""
    rise = fraction * duration / 2
    up = 0.5 - 0.5 * np.cos(np.pi * np.clip(time / rise, 0, 1))
    return up * (0.5 - 0.5 * np.cos(np.pi * np.clip((duration - time) / rise, 0, 1)))


def sent(time, duration, fraction, bandwidth):
    """Complex envelope of a tone (bandwidth 0) or of a rising sweep."""
    rate = bandwidth / duration
    return tukey(time, duration, fraction) * np.exp(1j * np.pi * rate * (time - duration / 2) ** 2)


def pulse_spectrum(offset, *, duration, fraction, bandwidth, band, matched_filter):
    """Spectrum of the pulse as recorded [s], by Gauss-Legendre quadrature between the taper's corners."""
    rise = fraction * duration / 2
    panels = max(4, int(4 * (bandwidth + np.abs(offset).max()) * duration / 20))
    knots = np.concatenate([[0], np.linspace(rise, duration - rise, panels), [duration]])
    node, weight = np.polynomial.legendre.leggauss(40)
    span = np.diff(knots)[:, None] / 2
    time = (knots[:-1, None] + span * (node + 1)).ravel()
    value = sent(time, duration, fraction, bandwidth) * (span * weight).ravel()
    passed = np.array([value @ np.exp(-2j * np.pi * f * time) for f in offset])
    if matched_filter:
        energy = np.sum(np.abs(value) ** 2 / (span * weight).ravel())
        passed = np.abs(passed) ** 2 / energy
    outside = np.clip((np.abs(offset) / band - 0.5) / 0.125, 0, 1)
    return passed * 0.5 * (1 + np.cos(np.pi * outside))


def received(delay, weight, time, carrier, spectrum, rate, bins):
    """Sum over echoes of weight p(t - delay) exp(-j 2 pi carrier delay), frequency by frequency.

    Args:
        delay: Delay of each echo [s].
        weight: Amplitude of each echo, without the carrier.
        time: Requested [s].
        carrier: Centre frequency [Hz].
        spectrum: Spectrum of the pulse, a function of the offset from the centre [s].
        rate: Width of the band over which to sum [Hz].
        bins: Frequencies in it: the sum repeats itself after bins / rate.
    """
    carried = weight * np.exp(-2j * np.pi * ((carrier * delay) % 1.0))
    return summed(delay, carried, time, spectrum, rate, bins)


def summed(delay, weight, time, spectrum, rate, bins):
    """Sum over echoes of weight p(t - delay), frequency by frequency; arguments as of `received`."""
    offset = ((np.arange(bins) + 0.5) / bins - 0.5) * rate
    late = delay - np.mean(delay)
    # a frequency is one of a coarse row and a step from it: turns of both, multiplied, are its own to rounding
    rows = -(-bins // STEPS)
    coarse, step = offset[::STEPS], np.arange(STEPS) * rate / bins
    echoes = ((turns(-coarse, late) * weight) @ turns(late, -step)).ravel()
    echoes[:bins] *= spectrum(offset)
    echoes[bins:] = 0
    since = np.asarray(time) - np.mean(delay)
    series = np.sum((turns(since, step) @ echoes.reshape(rows, STEPS).T) * turns(since, coarse), axis=1)
    return series * rate / bins


def turns(first, second):
    """Phasors of so many cycles: of every product of the two."""
    return np.exp(2j * np.pi * np.outer(first, second))


def relative_rms(value, truth):
    """Root mean square difference over root mean square truth."""
    return float(np.linalg.norm(np.ravel(value - truth)) / np.linalg.norm(np.ravel(truth)))
