"""The coherent reading: every echo adds its pulse, in phase."""

import numpy as np
import pytest

from insonify.simulator import arrivals, simulate
from oracles.scenes import PULSE, nominal, point
from oracles.time_series import pulse_spectrum, received, relative_rms

TONE = {"duration": 0.2e-3, "fraction": 0.2, "bandwidth": 0.0, "band": 20e3, "matched_filter": False}


def test_one_echo_is_the_source_level_less_twice_the_loss():
    """One point, direct.

    P = 10^(SL/20) / L^2 10^(-2 alpha L / 20) TS, turned by the carrier's phase over 2 L / c, at the flat middle
    of a long pulse. Tolerance 1e-3: ripples of the receiver's band.
    """
    long = {**PULSE, "duration": 4e-3, "taper": "hann"}
    scenario = nominal(
        targets=[point(0, 60.0, 11.0, strength=-6)], water={"noise_level_db": None, "absorption_db_per_m": 0.035},
        sonar={"source_level_db": 200, "pulse": long}, track={"window": (0.07, 0.1)},
        paths={"max_reflections": 0, "contributions": ["target"]},
    )  # fmt: skip
    series = simulate(scenario)
    middle = int(np.argmin(np.abs(series.time.values - (0.08 + 2e-3))))
    level = 200 - 40 * np.log10(60) - 2 * 0.035 * 60 - 6
    expected = 10 ** (level / 20) * np.exp(-2j * np.pi * 100e3 * 0.08)
    assert series.pressure.values[0, 0, middle] == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_a_point_target_is_received_along_every_pair_of_paths(order):
    """1, 9, 25 echoes of one point against their sum over frequencies: relative rms 1e-5."""
    scenario = nominal(targets=[point(0, 150, 19.5)], track={"window": (0.19, 0.23)},
                       paths={"max_reflections": order, "contributions": ["target"]})  # fmt: skip
    found = arrivals(scenario)
    series = simulate(scenario)
    truth = received(found.delay, 1e11 * found.amplitude, series.time.values, 100e3,
                  lambda f: pulse_spectrum(f, **TONE), 25e3, 2048)  # fmt: skip
    assert relative_rms(series.pressure.values[0, 0], truth) < 1e-5


def test_each_channel_receives_through_its_own_beam():
    """A fan of three beams: each channel is the same beam received alone, to 1e-6."""
    fan = (-0.02, 0.0, 0.02)
    settings = {
        "targets": [point(1, 150, 19.5)],
        "track": {"window": (0.199, 0.203)},
        "paths": {"contributions": ["target"]},
    }
    together = simulate(nominal(receive={"steer": fan}, **settings)).pressure.values[0]
    for channel, steer in enumerate(fan):
        alone = simulate(nominal(receive={"steer": steer}, **settings)).pressure.values[0, 0]
        assert relative_rms(together[channel], alone) < 1e-6


def test_exchanging_source_and_receiver_changes_nothing():
    """Reciprocity.

    Ends apart, multipath, a point target and a bed: the same series to 1e-4 (tiles at the beam's floor are chosen
    from the transmitter's side).
    """
    first, second = {"offset": (0.3, 0.0, -1.0)}, {"offset": (-0.2, 0.1, 1.0)}
    both = [
        simulate(nominal(targets=[point(0, 150, 19.5)], transmit=a, receive=b, track={"window": (0.2, 0.202)},
                         seabed={"depth": 20, "reflection": "medium sand"})).pressure.values
        for a, b in ((first, second), (second, first))
    ]  # fmt: skip
    assert relative_rms(*both) < 1e-4
