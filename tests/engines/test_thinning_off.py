"""Claims about `paths.thinning: false`: every scatterer is drawn, every pair is met, and nobody else hears of it."""

import numpy as np
import pytest

from insonify.records.pairs import Product
from insonify.scenario.load import ScenarioError, parse
from insonify.scenario.scenario import Scenario
from insonify.scenario.write import to_yaml
from insonify.simulation import prepare, simulate
from oracles.scenes import nominal

ROUGH = {"depth": 20.0, "relief": {"kind": "power-law", "hurst": 0.8, "rms": 0.05}}


def ground(*, thinning, seabed=ROUGH, **more):
    """Ground 60 to 65 m away, of 40 cm lines, and its scenario prepared."""
    paths = {"reflections": 1, "causes": ["seabed"], "thinning": thinning, **more.pop("paths", {})}
    line = {"length": 0.4, "elements": 56, "element": "baffled"}
    told = {"seabed": seabed, "track": {"window": (0.08, 0.086)}, "line": line, "paths": paths}
    return prepare(nominal(**{**told, **more}))


def drawn(listening):
    """Places, areas and distances of all scatterers of the ground, in the order of their keys."""
    here = listening.stance(0)
    blocks = [block() for block in listening.engine.blocks(here)]
    key, area = (np.concatenate([getattr(one, name) for one in blocks]) for name in ("place", "area"))
    place = np.concatenate([one.position for one in blocks])
    order = np.argsort(key)
    return key[order], area[order], place[order]


@pytest.mark.parametrize("seabed", [ROUGH, {"depth": 20.0}], ids=["rough", "flat"])
def test_those_left_are_some_of_all(seabed):
    """Whoever is drawn with thinning is drawn without it, at the same place, no smaller; and they are fewer."""
    few, all_of_them = (drawn(ground(thinning=on, seabed=seabed)) for on in (True, False))
    found = np.searchsorted(all_of_them[0], few[0])
    np.testing.assert_array_equal(all_of_them[0][found], few[0])
    np.testing.assert_array_equal(all_of_them[2][found], few[2])
    assert (few[1] >= all_of_them[1][found] * (1 - 1e-6)).all()
    assert len(few[0]) < 0.8 * len(all_of_them[0])


def test_areas_of_those_left_come_to_the_whole():
    """Each stands for others: the sum of areas is that of all, within 4 standard errors, which are below 4 %."""
    few, all_of_them = (
        drawn(ground(thinning=on, seabed={"depth": 20.0}, paths={"scatterers_per_cell": 30.0})) for on in (True, False)
    )
    found = np.searchsorted(all_of_them[0], few[0])
    own = all_of_them[1][found]
    error = np.sqrt(np.sum(few[1] ** 2 * (1 - own / few[1])))  # kept by chance own / area
    assert error < 0.04 * all_of_them[1].sum()
    assert abs(few[1].sum() - all_of_them[1].sum()) < 4 * error


def test_all_pairs_are_met_everywhere():
    """Rough ground, 9 pairs: no shares, no number; each pair answers at each place whose two legs are there."""
    listening = ground(thinning=False, paths={"reflections": 2})
    here = listening.stance(0)
    assert listening.engine.met(here, np.array([50.0])) is None
    for block in listening.engine.blocks(here):
        pairs = listening.engine.pairs(here, block, drowned=False)
        assert isinstance(pairs.answer, Product) and pairs.answer.thinned is None
        i, j = pairs.pair.T
        there = (pairs.out.amplitude[i] != 0) & (pairs.back.amplitude[j] != 0) & (pairs.out.grazing[i] != 0)
        assert (pairs.strength[there & (pairs.back.grazing[j] != 0)] > 0).all()


@pytest.mark.parametrize("thinning", [True, False])
def test_elements_and_beams_have_one_ground(thinning):
    """Within 11 degrees a line recorded by its elements draws the places that its beam does; with thinning, others."""
    lobes = {"transmit": {"kind": "point", "length": None, "elements": None, "element": "omni"}}
    one, other = (
        drawn(ground(thinning=thinning, sonar={"receiver": {"band": 20e3, "record": record}}, **lobes))
        for record in ("beams", "elements")
    )
    inner = [set(key[np.hypot(place[:, 0], place[:, 1] - 60.5) < 12].tolist()) for key, _, place in (one, other)]
    assert len(inner[0]) > 100 and (inner[0] == inner[1]) != thinning


def test_expected_intensities_do_not_know_it():
    """Nothing is drawn for them: the same bits."""
    heard = [simulate(ground(thinning=on).scenario.model_copy(update={"field": "incoherent"}), threads=1)
             for on in (True, False)]  # fmt: skip
    np.testing.assert_array_equal(*(one.intensity.values for one in heard))
    assert heard[0].intensity.values.max() > 0


def test_targets_alone_do_not_know_it():
    """A ball and no ground: the same bits with and without."""
    ball = [{"shape": "sphere", "label": "ball", "diameter": 0.6, "position": (0.0, 60.0)}]
    heard = [
        simulate(ground(thinning=on, targets=ball, paths={"causes": ["target"]}).scenario, threads=1).pressure.values
        for on in (True, False)
    ]
    np.testing.assert_array_equal(*heard)
    assert np.abs(heard[0]).max() > 0


def test_the_choice_is_written_and_read():
    """A file says it, says it again when written out, and says true by itself; what is no yes or no is refused."""
    assert nominal().paths.thinning
    off = nominal(paths={"thinning": False})
    assert "thinning: false" in to_yaml(off)
    assert parse(Scenario, to_yaml(off)) == off
    with pytest.raises(ScenarioError, match="thinning"):
        parse(Scenario, to_yaml(off).replace("thinning: false", "thinning: seldom"))
