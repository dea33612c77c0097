"""Words on smooth faces of targets: more sound than they got, round bodies that are not round enough, the tracer."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from insonify.scattering.lambert import Lambert
from insonify.scene.smooth_faces import MOST_AROUND, phase_of_steps
from insonify.units import intensity_ratio

if TYPE_CHECKING:
    from insonify.scenario.scenario import Scenario

COARSE = np.pi / 4
"""Change of an echo's phase by the steps of a round body from which on there is a word about it [rad]."""


def smooth_cautions(scenario: Scenario) -> Iterator[str]:
    """A sentence on each doubtful smooth face.

    Args:
        scenario: A scenario without faults.
    """
    wavelength = scenario.water.slowest / scenario.sonar.pulse.frequency
    for row, target in enumerate(scenario.targets):
        smooth = getattr(target, "smooth", None)
        if not smooth or target.shape == "point":
            continue
        name = f"targets.{row}.smooth ({target.label})"
        rough = _albedo(target.scattering)
        if smooth**2 + rough > 1 + 1e-9:
            most = f"smooth up to {np.floor(100 * np.sqrt(max(1 - rough, 0))) / 100:g}, or" if rough < 1 else ""
            yield (
                f"{name}: {smooth:g} and a scattering strength of {target.scattering.strength_db:g} dB together send "
                f"back {100 * (smooth**2 + rough):.0f} % of the sound. Write {most} a lower strength."
            )
        bend = phase_of_steps(target, MOST_AROUND, wavelength)
        if bend > COARSE:
            yield (
                f"{name}: the body is {MOST_AROUND} steps round at most, which turn the phase of its echoes by up to "
                f"{bend:.1g} rad at this frequency, so that flashes are not exact. Leave smooth out, or lower the "
                "frequency."
            )
        if scenario.paths.engine == "tracer":
            yield (
                f"{name}: the tracer lets rays go on from smooth faces, but hears no flash of theirs. For flashes "
                "write engine: paths under paths."
            )


def _albedo(law: Lambert) -> float:
    """Share of the sound that a rough face scatters [1]."""
    return float(np.pi * intensity_ratio(law.strength_db))
