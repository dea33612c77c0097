"""Error of evaluating beams and absorption at a few frequencies of the band, and the sub-bands that keep it small.

The error is that of reverberation: rms over all directions in front of the arrays, weighted by the gain of both beams
and by the pulse's spectrum, at the end of the window, where absorption differs most between frequencies. It is
evaluated for the first beam of each array, with both arrays facing the same direction. Where beams differ in horizontal
steering alone, horizontal patterns are evaluated at every frequency; the error is then that of their common pattern.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import Water
from insonify.sonar.array import LineArray, PlanarArray
from insonify.sonar.beam import Beams, beams
from insonify.sonar.element_array import AnyArray
from insonify.sonar.hydrophones import filled_aperture, single_element
from insonify.sonar.received_pulse import ReceivedPulse
from insonify.sonar.shared_directions import common_pattern, horizontal_extent
from insonify.sonar.sonar import Sonar
from insonify.sonar.sub_bands import band_nodes, half_bandwidth, lagrange_weights, node_count
from insonify.units import level_db

Floats = NDArray[np.float64]

MAX_ERROR_DB = -30.0
"""Largest error [dB re the rms pressure]: small against speckle, and half of that by a calibration error of 0.5 dB."""
SUB_BAND_COUNTS = (1, 2, 3, 4, 5, 6, 8, 12, 16, 24, 32)
"""Numbers of sub-bands among which the automatic choice is made [1]."""
MAX_SHARED_ERROR_DB = -40.0
"""Largest error for beams that differ in horizontal steering alone [dB re the rms pressure]. Horizontal patterns are
evaluated at a few frequencies only in the explanation of a sample, whose sum is within a hundredth of the sample."""
MAX_HORIZONTAL_COUNT = 128
"""Largest number of frequencies at which horizontal patterns are evaluated for an explanation [1]."""
_FREQUENCY_COUNT, _STEPS_PER_LOBE, _MAX_STEPS, _MIN_RELATIVE_GAIN = 17, 8, 1000, 1e-2
"""Frequencies across the band; steps of direction cosine per lobe, and at most in all; and two-way amplitude gain re
the largest below which a direction is left out [1]."""


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
    """Two-way path length over which absorption is evaluated [m]."""
    shared: bool = False
    """True for beams that differ in horizontal steering alone, see `shared_directions.share_directions`."""

    def error_db(self, count: int) -> float:
        """Level of the rms error [dB re the rms pressure], -300 for none.

        Args:
            count: Number of sub-bands; 1: the carrier alone, for horizontal patterns as well.
        """
        separate = not self.shared or count == 1
        node, exact = band_nodes(self.pulse, count), self._exact_responses[separate]
        node_response = np.array([self._response(offset, separate=separate) for offset in node])
        error = exact - lagrange_weights(node, self._offsets).T @ node_response
        # energy over the band and over all directions, alike per solid angle
        spectrum, solid_angle = np.abs(self.pulse.spectrum(self._offsets)) ** 2, 1 / self._directions[separate][:, 0]
        error_energy, total_energy = (float(spectrum @ pressure**2 @ solid_angle) for pressure in (error, exact))
        return float(level_db(max(error_energy / total_energy, 1e-30)))

    @cached_property
    def sufficient_count(self) -> int | None:
        """Smallest of `SUB_BAND_COUNTS` within `MAX_ERROR_DB`, or `MAX_SHARED_ERROR_DB` if `shared`; None: none is."""
        limits = {
            count: MAX_SHARED_ERROR_DB if self.shared and count > 1 else MAX_ERROR_DB for count in SUB_BAND_COUNTS
        }
        return next((count for count, limit in limits.items() if self.error_db(count) <= limit), None)

    @cached_property
    def horizontal_count(self) -> int:
        """Frequencies that interpolate horizontal patterns within `MAX_SHARED_ERROR_DB`, or `MAX_HORIZONTAL_COUNT`."""
        transmit, receive = self._beams(0.0)
        extent = horizontal_extent(receive) + horizontal_extent(transmit) * (transmit.channel_count > 1)
        reach = 1 + float(np.abs(receive.steer[:, 0]).max())
        phase = np.pi * extent * reach * half_bandwidth(self.pulse) / self.sonar.pulse.frequency
        return node_count(phase, 10 ** (MAX_SHARED_ERROR_DB / 20), MAX_HORIZONTAL_COUNT)

    @cached_property
    def _offsets(self) -> Floats:
        """Offsets from the carrier at which the error is evaluated [Hz], shape (frequencies,)."""
        edge = half_bandwidth(self.pulse)
        return np.linspace(-edge, edge, _FREQUENCY_COUNT)

    @cached_property
    def _separations(self) -> tuple[bool, ...]:
        """Patterns of which the error is evaluated: True for a separate beam, False for the beams' common pattern."""
        return (True, False) if self.shared else (True,)

    @cached_property
    def _exact_responses(self) -> dict[bool, Floats]:
        """Pressure [1] at all frequencies of `_offsets` in each direction, (frequencies, n), by `_separations`."""
        return {
            separate: np.array([self._response(offset, separate=separate) for offset in self._offsets])
            for separate in self._separations
        }

    @cached_property
    def _directions(self) -> dict[bool, Floats]:
        """Directions in which the two-way gain is not negligible, shape (n, 3), by `_separations`."""
        return {separate: self._directions_in_beams(separate=separate) for separate in self._separations}

    def _directions_in_beams(self, *, separate: bool) -> Floats:
        """Directions in which the two-way gain is not negligible, on a grid of cosines in the arrays' frame, (n, 3)."""
        extents = [_extent(array) for array in (self.sonar.transmit, self.sonar.receive)]
        if not separate:  # the horizontal patterns of many beams do not count
            has_single_beam = [end.channel_count == 1 for end in self._beams(0.0)]
            extents = [
                (across * is_single, down) for (across, down), is_single in zip(extents, has_single_beam, strict=True)
            ]
        lobes = 2 * np.max(extents, axis=0) * self.sonar.pulse.frequency / self.sound_speed
        steps = np.clip(np.ceil(_STEPS_PER_LOBE * lobes), 40, _MAX_STEPS).astype(int)
        right, down = (np.linspace(-1, 1, 2 * (count // 2) + 1) for count in steps)
        cosines = np.stack(np.meshgrid(right, down), axis=-1).reshape(-1, 2)
        cosine_squared = 1 - np.sum(cosines**2, axis=1)
        front = cosine_squared > 1e-4
        direction = np.column_stack([np.sqrt(cosine_squared[front]), cosines[front]])
        gain = np.abs(self._gain(0.0, direction, separate=separate))
        return np.asarray(direction[gain >= _MIN_RELATIVE_GAIN * gain.max()])

    def _beams(self, offset: float) -> tuple[Beams, Beams]:
        """Transmit and receive beams at one frequency."""
        sonar, frequency = self.sonar, self.sonar.pulse.frequency + offset
        receive = single_element(sonar.receive) if sonar.receiver.record == "elements" else sonar.beam_arrays[-1]
        return beams(sonar.beam_arrays[0], frequency, self.sound_speed), beams(receive, frequency, self.sound_speed)

    def _gain(self, offset: float, direction: Floats, *, separate: bool) -> Floats:
        """Two-way amplitude gain at one frequency [1], shape (n,): of a separate beam, or of the common pattern."""
        ends = self._beams(offset)
        transmit_gain, receive_gain = (
            (end.single_beam(0) if separate or end.channel_count == 1 else common_pattern(end)).gain(direction)[0]
            for end in ends
        )
        return np.asarray(transmit_gain * receive_gain)

    def _response(self, offset: float, *, separate: bool) -> Floats:
        """Pressure at one frequency re that on axis without absorption [1], shape (n,)."""
        absorption = self.water.relative_absorption(np.array(self.distance), offset, self.sonar.pulse.frequency)
        return np.asarray(self._gain(offset, self._directions[separate], separate=separate) * absorption)


def _extent(array: AnyArray) -> tuple[float, float]:
    """Size of an array to its right and down [m]."""
    aperture = filled_aperture(array)
    if isinstance(aperture, PlanarArray):
        return aperture.width, aperture.height
    return (aperture.length, 0.0) if isinstance(aperture, LineArray) else (0.0, 0.0)
