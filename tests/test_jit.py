"""Claims about kernels that are compiled on first use: the machine code of plain numba, and stand-ins that agree."""

import gc
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from insonify import jit
from insonify.fourier import fast_length


@jit.njit(inline="always")
def doubled(x: float) -> float:
    """A number twice."""
    return 2.0 * x


@jit.njit(error_model="numpy")
def halved(x: float) -> float:
    """Half a number."""
    return x / 2.0


@jit.njit(error_model="numpy")
def there_and_back(x: float) -> float:
    """The same number."""
    return halved(doubled(x)) + halved(0.0)


def test_a_kernel_calls_others_whether_inlined_or_not():
    """To the compiler a kernel is a dispatcher of numba: it is called, or inlined where that is requested."""
    assert there_and_back(3.25) == 3.25
    assert there_and_back.signatures


def test_an_inlined_kernel_is_never_compiled_by_itself():
    """`inline="always"` reaches numba: the callee leaves no machine code of its own."""
    there_and_back(1.0)
    assert not doubled.linked.signatures and halved.linked.signatures


def test_a_kernel_has_the_wrappers_that_are_called():
    """For Python where Python calls it, none where only kernels do; its own instructions are the same."""
    kernel = jit.njit(error_model="numpy")(_sum_of_halves)
    caller = jit.njit(error_model="numpy")(lambda columns: 1.0 * kernel(columns))
    columns = Columns(np.arange(6.0), np.arange(6.0) * 10)
    assert caller(columns) == kernel(columns) == 123.0
    names, texts = [], []
    for dispatcher in (kernel.linked, kernel.dispatcher):
        (made,) = dispatcher.overloads.values()
        names.append([one.name for one in made.library.get_defined_functions() if not one.name.startswith("NRT_")])
        body = next(one for one in made.library.get_defined_functions() if one.name == made.fndesc.llvm_func_name)
        texts.append(re.sub(r"#\d+", "", str(body).replace(made.fndesc.mangled_name, "kernel")))
    assert [len(each) for each in names] == [1, 2] and texts[0] == texts[1]
    assert not any(name.startswith("cfunc") for name in names[1])


def test_a_kernel_that_python_has_called_is_not_compiled_again_for_its_callers():
    """The caller takes over what was compiled for Python, once per types of arguments."""
    kernel = jit.njit(error_model="numpy")(lambda x: x + 1.0)
    assert kernel(1.0) == 2.0
    assert jit.njit(error_model="numpy")(lambda x: kernel(x) + kernel(2 * x))(1.0) == 5.0
    assert list(kernel.linked.overloads.values()) == list(kernel.overloads.values())
    assert not kernel.linked.stats.cache_misses


CACHED = """
from insonify import jit
@jit.njit(cache=True)
def kernel(x):
    if x < 0.0:
        raise ValueError("below zero:", x)
    return x + 1.0
@jit.njit(cache=True)
def caller(x):
    return 2.0 * kernel(x)
@jit.njit(cache=True)
def other(x):
    return 3.0 * kernel(x)
"""
CALLS = """
from kernels import {name}
print({name}(1.0), sum({name}.stats.cache_hits.values()))
try:
    {name}(-1.0)
except ValueError as error:
    print(*error.args)
"""


def test_both_forms_of_a_kernel_are_cached_apart(tmp_path: Path) -> None:
    """A kernel that was compiled for its caller is compiled for Python, too; later processes load either form."""
    (tmp_path / "kernels.py").write_text(CACHED)
    places = {"PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path]), "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    for name, expected in {
        "caller": "4.0 0", "kernel": "2.0 0", "other": "6.0 0", "caller ": "4.0 1", "kernel ": "2.0 1",
    }.items():  # fmt: skip
        script = CALLS.format(name=name.strip())
        done = subprocess.run(
            [sys.executable, "-c", script], env=os.environ | places, check=False, capture_output=True, text=True
        )
        assert done.stdout.splitlines() == [expected, "below zero: -1.0"], done.stderr
    assert len(list(tmp_path.rglob("kernels.kernel*.nbc"))) == 2


class Columns(NamedTuple):
    """Arrays in a tuple."""

    first: np.ndarray
    second: np.ndarray


def _sum_of_halves(columns: Columns) -> float:
    """Sum of a view of each array, by loops."""
    half, total = columns.first.size // 2, 0.0
    for part in (columns.first[:half], columns.second[half:]):
        for k in range(part.size):
            total += part[k]
    return total


counted = jit.njit(error_model="numpy")(_sum_of_halves)
uncounted = jit.njit(error_model="numpy", reference_counts=False)(_sum_of_halves)


@jit.njit(error_model="numpy")
def both_sums(columns: Columns) -> tuple[float, float]:
    """Sums by kernels that count references, and that do not."""
    return counted(columns), uncounted(columns)


def test_a_kernel_that_counts_no_references_borrows_its_arrays():
    """Sums of views, and counts, are as before; instructions that change counts are gone."""
    columns = Columns(np.arange(6.0), np.arange(6.0) * 10)
    before = [sys.getrefcount(column) for column in columns]
    assert both_sums(columns) == (counted(columns), uncounted(columns)) == (123.0, 123.0)
    assert [sys.getrefcount(column) for column in columns] == before
    with_counts, without = (
        sum(text.count("call void @NRT_") for text in kernel.inspect_llvm().values()) for kernel in (counted, uncounted)
    )
    assert without == 0 < with_counts


def test_an_intrinsic_is_for_kernels_only():
    """Instructions of the compiler cannot be run by Python."""
    from insonify.propagation._eigenray_table_simd import interpolate_on_line

    with pytest.raises(TypeError, match="interpolate_on_line"):
        interpolate_on_line(np.zeros(16), 0, 0.5)


def test_a_stand_in_is_called_until_numba_is_imported():
    """Before: the function in NumPy, without numba; after: the kernel."""
    script = """
import sys
from insonify import jit
@jit.njit()
def kernel(x):
    return x + 1.0
@kernel.stand_in
def plain(x):
    return -x
waited = []
jit.when_loaded(lambda: waited.append(1))
assert kernel(1.0) == -1.0 and "numba" not in sys.modules and not waited
jit.load_numba()
assert kernel(1.0) == 2.0 and waited == [1]
jit.when_loaded(lambda: waited.append(2))
assert waited == [1, 2]
"""
    done = subprocess.run([sys.executable, "-c", script], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_fast_lengths_are_those_of_scipy():
    """Products of 2, 3, 5 and, of complex numbers, 7 and 11."""
    from scipy.fft import next_fast_len

    for least in (*range(1, 3000), 2**17 + 1, 999_983):
        assert fast_length(least) == next_fast_len(least)
        assert fast_length(least, real=True) == next_fast_len(least, real=True)


@pytest.mark.parametrize("order", ["fast first", "plain first"])
def test_plain_arithmetic_is_not_reordered_after_kernels_that_may(order: str) -> None:
    """Complex products, each real operation rounded by itself, whichever kernel is compiled first in a process."""
    script = f"""
import numpy as np
from insonify import jit
rng = np.random.default_rng(1)
a, b = (rng.normal(size=200) + 1j * rng.normal(size=200) for _ in range(2))
def products(a, b, result):
    for n in range(a.size):
        result[n] = a[n] * b[n]
kernels = [jit.njit(error_model="numpy", fastmath=flags)(products) for flags in ({{"contract"}}, False)]
results = [np.empty(200, complex), np.empty(200, complex)]
for k in ((0, 1) if {order == "fast first"} else (1, 0)):
    kernels[k](a, b, results[k])
pairs = zip(a.tolist(), b.tolist())
expected = [complex(x.real * y.real - x.imag * y.imag, x.real * y.imag + x.imag * y.real) for x, y in pairs]
np.testing.assert_array_equal(results[1], expected)
np.testing.assert_allclose(results[0], expected, rtol=1e-14)
"""
    done = subprocess.run([sys.executable, "-c", script], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_no_garbage_is_collected_while_a_kernel_is_compiled() -> None:
    """Disabled before the compiler runs, and as it was afterwards: enabled, or disabled by the program."""
    from numba.core import event

    jit.load_numba()
    seen: list[bool] = []

    class Probe(event.Listener):
        def on_start(self, _: event.Event) -> None:
            seen.append(gc.isenabled())

        def on_end(self, _: event.Event) -> None:
            pass

    probe, was_enabled = Probe(), gc.isenabled()
    event.register("numba:compile", probe)
    try:
        for set_state in (gc.enable, gc.disable):
            set_state()
            before = gc.isenabled()
            assert jit.njit()(lambda x: x + 1)(2.0) == 3.0
            assert seen == [False] and gc.isenabled() is before
            seen.clear()
    finally:
        event.unregister("numba:compile", probe)
        (gc.enable if was_enabled else gc.disable)()
