"""Run the benchmarks and print one table: `python benchmarks/run.py [part of a name ...]`.

Each file bench_*.py beside this one has a list BENCHES of functions without arguments that return results.
These are measurements, not tests: nothing fails.
"""

import importlib
import platform
import sys
from pathlib import Path

from measure import Result


def main(wanted: list[str]) -> None:
    """Measure and print, file by file; with names given, only files and functions whose names contain one."""
    print(f"{platform.machine()}, Python {platform.python_version()}, best of 5, interleaved\n")
    print(f"{'benchmark':<52}{'value':>10}  {'unit':<22}note")
    for file in sorted(Path(__file__).parent.glob("bench_*.py")):
        for bench in importlib.import_module(file.stem).BENCHES:
            name = f"{file.stem}.{bench.__name__}"
            if not wanted or any(part in name for part in wanted):
                show(bench())


def show(results: list[Result]) -> None:
    """Print lines of the table as soon as they are known."""
    for result in results:
        print(f"{result.bench:<52}{result.value:>10.4g}  {result.unit:<22}{result.note}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
