"""All features together: refracted rays, relief, ripples, boxes, solids and a mesh, two sides, a moving ship."""

import numpy as np
import pytest

import insonify
from insonify.engines import eigenray_engine
from insonify.formats import zarr_store
from insonify.propagation.image_sources import StraightRays
from insonify.recording_run import record
from insonify.records.legs import LegStatus
from insonify.simulator import build_simulator
from oracles.harbour import ALMOST_EVEN, THERMOCLINE, quiet_harbour

LAYERED = {"profile": THERMOCLINE}


@pytest.fixture(scope="module")
def described(tmp_path_factory):
    """The harbour in layered water, with a mesh."""
    folder = tmp_path_factory.mktemp("harbour")
    return lambda **changes: quiet_harbour(water=LAYERED, folder=folder, **changes)


@pytest.mark.slow
def test_occlusion_in_nearly_uniform_water_is_that_of_straight_rays(tmp_path, monkeypatch):
    """1 mm/s over 20 m: every leg of every point has the status and the occluder that images of the sonar give it.

    Neither boxes, solids nor ground are hidden by code that the two have in common, but for the walk along slices. All
    slices are walked: where beams are weak straight rays merge four of them, and refracted rays do not. One point in
    100,000 may lie within rounding of an edge; none of 340,000 does. Legs with bottom bounces arrive together too; the
    ground hides straight ones along the planes that reflect them, refracted ones along the mean plane.
    """
    monkeypatch.setattr(eigenray_engine, "bearing_gain_bound", lambda *_: None)
    even = quiet_harbour(water={}, folder=tmp_path, field="incoherent", pings=1)
    layered = quiet_harbour(water={"profile": ALMOST_EVEN}, folder=tmp_path, field="incoherent", pings=1)
    straight, refracted = build_simulator(even), build_simulator(layered)
    assert isinstance(straight.engine.rays, StraightRays)
    here, computed, unlike, hidden = straight.ping_geometry(0, channel=1), 0, 0, set()
    for block in straight.engine.blocks(here, quadrature=True):
        points = block()
        one, other = (
            straight.engine.path_pairs(here, points).transmit_legs,
            refracted.engine.path_pairs(here, points).transmit_legs,
        )
        assert one.families == other.families
        for row, family in enumerate(one.families):
            if "B" not in family:
                unlike += np.sum(one.occluder[row] != other.occluder[row])
                computed += len(points)
        clear = (one.status == LegStatus.CLEAR) & (other.status == LegStatus.CLEAR)
        clear &= one.reflection_coefficient != 0  # legs that rough ground leaves nothing of are not followed
        np.testing.assert_allclose(one.delay[clear], other.delay[clear], atol=1e-7)
        hidden |= set(np.unique(one.occluder))
    assert hidden == {-2, -1, 0, 1, 2, 4}  # the drum, 3, lies behind the baffle: its points are not needed
    assert computed > 300_000 and unlike <= 1e-5 * computed


@pytest.mark.slow
@pytest.mark.parametrize("channel", [0, 1])
def test_nearly_uniform_water_gives_the_level_of_uniform_water(tmp_path, channel):
    """1 mm/s over 20 m, relief and bodies: bounds of refracted rays leave no ground out, 0.02 dB.

    Every pair of direct and surface legs that is received agrees over every 10 ms, and so does the whole.
    """
    power = []
    for water in ({}, {"profile": ALMOST_EVEN}):
        scenario = quiet_harbour(water=water, folder=tmp_path, field="incoherent", pings=1, window=(0.02, 0.08))
        scenario = scenario.model_copy(update={"paths": scenario.paths.model_copy(update={"families": ("D", "S")})})
        level = insonify.levels(scenario, channel=channel).level_db.sel(contribution="total").values
        power.append((10 ** (level / 10)).reshape(len(level), 6, -1).mean(axis=2))
    strong = power[0] > 1.0  # 0 dB re 1 uPa: what is weaker is received by sidelobes of sidelobes
    np.testing.assert_allclose(10 * np.log10(power[1][strong]), 10 * np.log10(power[0][strong]), atol=0.02)


@pytest.mark.parametrize("field", ["coherent", "incoherent"])
def test_scatterers_are_the_same_in_every_ping_of_a_heaving_ship(described, field):
    """Sound is faster or slower where the ship is; still every ping finds the same points on the same bodies."""
    simulator = build_simulator(described(field=field, pings=2))
    found = []
    for ping in range(2):
        here = simulator.ping_geometry(ping, channel=1)
        blocks = [block() for block in simulator.engine.blocks(here, quadrature=field == "incoherent")]
        found.append([one for one in blocks if one.object == "log"])
    assert simulator.ping_geometry(0).sound_speed != simulator.ping_geometry(1).sound_speed
    for one, other in zip(*found, strict=True):
        np.testing.assert_array_equal(one.position, other.position)
        np.testing.assert_array_equal(one.phase, other.phase)


@pytest.mark.validate
def test_threads_do_not_change_a_bit_and_parts_make_the_whole(described, tmp_path):
    """Two pings, one thread or two; and a run that stops after the first ping and goes on."""
    scenario = described(field="coherent", pings=2, window=(0.05, 0.06))
    whole = insonify.simulate(scenario, threads=2).pressure.values
    path = record(scenario, tmp_path / "harbour.zarr", pings=[1], threads=1)
    record(scenario, path, threads=1)
    np.testing.assert_array_equal(whole, zarr_store.open_recording(path).pressure.values)


@pytest.mark.validate
@pytest.mark.parametrize("field", ["coherent", "incoherent"])
def test_a_scene_that_is_moved_and_turned_as_a_whole_sounds_the_same(described, field):
    """Ship, lattice, ripples and bodies 800 m away, turned by 1 rad: one ping within 1 %.

    Edges of shadows move by rounding, and with them a few points of thousands.
    """
    there = {"turn": 1.0, "shift": (800.0, -600.0), "pings": 1, "window": (0.05, 0.06), "field": field}
    name = "pressure" if field == "coherent" else "intensity"
    still = insonify.simulate(described(**{**there, "turn": 0.0, "shift": (0.0, 0.0)}))[name].values
    moved = insonify.simulate(described(**there))[name].values
    assert np.linalg.norm(moved - still) < 1e-2 * np.linalg.norm(still)
    assert np.abs(still).max() > 0


@pytest.mark.validate
def test_the_mean_of_many_draws_is_the_expectation(described):
    """9 draws of the scatterers over the same ground, by two sides: their mean power within 0.3 dB.

    20 ms of 5 kHz are about 100 independent samples, in all 1800: 4.34 / sqrt(1800) = 0.1 dB, a third of the
    tolerance. Samples weigh alike: each is divided by its expectation.
    """
    few = {"pings": 1, "window": (0.044, 0.064), "motion": False}
    expected = insonify.simulate(described(field="incoherent", **few)).intensity.values
    there = expected > 1e-3 * np.median(expected)
    ratio = []
    for seed in range(9):
        received = insonify.simulate(described(field="coherent", **few, seed=seed)).pressure.values
        ratio.append(np.mean(np.abs(received[there]) ** 2 / expected[there]))
    assert 10 * np.log10(np.mean(ratio)) == pytest.approx(0.0, abs=0.3)
