"""Processor time of commands from their start to their end, warm: `check`, `show` and `--help`, and the nominal `run`.

Each command runs in a process of its own; the value is the median of `ROUNDS` runs after one that is not counted.
"""

import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import measure
from insonify.cli import main
from measure import Result

EXAMPLES = Path(__file__).parents[1] / "examples"
ROUNDS = 5
"""Runs of each command."""
RECORDED: tuple[tuple[str, str], ...] = (("nominal", "0"), ("harbour", "0:6"))
"""Scenes that are drawn, and the pings of each that are recorded for its picture."""
SCENES = {name: (EXAMPLES / f"{name}.yaml").read_text(encoding="utf-8") for name, _ in RECORDED}
"""Their scenario files."""
SMALL = {
    "ROUNDS": 1, "RECORDED": (("nominal", "0"),),
    "SCENES": {"nominal": SCENES["nominal"].replace("[0 ms, 240 ms]", "[195 ms, 205 ms]")},
}  # fmt: skip


def processor_time(*words: str) -> float:
    """Processor time of one command, all threads [s]; of a smoke run, that of `--help` alone is in another process."""
    if measure.SMOKE and words != ("--help",):
        begin = time.process_time()
        if main([*words]):
            raise RuntimeError(f"insonify {' '.join(words)} fails")
        return time.process_time() - begin
    # a command leaves bytecode behind where it can, as it does on a user's machine
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    child = subprocess.Popen(
        [sys.executable, "-m", "insonify", *words], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        env=environment,
    )  # fmt: skip
    _, status, used = os.wait4(child.pid, 0)
    if status:
        raise RuntimeError(f"insonify {' '.join(words)} fails")
    return used.ru_utime + used.ru_stime


def median(name: str, *words: str) -> Result:
    """One line of the table for a command."""
    if not measure.SMOKE:
        processor_time(*words)
    return Result(name, statistics.median(processor_time(*words) for _ in range(ROUNDS)), "s")


def scenario_file(name: str, folder: str) -> str:
    """Path of the scenario file of a scene, written to a folder."""
    path = Path(folder) / f"{name}.yaml"
    path.write_text(SCENES[name], encoding="utf-8")
    return str(path)


def commands() -> list[Result]:
    """Help, a check, the simulation of one ping, and pictures of a trace with its expected level and of a survey."""
    with tempfile.TemporaryDirectory() as folder:
        nominal = scenario_file("nominal", folder)
        run = ("run", nominal, "-o", f"{folder}/nominal.zarr", "--overwrite", "--quiet")
        found = [
            median("insonify --help", "--help"),
            median("check of the nominal scene", "check", nominal),
            median("run of the nominal scene", *run),
        ]
        for name, pings in RECORDED:
            out = f"{folder}/{name}.zarr"
            if not Path(out).exists():
                processor_time("run", scenario_file(name, folder), "-o", out, "--quiet", "--pings", pings)
            found.append(median(f"show of a recording of the {name} scene", "show", out, "-o", f"{folder}/{name}.png"))
        return found


BENCHES = [commands]
