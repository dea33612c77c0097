"""Cubic B-splines at any four points at once, in vectors: each point gathers sixteen numbers of its own.

Compilers do not gather by themselves where results are written too, so the instructions are written out here, in the
compiler's portable vector language.
"""

from typing import Any

from insonify.jit import deferred, intrinsic
from insonify.scene._simd_splines import Arithmetic

ir = deferred("llvmlite.ir")
types = deferred("numba.core.types")
cgutils = deferred("numba.core.cgutils")
errors = deferred("numba.core.errors")

POINTS = 4
"""Points that are worked out together."""
_INDEX, _PLACE = ir.IntType(32), ir.IntType(64)
_FOUR = ir.VectorType(ir.DoubleType(), POINTS)


def _transposed(builder: Any, rows: list[Any]) -> list[Any]:
    """The columns of four by four numbers, as vectors."""

    def pick(first: Any, second: Any, lanes: list[int]) -> Any:
        return builder.shuffle_vector(first, second, ir.Constant(ir.VectorType(_INDEX, POINTS), lanes))

    even, odd, low, high = [0, 4, 2, 6], [1, 5, 3, 7], [0, 1, 4, 5], [2, 3, 6, 7]
    halves = [(pick(rows[0], rows[1], way), pick(rows[2], rows[3], way)) for way in (even, odd)]
    return [pick(*half, way) for way in (low, high) for half in halves]


def _vector(builder: Any, data: Any, at: Any) -> Any:
    """First positions of stencils of four numbers."""
    return builder.bitcast(builder.gep(data, [at]), _FOUR.as_pointer())


@intrinsic
def splines(
    typing_context: Any, node: Any, stride: Any, at: Any, along: Any, across: Any, first: Any, found: Any, plane: Any
) -> Any:
    """Value and both slopes per pitch of the spline at the next `POINTS` points.

    Args:
        typing_context: Of the compiler.
        node: Numbers on the nodes, row by row, float64.
        stride: Length of the rows.
        at: Where in `node` the first of the 16 nodes of each point is, int64.
        along: How far in its cell each point is, from row to row, float64.
        across: Likewise from column to column.
        first: Number of the first of the points in these three and in the results.
        found: Results, values, then slopes along and across, float64.
        plane: How much further in it these are.
    """
    for array, kind in ((node, types.float64), (at, types.int64), (along, types.float64), (across, types.float64),
                        (found, types.float64)):  # fmt: skip
        if array.layout != "C" or array.ndim != 1 or array.dtype != kind:
            raise errors.TypingError(f"{array} must be one contiguous list of {kind}")

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        node, at, along, across, found = (
            cgutils.create_struct_proxy(signature.args[k])(context, builder, value=arguments[k]).data
            for k in (0, 2, 3, 4, 6)
        )
        stride, first, plane = (arguments[k] for k in (1, 5, 7))
        positions = [builder.load(builder.gep(at, [builder.add(first, ir.Constant(_PLACE, k))])) for k in range(POINTS)]
        do = Arithmetic(builder, _FOUR)
        (a, d), (b, e) = (do.weights(builder.load(_vector(builder, part, first), align=8)) for part in (along, across))
        heights, slopes = [], []
        for _ in range(4):
            nodes = _transposed(
                builder, [builder.load(_vector(builder, node, position), align=8) for position in positions]
            )
            heights.append(do.pairs(b, nodes))
            slopes.append(do.pairs(e, nodes))
            positions = [builder.add(position, stride) for position in positions]
        for result in (do.pairs(a, heights), do.pairs(d, heights), do.pairs(a, slopes)):
            builder.store(result, _vector(builder, found, first), align=8)
            first = builder.add(first, plane)
        return context.get_dummy_value()

    whole = types.int64
    return types.void(node, whole, at, along, across, whole, found, whole), generate
