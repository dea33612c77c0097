"""Demonstrations: a template scenario, its recording, its figure and its checked numbers."""

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np

from insonify.demos.products import coherent_sidescan, draw, nominal_box
from insonify.formats.zarr_store import open_recording
from insonify.paper.checked_numbers import CheckedNumber
from insonify.plotting import recording as draw_recording
from insonify.plotting import style
from insonify.recording_run import record
from insonify.scenario.load import load_scenario
from insonify.scenario.template import template_text

NOMINAL = "nominal"
"""Scene of the paper: one ping, drawn as its recording."""
DEMOS = (NOMINAL, "coherent-sidescan", "forward-looking", "multibeam", "interferometric", "synthetic-aperture")
"""Demonstrations, by the names of their templates."""


@dataclass(frozen=True, slots=True)
class DemoFiles:
    """Files and numbers of a demonstration."""

    scenario: Path
    recording: Path
    picture: Path
    table: Path
    numbers: list[CheckedNumber]


def show(name: str, folder: Path, *, overwrite: bool = False, threads: int | None = None,
         on_ping: Callable[[int, int], None] | None = None) -> DemoFiles:  # fmt: skip
    """Write a scenario, simulate it, draw its product and compare its numbers with the truth.

    Args:
        name: One of `DEMOS`.
        folder: Folder of the files, created if necessary. An incomplete recording is continued.
        overwrite: True to replace another scenario or recording of that name.
        threads: Number of threads.
        on_ping: Called with the numbers of recorded pings and of all pings.

    Raises:
        FileExistsError: The folder has another scenario of that name.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{name}{suffix}" for suffix in (".yaml", ".zarr", ".png", ".json")]
    scenario, recording, picture, table = paths
    text = template_text(name)
    if scenario.exists() and scenario.read_text(encoding="utf-8") != text and not overwrite:
        raise FileExistsError(f"{scenario} exists and is another scenario. Give another folder, or --overwrite; or "
                              f"run it yourself: insonify run {scenario} -o {recording}")  # fmt: skip
    scenario.write_text(text, encoding="utf-8")
    record(load_scenario(scenario), recording, threads=threads, overwrite=overwrite, on_ping=on_ping)
    numbers = _draw_product(name, scenario, recording, picture)
    rows = [{**asdict(number), "relation": number.relation, "holds": number.holds} for number in numbers]
    content = {"demo": name, "version": version("insonify"), "numbers": rows}
    table.write_text(json.dumps(content, indent=1, default=float) + "\n", encoding="utf-8")
    return DemoFiles(scenario, recording, picture, table, numbers)


def _draw_product(name: str, scenario: Path, recording: Path, picture: Path) -> list[CheckedNumber]:
    dataset = open_recording(recording)
    if name == NOMINAL:
        draw_recording(dataset, picture)
        return nominal_box.numbers(dataset.load(), load_scenario(scenario))
    if name != "coherent-sidescan":
        return draw(dataset, picture)
    with style.plot_style():
        figure, numbers = coherent_sidescan.coherent_sidescan(dataset.load(), load_scenario(scenario))
        style.save_figure(figure, picture)
    return numbers


def numbers_table(numbers: list[CheckedNumber]) -> str:
    """Table of numbers: measured value, expected value, and agreement.

    Args:
        numbers: Numbers of `show`.
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
