"""A beam that is formed of recorded elements, for the arrivals behind one of its samples."""

from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from insonify.frames import direction, pose_rotation
from insonify.processing.element_recordings import beam_recording
from insonify.records.arrivals import Arrivals
from insonify.scenario.scenario import Scenario
from insonify.sonar.ping_geometry import PingGeometry
from insonify.synthesis.waveform_basis import waveform_basis

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class FormedBeam:
    """Delay and sum of the elements of one side, focused at the range of the sample."""

    bearing: float
    """Clockwise from the bow [rad]."""
    elevation: float
    """Down from the deck [rad]."""
    channels: NDArray[np.int64]
    """Rows of the elements in the recording, shape (n,)."""
    offset: Floats
    """Positions of the elements from the reference one, in the body's axes [m], shape (n, 3)."""
    reference: int
    """Row of the element next to their middle, whose arrivals are computed."""
    sound_speed: float
    """Sound speed that the beam is formed with [m/s]."""
    rotation: Floats
    """Attitude of the platform at the start of the ping, body to world, shape (3, 3)."""
    centre_frequency: float
    """Sample rate of the recording's baseband [Hz]."""

    @property
    def greatest_lag(self) -> float:
        """Upper bound of the delays between an element and the beam [s]."""
        return 2 * float(np.linalg.norm(self.offset, axis=1).max()) / self.sound_speed

    def echoes(
        self, arrivals: Arrivals, ping_geometry: PingGeometry, time: float
    ) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        """Array factor at the centre frequency [1], shape (n,), and mean waveforms of all elements [1], (bands, n).

        Each element receives an arrival as the reference does, from a position at half the arrival's path.

        Args:
            arrivals: Paths as the reference element receives them.
            ping_geometry: The sonar at that ping.
            time: Time of the sample, which sets the focus [s].
        """
        world = self.offset @ self.rotation.T
        look = self.rotation @ direction(self.bearing, self.elevation) * self.sound_speed * time / 2
        # beams start from the middle of the elements, arrivals are those of the reference one
        focus = np.linalg.norm(look - (world - world.mean(axis=0)), axis=1) - np.linalg.norm(look)
        away = arrivals.delay * self.sound_speed / 2
        source, waveforms = arrivals.arrival * away[:, None], waveform_basis(ping_geometry)
        factor, mean = np.zeros(len(arrivals), complex), np.zeros((1, len(arrivals)), complex)
        for element, focal_path in zip(world, focus, strict=True):
            lag = (np.linalg.norm(source - element, axis=1) - away - focal_path) / self.sound_speed
            carrier = np.exp(-2j * np.pi * ping_geometry.frequency * lag) / len(world)
            received = waveforms.samples(ping_geometry.pulse, time - arrivals.delay - lag, arrivals.doppler)
            factor, mean = factor + carrier, mean + carrier * received
        return factor, mean

    def recorded(self, pressure: xr.DataArray, time: float) -> complex:
        """Sample of the beam, formed of the recorded elements [uPa].

        Args:
            pressure: Pressure of one ping, over (channel, time), with its coordinates.
            time: Time of the sample [s].
        """
        part = pressure.isel(channel=self.channels).to_dataset(name="pressure")
        part = part.assign(element_position=(("channel", "axis"), self.offset))
        part = part.assign_attrs(centre_frequency=self.centre_frequency)
        formed = beam_recording(part, [self.bearing], elevation=self.elevation, sound_speed=self.sound_speed)
        return complex(formed["pressure"].isel(beam=0).sel(time=time, method="nearest").values)


def formed_beam(dataset: xr.Dataset, scenario: Scenario, ping: int, bearing: float) -> FormedBeam:
    """The beam of a recording of elements towards a bearing, at the tilt of its mounting.

    Args:
        dataset: The recording.
        scenario: The scenario.
        ping: Number of the ping.
        bearing: Clockwise from the bow [rad].

    Raises:
        ValueError: The recording is one of beams.
    """
    if scenario.sonar.receiver.record != "elements":
        raise ValueError("a bearing is for recordings of elements, and this one is of beams. Choose a beam instead.")
    side = np.asarray(dataset["side"].values).astype(int)
    requested = 1 if np.sin(bearing) >= 0 else -1
    channels = np.flatnonzero(side == requested) if np.any(side == requested) else np.arange(len(side))
    positions = np.asarray(dataset["element_position"].values, float)[channels]
    nearest = int(np.argmin(np.linalg.norm(positions - positions.mean(axis=0), axis=1)))
    prefix = "receiver_" if "receiver_attitude" in dataset else ""
    attitude = dataset[f"{prefix}attitude"]
    attitude = attitude.sel(ping=ping) if "ping" in dataset.coords else attitude.isel(ping=ping)
    rotation = pose_rotation(*np.asarray(attitude.values, float))
    return FormedBeam(
        bearing, scenario.sonar.mounting.tilt, channels, positions - positions[nearest], int(channels[nearest]),
        scenario.water.sound_speed, rotation, scenario.sonar.pulse.frequency,
    )  # fmt: skip
