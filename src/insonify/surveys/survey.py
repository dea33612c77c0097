"""Recording with its scenario, its navigation and its position on Earth, as writers of files need them."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Self

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from insonify.formats.locations import is_url
from insonify.formats.store_description import StoreError
from insonify.formats.stored_recording import stored_recording
from insonify.processing.recorder import lines_as_pings
from insonify.processing.sidescan import distance_run
from insonify.records.recording import FIELDS
from insonify.scenario.load import parse_model
from insonify.scenario.scenario import Scenario
from insonify.scenario.track_errors import seabed_depth_span
from insonify.scene.solid import seabed_depth_at
from insonify.surveys.earth_frame import EarthFrame

Floats = NDArray[np.float64]

START = 946_684_800
"""Time of the start of a track, 2000-01-01 UTC, since a scenario has no date [s since 1970]."""


@dataclass(frozen=True)
class Survey:
    """Recorded pings of a scenario; samples are read ping by ping."""

    name: str | Path
    """Folder or URL of the recording, or the title of one in memory."""
    recording: xr.Dataset
    scenario: Scenario

    @cached_property
    def rows(self) -> NDArray[np.int64]:
        """Rows of the recorded pings."""
        done = self.recording["done"].values if "done" in self.recording else np.ones(self.recording.sizes["ping"])
        return np.flatnonzero(done)

    @cached_property
    def position(self) -> Floats:
        """North, east, down of the platform at each recorded ping, as logged [m], shape (ping, 3)."""
        return self._logged("position")

    @cached_property
    def attitude(self) -> Floats:
        """Heading, pitch, roll of the platform at each recorded ping, as logged [rad], shape (ping, 3)."""
        return self._logged("attitude")

    @cached_property
    def time(self) -> Floats:
        """Start of transmission of each recorded ping [s since 1970], shape (ping,)."""
        return START + np.asarray(self.recording["ping_time"].values, float)[self.rows]

    @cached_property
    def frame(self) -> EarthFrame:
        """Position of the scene on Earth."""
        return EarthFrame.of(self.recording.attrs)

    @cached_property
    def pose_on_earth(self) -> tuple[Floats, Floats, Floats]:
        """Latitude, longitude and true heading of the platform at each recorded ping [deg], shape (ping,) each."""
        north, east = self.position[:, 0], self.position[:, 1]
        heading = np.degrees(self.attitude[:, 0] + self.frame.convergence(north, east)) % 360
        return *self.frame.geodetic(north, east), heading

    @property
    def version(self) -> str:
        """Version of the program that simulated the recording."""
        return str(self.recording.attrs.get("version", ""))

    @property
    def tags(self) -> dict[str, str]:
        """Title, software and seed, as files state them."""
        return {"TITLE": Path(self.name).name, "SOFTWARE": f"insonify {self.version}", "SEED": str(self.scenario.seed)}

    @property
    def speed(self) -> Floats:
        """Horizontal speed of the platform at each recorded ping [m/s], shape (ping,)."""
        if self.rows.size < 2:
            return np.zeros(self.rows.size)
        north, east = (np.gradient(self.position[:, axis], self.time) for axis in (0, 1))
        return np.asarray(np.hypot(north, east))

    @cached_property
    def distance_run(self) -> Floats:
        """Distance along the logged track at each recorded ping [m], shape (ping,)."""
        return distance_run(self.position)

    @cached_property
    def altitude(self) -> Floats:
        """Height of the platform above the seabed [m], shape (ping,)."""
        return self.bed_depth(self.position[:, 0], self.position[:, 1]) - self.position[:, 2]

    @property
    def sample_time(self) -> Floats:
        """Time of each sample after the start of transmission [s], shape (time,)."""
        return np.asarray(self.recording["time"].values, float)

    @property
    def sample_interval(self) -> float:
        """Time between samples [s]."""
        time = self.sample_time
        return float(time[-1] - time[0]) / max(time.size - 1, 1)

    @property
    def ping_interval(self) -> float:
        """Median time between pings [s], 0 of a single one."""
        return float(np.median(np.diff(self.time))) if self.rows.size > 1 else 0.0

    def bed_depth(self, north: Floats, east: Floats) -> Floats:
        """Depth of the seabed at positions [m], of their shape."""
        return seabed_depth_at(self.scenario.completed_seabed, np.stack([north, east], axis=-1))

    @property
    def shallowest_bed(self) -> float:
        """Least depth of the seabed [m]."""
        return seabed_depth_span(self.scenario)[0]

    def amplitude(self, numbers: slice) -> NDArray[np.float32]:
        """Rms amplitude of successive pings [uPa], shape (ping, channel, time).

        Args:
            numbers: Numbers within the recorded pings.
        """
        field = next((name for name in FIELDS if name in self.recording), "recorded")
        if "ping" not in self.recording[field].dims:
            raise StoreError(f"{self.name} has the lines of a recorder alone. Keep the pressure beside them in the "
                             "scenario, or write them as xtf-recorded (.xtf) or netCDF (.nc)")  # fmt: skip
        values = self.recording[field].isel(ping=self.rows[numbers]).transpose("ping", "channel", "time").values
        amplitude = np.sqrt(values) if field == "intensity" else values if field == "recorded" else np.abs(values)
        return np.asarray(amplitude, np.float32)

    def amplitudes(self) -> Iterator[tuple[int, NDArray[np.float32]]]:
        """Number within the recorded pings, and rms amplitude [uPa], shape (channel, time), of each ping."""
        return ((number, self.amplitude(slice(number, number + 1))[0]) for number in range(self.rows.size))

    def recorded_lines(self) -> Self:
        """The lines of the recorder as pings, at the first ping of each, with their numbers as amplitudes.

        Raises:
            StoreError: The sonar has no recorder.
        """
        recording = self.recording
        if "recorded" not in recording:
            raise StoreError(f"{self.name} has no recorded lines. Give the sonar a recorder in the scenario, or write "
                             "the pressure: xtf or xtf-float32")  # fmt: skip
        lines = lines_as_pings(recording)
        known = [bool(np.isfinite(lines["recorded"][row, 0, 0].values)) for row in range(lines.sizes["ping"])]
        return replace(self, recording=lines.assign(done=("ping", known)))

    def require_beams(self, name: str) -> None:
        """Refuse a recording whose channels are elements, or whose receiver has a platform of its own."""
        if self.scenario.sonar.receiver.record == "elements":
            raise StoreError(
                f"{self.name}: {name} holds beams, and this recording has elements. Write record: beams in the "
                "scenario, form beams of it first (insonify.processing.beam_recording), or write its soundings: csv, "
                "geojson, kmall or, as .tif, --as bathymetry"
            )
        self.require_one_platform(name)

    def require_one_platform(self, name: str) -> None:
        """Refuse a recording whose receiver has a platform of its own."""
        if "receiver_position" in self.recording:
            raise StoreError(f"{self.name}: {name} holds ranges, and a receiver on its own platform has none. Write it "
                             "as netCDF (.nc)")  # fmt: skip

    def _logged(self, name: str) -> Floats:
        column = f"logged_{name}" if f"logged_{name}" in self.recording else name
        return np.asarray(self.recording[column].values, float)[self.rows]


def open_survey(recording: Survey | xr.Dataset | str | Path) -> Survey:
    """Open a recording to be written to another format.

    Args:
        recording: A recording, or its folder, URL or netCDF file, or a survey that is open already.

    Raises:
        StoreError: It has no scenario, or no ping yet.
    """
    if isinstance(recording, Survey):
        return recording
    name: str | Path
    if isinstance(recording, xr.Dataset):
        dataset, name = recording, Path(str(recording.attrs.get("title") or "recording"))
    else:
        dataset, name = stored_recording(recording), recording if is_url(recording) else Path(recording)
    text = dataset.attrs.get("scenario")
    if not isinstance(text, str):
        raise StoreError(f"{name}: the recording has no scenario, which the settings of a file are taken from. Give "
                         "one of insonify.simulate or insonify.open_recording")  # fmt: skip
    survey = Survey(name, dataset, parse_model(Scenario, text, name=f"scenario of {name}", recorded=True))
    if not survey.rows.size:
        raise StoreError(f"{name} holds no ping yet. Simulate one: insonify run FILE -o {name}")
    return survey
