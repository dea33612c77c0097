"""Error of taking beams and absorption at a few frequencies of the band only, and the sub-bands that keep it small.

The error is that of reverberation: rms over all directions in front of the arrays, weighted by the gain of both beams
and by the pulse's spectrum, at the end of the window, where absorption differs most between frequencies. The beams are
the first of each array, and both arrays face the same direction. Where beams differ in horizontal steering alone,
horizontal patterns are those of every frequency, and the pattern common to all beams remains.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import Water
from insonify.sonar.array import LineArray, PlanarArray
from insonify.sonar.beam import Beams, beams
from insonify.sonar.element_array import AnyArray
from insonify.sonar.hydrophones import filled_aperture, one_element
from insonify.sonar.received_pulse import ReceivedPulse
from insonify.sonar.shared_directions import common_pattern, horizontal_extent
from insonify.sonar.sonar import Sonar
from insonify.sonar.sub_bands import band_nodes, half_bandwidth, lagrange_weights, node_count
from insonify.units import level_db

Floats = NDArray[np.float64]

ENOUGH_DB = -30.0
"""Error [dB re the rms of the sound] that is small beside speckle, and half of what 0.5 dB of calibration leaves."""
TRIED = (1, 2, 3, 4, 5, 6, 8, 12, 16, 24, 32)
"""Numbers of sub-bands [1]."""
SHARED_DB = -40.0
"""The same for beams that differ in horizontal steering alone: there only an explanation takes horizontal patterns at a
few frequencies, and its sum is to be the recorded sample within a hundredth [dB]."""
MOST_HORIZONTAL = 128
"""Largest number of frequencies at which an explanation takes horizontal patterns [1]."""
_FREQUENCIES, _PER_LOBE, _MOST, _WEAK = 17, 8, 1000, 1e-2


@dataclass(frozen=True, eq=False)
class BandError:
    """Error of a sonar's sub-bands, for any number of them."""

    sonar: Sonar
    """The sonar, of one side."""
    pulse: ReceivedPulse
    water: Water
    sound_speed: float
    """Sound speed at the sonar [m/s]."""
    distance: float
    """Path length to which absorption is counted [m]."""
    shared: bool = False
    """True for beams that differ in horizontal steering alone, see `shared_directions.share_directions`."""

    def error_db(self, count: int) -> float:
        """Rms error re the rms of the sound [dB], -300 for none.

        Args:
            count: Number of sub-bands; one is the carrier alone, for horizontal patterns as well.
        """
        separate = not self.shared or count == 1
        node, known = band_nodes(self.pulse, count), self._known[separate]
        at = np.array([self._response(offset, separate=separate) for offset in node])
        error = known - lagrange_weights(node, self._offsets).T @ at
        # energy over the band and over all directions, alike per solid angle
        spectrum, solid_angle = np.abs(self.pulse.spectrum(self._offsets)) ** 2, 1 / self._directions[separate][:, 0]
        lost, whole = (float(spectrum @ pressure**2 @ solid_angle) for pressure in (error, known))
        return float(level_db(max(lost / whole, 1e-30)))

    @cached_property
    def enough(self) -> int | None:
        """Least of `TRIED` that reaches `ENOUGH_DB`, or `SHARED_DB` where beams are shared; None: none does."""
        bars = {count: SHARED_DB if self.shared and count > 1 else ENOUGH_DB for count in TRIED}
        return next((count for count, bar in bars.items() if self.error_db(count) <= bar), None)

    @cached_property
    def horizontal_count(self) -> int:
        """Frequencies at which horizontal patterns are within `SHARED_DB` of the beams' axes, or `MOST_HORIZONTAL`."""
        transmit, receive = self._beams(0.0)
        extent = horizontal_extent(receive) + horizontal_extent(transmit) * (transmit.channel_count > 1)
        reach = 1 + float(np.abs(receive.steer[:, 0]).max())
        phase = np.pi * extent * reach * half_bandwidth(self.pulse) / self.sonar.pulse.frequency
        return node_count(phase, 10 ** (SHARED_DB / 20), MOST_HORIZONTAL)

    @cached_property
    def _offsets(self) -> Floats:
        edge = half_bandwidth(self.pulse)
        return np.linspace(-edge, edge, _FREQUENCIES)

    @cached_property
    def _kinds(self) -> tuple[bool, ...]:
        """True: separate beams; False: what they have in common, where that serves."""
        return (True, False) if self.shared else (True,)

    @cached_property
    def _known(self) -> dict[bool, Floats]:
        """Pressure at many frequencies, of either kind."""
        return {
            kind: np.array([self._response(offset, separate=kind) for offset in self._offsets]) for kind in self._kinds
        }

    @cached_property
    def _directions(self) -> dict[bool, Floats]:
        """Directions that both beams receive, of either kind."""
        return {kind: self._directions_in_beams(separate=kind) for kind in self._kinds}

    def _directions_in_beams(self, *, separate: bool) -> Floats:
        """Directions that both beams receive, on a grid of direction cosines in the arrays' frame, shape (n, 3)."""
        extents = [_extent(array) for array in (self.sonar.transmit, self.sonar.receive)]
        if not separate:  # horizontal patterns of the many beams are no part of it
            single = [end.channel_count == 1 for end in self._beams(0.0)]
            extents = [(across * alone, down) for (across, down), alone in zip(extents, single, strict=True)]
        lobes = 2 * np.max(extents, axis=0) * self.sonar.pulse.frequency / self.sound_speed
        steps = np.clip(np.ceil(_PER_LOBE * lobes), 40, _MOST).astype(int)
        right, down = (np.linspace(-1, 1, 2 * (count // 2) + 1) for count in steps)
        cosines = np.stack(np.meshgrid(right, down), axis=-1).reshape(-1, 2)
        ahead = 1 - np.sum(cosines**2, axis=1)
        front = ahead > 1e-4
        direction = np.column_stack([np.sqrt(ahead[front]), cosines[front]])
        gain = np.abs(self._gain(0.0, direction, separate=separate))
        return np.asarray(direction[gain >= _WEAK * gain.max()])

    def _beams(self, offset: float) -> tuple[Beams, Beams]:
        """Transmit and receive beams at one frequency."""
        sonar, frequency = self.sonar, self.sonar.pulse.frequency + offset
        receive = one_element(sonar.receive) if sonar.receiver.record == "elements" else sonar.beam_arrays[-1]
        return beams(sonar.beam_arrays[0], frequency, self.sound_speed), beams(receive, frequency, self.sound_speed)

    def _gain(self, offset: float, direction: Floats, *, separate: bool) -> Floats:
        """Gain of both beams at one frequency [1], shape (n,); not separate: of what all beams have in common."""
        ends = self._beams(offset)
        transmitted, received = (
            (end.single_beam(0) if separate or end.channel_count == 1 else common_pattern(end)).gain(direction)[0]
            for end in ends
        )
        return np.asarray(transmitted * received)

    def _response(self, offset: float, *, separate: bool) -> Floats:
        """Pressure at one frequency, through both beams and the water [1], shape (n,)."""
        absorbed = self.water.relative_absorption(np.array(self.distance), offset, self.sonar.pulse.frequency)
        return np.asarray(self._gain(offset, self._directions[separate], separate=separate) * absorbed)


def _extent(array: AnyArray) -> tuple[float, float]:
    """Size of an array to its right and down [m]."""
    whole = filled_aperture(array)
    if isinstance(whole, PlanarArray):
        return whole.width, whole.height
    return (whole.length, 0.0) if isinstance(whole, LineArray) else (0.0, 0.0)
