"""The sonar as it stands at one ping: where its two ends are, how its beams point, what it hears and when.

Places and attitudes are those at the start of the pulse; how they go on from there is its `course`. The receiver may
ride a platform of its own.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import Water
from insonify.sonar._beam_kernels import OMNI
from insonify.sonar.beam import Beams, beams
from insonify.sonar.course import Course
from insonify.sonar.element_array import AnyArray
from insonify.sonar.heard import HeardPulse
from insonify.sonar.hydrophones import Hydrophones, hydrophones, one_element, whole_aperture
from insonify.sonar.platforms import Platforms
from insonify.sonar.sonar import Sonar, array_position, array_rotation, receiver_rotation
from insonify.sonar.sub_bands import SubBand, band_nodes
from insonify.sonar.survey import Survey, survey
from insonify.sonar.track.poses import Poses

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Stance:
    """One ping's geometry, ready for the engine and for synthesis."""

    ping: int
    """Number of the ping."""
    sound_speed: float
    """Speed of sound at the transmitter [m/s]."""
    receive_speed: float
    """Speed of sound at the receiver [m/s]."""
    transmit_place: Floats
    """North, east, depth of the transmitter [m], shape (3,)."""
    receive_place: Floats
    """North, east, depth of the receiver [m], shape (3,)."""
    transmit_beams: Beams
    receive_beams: Beams
    boresight: Floats
    """Unit vector that the arrays face, in the world, shape (3,)."""
    bearing: float
    """Bearing of the first beam [rad]."""
    track: Floats
    """Places of the platform, or of both, at all pings, shape (n, 3): sampling follows the whole track."""
    survey: Survey
    """The same in short: how near, how far and how deep the sonar ever gets; of two platforms the transmitter's."""
    window: tuple[float, float]
    """Start and stop of the recording [s]."""
    pulse: HeardPulse
    source_level_db: float
    """Rms level on axis [dB re 1 uPa at 1 m]."""
    channel_count: int
    """Number of pairs of a transmit and a receive beam."""
    time: float = 0.0
    """Start of transmission after the start of the track [s]."""
    elements: Hydrophones | None = None
    """The receiver's elements, where each is a channel; `receive_beams` is then the pattern of any one of them."""
    resolving_beams: Beams | None = None
    """What can be made of the elements: decides how finely the scene is sampled; None: the receive beams."""
    arms: Floats = field(default_factory=lambda: np.zeros((2, 3)))
    """Places of transmitter and receiver on the platform: forward, starboard, down [m], shape (2, 3)."""
    bands: tuple[SubBand, ...] = ()
    """Beams at several frequencies across the band; none: those at its centre serve throughout."""
    course: Course | None = None
    """How the receiver's platform goes on from the start of the ping; None: nothing moves until the window ends."""
    transmit_course: Course | None = None
    """How the transmitter's platform goes on: the same course where it is the same platform."""
    moved: float = 0.0
    """How far either end gets from where it stands before the window ends [m]."""
    receive_survey: Survey | None = None
    """Where a receiver goes that has a platform of its own; None: both ends ride the same."""

    @property
    def still(self) -> bool:
        """True where the sonar stands until the window ends."""
        return self.course is None

    @property
    def transmit_velocity(self) -> Floats:
        """Of the transmitter at the start of the ping [m/s], shape (3,)."""
        return np.zeros(3) if self.transmit_course is None else self.transmit_course.of(self.arms[:1])[1][0]

    @property
    def receive_velocity(self) -> Floats:
        """Of the receiver at the start of the ping [m/s], shape (3,)."""
        return np.zeros(3) if self.course is None else self.course.of(self.arms[1:])[1][0]

    @property
    def frequency(self) -> float:
        """Centre frequency [Hz]."""
        return self.pulse.pulse.frequency

    @property
    def middle(self) -> Floats:
        """North and east of the middle between both ends [m], shape (2,)."""
        return np.asarray((self.transmit_place[:2] + self.receive_place[:2]) / 2)

    @property
    def wavelength(self) -> float:
        """Wavelength at the centre of the band [m]."""
        return self.sound_speed / self.frequency

    @property
    def heard_delays(self) -> tuple[float, float]:
        """Earliest and latest delay whose echo, or its ringing, touches the window [s]."""
        early, late = self.window[0] - self.pulse.faint_stop, self.window[1] - self.pulse.faint_start
        return early - self.spread, late + self.spread

    @property
    def spread(self) -> float:
        """How much sooner or later than at the centre of a standing array an echo may come [s]."""
        size = 0.0 if self.elements is None else float(np.linalg.norm(self.elements.place, axis=1).max())
        return (size + 2 * self.moved) / min(self.sound_speed, self.receive_speed)

    @property
    def surveys(self) -> tuple[Survey, ...]:
        """Where each platform goes: the transmitter's, then the receiver's if it is another."""
        return (self.survey,) if self.receive_survey is None else (self.survey, self.receive_survey)

    @property
    def survey_depths(self) -> tuple[float, float]:
        """Least and greatest depth of the sonar on its whole track [m]."""
        return min(one.depths[0] for one in self.surveys), max(one.depths[1] for one in self.surveys)

    @property
    def reach(self) -> tuple[float, float]:
        """Farthest that elements get from the receiver's centre at the start of the ping: over ground, in depth [m]."""
        own = np.zeros((1, 3)) if self.elements is None else self.elements.place
        place = own @ self.receive_beams.axes
        if self.course is not None:
            _, velocity, acceleration = self.course.of(self.arms[1] + place @ self.course.rotation[0])
            moments = (0.0, self.course.window / 2, self.course.window)
            place = np.concatenate([place + velocity * t + acceleration / 2 * t**2 for t in moments])
        return float(np.hypot(place[:, 0], place[:, 1]).max()), float(np.abs(place[:, 2]).max())

    @property
    def alike(self) -> bool:
        """True where both ends have the same beams."""
        sent, heard = self.transmit_beams, self.ears
        return sent is heard or (
            np.array_equal(sent.axes, heard.axes) and np.array_equal(sent.steer, heard.steer)
            and sent.element == heard.element and np.array_equal(sent.scale, heard.scale)
            and all(a is b for a, b in zip(sent.tables, heard.tables, strict=True))
        )  # fmt: skip

    @property
    def ears(self) -> Beams:
        """The receive beams; where elements face aside, what hears all around as loudly as any of them at most."""
        heard = self.receive_beams
        if self.elements is None or not np.any(self.elements.facing):
            return heard
        none, rows = np.empty(0), np.empty((0, 4))
        return replace(heard, element=OMNI, tables=(rows,) * 4, majorants=(none,) * 4, steer=np.zeros((1, 2)),
                       scale=np.ones(1))  # fmt: skip

    @property
    def together(self) -> bool:
        """True where transmitter and receiver are at one place, so that legs out and back hold the same values."""
        return bool(np.array_equal(self.transmit_place, self.receive_place))


def stance(sonar: Sonar, poses: Poses | Platforms, ping: int, *, window: tuple[float, float], pulse: HeardPulse,
           water: Water, whole: tuple[Survey, ...] = (), seed: int = 1) -> Stance:  # fmt: skip
    """The sonar as it stands at one ping.

    Args:
        sonar: The sonar, of one side.
        poses: Poses of its one platform, which stops and hops; or its platforms, with how they go on.
        ping: Number of the ping.
        window: Start and stop of the recording [s].
        pulse: The sonar's heard pulse, made once for all pings.
        water: What the arrays stand in: a beam is as wide as the sound speed at its own array makes it.
        whole: The survey of all its pings, of each platform; none: they are made here.
        seed: Of the scenario: the elements' errors are drawn from it.
    """
    both = Platforms(poses) if isinstance(poses, Poses) else poses
    return Riding(sonar, both, window, pulse, water, whole or surveys_of(sonar, both), seed).at(ping)


@dataclass(frozen=True, slots=True, eq=False)
class _Attitude:
    """What of a stance stays while the ends keep their attitude and the sound its speed there."""

    transmit_beams: Beams
    receive_beams: Beams
    resolving: Beams | None
    bands: tuple[SubBand, ...]
    boresight: Floats
    bearing: float


@dataclass(frozen=True, eq=False)
class Riding:
    """A sonar of one side on its platforms, to be asked for any of its pings; arguments as of `stance`."""

    sonar: Sonar
    platforms: Platforms
    window: tuple[float, float]
    pulse: HeardPulse
    water: Water
    surveys: tuple[Survey, ...]
    seed: int

    def at(self, ping: int) -> Stance:
        """The sonar as it stands at one ping.

        Args:
            ping: Number of the ping.
        """
        both, bodies = self.platforms, [carrier.rotation(ping) for carrier in self.platforms.carriers]
        places = [
            array_position(array, carrier.position[ping], body)
            for array, carrier, body in zip(self._arrays, both.carriers, bodies, strict=True)
        ]
        speeds = tuple(self._speed(float(place[2])) for place in places)
        facing, courses = self._attitude(bodies, speeds), both.courses(ping, self.window[1])
        return Stance(
            ping=ping,
            sound_speed=speeds[0],
            receive_speed=speeds[1],
            transmit_place=places[0],
            receive_place=places[1],
            transmit_beams=facing.transmit_beams,
            receive_beams=facing.receive_beams,
            boresight=facing.boresight,
            bearing=facing.bearing,
            track=both.positions,
            survey=self.surveys[0],
            window=self.window,
            pulse=self.pulse,
            source_level_db=self.sonar.source_level_db,
            channel_count=self._channel_count,
            time=float(both.sending.time[ping]),
            elements=self._elements,
            resolving_beams=facing.resolving,
            bands=facing.bands,
            arms=self._arms,
            course=courses[1],
            transmit_course=courses[0],
            moved=0.0 if self._moved is None or courses[0] is None else float(self._moved[ping]),
            receive_survey=self.surveys[1] if len(self.surveys) > 1 else None,
        )

    def _attitude(self, bodies: list[Floats], speeds: tuple[float, ...]) -> _Attitude:
        """The beams of one attitude, the same ones as long as it is kept."""
        key: tuple[object, ...] = (*(body.tobytes() for body in bodies), *speeds)
        held = self._last.get(key)
        if held is None:
            self._last.clear()
            held = self._last[key] = self._turned(bodies, speeds)
        return held

    def _turned(self, bodies: list[Floats], speeds: tuple[float, ...]) -> _Attitude:
        """The same, made anew."""
        sonar, frequency = self.sonar, self.sonar.pulse.frequency
        rotation, ears_rotation = array_rotation(sonar, bodies[0]), receiver_rotation(sonar, bodies[1])
        mouth, ears, resolving = sonar.steered_arrays[0], sonar.steered_arrays[-1], None
        if self._elements is not None:
            resolving = beams(whole_aperture(sonar.receive), frequency, speeds[1], ears_rotation)
            ears = one_element(sonar.receive)
        bands: tuple[SubBand, ...] = ()
        if sonar.receiver.sub_bands > 1:
            bands = tuple(
                SubBand(
                    float(offset),
                    beams(mouth, frequency + offset, speeds[0], rotation),
                    beams(ears, frequency + offset, speeds[1], ears_rotation),
                )
                for offset in band_nodes(self.pulse, sonar.receiver.sub_bands)
            )
        facing = rotation[0] * np.cos(sonar.steers[0]) + rotation[1] * np.sin(sonar.steers[0])
        sent = beams(mouth, frequency, speeds[0], rotation)
        alike = mouth == ears and speeds[0] == speeds[1] and np.array_equal(rotation, ears_rotation)
        heard = sent if alike else beams(ears, frequency, speeds[1], ears_rotation)
        bearing = float(np.arctan2(facing[1], facing[0]))
        return _Attitude(sent, heard, resolving, bands, rotation[0], bearing)

    @cached_property
    def _last(self) -> dict[tuple[object, ...], _Attitude]:
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
        """How far either end gets during each ping [m]; rounded, or one speed would be many."""
        if self.platforms.ways is None:
            return None
        ends = [way.farthest(arm) for way, arm in zip(self.platforms.ways, self._arms, strict=True)]
        return np.asarray(np.round(np.maximum(*ends), 9))

    def _speed(self, depth: float) -> float:
        """Of sound, at one depth [m/s]."""
        held = self._speeds.get(depth)
        if held is None:
            self._speeds.clear()
            held = self._speeds[depth] = float(self.water.speed_at(depth))
        return held

    @cached_property
    def _speeds(self) -> dict[float, float]:
        return {}


def surveys_of(sonar: Sonar, platforms: Platforms) -> tuple[Survey, ...]:
    """Where each platform of a sonar goes: one survey, or the transmitter's and the receiver's.

    Args:
        sonar: The sonar, of one side or both.
        platforms: What carries its ends.
    """
    if not platforms.two:
        return (survey(sonar, platforms.sending),)
    return survey(sonar, platforms.sending, ends=("transmit",)), survey(sonar, platforms.hearing, ends=("receive",))


def end_depths(sonar: Sonar, poses: Poses | Platforms) -> Floats:
    """Depths that transmitter or receiver of any side have on a track [m], increasing, each once.

    Args:
        sonar: The sonar.
        poses: Poses of its platform, or its platforms.
    """
    both = Platforms(poses) if isinstance(poses, Poses) else poses
    ends = [pair for side in sonar.one_sided for pair in zip(side.arrays, both.carriers, strict=True)]
    depths = [carrier.depths(array.offset) for array, carrier in ends]
    return np.unique(np.round(depths, 9))  # rounding would make one depth many
