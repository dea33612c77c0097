"""Claims about the picture of a synthetic aperture's strip: levels re the bed, places in metres, cuts re the peak."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.plotting.strip_map import DEEP, PointResponse, StripMap, range_trend, strip_map_view

ALONG, ACROSS, RUN = np.linspace(2, 8, 31), np.linspace(20, 32, 49), np.linspace(0, 10, 21)
LEVELS = st.floats(-40, 40)


def strip(level=None, single=None):
    """A strip whose bed falls by 0.5 dB a metre, speckle left out."""
    falls = 90 - 0.5 * (ACROSS - ACROSS[0])
    return StripMap(
        ALONG, ACROSS,
        np.tile(falls, (len(ALONG), 1)) if level is None else level,
        RUN, np.tile(falls - 7, (len(RUN), 1)) if single is None else single,
    )  # fmt: skip


def point():
    """A round peak of 0 dB, 3 pixels along and 5 across from the true position."""
    off = np.arange(-0.1, 0.1001, 0.01)
    level = -1e4 * ((off[:, None] - 0.03) ** 2 + (off - 0.05) ** 2)
    return PointResponse("point", off, level, (13, 15), 120.0, 25.0)


def images(figure):
    """Every image of a figure, by the title of its axes."""
    return {axes.get_title(): (axes, axes.images[0]) for axes in figure.findobj(lambda a: hasattr(a, "images"))
            if getattr(axes, "images", None)}  # fmt: skip


@given(LEVELS, st.floats(-0.5, 0.5))
def test_a_bed_on_a_straight_line_is_that_line(level, slope):
    """A bed whose level falls evenly with range is found exactly, whatever stands above or below in places."""
    line = level + slope * np.arange(49.0)
    bed = np.tile(line, (31, 1))
    bed[5:8, 10:30] -= 30  # a shadow over a tenth of the strip
    bed[20:22, 40:44] += 40  # and a bright body
    np.testing.assert_allclose(range_trend(bed), line, atol=1e-8)


def test_a_bed_is_known_where_nothing_was_received():
    """Columns that hold no number get the line of the others, without a warning."""
    bed = strip().level.copy()
    bed[:, :7] = np.nan
    np.testing.assert_allclose(range_trend(bed), strip().level[0], atol=1e-8)


def test_both_images_are_levels_above_their_own_bed():
    """Single pings are 7 dB weaker and look alike: a step of 12 dB in both is 12 dB in both."""
    level, single = strip().level.copy(), strip().single.copy()
    level[10:12, 20], single[4:6, 20] = level[10:12, 20] + 12, single[4:6, 20] + 12
    drawn = images(strip_map_view(strip(level, single), [], [], "strip"))
    focused = drawn["all pings focused together"][1].get_array()
    alone = drawn["each ping by itself, its elements as one array"][1].get_array()
    assert focused.shape == (len(ACROSS), len(ALONG)) and alone.shape == (len(ACROSS), len(RUN))
    np.testing.assert_allclose([focused[20, 10], alone[20, 4]], 12, atol=1e-6)
    np.testing.assert_allclose([focused[20, 0], alone[20, 0], focused[-1, -1], alone[-1, -1]], 0, atol=1e-6)


def test_a_metre_is_a_metre_along_and_across():
    """Pixels stand where they were focused; a ping is as wide as the way to the next, and about its own place."""
    drawn = images(strip_map_view(strip(), [], [], "strip"))
    axes, focused = drawn["all pings focused together"]
    _, alone = drawn["each ping by itself, its elements as one array"]
    np.testing.assert_allclose(focused.get_extent(), [2, 8, 20, 32])
    np.testing.assert_allclose(alone.get_extent(), [-0.25, 10.25, 20, 32])
    assert axes.get_aspect() == 1
    assert axes.get_xlabel() == "along the track [m]"


@pytest.mark.parametrize(("along", "named"), [(1.9, False), (2.0, True), (5.0, True), (8.0, True), (8.1, False)])
def test_only_what_lies_in_the_strip_is_named(along, named):
    """A label stands at its body; one of a body outside the strip would stand on the frame."""
    axes, _ = images(strip_map_view(strip(), [("mine", along, 25.0)], [], "strip"))["all pings focused together"]
    assert [(text.get_text(), text.xy) for text in axes.texts] == ([("mine", (along, 25.0))] if named else [])


def test_cuts_go_through_the_peak():
    """Along and across, each highest where the peak stands, 0 dB there, in centimetres."""
    figure = strip_map_view(strip(), [], [point()], "strip")
    (cuts,) = [axes for axes in figure.findobj(lambda a: hasattr(a, "get_ylabel"))
               if axes.get_ylabel() == "level [dB re peak]"]  # fmt: skip
    along, across = cuts.lines
    for line, centre in ((along, 3.0), (across, 5.0)):
        x, y = line.get_data()
        assert x[np.argmax(y)] == pytest.approx(centre) and y.max() == pytest.approx(0, abs=1e-9)
    assert cuts.get_ylim()[0] == DEEP
    patch, image = images(figure)["point, closer"]
    # rows of the picture are across the track: its brightest pixel is 5 across, 3 along
    assert np.unravel_index(np.argmax(image.get_array()), image.get_array().shape) == (15, 13)
    assert (patch.get_xlabel(), patch.get_ylabel()) == ("along, from the true position [cm]", "across [cm]")


@pytest.mark.parametrize(("far", "near"), [(400.0, 20.0), (22.0, 20.0)])
def test_a_long_strip_still_fits_a_page(far, near):
    """Strips of any proportion make a sheet between 5.6 and 12 inches high."""
    across = np.linspace(near, far, 49)
    figure = strip_map_view(StripMap(ALONG, across, strip().level, RUN, strip().single), [], [], "strip")
    assert 5.6 <= figure.get_figheight() <= 12 and figure.get_figwidth() < 20
