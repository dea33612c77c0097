"""Elements in layered water: expansions of the field interpolated from a table, and echoes from below the array."""

from dataclasses import replace

import numpy as np
import pytest

from insonify.propagation.aperture_expansion import TERMS, largest_change
from insonify.propagation.refracted_rays import refracted_rays
from insonify.scene.scatterers import Scatterers
from insonify.simulator import build_simulator
from insonify.synthesis import element_arrivals
from oracles.scenes import nominal

DOWNWARD = {"depth": [0, 8, 20], "speed": [1505, 1500, 1490]}
UPWARD = {"depth": [0, 20], "speed": [1400, 1600]}
MOVING = {
    "kind": "line", "start": [0, 0, 11], "heading": 0, "speed": 2.0, "pings": 1, "interval": 0.1,
    "window": [0.005, 0.08],
}  # fmt: skip
LINE = {"kind": "line", "length": 1.0, "elements": 16}


def simulator_of(profile, **changes):
    """16 elements on a line of 1 m, 11 m deep over 5 cm of fractal relief in 20 m of layered water."""
    scenario = nominal(
        water={"profile": profile, "smoothing": 1.0, "noise_level_db": None}, track={"window": (0.005, 0.08)},
        sonar={"receive": LINE, "receiver": {"record": "elements"}},
        seabed={"relief": {"kind": "power-law", "hurst": 0.8, "rms": 0.05}, "cutoff_wavelength": 0.5},
        paths={"families": ["D", "S", "BS"], "max_reflections": 2},
    )  # fmt: skip
    return build_simulator(scenario.with_(changes))


def seabed_points(simulator, count, nearest=0.2):
    """Positions all about the sonar, as many in each interval of the logarithm of distance."""
    rng = np.random.default_rng(1)
    away, turn = nearest * (55 / nearest) ** rng.random(count), rng.uniform(-np.pi, np.pi, count)
    place = np.column_stack([away * np.cos(turn), away * np.sin(turn)])
    ground = simulator.engine.scene.seabed.terrain.relief.sample(*place.T)
    return Scatterers(
        "seabed", "seabed", simulator.scenario.seabed.law(1e5, 1500.0), np.column_stack([place, 20 - ground.height]),
        np.tile([0.0, 0.0, -1.0], (count, 1)), np.ones(count), np.exp(2j * np.pi * rng.random(count)),
        np.arange(count).astype(np.uint64),
    )  # fmt: skip


@pytest.mark.parametrize("extent", [(1.0, 0.0), (1.0, 0.3)], ids=["line", "high"])
def test_expansions_from_a_table_are_those_from_rays(extent):
    """3000 legs: delays of elements within 0.1 ns, of up to several, pressures within 2e-5, of up to several 1e-4.

    Legs that are not there have no expansion.
    """
    simulator = simulator_of(DOWNWARD)
    sonar, domain = simulator.ping_geometry(0).receive_position, simulator.engine.rays.domain
    rays = refracted_rays(simulator.engine.scene, replace(domain, source_depths=(10.7, 11.0, 11.3)))
    points, families = seabed_points(simulator, 3000), ("D", "S", "BS")
    needed = np.random.default_rng(2).random((3, 3000)) < [[1.0], [0.7], [0.1]]
    legs = rays.legs(sonar, points, families, 1e5, needed=needed)
    found = rays.with_aperture_expansion(legs, sonar, points, extent).aperture_expansion
    assert rays._expansion_table(families, points, 11.0, extent) is not None
    exact = np.nan_to_num(rays._expansion(legs, sonar, points.position, "seabed", extent))
    delay, logarithm = largest_change(found - exact, extent)
    whole_delay, whole_logarithm = largest_change(exact, extent)
    assert delay.max() < 1e-10 < 1e-9 < whole_delay.max(axis=1).min()
    assert logarithm.max() < 2e-5 < 1e-4 < whole_logarithm.max(axis=1).min()
    assert not found[~np.broadcast_to(needed[:, None], found.shape)].any()


def test_no_table_where_rays_end():
    """Upward refraction leaves a shadow: rays are evaluated one by one; so are those to targets."""
    simulator = simulator_of(UPWARD)
    rays, sonar = simulator.engine.rays, simulator.ping_geometry(0).receive_position
    points = seabed_points(simulator, 300)
    for boundary in ("seabed", "target"):
        here = replace(points, boundary=boundary)
        legs = rays.legs(sonar, here, ("D", "S"), 1e5)
        found = rays.with_aperture_expansion(legs, sonar, here, (0.5, 0.0)).aperture_expansion
        assert rays._expansion_table(legs.families, points, 11.0, (0.5, 0.0)) is None
        exact = rays._expansion(legs, sonar, here.position, boundary, (0.5, 0.0))
        np.testing.assert_array_equal(found, np.nan_to_num(exact))
        assert found.shape == (len(legs.families), TERMS, 300) and found.any()


@pytest.mark.parametrize("changes", [{}, {"track": MOVING}], ids=["at rest", "moving"])
def test_echoes_from_below_are_evaluated_element_by_element(monkeypatch, changes):
    """Points from 0.2 to 55 m away: as all of them element by element, to 1e-5 of the rms pressure."""
    simulator = simulator_of(DOWNWARD, **changes)
    here, points = simulator.ping_geometry(0), seabed_points(simulator, 2000)
    pairs = simulator.engine.path_pairs(here, points)

    def received():
        accumulator, parts = simulator.coherent_accumulator(here), []
        deposit = element_arrivals.deposit_on_elements

        def counted(cells, points, legs, receive_beams, nodes, sector, reception):
            parts.append((len(nodes.series), np.count_nonzero(legs.strength)))
            deposit(cells, points, legs, receive_beams, nodes, sector, reception)

        with monkeypatch.context() as patched:
            patched.setattr(element_arrivals, "deposit_on_elements", counted)
            total = accumulator.empty()
            accumulator.add(total, pairs)
        return np.asarray(accumulator.time_series(total)), parts

    found, parts = received()
    (nodes, far), (none, near) = parts
    assert 4 <= nodes < 16 and none == 0 and min(far, near) > 500
    with monkeypatch.context() as patched:
        patched.setattr(element_arrivals, "few_nodes_beyond", lambda *_: 1e9)
        one_by_one, parts = received()
        assert [number for nodes, number in parts if nodes] == [0]
    rms = np.sqrt(np.mean(np.abs(one_by_one) ** 2))
    assert np.abs(found - one_by_one).max() < 1e-5 * rms
