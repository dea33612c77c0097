"""Absorption of sound in sea water.

Two salts absorb sound by relaxation: boric acid below about 10 kHz, magnesium sulphate up to
about 500 kHz; above that, the viscosity of water dominates. Each published law of these three
contributions has a file of its own; this one selects the law by name.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.ocean.ainslie_mccolm import ainslie_mccolm_db_per_km
from insonify.ocean.francois_garrison import francois_garrison_db_per_km
from insonify.ocean.sea_water_checks import checked_depth, checked_temperature_and_salinity
from insonify.units import amplitude_ratio
from insonify.validity import require_numbers

MODELS: dict[str, Callable[..., NDArray[np.float64]]] = {
    "francois-garrison": francois_garrison_db_per_km,
    "ainslie-mccolm": ainslie_mccolm_db_per_km,
}
"""Published laws by name; each takes (frequency, temperature, salinity, depth, ph) and gives dB/km."""


def absorption_db_per_m(
    frequency: ArrayLike, *, temperature: ArrayLike = 10.0, salinity: ArrayLike = 35.0, depth: ArrayLike = 0.0,
    ph: ArrayLike = 8.0, model: str = "francois-garrison",
) -> NDArray[np.float64]:  # fmt: skip
    """Absorption coefficient of sea water [dB/m].

    Args:
        frequency: Frequency [Hz], any shape.
        temperature: Temperature [degC]; all arguments broadcast.
        salinity: Salinity [g/kg].
        depth: Depth below the mean surface, positive down [m].
        ph: Acidity [1].
        model: Name of the law, one of `MODELS`; its file states source and validity.

    Returns:
        One-way loss per metre [dB/m], broadcast shape of the arguments.

    Raises:
        ValueError: The model is unknown, or an argument is not a number or not possible in water.

    Example:
        >>> (1e3 * absorption_db_per_m([10e3, 100e3, 500e3], temperature=10.0, salinity=35.0)).round().tolist()  # dB/km
        [1.0, 34.0, 125.0]
    """
    if model not in MODELS:
        raise ValueError(f"model is {model!r}; the absorption laws available are: {', '.join(MODELS)}")
    tone, acidity = require_numbers("frequency", frequency, "Hz", 0.0), require_numbers("ph", ph, "", 0.0, 14.0)
    (t, s), z = checked_temperature_and_salinity(temperature, salinity), checked_depth(depth)
    return np.asarray(MODELS[model](tone, t, s, z, acidity) / 1e3)


def absorption_filter(
    frequency: ArrayLike, path_length: ArrayLike, *, centre_frequency: float | None = None,
    temperature: ArrayLike = 10.0, salinity: ArrayLike = 35.0, depth: ArrayLike = 0.0, ph: ArrayLike = 8.0,
    model: str = "francois-garrison",
) -> NDArray[np.float64]:  # fmt: skip
    """Frequency response of absorption over a path [1].

    One absorption value for the whole band of a chirp would miss the larger loss of its upper end.

    Args:
        frequency: Frequency [Hz], any shape.
        path_length: Length of the two-way path through the water [m]; all arguments broadcast.
        centre_frequency: Frequency at which the response is 1 [Hz], where the loss at that frequency is
            applied separately; None gives the whole loss.
        temperature: Temperature [degC].
        salinity: Salinity [g/kg].
        depth: Mean depth of the path [m].
        ph: Acidity [1].
        model: Name of the law, one of `MODELS`.

    Returns:
        Factor on the pressure spectrum, real and positive, broadcast shape of the arguments.
        No phase: the two relaxations also change the sound speed, by 0.03 m/s in all.

    Example:
        >>> response = absorption_filter([300e3, 450e3, 600e3], 100.0, centre_frequency=450e3)
        >>> (20 * np.log10(response)).round(1).tolist()  # dB
        [3.7, 0.0, -5.0]
    """
    length = require_numbers("path_length", path_length, "m", 0.0)
    water = {"temperature": temperature, "salinity": salinity, "depth": depth, "ph": ph}
    loss = absorption_db_per_m(frequency, model=model, **water)
    if centre_frequency is not None:
        loss = loss - absorption_db_per_m(centre_frequency, model=model, **water)
    with np.errstate(over="ignore"):  # far below the centre frequency the factor may overflow
        return amplitude_ratio(-loss * length)
