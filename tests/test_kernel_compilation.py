"""Kernels compiled ahead: recorded signatures, the processes that compile them, and the cache that they share."""

import json
import os
import pickle
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from numba import typeof

from insonify import kernel_compilation, kernel_signatures
from insonify.kernel_signatures import RecordedKernel, decoded, encoded, kernel_of, recorded_kernels

ROOT = Path(__file__).parent.parent


class Pair(NamedTuple):
    """Two arguments of a kernel."""

    values: np.ndarray
    count: int


def _read_only(array):
    array.flags.writeable = False
    return array


@pytest.mark.parametrize(
    "value",
    [
        1, 2.5, True, 1j, np.float32(1), np.uint8(3), np.zeros(3), np.zeros((3, 2)).T, np.zeros((4, 4))[::2, ::2],
        _read_only(np.zeros(2, np.complex64)), (1, 2.5), (1.0, 2.0), Pair(np.zeros(2), 3), (Pair(np.zeros((1, 2)), 1),),
        (), np.zeros(2, bool), None, np.zeros((2, 1), [("row", np.int32), ("slope", np.float32)]),
    ],
)  # fmt: skip
def test_types_are_those_of_their_text(value):
    """To text and back: the type by which numba chooses the machine code of a call."""
    assert decoded(json.loads(json.dumps(encoded(typeof(value))))) == typeof(value)


@pytest.mark.parametrize("value", ["word", np.zeros(1, "M8[s]"), [1, 2]])
def test_types_without_a_text_are_refused(value):
    """No signature is recorded rather than a wrong one."""
    with pytest.raises((TypeError, AttributeError)):
        decoded(encoded(typeof(value)))


def test_recorded_kernels_exist():
    """Nine of ten recorded kernels have their name, and their named tuples the number of fields."""

    def is_valid(kernel: RecordedKernel) -> bool:
        try:
            return callable(kernel_of(kernel)) and len([decoded(code) for code in kernel.signature]) > 0
        except (AttributeError, TypeError, ModuleNotFoundError):
            return False

    kernels = recorded_kernels()
    assert len(kernels) > 150
    assert sum(map(is_valid, kernels)) >= 0.9 * len(kernels), "run `python benchmarks/record_kernels.py`"


def test_kernels_of_the_nominal_scenario_are_known_before():
    """Nine of ten kernels that a run calls are those predicted from its features, and few others are."""
    command = [sys.executable, str(ROOT / "benchmarks" / "record_kernels.py"), "template nominal"]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    features, called = json.loads(done.stdout.splitlines()[-1])
    called = {(module, name, json.dumps(signature)) for module, name, signature, _ in called}
    known = {(k.module, k.name, json.dumps(k.signature)) for k in recorded_kernels() if k.is_needed(set(features))}
    assert len(called & known) >= 0.9 * len(called), "run `python benchmarks/record_kernels.py`"
    assert len(known - called) <= 0.25 * len(known)


def _in_fresh_cache(folder: Path, script: str) -> str:
    """Output of a Python process whose cache of compiled kernels is empty."""
    environment = os.environ | {"NUMBA_CACHE_DIR": str(folder), kernel_compilation.SETTING: "2"}
    done = subprocess.run(
        [sys.executable, "-c", script], env=environment, stdout=subprocess.PIPE, text=True, check=True, timeout=300
    )
    return done.stdout


def test_two_processes_compile_what_is_missing(tmp_path):
    """The kernels of a scenario that are in no cache, each reported once; those of other scenarios are left alone."""
    output = _in_fresh_cache(
        tmp_path,
        """
from insonify import kernel_compilation as ahead, kernel_signatures as known
module = "insonify.engines._resolution_kernel"
cell = ["insonify.engines._resolution_kernel:ResolutionCell", *["float64"] * 5]
def record(name, feature):
    return known.RecordedKernel(module, name, [cell, "float64 1 C", "float64", "float64 1 C"], 1.0, [[feature]])
kernels = record("ground", "here"), record("cell_areas", "here"), record("ground", "elsewhere")
wrong = known.RecordedKernel("insonify.units", "no_such_kernel", [], 9.0, [["here"]])
known.recorded_kernels = lambda: (*kernels, wrong)
ahead.LEAST_SECONDS, ahead._process_count = 0.0, lambda threads: 2
ahead.report_compilation(lambda *numbers: print(numbers))
ahead.compile_ahead(set())
ahead.compile_ahead({"here"})
ahead.compile_ahead({"here"})
print([kernel.name for kernel in known.missing_kernels({"here"})])
""",
    )
    lines = output.splitlines()
    assert lines[:-1] == ["(0, 3, 2)", "(1, 3, 2)", "(2, 3, 2)", "(3, 3, 2)"]
    assert lines[-1] == "['no_such_kernel']"  # compiled when it is called, if ever


def test_kernels_that_share_others_go_to_one_process():
    """The draw calls kernels of the gain: the process that has the one takes the other, a second one something else.

    With nothing else to do, a third process takes it all the same.
    """
    engines = "insonify.engines."
    names = ("_gain_envelope_kernel", "_draw_kernel", "_resolution_kernel")
    groups = [[RecordedKernel(engines + name, "any", [], 9.0 - n, [[]])] for n, name in enumerate(names)]
    waiting, taken, first, second = list(groups), set(), set(), set()
    assert kernel_compilation._next_group(waiting, first, taken) == groups[0]
    assert kernel_compilation._next_group(waiting, second, taken) == groups[2]
    assert kernel_compilation._next_group(waiting, first, taken) == groups[1]
    assert kernel_compilation._next_group([groups[1]], set(), {engines + names[0]}) == groups[1]
    with pytest.raises(ValueError):
        kernel_compilation._next_group([], set(), set())


def test_without_processes_nothing_is_compiled_ahead(monkeypatch):
    """A Python that cannot be started, or one that ends at once, changes nothing."""
    kernels = [RecordedKernel(f"insonify.{name}", "nothing", [], 60.0, [["here"]]) for name in ("jit", "units")]
    monkeypatch.setattr(kernel_compilation, "missing_kernels", lambda features: kernels)
    monkeypatch.setattr(kernel_compilation, "_process_count", lambda threads: 2)
    seen: list[tuple[int, ...]] = []
    monkeypatch.setattr(kernel_compilation, "_REPORTS", [lambda *numbers: seen.append(numbers)])
    for program in ("/no/such/program", "/bin/false"):
        monkeypatch.setattr(kernel_compilation, "_DONE", set())
        monkeypatch.setattr(sys, "executable", program)
        kernel_compilation.compile_ahead({"here"})
    assert seen == [(0, 2, 2)] * 2


def test_signatures_saved_at_once_have_files_of_their_own(tmp_path):
    """Four processes save three signatures each of one kernel: all are in its index, each with its own machine code."""
    module = tmp_path / "squares.py"
    module.write_text(
        "from insonify.jit import njit\n@njit(cache=True)\ndef square(x):\n    return x * x\n", encoding="utf-8"
    )
    types = ["int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64", "float32", "float64",
             "complex64", "complex128"]  # fmt: skip
    script = f"""
import sys, time; sys.path.insert(0, {str(tmp_path)!r})
from numba import types
from squares import square
square.dispatcher.compile((types.boolean,))
sys.stdin.readline()
for name in sys.argv[1:]: square.dispatcher.compile((getattr(types, name),))
"""
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    processes = [
        subprocess.Popen([sys.executable, "-c", script, *types[n::4]], stdin=subprocess.PIPE, env=environment)
        for n in range(4)
    ]
    for process in processes:
        assert process.stdin is not None
        process.stdin.write(b"\n")
        process.stdin.close()
    assert [process.wait(timeout=300) for process in processes] == [0] * 4
    (index,) = (tmp_path / "cache").rglob("squares.square-*.nbi")
    with index.open("rb") as file:
        pickle.load(file)
        _, files = pickle.load(file)
    assert len(files) == len(types) + 1 == len(set(files.values()))


def test_machine_setting_limits_the_processes(monkeypatch):
    """The environment variable, the cores and the free memory: the least of them."""
    monkeypatch.setattr(kernel_compilation, "thread_count", lambda threads: threads or 8)
    monkeypatch.setattr(kernel_compilation, "available_memory", lambda: 1e12)
    for setting, count in (("3", 3), ("0", 0), ("many", 8), ("100", 8)):
        monkeypatch.setenv(kernel_compilation.SETTING, setting)
        assert kernel_compilation._process_count(None) == count
    assert kernel_compilation._process_count(5) == 5
    monkeypatch.setattr(kernel_compilation, "available_memory", lambda: 2 * kernel_compilation.MEMORY)
    assert kernel_compilation._process_count(None) == 2
    for program in ("", None, "/opt/viewer/bin/viewer"):
        monkeypatch.setattr(sys, "executable", program)
        assert kernel_compilation._process_count(None) == 0


def test_missing_kernels_are_those_without_an_index(monkeypatch, tmp_path):
    """A kernel counts as compiled by its index file of this version of Python."""
    kernels = tuple(RecordedKernel("insonify.units", name, [], 1.0, [[]]) for name in ("done", "other", "missing"))
    monkeypatch.setattr(kernel_signatures, "recorded_kernels", lambda: kernels)
    monkeypatch.setattr(kernel_signatures, "cache_folder", lambda package: lambda folder: tmp_path)
    version = f"py{sys.version_info[0]}{sys.version_info[1]}"
    for name in (f"units.done-7.{version}.nbi", "units.other-7.py30.nbi"):
        (tmp_path / name).touch()
    assert [kernel.name for kernel in kernel_signatures.missing_kernels(set())] == ["other", "missing"]
