"""Claims about the ripple of expected intensities under a statistical sea: given where it is, and only there."""

import numpy as np
import pytest

from insonify.estimates.expectation_ripple import ENOUGH, expectation_ripple
from insonify.simulator import simulate
from oracles.few_of import few_of
from oracles.scenes import nominal

SEA = {"reflection": "statistical", "wind_speed": 3.0}


def expected(length=1.5, points=5.0, seed=1, **top):
    """The nominal sidescan's expected intensity by D and S, 1.5 m arrays or others."""
    settings = {"surface": SEA, "field": "incoherent", "track": {"window": (0.06, 0.08)}, "targets": []} | top
    paths = {"max_reflections": 1, "scatterers_per_cell": points, "contributions": ["seabed"]}
    return nominal(seed=seed, line={"length": length}, paths=paths, **settings)


@pytest.mark.slow
@few_of((0,), "length", [0.5, 1.5])
def test_samples_ripple_as_much_as_the_note_states(length):
    """5 points against 40, whose own ripple is a third: 1 to 2 dB rms, and a fifth for chance."""
    few, many = (simulate(expected(length, points)).intensity.values[0, 0] for points in (5.0, ENOUGH))
    ripple = np.std(10 * np.log10(few / many))
    assert "ripple by 1.0 to 2.0 dB rms" in expectation_ripple(expected(length))
    assert 0.8 < ripple < 2.0 * 1.2


@pytest.mark.parametrize(
    "scenario",
    [expected(length=0.1), expected(points=ENOUGH), expected(surface={}), expected(field="coherent"),
     expected().with_({"paths.contributions": ["target"]}), expected().with_({"paths.max_reflections": 0})],
    ids=["wide beams", "many points", "flat sea", "coherent", "targets alone", "no surface paths"],
)  # fmt: skip
def test_no_note_is_given_where_glints_do_not_ripple(scenario):
    """Beams wider than the glints' spread, enough points, no glints, no expectation."""
    assert expectation_ripple(scenario) == ""


def test_the_note_names_the_key_and_falls_with_the_points():
    """Twenty points: half of the ripple of five."""
    note = expectation_ripple(expected(points=20.0))
    assert "ripple by 0.5 to 1.0 dB rms" in note and f"paths.scatterers_per_cell: {ENOUGH:g}" in note
