"""Refracted legs over relief that are followed only where they are needed, and lines of seabed that hide nothing."""

from dataclasses import replace

import numpy as np
import pytest

from insonify.engines._terrain_diffraction_kernel import falls_within
from insonify.engines.relief_reflections import reflect_off_relief
from insonify.engines.terrain_occlusion import TerrainOcclusion
from insonify.propagation._refracted_legs_kernel import bodies_passed_over
from insonify.propagation.propagation_model import departure_cones
from insonify.propagation.refracted_rays import refracted_rays
from insonify.records.legs import LegStatus
from insonify.scene.scatterers import Scatterers
from insonify.simulator import build_simulator
from oracles.scenes import nominal

FAMILIES = ("D", "S", "BS")
DOWNWARD = {"depth": [0, 8, 20], "speed": [1505, 1500, 1490]}
UPWARD = {"depth": [0, 20], "speed": [1400, 1600]}
COLUMNS = (
    "delay", "length", "spreading", "absorption", "reflection_coefficient", "visibility", "status", "occluder",
    "grazing_sine", "departure", "arrival",
)  # fmt: skip


def simulator_of(profile, **track):
    """An end 11 m deep over 5 cm of fractal relief in 20 m of layered water."""
    return build_simulator(
        nominal(
            water={"profile": profile, "noise_level_db": None}, track={"window": (0.02, 0.08), **track},
            seabed={"relief": {"kind": "power-law", "hurst": 0.8, "rms": 0.05}, "cutoff_wavelength": 0.5},
            paths={"families": list(FAMILIES), "max_reflections": 2},
        )
    )  # fmt: skip


@pytest.fixture(scope="module", params=[DOWNWARD, UPWARD], ids=["downward", "upward"])
def seabed_legs(request):
    """Legs to 400 positions of the relief, as a function of those that are needed, and the number of families."""
    simulator, rng = simulator_of(request.param), np.random.default_rng(1)
    here, rays, scene = simulator.ping_geometry(0), simulator.engine.rays, simulator.engine.scene
    away, turn = rng.uniform(12, 55, 400), rng.uniform(-np.pi, np.pi, 400)
    ground = scene.seabed.terrain.relief.sample(away * np.cos(turn), away * np.sin(turn))
    normal = np.column_stack([-ground.slope, -np.ones(400)])
    points = Scatterers(
        "seabed", "seabed", simulator.scenario.seabed.law(1e5, 1500.0),
        np.column_stack([away * np.cos(turn), away * np.sin(turn), 20 - ground.height]),
        normal / np.linalg.norm(normal, axis=1, keepdims=True), np.ones(400), np.ones(400, complex),
        np.arange(400).astype(np.uint64),
    )  # fmt: skip
    sonar = here.transmit_position

    def evaluate_at(needed=None, soft=False):
        legs = rays.legs(sonar, points, FAMILIES, here.frequency, needed=needed)
        rows = None if needed is None else needed[[FAMILIES.index(family) for family in legs.families]]
        occlusion = TerrainOcclusion(
            scene.seabed.terrain, sonar, rays.launch_angles(11.0), farthest=80.0, wavelength=0.015,
            min_profile_width=4e-3,
        )  # fmt: skip
        return reflect_off_relief(legs, points, sonar, occlusion, scene, soft=soft, needed=rows)

    return evaluate_at


@pytest.mark.parametrize("soft", [False, True])
@pytest.mark.parametrize("chance", [0.0, 0.1, 1.0])
def test_needed_legs_are_those_of_all_and_others_are_silent(seabed_legs, chance, soft):
    """None, a tenth and all of the reflected families: to rounding those of all together, the rest without amplitude.

    In the upward refracting water rays turn before they reach the farther points.
    """
    every, needed = seabed_legs(soft=soft), np.random.default_rng(2).random((len(FAMILIES), 400)) < chance
    needed[0] = True
    some = seabed_legs(needed, soft)
    rows = [row for row, branch in enumerate(every.branch) if branch == 0]
    assert some.families == FAMILIES or chance == 1.0
    assert np.abs(every.amplitude[rows]).max(axis=1).min() > 0  # each family reaches some of them
    for row, family in enumerate(FAMILIES):
        here, full = needed[row], rows[row]
        for name in COLUMNS:
            one, other = getattr(some, name)[row, here], getattr(every, name)[full, here]
            np.testing.assert_allclose(one, other, rtol=1e-11, atol=1e-14, err_msg=f"{family} {name}")
        assert not np.any(some.amplitude[row, ~here])


@pytest.mark.parametrize("family", FAMILIES)
def test_seabed_that_falls_slowly_enough_is_reached_in_order(family):
    """Launch slopes to lines with the largest fall never rise; with a tenth more they rise at some distance.

    Depths stay within the table: lines begin at its upper end and turn level at its lower one.
    """
    launches = simulator_of(DOWNWARD).engine.rays.launch_angles(11.0)
    step, count = 0.07, 800
    distance, limit = step * np.arange(1, count + 1), launches.largest_unobstructed_fall(family, step, count)
    highest, deepest = 19.9, 20.1
    assert launches.has_single_rays(family, distance, np.full(count, highest))
    rises = []
    for factor in (0.999, 1.1):
        start = np.random.default_rng(3).integers(0, count - 100, 50)
        depth = np.full((50, count), highest, np.float32)
        for line, first in zip(depth, start, strict=True):
            line[first + 1 :] = np.minimum(highest + factor * np.cumsum(limit[first:].astype(float)), deepest)
        assert falls_within(depth, limit) == (factor < 1)
        slope = launches.launch_slope(family, distance, depth.astype(float))
        rises.append(np.diff(slope, axis=1).max())
    assert rises[0] <= 0 < rises[1]


def test_rays_are_single_within_the_table_alone():
    """Not beyond its range or its depths, nor where upward refraction leaves a shadow."""
    downward, upward = (simulator_of(profile).engine.rays.launch_angles(11.0) for profile in (DOWNWARD, UPWARD))
    inside = np.array([20.0, 50.0]), np.array([20.0, 20.05])
    assert downward.has_single_rays("D", *inside)
    assert not downward.has_single_rays("D", np.array([20.0, 5000.0]), inside[1])
    assert not downward.has_single_rays("D", inside[0], np.array([20.0, 21.0]))
    assert not downward.has_single_rays("D", np.array([0.0, 20.0]), inside[1])
    assert not upward.has_single_rays("D", *inside)
    assert upward.largest_unobstructed_fall("D", 0.1, 10) is None
    assert downward.largest_unobstructed_fall("SB", 0.1, 10) is None  # it arrives from below


def test_tables_reach_a_little_beyond_the_window():
    """Scatterers drawn in cells at its edge: read from the table as well, to the tables' 1 ns of the exact solver."""
    rays = simulator_of(DOWNWARD).engine.rays
    beyond, depth = rays.domain.max_range * np.array([1.001, 1.009]), np.array([19.95, 20.02])
    table = rays.tables._table("D", "seabed", 11.0)
    _, points = table.plane_at(11.0).read(depth, beyond)
    assert points.paths.tolist() == [1, 1]
    found, exact = table.rays(11.0, depth, beyond), table._exact(11.0, depth, beyond)
    np.testing.assert_allclose(found.rays[:, 0, 0], exact.rays[:, 0, 0], rtol=0, atol=1e-9)


def test_bodies_below_legs_are_found_one_by_one():
    """3000 legs over 4 bodies, seen from above: those whose segment crosses the rectangle, from where to where."""
    rng = np.random.default_rng(4)
    middle, half = rng.uniform(-30, 30, (4, 2)), rng.uniform(0.5, 6, (4, 2))
    bounds = np.column_stack([middle - half, np.full(4, 18.0), middle + half, np.full(4, 20.0)])
    ends = np.column_stack([rng.uniform(-50, 50, (3000, 2)), np.full(3000, 20.0)])
    sonar, status = np.array([1.0, -2.0, 11.0]), np.where(rng.random(3000) < 0.9, LegStatus.CLEAR, LegStatus.SHADOW)
    legs, bodies, enter, leave = bodies_passed_over(sonar, ends, bounds, status.astype(np.uint8))
    along = (np.arange(2001) / 2000)[:, None]
    expected = set()
    for n in np.flatnonzero(status == LegStatus.CLEAR):
        place = sonar[:2] + along * (ends[n, :2] - sonar[:2])
        for b in range(4):
            inside = np.all((place >= bounds[b, :2]) & (place <= bounds[b, 3:5]), axis=1)
            if inside.any():
                expected.add((n, b))
                (row,) = np.flatnonzero((legs == n) & (bodies == b))
                span = along[inside, 0]
                assert enter[row] - 1e-12 <= span[0] <= enter[row] + 1e-3
                assert leave[row] - 1e-3 <= span[-1] <= leave[row] + 1e-12
    grazed = set(zip(legs.tolist(), bodies.tolist(), strict=True)) - expected  # corners, cut by less than a step
    assert len(expected) > 256 and len(grazed) < 10
    assert all(leave[(legs == n) & (bodies == b)] - enter[(legs == n) & (bodies == b)] < 1e-3 for n, b in grazed)


@pytest.fixture(scope="module")
def heaving():
    """Rays of a sonar whose depth varies between 10.6 and 11.4 m, in downward refracting water with a kink near it."""
    profile = {"depth": [0, 8, 11, 20], "speed": [1505, 1500, 1497, 1485]}
    rays = simulator_of(profile).engine.rays
    return refracted_rays(rays.scene, replace(rays.domain, source_depths=(10.6, 11.4), is_span=True))


@pytest.mark.parametrize("family", [*FAMILIES, "B", "SB"])
def test_launch_angles_between_two_depths_are_those_solved_there(heaving, family):
    """Six depths of the sonar: launch slope times distance within 1 mm, a twentieth of what counts as another ray."""
    distance, depth = np.linspace(1, 59, 300), np.linspace(19.85, 19.999, 300)
    for source in (10.6, 10.68, 10.9, 11.0, 11.07, 11.39):
        found = heaving.launch_angles(source)
        assert found is heaving.launch_angles(source) and len(found._neighbours) == 2
        exact = heaving._launch_angles(source, None)
        one, other = (angles.launch_slope(family, distance, depth) for angles in (found, exact))
        assert np.isfinite(one).all()
        assert np.abs((one - other) * distance).max() < 1e-3
        assert found.has_single_rays(family, distance, depth) == exact.has_single_rays(family, distance, depth)


def test_rays_from_between_two_depths_leave_within_the_cones(heaving):
    """Neighbourhoods of 0.1 to 10 m: every ray leaves within their cone, and arrives within the reachable range."""
    rng = np.random.default_rng(5)
    for source in (10.68, 11.07, 11.39):
        sonar, centre = np.array([0.0, 0.0, source]), rng.uniform(-35, 35, (300, 2))
        radius, turn = 10 ** rng.uniform(-1, 1, 300), rng.uniform(0, 2 * np.pi, 300)
        place = centre + (radius * np.sqrt(rng.random(300)))[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
        points = Scatterers(
            "seabed", "seabed", None, np.column_stack([place, np.full(300, 20.0)]), np.tile([0.0, 0.0, -1.0], (300, 1)),
            np.ones(300), np.ones(300, complex), np.arange(300).astype(np.uint64),
        )  # fmt: skip
        legs = heaving.legs(sonar, points, FAMILIES, 1e5)
        for row, family in enumerate(legs.families):
            cones = departure_cones(heaving, family, sonar, centre, radius, 20.0)
            off = np.arccos(np.clip(np.sum(cones.axis * legs.departure[row], axis=1), -1, 1))
            assert cones.exists.all() and np.all(off <= cones.half_angle + 1e-6)
        away, first = np.hypot(*place.T), legs.delay[: len(FAMILIES)].min(axis=0)
        limit = float(np.median(first))
        span = heaving.reachable_range((source, source), 20.0, FAMILIES, (0.0, limit), 0.0)
        assert away[first <= limit].max() <= span.farthest
