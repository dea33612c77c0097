"""`paths.importance_sampling: false`: every scatterer and every pair is evaluated; expectations do not change."""

import numpy as np
import pytest

from insonify.records.pairs import SeparableStrengths
from insonify.scenario.load import ScenarioError, parse_model
from insonify.scenario.scenario import Scenario
from insonify.scenario.write import to_yaml
from insonify.simulator import build_simulator, simulate
from oracles.scenes import nominal

ROUGH = {"depth": 20.0, "relief": {"kind": "power-law", "hurst": 0.8, "rms": 0.05}}


def ground(*, importance_sampling, seabed=ROUGH, **more):
    """Ground 60 to 65 m away, of 40 cm lines, and its scenario prepared."""
    paths = {
        "max_reflections": 1,
        "contributions": ["seabed"],
        "importance_sampling": importance_sampling,
        **more.pop("paths", {}),
    }
    line = {"length": 0.4, "elements": 56, "element": "baffled"}
    changes = {"seabed": seabed, "track": {"window": (0.08, 0.086)}, "line": line, "paths": paths}
    return build_simulator(nominal(**{**changes, **more}))


def drawn(simulator):
    """Positions, areas and distances of all scatterers of the seabed, in the order of their keys."""
    here = simulator.ping_geometry(0)
    blocks = [block() for block in simulator.engine.blocks(here)]
    key, area = (np.concatenate([getattr(one, name) for one in blocks]) for name in ("scatterer_id", "area"))
    place = np.concatenate([one.position for one in blocks])
    order = np.argsort(key)
    return key[order], area[order], place[order]


@pytest.mark.parametrize("seabed", [ROUGH, {"depth": 20.0}], ids=["rough", "flat"])
def test_those_left_are_some_of_all(seabed):
    """Scatterers kept with importance sampling are among all, at the same positions, no smaller; and they are fewer."""
    few, all_of_them = (drawn(ground(importance_sampling=on, seabed=seabed)) for on in (True, False))
    found = np.searchsorted(all_of_them[0], few[0])
    np.testing.assert_array_equal(all_of_them[0][found], few[0])
    np.testing.assert_array_equal(all_of_them[2][found], few[2])
    assert (few[1] >= all_of_them[1][found] * (1 - 1e-6)).all()
    assert len(few[0]) < 0.8 * len(all_of_them[0])


def test_areas_of_those_left_come_to_the_whole():
    """Each represents others: the sum of areas is that of all, within 4 standard errors, which are below 4 %."""
    few, all_of_them = (
        drawn(ground(importance_sampling=on, seabed={"depth": 20.0}, paths={"scatterers_per_cell": 30.0}))
        for on in (True, False)
    )
    found = np.searchsorted(all_of_them[0], few[0])
    own = all_of_them[1][found]
    error = np.sqrt(np.sum(few[1] ** 2 * (1 - own / few[1])))  # kept by chance own / area
    assert error < 0.04 * all_of_them[1].sum()
    assert abs(few[1].sum() - all_of_them[1].sum()) < 4 * error


def test_all_pairs_are_evaluated_everywhere():
    """Rough ground, 9 pairs: no keep probabilities; each pair scatters at each position that both legs reach."""
    simulator = ground(importance_sampling=False, paths={"max_reflections": 2})
    here = simulator.ping_geometry(0)
    assert simulator.engine.family_keep_probabilities(here, np.array([50.0])) is None
    for block in simulator.engine.blocks(here):
        pairs = simulator.engine.pairs(here, block, include_negligible=False)
        assert isinstance(pairs.stored_strengths, SeparableStrengths) and pairs.stored_strengths.sampling is None
        i, j = pairs.pair.T
        there = (
            (pairs.transmit_legs.amplitude[i] != 0)
            & (pairs.receive_legs.amplitude[j] != 0)
            & (pairs.transmit_legs.grazing_sine[i] != 0)
        )
        assert (pairs.strength[there & (pairs.receive_legs.grazing_sine[j] != 0)] > 0).all()


@pytest.mark.parametrize("importance_sampling", [True, False])
def test_elements_and_beams_have_one_ground(importance_sampling):
    """Within 11 degrees, elements and beam of a line share all scatterers; with importance sampling, they differ."""
    lobes = {"transmit": {"kind": "point", "length": None, "elements": None, "element": "omni"}}
    one, other = (
        drawn(
            ground(
                importance_sampling=importance_sampling,
                sonar={"receiver": {"bandwidth": 20e3, "record": record}},
                **lobes,
            )
        )
        for record in ("beams", "elements")
    )
    inner = [set(key[np.hypot(place[:, 0], place[:, 1] - 60.5) < 12].tolist()) for key, _, place in (one, other)]
    assert len(inner[0]) > 100 and (inner[0] == inner[1]) != importance_sampling


def test_expected_intensities_do_not_depend_on_it():
    """Nothing is drawn for them: the same bits."""
    received = [simulate(ground(importance_sampling=on).scenario.model_copy(update={"field": "incoherent"}), threads=1)
             for on in (True, False)]  # fmt: skip
    np.testing.assert_array_equal(*(one.intensity.values for one in received))
    assert received[0].intensity.values.max() > 0


def test_targets_alone_do_not_depend_on_it():
    """A ball and no ground: the same bits with and without."""
    ball = [{"shape": "sphere", "label": "ball", "diameter": 0.6, "position": (0.0, 60.0)}]
    received = [
        simulate(
            ground(importance_sampling=on, targets=ball, paths={"contributions": ["target"]}).scenario, threads=1
        ).pressure.values
        for on in (True, False)
    ]
    np.testing.assert_array_equal(*received)
    assert np.abs(received[0]).max() > 0


def test_the_choice_is_written_and_read():
    """A file has it, has it again when written out, and is true by itself; what is no yes or no is refused."""
    assert nominal().paths.importance_sampling
    off = nominal(paths={"importance_sampling": False})
    assert "importance_sampling: false" in to_yaml(off)
    assert parse_model(Scenario, to_yaml(off)) == off
    with pytest.raises(ScenarioError, match="importance_sampling"):
        parse_model(Scenario, to_yaml(off).replace("importance_sampling: false", "importance_sampling: seldom"))
