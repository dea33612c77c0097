"""Bilinear interpolation of eight values at once in vector instructions.

Compilers do not vectorise the eight values of a point, because the result might overlap the nodes.
"""

from typing import Any

from insonify.jit import deferred, intrinsic

ir = deferred("llvmlite.ir")
types = deferred("numba.core.types")
cgutils = deferred("numba.core.cgutils")
errors = deferred("numba.core.errors")
LANES = 8
"""Number of values of a node."""


@intrinsic
def bilinear_columns(typingctx: Any, nodes: Any, node: Any, below: Any, fractions: Any, columns: Any, row: Any) -> Any:
    """Eight values between the four nodes about a point; float32, C-contiguous.

    Args:
        typingctx: Context of the compiler.
        nodes: Eight values of each node, node after node.
        node: Offset of the first value of the upper left node; those of the upper right one follow.
        below: Offset from the values of a node to those of the node below it.
        fractions: Distances of the point from the upper left node, to the right and down [node spacings].
        columns: Result: eight values of each point.
        row: Offset of the first value of the point.
    """

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        vector, flags = ir.VectorType(ir.FloatType(), LANES), ("contract",)
        data, result = (cgutils.create_struct_proxy(signature.args[k])(context, builder, args[k]).data for k in (0, 4))
        node, below, row = args[1], args[2], args[5]
        first, splat = ir.Constant(ir.VectorType(ir.FloatType(), LANES), ir.Undefined), ir.Constant(
            ir.VectorType(ir.IntType(32), LANES), [0] * LANES)  # fmt: skip
        right, down = (
            builder.shuffle_vector(builder.insert_element(first, part, ir.Constant(ir.IntType(32), 0)), first, splat)
            for part in cgutils.unpack_tuple(builder, args[3], 2)
        )

        def pointer(array: Any, at: Any) -> Any:
            return builder.bitcast(builder.gep(array, [at]), vector.as_pointer())

        def between(low: Any, high: Any, part: Any) -> Any:
            change = builder.fmul(part, builder.fsub(high, low, flags=flags), flags=flags)
            return builder.fadd(low, change, flags=flags)

        def along(at: Any) -> Any:
            after = builder.add(at, ir.Constant(at.type, LANES))
            return between(builder.load(pointer(data, at), align=4), builder.load(pointer(data, after), align=4), right)

        value = between(along(node), along(builder.add(node, below)), down)
        builder.store(value, pointer(result, row), align=4)
        return context.get_dummy_value()

    if nodes.layout != "C" or columns.layout != "C":
        raise errors.TypingError("nodes and columns must be contiguous")
    return types.void(nodes, types.uint64, types.uint64, fractions, columns, types.uint64), codegen
