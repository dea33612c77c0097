"""Pictures of recordings: the right kind for what was recorded, and nothing lost on the way."""

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
import xarray as xr

from insonify import drawing, simulate
from insonify.drawing.ascan import ascan, target_window
from insonify.drawing.fan import fan
from insonify.drawing.heard import colour_span, heard
from insonify.drawing.waterfall import COLUMNS, thinned, waterfall
from insonify.study.paper.nominal import nominal


def ping(changes: dict[str, Any] | None = None) -> xr.Dataset:
    """The target alone, in one vertical plane, about its direct echo."""
    quick = {"paths.geometry": "slice", "paths.reflections": 0, "track.window": [0.19, 0.21]}
    return simulate(nominal({**quick, **(changes or {})}))


def beams(count: int) -> xr.Dataset:
    """The target in three dimensions, heard by some beams."""
    steer = np.radians(np.linspace(-3, 3, count)).tolist()
    return ping({"paths.geometry": "3d", "paths.causes": ["target"], "sonar.receive.steer": steer})


@pytest.mark.parametrize("suffix", [".png", ".pdf", ".svg"])
def test_a_picture_is_written_as_its_suffix_says(tmp_path: Path, suffix: str) -> None:
    """PNG, PDF and SVG, each with its own first bytes."""
    first = {".png": b"\x89PNG", ".pdf": b"%PDF", ".svg": b"<?xml"}
    path = drawing.recording(ping(), tmp_path / f"ping{suffix}")
    assert path.read_bytes().startswith(first[suffix])


def test_drawing_leaves_nothing_behind(tmp_path: Path) -> None:
    """Neither the house rules nor a figure stay in matplotlib's global state."""
    before = dict(matplotlib.rcParams)
    drawing.recording(ping(), tmp_path / "ping.png")
    assert dict(matplotlib.rcParams) == before


def test_the_same_recording_makes_the_same_picture(tmp_path: Path) -> None:
    """No date in the file: the same bytes."""
    one, other = (drawing.recording(ping(), tmp_path / name).read_bytes() for name in ("a.png", "b.png"))
    assert one == other


def test_a_lone_ping_is_a_trace_and_its_target_is_looked_at_closer() -> None:
    """One channel and one ping: level over time, and the target's neighbourhood beneath."""
    axes = ascan(heard(ping()), 0).axes
    assert [a.get_ylabel() for a in axes] == ["level [dB re 1 uPa]", "rms pressure [mPa]"]
    (line,) = axes[0].lines
    np.testing.assert_allclose(line.get_ydata(), 20 * np.log10(np.abs(ping()["pressure"].values[0, 0])), atol=1e-4)


def test_the_closer_look_contains_the_echo() -> None:
    """The target's direct echo comes at twice its slant range over the speed of sound."""
    window = target_window(heard(ping()))
    assert window is not None
    assert window[0] < 2e3 * np.hypot(150.0, 9.0) / 1500 < window[1]


def test_many_pings_are_a_waterfall() -> None:
    """One row of the image for each ping, slant range along it."""
    figure = waterfall(heard(ping({"track.pings": 3})))
    (image,) = figure.axes[0].images
    assert image.get_array().shape == (3, 500)
    np.testing.assert_allclose(image.get_extent()[:2], [0.19 * 750, 0.20996 * 750], rtol=1e-6)


def test_many_beams_are_a_fan_with_the_target_ahead() -> None:
    """The brightest spot of the fan is where the target stands: straight ahead, 150 m away."""
    sound = heard(beams(7))
    (mesh,) = fan(sound, 0).axes[0].collections[:1]
    brightest = np.unravel_index(np.argmax(mesh.get_array()), mesh.get_array().shape)
    x, y = mesh.get_coordinates()[brightest]
    assert abs(x) < 1.5
    assert y == pytest.approx(np.hypot(150, 9), abs=0.4)


def test_starboard_is_on_the_right() -> None:
    """A beam steered to the right of boresight is drawn on the right, whatever the order of the beams."""
    turned = beams(7).isel(channel=slice(None, None, -1))
    (mesh,) = fan(heard(turned), 0).axes[0].collections[:1]
    x = mesh.get_coordinates()[:, 0, 0]
    assert np.all(np.diff(x) > 0)


def test_a_ping_that_is_not_there_is_not_drawn(tmp_path: Path) -> None:
    """Of a recording without pings there is no picture; of one begun there is."""
    begun = ping({"track.pings": 3})
    begun["pressure"][1:] = np.nan
    assert drawing.recording(begun, tmp_path / "begun.png").exists()
    begun["pressure"][:] = np.nan
    with pytest.raises(ValueError, match="holds no ping yet"):
        drawing.recording(begun, tmp_path / "nothing.png")


def test_silence_and_intensity_can_be_drawn(tmp_path: Path) -> None:
    """A recording of expected intensity with not a single echo in it."""
    quiet = ping({"field": "incoherent", "targets": [], "paths.causes": ["target"]})
    assert drawing.recording(quiet, tmp_path / "quiet.png").exists()


def test_apparent_target_strength_is_the_target_strength() -> None:
    """A point of -10 dB, alone in the water: its level with the way undone is -10 dB."""
    point = {"shape": "point", "label": "point", "position": [0, 150, 11], "target_strength_db": -10.0}
    sound = heard(ping({"targets": [point], "paths.causes": ["target"], "sonar.pulse.duration": 2e-3}))
    row = int(np.argmin(np.abs(sound.time - 0.201)))
    # 1 ms into the echo the range is read 0.75 m too far: 40 log10(150.75 / 150) = 0.09 dB, and 0.05 dB absorbed
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
