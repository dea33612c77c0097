"""Curves that a law stands behind, and curves that it does not: the second are drawn thin and dashed.

A law outside the conditions it was made for still gives a number and warns once. A picture can say it where it
applies: at the curve, and in a line of small print.
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
    """What a law says, and what it says about itself."""

    values: Floats
    """The answer, in the law's unit, any shape."""
    caveats: Caveats
    """The law's own warnings; none where it is trusted."""


def evaluate_with_caveats(law: Callable[[], Floats]) -> LawCurve:
    """The answer of a law, with its warnings kept beside it.

    Args:
        law: Gives numbers; may warn that it is used outside its range.
    """
    return LawCurve(*with_caveats(law))


def with_caveats(make: Callable[[], T]) -> tuple[T, Caveats]:
    """Whatever is made, and the warnings about physics that came with it; other warnings go their way.

    Args:
        make: Makes it.
    """
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", PhysicsWarning)
        made = make()
    caveats: dict[str, None] = {}
    for warning in caught:
        if issubclass(warning.category, PhysicsWarning):
            caveats[" ".join(str(warning.message).split())] = None
        else:
            warnings.warn_explicit(warning.message, warning.category, warning.filename, warning.lineno)
    return made, tuple(caveats)


def curve(axes: Axes, x: Floats, answer: LawCurve, colour: str, label: str) -> None:
    """One curve in its colour, thin and dashed where the law does not stand behind it.

    Args:
        axes: Where to draw.
        x: Abscissa, in the unit of the axes, shape (n,).
        answer: Ordinates, shape (n,).
        colour: Of the curve.
        label: Of the curve, for the legend.
    """
    line: dict[str, Any] = {"linestyle": (0, (4, 2)), "linewidth": 0.9} if answer.caveats else {"linewidth": 1.6}
    axes.plot(x, answer.values, color=colour, label=label, **line)


def add_caveats(figure: Figure, caveats: Iterable[str], mark: str = "Thin and dashed: ") -> None:
    """The caveats of all curves in small letters below the picture; nothing if there are none.

    Args:
        figure: The picture.
        caveats: What the laws said about themselves.
        mark: How the doubtful curves are drawn, in words.
    """
    said = dict.fromkeys(doubt.split(", and the result")[0] for doubt in caveats)
    if said:
        figure.supxlabel(mark + ";\n".join(said), fontsize=7.5, color=style.QUIET, x=0.01, ha="left")
