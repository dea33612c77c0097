"""Claims about the arrivals of an interval: those of the whole ping that fall into it, found without the others."""

import numpy as np
import pytest

import insonify
from insonify.engines.eigenray_engine import EigenrayEngine
from insonify.scenario.scenario import Scenario
from oracles.scenes import nominal

WINDOW = (0.11, 0.112)
SEA = {"reflection": "statistical", "wind_speed": 4}
RELIEF = {"relief": [{"kind": "power-law", "hurst": 0.8, "rms": 0.1}]}
THERMOCLINE = {"profile": [[0, 1510], [8, 1510], [14, 1490], [20, 1490]]}
NEAR = {"window": (0.03, 0.15)}
SCENES: dict[str, dict] = {
    "flat": {},
    "four bounces": {"paths": {"max_reflections": 4}},
    "sea": {"surface": SEA},
    "relief": {"seabed": RELIEF},
    "relief, hard edges, a body": {
        "seabed": RELIEF,
        "paths": {"edge_diffraction": "none"},
        "targets": [{"shape": "box", "position": (2, 83), "size": (2, 1, 1)}],
    },
    "thermocline": {"water": THERMOCLINE},
    "slice": {"paths": {"geometry": "slice"}},
    "expected": {"field": "incoherent"},
    "smooth sphere": {
        "targets": [{"shape": "sphere", "position": (0, 83), "diameter": 1, "face_reflection_coefficient": 1}]
    },
    "water": {"water": {"volume_strength_db": -60}, "track": {"window": (0.1, 0.115)}},
}


def sorted_rows(found):
    """Delays, amplitudes and families in one order."""
    order = np.lexsort([found.amplitude.real, found.delay])
    return found.delay[order], found.amplitude[order], found.transmit_family[order], found.receive_family[order]


def scene(name: str) -> Scenario:
    """One of `SCENES`, of few scatterers."""
    changes = {"track": NEAR} | SCENES[name]
    paths = {"scatterers_per_cell": 1, "beam_cutoff_db": -30} | changes.pop("paths", {})
    return nominal(paths=paths, **changes)


@pytest.mark.parametrize("name", SCENES)
def test_they_are_those_of_the_whole_ping(name, monkeypatch):
    """To the bit, with paths worked out for a part of the scatterers only."""
    scenario, reached = scene(name), []
    pairs = EigenrayEngine.pairs
    monkeypatch.setattr(
        EigenrayEngine,
        "pairs",
        lambda self, here, block, **more: reached.append(len(block())) or pairs(self, here, block, **more),
    )
    whole, every = insonify.arrivals(scenario), sum(reached)
    reached.clear()
    some = insonify.arrivals(scenario, window=WINDOW)
    inside = whole.take((whole.delay >= WINDOW[0]) & (whole.delay <= WINDOW[1]))
    assert len(inside) > 0
    for one, other in zip(sorted_rows(some), sorted_rows(inside), strict=True):
        np.testing.assert_array_equal(one, other)
    if "sphere" not in name and "body" not in name and name != "water":  # most of whose points are in the interval
        assert sum(reached) < 0.9 * every


def test_an_interval_beyond_the_recording_is_refused_with_the_one_that_was_meant():
    """Milliseconds for seconds; elsewhere the recording's own delays are given."""
    scenario = scene("flat")
    with pytest.raises(ValueError, match=r"window is 110 to 112 s.* Did you mean \('110 ms', '112 ms'\)\?"):
        insonify.arrivals(scenario, window=(110, 112))
    with pytest.raises(ValueError, match=r"delays that touch the recording are .* ms. Give a part of that"):
        insonify.arrivals(scenario, window=(5, 6))
    with pytest.raises(ValueError, match="ends before it begins"):
        insonify.arrivals(scenario, window=(0.112, 0.11))
    with pytest.raises(ValueError, match="first and the last delay"):
        insonify.arrivals(scenario, window=(0.11,))
    with pytest.raises(ValueError, match="not a unit of time"):
        insonify.arrivals(scenario, window=("110 mm", "112 mm"))


def test_an_interval_may_have_units():
    """As scenarios do."""
    scenario = scene("slice")
    expected = insonify.arrivals(scenario, window=("110 ms", "112 ms"))
    np.testing.assert_array_equal(expected.delay, insonify.arrivals(scenario, window=WINDOW).delay)


def test_one_ping_may_be_given_by_its_number():
    """An int, of any kind, or a list; anything else is refused in words."""
    scenario = nominal(paths={"geometry": "slice"}, track={"window": (0.1, 0.11), "pings": 3})
    listed = insonify.simulate(scenario, pings=[2])
    for alone in (2, np.int64(2), np.int32(2)):
        assert insonify.simulate(scenario, pings=alone).identical(listed)
    with pytest.raises(ValueError, match="ping is 3; the track has pings 0 to 2"):
        insonify.simulate(scenario, pings=3)
    for strange in (1.5, True, "0", [0.5], ["0"], [True], np.array([0.5]), [None], [[0]]):
        with pytest.raises(TypeError, match=r"ping is .*; give a whole number, 0 to 2"):
            insonify.simulate(scenario, pings=strange)
    for strange in (0.5, "0", True, None):
        for function in (insonify.arrivals, insonify.labels, insonify.levels):
            with pytest.raises(TypeError, match=r"ping is .*; give a whole number, 0 to 2"):
                function(scenario, ping=strange)
        with pytest.raises(TypeError, match=r"channel is .*; give a whole number, 0 to 0"):
            insonify.levels(scenario, channel=strange)
