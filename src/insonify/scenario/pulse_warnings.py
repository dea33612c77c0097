"""Pulses that are implausibly long for what is recorded: more often a slip of units than a wish."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from insonify.scenario.scenario_parts import ScenarioParts

MAX_WINDOW_FRACTION = 0.1
"""Part of the time to the end of the window that a pulse may last without a warning [1]."""
LONGEST_ECHO = 20e-3
"""Length of a point's echo from which on range cells are implausibly long, 15 m [s]."""
LONGEST_IN_MS = 50.0
"""Greatest number that is a plausible duration in milliseconds [1]."""


def pulse_warnings(scenario: ScenarioParts) -> list[str]:
    """Warnings about a pulse that fills the recording, or whose echoes are longer than any sonar's."""
    pulse, stop = scenario.sonar.pulse, scenario.track.window[1]
    compressed = pulse.bandwidth > 0 and scenario.sonar.receiver.matched_filter
    echo = min(pulse.duration, 1 / pulse.bandwidth) if compressed else pulse.duration
    if pulse.duration <= MAX_WINDOW_FRACTION * stop and echo <= LONGEST_ECHO:
        return []
    speed = scenario.water.sound_speed
    meant = f"Did you mean {pulse.duration:g} ms?" if pulse.duration <= LONGEST_IN_MS else "Give a shorter pulse."
    return [
        f"sonar.pulse.duration: {pulse.duration * 1e3:g} ms, {100 * pulse.duration / stop:.3g} % of the time to the "
        f"end of track.window, during which {speed * pulse.duration / 2:.3g} m of range pass; a point's echo is "
        f"{speed * echo / 2:.3g} m long. {meant}"
    ]
