"""Error of taking beams and absorption at a few frequencies of the band only, and the sub-bands that keep it small.

The error is that of reverberation: rms over all directions in front of the arrays, weighted by the gain of both beams
and by the pulse's spectrum, at the end of the window, where absorption differs most between frequencies. The beams are
the first of each array, and both arrays face the same direction.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import Water
from insonify.sonar.array import LineArray, PlanarArray
from insonify.sonar.beam import beams
from insonify.sonar.element_array import AnyArray
from insonify.sonar.hydrophones import filled_aperture, one_element
from insonify.sonar.received_pulse import ReceivedPulse
from insonify.sonar.sonar import Sonar
from insonify.sonar.sub_bands import band_nodes, half_bandwidth, lagrange_weights
from insonify.units import level_db

Floats = NDArray[np.float64]

ENOUGH_DB = -30.0
"""Error [dB re the rms of the sound] that is small beside speckle, and half of what 0.5 dB of calibration leaves."""
TRIED = (1, 2, 3, 4, 5, 6, 8, 12, 16, 24, 32)
"""Numbers of sub-bands [1]."""
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

    def error_db(self, count: int) -> float:
        """Rms error re the rms of the sound [dB], -300 for none.

        Args:
            count: Number of sub-bands.
        """
        node = band_nodes(self.pulse, count)
        at = np.array([self._response(offset, self._directions) for offset in node])
        error = self._known - lagrange_weights(node, self._offsets).T @ at
        return float(level_db(max(self._power(error) / self._power(self._known), 1e-30)))

    @cached_property
    def enough(self) -> int | None:
        """Least of `TRIED` that reaches `ENOUGH_DB`; None: none does."""
        return next((count for count in TRIED if self.error_db(count) <= ENOUGH_DB), None)

    @cached_property
    def _offsets(self) -> Floats:
        edge = half_bandwidth(self.pulse)
        return np.linspace(-edge, edge, _FREQUENCIES)

    @cached_property
    def _known(self) -> Floats:
        return np.array([self._response(offset, self._directions) for offset in self._offsets])

    def _power(self, pressure: Floats) -> float:
        """Energy over the band and over all directions, alike per solid angle; pressure of shape (frequencies, n)."""
        spectrum = np.abs(self.pulse.spectrum(self._offsets)) ** 2
        return float(spectrum @ pressure**2 @ (1 / self._directions[:, 0]))

    @cached_property
    def _directions(self) -> Floats:
        """Directions that both beams receive, on a grid of direction cosines in the arrays' frame, shape (n, 3)."""
        arrays = self.sonar.transmit, self.sonar.receive
        extent = np.max([_extent(array) for array in arrays], axis=0)
        lobes = 2 * extent * self.sonar.pulse.frequency / self.sound_speed
        steps = np.clip(np.ceil(_PER_LOBE * lobes), 40, _MOST).astype(int)
        right, down = (np.linspace(-1, 1, 2 * (count // 2) + 1) for count in steps)
        cosines = np.stack(np.meshgrid(right, down), axis=-1).reshape(-1, 2)
        ahead = 1 - np.sum(cosines**2, axis=1)
        front = ahead > 1e-4
        direction = np.column_stack([np.sqrt(ahead[front]), cosines[front]])
        gain = np.abs(self._gain(0.0, direction))
        return np.asarray(direction[gain >= _WEAK * gain.max()])

    def _gain(self, offset: float, direction: Floats) -> Floats:
        """Gain of both beams at one frequency [1], shape (n,)."""
        sonar, frequency = self.sonar, self.sonar.pulse.frequency + offset
        receive = one_element(sonar.receive) if sonar.receiver.record == "elements" else sonar.beam_arrays[-1]
        transmitted, received = (
            beams(array, frequency, self.sound_speed).single_beam(0).gain(direction)[0]
            for array in (sonar.beam_arrays[0], receive)
        )
        return np.asarray(transmitted * received)

    def _response(self, offset: float, direction: Floats) -> Floats:
        """Pressure at one frequency in those directions, through both beams and the water [1], shape (n,)."""
        absorbed = self.water.relative_absorption(np.array(self.distance), offset, self.sonar.pulse.frequency)
        return np.asarray(self._gain(offset, direction) * absorbed)


def _extent(array: AnyArray) -> tuple[float, float]:
    """Size of an array to its right and down [m]."""
    whole = filled_aperture(array)
    if isinstance(whole, PlanarArray):
        return whole.width, whole.height
    return (whole.length, 0.0) if isinstance(whole, LineArray) else (0.0, 0.0)
