"""Radials that pass targets, against sample points in the cells of the radials."""

from types import SimpleNamespace

import numpy as np

from insonify.engines.fast_reverberation.radial_window import radials_crossing_targets
from oracles.few_of import few_of

SONAR = np.array([3.0, -2.0, 5.0])
HEADING = 0.7
COUNT = 256


def plan(cylinders, farthest=30.0):
    """Radials of equal cells all around the sonar, and cylinders about targets."""
    width = 2 * np.pi / COUNT
    bearings = -np.pi + width * (np.arange(COUNT) + 0.5)
    radials = np.zeros((COUNT, 9))
    radials[:, 0], radials[:, 1], radials[:, 2] = np.cos(bearings), np.sin(bearings), width
    radials[:, 5] = np.where(np.arange(COUNT) % 2, farthest, farthest / 3)
    return SimpleNamespace(radials=radials, bearings=bearings, bounding_cylinders=np.array(cylinders, float))


def mask(made, edges="none"):
    """Radials that pass each of the targets."""
    here = SimpleNamespace(transmit_position=SONAR, wavelength=0.005)
    return radials_crossing_targets(made, here, HEADING, edges)


@few_of((0, 1), "seed", range(4))
def test_radials_pass_the_targets_that_lie_over_their_cells(seed):
    """All cells with a sample point over a target are listed, and no cell whose bearings all miss the target."""
    rng = np.random.default_rng(seed)
    middle = SONAR[:2] + rng.uniform(-20, 20, (5, 2))
    made = plan(np.column_stack([middle, rng.uniform(0.3, 2.5, 5), np.zeros((5, 2))]))
    passes, across = mask(made), np.linspace(-0.5, 0.5, 41)[:, None]
    for target, (north, east, radius, *_) in zip(passes, made.bounding_cylinders, strict=True):
        for listed, bearing, radial in zip(target, made.bearings, made.radials, strict=True):
            turned, distance = HEADING + bearing + across * radial[2], np.linspace(0, 40, 400)
            offset = np.hypot(SONAR[0] + distance * np.cos(turned) - north, SONAR[1] + distance * np.sin(turned) - east)
            away = np.hypot(north - SONAR[0], east - SONAR[1])
            if (offset[:, distance < radial[5]] < radius - 0.05).any():
                assert listed
            elif (offset > radius + 0.1).all() or radial[5] < away - radius:
                assert not listed or away <= radius


def test_all_radials_pass_a_target_above_the_sonar_and_none_one_out_of_range():
    """A sonar within the cylinder of a target sees it all around; a target beyond the last sample shades none."""
    passes = mask(plan([[3.2, -2.1, 1.0, 0, 1], [3.0, 60.0, 1.0, 0, 1]]))
    assert passes[0].all() and not passes[1].any()
    assert mask(plan(np.empty((0, 5)))).shape == (0, COUNT)


def test_edge_diffraction_reaches_further_than_shadows():
    """Radials beside a target, within its penumbra, pass it where its edges diffract: as many on either side."""
    made = plan([[3.0, 18.0, 0.5, 0, 1]])
    hard, soft = mask(made)[0], mask(made, "knife-edge")[0]
    assert soft[hard].all() and soft.sum() >= hard.sum() + 2
    row = np.flatnonzero(made.radials[:, 5] > 20)
    ahead = np.mod(made.bearings[row] + HEADING - np.pi / 2 + np.pi, 2 * np.pi) - np.pi
    assert abs(ahead[soft[row]].mean()) < 2 * np.pi / COUNT
