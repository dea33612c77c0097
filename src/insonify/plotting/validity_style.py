"""Curves of laws inside and outside their validity: the latter are drawn thin and dashed.

A law outside its range of validity gives a number and warns once. A figure shows the warning
at the curve and in a line of small print.
"""

import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from insonify.plotting import style
from insonify.validity import PhysicsWarning

Floats = NDArray[np.float64]
Caveats = tuple[str, ...]
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class LawCurve:
    """Values of a law, and its warnings."""

    values: Floats
    """Values in the law's unit, any shape."""
    caveats: Caveats
    """Warnings of the law; none within its validity."""


def evaluate_with_caveats(law: Callable[[], Floats]) -> LawCurve:
    """Evaluate a law and keep its warnings.

    Args:
        law: Function that returns the values, and may warn that it is used outside its range.
    """
    return LawCurve(*with_caveats(law))


def with_caveats(make: Callable[[], T]) -> tuple[T, Caveats]:
    """Call a function and collect its warnings about physics; other warnings are passed on.

    Returns:
        Result of the function, and its warnings about physics.
    """
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", PhysicsWarning)
        result = make()
    caveats: dict[str, None] = {}
    for warning in caught:
        if issubclass(warning.category, PhysicsWarning):
            caveats[" ".join(str(warning.message).split())] = None
        else:
            warnings.warn_explicit(warning.message, warning.category, warning.filename, warning.lineno)
    return result, tuple(caveats)


def curve(axes: Axes, x: Floats, values: LawCurve, colour: str, label: str) -> None:
    """Draw one curve, thin and dashed outside the validity of its law.

    Args:
        axes: Axes to draw on.
        x: Abscissa, in the unit of the axes, shape (n,).
        values: Ordinates with their caveats, shape (n,).
        colour: Colour of the curve.
        label: Label of the curve in the legend.
    """
    line: dict[str, Any] = {"linestyle": (0, (4, 2)), "linewidth": 0.9} if values.caveats else {"linewidth": 1.6}
    axes.plot(x, values.values, color=colour, label=label, **line)


def add_caveats(figure: Figure, caveats: Iterable[str], mark: str = "Thin and dashed: ") -> None:
    """Print the caveats of all curves in small letters below the figure, if there are any.

    Args:
        figure: Figure of the curves.
        caveats: Warnings of the laws.
        mark: Line style of the curves outside their validity, in words.
    """
    unique = dict.fromkeys(caveat.split(", and the result")[0] for caveat in caveats)
    if unique:
        figure.supxlabel(mark + ";\n".join(unique), fontsize=7.5, color=style.QUIET, x=0.01, ha="left")
