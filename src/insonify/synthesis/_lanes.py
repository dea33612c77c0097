"""All cells of one spike in a few vector instructions.

Compilers do not find this loop by themselves: the kernel's polynomials have a lane per cell, and the complex weight
alternates along the cells. So the instructions are written out here, in the compiler's portable vector
language: it turns them into whatever the processor has.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.errors import TypingError
from numba.extending import intrinsic

from insonify.synthesis._taps import CELLS_PER_SPIKE, DEGREE, WIDTH, tap_coefficients

# Constants of the compiled kernels, which are cached on disk by the date of _spread.py alone: after a change here or in
# _taps.py or cycles.py, touch that file. (The accuracy tests fail on a stale cache.)
_TAPS = tap_coefficients()


def _vector(scalar: ir.Type, lanes: int) -> ir.Type:
    return ir.VectorType(scalar, lanes)


def _load(builder: Any, pointer: Any, vector: ir.Type, align: int) -> Any:
    return builder.load(builder.bitcast(pointer, vector.as_pointer()), align=align)


def _add_to(builder: Any, pointer: Any, vector: ir.Type, addend: Any, align: int) -> None:
    place = builder.bitcast(pointer, vector.as_pointer())
    builder.store(builder.fadd(builder.load(place, align=align), addend, flags=("contract",)), place, align=align)


def _pick(builder: Any, source: Any, lanes: list[int]) -> Any:
    mask = ir.Constant(_vector(ir.IntType(32), len(lanes)), lanes)
    return builder.shuffle_vector(source, ir.Constant(source.type, ir.Undefined), mask)


def _splat(builder: Any, scalar: Any, lanes: int) -> Any:
    one = builder.insert_element(
        ir.Constant(_vector(scalar.type, lanes), ir.Undefined), scalar, ir.Constant(ir.IntType(32), 0)
    )
    return _pick(builder, one, [0] * lanes)


def _kernel_cells(builder: Any, place: Any) -> Any:
    """The kernel on all its cells at once, by Horner's rule on a vector with one lane per cell."""
    vector = _vector(place.type, CELLS_PER_SPIKE)
    y = _splat(builder, place, CELLS_PER_SPIKE)
    rows = [ir.Constant(vector, [float(c) for c in row]) for row in _TAPS]
    value = rows[DEGREE]
    for row in reversed(rows[:DEGREE]):
        value = builder.fadd(builder.fmul(value, y, flags=("contract",)), row, flags=("contract",))
    return value


def _require_contiguous(cells: Any) -> None:
    if cells.layout != "C":
        raise TypingError("cells must lie side by side in memory; pass one channel's row, not a column")


def _weight_at(builder: Any, data: Any, i: Any) -> Any:
    """The complex weight of spike i, real and imaginary in turn, four times."""
    pair = _load(builder, builder.gep(data, [builder.mul(i, ir.Constant(i.type, 2))]), _vector(ir.FloatType(), 2), 4)
    return _pick(builder, pair, [0, 1] * 4)


def _add_kernel(builder: Any, first: Any, kernel: Any, weights: Any, lanes: int) -> None:
    """Cells of so many shapes side by side, from the first on: the kernel on each cell, times the weights of shapes."""
    for begin in range(0, WIDTH, 4 // lanes):
        height = _pick(builder, kernel, [begin + k // (2 * lanes) for k in range(8)])
        pointer = builder.gep(first, [ir.Constant(ir.IntType(64), 2 * lanes * begin)])
        _add_to(builder, pointer, height.type, builder.fmul(height, weights, flags=("contract",)), 4)


@intrinsic
def add_complex_spike(typingctx: Any, cells: Any, at: Any, place: Any, weights: Any, i: Any) -> Any:
    """cells[2 at ...] += kernel(place) * weights[2 i], weights[2 i + 1]; all float32, real and imaginary in turn."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        cells, at, place, weights, i = args
        data = cgutils.create_struct_proxy(signature.args[0])(context, builder, cells).data
        weight_data = cgutils.create_struct_proxy(signature.args[3])(context, builder, weights).data
        weight = _weight_at(builder, weight_data, i)
        first = builder.gep(data, [builder.mul(at, ir.Constant(at.type, 2))])
        _add_kernel(builder, first, _kernel_cells(builder, place), weight, 1)
        return context.get_dummy_value()

    _require_contiguous(cells)
    return types.void(cells, types.intp, types.float32, weights, types.intp), codegen


def _curved_spike(lanes: int) -> Any:
    """Adds spikes to as many shapes, 2 or 4, whose shares are polynomials of where an echo lies among them."""

    @intrinsic
    def add(
        typingctx: Any, cells: Any, at: Any, place: Any, weights: Any, x: Any, curve: Any, i: Any
    ) -> Any:  # fmt: skip
        """Cell j, shape s: cells[2 lanes (at + j) + 2 s ...] += kernel(place)[j] * share[s] * weights[2 i ...].

        With share[s] = curve[0, 2 s] + x curve[1, 2 s] + ..., each written twice; all float32.
        """

        def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            at, place, x, i = args[1], args[2], args[4], args[6]
            data, weight_data, curve_data = (
                cgutils.create_struct_proxy(signature.args[k])(context, builder, args[k]).data for k in (0, 3, 5)
            )
            vector, each = _vector(ir.FloatType(), 8), _splat(builder, x, 8)
            rows = [
                _load(builder, builder.gep(curve_data, [ir.Constant(at.type, 8 * row)]), vector, 4)
                for row in range(lanes)
            ]
            share = rows[-1]
            for row in reversed(rows[:-1]):
                share = builder.fadd(builder.fmul(share, each, flags=("contract",)), row, flags=("contract",))
            weight = builder.fmul(share, _weight_at(builder, weight_data, i))
            first = builder.gep(data, [builder.mul(at, ir.Constant(at.type, 2 * lanes))])
            _add_kernel(builder, first, _kernel_cells(builder, place), weight, lanes)
            return context.get_dummy_value()

        _require_contiguous(cells)
        whole, single = types.intp, types.float32
        return types.void(cells, whole, single, weights, single, curve, whole), codegen

    return add


add_spike_of_2 = _curved_spike(2)
add_spike_of_4 = _curved_spike(4)


@intrinsic
def add_shaped_spike(
    typingctx: Any, cells: Any, apart: Any, at: Any, place: Any, weights: Any, shares: Any, stride: Any, groups: Any,
    i: Any,
) -> Any:  # fmt: skip
    """The same for groups of 4 shapes, `apart` numbers apart; shape s has shares[s stride + i] of the weight."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        apart, at, place = args[1:4]
        stride, groups, i = args[6:]
        data, weight_data, share_data = (
            cgutils.create_struct_proxy(signature.args[k])(context, builder, args[k]).data for k in (0, 4, 5)
        )
        kernel, weight = _kernel_cells(builder, place), _weight_at(builder, weight_data, i)
        first = builder.gep(data, [builder.mul(at, ir.Constant(at.type, 8))])
        with cgutils.for_range(builder, groups) as loop:
            share = ir.Constant(weight.type, ir.Undefined)
            for k in range(4):
                row = builder.add(builder.mul(loop.index, ir.Constant(i.type, 4)), ir.Constant(i.type, k))
                one = builder.load(builder.gep(share_data, [builder.add(builder.mul(row, stride), i)]))
                for lane in (2 * k, 2 * k + 1):
                    share = builder.insert_element(share, one, ir.Constant(ir.IntType(32), lane))
            grid = builder.gep(first, [builder.mul(loop.index, apart)])
            _add_kernel(builder, grid, kernel, builder.fmul(share, weight), 4)
        return context.get_dummy_value()

    _require_contiguous(cells)
    whole = types.intp
    return types.void(cells, whole, whole, types.float32, weights, shares, whole, whole, whole), codegen


@intrinsic
def mix_nodes(
    typingctx: Any, mix: Any, single: Any, delay: Any, others: Any, shape: Any, i: Any, delays: Any, mixed: Any
) -> Any:  # fmt: skip
    """What is known at k nodes, told at `wide` elements, a multiple of 16, for echo i of `tile`; shape (k, wide, tile).

    delays[i wide + e] = sum over k of mix[k, e] * delay[k, i]; and in float32, by the same numbers in `single`, for the
    columns of `others`, (3, k, tile), into `mixed`, (3, tile wide).
    """

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        i = args[5]
        mix, single, delay, others, delays, mixed = (
            cgutils.create_struct_proxy(signature.args[k])(context, builder, args[k]).data for k in (0, 1, 2, 3, 6, 7)
        )
        nodes, wide, tile = cgutils.unpack_tuple(builder, args[4], 3)
        begin, none, lanes = builder.mul(i, wide), ir.Constant(i.type, 0), ir.Constant(i.type, 16)
        ways = [(mix, delay, delays, none, none)] + [
            (single, others, mixed, builder.mul(ir.Constant(i.type, c), builder.mul(nodes, tile)),
             builder.mul(ir.Constant(i.type, c), builder.mul(tile, wide))) for c in range(3)
        ]  # fmt: skip
        vectors = [_vector(source.type.pointee, 16) for _, source, *_ in ways]
        totals = [cgutils.alloca_once(builder, vector) for vector in vectors]
        with cgutils.for_range_slice(builder, none, wide, lanes) as (e, _):
            for total, vector in zip(totals, vectors, strict=True):
                builder.store(ir.Constant(vector, [0.0] * 16), total)
            with cgutils.for_range(builder, nodes) as loop:
                here = builder.add(builder.mul(loop.index, wide), e)
                row = builder.add(builder.mul(loop.index, tile), i)
                for (numbers, source, _, first, _), total, vector in zip(ways, totals, vectors, strict=True):
                    one = _splat(builder, builder.load(builder.gep(source, [builder.add(first, row)])), 16)
                    part = _load(builder, builder.gep(numbers, [here]), vector, 4)
                    part = builder.fmul(part, one, flags=("contract",))
                    builder.store(builder.fadd(builder.load(total), part, flags=("contract",)), total)
            for (_, _, out, _, first), total, vector in zip(ways, totals, vectors, strict=True):
                place = builder.gep(out, [builder.add(builder.add(first, begin), e)])
                builder.store(builder.load(total), builder.bitcast(place, vector.as_pointer()), align=4)
        return context.get_dummy_value()

    for rows in (mix, single, delay, others, delays, mixed):
        _require_contiguous(rows)
    return types.void(mix, single, delay, others, shape, types.intp, delays, mixed), codegen


@intrinsic
def add_real_spike(typingctx: Any, cells: Any, at: Any, place: Any, weight: Any) -> Any:
    """cells[at ...] += kernel(place) * weight; all float64."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        cells, at, place, weight = args
        data = cgutils.create_struct_proxy(signature.args[0])(context, builder, cells).data
        kernel = _kernel_cells(builder, place)
        addend = builder.fmul(kernel, _splat(builder, weight, CELLS_PER_SPIKE), flags=("contract",))
        _add_to(builder, builder.gep(data, [at]), kernel.type, addend, 8)
        return context.get_dummy_value()

    _require_contiguous(cells)
    return types.void(cells, types.intp, types.float64, types.float64), codegen
