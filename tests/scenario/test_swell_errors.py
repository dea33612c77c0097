"""Swells that focus are refused before the run, with numbers that pass."""

import re

import numpy as np
import pytest

from insonify.scenario.scenario import Scenario
from insonify.scenario.swell_errors import required_curvature_radius
from insonify.scenario.track_errors import array_positions
from insonify.simulator import simulate
from oracles.scenes import nominal, point

LINE = {"kind": "line", "start": (0.0, 0.0, 4.0), "pings": 3, "speed": 2.0, "interval": 0.2, "window": (0.04, 0.09)}


def built(height, length, *, track=None, **more):
    """A tilted swell over the nominal bed, out to 90 m, by all paths with two bounces."""
    settings = {"track": {"window": (0.0, 0.12)}, "paths": {"max_reflections": 2}, "line": {"length": 0.1}, **more}
    scenario = nominal(**settings).model_dump()
    scenario["surface"] = {"reflection": "tilted", "swell": {"height": height, "length": length}}
    return Scenario(**{**scenario, **({} if track is None else {"track": track})})


@pytest.mark.parametrize(
    "more",
    [
        {}, {"paths": {"max_reflections": 2, "families": ["S"]}},
        {"paths": {"max_reflections": 4, "beam_cutoff_db": -30}},
        {"targets": [point(0.0, 60.0, 4.0)], "paths": {"contributions": ["target"], "max_reflections": 2}},
        {"track": LINE},
    ],
)  # fmt: skip
def test_a_swell_that_focuses_is_refused_with_advice_that_works(more):
    """Families, targets, a moving sonar: the height, or the length, that the message names passes check and run."""
    with pytest.raises(ValueError, match="reflects at several points") as fault:
        built(0.9, 20.0, **more)
    words = r"height of at most ([\d.e-]+) m, a length of at least ([\d.e+]+) m"
    height, length = (float(number) for number in re.search(words, str(fault.value)).groups())
    for one in (built(height, 20.0, **more), built(0.9, length, **more)):
        assert np.isfinite(simulate(one, pings=[0])["pressure"].values).all()
    with pytest.raises(ValueError, match="reflects at several points"):
        built(1.15 * height, 20.0, **more)


def test_a_path_focuses_by_the_formula_of_the_design():
    """2 eta'' r1 r2 / ((r1 + r2) sin g) = 1 at 2.9 cm amplitude and 20 m length, S to a point at 150 m, within 5 %."""
    scenario = nominal(
        targets=[point(0.0, 150.0, 19.5)],
        paths={"contributions": ["target"], "families": ["S"]},
        track={"window": (0, 0.3)},
    )
    sine = 30.5 / np.hypot(30.5, 150)
    curvature = 2 * np.pi**2 * 0.058 / 20.0**2
    flatness, family = required_curvature_radius(scenario, array_positions(scenario))
    assert family == "S"
    assert curvature * flatness == pytest.approx(2 * curvature * (11 / sine) * (19.5 / sine) / (30.5 / sine) / sine)
    assert curvature * flatness == pytest.approx(1.0, rel=0.05)
