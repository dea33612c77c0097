"""Claims about intensities of a moving sonar: a beam receives from where it has come to, as for pressures."""

import numpy as np
import pytest

from insonify.scenario.scenario import Scenario
from insonify.simulator import simulate
from oracles.scenes import nominal

YAW = {"yaw": {"rms": 0.03, "period": 4.0}}


def abeam(
    speed, *, hop=False, field="incoherent", motion=None, max_reflections=0, seed=1, apart=0.0, window=(0.1, 0.13)
):
    """Sand received by 1 m arrays at 100 kHz; ends a little apart in depth take the general way."""
    ends = {"transmit": {"offset": (0.0, 0.0, -apart)}, "receive": {"offset": (0.0, 0.0, apart)}}
    paths = {"contributions": ["seabed"], "max_reflections": max_reflections, "scatterers_per_cell": 2}
    scenario = nominal(
        line={"length": 1.0}, field=field, seed=seed, paths=paths, sonar={"receiver": {"bandwidth": 20e3}}, **ends
    )
    track = {"kind": "line", "start": (0.0, 0.0, 11.0), "speed": speed, "heading": 0.4, "window": window,
             "motion": motion or {}, "stop_and_hop": hop}  # fmt: skip
    return Scenario(**scenario.model_dump(mode="json", exclude={"track"}), track=track)


def mean_db(scenario):
    """Mean level of an expectation [dB]."""
    return 10 * np.log10(simulate(scenario).intensity.values.mean())


@pytest.mark.parametrize("apart", [0.0, 1e-3], ids=["fast reverberation", "general engine"])
@pytest.mark.parametrize("speed", [2.0, 5.0])
def test_sand_is_weaker_by_what_two_parted_beams_share(speed, apart):
    """Integral of sinc^2 u sinc^2 (u - 2 v L / c wavelength) over that of sinc^4: 0.27 dB at 2 m/s; to 0.02 dB."""
    u = np.linspace(-40, 40, 80001)
    has_parallax = np.sinc(u - 2 * speed / 1500 / 0.015)
    expected = 10 * np.log10((np.sinc(u) ** 2 * has_parallax**2).sum() / (np.sinc(u) ** 4).sum())
    found = mean_db(abeam(speed, apart=apart)) - mean_db(abeam(speed, apart=apart, hop=True))
    assert found == pytest.approx(expected, abs=0.02)


def test_both_ways_to_the_ground_turn_alike():
    """Moving and yawing, with bounces: fast reverberation and general engine differ as at rest, by 0.02 dB."""
    levels = [[mean_db(abeam(3.0, apart=apart, hop=hop, motion=YAW, max_reflections=1)) for hop in (False, True)]
              for apart in (0.0, 1e-3)]  # fmt: skip
    (quick, still), (general, rest) = levels
    assert quick - still == pytest.approx(general - rest, abs=0.02)
    assert quick - still < -0.1


@pytest.mark.slow
def test_speckle_of_a_moving_sonar_has_the_expected_energy():
    """2 m/s and yawing: mean of |coherent|^2 over 24 seeds and 60 ms is the expectation within 0.15 dB.

    Some 7200 independent cells of speckle: known to 0.05 dB. Stop and hop would be 2 dB off.
    """
    received = []
    for seed in range(1, 25):
        coherent = simulate(abeam(2.0, field="coherent", motion=YAW, seed=seed, window=(0.1, 0.16))).pressure.values
        expected = simulate(abeam(2.0, motion=YAW, seed=seed, window=(0.1, 0.16))).intensity.values
        received.append([np.mean(np.abs(coherent) ** 2), expected.mean()])
    assert 10 * np.log10(np.divide(*np.mean(received, axis=0))) == pytest.approx(0, abs=0.15)
