"""Cubic B-splines at four arbitrary points at once in SIMD vectors: each point reads its own 4 x 4 spline coefficients.

Compilers do not vectorise such indexed loads in loops that also store results, so the instructions are given here as
LLVM's portable vector operations.
"""

from typing import Any

from insonify.jit import deferred, intrinsic
from insonify.scene._simd_splines import Arithmetic

ir = deferred("llvmlite.ir")
types = deferred("numba.core.types")
cgutils = deferred("numba.core.cgutils")
errors = deferred("numba.core.errors")

POINTS = 4
"""Points per vector."""
_INDEX, _OFFSET = ir.IntType(32), ir.IntType(64)
_FOUR = ir.VectorType(ir.DoubleType(), POINTS)


def _transposed(builder: Any, rows: list[Any]) -> list[Any]:
    """Transpose of a 4 x 4 matrix given as four row vectors."""

    def pick(first: Any, second: Any, lanes: list[int]) -> Any:
        return builder.shuffle_vector(first, second, ir.Constant(ir.VectorType(_INDEX, POINTS), lanes))

    even, odd, low, high = [0, 4, 2, 6], [1, 5, 3, 7], [0, 1, 4, 5], [2, 3, 6, 7]
    halves = [(pick(rows[0], rows[1], lanes), pick(rows[2], rows[3], lanes)) for lanes in (even, odd)]
    return [pick(*half, lanes) for lanes in (low, high) for half in halves]


def _vector(builder: Any, data: Any, at: Any) -> Any:
    """Pointer to the vector of four consecutive float64 that starts at index `at` of `data`."""
    return builder.bitcast(builder.gep(data, [at]), _FOUR.as_pointer())


@intrinsic
def splines(
    typing_context: Any,
    node: Any,
    stride: Any,
    at: Any,
    along: Any,
    across: Any,
    first: Any,
    result_list: Any,
    plane: Any,
) -> Any:
    """Value and both slopes, re one pitch, of the bicubic B-spline at `POINTS` points from `first` on.

    Args:
        typing_context: Typing context of numba.
        node: Spline coefficients at the nodes, row by row, float64, (rows * stride,).
        stride: Length of the rows.
        at: Index in `node` of the first of the 16 nodes of each point, int64, (n,).
        along: Fractional position of each point in its cell, from row to row, 0 to 1, float64, (n,).
        across: Fractional position from column to column, 0 to 1, float64, (n,).
        first: Index of the first of the four points.
        result_list: Result: values, slopes along, slopes across, one block after the other, float64, (3 * plane,).
        plane: Length of one of these blocks.
    """
    for array, kind in ((node, types.float64), (at, types.int64), (along, types.float64), (across, types.float64),
                        (result_list, types.float64)):  # fmt: skip
        if array.layout != "C" or array.ndim != 1 or array.dtype != kind:
            raise errors.TypingError(f"{array} must be one contiguous list of {kind}")

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        node, at, along, across, result_list = (
            cgutils.create_struct_proxy(signature.args[k])(context, builder, value=arguments[k]).data
            for k in (0, 2, 3, 4, 6)
        )
        stride, first, plane = (arguments[k] for k in (1, 5, 7))
        positions = [
            builder.load(builder.gep(at, [builder.add(first, ir.Constant(_OFFSET, k))])) for k in range(POINTS)
        ]
        arithmetic = Arithmetic(builder, _FOUR)
        (a, d), (b, e) = (  # weights and their derivatives
            arithmetic.weights(builder.load(_vector(builder, part, first), align=8)) for part in (along, across)
        )
        heights, slopes = [], []
        for _ in range(4):
            nodes = _transposed(
                builder, [builder.load(_vector(builder, node, position), align=8) for position in positions]
            )
            heights.append(arithmetic.pairs(b, nodes))
            slopes.append(arithmetic.pairs(e, nodes))
            positions = [builder.add(position, stride) for position in positions]
        for result in (arithmetic.pairs(a, heights), arithmetic.pairs(d, heights), arithmetic.pairs(a, slopes)):
            builder.store(result, _vector(builder, result_list, first), align=8)
            first = builder.add(first, plane)
        return context.get_dummy_value()

    whole = types.int64
    return types.void(node, whole, at, along, across, whole, result_list, whole), generate
