"""Where a published law stops being trustworthy, said aloud.

A law outside the conditions it was measured in still gives a number. It is given, with
one warning that names the law, the quantity and the range.
"""

import warnings

import numpy as np
from numpy.typing import ArrayLike


class PhysicsWarning(UserWarning):
    """A law was used outside the conditions it was made for."""


def warn_outside(law: str, quantity: str, value: ArrayLike, low: float, high: float, unit: str) -> bool:
    """Warns once if any value lies outside the range in which a law holds.

    Args:
        law: Name of the law, with author and year.
        quantity: What the value measures.
        value: The value or values used, any shape, in `unit`.
        low: Smallest trustworthy value, in `unit`.
        high: Largest trustworthy value, in `unit`.
        unit: Unit of the three numbers, "" for a ratio.

    Returns:
        Whether something was outside.
    """
    values = np.asarray(value, dtype=float)
    outside = values[(values < low) | (values > high)]
    if outside.size == 0:
        return False
    excess = np.maximum(low - outside, outside - high)
    worst, blank = outside[np.argmax(excess)], " " if unit else ""
    # The caller's line is the law itself: Python's default filter then shows each text once per run.
    warnings.warn(
        f"{law} is trusted for {quantity} {low:g} to {high:g}{blank}{unit}; "
        f"{worst:g}{blank}{unit} is outside, and the result an extrapolation",
        PhysicsWarning,
        stacklevel=2,
    )
    return True
