"""Radials cover what is received exactly once, for any beam, heading and floor."""

from dataclasses import replace

import numpy as np
import pytest

from insonify.engines.polar_grid import MAX_CELL_WIDTH
from insonify.engines.radials import (
    LOW_GAIN,
    SIDE_LOBE,
    ViewedBoundary,
    bearing_gain_bound,
    radial_gain_bound,
    radials_in_view,
)
from insonify.engines.resolution import Resolution, two_way_gain_bound
from insonify.propagation.families import image_depth
from insonify.propagation.propagation_model import ReachableRange
from insonify.simulator import build_simulator
from oracles.scenes import nominal

DEPTH, HEIGHT = 20.0, 9.0
RECEIVED = ReachableRange(HEIGHT, 20.0, 150.0)
RESOLUTION = Resolution(0.12, 0.0076, 4.0)


@pytest.fixture(scope="module")
def simulator():
    """The nominal sonar, 11 m deep over 20 m of water, that looks east."""
    return build_simulator(nominal(paths={"max_reflections": 0}))


def lines(simulator, floor=0.0, heading=0.0, received=RECEIVED, resolution=RESOLUTION, families=("D",)):
    """Lines of the seabed of the nominal sonar."""
    return radials_in_view(
        simulator.ping_geometry(0), ViewedBoundary(DEPTH, families), received, resolution, floor, heading
    )


def area(found):
    """Of the sectors of a ring that lines represent [m^2]."""
    return np.sum(found[:, 2] / 2 * (found[:, 5] ** 2 - found[:, 4] ** 2))


def width_at(found, distance):
    """Bearings that lines cover at one distance, added up [rad]."""
    return found[(found[:, 4] <= distance) & (distance < found[:, 5]), 2].sum()


@pytest.mark.parametrize(
    "received", [RECEIVED, ReachableRange(HEIGHT, 90.0, 91.0), ReachableRange(HEIGHT, 12.0, 500.0)]
)
def test_without_a_floor_the_whole_ring_is_covered_once(simulator, received):
    """Sectors add up to the annulus, and at any distance to the whole circle."""
    found = lines(simulator, received=received)
    assert area(found) == pytest.approx(np.pi * (received.farthest**2 - received.nearest**2), rel=1e-9)
    for distance in np.linspace(received.nearest, received.farthest, 9)[1:-1]:
        assert width_at(found, distance) == pytest.approx(2 * np.pi, rel=1e-9)


def test_below_the_sonar_too_the_ring_is_covered_once(simulator):
    """Down to the point under the sonar, where lines represent ever more cells: the whole circle at any distance."""
    found = lines(simulator, received=ReachableRange(HEIGHT, 0.0, 30.0))
    covered = [width_at(found, distance) for distance in np.geomspace(0.1, 29, 30)]
    np.testing.assert_allclose(covered, 2 * np.pi, rtol=1e-9)


@pytest.mark.parametrize(("height", "tilt_deg", "distance"), [(0.12, 60.0, 5.2), (0.12, 40.0, 10.7), (0.08, 45.0, 9.0)])
def test_a_narrow_beam_that_looks_down_reaches_each_position_once(height, tilt_deg, distance):
    """Tall panels, tilted: where their axis reaches the seabed, 9 m below, no bearing has two lines."""
    panel = {"kind": "planar", "width": 0.3, "height": height}
    mounting = {"tilt": float(np.radians(tilt_deg))}
    scenario = nominal(paths={"max_reflections": 0}, sonar={"mounting": mounting, "transmit": panel, "receive": panel})
    found = lines(build_simulator(scenario), 1e-3, received=ReachableRange(HEIGHT, 0.0, 60.0))
    there = (found[:, 4] <= distance) & (distance < found[:, 5])
    bearing = np.pi / 2 + np.linspace(-0.5, 0.5, 4001) + 1e-5
    off = np.angle(np.exp(1j * (bearing[:, None] - np.arctan2(found[there, 1], found[there, 0]))))
    assert np.sum(np.abs(off) <= found[there, 2] / 2, axis=1).max() == 1


@pytest.mark.parametrize("floor", [1e-3, 1e-2, 0.3])
def test_lines_do_not_overlap(simulator, floor):
    """At any distance the sectors, concurrently, are disjoint."""
    found = lines(simulator, floor)
    middle = np.arctan2(found[:, 1], found[:, 0])
    for distance in (21.0, 47.0, 74.0, 76.0, 149.0):
        there = (found[:, 4] <= distance) & (distance < found[:, 5])
        # the beam looks east, at pi / 2, and the seam of the bearings lies behind it
        order = np.argsort(np.mod(middle[there] - np.pi / 2 + np.pi, 2 * np.pi))
        bearing = np.mod(middle[there] - np.pi / 2 + np.pi, 2 * np.pi)[order]
        width = found[there, 2][order]
        assert np.all(np.diff(bearing) >= (width[1:] + width[:-1]) / 2 - 1e-9)


def test_a_lower_floor_only_adds(simulator):
    """Area and width at any distance grow as the floor falls, up to all there is."""
    areas = [area(lines(simulator, floor)) for floor in (0.5, 0.1, 1e-2, 1e-3, 0.0)]
    assert np.all(np.diff(areas) >= 0) and areas[0] < 0.05 * areas[-1]
    for distance in (30.0, 100.0):
        widths = [width_at(lines(simulator, floor), distance) for floor in (0.5, 0.1, 1e-2, 1e-3, 0.0)]
        assert np.all(np.diff(widths) >= -1e-12)


@pytest.mark.parametrize("floor", [1e-2, 0.2])
def test_what_no_line_covers_is_below_the_floor(simulator, floor):
    """3000 positions in the ring: where the two-way gain exceeds the floor there is a radial; gains by other code."""
    rng = np.random.default_rng(5)
    here, found = simulator.ping_geometry(0), lines(simulator, floor)
    distance = rng.uniform(21, 149, 3000)
    bearing = np.pi / 2 + rng.normal(0, 0.03, 3000)
    place = here.transmit_position[:2] + distance[:, None] * np.stack([np.cos(bearing), np.sin(bearing)], axis=-1)
    way = np.column_stack([place - here.transmit_position[:2], np.full(3000, HEIGHT)])
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    gain = np.abs(here.transmit_beams.gain(way)[0] * here.receive_beams.gain(way)[0])
    off = np.angle(np.exp(1j * (bearing[:, None] - np.arctan2(found[:, 1], found[:, 0]))))
    within = (np.abs(off) <= found[:, 2] / 2 + 1e-9) & (distance[:, None] >= found[:, 4])
    covered = (within & (distance[:, None] <= found[:, 5])).any(axis=1)
    assert np.all(covered[gain >= floor]) and np.mean(gain >= floor) > 0.02
    assert not covered.all()
    # and the bound by which tiles are chosen agrees that nothing strong was left out
    bound = two_way_gain_bound(place, np.zeros(3000), here, DEPTH, simulator.engine.rays, ("D",))
    assert bound[~covered].max() < floor * (1 + 1e-6)


@pytest.mark.parametrize("farthest", [5.0, 12.0])
def test_no_line_leaves_out_relief_that_beams_reach(farthest, rise=3.0, floor=3e-3):
    """A low panel's side lobes, 3000 positions up to 3 m off the mean plane: a radial where gain exceeds the floor."""
    rng, panel = np.random.default_rng(5), {"kind": "planar", "width": 0.3, "height": 0.06}
    sonar = {"transmit": panel, "receive": panel}
    here = build_simulator(nominal(paths={"max_reflections": 0}, sonar=sonar)).ping_geometry(0)
    found = radials_in_view(
        here, ViewedBoundary(DEPTH, ("D",), rise), ReachableRange(HEIGHT, 0, farthest), RESOLUTION, floor, 0.0
    )
    distance, bearing, height = rng.uniform([[1], [-0.3], [-rise]], [[farthest], [0.3], [rise]], (3, 3000))
    way = np.column_stack([distance * -np.sin(bearing), distance * np.cos(bearing), HEIGHT + height])
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    gain = np.abs(here.transmit_beams.gain(way)[0] * here.receive_beams.gain(way)[0])
    off = np.angle(np.exp(1j * (np.arctan2(way[:, 1], way[:, 0])[:, None] - np.arctan2(found[:, 1], found[:, 0]))))
    within = (np.abs(off) <= found[:, 2] / 2 + 1e-9) & (distance[:, None] >= found[:, 4])
    covered = (within & (distance[:, None] <= found[:, 5])).any(axis=1)
    assert np.all(covered[gain >= floor]) and not covered.all()


@pytest.mark.parametrize(("families", "floor", "height"), [(("D",), 1e-3, 0.3), (("D", "S", "BS"), 1e-4, 0.05)])
def test_every_radial_is_as_wide_as_the_bound_of_the_gain_in_its_patch_allows(families, floor, height):
    """Patch by patch: divided where the bound is not low, kept where it reaches the floor, merged where seabed is near.

    Transmitter and receiver differ, so that both bounds count.
    """
    ends = [{"kind": "planar", "width": width, "height": height} for width in (0.3, 0.2)]
    sonar = {"transmit": ends[0], "receive": ends[1]}
    here = build_simulator(nominal(paths={"max_reflections": 0}, sonar=sonar)).ping_geometry(0)
    verticals = np.array([DEPTH - image_depth(name, 11.0, DEPTH) for name in families])
    odd = np.array([name == "S" for name in families])
    cells = 128 * int(np.ceil(2 * np.pi / (RESOLUTION.beam_width / 2) / 128))
    angle, axis = 2 * np.pi / cells, np.arctan2(here.boresight[1], here.boresight[0])

    def bound(first, count, zone):
        bearing = axis + (first + count / 2) * angle
        return radial_gain_bound(here, np.array([bearing]), count * angle, zone, verticals, odd)[0]

    def patches(first, count, zone, merged, low):
        if count > merged and bound(first, count, zone) >= low:
            finer = max(4, merged) if count > max(4, merged) else merged
            return [x for part in range(first, first + count, finer) for x in patches(part, finer, zone, merged, low)]
        return [(first, count, *zone)] if count < 4 or bound(first, count, zone) >= floor else []

    sectors, expected, outer = range(-cells // 2, cells // 2, 128), [], 150.0
    for merged in (1, 1, 1, 1, 1, 2, 2, 4, 8, 16):  # at 150 m, half of it, and so on, up to 0.3 m, 9 m above
        zone = (outer / 2 if merged < 16 else 0.0), outer
        low = LOW_GAIN * min(max(bound(sector, 128, zone) for sector in sectors) / SIDE_LOBE, 1.0)
        widest = max(16, merged)
        kept = [part for k in sectors if bound(k, 128, zone) >= floor for part in range(k, k + 128, widest)]
        expected += [patch for k in kept for patch in patches(k, widest, zone, merged, low)]
        outer /= 2
    received = ReachableRange(HEIGHT, 0.0, 150.0)
    found = radials_in_view(here, ViewedBoundary(DEPTH, families), received, RESOLUTION, floor, 0.0)
    area = sum(count * angle / 2 * (far**2 - near**2) for _, count, near, far in expected)
    assert np.sum(found[:, 2] / 2 * (found[:, 5] ** 2 - found[:, 4] ** 2)) == pytest.approx(area, rel=1e-9)
    count = np.rint(found[:, 2] / angle).astype(int)
    turn = np.arctan2(found[:, 1], found[:, 0]) - axis
    first = np.rint(np.angle(np.exp(1j * turn)) / angle - count / 2).astype(int)
    radials = set(zip(first.tolist(), count.tolist(), found[:, 4].tolist(), found[:, 5].tolist(), strict=True))
    assert len(radials) == len(found) > 30
    for first, count, near, far in expected:  # a radial may go on through several zones
        assert any(r[:2] == (first, count) and r[2] <= near and r[3] >= far for r in radials)


def test_no_high_gain_line_is_wider_than_a_cell(simulator):
    """Away from the sonar and from the beam's outskirts, where the seabed is broad, each cell has its own line."""
    cell = min(RESOLUTION.beam_width, MAX_CELL_WIDTH) / np.sqrt(RESOLUTION.scatterers_per_cell)
    found = lines(simulator)
    alone = (found[:, 3] == 0) & (found[:, 4] > HEIGHT)
    assert alone.any() and found[alone, 2].max() <= cell * (1 + 1e-9)
    here = simulator.ping_geometry(0)
    for distance in (60.0, 140.0):
        way = np.array([[0.0, distance, HEIGHT]]) / np.hypot(distance, HEIGHT)
        assert np.abs(here.transmit_beams.gain(way)[0] * here.receive_beams.gain(way)[0]) > LOW_GAIN
        ahead = np.abs(np.angle(np.exp(1j * (np.arctan2(found[:, 1], found[:, 0]) - np.pi / 2)))) <= found[:, 2] / 2
        over = ahead & (found[:, 4] <= distance) & (distance < found[:, 5])
        assert over.any() and np.all(found[over, 3] == 0)


def test_finer_cells_are_more_lines(simulator):
    """Four times the points to a cell: radials half as wide at high gain, about twice as many, on the same ground."""
    coarse, fine = (lines(simulator, 1e-3, resolution=Resolution(0.12, 0.0076, n)) for n in (4.0, 16.0))
    strong = [found[(found[:, 3] == 0) & (found[:, 5] > 40)] for found in (coarse, fine)]
    assert strong[1][:, 2].max() == pytest.approx(strong[0][:, 2].max() / 2, rel=0.05)
    assert len(strong[1]) == pytest.approx(2 * len(strong[0]), rel=0.15)


@pytest.mark.parametrize("heading", [0.4, -2.0, np.pi])
def test_a_frame_turned_is_the_same_lines_turned(simulator, heading):
    """Only the direction cosines change, by the heading."""
    plain, turned = lines(simulator, 1e-3), lines(simulator, 1e-3, heading)
    c, s = np.cos(heading), np.sin(heading)
    np.testing.assert_allclose(turned[:, 0], c * plain[:, 0] + s * plain[:, 1], atol=1e-12)
    np.testing.assert_allclose(turned[:, 1], c * plain[:, 1] - s * plain[:, 0], atol=1e-12)
    np.testing.assert_array_equal(turned[:, 2:], plain[:, 2:])


def test_what_is_requested_again_is_the_same_whatever_was_requested_between(simulator):
    """Lines are remembered for the pings to come: twelve other questions later, the same numbers."""
    first = lines(simulator, 1e-2).copy()
    for heading in np.linspace(0.1, 3, 12):
        lines(simulator, 1e-2, float(heading))
    np.testing.assert_array_equal(lines(simulator, 1e-2), first)


def test_more_families_take_in_no_less(simulator):
    """The range of any family is covered: with surface bounces the seabed covered cannot shrink."""
    direct, both = (area(lines(simulator, 1e-2, families=families)) for families in (("D",), ("D", "S")))
    assert both >= direct * (1 - 1e-12)


def test_samples_are_staggered_evenly(simulator):
    """Shifts of the lines are multiples of the golden ratio: any 34 in a row leave no gap wider than 2 / 34."""
    found = lines(simulator)
    np.testing.assert_array_equal(found[:, 7], np.arange(len(found)))
    assert np.all((found[:, 6] > 0) & (found[:, 6] <= 1)) and len(found) > 100
    for start in (0, 17, 60):
        shift = np.sort(found[start : start + 34, 6])
        assert np.diff(np.append(shift, shift[0] + 1)).max() < 2 / 34


def test_an_empty_range_has_no_radial(simulator):
    """A window that closes before the first echo, and a floor above the largest gain beam."""
    assert lines(simulator, received=ReachableRange(HEIGHT, 0.0, -1.0)).shape == (0, 9)
    assert lines(simulator, floor=1.5).shape == (0, 9)


@pytest.mark.parametrize(("family", "climb", "up"), [("D", 9.0, 1), ("S", 31.0, -1), ("BS", 49.0, 1)])
@pytest.mark.parametrize("zone", [(20.0, 40.0), (40.0, 200.0)])
def test_the_gain_in_a_patch_is_at_most_its_bound(simulator, zone, family, climb, up):
    """4000 positions in 64 patches of 0.02 rad about the beam: two-way gains by another program stay below the bound.

    Nor is the bound far off: its strongest patch is at most 1.5 times as strong as the position of largest gain.
    """
    here, rng = simulator.ping_geometry(0), np.random.default_rng(9)
    gain_bound = bearing_gain_bound(here, DEPTH, (family,))
    middle = np.pi / 2 + 0.02 * (np.arange(64) - 31.5)
    expected = gain_bound(middle, 0.02, zone)
    patch = rng.integers(0, 64, 4000)
    bearing, distance = middle[patch] + rng.uniform(-0.01, 0.01, 4000), rng.uniform(*zone, 4000)
    way = np.column_stack([distance * np.cos(bearing), distance * np.sin(bearing), np.full(4000, up * climb)])
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    gain = np.abs(here.transmit_beams.gain(way)[0] * here.receive_beams.gain(way)[0])
    assert np.all(gain <= expected[patch] * (1 + 1e-6) + 1e-9)
    assert expected.max() < 1.5 * gain.max()


def test_pings_of_one_depth_share_the_bound_and_others_do_not(simulator):
    """A sonar that moves ahead has the same bound, and merges the same slices; one that dives another."""
    here = simulator.ping_geometry(0)
    ahead, down = (
        replace(here, transmit_position=position, receive_position=position)
        for position in here.transmit_position + np.array([[3.0, 1.0, 0.0], [0.0, 0.0, 0.5]])
    )
    first, second, third = (bearing_gain_bound(one, DEPTH, ("D",)) for one in (here, ahead, down))
    assert second is first and third is not first
    bearing = np.linspace(1.4, 1.7, 40)
    bounds = [bound(bearing, 0.01, (10.0, 20.0)) for bound in (first, third)]
    assert not np.array_equal(*bounds)


def test_bistatic_parallax_widens_patches_and_wide_patches_have_no_bound(simulator):
    """Ends 2 m apart: at 20 m a patch is 0.2 rad wider for the other end, never less strong; near by nothing is given.

    Beyond half a radian, and of two platforms, there is no bound.
    """
    here = simulator.ping_geometry(0)
    apart = replace(here, receive_position=here.receive_position + np.array([2.0, 0.0, 0.0]))
    middle = np.pi / 2 + 0.05 * np.arange(-8, 9)
    alone, both = (bearing_gain_bound(one, DEPTH, ("D",)) for one in (here, apart))
    assert np.all(both(middle, 0.02, (20.0, 40.0)) >= alone(middle, 0.02, (20.0, 40.0)))
    assert np.all(np.isinf(both(middle, 0.02, (0.0, 20.0)))) and np.all(np.isinf(alone(middle, 0.6, (20.0, 40.0))))
    assert np.all(np.isfinite(alone(middle, 0.02, (0.0, 20.0))))
    assert bearing_gain_bound(replace(here, receive_track_extent=here.track_extent), DEPTH, ("D",)) is None
