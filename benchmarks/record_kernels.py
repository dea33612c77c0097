"""Record the signatures with which scenarios of many kinds call kernels: `python benchmarks/record_kernels.py`.

Run it after the arguments of kernels have changed, or when new ones are called: it takes a quarter of an hour. Each
scenario is simulated by a process of its own, with an empty cache of compiled kernels that they share, so that the
compile time of each kernel is that of the first scenario that calls it. With a cache of one's own (NUMBA_CACHE_DIR) it
is faster, and the times of kernels in that cache are those recorded before. Written are the kernels, their signatures
and times, and the features of scenarios by which they are called: conjunctions found one by one, each with most of the
scenarios that call the kernel and are not covered yet, among those of whose scenarios at least nine tenths call it.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from insonify.scenario.scenario import Scenario

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "tests" / "golden"))
CONFIDENCE = 0.9
"""Part of the scenarios with some features that call a kernel, from which it is compiled for all of them [1]."""
TEMPLATES = (
    "nominal", "sidescan", "coherent-sidescan", "forward-looking", "multibeam", "interferometric",
    "synthetic-aperture", "echosounder",
)  # fmt: skip


def names() -> list[str]:
    """Names of the recorded scenarios."""
    from scenes import SCENES

    bench = [f"bench {mode} {order} {variant}" for mode in ("coherent", "incoherent") for order in (0, 2)
             for variant in ("still", "rolling", "layered")]  # fmt: skip
    files = [
        f"file {path.name}" for path in sorted((ROOT / "examples").glob("*.yaml")) if "dataset.yaml" not in path.name
    ]
    runs = [f"template {name}" for name in TEMPLATES] + [*files, *bench, "bench elements"]
    few = [run for run in runs if not run.startswith("bench") or run.endswith(("2 still", "2 layered"))]
    more = [f"{run} {result}" for result in ("labelled", "labels", "levels") for run in few]
    return [*runs, *more, *(f"golden {name}" for name in SCENES)]


def run(name: str) -> None:
    """Simulate one scenario and print its features, and the kernels that were called, as JSON."""
    seconds: dict[tuple[str, str], float] = {}
    _time_compilation(seconds)
    features = _simulate(name)
    from insonify.jit import Kernel
    from insonify.kernel_signatures import encoded

    called = []
    for module in list(sys.modules.values()):
        for kernel in list(vars(module).values()) if getattr(module, "__name__", "").startswith("insonify") else []:
            if type(kernel) is Kernel and kernel._made is not None and kernel.py_func.__module__ == module.__name__:
                where = module.__name__, kernel.py_func.__name__
                for signature in kernel._made.overloads:
                    try:
                        called.append((*where, [encoded(kind) for kind in signature], seconds.get(where, 0.0)))
                    except TypeError as error:
                        print(f"left out: {where[1]}: {error}", file=sys.stderr)
    print(json.dumps([sorted(features), called]))


def _simulate(name: str) -> set[str]:
    """Simulate a little of one scenario; returns its features."""
    import insonify
    from insonify import simulator
    from insonify.scenario.features import scenario_features

    kind, _, rest = name.partition(" ")
    found: set[str] = set()
    if kind == "golden":
        from scenes import SCENES

        simulator.compile_ahead = lambda features, _: found.update(features)
        SCENES[rest](2)
        return found
    result = next((word for word in ("labelled", "labels", "levels") if rest.endswith(f" {word}")), "series")
    scenario = _scenario(kind, rest.removesuffix(f" {result}"))
    labels = result in ("labelled", "labels") and scenario.sonar.receiver.record != "elements"
    series, levels = result in ("series", "labelled") or not (labels or result == "levels"), result == "levels"
    pings = list(range(min(2, scenario.track.ping_count))) if series else []
    for _ in insonify.simulator.simulate_pings(insonify.simulator.build_simulator(scenario), pings, 1):
        pass
    if labels:
        insonify.labels(scenario, 0, threads=1)
    if levels:
        insonify.levels(scenario, 0, threads=1)
    return set(scenario_features(scenario, series=series, labels=labels, levels=levels))


def _scenario(kind: str, rest: str) -> "Scenario":
    """Scenario of a template, a file, or a benchmark."""
    import insonify

    if kind == "template":
        folder = ROOT / "src" / "insonify" / "scenario" / "templates"
        return insonify.load_scenario(folder / f"{rest}.yaml")
    if kind == "file":
        return insonify.load_scenario(ROOT / "examples" / rest)
    import bench_coherent
    import bench_sidescan as bench

    if rest == "elements":
        return bench_coherent.elements()
    field, order, variant = rest.split(" ")
    text = bench.SCENE.replace("ORDER", order).replace("incoherent", field)
    change = {"rolling": bench.ROLLING, "layered": bench.LAYERED}.get(variant)
    return bench.loaded(text if change is None else text.replace(*change))


def _time_compilation(seconds: dict[tuple[str, str], float]) -> None:
    """Note the processor time to compile each kernel that is called from Python."""
    from numba.core import event

    begun: list[float] = []

    class Clock(event.Listener):
        def on_start(self, _: object) -> None:
            begun.append(time.process_time())

        def on_end(self, ended: event.Event) -> None:
            spent, function = time.process_time() - begun.pop(), ended.data["dispatcher"].py_func
            if not begun:
                where = function.__module__, function.__name__
                seconds[where] = seconds.get(where, 0.0) + spent

    event.register("numba:compile", Clock())


def rules(calling: set[int], features: list[set[str]]) -> list[list[str]]:
    """Conjunctions of features that describe the scenarios that call a kernel.

    Args:
        calling: Numbers of these scenarios.
        features: Features of each scenario.
    """
    left, found = set(calling), []
    while left:
        best: tuple[int, int, tuple[str, ...]] | None = None
        for size in range(4):
            for chosen in combinations(sorted(set().union(*(features[n] for n in left))), size):
                having = {n for n, each in enumerate(features) if each >= set(chosen)}
                if having and len(having & calling) >= CONFIDENCE * len(having):
                    rank = (len(having & left), -size, chosen)
                    best = rank if best is None or rank[:2] > best[:2] else best
        if best is None or best[0] == 0:
            break  # scenarios with the same features as many that do not call it
        found.append(list(best[2]))
        left -= {n for n, each in enumerate(features) if each >= set(best[2])}
    return found


def main() -> None:
    """Record all scenarios."""
    from insonify.kernel_signatures import FILE, recorded_kernels

    features: list[set[str]] = []
    calling: dict[tuple[str, str, str], set[int]] = {}
    seconds: dict[tuple[str, str], float] = {}
    seconds_before = {(kernel.module, kernel.name): kernel.seconds for kernel in recorded_kernels()}
    with tempfile.TemporaryDirectory() as cache:
        environment = {"NUMBA_CACHE_DIR": cache} | os.environ | {"INSONIFY_COMPILE_PROCESSES": "0"}
        for name in names():
            done = subprocess.run(
                [sys.executable, __file__, name], env=environment, stdout=subprocess.PIPE, text=True, check=False
            )
            if done.returncode:
                print(f"{name}: failed", file=sys.stderr)
                continue
            own, called = json.loads(done.stdout.splitlines()[-1])
            for module, kernel, signature, spent in called:
                calling.setdefault((module, kernel, json.dumps(signature)), set()).add(len(features))
                seconds[module, kernel] = max(seconds.get((module, kernel), 0.0), spent)
            features.append(set(own))
            print(f"{name}: {len(called)} kernels, {len(calling)} in all", file=sys.stderr)
    rows = []
    for (module, kernel, signature), numbers in sorted(calling.items()):
        found = rules(numbers, features)
        if found:
            spent = seconds[module, kernel] or seconds_before.get((module, kernel), 0.0)
            row = [module, kernel, json.loads(signature), round(spent, 2), found]
            rows.append(json.dumps(row))
    FILE.write_text("[\n" + ",\n".join(rows) + "\n]\n")


if __name__ == "__main__":
    run(sys.argv[1]) if len(sys.argv) > 1 else main()
