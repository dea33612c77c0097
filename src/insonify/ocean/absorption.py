"""Absorption of sound in sea water.

Salt makes the sea deaf long before water does: boric acid relaxes below about 10 kHz,
magnesium sulphate up to about 500 kHz; above that, water itself is viscous. Each
published law of these three has a file of its own; this one asks the law by name.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.ocean.francois_garrison import francois_garrison_db_per_km

MODELS: dict[str, Callable[..., NDArray[np.float64]]] = {"francois-garrison": francois_garrison_db_per_km}
"""Published laws by name; each takes (frequency, temperature, salinity, depth, ph) and gives dB/km."""


def absorption_db_per_m(
    frequency: ArrayLike,
    *,
    temperature: ArrayLike = 10.0,
    salinity: ArrayLike = 35.0,
    depth: ArrayLike = 0.0,
    ph: ArrayLike = 8.0,
    model: str = "francois-garrison",
) -> NDArray[np.float64]:
    """Energy that sea water takes from the wave along each metre of its way [dB/m].

    Args:
        frequency: Frequency [Hz], any shape.
        temperature: Temperature [degC], broadcast against frequency, as are the rest.
        salinity: Salinity [g/kg].
        depth: Depth below the mean surface, positive down [m].
        ph: Acidity [1].
        model: Name of the law, one of `MODELS`; its file states source and validity.

    Returns:
        One-way loss per metre [dB/m], broadcast shape of the arguments.

    Raises:
        ValueError: There is no law of that name.
    """
    if model not in MODELS:
        raise ValueError(f"model is {model!r}; the absorption laws available are: {', '.join(MODELS)}")
    return np.asarray(MODELS[model](frequency, temperature, salinity, depth, ph) / 1e3)
