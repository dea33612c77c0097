"""Run the benchmarks and print one table: `python benchmarks/run.py [--smoke] [part of a name ...]`.

Each file bench_*.py beside this one has a list BENCHES of functions without arguments that return results.
These are measurements, not tests: no speed is a failure. With --smoke each runs once, at the sizes that its file
names in SMALL (constants of the module, by name), to see that it runs at all: the test suite does that.
Full runs are appended to `ledger.jsonl`; the last column compares with the last entry of the same machine.
"""

import importlib
import platform
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import ledger
import measure
from measure import Result


def files() -> list[Path]:
    """All benchmark files."""
    return sorted(Path(__file__).parent.glob("bench_*.py"))


def main(arguments: list[str]) -> None:
    """Measure and print, file by file; with names given, only files and functions whose names contain one."""
    smoke, names = "--smoke" in arguments, [word for word in arguments if word != "--smoke"]
    rounds = "each once: the numbers mean nothing" if smoke else "best of 5, interleaved"
    print(f"{platform.machine()}, Python {platform.python_version()}, {rounds}\n")
    print(f"{'benchmark':<52}{'value':>10}  {'unit':<22}note")
    before = [] if smoke else ledger.read()
    for file in files():
        module = importlib.import_module(file.stem)
        if smoke:
            measure.SMOKE = True
            for name, value in small(module):
                setattr(module, name, value)
        for bench in module.BENCHES:
            name = f"{file.stem}.{bench.__name__}"
            if not names or any(part in name for part in names):
                results = bench()
                show(results, before)
                if not smoke:
                    ledger.append(results)


def small(module: ModuleType) -> Iterator[tuple[str, object]]:
    """Names and values of the constants by which a benchmark file is made small.

    Raises:
        AttributeError: SMALL names something that the file does not have.
    """
    for name, value in getattr(module, "SMALL", {}).items():
        getattr(module, name)
        yield name, value


def show(results: list[Result], before: list[ledger.Entry]) -> None:
    """Print lines of the table as soon as they are known, with the time over that of the ledger's last entry."""
    for result in results:
        ratio = ledger.slowdown(result, before)
        compared = "" if ratio is None else f"  [{ratio:.2f} x the last time]"
        print(f"{result.bench:<52}{result.value:>10.4g}  {result.unit:<22}{result.note}{compared}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
