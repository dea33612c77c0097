"""Signatures with which kernels are called from Python, recorded from scenarios of many kinds.

A kernel is compiled for the types of its arguments when it is first called, one kernel after the other: a first run of
a kind of scenario waits for a minute or two. The signatures that each kind needs are recorded in a file of the package
by `benchmarks/record_kernels.py`, so that they can be compiled before, on all cores (`insonify.kernel_compilation`),
and their time be estimated. A kernel or a signature that is not recorded is compiled when it is called.
"""

import json
import sys
from collections.abc import Set
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from insonify.jit import deferred
from insonify.kernel_cache import cache_folder

numpy = deferred("numpy")
types = deferred("numba.core.types")
numpy_support = deferred("numba.np.numpy_support")

PACKAGE = Path(__file__).parent
FILE = PACKAGE / "kernel_signatures.json"
Signature = list[Any]
"""A list of types as of `encoded`, one for each argument."""


class RecordedKernel(NamedTuple):
    """One kernel with one signature."""

    module: str
    """Its module."""
    name: str
    """Its name in the module."""
    signature: Signature
    """Types of its arguments."""
    seconds: float
    """Processor time to compile it [s]."""
    needed_by: list[list[str]]
    """Sets of features: a scenario with all features of one of them calls the kernel."""

    def is_needed(self, features: Set[str]) -> bool:
        """Return True if scenarios with these features call the kernel."""
        return any(features >= set(needed) for needed in self.needed_by)


@cache
def recorded_kernels() -> tuple[RecordedKernel, ...]:
    """All recorded kernels; none where the file cannot be read."""
    try:
        return tuple(RecordedKernel(*row) for row in json.loads(FILE.read_text()))
    except (OSError, ValueError, TypeError):
        return ()


def missing_kernels(features: Set[str]) -> list[RecordedKernel]:
    """Kernels that a scenario needs and that are not in the cache of compiled kernels.

    Args:
        features: Features of the scenario, see `insonify.scenario.features`.
    """
    needed = [kernel for kernel in recorded_kernels() if kernel.is_needed(features)]
    sources = {kernel.module: _source(kernel.module) for kernel in needed}
    folder_of_code, compiled = cache_folder(PACKAGE), set()
    for folder in {source.parent for source in sources.values()}:
        compiled |= {
            (folder, path.name.partition("-")[0]) for path in folder_of_code(folder).glob(f"*{_python_tag()}.nbi")
        }
    return [k for k in needed if (sources[k.module].parent, f"{sources[k.module].stem}.{k.name}") not in compiled]


@cache
def shares_kernels(module: str, other: str) -> bool:
    """Return True if one of two modules imports the other, whose kernels it then calls."""
    return any(f"from {b} import" in _source(a).read_text() for a, b in ((module, other), (other, module)))


def _source(module: str) -> Path:
    """Source file of a module of the package."""
    return PACKAGE.joinpath(*module.split(".")[1:]).with_suffix(".py")


def _python_tag() -> str:
    """Python version in the names of numba's index files."""
    return f".py{sys.version_info[0]}{sys.version_info[1]}"


def encoded(numba_type: Any) -> Any:
    """Text, or list of a tuple's fields, that stands for a numba type.

    Arrays are "float64 2 C", with "readonly" where they are; structured ones a list of "records", dimensions, layout
    and fields; tuples a list that begins with "tuple", or with the class of a named tuple.

    Raises:
        TypeError: A type of another kind.
    """
    if isinstance(numba_type, types.Array) and isinstance(numba_type.dtype, types.Record) and numba_type.mutable:
        return [
            "records",
            numba_type.ndim,
            numba_type.layout,
            *map(list, numpy_support.as_dtype(numba_type.dtype).descr),
        ]
    if isinstance(numba_type, types.Array) and numba_type.aligned:
        return f"{numba_type.dtype} {numba_type.ndim} {numba_type.layout}{'' if numba_type.mutable else ' readonly'}"
    if isinstance(numba_type, types.BaseTuple):
        named = getattr(numba_type, "instance_class", tuple)
        name = "tuple" if named is tuple else f"{named.__module__}:{named.__qualname__}"
        return [name, *(encoded(field) for field in numba_type.types)]
    is_number = isinstance(numba_type, types.Number | types.Boolean) and not isinstance(numba_type, types.Literal)
    if is_number or numba_type == types.none:
        return str(numba_type)
    raise TypeError(f"{numba_type} has no text that stands for it")


def decoded(code: Any) -> Any:
    """Numba type for its text or list, see `encoded`.

    Raises:
        AttributeError: A named tuple or a number that does not exist.
        TypeError: A named tuple with another number of fields.
    """
    if isinstance(code, list) and code[0] == "records":
        record = numpy_support.from_dtype(numpy.dtype([tuple(field) for field in code[3:]]))
        return types.Array(record, code[1], code[2], aligned=False)
    if isinstance(code, list):
        name, fields = code[0], [decoded(field) for field in code[1:]]
        if name == "tuple":
            return types.BaseTuple.from_types(fields)
        module, _, qualified = name.partition(":")
        named: Any = import_module(module)
        for part in qualified.split("."):
            named = getattr(named, part)
        if len(named._fields) != len(fields):
            raise TypeError(f"{name} has {len(named._fields)} fields; {len(fields)} are recorded")
        return types.BaseTuple.from_types(fields, named)
    name, *array = code.split(" ")
    scalar = types.boolean if name == "bool" else getattr(types, name)
    return types.Array(scalar, int(array[0]), array[1], readonly=len(array) > 2) if array else scalar


def kernel_of(recorded: RecordedKernel) -> Any:
    """The kernel that was recorded.

    Raises:
        AttributeError: There is none.
    """
    return getattr(import_module(recorded.module), recorded.name)
