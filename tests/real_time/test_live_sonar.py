"""A live sonar: the same bits as a recording on the same track, and advice where a pose is none."""

import gc
import os
import subprocess
import sys
import threading
import tracemalloc
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import insonify
from insonify.propagation.solid_shadows import _built_triangles
from insonify.real_time import PlatformPose
from insonify.scenario.scenario import Scenario
from insonify.validity import PhysicsWarning
from oracles.scenes import nominal, point

SURVEY: dict[str, Any] = {
    "seed": 3,
    "water": {"noise_level_db": 60.0},
    "seabed": {"depth": 10.0, "relief": {"kind": "power-law", "hurst": 0.8, "rms": "3 cm"}},
    "targets": [{"shape": "library", "name": "tyre", "position": [1.0, 6.0]}],
    "sonar": {
        "source_level_db": 220,
        "pulse": {"kind": "cw", "frequency": "100 kHz", "duration": "0.2 ms"},
        "transmit": {"kind": "planar", "width": 0.3, "height": 0.02},
        "receive": {"kind": "planar", "width": 0.3, "height": 0.02, "offset": [0.2, 0.1, 0.0]},
        "mounting": {"bearing": "90 deg", "tilt": "20 deg"},
        "sides": ["port", "starboard"],
    },
    "track": {
        "kind": "line", "start": [0.0, 0.0, 4.0], "heading": 0.3, "speed": "3 m/s", "pings": 3, "interval": 0.1,
        "window": [0.0, "13 ms"], "motion": {"roll": {"rms": "2 deg", "period": 4.0}},
        "navigation_errors": {"north": {"noise": 0.5, "correlation_time": 2.0, "drift": 0.1}, "roll": {"noise": 0.01}},
    },
    "paths": {"max_reflections": 1, "scatterers_per_cell": 1},
}  # fmt: skip
ELEMENTS = {"kind": "elements", "positions": [[0, -0.02, 0], [0, 0, 0], [0, 0.02, 0.01]]}
SEA = {"wind_speed": "5 m/s", "reflection": "explicit"}


def survey(**changes: Any) -> Scenario:
    """Three pings past a tyre on fractal ground, rolling, logged with errors."""
    values = {key: {**SURVEY[key], **changes.pop(key)} if key in ("sonar", "track", "water") and key in changes
            else value for key, value in SURVEY.items()}  # fmt: skip
    return Scenario.model_validate({**values, **changes})


def pinged(scenario: Scenario, pings: int, **options: Any) -> list[xr.Dataset]:
    """The first pings of a scenario's own track, one by one."""
    with insonify.live(scenario, warm_up=False, **options) as sonar:
        return [sonar.ping(**sonar.track_ping(ping)) for ping in range(pings)]


OTHER = {"kind": "line", "start": [3.0, 1.0, 5.0], "speed": 2.0, "heading": 1.0, "navigation_errors": {"east": {
    "noise": 0.3}}}  # fmt: skip
RECORDER = {"full_scale_db": 150.0, "stages": [
    {"kind": "gain", "tvg_db_per_decade": 30.0}, {"kind": "looks", "samples": 3}, {"kind": "clipping"},
    {"kind": "quantisation", "bits": 12}]}  # fmt: skip
CASES = {
    "expected intensity": survey(field="incoherent"),
    "coherent": survey(),
    "sea that moves": survey(surface=SEA, track={"pings": 2}),
    "stop and hop": survey(track={"stop_and_hop": True}),
    "elements": survey(sonar={"receive": ELEMENTS, "receiver": {"record": "elements"}}),
    "two platforms": survey(receiver_track=OTHER, sonar={"sides": None}),
    "lines of a recorder": survey(sonar={"recorder": RECORDER}),
    "lines alone": survey(field="incoherent", sonar={"recorder": {**RECORDER, "keep": "recorded"}}),
    "layered water": survey(water={"profile": [[0.0, 1510.0], [10.0, 1495.0]]}, track={"motion": {}, "pings": 2}),
}


@pytest.mark.parametrize("case", CASES)
def test_pings_are_those_of_a_recording(case: str) -> None:
    """Every variable, coordinate and attribute of every ping of the track, bit for bit, with noise and logged poses."""
    scenario = CASES[case]
    whole = insonify.simulate(scenario)
    for ping, here in enumerate(pinged(scenario, whole.sizes["ping"])):
        xr.testing.assert_identical(here, whole.isel(ping=[ping]).isel(line=[ping], missing_dims="ignore"))
        assert ("recorded" in here) == (scenario.sonar.recorder is not None)


def test_a_ping_off_the_track_is_that_of_a_track_of_its_own() -> None:
    """Forty metres aside and a metre deeper, from one pose: the series of a platform that stands there, bit for bit."""
    place, lean = (40.0, 5.0, 5.0), (1.0, 0.02, -0.05)
    still = {"kind": "static", "position": place, "heading": lean[0], "pitch": lean[1], "roll": lean[2]}
    with insonify.live(survey(), warm_up=False) as sonar, pytest.warns(PhysicsWarning, match="off the scenario's"):
        one = sonar.ping(0.0, place, lean)
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # once is enough
            sonar.ping(1.0, place, lean)
    standing = Scenario.model_validate({**SURVEY, "track": {**still, "window": [0.0, "13 ms"]}})
    np.testing.assert_array_equal(one["pressure"], insonify.simulate(standing)["pressure"])


def test_motion_comes_from_the_pose_before() -> None:
    """The second of two poses has the mean velocity and turn rate since the first, through north as well."""
    first = PlatformPose((0, 0, 4), (np.radians(359), 0, 0))
    second = PlatformPose((0.3, 0, 4), (np.radians(1), 0, 0.01)).following(first, 0.1)
    np.testing.assert_allclose(second.velocity, (3, 0, 0), rtol=1e-12)
    np.testing.assert_allclose(second.turn_rate, (np.radians(20), 0, 0.1), rtol=1e-9)
    half, whole = second.later_poses(1.0, 0.2)
    np.testing.assert_allclose(whole.position, [(0.9, 0, 4)])
    np.testing.assert_allclose(half.heading, np.radians(3))


def test_any_thread_may_ping_and_restart_repeats() -> None:
    """Pings by four threads at once are numbered in turn; after `restart` the first ping has the first bits."""
    with insonify.live(survey(field="incoherent", track={"motion": {}}), threads=1, warm_up=False) as sonar:
        first = sonar.ping(**sonar.track_ping(0))
        numbers: list[int] = []

        def work() -> None:
            made = sonar.ping(1.0, (0, 0, 4), velocity=(0, 0, 0), turn_rate=(0, 0, 0))
            numbers.append(int(made["ping"][0]))

        threads = [threading.Thread(target=work) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert sorted(numbers) == [1, 2, 3, 4] and sonar.ping_count == 5
        sonar.restart()
        xr.testing.assert_identical(sonar.ping(**sonar.track_ping(0)), first)


WRONG = [
    ({"position": (0, 0, 11)}, "below the seabed"),
    ({"position": (0, 0, -1)}, "above the sea surface"),
    ({"position": (1.0, 6.0, 9.9)}, "inside tyre"),
    ({"position": (0, 0, np.nan)}, "finite"),
    ({"position": (0, 4)}, "three finite numbers"),
    ({"position": "here"}, "three numbers"),
    ({"position": (0, 0, 4), "attitude": (270, 0, 0)}, "rad"),
    ({"position": (0, 0, 4), "attitude": (0, 2, 0)}, "pitch"),
    ({"position": (0, 0, 4), "velocity": (300, 0, 0)}, "m/s"),
    ({"position": (0, 0, 4), "time": float("inf")}, "time of transmission"),
    ({"position": (0, 0, 4), "time": 4.0}, "before 5 s"),
    ({"position": (900, 0, 4)}, "faster than 100 m/s"),
    ({"position": (0, 0, 4), "attitude": (3, 0, 0), "time": 5.1}, "turned by"),
    ({"position": (0, 0, 4), "window_poses": 3}, "two of"),
    ({"position": (0, 0, 4), "receiver": PlatformPose((0, 0, 5))}, "one platform"),
]


def test_wrong_poses_are_refused_with_advice_and_change_nothing() -> None:
    """Each wrong argument is named with its value, and the ping after it is still the second."""
    with insonify.live(survey(field="incoherent"), warm_up=False) as sonar:
        sonar.ping(5.0, (0, 0, 4))
        for values, words in WRONG:
            with pytest.raises(ValueError, match=words):
                sonar.ping(**{"time": 6.0, **values})
        assert sonar.ping_count == 1
        sonar.close()
        sonar.close()
        with pytest.raises(RuntimeError, match="closed"):
            sonar.ping(6.0, (0, 0, 4))


def test_layered_water_requires_depths_that_have_rays() -> None:
    """A depth without a table of rays is refused; with positions above and below it, it is simulated."""
    layered = CASES["layered water"]
    with insonify.live(layered, warm_up=False) as sonar, pytest.raises(ValueError, match="positions"):
        sonar.ping(0.0, (0, 0, 5))
    with insonify.live(layered, positions=[(0, 0, 3), (0, 0, 6)], warm_up=False) as sonar:
        assert np.isfinite(sonar.ping(0.0, (0, 0, 5), (0, 0.1, 0))["pressure"]).all()


def test_a_warm_up_prepares_targets_all_around() -> None:
    """A tyre abeam of a sonar that first faces north: its triangles are sorted before the first ping."""
    scenario = survey(field="incoherent", sonar={"mounting": {"bearing": 0.0, "tilt": "20 deg"}, "sides": None})
    _built_triangles.cache_clear()
    with insonify.live(scenario):
        assert _built_triangles.cache_info().currsize == 1


def test_objects_from_before_the_first_ping_are_left_out_of_garbage_collection() -> None:
    """From the warm-up until the last of two sonars is closed, and closing one twice counts once."""
    gc.unfreeze()
    scenario = survey(field="incoherent", targets=[])
    with insonify.live(scenario) as one:
        with insonify.live(scenario) as other:
            assert gc.get_freeze_count() > 0
        other.close()
        assert gc.get_freeze_count() > 0
        one.sequence().close()
    assert gc.get_freeze_count() == 0


def test_two_platforms_want_both_poses() -> None:
    """The pose of a receiver whose track moves cannot be guessed."""
    with insonify.live(CASES["two platforms"], warm_up=False) as sonar, pytest.raises(ValueError, match="receiver"):
        sonar.ping(0.0, (0, 0, 4))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")
def test_memory_does_not_grow_with_pings() -> None:
    """50 pings, each from a new pose, after as many: Python holds less than 75 kB more.

    Kept pings would be over 0.15 MB; caches of bounded size still fill.
    """
    scene = nominal(targets=[point(0.0, 10.0, 15.0)], field="incoherent", paths={"contributions": ("target",)},
                    track={"window": (0.005, 0.02), "stop_and_hop": False})  # fmt: skip
    with insonify.live(scene, threads=1, warm_up=False) as sonar:
        tracemalloc.start()
        try:
            sizes = []
            for n in range(100):
                sonar.ping(0.1 * n, (0.001 * n, 0, 11), (0.0003 * n, 0, 0))
                if n in (50, 99):
                    gc.collect()
                    sizes.append(tracemalloc.get_traced_memory()[0])
        finally:
            tracemalloc.stop()
    assert sizes[1] - sizes[0] < 75_000, sizes


def test_elements_out_of_the_water_are_refused() -> None:
    """A pose that rolls an element above the surface is named with its element."""
    with insonify.live(CASES["elements"], warm_up=False) as sonar, pytest.raises(ValueError, match="element"):
        sonar.ping(0.0, (0, 0, 0.015), (0, 1.5, 0))


def test_no_ping_waits_for_packages() -> None:
    """After the warm-up the first ping loads nothing, and a log without noise no filters: in a process of its own."""
    script = """
import sys, warnings
warnings.simplefilter("ignore")
import insonify
from oracles.surveys import sidescan
sonar = insonify.live(sidescan(pings=2), threads=1)
known = set(sys.modules)
sonar.ping(**sonar.track_ping(0))
print(*sorted(set(sys.modules) - known), *sorted({"scipy.signal"} & set(sys.modules)))
"""
    folder = str(Path(__file__).parents[1])
    found = subprocess.run(
        [sys.executable, "-c", script], env={**os.environ, "PYTHONPATH": folder}, capture_output=True, text=True,
        check=True, timeout=300,
    )  # fmt: skip
    assert found.stdout.split() == []
