"""Weighted sum of four complex cells in a few vector instructions.

Compilers do not vectorise this sum: real and imaginary parts alternate along the cells. So the instructions
are written out in the compiler's portable vector language, which maps them to those of the processor.
"""

from typing import Any

from insonify.jit import deferred, intrinsic

ir = deferred("llvmlite.ir")
types = deferred("numba.core.types")
cgutils = deferred("numba.core.cgutils")
errors = deferred("numba.core.errors")


_SINGLE, _INDEX = ir.FloatType(), ir.IntType(32)


def _load(builder: Any, array: Any, at: Any, lanes: int) -> Any:
    pointer = builder.bitcast(builder.gep(array.data, [at]), ir.VectorType(_SINGLE, lanes).as_pointer())
    return builder.load(pointer, align=4)


def _pick(builder: Any, source: Any, lanes: list[int]) -> Any:
    mask = ir.Constant(ir.VectorType(_INDEX, len(lanes)), lanes)
    return builder.shuffle_vector(source, ir.Constant(source.type, ir.Undefined), mask)


@intrinsic
def four_tap_sum(typingctx: Any, cells: Any, at: Any, weights: Any, first: Any) -> Any:
    """Real and imaginary part of the sum of four cells, cells[at], cells[at + 1] and so on, times their weights.

    cells: float32, real and imaginary parts alternating; weights: float32, from `first` on, one per cell.
    """

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        arrays = [cgutils.create_struct_proxy(signature.args[k])(context, builder, args[k]) for k in (0, 2)]
        values = _load(builder, arrays[0], args[1], 8)
        both = _pick(builder, _load(builder, arrays[1], args[3], 4), [0, 0, 1, 1, 2, 2, 3, 3])
        product = builder.fmul(values, both, flags=("contract",))
        for half in (4, 2):
            low, high = _pick(builder, product, list(range(half))), _pick(builder, product, list(range(half, 2 * half)))
            product = builder.fadd(low, high, flags=("contract",))
        components = [builder.extract_element(product, ir.Constant(_INDEX, k)) for k in (0, 1)]
        return context.make_tuple(builder, signature.return_type, components)

    if cells.layout != "C" or weights.layout != "C":
        raise errors.TypingError("cells and weights must lie side by side in memory")
    return types.UniTuple(types.float32, 2)(cells, types.intp, weights, types.intp), codegen
