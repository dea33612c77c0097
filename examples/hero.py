"""The picture on the front page: three boxes on the seabed, seen by direct paths alone and as the water shows them.

Run it from anywhere: python examples/hero.py [PICTURE]
"""

import sys
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from insonify import Scenario, levels, load_scenario, simulate
from insonify.plotting import style
from insonify.plotting.recording_levels import recording_levels
from insonify.plotting.sector_image import sector

HERE = Path(__file__).resolve().parent
STEERS = np.radians(np.arange(-6, 6.01, 0.125))
WINDOW = (0.185, 0.2345)
SPAN = (-72.0, -18.0)
NIGHT, PALE, DIM = "#0C0F12", "#E9E4DA", "#8F8A80"
CONTRIBUTION_COLOURS = {"seabed": "#E8A33D", "target": "#FF5B3A"}


def box(label: str, bearing: float, reach: float, size: list[float], heading: float) -> dict[str, object]:
    """A box on the seabed at a bearing [deg] to the right of boresight, which looks east, and a range [m]."""
    angle = np.radians(bearing)
    place = [float(-reach * np.sin(angle)), float(reach * np.cos(angle))]
    return {"shape": "box", "label": label, "position": place, "size": size, "heading": f"{heading} deg"}


TARGETS = [
    box("wreck", -2.9, 146.0, [5.0, 1.2, 1.3], 12.0),
    box("box", 0.9, 150.5, [2.0, 1.0, 1.0], 0.0),
    box("stone", 3.9, 144.0, [0.8, 0.8, 0.6], 40.0),
]


def scene(steers: list[float], reflections: int = 2) -> Scenario:
    """The nominal scene with three boxes, some beams and a window about the boxes."""
    values = load_scenario(HERE / "nominal.yaml").model_dump(mode="json")
    values["targets"] = TARGETS
    values["track"]["window"] = WINDOW
    values["sonar"]["receive"]["steer"] = steers
    values["paths"]["max_reflections"] = reflections
    return Scenario.model_validate(values)


def images(figure: Figure) -> None:
    """Two fans side by side: direct paths, and up to two reflections on each leg."""
    panels = figure.subplots(1, 2, sharey=True)
    for axes, reflections, title in zip(panels, (0, 2), ("direct paths only", "with surface and bottom"), strict=True):
        sound = recording_levels(simulate(scene(STEERS.tolist(), reflections)))
        slant = sound.time * sound.sound_speed / 2
        mesh = sector(axes, slant, sound.steer, np.maximum(sound.strength()[0], SPAN[0]), SPAN, ink=DIM)
        axes.set_title(title, pad=24, fontsize=13)
    panels[1].set_ylabel("")
    figure.colorbar(mesh, ax=list(panels), label="apparent target strength [dB re 1 m$^2$]", shrink=0.8, pad=0.01)


def curves(figure: Figure) -> None:
    """The beam on the middle box: one ping, and the mean level of each contribution."""
    axes = figure.subplots()
    beam = int(np.argmin(np.abs(STEERS - np.radians(0.9))))
    whole = scene([float(STEERS[beam])])
    ping = simulate(whole)
    time = ping["time"].values * 1e3
    expected = levels(whole)["level_db"].sel(pair="all")
    axes.plot(time, 20 * np.log10(np.abs(ping["pressure"].values[0, 0])), color=PALE, linewidth=0.7, label="one ping")
    for contribution, colour in CONTRIBUTION_COLOURS.items():
        level = expected.sel(contribution=contribution).values
        axes.plot(
            time,
            np.where(np.isfinite(level), level, np.nan),
            color=colour,
            linewidth=2.2,
            label=f"{contribution}, expected",
        )
    axes.set_xlim(time[0], time[-1])
    axes.set_ylim(42, 125)
    axes.set_xlabel("time after the start of transmission [ms]")
    axes.set_ylabel("level [dB re 1 uPa]")
    axes.set_title("the beam on the middle box", fontsize=13)
    axes.legend(ncols=3, loc="upper right")


def main(path: Path) -> None:
    """Draw it."""
    night = {name: NIGHT for name in ("figure.facecolor", "axes.facecolor", "savefig.facecolor")}
    pale = {name: PALE for name in ("text.color", "axes.labelcolor", "xtick.labelcolor", "ytick.labelcolor")}
    lines = {"axes.edgecolor": DIM, "xtick.color": DIM, "ytick.color": DIM, "grid.color": "#23282D", "savefig.dpi": 90}
    with style.plot_style(), matplotlib.rc_context({**night, **pale, **lines}):
        figure = style.new_figure(12, 9.6)
        above, below = figure.subfigures(2, 1, height_ratios=(2.2, 1))
        images(above)
        curves(below)
        style.save_figure(figure, path)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE.parent / "docs" / "images" / "hero.png")
