"""Every axis has its name and unit; what has a colour has it in every picture."""

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from insonify import arrivals, levels, plotting, simulate
from insonify.paper.nominal_scenario import nominal
from insonify.plotting import style
from insonify.plotting.ascan import ascan, envelope, target_window, trace
from insonify.plotting.leg_diagram import LETTERS, section
from insonify.plotting.levels import curves
from insonify.plotting.recording_levels import recording_levels
from insonify.plotting.sector_image import sector, sector_image
from insonify.plotting.spikes import spike_array
from insonify.plotting.waterfall import waterfall
from insonify.propagation.families import families_up_to

UNIT = re.compile(r"\[(m|ms|mPa|dB re 1 uPa|dB re 1 m\$\^2\$)\]$|\bre .*\[dB\]$")
NO_UNIT = {"ping", ""}
QUICK = {"paths.geometry": "slice", "paths.max_reflections": 1, "track.window": [0.198, 0.206]}


def scenario(**changes: Any) -> Any:
    """The nominal scene, a slice of a few milliseconds."""
    return nominal({**QUICK, **{name.replace("__", "."): value for name, value in changes.items()}})


@cache
def picture_of(draw: Callable[[], Figure]) -> Figure:
    """A picture, drawn once in the house style."""
    with style.plot_style():
        return draw()


def beams(count: int, **changes: Any) -> xr.Dataset:
    """The target alone, in three dimensions, received by some beams."""
    steer = np.radians(np.linspace(-3, 3, count)).tolist()
    return simulate(
        scenario(paths__geometry="3d", paths__contributions=["target"], sonar__receive__steer=steer, **changes)
    )


def ascan_figure() -> Figure:
    """One ping."""
    return ascan(recording_levels(simulate(scenario())), 0)


def waterfall_figure() -> Figure:
    """Three pings."""
    return waterfall(recording_levels(simulate(scenario(track__pings=3))))


def fan_figure() -> Figure:
    """Seven beams."""
    return sector_image(recording_levels(beams(7)), 0)


def two_beams_figure() -> Figure:
    """Two beams, one trace each."""
    return ascan(recording_levels(beams(2)), 0)


def levels_figure() -> Figure:
    """Curves by contribution."""
    figure = style.new_figure()
    curves(figure.subplots(), levels(scenario(surface__scattering={"strength_db": -30}, water__noise_level_db=60)))
    return figure


def spikes_figure() -> Figure:
    """Arrivals as spikes."""
    figure = style.new_figure()
    paths = arrivals(scenario())
    spike_array(figure.subplots(), paths, 20 * np.log10(np.abs(paths.amplitude)), "level re the source at 1 m [dB]")
    return figure


def geometry_figure() -> Figure:
    """The five legs."""
    figure = style.new_figure()
    section(figure.subplots(), families_up_to(2), 11.0, 19.0, 150.0, 20.0)
    return figure


PICTURES: list[Callable[[], Figure]] = [
    ascan_figure, waterfall_figure, fan_figure, two_beams_figure, levels_figure, spikes_figure, geometry_figure,
]  # fmt: skip


def all_axes(figure: Figure) -> list[Axes]:
    """Axes of a figure, and those hung onto them."""
    return [inner for axes in figure.axes for inner in (axes, *axes.child_axes)]


@pytest.mark.parametrize("picture", PICTURES, ids=lambda made: made.__name__.removesuffix("_figure"))
def test_every_axis_has_a_name_and_a_unit(picture: Callable[[], Figure]) -> None:
    """Abscissa, ordinate, second axes and colour bars: "what [unit]", but for the number of the ping."""
    named = 0
    with style.plot_style():
        for axes in all_axes(picture_of(picture)):
            for label in (axes.get_xlabel(), axes.get_ylabel()):
                assert label in NO_UNIT or UNIT.search(label), label
                named += label != ""
    assert named >= 2


@pytest.mark.parametrize("picture", PICTURES, ids=lambda made: made.__name__.removesuffix("_figure"))
def test_every_picture_can_be_written_and_is_not_blank(picture: Callable[[], Figure], tmp_path: Path) -> None:
    """At least a twentieth of a percent of its pixels, and three grey levels, are neither paper nor missing."""
    with style.plot_style():
        path = style.save_figure(picture_of(picture), tmp_path / "picture.png")
    from matplotlib.image import imread

    pixels = imread(path)[..., :3].mean(axis=-1)
    assert (pixels < 0.9).mean() > 5e-4
    assert np.unique(np.round(pixels, 2)).size > 3


DOORS = {
    "recording": lambda path: plotting.recording(simulate(scenario()), path),
    "levels": lambda path: plotting.levels(levels(scenario()), path, window=(0.199, 0.204)),
    "spikes": lambda path: plotting.spikes(arrivals(scenario()), path),
    "geometry": lambda path: plotting.geometry(path, families=("D", "SB"), distance=80.0),
}


@pytest.mark.parametrize("name", DOORS)
def test_every_public_drawing_returns_the_file_that_it_wrote(name: str, tmp_path: Path) -> None:
    """A path goes in, the same path comes out, and there is a picture under it."""
    path = tmp_path / f"{name}.png"
    assert DOORS[name](path) == path
    assert path.stat().st_size > 5000


def test_a_cause_has_one_colour_in_all_pictures() -> None:
    """Surface and bed of the geometry, and the target of the closer look, in the colours of their curves."""
    with style.plot_style():
        drawn = {str(line.get_label()): line.get_color() for line in picture_of(levels_figure).axes[0].lines}
        assert drawn == {
            contribution: style.CONTRIBUTION_COLOURS[contribution]
            for contribution in ("seabed", "surface", "target", "noise", "total")
        }
        flat = {
            tuple(np.unique(line.get_ydata())): line.get_color()
            for line in picture_of(geometry_figure).axes[0].lines[:2]
        }
        assert flat == {(0.0,): style.CONTRIBUTION_COLOURS["surface"], (20.0,): style.CONTRIBUTION_COLOURS["seabed"]}
        near = picture_of(ascan_figure).axes[1].lines[0]
        assert near.get_color() == style.CONTRIBUTION_COLOURS["target"]


def test_legs_are_drawn_in_the_colours_of_their_families_and_named_twice() -> None:
    """The legend gives the paper's letter and the program's name of each leg."""
    axes = picture_of(geometry_figure).axes[0]
    named = {line.get_label(): line.get_color() for line in axes.lines if not str(line.get_label()).startswith("_")}
    assert named == {f"{LETTERS[name]}  {name}": style.FAMILIES[name] for name in families_up_to(2)}
    assert axes.get_ylim()[0] > axes.get_ylim()[1]  # depth grows downwards


def test_the_range_above_a_trace_is_the_range_of_a_direct_echo() -> None:
    """Ground range sqrt((c t / 2)^2 - h^2) of a sonar 9 m above the bed; there and back is where it was."""
    axes = style.new_figure().subplots()
    axes.set_xlim(100, 200)
    style.range_axis(axes, 1500.0, 9.0)
    (top,) = axes.child_axes
    assert top.get_xlabel() == "ground range of a direct echo [m]"
    there, back = top._functions
    time = np.linspace(100, 200, 50)
    np.testing.assert_allclose(there(time), np.sqrt((0.75 * time) ** 2 - 81))
    np.testing.assert_allclose(back(there(time)), time)


@pytest.mark.parametrize(("first", "altitude"), [(0.0, 9.0), (100.0, None)], ids=["from the pulse on", "no altitude"])
def test_where_the_ground_is_not_reached_yet_the_range_is_slant(first: float, altitude: float | None) -> None:
    """Before the first return, or without an altitude, there is no ground range: c t / 2."""
    axes = style.new_figure().subplots()
    axes.set_xlim(first, 200)
    style.range_axis(axes, 1480.0, altitude)
    (top,) = axes.child_axes
    assert top.get_xlabel() == "slant range of a direct echo [m]"
    there, back = top._functions
    assert there(100.0) == pytest.approx(74.0) and back(there(123.0)) == pytest.approx(123.0)


def test_a_closer_look_is_in_millipascals() -> None:
    """The linear panel shows the rms pressure of the samples in its window: 10^(L/20) uPa, as mPa."""
    sound = recording_levels(simulate(scenario()))
    axes = style.new_figure().subplots()
    look = target_window(sound, 0)
    assert look is not None
    envelope(axes, sound, 0, look)
    x, y = (np.asarray(data) for data in axes.lines[0].get_data())
    inside = (sound.time * 1e3 >= look.window[0]) & (sound.time * 1e3 <= look.window[1])
    np.testing.assert_allclose(x, sound.time[inside] * 1e3)
    np.testing.assert_allclose(y * 1e3, 10 ** (sound.level[0, 0, inside] / 20))
    assert axes.get_ylim()[0] == 0


def test_a_trace_can_be_cut_to_a_window_and_follows_its_levels() -> None:
    """Only the samples seen set the ordinate; nothing finite at all leaves it alone."""
    sound = recording_levels(simulate(scenario()))
    axes = style.new_figure().subplots()
    trace(axes, sound, 0, 0, (201.0, 202.0))
    assert axes.get_xlim() == (201.0, 202.0)
    seen = sound.level[0, 0][(sound.time >= 0.201) & (sound.time <= 0.202)]
    assert axes.get_ylim()[0] < seen.min() and seen.max() < axes.get_ylim()[1]


def test_two_beams_state_where_they_look() -> None:
    """A title for each channel with its steer angle; a lone one has the title of the scenario."""
    titles = [axes.get_title(loc="left") or axes.get_title() for axes in picture_of(two_beams_figure).axes[:2]]
    assert "-3.00 deg" in titles[0] and "+3.00 deg" in titles[1]


def test_a_fans_bearings_are_written_on_its_rim() -> None:
    """Five bearings from the first to the last steer angle, straight ahead among them."""
    texts = [text.get_text() for text in picture_of(fan_figure).axes[0].texts]
    assert [text for text in texts if text.endswith("°")] == ["-3°", "-1.5°", "0°", "+1.5°", "+3°"]


def test_a_sector_is_drawn_to_scale() -> None:
    """A sample at slant range r and steer angle s stands at (r sin s, r cos s), both axes alike."""
    axes = style.new_figure().subplots()
    slant, steer = np.linspace(50, 100, 30), np.radians([-10.0, 0.0, 10.0])
    mesh = sector(axes, slant, steer, np.zeros((3, 30)), (-1.0, 0.0))
    corner = mesh.get_coordinates()
    assert axes.get_aspect() == 1.0
    np.testing.assert_allclose(np.hypot(*corner.T).T, np.broadcast_to(np.linspace(50, 100, 31), (4, 31)))
    np.testing.assert_allclose(np.degrees(np.arctan2(corner[:, 0, 0], corner[:, 0, 1])), [-15, -5, 5, 15])


def test_pictures_do_not_depend_on_a_scenario_that_is_not_known() -> None:
    """A recording from elsewhere, without its scenario: levels as they are, 1500 m/s, and no closer look."""
    strange = simulate(scenario(track__pings=2)).assign_attrs(scenario="")
    sound = recording_levels(strange)
    assert sound.scenario is None and sound.sound_speed == 1500.0
    np.testing.assert_array_equal(sound.strength(), sound.level)
    assert target_window(sound, 0) is None
    figure = waterfall(sound)
    assert figure.axes[-1].get_ylabel() == "level [dB re 1 uPa]"


def test_colours_are_six_figures_that_any_program_reads() -> None:
    """Hex colours throughout, unchanged by a round trip."""
    for colours in (style.CONTRIBUTION_COLOURS, style.FAMILIES, style.PAIRS):
        for colour in colours.values():
            assert to_hex(colour).upper() == colour
