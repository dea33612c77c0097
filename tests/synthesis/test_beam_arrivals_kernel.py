"""Claims about a block of scatterers received by beams.

The kernel's cells are those of echoes worked out one by one.
"""

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
from insonify.synthesis._waveform_basis_kernel import basis_weight_table, group_layout
from oracles.beams import axes
from oracles.block import CARRIER, CELLS, RATE, SPEED, WAVELENGTH, received_series, world
from synthesis.oracle import relative_rms

NONE, NOTHING = np.empty(0), np.empty((0, 0), np.float32)
FRONTS = WavefrontColumns(np.empty((0, 0)), np.empty((0, 0)), np.empty((0, 0, 0)))


def patterns(one):
    """Beams of an array of the oracle, for the kernel."""
    line = LineArray(length=one["extent"] * WAVELENGTH, element=one["element"], steer=tuple(one["steer"]))
    return beams(line, CARRIER, SPEED, one["axes"]).kernel_tables


def strengths(case):
    """What the scatterers of a world strength, for the kernel."""
    given, thinned = case["strengths"] == "given", case["strengths"] == "thinned"
    number, stretch, share = case["number"], case["stretch"], case["share"]
    if not thinned:
        number, stretch, share = np.empty(0, np.float32), np.empty(0, np.uint8), NOTHING
    if given:
        return ScatteringStrengths(case["given"].astype(np.complex64), NONE, NONE, NONE, number, stretch, share)
    return ScatteringStrengths(
        np.empty((0, 0), np.complex64), case["factor"], case["root"], case["weight"], number, stretch, share
    )


def deposited(case, *, both=None, fronts=FRONTS, cells=None):
    """Cells of a world by the kernel, (channels, groups, cells, shapes of a group)."""
    sent, receive_patterns = patterns(case["transmit"]), patterns(case["receive"])
    channels = max(len(sent.steer), len(receive_patterns.steer))
    groups, together = group_layout(len(case["node"]))
    if cells is None:
        cells = np.zeros((channels, groups, CELLS, together), np.complex64)
    channel = np.arange(channels)
    receive_beams = ReceiveBeams(case["place"], case["velocity"], case["acceleration"], np.array([[0, channels]]),
                channel % len(sent.steer), channel % len(receive_patterns.steer))  # fmt: skip
    receiving_array = ReceivingArray(
        case["middle"], case["has_parallax"], case["turns"], case["rate"], case["bend"], receive_patterns, receive_beams
    )
    away, home = (LegColumns(**case[end]) for end in ("out", "back"))
    same = case["out"] is case["back"] if both is None else both
    block = ScattererBlock(case["pair"], away, home, same, case["phase"], strengths(case), fronts)
    water = ArrayWater(1 / SPEED, 0.0, case["loss"], fronts is not FRONTS, case["middle"])
    deposit_block(
        cells, block, case["taken"], Transmitter(case["level"], case["sent"], case["middle"], 1 / SPEED, sent),
        receiving_array, Reception(0.0, RATE, CARRIER, basis_weight_table(case["node"], -5e-3, 5e-3), water), None,
    )  # fmt: skip
    return cells


def flat(cells):
    """The same as the oracle has them, (channels, cells, shapes)."""
    return np.moveaxis(cells, 1, 2).reshape(len(cells), CELLS, -1)


def part_of(case, rows):
    """A world with some of its scatterers."""
    ends = {end: {name: np.ascontiguousarray(column[:, rows]) for name, column in case[end].items()}
            for end in ("out", "back")}  # fmt: skip
    if case["out"] is case["back"]:
        ends["back"] = ends["out"]
    own = {name: np.ascontiguousarray(case[name][rows]) for name in ("phase", "root", "number", "stretch")}
    return {**case, **ends, **own, "given": np.ascontiguousarray(case["given"][:, rows])}


@pytest.mark.parametrize("strength", ["products", "thinned", "given"])
@pytest.mark.parametrize(("moving", "turning"), [(0.0, 0.0), (1.0, 0.0), (1.0, 0.5)], ids=["rest", "ahead", "turning"])
def test_a_block_is_the_sum_of_its_echoes(strength, moving, turning):
    """More than a part, a quarter of the legs not there, 2 x 2 legs, 2 beams: float64, one by one, to 1e-6."""
    case = world(1, _PART + 100, strengths=strength, moving=moving, turning=turning)
    known = received_series(case)
    assert relative_rms(flat(deposited(case))[..., : known.shape[2]], known) < 1e-6


@pytest.mark.parametrize(
    ("count", "outs", "backs"),
    [(1, 1, 1), (2, 3, 3), (_PART - 1, 1, 1), (_PART, 1, 2), (_PART + 1, 3, 2), (2 * _PART + 1, 1, 1)],
)
def test_however_many_scatterers_and_legs_there_are(count, outs, backs):
    """Parts that are filled, one less, one more; legs back that are others than those out: 1e-6."""
    case = world(15 if count == 1 else 16, count, outs=outs, backs=backs, strengths="thinned", dopplers=2)
    case["share"][:] = 0.6
    case["number"][:1] = 0.1
    known = received_series(case)
    assert np.linalg.norm(flat(deposited(case)) - known) < 1e-6 * np.linalg.norm(known)


@pytest.mark.parametrize(("sent", "received"), [(1, 1), (3, 3), (3, 1), (1, 4)])
def test_each_channel_has_its_own_two_beams(sent, received):
    """One beam out for all or one for each, one pattern for all or one for each: 1e-6, channel by channel."""
    case = world(7, 300, beams=sent, patterns=received, dopplers=5)
    known, got = received_series(case), flat(deposited(case))
    assert known.shape == (max(sent, received), CELLS, 5) and got.shape[2] == 8 and not got[..., 5:].any()
    for one, other in zip(got[..., :5], known, strict=True):
        assert relative_rms(one, other) < 1e-6


@pytest.mark.parametrize("strength", ["products", "thinned", "given"])
def test_parts_deposited_one_after_the_other_are_the_whole_bit_for_bit(strength):
    """A block cut where one part ends requests the same in the same order: the same bits; cut elsewhere, 1e-6."""
    case = world(3, 2 * _PART + 100, strengths=strength)
    whole = deposited(case)
    for cut, same in ((_PART, True), (2 * _PART, True), (700, False)):
        cells = deposited(part_of(case, slice(cut, None)), cells=deposited(part_of(case, slice(0, cut))))
        assert relative_rms(cells, whole) < 1e-6
        assert np.array_equal(cells, whole) == same


def test_what_is_not_there_may_be_anything():
    """Legs of no visibility, or with a mirror that returns nothing, hold NaN or numbers: the bits are the same."""
    case, other = world(4, 600), world(4, 600)
    for name in ("length", "spreading", "absorption", "grazing_sine"):
        column = other["out"][name]
        assert np.isnan(column).any()
        column[:] = np.nan_to_num(column, nan=0.7)
    np.testing.assert_array_equal(deposited(case), deposited(other))


def test_a_scatterer_without_any_leg_is_silence():
    """No leg there, no pairs, no weight, no share, no given strength: not one cell is touched."""
    dark = world(5, 40)
    dark["out"]["visibility"][:] = 0
    alone = world(5, 40)
    alone["pair"] = np.zeros((0, 2), np.int64)
    mute = world(5, 40)
    mute["weight"] = np.zeros(4)
    left_out, none_given = world(5, 40, strengths="thinned"), world(5, 40, strengths="given")
    left_out["share"][:], none_given["given"][:] = 0, 0
    assert [bool(deposited(case).any()) for case in (dark, alone, mute, left_out, none_given)] == [False] * 5
    assert deposited(world(5, 40)).any()


def test_a_baffle_receives_and_sends_nothing_backwards():
    """All scatterers behind either array: silence; before both: sound."""
    case = world(6, 50, moving=0.0)
    ahead = case["transmit"]["axes"][0]
    for end, sign, silent in (("receive", 1, False), ("receive", -1, True), ("transmit", -1, True)):
        turned = {**case, "out": dict(case["out"]), "transmit": {**case["transmit"]}, "receive": {**case["receive"]}}
        turned["back"] = turned["out"]
        turned["out"]["departure"] = np.tile(ahead, (2, 50, 1))
        turned["receive"]["axes"] = case["transmit"]["axes"]
        turned[end]["axes"] = np.ascontiguousarray(np.diag([sign, 1, sign]) @ case["transmit"]["axes"])
        assert deposited(turned).any() != silent


def test_pressure_is_linear_in_what_is_sent():
    """Twice the source level, or root of area, or weight of all pairs: twice each cell, bit for bit."""
    case = world(8, 600, strengths="thinned")
    once = deposited(case)
    for name in ("level", "root", "weight"):
        np.testing.assert_array_equal(deposited({**case, name: 2 * case[name]}), 2 * once)


@pytest.mark.parametrize("moving", [0.0, 1.0])
def test_legs_out_and_back_that_are_alike_are_worked_out_once(moving):
    """Whether both are one array, or one is a copy: the same cells to 1e-7."""
    case = world(9, 900, moving=moving)
    assert relative_rms(deposited(case, both=True), deposited(case, both=False)) < 1e-7


def test_no_speed_is_rest():
    """Moving at 0 m/s, evaluated at the middles of pulses and seen from where the array is: as at rest, 1e-6."""
    rest = world(10, 700, moving=0.0)
    for middle in (1e-4, 3e-3):
        under_way = {**rest, "middle": middle, "has_parallax": True, "turns": True}
        assert relative_rms(deposited(under_way), deposited(rest)) < 1e-6


@pytest.mark.parametrize("strength", ["products", "thinned"])
def test_ends_may_be_exchanged_at_rest(strength):
    """Legs out for legs back, the arrays, and the pairs turned round: reciprocity to 1e-6."""
    case = world(11, 700, outs=2, backs=3, beams=2, moving=0.0, strengths=strength)
    case["receive"]["element"] = "cosine"
    other = {**case, "out": case["back"], "back": case["out"], "pair": np.ascontiguousarray(case["pair"][:, ::-1])}
    other["transmit"], other["receive"] = case["receive"], case["transmit"]
    assert relative_rms(deposited(other), deposited(case)) < 1e-6


def mapped(case, matrix, steer):
    """A world turned or mirrored as a whole; with the sign of all steer angles."""
    ends = {}
    for end in ("out", "back"):
        ends[end] = {**case[end], "departure": np.ascontiguousarray(case[end]["departure"] @ matrix.T)}
    if case["back"] is case["out"]:
        ends["back"] = ends["out"]
    for end in ("transmit", "receive"):
        turned = np.diag([1, steer, 1]) @ case[end]["axes"] @ matrix.T
        ends[end] = {**case[end], "axes": np.ascontiguousarray(turned), "steer": steer * case[end]["steer"]}
    ways = {name: np.ascontiguousarray(case[name] @ matrix.T) for name in ("sent", "velocity", "acceleration")}
    return {**case, **ends, **ways, **{name: matrix @ case[name] @ matrix.T for name in ("rate", "bend")}}


@pytest.mark.parametrize(
    ("matrix", "steer"), [(axes(heading=1.1, pitch=0.3, roll=-0.7), 1), (np.diag([1.0, -1.0, 1.0]), -1)],
    ids=["turned", "port for starboard"],
)  # fmt: skip
@pytest.mark.parametrize("turning", [0.0, 0.4])
def test_no_direction_of_the_scene_is_special(matrix, steer, turning):
    """All turned together, or mirrored with the steer angles: the same sound, to 1e-6."""
    case = world(12, 700, patterns=3, turning=turning)
    assert relative_rms(deposited(mapped(case, matrix, steer)), deposited(case)) < 1e-6


def test_halves_of_an_area_have_the_energy_of_the_whole():
    """Two halves at one place a quarter turn apart, the mean over all turns: each cell as strong as of the whole."""
    whole = world(13, 500)
    half = {**whole, "root": whole["root"] / np.sqrt(2)}
    other = {**half, "phase": 1j * whole["phase"]}
    cells = deposited(other, cells=deposited(half))
    np.testing.assert_allclose(np.abs(cells), np.abs(deposited(whole)), atol=2e-6 * np.abs(cells).max())


def test_shares_of_one_are_no_thinning():
    """Numbers below a share of 1 are all numbers: the cells of products to 1e-7."""
    case = world(14, 700, strengths="thinned")
    case["share"][:] = 1
    assert relative_rms(deposited(case), deposited({**case, "strengths": "products"})) < 1e-7


def test_few_scatterers_stand_for_all():
    """One scatterer in 5 evaluated: the energy of 200 draws of numbers and phases is that of all, 3 standard errors."""
    case, rng = world(15, 512, outs=1, backs=1, strengths="thinned", moving=0.0), np.random.default_rng(1)
    case["share"][:] = 0.2
    energy = []
    for _ in range(200):
        drawn = {**case, "phase": np.exp(2j * np.pi * rng.uniform(size=512))}
        drawn["number"] = rng.uniform(size=512).astype(np.float32)
        energy.append([np.sum(np.abs(deposited({**drawn, "strengths": how})) ** 2) for how in ("thinned", "products")])
    thin, full = np.array(energy).T
    error = np.std(thin - full) / np.sqrt(200)
    assert error < 0.13 * full.mean()
    assert abs(thin.mean() - full.mean()) < 3 * error


def test_wavefronts_of_even_water_are_spheres():
    """As their curvature and distance over ground, at 3 m/s: cells as of spheres, 2e-6 where none is steep."""
    case = world(16, 600)
    way = case["out"]["departure"]
    way[..., 2] *= 0.5
    way /= np.linalg.norm(way, axis=-1, keepdims=True)
    length = case["out"]["length"]
    fronts = WavefrontColumns(1 / length, length * np.hypot(way[..., 0], way[..., 1]), np.zeros((2, 0, 600)))
    assert relative_rms(deposited(case, fronts=fronts), deposited(case)) < 2e-6
