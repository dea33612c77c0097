"""Claims about arrays whose elements face all around: what lies behind the first is received by the others."""

import numpy as np
import pytest

from insonify.engines.targets import target_points
from insonify.simulator import build_simulator
from oracles.scenes import nominal

ROUND = {"kind": "arc", "length": None, "steer": None, "radius": 0.1, "arc_angle": np.radians(300), "elements": 16}


def simulator(contributions, *, north=20.0, **receive):
    """A point that sends all around, in the middle of a ring of elements that each receive a half space."""
    return build_simulator(nominal(
        transmit={"kind": "point", "length": None, "element": "omni"}, receive={**ROUND, **receive},
        sonar={"receiver": {"record": "elements"}, "mounting": {"bearing": 0.0}},
        targets=[{"shape": "box", "label": "box", "position": (north, 0.0), "size": (2.0, 2.0, 2.0)}],
        track={"window": (0.0, 0.04)},
        paths={"contributions": contributions, "scatterers_per_cell": 1.0, "beam_cutoff_db": -40.0},
    ))  # fmt: skip


def places(of):
    """Of all scatterers of one ping, (n, 3)."""
    return np.concatenate([block().position for block in of.engine.blocks(of.ping_geometry(0))])


def test_a_ring_receives_ground_behind_it_as_that_before_it():
    """As many scatterers aft as ahead, to 4 standard errors of their counts."""
    north = places(simulator(("seabed",)))[:, 0]
    ahead, aft = (north > 0).sum(), (north < 0).sum()
    assert abs(ahead - aft) < 4 * np.sqrt(ahead + aft)


@pytest.mark.parametrize("north", [20.0, -20.0])
def test_a_ring_receives_a_target_behind_it(north):
    """A box ahead, and one behind: each has its points."""
    here = simulator(("target",), north=north)
    scenario = here.scenario
    assert target_points(
        scenario.scene, scenario.paths, 1, here.ping_geometry(0), 0.1, quadrature=False, rays=here.engine.rays
    )
    assert target_points(scenario.scene, scenario.paths, 1, here.ping_geometry(0), 0.1, quadrature=False)


def test_elements_that_all_face_ahead_receive_nothing_of_what_is_behind():
    """The same positions, all facing the bow: no point of the box, and of the seabed only what a tile reaches over."""
    along = [(0.0, float(east), 0.0) for east in np.linspace(-0.1, 0.1, 16)]
    line = {"kind": "elements", "radius": None, "arc_angle": None, "elements": None, "positions": along}
    here = simulator(("seabed", "target"), north=-20.0, **line)
    assert places(here)[:, 0].min() > -10.0
