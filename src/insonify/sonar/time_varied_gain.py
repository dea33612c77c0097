"""Gain that grows with range by the law of spreading and absorption."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

MIN_RANGE = 1.0
"""Range below which the gain is that at this range [m]."""


def tvg_db(slant_range: Floats, db_per_decade: float, *, absorption_db_per_m: float = 0.0) -> Floats:
    """Time-varied gain by the law of spreading and absorption [dB].

    Args:
        slant_range: Slant range [m], any shape; below 1 m the gain is that at 1 m.
        db_per_decade: Growth of the gain for each tenfold range, such as 20, 30 or 40 [dB].
        absorption_db_per_m: One-way absorption of the water [dB/m].

    Returns:
        Gain [dB], 0 at 1 m but for absorption, shape of `slant_range`.

    Source: sonar equation; Urick (1983), Principles of Underwater Sound, ch. 2 and 8: 40 log R for a point, 30 log R
    for a seabed whose insonified area grows with range.

    Example:
        >>> tvg_db(np.array([1.0, 10.0, 100.0]), 40.0, absorption_db_per_m=0.03).round(1).tolist()
        [0.1, 40.6, 86.0]
    """
    distance = np.maximum(slant_range, MIN_RANGE)
    return np.asarray(db_per_decade * np.log10(distance) + 2 * absorption_db_per_m * distance)
