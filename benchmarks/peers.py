"""Other programs beside insonify on the same scatterers, elements and range: `python benchmarks/peers.py [--smoke]`.

    pip install pymust pyroomacoustics finufft

What is not installed is left out. Free field: the echoes of points ahead of a line of elements half a wavelength apart,
as series of every element. Timed is all from positions of the points to the series; insonify runs on one thread, the
others on as many as they take. Beside each speed stands the difference of the two results.

* PyMUST, `simus`: sums of harmonics, points by elements by frequencies.
* finufft: exact delays with numpy, a type 1 transform per element, the pulse applied in the band.
* Replicas: the method of the paper, section 4; every echo writes its pulse, carrier and all, at 1 MHz.
* pyroomacoustics: rooms by image sources; here a channel, and its images are rendered by both.
"""

import importlib.util
import math
import sys
import time
from collections.abc import Callable

import numpy as np

import ledger
import measure
import run
from bench_synthesis import passband_replicas
from insonify.synthesis._arrival_kernel import ReceiveBeams, ReceiveLegs, Reception, TransmitLegs
from insonify.synthesis._arrival_time_kernel import ArrayWater
from insonify.synthesis._element_arrivals_kernel import PairedLegs, deposit_on_elements
from insonify.synthesis.chebyshev_nodes import aperture_nodes
from insonify.synthesis.sector_interpolation import NO_SECTOR
from insonify.synthesis.time_grid import TimeGrid, convolve_pulse, time_grid
from insonify.synthesis.waveform_basis import WaveformBasis
from measure import Result

SPEED, CARRIER, ELEMENTS, RATE = 1500.0, 100e3, 32, 160e3
PITCH = SPEED / CARRIER / 2
WIDTH = 0.8 * PITCH
NEAREST, FARTHEST = 5.0, 40.0
NARROW = 25e3
"""Samples per second of the band of pulses of 0.2 ms and longer [Hz]."""
POINTS = 20_000
REPLICA_POINTS = 200
REPLICA_SECONDS = 2e-3
REFLECTIONS = 10
"""Highest order of the images of the channel."""
MICROPHONES = 64
REPEATS = 3


def points(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions across and ahead of the array [m], (count, 2), and real reflectivities [1]."""
    random = np.random.default_rng(1)
    range_, angle = random.uniform(NEAREST, FARTHEST, count), random.uniform(-0.7, 0.7, count)
    return np.column_stack([range_ * np.sin(angle), range_ * np.cos(angle)]), random.normal(size=count)


def level(position: np.ndarray) -> np.ndarray:
    """Positions in the plane with a third coordinate of zero, shape (n, 3)."""
    return np.column_stack([position, np.zeros(len(position))])


def line(elements: int, pitch: float) -> np.ndarray:
    """Positions of the elements of a line about its centre [m], shape (elements,)."""
    return (np.arange(elements) - (elements - 1) / 2) * pitch


def rendered(
    position: np.ndarray, across: np.ndarray, weight: np.ndarray, source: float | None, grid: TimeGrid, carrier: float,
    spectrum: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Series of the elements of a line by insonify [1], shape (elements, samples).

    Args:
        position: Positions of the points [m], first along the line, shape (n, 3).
        across: Positions of the elements along it [m], shape (elements,).
        weight: Pressure at 1 m from each point, shape (n,) complex.
        source: Position of the transmitting point along the line [m]; None: the points transmit.
        grid: Time grid.
        carrier: Carrier [Hz].
        spectrum: Spectrum of the pulse at the grid's frequencies [s].
    """
    count, elements = len(position), len(across)
    radius = np.linalg.norm(position, axis=1)
    element_position = np.outer(across, [1.0, 0.0, 0.0])
    still, one, number = np.zeros((elements, 3)), np.ones((1, count)), np.arange(elements)
    basis = WaveformBasis(np.zeros(1)).weight_table
    to_point = 0 * radius if source is None else np.linalg.norm(position - [source, 0.0, 0.0], axis=1)
    towards = position / radius[:, None]
    transmit = TransmitLegs((to_point / SPEED)[None], one, weight.astype(np.complex64)[None, None])
    receive = ReceiveLegs(
        (radius / SPEED)[None], (1 / radius)[None], radius[None], np.empty((1, 0, count)), towards[None],
        (1 / radius)[None].astype(np.complex64), one[None].astype(np.float32),
    )  # fmt: skip
    beams = ReceiveBeams(element_position, still, still, np.stack([number, number + 1], axis=1), 0 * number, 0 * number)
    nodes = aperture_nodes(element_position, still, still, float(radius.min()), float(grid.time[-1]), SPEED / carrier)
    cells = grid.cells(elements).reshape(elements, 1, -1, 1)
    deposit_on_elements(
        cells, cells[:0], PairedLegs(np.zeros((1, 3), np.int64), transmit, receive, one), beams, nodes, NO_SECTOR,
        Reception(grid.first_time, grid.cell_rate, carrier, basis, ArrayWater(1 / SPEED, 0.0, 0.0, False, 0.0)),
    )  # fmt: skip
    return convolve_pulse(cells.reshape(elements, -1), grid, spectrum)


def taken(work: Callable[[], np.ndarray], repeats: int) -> tuple[float, np.ndarray]:
    """Least seconds of some runs after one, and the result."""
    result, best = work() if repeats > 1 else None, np.inf
    for _ in range(1 if measure.SMOKE else repeats):
        begin = time.perf_counter()
        result = work()
        best = min(best, time.perf_counter() - begin)
    return best, result


def difference(found: np.ndarray, reference: np.ndarray) -> float:
    """Relative rms difference of two fields, after one common complex factor."""
    factor = np.vdot(found, reference) / np.vdot(found, found)
    return float(np.linalg.norm(factor * found - reference) / np.linalg.norm(reference))


def band_of(pulse: np.ndarray, step: float, start: float, grid: TimeGrid, carrier: float) -> np.ndarray:
    """Spectrum of a real pulse about the carrier at the grid's frequencies [s].

    Args:
        pulse: Its samples.
        step: Their spacing [s].
        start: Time of the first re the echo's delay [s].
        grid: The grid.
        carrier: Carrier [Hz].
    """
    time_ = start + step * np.arange(len(pulse))
    spectrum = np.array([np.sum(pulse * np.exp(-2j * np.pi * (carrier + f) * time_)) for f in grid.frequencies])
    # nothing beyond the band: a real receiver's filter
    return np.where(np.abs(grid.frequencies) <= 0.45 * grid.sample_rate, spectrum, 0) * step


def envelope(series: np.ndarray, rate: float, grid: TimeGrid, carrier: float) -> np.ndarray:
    """Complex envelope of real series from time 0, in the band of a grid and at its times, shape (rows, samples).

    Args:
        series: Real series, shape (rows, any).
        rate: Their samples per second [Hz].
        grid: The grid.
        carrier: Carrier [Hz].
    """
    block = round(rate / math.gcd(round(rate), round(grid.sample_rate)))
    samples = -(-max(series.shape[1], round((grid.time[-1] + 1e-3) * rate)) // block) * block
    count = round(samples * grid.sample_rate / rate)
    offset = np.fft.fftfreq(count, 1 / grid.sample_rate)
    first = round(carrier * samples / rate)
    result = np.empty((len(series), len(grid.time)), complex)
    for row, one in enumerate(series):
        band = np.fft.fft(one, samples)[first + np.round(offset * samples / rate).astype(int)]
        band *= np.abs(offset) <= 0.45 * grid.sample_rate
        # the carrier lies between two bins of the transform
        shift = np.exp(2j * np.pi * (first * rate / samples - carrier) * grid.time)
        result[row] = np.fft.ifft(band)[: len(grid.time)] * shift * (2 * count / samples)
    return result


def tone(seconds: float) -> np.ndarray:
    """A tone with a smooth envelope, sampled at 10 MHz."""
    time_ = np.arange(round(seconds * 1e7)) * 1e-7
    return np.sin(np.pi * time_ / seconds) ** 2 * np.cos(2 * np.pi * CARRIER * time_)


def rate_lines(
    name: str, count: int, ours: float, other: float, other_count: int, unit: str, accuracy: str
) -> list[Result]:
    """Two lines of the table: insonify, then the peer with the ratio of both."""
    mine, theirs = count / ours / 1e6, other_count / other / 1e6
    return [
        Result(f"insonify, as {name}", mine, unit),
        Result(name, theirs, unit, f"insonify {mine / theirs:.0f} x", accuracy),
    ]


UNIT = "M point-elements/s"


def pymust() -> list[Result]:
    """PyMUST's `simus`: one element transmits; pulse and directivity are those of PyMUST."""
    import pymust as peer

    position, reflectivity = points(POINTS)
    parameters = peer.utils.Param()
    values = {"fc": CARRIER, "pitch": PITCH, "width": WIDTH, "Nelements": ELEMENTS, "bandwidth": 20, "TXnow": 1,
              "c": SPEED, "fs": 4 * CARRIER, "radius": np.inf}  # fmt: skip
    for key, value in values.items():
        setattr(parameters, key, value)
    parameters.TXapodization = np.eye(ELEMENTS)[ELEMENTS // 2 - 1]
    pulse, at = peer.getpulse(parameters, 2)
    step = float(at.ravel()[1] - at.ravel()[0]) * 50
    grid = time_grid(0.0, 2 * FARTHEST / SPEED + 1e-3, RATE, -2e-4, 6e-4)
    spectrum = band_of(pulse.ravel()[::50], step, -step * len(pulse.ravel()[::50]) / 2, grid, CARRIER)

    def simus() -> np.ndarray:
        series, _ = peer.simus(position[:, 0], position[:, 1], reflectivity, np.zeros((1, ELEMENTS)), parameters)
        return np.asarray(series)

    def insonify() -> np.ndarray:
        radius = np.hypot(*position.T)
        sine = position[:, 0] / radius
        # the gain of one element: its width, and the soft baffle's cosine
        gain = np.sinc(WIDTH * CARRIER / SPEED * sine) * position[:, 1] / radius
        weight = reflectivity * gain**2 + 0j  # spreads as cylindrical waves: 1 / range over both ways
        return rendered(level(position), line(ELEMENTS, PITCH), weight, -PITCH / 2, grid, CARRIER, spectrum)

    other, series = taken(simus, 1)
    ours, found = taken(insonify, REPEATS)
    accuracy = f"{difference(found, envelope(series.T, parameters.fs, grid, CARRIER)):.1e} rms"
    total = POINTS * ELEMENTS
    return rate_lines("PyMUST simus, 32 elements, 40 m", total, ours, other, total, UNIT, accuracy)


def echoes(count: int, pulse: np.ndarray, grid: TimeGrid) -> tuple[np.ndarray, np.ndarray, Callable[[], np.ndarray]]:
    """Points, pressures at 1 m from them and their series by insonify, with one omnidirectional transmitter."""
    position, reflectivity = points(count)
    weight = reflectivity / np.hypot(*position.T) + 0j
    spectrum = band_of(pulse, 1e-7, 0.0, grid, CARRIER)
    return (
        position,
        weight,
        lambda: rendered(level(position), line(ELEMENTS, PITCH), weight, 0.0, grid, CARRIER, spectrum),
    )


def finufft() -> list[Result]:
    """Exact delays with numpy, and one transform of type 1 per element, in single precision to 1e-5, on one thread."""
    import finufft as peer

    pulse = tone(2e-4)
    grid = time_grid(0.0, 2 * FARTHEST / SPEED + 1e-3, NARROW, -1e-4, 3e-4)
    position, weight, insonify = echoes(POINTS, pulse, grid)
    spectrum = np.fft.fftshift(band_of(pulse, 1e-7, 0.0, grid, CARRIER))
    samples = len(spectrum)

    def transforms() -> np.ndarray:
        radius, rows = np.hypot(*position.T), []
        for across in line(ELEMENTS, PITCH):
            back = np.hypot(position[:, 0] - across, position[:, 1])
            delay = (radius + back) / SPEED
            cycles = CARRIER * delay
            strength = (weight / back * np.exp(-2j * np.pi * (cycles - np.floor(cycles)))).astype(np.complex64)
            turn = np.mod(delay * NARROW / samples, 1.0) * 2 * np.pi
            modes = peer.nufft1d1(turn.astype(np.float32), strength, samples, isign=-1, eps=1e-5, nthreads=1)
            rows.append(np.fft.ifft(np.fft.ifftshift(modes * spectrum))[: grid.sample_count] * NARROW)
        return np.array(rows)

    seconds, found = taken(transforms, REPEATS)
    ours, series = taken(insonify, REPEATS)
    accuracy = f"{difference(series, found):.1e} rms"
    total = POINTS * ELEMENTS
    return rate_lines("finufft and numpy, 32 elements", total, ours, seconds, total, UNIT, accuracy)


def replicas() -> list[Result]:
    """The paper's method for one element, and the same pulse by insonify for all elements and points."""
    pulse = tone(REPLICA_SECONDS)
    grid = time_grid(0.0, 2 * FARTHEST / SPEED + 2 * REPLICA_SECONDS, NARROW, -1e-4, REPLICA_SECONDS + 1e-4)
    _, _, insonify = echoes(POINTS, pulse, grid)
    position, weight, _ = echoes(REPLICA_POINTS, pulse, grid)
    across = line(ELEMENTS, PITCH)[0]
    delay = (np.hypot(*position.T) + np.hypot(position[:, 0] - across, position[:, 1])) / SPEED
    amplitude = weight / np.hypot(position[:, 0] - across, position[:, 1])

    def summed() -> np.ndarray:
        series = np.zeros(round((grid.time[-1] + 1 / NARROW) * 1e6))
        passband_replicas(series, 1e6, delay, amplitude, CARRIER, REPLICA_SECONDS)
        return series

    seconds, series = taken(summed, REPEATS)
    ours, _ = taken(insonify, REPEATS)
    # the sum has no window over its pulses: the energies of both are compared
    theirs = envelope(series[None], 1e6, grid, CARRIER)[0]
    plain = tone_without_window(REPLICA_SECONDS)
    mine = rendered(
        level(position), line(ELEMENTS, PITCH), weight, 0.0, grid, CARRIER, band_of(plain, 1e-7, 0.0, grid, CARRIER)
    )
    accuracy = f"{difference(mine[0], theirs):.1e} rms"
    name = f"replicas at 1 MHz, {REPLICA_SECONDS * 1e3:g} ms"
    return rate_lines(name, POINTS * ELEMENTS, ours, seconds, REPLICA_POINTS, UNIT, accuracy)


def tone_without_window(seconds: float) -> np.ndarray:
    """A tone of constant amplitude, sampled at 10 MHz."""
    return np.cos(2 * np.pi * CARRIER * np.arange(round(seconds * 1e7)) * 1e-7)


def pyroomacoustics() -> list[Result]:
    """Images of a channel between two boundaries at a line of microphones, rendered by both."""
    import pyroomacoustics as peer

    rate, carrier, size = 96e3, 24e3, (300.0, 100.0, 15.0)
    across = line(MICROPHONES, SPEED / carrier / 2)
    centre = np.array([150.0, 20.0, 8.0])
    peer.constants.set("c", SPEED)
    boundary = {side: peer.Material(0.19 if side in ("floor", "ceiling") else 1.0) for side in
                ("east", "west", "north", "south", "floor", "ceiling")}  # fmt: skip

    room = peer.ShoeBox(size, fs=int(rate), materials=boundary, max_order=REFLECTIONS, air_absorption=False)
    room.add_source([150.0, 70.0, 5.0])
    room.add_microphone_array(np.array([centre[0] + across, 0 * across + centre[1], 0 * across + centre[2]]))

    def impulse_responses() -> np.ndarray:
        room.compute_rir()
        longest = max(len(responses[0]) for responses in room.rir)
        return np.array([np.pad(responses[0], (0, longest - len(responses[0]))) for responses in room.rir])

    seconds, responses = taken(impulse_responses, REPEATS)
    images, damping = room.sources[0].images.T, room.sources[0].damping[0]
    lead = peer.constants.get("frac_delay_length") // 2
    pulse = np.sin(np.pi * np.arange(10_000) * 1e-7 / 1e-3) ** 2 * np.cos(
        2 * np.pi * carrier * np.arange(10_000) * 1e-7
    )
    grid = time_grid(0.0, responses.shape[1] / rate, 12e3, -1e-4, 1.2e-3)
    spectrum = band_of(pulse, 1e-7, 0.0, grid, carrier)
    position = images - centre
    ours, found = taken(lambda: rendered(position, across, damping + 0j, None, grid, carrier, spectrum), REPEATS)
    sampled = np.cos(2 * np.pi * carrier * np.arange(96) / rate) * np.sin(np.pi * np.arange(96) / 96) ** 2
    convolved = np.array([np.convolve(one, sampled)[lead:] for one in responses])
    accuracy = f"{difference(found, envelope(convolved, rate, grid, carrier)):.1e} rms"
    total = len(images) * MICROPHONES
    return rate_lines(f"pyroomacoustics, {len(images)} images, 64 microphones", total, ours, seconds, total,
                      "M paths/s", accuracy)  # fmt: skip


PEERS = {"pymust": pymust, "finufft": finufft, "": replicas, "pyroomacoustics": pyroomacoustics}
"""Functions by the package that they need."""
SMALL = {"POINTS": 30, "REPLICA_POINTS": 10, "REFLECTIONS": 3, "REPEATS": 1, "FARTHEST": 12.0}


def main(arguments: list[str]) -> None:
    """Measure, print and append to the ledger; with --smoke once, small, and without the ledger."""
    if "--smoke" in arguments:
        measure.SMOKE = True
        globals().update(SMALL)
    names = [word for word in arguments if not word.startswith("-")]
    before = ledger.read()
    for package, bench in PEERS.items():
        if package and importlib.util.find_spec(package) is None:
            print(f"{package} is not installed: left out")
        elif not names or any(word in bench.__name__ for word in names):
            lines = bench()
            run.show(lines, before)
            if not measure.SMOKE:
                ledger.append(lines)


if __name__ == "__main__":
    main(sys.argv[1:])
