"""Hermite's cubic in vectors: all values of a table between its nodes, in some forty instructions.

The eight values of a node fill one cache line: U, W, V, Y and their derivatives by range times the step. Between two
nodes of a line the cubic of all four is one cubic of vectors; between two lines, U and W and their derivatives are one
vector again, and V and Y with theirs are its derivative by depth. Compilers do not vectorise that by themselves, so it
is written out in the portable vector language of LLVM.
"""

from typing import Any

from insonify.jit import deferred, intrinsic

ir = deferred("llvmlite.ir")
types = deferred("numba.core.types")
cgutils = deferred("numba.core.cgutils")
errors = deferred("numba.core.errors")


LANES = 4  # double-precision numbers in a vector
_ROW = ir.VectorType(ir.DoubleType(), LANES)
_INDEX = ir.IntType(32)
_FUSED = ("contract",)  # a multiplication and an addition may round once


def _constant(number: float) -> Any:
    return ir.Constant(_ROW, [number] * LANES)


def _pick(builder: Any, first: Any, second: Any, lanes: list[int]) -> Any:
    return builder.shuffle_vector(first, second, ir.Constant(ir.VectorType(_INDEX, len(lanes)), lanes))


def _splat(builder: Any, scalar: Any) -> Any:
    nothing = ir.Constant(_ROW, ir.Undefined)
    vector = builder.insert_element(nothing, scalar, ir.Constant(_INDEX, 0))
    return _pick(builder, vector, nothing, [0] * LANES)


def _load(builder: Any, nodes: Any, node_offset: Any, row: int) -> Any:
    start = builder.gep(nodes, [builder.add(node_offset, ir.Constant(node_offset.type, row * LANES))])
    return builder.load(builder.bitcast(start, _ROW.as_pointer()), align=8)


def _cubic(builder: Any, start_value: Any, start_slope: Any, end_value: Any, end_slope: Any, u: Any) -> tuple[Any, Any]:
    """Value and derivative of the cubic with these ends and slopes at u, 0 to 1."""

    def plus(a: Any, b: Any) -> Any:
        return builder.fadd(a, b, flags=_FUSED)

    def minus(a: Any, b: Any) -> Any:
        return builder.fsub(a, b, flags=_FUSED)

    def times(a: Any, b: Any) -> Any:
        return builder.fmul(a, b, flags=_FUSED)

    rise = minus(end_value, start_value)
    third = minus(plus(start_slope, end_slope), plus(rise, rise))
    second = minus(minus(rise, start_slope), third)
    value = plus(times(plus(times(plus(times(third, u), second), u), start_slope), u), start_value)
    slope = plus(times(plus(times(times(third, _constant(3.0)), u), plus(second, second)), u), start_slope)
    return value, slope


def _on_line(builder: Any, nodes: Any, node_offset: Any, u: Any) -> tuple[Any, Any]:
    """U, W, V, Y and their derivatives with u between a node and the next."""
    following = builder.add(node_offset, ir.Constant(node_offset.type, 2 * LANES))
    start_value, start_slope = (_load(builder, nodes, node_offset, row) for row in range(2))
    end_value, end_slope = (_load(builder, nodes, following, row) for row in range(2))
    return _cubic(builder, start_value, start_slope, end_value, end_slope, u)


def _numbers(builder: Any, picks: list[tuple[Any, int]]) -> list[Any]:
    return [builder.extract_element(vector, ir.Constant(_INDEX, lane)) for vector, lane in picks]


def _data(context: Any, builder: Any, array_type: Any, array: Any) -> Any:
    return cgutils.create_struct_proxy(array_type)(context, builder, value=array).data


def _require_flat(nodes: Any) -> None:
    if not isinstance(nodes, types.Array) or nodes.layout != "C" or nodes.ndim != 1 or nodes.dtype != types.float64:
        raise errors.TypingError(f"the nodes are {nodes}; they must be one contiguous list of float64")


@intrinsic
def interpolate_on_line(typing_context: Any, nodes: Any, node_offset: Any, u: Any) -> Any:
    """(U, dU/du, V, W, dW/du, Y) at a fraction u of the distance from one node to the next.

    Args:
        typing_context: Typing context of the compiler.
        nodes: Values of all nodes one after another, float64.
        node_offset: Index of the first value of the first node.
        u: Fraction of the distance between the nodes, 0 to 1.
    """
    _require_flat(nodes)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = _data(context, builder, signature.args[0], arguments[0])
        value, slope = _on_line(builder, data, arguments[1], _splat(builder, arguments[2]))
        picks = [(value, 0), (slope, 0), (value, 2), (value, 1), (slope, 1), (value, 3)]
        return context.make_tuple(builder, signature.return_type, _numbers(builder, picks))

    return types.UniTuple(types.float64, 6)(nodes, types.intp, types.float64), generate


@intrinsic
def interpolate_in_cell(typing_context: Any, nodes: Any, upper: Any, lower: Any, u: Any, v: Any, height: Any) -> Any:
    """(U, dU/du, dU/dv, W, dW/du, dW/dv) inside one cell.

    Args:
        typing_context: Typing context of the compiler.
        nodes: Values of all nodes one after another, float64.
        upper: Index of the first value of the node at the cell's upper near corner.
        lower: Index of the first value of the node below it.
        u: Fraction of the horizontal distance to the next nodes, 0 to 1.
        v: Fraction of the cell's height, 0 to 1.
        height: Height of the cell [m].
    """
    _require_flat(nodes)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = _data(context, builder, signature.args[0], arguments[0])
        u, v, height = (_splat(builder, scalar) for scalar in arguments[3:])
        cubic_ends: list[Any] = []
        for node in arguments[1:3]:
            value, slope = _on_line(builder, data, node, u)
            cubic_ends.append(_pick(builder, value, slope, [0, 1, 4, 5]))
            down = _pick(builder, value, slope, [2, 3, 6, 7])
            cubic_ends.append(builder.fmul(down, height, flags=_FUSED))
        upper, upper_slope, lower, lower_slope = cubic_ends
        value, slope = _cubic(builder, upper, upper_slope, lower, lower_slope, v)
        picks = [(value, 0), (value, 2), (slope, 0), (value, 1), (value, 3), (slope, 1)]
        return context.make_tuple(builder, signature.return_type, _numbers(builder, picks))

    return types.UniTuple(types.float64, 6)(nodes, *[types.intp] * 2, *[types.float64] * 3), generate
