"""Live sonar: the pings of a scenario one by one, from poses that another program gives.

What does not depend on the pose (scene, rays, pulse, noise) is prepared once. A pose on the scenario's track gives
the same bits as `insonify.simulate`.
"""

from __future__ import annotations

import threading
import warnings
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from copy import copy
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.caller_warning import warn_caller
from insonify.kernel_compilation import compile_ahead
from insonify.malloc_tuning import keep_freed_memory
from insonify.processing.recorder import instrument_recording
from insonify.propagation.bounding_cylinders import bounding_cylinders
from insonify.propagation.image_sources import StraightRays
from insonify.real_time.collector_pauses import exclude_present_objects, include_all_objects
from insonify.real_time.platform_pose import PlatformPose
from insonify.real_time.pose_errors import require_in_water
from insonify.records.recording import RecordingLayout, recording_dataset
from insonify.scenario.attributes import attributes
from insonify.scenario.features import scenario_features
from insonify.scenario.pings import require_index
from insonify.scenario.platform_poses import platforms
from insonify.scenario.recording_layout import navigation_systems, recording_layout
from insonify.scenario.scenario import Scenario
from insonify.simulator import build_simulator, record_ping
from insonify.sonar.ping_geometry import PingGeometry, array_depths, track_extents_of
from insonify.sonar.platforms import Platforms
from insonify.sonar.track import Poses
from insonify.sonar.track_extent import TrackExtent, distance_to_segments
from insonify.thread_count import thread_count
from insonify.validity import PhysicsWarning

if TYPE_CHECKING:
    import xarray as xr

Floats = NDArray[np.float64]

OFF_TRACK = 1.0
"""Distance from the track up to which a ping is sampled as one of the track [m]."""
MAX_TIME = 1e12
"""Latest time of a ping [s]: beyond it, a sea has no phase."""
OFF_DEPTH = 0.1
"""Depth beyond those of the track up to which a ping is sampled as one of the track [m]."""
TARGETS_FACED = 3
"""Targets towards which a ping is simulated to warm up, at most."""
STEPS = 8
"""Poses from one further position to the next, so that rays are prepared for all depths between them."""

_RECORDED_WARNINGS = threading.Lock()  # Python has one list of recorded warnings in a process


def live(
    scenario: Scenario, *, positions: Iterable[ArrayLike] = (), threads: int | None = None, warm_up: bool = True
) -> LiveSonar:
    """A sonar whose pings are simulated one by one, from poses given at each.

    Args:
        scenario: What is simulated; its track gives sampling densities, ping interval and window.
        positions: Positions (north, east, depth) that the sonar may have besides those of the track [m]: straight runs
            join them. The scene is sampled, and rays are prepared, for all of them.
        threads: Number of threads; all cores by default. The result does not depend on it, bit for bit.
        warm_up: True: simulate a few pings now, so that no later one waits for kernels and tables, and leave present
            objects out of garbage collection until the sonar is closed.

    Example:
        >>> scenario = insonify.load_scenario("sidescan.yaml")
        >>> with insonify.live(scenario, warm_up=False) as sonar:
        ...     ping = sonar.ping(0.0, (5.0, 0.0, 12.0), (0.1, 0.0, 0.0))
        >>> dict(ping.pressure.sizes)
        {'ping': 1, 'channel': 2, 'time': 1750}
    """
    sonar = LiveSonar(scenario, positions=positions, threads=threads)
    if warm_up:
        sonar.warm_up()
    return sonar


class LiveSonar:
    """A prepared scenario that is simulated ping by ping; several threads may use it, one ping at a time.

    Example:
        >>> paths = {"contributions": ["target"], "families": ["D"]}
        >>> with LiveSonar(insonify.load_scenario("sidescan.yaml").with_("paths", paths)) as sonar:
        ...     recording = sonar.ping(time=10.0, position=(20.0, 0.0, 12.0))  # a buoy is 25 m to port and 7 m below
        >>> port = abs(recording["pressure"][0, 0])
        >>> print(port["slant_range"][port.argmax("time")].values.round())
        26.0
    """

    def __init__(self, scenario: Scenario, *, positions: Iterable[ArrayLike] = (), threads: int | None = None) -> None:
        """Prepare a scenario; arguments as those of `live`."""
        if not isinstance(scenario, Scenario):
            raise TypeError(f"expected a Scenario, not a {type(scenario).__name__}; load one with load_scenario")
        track = platforms(scenario)
        self._simulator = build_simulator(scenario, _with_positions(track, positions))
        self._attributes = attributes(scenario)
        self._lines = self._simulator.recorded_lines()
        if self._lines is not None and self._lines.recorder.pings_per_line > 1:
            raise ValueError(f"sonar.recorder has {self._lines.recorder.pings_per_line} pings in each line, and a live "
                             "sonar has one ping at a time. Give looks of one ping.")  # fmt: skip
        self._poses = track
        self._pool = ThreadPoolExecutor(thread_count(threads))
        self._lock = threading.RLock()
        self._warned = False
        self._closed = threading.Event()
        self._count, self._time, self._last = 0, 0.0, list[PlatformPose]()
        self._navigation = navigation_systems(self.scenario, self._poses)
        keep_freed_memory()
        compile_ahead(scenario_features(scenario), thread_count(threads))

    def __repr__(self) -> str:
        """Title of the scenario, number of channels, and number of pings so far."""
        title, channels = self.scenario.title or "untitled", self.scenario.sonar.channel_count
        return f"LiveSonar: {title}, {channels} channel{'s' * (channels != 1)}, {self._count} pings so far"

    @property
    def scenario(self) -> Scenario:
        """The scenario."""
        return self._simulator.scenario

    @property
    def ping_count(self) -> int:
        """Number of pings so far, which is the number of the next one."""
        return self._count

    def ping(
        self, time: float, position: ArrayLike, attitude: ArrayLike = (0.0, 0.0, 0.0), *,
        velocity: ArrayLike | None = None, turn_rate: ArrayLike | None = None, window_poses: Any = None,
        receiver: PlatformPose | None = None,
    ) -> xr.Dataset:  # fmt: skip
        """Simulate one ping.

        Args:
            time: Time of transmission [s], not before that of the ping before; a moving sea depends on it.
            position: Platform's reference point: north, east, depth [m], shape (3,).
            attitude: Heading, pitch, roll [rad], shape (3,).
            velocity: North, east, down [m/s]; None: mean velocity since the ping before, 0 at the first.
            turn_rate: Rates of heading, pitch and roll [rad/s]; None: mean rates since the ping before, 0 at the first.
            window_poses: Position and attitude half a window, and a whole window, after transmission, in place of
                velocity and turn rate.
            receiver: Pose of the receiver's own platform, where it has one; None: where its track has it stand still.

        Returns:
            A recording of one ping, as that of `insonify.simulate`.

        Raises:
            ValueError: The time is before the last, or a pose is not in the water.
            RuntimeError: The sonar is closed.
        """
        pose = PlatformPose(position, attitude, velocity, turn_rate, window_poses)
        if isinstance(time, bool) or not isinstance(time, int | float | np.number) or not abs(time) <= MAX_TIME:
            raise ValueError(f"time is {str(time)[:30]!r}; give the time of transmission [s], {MAX_TIME:g} s at most")
        with self._lock:
            self._require_open()
            if self._count and time < self._time:
                raise ValueError(f"time is {float(time):g} s, before {self._time:g} s of the ping before. Give a later "
                                 "time, or start anew with restart().")  # fmt: skip
            ends = [pose, *([] if not self._poses.is_bistatic else [receiver or self._standing_receiver()])]
            if receiver is not None and not self._poses.is_bistatic:
                raise ValueError("receiver has a pose, and one platform carries both ends. Leave it out, or give the "
                                 "scenario a receiver_track.")  # fmt: skip
            before = self._last if self._count else [replace(end, velocity=None, turn_rate=None) for end in ends]
            elapsed = float(time) - self._time if self._count else 0.0
            ends = [end.following(old, elapsed) for end, old in zip(ends, before, strict=True)]
            platforms = self._platforms(float(time), ends)
            series = self._simulate(self._count, platforms)
            recording = self._recording(platforms, series)
            self._count, self._time, self._last = self._count + 1, float(time), ends
        return recording

    def ping_and_warnings(self, **arguments: Any) -> tuple[xr.Dataset, list[str]]:
        """Simulate one ping, and list the physics warnings that it gives; they are issued in this process as well.

        Args:
            arguments: Arguments of `ping`, by name.
        """
        with self._lock, _RECORDED_WARNINGS:
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always", PhysicsWarning)
                recording = self.ping(**arguments)
            for one in caught:
                warnings.warn_explicit(one.message, one.category, one.filename, one.lineno)
        physics = (str(one.message) for one in caught if issubclass(one.category, PhysicsWarning))
        return recording, list(dict.fromkeys(physics))

    def track_ping(self, ping: int) -> dict[str, Any]:
        """Arguments of `ping` for one ping of the scenario's own track.

        Args:
            ping: Number of the ping.

        Raises:
            ValueError: The track has no such ping.
        """
        row = require_index("ping", ping, len(self._poses.transmitter_poses), "track")
        sending = self._poses.transmitter_poses
        values = {"time": float(sending.time[row])} | _pose_columns(sending, self._poses.transmitter_window_poses, row)
        if self._poses.separate_receiver_poses is not None:
            columns = _pose_columns(self._poses.separate_receiver_poses, self._poses.receiver_window_poses, row)
            values["receiver"] = PlatformPose(**columns)
        return values

    def warm_up(self) -> None:
        """Simulate the first ping of the track, and pings towards targets, and discard them.

        Kernels are then compiled, tables and packages loaded, and objects that stay are left out of garbage collection.
        """
        with self._lock:
            self._require_open()
            platforms, logged = self._poses.single_ping(0), self._navigation
            self._navigation = navigation_systems(self.scenario, self._poses)
            self._recording(platforms, self._simulate(0, platforms))
            self._navigation = logged
            for turned in self._towards_targets(platforms):
                self._simulate(0, turned)
            exclude_present_objects(self._closed)

    def _towards_targets(self, platforms: Platforms) -> list[Platforms]:
        """The platform of a ping, turned towards the nearest targets in reach; two platforms are not turned."""
        geometry = self._simulator.ping_geometries(0, platforms)[0]
        north, east = (bounding_cylinders(self._simulator.engine.scene)[:, :2] - geometry.transmit_position[:2]).T
        distance = np.hypot(north, east)
        in_reach = distance < geometry.sound_speed * self.scenario.track.window[1] / 2
        turns = np.arctan2(east, north) - np.arctan2(geometry.boresight[1], geometry.boresight[0])
        nearest = [row for row in np.argsort(distance)[:TARGETS_FACED] if in_reach[row]]
        return [] if platforms.is_bistatic else [platforms.turned(float(turns[row])) for row in nearest]

    def restart(self) -> None:
        """Start anew: the next ping is number 0, at any time."""
        with self._lock:
            self._count, self._time, self._last = 0, 0.0, []
            self._navigation = navigation_systems(self.scenario, self._poses)

    def sequence(self) -> LiveSonar:
        """Another sequence of pings of the same sonar, from number 0 on; the two are independent and share threads."""
        other = copy(self)
        other.restart()
        return other

    @property
    def layout(self) -> RecordingLayout:
        """Axes of every ping; the poses are those of the first ping of the track."""
        return recording_layout(self.scenario, self._poses.single_ping(0), self._simulator.grid.time)

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes of every ping."""
        return dict(self._attributes)

    def close(self) -> None:
        """End the threads; no further ping is simulated, of no sequence."""
        with self._lock:
            self._closed.set()
            self._pool.shutdown()
            include_all_objects(self._closed)

    def __enter__(self) -> Self:
        """Enter a context that closes the sonar."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the sonar."""
        self.close()

    def _require_open(self) -> None:
        if self._closed.is_set():
            raise RuntimeError("the sonar is closed. Make another one with insonify.live.")

    def _standing_receiver(self) -> PlatformPose:
        """The receiver's own pose, where its track keeps to one."""
        poses = self._poses.separate_receiver_poses
        assert poses is not None
        position, lean = poses.position, poses.attitude
        if np.ptp(position, axis=0).any() or np.ptp(lean, axis=0).any():
            raise ValueError("receiver is None, and the receiver's track moves. Give receiver=PlatformPose(position, "
                             "attitude).")  # fmt: skip
        return PlatformPose(position[0], lean[0], np.zeros(3), np.zeros(3))

    def _platforms(self, time: float, ends: list[PlatformPose]) -> Platforms:
        """The platforms at one ping, in the water."""
        start = [end.poses(time) for end in ends]
        later: list[tuple[Poses, Poses] | None] = [None, None]
        if not self.scenario.track.stop_and_hop:
            stop = self.scenario.track.window[1]
            later = [*(end.later_poses(time, stop) for end in ends), None]
        platforms = Platforms(start[0], start[1] if len(start) > 1 else None, later[0], later[1])
        require_in_water(self.scenario, self._simulator.engine.scene, platforms)
        return platforms

    def _simulate(self, ping: int, platforms: Platforms) -> NDArray[np.generic]:
        """Series of one ping, shape (channels, samples)."""
        self._require_rays(platforms)
        sides = self._simulator.ping_geometries(ping, platforms)
        if _is_off(sides[0].track_extents, platforms):
            sides = self._sampled_alone(sides, platforms)
        return record_ping(self._simulator, sides, self._pool)

    def _sampled_alone(self, sides: list[PingGeometry], platforms: Platforms) -> list[PingGeometry]:
        """Geometries whose sampling follows this ping alone."""
        if not self._warned and self.scenario.field == "coherent":
            self._warned = True
            warn_caller(
                f"position {np.round(platforms.transmitter_poses.position[0], 3).tolist()} m is off the scenario's "
                "track, by which the seabed is sampled: its scatterers, and the speckle with them, change from ping to "
                "ping. Give live(scenario, positions=...) the positions that the sonar may have.",
                PhysicsWarning,
            )  # fmt: skip
        extents = track_extents_of(self.scenario.sonar, platforms)
        return [
            replace(
                side, platform_positions=platforms.positions, track_extent=extents[0],
                receive_track_extent=extents[1] if len(extents) > 1 else None,
            )
            for side in sides
        ]  # fmt: skip

    def _require_rays(self, platforms: Platforms) -> None:
        """Refuse depths for which layered water has no tables of rays."""
        rays = self._simulator.engine.rays
        if isinstance(rays, StraightRays):
            return
        region, depths = self._region, array_depths(self.scenario.sonar, platforms)
        nearest = np.array(region.source_depths)
        if region.is_span:
            outside = (depths < nearest[0] - 1e-9) | (depths > nearest[-1] + 1e-9)
        else:
            outside = np.abs(depths[:, None] - nearest).min(axis=1) > 1e-9
        if outside.any():
            known = f"{nearest[0]:.4g} to {nearest[-1]:.4g} m" if region.is_span else f"{nearest.tolist()} m"
            raise ValueError(
                f"an array is at {depths[outside][0]:.6g} m, and rays in this layered water are prepared for "
                f"{known}. Give live(scenario, positions=...) positions above and below all depths of the sonar."
            )

    @property
    def _region(self) -> Any:
        return self._simulator.engine.rays.domain  # type: ignore[attr-defined]

    def _recording(self, platforms: Platforms, series: NDArray[np.generic]) -> xr.Dataset:
        layout = recording_layout(self.scenario, platforms, self._simulator.grid.time, systems=self._navigation)
        number = np.array([self._count], np.int64)
        recording = recording_dataset(layout, self._attributes, series[None], number, of_pings=True)
        return recording if self._lines is None else instrument_recording(
            recording, self._lines.recorder, sound_speed=self._lines.sound_speed,
            absorption_db_per_m=self._lines.absorption_db_per_m,
        )  # fmt: skip


def _pose_columns(start: Poses, later: tuple[Poses, Poses] | None, row: int) -> dict[str, Any]:
    """Arguments of `PlatformPose` of one row of poses."""
    columns = {"position": start.position[row], "attitude": start.attitude[row]}
    if later is None:
        return columns
    return columns | {"window_poses": tuple((poses.position[row], poses.attitude[row]) for poses in later)}


def _is_off(extents: tuple[TrackExtent, ...], platforms: Platforms) -> bool:
    """True where a platform is so far from its track that sampling by the track does not suit it."""
    for extent, poses in zip(extents, platforms.transmitter_and_receiver_poses, strict=False):
        runs = np.stack([extent.corners[:-1], extent.corners[1:]], axis=1)
        away = float(distance_to_segments(poses.position[:, :2], runs)[0])
        depth, (least, greatest) = float(poses.position[0, 2]), extent.depths
        beyond = max(least - depth, depth - greatest)
        if away > extent.polyline_error + OFF_TRACK or beyond > OFF_DEPTH:
            return True
    return False


def _with_positions(track: Platforms, positions: Iterable[ArrayLike]) -> Platforms | None:
    """Platforms at all pings of the track and at further positions, joined by straight runs; None: there are none."""
    given = [np.asarray(PlatformPose(position).position, float) for position in positions]
    if not given:
        return None
    steps = np.linspace(0, 1, STEPS, endpoint=False)[:, None]
    runs = [(1 - steps) * first + steps * last for first, last in pairwise(given)]
    further = np.concatenate([*runs, given[-1][None]])
    return Platforms(
        _extended(track.transmitter_poses, further),
        None if track.separate_receiver_poses is None else _extended(track.separate_receiver_poses, further),
        None if (w := track.transmitter_window_poses) is None else (_extended(w[0], further), _extended(w[1], further)),
        None if (w := track.receiver_window_poses) is None else (_extended(w[0], further), _extended(w[1], further)),
    )


def _extended(poses: Poses, further: Floats) -> Poses:
    zero, time = np.zeros(len(further)), np.full(len(further), poses.time[-1])
    columns = (np.concatenate([lean, zero]) for lean in (poses.heading, poses.pitch, poses.roll))
    return Poses(np.concatenate([poses.time, time]), np.concatenate([poses.position, further]), *columns)
