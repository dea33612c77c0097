"""Warnings on arrays that are not what they seem: beams out of focus, and elements that receive the same sound."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from insonify.sonar.array import LineArray, PlanarArray, PointTransducer
from insonify.sonar.hydrophones import element_layout

if TYPE_CHECKING:
    from insonify.scenario.scenario_parts import ScenarioParts

CLOSEST = 0.02
"""Distance between elements below which they receive the same but for their noise [wavelengths]."""


def aperture_warnings(scenario: ScenarioParts, wavelength: float) -> Iterator[str]:
    """Words on the arrays of a sonar.

    Args:
        scenario: The scenario.
        wavelength: Wavelength of the sound at the sonar [m].
    """
    farthest = scenario.track.window[1] * scenario.water.max_sound_speed / 2
    keys: dict[str, list[str]] = {}
    for end, array in zip(("transmit", "receive"), scenario.sonar.beam_arrays, strict=False):
        keys.setdefault(_near_field_warning(array, wavelength, farthest), []).append(f"sonar.{end}")
    yield from (f"{' and '.join(ends)}: {words}" for words, ends in keys.items() if words)
    yield _crowded(scenario, wavelength)


def _near_field_warning(array: LineArray | PlanarArray | PointTransducer, wavelength: float, farthest: float) -> str:
    """Warning on an array so long that its whole range lies in its near field, where its beam is no far-field pattern.

    At a quarter of L^2 / wavelength the wavefront of a point is curved by half a wavelength over the array.
    """
    size = _size(array)
    if size**2 / (4 * wavelength) <= farthest:
        return ""
    return (
        f"beams are far-field patterns, which for {size:.3g} m at {1e3 * wavelength:.3g} mm of wavelength "
        f"hold from about {size**2 / wavelength:.3g} m on, and the recording ends at {farthest:.3g} m: a real one that "
        "is not focused would be wider. Write sonar.receiver.record: elements and focus afterwards, or a shorter array."
    )


def _size(array: LineArray | PlanarArray | PointTransducer) -> float:
    """Longest side of an array [m]."""
    if isinstance(array, LineArray):
        return float(array.length)
    return float(max(array.width, array.height)) if isinstance(array, PlanarArray) else 0.0


def _crowded(scenario: ScenarioParts, wavelength: float) -> str:
    """Warning on recorded elements that lie at one position, or nearly."""
    if scenario.sonar.receiver.record != "elements":
        return ""
    from scipy.spatial import cKDTree

    positions = element_layout(scenario.sonar.receive)[0]
    if len(positions) < 2:
        return ""
    spacing = cKDTree(positions).query(positions, k=2)[0][:, 1]
    if spacing.min() >= CLOSEST * wavelength:
        return ""
    row = int(np.argmin(spacing))
    return (
        f"sonar.receive: element {row} is {1e3 * spacing[row]:.3g} mm from another, {spacing[row] / wavelength:.2g} "
        "wavelengths: they receive the same sound, and no beam is sharper for it. Give fewer elements, or a larger one."
    )
