"""Cubic B-splines of one lattice at consecutive nodes of a map row at once, in SIMD vectors.

The lattice of an octave is rotated relative to the rows of the map, so that each node reads its own 4 x 4 spline
coefficients. Compilers do not vectorise such indexed loads in loops that also store results, so the instructions are
given here as LLVM's portable vector operations.
"""

from typing import Any

from insonify.jit import deferred, intrinsic

ir = deferred("llvmlite.ir")
types = deferred("numba.core.types")
cgutils = deferred("numba.core.cgutils")
errors = deferred("numba.core.errors")


LANES = 16
"""Nodes per vector."""
_SINGLE, _INDEX, _ADDRESS = ir.FloatType(), ir.IntType(32), ir.IntType(64)
_ROW, _CELLS, _ADDRESSES = (ir.VectorType(kind, LANES) for kind in (_SINGLE, _INDEX, _ADDRESS))
_FOUR = ir.VectorType(_SINGLE, 4)
_FUSED = ("contract",)  # permits fused multiply-add


class Arithmetic:
    """Builder of arithmetic instructions on vectors of one type, and on vectors and constants."""

    def __init__(self, builder: Any, kind: Any = _ROW) -> None:
        """Arithmetic with a builder of LLVM and a type of vectors."""
        self.builder, self.kind = builder, kind

    def of(self, number: Any) -> Any:
        """Vector with a constant in every lane."""
        return ir.Constant(self.kind, [number] * self.kind.count) if isinstance(number, float) else number

    def plus(self, a: Any, b: Any) -> Any:
        """Sum."""
        return self.builder.fadd(self.of(a), self.of(b), flags=_FUSED)

    def minus(self, a: Any, b: Any) -> Any:
        """Difference."""
        return self.builder.fsub(self.of(a), self.of(b), flags=_FUSED)

    def times(self, a: Any, b: Any) -> Any:
        """Product."""
        return self.builder.fmul(self.of(a), self.of(b), flags=_FUSED)

    def dot(self, weights: list[Any], values: list[Any]) -> Any:
        """Sum of products."""
        total = self.times(weights[0], values[0])
        for weight, value in zip(weights[1:], values[1:], strict=True):
            total = self.plus(total, self.times(weight, value))
        return total

    def pairs(self, weights: list[Any], values: list[Any]) -> Any:
        """Sum of four products, by twos."""
        first, second, third, fourth = map(self.times, weights, values)
        return self.plus(self.plus(first, second), self.plus(third, fourth))

    def weights(self, f: Any) -> tuple[list[Any], list[Any]]:
        """The four cubic B-splines that reach a cell, at fractions f of it, and their derivatives."""
        minus, times = self.minus, self.times
        r = minus(1.0, f)
        rr, ff = times(r, r), times(f, f)
        values = [
            times(times(1 / 6, rr), r), minus(2 / 3, times(times(0.5, ff), minus(2.0, f))),
            minus(2 / 3, times(times(0.5, rr), minus(2.0, r))), times(times(1 / 6, ff), f),
        ]  # fmt: skip
        slopes = [
            times(-0.5, rr),
            times(f, minus(times(1.5, f), 2.0)),
            times(r, minus(2.0, times(1.5, r))),
            times(0.5, ff),
        ]
        return values, slopes


def _splat(builder: Any, scalar: Any, kind: Any) -> Any:
    """Vector with one scalar in all lanes."""
    nothing = ir.Constant(kind, ir.Undefined)
    one = builder.insert_element(nothing, scalar, ir.Constant(_INDEX, 0))
    return builder.shuffle_vector(one, nothing, ir.Constant(_CELLS, [0] * LANES))


def _pick(builder: Any, first: Any, second: Any, lanes: list[int]) -> Any:
    """Vector of the given lanes of two vectors, those of the second numbered after the first."""
    return builder.shuffle_vector(first, second, ir.Constant(ir.VectorType(_INDEX, len(lanes)), lanes))


def _four_columns(builder: Any, positions: list[Any]) -> list[Any]:
    """The number at each of some positions, the one after it, the next and the last of four, each as a vector."""
    fours = [builder.load(builder.inttoptr(position, _FOUR.as_pointer()), align=4) for position in positions]
    # A square of four by four numbers is turned over in each quarter of the vectors.
    rows = [_side_by_side(builder, fours[k::4]) for k in range(4)]

    def zipped(first: Any, second: Any, lanes: list[int]) -> Any:
        order = [4 * part + lane % 4 + lane // 4 * LANES for part in range(LANES // 4) for lane in lanes]
        return _pick(builder, first, second, order)

    low, high, left, right = [0, 4, 1, 5], [2, 6, 3, 7], [0, 1, 4, 5], [2, 3, 6, 7]
    halves = [(zipped(rows[0], rows[1], order), zipped(rows[2], rows[3], order)) for order in (low, high)]
    return [zipped(*half, order) for half in halves for order in (left, right)]


def _side_by_side(builder: Any, parts: list[Any]) -> Any:
    """Short vectors joined into one."""
    while len(parts) > 1:
        lanes = list(range(2 * parts[0].type.count))
        parts = [_pick(builder, parts[k], parts[k + 1], lanes) for k in range(0, len(parts), 2)]
    return parts[0]


def _cell(builder: Any, position: Any) -> tuple[Any, Any]:
    """Cell number and fractional position in the cell of positions above 0."""
    cell = builder.fptosi(position, _CELLS)
    return cell, builder.fsub(position, builder.sitofp(cell, _ROW))


def _spline(builder: Any, data: Any, stride: Any, a: Any, b: Any) -> tuple[Any, Any, Any]:
    """Value and both slopes per pitch at positions a, b in a window of nodes."""
    row, f = _cell(builder, a)
    column, g = _cell(builder, b)
    index = builder.add(builder.mul(row, _splat(builder, builder.trunc(stride, _INDEX), _CELLS)), column)
    four = ir.Constant(_ADDRESSES, [4] * LANES)
    addresses = builder.add(
        _splat(builder, builder.ptrtoint(data, _ADDRESS), _ADDRESSES),
        builder.mul(builder.sext(index, _ADDRESSES), four),
    )
    positions = [builder.extract_element(addresses, ir.Constant(_INDEX, k)) for k in range(LANES)]
    down = builder.mul(stride, ir.Constant(_ADDRESS, 4))
    arithmetic = Arithmetic(builder)
    across, across_slope = arithmetic.weights(g)
    heights, slopes = [], []
    for _ in range(4):
        nodes = _four_columns(builder, positions)
        heights.append(arithmetic.dot(across, nodes))
        slopes.append(arithmetic.dot(across_slope, nodes))
        positions = [builder.add(position, down) for position in positions]
    along, along_slope = arithmetic.weights(f)
    return arithmetic.dot(along, heights), arithmetic.dot(along_slope, heights), arithmetic.dot(along, slopes)


def _add_to(builder: Any, data: Any, at: Any, addend: Any) -> None:
    """Add a vector to the numbers from index `at` on."""
    position = builder.bitcast(builder.gep(data, [at]), _ROW.as_pointer())
    builder.store(builder.fadd(builder.load(position, align=4), addend, flags=_FUSED), position, align=4)


def _require_flat(*arrays: Any) -> None:
    """Raise an error of typing unless arrays are contiguous, one-dimensional and of float32."""
    for array in arrays:
        if array.layout != "C" or array.ndim != 1 or array.dtype != types.float32:
            raise errors.TypingError(f"{array} must be one contiguous list of float32")


@intrinsic
def add_spline(
    typing_context: Any, window: Any, stride: Any, a: Any, b: Any, per_a: Any, per_b: Any, turned: Any,
    out: Any, at: Any, plane: Any,
) -> Any:  # fmt: skip
    """Add height and slopes of one octave at the next `LANES` nodes of a row.

    Args:
        typing_context: Typing context of numba.
        window: Spline coefficients in a window of the lattice, row by row, float32.
        stride: Length of its rows.
        a: Position of the first node in rows of the window, >= 0: positions n to n + 1 use rows n to n + 3.
        b: Position of the first node in columns.
        per_a: Rows per node.
        per_b: Columns per node.
        turned: Factor of the height, then cosine and sine of the lattice's angle times the factor of the slopes.
        out: Result, added to: heights, then both slopes, float32.
        at: Index of the first node's height in `out`.
        plane: Offset from heights to slopes, and between the two slopes, in `out`.
    """
    _require_flat(window, out)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        window, out = (
            cgutils.create_struct_proxy(signature.args[k])(context, builder, value=arguments[k]).data for k in (0, 7)
        )
        stride, a, b, per_a, per_b = arguments[1:6]
        number = ir.Constant(_ROW, [float(k) for k in range(LANES)])
        arithmetic = Arithmetic(builder)
        positions = [
            arithmetic.plus(_splat(builder, first, _ROW), arithmetic.times(number, _splat(builder, per, _ROW)))
            for first, per in ((a, per_a), (b, per_b))
        ]
        value, along, across = _spline(builder, window, stride, *positions)
        height, c, s = (_splat(builder, builder.extract_value(arguments[6], k), _ROW) for k in range(3))
        results = [
            arithmetic.times(height, value),
            arithmetic.minus(arithmetic.times(c, along), arithmetic.times(s, across)),
            arithmetic.plus(arithmetic.times(s, along), arithmetic.times(c, across)),
        ]
        position = arguments[8]
        for result in results:
            _add_to(builder, out, position, result)
            position = builder.add(position, arguments[9])
        return context.get_dummy_value()

    single = types.float32
    signature = types.void(window, types.int64, *[single] * 4, types.UniTuple(single, 3), out, types.int64, types.int64)
    return signature, generate
