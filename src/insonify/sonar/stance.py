"""The sonar as it stands at one ping: where its two ends are, how its beams point, what it hears and when.

Places and attitudes are those at the start of the pulse; how they go on from there is its `course`.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import Water
from insonify.sonar.beam import Beams, beams
from insonify.sonar.course import Course, course
from insonify.sonar.heard import HeardPulse
from insonify.sonar.hydrophones import Hydrophones, hydrophones, one_element, whole_aperture
from insonify.sonar.sonar import Sonar, array_position, array_rotation
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
    """Places of the platform at all pings, shape (pings, 3): sampling follows the whole track."""
    survey: Survey
    """The same in short: how near, how far and how deep the sonar ever gets."""
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
    """How the platform goes on from the start of the ping; None: it stands still until the window ends."""

    @property
    def still(self) -> bool:
        """True where the sonar stands until the window ends."""
        return self.course is None

    @property
    def transmit_velocity(self) -> Floats:
        """Of the transmitter at the start of the ping [m/s], shape (3,)."""
        return np.zeros(3) if self.course is None else self.course.of(self.arms[:1])[1][0]

    @property
    def receive_velocity(self) -> Floats:
        """Of the receiver at the start of the ping [m/s], shape (3,)."""
        return np.zeros(3) if self.course is None else self.course.of(self.arms[1:])[1][0]

    @property
    def frequency(self) -> float:
        """Centre frequency [Hz]."""
        return self.pulse.pulse.frequency

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
        moved = 0.0 if self.course is None else self.course.farthest(self.arms)
        return (size + 2 * moved) / self.sound_speed

    @property
    def alike(self) -> bool:
        """True where both ends have the same beams."""
        sent, heard = self.transmit_beams, self.receive_beams
        return (
            np.array_equal(sent.axes, heard.axes) and np.array_equal(sent.steer, heard.steer)
            and sent.element == heard.element and np.array_equal(sent.scale, heard.scale)
            and all(a is b for a, b in zip(sent.tables, heard.tables, strict=True))
        )  # fmt: skip

    @property
    def together(self) -> bool:
        """True where transmitter and receiver are at one place, so that legs out and back hold the same values."""
        return bool(np.array_equal(self.transmit_place, self.receive_place))


def stance(sonar: Sonar, poses: Poses, ping: int, *, window: tuple[float, float], pulse: HeardPulse,
           water: Water, whole: Survey | None = None, later: tuple[Poses, Poses] | None = None,
           seed: int = 1) -> Stance:  # fmt: skip
    """The sonar as it stands at one ping.

    Args:
        sonar: The sonar, of one side.
        poses: Poses of its platform.
        ping: Number of the ping.
        window: Start and stop of the recording [s].
        pulse: The sonar's heard pulse, made once for all pings.
        water: What the arrays stand in: a beam is as wide as the sound speed at its own array makes it.
        whole: The survey of all its pings; None: it is made here.
        later: Poses at the middle and at the end of the window of every ping; None: stop and hop.
        seed: Of the scenario: the elements' errors are drawn from it.
    """
    body = poses.rotation(ping)
    rotation = array_rotation(sonar, body)
    transmit, receive = sonar.arrays
    frequency = sonar.pulse.frequency
    places = [array_position(array, poses.position[ping], body) for array in (transmit, receive)]
    speeds = [float(water.speed_at(place[2])) for place in places]
    elements, resolving, ears = None, None, sonar.steered_arrays[-1]
    if sonar.receiver.record == "elements":
        side = int(np.sign(np.sin(sonar.mounting.bearing)))
        elements = hydrophones(receive, sonar.receiver.errors, seed, side & 3)
        resolving = beams(whole_aperture(receive), frequency, speeds[1], rotation)
        ears = one_element(receive)
    bands: tuple[SubBand, ...] = ()
    if sonar.receiver.sub_bands > 1:
        bands = tuple(
            SubBand(
                float(offset),
                beams(sonar.steered_arrays[0], frequency + offset, speeds[0], rotation),
                beams(ears, frequency + offset, speeds[1], rotation),
            )
            for offset in band_nodes(pulse, sonar.receiver.sub_bands)
        )
    facing = rotation[0] * np.cos(sonar.steers[0]) + rotation[1] * np.sin(sonar.steers[0])
    return Stance(
        ping=ping,
        sound_speed=speeds[0],
        transmit_place=places[0],
        receive_place=places[1],
        transmit_beams=beams(sonar.steered_arrays[0], frequency, speeds[0], rotation),
        receive_beams=beams(ears, frequency, speeds[1], rotation),
        boresight=rotation[0],
        bearing=float(np.arctan2(facing[1], facing[0])),
        track=poses.position,
        survey=survey(sonar, poses) if whole is None else whole,
        window=window,
        pulse=pulse,
        source_level_db=sonar.source_level_db,
        channel_count=sonar.channel_count,
        time=float(poses.time[ping]),
        elements=elements,
        resolving_beams=resolving,
        bands=bands,
        arms=np.array([array.offset for array in sonar.arrays], float),
        course=None if later is None else course(poses, later, ping, window[1]),
    )


def end_depths(sonar: Sonar, poses: Poses) -> Floats:
    """Depths that transmitter or receiver of any side have on a track [m], increasing, each once.

    Args:
        sonar: The sonar.
        poses: Poses of its platform.
    """
    # The third row of the rotation from body to world, for every ping at once.
    level = np.cos(poses.pitch)
    down = np.stack([-np.sin(poses.pitch), level * np.sin(poses.roll), level * np.cos(poses.roll)], axis=-1)
    arrays = [array for side in sonar.one_sided for array in side.arrays]
    depths = [poses.position[:, 2] + down @ np.asarray(array.offset) for array in arrays]
    return np.unique(np.round(depths, 9))  # rounding would make one depth many
