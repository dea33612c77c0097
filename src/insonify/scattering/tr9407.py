"""Frequency range of the APL-UW handbook: its bottom, surface and bubbles were measured at 10 to 100 kHz.

All its laws share one warning about other frequencies.
"""

import numpy as np
from numpy.typing import ArrayLike

from insonify.validity import warn_outside

HANDBOOK = "APL-UW TR 9407 (1994), the source of these scattering laws,"


def warn_of_frequency(frequency: ArrayLike) -> None:
    """Warn where a frequency lies outside those of the handbook.

    Args:
        frequency: Frequency [Hz], any shape.
    """
    warn_outside(HANDBOOK, "frequency", np.asarray(frequency, float) / 1e3, 10.0, 100.0, "kHz")
