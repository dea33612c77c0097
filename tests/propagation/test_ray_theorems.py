"""What holds of rays in any layered water, whatever the solver: Snell, reciprocity, energy, Fermat, symmetry."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.ocean import SoundSpeedProfile
from insonify.propagation import eigenrays
from oracles.columns import DEPTH, NAMED, SOURCE, random_column, random_distance
from oracles.layered import FAMILIES
from oracles.water import fold

COLUMNS = ("point", "family", "delay", "amplitude", "path_length", "caustics", "turning_points")
seeds = st.integers(0, 2**32 - 1)
SIDES = {"D": "D", "S": "B", "B": "S", "SB": "BS", "BS": "SB", "SBS": "BSB", "BSB": "SBS"}


def profile(depth, speed):
    """Straight lines between knots."""
    return SoundSpeedProfile(np.asarray(depth, float), np.asarray(speed, float))


def drawn(seed):
    """A random column with its source, point and three distances."""
    rng = np.random.default_rng(seed)
    depth, speed, source, point = random_column(rng)
    return depth, speed, source, point, np.sort([random_distance(rng) for _ in range(3)])


def rows(depth, speed, source, point, distance, families=FAMILIES):
    """The solver's rows that are paths, as a dictionary of columns."""
    found = eigenrays(
        profile(depth, speed), water_depth=float(depth[-1]), source_depth=source, point_depth=point, range=distance,
        families=families,
    )  # fmt: skip
    there = found.status == "ok"
    columns = {name: getattr(found, name)[there] for name in COLUMNS}
    return columns | {"launch": found.launch_angle[there], "arrival": found.arrival_angle[there]}


@settings(max_examples=60)
@given(seeds)
def test_snells_invariant_is_the_same_at_both_ends(seed):
    """cos(elevation) / sound speed does not change along a ray, but for the rounding of the angles."""
    depth, speed, source, point, distance = drawn(seed)
    found = rows(depth, speed, source, point, distance)
    here, there = (float(profile(depth, speed).at(z)) for z in (source, point))
    np.testing.assert_allclose(np.cos(found["launch"]) / here, np.cos(found["arrival"]) / there, rtol=1e-13, atol=3e-17)


@settings(max_examples=60)
@given(seeds)
def test_reciprocity(seed):
    """From point to source the same way back: same delay, length, caustics and pressure; what was launch is arrival."""
    depth, speed, source, point, distance = drawn(seed)
    for family in FAMILIES:
        there = rows(depth, speed, source, point, distance, [family])
        back = rows(depth, speed, point, source, distance, [family[::-1]])
        if there["delay"].size != back["delay"].size or np.bincount(there["point"], minlength=1).max(initial=0) >= 8:
            crowded = np.bincount(there["point"], minlength=1).max(initial=0)
            assert crowded >= 8 or _at_an_edge(there, back)
            continue
        order, turned = np.lexsort((there["delay"], there["point"])), np.lexsort((back["delay"], back["point"]))
        for name, rtol in (("delay", 1e-12), ("path_length", 1e-10)):
            np.testing.assert_allclose(there[name][order], back[name][turned], rtol=rtol)
        for name in ("caustics", "turning_points"):
            np.testing.assert_array_equal(np.sort(there[name]), np.sort(back[name]))
        np.testing.assert_allclose(np.sort(there["launch"]), np.sort(-back["arrival"]), rtol=0, atol=1e-8)
        tame = there["amplitude"][order] < 0.3 * np.sqrt(1 / distance[there["point"][order]])  # not beside a fold
        ratio = there["amplitude"][order] / back["amplitude"][turned]
        np.testing.assert_allclose(ratio[tame], 1, rtol=1e-4)


def _at_an_edge(there, back):
    """Whether a ray that only one direction knows stands at the end of its branch, or beside a fold."""
    few, many = sorted((there, back), key=lambda found: found["delay"].size)
    left = [i for i, delay in enumerate(many["delay"]) if np.abs(few["delay"] - delay).min(initial=1) > 1e-9]
    return all(min(abs(many["launch"][i]), abs(many["arrival"][i])) < 1e-6 or many["amplitude"][i] > 1 for i in left)


def cuts(family, water):
    """Ranges between which one family of a named column is a single smooth branch, and the point's depth."""
    spans = {"thermo20": {"D": (70.0, 155.0), "B": (60.0, 140.0)}, "caustic20": {"D": (20.0, 180.0)}}
    return spans.get(water, {}).get(family, (20.0, 200.0))


@pytest.mark.parametrize("water", ["down20", "thermo20", "winter20", "fresh20"])
@pytest.mark.parametrize("family", ["D", "S", "B", "SB", "BS"])
def test_energy_stays_in_its_ray_tube(water, family):
    """Intensity through a ring of a level plane, A^2 |sin| / c over its area, is what left between two launch angles.

    Per unit of azimuth: integral of A^2 |sin(arrival)| R / c_r dR = difference of sin(launch) / c_0 (Gauss-Legendre,
    120 points).
    """
    depth, speed = NAMED[water]
    near, far = cuts(family, water)
    nodes, weights = np.polynomial.legendre.leggauss(120)
    reach = np.concatenate([[near], (near + far) / 2 + (far - near) / 2 * nodes, [far]])
    found = rows(depth, speed, SOURCE, 19.0, reach, [family])
    assert found["point"].size == reach.size, "one ray to each range"
    c0, cr = (float(profile(depth, speed).at(z)) for z in (SOURCE, 19.0))
    flow = found["amplitude"] ** 2 * np.abs(np.sin(found["arrival"])) * reach / cr
    received = (far - near) / 2 * np.sum(weights * flow[1:-1])
    sent = abs(np.sin(found["launch"][-1]) - np.sin(found["launch"][0])) / c0
    assert received == pytest.approx(sent, rel=1e-6)


@settings(max_examples=40)
@given(seeds)
def test_delay_grows_along_the_ray(seed):
    """Fermat: its slope over range is cos / c, over depth sin / c, of the arriving ray; differences over 0.2 mm."""
    depth, speed, source, point, distance = drawn(seed)
    knots = np.abs(np.asarray(depth) - point).min()
    step = 1e-4
    there = float(profile(depth, speed).at(point))
    for family in ("D", "S", "BS"):
        here = rows(depth, speed, source, point, distance[:1], [family])
        sides = [rows(depth, speed, source, point, distance[:1] + sign * step, [family]) for sign in (1, -1)]
        if here["delay"].size == 1 and all(side["delay"].size == 1 for side in sides):
            slope = (sides[0]["delay"] - sides[1]["delay"]) / (2 * step)
            assert slope == pytest.approx(np.cos(here["arrival"]) / there, rel=1e-7)
        if knots < 2 * step:
            continue
        sides = [rows(depth, speed, source, point + sign * step, distance[:1], [family]) for sign in (1, -1)]
        if here["delay"].size == 1 and all(side["delay"].size == 1 for side in sides):
            slope = (sides[0]["delay"] - sides[1]["delay"]) / (2 * step)
            assert slope == pytest.approx(np.sin(here["arrival"]) / there, abs=1e-7 / there)


@settings(max_examples=60)
@given(seeds)
def test_turned_upside_down_the_surface_is_the_bed(seed):
    """Up is down: S and B change places, angles their sign, nothing else."""
    depth, speed, source, point, distance = drawn(seed)
    water = depth[-1]
    for family, other in SIDES.items():
        here = rows(depth, speed, source, point, distance, [family])
        over = rows(water - depth[::-1], speed[::-1], water - source, water - point, distance, [other])
        if here["delay"].size != over["delay"].size:
            assert _at_an_edge(here, over)
            continue
        for name, rtol in (("delay", 1e-12), ("path_length", 1e-9)):
            np.testing.assert_allclose(np.sort(here[name]), np.sort(over[name]), rtol=rtol)
        np.testing.assert_allclose(np.sort(here["launch"]), np.sort(-over["launch"]), rtol=0, atol=1e-7)


@settings(max_examples=40)
@given(seeds, st.floats(0.1, 10))
def test_a_larger_sea_takes_as_much_longer(seed, size):
    """All lengths grown by one factor: delays and lengths grow by it, angles stay, pressure falls by it."""
    depth, speed, source, point, distance = drawn(seed)
    here = rows(depth, speed, source, point, distance)
    large = rows(depth * size, speed, source * size, point * size, distance * size)
    if here["delay"].size != large["delay"].size:
        assert _at_an_edge(here, large)
        return
    np.testing.assert_allclose(large["delay"], here["delay"] * size, rtol=1e-12)
    np.testing.assert_allclose(large["path_length"], here["path_length"] * size, rtol=1e-9)
    np.testing.assert_allclose(large["launch"], here["launch"], rtol=0, atol=1e-7)


@settings(max_examples=40)
@given(seeds)
def test_a_knot_on_a_straight_line_changes_nothing(seed):
    """What is one layer may be written as two."""
    depth, speed, source, point, distance = drawn(seed)
    more = np.sort(np.append(depth, (depth[0] + 2 * depth[1]) / 3))
    here = rows(depth, speed, source, point, distance)
    cut = rows(more, profile(depth, speed).at(more), source, point, distance)
    if here["delay"].size != cut["delay"].size:
        assert _at_an_edge(here, cut)
        return
    np.testing.assert_allclose(cut["delay"], here["delay"], rtol=1e-12)
    np.testing.assert_allclose(cut["launch"], here["launch"], rtol=0, atol=1e-7)


@settings(max_examples=60)
@given(st.floats(0.01, 19.99), st.floats(0.01, 19.99), st.floats(0.1, 1e3), st.floats(1400, 1600))
def test_sound_of_one_speed_runs_straight_to_every_image(source, point, distance, speed):
    """One ray of each family, as long as the folded line: delay to 1e-12 s, pressure 1 / length."""
    found = rows([0.0, 7.0, 20.0], [speed] * 3, source, point, distance)
    assert found["family"].tolist() == list(FAMILIES)
    length = np.array([fold((0, 0, source), (distance, 0, point), family, 20.0).length for family in FAMILIES])
    np.testing.assert_allclose(found["delay"], length / speed, rtol=0, atol=1e-12)
    np.testing.assert_allclose(found["path_length"], length, rtol=1e-9)
    np.testing.assert_allclose(found["amplitude"], 1 / length, rtol=1e-6)


@settings(max_examples=80)
@given(
    st.floats(0.1, 19.9), st.floats(0.1, 19.9), st.floats(0.1, 150), st.floats(-6, 0.7).map(lambda x: 10**x),
    st.booleans(),
)  # fmt: skip
def test_in_one_gradient_the_direct_ray_is_an_arc_of_a_circle(source, point, distance, size, falls):
    """T = 2 / |g| asinh(|g| d / (2 sqrt(c1 c2))), turning or not, to 1e-12 s, where the arc stays in the water."""
    gradient = -size if falls else size
    speed = np.array([1500.0, 1500.0 + 20 * gradient])
    c1, c2 = (1500 + gradient * z for z in (source, point))
    # the circle's centre lies where sound would stand still, half way between the ends as the chord has it
    centre = (distance**2 + (point - source) * (c1 + c2) / gradient) / (2 * distance)
    deepest = np.hypot(centre, c1 / gradient) - abs(1500.0 / gradient)
    turn = deepest if gradient > 0 else -deepest
    if 0 < centre < distance and not 1e-3 < turn < DEPTH - 1e-3:
        return
    found = rows([0.0, DEPTH], speed, source, point, distance, ["D"])
    straight = np.hypot(distance, point - source)
    closed = 2 / size * np.arcsinh(size * straight / (2 * np.sqrt(c1 * c2)))
    assert found["delay"].size == 1
    assert found["delay"][0] == pytest.approx(closed, abs=1e-12)
