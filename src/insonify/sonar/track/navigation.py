"""Track of a platform from the log of its navigation system."""

from functools import lru_cache
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from insonify.data_file import DataFile, file_digest
from insonify.model import Seconds, field_error
from insonify.sonar.navigation_file import NavigationLog, read_navigation
from insonify.sonar.track.ping_schedule import PingCount, PingSchedule, checked_ping_count, max_ping_count, ping_times
from insonify.sonar.track.poses import Poses

Floats = NDArray[np.float64]

GAP_STEPS = 10.0
"""Median steps of a log beyond which a pause between its rows is a gap [1]."""
MIN_GAP = 1.0
"""Shortest pause between rows that is a gap [s]."""


class NavigationTrack(PingSchedule):
    """Track from a navigation log, with linear interpolation of positions and angles between its rows.

    Example:
        >>> log = [(0, 0, 0, 5, 90), (10, 0, 20, 5, 90)]
        >>> np.savetxt("log.csv", log, delimiter=",", header="time,north,east,depth,heading [deg]", comments="")
        >>> track = NavigationTrack(file="log.csv", interval="5 s")
        >>> true_poses(track).position.round(3).tolist()
        [[0.0, 0.0, 5.0], [0.0, 10.0, 5.0], [0.0, 20.0, 5.0]]
    """

    kind: Literal["navigation"] = "navigation"
    file: DataFile
    """Table of comma-separated values with a header: time, north and east (or latitude and longitude), depth,
    heading, optionally pitch and roll. Path relative to the scenario file's folder, or absolute."""
    sha256: str = ""
    """SHA-256 digest of the file, filled in when it is read, so that a recording identifies its navigation log."""
    origin: tuple[Annotated[float, Field(ge=-90, le=90)], Annotated[float, Field(ge=-360, le=360)]] | None = None
    """Latitude [deg] and longitude [deg] of north 0, east 0; None: the first row. Only for logs in degrees."""
    start: Seconds = Field(default=0.0, ge=0, le=1e9)
    """Time of the first ping after the log's first row [s]."""
    pings: PingCount | None = None
    """Number of pings [1]; None: as many as fit before the log ends."""
    longest_gap: Annotated[Seconds, Field(gt=0, le=1e9)] | None = None
    """Longest pause between rows over which poses are interpolated [s]; None: ten median steps of the log, at least
    1 s."""

    @model_validator(mode="after")
    def _check_track(self) -> Self:
        log = self.log()
        self.__dict__["sha256"] = file_digest(self.file)  # frozen from here on
        end = float(log.time[-1])
        if self.start > end:
            raise field_error("start", f"{self.start:g} s", f"is after the log's last row, {end:g} s after its first. "
                          "Start earlier.")  # fmt: skip
        checked_ping_count(
            self.pings, self._max_pings(log), "pings", end=f"the end of the log, {end:.10g} s after its first row"
        )
        self._require_log_coverage(log)
        return self

    def log(self) -> NavigationLog:
        """Content of the log's file.

        Raises:
            PydanticCustomError: The file cannot be read, or has changed.
        """
        try:
            digest = file_digest(self.file)
            if self.sha256 and digest != self.sha256:
                raise ValueError(
                    f"{self.file} is not the file that it was: its sha256 is {digest[:12]}..., and "
                    f"{self.sha256[:12]}... is required. Restore the file, or leave sha256 out."
                )
            log = _read(self.file, digest, self.origin)
        except OSError as fault:
            raise field_error("file", self.file, f"cannot be read: {fault.strerror or fault}. Give the log's path, as "
                          "seen from the scenario file.") from None  # fmt: skip
        except ValueError as fault:
            raise field_error("file", None, str(fault)) from None
        return log

    def default_longest_gap(self) -> float:
        """Longest pause between rows that is no gap of this log [s]: ten of its median steps, at least 1 s."""
        return max(MIN_GAP, GAP_STEPS * float(np.median(np.diff(self.log().time))))

    def _max_pings(self, log: NavigationLog) -> int:
        """Largest number of pings from the start to the end of the log."""
        return max_ping_count(float(log.time[-1]) - self.start, self.interval)

    def _require_log_coverage(self, log: NavigationLog) -> None:
        """Refuse pings in a gap of the log."""
        step = np.diff(log.time)
        longest_gap = self.longest_gap or self.default_longest_gap()
        time = self.start + ping_times(self.ping_count, self.interval)
        row = np.clip(np.searchsorted(log.time, time, side="right") - 1, 0, len(step) - 1)
        in_gap = np.flatnonzero((step[row] > longest_gap) & (time > log.time[row]) & (time < log.time[row + 1]))
        if in_gap.size:
            ping, gap = int(in_gap[0]), int(row[in_gap[0]])
            raise field_error(
                "file", None, f"{self.file}, line {log.line[gap + 1]}: the log has a gap of {step[gap]:.4g} s before "
                f"this line, and ping {ping} falls into it ({in_gap.size} ping{'s' * (in_gap.size > 1)} in gaps longer "
                f"than {longest_gap:.4g} s). End the track before it with `pings`, start after it with `start`, or "
                "allow it with `longest_gap`.",
            )  # fmt: skip

    @property
    def ping_count(self) -> int:
        """Number of pings."""
        return self._max_pings(self.log()) if self.pings is None else self.pings

    def planned_poses(self, after: float = 0.0) -> Poses:
        """Poses at a time `after` the start of each ping [s], without the motion that a scenario adds to the log."""
        log = self.log()
        time = ping_times(self.ping_count, self.interval) + after
        log_time = np.minimum(self.start + time, log.time[-1])  # rounding may exceed the last row
        columns = [np.interp(log_time, log.time, column) for column in (*log.position.T, *log.attitude.T)]
        if after > 0:  # a platform does not stop where its log ends
            overrun = self.start + time - log_time
            last_step = np.array([column[-1] - column[-2] for column in (*log.position.T, *log.attitude.T)])
            columns = [
                c + overrun * rate for c, rate in zip(columns, last_step / (log.time[-1] - log.time[-2]), strict=True)
            ]
        return Poses(time, np.stack(columns[:3], axis=-1), *columns[3:])


@lru_cache(maxsize=4)
def _read(file: str, digest: str, origin: tuple[float, float] | None) -> NavigationLog:
    """Content of a log's file, cached by its digest, so that a changed file is read again."""
    return read_navigation(file, origin=origin)
