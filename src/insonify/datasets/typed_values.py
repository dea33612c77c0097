"""Values of the files of a data set as they were typed, and the differences between two versions of these files."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from insonify.diagnostics.diagnostic import Diagnostic
from insonify.diagnostics.yaml_source import YamlSource, dotted, read

WITHOUT_EFFECT = ("scene", "compare")
"""Keys of the file of a data set that change no image."""


def read_typed(path: str | Path) -> YamlSource:
    """A file of a data set with the lines of its values."""
    return read(Path(path).read_text(encoding="utf-8-sig"), str(path))


def typed_values(source: YamlSource) -> dict[str, str]:
    """Text of each value that the images depend on, by the path of its key.

    Args:
        source: The file.
    """
    return {dotted(path): text for path, text in source.written.items() if path[0] not in WITHOUT_EFFECT}


def changed_values(recorded: Sequence[Mapping[str, str]], sources: Sequence[YamlSource]) -> list[Diagnostic]:
    """Values that differ from those that a data set was begun with, in the order of the files' lines.

    Args:
        recorded: `typed_values` of each file as the data set was begun.
        sources: The files as they are.
    """
    changes = list[Diagnostic]()
    for before, source in zip(recorded, sources, strict=False):
        lines = {dotted(path): line for path, line in source.lines.items()}
        now = typed_values(source)
        of_file = list[Diagnostic]()
        for key in dict.fromkeys([*now, *before]):
            if now.get(key) != before.get(key):
                is_now = now.get(key, "not given")
                was = f"it was {before[key]} in the folder" if key in before else "it was not given in the folder"
                of_file.append(Diagnostic(source.name, _line(lines, key), key, f"{is_now}; {was}"))
        changes += sorted(of_file, key=lambda change: change.line)
    return changes


def _line(lines: Mapping[str, int], key: str) -> int:
    """Line of a value, or of the nearest group around it that the file has."""
    while key and key not in lines:
        key = key.rpartition(".")[0]
    return lines.get(key, 1)
