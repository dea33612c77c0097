"""Weak pairs of paths are evaluated at few points of the seabed, and nothing that can be received is lost by it."""

import numpy as np
import pytest

from engines.test_fast_reverberation import SIDESCAN, made, quickly, thoroughly
from insonify.engines.arrived_energy import arrived_energy
from insonify.engines.fast_reverberation import _radial_legs_kernel as kernel
from insonify.engines.fast_reverberation import (
    _radial_samples_kernel,
    _radial_terrain_kernel,
    prepare_fast_reverberation,
    reverberation,
    reverberation_plan,
    sample_allocation,
)
from insonify.engines.fast_reverberation._line_of_sight_kernel import first_occluding_sample, running_horizon
from insonify.engines.fast_reverberation._sample_allocation_kernel import lengthen_steps, pair_keep_probabilities
from insonify.engines.fast_reverberation.reverberation_plan import bounce_tables
from insonify.engines.radial_tables import FamilyTable, IsovelocityChannel, MapTiles, RadialFrame
from insonify.propagation.families import image_depth
from insonify.recent_results import RecentResults
from insonify.scattering.compiled_law import CompiledLaw
from insonify.simulator import build_simulator

FLAT = {**SIDESCAN["seabed"], "relief": None}
PART = slice(350, 1200)


def forget():
    """Nothing is kept from the pings before."""
    reverberation._PREPARED = RecentResults(8)
    reverberation_plan._PLANS = RecentResults(8)


@pytest.fixture
def whole(monkeypatch):
    """Calls a function twice: with weak pairs sampled, and with every point of every pair."""

    def both(run):
        forget()
        sampled = run()
        with monkeypatch.context() as all_of_it:
            all_of_it.setattr(sample_allocation, "MIN_PROBABILITY_STEPS", sample_allocation.FULL_PROBABILITY)
            all_of_it.setattr(sample_allocation, "NEGLIGIBLE", 0.0)
            forget()
            full = run()
        forget()
        return sampled, full

    return both


def points(simulator):
    """Points that all pairs are evaluated at, in sum."""
    here = simulator.ping_geometry(0)
    ground = simulator.fast_reverberation(here)
    return sum(ground.accumulate(map, lambda swath: int(swath.count.sum())))


@pytest.mark.parametrize("order", [0, 2, 4])
def test_importance_sampling_does_not_bias_fractal_ground(whole, order):
    """Within 0.02 dB of all points in the mean; 2 ms within 0.06 dB rms and 0.2 dB, single samples within 0.3 dB rms.

    The points that are left are drawn, so what remains is noise: 0.03 dB rms over 8 pings, 0.044 over these two.
    """
    simulator = build_simulator(made(order))
    sampled, full = whole(lambda: np.concatenate([quickly(simulator, ping)[:, PART] for ping in (0, 1)]))
    runs = [x.reshape(2, -1, 50).mean(axis=2) for x in (sampled, full)]
    off = 10 * np.log10(runs[0] / runs[1])
    assert np.sqrt(np.mean(off**2)) < 0.06 and np.abs(off).max() < 0.2
    assert abs(10 * np.log10(sampled.mean() / full.mean())) < 0.02
    strong = full > 0.1 * np.repeat(runs[1], 50, axis=1)
    assert np.std(10 * np.log10(sampled / full)[strong]) < 0.3


@pytest.mark.parametrize("order", [0, 4])
def test_a_flat_bed_stays_smooth(whole, order):
    """Ripple from importance sampling on a flat bed: 0.1 dB rms, and never 0.5 dB."""
    simulator = build_simulator(made(order, seabed=FLAT))
    sampled, full = whole(lambda: quickly(simulator)[:, PART])
    ripple = 10 * np.log10(sampled / full)
    assert ripple.std() < 0.1 and np.abs(ripple).max() < 0.5 and abs(ripple.mean()) < 0.01


def test_many_bounces_request_few_more_points(whole):
    """25 pairs, 15 that differ, take less than four times the points of one, and less than a fifth of all there are."""
    direct, some = points(build_simulator(made(0))), build_simulator(made(4))
    sampled, full = whole(lambda: points(some))
    assert sampled < 4 * direct and full > 5 * sampled


def test_pairs_that_may_interfere_share_their_points():
    """A sonar just under the surface: wherever D-D and D-S arrive within a pulse they are evaluated at the same points.

    S-S is too, but for positions where it is not received at all.
    """
    track = {**SIDESCAN["track"], "start": [0.0, 0.0, 0.15]}
    simulator = build_simulator(made(1, track=track, seabed=FLAT))
    changes = {}

    def add(swath):
        for first, last in swath.interference_ranges:
            for k, rows in enumerate(swath.rows):
                there = rows[: swath.count[k]]
                changes.setdefault(k, []).append(there[(there >= first) & (there < last)])

    here, engine = simulator.ping_geometry(0), simulator.engine
    prepare_fast_reverberation(engine.scene, engine.path_settings, here, engine.rays).accumulate(map, add)
    direct, mixed, surface = (np.concatenate(changes[k]) for k in range(3))
    assert len(direct) > 1000
    np.testing.assert_array_equal(direct, mixed)
    assert np.isin(surface, direct).all() and len(surface) > 0.5 * len(direct)


def test_priorities_are_spread_evenly():
    """Along any radial, and across them at any sample, each keep probability keeps its part of 320 positions, +- 4."""
    turn = np.empty((320, 320), np.int32)
    for number in range(320):
        turn[number] = [_radial_samples_kernel.priority_of(float(number), k) for k in range(320)]
    for share in (1, 2, 5, 16, 31):
        taken = turn < share
        assert np.abs(taken.sum(axis=0) - 10 * share).max() <= 4
        assert np.abs(taken.sum(axis=1) - 10 * share).max() <= 4
    assert (turn < sample_allocation.FULL_PROBABILITY).all()


def test_lines_in_longer_steps_cover_the_same_ground():
    """Cut or not, each line still reaches from its start to its stop, and strong stretches keep the shortest step."""
    lines = np.zeros((3, 9))
    lines[:, 4], lines[:, 5], lines[:, 7], lines[:, 8] = 5.0, 100.0, np.arange(3), 1
    edges = np.linspace(0, 100, 21)
    share = np.full((3, 20, 1), 1, np.uint8)
    share[1, :8], share[2] = 32, 32
    made_of, row = np.empty((6, 9)), np.empty(6, np.int64)
    count = lengthen_steps(lines, edges, share, 32, 8, made_of, row)
    made_of, row = made_of[:count], row[:count]
    np.testing.assert_array_equal(row, [0, 1, 1, 2])
    np.testing.assert_array_equal(made_of[:, 4:6], [[5, 100], [5, 40], [40, 100], [5, 100]])
    np.testing.assert_array_equal(made_of[:, 8], [8, 1, 8, 1])


def test_every_piece_that_a_line_reads_is_requested():
    """200 lines at any angle, in steps of 1 to 8: the tiles under all their samples, one by one, are among those."""
    rng = np.random.default_rng(4)
    bearing, lines = rng.uniform(0, 2 * np.pi, 200), np.zeros((200, 9))
    bearing[:4] = np.arange(4) * np.pi / 2
    lines[:, 0], lines[:, 1], lines[:, 5] = np.cos(bearing), np.sin(bearing), rng.uniform(1, 60, 200)
    lines[:, 6], lines[:, 8] = rng.uniform(0.01, 1, 200), rng.choice([1, 2, 8], 200)
    samples = np.ceil(lines[:, 5] / 0.05 / lines[:, 8] - lines[:, 6]).astype(np.int64)
    crossed = np.zeros((41, 41), bool)
    _radial_terrain_kernel.mark_tiles(RadialFrame(63.3, 60.9, 0.0, 0.05), lines, samples, np.arange(200), 0.05, crossed)
    expected = set(map(tuple, np.argwhere(crossed).tolist()))
    for line, many in zip(lines, samples, strict=True):
        r = (np.arange(many) + line[6]) * 0.05 * line[8]
        cell = np.floor(np.stack([63.3 + r * line[0], 60.9 + r * line[1]], axis=-1) / 0.05)
        assert set(map(tuple, (cell // 64).astype(int).tolist())) <= expected


def test_ground_along_a_line_is_that_of_the_map():
    """Heights of a plane are exact, slopes those of the nearest node; across tiles, forwards and back."""
    slot, node = np.zeros((4, 4), np.uint32), np.arange(65)
    nodes = np.zeros((16, 65, 65, 3), np.float32)
    for row, (a, b) in enumerate((a, b) for a in range(-2, 2) for b in range(-2, 2)):
        slot[a + 2, b + 2] = row
        x, y = (a * 64 + node)[:, None], (b * 64 + node)[None, :]
        nodes[row, :, :, 0], nodes[row, :, :, 1], nodes[row, :, :, 2] = 0.01 * x - 0.03 * y, x + 0 * y, y + 0 * x
    where, depth, slope = np.empty(500, np.uint32), np.empty(500, np.float32), np.empty((2, 500), np.float32)
    frame, tiles = RadialFrame(65.3, 61.9, 0.0, 0.2), MapTiles(0.5, slot, nodes, False)
    for bearing in np.linspace(0, 2 * np.pi, 17):
        line = np.array([np.cos(bearing), np.sin(bearing), 0, 0, 0, 60.0, 0.37, 0, 1])
        _radial_terrain_kernel.sample_radial_terrain(frame, line, (0, 300), 0.0, tiles, where, depth, slope)
        x = (1.3 + (np.arange(300) + 0.37) * 0.2 * line[0]) / 0.5
        y = (-2.1 + (np.arange(300) + 0.37) * 0.2 * line[1]) / 0.5
        np.testing.assert_allclose(-depth[:300], 0.01 * x - 0.03 * y, atol=2e-5)
        assert np.abs(slope[0, :300] - x).max() <= 0.5 + 1e-4 and np.abs(slope[1, :300] - y).max() <= 0.5 + 1e-4


def test_a_law_of_two_factors_may_as_well_be_evaluated_pair_by_pair(monkeypatch):
    """Lambert's law as a part of each leg, or as a cross section of each pair: the same to a ten thousandth."""
    simulator = build_simulator(made(2))
    forget()
    in_legs = quickly(simulator)[0, PART]
    monkeypatch.setattr(CompiledLaw, "direction_factors", None)
    forget()
    np.testing.assert_allclose(quickly(simulator)[0, PART], in_legs, rtol=1e-4)
    forget()


def test_a_law_that_is_no_product_has_the_same_energy_by_both_paths():
    """Medium sand with its roughness and its inside, 9 pairs: within 0.05 dB of the general way."""
    sand = build_simulator(
        made(2, seabed={**SIDESCAN["seabed"], "scattering": {"law": "jackson", "sediment": "medium sand"}})
    )
    quick, general = quickly(sand)[0, PART], thoroughly(sand)[0, PART]
    assert abs(10 * np.log10(quick.mean() / general.mean())) < 0.05


def test_a_sonar_that_only_moves_on_keeps_its_plan():
    """Five pings of a level track: one plan; another depth: another plan, and the bits of the first come back."""
    simulator, deeper = (
        build_simulator(made(1)),
        build_simulator(made(1, track={**SIDESCAN["track"], "start": [0.0, 0.0, 4.1]})),
    )
    plans = [simulator.fast_reverberation(simulator.ping_geometry(ping)).plan for ping in range(5)]
    assert all(plan is plans[0] for plan in plans)
    assert deeper.fast_reverberation(deeper.ping_geometry(0)).plan is not plans[0]
    first = quickly(simulator)
    forget()
    np.testing.assert_array_equal(quickly(simulator), first)


def test_ground_behind_a_target_is_fully_sampled():
    """In a shadow only weak paths remain: radials that pass the box take every point of every pair received."""
    crate = {"shape": "box", "label": "crate", "position": [0.0, 20.0], "size": [4.0, 2.0, 1.5]}
    counts = [points(build_simulator(made(2, targets=targets))) for targets in ([crate], [])]
    assert counts[0] > 1.2 * counts[1]


def test_legs_are_straight_lines_from_the_image_source():
    """Delay, direction, spreading and absorption of 200 points of two radials against geometry; none behind a facet."""
    rng = np.random.default_rng(2)
    n, image, speed, loss = 200, -12.0, 1500.0, 0.01
    reach, depth = rng.uniform(1, 200, n), 20 + rng.normal(0, 0.1, n)
    slope = rng.normal(0, 0.5, (2, n)).astype(np.float32)
    north, east, down, area, x, y, z, ahead, aside, out, size, slant = np.empty((12, n), np.float32)
    turn = np.array([np.cos(0.71), np.sin(0.71)], np.float32)[:, None] * np.ones(n, np.float32)
    delay, bits = np.empty(n), np.full(n, 2, np.int32)
    bearing, width = np.repeat([0.7, 2.1], n // 2), np.repeat([0.02, 0.01], n // 2)
    c, s = np.cos(bearing), np.sin(bearing)
    facets = kernel.Facets(reach, slope[0], slope[1], north, east, down, area)
    kernel.facet_normals(facets, 1.0, 0.0, width)
    legs = kernel.FamilyLegs(delay, x, y, z, ahead, aside, out, size, slant)
    bearings = kernel.RadialBearings(c.astype(np.float32), s.astype(np.float32), turn[0], turn[1])
    kernel.straight_legs(facets, depth, kernel.FamilyImage(image, 1 / speed, loss, -1.0, 1), bearings, bits, legs)
    way = np.stack([reach * c, reach * s, depth - image])
    length = np.linalg.norm(way, axis=0)
    normal = -np.stack([slope[0], slope[1], np.ones(n)]) / np.sqrt(1 + (slope**2).sum(axis=0))
    np.testing.assert_allclose(delay, length / speed, rtol=1e-14)
    np.testing.assert_allclose(np.stack([x, y, z]), way / length, atol=3e-7)
    np.testing.assert_allclose(out, -z)
    np.testing.assert_allclose(np.stack([ahead, aside]), turn * (reach / length), atol=3e-7)
    np.testing.assert_allclose(np.stack([north, east, down]), normal, atol=3e-7)
    np.testing.assert_allclose(area, reach * width * np.sqrt(1 + (slope**2).sum(axis=0)), rtol=1e-6)
    sine = -np.sum(way / length * normal, axis=0)
    lit = sine > 1e-6
    np.testing.assert_allclose(size[lit], (2.0 ** (-loss * length) / length)[lit], rtol=5e-6)
    np.testing.assert_allclose(slant[lit], np.sqrt(1 - sine[lit]), atol=1e-5)
    assert (size[sine < -1e-6] == 0).all() and (bits[sine < -1e-6] == 0).all() and 100 < lit.sum() < n


def test_all_energy_has_arrived_in_the_end():
    """Three pairs of other delays: nothing before the first, never less later, and at the end the sum of all."""
    rng = np.random.default_rng(1)
    late = np.cumsum(rng.uniform(0.001, 0.01, (3, 41)), axis=1)
    energy = rng.uniform(0, 1, (3, 40))
    arrived = arrived_energy(late, energy)
    order = np.argsort(late, axis=None)
    assert np.all(np.diff(arrived.ravel()[order]) >= -1e-12)
    assert arrived.max() == pytest.approx(energy.sum(), rel=1e-9)
    assert arrived.ravel()[order[0]] == pytest.approx(0, abs=1e-9)


def test_what_has_arrived_is_interpolated_as_numpy_does():
    """Pairs with equal delays, and stretches without energy: between a thousand times, to the bit."""
    rng = np.random.default_rng(2)
    for pairs, bins in ((1, 48), (6, 48), (3, 1)):
        late = np.cumsum(rng.uniform(0, 0.1, (pairs, bins + 1)) ** 3, axis=1)
        energy = rng.exponential(size=(pairs, bins)) ** 4
        late[:, 1 : bins // 4], energy[:, : bins // 3] = late[:, 1:2], 0.0
        times = np.linspace(late.min(), late.max(), 1024)
        sums = [
            np.interp(times, *one) for one in zip(late, np.cumsum(np.pad(energy, ((0, 0), (1, 0))), 1), strict=True)
        ]
        np.testing.assert_array_equal(arrived_energy(late, energy), np.interp(late, times, np.add.reduce(sums)))


def test_one_pair_alone_has_arrived_as_it_was_sent():
    """Between its own edges the running sum is that of its own stretches, to the grid of times."""
    late, energy = np.linspace(0.01, 0.2, 21)[None], np.linspace(1, 3, 20)[None]
    np.testing.assert_allclose(arrived_energy(late, energy)[0, 1:], np.cumsum(energy), rtol=1e-3)


def test_pairs_that_arrive_within_a_pulse_are_known_however_deep_the_ground():
    """Sonar at the surface: D-D and S-S always; in the middle of the water only where they cross, more so on relief."""
    pair = np.array([[0, 0], [0, 1], [1, 1]])
    edges, needed = np.linspace(10, 100, 31), np.ones((30, 3), bool)

    def evaluate(climbs, rise):
        levels = [np.hypot(edges, np.array(climbs)[:, None] + shift) / 1500.0 for shift in (-rise, rise)]
        together = sample_allocation._interfering_pairs(levels, pair, 2e-4, needed)
        return (together != np.arange(3)).any(axis=1)

    assert evaluate([10.0, 10.01], 0.0).all()
    apart = evaluate([10.0, 20.0], 0.0)
    assert not apart.any() and not evaluate([10.0, 20.0], 0.3).any()
    far = evaluate([10.0, 12.0], 0.0)
    assert far[-1] and not far[0] and (evaluate([10.0, 12.0], 1.0) | ~far).all()


def test_what_is_stronger_than_a_hundredth_takes_every_point():
    """A point that adds a hundredth takes part always, one that adds a third of it at a third of all positions."""
    energy = np.array([[[1.0, 0.3, 1e-4, 0.0]]], np.float32) * 10
    share, ones = np.empty((1, 1, 4), np.uint8), np.ones((1, 4))
    ten_points = np.array([[1, 0, 0, 0, 5.0, 10.0, 1, 0, 1]]), np.array([0.0, 20.0]), 0.5
    given = (*ten_points, energy, np.zeros(1, np.int64), ones, ones > 0)
    pair_keep_probabilities(*given, np.arange(4)[None], share, 32, 1)
    np.testing.assert_array_equal(share[0, 0], [32, 10, 1, 0])
    pair_keep_probabilities(*given, np.array([[0, 0, 2, 3]]), share, 32, 1)
    np.testing.assert_array_equal(share[0, 0], [32, 32, 1, 0])


@pytest.mark.parametrize("families", [("D",), ("D", "S")])
def test_terrain_left_out_before_the_first_evaluated_sample_hides_nothing(families):
    """A peak as high as terrain gets hides a hole as deep as it gets, if and only if it is not left out."""
    channel = IsovelocityChannel(10.0, 20.0, 1500.0, 0.01, (19.0, 21.0))
    bounce_codes, horizon_row, launches = bounce_tables(families)
    images = np.array([image_depth(name, channel.sonar_depth, channel.water_depth) for name in launches])
    table = FamilyTable(images, bounce_codes, horizon_row, images, np.zeros(len(images), bool), np.zeros((1, 2)),
                        np.zeros(0), 0.0)  # fmt: skip
    listed, count = 1000, 1200
    begin = first_occluding_sample(listed, channel, table, np.ones(len(images), bool))
    assert 0.7 * listed < begin < listed
    seen = []
    for peak in range(begin - 10, listed):
        terrain = np.full(count, 21.0, np.float32)
        terrain[peak] = 19.0
        for image in images:
            launch, bound = np.empty((2, 2, count), np.float32)
            for start, row in ((0, 0), (begin, 1)):
                running_horizon(terrain, image, False, 0.02, 0.3, (start, count), launch[row], bound[row])
            clear = launch[:, listed:] <= bound[:, listed:]
            np.testing.assert_array_equal(*clear)
            seen.append((peak, bool(clear[0].all())))
    hiding = [peak for peak, clear in seen if not clear]
    assert begin <= min(hiding) < begin + 0.05 * listed


def test_no_terrain_is_left_out_where_rays_rise_off_the_seabed():
    """A ray that rises off the seabed may be hidden by any terrain on its path, unless its bounces are clear."""
    channel = IsovelocityChannel(10.0, 20.0, 1500.0, 0.01, (19.0, 21.0))
    bounce_codes, horizon_row, launches = bounce_tables(("D", "BS"))
    images = np.array([image_depth(name, channel.sonar_depth, channel.water_depth) for name in launches])
    rising = np.array([name.endswith("B") for name in launches])
    table = FamilyTable(images, bounce_codes, horizon_row, images, rising, np.zeros((1, 2)), np.zeros(0), 0.0)
    assert first_occluding_sample(1000, channel, table, np.ones(len(images), bool)) == 0
    assert 700 < first_occluding_sample(1000, channel, table, ~rising) < 1000
