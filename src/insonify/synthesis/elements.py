"""Echoes heard element by element: what a centre's far field and a standing sonar cannot tell.

The leg to an array's centre gives those to its elements: `_element_kernel`. The strength of a scatterer, its shadows
and the beam that insonified it are those of the start of the ping; delay, spreading, the pattern that hears it and the
Doppler factor are those of the moment when the echo comes.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import Water
from insonify.propagation.wavefront import CLOSEST_SOURCE, Wavefront, wavefront
from insonify.records.pairs import Pairs
from insonify.sonar.beam import POINTS_PER_LOBE, Beams
from insonify.sonar.stance import Stance
from insonify.sonar.sub_bands import SubBand
from insonify.synthesis._aperture_kernel import spread_to_elements
from insonify.synthesis._echo_kernel import Ears, Heard, Sent
from insonify.synthesis._element_kernel import CLOSEST, send_moving, turn_towards
from insonify.synthesis._leg_kernel import brought
from insonify.synthesis.apertures import nodes_along
from insonify.synthesis.grid import TimeGrid
from insonify.synthesis.perturbation import Perturbation
from insonify.synthesis.sectors import NONE, Shared
from insonify.synthesis.shapes import Shapes
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]
PARTED = 0.02
"""Part of a pattern's own angle, a wavelength over pi apertures, by which elements may see one echo apart [1]."""
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
    sent = {i: sent_at_the_middle(out.departure[i], out.length[i], stance) for i in np.unique(pairs.pair[:, 0])}
    fronts = {j: wavefront(back, j, stance.receive_place, places, water) for j in np.unique(pairs.pair[:, 1])}
    for i, j in pairs.pair:
        gone, leaving, louder = sent[i]
        delay = out.delay[i] + back.delay[j] + gone
        yield Echoes(delay, back.departure[j], leaving, louder, fronts[j])


def lay_down(
    cells: Cells, pairs: Pairs, stance: Stance, grid: TimeGrid, perturbation: Perturbation, shapes: Shapes, ends: Ends,
    water: Water, loss: float, few: Shared | None = None,
) -> None:  # fmt: skip
    """Add the echoes of one block of scatterers to the cells of all elements.

    Args:
        cells: Grids of pressure, shape (bands, elements, groups, cells, dopplers of a group).
        pairs: Legs out and back of the block, and strengths.
        stance: The sonar at this ping.
        grid: The grid that the cells belong to.
        perturbation: Jitter of replicas.
        shapes: Waveforms of which echoes are sums.
        ends: Of `ends_of`.
        water: Between sonar and scatterers.
        loss: Of `taken_by`.
        few: Of `shared`; its places are channels after the elements.
    """
    out, back, strength = pairs.out, pairs.back, pairs.strength
    if not perturbation.still:
        factors = [perturbation.factor(pairs.scatterers.place, *names) for names in pairs.rays()]
        strength = strength * np.array(factors)
    gone, leaving, louder = sent_at_the_middle(out.departure, out.length, stance)
    amplitude = out.amplitude
    level, phase = float(amplitude_ratio(stance.source_level_db)), np.ascontiguousarray(pairs.scatterers.phase)
    left = amplitude if back is out else back.amplitude
    bend, away, gradient, beside = fronts_of(pairs, stance, water)
    rows, seen = _directions(pairs, stance, gone, ends)
    ears = _ears(ends, stance.channel_count, len(seen))
    middle = 0.0 if stance.still else stance.pulse.pulse.duration / 2
    end = (
        1 / stance.receive_speed, gradient, loss, water.layered, middle, stance.frequency, shapes.doppler,
    )  # fmt: skip
    nearest = 1 / float(np.fmax.reduce(np.abs(bend), axis=None, initial=1e-9))
    if water.layered:
        nearest = float(np.fmin.reduce(away, axis=None, initial=nearest))
    latest, wavelength = grid.start + grid.count / grid.sample_rate, stance.receive_speed / stance.frequency
    also = None if few is None else few.place
    nodes = nodes_along(ends.place, ends.velocity, ends.acceleration, nearest, latest, wavelength, also)
    sector = NONE if few is None or nodes.mix.shape[1] == len(ends.place) else few.sector
    for band, sub_band in enumerate(stance.bands or (whole_band(stance),)):
        lost, kept = np.empty((0, 0)), left
        if sub_band.offset != 0:
            lost = absorbed(out.length, sub_band.offset, stance.frequency, water)
            kept = left * absorbed(back.length, sub_band.offset, stance.frequency, water)
        beams = sub_band.transmit_beams.gain(out.departure)
        sent = np.empty(beams.shape, np.complex64)
        brought(amplitude, louder, phase, level, lost, beams, sent)
        gain = element_gains(stance, sub_band.receive_beams, ends, seen)
        spread_to_elements(
            cells[band], grid.first_time, grid.cell_rate, np.column_stack([pairs.pair, rows]),
            Sent(out.delay + gone, 1 / (1 - leaving), sent),
            Heard(back.delay, bend, away, beside, back.departure, kept.astype(np.complex64),
                  np.ascontiguousarray(np.moveaxis(gain, 1, 0))),
            strength, ears, nodes, sector, *end,
        )  # fmt: skip


def fronts_of(pairs: Pairs, stance: Stance, water: Water) -> tuple[Floats, Floats, float, Floats]:
    """The wavefronts of all legs back, as of `Wavefront`, leg by leg; distances on ground where rays bend alone."""
    back = pairs.back
    if not water.layered:
        bend = 1 / np.maximum(back.length, CLOSEST_SOURCE)
        return bend, bend, 0.0, np.zeros((len(bend), 0, bend.shape[1]))
    place, points = stance.receive_place, pairs.scatterers.position
    fronts = [wavefront(back, j, place, points, water) for j in range(len(back.length))]
    bend, away, beside = (np.array([getattr(front, name) for front in fronts]) for name in ("bend", "away", "beside"))
    return bend, away, fronts[0].gradient, beside


def _directions(
    pairs: Pairs, stance: Stance, gone: Floats, ends: Ends
) -> tuple[NDArray[np.int64], list[Floats]]:  # fmt: skip
    """Directions of echoes as the platform sees them, and the row of each pair among them; see `come_from`."""
    rows, towards, when = come_from(pairs, stance, gone, ends)
    course = stance.course
    if course is None or not course.turns:
        return rows, towards
    return rows, [np.array([course.turned(*row) for row in zip(one, when, strict=True)]) for one in towards]


def come_from(
    pairs: Pairs, stance: Stance, gone: Floats, ends: Ends
) -> tuple[NDArray[np.int64], list[Floats], Floats]:  # fmt: skip
    """Directions in which echoes are heard in the world, and when; those of a leg back, if nothing turns.

    Args:
        pairs: Legs of a block of n scatterers.
        stance: The sonar at this ping.
        gone: Of `sent_at_the_middle`, shape (legs, n).
        ends: Of `ends_of`.

    Returns:
        Row of each pair among the legs back, or among the pairs; directions of shape (legs or pairs, n, 3), one for
        the whole array or one for each of its elements; times [s], shape (legs or pairs, n).
    """
    out, back = pairs.out, pairs.back
    rows, towards, away = pairs.pair[:, 1], back.departure, back.length
    when = out.delay[0] + gone[0] + back.delay  # by another leg out it is hardly another place
    if stance.course is not None and stance.course.turns:
        (i, j), rows = pairs.pair.T, np.arange(len(pairs.pair))
        towards, away, when = towards[j], away[j], out.delay[i] + gone[i] + back.delay[j]
    if not parted(stance, ends, float(np.fmin.reduce(away, axis=None)), float(np.fmax.reduce(when, axis=None))):
        return rows, [towards], when
    return rows, [seen_by(ends, e, towards, away, when) for e in range(len(ends.place))], when


def parted(stance: Stance, ends: Ends, nearest: float, latest: float) -> bool:
    """Whether elements, or beams under way, see the nearest scatterer in directions that their patterns tell apart.

    Args:
        stance: The sonar at this ping.
        ends: Of `ends_of`.
        nearest: Shortest way back [m].
        latest: When the last echo comes [s].
    """
    waves = float(stance.receive_beams.per_unit.max()) / POINTS_PER_LOBE
    if not waves > 1:
        return False
    reach = np.linalg.norm(ends.place, axis=1) + latest * np.linalg.norm(ends.velocity, axis=1)
    return bool(np.pi * waves * reach.max() > PARTED * max(nearest, CLOSEST))


def seen_by(ends: Ends, element: int, towards: Floats, away: Floats, when: Floats) -> Floats:
    """Directions in which an element sees what the array's centre sees at the start, from its place when echoes come.

    Args:
        ends: Of `ends_of`.
        element: Which.
        towards: Directions from the centre [1], shape (..., 3).
        away: Ways back [m], shape (...).
        when: When the echoes come [s], shape (...).
    """
    seen = np.empty(towards.shape)
    turn_towards(
        np.ascontiguousarray(towards).reshape(-1, 3), np.ascontiguousarray(away).ravel(),
        np.ascontiguousarray(when).ravel(), ends.place[element], ends.velocity[element], ends.acceleration[element],
        seen.reshape(-1, 3),
    )  # fmt: skip
    return seen


def _ears(ends: Ends, channels: int, views: int) -> Ears:
    """Who hears: each element for itself."""
    number = np.arange(channels)
    own = np.stack([number, number + 1], axis=1)
    pattern = ends.facing if views == 1 else np.where(ends.facing < 0, -1, number)
    return Ears(ends.place, ends.velocity, ends.acceleration, own, 0 * number, pattern)


def whole_band(stance: Stance) -> SubBand:
    """The carrier and its beams, for a sonar whose beams are the same throughout the band."""
    return SubBand(0.0, stance.transmit_beams, stance.receive_beams)


def taken_by(water: Water, frequency: float) -> float:
    """Part of the pressure that the water takes on a metre [1/m].

    Args:
        water: What takes it.
        frequency: Of the sound [Hz].
    """
    return float(water.absorption(frequency)) * np.log(10) / 20


def absorbed(length: Floats, offset: float, frequency: float, water: Water) -> Floats:
    """Pressure that is left at one frequency of the band, relative to that left at the carrier [1], any shape.

    Args:
        length: Of the way [m], any shape.
        offset: From the carrier [Hz].
        frequency: Of the carrier [Hz].
        water: What takes it.
    """
    if offset == 0:
        return np.ones(length.shape)
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


def sent_at_the_middle(there: Floats, away: Floats, stance: Stance) -> tuple[Floats, Floats, Floats]:
    """What is later for the pulse's middle than for its start, and what else the transmitter's own way does.

    Nothing is later for a sonar that stands still: its echoes are told by their starts.

    Args:
        there: Directions in which the sound leaves, shape (..., 3).
        away: Radius of its wavefronts [m], shape (...).
        stance: The sonar.

    Returns:
        By what it is later [s], part of the speed of sound at which the transmitter follows what it sends [1], by what
        the pressure changes [1], each of shape (...).
    """
    later, leaving, louder = np.zeros(away.shape), np.zeros(away.shape), np.ones(away.shape)
    if stance.course is not None:
        send_moving(
            np.ascontiguousarray(there).reshape(-1, 3), np.ascontiguousarray(away).ravel(), stance.transmit_velocity,
            stance.pulse.pulse.duration / 2, 1 / stance.sound_speed, later.ravel(), leaving.ravel(), louder.ravel(),
        )  # fmt: skip
    return later, leaving, louder


def element_gains(stance: Stance, beams: Beams, ends: Ends, seen: list[Floats]) -> NDArray[np.float32]:
    """Gain of an element that faces each way, (facings, ...), or of each element.

    Args:
        stance: The sonar at this ping.
        beams: Its receive beams, at one frequency.
        ends: Of `ends_of`.
        seen: Directions, as of `seen_from`, of shape (..., 3): of the whole array, or of each of its elements.
    """
    if len(seen) == 1:
        return np.asarray([faced(beams, angle).gain(seen[0])[0] for angle in ends.facings], np.float32)
    rows = [faced(beams, angle).gain(one)[0] for angle, one in zip(ends.facings[ends.facing], seen, strict=True)]
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
