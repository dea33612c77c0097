"""Strips of the outline of a flat face: merged where their edges are nearly level."""

import numpy as np
import pytest

from insonify.scene import flat_faces as module
from insonify.scene.flat_faces import _merge_strips, flat_faces
from insonify.simulator import build_simulator, simulate
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
    merged, gap, at_surface = _merge_strips(boxes, np.zeros(64), np.zeros(64, bool), 4e-3)
    begin, end = merged[:, 1] - merged[:, 5], merged[:, 1] + merged[:, 5]
    assert 5 < len(merged) < 32 and not gap.any() and not at_surface.any()
    np.testing.assert_allclose([begin[0], end[-1]], [3.0, 6.2])
    np.testing.assert_allclose(begin[1:], end[:-1])
    area = [np.sum(one[:, 5] * (one[:, 7] - one[:, 6])) for one in (boxes, merged)]
    assert area[1] == pytest.approx(area[0], rel=1e-12)
    within = merged[np.searchsorted(end, boxes[:, 1]), 7]
    assert np.abs(within - boxes[:, 7]).max() < 4e-3


def test_strips_that_stand_on_the_ground_do_not_join_those_above_it() -> None:
    """Nor do strips at the surface and below it, or strips with another between them; equal ones are one."""
    boxes, none = outline(np.full(10, 5.0)), np.zeros(10, bool)
    merged, gap, _ = _merge_strips(boxes, np.array([0, 0, 0, 1e-4, 1e-4, 0, 0, 0, 0, 0]), none, 1e-2)
    assert len(merged) == 3 and gap.tolist() == [0.0, 1e-4, 0.0]
    merged, _, at_surface = _merge_strips(boxes, np.zeros(10), np.arange(10) < 4, 1e-2)
    assert len(merged) == 2 and at_surface.tolist() == [True, False]
    assert len(_merge_strips(boxes[[0, 1, 3]], np.zeros(3), none[:3], 1e-2)[0]) == 2
    assert len(_merge_strips(boxes[:1], np.zeros(1), none[:1], 1e-2)[0]) == 1


@pytest.mark.parametrize("width", [0.7, 1.1, 1.2, 1.7, 2.0, 2.3])
def test_gaps_without_ground_stay_infinite(width: float) -> None:
    """Whatever the widths of the strips: a strip above unknown ground has no image in it."""
    boxes = outline(np.full(64, 5.0))
    boxes[:, 1], boxes[:, 5] = (np.arange(64) + 0.5) * width / 64, width / 128
    merged, gap, _ = _merge_strips(boxes, np.full(64, np.inf), np.zeros(64, bool), 4e-3)
    assert len(merged) == 1 and np.isinf(gap).all()
    mixed = _merge_strips(boxes, np.where(np.arange(64) < 9, np.inf, 1.0), np.zeros(64, bool), 4e-3)[1]
    np.testing.assert_allclose(mixed, [np.inf, 1.0])


def test_sides_of_a_box_over_relief_have_few_strips_and_its_lid_one() -> None:
    """A box of 2 m by 1 m at 100 kHz: a strip for each 4 mm by which the ground rises or falls along it."""
    scene = nominal(seabed={"relief": RELIEF, "seed": 5}, box={"position": (0.0, 82.0)})
    scene = scene.with_("targets.0.face_reflection_coefficient", 0.9)
    simulator = build_simulator(scene)
    faces = flat_faces(simulator.engine.scene, simulator.ping_geometry(0).wavelength)
    counts = [len(face.strips) for face in faces if face.is_upright]
    assert len(counts) == 4 and max(counts) < 32
    assert [len(face.strips) for face in faces if face.axes[0, 2] < -0.99] == [1]


def test_merged_strips_sound_as_strips_do(monkeypatch) -> None:
    """The bed before a box over relief, by its faces: to -66 dB of the sound with 64 strips a face; by one, -60 dB.

    The window has the echoes by bed and face, which take as long as that of the face.
    """
    scene = nominal(
        seabed={"relief": RELIEF, "seed": 5}, box={"position": (0.0, 82.0)}, line={"length": 0.1},
        track={"window": (0.1085, 0.1095)},
        paths={"max_reflections": 1, "face_reflections": True, "scatterers_per_cell": 1},
    ).with_("targets.0.face_reflection_coefficient", 0.9)  # fmt: skip
    sound = []
    for step in (0.25, 0.0):
        monkeypatch.setattr(module, "STEP_WAVELENGTHS", step)
        flat_faces.cache_clear()
        sound.append(simulate(scene).pressure.values)
    flat_faces.cache_clear()
    assert 0 < np.linalg.norm(sound[0] - sound[1]) < 5e-4 * np.linalg.norm(sound[1])
