"""Prefetch of memory that will be read soon, by LLVM's portable intrinsic: compilers do not insert it."""

from typing import Any

from insonify.jit import deferred, intrinsic

ir = deferred("llvmlite.ir")
types = deferred("numba.core.types")
cgutils = deferred("numba.core.cgutils")


_BYTES, _FLAG = ir.IntType(8).as_pointer(), ir.IntType(32)
_READ, _SOON, _DATA = (ir.Constant(_FLAG, n) for n in (0, 3, 1))


@intrinsic
def prefetch(typing_context: Any, array: Any, at: Any) -> Any:
    """Start loading one element of a contiguous array into the processor's cache.

    Args:
        typing_context: Typing context of the compiler.
        array: Array that will be read.
        at: Index of the element.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = cgutils.create_struct_proxy(signature.args[0])(context, builder, value=arguments[0]).data
        position = builder.bitcast(builder.gep(data, [arguments[1]]), _BYTES)
        kind = ir.FunctionType(ir.VoidType(), [_BYTES, _FLAG, _FLAG, _FLAG])
        call = builder.module.declare_intrinsic("llvm.prefetch", [_BYTES], kind)
        builder.call(call, [position, _READ, _SOON, _DATA])
        return context.get_dummy_value()

    return types.void(array, types.uint64), generate
