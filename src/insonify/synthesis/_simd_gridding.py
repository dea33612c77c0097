"""All cells of one spike in a few vector instructions.

Compilers do not vectorise this loop: the kernel's polynomials have a lane per cell, and the complex weight
alternates along the cells. So the instructions are written out here, in the compiler's portable vector
language, which maps them to those of the processor.
"""

from typing import Any

from insonify.jit import deferred, intrinsic
from insonify.synthesis._gridding_kernel import CELLS_PER_SPIKE, DEGREE, WIDTH, tap_coefficients

ir = deferred("llvmlite.ir")
types = deferred("numba.core.types")
cgutils = deferred("numba.core.cgutils")
errors = deferred("numba.core.errors")

# Constants of the compiled kernels, which are cached on disk by the date of _gridding.py alone: after a change here or
# in _gridding_kernel.py or fast_sincos.py, touch that file. (The accuracy tests fail on a stale cache.)
_TAPS = tap_coefficients()


def _vector(scalar: Any, lanes: int) -> Any:
    """Type of a vector of numbers of a scalar type."""
    return ir.VectorType(scalar, lanes)


def _load(builder: Any, pointer: Any, vector: Any, align: int) -> Any:
    """Load a vector of type `vector` from a pointer aligned to `align` bytes."""
    return builder.load(builder.bitcast(pointer, vector.as_pointer()), align=align)


def _add_to(builder: Any, pointer: Any, vector: Any, addend: Any, align: int) -> None:
    """Add a vector to that at a pointer."""
    target = builder.bitcast(pointer, vector.as_pointer())
    builder.store(builder.fadd(builder.load(target, align=align), addend, flags=("contract",)), target, align=align)


def _pick(builder: Any, source: Any, lanes: list[int]) -> Any:
    """Vector of the given lanes of a source vector, in their order."""
    mask = ir.Constant(_vector(ir.IntType(32), len(lanes)), lanes)
    return builder.shuffle_vector(source, ir.Constant(source.type, ir.Undefined), mask)


def _splat(builder: Any, scalar: Any, lanes: int) -> Any:
    """Vector with one scalar in all lanes."""
    vector = builder.insert_element(
        ir.Constant(_vector(scalar.type, lanes), ir.Undefined), scalar, ir.Constant(ir.IntType(32), 0)
    )
    return _pick(builder, vector, [0] * lanes)


def _kernel_cells(builder: Any, fraction: Any) -> Any:
    """Gridding kernel at all its cells, by Horner's rule on a vector with one lane per cell."""
    vector = _vector(fraction.type, CELLS_PER_SPIKE)
    y = _splat(builder, fraction, CELLS_PER_SPIKE)
    rows = [ir.Constant(vector, [float(c) for c in row]) for row in _TAPS]
    value = rows[DEGREE]
    for row in reversed(rows[:DEGREE]):
        value = builder.fadd(builder.fmul(value, y, flags=("contract",)), row, flags=("contract",))
    return value


def _require_contiguous(cells: Any) -> None:
    """Raise an error of typing unless an array type is C-contiguous."""
    if cells.layout != "C":
        raise errors.TypingError("cells must lie side by side in memory; pass one channel's row, not a column")


def _weight_at(builder: Any, data: Any, i: Any) -> Any:
    """Complex weight of spike i, real and imaginary part, repeated four times to a vector of 8."""
    pair = _load(builder, builder.gep(data, [builder.mul(i, ir.Constant(i.type, 2))]), _vector(ir.FloatType(), 2), 4)
    return _pick(builder, pair, [0, 1] * 4)


def _add_kernel(builder: Any, first: Any, kernel: Any, weights: Any, lanes: int) -> None:
    """Add the kernel times the weights of `lanes` waveforms to their interleaved cells, from the first on."""
    for begin in range(0, WIDTH, 4 // lanes):
        height = _pick(builder, kernel, [begin + k // (2 * lanes) for k in range(8)])
        pointer = builder.gep(first, [ir.Constant(ir.IntType(64), 2 * lanes * begin)])
        _add_to(builder, pointer, height.type, builder.fmul(height, weights, flags=("contract",)), 4)


@intrinsic
def add_complex_spike(typingctx: Any, cells: Any, first_cell: Any, fraction: Any, weights: Any, i: Any) -> Any:
    """cells[2 first_cell ...] += kernel(fraction) * weights[2 i, 2 i + 1]; float32, complex as two numbers."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        cells, first_cell, fraction, weights, i = args
        data = cgutils.create_struct_proxy(signature.args[0])(context, builder, cells).data
        weight_data = cgutils.create_struct_proxy(signature.args[3])(context, builder, weights).data
        weight = _weight_at(builder, weight_data, i)
        first = builder.gep(data, [builder.mul(first_cell, ir.Constant(first_cell.type, 2))])
        _add_kernel(builder, first, _kernel_cells(builder, fraction), weight, 1)
        return context.get_dummy_value()

    _require_contiguous(cells)
    return types.void(cells, types.intp, types.float32, weights, types.intp), codegen


def _shared_weight(builder: Any, lanes: int, data: tuple[Any, Any], x: Any, i: Any) -> Any:
    """Weights of spike i for `lanes` waveforms, real and imaginary parts alternating, repeated to 8 numbers.

    `data` are pointers to the weights of spikes, and to the coefficients of the basis weights.
    """
    weight_data, curve_data = data
    weight = _weight_at(builder, weight_data, i)
    if lanes == 1:
        return weight
    vector, coordinate = _vector(ir.FloatType(), 8), _splat(builder, x, 8)
    rows = [_load(builder, builder.gep(curve_data, [ir.Constant(i.type, 8 * row)]), vector, 4) for row in range(lanes)]
    basis_weight = rows[-1]
    for row in reversed(rows[:-1]):
        basis_weight = builder.fadd(
            builder.fmul(basis_weight, coordinate, flags=("contract",)), row, flags=("contract",)
        )
    return builder.fmul(basis_weight, weight)


def _curved_spike(lanes: int) -> Any:
    """Intrinsic that adds spikes to 2 or 4 waveforms, whose weights are polynomials of the basis coordinate."""

    @intrinsic
    def add(
        typingctx: Any, cells: Any, first_cell: Any, fraction: Any, weights: Any, x: Any, curve: Any, i: Any
    ) -> Any:  # fmt: skip
        """cells[2 lanes (first_cell + j) + 2 s ...] += kernel(fraction)[j] share[s] weights[2 i ...].

        For cell j and waveform s, with share[s] = curve[0, 2 s] + x curve[1, 2 s] + ..., each twice; float32.
        """

        def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            first_cell, fraction, x, i = args[1], args[2], args[4], args[6]
            data, weight_data, curve_data = (
                cgutils.create_struct_proxy(signature.args[k])(context, builder, args[k]).data for k in (0, 3, 5)
            )
            weight = _shared_weight(builder, lanes, (weight_data, curve_data), x, i)
            first = builder.gep(data, [builder.mul(first_cell, ir.Constant(first_cell.type, 2 * lanes))])
            _add_kernel(builder, first, _kernel_cells(builder, fraction), weight, lanes)
            return context.get_dummy_value()

        _require_contiguous(cells)
        index_type, single = types.intp, types.float32
        return types.void(cells, index_type, single, weights, single, curve, index_type), codegen

    return add


add_spike_of_2 = _curved_spike(2)
add_spike_of_4 = _curved_spike(4)


def moment_vectors(lanes: int) -> int:
    """Number of vectors of 8 numbers that hold the moments of one cell of `lanes` waveforms."""
    return -(-(DEGREE + 1) * lanes // 4)


def _gathered_spike(lanes: int) -> Any:
    """Intrinsic that adds one spike to the moments of its cell, for 1, 2 or 4 waveforms (`lanes`).

    A moment is a sum of the spikes' weights times a power of their position in the cell.
    """

    @intrinsic
    def add(typingctx: Any, moments: Any, cell: Any, fraction: Any, weights: Any, x: Any, curve: Any, i: Any) -> Any:
        """moments[8 vectors cell + 2 lanes p + 2 s ...] += fraction^p share[s] weights[2 i ...] (power p)."""

        def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            cell, fraction, x, i = args[1], args[2], args[4], args[6]
            data, weight_data, curve_data = (
                cgutils.create_struct_proxy(signature.args[k])(context, builder, args[k]).data for k in (0, 3, 5)
            )
            part = _shared_weight(builder, lanes, (weight_data, curve_data), x, i)
            powers = [ir.Constant(fraction.type, 1.0)]
            for _ in range(4 // lanes):
                powers.append(builder.fmul(powers[-1], fraction))
            step = _splat(builder, powers.pop(), 8)
            if lanes < 4:
                first = ir.Constant(part.type, ir.Undefined)
                for k in range(8):
                    first = builder.insert_element(first, powers[k // (2 * lanes)], ir.Constant(ir.IntType(32), k))
                part = builder.fmul(part, first)
            count = moment_vectors(lanes)
            begin = builder.gep(data, [builder.mul(cell, ir.Constant(cell.type, 8 * count))])
            for row in range(count):
                _add_to(builder, builder.gep(begin, [ir.Constant(cell.type, 8 * row)]), part.type, part, 4)
                part = builder.fmul(part, step)
            return context.get_dummy_value()

        _require_contiguous(moments)
        index_type, single = types.intp, types.float32
        return types.void(moments, index_type, single, weights, single, curve, index_type), codegen

    return add


gather_spike_of_1 = _gathered_spike(1)
gather_spike_of_2 = _gathered_spike(2)
gather_spike_of_4 = _gathered_spike(4)


def _spike_totals(builder: Any, moment: list[Any], per: int) -> list[Any]:
    """Sums of moments times the polynomials of the kernel's cells, `per` cells to a vector of 8 numbers."""

    def part(begin: int, powers: Any) -> Any:
        total = None
        for p in powers:
            taps = ir.Constant(moment[p].type, [float(_TAPS[p, begin + k * per // 8]) for k in range(8)])
            product = builder.fmul(moment[p], taps, flags=("contract",))
            total = product if total is None else builder.fadd(total, product, flags=("contract",))
        return total

    if per > 1:
        return [part(j, range(DEGREE + 1)) for j in range(0, WIDTH, per)]
    # the kernel is even: cells as far before as after the middle one have the same even and opposite odd terms
    even = [part(j, range(0, DEGREE + 1, 2)) for j in range(WIDTH // 2 + 1)]
    odd = [part(j, range(1, DEGREE + 1, 2)) for j in range(WIDTH // 2)]
    before = [builder.fadd(a, b) for a, b in zip(even, odd, strict=False)]
    after = [builder.fsub(a, b) for a, b in zip(even, odd, strict=False)]
    return [*before, even[-1], *reversed(after)]


def _gathered_cell(lanes: int) -> Any:
    """Intrinsic that deposits the spikes of one cell from their moments, for 1, 2 or 4 waveforms (`lanes`)."""

    @intrinsic
    def add(typingctx: Any, cells: Any, at: Any, moments: Any, cell: Any) -> Any:
        """Add to the cells from `at` on the sum of all spikes in the moments, and clear the moments."""

        def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            at, cell = args[1], args[3]
            data, moment_data = (
                cgutils.create_struct_proxy(signature.args[k])(context, builder, args[k]).data for k in (0, 2)
            )
            vector, count = _vector(ir.FloatType(), 8), moment_vectors(lanes)
            begin = builder.gep(moment_data, [builder.mul(cell, ir.Constant(cell.type, 8 * count))])
            pointers = [builder.gep(begin, [ir.Constant(cell.type, 8 * row)]) for row in range(count)]
            rows = [_load(builder, pointer, vector, 4) for pointer in pointers]
            bits = ir.IntType(256)
            nonzero = builder.bitcast(rows[0], bits)
            for row in rows[1:]:
                nonzero = builder.or_(nonzero, builder.bitcast(row, bits))
            with builder.if_then(builder.icmp_unsigned("!=", nonzero, ir.Constant(bits, 0))):
                per, width = 4 // lanes, 2 * lanes
                moment = [
                    _pick(builder, rows[p // per], [width * (p % per) + k % width for k in range(8)])
                    for p in range(DEGREE + 1)
                ]
                first = builder.gep(data, [builder.mul(at, ir.Constant(at.type, width))])
                for j, total in enumerate(_spike_totals(builder, moment, per)):
                    _add_to(builder, builder.gep(first, [ir.Constant(at.type, 8 * j)]), vector, total, 4)
                for pointer in pointers:
                    empty = ir.Constant(vector, [0.0] * 8)
                    builder.store(empty, builder.bitcast(pointer, vector.as_pointer()), align=4)
            return context.get_dummy_value()

        _require_contiguous(cells)
        _require_contiguous(moments)
        return types.void(cells, types.intp, moments, types.intp), codegen

    return add


deposit_cell_of_1 = _gathered_cell(1)
deposit_cell_of_2 = _gathered_cell(2)
deposit_cell_of_4 = _gathered_cell(4)


@intrinsic
def add_shaped_spike(
    typingctx: Any, cells: Any, group_stride: Any, first_cell: Any, fraction: Any, weights: Any, shares: Any,
    stride: Any, groups: Any, i: Any,
) -> Any:  # fmt: skip
    """Spike for groups of 4 waveforms, `group_stride` apart; waveform s has shares[s stride + i] of the weight."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        group_stride, first_cell, fraction = args[1:4]
        stride, groups, i = args[6:]
        data, weight_data, share_data = (
            cgutils.create_struct_proxy(signature.args[k])(context, builder, args[k]).data for k in (0, 4, 5)
        )
        kernel, weight = _kernel_cells(builder, fraction), _weight_at(builder, weight_data, i)
        first = builder.gep(data, [builder.mul(first_cell, ir.Constant(first_cell.type, 8))])
        with cgutils.for_range(builder, groups) as loop:
            share = ir.Constant(weight.type, ir.Undefined)
            for k in range(4):
                row = builder.add(builder.mul(loop.index, ir.Constant(i.type, 4)), ir.Constant(i.type, k))
                loaded = builder.load(builder.gep(share_data, [builder.add(builder.mul(row, stride), i)]))
                for lane in (2 * k, 2 * k + 1):
                    share = builder.insert_element(share, loaded, ir.Constant(ir.IntType(32), lane))
            grid = builder.gep(first, [builder.mul(loop.index, group_stride)])
            _add_kernel(builder, grid, kernel, builder.fmul(share, weight), 4)
        return context.get_dummy_value()

    _require_contiguous(cells)
    index = types.intp
    return types.void(cells, index, index, types.float32, weights, shares, index, index, index), codegen


@intrinsic
def mix_series(
    typingctx: Any, polynomials: Any, series: Any, shape: Any, e: Any, begin: Any, mixed: Any
) -> Any:  # fmt: skip
    """Series of echoes at element e: cycles beyond the third term, spreading ratio, basis coordinate; float32.

    mixed[c, begin + i] = sum over k of polynomials[e, k] * series[c, k, i] for i from `start` to `stop`: of cycles,
    c = 0, from term 3 on, of the other two before term `kept`. Both arrays are padded: up to 15 entries after `stop`
    are read, and overwritten. shape: terms, kept, tile, start, stop, width, and columns: 3, or 2 without coordinates;
    series: (3, terms, tile); mixed: (3, width).
    """

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        e, begin = args[3:5]
        polynomials, series, mixed = (
            cgutils.create_struct_proxy(signature.args[k])(context, builder, args[k]).data for k in (0, 1, 5)
        )
        terms, kept, tile, start, stop, width, columns = cgutils.unpack_tuple(builder, args[2], 7)
        vector, zero, lanes = _vector(ir.FloatType(), 16), ir.Constant(e.type, 0), ir.Constant(e.type, 16)
        row_of_element = builder.gep(polynomials, [builder.mul(e, terms)])
        total = cgutils.alloca_once(builder, vector)
        terms_of_columns = (ir.Constant(e.type, 3), terms), (zero, kept), (zero, kept)

        def mix(column: int, i: Any) -> None:
            low, high = terms_of_columns[column]
            builder.store(ir.Constant(vector, [0.0] * 16), total)
            first_row = builder.mul(ir.Constant(e.type, column), terms)
            with cgutils.for_range(builder, high, low) as loop:
                share = _splat(builder, builder.load(builder.gep(row_of_element, [loop.index])), 16)
                row = builder.add(builder.mul(builder.add(first_row, loop.index), tile), i)
                term = _load(builder, builder.gep(series, [row]), vector, 4)
                term = builder.fmul(term, share, flags=("contract",))
                builder.store(builder.fadd(builder.load(total), term, flags=("contract",)), total)
            at = builder.add(builder.mul(ir.Constant(e.type, column), width), builder.add(begin, i))
            target = builder.bitcast(builder.gep(mixed, [at]), vector.as_pointer())
            builder.store(builder.load(total), target, align=4)

        with cgutils.for_range_slice(builder, start, stop, lanes) as (i, _):
            mix(0, i)
            mix(1, i)
            with builder.if_then(builder.icmp_signed(">", columns, ir.Constant(columns.type, 2))):
                mix(2, i)
        return context.get_dummy_value()

    for rows in (polynomials, series, mixed):
        _require_contiguous(rows)
    return types.void(polynomials, series, shape, types.intp, types.intp, mixed), codegen


@intrinsic
def add_real_spike(typingctx: Any, cells: Any, first_cell: Any, fraction: Any, weight: Any) -> Any:
    """cells[first_cell ...] += kernel(fraction) * weight; float64, cells possibly float32."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        cells, first_cell, fraction, weight = args
        data = cgutils.create_struct_proxy(signature.args[0])(context, builder, cells).data
        kernel = _kernel_cells(builder, fraction)
        addend = builder.fmul(kernel, _splat(builder, weight, CELLS_PER_SPIKE), flags=("contract",))
        if data.type.pointee != kernel.type.element:
            addend = builder.fptrunc(addend, _vector(data.type.pointee, CELLS_PER_SPIKE))
        _add_to(builder, builder.gep(data, [first_cell]), addend.type, addend, 4)
        return context.get_dummy_value()

    _require_contiguous(cells)
    return types.void(cells, types.intp, types.float64, types.float64), codegen
