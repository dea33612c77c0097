"""Everything at once against sums over every element, ray by ray: 200 points, a moving array, layers, a surface."""

import numpy as np
import pytest

from insonify.simulator import build_simulator, simulate
from oracles.arrays import HEADING, WINDOW, elements_scenario, line_of, some_targets
from oracles.brute import back_to, echoes, out_of, refracted, straight
from oracles.few_of import few_of
from oracles.scenes import nominal, point
from oracles.underway import CARRIER, SPEED, recorded
from synthesis.oracle import relative_rms

RATE = 1e6
TIME = np.arange(0, WINDOW[1] + 0.01, 1 / RATE)
LOSS = 0.03
THERMOCLINE = {"profile": [[0, 1520], [8, 1518], [12, 1495], [20, 1490]], "smoothing": 1.0}
EVEN = {"sound_speed": SPEED}
PANEL = {"kind": "planar", "width": 0.3, "height": 0.3, "columns": 2, "rows": 2, "element": "omni"}
pytestmark = pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")


def scenario_of(targets, water, *, receive=None, families=("D", "S"), surface=None, speed=3.0):
    """Silent water that absorbs, and an array that runs straight on."""
    return elements_scenario(
        targets, receive=receive or line_of(4), track={"speed": speed}, surface=surface or {},
        water={**water, "noise_level_db": None, "absorption_db_per_m": LOSS},
        seabed={"depth": 20.0, "reflection": 0.35},
        paths={"max_reflections": 2, "families": list(families), "contributions": ["target"]},
    )  # fmt: skip


def brute_force(scenario, out, back, pairs, rows=slice(None)):
    """What each element receives, or some of them.

    Over pairs of paths out and back, by name, with a weight for each.
    """
    simulator = build_simulator(scenario)
    here = simulator.ping_geometry(0)
    velocity = scenario.track.speed * np.array([np.cos(HEADING), np.sin(HEADING), 0.0])

    def path(place):
        return lambda time: place + np.asarray(time)[:, None] * velocity

    ways = {name: out_of(way, path(here.transmit_position), scenario.sonar.pulse.duration) for name, way in out.items()}
    places = here.receive_position + here.elements.positions[rows] @ here.receive_beams.axes
    raw = np.zeros((len(places), len(TIME)), complex)
    for row, place in enumerate(places):
        for i, j, weight in pairs:
            home = back_to(back[j], path(place), ways[i])
            raw[row] += 1e10 * weight * echoes(scenario.sonar, CARRIER, ways[i], home, TIME)
    return recorded(raw, scenario, RATE)


def in_layers(scenario, targets, families):
    """By rays of their own from every element at every moment."""
    column = build_simulator(scenario).engine.rays.layers
    ways = {name: refracted(column, targets, name, loss_db=LOSS) for name in families}
    return brute_force(scenario, ways, ways, [(i, j, 1.0) for i in families for j in families])


def off_glints(scenario, targets):
    """By images of the sonar that stand where the legs drawn for a wind sea come from: bounces alike, nothing else."""
    simulator = build_simulator(scenario)
    here = simulator.ping_geometry(0)
    legs = [simulator.engine.path_pairs(here, block()) for block in simulator.engine.blocks(here)]
    columns = {end: _images([getattr(pairs, end) for pairs in legs], place) for end, place in (
        ("transmit_legs", here.transmit_position), ("receive_legs", here.receive_position))}  # fmt: skip
    assert all(np.array_equal(one.pair, legs[0].pair) for one in legs) and len(legs) == len(targets)
    weight = [np.abs(pairs.strength[:, 0]) for pairs in legs]
    assert np.ptp(weight, axis=0).max() < 1e-12
    pairs = [(i, j, weight[0][row]) for row, (i, j) in enumerate(legs[0].pair)]
    return brute_force(scenario, *columns.values(), pairs)


def _images(legs, place):
    """Straight ways of each row of legs, by row."""
    found = {}
    for row in range(len(legs[0].families)):
        length = np.array([one.length[row, 0] for one in legs])
        image = place + length[:, None] * np.array([one.departure[row, 0] for one in legs])
        factor = np.array([one.amplitude[row, 0] / one.absorption[row, 0] for one in legs]) * length
        found[row] = straight(image, SPEED, factor, loss_db=LOSS)
    return found


def test_200_points_in_a_thermocline_received_by_an_array_under_way():
    """Brute force: D and S through layers that absorb, two elements 0.12 m apart at 3 m/s; rms 1e-5 (seen: 4e-6)."""
    targets = some_targets(200)
    scenario = scenario_of(targets, THERMOCLINE, receive=line_of(2))
    known = in_layers(scenario, targets, ("D", "S"))
    assert relative_rms(simulate(scenario, threads=1).pressure.values[0], known) < 1e-5


@pytest.mark.slow
@few_of((1,), "speed", [0.0, 3.0])
def test_so_do_elements_above_and_below_the_centre(speed):
    """The same of a panel of 0.3 m by 0.3 m with 2 x 2 elements, still and at 3 m/s: 2e-5 (seen: 1e-5)."""
    targets = some_targets(100)
    scenario = scenario_of(targets, THERMOCLINE, receive=PANEL, speed=speed)
    known = in_layers(scenario, targets, ("D", "S"))
    assert relative_rms(simulate(scenario, threads=1).pressure.values[0], known) < 2e-5


@pytest.mark.slow
def test_so_are_echoes_off_a_wind_sea():
    """Glints at 5 m/s, each drawn as the engine draws it, 60 points: their images stand in the world; 1e-5."""
    targets = some_targets(60)
    sea = {"reflection": "statistical", "wind_speed": 5.0}
    scenario = scenario_of(targets, EVEN, surface=sea, receive=line_of(2))
    received = simulate(scenario, threads=1).pressure.values[0]
    assert relative_rms(received, off_glints(scenario, targets)) < 1e-5
    mirrored = simulate(scenario_of(targets, EVEN, receive=line_of(2)), threads=1).pressure.values[0]
    assert relative_rms(received, mirrored) > 0.1


@pytest.mark.parametrize("abeam", [1.2, 40.0])
def test_an_array_of_32_receives_what_is_abeam_at_its_ends_and_between(abeam):
    """A line of 0.5 m at 3 m/s, 20 points within so many degrees of its beam: rms 1e-5 (seen: 5e-6)."""
    random = np.random.default_rng(7)
    bearing = HEADING + np.pi / 2 + np.radians(random.uniform(-abeam, abeam, 20))
    away, depth = random.uniform(15, 40, 20), random.uniform(5, 9, 20)
    targets = np.stack([away * np.cos(bearing), away * np.sin(bearing), depth], axis=1)
    scenario, rows = scenario_of(targets, EVEN, receive=line_of(32, 0.5), families=("D",)), [0, 13, 31]
    ways = {"D": straight(targets, SPEED, np.ones(20), loss_db=LOSS)}
    known = brute_force(scenario, ways, ways, [("D", "D", 1.0)], rows)
    assert relative_rms(simulate(scenario, threads=1).pressure.values[0][rows], known) < 1e-5


def test_transmitter_and_receiver_change_places_in_a_thermocline():
    """Seabed and a point target by D, S and BS, ends 3.7 m apart in three dimensions: the same recording to 1e-4."""
    ends = (0.0, 0.0, 0.0), (3.0, 1.0, 2.0)
    one, other = (
        simulate(
            nominal(
                water={**THERMOCLINE, "noise_level_db": None}, targets=[point(1.0, 30.0, 15.0)], line={"length": None},
                transmit={"kind": "point", "element": "omni", "offset": sent},
                receive={"kind": "elements", "element": "omni", "positions": [(0, 0, 0)], "offset": received},
                sonar={"receiver": {"record": "elements", "bandwidth": 20e3}},
                paths={"max_reflections": 2, "families": ["D", "S", "BS"]}, track={"window": (0.041, 0.045)},
            ),
            threads=1,
        ).pressure.values
        for sent, received in (ends, ends[::-1])
    )  # fmt: skip
    assert np.linalg.norm(one) > 0 and relative_rms(one, other) < 1e-4
