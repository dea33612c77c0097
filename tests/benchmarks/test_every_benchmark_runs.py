"""Claims about the benchmarks: each of them runs."""

import importlib
import sys
from pathlib import Path

import numpy as np
import pytest

FOLDER = Path(__file__).parents[2] / "benchmarks"
FILES = sorted(path.stem for path in FOLDER.glob("bench_*.py"))


@pytest.fixture
def benchmarks(monkeypatch):
    """The benchmarks' folder on the path, and everything run once."""
    if not FOLDER.is_dir():
        pytest.skip("no benchmarks here: an installation, not a checkout")
    monkeypatch.syspath_prepend(str(FOLDER))
    measure = importlib.import_module("measure")
    monkeypatch.setattr(measure, "SMOKE", True)
    yield importlib.import_module("run")
    for name in ("run", "ledger", "measure", *FILES):
        sys.modules.pop(name, None)


@pytest.mark.parametrize("name", FILES)
def test_each_function_gives_lines_of_the_table(benchmarks, monkeypatch, name):
    """Every benchmark of every file, once and small: names, finite positive values, units."""
    module = importlib.import_module(name)
    for constant, value in benchmarks.small(module):
        monkeypatch.setattr(module, constant, value)
    assert module.BENCHES, f"{name} has no BENCHES"
    for bench in module.BENCHES:
        lines = bench()
        assert lines, f"{name}.{bench.__name__} measured nothing"
        for line in lines:
            assert line.bench and line.unit, line
            assert np.isfinite(line.value) and line.value >= 0, line


@pytest.mark.parametrize(
    ("package", "name", "tolerance"),
    [("pymust", "pymust", 0.02), ("finufft", "finufft", 1e-3), ("scipy", "replicas", 0.05),
     ("pyroomacoustics", "pyroomacoustics", 0.01)],
)  # fmt: skip
def test_peers_agree_with_what_they_are_timed_against(benchmarks, monkeypatch, package, name, tolerance):
    """The series of both programs, small: a comparison of speed is one of the same work."""
    pytest.importorskip(package)
    peers = importlib.import_module("peers")
    for constant, value in peers.SMALL.items():
        monkeypatch.setattr(peers, constant, value)
    mine, theirs = getattr(peers, name)()
    assert mine.value > 0 and theirs.value > 0
    assert float(theirs.accuracy.split()[0]) < tolerance
    sys.modules.pop("peers")


def test_a_benchmark_that_is_made_small_by_a_name_it_does_not_have_is_refused(benchmarks):
    """A constant that was renamed is noticed, or the smoke run would take the full size."""
    module = type(sys)("bench_nothing")
    module.SMALL = {"AT_ONCE": 1}  # type: ignore[attr-defined]
    with pytest.raises(AttributeError, match="AT_ONCE"):
        list(benchmarks.small(module))
