"""Claims about recordings in uneven water: what it blurs, what shares it, what an expectation makes of it."""

import tracemalloc

import numpy as np
import pytest

from insonify.ocean.inhomogeneity import delay_variance
from insonify.propagation.delay_field import DelayField
from insonify.scenario.load import parse_model
from insonify.scenario.ray_domain import delay_field
from insonify.scenario.scenario import Scenario
from insonify.scenario.write import to_yaml
from insonify.simulator import arrivals, build_simulator, levels, simulate
from insonify.synthesis.coherence_factors import split_by_coherence
from insonify.synthesis.coherent_subsets import coherent_subsets
from insonify.validity import PhysicsWarning
from simulator.test_two_platforms import GOES, SAND, STATIC_RECEIVER, STAYS, scenario_of
from synthesis.oracle import relative_rms

CALM = {"sound_speed": 1500.0, "absorption_db_per_m": 0.0, "noise_level_db": None}
FAR = (40.0, 10.0, 15.0)
ONE = {"shape": "point", "label": "p", "target_strength_db": 0.0, "position": FAR}
WAY = float(np.linalg.norm(np.subtract(FAR, (0.0, 0.0, 11.0))))


def uneven(rms=1e-4, length=2.0, *, families=("D",), targets=(ONE,), **top):
    """Point targets in uneven water, one platform unless given otherwise."""
    top.setdefault("receiver_track", None)
    top.setdefault("paths", {"contributions": ["target"], "families": list(families)})
    patches = {"rms_index": rms, "correlation_length": length, **top.pop("patches", {})}
    return scenario_of(water={**CALM, "inhomogeneity": patches}, targets=list(targets), **top)


def phase_variance(scenario, way=WAY):
    """Of one leg at the carrier [rad^2]."""
    return (2 * np.pi * 1e5) ** 2 * float(delay_variance(way, 1500.0, scenario.water.inhomogeneity))


def test_water_without_changes_is_even_to_the_bit():
    """rms_index 0 gives the bits of no inhomogeneity; a seed gives the same bits again; another other delays."""
    plain = simulate(scenario_of(targets=[ONE], receiver_track=None, water=CALM)).pressure.values
    np.testing.assert_array_equal(simulate(uneven(0.0, families=("D", "S"))).pressure.values, plain)
    scenario = uneven(families=("D", "S"))
    once, again = simulate(scenario, threads=1).pressure.values, simulate(scenario, threads=2).pressure.values
    np.testing.assert_array_equal(once, again)
    assert relative_rms(once[0], plain[0]) > 0.1
    assert parse_model(Scenario, to_yaml(scenario)) == scenario


def test_pings_through_changing_water_lose_coherence():
    """500 pings, correlation time 1 s: the sum's energy is exp(-4 Phi^2) of full coherence, out and back alike.

    Monostatic delays are the same both ways, so the phase is twice that of a leg: 4 Phi^2 is its variance. Standard
    error of |mean| by the ratio estimate, sqrt((1 - exp(-2 V)) / 2 N) at most: 0.032; the bar is three of them.
    """
    scenario = uneven(patches={"correlation_time": 1.0}, track={**STAYS, "pings": 500, "interval": 3.0})
    received = simulate(scenario).pressure.values[:, 0]
    sample = received[:, np.argmax(np.abs(received[0]))]
    variance = 4 * phase_variance(scenario)
    assert np.abs(sample.mean()) / np.abs(sample).mean() == pytest.approx(np.exp(-variance / 2), abs=0.095)
    turned = np.angle(sample / sample.mean())
    assert np.var(turned) == pytest.approx(variance, rel=3 * np.sqrt(2 / 500) + 0.06)  # some turn past half a circle


def test_pings_near_each_other_share_the_water():
    """A track through frozen patches of 2 m: the phase's structure function is 8 Phi^2 (1 - rho), rho as of the field.

    Mean over 40 seeds of pings 0.4 m apart, rho = mean over s of exp(-((1 - s) 0.4 / 2)^2) = 0.987.
    """
    step, s = 0.4, (np.arange(100) + 0.5) / 100
    alike = np.exp(-(((1 - s) * step / 2) ** 2)).mean()
    square, even = [], []
    for seed in range(1, 41):
        line = {"kind": "line", "start": (0.0, -40.0, 11.0), "heading": np.pi / 2, "speed": 4.0, "pings": 200,
                "interval": 0.1, "window": (0.0, 0.08), "stop_and_hop": True}  # fmt: skip
        late = [arrivals(uneven(seed=seed, track=line), ping).delay[0] for ping in (50, 51)]
        even = even or [arrivals(uneven(0.0, track=line), ping).delay[0] for ping in (50, 51)]
        square.append((2 * np.pi * 1e5 * (late[1] - late[0] - (even[1] - even[0]))) ** 2)
    scenario = uneven(track=line)
    way = np.linalg.norm(np.subtract(FAR, (0.0, -20.0, 11.0)))
    expected = 8 * phase_variance(scenario, way) * (1 - alike)
    assert np.mean(square) == pytest.approx(expected, rel=3 * np.sqrt(2 / 40))


def _delay(scenario, ping):
    """What uneven water adds, out and back [s]."""
    even = scenario.model_copy(update={"water": scenario.water.model_copy(update={"inhomogeneity": None})})
    return float(arrivals(scenario, ping).delay[0] - arrivals(even, ping).delay[0])


def test_elements_share_the_delays_of_their_centre():
    """A metre of elements in patches of 5 m: phases between elements as in even water, to 1e-4 rad."""
    line = {"kind": "line", "length": 1.0, "elements": 5, "element": "omni"}
    sonar = {"receive": line, "receiver": {"bandwidth": 20e3, "record": "elements"}}
    one, other = (simulate(uneven(rms, 5.0, sonar=sonar)).pressure.values[0] for rms in (0.0, 1e-4))
    at = np.argmax(np.abs(one[0]))
    turned = np.angle(other[:, at] / one[:, at])
    assert np.abs(turned[0]) > 0.05
    np.testing.assert_allclose(turned, turned[0], atol=1e-4 + 0.02 * np.ptp(turned))


@pytest.mark.slow
@pytest.mark.parametrize("receiver_track", [None, STATIC_RECEIVER], ids=["one platform", "two"])
def test_expectations_keep_the_mean_of_what_paths_make_together(receiver_track):
    """Paths D and S to a point near the sea, mean energy over 200 pings: the expectation's, 3 standard errors.

    Patches of 0.8 m, which the paths share only in part, and water that is another one at each ping; in even water the
    energy is another.
    """
    near = {**ONE, "position": (40.0, 10.0, 1.0)}
    common = {"targets": [near], "families": ("D", "S"), "receiver_track": receiver_track,
              "track": {**STAYS, "position": (0.0, 0.0, 1.5), "pings": 200, "interval": 10.0},
              "patches": {"correlation_time": 1.0}}  # fmt: skip
    energy = np.sum(np.abs(simulate(uneven(4e-4, 0.8, **common)).pressure.values) ** 2, axis=(1, 2))
    expected, even = (
        np.sum(simulate(uneven(strength, 0.8, field="incoherent", **common), pings=0).intensity.values)
        for strength in (4e-4, 0.0)
    )
    error = np.std(energy) / np.sqrt(len(energy))
    assert np.mean(energy) == pytest.approx(expected, abs=3 * error + 1e-3 * expected)
    assert abs(expected - even) > 4 * error


def test_ends_may_be_exchanged_in_uneven_water():
    """Two platforms exchanged over sand, through the same patches: the same series, relative rms 1e-4."""
    clock = {"window": (0.035, 0.045)}
    common = {
        "paths": {"contributions": ["seabed", "target"], "max_reflections": 1, "scatterers_per_cell": 1},
        "seabed": SAND,
    }
    one = uneven(track={**STAYS, **clock}, receiver_track=STATIC_RECEIVER, **common)
    back = {"kind": "static", "position": STAYS["position"]}
    other = uneven(track={**STATIC_RECEIVER, **clock}, receiver_track=back, **common)
    assert relative_rms(simulate(other).pressure.values[0], simulate(one).pressure.values[0]) < 1e-4


def test_levels_of_a_coherent_scenario_are_means():
    """Level curves do not follow one draw of the water: two seeds have the same, to 1e-9 of a dB."""
    curves = [levels(uneven(seed=seed, families=("D", "S"))).level_db.values for seed in (1, 2)]
    np.testing.assert_allclose(*curves, atol=1e-9)


def test_small_patches_and_long_arrays_are_reported():
    """4 R / (k l^2) above 1, and an array longer than half a patch, are cautions with the fix."""
    with pytest.warns(PhysicsWarning, match="4 R / .k l.2. is .* Give patches of"):
        uneven(length=0.3)
    line = {"kind": "line", "length": 1.5, "elements": 5, "element": "omni"}
    with pytest.warns(PhysicsWarning, match="the receive array is 1.2 m long, and all its elements share"):
        uneven(sonar={"receive": line, "receiver": {"bandwidth": 20e3, "record": "elements"}})


def test_for_a_moving_sonar_the_water_stays_where_it_is():
    """A moving sonar in uneven water receives arrivals that make up its recording: delays are in both, to 1e-9 s."""
    still, moving = (uneven(track={**GOES, "stop_and_hop": hop}) for hop in (True, False))
    assert _delay(still, 0) == pytest.approx(_delay(moving, 0), abs=1e-9)


def test_parts_of_a_block_share_the_covariance_of_its_families(monkeypatch):
    """A moving sea parts a block into dozens of groups: copies of all, bit-identical to one by one, of one covariance.

    At most one factor of the covariance is evaluated for every set of pairs of families, however many glints there are.
    """
    scenario = uneven(families=("D", "S", "B", "BS", "SB"), surface={"reflection": "statistical", "wind_speed": 5.0},
                      targets=[{**ONE, "position": (10.0, 5.0, 15.0)}], field="incoherent")  # fmt: skip
    simulator = build_simulator(scenario)
    here = simulator.ping_geometry(0)
    parts = coherent_subsets(simulator.engine.pairs(here, simulator.engine.blocks(here, quadrature=True)[0]))
    field = delay_field(scenario)
    alone = [copy for part in parts for copy in split_by_coherence([part], field, here)]
    evaluated, factorised = [], []
    covariance, cholesky = DelayField.covariance, np.linalg.cholesky
    monkeypatch.setattr(DelayField, "covariance", lambda *arguments: evaluated.append(1) or covariance(*arguments))
    monkeypatch.setattr(np.linalg, "cholesky", lambda matrix: factorised.append(1) or cholesky(matrix))
    together = list(split_by_coherence(parts, field, here))
    assert len(parts) > 20 and len(evaluated) == 1
    assert len(factorised) <= len({tuple(sorted(set(part.names()))) for part in parts}) < len(parts) / 2
    assert len(together) == len(alone)
    for copy, other in zip(together, alone, strict=True):
        np.testing.assert_array_equal(copy.pair, other.pair)
        np.testing.assert_array_equal(copy.strength, other.strength)


def test_copies_of_a_block_in_uneven_water_come_one_after_the_other():
    """2000 positions, 9 families: 45 copies, one by one: a third of the memory of all."""
    scenario = uneven(paths={"contributions": ["seabed"], "max_reflections": 8, "scatterers_per_cell": 1})
    simulator = build_simulator(scenario.with_("surface.reflection", "flat"))
    here = simulator.ping_geometry(0)
    points = simulator.engine.blocks(here, quadrature=True)[0]().take(slice(2000))
    pairs = simulator.engine.pairs(here, lambda: points)
    tracemalloc.start()
    copies = sum(1 for _ in split_by_coherence([pairs], delay_field(scenario), here))
    taken = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert copies > 40
    assert taken < 20 * pairs.strength.nbytes


def test_bounces_of_one_family_off_waves_share_a_copy():
    """Swell reflects D and S by several points: as many copies as pairs of families, which are four, not of rays."""
    swell = {"reflection": "explicit", "wind_speed": None, "swell": {"height": "1 m", "length": "12 m"}}
    scenario = uneven(surface=swell, targets=[{**ONE, "position": (40.0, 5.0, 15.0)}], families=("D", "S"))
    simulator = build_simulator(scenario)
    here = simulator.ping_geometry(0)
    pairs = simulator.engine.pairs(here, simulator.engine.blocks(here)[0])
    assert len(pairs.pair) > 8
    assert sum(1 for _ in split_by_coherence([pairs], delay_field(scenario), here)) <= 4
