"""Echoes heard element by element, or by beams under way: what a centre's far field and a standing sonar cannot tell.

The leg to an array's centre gives those to its elements: `_element_kernel`. The strength of a scatterer, its shadows
and the beam that insonified it are those of the start of the ping; delay, spreading, the pattern that hears it and the
Doppler factor are those of the moment when the echo comes.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import Water
from insonify.propagation.wavefront import Wavefront, wavefront
from insonify.records.pairs import Pairs
from insonify.sonar.beam import Beams
from insonify.sonar.stance import Stance
from insonify.sonar.sub_bands import SubBand
from insonify.synthesis._element_kernel import CLOSEST, spread_elements
from insonify.synthesis.grid import TimeGrid
from insonify.synthesis.perturbation import Perturbation
from insonify.synthesis.shapes import Shapes
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]
Cells = NDArray[np.complex64]


@dataclass(frozen=True, slots=True)
class Ends:
    """The receiver's channels as points that hear: m of them."""

    place: Floats
    """From the array's centre, in the world, at the start of the ping [m], shape (m, 3)."""
    velocity: Floats
    """In the world [m/s], shape (m, 3)."""
    acceleration: Floats
    """In the world [m/s^2], shape (m, 3)."""
    facing: NDArray[np.int64]
    """Row of `facings` that each has, -1 for one that is dead, shape (m,)."""
    facings: Floats
    """Angles to the right of boresight that there are [rad], shape (facings,)."""


def ends_of(stance: Stance) -> Ends:
    """The receiver's elements in the world; for beams, the array's centre.

    Args:
        stance: The sonar at one ping.
    """
    elements = stance.elements
    axes = stance.receive_beams.axes
    own = np.zeros((1, 3)) if elements is None else elements.place
    place = own @ axes
    velocity, acceleration = np.zeros_like(place), np.zeros_like(place)
    if stance.course is not None:
        on_platform = stance.arms[1] + place @ stance.course.rotation[0]
        _, velocity, acceleration = stance.course.of(on_platform)
    if elements is None:
        return Ends(place, velocity, acceleration, np.zeros(1, np.int64), np.zeros(1))
    facings, row = np.unique(elements.facing, return_inverse=True)
    return Ends(place, velocity, acceleration, np.where(elements.response == 0, -1, row), facings)


@dataclass(frozen=True, slots=True)
class Echoes:
    """What comes back from n scatterers by one leg out and one leg back, before any beam and any carrier."""

    delay: Floats
    """Out and back at the receiver's centre [s], shape (n,); under way: of the pulse's middle, the centre at rest."""
    towards: Floats
    """Direction that each comes from, away from the sonar, shape (n, 3)."""
    leaving: Floats
    """Part of the speed of sound at which the transmitter follows what it sends [1], shape (n,)."""
    louder: Floats
    """By what the transmitter's own way changes the pressure [1], shape (n,)."""
    front: Wavefront


def all_echoes(pairs: Pairs, stance: Stance, water: Water) -> Iterator[Echoes]:
    """What comes back by each ordered pair of legs of a block, in their order.

    Args:
        pairs: Legs out and back of a block.
        stance: The sonar at this ping.
        water: Between sonar and scatterers.
    """
    out, back, places = pairs.out, pairs.back, pairs.scatterers.position
    sent = {i: _sent_at_the_middle(out.departure[i], out.length[i], stance) for i in np.unique(pairs.pair[:, 0])}
    fronts = {j: wavefront(back, j, stance.receive_place, places, water) for j in np.unique(pairs.pair[:, 1])}
    for i, j in pairs.pair:
        gone, closer, louder = sent[i]
        delay = out.delay[i] + back.delay[j] + gone
        yield Echoes(delay, back.departure[j], closer / stance.sound_speed, louder, fronts[j])


def lay_down(
    cells: Cells, pairs: Pairs, stance: Stance, grid: TimeGrid, perturbation: Perturbation, shapes: Shapes, ends: Ends,
    water: Water,
) -> None:  # fmt: skip
    """Add the echoes of one block of scatterers to the cells of all channels.

    Args:
        cells: Grids of pressure, shape (bands, channels, dopplers, cells).
        pairs: Legs out and back of the block, and strengths.
        stance: The sonar at this ping.
        grid: The grid that the cells belong to.
        perturbation: Jitter of replicas.
        shapes: Waveforms of which echoes are sums.
        ends: Of `ends_of`.
        water: Between sonar and scatterers.
    """
    level = float(amplitude_ratio(stance.source_level_db))
    out, back = level * pairs.out.amplitude, pairs.back.amplitude
    for row, echoes in enumerate(all_echoes(pairs, stance, water)):
        i, j = pairs.pair[row]
        strength = out[i] * back[j] * pairs.strength[row]
        some = np.flatnonzero(strength)
        if not some.size:
            continue
        strength = strength * pairs.scatterers.phase
        if not perturbation.still:
            strength = strength * perturbation.factor(pairs.scatterers.place, pairs.out.rays[i], pairs.back.rays[j])
        seen = seen_from(stance, echoes.towards[some], echoes.delay[some])
        departure, amplitude = pairs.out.departure[i][some], (strength * echoes.louder)[some]
        travelled = (pairs.out.length[i] + pairs.back.length[j])[some]
        for band, sub_band in enumerate(stance.bands or (_whole_band(stance),)):
            taken = amplitude * absorbed(travelled, sub_band.offset, stance.frequency, water)
            sent = sub_band.transmit_beams.gain(departure)
            gain = element_gains(stance, sub_band.receive_beams, ends, seen)
            if stance.elements is not None:
                _spread(cells[band], some, echoes, taken * sent[0], gain, stance, grid, shapes, ends, water)
                continue
            for channel in range(cells.shape[1]):
                weight, heard = taken * sent[channel % len(sent)], gain[channel % len(gain)][None]
                one = cells[band, channel : channel + 1]
                _spread(one, some, echoes, weight, heard, stance, grid, shapes, ends, water)


def _spread(
    cells: Cells, some: NDArray[np.int64], echoes: Echoes, weight: NDArray[np.complex128], gain: NDArray[np.float32],
    stance: Stance, grid: TimeGrid, shapes: Shapes, ends: Ends, water: Water,
) -> None:  # fmt: skip
    front, middle = echoes.front, 0.0 if stance.still else stance.pulse.pulse.duration / 2
    spread_elements(
        cells, grid.first_time, grid.cell_rate, echoes.delay[some], front.bend[some], front.away[some],
        np.ascontiguousarray(echoes.towards[some].T), echoes.leaving[some], weight.astype(np.complex64), gain,
        ends.facing, ends.place, ends.velocity, ends.acceleration, 1 / stance.sound_speed, front.gradient,
        water.layered, middle, stance.frequency, shapes.doppler, shapes.scale,
    )  # fmt: skip


def _whole_band(stance: Stance) -> SubBand:
    return SubBand(0.0, stance.transmit_beams, stance.receive_beams)


def absorbed(length: Floats, offset: float, frequency: float, water: Water) -> Floats:
    """Pressure that is left at one frequency of the band, relative to that left at the carrier [1], shape (n,).

    Args:
        length: Way out and back [m], shape (n,).
        offset: From the carrier [Hz].
        frequency: Of the carrier [Hz].
        water: What takes it.
    """
    if offset == 0:
        return np.ones(len(length))
    more = float(water.absorption(frequency + offset)) - float(water.absorption(frequency))
    return np.asarray(amplitude_ratio(-more * length))


def seen_from(stance: Stance, towards: Floats, delay: Floats) -> Floats:
    """Directions as the platform sees them when the echo comes, told by its attitude at the start of the ping.

    Args:
        stance: The sonar at this ping.
        towards: Unit vectors in the world [1], shape (n, 3).
        delay: When each echo comes [s], shape (n,).
    """
    return towards if stance.course is None else stance.course.turned(towards, delay)


def _sent_at_the_middle(there: Floats, away: Floats, stance: Stance) -> tuple[Floats, Floats, Floats]:
    """What is later for the pulse's middle than for its start [s], how fast the transmitter follows it [m/s], how loud.

    Nothing is later for a sonar that stands still: its echoes are told by their starts.

    Args:
        there: Directions in which the sound leaves, shape (n, 3).
        away: Radius of its wavefronts [m], shape (n,).
        stance: The sonar.
    """
    if stance.course is None:
        return np.zeros(len(away)), np.zeros(len(away)), np.ones(len(away))
    middle, velocity = stance.pulse.pulse.duration / 2, stance.transmit_velocity
    way = away[:, None] * there - middle * velocity
    left = np.maximum(np.sqrt(np.einsum("ij,ij->i", way, way)), CLOSEST)
    return middle + (left - away) / stance.sound_speed, way @ velocity / left, away / left


def element_gains(stance: Stance, beams: Beams, ends: Ends, direction: Floats) -> NDArray[np.float32]:
    """Gain of an element that faces each way, (facings, n); or of each beam, (beams, n).

    Args:
        stance: The sonar at this ping.
        beams: Its receive beams, at one frequency.
        ends: Of `ends_of`.
        direction: As of `seen_from`, shape (n, 3).
    """
    if stance.elements is None:
        return np.asarray(beams.gain(direction), np.float32)
    rows = [faced(beams, angle).gain(direction)[0] for angle in ends.facings]
    return np.asarray(rows, np.float32)


def faced(beams: Beams, angle: float) -> Beams:
    """The pattern of an element that faces aside.

    Args:
        beams: Of an element that faces along boresight.
        angle: To the right of boresight [rad].
    """
    c, s = np.cos(angle), np.sin(angle)
    ahead, right, down = beams.axes
    return beams.turned(np.stack([c * ahead + s * right, c * right - s * ahead, down]))


def as_beam(stance: Stance, channel: int) -> Stance:
    """The sonar with one of its elements as its only beam, at the array's centre; itself where it has beams.

    Args:
        stance: The sonar at one ping.
        channel: Which element.
    """
    if stance.elements is None:
        return stance
    ears = faced(stance.receive_beams, float(stance.elements.facing[channel]))
    scale = ears.scale * abs(stance.elements.response[channel])
    return replace(stance, receive_beams=replace(ears, scale=scale), elements=None, bands=(), channel_count=1)
