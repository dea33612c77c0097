"""Families of legs between surface and seabed in a vertical plane, figure 10 of the paper."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from insonify.plotting import style
from insonify.propagation.families import bounce_sequence, image_depth

LETTERS = {"D": "a", "S": "b", "B": "c", "SB": "d", "BS": "e"}
"""Letters of the families in the paper."""


def geometry(path: str | Path, *, families: tuple[str, ...] = ("D", "S", "B", "SB", "BS"), source_depth: float = 11.0,
             point_depth: float = 19.0, distance: float = 150.0, water_depth: float = 20.0) -> Path:  # fmt: skip
    """Draw the legs between the sonar and a point.

    Args:
        path: File of the figure.
        families: Families of the legs that are drawn.
        source_depth: Depth of the sonar [m].
        point_depth: Depth of the point [m].
        distance: Horizontal distance to the point [m].
        water_depth: Depth of the seabed [m].

    Returns:
        The path.

    Example:
        >>> picture = geometry("legs.png", families=("D", "S", "B"), source_depth=5.0, distance=60.0)
        >>> picture.name, picture.stat().st_size > 0
        ('legs.png', True)
    """
    with style.plot_style():
        figure = style.new_figure(10, 4)
        section(figure.subplots(), families, source_depth, point_depth, distance, water_depth)
        return style.save_figure(figure, path)


def section(axes: Axes, families: tuple[str, ...], source_depth: float, point_depth: float, distance: float,
            water_depth: float) -> None:  # fmt: skip
    """Draw the vertical plane through the sonar and a point, with one line for each leg [m]."""
    right = distance * 1.06
    axes.axhline(0, color=style.CONTRIBUTION_COLOURS["surface"], linewidth=2)
    axes.axhspan(water_depth, water_depth * 1.12, color=style.CONTRIBUTION_COLOURS["seabed"], alpha=0.3, linewidth=0)
    axes.axhline(water_depth, color=style.CONTRIBUTION_COLOURS["seabed"], linewidth=2)
    for name in families:
        x, z = leg(name, source_depth, point_depth, distance, water_depth)
        axes.plot(x, z, color=style.FAMILIES.get(name, style.QUIET), label=f"{LETTERS.get(name, '')}  {name}")
    axes.plot([0], [source_depth], "o", color=style.INK, markersize=8)
    axes.annotate("sonar", (0, source_depth), xytext=(-8, 0), textcoords="offset points", ha="right", va="center")
    axes.add_patch(_target(distance, point_depth, water_depth))
    axes.set_xlim(-0.09 * distance, right)
    axes.set_ylim(water_depth * 1.12, -0.06 * water_depth)
    axes.set_xlabel("horizontal range [m]")
    axes.set_ylabel("depth [m]")
    axes.legend(loc="upper center", ncols=len(families), title="legs, as the paper and as the program name them",
                bbox_to_anchor=(0.5, 1.2))  # fmt: skip


def leg(family: str, source_depth: float, point_depth: float, distance: float,
        water_depth: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:  # fmt: skip
    """Corners of one leg, from the sonar to the point: ranges and depths [m].

    The leg is a straight line from the image source, folded at each boundary.
    """
    image = image_depth(family, source_depth, water_depth)
    string = bounce_sequence(family)
    # Unfolded about the point: the last bounce is the nearest boundary plane, earlier ones lie one depth further.
    up = image < point_depth
    planes = np.array([-water_depth * k if up else water_depth * (k + 1) for k in range(len(string))])
    if string and (string[-1] == "S") != up:
        raise ValueError(f"the last bounce of family {family} is not on the side of its image source")
    share = (planes - image) / (point_depth - image)
    corners = share[::-1] * distance
    depths = [0.0 if letter == "S" else water_depth for letter in string]
    return np.array([0, *corners, distance]), np.array([source_depth, *depths, point_depth])


def _target(distance: float, top: float, water_depth: float) -> Rectangle:
    return Rectangle(
        (distance, top), distance * 0.008, max(water_depth - top, 0), color=style.CONTRIBUTION_COLOURS["target"]
    )
