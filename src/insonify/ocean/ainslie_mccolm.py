"""Simplified absorption of sea water: Ainslie and McColm's law of 1998.

The data and the three contributions are Francois and Garrison's, each with the fewest terms.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.validity import warn_outside

LAW = "Ainslie & McColm (1998) absorption"


def ainslie_mccolm_db_per_km(
    frequency: ArrayLike, temperature: ArrayLike, salinity: ArrayLike, depth: ArrayLike, ph: ArrayLike
) -> NDArray[np.float64]:
    """Absorption of boric acid, magnesium sulphate and pure water, in few terms [dB/km].

    Args:
        frequency: Frequency [Hz], any shape.
        temperature: Temperature [degC]; all arguments broadcast.
        salinity: Salinity [g/kg].
        depth: Depth [m].
        ph: Acidity [1].

    Returns:
        One-way loss per kilometre [dB/km], broadcast shape of the arguments.

    Source: Ainslie & McColm (1998), J. Acoust. Soc. Am. 103(3), 1671-1672.
    Valid: within 10 % of Francois & Garrison (1982) for 100 Hz to 1 MHz, and one at a time -6..35 degC,
    5..50 g/kg, 0..7 km, pH 7.7..8.3, the others at 10 degC (35 g/kg, surface, pH 8).
    """
    warn_outside(LAW, "frequency", frequency, 100.0, 1e6, "Hz")
    warn_outside(LAW, "temperature", temperature, -6.0, 35.0, "degC")
    warn_outside(LAW, "salinity", salinity, 5.0, 50.0, "g/kg")
    warn_outside(LAW, "depth", depth, 0.0, 7e3, "m")
    warn_outside(LAW, "acidity", ph, 7.7, 8.3, "")
    f = np.asarray(frequency, dtype=float) / 1e3  # the paper's kHz
    z = np.asarray(depth, dtype=float) / 1e3  # the paper's km
    t, s, acidity = (np.asarray(a, dtype=float) for a in (temperature, salinity, ph))
    boric = 0.106 * _relaxation_term(f, 0.78 * np.sqrt(s / 35) * np.exp(t / 26)) * np.exp((acidity - 8) / 0.56)
    magnesium = 0.52 * (1 + t / 43) * (s / 35) * _relaxation_term(f, 42 * np.exp(t / 17)) * np.exp(-z / 6)
    water = 0.00049 * f**2 * np.exp(-(t / 27 + z / 17))
    return np.asarray(boric + magnesium + water)


def _relaxation_term(f: NDArray[np.float64], relaxation: NDArray[np.float64]) -> NDArray[np.float64]:
    """Relaxation term f_r f^2 / (f_r^2 + f^2) [kHz]."""
    # Fresh water has no boric acid: both frequencies may be 0, and then so is the loss.
    return np.asarray(relaxation * f**2 / np.maximum(relaxation**2 + f**2, np.finfo(float).tiny))
