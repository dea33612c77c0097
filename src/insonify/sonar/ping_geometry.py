"""Geometry of one ping: positions of the sonar's two ends, beams, velocities and recording window.

Positions and attitudes are those at the start of the pulse; the motion from then on is in `receive_motion` and
`transmit_motion`. The receiver may be on a platform of its own.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import Water
from insonify.sonar.array import LineArray, PlanarArray, PointTransducer
from insonify.sonar.band_error import SUB_BAND_COUNTS, BandError
from insonify.sonar.beam import Beams, beams
from insonify.sonar.beam_kernels import OMNI
from insonify.sonar.element_array import AnyArray
from insonify.sonar.hull import HullPlate, hull_plate
from insonify.sonar.hydrophones import Hydrophones, filled_aperture, hydrophones, single_element
from insonify.sonar.platform_motion import PlatformMotion
from insonify.sonar.platforms import Platforms
from insonify.sonar.received_pulse import ReceivedPulse
from insonify.sonar.shared_directions import share_directions
from insonify.sonar.sonar import Sonar, array_rotation, receiver_rotation
from insonify.sonar.sub_bands import SubBand, band_nodes
from insonify.sonar.track.poses import Poses
from insonify.sonar.track_extent import TrackExtent, track_extent

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PingGeometry:
    """Geometry of one ping, as engine and synthesis use it."""

    ping: int
    """Number of the ping."""
    sound_speed: float
    """Speed of sound at the transmitter [m/s]."""
    receive_sound_speed: float
    """Speed of sound at the receiver [m/s]."""
    transmit_position: Floats
    """North, east, depth of the transmitter [m], shape (3,)."""
    receive_position: Floats
    """North, east, depth of the receiver [m], shape (3,)."""
    transmit_beams: Beams
    receive_beams: Beams
    boresight: Floats
    """Unit vector along the boresight of the transmit array in the world [1], shape (3,)."""
    first_beam_bearing: float
    """Bearing of the axis of the first beam, clockwise from north [rad]."""
    platform_positions: Floats
    """Positions of the platform, or of both, at all pings [m], shape (n, 3); sampling follows from the whole track."""
    track_extent: TrackExtent
    """Extent of the track: polyline, convex hull and depth range; of two platforms the transmitter's."""
    window: tuple[float, float]
    """Start and stop of the recording, after the start of transmission [s]."""
    pulse: ReceivedPulse
    source_level_db: float
    """Rms level on the axis of the transmit beam [dB re 1 uPa at 1 m]."""
    channel_count: int
    """Number of channels: of pairs of a transmit and a receive beam, or of recorded elements."""
    time: float = 0.0
    """Start of transmission after the start of the track [s]."""
    elements: Hydrophones | None = None
    """Elements of the receiver, if each is a channel; `receive_beams` is then the pattern of one element."""
    full_aperture_beams: Beams | None = None
    """Beams of the filled aperture of the elements, which determine the sampling of the scene; None: the receive
    beams."""
    lever_arms: Floats = field(default_factory=lambda: np.zeros((2, 3)))
    """Positions of transmitter and receiver on the platform: forward, starboard, down [m], shape (2, 3)."""
    sub_bands: tuple[SubBand, ...] = ()
    """Beams at several frequencies across the band; empty: beams at its centre apply to all of it. For beams that
    differ in horizontal steering alone, only their common pattern is interpolated between these frequencies."""
    horizontal_bands: Callable[[], tuple[SubBand, ...]] | None = None
    """Function that returns beams at more frequencies, so many that horizontal patterns can be interpolated as well;
    None: `sub_bands` are such."""
    receive_motion: PlatformMotion | None = None
    """Motion of the receiver's platform from the start of the ping; None: nothing moves until the window ends."""
    transmit_motion: PlatformMotion | None = None
    """Motion of the transmitter's platform; the same object as `receive_motion` for one platform."""
    max_displacement: float = 0.0
    """Largest displacement of either end before the window ends [m]."""
    hull: HullPlate | None = None
    """Underside of the hull above the transmitter; None: none."""
    receive_track_extent: TrackExtent | None = None
    """Track extent of a receiver on a platform of its own; None: one platform carries both ends."""

    @property
    def is_static(self) -> bool:
        """True if the sonar does not move until the window ends."""
        return self.receive_motion is None

    @property
    def transmit_velocity(self) -> Floats:
        """Velocity of the transmitter at the start of the ping [m/s], shape (3,)."""
        return (
            np.zeros(3) if self.transmit_motion is None else self.transmit_motion.kinematics(self.lever_arms[:1])[1][0]
        )

    @property
    def receive_velocity(self) -> Floats:
        """Velocity of the receiver at the start of the ping [m/s], shape (3,)."""
        return np.zeros(3) if self.receive_motion is None else self.receive_motion.kinematics(self.lever_arms[1:])[1][0]

    @property
    def interpolated_bands(self) -> tuple[SubBand, ...]:
        """Beams at so many frequencies across the band that all of their patterns can be interpolated; may be empty."""
        return self.sub_bands if self.horizontal_bands is None else self.horizontal_bands()

    @property
    def frequency(self) -> float:
        """Centre frequency [Hz]."""
        return self.pulse.pulse.frequency

    @property
    def midpoint(self) -> Floats:
        """North and east of the middle between both ends [m], shape (2,)."""
        return np.asarray((self.transmit_position[:2] + self.receive_position[:2]) / 2)

    @property
    def wavelength(self) -> float:
        """Wavelength at the centre of the band [m]."""
        return self.sound_speed / self.frequency

    @property
    def recorded_delays(self) -> tuple[float, float]:
        """Earliest and latest delay of echoes that, with their ringing, overlap the window [s]."""
        earliest, latest = self.window[0] - self.pulse.ringing_stop, self.window[1] - self.pulse.ringing_start
        return earliest - self.delay_margin, latest + self.delay_margin

    @property
    def delay_margin(self) -> float:
        """Upper bound of the difference between an echo's delay and that at the centre of a stationary array [s]."""
        size = 0.0 if self.elements is None else float(np.linalg.norm(self.elements.positions, axis=1).max())
        return (size + 2 * self.max_displacement) / min(self.sound_speed, self.receive_sound_speed)

    @property
    def track_extents(self) -> tuple[TrackExtent, ...]:
        """Track extent of each platform: the transmitter's, then the receiver's if it is on another."""
        return (
            (self.track_extent,)
            if self.receive_track_extent is None
            else (self.track_extent, self.receive_track_extent)
        )

    @property
    def track_depths(self) -> tuple[float, float]:
        """Least and greatest depth of the sonar on its whole track [m]."""
        return min(extent.depths[0] for extent in self.track_extents), max(
            extent.depths[1] for extent in self.track_extents
        )

    @property
    def element_extent(self) -> tuple[float, float]:
        """Largest horizontal and vertical distance of elements in the window from the centre's initial position [m]."""
        offset = np.zeros((1, 3)) if self.elements is None else self.elements.positions
        position = offset @ self.receive_beams.axes
        if self.receive_motion is not None:
            _, velocity, acceleration = self.receive_motion.kinematics(
                self.lever_arms[1] + position @ self.receive_motion.rotation[0]
            )
            moments = (0.0, self.receive_motion.window / 2, self.receive_motion.window)
            position = np.concatenate([position + velocity * t + acceleration / 2 * t**2 for t in moments])
        return float(np.hypot(position[:, 0], position[:, 1]).max()), float(np.abs(position[:, 2]).max())

    @property
    def same_beams(self) -> bool:
        """True if transmitter and receiver have the same beams."""
        return self.transmit_beams.equals(self.bounding_receive_beams)

    @property
    def bounding_receive_beams(self) -> Beams:
        """The receive beams; for elements of different orientations an omnidirectional beam that bounds their gain."""
        receive = self.receive_beams
        if self.elements is None or not np.any(self.elements.orientations):
            return receive
        majorant, table = np.empty(0), np.empty((0, 4))
        return replace(receive, element=OMNI, tables=(table,) * 4, majorants=(majorant,) * 4, steer=np.zeros((1, 2)),
                       scale=np.ones(1))  # fmt: skip

    @property
    def is_monostatic(self) -> bool:
        """True if transmitter and receiver are at one position, so that transmit and receive legs are equal."""
        same = self.transmit_position is self.receive_position
        return same or bool(np.array_equal(self.transmit_position, self.receive_position))


def ping_geometry(
    sonar: Sonar, platforms: Poses | Platforms, ping: int, *, window: tuple[float, float], pulse: ReceivedPulse,
    water: Water, track_extents: tuple[TrackExtent, ...] = (), seed: int = 1,
) -> PingGeometry:  # fmt: skip
    """Compute the geometry of one ping.

    Args:
        sonar: The sonar, of one side.
        platforms: Poses of its one platform, which stops and hops; or its platforms, with their motion.
        ping: Number of the ping.
        window: Start and stop of the recording [s].
        pulse: The received pulse, computed once for all pings.
        water: The water; beam widths follow from the sound speed at each array.
        track_extents: Track extent of each platform; none: they are computed here.
        seed: Seed of the scenario, for the random errors of the elements.
    """
    end_platforms = Platforms(platforms) if isinstance(platforms, Poses) else platforms
    return MountedSonar(
        sonar, end_platforms, window, pulse, water, track_extents or track_extents_of(sonar, end_platforms), seed
    ).at(ping)


@dataclass(frozen=True, slots=True, eq=False)
class _AttitudeBeams:
    """Fields of a ping geometry that depend on the attitudes of the ends and the sound speeds there alone."""

    transmit_beams: Beams
    receive_beams: Beams
    full_aperture: Beams | None
    """See `PingGeometry.full_aperture_beams`."""
    bands: tuple[SubBand, ...]
    """See `PingGeometry.sub_bands`."""
    horizontal_bands: Callable[[], tuple[SubBand, ...]] | None
    boresight: Floats
    bearing: float
    """See `PingGeometry.first_beam_bearing`."""


def beams_at(
    ends: tuple[tuple[LineArray | PlanarArray | PointTransducer, float, Floats], ...], pulse: ReceivedPulse, count: int
) -> tuple[SubBand, ...]:  # fmt: skip
    """Beams at a number of frequencies across the band of a pulse.

    Args:
        ends: Array, sound speed [m/s] and axes in the world of the transmitter and of the receiver.
        pulse: The received pulse.
        count: Number of frequencies.
    """
    offsets, carrier = band_nodes(pulse, count), pulse.pulse.frequency
    end_beams = [[beams(array, carrier + offset, speed, axes) for array, speed, axes in ends] for offset in offsets]
    return tuple(SubBand(float(offset), *pair) for offset, pair in zip(offsets, end_beams, strict=True))


@dataclass(frozen=True, eq=False)
class MountedSonar:
    """A sonar of one side on its platforms, with a geometry for each ping; arguments as in `ping_geometry`."""

    sonar: Sonar
    platforms: Platforms
    window: tuple[float, float]
    pulse: ReceivedPulse
    water: Water
    track_extents: tuple[TrackExtent, ...]
    seed: int

    def at(self, ping: int) -> PingGeometry:
        """Geometry of the sonar at one ping.

        Args:
            ping: Number of the ping.
        """
        return self._geometry(ping, self.platforms, ping, self._max_displacements)

    def at_poses(self, ping: int, platforms: Platforms) -> PingGeometry:
        """Geometry of the sonar at given poses of its platforms, with the sampling that follows from its track.

        Args:
            ping: Number of the ping.
            platforms: The platforms at this ping alone.
        """
        return self._geometry(ping, platforms, 0, self._displacements(platforms))

    def _geometry(self, ping: int, platforms: Platforms, row: int, displacements: Floats | None) -> PingGeometry:
        """Geometry at one row of the platforms' poses; `displacements` are the largest ones during each ping [m]."""
        ends = platforms.transmitter_and_receiver_poses
        bodies = [poses.rotation(row) for poses in ends]
        positions = [
            poses.position[row] + body @ arm for arm, poses, body in zip(self._lever_arms, ends, bodies, strict=True)
        ]
        if positions[0].tolist() == positions[1].tolist():
            positions[1] = positions[0]  # one object, so that comparisons are fast
        speeds = tuple(self._speed(float(position[2])) for position in positions)
        attitude, motions = self._attitude_beams(bodies, speeds), platforms.ping_motions(row, self.window[1])
        return PingGeometry(
            ping=ping, sound_speed=speeds[0], receive_sound_speed=speeds[1], transmit_position=positions[0],
            receive_position=positions[1], transmit_beams=attitude.transmit_beams, receive_beams=attitude.receive_beams,
            boresight=attitude.boresight, first_beam_bearing=attitude.bearing,
            platform_positions=self.platforms.positions,
            track_extent=self.track_extents[0], window=self.window, pulse=self.pulse,
            source_level_db=self.sonar.source_level_db, channel_count=self._channel_count,
            time=float(platforms.transmitter_poses.time[row]), elements=self._elements,
            full_aperture_beams=attitude.full_aperture, sub_bands=attitude.bands, lever_arms=self._lever_arms,
            horizontal_bands=attitude.horizontal_bands,
            receive_motion=motions[1], transmit_motion=motions[0],
            max_displacement=0.0 if displacements is None or motions[0] is None else float(displacements[row]),
            hull=None if self.sonar.hull is None else hull_plate(
                self.sonar.hull, platforms.transmitter_poses.position[row], bodies[0]
            ),
            receive_track_extent=self.track_extents[1] if len(self.track_extents) > 1 else None,
        )  # fmt: skip

    def _attitude_beams(self, bodies: list[Floats], speeds: tuple[float, ...]) -> _AttitudeBeams:
        """Beams of one attitude, the same object for consecutive pings of equal attitude."""
        key: tuple[object, ...] = (*(body.tobytes() for body in bodies), *speeds)
        cached = self._attitude_cache.get(key)
        if cached is None:
            self._attitude_cache.clear()
            cached = self._attitude_cache[key] = self._beams_of_attitude(bodies, speeds)
        return cached

    def _beams_of_attitude(self, bodies: list[Floats], speeds: tuple[float, ...]) -> _AttitudeBeams:
        """Beams at one attitude and sound speed, without the cache."""
        sonar, frequency = self.sonar, self.sonar.pulse.frequency
        rotation, receive_rotation = array_rotation(sonar, bodies[0]), receiver_rotation(sonar, bodies[1])
        (transmit, receive), full_aperture = self._beam_arrays, None
        if self._elements is not None:
            full_aperture = beams(filled_aperture(sonar.receive), frequency, speeds[1], receive_rotation)
            receive = single_element(sonar.receive)
        ahead, right = self._first_beam
        first_beam_axis = rotation[0] * ahead + rotation[1] * right
        transmit_beams = beams(transmit, frequency, speeds[0], rotation)
        receive_beams = beams(receive, frequency, speeds[1], receive_rotation)
        receive_beams = transmit_beams if transmit_beams.equals(receive_beams) else receive_beams
        bearing = float(np.arctan2(first_beam_axis[1], first_beam_axis[0]))
        shared = self._elements is None and share_directions(transmit_beams, receive_beams)
        ends = (transmit, speeds[0], rotation), (receive, speeds[1], receive_rotation)
        count, horizontal_count = self._band_counts(shared)
        bands = beams_at(ends, self.pulse, count) if count else ()
        horizontal = partial(beams_at, ends, self.pulse, horizontal_count) if bands and shared else None
        return _AttitudeBeams(transmit_beams, receive_beams, full_aperture, bands, horizontal, rotation[0], bearing)

    def _band_counts(self, shared: bool) -> tuple[int, int]:
        """Numbers of sub-bands, 0 for none, and of `horizontal_bands`, the same for all pings with such beams.

        Args:
            shared: True for beams that differ in horizontal steering alone.
        """
        depth = self.platforms.transmitter_and_receiver_poses[0].position[0, 2] + self._lever_arms[0, 2]
        speed = float(self.water.sound_speed_at(depth))
        return _sufficient_counts(self.sonar, self.pulse, self.water, speed, self.window[1] * speed, shared)

    @cached_property
    def _attitude_cache(self) -> dict[tuple[object, ...], _AttitudeBeams]:
        return {}

    @cached_property
    def _arrays(self) -> tuple[AnyArray, AnyArray]:
        return self.sonar.arrays

    @cached_property
    def _beam_arrays(self) -> tuple[Any, Any]:
        """Transmit and receive array that form beams, a transmit array alone twice."""
        return self.sonar.beam_arrays[0], self.sonar.beam_arrays[-1]

    @cached_property
    def _first_beam(self) -> tuple[float, float]:
        """Components along boresight and to the right of the axis of the first beam [1]."""
        return np.cos(self.sonar.steers[0]), np.sin(self.sonar.steers[0])

    @cached_property
    def _lever_arms(self) -> Floats:
        return np.array([array.offset for array in self._arrays], float)

    @cached_property
    def _channel_count(self) -> int:
        return self.sonar.channel_count

    @cached_property
    def _elements(self) -> Hydrophones | None:
        if self.sonar.receiver.record != "elements":
            return None
        side = int(np.sign(np.sin(self.sonar.mounting.bearing)))
        return hydrophones(self.sonar.receive, self.sonar.receiver.errors, self.seed, side & 3)

    @cached_property
    def _max_displacements(self) -> Floats | None:
        return self._displacements(self.platforms)

    def _displacements(self, platforms: Platforms) -> Floats | None:
        """Largest displacement of either end in each ping [m], (pings,); rounded, for one value at equal speeds."""
        if platforms.track_motions is None:
            return None
        ends = [
            motion.max_displacement(arm) for motion, arm in zip(platforms.track_motions, self._lever_arms, strict=True)
        ]
        return np.asarray(np.round(np.maximum(*ends), 9))

    def _speed(self, depth: float) -> float:
        """Sound speed at one depth [m/s], cached for consecutive pings."""
        cached = self._speed_cache.get(depth)
        if cached is None:
            self._speed_cache.clear()
            cached = self._speed_cache[depth] = float(self.water.sound_speed_at(depth))
        return cached

    @cached_property
    def _speed_cache(self) -> dict[float, float]:
        return {}


def track_extents_of(sonar: Sonar, platforms: Platforms) -> tuple[TrackExtent, ...]:
    """Track extent of each platform of a sonar: one, or the transmitter's and the receiver's.

    Args:
        sonar: The sonar, of one side or both.
        platforms: Platforms of its ends.
    """
    if not platforms.is_bistatic:
        return (track_extent(sonar, platforms.transmitter_poses),)
    return track_extent(sonar, platforms.transmitter_poses, ends=("transmit",)), track_extent(
        sonar, platforms.receiver_poses, ends=("receive",)
    )


def array_depths(sonar: Sonar, poses: Poses | Platforms) -> Floats:
    """Depths of transmitter and receiver of all sides on a track [m], increasing, each once, shape (n,).

    Args:
        sonar: The sonar.
        poses: Poses of its platform, or its platforms.
    """
    end_platforms = Platforms(poses) if isinstance(poses, Poses) else poses
    ends = [
        pair
        for side in sonar.side_sonars
        for pair in zip(side.arrays, end_platforms.transmitter_and_receiver_poses, strict=True)
    ]
    depths = [end_poses.offset_depths(array.offset) for array, end_poses in ends]
    sorted_depths = np.sort(np.round(depths, 9), axis=None)  # rounded, so that equal depths are one
    return sorted_depths[np.append(True, np.diff(sorted_depths) > 0)]


@lru_cache(maxsize=8)  # the search takes longer than a short ping, and draws of one scene repeat it
def _sufficient_counts(
    sonar: Sonar, pulse: ReceivedPulse, water: Water, sound_speed: float, distance: float, shared: bool
) -> tuple[int, int]:
    """Numbers of sub-bands, 0 for none, and of `horizontal_bands`; arguments are those of `BandError`."""
    setting = sonar.receiver.sub_bands
    if setting == 1:
        return 0, 0
    error = BandError(sonar, pulse, water, sound_speed, distance, shared=shared)
    count = setting if isinstance(setting, int) else error.sufficient_count or SUB_BAND_COUNTS[-1]
    if count == 1:
        return 0, 0
    return count, max(error.horizontal_count, count) if shared else 0
