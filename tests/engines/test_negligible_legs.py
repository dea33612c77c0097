"""Claims about what is too weak to be computed: it is as weak as that, and the sum does not miss it."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest

from insonify.engines import pair_importance, relief_reflections
from insonify.propagation.knife_edge import edge_diffraction_table
from insonify.propagation.knife_edge_kernel import crest_diffraction_factor, crest_is_negligible
from insonify.propagation.local_planes import flat_image_paths
from insonify.scene.scatterers import Scatterers
from insonify.scene.seabed import Seabed
from insonify.simulator import build_simulator, simulate_pings
from oracles.scenes import nominal

ROUGH = {"depth": 20.0, "relief": {"kind": "power-law", "hurst": 0.8, "rms": 0.05}}


def amplitudes(seabed, points, families):
    """Amplitudes of the legs to some points above the seabed, (families, n)."""
    scenario = nominal(
        seabed=seabed, track={"window": (0.01, 0.25)}, paths={"families": families, "max_reflections": 4}
    )
    simulator = build_simulator(scenario)
    ones, keys = np.ones(len(points)), np.arange(len(points)).astype(np.uint64)
    law = scenario.seabed.law(1e5, 1500.0)
    scatterers = Scatterers("any", "target", law, points, np.zeros(points.shape), ones, ones.astype(complex), keys)
    legs = simulator.engine.path_pairs(simulator.ping_geometry(0), scatterers).transmit_legs
    return np.abs(legs.amplitude) / legs.spreading


def test_requested_legs_do_not_depend_on_which_others_are():
    """Every third point of bounced families, and all of them: the same bits in every column, others are silent."""
    scenario = nominal(seabed=ROUGH, track={"window": (0.01, 0.25)}, paths={"max_reflections": 3})
    simulator, rng = build_simulator(scenario), np.random.default_rng(3)
    points = np.stack([rng.uniform(20, 90, 300), rng.uniform(-30, 30, 300), rng.uniform(12, 18, 300)], axis=1)
    normal = np.broadcast_to([0.0, 0.0, -1.0], points.shape).copy()
    ones, keys = np.ones(300), np.arange(300).astype(np.uint64)
    scatterers = Scatterers(
        "any", "target", scenario.seabed.law(1e5, 1500.0), points, normal, ones, ones.astype(complex), keys
    )
    every = simulator.engine.path_pairs(simulator.ping_geometry(0), scatterers).transmit_legs
    needed = np.ones((len(every.families), 300), bool)
    bounces = [row for row, family in enumerate(every.families) if "B" in family]
    needed[bounces] = np.arange(300) % 3 == 0
    some = simulator.engine.path_pairs(
        simulator.ping_geometry(0), scatterers, pair_importance.PairSelection(every.families, needed, None)
    ).transmit_legs
    for name in ("delay", "amplitude", "arrival", "departure", "grazing_sine", "status", "visibility"):
        np.testing.assert_array_equal(getattr(some, name)[needed], getattr(every, name)[needed])
    assert not some.amplitude[~needed].any() and np.mean(every.amplitude[~needed] != 0) > 0.3


def test_legs_left_out_are_seventy_decibels_down(monkeypatch):
    """Those followed keep their bits; followed all the same, the others are below 1e-3, half of them below 3e-4."""
    rng = np.random.default_rng(1)
    distance, azimuth = rng.uniform(5, 150, 400), rng.uniform(0, 0.02, 400)
    points = np.stack([distance * np.cos(azimuth), distance * np.sin(azimuth), rng.uniform(12, 18, 400)], axis=1)
    families = ["D", "BS", "SBS", "BSBS"]
    kept = amplitudes(ROUGH, points, families)
    monkeypatch.setattr(relief_reflections, "NEGLIGIBLE_PRESSURE", 0.0)
    every = amplitudes(ROUGH, points, families)
    left_out = (kept == 0) & (every > 0)
    assert 0.2 < left_out[1:].mean() < 0.9 and not left_out[0].any()
    np.testing.assert_array_equal(kept[~left_out], every[~left_out])
    assert every[left_out].max() < 1e-3 and np.median(every[left_out]) < 3e-4


def test_families_left_out_are_negligible_beside_simultaneous_arrivals(monkeypatch):
    """Of a ping over rough ground with up to 4 bounces a leg, in every 10 ms at least 40 dB below what is received."""
    scenario = nominal(
        seabed=ROUGH, track={"window": (0.01, 0.11)}, paths={"max_reflections": 4, "scatterers_per_cell": 0.5}
    )
    simulator = build_simulator(scenario)
    here = simulator.ping_geometry(0)
    ground = [block for block in simulator.engine.blocks(here) if block().boundary == "seabed"]
    legs = [
        len(simulator.engine.pairs(here, block, include_negligible=False).transmit_legs.families) for block in ground
    ]
    assert max(legs) < 5  # of 5
    fewer = dict(simulate_pings(simulator, [0], 2))[0]
    monkeypatch.setattr(pair_importance, "NEGLIGIBLE", 0.0)
    every = dict(simulate_pings(build_simulator(scenario), [0], 2))[0]
    missing, received = (np.sum(np.abs(a[:, : a.shape[1] // 10 * 10].reshape(-1, 10, a.shape[1] // 10)) ** 2, axis=(0,
    2))
                      for a in (fewer - every, every))  # fmt: skip
    assert missing.max() > 0 and (missing < 1e-4 * received).all()


def test_crests_passed_over_change_as_little_as_that():
    """50000 crests below rays: those reported to change the pressure by less than a limit do so."""
    rng, table = np.random.default_rng(2), edge_diffraction_table()
    count = 0
    for clear, hollow, behind, before, exponent in zip(
        10 ** rng.uniform(-3, 1, 50_000), 10 ** rng.uniform(-4, 1, 50_000), 10 ** rng.uniform(-1, 2.5, 50_000),
        10 ** rng.uniform(-1, 2.5, 50_000), rng.uniform(-4, -0.5, 50_000), strict=True,
    ):  # fmt: skip
        way = behind, behind + before, 0.015
        if crest_is_negligible(clear, hollow, *way, 10 ** (2 * exponent)):
            count += 1
            assert abs(1 - crest_diffraction_factor(-clear, hollow, *way, table)) < 10**exponent
    assert count > 10_000


@pytest.mark.parametrize("family", ["B", "BS", "SBS", "BSBS"])
def test_legs_that_cannot_be_negligible_are_recognised_first(family):
    """If widest zone and steepest bounce together leave enough energy, every leg on the mean plane has enough."""
    bed = Seabed(**ROUGH, cutoff_wavelength=0.5, seed=1).completed(1, 1e5, 1500.0).terrain
    place, found = np.array([0.0, 0.0, 12.0]), set()
    for near, wavelength in itertools.product((5.0, 40.0, 150.0), (0.015, 0.15, 0.6)):
        points = np.stack([np.linspace(near, near + 10, 50), np.zeros(50), np.full(50, 15.0)], axis=1)
        terrain_occlusion = SimpleNamespace(bed=bed, wavelength=wavelength)
        way = flat_image_paths(family, place, points, bed.depth)
        may = relief_reflections._may_be_weak(family, way.length, np.abs(way.departure[:, 2]), terrain_occlusion)
        least = relief_reflections.coherent_bounce_factor(family, way, bed, wavelength).min()
        assert may or least >= relief_reflections.NEGLIGIBLE_PRESSURE
        found.add(may)
    assert False in found
