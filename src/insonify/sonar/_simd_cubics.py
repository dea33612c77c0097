"""Cubics of a table at several positions at once: each row is loaded whole, and the rows are transposed in registers.

Compilers gather one coefficient of all positions after the other, which takes twice as long.
"""

from typing import Any

from insonify.jit import deferred, intrinsic

ir = deferred("llvmlite.ir")
types = deferred("numba.core.types")
cgutils = deferred("numba.core.cgutils")
errors = deferred("numba.core.errors")
LANES = 4
"""Number of factors that are multiplied at once."""


@intrinsic
def multiply_by_cubics(typingctx: Any, cubics: Any, first: Any, fraction: Any, factor: Any, at: Any) -> Any:
    """Multiply four factors in succession by cubics; float64, C-contiguous.

    Args:
        typingctx: Context of the compiler.
        cubics: Coefficients of each cubic, constant first, row after row.
        first: Index in `cubics` of the first coefficient for each factor, uint32.
        fraction: Argument of the cubic for each factor.
        factor: Factors, multiplied in place.
        at: Index of the first of the four factors.
    """

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        vector, flags = ir.VectorType(ir.DoubleType(), LANES), ("contract",)
        table, offset, fractions, factors = (
            cgutils.create_struct_proxy(signature.args[k])(context, builder, args[k]).data for k in range(4)
        )

        def pointer(array: Any, index: Any) -> Any:
            return builder.bitcast(builder.gep(array, [index]), vector.as_pointer())

        def shuffled(one: Any, other: Any, *lanes: int) -> Any:
            return builder.shuffle_vector(one, other, ir.Constant(ir.VectorType(ir.IntType(32), LANES), lanes))

        def row(lane: int) -> Any:
            number = builder.add(args[4], ir.Constant(args[4].type, lane))
            start = builder.zext(builder.load(builder.gep(offset, [number])), ir.IntType(64))
            return builder.load(pointer(table, start), align=8)

        rows = [row(lane) for lane in range(LANES)]
        even, odd = ([shuffled(rows[k], rows[k + 1], s, s + 4, s + 2, s + 6) for k in (0, 2)] for s in (0, 1))
        c0, c2 = (shuffled(*even, s, s + 1, s + 4, s + 5) for s in (0, 2))
        c1, c3 = (shuffled(*odd, s, s + 1, s + 4, s + 5) for s in (0, 2))
        t = builder.load(pointer(fractions, args[4]), align=8)
        value = c3
        for coefficient in (c2, c1, c0):
            value = builder.fadd(coefficient, builder.fmul(t, value, flags=flags), flags=flags)
        product = builder.fmul(builder.load(pointer(factors, args[4]), align=8), value, flags=flags)
        builder.store(product, pointer(factors, args[4]), align=8)
        return context.get_dummy_value()

    if not all(array.layout == "C" for array in (cubics, first, fraction, factor)):
        raise errors.TypingError("all arrays must be contiguous")
    return types.void(cubics, first, fraction, factor, types.uint64), codegen
