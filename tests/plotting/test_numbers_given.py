"""Pictures show the given numbers: read back from axes, images and files."""

import re

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.colors import to_rgb

from insonify import plotting
from insonify.plotting import style
from insonify.plotting.labels import KINDS, MEANING, STRENGTH
from insonify.plotting.levels import curves
from insonify.plotting.recording_levels import BELOW, RecordingLevels, colour_span, recording_levels
from insonify.plotting.sector_image import sector, sector_image
from insonify.plotting.sidescan import NAMES, sidescan
from insonify.plotting.validity_style import LawCurve, add_caveats, curve
from insonify.plotting.waterfall import thinned, waterfall


def sound(level, *, steer=None, start=0.01, step=1e-4, title="made up"):
    """A recording of given levels [dB], shape (ping, channel, time), that knows no scenario."""
    level = np.asarray(level, float)
    angles = np.zeros(level.shape[1]) if steer is None else np.asarray(steer, float)
    return RecordingLevels(level, start + step * np.arange(level.shape[2]), angles, None, title)


def random_levels(*shape, seed=0):
    """Levels about 80 dB."""
    return np.random.default_rng(seed).normal(80.0, 5.0, shape)


def side_image(across, along, gain="none", geometry="slant", seed=0):
    """A sidescan image of noise."""
    level = random_levels(len(along), len(across), seed=seed)
    return xr.Dataset(
        {"level_db": (("ping", "across"), level)},
        {"ping": np.arange(len(along)), "across": across, "along": ("ping", np.asarray(along, float))},
        {"gain": gain, "geometry": geometry},
    )


def test_each_line_of_a_waterfall_is_a_ping_and_each_pixel_a_sample():
    """Row p of the image is ping p, from the top; its ends stand at c t / 2 of the first and last sample."""
    level = random_levels(5, 2, 300)
    scenario = sound(level)
    panels = waterfall(scenario).axes[:2]
    for channel, axes in enumerate(panels):
        (image,) = axes.images
        np.testing.assert_array_equal(image.get_array(), level[:, channel])
        left, right, bottom, top = image.get_extent()
        assert (left, right) == pytest.approx((0.01 * 750, (0.01 + 299e-4) * 750))
        assert (bottom, top) == (4.5, -0.5)
        assert axes.get_xlabel() == "slant range [m]" and axes.get_ylabel() == "ping"


def test_two_panels_of_a_waterfall_share_their_colours():
    """A channel that is 10 dB weaker looks weaker: one colour means one level in both, and the bar states the unit."""
    level = random_levels(4, 2, 200)
    level[:, 1] -= 10
    figure = waterfall(sound(level))
    spans = {axes.images[0].get_clim() for axes in figure.axes[:2]}
    assert spans == {colour_span(level)}
    assert figure.axes[2].get_ylabel() == "level [dB re 1 uPa]"


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 400), st.integers(1, 50), st.integers(0, 2**31))
def test_thinning_keeps_order_bounds_and_energy(samples, columns, seed):
    """Never more columns than requested; the energy of each is the mean of the powers it stands for, in their order."""
    level = random_levels(3, samples, seed=seed)
    thin = thinned(level, columns)
    assert thin.shape[1] <= max(columns, 1)
    step = -(-samples // columns)
    for column in range(thin.shape[1]):
        part = 10 ** (level[:, column * step : (column + 1) * step] / 10)
        np.testing.assert_allclose(10 ** (thin[:, column] / 10), part.mean(axis=1), rtol=1e-9)


@settings(max_examples=50, deadline=None)
@given(st.floats(-200, 200), st.integers(0, 2**31), st.floats(0.1, 15))
def test_colours_go_with_the_levels(shift, seed, spread):
    """A span of whole fives around the median; 5 dB more sound are 5 dB more on both ends."""
    level = shift + spread * np.random.default_rng(seed).standard_normal(2000)
    low, high = colour_span(level)
    assert low % 5 == 0 and high % 5 == 0 and low < np.median(level) < high
    assert np.median(level) - low <= BELOW + 5
    more = colour_span(level + 5.0)
    assert more == pytest.approx((low + 5, high + 5), abs=5.01)
    with_silence = np.concatenate([level, [-np.inf, np.nan]])
    assert colour_span(with_silence) == (low, high)


def test_a_recording_of_zeros_has_colours_too():
    """No finite level at all: a span that can be drawn."""
    low, high = colour_span(np.full((2, 3), -np.inf))
    assert low < high and np.isfinite([low, high]).all()


def test_a_fan_has_every_beam_in_its_place():
    """Beams in any order: cell (beam, sample) holds its level, sorted by steer angle, and the range edges span all."""
    level, steer = random_levels(1, 6, 50), np.radians([10.0, -10, 2, -2, 6, -6])
    axes, bar = sector_image(sound(level, steer=steer), 0).axes
    (mesh,) = axes.collections
    np.testing.assert_array_equal(mesh.get_array(), level[0][np.argsort(steer)])
    reach = np.hypot(*np.moveaxis(mesh.get_coordinates(), -1, 0))
    assert reach.min() == pytest.approx(7.5) and reach.max() == pytest.approx((0.01 + 49e-4) * 750)
    assert bar.get_ylabel() == "level [dB re 1 uPa]"
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("to the right of boresight [m]", "along boresight [m]")


@pytest.mark.parametrize("steer", [[-5.0, 0, 5], [-40, -10, 15, 20], [30.0, 31]])
def test_the_cells_of_a_sector_meet_and_contain_their_beams(steer):
    """Each beam lies between the edges of its own cell, and the outer cells are as wide as their inner halves."""
    axes = style.new_figure().subplots()
    mesh = sector(axes, np.linspace(10, 20, 8), np.radians(steer), np.zeros((len(steer), 8)), (-1.0, 0.0))
    corner = mesh.get_coordinates()[:, -1]
    edge = np.degrees(np.arctan2(corner[:, 0], corner[:, 1]))
    assert np.all(edge[:-1] < steer) and np.all(steer < edge[1:])
    assert steer[0] - edge[0] == pytest.approx(edge[1] - steer[0])
    assert edge[-1] - steer[-1] == pytest.approx(steer[-1] - edge[-2])
    x, y = corner.T
    assert axes.get_xlim()[0] < x.min() and axes.get_xlim()[1] > x.max() and axes.get_ylim()[1] > y.max()


@pytest.mark.parametrize("gain", NAMES)
def test_a_sidescan_holds_both_halves_and_states_its_gain(gain):
    """Every pixel left of the track is in the left image, every other in the right; the bar names the gain."""
    across = np.concatenate([-np.arange(40.0, 0, -0.5), np.arange(0.5, 40.1, 0.5)])
    image = side_image(across, np.arange(6) * 2.0, gain)
    figure = sidescan(image, "two sides")
    axes, bar = figure.axes
    left, right = axes.images
    np.testing.assert_array_equal(left.get_array(), image.level_db.values[:, across < 0])
    np.testing.assert_array_equal(right.get_array(), image.level_db.values[:, across > 0])
    assert left.get_extent()[:2] == [-40, -0.5] and right.get_extent()[:2] == [0.5, 40]
    assert axes.get_xlabel() == "port  |  starboard,  slant range [m]" and axes.get_title(loc="left") in (
        "two sides",
        "",
    )
    assert bar.get_ylabel() == NAMES[gain] and "dB" in NAMES[gain]
    assert axes.xaxis.get_major_formatter()(-20, 0) == "20"  # a distance to port is no negative distance


def test_even_pings_are_drawn_over_the_distance_run_and_uneven_ones_over_their_number():
    """Each row is as high as the step; a stop in the middle would be a lie on an even axis."""
    across = np.arange(0.5, 20, 0.5)
    even = sidescan(side_image(across, [0, 3, 6, 9])).axes[0]
    assert even.get_ylabel() == "distance run [m]" and even.get_ylim() == pytest.approx((-1.5, 10.5))
    uneven = sidescan(side_image(across, [0, 3, 3, 9])).axes[0]
    assert uneven.get_ylabel() == "ping" and uneven.get_ylim() == pytest.approx((-0.5, 3.5))
    assert even.get_xlabel() == "slant range [m]"  # one side only


def test_a_title_states_what_there_are_several_of():
    """The number of a ping among many, the beam and its angle among many; a lone one has the title alone."""
    many = sound(random_levels(3, 2, 4), steer=np.radians([-2.0, 1.5]))
    assert many.named(ping=2, channel=1) == "made up, ping 2, beam 1 steered +1.50 deg"
    assert many.only(1).named(channel=0) == "made up, beam 1 steered +1.50 deg"
    assert sound(random_levels(1, 1, 4)).named(ping=0, channel=0) == "made up"
    np.testing.assert_array_equal(many.only(1).level[:, 0], many.level[:, 1])


def test_levels_of_a_pressure_are_its_square():
    """1 Pa = 1e6 uPa is 120 dB whatever its phase; an intensity of 1e12 uPa^2 is the same, and is called expected."""
    coords = {"time": [0.0, 1e-3], "steer": ("channel", [0.0])}
    pressure = np.array([[[1e6, -0.1j * 1e6]]])
    one = recording_levels(xr.Dataset({"pressure": (("ping", "channel", "time"), pressure)}, coords))
    other = recording_levels(xr.Dataset({"intensity": (("ping", "channel", "time"), np.abs(pressure) ** 2)}, coords))
    np.testing.assert_allclose(one.level, [[[120, 100]]])
    np.testing.assert_allclose(other.level, one.level)
    assert not one.expected and other.expected and one.scenario is None
    assert other.named() == "expected level"


def test_curves_of_levels_can_be_cut_and_break_at_silence():
    """Only times in the window, in milliseconds; silence is a gap in the line; a mute contribution is not drawn."""
    time, level = np.linspace(0, 0.1, 11), np.full((3, 1, 11), -np.inf)
    level[0, 0, 2:8], level[2] = np.arange(6) + 60.0, 70.0
    data = xr.Dataset(
        {"level_db": (("contribution", "pair", "time"), level)},
        {"contribution": ["seabed", "surface", "total"], "pair": ["all"], "time": time},
    )
    axes = style.new_figure().subplots()
    curves(axes, data, (0.035, 0.1))
    drawn = {str(line.get_label()): line for line in axes.lines}
    assert set(drawn) == {"seabed", "total"}
    np.testing.assert_allclose(drawn["seabed"].get_xdata(), [40, 50, 60, 70, 80, 90, 100])
    np.testing.assert_array_equal(drawn["seabed"].get_ydata(), [62, 63, 64, 65, np.nan, np.nan, np.nan])
    assert axes.get_xlim() == pytest.approx((35, 100)) and axes.get_ylim()[1] > 70
    assert (axes.get_xlabel()[-4:], axes.get_ylabel()) == ("[ms]", "level [dB re 1 uPa]")


def caught(monkeypatch):
    """Figures that would be written."""
    kept = []
    monkeypatch.setattr(style, "save_figure", lambda figure, path: kept.append(figure) or path)
    return kept


def labelled(pings=4, samples=60, **masks):
    """A recording of one channel and its labels; masks as rows of (ping, sample)."""
    time = 0.02 + 1e-4 * np.arange(samples)
    shape, coords = (
        (pings, 1, samples),
        {"time": time, "steer": ("channel", [0.0]), "object": ["seabed", "mine", "buoy"]},
    )
    values = {name: np.zeros(shape, bool) for name in KINDS}
    for name, places in masks.items():
        for ping, sample in places:
            values[name][ping, 0, sample] = True
    rng = np.random.default_rng(3)
    pressure = (rng.normal(size=shape) + 1j * rng.normal(size=shape)) * 1e5
    dims = ("ping", "channel", "time")
    recording = xr.Dataset({"pressure": (dims, pressure), "position": (("ping", "axis"), np.zeros((pings, 3)))}, coords)
    intensity = np.zeros((pings, 1, 3, samples))
    intensity[:, 0, 0], intensity[:, 0, 1, 10:20] = 1e8, 1e10
    dataset = xr.Dataset(
        {name: (dims, mask) for name, mask in values.items()}
        | {
            "object_intensity": (("ping", "channel", "object", "time"), intensity),
            "done": ("ping", np.ones(pings, bool)),
        },
        coords,
    )
    return recording, dataset


def test_a_labelled_sample_is_coloured_and_no_other(monkeypatch):
    """Grey where nothing is reported; elsewhere 65 % of the mask's own colour over the grey of the level."""
    kept = caught(monkeypatch)
    recording, masks = labelled(shadow=[(1, 5)], ghost=[(2, 7)], highlight=[(0, 0), (3, 59)])
    plotting.labels(recording, masks, "unused.png", gain="none")
    (plain,), (image,) = (kept[0].axes[row].images for row in (0, 1))
    assert plain.get_extent() == image.get_extent()
    picture = np.asarray(image.get_array())
    coloured = {tuple(place) for place in np.argwhere(np.ptp(picture, axis=-1) > 1e-9)}
    assert coloured == {(1, 5), (2, 7), (0, 0), (3, 59)}
    level = 20 * np.log10(np.abs(recording["pressure"].values[:, 0]))
    low, high = colour_span(level)
    grey = np.clip((level - low) / (high - low), 0, 1)[..., None] * np.ones(3)
    for name, place in (("shadow", (1, 5)), ("ghost", (2, 7)), ("highlight", (0, 0)), ("highlight", (3, 59))):
        grey[place] = 0.35 * grey[place] + STRENGTH * np.array(to_rgb(KINDS[name]))
    np.testing.assert_allclose(picture, grey, atol=1e-6)
    assert image.get_extent() == pytest.approx([15, 15 + 59e-4 * 750, -0.5, 3.5])
    assert {text.get_text() for text in kept[0].legends[0].get_texts()} == set(MEANING.values())


def test_a_labelled_trace_shows_the_objects_that_are_received(monkeypatch):
    """One curve for each object with an echo, at its level, never below 80 dB under the strongest."""
    kept = caught(monkeypatch)
    recording, masks = labelled(highlight=[(2, 12)])
    plotting.labels(recording, masks, "unused.png", ping=2)
    axes = kept[0].axes[0]
    drawn = {str(line.get_label()): np.asarray(line.get_ydata()) for line in axes.lines}
    assert set(drawn) == {"seabed", "mine"}
    np.testing.assert_allclose(drawn["seabed"], 80)
    np.testing.assert_allclose(drawn["mine"][10:20], 100)
    np.testing.assert_allclose(np.delete(drawn["mine"], np.s_[10:20]), 20)
    assert axes.get_ylim() == pytest.approx((20, 106)) and re.search(r"\[dB re 1 uPa\]$", axes.get_ylabel())


def test_the_labels_of_many_beams_are_a_sector_beside_their_levels(monkeypatch):
    """A mask lies at the range and bearing of its sample, beams in order of bearing, and nothing else is coloured."""
    kept = caught(monkeypatch)
    recording, masks = labelled(pings=2)
    steer = np.radians([10.0, -10.0, 0.0, 20.0, -20.0])
    recording, masks = (
        data.isel(channel=np.zeros(5, int)).assign_coords(steer=("channel", steer)) for data in (recording, masks)
    )
    masks["shadow"].values[1, 3, 40] = True
    plotting.labels(recording, masks, "unused.png", ping=1)
    plain, coloured = (axes.collections[0] for axes in kept[0].axes[:2])
    np.testing.assert_array_equal(plain.get_coordinates(), coloured.get_coordinates())
    picture = np.asarray(coloured.get_array())
    ((beam, sample),) = np.argwhere(np.ptp(picture, axis=-1) > 1e-9)
    right, ahead = coloured.get_coordinates()[beam : beam + 2, sample : sample + 2].reshape(-1, 2).T
    assert sorted(np.degrees(np.arctan2(right, ahead))) == pytest.approx([15, 15, 25, 25])
    assert np.hypot(right, ahead).mean() == pytest.approx(750 * masks["time"].values[40], abs=0.0375)
    assert [text.get_text() for text in kept[0].legends[0].get_texts()] == [MEANING["shadow"]]
    plotting.labels(recording, masks, "unused.png", ping=1, beam=3)
    assert kept[1].axes[0].get_xlabel() == "time [ms]"


@pytest.mark.parametrize(
    "suffix",
    [
        ".png",
        ".pdf",
        ".svg",
    ],
)
def test_the_same_figure_has_the_same_bytes_today_and_tomorrow(tmp_path, suffix, monkeypatch):
    """No date in any kind of file that is written twice, and the name is given back."""
    pictures = []
    for name, day in (("a", "1000000000"), ("b", "1500000000")):
        monkeypatch.setenv("SOURCE_DATE_EPOCH", day)
        target = tmp_path / f"{name}{suffix}"
        assert plotting.geometry(target) == target
        pictures.append(target.read_bytes())
    assert pictures[0] == pictures[1]


def test_doubts_are_reported_once_and_only_where_there_are_any():
    """Two curves with the same doubt: one line; none: no small print; a trusted curve is solid."""
    figure = style.new_figure()
    axes = figure.subplots()
    x = np.arange(3.0)
    for caveats, colour in (((), "red"), (("too fast, and the result is a guess",), "blue")):
        curve(axes, x, LawCurve(2 * x, caveats), colour, colour)
    solid, dashed = axes.lines
    assert solid.get_linestyle() == "-" and dashed.get_linestyle() == "--"
    np.testing.assert_array_equal(dashed.get_ydata(), [0, 2, 4])
    add_caveats(figure, [])
    assert figure._supxlabel is None
    add_caveats(figure, ["too fast, and the result is a guess", "too deep", "too fast, and the result is worse"])
    assert figure._supxlabel.get_text() == "Thin and dashed: too fast;\ntoo deep"
