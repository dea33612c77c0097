"""Absorption of sea water: Francois and Garrison's law of 1982.

The sum of three contributions, each with its strength A, its pressure correction P and, for the
two salts, the relaxation frequency.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.validity import warn_outside

Floats = NDArray[np.float64]

LAW = "Francois & Garrison (1982) absorption"
KELVIN = 273.0
"""Absolute temperature of 0 degC, rounded as in the paper [K]."""


def francois_garrison_db_per_km(
    frequency: ArrayLike, temperature: ArrayLike, salinity: ArrayLike, depth: ArrayLike, ph: ArrayLike
) -> Floats:
    """Absorption of boric acid, magnesium sulphate and pure water [dB/km].

    Args:
        frequency: Frequency [Hz], any shape.
        temperature: Temperature [degC]; all arguments broadcast.
        salinity: Salinity [g/kg].
        depth: Depth [m].
        ph: Acidity [1].

    Returns:
        One-way loss per kilometre [dB/km], broadcast shape of the arguments.

    Source: Francois & Garrison (1982), J. Acoust. Soc. Am. 72(3), 896-907 (part I, water and
    magnesium sulphate) and 72(6), 1879-1890 (part II, boric acid and the total). Checked
    against the printed Table IV of part II, 0.4 kHz to 1 MHz.
    Valid: about 5 % for 200 Hz to 1 MHz; up to 500 kHz, where the salts dominate, -2..22 degC,
    30..35 g/kg, 0..3.5 km; above it, where pure water dominates, 0..30 degC, 0..40 g/kg, 0..10 km. The
    ranges are quoted from secondary summaries of the papers; acidity has no stated limit.
    """
    _warn(frequency, temperature, salinity, depth)
    f = np.asarray(frequency, dtype=float) / 1e3  # the paper's kHz
    t, s, z, acidity = (np.asarray(a, dtype=float) for a in (temperature, salinity, depth, ph))
    return np.asarray(_boric_acid(f, t, s, z, acidity) + _magnesium_sulphate(f, t, s, z) + _pure_water(f, t, z))


def _boric_acid(f: Floats, t: Floats, s: Floats, z: Floats, ph: Floats) -> Floats:
    """Absorption by boric acid [dB/km], A1 P1 with P1 = 1; arguments in the paper's units, f in kHz."""
    strength = 8.86 / _sound_speed(t, s, z) * 10 ** (0.78 * ph - 5)
    relaxation = 2.8 * np.sqrt(s / 35) * 10 ** (4 - 1245 / (t + KELVIN))
    return strength * _relaxation_term(f, relaxation)


def _magnesium_sulphate(f: Floats, t: Floats, s: Floats, z: Floats) -> Floats:
    strength = 21.44 * s / _sound_speed(t, s, z) * (1 + 0.025 * t)
    pressure_correction = 1 - 1.37e-4 * z + 6.2e-9 * z**2
    relaxation = 8.17 * 10 ** (8 - 1990 / (t + KELVIN)) / (1 + 0.0018 * (s - 35))
    return strength * pressure_correction * _relaxation_term(f, relaxation)


def _pure_water(f: Floats, t: Floats, z: Floats) -> Floats:
    # The paper fits two cubics; they agree at 20 degC to 0.05 %.
    cold = 4.937e-4 - 2.59e-5 * t + 9.11e-7 * t**2 - 1.50e-8 * t**3
    warm = 3.964e-4 - 1.146e-5 * t + 1.45e-7 * t**2 - 6.5e-10 * t**3
    pressure_correction = 1 - 3.83e-5 * z + 4.9e-10 * z**2
    return np.where(t <= 20, cold, warm) * pressure_correction * f**2


def _relaxation_term(f: Floats, relaxation: Floats) -> Floats:
    """Relaxation term f_r f^2 / (f_r^2 + f^2) [kHz]."""
    # Fresh water has no boric acid: both frequencies may be 0, and then so is the loss.
    return relaxation * f**2 / np.maximum(relaxation**2 + f**2, np.finfo(float).tiny)


def _sound_speed(t: Floats, s: Floats, z: Floats) -> Floats:
    """Sound speed of the paper, for use inside the absorption law only [m/s]."""
    return 1412 + 3.21 * t + 1.19 * s + 0.0167 * z


def _warn(frequency: ArrayLike, temperature: ArrayLike, salinity: ArrayLike, depth: ArrayLike) -> None:
    warn_outside(LAW, "frequency", frequency, 200.0, 1e6, "Hz")
    salts_dominate = bool(np.any(np.asarray(frequency, dtype=float) <= 500e3))
    warn_outside(LAW, "temperature", temperature, *((-2.0, 22.0) if salts_dominate else (0.0, 30.0)), "degC")
    warn_outside(LAW, "salinity", salinity, *((30.0, 35.0) if salts_dominate else (0.0, 40.0)), "g/kg")
    warn_outside(LAW, "depth", depth, 0.0, 3500.0 if salts_dominate else 10e3, "m")
