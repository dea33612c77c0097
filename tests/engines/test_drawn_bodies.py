"""Points of bodies: only those in reach are drawn, they are those of the whole body, and few are kept."""

import numpy as np
import pytest

from insonify.engines import drawn_bodies
from insonify.engines import targets as target_engine
from insonify.engines.drawn_bodies import DrawnBodies
from insonify.engines.facet_subdivision import solid_insonification
from insonify.engines.target_culling import facing
from insonify.engines.targets import target_points
from insonify.propagation import silhouette
from insonify.scene.box import box_scatterers
from insonify.simulator import build_simulator
from oracles.scenes import nominal

QUAY = {"shape": "box", "label": "quay", "position": (0.0, 60.0), "size": (120.0, 2.0, 4.0), "heading": "10 deg"}


def points_of(targets, slant=0.06, even=False, **changes):
    """Points of one ping, the scenario's scene and what the sonar receives of the first target."""
    scenario = nominal(targets=targets, **changes)
    simulator = build_simulator(scenario)
    here, rays = simulator.ping_geometry(0), simulator.engine.rays
    found = target_points(scenario.scene, scenario.paths, 1, here, slant, quadrature=even, rays=rays)
    sight = solid_insonification(scenario.scene, scenario.scene.targets[0], scenario.paths, here, slant, rays)
    return found, scenario.scene, sight


@pytest.mark.parametrize("even", [False, True])
def test_of_a_quay_wall_only_what_is_in_reach_is_drawn(even, monkeypatch):
    """Each point is one of the whole wall's, bit by bit; all of the whole that can be received are among them."""
    requested = []

    def counted(*args, **how):
        requested.append((args, box_scatterers(*args, **how)))
        return requested[-1][1]

    monkeypatch.setattr(target_engine, "box_scatterers", counted)
    (found,), _, sight = points_of([QUAY], slant=0.5, even=even, track={"window": (0.08, 0.1)})
    args, near = requested[-1]
    whole = box_scatterers(*args[:5], rise=requested_rise(near, args), quadrature=even)
    assert 0 < len(found) < len(near) < len(whole) / 4
    row = {int(key): n for n, key in enumerate(whole.scatterer_id)}
    rows = np.array([row[int(key)] for key in found.scatterer_id])
    for column in ("position", "normal", "area", "phase"):
        np.testing.assert_array_equal(getattr(found, column), getattr(whole, column)[rows])
    received = sight.reaches(whole.position, np.zeros(len(whole)))
    received &= facing(whole.position, whole.normal, sight.point_images, max_deviation=sight.max_deviation)
    assert set(np.flatnonzero(received)) <= set(rows)


def requested_rise(points, args):
    """Height of the cells of a wall's long faces [m], from the area of its points."""
    _, _, _, pitch, _ = args
    long_side = points.area[np.abs(points.normal[:, 2]) < 0.5]
    return float(long_side.min() / pitch) * 1.0001


def test_bodies_out_of_reach_are_not_drawn():
    """A rock 3 km away, beyond the window, and one behind the beams cost no point."""
    far = {"shape": "rock", "label": "far", "position": (0.0, 3000.0)}
    found, *_ = points_of([far], track={"window": (0.08, 0.1)})
    assert found == []


def test_the_points_kept_have_bounded_memory(monkeypatch):
    """Those used last stay; what goes beyond the bound is drawn again, the same."""
    (points,), *_ = points_of([{"shape": "drum", "position": (0.0, 75.0)}])
    one = drawn_bodies.size(points)
    kept, drawn = DrawnBodies(2 * one), []

    def draw(name):
        return lambda: drawn.append(name) or points

    for name in "abacabcb":
        assert kept.get(name, draw(name)) is points
    assert "".join(drawn) == "abcbc"  # no more than two at a time


def test_each_silhouette_is_made_once_a_ping(monkeypatch):
    """Of 30 rocks seen from the images of five families, block after block of the seabed: 150 outlines, no more.

    Bearings of a rock's corners are the same from all images: 30.
    """
    made, seen, bearings = [], [], silhouette._triangle_bearings
    monkeypatch.setattr(silhouette, "silhouette_columns", lambda *args: made.append(args[4].fill(1.0)))
    monkeypatch.setattr(silhouette, "_triangle_bearings", lambda *args: seen.append(args) or bearings(*args))
    silhouette.silhouette.cache_clear()
    rocks = [{"shape": "rock", "label": f"rock {n}", "position": (0.0, 50.0 + n)} for n in range(30)]
    scene = nominal(targets=rocks).scene
    for _block in range(3):
        for solid in scene.solids:
            for depth in (11.0, -11.0, 29.0, -29.0, 51.0):
                silhouette.silhouette(solid, scene.seabed, (0.0, 0.0, depth))
    silhouette.silhouette.cache_clear()
    assert (len(made), len(seen)) == (30 * 5, 30)
