"""When there is sound, and when there is none; windows of any start and any length, water of any depth."""

import numpy as np
import pytest

from insonify.simulator import arrivals, simulate
from oracles.scenes import nominal, point
from oracles.time_series import relative_rms

SURFACE = {"surface": {"scattering": {"strength_db": -27}}, "contributions": ("surface",), "first": 2 * 11 / 1500}
SEABED = {"surface": {}, "contributions": ("seabed",), "first": 2 * 9 / 1500}


@pytest.mark.parametrize("case", [SEABED, SURFACE], ids=["seabed", "surface"])
def test_no_echo_comes_before_sound_can_have_gone_there_and_back(case):
    """First bottom 12.000 ms, first surface 14.667 ms: no arrival earlier, some within 5 us.

    In the recording the silence before is filled by the ringing of the receiver's band alone, which falls as
    time^-3: more than 90 dB down 2 ms earlier and before (mean; seen: 102), 75 dB down at its strongest 1 ms before
    (seen: 80).
    """
    scenario = nominal(surface=case["surface"], paths={"max_reflections": 0, "contributions": case["contributions"]},
                       track={"window": (0.0, 0.02)})  # fmt: skip
    first = case["first"]
    delay = arrivals(scenario).delay
    assert first <= delay.min() < first + 5e-6
    received = simulate(scenario)
    power, time = np.abs(received.pressure.values[0, 0]) ** 2, received.time.values
    peak = power[(time > first) & (time < first + 1e-3)].mean()
    assert 10 * np.log10(power[time < first - 2e-3].mean() / peak) < -90
    assert 10 * np.log10(power[time < first - 1e-3].max() / peak) < -75


@pytest.mark.parametrize(
    ("family", "first"), [("S", 2 * (2 * 11 + 9)), ("BS", 2 * (2 * 9 + 11 + 20))], ids=["surface", "bottom-surface"]
)
def test_bounced_paths_reach_the_bed_when_their_images_do(family, first):
    """Straight down by way of the surface, 31 m each way, or of bottom and surface, 49 m."""
    scenario = nominal(paths={"families": (family,)}, track={"window": (0.0, first / 1500 + 2e-3)})
    assert first / 1500 <= arrivals(scenario).delay.min() < first / 1500 + 1e-5


def test_mixed_paths_under_the_sonar_come_where_the_timetable_states():
    """Down and back by the surface: 9 + 31 m, 26.667 ms, in both orders."""
    found = arrivals(nominal(paths={"max_reflections": 1}, track={"window": (0.0, 0.028)}))
    for out, back in (("D", "S"), ("S", "D")):
        rows = (found.transmit_family == out) & (found.receive_family == back)
        assert 40 / 1500 <= found.delay[rows].min() < 40 / 1500 + 1e-5


@pytest.mark.parametrize("window", [(0.198, 0.235), (0.016, 0.02)], ids=["late", "after the strongest echo"])
@pytest.mark.parametrize("field", ["coherent", "incoherent"])
def test_a_window_is_a_piece_of_the_whole(field, window):
    """A window alone, against the same samples of 0 to 240 ms: relative rms 1e-5, up to the edges.

    Seen: 8e-6, what is left of the ringing of the strongest echo, from straight below.
    """
    whole, part = (
        simulate(nominal(field=field, track={"window": span}, paths={"max_reflections": 0}))
        for span in ((0.0, 0.24), window)
    )
    first = round(window[0] * 25e3)
    piece = whole.isel(time=slice(first, first + part.sizes["time"]))
    np.testing.assert_allclose(part.time, piece.time, atol=1e-12)
    name = "pressure" if field == "coherent" else "intensity"
    assert relative_rms(part[name].values, piece[name].values) < 1e-5


def test_shallow_water_rings_on_for_a_second():
    """5 m of water, six bounces a leg, a window of 1 s.

    Every family of a far point target arrives, and the bed's mean level keeps falling.
    """
    reached = arrivals(
        nominal(seabed={"depth": 5}, targets=[point(0, 700, 4)], track={"window": (0.0, 1.0), "position": (0, 0, 2)},
                paths={"max_reflections": 6, "contributions": ["target"]})
    )  # fmt: skip
    assert len(reached) == 13**2
    received = simulate(
        nominal(seabed={"depth": 5}, field="incoherent", line={"shading": "hann"},
                track={"window": (0.0, 1.0), "position": (0, 0, 2)},
                sonar={"source_level_db": 220, "receiver": {"bandwidth": 2e3}},
                paths={"max_reflections": 6, "families": ("D", "S", "BSBSBS"), "beam_cutoff_db": -20,
                       "scatterers_per_cell": 1})
    ).intensity.values[0, 0]  # fmt: skip
    decades = [part.mean() for part in np.array_split(received[100:], 8)]
    assert np.all(np.isfinite(received)) and np.all(received[100:] > 0)
    assert np.all(np.diff(decades) < 0)


@pytest.mark.parametrize(("depth", "sonar", "window"), [(300.0, 30.0, (0.36, 0.362)), (2.0, 0.3, (0.03, 0.05))])
def test_any_depth_of_water_is_received(depth, sonar, window):
    """Deep under the sonar and in a puddle: arrivals within the window, sound in the recording."""
    scenario = nominal(seabed={"depth": depth}, track={"position": (0, 0, sonar), "window": window},
                       paths={"beam_cutoff_db": -20, "scatterers_per_cell": 1})  # fmt: skip
    power = np.abs(simulate(scenario).pressure.values) ** 2
    assert np.isfinite(power).all() and power.mean() > 0
