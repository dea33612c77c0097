"""The estimate of `insonify check` compared with the run: processor time, memory and disk, scene by scene.

Each scene is run by the command, in a process of its own, with warm kernels. Values are estimated over measured:
1 is right, the goal is 0.5 to 2.
"""

import json
import sys
import tempfile
import warnings
from pathlib import Path
from typing import NamedTuple

import yaml

from estimate_scenes import SCENES, described
from insonify.estimates.run_cost import RunCost, estimate_cost
from insonify.scenario.load import load_scenario
from measure import THREADS, Result, run_command

SMALL = {"CHOSEN": ("calm sea",)}
CHOSEN: tuple[str, ...] = tuple(SCENES)
"""Scenes that are run."""


class Taken(NamedTuple):
    """Resources that one run took."""

    seconds: float
    """Processor time, all threads [s]."""
    memory: float
    """Largest resident set [bytes]."""
    disk: float
    """Sizes of all files of the recording [bytes]."""


def estimated(file: Path) -> RunCost:
    """The estimate of a scenario file."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return estimate_cost(load_scenario(file)).on_this_machine()


def measured(file: Path, out: Path) -> Taken:
    """Run a scenario file in a process of its own; twice where the first has to compile."""
    run = run_command(["run", str(file), "-o", str(out), "--quiet", "--overwrite", "--threads", str(THREADS)])
    if run.code:
        raise RuntimeError(f"{file} does not run: {run.message}")
    disk = sum(one.stat().st_size for one in out.rglob("*") if one.is_file())
    return Taken(run.seconds, run.memory, float(disk))


def estimates() -> list[Result]:
    """Estimated over measured, of all scenes."""
    found = []
    for name in CHOSEN:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "scene.yaml"
            file.write_text(yaml.safe_dump(described(name), sort_keys=False), encoding="utf-8")
            guess, real = estimated(file), measured(file, Path(folder) / "scene.zarr")
        for what, one, other, unit, size in (
            ("time", guess.seconds, real.seconds, "s", 1.0),
            ("memory", guess.memory, real.memory, "MB", 1e6),
            ("disk", guess.disk, real.disk, "MB", 1e6),
        ):
            note = f"estimated {one / size:.3g} {unit}, measured {other / size:.3g} {unit}"
            found.append(Result(f"estimate, {name}: {what}", one / other, "estimated / measured", note))
        print(json.dumps({"scene": name, "estimated": [guess.seconds, guess.memory, guess.disk], "measured": real}),
              file=sys.stderr, flush=True)  # fmt: skip
    return found


BENCHES = [estimates]
