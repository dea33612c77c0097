"""Scenarios that show what the simulator does: each a template, its recording, its picture and its numbers."""

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path

import numpy as np

from insonify.demos.products import coherent_sidescan, draw, nominal_box
from insonify.formats.zarr_store import open_recording
from insonify.paper.checked_numbers import CheckedNumber
from insonify.plotting import recording as draw_recording
from insonify.plotting import style
from insonify.scenario.load import load_scenario
from insonify.simulator import record

NOMINAL = "nominal"
"""The scene of the paper and of the first page: one ping, drawn as its recording."""
DEMOS = (NOMINAL, "coherent-sidescan", "forward-looking", "multibeam", "interferometric", "synthetic-aperture")
"""Scenarios that can be shown, by the names of their templates."""


@dataclass(frozen=True, slots=True)
class DemoFiles:
    """Files and numbers of a demonstration."""

    scenario: Path
    recording: Path
    picture: Path
    table: Path
    numbers: list[CheckedNumber]


def template(name: str) -> str:
    """The scenario file of a demonstration, as text.

    Args:
        name: One of `DEMOS`.
    """
    return (files("insonify.scenario") / "templates" / f"{name}.yaml").read_text(encoding="utf-8")


def show(name: str, folder: Path, *, overwrite: bool = False, threads: int | None = None,
         on_ping: Callable[[int, int], None] | None = None) -> DemoFiles:  # fmt: skip
    """Write a scenario, simulate it, draw what it makes and say how that agrees with the truth.

    Args:
        name: One of `DEMOS`.
        folder: Where the files go, named after it; made where it is not there. A recording that was begun goes on.
        overwrite: Whether a scenario or a recording of that name that is another is replaced.
        threads: How many cores to use.
        on_ping: Told the pings done and the pings wanted.

    Raises:
        FileExistsError: The folder has a scenario of that name that says something else.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{name}{suffix}" for suffix in (".yaml", ".zarr", ".png", ".json")]
    scenario, recording, picture, table = paths
    text = template(name)
    if scenario.exists() and scenario.read_text(encoding="utf-8") != text and not overwrite:
        raise FileExistsError(f"{scenario} is there and says something else. Give another folder, or --overwrite; or "
                              f"run it yourself: insonify run {scenario} -o {recording}")  # fmt: skip
    scenario.write_text(text, encoding="utf-8")
    record(load_scenario(scenario), recording, threads=threads, overwrite=overwrite, on_ping=on_ping)
    numbers = _drawn(name, scenario, recording, picture)
    rows = [{**asdict(number), "relation": number.relation, "holds": number.holds} for number in numbers]
    content = {"demo": name, "version": version("insonify"), "numbers": rows}
    table.write_text(json.dumps(content, indent=1, default=float) + "\n", encoding="utf-8")
    return DemoFiles(scenario, recording, picture, table, numbers)


def _drawn(name: str, scenario: Path, recording: Path, picture: Path) -> list[CheckedNumber]:
    held = open_recording(recording)
    if name == NOMINAL:
        draw_recording(held, picture)
        return nominal_box.numbers(held.load(), load_scenario(scenario))
    if name != "coherent-sidescan":
        return draw(held, picture)
    with style.plot_style():
        figure, numbers = coherent_sidescan.coherent_sidescan(held.load(), load_scenario(scenario))
        style.save_figure(figure, picture)
    return numbers


def numbers_table(numbers: list[CheckedNumber]) -> str:
    """Numbers as a table: what was measured, what is true, and whether they agree.

    Args:
        numbers: As of `show`.
    """
    lines = []
    for number in numbers:
        line = f"  {number.name:<52}{_figures(number.value):>9} {number.unit:<4}"
        if number.expected is not None:
            about = f"+- {_figures(number.tolerance)}" if number.tolerance is not None else "or more"
            line += f"  expected {_figures(number.expected):>8} {about:<11} {'holds' if number.holds else 'FAILS'}"
        lines.append(line.rstrip())
    return "\n".join(lines)


def _figures(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 1e4 else f"{value + 0.0:.5g}" if np.isfinite(value) else str(value)
