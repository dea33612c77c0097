"""Errors of smooth faces that lie on one another: their flash and the sound they reflect would count twice."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from pydantic_core import PydanticCustomError

from insonify.model import field_error
from insonify.scene.flat_faces import FlatFace, flat_faces

if TYPE_CHECKING:
    from insonify.scenario.scenario_parts import ScenarioParts

GAP, SLOPE = 1e-3, 1e-3
"""Distance [m] and sine of the angle between two faces below which neither hides the other."""
LAP = 1e-3
"""Width to which two faces may lie on one another, as neighbours with a common edge do [m]."""


def overlapping_face_errors(scenario: ScenarioParts) -> Iterator[PydanticCustomError]:
    """Errors of faces of different targets that reflect sound from the same point.

    Args:
        scenario: The scenario, whose targets have passed their own checks.
    """
    scene = scenario.scene
    shortest = scene.water.max_sound_speed / scenario.sonar.pulse.frequency
    faces = sorted(flat_faces(scene, shortest), key=lambda face: face.distance)
    rows, seen = {target.label: row for row, target in enumerate(scenario.targets)}, set[tuple[str, str]]()
    for number, one in enumerate(faces):
        for other in faces[number + 1 :]:
            if other.distance - one.distance > GAP:
                break
            names = tuple(sorted((one.label, other.label), key=rows.__getitem__))
            if one.label == other.label or names in seen or not _overlap(one, other):
                continue
            seen.add((names[0], names[1]))
            first, second = names
            yield field_error(
                f"targets.{rows[second]}.position", None, f"a smooth face of {second} lies on one of {first}: their "
                f"reflections would count twice. Move {second} by {2 * GAP * 1e3:g} mm or more off that plane, or make "
                "one target of the two.",
            )  # fmt: skip


def _overlap(one: FlatFace, other: FlatFace) -> bool:
    """True where two faces in planes of about one distance from the origin lie on one another."""
    if np.linalg.norm(one.axes[0] - other.axes[0]) > SLOPE:
        return False
    (low, high), (first, last) = _sides(one), _sides(other)
    lap = np.minimum(high[:, None], last[None]) - np.maximum(low[:, None], first[None])
    return bool((lap > LAP).all(axis=2).any())


def _sides(face: FlatFace) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Least and greatest position along and down of the strips of a face [m], each shape (k, 2)."""
    along, half, top, base = face.strips[:, 1], face.strips[:, 5], face.strips[:, 6], face.strips[:, 7]
    return np.stack([along - half, top], axis=1), np.stack([along + half, base], axis=1)
