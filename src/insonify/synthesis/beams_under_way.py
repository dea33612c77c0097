"""Echoes of one block for beams: under way, or told at several frequencies of the band.

Legs go to the kernel as they are: what becomes of them is worked out there, a stretch of the block at a time.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import Water
from insonify.records.legs import Legs
from insonify.records.pairs import Pairs, Product
from insonify.sonar.beam import Beams
from insonify.sonar.stance import Stance
from insonify.synthesis._block_kernel import Answers, Fronts, Listener, Mouth, Ways, spread_block
from insonify.synthesis._echo_kernel import Ears
from insonify.synthesis.directions import BEAM_BY_BEAM, Directions
from insonify.synthesis.elements import Ends, fronts_of, parted, taken_by, whole_band
from insonify.synthesis.grid import TimeGrid
from insonify.synthesis.perturbation import Perturbation
from insonify.synthesis.shapes import Shapes
from insonify.units import amplitude_ratio

_NONE = np.empty(0)
_NOTHING = np.empty((0, 0), np.float32)


def lay_down_beams(
    cells: NDArray[np.complex64], pairs: Pairs, stance: Stance, grid: TimeGrid, perturbation: Perturbation,
    shapes: Shapes, ends: Ends, water: Water, loss: float, grid_of_directions: Directions | None = None,
) -> None:  # fmt: skip
    """Add the echoes of one block of scatterers to the cells of all beams.

    The strength of a scatterer, its shadows and the beam that insonified it are those of the start of the ping; delay,
    spreading, the pattern that hears it and the Doppler factor are those of the moment when the echo comes.

    Args:
        cells: Grids of pressure, shape (bands, channels, groups, cells, dopplers of a group).
        pairs: Legs out and back of the block, and strengths.
        stance: The sonar at this ping.
        grid: The grid that the cells belong to.
        perturbation: Jitter of replicas.
        shapes: Waveforms of which echoes are sums.
        ends: Of `ends_of`.
        water: Between sonar and scatterers.
        loss: Of `taken_by`.
        grid_of_directions: Rows of which beams are sums; channels are these rows then.
    """
    if not len(pairs.scatterers) or not len(pairs.pair):
        return
    out, back = pairs.out, pairs.back
    away = _ways(out)
    home = away if back is out else _ways(back)
    gradient, fronts = 0.0, Fronts(np.empty((0, 0)), np.empty((0, 0)), np.empty((0, 0, 0)))
    if water.layered:
        bend, level, gradient, beside = fronts_of(pairs, stance, water)
        fronts = Fronts(bend, level, beside)
    answers, phase = _answers(pairs, perturbation), np.ascontiguousarray(pairs.scatterers.phase)
    middle = 0.0 if stance.still else stance.pulse.pulse.duration / 2
    fan = grid_of_directions
    rows, ears = np.ascontiguousarray(pairs.pair), _ears(ends, cells.shape[1] if fan is None else 1, stance)
    apart = parted(stance, ends, _nearest(back), grid.start + grid.count / grid.sample_rate)
    for band, sub_band in enumerate(stance.bands or (whole_band(stance),)):
        taken = 0.0
        if sub_band.offset != 0:
            taken = taken_by(water, stance.frequency + sub_band.offset) - loss
        sends, hears = (sub_band.transmit_beams, sub_band.receive_beams) if fan is None else fan.ends[band]
        listener = _listener(stance, hears, middle, apart=apart)
        spread_block(
            cells[band], grid.first_time, grid.cell_rate, rows, away, home, back is out, taken, phase, answers,
            _mouth(stance, sends, middle), listener, fronts, ears, 1 / stance.receive_speed, gradient, loss,
            water.layered, middle, stance.frequency, shapes.doppler, BEAM_BY_BEAM if fan is None else fan.rows[band],
        )  # fmt: skip


def _ways(legs: Legs) -> Ways:
    """Columns of legs for the kernel."""
    boundary, visibility = legs.boundary, np.asarray(legs.visibility, complex)
    if legs.caustic is not None:
        boundary = boundary * legs.caustic
    if legs.glints is not None:
        boundary = boundary * legs.glints.phasor
    own = np.ascontiguousarray
    return Ways(
        own(legs.delay), own(legs.length), own(legs.spreading), own(legs.absorption), own(boundary), own(visibility),
        own(legs.departure), own(legs.grazing),
    )  # fmt: skip


def _nearest(legs: Legs) -> float:
    """Shortest of some legs [m]; those that are not there may have no length."""
    nearest = float(legs.length.min())  # several times as quick as to look for what is no number
    return nearest if np.isfinite(nearest) else float(np.fmin.reduce(legs.length, axis=None))


def _answers(pairs: Pairs, perturbation: Perturbation) -> Answers:
    """What scatterers make of pairs, as kernels want it: products if they are, and replicas are not shaken."""
    answer, number, stretch, share = pairs.answer, np.empty(0, np.float32), np.empty(0, np.uint8), _NOTHING
    if isinstance(answer, Product) and perturbation.still:
        if answer.thinned is not None:
            number, stretch, share = answer.thinned.number, answer.thinned.stretch, answer.thinned.share
        given = np.empty((0, 0), np.complex64)
        return Answers(given, answer.factor, answer.root, answer.weight, number, stretch, share)
    strength = pairs.strength
    if not perturbation.still:
        strength = strength * np.array([perturbation.factor(pairs.scatterers.place, *ray) for ray in pairs.rays()])
    return Answers(np.ascontiguousarray(strength, np.complex64), _NONE, _NONE, _NONE, number, stretch, share)


def _ears(ends: Ends, channels: int, stance: Stance) -> Ears:
    """Who hears: beams all at the array's centre."""
    number = np.arange(channels)
    return Ears(
        ends.place, ends.velocity, ends.acceleration, np.array([[0, channels]]),
        number % stance.transmit_beams.channel_count, number % stance.receive_beams.channel_count,
    )  # fmt: skip


def _mouth(stance: Stance, beams: Beams, middle: float) -> Mouth:
    level, velocity = float(amplitude_ratio(stance.source_level_db)), np.ascontiguousarray(stance.transmit_velocity)
    return Mouth(level, velocity, middle, 1 / stance.sound_speed, beams.patterns)


def _listener(stance: Stance, beams: Beams, middle: float, *, apart: bool) -> Listener:
    turns = stance.course is not None and stance.course.turns
    rate, bend = (np.zeros((3, 3)),) * 2
    if stance.course is not None and turns:
        rate, bend = (np.ascontiguousarray(part) for part in stance.course.sweep)
    return Listener(middle, apart, turns, rate, bend, beams.patterns)
