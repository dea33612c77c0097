"""Claims about a block of scatterers heard by beams: the kernel's cells are those of echoes worked out one by one."""

import numpy as np
import pytest

from insonify.sonar import LineArray, beams
from insonify.synthesis._arrival_kernel import ReceiveBeams, Reception
from insonify.synthesis._arrival_time_kernel import ArrayWater
from insonify.synthesis._beam_arrivals_kernel import (
    _PART,
    LegColumns,
    ReceivingArray,
    ScattererBlock,
    ScatteringStrengths,
    Transmitter,
    WavefrontColumns,
    deposit_block,
)
from insonify.synthesis._waveform_basis_kernel import group_layout
from insonify.synthesis.direction_grid import NO_DIRECTION_GRID
from oracles.beams import axes
from oracles.block import CARRIER, CELLS, RATE, SPEED, WAVELENGTH, heard, world
from synthesis.oracle import relative_rms

NONE, NOTHING = np.empty(0), np.empty((0, 0), np.float32)
FRONTS = WavefrontColumns(np.empty((0, 0)), np.empty((0, 0)), np.empty((0, 0, 0)))


def patterns(one):
    """Beams of an array of the oracle, for the kernel."""
    line = LineArray(length=one["extent"] * WAVELENGTH, element=one["element"], steer=tuple(one["steer"]))
    return beams(line, CARRIER, SPEED, one["axes"]).kernel_tables


def answers(told):
    """What the scatterers of a world answer, for the kernel."""
    given, thinned = told["answers"] == "given", told["answers"] == "thinned"
    number, stretch, share = told["number"], told["stretch"], told["share"]
    if not thinned:
        number, stretch, share = np.empty(0, np.float32), np.empty(0, np.uint8), NOTHING
    if given:
        return ScatteringStrengths(told["given"].astype(np.complex64), NONE, NONE, NONE, number, stretch, share)
    return ScatteringStrengths(
        np.empty((0, 0), np.complex64), told["factor"], told["root"], told["weight"], number, stretch, share
    )


def laid(told, *, both=None, fronts=FRONTS, cells=None):
    """Cells of a world by the kernel, (channels, groups, cells, shapes of a group)."""
    sent, ear = patterns(told["transmit"]), patterns(told["receive"])
    channels = max(len(sent.steer), len(ear.steer))
    groups, together = group_layout(len(told["node"]))
    if cells is None:
        cells = np.zeros((channels, groups, CELLS, together), np.complex64)
    channel = np.arange(channels)
    ears = ReceiveBeams(told["place"], told["velocity"], told["acceleration"], np.array([[0, channels]]),
                channel % len(sent.steer), channel % len(ear.steer))  # fmt: skip
    listener = ReceivingArray(
        told["middle"], told["has_parallax"], told["turns"], told["rate"], told["bend"], ear, ears
    )
    away, home = (LegColumns(**told[end]) for end in ("out", "back"))
    same = told["out"] is told["back"] if both is None else both
    block = ScattererBlock(told["pair"], away, home, same, told["phase"], answers(told), fronts)
    water = ArrayWater(1 / SPEED, 0.0, told["loss"], fronts is not FRONTS, told["middle"])
    deposit_block(
        cells, block, told["taken"], Transmitter(told["level"], told["sent"], told["middle"], 1 / SPEED, sent),
        listener, Reception(0.0, RATE, CARRIER, told["node"], water), NO_DIRECTION_GRID,
    )  # fmt: skip
    return cells


def flat(cells):
    """The same as the oracle has them, (channels, cells, shapes)."""
    return np.moveaxis(cells, 1, 2).reshape(len(cells), CELLS, -1)


def part_of(told, rows):
    """A world with some of its scatterers."""
    ends = {end: {name: np.ascontiguousarray(column[:, rows]) for name, column in told[end].items()}
            for end in ("out", "back")}  # fmt: skip
    if told["out"] is told["back"]:
        ends["back"] = ends["out"]
    own = {name: np.ascontiguousarray(told[name][rows]) for name in ("phase", "root", "number", "stretch")}
    return {**told, **ends, **own, "given": np.ascontiguousarray(told["given"][:, rows])}


@pytest.mark.parametrize("answer", ["products", "thinned", "given"])
@pytest.mark.parametrize(("moving", "turning"), [(0.0, 0.0), (1.0, 0.0), (1.0, 0.5)], ids=["rest", "ahead", "turning"])
def test_a_block_is_the_sum_of_its_echoes(answer, moving, turning):
    """More than a part, a quarter of the legs not there, 2 x 2 legs, 2 beams: float64, one by one, to 1e-6."""
    told = world(1, _PART + 100, answers=answer, moving=moving, turning=turning)
    known = heard(told)
    assert relative_rms(flat(laid(told))[..., : known.shape[2]], known) < 1e-6


@pytest.mark.parametrize(
    ("count", "outs", "backs"),
    [(1, 1, 1), (2, 3, 3), (_PART - 1, 1, 1), (_PART, 1, 2), (_PART + 1, 3, 2), (2 * _PART + 1, 1, 1)],
)
def test_however_many_scatterers_and_legs_there_are(count, outs, backs):
    """Parts that are filled, one less, one more; legs back that are others than those out: 1e-6."""
    told = world(15 if count == 1 else 16, count, outs=outs, backs=backs, answers="thinned", dopplers=2)
    told["share"][:] = 0.6
    told["number"][:1] = 0.1
    known = heard(told)
    assert np.linalg.norm(flat(laid(told)) - known) < 1e-6 * np.linalg.norm(known)


@pytest.mark.parametrize(("sent", "received"), [(1, 1), (3, 3), (3, 1), (1, 4)])
def test_each_channel_has_its_own_two_beams(sent, received):
    """One beam out for all or one for each, one pattern for all or one for each: 1e-6, channel by channel."""
    told = world(7, 300, beams=sent, patterns=received, dopplers=5)
    known, got = heard(told), flat(laid(told))
    assert known.shape == (max(sent, received), CELLS, 5) and got.shape[2] == 8 and not got[..., 5:].any()
    for one, other in zip(got[..., :5], known, strict=True):
        assert relative_rms(one, other) < 1e-6


@pytest.mark.parametrize("answer", ["products", "thinned", "given"])
def test_parts_laid_one_after_the_other_are_the_whole_bit_for_bit(answer):
    """A block cut where one part ends asks the same in the same order: the same bits; cut elsewhere, 1e-6."""
    told = world(3, 2 * _PART + 100, answers=answer)
    whole = laid(told)
    for cut, same in ((_PART, True), (2 * _PART, True), (700, False)):
        cells = laid(part_of(told, slice(cut, None)), cells=laid(part_of(told, slice(0, cut))))
        assert relative_rms(cells, whole) < 1e-6
        assert np.array_equal(cells, whole) == same


def test_what_is_not_there_may_be_anything():
    """Legs of no visibility, or with a mirror that returns nothing, hold NaN or numbers: the bits are the same."""
    told, other = world(4, 600), world(4, 600)
    for name in ("length", "spreading", "absorption", "grazing"):
        column = other["out"][name]
        assert np.isnan(column).any()
        column[:] = np.nan_to_num(column, nan=0.7)
    np.testing.assert_array_equal(laid(told), laid(other))


def test_a_scatterer_without_any_leg_is_silence():
    """No leg there, no pairs, no weight, no share, no given answer: not one cell is touched."""
    dark = world(5, 40)
    dark["out"]["visibility"][:] = 0
    alone = world(5, 40)
    alone["pair"] = np.zeros((0, 2), np.int64)
    mute = world(5, 40)
    mute["weight"] = np.zeros(4)
    left_out, none_given = world(5, 40, answers="thinned"), world(5, 40, answers="given")
    left_out["share"][:], none_given["given"][:] = 0, 0
    assert [bool(laid(told).any()) for told in (dark, alone, mute, left_out, none_given)] == [False] * 5
    assert laid(world(5, 40)).any()


def test_a_baffle_receives_and_sends_nothing_backwards():
    """All scatterers behind either array: silence; before both: sound."""
    told = world(6, 50, moving=0.0)
    ahead = told["transmit"]["axes"][0]
    for end, sign, silent in (("receive", 1, False), ("receive", -1, True), ("transmit", -1, True)):
        turned = {**told, "out": dict(told["out"]), "transmit": {**told["transmit"]}, "receive": {**told["receive"]}}
        turned["back"] = turned["out"]
        turned["out"]["departure"] = np.tile(ahead, (2, 50, 1))
        turned["receive"]["axes"] = told["transmit"]["axes"]
        turned[end]["axes"] = np.ascontiguousarray(np.diag([sign, 1, sign]) @ told["transmit"]["axes"])
        assert laid(turned).any() != silent


def test_pressure_is_linear_in_what_is_sent():
    """Twice the source level, or root of area, or weight of all pairs: twice each cell, bit for bit."""
    told = world(8, 600, answers="thinned")
    once = laid(told)
    for name in ("level", "root", "weight"):
        np.testing.assert_array_equal(laid({**told, name: 2 * told[name]}), 2 * once)


@pytest.mark.parametrize("moving", [0.0, 1.0])
def test_legs_out_and_back_that_are_alike_are_worked_out_once(moving):
    """Told that both are the same, or given a copy of them: the same cells to 1e-7."""
    told = world(9, 900, moving=moving)
    assert relative_rms(laid(told, both=True), laid(told, both=False)) < 1e-7


def test_no_speed_is_rest():
    """Under way at 0 m/s, told by the middles of pulses and seen from where the array is: as at rest, 1e-6."""
    rest = world(10, 700, moving=0.0)
    for middle in (1e-4, 3e-3):
        under_way = {**rest, "middle": middle, "has_parallax": True, "turns": True}
        assert relative_rms(laid(under_way), laid(rest)) < 1e-6


@pytest.mark.parametrize("answer", ["products", "thinned"])
def test_ends_may_be_exchanged_at_rest(answer):
    """Legs out for legs back, the arrays, and the pairs turned round: reciprocity to 1e-6."""
    told = world(11, 700, outs=2, backs=3, beams=2, moving=0.0, answers=answer)
    told["receive"]["element"] = "cosine"
    other = {**told, "out": told["back"], "back": told["out"], "pair": np.ascontiguousarray(told["pair"][:, ::-1])}
    other["transmit"], other["receive"] = told["receive"], told["transmit"]
    assert relative_rms(laid(other), laid(told)) < 1e-6


def mapped(told, matrix, steer):
    """A world turned or mirrored as a whole; with the sign of all steer angles."""
    ends = {}
    for end in ("out", "back"):
        ends[end] = {**told[end], "departure": np.ascontiguousarray(told[end]["departure"] @ matrix.T)}
    if told["back"] is told["out"]:
        ends["back"] = ends["out"]
    for end in ("transmit", "receive"):
        turned = np.diag([1, steer, 1]) @ told[end]["axes"] @ matrix.T
        ends[end] = {**told[end], "axes": np.ascontiguousarray(turned), "steer": steer * told[end]["steer"]}
    ways = {name: np.ascontiguousarray(told[name] @ matrix.T) for name in ("sent", "velocity", "acceleration")}
    return {**told, **ends, **ways, **{name: matrix @ told[name] @ matrix.T for name in ("rate", "bend")}}


@pytest.mark.parametrize(
    ("matrix", "steer"), [(axes(heading=1.1, pitch=0.3, roll=-0.7), 1), (np.diag([1.0, -1.0, 1.0]), -1)],
    ids=["turned", "port for starboard"],
)  # fmt: skip
@pytest.mark.parametrize("turning", [0.0, 0.4])
def test_no_direction_of_the_scene_is_special(matrix, steer, turning):
    """All turned together, or mirrored with the steer angles: the same sound, to 1e-6."""
    told = world(12, 700, patterns=3, turning=turning)
    assert relative_rms(laid(mapped(told, matrix, steer)), laid(told)) < 1e-6


def test_halves_of_an_area_have_the_energy_of_the_whole():
    """Two halves at one place a quarter turn apart, the mean over all turns: each cell as loud as of the whole."""
    whole = world(13, 500)
    half = {**whole, "root": whole["root"] / np.sqrt(2)}
    other = {**half, "phase": 1j * whole["phase"]}
    cells = laid(other, cells=laid(half))
    np.testing.assert_allclose(np.abs(cells), np.abs(laid(whole)), atol=2e-6 * np.abs(cells).max())


def test_shares_of_one_are_no_thinning():
    """Numbers below a share of 1 are all numbers: the cells of products to 1e-7."""
    told = world(14, 700, answers="thinned")
    told["share"][:] = 1
    assert relative_rms(laid(told), laid({**told, "answers": "products"})) < 1e-7


def test_few_scatterers_stand_for_all():
    """One scatterer in 5 met: the energy of 200 draws of numbers and phases is that of all, 3 standard errors."""
    told, rng = world(15, 512, outs=1, backs=1, answers="thinned", moving=0.0), np.random.default_rng(1)
    told["share"][:] = 0.2
    energy = []
    for _ in range(200):
        drawn = {**told, "phase": np.exp(2j * np.pi * rng.uniform(size=512))}
        drawn["number"] = rng.uniform(size=512).astype(np.float32)
        energy.append([np.sum(np.abs(laid({**drawn, "answers": how})) ** 2) for how in ("thinned", "products")])
    thin, full = np.array(energy).T
    error = np.std(thin - full) / np.sqrt(200)
    assert error < 0.13 * full.mean()
    assert abs(thin.mean() - full.mean()) < 3 * error


def test_wavefronts_of_even_water_are_spheres():
    """Told by their curvature and distance over ground, at 3 m/s: cells as of spheres, 2e-6 where none is steep."""
    told = world(16, 600)
    way = told["out"]["departure"]
    way[..., 2] *= 0.5
    way /= np.linalg.norm(way, axis=-1, keepdims=True)
    length = told["out"]["length"]
    fronts = WavefrontColumns(1 / length, length * np.hypot(way[..., 0], way[..., 1]), np.zeros((2, 0, 600)))
    assert relative_rms(laid(told, fronts=fronts), laid(told)) < 2e-6
