"""Part of a matrix product in vector instructions.

Compilers load and store the sums of a product anew for each of its terms, which takes longer than the multiplications.
Here they stay in registers. A library of linear algebra does the same, but brings threads of its own.
"""

from typing import Any

from insonify.jit import deferred, intrinsic
from insonify.synthesis._simd_gridding import _load, _require_contiguous, _splat, _vector

ir = deferred("llvmlite.ir")
types = deferred("numba.core.types")
cgutils = deferred("numba.core.cgutils")
TILE = 8, 32
"""Rows and columns of the part that is computed at once."""


@intrinsic
def multiply_tile(
    typingctx: Any, products: Any, weights: Any, columns: Any, filled: Any, shape: Any, first: Any
) -> Any:
    """Matrix product of a few rows and columns, whose sums stay in registers throughout; float32.

    products[b, i] = sum over k of weights[first + b, filled[k]] * columns[k, i], of shape TILE; shape: number of k, and
    of weights in a row.
    """

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        first = args[5]
        products, weights, columns, filled = (
            cgutils.create_struct_proxy(signature.args[k])(context, builder, args[k]).data for k in range(4)
        )
        count, rows = cgutils.unpack_tuple(builder, args[4], 2)
        vector, lanes = _vector(ir.FloatType(), 16), range(0, TILE[1], 16)

        def at(pointer: Any, row: Any, width: Any, column: int = 0) -> Any:
            return builder.gep(pointer, [builder.add(builder.mul(row, width), ir.Constant(first.type, column))])

        width = ir.Constant(first.type, TILE[1])
        totals = [[cgutils.alloca_once_value(builder, ir.Constant(vector, [0.0] * 16)) for _ in lanes]
                  for _ in range(TILE[0])]  # fmt: skip
        starts = [at(weights, builder.add(first, ir.Constant(first.type, b)), rows) for b in range(TILE[0])]
        with cgutils.for_range(builder, count) as loop:
            row = builder.load(builder.gep(filled, [loop.index]))
            numbers = [_load(builder, at(columns, loop.index, width, k), vector, 4) for k in lanes]
            for start, sums in zip(starts, totals, strict=True):
                weight = _splat(builder, builder.load(builder.gep(start, [row])), 16)
                for number, total in zip(numbers, sums, strict=True):
                    product = builder.fmul(number, weight, flags=("contract",))
                    builder.store(builder.fadd(builder.load(total), product, flags=("contract",)), total)
        for b, sums in enumerate(totals):
            for k, total in zip(lanes, sums, strict=True):
                target = builder.bitcast(at(products, ir.Constant(first.type, b), width, k), vector.as_pointer())
                builder.store(builder.load(total), target, align=4)
        return context.get_dummy_value()

    for array in (products, weights, columns, filled):
        _require_contiguous(array)
    return types.void(products, weights, columns, filled, shape, types.intp), codegen
