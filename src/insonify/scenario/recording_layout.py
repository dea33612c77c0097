"""Layout of the recording of a scenario: axes, true and logged poses, bins and lines of a recorder."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from insonify.records.recording import RecordingLayout
from insonify.scenario.platform_poses import receiver_seed
from insonify.scenario.scenario import Scenario
from insonify.sonar.platforms import Platforms
from insonify.sonar.sonar import channel_positions
from insonify.sonar.track import logged_poses

if TYPE_CHECKING:
    from insonify.processing.recorded_lines import RecordedLines


def recording_layout(
    scenario: Scenario, platforms: Platforms, time: NDArray[np.float64], lines: RecordedLines | None = None
) -> RecordingLayout:
    """All that a recording of a scenario holds besides its series.

    Args:
        scenario: What is simulated.
        platforms: Its platforms.
        time: Time of each sample [s], shape (samples,).
        lines: Lines of its recorder; None: none are stored.
    """
    true = platforms.transmitter_poses
    logged = logged_poses(scenario.track.navigation_errors, true, scenario.seed)
    own_poses, other = platforms.own_receiver_poses, scenario.receiver_track
    further: dict[str, Any] = {}
    if own_poses is not None and other is not None:
        logged_second = logged_poses(other.navigation_errors, own_poses, receiver_seed(scenario))
        further = {
            "receiver_position": own_poses.position, "receiver_attitude": own_poses.attitude,
            "logged_receiver_position": logged_second.position, "logged_receiver_attitude": logged_second.attitude,
        }  # fmt: skip
    if not further:
        further["slant_range"] = time * scenario.water.sound_speed / 2
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
