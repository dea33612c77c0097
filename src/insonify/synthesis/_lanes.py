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

from insonify.synthesis._taps import CELLS_PER_SPIKE, DEGREE, tap_coefficients

# Constants of the compiled kernels, which are cached on disk by the date of _spread.py alone: after a change here or in
# _taps.py or _fastmath.py, touch that file. (The accuracy tests fail on a stale cache.)
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


@intrinsic
def add_complex_spike(typingctx: Any, cells: Any, at: Any, place: Any, weights: Any, i: Any) -> Any:
    """cells[2 at ...] += kernel(place) * weights[2 i], weights[2 i + 1]; all float32, real and imaginary in turn."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        cells, at, place, weights, i = args
        single = ir.FloatType()
        data = cgutils.create_struct_proxy(signature.args[0])(context, builder, cells).data
        weight_data = cgutils.create_struct_proxy(signature.args[3])(context, builder, weights).data
        two = ir.Constant(at.type, 2)
        weight = _load(builder, builder.gep(weight_data, [builder.mul(i, two)]), _vector(single, 2), 4)
        kernel = _kernel_cells(builder, place)
        first = builder.gep(data, [builder.mul(at, two)])
        for begin in range(0, CELLS_PER_SPIKE, 4):
            pairs = _pick(builder, kernel, [begin + k // 2 for k in range(8)])
            both = _pick(builder, weight, [0, 1] * 4)
            pointer = builder.gep(first, [ir.Constant(at.type, 2 * begin)])
            _add_to(builder, pointer, pairs.type, builder.fmul(pairs, both, flags=("contract",)), 4)
        return context.get_dummy_value()

    _require_contiguous(cells)
    return types.void(cells, types.intp, types.float32, weights, types.intp), codegen


@intrinsic
def add_shaped_spike(
    typingctx: Any, cells: Any, apart: Any, at: Any, place: Any, weights: Any, shares: Any, stride: Any, shapes: Any,
    i: Any,
) -> Any:  # fmt: skip
    """The same for several grids that lie `apart` numbers apart, each with its share of the weight.

    Grid s takes kernel(place) * shares[s stride + i] * weights[2 i], weights[2 i + 1].
    """

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        apart, at, place = args[1:4]
        stride, shapes, i = args[6:]
        single = ir.FloatType()
        data, weight_data, share_data = (
            cgutils.create_struct_proxy(signature.args[k])(context, builder, args[k]).data for k in (0, 4, 5)
        )
        two = ir.Constant(at.type, 2)
        weight = _load(builder, builder.gep(weight_data, [builder.mul(i, two)]), _vector(single, 2), 4)
        kernel, both = _kernel_cells(builder, place), _pick(builder, weight, [0, 1] * 4)
        parts = [
            builder.fmul(_pick(builder, kernel, [begin + k // 2 for k in range(8)]), both, flags=("contract",))
            for begin in range(0, CELLS_PER_SPIKE, 4)
        ]
        first = builder.gep(data, [builder.mul(at, two)])
        with cgutils.for_range(builder, shapes) as loop:
            share = builder.load(builder.gep(share_data, [builder.add(builder.mul(loop.index, stride), i)]))
            each, grid = _splat(builder, share, 8), builder.gep(first, [builder.mul(loop.index, apart)])
            for row, part in enumerate(parts):
                pointer = builder.gep(grid, [ir.Constant(at.type, 8 * row)])
                _add_to(builder, pointer, part.type, builder.fmul(part, each, flags=("contract",)), 4)
        return context.get_dummy_value()

    _require_contiguous(cells)
    whole = types.intp
    return types.void(cells, whole, whole, types.float32, weights, shares, whole, whole, whole), codegen


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
