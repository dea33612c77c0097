"""Compile functions with numba on first use, not on import.

Importing numba and making its first call ready takes half a second, and each of some 440 decorated functions a little.
A scenario that is only checked, or a recording that is only drawn, calls none of them. So kernels are decorated with
the `njit` of this module: what stands at the module's top level is a `Kernel`, and numba is imported when one is called
for the first time. The machine code, and its cache on disk, are those of plain numba, without the wrappers that are not
called: for C, and, where only other kernels call a kernel, for Python.
"""

import contextlib
import functools
import gc
import os
import sys
import threading
from collections.abc import Callable
from importlib import import_module
from types import FunctionType
from typing import Any

_LOCK = threading.RLock()
_WAITING: list[Callable[[], None]] = []
"""Functions to call once numba has been imported."""


class Kernel:
    """A function that numba compiles when it is first called."""

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]) -> None:
        """Keep a function and the options of its compilation.

        Args:
            function: The function in Python.
            options: Keyword arguments of `numba.njit`.
        """
        functools.update_wrapper(self, function)
        self.py_func, self.targetoptions = function, options
        self._made: Any = None
        self._stand_in: Callable[..., Any] | None = None

    def stand_in(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Register the same function in NumPy, which is called as long as numba has not been imported.

        Args:
            function: Function of the same arguments; to the bit where its results are kept for a simulation.
        """
        self._stand_in = function
        return function

    @property
    def dispatcher(self) -> Any:
        """Dispatcher of numba for calls from Python, made when it is first needed."""
        if self._made is None:
            with _LOCK:
                if self._made is None:
                    self._made = self._dispatcher(self.py_func, no_cfunc_wrapper=True)
        return self._made

    @functools.cached_property
    def linked(self) -> Any:
        """Dispatcher of numba for calls from other kernels, which copy the instructions of this one into their own.

        It compiles no wrappers, which unpack the arguments of a call from Python or C. What has been compiled for calls
        from Python serves as well.
        """
        function = _copied(self.py_func)
        function.__qualname__ += "-linked"  # a name of its own in the cache on disk
        linked = self._dispatcher(function, no_cfunc_wrapper=True, no_cpython_wrapper=True)
        compile_anew = linked.compile

        def compile_once(types: Any) -> Any:
            called = self._made.overloads if self._made is not None else {}
            if tuple(types) in called and tuple(types) not in linked.overloads:
                linked.add_overload(called[tuple(types)])
            return compile_anew(types)

        linked.compile = compile_once
        return linked

    def _dispatcher(self, function: Callable[..., Any], **flags: bool) -> Any:
        """Dispatcher of numba for a function, with flags for the last stage of the compiler."""
        dispatcher = load_numba().njit(**self.targetoptions, pipeline_class=_compiler(**flags))(function)
        _save_under_lock(dispatcher._cache)
        return dispatcher

    @property
    def _numba_type_(self) -> Any:
        """Numba type of this kernel, for calls from other kernels."""
        return self.linked._numba_type_

    def __call__(self, *arguments: Any) -> Any:
        """Run the compiled function, or its stand-in."""
        if self._made is None and self._stand_in is not None and "numba" not in sys.modules:
            return self._stand_in(*arguments)
        return (self._made or self.dispatcher)(*arguments)

    def __getattr__(self, name: str) -> Any:
        """Return an attribute of numba's dispatcher, such as `signatures`."""
        if name.startswith("__") or name == "_made":
            raise AttributeError(name)
        return getattr(self.dispatcher, name)


class Intrinsic:
    """A function that writes instructions of the compiler, for kernels to call."""

    def __init__(self, definition: Callable[..., Any]) -> None:
        """Keep the definition.

        Args:
            definition: Function of a typing context and types, as of `numba.extending.intrinsic`.
        """
        functools.update_wrapper(self, definition)
        self.definition = definition

    @functools.cached_property
    def _numba_type_(self) -> Any:
        """Numba type of this function, for calls from kernels."""
        from numba.core import types
        from numba.core.typing.templates import make_intrinsic_template

        return types.Function(make_intrinsic_template(self, self.definition, self.definition.__name__))

    def __call__(self, *arguments: Any) -> Any:
        """Refuse a call from Python: only the compiler can write the instructions, into the kernel that calls it."""
        raise TypeError(f"{self.definition.__name__} can be called by compiled kernels only")


def njit(*, reference_counts: bool = True, **options: Any) -> Any:
    """Compile a function when it is first called.

    Args:
        reference_counts: False: do not count references to the arrays of arguments. Their caller keeps them, so a
            function that other kernels call does not need the counts; each array in a tuple of arguments costs two
            atomic instructions, 10 ns. Such a function allocates nothing, and calls nothing without this option that
            returns an array.
        options: Keyword arguments of `numba.njit`.

    Returns:
        A decorator.
    """
    return lambda function: Kernel(function, options | {"_nrt": reference_counts})


def intrinsic(definition: Callable[..., Any]) -> Any:
    """Turn a definition into an intrinsic, as `numba.extending.intrinsic` does, without importing numba.

    Args:
        definition: Function of a typing context and types that returns a signature and a code generator.
    """
    return Intrinsic(definition)


def _copied(function: Callable[..., Any]) -> Callable[..., Any]:
    """The same function as another object."""
    assert isinstance(function, FunctionType)
    parts = (function.__code__, function.__globals__, function.__name__, function.__defaults__, function.__closure__)
    return functools.update_wrapper(FunctionType(*parts), function)


def _save_under_lock(cache: Any) -> None:
    """Let one process at a time save machine code in a folder.

    Numba numbers the files of a kernel's signatures by an index that it reads before: two processes that save two
    signatures at once may take one number for both, and the index of one lead to the machine code of the other.
    """
    if cache.cache_path is None:  # a kernel that is not saved
        return
    save = cache.save_overload

    def save_under_lock(signature: Any, result: Any) -> None:
        with contextlib.ExitStack() as stack:
            with contextlib.suppress(ImportError, OSError):  # a system without such locks, or a folder without
                import fcntl

                os.makedirs(cache.cache_path, exist_ok=True)
                file = stack.enter_context(open(os.path.join(cache.cache_path, "kernels.lock"), "w"))
                fcntl.flock(file, fcntl.LOCK_EX)
            save(signature, result)

    cache.save_overload = save_under_lock


@functools.cache
def _compiler(**flags: bool) -> Any:
    """Numba's compiler with flags that apply to writing instructions.

    As options of a kernel they would apply to its analysis, too, and with each set of options numba compiles its own
    functions, such as `np.empty`, once more.
    """
    from numba.core.compiler import CompilerBase, DefaultPassBuilder
    from numba.core.compiler_machinery import AnalysisPass, register_pass
    from numba.core.typed_passes import AnnotateTypes

    @register_pass(mutates_CFG=False, analysis_only=True)
    class SetFlags(AnalysisPass):  # type: ignore[misc]
        _name = "_".join(flags)

        def __init__(self) -> None:  # numba demands one
            super().__init__()

        def run_pass(self, state: Any) -> bool:
            for name, value in flags.items():
                setattr(state.flags, name, value)
            return False

    class Compiler(CompilerBase):  # type: ignore[misc]
        def define_pipelines(self) -> list[Any]:
            passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
            passes.add_pass_after(SetFlags, AnnotateTypes)
            passes.finalize()
            return [passes]

    return Compiler


def load_numba() -> Any:
    """Import numba, and call what waits for that."""
    import numba

    with _LOCK:
        while _WAITING:
            _WAITING.pop()()
    return numba


def _collect_no_garbage_while_compiling() -> None:
    """Pause garbage collection while numba compiles: it takes a twentieth of that time, and finds nothing to free."""
    from numba.core import event

    was_enabled: list[bool] = []

    class Pause(event.Listener):  # type: ignore[misc]
        def on_start(self, _: Any) -> None:
            was_enabled.append(gc.isenabled())
            gc.disable()

        def on_end(self, _: Any) -> None:
            if was_enabled.pop():
                gc.enable()

    event.register("numba:compile", Pause())


def when_loaded(function: Callable[[], None]) -> None:
    """Call a function as soon as numba has been imported: at once, or before the first kernel is compiled.

    Args:
        function: Function without arguments.
    """
    if "numba" in sys.modules:
        function()
    else:
        _WAITING.append(function)


class _Deferred:
    """A module that is imported when a name of it is first used."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, name: str) -> Any:
        return getattr(import_module(self._name), name)


def deferred(name: str) -> Any:
    """A module of the compiler, imported when something of it is first used.

    Args:
        name: Its full name.
    """
    return _Deferred(name)


def _keep_helpers_apart() -> None:
    """Keep functions that numba compiles for kernels with reordered arithmetic (`fastmath`) out of other kernels.

    Numba compiles complex multiplication and the like once in a process, with the options of the first kernel that
    needs it. The machine code of a kernel, and the last bits of its results, would depend on which were compiled before
    it in the same process.
    """
    from numba.core.cpu import CPUContext
    from numba.core.registry import cpu_target

    cpu_target.target_context.cached_internal_func.clear()  # of kernels of other packages
    derive, helpers = CPUContext.subtarget, dict[str, dict[Any, Any]]()

    def subtarget(context: Any, **options: Any) -> Any:
        derived = derive(context, **options)
        if options.get("fastmath"):
            derived.cached_internal_func = helpers.setdefault(repr(sorted(options["fastmath"].flags)), {})
        return derived

    CPUContext.subtarget = subtarget


when_loaded(_collect_no_garbage_while_compiling)
when_loaded(_keep_helpers_apart)
