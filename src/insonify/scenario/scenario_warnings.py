"""Warnings on scenarios that can be simulated but may not be what was meant: each given once, with its numbers."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from insonify.caller_warning import warn_caller
from insonify.ocean.profile_corners import ProfileCorner, profile_corners
from insonify.propagation.families import surface_bounces
from insonify.scattering.bubbles import bubble_loss_db
from insonify.scenario.aperture_warnings import aperture_warnings
from insonify.scenario.boundary_warnings import boundary_warning
from insonify.scenario.density_warnings import density_warnings
from insonify.scenario.expectation_warnings import expectation_warnings
from insonify.scenario.grating_lobe_warnings import grating_lobe_warnings
from insonify.scenario.inhomogeneity_warnings import inhomogeneity_warnings
from insonify.scenario.navigation_log_warnings import gap_warning, jump_warning
from insonify.scenario.platform_poses import platforms
from insonify.scenario.pulse_warnings import pulse_warnings
from insonify.scenario.range_warnings import range_warnings
from insonify.scenario.receiver_errors import receiver_warnings
from insonify.scenario.smooth_face_warnings import smooth_face_warnings
from insonify.scenario.terrain_errors import terrain_gap_warning
from insonify.scenario.turn_warnings import turn_warnings
from insonify.scenario.wave_warnings import wave_warnings
from insonify.scene.target import Target
from insonify.sonar.ping_geometry import array_depths
from insonify.sonar.received_pulse import received_pulse
from insonify.validity import PhysicsWarning

if TYPE_CHECKING:
    from insonify.scenario.scenario_parts import ScenarioParts

Floats = NDArray[np.float64]

TESTED_DEPTHS = 9
"""Number of sonar depths, from its shallowest to its deepest, at which profile corners are tested."""
THINNEST = 1e-3
"""Distance between knots of a profile below which a step of sound speed is likely to be measurement noise [m]."""
MAX_ABSORPTION_RATIO = 10.0
"""Ratio of a measured absorption to that of the law above which its unit is likely to be wrong [1]."""
MAX_LOST_ENERGY = 0.1
"""Share of the pulse's energy that a receiver may leave out without a word [1]."""


def scenario_warnings(scenario: ScenarioParts) -> None:
    """Warn of what can be simulated but may not be meant: laws, receiver, lobes, profile, log, ground, nearness."""
    sonar, water = scenario.sonar, scenario.water
    water.absorption(sonar.pulse.frequency)  # for the warning that its law gives of itself
    _bubbles(scenario)
    poses = platforms(scenario)
    depths = array_depths(sonar, poses)
    slowest = float(np.min(water.sound_speed_at(depths)))  # where waves are shortest, lobes are nearest
    messages = [
        *pulse_warnings(scenario),
        _narrow_receiver_warning(scenario),
        _profile_corners(scenario, np.linspace(depths[0], depths[-1], TESTED_DEPTHS)),
    ]
    messages += [*grating_lobe_warnings(scenario, slowest), terrain_gap_warning(scenario, poses.positions),
             _thin_layer_warning(scenario), jump_warning(scenario), gap_warning(scenario), boundary_warning(scenario),
             *range_warnings(scenario), *smooth_face_warnings(scenario),
             *inhomogeneity_warnings(scenario), *expectation_warnings(scenario),
             *density_warnings(scenario), _unused_water_warning(scenario), _absorption_warning(scenario),
             *_equal_target_warnings(scenario)]  # fmt: skip
    messages += [*receiver_warnings(scenario), *aperture_warnings(scenario, slowest / sonar.pulse.frequency),
             *turn_warnings(scenario, slowest / sonar.pulse.frequency)]  # fmt: skip
    if scenario.surface.reflection == "explicit":
        messages += wave_warnings(scenario, float(depths[0]))
    for sentence in filter(None, messages):
        warn_caller(sentence, PhysicsWarning)


def _bubbles(scenario: ScenarioParts) -> None:
    """Evaluate the loss of surface bounces to bubbles, if there are any, for the warnings that its law gives."""
    wind, bounced = scenario.surface.wind_speed, any(surface_bounces(name) for name in scenario.paths.followed_families)
    if wind and bounced and scenario.surface.reflection in ("statistical", "explicit"):
        bubble_loss_db(wind, scenario.sonar.pulse.frequency, np.pi / 2)


def _absorption_warning(scenario: ScenarioParts) -> str:
    """Warning on a measured absorption far above that of the law, as in a wrong unit; empty otherwise."""
    water, frequency = scenario.water, scenario.sonar.pulse.frequency
    if water.absorption_db_per_m is None:
        return ""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the law is only compared with, outside its range too
        by_law = float(water.unchecked_copy(absorption_db_per_m=None).absorption(frequency))
    stated = water.absorption_db_per_m
    if stated <= MAX_ABSORPTION_RATIO * by_law:
        return ""
    return (
        f"water.absorption_db_per_m: {stated:g} dB/m is {stated / by_law:.0f} times the {1e3 * by_law:.3g} dB/km of "
        f"the law at {frequency / 1e3:g} kHz. Did you mean {stated:g} dB/km? Write the unit."
    )


def _unused_water_warning(scenario: ScenarioParts) -> str:
    """Warning on scattering water that is not among the contributions; empty otherwise."""
    if not scenario.water.scatters or "water" in scenario.paths.contributions:
        return ""
    return (
        "paths.contributions: water is not among them, and its backscatter is not received. Add water, or leave "
        "contributions out."
    )


def _equal_target_warnings(scenario: ScenarioParts) -> Iterator[str]:
    """Warnings on targets that are equal, their labels apart: each echo would count twice."""
    rows = dict[Target, int]()
    for row, target in enumerate(scenario.targets):
        first = rows.setdefault(target.unchecked_copy(label=""), row)
        if first != row:
            yield (
                f"targets.{row} ({target.label}): it is all that targets.{first} ({scenario.targets[first].label}) is, "
                "at the same position: their echoes add up. Move it, or leave one of them out."
            )


def _narrow_receiver_warning(scenario: ScenarioParts) -> str:
    """Warning on a receiver that leaves out more than a tenth of the pulse; empty otherwise."""
    pulse, band = scenario.sonar.pulse, scenario.sonar.receiver.bandwidth
    lost = received_pulse(scenario.sonar).out_of_band_energy
    if lost <= MAX_LOST_ENERGY:
        return ""
    width = f"{pulse.bandwidth / 1e3:g} kHz" if pulse.bandwidth > 0 else f"{2e-3 / pulse.duration:g} kHz (2 / duration)"
    return (
        f"sonar.receiver.bandwidth: {band / 1e3:g} kHz is narrow for a pulse with a band of {width}; "
        f"{100 * lost:.0f} % of its energy is not recorded, and levels are lower by as much. Give a wider band."
    )


def _profile_corners(scenario: ScenarioParts, sonar_depths: Floats) -> str:
    """Warning on corners of the profile that make caustics; empty where there is none within the window's range."""
    water, bed = scenario.water, scenario.seabed.depth
    if not water.layered:
        return ""
    farthest = water.max_sound_speed * scenario.track.window[1] / 2
    profile, corners = water.profile_to_depth(bed), dict[float, ProfileCorner]()
    for depth in np.unique(sonar_depths):
        for kink in profile_corners(profile, float(depth), farthest):
            nearest = corners.get(kink.depth)
            if 0 < kink.depth < bed and (nearest is None or kink.caustic_range < nearest.caustic_range):
                corners[kink.depth] = kink
    if not corners:
        return ""
    first = next(iter(corners.values()))
    depths = " and ".join(f"{depth:g} m" for depth in corners)
    return (
        f"water.profile: the gradient jumps by {first.gradient_jump:.3g} 1/s at {depths}, which gathers rays to a "
        f"caustic from {first.caustic_range:.0f} m on that smooth water would have elsewhere or not at all. "
        "Give water.smoothing, such as 1 m, to round the corners, or a finer profile."
    )


def _thin_layer_warning(scenario: ScenarioParts) -> str:
    """Warning on knots of the profile so near to each other that digits decide the gradient; empty where none are."""
    written = scenario.water.profile
    if written is None:
        return ""
    depth, speed = np.array(written.depth), np.array(written.speed)
    thin = np.flatnonzero(np.diff(depth) < THINNEST * (1 - 1e-9))
    if not thin.size:
        return ""
    row = int(thin[0])
    others = "" if thin.size == 1 else f", the first of {thin.size} such steps"
    return (
        f"water.profile: {depth[row]:.9g} m and {depth[row + 1]:.9g} m are {np.diff(depth)[row]:.2g} m apart{others}; "
        f"their speeds of {speed[row]:.7g} and {speed[row + 1]:.7g} m/s make a gradient of "
        f"{np.diff(speed)[row] / np.diff(depth)[row]:.3g} 1/s. Give knots at least {THINNEST:g} m apart: leave one of "
        "the two out."
    )
