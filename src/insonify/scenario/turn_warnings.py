"""Warnings on platforms that turn during a ping: the receive beam no longer points where the pulse was transmitted."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from insonify.scenario.platform_poses import platforms
from insonify.sonar.array import LineArray, PlanarArray, PointTransducer

if TYPE_CHECKING:
    from insonify.scenario.scenario_parts import ScenarioParts

MIN_LOSS_DB = 1.5
"""Loss at the end of the window from which on there is a warning [dB]."""
MAX_LOSS_DB = 10.0
"""Loss beyond which side lobes decide, and a Gaussian beam does not apply [dB]."""
GAUSSIAN = 2 * np.sqrt(2 * np.log(2))
"""Full width at half power over the standard deviation of a Gaussian beam [1]."""
APERTURE = 0.886
"""Full width at half power of a uniform line, over wavelength by length [rad]."""


def turn_warnings(scenario: ScenarioParts, wavelength: float) -> list[str]:
    """Warnings about turns during which echoes come back beside the receive beam; none where they are slow.

    Args:
        scenario: A scenario without faults.
        wavelength: Wavelength of the sound at the sonar [m].
    """
    turned = _turned(scenario)
    if not turned.size:
        return []
    loss = turn_loss_db(float(turned.max()), _widths(scenario, wavelength))
    if loss < MIN_LOSS_DB:
        return []
    ping = int(turned.argmax())
    lost = f"about {loss:.0f} dB" if loss < MAX_LOSS_DB else f"{MAX_LOSS_DB:.0f} dB and more"
    many = int((turned > turned.max() / 2).sum())
    return [
        f"track: at ping {ping} the platform turns by {np.degrees(turned[ping]):.2g} deg before the window ends "
        f"(at {many} ping{'s' * (many != 1)} by half of that or more), and the latest echoes come back beside the "
        f"receive beam, {lost} weaker; the platform's own motion adds to that on the outside of the turn and "
        "takes from it on the inside, so that one side is darker. Real sonars have that; turn more slowly, take wider "
        "beams or a shorter window, or leave it out with track.stop_and_hop: true."
    ]


def turn_loss_db(turned: float, widths: tuple[float, float]) -> float:
    """Loss of an extended bed's echo through two Gaussian beams of which one has turned [dB].

    Args:
        turned: Angle between their axes, across their narrow width [rad].
        widths: Full widths at half power of the transmit and the receive beam [rad].

    Source: the product of two Gaussians a distance d apart has exp(-d^2 / 2 (s1^2 + s2^2)) of its integral.
    """
    variance = sum((width / GAUSSIAN) ** 2 for width in widths)
    return float(10 / np.log(10) * turned**2 / (2 * variance)) if variance > 0 else 0.0


def _turned(scenario: ScenarioParts) -> np.ndarray:
    """Change of heading from the start of each ping to the end of its window [rad], shape (pings,); empty: none."""
    poses = platforms(scenario)
    if poses.transmitter_window_poses is None or poses.is_bistatic or scenario.sonar.receiver.record == "elements":
        return np.zeros(0)
    change = poses.transmitter_window_poses[1].heading - poses.transmitter_poses.heading
    return np.asarray(np.abs(np.angle(np.exp(1j * change))))


def _widths(scenario: ScenarioParts, wavelength: float) -> tuple[float, float]:
    """Widths of the transmit and the receive beam in the plane of heading [rad]; half a turn where they are points."""
    first, second = (_width(array, wavelength) for array in scenario.sonar.beam_arrays[:2])
    return first, second


def _width(array: LineArray | PlanarArray | PointTransducer, wavelength: float) -> float:
    size = array.length if isinstance(array, LineArray) else array.width if isinstance(array, PlanarArray) else 0.0
    return min(APERTURE * wavelength / size, np.pi) if size > 0 else np.pi
