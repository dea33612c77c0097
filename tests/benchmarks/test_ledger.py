"""Claims about the ledger of benchmark results."""

import importlib
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def ledger(monkeypatch):
    """The ledger's module, from the benchmarks' folder."""
    if not FOLDER.is_dir():
        pytest.skip("no benchmarks here: an installation, not a checkout")
    monkeypatch.syspath_prepend(str(FOLDER))
    yield importlib.import_module("ledger")
    for name in ("ledger", "measure"):
        sys.modules.pop(name, None)


def test_a_slower_result_has_a_ratio_above_one_in_every_unit(ledger, tmp_path):
    """Seconds that grow and rates that fall are both slower; the last entry of this machine is the one compared."""
    store = tmp_path / "ledger.jsonl"
    Result = sys.modules["measure"].Result
    for seconds, rate in ((9.0, 90.0), (2.0, 20.0)):
        ledger.append([Result("ping", seconds, "s"), Result("survey", rate, "x real time")], store)
    entries = ledger.read(store)
    assert [one.value for one in entries] == [9.0, 90.0, 2.0, 20.0]
    assert ledger.slowdown(Result("ping", 3.0, "s"), entries) == pytest.approx(1.5)
    assert ledger.slowdown(Result("survey", 10.0, "x real time"), entries) == pytest.approx(2.0)
    assert ledger.slowdown(Result("unknown", 1.0, "s"), entries) is None


def test_other_machines_are_not_compared(ledger, tmp_path, monkeypatch):
    """An entry of another processor is no reference."""
    store = tmp_path / "ledger.jsonl"
    result = sys.modules["measure"].Result("ping", 1.0, "s", accuracy="-60 dB")
    ledger.append([result], store)
    assert ledger.read(store)[0].accuracy == "-60 dB"
    monkeypatch.setattr(ledger, "machine", lambda: "another")
    assert ledger.slowdown(result, ledger.read(store)) is None


def test_every_line_on_file_is_an_entry(ledger):
    """The ledger in the repository can be read."""
    for entry in ledger.read():
        assert entry.case and entry.unit and entry.value >= 0
