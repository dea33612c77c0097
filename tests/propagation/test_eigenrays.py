"""What eigenrays promise their user: every path once, a reason where there is none, and numbers at every limit."""

from decimal import Decimal, localcontext

import numpy as np
import pytest
from scipy.integrate import quad

from insonify.ocean import SoundSpeedProfile
from insonify.propagation import eigenrays
from insonify.propagation._eigenray_kernel import (
    DELAY,
    FOLD,
    FOLD_CURVATURE,
    FOLD_SIDE,
    MAX_RAYS,
    SLOWNESS,
)
from insonify.propagation.eigenray_record import exact_solutions
from insonify.propagation.families import families_up_to
from insonify.propagation.sound_speed_layers import sound_speed_layers

THERMO = SoundSpeedProfile([0, 8, 14, 20], [1510, 1510, 1490, 1490])
CAUSTIC = SoundSpeedProfile([0, 4, 8, 20], [1510, 1510, 1490, 1490])
STILL = SoundSpeedProfile([0, 20], [1500, 1500])
UPWARD = SoundSpeedProfile([0, 20], [1480, 1486])
SEVEN = families_up_to(3)


def found(profile, source, point, distance, chosen=SEVEN):
    """Eigenrays in 20 m of water."""
    return eigenrays(
        profile, water_depth=20, source_depth=source, point_depth=point, range=distance, families=chosen
    )  # fmt: skip


def solved(profile, source, point, distances):
    """What the kernel fills for the direct family at one depth."""
    depths = np.full(np.size(distances), float(point))
    water = sound_speed_layers(profile, 20.0)
    return exact_solutions(water, "D", source, depths, np.asarray(distances, float))[:2]


def test_straight_up_and_down_the_delay_is_depth_over_speed():
    """At range 0 delay and length are the integrals of dz / c and of dz; the amplitude is sqrt(c_s c_r) / that of c dz.

    For a vertical ray dX/dp is the integral of c dz, and the tube is as wide along the range as across it.
    """
    rows = found(THERMO, 11.0, 17.0, 0.0)
    slow = lambda a, b: quad(lambda z: 1 / THERMO.at(z), a, b, points=[8, 14], epsabs=1e-15)[0]  # noqa: E731
    fast = lambda a, b: quad(THERMO.at, a, b, points=[8, 14])[0]  # noqa: E731
    ways = {"D": [(11, 17)], "S": [(0, 11), (0, 17)], "B": [(11, 20), (17, 20)], "SB": [(0, 11), (0, 20), (17, 20)]}
    for family, way in ways.items():
        k = list(rows.family).index(family)
        assert rows.delay[k] == pytest.approx(sum(slow(a, b) for a, b in way), abs=1e-13)
        assert rows.path_length[k] == pytest.approx(sum(b - a for a, b in way), abs=1e-12)
        spread = np.sqrt(1500 * 1490) / sum(fast(a, b) for a, b in way)
        assert rows.amplitude[k] == pytest.approx(spread, rel=1e-9)
    np.testing.assert_allclose(np.abs(rows.launch_angle), np.pi / 2)


def test_minus_nothing_is_straight_up_and_down_too():
    """A range of -0.0, as a subtraction may leave it, is a range of 0."""
    for method in ("exact", "table"):
        rows = eigenrays(
            THERMO, water_depth=20.0, source_depth=11.0, point_depth=[17.0, -0.0], range=[-0.0, 60.0], method=method
        )
        plain = eigenrays(
            THERMO, water_depth=20.0, source_depth=11.0, point_depth=[17.0, 0.0], range=[0.0, 60.0], method=method
        )
        assert np.all(np.isfinite(rows.delay[rows.status == "ok"]))
        np.testing.assert_array_equal(rows.delay, plain.delay)
        np.testing.assert_array_equal(rows.amplitude, plain.amplitude)


@pytest.mark.parametrize("depth", [0.0, 11.0, 20.0])
def test_along_its_own_depth_sound_of_one_speed_runs_level(depth):
    """A point as deep as the source is reached level, in R / c, in the water and along both boundaries."""
    distance = np.array([0.5, 5.0, 150.0])
    rows = found(STILL, depth, depth, distance, ["D"])
    np.testing.assert_allclose(rows.delay, distance / 1500, rtol=1e-15)
    np.testing.assert_allclose(rows.amplitude, 1 / distance, rtol=1e-15)
    assert not rows.launch_angle.any() and not rows.arrival_angle.any() and list(rows.status) == ["ok"] * 3


def test_on_a_boundary_the_bounce_there_is_still_to_come():
    """On the seabed D and B are one path, and so are S and SB; at the surface D and S, B and BS."""
    for point, pairs in ((20.0, ("D", "B", "S", "SB")), (0.0, ("D", "S", "B", "BS"))):
        rows = found(THERMO, 11.0, point, 60.0)
        first = {name: list(rows.family).index(name) for name in pairs}
        for a, b in (pairs[:2], pairs[2:]):
            assert rows.delay[first[a]] == pytest.approx(rows.delay[first[b]], abs=1e-15)
            assert rows.launch_angle[first[a]] == pytest.approx(rows.launch_angle[first[b]], abs=1e-12)


def test_why_there_is_no_path():
    """Below a thermocline a shadow; where sound speed grows with depth rays turn; across a kink a gap."""
    assert set(found(THERMO, 11.0, 20.0, [170.0, 300.0], ["D"]).status) == {"shadow"}
    assert set(found(UPWARD, 11.0, 20.0, 2000.0, ["D", "B"]).status) == {"turned"}
    peak = SoundSpeedProfile([0, 4, 8, 14, 20], [1540, 1500, 1510, 1490, 1490])  # rays turn below 8 m or above 4 m
    gap = found(peak, 11.0, 19.0, np.linspace(100, 240, 71), ["D"]).status.tolist()
    assert gap[0] == gap[-1] == "ok" and set(gap) == {"ok", "beyond_critical"}
    missing = found(THERMO, 11.0, 20.0, 170.0, ["D"])
    assert np.isnan(missing.delay).all() and np.isnan(missing.amplitude).all() and (missing.caustics == -1).all()


def test_the_direct_path_ends_where_the_limiting_ray_lands():
    """In the thermocline the last direct ray is the one that turns at the kink at 8 m: p = 1 / 1510."""
    p = 1 / 1510

    def run(z):
        return p * THERMO.at(z) / np.sqrt(1 - (p * THERMO.at(z)) ** 2)

    arc = np.sqrt(1 - (1500 * p) ** 2) / (p * 20 / 6)  # from the source to the kink, in closed form
    edge = 2 * arc + quad(run, 11, 14)[0] + run(17.0) * 6
    rows = found(THERMO, 11.0, 20.0, edge + np.array([-1e-3, 1e-3]), ["D"])
    assert list(rows.status) == ["ok", "shadow"]
    assert np.cos(rows.launch_angle[0]) / 1500 == pytest.approx(p, rel=1e-6)


def test_two_rays_are_born_at_a_fold_and_one_has_touched_the_caustic():
    """On one side of a caustic there are two more rays; their slownesses differ by sqrt(2 FOLD / FOLD_CURVATURE)."""
    rays, count = solved(CAUSTIC, 11.0, 11.0, np.linspace(100, 160, 601))
    fold = np.flatnonzero(np.diff(count) == 2)[0] + 1
    pair = rays[fold, : count[fold]]
    pair = pair[np.isfinite(pair[:, FOLD]) & (np.abs(pair[:, FOLD]) < 0.2)]
    edge = np.linspace(100, 160, 601)[fold] - pair[0, FOLD]
    near, counts = solved(CAUSTIC, 11.0, 11.0, edge + np.array([-1e-3, 1e-3, 0.02]))
    assert list(np.diff(counts[:2])) == [2]
    born = near[2, : counts[2]]
    born = born[np.abs(born[:, FOLD] - 0.02) < 1e-6]
    assert sorted(born[:, FOLD_SIDE]) == sorted(np.where(born[:, 6] == born[:, 6].max(), 1.0, -1.0))
    apart = np.abs(np.diff(born[:, SLOWNESS]))[0]
    assert apart == pytest.approx(2 * np.sqrt(2 * 0.02 / born[0, FOLD_CURVATURE]), rel=0.05)


def test_properties_of_a_ray_do_not_depend_on_the_other_points():
    """Alone, in a batch, or shuffled: the same rays, to rounding; the last Newton step may differ."""
    rng = np.random.default_rng(3)
    depth, distance = rng.choice([2.0, 6.0, 11.0, 20.0], 300), rng.uniform(0, 250, 300)
    together = found(CAUSTIC, 11.0, depth, distance)
    shuffle = rng.permutation(300)
    apart = found(CAUSTIC, 11.0, depth[shuffle], distance[shuffle])
    order = np.lexsort((apart.branch, [SEVEN.index(f) for f in apart.family], shuffle[apart.point]))
    for name in ("delay", "launch_angle", "amplitude", "path_length"):
        np.testing.assert_allclose(getattr(together, name), getattr(apart, name)[order], rtol=1e-7)
    for k in range(0, 300, 30):
        alone = found(CAUSTIC, 11.0, depth[k], distance[k])
        mine = together.point == k
        np.testing.assert_array_equal(alone.status, together.status[mine])
        np.testing.assert_allclose(alone.delay, together.delay[mine], rtol=0, atol=1e-14)


def test_no_join_of_branches_doubles_or_loses_a_ray():
    """Across the range where the source is left level, and where it is reached level, there is one direct ray."""
    rays, count = solved(THERMO, 11.0, 17.0, np.linspace(1, 140, 5001))
    assert (count == 1).all()
    slow = np.abs(rays[:, 0, SLOWNESS] - 1 / 1500).argmin()
    edge = np.linspace(1, 140, 5001)[slow]
    fine, counts = solved(THERMO, 11.0, 17.0, edge + np.linspace(-0.03, 0.03, 4001))
    assert (counts == 1).all()
    np.testing.assert_allclose(np.diff(fine[:, 0, DELAY]), 0.06 / 4000 / 1500, rtol=1e-4)  # dT/dR = p


def test_at_the_very_join_of_two_branches_there_is_one_ray():
    """The ray that leaves level lands at s / (p g) + p c dz / s; there, to the last bits, it is found exactly once."""
    p, g, s = 1 / 1500, 20 / 6, np.sqrt(10 * 2990) / 1500  # s = sqrt(1 - (1490 / 1500)^2)
    landing = s / (p * g) + p * 1490 * 3 / s
    rays, count = solved(THERMO, 11.0, 17.0, landing * (1 + 1e-15 * np.arange(-60, 61)))
    assert (count == 1).all()
    assert np.abs(rays[:, 0, SLOWNESS] * 1500 - 1).max() < 1e-15


@pytest.mark.parametrize("gradient", [-3.0, 0.02, 0.8])
def test_in_one_gradient_the_path_is_as_long_as_its_arc(gradient):
    """An arc of radius 1 / (p g) over the chord d has the length 2 / (p g) asin(p g d / 2), turned or not."""
    water = SoundSpeedProfile([0, 20], [1500, 1500 + 20 * gradient])
    source, point, distance = 9.0, np.array([[3.0], [9.0], [15.0]]), np.linspace(2, 60, 30)
    rows = found(water, source, point, distance, ["D"])
    there = rows.status == "ok"
    chord = np.hypot(distance, point - source).ravel()[rows.point[there]]
    curvature = np.cos(rows.launch_angle[there]) / water.at(source) * abs(gradient)
    assert rows.turning_points.max() == 1
    np.testing.assert_allclose(
        rows.path_length[there], 2 / curvature * np.arcsin(curvature * chord / 2), rtol=1e-12, atol=0
    )


@pytest.mark.parametrize("gap", [1e-9, 1e-6, 1e-3])
def test_knots_a_hair_apart_bend_no_more_than_one(gap):
    """A knot split in two with the speed that lies between changes delays by less than the hair takes, 1e-3 / c."""
    split = SoundSpeedProfile([0, 8, 14, 14 + gap, 20], [1510, 1510, 1490, 1490, 1490])
    one, two = found(THERMO, 11.0, 19.0, [30.0, 90.0, 150.0]), found(split, 11.0, 19.0, [30.0, 90.0, 150.0])
    np.testing.assert_allclose(one.delay, two.delay, rtol=0, atol=1e-12)
    np.testing.assert_allclose(one.amplitude, two.amplitude, rtol=1e-6)


def test_in_a_channel_the_rays_with_the_fewest_turns_are_given():
    """From axis to axis of a channel any number of turns leads; eight rays are kept, no ray left out turns less."""
    channel = SoundSpeedProfile([0, 10, 20], [1510, 1490, 1510])
    rows = found(channel, 10.0, 10.0, 100.0, ["D"])
    assert len(rows) == MAX_RAYS
    least = rows.turning_points.min()
    assert set(rows.turning_points) == set(range(least, rows.turning_points.max() + 1))


def test_points_are_numbered_as_depths_and_ranges_broadcast():
    """Depths down a column against ranges along a row: point = row x columns + column; each has all families."""
    rows = found(STILL, 11.0, [[5.0], [15.0]], [10.0, 20.0, 30.0])
    assert sorted(set(rows.point)) == list(range(6)) and len(rows) == 6 * len(SEVEN)
    k = np.flatnonzero((rows.point == 4) & (rows.family == "D"))[0]
    assert rows.delay[k] == pytest.approx(np.hypot(20, 4) / 1500, abs=1e-15)
    assert len(found(STILL, 11.0, [], 10.0)) == 0


def test_a_record_reads_like_a_notebook():
    """Delay, level and angles of each path, and the reason where there is none."""
    text = repr(found(THERMO, 11.0, [19.0, 20.0], [150.0, 170.0], ["D", "S"]))
    assert "100.466668 ms   -41.70 dB    -6.061" in text and "D    shadow" in text and "3 paths to 2 points" in text


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"water_depth": 25.0}, "ends at 20 m"),
        ({"water_depth": -1.0}, "water_depth"),
        ({"source_depth": 20.1}, "source_depth is 20.1 m"),
        ({"source_depth": float("nan")}, "source_depth is nan"),
        ({"point_depth": [5.0, -0.1]}, "point_depth is -0.1 m"),
        ({"range": -1.0}, "range is -1 m"),
        ({"range": [1.0, np.inf]}, "range is inf"),
        ({"range": "far"}, "range is 'far'"),
        ({"point_depth": [1.0, 2.0], "range": [1.0, 2.0, 3.0]}, "point_depth has shape"),
        ({"families": ["D", "BB"]}, "'BB' is no path family"),
        ({"families": "DS"}, "a list of names"),
        ({"families": ["D", "D"]}, "names one twice"),
        ({"families": []}, "families is empty"),
        ({"method": "fast"}, "'exact' or 'table'"),
    ],
)
def test_what_means_nothing_is_refused_with_advice(change, words):
    """Depths out of the water, ranges behind the source, words for numbers, families that cannot be."""
    arguments = {"water_depth": 20.0, "source_depth": 11.0, "point_depth": 19.0, "range": 150.0} | change
    with pytest.raises(ValueError, match=words):
        eigenrays(THERMO, **arguments)


def test_a_column_is_the_profile_from_surface_to_seabed():
    """Knots below the seabed play no part, those in the water all do, and the ends lie exactly at 0 and at the bed."""
    water = sound_speed_layers(THERMO, 17.0)
    np.testing.assert_array_equal(water.depth, [0, 8, 14, 17])
    np.testing.assert_array_equal(water.speed, [1510, 1510, 1490, 1490])
    assert water.water_depth == 17
    with pytest.raises(ValueError, match="begins at 2 m"):
        sound_speed_layers(SoundSpeedProfile([2, 20], [1500, 1500]), 10.0)


@pytest.mark.parametrize("gradient", [0.5, -0.5, 0.05, -1.0])
def test_delays_are_right_to_rounding(gradient):
    """Direct rays in one gradient, up to 250 m: within 2e-16 s of arccosh in 40-digit decimals."""
    deep, random = 50.0, np.random.default_rng(1)
    profile = SoundSpeedProfile([0.0, deep], [1500.0, 1500.0 + gradient * deep])
    with localcontext() as context:
        context.prec = 40
        slope = (Decimal(1500.0 + gradient * deep) - 1500) / Decimal(deep)
        for _ in range(12):
            source, point = (float(depth) for depth in random.uniform(1, 49, 2))
            reach = float(random.uniform(3, 250))
            ends = {"source_depth": source, "point_depth": point, "range": reach}
            rays = eigenrays(profile, water_depth=deep, families=("D",), **ends)
            across = Decimal(reach) ** 2 + (Decimal(source) - Decimal(point)) ** 2
            speeds = (1500 + slope * Decimal(source)) * (1500 + slope * Decimal(point))
            x = 1 + slope**2 * across / (2 * speeds)
            expected = (x + (x * x - 1).sqrt()).ln() / abs(slope)
            delays = [Decimal(float(delay)) for delay in rays.delay if np.isfinite(delay)]
            assert not delays or min(abs(delay - expected) for delay in delays) < Decimal("2e-16")
