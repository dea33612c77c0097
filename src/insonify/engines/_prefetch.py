"""Prefetch of memory that will be read soon, by LLVM's portable intrinsic: compilers do not insert it."""

from typing import Any

from insonify.jit import deferred, intrinsic

ir = deferred("llvmlite.ir")
types = deferred("numba.core.types")
cgutils = deferred("numba.core.cgutils")


@intrinsic
def prefetch(typing_context: Any, array: Any, at: Any) -> Any:
    """Start loading one element of a contiguous array into the processor's cache.

    Args:
        typing_context: Typing context of the compiler.
        array: Array that will be read.
        at: Index of the element.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        address, flag = ir.IntType(8).as_pointer(), ir.IntType(32)
        read, soon, of_data = (ir.Constant(flag, n) for n in (0, 3, 1))
        data = cgutils.create_struct_proxy(signature.args[0])(context, builder, value=arguments[0]).data
        position = builder.bitcast(builder.gep(data, [arguments[1]]), address)
        kind = ir.FunctionType(ir.VoidType(), [address, flag, flag, flag])
        call = builder.module.declare_intrinsic("llvm.prefetch", [address], kind)
        builder.call(call, [position, read, soon, of_data])
        return context.get_dummy_value()

    return types.void(array, types.uint64), generate
