"""Tables of delays: as right as the exact solver, and never where they cannot be."""

import dataclasses

import numpy as np
import pytest

from insonify.ocean.profile import SoundSpeedProfile
from insonify.propagation._eigenray_kernel import (
    AMPLITUDE,
    CAUSTICS,
    COLUMNS,
    DELAY,
    LENGTH,
    SIN_ARRIVAL,
    SIN_LAUNCH,
    SLOWNESS,
    TURNS,
)  # fmt: skip
from insonify.propagation._eigenray_table_kernel import EXACT
from insonify.propagation.eigenray import eigenrays
from insonify.propagation.eigenray_record import exact_solutions
from insonify.propagation.eigenray_table import (
    MAX_AMPLITUDE_ERROR,
    MAX_DELAY_ERROR,
    EigenrayTable,
    TableError,
    check_sample,
    eigenray_table,
)
from insonify.propagation.sound_speed_layers import sound_speed_layers
from oracles.columns import NAMED, nasty_column, random_column

FAMILIES = {"D": "", "S": "S", "B": "B", "SB": "SB", "BS": "BS"}


def water(name):
    """A column of the published comparison."""
    return between_boundaries(*NAMED[name])


def between_boundaries(depth, speed):
    """A column of these knots."""
    return sound_speed_layers(SoundSpeedProfile(np.asarray(depth, float), np.asarray(speed, float)), float(depth[-1]))


def table(here, family, sources=(11.0, 11.0), points=(0.0, 20.0), farthest=200.0):
    """A table for a source at 11 m in water 20 m deep, unless given otherwise."""
    return eigenray_table(here, family, source_depths=sources, point_depths=points, max_range=farthest)


def exact(here, family, source, depth, ranges):
    """Rays, count and status by the exact solver, in the order given."""
    order = np.lexsort((ranges, depth))
    rays, count, why = exact_solutions(here, family, source, depth[order], ranges[order])
    back = np.argsort(order)
    return rays[back], count[back], why[back]


def anywhere(low, high, farthest, n, seed=0):
    """Points drawn evenly over a table."""
    draw = np.random.default_rng(seed)
    return draw.uniform(low, high, n), draw.uniform(0, farthest, n)


def assert_agree(table, source, depth, ranges):
    """Holds a table against the exact solver: same paths, delays to 1e-9 s, amplitudes and lengths to 0.02 dB."""
    rays, count, status = table.rays(source, depth, ranges)
    truth, paths, why = exact(table.specification.layers, table.family, source, depth, ranges)
    np.testing.assert_array_equal(count, paths)
    np.testing.assert_array_equal(status, why)
    there = np.arange(rays.shape[1]) < count[:, None]
    ours, theirs = rays[there], truth[:, : rays.shape[1]][there]
    assert np.abs(ours[:, DELAY] - theirs[:, DELAY]).max(initial=0) <= MAX_DELAY_ERROR
    np.testing.assert_allclose(ours[:, AMPLITUDE], theirs[:, AMPLITUDE], rtol=MAX_AMPLITUDE_ERROR)
    np.testing.assert_allclose(ours[:, LENGTH], theirs[:, LENGTH], rtol=MAX_AMPLITUDE_ERROR, atol=1e-6)
    np.testing.assert_allclose(ours[:, SLOWNESS], theirs[:, SLOWNESS], atol=1e-8)
    for angle in (SIN_LAUNCH, SIN_ARRIVAL):
        np.testing.assert_allclose(ours[:, angle], theirs[:, angle], atol=2e-5)
    np.testing.assert_array_equal(ours[:, CAUSTICS], theirs[:, CAUSTICS])
    return ours, theirs


def exact_fraction(held):
    """Fraction of a table's cells in which the exact solver is used."""
    return np.mean([plane.path_count == EXACT for plane in held.planes])


@pytest.mark.parametrize("family", FAMILIES)
def test_water_of_one_speed_is_held_exactly(family):
    """The square of the delay is a quadratic there, which the polynomials hold: images to 1e-11 s, from 0.1 m on."""
    held = table(water("iso20"), family)
    depth, ranges = anywhere(0, 20, 200, 4000)
    ranges = np.maximum(ranges, 0.1)
    rays, count, _ = held.rays(11.0, depth, ranges)
    image = {"D": 11.0, "S": -11.0, "B": 29.0, "SB": 51.0, "BS": -29.0}[family]
    slant = np.hypot(ranges, depth - image)
    assert np.all(count == 1) and exact_fraction(held) < 1e-3
    np.testing.assert_allclose(rays[:, 0, DELAY], slant / 1500, atol=1e-11)
    np.testing.assert_allclose(rays[:, 0, AMPLITUDE], 1 / slant, rtol=1e-4)
    np.testing.assert_allclose(rays[:, 0, SLOWNESS], ranges / slant / 1500, atol=1e-10)
    np.testing.assert_allclose(np.abs(rays[:, 0, SIN_ARRIVAL]), np.abs(depth - image) / slant, atol=1e-6)
    np.testing.assert_allclose(rays[:, 0, LENGTH], slant, rtol=1e-6)


def test_one_gradient_has_a_closed_form():
    """T = (2 / |g|) asinh(|g| d / (2 sqrt(c1 c2))) for the direct ray, turning or not, near and far."""
    held = table(water("down20"), "D")
    depth, ranges = anywhere(0, 20, 200, 4000)
    ranges[:1000] *= 0.025  # within 5 m of the sonar
    rays, count, _ = held.rays(11.0, depth, ranges)
    speeds = np.interp(11.0, *NAMED["down20"]) * np.interp(depth, *NAMED["down20"])
    delay = 4 * np.arcsinh(0.25 * np.hypot(ranges, depth - 11) / np.sqrt(speeds))
    there = count == 1
    assert there.mean() > 0.99 and exact_fraction(held) < 0.01
    np.testing.assert_allclose(rays[there, 0, DELAY], delay[there], atol=1e-10)
    assert (rays[there, 0, TURNS] == 1).sum() > 500


@pytest.mark.parametrize(("name", "family"), [
    ("thermo20", "D"), ("thermo20", "S"), ("thermo20", "B"), ("thermo20", "BS"), ("caustic20", "D"), ("duct20", "D"),
    ("fresh20", "SB"), ("winter20", "D"),
])  # fmt: skip
def test_a_table_is_the_exact_solver(name, family):
    """Same paths everywhere, shadows included; 1e-9 s and 0.02 dB, and most of it from the table itself."""
    held = table(water(name), family)
    depth, ranges = anywhere(0, 20, 200, 1500, seed=3)
    assert_agree(held, 11.0, depth, ranges)
    assert exact_fraction(held) < 0.2


@pytest.mark.parametrize("family", FAMILIES)
def test_a_flat_seabed_is_one_line(family):
    """Points of one depth cost one line of nodes, and 99 % of them are read from it in a thermocline."""
    held = table(water("thermo20"), family, points=(20.0, 20.0))
    _, ranges = anywhere(0, 20, 200, 2000, seed=4)
    assert_agree(held, 11.0, np.full(ranges.size, 20.0), ranges)
    assert exact_fraction(held) < 0.01


@pytest.mark.parametrize(
    ("name", "family"), [("thermo20", "D"), ("thermo20", "S"), ("down20", "D"), ("caustic20", "B")]
)
def test_a_heaving_sonar_is_anywhere_between(name, family):
    """Delays for a source between two planes: from their values and exact slopes, 1e-9 s and 0.02 dB."""
    held = table(water(name), family, sources=(10.4, 11.5), points=(19.0, 20.0))
    for source in (10.4, 10.47, 10.9, 11.23, 11.5):
        depth, ranges = anywhere(19, 20, 200, 400, seed=5)
        assert_agree(held, source, depth, ranges)


@pytest.mark.parametrize(
    ("draw", "seed"), [(random_column, k) for k in range(12)] + [(nasty_column, k) for k in range(6)]
)
def test_any_profile(draw, seed):
    """Random profiles with knots anywhere, channels, still layers, layers of a hair's breadth: as the exact solver."""
    rng = np.random.default_rng(1000 + seed)
    depth, speed, source, _ = draw(rng)
    here, family = between_boundaries(depth, speed), list(FAMILIES)[seed % 5]
    low = rng.uniform(0, 0.9) * here.water_depth
    held = table(here, family, (source, source), (low, here.water_depth), 120.0)
    z, ranges = anywhere(low, here.water_depth, 120, 300, seed)
    assert_agree(held, source, z, ranges)


def test_slopes_are_those_of_the_delay_itself():
    """Slowness and both angles are derivatives of what the table states of the delay, as Fermat has it."""
    held = table(water("thermo20"), "S", sources=(10.5, 11.5))
    depth, ranges = anywhere(0.5, 19.5, 195, 500, seed=6)
    ranges = np.maximum(ranges, 1.0)
    step = 1e-4

    def delay(source, z, away):
        rays, _, _ = held.rays(source, z, away)
        return rays[:, 0, DELAY]

    plane = held.plane_at(11.1)
    used = np.flatnonzero(plane.specification.grid.find(plane.path_count, depth, ranges).paths == 1)
    depth, ranges = depth[used], ranges[used]
    ray = held.rays(11.1, depth, ranges)[0][:, 0]
    speed, source_speed = np.interp(depth, *NAMED["thermo20"]), np.interp(11.1, *NAMED["thermo20"])
    along = (delay(11.1, depth, ranges + step) - delay(11.1, depth, ranges - step)) / (2 * step)
    down = (delay(11.1, depth + step, ranges) - delay(11.1, depth - step, ranges)) / (2 * step)
    source = (delay(11.1 + step, depth, ranges) - delay(11.1 - step, depth, ranges)) / (2 * step)
    assert used.size > 400
    # 1e-16 s over 1e-4 m: six digits of a slope
    np.testing.assert_allclose(ray[:, SLOWNESS], along, atol=1e-10)
    np.testing.assert_allclose(ray[:, SIN_ARRIVAL], speed * down, atol=1e-6)
    np.testing.assert_allclose(ray[:, SIN_LAUNCH], -source_speed * source, atol=1e-6)


@pytest.mark.parametrize("family", FAMILIES)
def test_the_delay_solves_the_eikonal_equation(family):
    """(dT/dR)^2 + (dT/dz)^2 = 1 / c^2 at the point, and the same at the source: no solver is requested."""
    held = table(water("thermo20"), family, sources=(10.5, 11.5))
    depth, ranges = anywhere(0, 20, 200, 2000, seed=8)
    rays, count, _ = held.rays(11.2, depth, ranges)
    ray, z = rays[count == 1, 0], depth[count == 1]
    for sine, speed in (
        (SIN_ARRIVAL, np.interp(z, *NAMED["thermo20"])),
        (SIN_LAUNCH, np.interp(11.2, *NAMED["thermo20"])),
    ):
        np.testing.assert_allclose(ray[:, sine] ** 2 + (ray[:, SLOWNESS] * speed) ** 2, 1, atol=1e-5)


@pytest.mark.validate
@pytest.mark.parametrize("seed", range(300))
def test_many_profiles(seed):
    """As `test_any_profile`, of 300 more, for a sonar that heaves by half a metre."""
    rng = np.random.default_rng(5000 + seed)
    depth, speed, source, _ = (nasty_column if seed % 3 == 0 else random_column)(rng)
    here, family = between_boundaries(depth, speed), list(FAMILIES)[seed % 5]
    low, deepest = rng.uniform(0, 0.9) * here.water_depth, here.water_depth
    sources = (max(0.0, source - 0.25), min(deepest, source + 0.25))
    held = table(here, family, sources, (low, deepest), 120.0)
    for place in rng.uniform(*sources, 2):
        assert_agree(held, place, *anywhere(low, deepest, 120, 300, seed))


def test_what_the_table_was_not_made_for_is_solved_for():
    """Points beyond it and sources beside it cost time, not accuracy."""
    held = table(water("thermo20"), "D", sources=(10.8, 11.2), points=(10.0, 20.0), farthest=100.0)
    depth, ranges = np.array([20.0, 5.0, 15.0]), np.array([150.0, 60.0, 99.0])
    assert_agree(held, 11.0, depth, ranges)
    assert_agree(held, 12.0, depth, ranges)
    with pytest.raises(ValueError, match="span the whole track"):
        held.plane_at(12.0)


def test_no_path_is_distinguished_from_no_table():
    """In the shadow beyond 162 m the table itself states that there is none, and why."""
    held = table(water("thermo20"), "D", points=(20.0, 20.0))
    ranges = np.array([150.0, 161.0, 170.0, 195.0])
    rays, count, status = held.rays(11.0, np.full(4, 20.0), ranges)
    plane = held.plane_at(11.0)
    np.testing.assert_array_equal(count, [1, 1, 0, 0])
    np.testing.assert_array_equal(
        plane.specification.grid.find(plane.path_count, np.full(4, 20.0), ranges).paths == EXACT, False
    )
    assert status[0] == 0 and np.all(status[2:] > 0)
    assert rays.shape == (4, 1, COLUMNS)


def test_a_wrong_table_is_refused_with_an_error():
    """One part in 1e7 of the delay is 1e-8 s: the sample names the worst place and its error."""
    held = table(water("down20"), "S")
    wrong = dataclasses.replace(held.planes[0], nodes=held.planes[0].nodes * (1 + 2e-7))
    with pytest.raises(TableError, match=r"the table of S from 11.000 m to .* is wrong by .* s and .* dB"):
        check_sample(EigenrayTable("S", held.specification, (wrong,), ()))


def test_the_same_table_twice_is_the_same():
    """No bit depends on the run."""
    first, second = (table(water("thermo20"), "B", sources=(10.8, 11.2), points=(18.0, 20.0)) for _ in range(2))
    depth, ranges = anywhere(18, 20, 200, 300)
    np.testing.assert_array_equal(first.rays(11.1, depth, ranges)[0][:, 0], second.rays(11.1, depth, ranges)[0][:, 0])


def test_eigenrays_from_tables_are_the_same_record():
    """method="table" finds the same rows as method="exact"."""
    profile = SoundSpeedProfile(*NAMED["thermo20"])
    draw = np.random.default_rng(7)
    arguments = dict(
        water_depth=20, source_depth=11, point_depth=draw.uniform(14, 20, 60), range=draw.uniform(2, 190, 60)
    )
    slow, fast = eigenrays(profile, **arguments), eigenrays(profile, **arguments, method="table")
    for name in ("point", "family", "branch", "status", "caustics", "turning_points"):
        np.testing.assert_array_equal(getattr(slow, name), getattr(fast, name), name)
    np.testing.assert_allclose(fast.delay, slow.delay, atol=1e-9)
    np.testing.assert_allclose(fast.amplitude, slow.amplitude, rtol=MAX_AMPLITUDE_ERROR)
    np.testing.assert_allclose(fast.launch_angle, slow.launch_angle, atol=1e-4)


@pytest.mark.parametrize(("wrong", "words"), [
    ({"sources": (12.0, 11.0)}, "source_depths is 12 to 11 m"),
    ({"points": (0.0, 21.0)}, "seabed at 20 m"),
    ({"farthest": 0.0}, "max_range is 0 m"),
    ({"farthest": float("nan")}, "max_range is nan m"),
])  # fmt: skip
def test_impossible_spans_are_refused(wrong, words):
    """Spans that are upside down or leave the water, with the fix."""
    with pytest.raises(ValueError, match=words):
        table(water("iso20"), "D", **wrong)
