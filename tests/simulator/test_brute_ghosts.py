"""Synthetic apertures under a moving sea: the target gathers, its ghosts do not, unless the sea stands still."""

import numpy as np
import pytest

from insonify.processing import synthetic_aperture_image
from insonify.scenario.scenario import Scenario
from insonify.simulator import simulate
from oracles.scenes import BED, point

pytestmark = pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")
APERTURE, AWAY, DEPTH = 1.5, 150.0, 19.5
INDEPENDENT, FROZEN = 1.0, 0.0
"""Time from ping to ping [s]; 0: as fast as a platform may go, 15 ms for the whole aperture."""


def scene(count, interval, seed, **more):
    """Pings over one fixed aperture abeam of a point target, under 3 m/s of wind."""
    step, line = APERTURE / count, {"kind": "line", "length": 0.3}
    speed = step / interval if interval else 100.0
    return Scenario(
        **{
            "water": {"noise_level_db": None, "absorption_db_per_m": 0.0},
            "seabed": BED,
            "seed": seed,
            "field": "coherent",
            "surface": {"reflection": "statistical", "wind_speed": 3.0},
            "targets": [point(0.0, AWAY, DEPTH)],
            "sonar": {
                "source_level_db": 220,
                "pulse": {"kind": "cw", "frequency": 100e3, "duration": 0.1e-3},
                "transmit": line,
                "receive": line,
                "receiver": {"bandwidth": 20e3},
                "mounting": {"bearing": np.pi / 2},
            },
            "track": {
                "kind": "line",
                "start": ((step - APERTURE) / 2, 0.0, 11.0),
                "speed": speed,
                "interval": step / speed,
                "pings": count,
                "window": (0.199, 0.208),
                "stop_and_hop": True,
            },
            "paths": {
                "max_reflections": 1,
                "families": ["D", "S"],
                "contributions": ["target"],
                "edge_diffraction": "none",
            },
            **more,
        }
    )


def image(scenario, north, east, depth=DEPTH):
    """Power of the focused image."""
    made = synthetic_aperture_image(
        simulate(scenario, threads=1), north, east, depth, stop_and_hop=True, navigation="true", threads=1
    )
    return np.abs(made.pressure.values) ** 2


def ghosts(count, interval, seeds):
    """Mean power and peak of the ghosts, over the target's peak, means over seas."""
    found = []
    for seed in range(seeds):
        seen = image(scene(count, interval, seed), np.linspace(-8, 8, 49), np.linspace(149, 156, 106))
        target, ghost = seen[:, :25], seen[:, 33:]
        found.append([ghost.mean() / target.max(), ghost.max() / target.max()])
    return 10 * np.log10(np.mean(found, axis=0))


def test_ghosts_fall_with_the_pings_over_independent_seas_only():
    """16 and 64 pings a second apart, 4 seas: ghosts 6 dB weaker, 1 dB (0.35 standard error); their peaks 5 to 8 dB.

    Over a sea that hardly moves in 15 ms: within 1 dB.
    """
    few, many = ghosts(16, INDEPENDENT, 4), ghosts(64, INDEPENDENT, 4)
    assert few[0] - many[0] == pytest.approx(10 * np.log10(4), abs=1.0)
    assert 4.0 < few[1] - many[1] < 8.0
    few, many = ghosts(16, FROZEN, 2), ghosts(64, FROZEN, 2)
    assert few[0] == pytest.approx(many[0], abs=1.0)


@pytest.mark.validate
def test_ghosts_of_256_pings_fall_by_12_db():
    """16 against 256 pings, 12 seas: 12 dB within 1 dB (0.2 standard error), and 0 within 1 dB over a frozen sea."""
    fall = [ghosts(16, interval, 12)[0] - ghosts(256, interval, 12)[0] for interval in (INDEPENDENT, FROZEN)]
    np.testing.assert_allclose(fall, [10 * np.log10(16), 0.0], atol=1.0)
