"""The tracer in layered water: rays against closed forms, and every pair of families against the eigenray engine."""

import numpy as np
import pytest

from insonify.engines.tracer._trace_kernel import BED, NOTHING, SURFACE
from insonify.engines.tracer.family_legs import TracedLegs, nearest_delay
from insonify.engines.tracer.tracing_scene import open_water_hits
from insonify.ocean.profile import SoundSpeedProfile
from insonify.propagation.sound_speed_layers import sound_speed_layers
from insonify.simulator import build_simulator
from oracles.few_of import few_of
from oracles.scenes import point
from oracles.traced import BOX, FRACTAL, apart_db, curves, scene

WARM_TOP = {"noise_level_db": None, "profile": [[0, 1530], [12, 1500], [20, 1496]]}
UPWARD = {"noise_level_db": None, "profile": [[0, 1490], [20, 1510]]}
DUCT = {"noise_level_db": None, "profile": [[0, 1510], [8, 1490], [20, 1512]]}
BINS = 15


def both(**changes):
    """Curves of each pair of families by the tracer and by the eigenray engine."""
    return tuple(curves(scene(engine, **changes)) for engine in ("tracer", "eigenrays"))


def binned_db(power):
    """Levels of `BINS` equal parts of a curve [dB]."""
    size = len(power) // BINS
    return 10 * np.log10(power[: BINS * size].reshape(BINS, size).mean(axis=1))


@pytest.mark.parametrize("gradient", [10.0, -10.0, 0.02])
def test_rays_are_arcs_of_circles(gradient):
    """Hits in one gradient: on the circle of radius c / (g cos) about c = 0, with its length and logarithm of time.

    Distances to 1e-9 m and times to 1e-12 s; with a box in the scene, by chords, to 2 mm and 1 us.
    """
    profile = [[0, 1500], [20, 1500 + 20 * gradient]]
    water = {"noise_level_db": None, "profile": profile}
    dip = np.radians([-80.0, -30.0, -15.0, 20.0, 45.0, 89.0])
    for targets, to_metre, to_second in (([], 1e-9, 1e-12), ([{**BOX, "position": (500.0, 0.0)}], 2e-3, 1e-6)):
        simulator = build_simulator(scene("tracer", water=water, targets=targets))
        ping = simulator.tracer.ping(simulator.ping_geometry(0))
        way = np.stack([0 * dip, np.cos(dip), np.sin(dip)], axis=-1)
        hits = ping.intersector.hits(np.tile([0.0, 0.0, 11.0], (6, 1)), way, np.full(6, 500.0))
        speed = 1500 + gradient * 11
        ends = np.where(hits.kind == 1, 1500 + 20 * gradient, 1500.0)
        cosine = ends * np.cos(dip) / speed
        assert np.all(hits.kind[cosine < 1] == np.where(hits.direction[cosine < 1, 2] > 0, 1, 2))
        leaving = np.sign(hits.direction[:, 2]) * np.arccos(cosine)
        radius = speed / (gradient * np.cos(dip))
        np.testing.assert_allclose(hits.position[:, 1], radius * (np.sin(dip) - np.sin(leaving)), atol=to_metre)
        np.testing.assert_allclose(hits.distance, radius * (dip - leaving), atol=to_metre, rtol=1e-6)
        time = (np.arctanh(np.sin(dip)) - np.arctanh(np.sin(leaving))) / gradient
        np.testing.assert_allclose(hits.delay, time, atol=max(to_second, 1e-13 / abs(gradient)))


@few_of(
    (0, 2),
    ("water", "window"), [(WARM_TOP, (0.09, 0.12)), (UPWARD, (0.09, 0.12)), (DUCT, (0.15, 0.17))],
    ids=["warm top", "upward", "duct"],
)  # fmt: skip
def test_layered_water_reverberates_the_same(water, window):
    """Six pairs of D, S and BS over a flat seabed: each within 0.02 dB, and their sum within 0.05 dB in each 2 ms."""
    ours, theirs = both(water=water, window=window, paths={"contributions": ["seabed"]})
    strongest = max(power.mean() for power in theirs.values())
    compared = [key for key, power in theirs.items() if power.mean() > 1e-4 * strongest]
    assert len(compared) > 5
    for key in compared:
        assert apart_db(ours[key], theirs[key]) == pytest.approx(0, abs=0.02), key
    key = "seabed", "all"
    np.testing.assert_allclose(binned_db(ours[key]), binned_db(theirs[key]), atol=0.05)


@pytest.mark.parametrize("apart", [0.0, -0.1])
def test_a_point_in_layered_water_is_received_by_every_ray(apart):
    """Fifteen pairs of a point, arrays together or 0.1 m apart: within 0.002 dB."""
    changes = {"targets": [point(0.0, 75.0, 19.5)], "receive": {"offset": (0.0, 0.0, apart)}}
    ours, theirs = both(water=WARM_TOP, rays=100, paths={"contributions": ["target"]}, **changes)
    pairs = [key for key in theirs if key[1] != "all"]
    assert len(pairs) == 15
    for key in pairs:
        assert apart_db(ours[key], theirs[key]) == pytest.approx(0, abs=2e-3), key


def test_a_box_in_layered_water_sounds_the_same_and_casts_its_shadow():
    """Fifteen pairs of a box within 0.02 dB; the seabed with its shadows within 0.1 dB in each 2 ms."""
    ours, theirs = both(water=WARM_TOP, targets=[BOX], rays=60_000)
    pairs = [key for key in theirs if key[0] == "target" and key[1] != "all"]
    assert len(pairs) == 15
    for key in pairs:
        assert apart_db(ours[key], theirs[key]) == pytest.approx(0, abs=0.02), key
    key = "seabed", "all"
    np.testing.assert_allclose(binned_db(ours[key]), binned_db(theirs[key]), atol=0.1)


@pytest.mark.slow
def test_relief_in_layered_water_sounds_the_same():
    """Fractal ground of 5 cm rms, direct and surface paths: each pair within 0.05 dB."""
    bed = {"relief": FRACTAL, "seed": 3, "cutoff_wavelength": 0.5}
    paths = {"max_reflections": 1, "contributions": ["seabed"]}
    ours, theirs = both(water=WARM_TOP, seabed=bed, paths=paths, window=(0.09, 0.105))
    for pair in ("D-D", "D-S", "S-S", "all"):
        assert apart_db(ours["seabed", pair], theirs["seabed", pair]) == pytest.approx(0, abs=0.05), pair


def test_a_point_without_a_ray_has_an_infinite_delay_to_any_other():
    """Two rays of a family, each missing at some points: the nearer one, and infinity where both are missing."""
    none = np.full(3, np.inf)
    legs = [TracedLegs(np.array(delay), *np.zeros((5, 3))) for delay in ([0.1, np.inf, np.inf], [0.3, 0.2, np.inf])]
    for given, expected in (([0.12, 0.2, 0.2], [0.1, 0.2, np.inf]), ([0.29, np.inf, np.inf], [0.3, 0.2, np.inf])):
        np.testing.assert_array_equal(nearest_delay(legs, np.array(given)), expected)
    np.testing.assert_array_equal(nearest_delay([], none), none)


@pytest.mark.parametrize("angle", [0.0, 1e-9, -1e-9])
def test_a_horizontal_ray_from_a_knot_is_the_arc_of_its_layer(angle):
    """Speed grows by 1 /s with depth, or with height: a circle of 1510 m to the nearer boundary, as without knots."""
    layers = sound_speed_layers(SoundSpeedProfile([0.0, 10.0, 30.0], [1500.0, 1510.0, 1530.0]), 30.0)
    for sign, boundary, kind in ((1.0, 0.0, SURFACE), (-1.0, 30.0, BED)):
        if sign < 0:  # the same water upside down, and 20 m above it
            layers = sound_speed_layers(SoundSpeedProfile([0.0, 20.0, 30.0], [1530.0, 1510.0, 1500.0]), 30.0)
        start = 10.0 if sign > 0 else 20.0
        direction = np.array([[np.cos(angle), 0.0, np.sin(angle)]])
        hits = open_water_hits(np.array([[0.0, 0.0, start]]), direction, 1000.0, 30.0, layers)
        assert hits.kind[0] == kind and hits.position[0, 2] == pytest.approx(boundary, abs=1e-9)
        assert hits.position[0, 0] == pytest.approx(np.sqrt(1510.0**2 - 1500.0**2), abs=1e-4)
        assert hits.distance[0] == pytest.approx(1510.0 * np.arccos(1500 / 1510), abs=1e-4)


@pytest.mark.parametrize("angle", [0.0, 1e-9, -1e-9, 1e-7, -1e-7])
def test_a_horizontal_ray_stays_at_the_least_sound_speed(angle):
    """At a knot of 1490 m/s below and above faster water: 500 m along it, within 0.1 mm of its depth."""
    layers = sound_speed_layers(SoundSpeedProfile([0.0, 10.0, 30.0], [1500.0, 1490.0, 1500.0]), 30.0)
    hits = open_water_hits(
        np.array([[0.0, 0.0, 10.0]]), np.array([[np.cos(angle), 0.0, np.sin(angle)]]), 500.0, 30.0, layers
    )
    assert hits.kind[0] == NOTHING and hits.position[0, 2] == pytest.approx(10.0, abs=1e-4)
    assert hits.position[0, 0] == pytest.approx(500.0, abs=1e-6)
    assert hits.delay[0] == pytest.approx(500 / 1490, abs=1e-8)
