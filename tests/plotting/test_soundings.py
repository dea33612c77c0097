"""Claims about the picture of a multibeam: rays where they look, depths where they lie, errors in centimetres."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.collections import QuadMesh

from insonify.plotting.soundings import CELLS, SwathSoundings, depth_span, soundings_view

PINGS, BEAMS, SAMPLES = 12, 61, 240
ANGLE = np.radians(np.linspace(-60, 60, BEAMS))
SLANT = np.linspace(4, 40, SAMPLES)
KEEL, BED = 2.0, 20.0


def soundings(*, roll=0.0, off=0.0, pings=PINGS, first=0):
    """A level bed 18 m under the keel, sounded so much too deep [m]; its echo is 40 dB above the rest."""
    reach = (BED - KEEL) * np.tan(ANGLE)
    across = np.broadcast_to(reach, (pings, BEAMS))
    along = np.broadcast_to(np.arange(pings)[:, None] * 1.0, (pings, BEAMS))
    truth = np.full((pings, BEAMS), BED)
    level = np.where(np.abs(SLANT - (BED - KEEL) / np.cos(ANGLE - roll)[:, None]) < 0.2, 100.0, 60.0)
    beside = np.linspace(reach[0], reach[-1], 50)
    return SwathSoundings(ANGLE, along, across, truth + off, truth, np.ones(truth.shape, bool), 0, first, SLANT, level,
                     (KEEL, roll), (beside, np.full(50, BED)))  # fmt: skip


def panels(figure):
    """Axes by their titles."""
    return {axes.get_title(): axes for axes in figure.axes if axes.get_title()}


@given(st.lists(st.floats(1, 5000), min_size=1, max_size=50))
def test_colours_span_all_depths_but_a_hundredth(depths):
    """Ends are whole quarters of a metre, in order, outside the middle 98.9 % of the depths, and less than 0.25 m."""
    values = np.array(depths)
    low, high = depth_span(values)
    inner = np.quantile(values, [0.01, 0.999])
    assert low <= inner[0] < low + 0.25 and high - 0.25 < inner[1] <= high
    assert low <= high and low * 4 == round(low * 4) and high * 4 == round(high * 4)


def test_depths_that_are_missing_do_not_count():
    """NaN where a beam found nothing: the span is that of the others."""
    assert depth_span(np.array([10.1, np.nan, 12.2])) == depth_span(np.array([10.1, 12.2]))


@pytest.mark.parametrize("roll", [0.0, np.radians(8), np.radians(-8)])
def test_the_bright_line_of_a_ping_is_the_bed_whatever_the_roll(roll):
    """Rays are drawn from the keel as the ship lay: the strongest cells lie at the bed's depth, to half a metre."""
    axes = panels(soundings_view(soundings(roll=roll), "swath"))[f"Ping 0: {BEAMS} beams"]
    mesh = axes.findobj(QuadMesh)[0]
    place, level = mesh.get_coordinates(), np.asarray(mesh.get_array())
    bright = place.reshape(-1, 2)[level.ravel() > 90]
    assert len(bright) > BEAMS and np.abs(bright[:, 1] - BED).max() < 0.5
    assert np.ptp(bright[:, 0]) > 40


def test_depth_grows_downwards_and_a_metre_is_a_metre():
    """The ping is to scale, the keel above the bed, the true bed among the lines, units on the axes."""
    axes = panels(soundings_view(soundings(off=0.1), "swath"))[f"Ping 0: {BEAMS} beams"]
    low, high = axes.get_ylim()
    assert low > BED > KEEL > high and axes.get_aspect() == 1
    truth, found = axes.lines
    np.testing.assert_allclose(truth.get_ydata(), BED)
    np.testing.assert_allclose(found.get_ydata(), BED + 0.1)
    assert axes.get_ylabel() == "depth [m]"


def test_thinned_samples_keep_their_energy():
    """Ten times the samples that are drawn, every tenth at 100 dB in silence: each cell has 90 dB."""
    slant, level = np.linspace(4, 40, 10 * CELLS), np.full((BEAMS, 10 * CELLS), -100.0)
    level[:, ::10] = 100.0
    figure = soundings_view(replace(soundings(), slant=slant, level=level), "swath")
    mesh = panels(figure)[f"Ping 0: {BEAMS} beams"].findobj(QuadMesh)[0]
    np.testing.assert_allclose(np.asarray(mesh.get_array()), 90.0, atol=1e-6)


@pytest.mark.parametrize("off", [0.25, -0.04])
def test_the_error_is_what_was_sounded_less_what_is_there(off):
    """Too deep is positive, in centimetres, at the beam's angle in degrees."""
    axes = panels(soundings_view(soundings(off=off), "swath"))["Sounded minus true depth, bed only"]
    median = next(line for line in axes.lines if line.get_label() == "median")
    np.testing.assert_allclose(median.get_ydata(), 100 * off, atol=1e-9)
    np.testing.assert_allclose(median.get_xdata(), np.degrees(ANGLE))
    assert axes.get_ylabel() == "depth error [cm]"


def test_soundings_of_targets_do_not_count_as_errors():
    """A wreck 6 m high under the middle beams: the errors of the others are as they were."""
    found = soundings(off=0.25)
    bed, depth = found.bed.copy(), found.depth.copy()
    bed[:, 25:36], depth[:, 25:36] = False, BED - 6
    axes = panels(soundings_view(replace(found, bed=bed, depth=depth), "swath"))["Sounded minus true depth, bed only"]
    median = next(line for line in axes.lines if line.get_label() == "median")
    assert len(median.get_xdata()) == BEAMS - 11
    np.testing.assert_allclose(median.get_ydata(), 25.0, atol=1e-9)


@pytest.mark.parametrize("pings", [1, 2, PINGS])
def test_depths_lie_in_cells_where_they_were_put(pings):
    """North is up, starboard is right: a swath of any number of pings fills its own place and no other."""
    found = soundings(pings=pings)
    figure = panels(soundings_view(found, "swath"))
    for title in ("Depth sounded", "True depth"):
        (image,) = figure[title].images
        left, right, low, high = image.get_extent()
        assert left == -right and low <= 0 and high >= pings - 1
        assert np.quantile(np.abs(found.across), 0.97) == pytest.approx(right)
        assert figure[title].get_aspect() == 1


@pytest.mark.filterwarnings("error")
def test_perfect_soundings_are_a_flat_line():
    """No error at all: the axis still has a height."""
    axes = panels(soundings_view(soundings(), "swath"))["Sounded minus true depth, bed only"]
    assert axes.get_ylim()[0] < 0 < axes.get_ylim()[1]


@pytest.mark.filterwarnings("error")
def test_a_swath_of_targets_alone_has_no_errors_to_draw():
    """Nothing is bed: depths are drawn, the panel of errors is empty, and nothing is warned of."""
    found = soundings(off=0.1)
    axes = panels(soundings_view(replace(found, bed=np.zeros_like(found.bed)), "swath"))
    assert all(len(line.get_xdata()) in (0, 2) for line in axes["Sounded minus true depth, bed only"].lines)


def test_a_ping_has_its_number_not_its_row():
    """Of a recording that begins with ping 20, the ping in the first row is ping 20."""
    assert f"Ping 20: {BEAMS} beams" in panels(soundings_view(soundings(first=20), "swath"))


@pytest.mark.parametrize(("spacing", "pings"), [(5.0, 9), (1.3, 9), (0.25, 4), (1.0, 1)])
def test_rounding_of_a_track_leaves_no_strip_of_a_map_empty(spacing, pings):
    """Positions a nanometre off: each row of the map has soundings, the first and the last as well."""
    found = soundings(pings=pings)
    noise = np.random.default_rng(1).normal(scale=1e-9, size=found.depth.shape)
    figure = soundings_view(replace(found, along=np.arange(pings)[:, None] * spacing + noise), "swath")
    (image,) = panels(figure)["Depth sounded"].images
    unknown = np.all(np.isclose(image.get_array()[..., :3], 0x30 / 255), axis=-1)
    assert (~unknown).mean(axis=1).min() == (~unknown).mean(axis=1).max()


@pytest.mark.parametrize("spacing", [1.3, 5.0])
def test_two_maps_take_most_of_their_part_of_the_figure(spacing):
    """A short track and a long one: the maps, drawn to scale, fill more than a third of the figure's lower part."""
    found = soundings()
    figure = soundings_view(replace(found, along=found.along * spacing), "swath")
    figure.draw_without_rendering()
    maps = [panels(figure)[title].get_window_extent() for title in ("Depth sounded", "True depth")]
    lower = maps[0].y1 / figure.bbox.height
    assert sum(one.width * one.height for one in maps) > lower * figure.bbox.width * figure.bbox.height / 3
