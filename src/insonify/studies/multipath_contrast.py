"""Multipath at a target: level of its highlight, of its ghosts, and of the seabed in its shadow, by reflections.

The expected intensity of the nominal scene over sediments and under winds, for legs of no reflection up to some. The
shadow is measured by the seabed alone, past a target that casts shadows and returns nothing; what the target itself
returns in that time are its ghosts.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from insonify.paper.nominal_scenario import nominal
from insonify.plotting import style
from insonify.simulator import simulate
from insonify.studies.page import Section, table
from insonify.units import level_db

Floats = NDArray[np.float64]

ORDERS = (0, 1, 2, 3)
"""Largest number of reflections of one leg."""
HIGHLIGHT, GHOSTS, SHADOW = (0.2000, 0.2004), (0.2030, 0.2200), (0.2030, 0.2200)
"""Times of the highlight, of its ghosts and of the shadow by direct paths [s]."""


def _sediment(name: str) -> dict[str, Any]:
    return {"seabed.scattering": {"law": "jackson", "sediment": name}, "seabed.reflection": name}


def _wind(speed: float) -> dict[str, Any]:
    return {"surface.reflection": "statistical", "surface.wind_speed": speed}


POSITIONS: dict[str, dict[str, Any]] = {
    "sand, calm": _sediment("medium sand"),
    "sand, 3 m/s": {**_sediment("medium sand"), **_wind(3.0)},
    "sand, 8 m/s": {**_sediment("medium sand"), **_wind(8.0)},
    "silt, calm": _sediment("medium silt"),
}
"""Seabed and sea, and their changes to the nominal scene."""
COLOURS = dict(zip(POSITIONS, ("#1A1A1A", "#1E8FD5", "#0B3F73", "#B8720A"), strict=True))


@dataclass(frozen=True, slots=True)
class TargetContrast:
    """Levels around a target, re the seabed without it [dB]."""

    seabed: float
    """Level of the seabed without the target [dB re 1 uPa]."""
    highlight: float
    """Highlight re the seabed [dB]."""
    shadow: float
    """Seabed in the shadow re the seabed without it [dB]."""
    ghosts: float
    """The target's own later echoes re the seabed [dB]."""


@dataclass(frozen=True, slots=True)
class ContrastResults:
    """Contrasts by position and order, and the A-scans of one position."""

    contrast: dict[str, list[TargetContrast]]
    time: Floats
    """Sample times [s], shape (time,)."""
    scans: list[Floats]
    """Expected intensity over sand under a calm sea by order [uPa^2], shape (time,) each."""


def evaluate(positions: tuple[str, ...] = tuple(POSITIONS), orders: tuple[int, ...] = ORDERS) -> ContrastResults:
    """Simulate every position and order.

    Args:
        positions: Names of `POSITIONS`.
        orders: Largest numbers of reflections.
    """
    contrasts: dict[str, list[TargetContrast]] = {}
    scans, time = [], np.empty(0)
    for position in positions:
        contrasts[position] = []
        for order in orders:
            common = {**POSITIONS[position], "paths.max_reflections": order, "paths.edge_diffraction": "knife-edge"}
            time, bare = _ping({**common, "targets": [], "paths.contributions": ["seabed"]})
            _, shadowed = _ping({**common, "paths.contributions": ["seabed"]})
            _, target = _ping({**common, "paths.contributions": ["target"]})
            contrasts[position].append(
                TargetContrast(
                    _mean(time, bare, SHADOW), _mean(time, target, HIGHLIGHT) - _mean(time, bare, HIGHLIGHT),
                    _mean(time, shadowed, SHADOW) - _mean(time, bare, SHADOW),
                    _mean(time, target, GHOSTS) - _mean(time, bare, GHOSTS),
                )
            )  # fmt: skip
            if position == positions[0]:
                scans.append(shadowed + target)
    return ContrastResults(contrasts, time, scans)


def _ping(changes: dict[str, Any]) -> tuple[Floats, Floats]:
    fixed = {"field": "incoherent", "track.window": (0.190, 0.234)}
    ping = simulate(nominal({**fixed, **changes}))
    return ping["time"].values, ping["intensity"].values[0, 0].astype(float)


def _mean(time: Floats, intensity: Floats, window: tuple[float, float]) -> float:
    inside = intensity[(time >= window[0]) & (time < window[1])]
    return float(level_db(max(inside.mean(), 1e-30)))


def section(results: ContrastResults) -> Section:
    """Text and picture of the question."""
    rows = [
        [position, str(order), f"{c.seabed:.1f}", f"{c.highlight:+.1f}", f"{c.shadow:+.1f}", f"{c.ghosts:+.1f}"]
        for position, row in results.contrast.items()
        for order, c in zip(ORDERS, row, strict=False)
    ]
    calm, silt = results.contrast["sand, calm"], results.contrast["silt, calm"]
    windy = results.contrast["sand, 8 m/s"]
    last = len(calm) - 1
    header = ["seabed and sea", "reflections", "seabed [dB re 1 uPa]", "highlight [dB]", "shadow [dB]", "ghosts [dB]"]
    text = f"""## What does each multipath do to highlight and shadow?

The box of the paper, 150 m away in 20 m of water, at 3.4 degrees of grazing. Expected intensity; highlight, shadow
and ghosts are re the seabed without the target at the same times; the shadow is the seabed's part of it.

{table(header, rows)}

The direct paths meet the seabed at a grazing angle where it scatters little; the steeper multipath raises the seabed by
{calm[last].seabed - calm[0].seabed:.0f} dB over calm sand, and the highlight stands {calm[last].highlight:.0f} dB above
it instead of {calm[0].highlight:.0f}. The shadow of the direct paths ({calm[0].shadow:.1f} dB) is filled by paths that
reach its seabed over the box: {calm[1].shadow:.1f} dB with one reflection, {calm[last].shadow:.1f} dB with {last}.
Before that, the box's own echoes by the surface arrive in it, {calm[1].ghosts:+.0f} dB re the seabed with one.
Wind takes the surface's coherent part and spreads the rest: at 8 m/s {last} reflections raise the seabed by
{windy[last].seabed - windy[0].seabed:.0f} dB. Over silt, which reflects little, reflections beyond the first change
nothing ({silt[last].shadow - silt[1].shadow:+.2f} dB in the shadow): there one reflection, the surface's, is the whole
multipath."""
    return Section(text, draw(results), "multipath-contrast", "A-scans by number of reflections; highlight and shadow")


def draw(results: ContrastResults) -> Figure:
    """A-scans by order, and the contrasts over it."""
    with style.plot_style():
        figure = style.new_figure(9.5, 7.5)
        grid = figure.add_gridspec(2, 3, height_ratios=(1.2, 1))
        axes = figure.add_subplot(grid[0, :])
        for order, scan in reversed(list(enumerate(results.scans))):
            colour = style.COPPER(0.15 + 0.2 * order)
            axes.plot(
                results.time * 1e3,
                level_db(scan),
                color=colour,
                linewidth=1.0,
                label=f"{order} reflection{'s' * (order != 1)}",
            )
        axes.set(xlim=(190, 234), ylim=(35, 155), xlabel="time after the start of transmission [ms]",
                 ylabel="expected level [dB re 1 uPa]")  # fmt: skip
        axes.set_title(f"the target by up to {len(results.scans) - 1} reflections, {next(iter(results.contrast))}")
        axes.legend(ncols=4, loc="upper right")
        for column, name in enumerate(("highlight", "shadow", "ghosts")):
            axes = figure.add_subplot(grid[1, column])
            for position, row in results.contrast.items():
                level = [getattr(c, name) for c in row]
                axes.plot(range(len(row)), level, "o-", color=COLOURS[position], label=position)
            axes.set(xlabel="most reflections of a leg", ylabel="dB re the seabed", xticks=range(len(results.scans)))
            if name == "ghosts":
                axes.set_ylim(-40, None)
            axes.set_title(name)
        axes.legend(fontsize=8)
        return figure
