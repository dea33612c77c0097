"""Covariance of directional noise between the channels of an array.

Each direction sends an independent plane wave. So the covariance of two channels is the mean over directions of the
product of their patterns, times the phase between their positions: sin(kd) / kd for hydrophones in isotropic noise,
one over the directivity factor on the diagonal.

Wavelengths are those of the centre of the band.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.sea_noise import Directionality
from insonify.sonar.beam import POINTS_PER_LOBE, Beams
from insonify.sonar.beam_kernels import BAFFLED, OMNI
from insonify.sonar.ping_geometry import PingGeometry
from insonify.synthesis.element_arrivals import rotated_beams

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

MAX_DEPTH = 1e-9
"""Depth of an array along boresight, in wavelengths, below which it counts as planar [1]."""
AT_ONCE = 4_000_000
"""Largest product of numbers of channels and directions that are processed together."""
MIN_AZIMUTHS = 720
"""Least number of azimuths around an array of differently oriented elements: baffle edges lie between nodes."""
DIAGONAL_LOADING = 1e-9
"""Fraction of the mean power added to the diagonal: the matrix is positive definite also of identical channels [1]."""


def noise_covariance(ping_geometry: PingGeometry, directionality: Directionality) -> Complexes:
    """Covariance of the channels' noise, for unit power at an omnidirectional hydrophone [1].

    Args:
        ping_geometry: The sonar at one ping; beams and elements at rest.
        directionality: Directional distribution of the noise.

    Returns:
        Hermitian matrix, shape (channels, channels). Channels that share one receive beam stand for separate pings
        and are independent; element errors of gain and phase are not included.

    Source: Cox (1973), J. Acoust. Soc. Am. 54(5), 1289-1301 (plane waves of any directional density); Cron & Sherman
    (1962), J. Acoust. Soc. Am. 34(11), 1732-1736 (isotropic: sin kd / kd; surface dipoles: density cos / pi of the
    angle from the zenith, 2 J1(kd) / kd at equal depth). The closed forms follow from the mean over directions; the
    papers themselves were not opened.
    Valid: plane waves; a surface without bottom bounces, at depths where absorption does not yet weaken the zenith.
    """
    if ping_geometry.elements is None and ping_geometry.receive_beams.channel_count < ping_geometry.channel_count:
        single = _direction_average(ping_geometry, directionality)
        return single[0, 0] * np.eye(ping_geometry.channel_count)
    closed_form = _closed_form(ping_geometry) if directionality == "isotropic" else None
    return _direction_average(ping_geometry, directionality) if closed_form is None else closed_form.astype(complex)


def covariance_factor(covariance: Complexes) -> Complexes:
    """Lower triangular factor whose product with its conjugate transpose is a covariance.

    Args:
        covariance: Hermitian, positive or nearly positive definite, shape (n, n).
    """
    load = DIAGONAL_LOADING * max(float(np.trace(covariance).real) / len(covariance), np.finfo(float).tiny)
    return np.asarray(np.linalg.cholesky(covariance + load * np.eye(len(covariance))))


def _closed_form(ping_geometry: PingGeometry) -> Floats | None:
    """Covariance of isotropic noise of point elements, omnidirectional, or equal ones in one plane; else None."""
    from scipy.special import spherical_jn

    elements, pattern = ping_geometry.elements, ping_geometry.receive_beams
    if elements is None or any(len(table) for table in pattern.tables):
        return None
    wavelength = ping_geometry.receive_sound_speed / ping_geometry.frequency
    phase = 2 * np.pi / wavelength * _distances(elements.positions)
    if pattern.element == OMNI:
        return np.sinc(phase / np.pi)
    flat = np.ptp(elements.positions[:, 0]) < MAX_DEPTH * wavelength
    if not flat or np.any(elements.orientations != 0):
        return None
    # by symmetry the front half space contributes half of the total
    if pattern.element == BAFFLED:
        return np.asarray(np.sinc(phase / np.pi) / 2)
    divisor = np.where(phase > 1e-4, phase, 1.0)
    return np.asarray(np.where(phase > 1e-4, spherical_jn(1, divisor) / divisor, 1 / 3) / 2)


def _distances(position: Floats) -> Floats:
    """Distance of every two positions (m, 3) [m], shape (m, m)."""
    return np.asarray(np.sqrt(sum((axis[:, None] - axis) ** 2 for axis in position.T)))


def _direction_average(ping_geometry: PingGeometry, directionality: Directionality) -> Complexes:
    """Covariance by quadrature over directions, fine enough for all patterns and distances."""
    patterns = ping_geometry.receive_beams
    position, orientation = np.zeros((1, 3)), np.zeros(1)
    if ping_geometry.elements is not None:
        position, orientation = ping_geometry.elements.positions, ping_geometry.elements.orientations
    wavelength = ping_geometry.receive_sound_speed / ping_geometry.frequency
    channels = patterns.channel_count if ping_geometry.elements is None else len(position)
    covariance = np.zeros((channels, channels), complex)
    is_flat = directionality == "isotropic" and np.ptp(position[:, 2]) == 0
    parts = _directions(patterns, position / wavelength, orientation, max(1, AT_ONCE // channels), symmetric=is_flat)
    for direction, weight in parts:
        outward = direction @ patterns.axes
        density = (
            np.full(len(weight), 1 / (4 * np.pi)) if directionality == "isotropic" else _surface_dipole_density(outward)
        )
        received = _patterns(patterns, orientation, outward) * np.exp(
            2j * np.pi / wavelength * (position @ direction.T)
        )
        covariance += (received * (weight * density)) @ received.conj().T
    return np.asarray((covariance + covariance.conj().T) / 2, complex)


def _surface_dipole_density(outward: Floats) -> Floats:
    """Density of noise from surface dipoles over directions (north, east, down) [1/sr], shape (n,)."""
    return np.maximum(-outward[:, 2], 0.0) / np.pi


def _patterns(patterns: Beams, orientation: Floats, outward: Floats) -> Floats:
    """Amplitude of each channel towards directions in the world [1], shape (channels or 1, n)."""
    if not orientation.any():
        return patterns.gain(outward)
    angles, row = np.unique(orientation, return_inverse=True)
    return np.concatenate([rotated_beams(patterns, float(angle)).gain(outward) for angle in angles])[row]


def _directions(
    patterns: Beams, position: Floats, orientation: Floats, max_directions: int, *, symmetric: bool
) -> Iterator[tuple[Floats, Floats]]:
    """Directions in the array's frame and their solid angles [sr], in batches of limited size.

    Args:
        patterns: Patterns of the channels.
        position: Channel positions in the array's frame [wavelengths], shape (m, 3).
        orientation: Orientations of the elements [rad], shape (m,).
        max_directions: Largest number of directions in a batch.
        symmetric: True if the elements receive equally from above and below the array's plane.
    """
    # the tables have this many rows per wavelength of aperture
    across, down, piston_across, piston_down = patterns.per_unit / POINTS_PER_LOBE
    ahead, right, below = np.ptp(position, axis=0)
    width, height = right + across + piston_across, below + down + piston_down
    extent = 2 * np.pi * float(np.linalg.norm([width, height, ahead]))
    if np.ptp(orientation) == 0:
        # pole to the right: baffle edges, and the horizon of an array that is not tilted, are meridians
        quarters = np.arange(-2, 3) * np.pi / 2 - np.pi / 2
        along = _gauss(np.array([-1.0, 1.0]), extent)
        around = _gauss(quarters, 2 * np.pi * np.hypot(height, ahead))
        frame = [1, 0, 2]
    else:
        along = _gauss(np.array([0.0, 1.0]) if symmetric else np.array([-1.0, 0.0, 1.0]), extent)
        count = max(MIN_AZIMUTHS, _node_count(2 * np.pi * np.hypot(width, ahead)) * 2)
        around = (np.arange(count) + 0.5) * 2 * np.pi / count, np.full(count, 2 * np.pi / count)
        frame = [2, 0, 1]
        along = (along[0], 2 * along[1]) if symmetric else along
    rows = max(1, max_directions // len(around[0]))
    for first in range(0, len(along[0]), rows):
        pole, azimuth = (grid.ravel() for grid in np.meshgrid(along[0][first : first + rows], around[0], indexing="ij"))
        ring = np.sqrt(1 - pole**2)
        direction = np.empty((len(pole), 3))
        for axis, values in zip(frame, (pole, ring * np.cos(azimuth), ring * np.sin(azimuth)), strict=True):
            direction[:, axis] = values
        yield direction, np.outer(along[1][first : first + rows], around[1]).ravel()


def _gauss(edges: Floats, wavenumber: float) -> tuple[Floats, Floats]:
    """Gauss-Legendre nodes and weights over adjacent equal intervals, for waves of `wavenumber` radians per unit.

    Source: Gauss-Legendre quadrature; a wave exp(j K x) over -1 to 1 needs a little over K / 2 nodes.
    """
    from scipy.special import roots_legendre

    half = np.diff(edges)[0] / 2
    node, weight = roots_legendre(_node_count(wavenumber * half))
    centres = (edges[:-1] + edges[1:]) / 2
    return (centres[:, None] + half * node).ravel(), np.tile(half * weight, len(centres))


def _node_count(phase: float) -> int:
    """Number of nodes for a wave that turns by `phase` [rad] over half an interval."""
    return int(np.ceil(phase / 2 + 6 * np.cbrt(phase) + 12))
