"""Beams of one array from a direction grid: an arrival is deposited about its own direction, once for all beams.

Each arrival is deposited on seven rows of direction cosines (see `shared_directions`). An aperture's pattern is the
sum of the phasors of points along it; so the rows are transformed to such points, and these to beams, at each frequency
of the band with the phase that is due there. Only what all beams have in common, which changes slowly with frequency,
is deposited for a few frequencies.

Source: non-uniform FFT of type 1; Greengard & Lee (2004), SIAM Review 46(3), section 2. Beams as sums of phasors of an
array's elements; van Trees (2002), Optimum Array Processing, ch. 2 (not verified).
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy
from numpy.typing import NDArray

from insonify.recent_results import RecentResults
from insonify.sonar.aperture import cosine_series
from insonify.sonar.ping_geometry import PingGeometry
from insonify.sonar.shared_directions import common_pattern, row_step, share_directions
from insonify.sonar.sub_bands import SubBand, half_bandwidth, lagrange_weights
from insonify.synthesis._beam_spectra_kernel import AperturePoints, form_beams
from insonify.synthesis._direction_grid_kernel import DirectionRows, combine_rows
from insonify.synthesis._gridding_kernel import CELLS_PER_SPIKE, kernel_transform
from insonify.synthesis._gridding_kernel import WIDTH as WIDTH
from insonify.synthesis.element_arrivals import carrier_band
from insonify.synthesis.time_grid import WAVEFORM_CHANNELS, TimeGrid, convolve_waveforms, waveform_spectra
from insonify.synthesis.waveform_basis import WaveformBasis

Floats = NDArray[np.float64]
Cells = NDArray[np.complex64]
WEAK = 1e-9
"""Magnitude of the received pulse's spectrum re its maximum below which beams are not formed [1]."""
_RESPONSE_DEGREE = 12
"""Degree of a polynomial that is one over the transform of the gridding kernel to 1e-12."""
_MOST_CYCLES = 0.35
"""Cycles per row up to which that polynomial is fitted; by the rows' spacing, the ends of apertures have a quarter."""
_WEIGHTS: RecentResults[NDArray[np.float32]] = RecentResults(16)


@dataclass(frozen=True, slots=True)
class DirectionGrid:
    """Direction grid of one array, from whose rows its beams follow."""

    rows: tuple[DirectionRows, ...]
    """Rows of the grid, for each of `bands`."""
    row_count: int
    """Number of rows."""
    bands: tuple[SubBand, ...]
    """Patterns common to all beams, at the frequencies for which echoes are deposited."""
    steer: Floats
    """Direction cosines to the right of the beams' axes [1], shape (beams,)."""
    scale: Floats
    """Scale of each beam's gain at those frequencies [1], shape (bands, beams)."""
    points: AperturePoints
    """Points of the aperture."""
    ping_geometry: PingGeometry
    """The sonar."""

    def beams(self, cells: Cells, grid: TimeGrid, basis: WaveformBasis) -> NDArray[np.complex64]:
        """Complex envelope of each beam.

        Args:
            cells: Cells of the rows [uPa], shape (bands, rows, groups, cells, waveforms of a group).
            grid: The time grid.
            basis: Waveforms of the grid's frequencies.

        Returns:
            Complex envelope at grid.time [uPa], shape (beams, samples).
        """
        factors, half = basis.grid_factors(self.ping_geometry.pulse, grid), grid.padded_samples // 2
        if not self.ping_geometry.sub_bands:
            return convolve_waveforms(self._beam_cells(cells), grid, factors)
        low, high = _received_bins(scipy.fft.fftshift(np.abs(factors).max(axis=(0, 1))))
        filled = np.flatnonzero(np.any(cells != 0, axis=(0, 2, 3, 4)))
        rows = np.empty((len(filled), high - low), complex)
        for first in range(0, len(filled), WAVEFORM_CHANNELS):
            part = slice(first, first + WAVEFORM_CHANNELS)
            spectra = waveform_spectra(cells[:, filled[part]], grid, factors)
            rows[part] = scipy.fft.fftshift(spectra, axes=1)[:, low:high]
        increment = grid.sample_rate / grid.padded_samples / self.ping_geometry.frequency
        beams = np.empty((len(self.steer), high - low), complex)
        form_beams(
            rows, self.row_cosines[filled], self.rows[0].step, self.steer, self.points, 1 + (low - half) * increment,
            increment, beams,
        )  # fmt: skip
        offset = (np.arange(low, high) - half) * grid.sample_rate / grid.padded_samples
        weights = lagrange_weights(basis.band, offset, -basis.band_edge, basis.band_edge)
        window = slice(grid.lead_samples, grid.lead_samples + grid.sample_count)
        series, whole = np.empty((len(beams), grid.sample_count), np.complex64), np.zeros(grid.padded_samples, complex)
        for beam, (spectrum, on_axis) in enumerate(zip(beams, 1 / self.scale.T, strict=True)):
            # gains of elements are interpolated, which are smoother than one over them
            whole[low:high] = spectrum / (on_axis @ weights)
            series[beam] = scipy.fft.ifft(scipy.fft.ifftshift(whole))[window]
        return series

    @property
    def row_weights(self) -> NDArray[np.float32]:
        """Weight of each row in each beam at the carrier [1], shape (beams, rows); cached for the next ping."""
        arrays = self.steer, self.scale, self.points.position, self.points.weight
        key = (self.rows[0].step, self.row_count, *(array.tobytes() for array in arrays))
        return _WEIGHTS.get(key, self._row_weights)

    @property
    def row_cosines(self) -> Floats:
        """Direction cosine of each row [1], shape (rows,)."""
        return np.asarray(self.rows[0].first + self.rows[0].step * np.arange(self.row_count), float)

    def _beam_cells(self, cells: Cells) -> Cells:
        """Cells of the beams from those of the rows, where patterns are those of the carrier throughout."""
        beams = np.empty((1, len(self.steer), *cells.shape[2:]), np.complex64)
        parts = [part.reshape(len(part), -1).view(np.float32) for part in (cells[0], beams[0])]
        combine_rows(parts[0], self.row_weights, parts[1])
        return beams

    def _row_weights(self) -> NDArray[np.float32]:
        """Compute `row_weights`."""
        points = self.points
        squared = (points.position * self.rows[0].step) ** 2
        weight = points.weight * np.polynomial.polynomial.polyval(squared, points.inverse_response)
        turns = [2 * np.pi * np.outer(cosine, points.position) for cosine in (self.steer, self.row_cosines)]
        sums = sum(np.einsum("bj,rj,j->br", *(part(angle) for angle in turns), weight) for part in (np.cos, np.sin))
        return np.ascontiguousarray(self.scale[0][:, None] * sums, np.float32)


def direction_grid(ping_geometry: PingGeometry) -> DirectionGrid | None:
    """Direction grid of a ping's beams; None where beams are few or differ in more than horizontal steering."""
    transmit, receive = ping_geometry.transmit_beams, ping_geometry.receive_beams
    if ping_geometry.elements is not None or not share_directions(transmit, receive):
        return None
    bands = ping_geometry.sub_bands or (carrier_band(ping_geometry),)
    top = 1 + half_bandwidth(ping_geometry.pulse) / ping_geometry.frequency if ping_geometry.sub_bands else 1.0
    step, steered = row_step(transmit, receive) / top, transmit.channel_count > 1
    count = -(-(int(np.ceil(2 / step)) + 2 * CELLS_PER_SPIKE) // 4) * 4
    first, no_rows = -step * (count - 1) / 2, np.empty((0, 4))
    rows = tuple(
        DirectionRows(
            first, step, *((band.transmit_beams.tables[0].copy(), float(band.transmit_beams.per_unit[0])) if steered
                           else (no_rows, 1.0)),
        )
        for band in bands
    )  # fmt: skip
    common = tuple(
        SubBand(
            band.offset, common_pattern(band.transmit_beams) if steered else band.transmit_beams,
            common_pattern(band.receive_beams),
        )
        for band in bands
    )  # fmt: skip
    scale = np.array([band.receive_beams.scale * (band.transmit_beams.scale if steered else 1.0) for band in bands])
    ends = (transmit, receive) if steered else (receive,)
    sides = tuple(end.across for end in ends if end.across.extent > 0)
    reach = 1 + float(np.abs(receive.steer[:, 0]).max())
    points = AperturePoints(*cosine_series(sides, reach * top), _response())
    return DirectionGrid(rows, count, common, np.ascontiguousarray(receive.steer[:, 0]), scale, points, ping_geometry)


def _received_bins(magnitude: Floats) -> tuple[int, int]:
    """Index of the first frequency with a magnitude above `WEAK` re the largest, and one past that of the last."""
    strong = np.flatnonzero(magnitude > WEAK * magnitude.max(initial=0.0))
    return (int(strong[0]), int(strong[-1]) + 1) if len(strong) else (0, 0)


@lru_cache(maxsize=1)
def _response() -> Floats:
    """Coefficients of one over the transform of the gridding kernel, see `AperturePoints.inverse_response`."""
    cycles = np.linspace(0, _MOST_CYCLES, 400)
    series = np.polynomial.Polynomial.fit(cycles**2, 1 / kernel_transform(cycles), _RESPONSE_DEGREE)
    return np.ascontiguousarray(series.convert().coef)
