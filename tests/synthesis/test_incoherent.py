"""The incoherent reading: what interferes, interferes; what does not, adds in power."""

import numpy as np
import pytest

import insonify.simulator as simulation
from insonify.simulator import arrivals, build_simulator, simulate
from oracles.scenes import PULSE, each_ping, nominal, point
from oracles.surveys import sidescan


def lloyd(field="incoherent", seed=1, duration=0.2e-3):
    """A sonar half a metre under the surface of 10 m of water: D and S lie 66 us apart at 100 m, within the pulse."""
    return nominal(field=field, seed=seed, seabed={"depth": 10}, paths={"families": ("D", "S")},
                   sonar={"pulse": {**PULSE, "duration": duration}},
                   track={"position": (0, 0, 0.5), "window": (0.06, 0.2)})  # fmt: skip


def test_a_shallow_sonar_receives_lloyds_fringes():
    """Lloyd's mirror.

    Out and back the intensity follows |1 - exp(-j k dL)|^4 where D and S overlap; a pulse of 1 ms lets levels
    swing by more than 20 dB, and maxima stand where dL is an odd number of half wavelengths (range within 2 %).
    """
    received = simulate(lloyd(duration=1e-3))
    slant = 1500 * (received.time.values - 0.5e-3) / 2
    level = 10 * np.log10(received.intensity.values[0, 0] * slant**7)
    assert level.max() - level.min() > 20
    ground = np.sqrt(slant**2 - 9.5**2)
    mirrored = np.hypot(ground, 10.5) - np.hypot(ground, 9.5)
    for halves in (9, 11, 13, 15):
        bright = int(np.argmin(np.abs(mirrored - halves * 0.015 / 2)))
        near = slice(int(bright - 0.035 * ground[bright] / 0.03), int(bright + 0.035 * ground[bright] / 0.03))
        assert ground[near][np.argmax(level[near])] == pytest.approx(ground[bright], rel=0.02)


def test_lloyds_fringes_are_the_mean_of_the_coherent_reading():
    """40 beds.

    Over all 36 000 cells the bias is within 0.1 dB (0.023 dB standard error); in bins of 2 ms (N = 520, 0.19 dB)
    within 0.7 dB, on crests and in troughs.
    """
    received = each_ping([lloyd("coherent", seed) for seed in range(40)],
                      lambda scenario: simulate(scenario, threads=1).pressure.values[0, 0])  # fmt: skip
    power, expected = np.mean(np.abs(received) ** 2, axis=0), simulate(lloyd()).intensity.values[0, 0]
    ratio = np.array([np.mean(part) for part in np.array_split(power / expected, 70)])
    assert 10 * np.log10(ratio.mean()) == pytest.approx(0, abs=0.1)
    assert np.abs(10 * np.log10(ratio)).max() < 0.7


def test_the_echo_of_a_point_is_received_as_it_is():
    """A deterministic target has no speckle: its intensity is the square of its pressure, overlapping paths and all."""
    scenario = nominal(
        targets=[point(0, 150, 19.5)], track={"window": (0.199, 0.212)}, paths={"contributions": ["target"]}
    )
    power = np.abs(simulate(scenario).pressure.values) ** 2
    mean = simulate(scenario.model_copy(update={"field": "incoherent"})).intensity.values
    assert np.abs(mean - power).max() < 1e-3 * power.max()


def test_two_points_add_as_energies_and_each_in_phase_with_itself():
    """Targets of their own do not interfere in the mean: intensities add."""
    one, two = point(0, 150, 19.5), point(0.5, 150.02, 15.0, label="other")
    received = [
        simulate(nominal(field="incoherent", targets=targets, track={"window": (0.199, 0.212)},
                         paths={"contributions": ["target"]})).intensity.values
        for targets in ([one], [two], [one, two])
    ]  # fmt: skip
    np.testing.assert_allclose(received[2], received[0] + received[1], rtol=1e-9, atol=1e-9 * received[2].max())


def test_expected_power_is_the_sum_over_groups_written_out(monkeypatch):
    """Thousands of arrivals by hand: sum over groups of |sum of A b p(t - tau)|^2.

    To 1e-5 of the mean where the filter's ringing is followed 2 ms further than by default. By default the interference
    of arrivals further apart than all but a millionth of the pulse's energy is left out: sqrt(1e-6) / 5 of the mean.
    """
    scenario = nominal(field="incoherent", track={"window": (0.0805, 0.0811)}, seabed={"depth": 13},
                   paths={"scatterers_per_cell": 0.5, "beam_cutoff_db": -10})  # fmt: skip
    found, simulator = arrivals(scenario), build_simulator(scenario)
    here = simulator.ping_geometry(0)
    gain = 1e11 * here.transmit_beams.gain(found.departure)[0] * here.receive_beams.gain(found.arrival)[0]
    weight = gain * found.amplitude * np.exp(-2j * np.pi * (100e3 * found.delay % 1))
    expected = np.zeros(simulator.grid.sample_count)
    for group in np.unique(found.group):
        rows = found.group == group
        expected += np.abs(weight[rows] @ simulator.pulse.samples(simulator.grid.time - found.delay[rows, None])) ** 2
    received = simulate(scenario).intensity.values[0, 0]
    assert np.abs(received - expected).max() < 2e-4 * expected.mean()
    plain, more = simulation.pulse_table, 2e-3
    monkeypatch.setattr(simulation, "pulse_table", lambda p, a, b, rate: plain(p, a - more, b + more, rate))
    received = simulate(scenario).intensity.values[0, 0]
    assert np.abs(received - expected).max() < 1e-5 * expected.mean()


MANY_BEAMS = {
    "source_level_db": 200, "pulse": {"kind": "cw", "frequency": 300e3, "duration": 0.1e-3},
    "transmit": {"kind": "planar", "width": 0.003, "height": 0.01, "steer": 0.0},
    "receive": {
        "kind": "planar", "width": 0.05, "height": 0.01,
        "steer": [float(angle) for angle in np.radians(np.linspace(-60, 60, 65))],
    },
    "mounting": {"bearing": 0.0, "tilt": "20 deg"},
}  # fmt: skip


def by_rows_and_by_beams(monkeypatch, scenario):
    """Expected intensity by rows of directions, the same for any number of threads, and beam by beam."""
    rows, again = (simulate(scenario, threads=threads).intensity.values for threads in (2, 1))
    np.testing.assert_array_equal(rows, again)
    monkeypatch.setattr("insonify.simulator.direction_powers", lambda *_: None)
    each = simulate(scenario, threads=1).intensity.values
    assert not np.array_equal(rows, each)
    return rows, each


@pytest.mark.parametrize("moving", [False, True])
def test_many_beams_from_rows_of_directions_are_those_of_each_beam(monkeypatch, moving):
    """65 beams over a bed and a point: 2 % of the largest beam at each time, 0.02 dB in the mean; whatever threads."""
    point = {"shape": "point", "label": "point", "position": (12.0, 3.0, 8.0), "target_strength_db": -5.0}
    paths = {"max_reflections": 0, "contributions": ("seabed", "target"), "scatterers_per_cell": 1}
    track = {"pings": 1, "window": (0.004, 0.024), "stop_and_hop": not moving}
    scenario = sidescan(targets=[point], sonar=MANY_BEAMS, paths=paths, track=track)
    rows, each = by_rows_and_by_beams(monkeypatch, scenario)
    assert np.abs(rows - each).max() <= 0.02 * each.max()
    assert (np.abs(rows - each) <= 0.02 * each.max(axis=1, keepdims=True)).all()
    assert np.abs(10 * np.log10(rows.mean(axis=2) / each.mean(axis=2))).max() < 0.1
    assert abs(10 * np.log10(rows.mean() / each.mean())) < 0.02


DIRECT_AND_BED = {"families": ("D", "B")}


@pytest.mark.parametrize(
    ("paths", "strength", "apart"),
    [({}, 5.0, 0.05), ({"jitter": 0.3}, 5.0, 0.05), (DIRECT_AND_BED, -20.0, 0.02),
     (DIRECT_AND_BED | {"amplitude_perturbation": 0.5}, -20.0, 0.02)],
)  # fmt: skip
def test_all_pairs_of_many_beams_from_rows_of_directions_are_those_of_each_beam(monkeypatch, paths, strength, apart):
    """One bounce, 65 beams over a bed, and a point whose replicas overlap: 2 or 5 % of the largest beam at each time.

    By way of the surface too, its replicas come from directions neither alike nor apart, and are added beam by beam.
    The point on rows is weak: a beam with a null towards it is too high, as its pattern is linear between two rows.
    """
    point = {"shape": "point", "label": "point", "position": (12.0, 3.0, 9.7), "target_strength_db": strength}
    paths = {"max_reflections": 1, "contributions": ("seabed", "target"), "scatterers_per_cell": 1} | paths
    track = {"pings": 1, "window": (0.004, 0.024)}
    scenario = sidescan(targets=[point], sonar=MANY_BEAMS, paths=paths, track=track)
    rows, each = by_rows_and_by_beams(monkeypatch, scenario)
    assert (np.abs(rows - each) <= apart * each.max(axis=1, keepdims=True)).all()
    assert np.abs(10 * np.log10(rows.mean(axis=2) / each.mean(axis=2))).max() < 0.1
    assert abs(10 * np.log10(rows.mean() / each.mean())) < 0.02


def test_dense_points_of_many_beams_on_rows_are_those_of_each_beam(monkeypatch):
    """A rough wall near the bed by all paths of one bounce, whose replicas overlap: exact in the sum over beams.

    Interference between directions is deposited half way: 0.1 dB in that sum at each time, 0.3 dB in the mean of a
    beam, 0.02 dB in all.
    """
    wall = {"shape": "box", "label": "wall", "position": (10.0, 2.0), "size": (0.4, 1.0, 0.6)}
    paths = {"max_reflections": 1, "contributions": ("target",)}
    track = {"pings": 1, "window": (0.010, 0.022)}
    scenario = sidescan(targets=[wall], sonar=MANY_BEAMS, paths=paths, track=track)
    rows, each = by_rows_and_by_beams(monkeypatch, scenario)
    sums = [values[0].sum(axis=0) for values in (rows, each)]
    strong = sums[1] > 1e-3 * sums[1].max()
    assert rows.min() >= 0
    assert np.abs(10 * np.log10(sums[0][strong] / sums[1][strong])).max() < 0.1
    assert np.abs(10 * np.log10(rows.mean(axis=2) / each.mean(axis=2))).max() < 0.3
    assert abs(10 * np.log10(rows.mean() / each.mean())) < 0.02


def test_a_time_series_does_not_change_its_buffer():
    """A bed and a target with bounces on rows of directions: evaluated twice, the same intensity."""
    point = {"shape": "point", "label": "point", "position": (12.0, 3.0, 9.7), "target_strength_db": 5.0}
    scenario = sidescan(
        targets=[point], sonar=MANY_BEAMS,
        paths=DIRECT_AND_BED | {"max_reflections": 1, "contributions": ("target",)},
        track={"pings": 1, "window": (0.004, 0.024)},
    )  # fmt: skip
    simulator = build_simulator(scenario)
    geometry = simulator.ping_geometry(0)
    accumulator = simulator.incoherent_accumulator(geometry)
    energies = accumulator.empty()
    for block in simulator.engine.blocks(geometry, quadrature=True):
        for pairs in simulator.engine.pair_batches(geometry, block):
            accumulator.add(energies, pairs)
    assert energies.row_intensity.any()
    once = accumulator.time_series(energies)
    np.testing.assert_array_equal(accumulator.time_series(energies), once)
