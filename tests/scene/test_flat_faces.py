"""Strips of the outline of a flat face: merged where their edges are nearly level."""

import numpy as np
import pytest

from insonify.scene.flat_faces import _merged, flat_faces
from insonify.simulator import build_simulator
from oracles.scenes import nominal

RELIEF = {"kind": "power-law", "hurst": 0.8, "rms": "5 cm", "outer_scale": "10 m"}


def outline(base: np.ndarray) -> np.ndarray:
    """Strips of 5 cm, side by side from 3 m on, with tops at 4 m and bases at some depths."""
    boxes = np.zeros((len(base), 8))
    boxes[:, 1], boxes[:, 2], boxes[:, 5] = 3.025 + 0.05 * np.arange(len(base)), 1.0, 0.025
    boxes[:, 6], boxes[:, 7] = 4.0, base
    return boxes


def test_merged_strips_cover_the_same_outline_within_a_step() -> None:
    """A random walk of the base: the same ends and area, no gap between strips, and no edge off by more than a step."""
    boxes = outline(5 + np.cumsum(np.random.default_rng(4).normal(0, 2e-3, 64)))
    merged, gap = _merged(boxes, np.zeros(64), 4e-3)
    begin, end = merged[:, 1] - merged[:, 5], merged[:, 1] + merged[:, 5]
    assert 5 < len(merged) < 32 and not gap.any()
    np.testing.assert_allclose([begin[0], end[-1]], [3.0, 6.2])
    np.testing.assert_allclose(begin[1:], end[:-1])
    area = [np.sum(one[:, 5] * (one[:, 7] - one[:, 6])) for one in (boxes, merged)]
    assert area[1] == pytest.approx(area[0], rel=1e-12)
    within = merged[np.searchsorted(end, boxes[:, 1]), 7]
    assert np.abs(within - boxes[:, 7]).max() < 4e-3


def test_strips_that_stand_on_the_ground_do_not_join_those_above_it() -> None:
    """Nor do strips with another between them; one strip, or equal ones, are one."""
    boxes, gap = outline(np.full(10, 5.0)), np.array([0, 0, 0, 1e-4, 1e-4, 0, 0, 0, 0, 0])
    merged, left = _merged(boxes, gap, 1e-2)
    assert len(merged) == 3 and left.tolist() == [0.0, 1e-4, 0.0]
    assert len(_merged(boxes[[0, 1, 3]], np.zeros(3), 1e-2)[0]) == 2
    assert len(_merged(boxes[:1], np.zeros(1), 1e-2)[0]) == len(_merged(boxes, np.full(10, np.inf), 1e-2)[0]) == 1


def test_sides_of_a_box_over_relief_have_few_strips_and_its_lid_one() -> None:
    """A box of 2 m by 1 m at 100 kHz: a strip for each 4 mm by which the ground rises or falls along it."""
    scene = nominal(seabed={"relief": RELIEF, "seed": 5}, box={"position": (0.0, 82.0)})
    scene = scene.with_("targets.0.face_reflection_coefficient", 0.9)
    simulator = build_simulator(scene)
    faces = flat_faces(simulator.engine.scene, simulator.ping_geometry(0).wavelength)
    counts = [len(face.strips) for face in faces if face.is_upright]
    assert len(counts) == 4 and max(counts) < 32
    assert [len(face.strips) for face in faces if face.axes[0, 2] < -0.99] == [1]
