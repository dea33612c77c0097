"""Back-projection: many pings as one long array, focused on each pixel."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.processing._backprojection_kernel import SonarTrack, backproject_pings
from insonify.processing._fractional_delay import FINER, REACH, CellClock, oversampled_cells
from insonify.processing.element_series import checked_carrier, checked_positions, element_series, taper, uniform_clock
from insonify.thread_count import thread_count
from insonify.validity import require_number, require_numbers

Floats = NDArray[np.float64]

PIXELS_AT_ONCE = 2048
"""Pixels that a thread processes together."""
CELLS_AT_ONCE = 8_000_000
"""Largest number of fine cells in memory, 8 bytes each."""


def backproject(
    pressure: ArrayLike, time: ArrayLike, transmit: ArrayLike, receive: ArrayLike, grid: ArrayLike, *,
    centre_frequency: float, sound_speed: float = 1500.0, receive_velocity: ArrayLike | None = None,
    shading: ArrayLike | None = None, track_direction: ArrayLike | None = None, max_angle: float | None = None,
    angle_shading: str = "uniform", threads: int | None = None,
) -> NDArray[np.complex64]:  # fmt: skip
    """Complex image by back-projection of matched-filtered pings of a moving array.

    Each pixel sums every series at the delay of its own echo: from the transmitter's position at transmission to the
    receiver's at reception. The track need not be straight nor the pings evenly spaced; positions are the caller's,
    micronavigation included. The pixels lie on an assumed surface: a depth error dz
    shifts echoes by about dz times the tangent of the grazing angle, and defocuses only where the track is curved.

    Args:
        pressure: Matched-filtered complex baseband, shape (ping, channel, time).
        time: Sample times after the start of each transmission, evenly spaced [s], shape (time,).
        transmit: Position of the transmitter at the start of each transmission [m], shape (ping, 3).
        receive: Positions of the receivers at that time [m], shape (ping, channel, 3).
        grid: Positions of the pixels in the same frame [m], shape (..., 3).
        centre_frequency: Centre frequency of the baseband [Hz].
        sound_speed: Sound speed of the water [m/s].
        receive_velocity: Velocity of the receivers during reception, constant over a ping [m/s], shape (ping, channel,
                3), or anything that broadcasts to it; None: stop-and-hop.
        shading: Weight of each ping (ping,), or of each series (ping, channel), such as a taper of the aperture.
        track_direction: Unit vector along the track, shape (3,) or (ping, 3), for the limit of angles.
        max_angle: Largest angle off broadside at which a ping contributes to a pixel, at the transmitter [rad];
                None: every ping contributes to every pixel.
        angle_shading: Taper over the sine of that angle: uniform, cosine, hann, hamming, taylor.
        threads: Number of cores; default: all. Results are bit-identical for any number.

    Returns:
        Image, shape grid.shape[:-1], complex64: the weighted mean over the series that cover a pixel, so that a point
        echo of amplitude 1 in every ping has the value 1 at its position. Zero where no ping contributes. The phase is
        that of the scatterer: the carrier's phase over the delay is removed.

    Raises:
        ValueError: Shapes that do not fit; a limit of angles without a track direction.

    Source: Hawkins (1996), thesis, Canterbury, and Callow (2003), thesis, Canterbury (back-projection of synthetic
    aperture sonar, stop and hop); not verified. For a receiver of constant velocity the delay is a quadratic's root.

    Example:
        >>> north = np.arange(-1, 1.01, 0.05)  # 41 pings of a sonar that runs past a point at 30 m
        >>> track = np.stack([north, 0 * north, 0 * north], axis=-1)
        >>> delay, time = 2 * np.hypot(north, 30.0)[:, None] / 1500, 0.04 + np.arange(-50, 51) / 50e3
        >>> echo = np.sinc(20e3 * (time - delay)) * np.exp(-2j * np.pi * 100e3 * delay)
        >>> pixels = [[0, 30, 0], [0.05, 30, 0]]  # at the point, and half a resolution of 10 cm ahead of it
        >>> image = backproject(echo[:, None], time, track, track[:, None], pixels, centre_frequency=100e3)
        >>> print(abs(image).round(2))
        [1.   0.69]
    """
    series, clock = _pings(pressure, np.size(time)), uniform_clock(time)
    frequency, speed = checked_carrier(centre_frequency, sound_speed)
    count, channels = series.shape[:2]
    transmit_position = checked_positions("transmit", transmit, (count, 3))
    receive_position = checked_positions("receive", receive, (count, channels, 3))
    velocity = _velocity(receive_velocity, receive_position.shape, speed)
    weight = _weights(shading, count, channels)
    axis, max_sine, window = _angles(track_direction, max_angle, angle_shading, count)
    pixels = require_numbers("grid", grid, "m", allow_nan=False)
    if pixels.ndim < 1 or pixels.shape[-1] != 3:
        raise ValueError(f"grid has shape {pixels.shape}; give positions in three axes, (..., 3)")
    flat_pixels = np.ascontiguousarray(pixels.reshape(-1, 3).T)
    sums, weights = np.zeros(2 * flat_pixels.shape[1], np.float32), np.zeros(flat_pixels.shape[1], np.float32)
    columns, workers = (transmit_position, receive_position, velocity, weight, axis), thread_count(threads)
    with ThreadPoolExecutor(workers) as pool:
        for part in _batches(count, channels * series.shape[2] * FINER):
            cells = oversampled_cells(series[part], workers=workers)

            def add_pixels(begin: int, cells: NDArray[np.complex64] = cells, part: slice = part) -> None:
                end = begin + PIXELS_AT_ONCE
                times = CellClock(clock[0] - REACH / clock[1], clock[1] * FINER, frequency, speed)
                track = SonarTrack(*(own[part] for own in columns))
                backproject_pings(
                    cells, times, track, max_sine, window,
                    np.ascontiguousarray(flat_pixels[:, begin:end]), sums[2 * begin : 2 * end], weights[begin:end],
                )  # fmt: skip

            list(pool.map(add_pixels, range(0, flat_pixels.shape[1], PIXELS_AT_ONCE)))
    image = sums.view(np.complex64) / np.where(weights > 0, weights, np.float32(1))
    return np.asarray(image, np.complex64).reshape(pixels.shape[:-1])


def along_track_resolution(half_angle: float, centre_frequency: float, sound_speed: float = 1500.0) -> float:
    """Along-track resolution at -3 dB of a point insonified uniformly from -half_angle to half_angle off broadside [m].

    0.886 of the spatial period c / (4 f sin(half_angle)) of a two-way aperture; for an element of length D,
    used to its -3.9 dB points one way (sin(half_angle) = wavelength / 2 D), that is 0.44 D, and less sharp with its
    own taper; out to its first nulls half of that.

    Args:
        half_angle: Largest angle off broadside [rad].
        centre_frequency: Centre frequency of the pulse [Hz].
        sound_speed: Sound speed of the water [m/s].

    Raises:
        ValueError: An angle of zero, or beyond a right angle.

    Source: width of a sinc, as in Hawkins (1996), ch. 4; not verified.

    Example:
        >>> round(along_track_resolution(np.arcsin(0.015 / (2 * 0.10)), 100e3), 3)  # of elements of 10 cm
        0.044
    """
    frequency, speed = checked_carrier(centre_frequency, sound_speed)
    max_angle = require_number(
        "half_angle", half_angle, "rad", 0.0, np.pi / 2, exclude_low=True, example="np.radians(10)"
    )
    return float(0.8859 * speed / (4 * frequency * np.sin(max_angle)))


def _pings(pressure: ArrayLike, samples: int) -> NDArray[np.complex64]:
    series = element_series(pressure, samples)
    if series.ndim != 3:
        raise ValueError(f"pressure has shape {series.shape}; give (ping, channel, time)")
    return series


def _batches(count: int, cells_each: int) -> list[slice]:
    """Slices of pings processed together: as many as the memory limit allows, independent of the machine."""
    at_once = max(1, CELLS_AT_ONCE // max(1, cells_each))
    return [slice(begin, begin + at_once) for begin in range(0, count, at_once)]


def _velocity(velocity: ArrayLike | None, shape: tuple[int, ...], sound_speed: float) -> Floats:
    given = require_numbers("receive_velocity", 0.0 if velocity is None else velocity, "m/s", allow_nan=False)
    try:
        rows = np.array(np.broadcast_to(given, shape), float, order="C")
    except ValueError:
        raise ValueError(f"receive_velocity has shape {given.shape}; give one that broadcasts to {shape}") from None
    fastest = float(np.sqrt((rows**2).sum(axis=-1)).max(initial=0.0))
    if fastest >= sound_speed / 10:
        raise ValueError(f"receive_velocity reaches {fastest:g} m/s; give speeds below a tenth of the speed of sound")
    return rows


def _weights(shading: ArrayLike | None, pings: int, channels: int) -> Floats:
    given = require_numbers("shading", 1.0 if shading is None else shading, "", 0.0, allow_nan=False)
    if given.ndim == 1:
        given = given[:, None]
    if given.ndim and given.shape not in ((pings, 1), (pings, channels)):
        raise ValueError(f"shading has shape {given.shape}; give ({pings},) or ({pings}, {channels})")
    return np.array(np.broadcast_to(given, (pings, channels)), float, order="C")


def _angles(
    track_direction: ArrayLike | None, max_angle: float | None, shading: str, pings: int
) -> tuple[Floats, float, NDArray[np.float32]]:
    """Axis at each ping, sine of the largest angle (2: no limit), and its taper from the middle outward."""
    window = np.asarray(taper("angle_shading", shading, np.linspace(0, 0.5, 257)), np.float32)
    if max_angle is None:
        if shading != "uniform":
            raise ValueError(f"angle_shading is {shading!r} without a limit; give max_angle, the angle where it ends")
        return np.zeros((pings, 3)), 2.0, window
    sine = np.sin(
        require_number("max_angle", max_angle, "rad", 0.0, np.pi / 2, exclude_low=True, example="np.radians(10)")
    )
    if track_direction is None:
        raise ValueError(
            "max_angle is given without track_direction; give the unit vector along the track, (3,) or (ping, 3)"
        )
    given = require_numbers("track_direction", track_direction, "", allow_nan=False)
    if given.shape not in ((3,), (pings, 3)) or np.any(np.abs(np.linalg.norm(given, axis=-1) - 1) > 1e-6):
        raise ValueError(f"track_direction has shape {given.shape}; give unit vectors, (3,) or ({pings}, 3)")
    return np.array(np.broadcast_to(given, (pings, 3)), float, order="C"), float(sine), np.maximum(window, 0)
