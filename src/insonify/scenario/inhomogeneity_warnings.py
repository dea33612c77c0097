"""Warnings where uneven water does more than delay, and where an array is larger than the patches of equal delay."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from insonify.ocean.inhomogeneity import wave_parameter
from insonify.sonar.hydrophones import element_layout

if TYPE_CHECKING:
    from insonify.scenario.scenario_parts import ScenarioParts

SHARED = 0.5
"""Largest extent of an array whose elements are taken to share their delays, re the patches' length [1]."""


def inhomogeneity_warnings(scenario: ScenarioParts) -> list[str]:
    """Words on patches so small that they scatter, and on arrays that span several; none in even water."""
    uneven, sonar = scenario.water.inhomogeneity, scenario.sonar
    if uneven is None or uneven.rms_index == 0:
        return []
    warnings, length = [], scenario.water.max_sound_speed * scenario.track.window[1] / 2
    wavelength = scenario.water.sound_speed / sonar.pulse.frequency
    if (size := wave_parameter(length, wavelength, uneven)) > 1:
        least = float(np.sqrt(size)) * uneven.correlation_length
        warnings.append(
            f"water.inhomogeneity.correlation_length: over {length:.4g} m patches of {uneven.correlation_length:g} m "
            f"bend the sound as much as they delay it (4 R / (k l^2) is {size:.2g}, and 1 is the limit): amplitudes "
            f"would flicker, and are steady. Give patches of {least:.2g} m or more, or a shorter window."
        )
    if sonar.receiver.record == "elements":
        extent = float(np.ptp(element_layout(sonar.receive)[0], axis=0).max())
        if extent > SHARED * uneven.correlation_length:
            warnings.append(
                f"water.inhomogeneity.correlation_length: the receive array is {extent:.3g} m long, and all its "
                f"elements share the delays of its centre, as in patches of {extent / SHARED:.3g} m; these are of "
                f"{uneven.correlation_length:g} m. Give larger ones, or a shorter array."
            )
    return warnings
