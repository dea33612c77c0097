"""Random scenarios run for one ping: no crash, no NaN, and the estimate of `insonify check` compared with the run.

Each scene runs by the command on one thread, in a child process with limits of memory and time. Values are
estimated over measured: 1 is right, the goal is 0.5 to 2. The same numbers give the same scenes. Lines about single
scenes go to stderr as JSON.
"""

import json
import resource
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import yaml

import measure
from insonify.diagnostics.diagnostic import ScenarioError
from insonify.estimates.run_cost import estimate_cost
from insonify.estimates.run_limits import run_refusal
from insonify.formats.zarr_store import open_recording
from insonify.scenario.load import load_scenario
from measure import Result, run_command
from random_scenes import random_description

SMALL = {"SEEDS": (2,), "MOST_SECONDS": 20.0}
SEEDS: tuple[int, ...] = tuple(range(60))
"""Numbers of the scenes: any others give further scenes."""
MOST_SECONDS = 60.0
"""Estimated processor time above which a scene is left out [s]."""
MOST_MEMORY = 8 << 30
"""Address space of a child [bytes]."""
PATIENCE = 300.0
"""Processor time after which a child is ended [s]."""
QUANTITIES = {"seconds": "time", "memory": "memory", "disk": "disk"}
"""What is compared, and its name in the table."""


def scene(seed: int) -> dict[str, Any]:
    """Check one scene, run it, and hold the two against each other.

    Args:
        seed: Number of the scene.

    Returns:
        The outcome: invalid, too large, refused, done or failed; estimated and measured; time of the check [s].
    """
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        file, begin = Path(folder) / "scene.yaml", time.process_time()
        file.write_text(yaml.safe_dump(random_description(seed, Path(folder)), sort_keys=False), encoding="utf-8")
        try:
            scenario = load_scenario(file)
        except ScenarioError as fault:
            return {"seed": seed, "outcome": "invalid", "words": str(fault).partition(": ")[2]}
        estimate = estimate_cost(scenario, threads=1).on_this_machine()
        refused = run_refusal(scenario, estimate)
        found = {"seed": seed, "check": time.process_time() - begin,
                 "estimated": {name: getattr(estimate, name) for name in QUANTITIES}}  # fmt: skip
        if not refused and estimate.seconds > MOST_SECONDS:
            return found | {"outcome": "too large"}
        return found | _run(file, Path(folder) / "scene.zarr", refused=bool(refused))


def _run(file: Path, out: Path, *, refused: bool) -> dict[str, Any]:
    """Run one scene in a child, twice where the first has to compile."""
    arguments = ["run", str(file), "-o", str(out), "--threads", "1", "--quiet", "--overwrite"]
    run = run_command(arguments, {"NUMBA_NUM_THREADS": "1"}, _limit)
    if run.code or refused:
        agreed = refused and run.code == 2
        words = "" if agreed else run.message[-400:]
        return {"outcome": "refused" if agreed else "failed", "code": run.code, "words": words}
    disk = sum(one.stat().st_size for one in out.rglob("*") if one.is_file())
    taken = {"seconds": run.seconds, "memory": run.memory, "disk": float(disk)}
    broken = _broken(out)
    return {"outcome": "failed" if broken else "done", "measured": taken, "words": broken}


def _limit(process: int) -> None:
    """Bound the memory and the processor time of a child, where the system can."""
    if hasattr(resource, "prlimit"):
        resource.prlimit(process, resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
        resource.prlimit(process, resource.RLIMIT_CPU, (int(PATIENCE), int(PATIENCE) + 5))


def _broken(out: Path) -> str:
    """Name of a variable of a recording with a value that is not a number; empty where there is none."""
    with open_recording(out) as recording:
        for name, values in recording.variables.items():
            if values.dtype.kind in "fc" and not np.isfinite(values.values).all():
                return f"{name} is not finite"
    return ""


def random_scenes() -> Iterator[dict[str, Any]]:
    """Outcomes of all scenes, one after the other."""
    for seed in SEEDS:
        found = scene(seed)
        print(json.dumps(found), file=sys.stderr, flush=True)
        yield found


def estimate_over_measured() -> list[Result]:
    """Shares of scenes whose estimate is within a factor of two, the worst, and outcomes."""
    found = list(random_scenes())
    done = [one for one in found if one["outcome"] == "done"]
    lines = []
    for key, name in QUANTITIES.items():
        ratio = np.array([one["estimated"][key] / one["measured"][key] for one in done])
        good = 100 * float(np.mean((ratio >= 0.5) & (ratio <= 2))) if done else 0.0
        spread = f"{ratio.min():.2f} to {ratio.max():.2f}, median {np.median(ratio):.2f}" if done else "none"
        lines.append(Result(f"random scenes, {name} within a factor of 2", good, "%", spread))
    counts = Counter(one["outcome"] for one in found)
    if measure.SMOKE and counts["failed"]:
        raise RuntimeError(f"random scenes fail: {[one for one in found if one['outcome'] == 'failed']}")
    note = ", ".join(f"{count} {outcome}" for outcome, count in counts.items())
    lines.append(Result("random scenes that fail", float(counts["failed"]), "scenes", note))
    slowest = max((one.get("check", 0.0) for one in found), default=0.0)
    return [*lines, Result("random scenes, slowest check", slowest, "s", "the goal is 5")]


BENCHES = [estimate_over_measured]
