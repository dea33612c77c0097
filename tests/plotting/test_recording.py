"""Pictures of recordings: the right kind for what was recorded, and nothing lost on the way."""

import json
from functools import lru_cache
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
import xarray as xr
from matplotlib.axes import Axes

from insonify import arrivals, plotting, simulate
from insonify.paper.nominal_scenario import box, nominal
from insonify.plotting.ascan import ascan, target_window
from insonify.plotting.recording_levels import colour_span, recording_levels
from insonify.plotting.sector_image import sector_image
from insonify.plotting.target_view import echo_window
from insonify.plotting.waterfall import COLUMNS, thinned, waterfall


@lru_cache
def simulated(changes: str) -> xr.Dataset:
    """Recording of the nominal scene with changes, as JSON."""
    return simulate(nominal(json.loads(changes)))


def ping(changes: dict[str, Any] | None = None) -> xr.Dataset:
    """The target alone, in one vertical plane, about its direct echo."""
    quick = {"paths.geometry": "slice", "paths.max_reflections": 0, "track.window": [0.19, 0.21]}
    return simulated(json.dumps({**quick, **(changes or {})})).copy(deep=True)


def beams(count: int) -> xr.Dataset:
    """The target in three dimensions, received by some beams."""
    steer = np.radians(np.linspace(-3, 3, count)).tolist()
    return ping({"paths.geometry": "3d", "paths.contributions": ["target"], "sonar.receive.steer": steer})


@pytest.mark.parametrize("suffix", [".png", ".pdf", ".svg"])
def test_a_picture_is_written_as_its_suffix_states(tmp_path: Path, suffix: str) -> None:
    """PNG, PDF and SVG, each with its own first bytes."""
    first = {".png": b"\x89PNG", ".pdf": b"%PDF", ".svg": b"<?xml"}
    path = plotting.recording(ping(), tmp_path / f"ping{suffix}")
    assert path.read_bytes().startswith(first[suffix])


def test_drawing_leaves_nothing_behind(tmp_path: Path) -> None:
    """Neither the house rules nor a figure stay in matplotlib's global state."""
    before = dict(matplotlib.rcParams)
    plotting.recording(ping(), tmp_path / "ping.png")
    assert dict(matplotlib.rcParams) == before


def test_the_same_recording_makes_the_same_picture(tmp_path: Path) -> None:
    """No date in the file: the same bytes."""
    one, other = (plotting.recording(ping(), tmp_path / name).read_bytes() for name in ("a.png", "b.png"))
    assert one == other


def test_a_lone_ping_is_a_trace_and_its_target_is_looked_at_closer() -> None:
    """One channel and one ping: level over time with what each contribution should bring, and the target beneath."""
    axes = ascan(recording_levels(ping()), 0).axes
    assert [a.get_ylabel() for a in axes] == ["level [dB re 1 uPa]", "rms pressure [mPa]"]
    line, *contributions = axes[0].lines
    assert {str(contribution.get_label()) for contribution in contributions} == {"seabed", "target"}
    np.testing.assert_allclose(line.get_ydata(), 20 * np.log10(np.abs(ping()["pressure"].values[0, 0])), atol=1e-4)


def test_the_closer_look_contains_the_echo() -> None:
    """The target's direct echo comes at twice its slant range over the speed of sound."""
    look = target_window(recording_levels(ping()), 0)
    assert look is not None
    assert look.window[0] < 2e3 * np.hypot(150.0, 9.0) / 1500 < look.window[1]


def test_many_pings_are_a_waterfall() -> None:
    """One row of the image for each ping, slant range along it."""
    figure = waterfall(recording_levels(ping({"track.pings": 3})))
    (image,) = figure.axes[0].images
    assert image.get_array().shape == (3, 500)
    np.testing.assert_allclose(image.get_extent()[:2], [0.19 * 750, 0.20996 * 750], rtol=1e-6)


def test_many_beams_are_a_fan_with_the_target_ahead() -> None:
    """The brightest spot of the fan is where the target stands: straight ahead, 150 m away."""
    sound = recording_levels(beams(7))
    (mesh,) = sector_image(sound, 0).axes[0].collections[:1]
    brightest = np.unravel_index(np.argmax(mesh.get_array()), mesh.get_array().shape)
    x, y = mesh.get_coordinates()[brightest]
    assert abs(x) < 1.5
    assert y == pytest.approx(np.hypot(150, 9), abs=0.4)


def test_starboard_is_on_the_right() -> None:
    """A beam steered to the right of boresight is drawn on the right, whatever the order of the beams."""
    turned = beams(7).isel(channel=slice(None, None, -1))
    (mesh,) = sector_image(recording_levels(turned), 0).axes[0].collections[:1]
    x = mesh.get_coordinates()[:, 0, 0]
    assert np.all(np.diff(x) > 0)


def test_a_ping_that_is_not_there_is_not_drawn(tmp_path: Path) -> None:
    """Of a recording without pings there is no picture; of one begun there is."""
    begun = ping({"track.pings": 3})
    begun["pressure"][1:] = np.nan
    assert plotting.recording(begun, tmp_path / "begun.png").exists()
    begun["pressure"][:] = np.nan
    with pytest.raises(ValueError, match="holds no ping yet"):
        plotting.recording(begun, tmp_path / "nothing.png")


def test_one_ping_or_one_channel_of_a_recording_is_drawn(tmp_path: Path) -> None:
    """A selection by number, which removes the axis, gives the picture of a selection by a list of that number."""
    whole = beams(3)
    for number, (axis, row) in enumerate([("ping", 0), ("channel", 1)]):
        selections = whole.isel({axis: row}), whole.isel({axis: [row]})
        one, other = (
            plotting.recording(part, tmp_path / f"{number}{side}.png").read_bytes()
            for side, part in enumerate(selections)
        )
        assert one == other


@pytest.mark.parametrize("part", [xr.Dataset({"a": 1}), xr.Dataset({"pressure": (("ping", "time"), np.ones((1, 9)))})])
def test_a_dataset_that_is_no_recording_is_refused(part: xr.Dataset) -> None:
    """No field, or no times and channels: the message states what to give."""
    with pytest.raises(ValueError, match="the dataset is no recording"):
        plotting.recording(part)
    with pytest.raises(TypeError, match="recorded is a DataArray; give a recording"):
        plotting.recording(ping()["pressure"])
    with pytest.raises(ValueError, match="beam is 3; the recording has beams 0 to 2"):
        plotting.recording(beams(3), beam=3)


def test_silence_and_intensity_can_be_drawn(tmp_path: Path) -> None:
    """A recording of expected intensity with not a single echo in it."""
    quiet = ping({"field": "incoherent", "targets": [], "paths.contributions": ["target"]})
    assert plotting.recording(quiet, tmp_path / "quiet.png").exists()


def test_apparent_target_strength_is_the_target_strength() -> None:
    """A point of -10 dB, alone in the water: its level with the way undone is -10 dB."""
    point = {"shape": "point", "label": "point", "position": [0, 150, 11], "target_strength_db": -10.0}
    sound = recording_levels(
        ping({"targets": [point], "paths.contributions": ["target"], "sonar.pulse.duration": 2e-3})
    )
    row = int(np.argmin(np.abs(sound.time - 0.201)))
    # 1 ms into the echo the range is read 0.75 m too far: 40 log10(150.75 / 150) = 0.09 dB, and 0.05 dB absorption
    assert sound.strength()[0, 0, row] == pytest.approx(-10 + 0.14, abs=0.03)


def test_thinning_keeps_the_energy() -> None:
    """Columns that do not fit are averaged as energy: the mean of powers stays."""
    level = 10 * np.log10(np.random.default_rng(1).exponential(size=(2, 4 * COLUMNS)))
    assert thinned(level).shape == (2, COLUMNS)
    np.testing.assert_allclose((10 ** (thinned(level) / 10)).mean(), (10 ** (level / 10)).mean())


def test_colours_span_what_there_is() -> None:
    """The median lies inside the colours, and silence does not stretch them."""
    level = 10 * np.log10(np.random.default_rng(1).exponential(size=10_000)) - 40
    low, high = colour_span(np.append(level, -np.inf))
    assert low < np.median(level) < high
    assert (low, high) == colour_span(level)
    assert high - low < 60


def title(axes: Axes) -> str:
    """What stands above a panel."""
    return axes.get_title(loc="left") or axes.get_title()


def two_targets() -> dict[str, Any]:
    """A box to the right of boresight and a buoy to the left, nearer, with as many bounces as the paper's."""
    buoy = {"shape": "point", "label": "buoy", "position": [8.0, 130.0, 15.0], "target_strength_db": -10.0}
    return {
        "targets": [buoy, {**box(2.0), "position": [-5.5, 150.5]}], "paths.geometry": "3d", "paths.max_reflections": 2,
        "paths.contributions": ["target"], "track.window": [0.165, 0.24],
    }  # fmt: skip


@pytest.mark.parametrize(("steer", "label"), [(-3.52, "buoy"), (2.09, "box")])
def test_the_closer_look_is_at_the_target_in_the_beam(steer: float, label: str) -> None:
    """Of two targets the one that the beam points at, and its name in the title."""
    sound = recording_levels(ping({**two_targets(), "sonar.receive.steer": [float(np.radians(steer))]}))
    look = target_window(sound, 0)
    assert look is not None and look.label == label and look.channel == 0
    assert label in title(ascan(sound, 0).axes[-1])


def test_of_several_beams_the_closer_look_takes_the_strongest() -> None:
    """A beam alone keeps its number, and what is strongest in it is looked at."""
    steers = np.radians([0.5, 2.09, -3.0]).tolist()
    sound = recording_levels(ping({**two_targets(), "sonar.receive.steer": steers}))
    look = target_window(sound, 0)
    assert look is not None and (look.label, look.channel) == ("box", 1)
    alone = target_window(sound.only(2), 0)
    assert alone is not None and (alone.label, alone.channel) == ("buoy", 0)
    assert sound.only(2).named(channel=0).endswith("beam 2 steered -3.00 deg")


def test_the_closer_look_lasts_to_the_last_family() -> None:
    """Every arrival of the target, up to two bounces out and two back, lies in the window: 200 to 212 ms."""
    scenario = nominal({"paths.contributions": ["target"], "paths.geometry": "slice"})
    delay = arrivals(scenario).delay * 1e3
    first, last = (1e3 * when for when in echo_window(scenario, 0, scenario.targets[0]))
    assert first <= delay.min() < first + 2
    assert delay.max() <= last < delay.max() + 2
    look = target_window(recording_levels(simulate(scenario)), 0)
    assert look is not None and look.window[0] < first and look.window[1] > last


def test_a_target_that_is_not_received_is_not_drawn() -> None:
    """Outside the window there is no closer look."""
    assert target_window(recording_levels(ping({"track.window": [0.1, 0.12]})), 0) is None


def test_a_fan_names_its_targets_where_they_are() -> None:
    """Each label stands at the near side of its target: bearing and slant range of the geometry."""
    steer = np.radians(np.linspace(-6, 6, 13)).tolist()
    axes = sector_image(recording_levels(ping({**two_targets(), "sonar.receive.steer": steer})), 0).axes[0]
    place = {text.get_text(): text.xy for text in axes.texts if text.get_text() in ("box", "buoy")}
    assert place["buoy"] == pytest.approx((-8.0, np.sqrt(130.0**2 + 4.0**2)), abs=1e-6)
    assert place["box"][0] == pytest.approx(5.5, abs=0.1)
    assert place["box"][1] == pytest.approx(150.5, abs=2)


@pytest.mark.parametrize("half", [1.0, 6.0, 60.0])
def test_a_page_is_as_large_as_its_sector(half: float) -> None:
    """The axes hug the sector, with at most 2 inches for a needle; both scales are alike; the title is over it."""
    steer = np.radians(np.linspace(-half, half, 9)).tolist()
    figure = sector_image(
        recording_levels(
            ping({"paths.geometry": "3d", "paths.contributions": ["target"], "sonar.receive.steer": steer})
        ),
        0,
    )
    axes = figure.axes[0]
    box_of_axes = axes.get_position().transformed(figure.transFigure)
    metres_per_dot = np.ptp(axes.get_xlim()) / box_of_axes.width, np.ptp(axes.get_ylim()) / box_of_axes.height
    assert metres_per_dot[0] == pytest.approx(metres_per_dot[1], rel=1e-6)
    wide = axes.collections[0].get_coordinates()[..., 0]
    assert box_of_axes.width <= max(2.0 * figure.dpi, 1.5 * np.ptp(wide) / metres_per_dot[0])
    assert axes.get_title(loc="center") and not axes.get_title(loc="left")


def test_expectations_are_called_so() -> None:
    """A picture of expected levels states it in its title, and one of a ping among many states which."""
    sound = recording_levels(ping({"field": "incoherent", "track.pings": 2}))
    assert title(ascan(sound, 1).axes[0]) == "Nominal scene, expected level, ping 1"
    assert "expected" in title(waterfall(sound).axes[0])
    assert "expected" not in recording_levels(ping()).named()


def test_silence_does_not_stretch_the_colours() -> None:
    """Echoes in an empty sea: the darkest colour is at most 90 dB below the brightest."""
    low, high = colour_span(np.append(np.full(900, -300.0), np.linspace(-60, -20, 100)))
    assert high - low <= 90
