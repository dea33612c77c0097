"""Gain that grows with range by the law of spreading and absorption."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

NEAREST = 1.0
"""Range below which no gain law is followed any further [m]."""


def tvg_db(slant: Floats, spreading: float, *, absorption_db_per_m: float = 0.0) -> Floats:
    """Time-varied gain by the law of spreading and absorption [dB].

    Args:
        slant: Slant range [m], any shape; below 1 m the law is followed no further.
        spreading: Decibels for each tenfold range, such as 20, 30 or 40.
        absorption_db_per_m: One-way absorption of the water [dB/m].

    Returns:
        Gain [dB], 0 at 1 m but for absorption, shape of `slant`.

    Source: sonar equation; Urick (1983), Principles of Underwater Sound, ch. 2 and 8: 40 log R for a point, 30 log R
    for a bed whose insonified part grows with range.
    """
    far = np.maximum(slant, NEAREST)
    return np.asarray(spreading * np.log10(far) + 2 * absorption_db_per_m * far)
