"""Figure 10: the five legs a-e between the transducer and the target, their lengths, angles and delays.

The nominal scene, unchanged. Lengths follow from image sources: L = sqrt(r^2 + (z - z_image)^2), with the image at
z_s, -z_s, 2H - z_s, 2H + z_s and z_s - 2H for a, b, c, d, e.
"""

from itertools import combinations_with_replacement

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from insonify.paper.checked_numbers import CheckedNumber, Drawn
from insonify.paper.nominal_scenario import nominal
from insonify.plotting import style
from insonify.plotting.leg_diagram import LETTERS, section
from insonify.propagation.image_sources import image_legs
from insonify.records.legs import Legs
from insonify.scattering.point_target import PointTargetLaw
from insonify.scene.scatterers import Scatterers
from insonify.sonar.track import true_poses

TITLE = "Legs between the transducer and a target at 150 m"
POINTS = {"seabed": 20.0, "target middle": 19.5, "target top": 19.0}
"""Depths of the points [m]."""
DISTANCE = 150.0
SOURCE = "image sources: L = sqrt(r^2 + (z - z_image)^2)"


def legs() -> Legs:
    """The five legs to the three points, as the engine computes them, shape (5, 3)."""
    scenario = nominal({"targets": []})
    depth = np.array(list(POINTS.values()))
    position = true_poses(scenario.track, seed=scenario.seed).position[0]
    n = len(depth)
    points = Scatterers(
        "points", "target", PointTargetLaw(0.0), np.stack([np.zeros(n), np.full(n, DISTANCE), depth], axis=-1),
        np.zeros((n, 3)), np.ones(n), np.ones(n, complex), np.arange(n, dtype=np.uint64), has_random_phase=False,
    )  # fmt: skip
    return image_legs(scenario.scene, position, points, tuple(LETTERS), scenario.sonar.pulse.frequency)


def expected_delays() -> NDArray[np.float64]:
    """One-way delays of the five legs by the formula above [s], shape (5, 3)."""
    scenario = nominal()
    source, bottom, speed = 11.0, scenario.seabed.depth, scenario.water.sound_speed
    image = np.array([source, -source, 2 * bottom - source, 2 * bottom + source, source - 2 * bottom])
    return np.asarray(np.hypot(DISTANCE, np.array(list(POINTS.values())) - image[:, None]) / speed)


def numbers() -> list[CheckedNumber]:
    """Length, angle and delay of each leg, and the fifteen two-way delays of each point."""
    computed, expected, speed = legs(), expected_delays(), nominal().water.sound_speed
    rows: list[CheckedNumber] = []
    for column, point in enumerate(POINTS):
        for row, family in enumerate(computed.families):
            name, delay = f"{LETTERS[family]} to {point}", computed.delay[row, column]
            angle = float(np.degrees(np.arcsin(np.abs(computed.arrival[row, column, 2]))))
            rows.append(CheckedNumber(f"{name}: length", delay * speed, "m"))
            rows.append(CheckedNumber(f"{name}: angle from the horizontal", angle, "deg"))
            rows.append(CheckedNumber(f"{name}: delay", delay, "s", expected[row, column], 1e-9, SOURCE))
        for i, j in combinations_with_replacement(range(5), 2):
            name = f"{LETTERS[computed.families[i]]}{LETTERS[computed.families[j]]} to {point}: two-way delay"
            value, target = (float(x[i, column] + x[j, column]) for x in (computed.delay, expected))
            rows.append(CheckedNumber(name, value, "s", target, 1e-9, SOURCE))
    return rows


def draw() -> Drawn:
    """The picture, its scenarios by name, and its numbers."""
    delay = legs().delay
    figure = style.new_figure(10, 6.5)
    above, below = figure.subplots(2, 1, height_ratios=(3, 2))
    section(above, tuple(LETTERS), 11.0, POINTS["target top"], DISTANCE, nominal().seabed.depth)
    _comb(below, delay)
    return figure, {"nominal": nominal()}, numbers()


def _comb(axes: Axes, delay: NDArray[np.float64]) -> None:
    """Draw the two-way delays of each point, one tick each."""
    names = list(LETTERS)
    for y, (point, column) in enumerate(zip(POINTS, delay.T, strict=True)):
        for pair in reversed(list(combinations_with_replacement(range(5), 2))):
            longer = max(pair, key=lambda leg: round(float(column[leg]), 12))
            when = 1e3 * (column[pair[0]] + column[pair[1]])
            axes.plot([when], [y], "|", color=style.FAMILIES[names[longer]], markersize=18, markeredgewidth=1.6)
        axes.annotate(point, (199.9, y), ha="right", va="center", annotation_clip=False)
    axes.set_xlim(200, 211)
    axes.set_ylim(-0.6, 2.6)
    axes.set_yticks([])
    axes.set_title("Fifteen two-way delays, coloured by the longer leg")
    axes.set_xlabel("two-way delay [ms]")
