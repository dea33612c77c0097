"""Claims about the veil of bubbles: figures read, limits, reciprocity, and what may be requested."""

import csv
import math
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.scattering.bubbles import Bubbles, bubble_extinction, bubble_loss_db
from insonify.validity import PhysicsWarning

FIGURE = list(
    csv.DictReader((Path(__file__).parents[1] / "published" / "apl_uw_tr9407_surface_bubble_loss.csv").open())
)
winds, tones = st.floats(0, 20), st.floats(1e4, 1e5)
angles, azimuths = st.floats(1e-3, np.pi / 2), st.floats(-np.pi, np.pi)


@pytest.mark.parametrize("row", FIGURE, ids=lambda row: f"{row['wind_speed_m_s']} m/s")
def test_the_loss_is_that_of_the_figure(row):
    """TR 9407's figure at 20 kHz and 10 degrees, to half of what can be read from it."""
    loss = bubble_loss_db(
        float(row["wind_speed_m_s"]), float(row["frequency_khz"]) * 1e3, np.radians(float(row["grazing_deg"]))
    )
    assert loss == pytest.approx(float(row["loss_db"]), abs=float(row["print_unit"]) / 2)


@given(tones, angles)
def test_the_loss_joins_at_6_metres_per_second(frequency, grazing):
    """The two wind laws of the loss meet where one takes over."""
    below, above = bubble_loss_db([6 - 1e-9, 6 + 1e-9], frequency, grazing)
    assert below == pytest.approx(above, rel=1e-6)


@given(tones, st.floats(0, 19), angles)
def test_more_wind_hides_more(frequency, wind, grazing):
    """The loss grows with wind and falls with grazing angle, never below 0 or past its cap."""
    calm, windy = bubble_loss_db([wind, wind + 1], frequency, grazing)
    assert 0 <= calm <= windy <= 15
    assert bubble_loss_db(wind, frequency, grazing / 2) >= calm


def test_a_gale_thickens_the_veil_without_a_step():
    """At 11 m/s the exponential becomes a power law: 3.5 of the wind."""
    below, at, twice = bubble_extinction([11 - 1e-9, 11, 22], 25e3)
    assert at == pytest.approx(10 ** (-5.2577 + 0.4701 * 11)) == pytest.approx(below, rel=1e-6)
    assert twice / at == pytest.approx(2**3.5)


@given(winds, tones, angles)
def test_straight_back_is_the_report(wind, frequency, grazing):
    """TR 9407: sigma_b = beta_v delta_r (1 + 8 beta e^(-2 beta) - e^(-4 beta)) / (8 pi delta beta)."""
    law, f = Bubbles(wind, frequency), frequency / 1e3
    veil = 10 ** (-5.2577 + 0.4701 * min(wind, 11)) * (f / 25) ** 0.85 * max(wind / 11, 1) ** 3.5
    beta, delta = veil / math.sin(grazing), 0.0255 * f ** (1 / 3)
    ways = (8 * beta * math.exp(-2 * beta) - math.expm1(-4 * beta)) / (2 * beta)
    printed = veil * 0.0136 / (4 * math.pi * delta) * ways
    assert law.cross_section(grazing, grazing, np.pi) == pytest.approx(printed, rel=1e-9)


@given(winds, tones, angles, angles, azimuths)
def test_reciprocity(wind, frequency, a, b, azimuth):
    """Swapping source and receiver changes nothing."""
    law = Bubbles(wind, frequency)
    assert law.cross_section(a, b, azimuth) == pytest.approx(law.cross_section(b, a, azimuth), rel=1e-10)


def test_the_mixed_ways_add_as_pressures_only_straight_back():
    """A thin veil sends back 6 parts straight back and 4 elsewhere: 1 + 1 + (1 + 1)^2 against 1 + 1 + 1 + 1."""
    law = Bubbles(0.5, 30e3)
    back, aside = law.cross_section(0.8, 0.8, np.array([np.pi, np.pi / 2]))
    assert back / aside == pytest.approx(1.5, rel=1e-4)


def test_the_cone_has_the_requested_width():
    """At the cone's half width the excess is 1/e of that straight back."""
    law, steep = Bubbles(0.5, 30e3, cone=0.05), 1.0
    # Turning both directions by a small angle about the vertical parts them by cos(grazing) times that angle.
    turned = 2 * np.arcsin(0.025 / np.cos(steep))
    back, edge, aside = law.cross_section(steep, steep, np.pi - np.array([0, turned, 1.0]))
    assert (edge - aside) / (back - aside) == pytest.approx(np.exp(-1), rel=1e-3)


def test_a_thick_veil_is_a_surface_of_its_own():
    """Through thick bubbles nothing of the sea is seen: sin(grazing) delta_r / (8 pi delta), whatever the wind."""
    low = math.radians(1.0)
    strong = [float(Bubbles(u, 50e3).cross_section(low, low, np.pi)) for u in (12, 15, 20)]
    expected = math.sin(low) * 0.0136 / (8 * math.pi * 0.0255 * 50 ** (1 / 3))
    assert strong == pytest.approx([expected] * 3, rel=1e-6)


def test_nothing_comes_from_behind_the_surface():
    """A direction above the surface receives nothing."""
    assert np.all(Bubbles(8, 50e3).cross_section([-0.1, 0.3, 0.0], [0.3, -0.1, 0.2], np.pi) == 0)


@pytest.mark.parametrize(
    ("wind", "frequency", "message"),
    [(-1, 5e4, "wind_speed is -1"), (float("nan"), 5e4, "wind_speed"), (7, 0, "frequency is 0.* Hz")],
)
def test_what_means_nothing_is_refused(wind, frequency, message):
    """A negative wind and a tone of 0 Hz have no veil."""
    with pytest.raises(ValueError, match=message):
        Bubbles(wind, frequency)
    with pytest.raises(ValueError, match=message):
        bubble_loss_db(wind, frequency, 0.3)


def test_an_angle_that_is_none_is_refused():
    """A grazing angle of 95 degrees is a mistake of units or of plane; so is a cone of no width."""
    with pytest.raises(ValueError, match="grazing is"):
        bubble_loss_db(7, 5e4, np.radians(95))
    with pytest.raises(ValueError, match=r"Bubbles\.cone is 0"):
        Bubbles(7, 5e4, cone=0)


@pytest.mark.parametrize(("wind", "frequency", "message"), [(7, 4e5, "10 to 100 kHz"), (25, 5e4, "0 to 20 m/s")])
def test_outside_the_law_one_warning_reports_it(wind, frequency, message):
    """A number comes back, with one sentence naming law and range; inside, silence."""
    with pytest.warns(PhysicsWarning, match=f"TR 9407.*{message}") as caught:
        assert bubble_loss_db(wind, frequency, 0.3) > 0
    assert len(caught) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Bubbles(7, 5e4).cross_section(0.3, 0.4, 1.0)
