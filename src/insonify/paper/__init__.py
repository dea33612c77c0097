"""The paper's figures, each a scenario, a picture and a JSON file of the numbers that it must show."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

FIGURES = (1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14)
"""Figures that can be drawn."""


def run(figures: list[int] | None, folder: Path, *, on_figure: Callable[[int, int], None] | None = None) -> list[Path]:
    """Draw some of the paper's figures.

    Args:
        figures: Their numbers in the paper; None for all there are.
        folder: Where pictures and numbers go; made where it is not there.
        on_figure: Told the figures done and the figures wanted, before the first and after each.

    Returns:
        The files written, in order.

    Raises:
        ValueError: A figure that is not available.
    """
    wanted = list(FIGURES) if figures is None else figures
    strange = [number for number in wanted if number not in FIGURES]
    if strange:
        there = ", ".join(map(str, FIGURES))
        raise ValueError(f"figure {', '.join(map(str, strange))} is not available; choose from {there}")
    folder.mkdir(parents=True, exist_ok=True)
    report = on_figure or (lambda *_: None)
    report(0, len(wanted))
    written: list[Path] = []
    for done, number in enumerate(wanted, start=1):
        written += import_module(f"{__name__}.figure{number}").draw(folder)
        report(done, len(wanted))
    return written
