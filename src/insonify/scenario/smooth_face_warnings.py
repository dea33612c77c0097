"""Words on smooth faces of targets: more sound than they got, the tracer."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from insonify.scattering.lambert import Lambert
from insonify.scene.target import PointTarget, key_label, solids_of_one_law
from insonify.units import intensity_ratio

if TYPE_CHECKING:
    from insonify.scenario.scenario_parts import ScenarioParts


def smooth_face_warnings(scenario: ScenarioParts) -> Iterator[str]:
    """A sentence on each doubtful smooth face."""
    named = [
        (f"targets.{row}", faces)
        for row, target in enumerate(scenario.targets) if not isinstance(target, PointTarget)
        for faces in solids_of_one_law(target)
    ]  # fmt: skip
    for key, target in named:
        smooth = target.face_reflection_coefficient
        if not smooth:
            continue
        name = f"{key}.face_reflection_coefficient ({key_label(target)})"
        rough = _albedo(target.scattering)
        if smooth**2 + rough > 1 + 1e-9:
            most = f"a magnitude up to {np.floor(100 * np.sqrt(max(1 - rough, 0))) / 100:g}, or" if rough < 1 else ""
            yield (
                f"{name}: {smooth:g} and a scattering strength of {target.scattering.strength_db:g} dB together send "
                f"back {100 * (smooth**2 + rough):.0f} % of the sound. Write {most} a lower strength."
            )
        if scenario.paths.engine == "tracer":
            yield (
                f"{name}: the tracer lets rays go on from smooth faces, but simulates no flash of theirs. For flashes "
                "write engine: eigenrays under paths."
            )


def _albedo(law: Lambert) -> float:
    """Share of the sound that a rough face scatters [1]."""
    return float(np.pi * intensity_ratio(law.strength_db))
