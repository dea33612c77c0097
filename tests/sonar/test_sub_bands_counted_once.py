"""Claims about the count of sub-bands: the search for it is done once for a sonar in its water."""

from insonify.simulator import build_simulator
from insonify.sonar import ping_geometry
from oracles.surveys import multibeam


def test_the_sub_bands_of_a_sonar_are_counted_once(monkeypatch):
    """Another draw of the same scene takes the count of the first; a longer window and a wider band are searched."""
    searched, error = [], ping_geometry.BandError
    ping_geometry._sufficient_counts.cache_clear()
    monkeypatch.setattr(ping_geometry, "BandError", lambda *about, **more: searched.append(1) or error(*about, **more))
    scene = multibeam(pings=1)
    wide = {"sonar.receiver.bandwidth": 60e3, "sonar.pulse.duration": 0.03e-3}
    others = (scene.with_(seed=5), scene.with_({"track.window": (0.008, 0.04)}), scene.with_(wide))
    counts = [len(build_simulator(one).ping_geometry(0).sub_bands) for one in (scene, *others)]
    assert counts[0] == counts[1] == 3 and counts[3] > 3 and len(searched) == 3
