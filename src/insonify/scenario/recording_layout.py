"""Layout of the recording of a scenario: axes, true and logged poses, bins and lines of a recorder."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from insonify.records.recording import RecordingLayout
from insonify.scenario.platform_poses import receiver_seed
from insonify.scenario.scenario import Scenario
from insonify.sonar.platforms import Platforms
from insonify.sonar.sonar import channel_positions
from insonify.sonar.track.navigation_errors import NavigationSystem

if TYPE_CHECKING:
    from insonify.processing.recorded_lines import RecordedLines


def navigation_systems(scenario: Scenario, platforms: Platforms) -> list[NavigationSystem]:
    """Navigation system of each platform, of the transmitter's first."""
    tracks = [(scenario.track, scenario.seed)]
    if platforms.is_bistatic and scenario.receiver_track is not None:
        tracks.append((scenario.receiver_track, receiver_seed(scenario)))
    return [NavigationSystem(track.navigation_errors, track.interval, seed) for track, seed in tracks]


def recording_layout(
    scenario: Scenario, platforms: Platforms, time: NDArray[np.float64], lines: RecordedLines | None = None,
    systems: Sequence[NavigationSystem] = (),
) -> RecordingLayout:  # fmt: skip
    """Coordinates and attributes of a recording of some pings, without its time series.

    Args:
        scenario: The scenario.
        platforms: Its platforms at these pings.
        time: Time of each sample [s], shape (samples,).
        lines: Lines of its recorder; None: none are stored.
        systems: Navigation systems, which have logged the pings before; none: there are no pings before.
    """
    true, own_poses = platforms.transmitter_poses, platforms.separate_receiver_poses
    systems = systems or navigation_systems(scenario, platforms)
    logged, further = systems[0].log(true), dict[str, Any]()
    if own_poses is None:
        further["slant_range"] = time * scenario.water.sound_speed / 2
    else:
        logged_second = systems[1].log(own_poses)
        further = {
            "receiver_position": own_poses.position, "receiver_attitude": own_poses.attitude,
            "logged_receiver_position": logged_second.position, "logged_receiver_attitude": logged_second.attitude,
        }  # fmt: skip
    if lines is not None:
        from insonify.processing.recorder import recorded_time  # with xarray

        length = lines.recorder.pings_per_line
        further |= {
            "bin_time": recorded_time(time, lines.recorder), "recorded_units": lines.recorder.units,
            "line_ping": np.arange(true.time.size // length) * length, "keeps_field": lines.recorder.keep == "both",
        }  # fmt: skip
    return RecordingLayout(
        field="pressure" if scenario.field == "coherent" else "intensity", time=time, ping_time=true.time,
        steer=np.array(scenario.sonar.steers), side=np.array(scenario.sonar.channel_sides, dtype=float),
        element_position=channel_positions(scenario.sonar), position=true.position, attitude=true.attitude,
        logged_position=logged.position, logged_attitude=logged.attitude, **further,
    )  # fmt: skip
