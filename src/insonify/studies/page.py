"""Page of a study: Markdown text, tables and pictures beside it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

from insonify.plotting import style


@dataclass(frozen=True, slots=True)
class Section:
    """Part of a page: text, and one picture."""

    text: str
    """Markdown, with its heading."""
    figure: Figure
    """Picture below the text."""
    name: str
    """Name of the picture's file, without its suffix."""
    caption: str
    """Caption of the picture."""


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Markdown table.

    Args:
        header: Titles of the columns.
        rows: Cells of each row, as many as columns.

    Example:
        >>> print(table(["wind", "loss [dB]"], [["3 m/s", "1.2"]]))
        | wind | loss [dB] |
        |---|---|
        | 3 m/s | 1.2 |
    """
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("|" + "|".join(c if c == "---" else f" {c} " for c in cells) + "|" for cells in lines)


def write_page(path: Path, title: str, introduction: str, sections: Sequence[Section]) -> list[Path]:
    """Write a page and its pictures, which lie in a folder `images` beside it.

    Args:
        path: Markdown file to write.
        title: Title of the page.
        introduction: Text below the title.
        sections: Sections in their order.

    Returns:
        Files written, the page first.
    """
    images = path.parent / "images"
    images.mkdir(parents=True, exist_ok=True)
    parts, files = [f"# {title}", introduction], [path]
    for section in sections:
        files.append(style.save_figure(section.figure, images / f"{section.name}.png"))
        parts += [section.text, f"![{section.caption}](images/{section.name}.png)"]
    path.write_text("\n\n".join(parts) + "\n", encoding="utf-8")
    return files
