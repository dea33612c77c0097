"""Figures of the paper, each with its scenarios, a picture and a JSON file of checked numbers."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

FIGURES = (1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14)
"""Figures that can be drawn."""


def run(figures: list[int] | None, folder: Path, *, on_figure: Callable[[int, int], None] | None = None) -> list[Path]:
    """Draw some of the paper's figures.

    Args:
        figures: Numbers of the figures in the paper; None for all.
        folder: Folder of pictures and numbers, created if necessary.
        on_figure: Called with the numbers of completed and of all figures, before the first and after each.

    Returns:
        The files written, in order.

    Raises:
        ValueError: A figure that is not available.
    """
    requested = list(FIGURES) if figures is None else figures
    unknown = [number for number in requested if number not in FIGURES]
    if unknown:
        available = ", ".join(map(str, FIGURES))
        raise ValueError(f"figure {', '.join(map(str, unknown))} is not available; choose from {available}")
    folder.mkdir(parents=True, exist_ok=True)
    report = on_figure or (lambda *_: None)
    report(0, len(requested))
    written: list[Path] = []
    for done, number in enumerate(requested, start=1):
        written += draw(number, folder)
        report(done, len(requested))
    return written


def draw(number: int, folder: Path, **options: int) -> list[Path]:
    """Draw one of the paper's figures, and write the picture and its numbers.

    Args:
        number: Number of the figure in the paper.
        folder: Folder of picture and numbers.
        **options: Arguments of the figure's own function `draw`.

    Returns:
        The files written.
    """
    from insonify.paper.checked_numbers import write_numbers
    from insonify.plotting import style

    module = import_module(f"{__name__}.figure{number}")
    with style.plot_style():
        figure, scenarios, numbers = module.draw(**options)
        picture = style.save_figure(figure, folder / f"figure{number}.png")
    return [picture, write_numbers(folder / f"figure{number}.json", number, module.TITLE, scenarios, numbers)]
