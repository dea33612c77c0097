"""Arrivals and elements per second that become a band-limited series.

Nominal case: 100 kHz, a band of 20 kHz sampled at 25 kHz, 0.24 s, delays in no order (as the ground gives them).
"""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numba import njit

from insonify.synthesis._arrival_kernel import ReceiveBeams, ReceiveLegs, Reception, TransmitLegs
from insonify.synthesis._arrival_time_kernel import ArrayWater
from insonify.synthesis._element_arrivals_kernel import PairedLegs, deposit_on_elements
from insonify.synthesis._gridding import deposit_energy, deposit_pressure
from insonify.synthesis._gridding_kernel import CELLS_PER_SPIKE, WIDTH, tap_coefficients
from insonify.synthesis.chebyshev_nodes import aperture_nodes
from insonify.synthesis.coherent_groups import add_groups, pulse_table
from insonify.synthesis.sector_interpolation import NO_SECTOR
from insonify.synthesis.time_grid import convolve_pulse, time_grid
from insonify.synthesis.waveform_basis import WaveformBasis
from measure import Result, best_seconds

RATE, CARRIER, WINDOW = 25e3, 100e3, 0.24
UNIT = "M spike-elements/s"
GRID = time_grid(0.0, WINDOW, RATE, -1e-3, 1e-3)
GRID_ARGUMENTS = (GRID.first_time, GRID.cell_rate)
TAPS = tap_coefficients()


def spikes(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Random delays [s] and complex amplitudes."""
    random = np.random.default_rng(1)
    weight = random.normal(size=count) + 1j * random.normal(size=count)
    return random.uniform(0, WINDOW, count), weight.astype(np.complex64)


@njit(nogil=True, fastmath=True)
def plain_gridding(cells, first_time, cell_rate, delay, amplitude, frequency, taps):
    """The same sum by plain loops and the maths library: what gridding costs before any tuning."""
    for i in range(delay.size):
        position = (delay[i] - first_time) * cell_rate - (WIDTH / 2 - 1)
        cell = int(np.floor(position))
        if cell < 0 or cell > cells.size - CELLS_PER_SPIKE:
            continue
        fraction = np.float32(position - cell - 0.5)
        cycles = frequency * delay[i]
        angle = np.float32(2 * np.pi * (cycles - np.floor(cycles)))
        weight = amplitude[i] * np.complex64(complex(np.cos(angle), -np.sin(angle)))
        for j in range(WIDTH):
            height = taps[-1, j]
            for degree in range(taps.shape[0] - 2, -1, -1):
                height = height * fraction + taps[degree, j]
            cells[cell + j] += weight * height


@njit(nogil=True, fastmath=True)
def passband_replicas(series, rate, delay, amplitude, frequency, duration):
    """Plain gridding: every echo writes its whole pulse, carrier and all, at 1 MHz."""
    samples = int(duration * rate)
    for i in range(delay.size):
        first = int(np.ceil(delay[i] * rate))
        for n in range(first, min(first + samples, series.size)):
            phase = 2 * np.pi * frequency * (n / rate - delay[i])
            series[n] += amplitude[i].real * np.cos(phase) - amplitude[i].imag * np.sin(phase)


def one_core() -> list[Result]:
    """Kernels on one thread, for few and for many spikes."""
    results = []
    for count in (100_000, 1_000_000):
        delay, weight = spikes(count)
        sorted_delay = np.sort(delay)
        energy = np.abs(weight).astype(float)
        cells, energies = GRID.cells()[0], GRID.energy_cells()[0]
        kernels = {
            "deposit_pressure": lambda d=delay, w=weight, c=cells: deposit_pressure(c, *GRID_ARGUMENTS, d, w),
            "deposit_pressure, delays in order": lambda d=sorted_delay, w=weight, c=cells: deposit_pressure(
                c, *GRID_ARGUMENTS, d, w
            ),
            "deposit_energy": lambda d=delay, e=energy, c=energies: deposit_energy(
                c, GRID.first_time, GRID.energy_rate, d, e
            ),
            "plain gridding": lambda d=delay, w=weight, c=cells: plain_gridding(
                c, *GRID_ARGUMENTS, d, w, CARRIER, TAPS
            ),
        }
        seconds = best_seconds(kernels)
        plain = seconds["plain gridding"]
        for name, best in seconds.items():
            note = "goal 40" if name == "deposit_pressure" else f"{plain / best:.1f} x plain gridding"
            results.append(Result(f"{name}, {count:.0e}", count / best / 1e6, UNIT, note))
    return results


def element_by_element() -> list[Result]:
    """Echoes of 50,000 scatterers at the 16 elements of an array of a metre: at rest, moving, where rays bend."""
    count, elements = 50_000, 16
    delay, weight = spikes(count)
    azimuth = np.random.default_rng(2).uniform(0, 2 * np.pi, count)
    towards = np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros(count)], axis=1)
    radius = np.maximum(750 * delay, 1.0)
    positions = np.outer(np.linspace(-0.5, 0.5, elements), [1.0, 0.0, 0.0])
    still, ones, number = np.zeros((elements, 3)), np.ones((1, count)), np.arange(elements)
    sent = TransmitLegs(0 * ones, ones, weight[None, None])
    receive_legs = ReceiveLegs(delay[None], 1 / radius[None], radius[None], np.empty((1, 0, delay.size)), towards[None],
                  ones.astype(np.complex64), ones[None].astype(np.float32))  # fmt: skip
    channels = np.stack([number, number + 1], axis=1)

    cells_of = {
        shapes: GRID.cells(elements * shapes).reshape(elements, -(-shapes // 4), -1, min(shapes, 4))
        for shapes in (1, 8)
    }

    def kernel(speed: float, refracted: bool, shapes: int) -> None:
        made = WaveformBasis(-4e-3 * np.cos((np.arange(shapes) + 0.5) * np.pi / shapes), (-4e-3, 4e-3))
        velocity = np.tile([speed, 0.0, 0.0], (elements, 1))
        receive_beams = ReceiveBeams(positions, velocity, still, channels, 0 * number, 0 * number)
        nodes = aperture_nodes(positions, velocity, still, float(radius.min()), WINDOW, 1500 / CARRIER)
        legs = PairedLegs(np.zeros((1, 3), np.int64), sent, receive_legs, ones)
        water = ArrayWater(1 / 1500, 0.0, 0.0, refracted, 1e-4 * (speed > 0))
        reception = Reception(*GRID_ARGUMENTS, CARRIER, made.weight_table, water)
        cells = cells_of[shapes]
        deposit_on_elements(cells, cells[:0], legs, receive_beams, nodes, NO_SECTOR, reception)

    kernels = {
        "deposit_on_elements, at rest": lambda: kernel(0.0, False, 1),
        "deposit_on_elements, moving, 1 shape": lambda: kernel(3.0, False, 1),
        "deposit_on_elements, moving, 8 shapes": lambda: kernel(3.0, False, 8),
        "deposit_on_elements, refracted rays, moving, 1 shape": lambda: kernel(3.0, True, 1),
    }
    return [Result(name, count * elements / best / 1e6, UNIT) for name, best in best_seconds(kernels).items()]


def against_replicas() -> list[Result]:
    """Gridding, its transforms included, against writing pulses one by one."""
    many, few = spikes(100_000), spikes(1000)
    series = np.zeros(int(WINDOW * 1e6))
    spectrum = np.ones(GRID.padded_samples, complex)

    def gridded() -> None:
        cells = GRID.cells()
        deposit_pressure(cells[0], *GRID_ARGUMENTS, *many)
        convolve_pulse(cells, GRID, spectrum)

    seconds = best_seconds(
        {
            "gridding and transforms, 1e+05": gridded,
            "passband replicas at 1 MHz, 0.2 ms": lambda: passband_replicas(series, 1e6, *few, CARRIER, 2e-4),
            "passband replicas at 1 MHz, 2 ms": lambda: passband_replicas(series, 1e6, *few, CARRIER, 2e-3),
            "transforms alone, per channel": lambda: convolve_pulse(GRID.cells(), GRID, spectrum),
        }
    )
    alone = seconds.pop("transforms alone, per channel")
    counts = [100_000, 1000, 1000]
    rates = {name: count / best / 1e6 for (name, best), count in zip(seconds.items(), counts, strict=True)}
    first = next(iter(rates.values()))
    lines = [Result(name, rate, UNIT, f"1 / {first / rate:.0f} of gridding") for name, rate in rates.items()]
    return [*lines, Result("transforms alone, per channel", alone * 1e3, "ms")]


def two_threads() -> list[Result]:
    """The same 2 million spikes in 8 chunks, on one thread and on two."""
    delay, weight = spikes(2_000_000)
    chunks = [slice(k * 250_000, (k + 1) * 250_000) for k in range(8)]

    def chunk(part: slice) -> np.ndarray:
        cells = GRID.cells()[0]
        deposit_pressure(cells, *GRID_ARGUMENTS, delay[part], weight[part])
        return cells

    with ThreadPoolExecutor(1) as one, ThreadPoolExecutor(2) as two:
        seconds = best_seconds({"one": lambda: sum(one.map(chunk, chunks)), "two": lambda: sum(two.map(chunk, chunks))})
    gain = seconds["one"] / seconds["two"]
    return [
        Result("deposit_carrier, 8 chunks, 1 thread", 2.0 / seconds["one"], UNIT),
        Result("deposit_carrier, 8 chunks, 2 threads", 2.0 / seconds["two"], UNIT, f"{gain:.2f} x one thread"),
    ]


def groups() -> list[Result]:
    """Expected intensity of groups of nine arrivals, half a pulse apart, with a pulse of 15 samples."""
    table = pulse_table(lambda t: np.exp(-((t / 1e-4) ** 2)) + 0j, -3e-4, 3e-4, RATE)
    count, size = 50_000, 9
    delay, weight = spikes(count * size)
    delay = np.repeat(delay[:count], size) + np.tile(np.arange(size) * 1e-4, count)
    intensity, first = np.zeros(GRID.sample_count), np.arange(count + 1) * size
    columns = (table.samples, table.start, table.rate, first, delay, weight.astype(complex))
    best = best_seconds({"groups": lambda: add_groups(intensity, 0.0, RATE, *columns, 1.0, 0.0)})["groups"]
    return [Result("add_groups, nine arrivals a group", count * size / best / 1e6, "M arrivals/s")]


BENCHES = [one_core, element_by_element, against_replicas, two_threads, groups]
