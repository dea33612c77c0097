"""Claims about the picture of a body with and without multipath: levels re the bed, echoes at their delays."""

import numpy as np
import pytest

from insonify.plotting.multipath_view import ABOVE, SPAN, PassByLevels, TargetEcho, multipath_view

TIME, NORTH = np.linspace(0.19, 0.23, 401), np.linspace(-6, 6, 13)
DARK = 0.203, 0.215
ECHOES = [TargetEcho("D-D", 0.2, 1e-5), TargetEcho("D-S", 0.2025, 1e-4)]


def passing(bed_db=90.0, filled_db=10.0):
    """A bed of one level, 30 dB less in the shadow by direct paths, less filled by all."""
    inside = np.abs(TIME - np.mean(DARK)) < np.ptp(DARK) / 2
    direct = 10 ** ((bed_db - 30 * inside) / 10)
    whole = 10 ** ((bed_db + 3 - (30 - filled_db) * inside) / 10)
    rows = np.ones((len(NORTH), 1))
    return PassByLevels(TIME, NORTH, whole * rows, direct * rows, whole, direct, whole, direct)


def view(**levels):
    """Image by direct paths, image by all, and traces."""
    figure = multipath_view(passing(**levels), ECHOES, DARK, 1500.0, "box")
    return figure.axes[:3]


@pytest.mark.parametrize("bed_db", [40.0, 90.0])
def test_each_image_is_levels_above_its_own_bed(bed_db):
    """The bed is 0 dB in both however strong the sonar is; the shadow is 30 dB down, and 20 where it is filled."""
    direct, whole, _ = view(bed_db=bed_db)
    for axes, dark in ((direct, -30.0), (whole, -20.0)):
        values = np.asarray(axes.images[0].get_array())
        assert values[0, 0] == pytest.approx(0, abs=1e-9)
        assert values.min() == pytest.approx(dark, abs=1e-9)
        assert axes.images[0].get_clim() == (ABOVE - SPAN, ABOVE)
    assert f"{bed_db:.0f} dB re 1 uPa" in direct.get_title() and f"{bed_db + 3:.0f} dB" in whole.get_title()


def test_times_are_milliseconds_and_places_metres():
    """The image spans what was received; the axes state in which units."""
    direct, _, traces = view()
    np.testing.assert_allclose(direct.images[0].get_extent(), [190, 230, -6, 6])
    assert traces.get_xlim() == pytest.approx((190, 230))
    assert traces.get_xlabel().endswith("[ms]") and traces.get_ylabel() == "level [dB re 1 uPa]"


def test_echoes_are_named_where_they_begin():
    """Each pair once, at its delay."""
    _, whole, traces = view()
    assert [(text.get_text(), text.xy[0]) for text in whole.texts] == [("D-D", 200.0), ("D-S", 202.5)]
    assert {200.0, 202.5} <= {float(line.get_xdata()[0]) for line in traces.lines}


def test_traces_are_the_levels_of_the_mean_powers():
    """Received and expected, with and without multipath: 10 log of what was given."""
    *_, traces = view()
    by_name = {line.get_label(): line.get_ydata() for line in traces.lines}
    given = passing()
    for name, power in (("all paths", given.trace), ("direct paths alone", given.direct_trace)):
        for kind in ("simulated", "expected"):
            np.testing.assert_allclose(by_name[f"{name}, {kind}"], 10 * np.log10(power), atol=1e-9)


def test_silence_is_drawn_and_not_warned_of():
    """No sound at all in the shadow: a level that can be drawn, and the same bed."""
    silent = passing()
    direct = silent.direct.copy()
    direct[:, 150:200] = 0.0
    trace = direct.mean(axis=0)
    levels = PassByLevels(TIME, NORTH, silent.image, direct, silent.trace, trace, silent.expected, trace)
    axes = multipath_view(levels, [], DARK, 1500.0, "box").axes[0]
    assert np.isfinite(np.asarray(axes.images[0].get_array())).all()
