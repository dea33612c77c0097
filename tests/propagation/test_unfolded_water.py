"""Bounces unfold into stacked water, delays are least, and tubes of a fan carry what eigenrays state."""

from itertools import pairwise

import numpy as np
import pytest

from insonify.ocean.profile import SoundSpeedProfile
from insonify.propagation.eigenray import eigenrays
from insonify.propagation.ray_fan import trace_fan
from insonify.propagation.sound_speed_layers import sound_speed_layers
from oracles.few_of import few_of

WATERS = {
    "still": ([0.0, 20.0], [1500.0, 1500.0]),
    "falling": ([0.0, 20.0], [1510.0, 1495.0]),
    "thermocline": ([0.0, 8.0, 14.0, 20.0], [1510.0, 1510.0, 1490.0, 1490.0]),
    "channel": ([0.0, 11.0, 20.0], [1505.0, 1495.0, 1501.0]),
    "fast middle": ([0.0, 9.0, 20.0], [1492.0, 1503.0, 1488.0]),
}
BED, SOURCE = 20.0, 11.0
FAMILIES = ("D", "S", "B", "SB", "BS", "SBS", "BSB")


def found(name, point, distance, *families, source=SOURCE):
    """Eigenrays of a named water."""
    return eigenrays(
        SoundSpeedProfile(*WATERS[name]), water_depth=BED, source_depth=source, point_depth=point, range=distance,
        families=families or FAMILIES,
    )  # fmt: skip


def stacked(depth, speed, copies, first_up):
    """The water written one copy below the other, each the mirror of that before, so that no ray needs a mirror."""
    depth, speed = np.asarray(depth), np.asarray(speed)
    knots, values = [np.array([0.0])], [speed[-1:] if first_up else speed[:1]]
    for k in range(copies):
        mirrored = (k % 2 == 0) == first_up
        inside = (BED - depth[::-1] if mirrored else depth)[1:]
        knots.append(k * BED + inside)
        values.append((speed[::-1] if mirrored else speed)[1:])
    return np.concatenate(knots), np.concatenate(values)


def place_in(copy, depth, first_up):
    """Depth of a point in the stack that stands for one of the water."""
    return copy * BED + (BED - depth if (copy % 2 == 0) == first_up else depth)


@pytest.mark.parametrize("name", WATERS)
@pytest.mark.parametrize("family", FAMILIES[1:])
def test_a_bounced_ray_is_a_direct_one_of_the_mirrored_water(name, family):
    """Stack the water and its mirror images: each bounced ray is there as a direct one, alike in delay, length, level.

    None of the rest goes through every mirror just once: followed by a fan, it crosses one again.
    """
    count, up = len(family), family.startswith("S")
    knots, values = stacked(*WATERS[name], count + 1, up)
    tall = SoundSpeedProfile(knots, values)
    for point, distance in ((17.0, 60.0), (4.0, 35.0), (13.0, 110.0)):
        folded = found(name, point, distance, family)
        start, stop = place_in(0, SOURCE, up), place_in(count, point, up)
        whole = eigenrays(
            tall, water_depth=knots[-1], source_depth=start, point_depth=stop, range=distance, families=("D",)
        )
        folded_delay = folded.delay[folded.status == "ok"]
        left = set(range(len(whole))) if whole.status[0] == "ok" else set()
        for row, delay in enumerate(folded_delay):
            same = min(left, key=lambda i: abs(whole.launch_angle[i] - folded.launch_angle[row] * (-1 if up else 1)))
            left.remove(same)
            assert whole.delay[same] == pytest.approx(delay, abs=1e-12)
            assert whole.path_length[same] == pytest.approx(folded.path_length[row], rel=1e-9)
            assert whole.amplitude[same] == pytest.approx(folded.amplitude[row], rel=1e-6)
            assert whole.caustics[same] == folded.caustics[row]
            assert whole.turning_points[same] == folded.turning_points[row]
            assert abs(whole.arrival_angle[same]) == pytest.approx(abs(folded.arrival_angle[row]), abs=1e-9)
        for other in left:
            ray = trace_fan(
                sound_speed_layers(tall, knots[-1]),
                start,
                whole.launch_angle[other],
                max_range=distance,
                max_bounces=0,
                step=0.2,
            )
            crossings = sum(np.sum(np.diff(ray.depth > k * BED)) for k in range(1, count + 1))
            assert crossings > count


def vertical(name, source, point, family):
    """Depths between which a ray that never turns travels, leg by leg."""
    stops = [source, *[0.0 if letter == "S" else BED for letter in family.replace("D", "")], point]
    return list(pairwise(stops))


@pytest.mark.parametrize("name", WATERS)
@pytest.mark.parametrize("family", FAMILIES)
def test_range_and_delay_are_the_integrals_of_snell_s_law(name, family):
    """R = integral of p / q, T - p R = integral of q over dz, q = sqrt(1 / c^2 - p^2): by Gauss, layer by layer."""
    nodes, weights = np.polynomial.legendre.leggauss(60)
    depth, speed = WATERS[name]
    tried = 0
    for point, distance in ((17.5, 12.0), (2.0, 30.0), (17.5, 55.0)):
        rays = found(name, point, distance, family)
        for row in np.flatnonzero((rays.status == "ok") & (rays.turning_points == 0)):
            p = np.cos(rays.launch_angle[row]) / np.interp(SOURCE, depth, speed)
            reach = tau = 0.0
            for begin, end in vertical(name, SOURCE, point, family):
                low, high = min(begin, end), max(begin, end)
                cuts = [low, *[z for z in depth if low < z < high], high]
                for a, b in pairwise(cuts):
                    c = np.interp((a + b) / 2 + (b - a) / 2 * nodes, depth, speed)
                    q = np.sqrt(1 / c**2 - p**2)
                    reach += (b - a) / 2 * np.sum(weights * p / q)
                    tau += (b - a) / 2 * np.sum(weights * q)
            if abs(np.sin(rays.launch_angle[row])) < 0.1:
                continue  # where q nearly vanishes, polynomials cannot follow it
            assert reach == pytest.approx(distance, rel=1e-8)
            assert rays.delay[row] - p * distance == pytest.approx(tau, abs=1e-11)
            tried += 1
    assert tried >= 2


@pytest.mark.parametrize("name", WATERS)
@pytest.mark.parametrize("family", ["S", "B", "SB", "BS"])
def test_delay_is_convex_over_range_before_any_caustic(name, family):
    """Farther points are reached by flatter rays: second differences of the delay over range are positive."""
    distance = np.linspace(1, 60, 60)
    rays = found(name, 16.0, distance, family)
    one = np.array([np.sum((rays.point == k) & (rays.status == "ok")) == 1 for k in range(60)])
    kept = np.flatnonzero(~one)[0] if not one.all() else 60
    assert kept >= 20
    row = np.array([np.flatnonzero(rays.point == k)[0] for k in range(kept)])
    plain = (rays.caustics[row] == 0) & (rays.turning_points[row] == 0)
    kept = np.flatnonzero(~plain)[0] if not plain.all() else kept
    delay = rays.delay[row[:kept]]
    assert kept >= 15
    assert np.all(np.diff(delay, 2) > 0)
    # the slope is cos / c: it stays below the slowness of the slowest water
    assert np.all(np.diff(delay) < 1 / min(WATERS[name][1]))


def polyline_time(name, ranges, depths):
    """Time along straight pieces: length ln(c2 / c1) / (c2 - c1) in each layer, for c is linear along them."""
    knots, speed = WATERS[name]
    total = 0.0
    for x1, z1, x2, z2 in zip(ranges[:-1], depths[:-1], ranges[1:], depths[1:], strict=True):
        share = [0.0, 1.0] + [(k - z1) / (z2 - z1) for k in knots if min(z1, z2) < k < max(z1, z2)]
        share = np.sort(share)
        c = np.interp(z1 + share * (z2 - z1), knots, speed)
        ratio = np.diff(c) / c[:-1]
        mean = np.where(np.abs(ratio) > 1e-9, np.log1p(ratio) / np.where(ratio == 0, 1, np.diff(c)), 1 / c[:-1])
        total += np.hypot(x2 - x1, z2 - z1) * np.sum(np.diff(share) * mean)
    return total


@pytest.mark.parametrize("name", ["still", "falling"])
@pytest.mark.parametrize("seed", range(3))
def test_no_path_through_water_of_one_gradient_is_quicker(name, seed):
    """Fermat, of all ways: a hundred random polylines of 1 to 12 corners all take longer than the direct ray."""
    rng = np.random.default_rng(seed)
    point, distance = rng.uniform(12, 19), rng.uniform(20, 90)
    least = found(name, point, distance, "D").delay.min()
    for _ in range(100):
        corners = rng.integers(1, 13)
        ranges = np.sort(rng.uniform(0, distance, corners))
        along = SOURCE + (point - SOURCE) * ranges / distance
        depths = np.clip(along + rng.normal(0, 10 ** rng.uniform(-4, 1), corners), 0, BED)
        assert polyline_time(name, [0, *ranges, distance], [SOURCE, *depths, point]) > least - 1e-13


@pytest.mark.parametrize("name", WATERS)
@few_of((0, 2), "family", ["D", "S", "BS"])
def test_a_ray_pushed_aside_is_late_by_the_square(name, family):
    """Fermat: between its ends and bounces pushed by twice as much, four times as late, if no caustic is touched."""
    rays = found(name, 17.0, 50.0, family)
    for row in np.flatnonzero((rays.status == "ok") & (rays.caustics == 0) & (rays.turning_points == 0)):
        traced = trace_fan(
            sound_speed_layers(SoundSpeedProfile(*WATERS[name]), BED), SOURCE, rays.launch_angle[row], max_range=50.0,
            max_bounces=len(family.replace("D", "")), step=0.05,
        )  # fmt: skip
        x, z = traced.range, traced.depth
        keep = np.concatenate([[True], np.diff(x) > 0])
        x, z = x[keep], z[keep]
        if name == "still":  # of straight pieces there are only the ends
            x, z = (fine := np.union1d(x, np.linspace(0, 50, 400))), np.interp(fine, x, z)
        still = polyline_time(name, x, z)
        assert still == pytest.approx(rays.delay[row], abs=1e-10)
        # a push that vanishes at ends and boundaries, and leaves the water nowhere
        push = np.sin(2 * np.pi * x / 50.0) * np.minimum(z, BED - z) / BED
        late = [polyline_time(name, x, z + size * push) - still for size in (0.2, 0.4, -0.2, -0.4)]
        assert min(late) > 0
        # the parts that are odd in the push cancel between both signs; what is left grows by the square
        assert (late[1] + late[3]) / (late[0] + late[2]) == pytest.approx(4, rel=0.1)


@pytest.mark.parametrize("name", WATERS)
def test_the_level_of_a_ray_is_the_width_of_its_tube_in_a_fan(name):
    """A^2 = 1 / (R |dz / dtheta|): two neighbours of a fan, traced apart by 2e-6 rad, part as the amplitude states."""
    water, tried = sound_speed_layers(SoundSpeedProfile(*WATERS[name]), BED), 0
    for point, distance in ((17.0, 40.0), (3.0, 70.0), (12.5, 90.0)):
        rays = found(name, point, distance)
        for row in np.flatnonzero(rays.status == "ok"):
            bounces = len(rays.family[row].replace("D", ""))
            sides = rays.launch_angle[row] + np.array([-1e-6, 1e-6])
            pair = trace_fan(water, SOURCE, sides, max_range=distance, max_bounces=bounces, step=np.inf)
            last = pair.first_vertex[1:] - 1
            if pair.boundaries[0] != pair.boundaries[1] or pair.turns[last[0]] != pair.turns[last[1]]:
                continue
            width = abs(np.diff(pair.depth[last])[0]) / 2e-6
            assert rays.amplitude[row] == pytest.approx(1 / np.sqrt(distance * width), rel=1e-3)
            tried += 1
    assert tried >= 12
