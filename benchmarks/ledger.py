"""Ledger of benchmark results: one JSON line per figure in `ledger.jsonl`, compared with the last of the same machine.

Absolute times differ from machine to machine, and on shared machines from hour to hour: a ratio beyond about 1.2 is a
reason to measure again side by side (`git worktree`), not yet a finding.
"""

import json
import platform
import subprocess
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import llvmlite.binding as llvm

from measure import Result

STORE = Path(__file__).with_name("ledger.jsonl")


@dataclass(frozen=True, slots=True)
class Entry:
    """One figure of one commit on one machine."""

    commit: str
    machine: str
    case: str
    value: float
    unit: str
    accuracy: str
    """Error of the result that was timed, beside the speed; empty where the case states none."""


def read(store: Path = STORE) -> list[Entry]:
    """All entries, oldest first; none where there is no ledger."""
    if not store.is_file():
        return []
    return [Entry(**json.loads(line)) for line in store.read_text().splitlines() if line]


def append(results: Iterable[Result], store: Path = STORE) -> None:
    """Append results, as of the commit that is checked out."""
    with store.open("a") as file:
        for one in results:
            entry = Entry(commit(), machine(), one.bench, float(f"{one.value:.4g}"), one.unit, one.accuracy)
            file.write(json.dumps({name: getattr(entry, name) for name in Entry.__slots__}) + "\n")


def slowdown(result: Result, entries: list[Entry]) -> float | None:
    """Time of a result over that of the last entry of its case on this machine; None without such an entry.

    Units that end in "/s" and multiples of real time are rates; counts compare as they are.
    """
    before = [one for one in entries if one.case == result.bench and one.machine == machine()]
    if not before or not before[-1].value or not result.value:
        return None
    ratio = result.value / before[-1].value
    return 1 / ratio if is_rate(result.unit) else ratio


def is_rate(unit: str) -> bool:
    """Return True if a larger value in this unit is faster."""
    return unit.endswith("/s") or unit.startswith("x real time")


def machine() -> str:
    """Name of the processor and of the Python version."""
    return f"{llvm.get_host_cpu_name()} {platform.machine()}, Python {platform.python_version()}"


def commit() -> str:
    """Short hash of the commit, with a plus sign where the tree has changes; "unknown" outside a checkout."""

    def git(*words: str) -> str:
        done = subprocess.run(["git", *words], cwd=STORE.parent, capture_output=True, text=True, check=False)
        return done.stdout.strip()

    changed = git("status", "--porcelain", "--untracked-files=no", "--", ".", ":!benchmarks/ledger.jsonl")
    return (git("rev-parse", "--short", "HEAD") or "unknown") + "+" * bool(changed)
