"""Geometry of one ping: positions of the sonar's two ends, beams, velocities and recording window.

Positions and attitudes are those at the start of the pulse; the motion from there is in `receive_motion` and
`transmit_motion`. The receiver may ride a platform of its own.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import Water
from insonify.sonar.array import LineArray, PlanarArray, PointTransducer
from insonify.sonar.band_error import TRIED, BandError
from insonify.sonar.beam import Beams, beams
from insonify.sonar.beam_kernels import OMNI
from insonify.sonar.element_array import AnyArray
from insonify.sonar.hull import HullPlate, hull_plate
from insonify.sonar.hydrophones import Hydrophones, filled_aperture, hydrophones, one_element
from insonify.sonar.platform_motion import PlatformMotion
from insonify.sonar.platforms import Platforms
from insonify.sonar.received_pulse import ReceivedPulse
from insonify.sonar.shared_directions import share_directions
from insonify.sonar.sonar import Sonar, array_position, array_rotation, receiver_rotation
from insonify.sonar.sub_bands import SubBand, band_nodes
from insonify.sonar.track.poses import Poses
from insonify.sonar.track_extent import TrackExtent, track_extent

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PingGeometry:
    """One ping's geometry, ready for the engine and for synthesis."""

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
    """Unit vector that the arrays face, in the world, shape (3,)."""
    first_beam_bearing: float
    """Bearing of the first beam [rad]."""
    platform_positions: Floats
    """Positions of the platform, or of both, at all pings [m], shape (n, 3); sampling follows from the whole track."""
    track_extent: TrackExtent
    """Extent of the track: polyline, convex hull and depth range; of two platforms the transmitter's."""
    window: tuple[float, float]
    """Start and stop of the recording [s]."""
    pulse: ReceivedPulse
    source_level_db: float
    """Rms level on axis [dB re 1 uPa at 1 m]."""
    channel_count: int
    """Number of pairs of a transmit and a receive beam."""
    time: float = 0.0
    """Start of transmission after the start of the track [s]."""
    elements: Hydrophones | None = None
    """The receiver's elements, where each is a channel; `receive_beams` is then the pattern of any one of them."""
    full_aperture_beams: Beams | None = None
    """Beams of the filled aperture of the elements: decide the sampling of the scene; None: the receive beams."""
    lever_arms: Floats = field(default_factory=lambda: np.zeros((2, 3)))
    """Places of transmitter and receiver on the platform: forward, starboard, down [m], shape (2, 3)."""
    sub_bands: tuple[SubBand, ...] = ()
    """Beams at several frequencies across the band; none: those at its centre serve throughout. Where beams differ in
    horizontal steering alone, these are for what they have in common; horizontal patterns are of every frequency."""
    horizontal_bands: Callable[[], tuple[SubBand, ...]] | None = None
    """Function for the beams at more frequencies, where `sub_bands` are for what all beams have in common: at so many
    that their horizontal patterns can be interpolated. None: those of `sub_bands` serve."""
    receive_motion: PlatformMotion | None = None
    """Motion of the receiver's platform from the start of the ping; None: nothing moves until the window ends."""
    transmit_motion: PlatformMotion | None = None
    """Motion of the transmitter's platform: the same as the receiver's where it is the same platform."""
    max_displacement: float = 0.0
    """Largest displacement of either end before the window ends [m]."""
    hull: HullPlate | None = None
    """Underside of the hull above the transmitter; None: none."""
    receive_track_extent: TrackExtent | None = None
    """Track extent of a receiver on a platform of its own; None: both ends ride the same platform."""

    @property
    def is_static(self) -> bool:
        """True where the sonar stands until the window ends."""
        return self.receive_motion is None

    @property
    def transmit_velocity(self) -> Floats:
        """Of the transmitter at the start of the ping [m/s], shape (3,)."""
        return (
            np.zeros(3) if self.transmit_motion is None else self.transmit_motion.kinematics(self.lever_arms[:1])[1][0]
        )

    @property
    def receive_velocity(self) -> Floats:
        """Of the receiver at the start of the ping [m/s], shape (3,)."""
        return np.zeros(3) if self.receive_motion is None else self.receive_motion.kinematics(self.lever_arms[1:])[1][0]

    @property
    def interpolated_bands(self) -> tuple[SubBand, ...]:
        """Beams at so many frequencies across the band that all of their patterns can be interpolated, or none."""
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
        """Earliest and latest delay whose echo, or its ringing, touches the window [s]."""
        earliest, latest = self.window[0] - self.pulse.ringing_stop, self.window[1] - self.pulse.ringing_start
        return earliest - self.delay_margin, latest + self.delay_margin

    @property
    def delay_margin(self) -> float:
        """Difference in delay of an echo from that at the centre of a stationary array, at most [s]."""
        size = 0.0 if self.elements is None else float(np.linalg.norm(self.elements.positions, axis=1).max())
        return (size + 2 * self.max_displacement) / min(self.sound_speed, self.receive_sound_speed)

    @property
    def track_extents(self) -> tuple[TrackExtent, ...]:
        """Track extent of each platform: the transmitter's, then the receiver's if it is another."""
        return (
            (self.track_extent,)
            if self.receive_track_extent is None
            else (self.track_extent, self.receive_track_extent)
        )

    @property
    def track_depths(self) -> tuple[float, float]:
        """Least and greatest depth of the sonar on its whole track [m]."""
        return min(one.depths[0] for one in self.track_extents), max(one.depths[1] for one in self.track_extents)

    @property
    def element_extent(self) -> tuple[float, float]:
        """Farthest that elements get from the receiver's centre at the start of the ping: over ground, in depth [m]."""
        own = np.zeros((1, 3)) if self.elements is None else self.elements.positions
        position = own @ self.receive_beams.axes
        if self.receive_motion is not None:
            _, velocity, acceleration = self.receive_motion.kinematics(
                self.lever_arms[1] + position @ self.receive_motion.rotation[0]
            )
            moments = (0.0, self.receive_motion.window / 2, self.receive_motion.window)
            position = np.concatenate([position + velocity * t + acceleration / 2 * t**2 for t in moments])
        return float(np.hypot(position[:, 0], position[:, 1]).max()), float(np.abs(position[:, 2]).max())

    @property
    def same_beams(self) -> bool:
        """True where both ends have the same beams."""
        return self.transmit_beams.equals(self.bounding_receive_beams)

    @property
    def bounding_receive_beams(self) -> Beams:
        """The receive beams; for elements turned aside an omnidirectional beam that bounds the gain of each."""
        receive = self.receive_beams
        if self.elements is None or not np.any(self.elements.orientations):
            return receive
        none, rows = np.empty(0), np.empty((0, 4))
        return replace(receive, element=OMNI, tables=(rows,) * 4, majorants=(none,) * 4, steer=np.zeros((1, 2)),
                       scale=np.ones(1))  # fmt: skip

    @property
    def is_monostatic(self) -> bool:
        """True where transmitter and receiver are at one position, so that legs out and back hold the same values."""
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
    both = Platforms(platforms) if isinstance(platforms, Poses) else platforms
    return MountedSonar(sonar, both, window, pulse, water, track_extents or track_extents_of(sonar, both), seed).at(
        ping
    )


@dataclass(frozen=True, slots=True, eq=False)
class _AttitudeBeams:
    """Fields of a ping geometry that stay while the ends keep their attitude and the water its sound speed there."""

    transmit_beams: Beams
    receive_beams: Beams
    resolving: Beams | None
    bands: tuple[SubBand, ...]
    horizontal_bands: Callable[[], tuple[SubBand, ...]] | None
    boresight: Floats
    bearing: float


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
    made = [[beams(array, carrier + offset, speed, axes) for array, speed, axes in ends] for offset in offsets]
    return tuple(SubBand(float(offset), *pair) for offset, pair in zip(offsets, made, strict=True))


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
        """The sonar as it stands at one ping.

        Args:
            ping: Number of the ping.
        """
        return self._posed(ping, self.platforms, ping, self._moved)

    def posed(self, ping: int, platforms: Platforms) -> PingGeometry:
        """The sonar on platforms with other poses, sampled as its track is.

        Args:
            ping: Number of the ping.
            platforms: The platforms at this ping alone.
        """
        return self._posed(ping, platforms, 0, self._displacements(platforms))

    def _posed(self, ping: int, both: Platforms, row: int, moved: Floats | None) -> PingGeometry:
        """The sonar on platforms as some row of their poses has them, displaced by that of `moved` during the ping."""
        bodies = [carrier.rotation(row) for carrier in both.end_poses]
        positions = [
            array_position(array, carrier.position[row], body)
            for array, carrier, body in zip(self._arrays, both.end_poses, bodies, strict=True)
        ]
        if np.array_equal(positions[0], positions[1]):
            positions[1] = positions[0]  # one object, so that comparisons are fast
        speeds = tuple(self._speed(float(position[2])) for position in positions)
        facing, courses = self._attitude(bodies, speeds), both.ping_motions(row, self.window[1])
        return PingGeometry(
            ping=ping, sound_speed=speeds[0], receive_sound_speed=speeds[1], transmit_position=positions[0],
            receive_position=positions[1], transmit_beams=facing.transmit_beams, receive_beams=facing.receive_beams,
            boresight=facing.boresight, first_beam_bearing=facing.bearing, platform_positions=self.platforms.positions,
            track_extent=self.track_extents[0], window=self.window, pulse=self.pulse,
            source_level_db=self.sonar.source_level_db, channel_count=self._channel_count,
            time=float(both.transmitter_poses.time[row]), elements=self._elements,
            full_aperture_beams=facing.resolving, sub_bands=facing.bands, lever_arms=self._arms,
            horizontal_bands=facing.horizontal_bands,
            receive_motion=courses[1], transmit_motion=courses[0],
            max_displacement=0.0 if moved is None or courses[0] is None else float(moved[row]),
            hull=None if self.sonar.hull is None else hull_plate(
                self.sonar.hull, both.transmitter_poses.position[row], bodies[0]
            ),
            receive_track_extent=self.track_extents[1] if len(self.track_extents) > 1 else None,
        )  # fmt: skip

    def _attitude(self, bodies: list[Floats], speeds: tuple[float, ...]) -> _AttitudeBeams:
        """The beams of one attitude, the same ones as long as it is kept."""
        key: tuple[object, ...] = (*(body.tobytes() for body in bodies), *speeds)
        held = self._last.get(key)
        if held is None:
            self._last.clear()
            held = self._last[key] = self._turned(bodies, speeds)
        return held

    def _turned(self, bodies: list[Floats], speeds: tuple[float, ...]) -> _AttitudeBeams:
        """Beams at one attitude and sound speed, evaluated without the cache."""
        sonar, frequency = self.sonar, self.sonar.pulse.frequency
        rotation, receive_rotation = array_rotation(sonar, bodies[0]), receiver_rotation(sonar, bodies[1])
        transmit, receive, resolving = sonar.beam_arrays[0], sonar.beam_arrays[-1], None
        if self._elements is not None:
            resolving = beams(filled_aperture(sonar.receive), frequency, speeds[1], receive_rotation)
            receive = one_element(sonar.receive)
        facing = rotation[0] * np.cos(sonar.steers[0]) + rotation[1] * np.sin(sonar.steers[0])
        transmit_beams = beams(transmit, frequency, speeds[0], rotation)
        receive_beams = beams(receive, frequency, speeds[1], receive_rotation)
        receive_beams = transmit_beams if transmit_beams.equals(receive_beams) else receive_beams
        bearing = float(np.arctan2(facing[1], facing[0]))
        shared = self._elements is None and share_directions(transmit_beams, receive_beams)
        ends = (transmit, speeds[0], rotation), (receive, speeds[1], receive_rotation)
        count, horizontal_count = self._band_counts(shared)
        bands = beams_at(ends, self.pulse, count) if count else ()
        horizontal = partial(beams_at, ends, self.pulse, horizontal_count) if bands and shared else None
        return _AttitudeBeams(transmit_beams, receive_beams, resolving, bands, horizontal, rotation[0], bearing)

    def _band_counts(self, shared: bool) -> tuple[int, int]:
        """Numbers of sub-bands, 0 for none, and of `horizontal_bands`, the same for all pings with such beams.

        Args:
            shared: True for beams that differ in horizontal steering alone.
        """
        if shared not in self._counts:
            self._counts[shared] = self._count_bands(shared)
        return self._counts[shared]

    def _count_bands(self, shared: bool) -> tuple[int, int]:
        """Numbers of sub-bands, evaluated."""
        written = self.sonar.receiver.sub_bands
        if written == 1:
            return 0, 0
        depth = self.platforms.end_poses[0].position[0, 2] + self._arms[0, 2]
        speed = float(self.water.sound_speed_at(depth))
        error = BandError(self.sonar, self.pulse, self.water, speed, self.window[1] * speed, shared=shared)
        count = written if isinstance(written, int) else error.enough or TRIED[-1]
        if count == 1:
            return 0, 0
        return count, max(error.horizontal_count, count) if shared else 0

    @cached_property
    def _counts(self) -> dict[bool, tuple[int, int]]:
        return {}

    @cached_property
    def _last(self) -> dict[tuple[object, ...], _AttitudeBeams]:
        return {}

    @cached_property
    def _arrays(self) -> tuple[AnyArray, AnyArray]:
        return self.sonar.arrays

    @cached_property
    def _arms(self) -> Floats:
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
    def _moved(self) -> Floats | None:
        return self._displacements(self.platforms)

    def _displacements(self, platforms: Platforms) -> Floats | None:
        """Largest displacement of either end during each ping [m]; rounded, or one speed would be many."""
        if platforms.track_motions is None:
            return None
        ends = [motion.max_displacement(arm) for motion, arm in zip(platforms.track_motions, self._arms, strict=True)]
        return np.asarray(np.round(np.maximum(*ends), 9))

    def _speed(self, depth: float) -> float:
        """Of sound, at one depth [m/s]."""
        held = self._speeds.get(depth)
        if held is None:
            self._speeds.clear()
            held = self._speeds[depth] = float(self.water.sound_speed_at(depth))
        return held

    @cached_property
    def _speeds(self) -> dict[float, float]:
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
    """Depths that transmitter or receiver of any side have on a track [m], increasing, each once.

    Args:
        sonar: The sonar.
        poses: Poses of its platform, or its platforms.
    """
    both = Platforms(poses) if isinstance(poses, Poses) else poses
    ends = [pair for side in sonar.side_sonars for pair in zip(side.arrays, both.end_poses, strict=True)]
    depths = [carrier.offset_depths(array.offset) for array, carrier in ends]
    sorted_depths = np.sort(np.round(depths, 9), axis=None)  # rounding would make one depth many
    return sorted_depths[np.append(True, np.diff(sorted_depths) > 0)]
