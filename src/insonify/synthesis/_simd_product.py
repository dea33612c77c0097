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
    typingctx: Any, product: Any, left: Any, right: Any, column_of_row: Any, shape: Any, first_row: Any
) -> Any:
    """Part of a product of two matrices, whose sums stay in registers throughout; float32.

    product[i, j] = sum over k of left[first_row + i, column_of_row[k]] * right[k, j], where product has the shape TILE.
    Rows of zeros are left out of the right matrix, so that its row k belongs to a column of the left one.

    Args:
        typingctx: Context of the compiler.
        product: Result, TILE.
        left: Left matrix, (rows, columns), at least TILE[0] rows from the first.
        right: Some columns of the right matrix, without rows of zeros, (k, TILE[1]) or more rows.
        column_of_row: Column of the left matrix for each of these rows, (k,) or more.
        shape: Number of rows of the right matrix, and of columns of the left one.
        first_row: First row of the left matrix.
    """

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        first_row = args[5]
        product, left, right, column_of_row = (
            cgutils.create_struct_proxy(signature.args[k])(context, builder, args[k]).data for k in range(4)
        )
        count, width = cgutils.unpack_tuple(builder, args[4], 2)
        vector, lanes = _vector(ir.FloatType(), 16), range(0, TILE[1], 16)

        def constant(number: int) -> Any:
            return ir.Constant(first_row.type, number)

        def at(pointer: Any, row: Any, row_width: Any, column: int = 0) -> Any:
            return builder.gep(pointer, [builder.add(builder.mul(row, row_width), constant(column))])

        sums = [[cgutils.alloca_once_value(builder, ir.Constant(vector, [0.0] * 16)) for _ in lanes]
                for _ in range(TILE[0])]  # fmt: skip
        left_rows = [at(left, builder.add(first_row, constant(i)), width) for i in range(TILE[0])]
        with cgutils.for_range(builder, count) as loop:
            column = builder.load(builder.gep(column_of_row, [loop.index]))
            numbers = [_load(builder, at(right, loop.index, constant(TILE[1]), j), vector, 4) for j in lanes]
            for left_row, row_sums in zip(left_rows, sums, strict=True):
                factor = _splat(builder, builder.load(builder.gep(left_row, [column])), 16)
                for number, one in zip(numbers, row_sums, strict=True):
                    term = builder.fmul(number, factor, flags=("contract",))
                    builder.store(builder.fadd(builder.load(one), term, flags=("contract",)), one)
        for i, row_sums in enumerate(sums):
            for j, one in zip(lanes, row_sums, strict=True):
                target = builder.bitcast(at(product, constant(i), constant(TILE[1]), j), vector.as_pointer())
                builder.store(builder.load(one), target, align=4)
        return context.get_dummy_value()

    for array in (product, left, right, column_of_row):
        _require_contiguous(array)
    return types.void(product, left, right, column_of_row, shape, types.intp), codegen
