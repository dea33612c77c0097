"""Claims about arrays whose elements face all around: what lies behind the first is heard by the others."""

import numpy as np
import pytest

from insonify.engines.targets import target_points
from insonify.simulation import prepare
from oracles.scenes import nominal

ROUND = {"kind": "arc", "length": None, "steer": None, "radius": 0.1, "span": np.radians(300), "elements": 16}


def listening(causes, *, north=20.0, **receive):
    """A point that sends all around, in the middle of a ring of elements that each hear a half space."""
    return prepare(nominal(
        transmit={"kind": "point", "length": None, "element": "omni"}, receive={**ROUND, **receive},
        sonar={"receiver": {"record": "elements"}, "mounting": {"bearing": 0.0}},
        targets=[{"shape": "box", "label": "box", "position": (north, 0.0), "size": (2.0, 2.0, 2.0)}],
        track={"window": (0.0, 0.04)}, paths={"causes": causes, "scatterers_per_cell": 1.0, "beam_floor_db": -40.0},
    ))  # fmt: skip


def places(of):
    """Of all scatterers of one ping, (n, 3)."""
    return np.concatenate([block().position for block in of.engine.blocks(of.stance(0))])


def test_ground_behind_a_ring_is_met_as_that_before_it():
    """As many scatterers aft as ahead, to 4 standard errors of their counts."""
    north = places(listening(("seabed",)))[:, 0]
    ahead, aft = (north > 0).sum(), (north < 0).sum()
    assert abs(ahead - aft) < 4 * np.sqrt(ahead + aft)


@pytest.mark.parametrize("north", [20.0, -20.0])
def test_a_target_behind_a_ring_is_met(north):
    """A box ahead, and one behind: each has its points."""
    here = listening(("target",), north=north)
    scenario = here.scenario
    assert target_points(scenario.scene, scenario.paths, 1, here.stance(0), 0.1, even=False, rays=here.engine.rays)
    assert target_points(scenario.scene, scenario.paths, 1, here.stance(0), 0.1, even=False)


def test_elements_that_all_face_ahead_hear_nothing_of_what_is_behind():
    """The same places, all facing the bow: no point of the box, and of the ground only what a tile reaches over."""
    along = [(0.0, float(east), 0.0) for east in np.linspace(-0.1, 0.1, 16)]
    line = {"kind": "elements", "radius": None, "span": None, "elements": None, "places": along}
    here = listening(("seabed", "target"), north=-20.0, **line)
    assert places(here)[:, 0].min() > -10.0
