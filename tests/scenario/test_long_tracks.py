"""Claims about checks over many pings: their work follows what is near a boundary, not the length of the track."""

import pytest

from insonify.scenario import element_errors
from oracles.arrays import elements_scenario, line_of


def of_many_pings(depth):
    """A line of elements far from both boundaries, or near the surface, at five thousand pings."""
    track = {"kind": "line", "start": (0, 0, depth), "heading": 0, "speed": 1.0, "pings": 5000, "interval": 0.1}
    return elements_scenario([(0, 20, 5)], receive=line_of(8, 1.0), track={**track, "window": (0.0, 0.05)})


def test_elements_far_from_both_boundaries_are_placed_at_no_ping(monkeypatch):
    """Where the array's size does not reach the surface or the bed, no pose is looked at."""
    calls = []
    turned = element_errors.receiver_rotation
    monkeypatch.setattr(element_errors, "receiver_rotation", lambda *words: calls.append(1) or turned(*words))
    of_many_pings(10.0)
    assert len(calls) < 100


@pytest.mark.filterwarnings("ignore")
def test_elements_far_apart_make_no_pattern_beyond_the_widest():
    """Hydrophones ten kilometres apart are a fault or a scene, never a crash of the validator."""
    from insonify.sonar.element_array import ElementArray
    from insonify.sonar.hydrophones import MAX_APERTURE, filled_aperture

    assert filled_aperture(ElementArray(positions=[(0, 0, 0), (0, 1e4, 0)])).length == MAX_APERTURE
