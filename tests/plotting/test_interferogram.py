"""Claims about the picture of an interferometric sidescan: both sides about the track, depths where they are sure."""

import numpy as np
import pytest

from insonify.plotting.interferogram import THIN, SwathSide, interferogram_view

SLANT, RUN = np.linspace(10, 40, 301), np.linspace(0, 4, 9)
SHAPE = len(RUN), len(SLANT)
DEPTH = 20.0


def side(sign, *, sure=None, samples=301):
    """A level bed 12 m below the sonar; depths lie 0.1 m too deep, and are unsure beyond 30 m."""
    slant = np.linspace(10, 40, samples)
    shape = len(RUN), samples
    across = np.broadcast_to(sign * np.sqrt(np.maximum(slant**2 - 12**2, 0)), shape)
    phase = np.broadcast_to(np.linspace(-np.pi, np.pi, samples), shape)
    known = np.broadcast_to(slant < 30, shape) if sure is None else sure
    truth = np.full(shape, DEPTH)
    return SwathSide(sign, np.broadcast_to(80 - slant / 2, shape), phase, across, truth + 0.1, truth, known)


def panels(figure):
    """Axes by their titles."""
    return {axes.get_title(): axes for axes in figure.axes if axes.get_title()}


@pytest.fixture(scope="module")
def both():
    """Port and starboard."""
    return panels(interferogram_view([side(-1), side(1)], SLANT, RUN, 4, "both"))


@pytest.mark.parametrize("title", ["Sidescan image", "Phase between the receivers", "Depth by phase"])
def test_port_is_left_of_the_track_and_starboard_right(both, title):
    """Each side from its first range outwards, along the track upwards; the gap between is what was not received."""
    port, starboard = both[title].images
    assert port.get_extent() == [-10, -40, 0, 4] and starboard.get_extent() == [10, 40, 0, 4]
    assert both[title].get_xlim() == (-40, 40)
    assert both[title].get_xlabel() == "port  |  starboard,  slant range [m]"


def test_one_side_alone_begins_at_the_track():
    """Starboard alone has an axis from 0 to its last range, and no word of port."""
    axes = panels(interferogram_view([side(1)], SLANT, RUN, 4, "one"))["Sidescan image"]
    assert axes.get_xlim() == (0, 40) and axes.get_xlabel() == "slant range [m]"


def test_ranges_are_written_without_a_sign(both):
    """30 m to port is 30 m."""
    write = both["Sidescan image"].xaxis.get_major_formatter()
    assert write(-30.0, 0) == write(30.0, 0) == "30"


def test_depths_that_are_unsure_are_left_out(both):
    """Of 301 samples those beyond 30 m are empty in the depths and in the truth beside them, and nothing else is."""
    for title in ("Depth by phase", "True depth at the same positions"):
        for image in both[title].images:
            kept = ~np.isnan(np.ma.filled(image.get_array().astype(float), np.nan))
            np.testing.assert_array_equal(kept, np.broadcast_to(SLANT < 30, SHAPE))


def test_measured_and_true_depths_have_one_scale(both):
    """Colours mean the same in both pictures, whatever the errors are."""
    one, other = both["Depth by phase"].images[0], both["True depth at the same positions"].images[0]
    assert one.get_clim() == other.get_clim() and one.get_clim()[0] <= DEPTH <= one.get_clim()[1]


def test_phases_use_the_whole_circle(both):
    """From -pi to pi on colours whose ends meet: neither end looks like a cliff."""
    image = both["Phase between the receivers"].images[0]
    np.testing.assert_allclose(image.get_clim(), [-np.pi, np.pi])
    ends = np.array([image.cmap(0.0), image.cmap(1.0)])
    assert np.abs(ends[0] - ends[1]).max() < 0.05


def test_a_profile_is_drawn_deep_down_and_in_place(both):
    """Places to port are negative, depth grows downwards, and only depths that are sure are drawn."""
    axes = both["Profile of the ping at 2.0 m"]
    low, high = axes.get_ylim()
    assert low > high
    truth, found = axes.lines[0], axes.lines[1]
    assert truth.get_xdata().max() <= 0 and found.get_xdata().min() < -27
    assert len(found.get_xdata()) == np.count_nonzero(SLANT < 30)
    np.testing.assert_allclose(found.get_ydata(), DEPTH + 0.1)
    np.testing.assert_allclose(truth.get_ydata(), DEPTH)
    assert (np.diff(truth.get_xdata()) >= 0).all()


def test_long_pings_are_thinned_but_never_averaged():
    """1400 samples: no more columns than are drawn, each of them one of the phases that were measured."""
    one = side(1, samples=1400)
    image = panels(interferogram_view([one], np.linspace(10, 40, 1400), RUN, 0, "long"))[
        "Phase between the receivers"
    ].images[0]
    drawn = np.asarray(image.get_array())
    assert drawn.shape[1] <= THIN
    assert np.isin(drawn, one.phase).all()


def test_a_swath_without_a_sure_depth_is_still_a_picture():
    """Noise alone: image and phase are there, depths are empty, and nothing is warned of."""
    nothing = np.zeros(SHAPE, bool)
    figure = interferogram_view([side(-1, sure=nothing), side(1, sure=nothing)], SLANT, RUN, 4, "noise")
    axes = panels(figure)["Depth by phase"]
    assert np.isnan(np.ma.filled(axes.images[0].get_array().astype(float), np.nan)).all()
    figure.canvas.draw()


def test_a_ping_without_a_sure_depth_is_still_a_profile():
    """The middle ping received nothing: its profile is empty, those of the others are as ever."""
    some = np.ones(SHAPE, bool)
    some[4] = False
    for row, drawn in ((4, 0), (3, len(SLANT))):
        axes = interferogram_view([side(1, sure=some)], SLANT, RUN, row, "gap").axes
        (profile,) = [one for one in axes if one.get_title().startswith("Profile")]
        assert len(profile.lines[1].get_xdata()) == drawn
