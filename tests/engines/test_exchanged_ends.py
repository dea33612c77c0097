"""Sonar and point exchanged: what ground displaces, cuts and reflects is the same."""

import numpy as np
import pytest

from engines.test_local_planes import FAMILIES, surveyed
from insonify.engines.terrain_occlusion import occlude_by_terrain
from insonify.propagation.image_sources import image_legs
from insonify.records.legs import LegStatus
from insonify.scattering.lambert import Lambert
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene, point_scatterer
from insonify.scene.target import PointTarget
from insonify.simulator import build_simulator
from oracles.few_of import few_of
from oracles.ridges import DEPTH, Ridge, bed_of, seen_from
from oracles.scenes import nominal

FLAT = Scene(seabed={"depth": DEPTH})


def beyond_crests(here, there, families, *crests):
    """Legs from one position to another past ridges, soft."""
    point = point_scatterer(PointTarget(position=tuple(there)))
    flat = image_legs(FLAT, np.array(here), point, families, 1e5)
    return occlude_by_terrain(flat, point, np.array(here), seen_from(bed_of(*crests), here), soft=True)


def ends(seed, count, farthest=100):
    """Pairs of positions in the water, to the south and to the north of ridges between 30 and 60 m."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        # whole metres: the lines of either end have a node on each crest
        yield (0.0, 0.0, rng.uniform(6, 18)), (float(rng.integers(75, farthest)), 0.0, rng.uniform(6, 19))


@few_of(
    (2, 3),
    ("family", "crests"),
    [
        ("D", [Ridge(40.0, 6.0)]),
        ("S", [Ridge(70.0, 10.0)]),
        ("D", [Ridge(35.0, 6.0), Ridge(60.0, 5.0)]),
        ("B", [Ridge(30.0, 5.0)]),
    ],
)
def test_diffraction_over_a_crest_is_reciprocal(family, crests):
    """25 pairs of ends beyond one ridge or two: the same complex part of the pressure both paths, to 0.025.

    But for bounces within 5 m of a crest, which lies in their mirror then.
    """
    out, home = [], []
    for one, other in ends(1, 25):
        bounce = other[0] * (DEPTH - one[2]) / (2 * DEPTH - one[2] - other[2])
        if family == "B" and abs(bounce - crests[0].crest) < 5:
            continue
        out.append(beyond_crests(one, other, (family,), *crests))
        home.append(beyond_crests(other, one, (family,), *crests))
    assert len(out) > 12
    left = [np.array([legs.visibility[0, 0] for legs in ways]) for ways in (out, home)]
    np.testing.assert_allclose(*left, rtol=0, atol=0.025)
    assert np.ptp(np.abs(left[0])) > 0.5
    cut = [np.array([legs.status[0, 0] == LegStatus.OCCLUDED for legs in ways]) for ways in (out, home)]
    near_edge = np.abs(np.abs(left[0]) - 0.5) < 0.05
    assert np.array_equal(cut[0][~near_edge], cut[1][~near_edge])


def test_a_higher_crest_leaves_no_more_in_the_shadow():
    """D behind a ridge that grows from 3 to 8 m: once it is dark it gets darker and never lighter."""
    here, there = (0.0, 0.0, 11.0), (90.0, 0.0, 17.0)
    legs = [beyond_crests(here, there, ("D",), Ridge(40.0, height)) for height in np.arange(3.0, 8.0, 0.1)]
    left = np.array([abs(way.visibility[0, 0]) for way in legs])
    dark = np.array([way.status[0, 0] == LegStatus.OCCLUDED for way in legs])
    first = np.flatnonzero(dark)[0]
    assert dark[first:].all() and 5 < first < 40
    assert np.all(np.diff(left[first:]) < 1e-6)
    assert left[first] == pytest.approx(0.5, abs=0.1) and left[0] == pytest.approx(1, abs=0.05)
    assert left[:first].max() < 1.18  # the first maximum of Fresnel's integral


def test_two_like_crests_of_a_symmetric_path_leave_what_one_does_or_less():
    """A second ridge, lower than the ray, takes nothing that matters; one as high takes no less than the first."""
    here, there = (0.0, 0.0, 15.0), (100.0, 0.0, 15.0)
    one, low, two = (
        abs(beyond_crests(here, there, ("D",), *crests).visibility[0, 0])
        for crests in ([Ridge(40.0, 5.5)], [Ridge(40.0, 5.5), Ridge(60.0, 1.0)], [Ridge(40.0, 5.5), Ridge(60.0, 5.5)])
    )
    assert low == pytest.approx(one, abs=1e-3)
    assert two <= one + 0.02


BEYOND = "ignore:.*not in the survey:insonify.validity.PhysicsWarning"


def wavy(north, east):
    """A seabed of gentle swells, with no way of its own between north and east."""
    return 20 + 0.15 * np.sin(2 * np.pi * (north + 0.3 * east) / 70) + 0.1 * np.cos(2 * np.pi * (east - north) / 90)


def evaluate(scenario, points):
    """Legs from the nominal sonar of a scenario to points."""
    simulator = build_simulator(scenario)
    count = len(points)
    ones = np.ones(count)
    points = Scatterers(
        "any", "target", Lambert(), np.array(points, float), np.zeros((count, 3)), ones, ones.astype(complex),
        np.arange(count).astype(np.uint64),
    )  # fmt: skip
    return simulator.engine.path_pairs(simulator.ping_geometry(0), points).transmit_legs


@pytest.mark.filterwarnings(BEYOND)
def test_a_bounce_off_uneven_ground_is_the_same_from_either_end(tmp_path):
    """Twelve pairs of ends over swells of the seabed: B and SBS as long and as strong, SB as BS; to 1 us and 0.3 dB."""
    seabed = surveyed(tmp_path, wavy, reach=100.0, cell=1.0)
    paths = {"families": list(FAMILIES), "max_reflections": 3}
    rng = np.random.default_rng(7)
    worst, level = [], []
    for _ in range(12):
        distance, turn = rng.uniform(15, 60), rng.uniform(-np.pi, np.pi)
        one = np.array([0.0, 0.0, rng.uniform(8, 14)])
        other = np.array([distance * np.cos(turn), distance * np.sin(turn), rng.uniform(6, 15)])
        out, back = (
            evaluate(nominal(seabed=seabed, track={"position": tuple(a), "window": (0.01, 0.25)}, paths=paths), [b])
            for a, b in ((one, other), (other, one))
        )
        for family in ("B", "SB", "BS", "SBS"):
            there, home = out.families.index(family), back.families.index(family[::-1])
            if (out.status[there, 0], back.status[home, 0]) == (LegStatus.CLEAR, LegStatus.CLEAR):
                worst.append(out.delay[there, 0] - back.delay[home, 0])
                level.append(20 * np.log10(abs(out.amplitude[there, 0] / back.amplitude[home, 0])))
    assert len(worst) > 40
    assert np.abs(worst).max() < 1e-6
    assert np.abs(level).max() < 0.3


@pytest.mark.filterwarnings(BEYOND)
def test_an_inclined_world_may_be_turned(tmp_path):
    """A slope of 4 % towards any bearing, with the points turned along: delays to 1e-8 s, level to 1e-5."""
    rng = np.random.default_rng(5)
    distance, bearing = rng.uniform(15, 90, 60), rng.uniform(-np.pi, np.pi, 60)
    depth = rng.uniform(0.2, 0.9, 60) * (20 + 0.04 * distance * np.cos(bearing))
    found = []
    for turn in (0.0, 0.7, 2.5):
        folder = tmp_path / f"{turn}"
        folder.mkdir()
        c, s = np.cos(turn), np.sin(turn)
        seabed = surveyed(folder, lambda n, e, c=c, s=s: 20 + 0.04 * (c * n + s * e), reach=150.0)
        points = np.column_stack([distance * np.cos(bearing + turn), distance * np.sin(bearing + turn), depth])
        paths = {"families": list(FAMILIES), "max_reflections": 3}
        found.append(evaluate(nominal(seabed=seabed, track={"window": (0.01, 0.25)}, paths=paths), points))
    for other in found[1:]:
        np.testing.assert_array_equal(other.status, found[0].status)
        np.testing.assert_allclose(other.delay, found[0].delay, rtol=0, atol=2e-8)
        np.testing.assert_allclose(other.amplitude, found[0].amplitude, rtol=2e-5)
