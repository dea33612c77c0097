"""Arguments of the command line as typed, and their values."""

import difflib
import re
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import typer

from insonify.former_names import FORMER_WORDS
from insonify.part import Part

ScenarioFile = Annotated[Path, typer.Argument(metavar="FILE", help="Scenario file (YAML).")]
Cores = Annotated[int | None, typer.Option(metavar="N", min=1, help="How many cores to use. [default: all]")]
Cluster = Annotated[
    str | None,
    typer.Option(metavar="ADDRESS", help="Workers of dask: local:2, tcp://host:8786 or slurm://partition:64."),
]
Quiet = Annotated[bool, typer.Option("--quiet", help="No progress on the terminal.")]
PICTURES = (".png", ".pdf", ".svg")
"""Suffixes of the pictures that can be written."""


class InputError(ValueError):
    """An argument of the command line that cannot be meant, and its fix."""


def parse_quantity(text: str, dimension: str, option: str) -> float:
    """A quantity such as "201.9 ms" or "100 kHz" in SI.

    Args:
        text: Number and unit, or a bare number in SI.
        dimension: Its dimension, such as "time" or "frequency".
        option: The option it was typed for, as messages name it.
    """
    from insonify.units import si  # brings numpy, for which --help does not wait

    try:
        return float(str(si(text, dimension)))
    except ValueError as error:
        raise InputError(f"{option} {text}: {error}") from None


def require_time(text: str, when: float, held: tuple[float, float], option: str) -> None:
    """Refuse a time outside a recording; a bare number that would fit in milliseconds was probably meant so.

    Args:
        text: The time as typed.
        when: The same time [s].
        held: First and last time of the recording [s].
        option: The option it was typed for, as messages name it.
    """
    first, last = held
    if first <= when <= last:
        return
    window = f"the recording holds {first * 1e3:g} to {last * 1e3:g} ms"
    if re.search(r"[A-Za-z]\s*$", text):
        raise InputError(f"{option} {text}: {window}")
    hint = f"; did you mean {when:g} ms?" if first <= when / 1e3 <= last else ""
    raise InputError(f"{option} {text}: read as {when:g} s, and {window}{hint}")


def parse_ping_range(text: str | None, count: int) -> range:
    """The pings meant by 10:20 (the last one not included), 10: or 7.

    Args:
        text: The range as typed; None for all pings.
        count: How many pings the track has.
    """
    if text is None:
        return range(count)
    match = re.fullmatch(r"(\d*)(:?)(\d*)", text)
    if match is None or not text.strip(":"):
        raise InputError(f"--pings {text}: not a range of pings; write 10:20, 10: or a single number")
    first, colon, end = match.groups()
    start = int(first or 0)
    stop = int(end) if end else count if colon else start + 1
    if not start < stop <= count:
        problem = "the range is empty" if start >= stop and start < count else "the track does not have them all"
        raise InputError(f"--pings {text}: {problem}; there are pings 0 to {count - 1}")
    return range(start, stop)


def parse_part(text: str | None, option: str = "--part") -> Part | None:
    """The part of a job meant by 3/64: the third of 64.

    Args:
        text: The part as typed; None: the whole job.
        option: The option it was typed for, as messages name it.
    """
    try:
        return None if text is None else Part.parse(text)
    except ValueError as error:
        raise InputError(f"{option} {error}") from None


def require_cluster(cluster: str, others: Mapping[str, object]) -> None:
    """Refuse an address of a cluster that cannot be used.

    Args:
        cluster: The address as typed.
        others: Further options that a cluster has no use for, with their values.
    """
    from insonify import cluster as clusters

    for option, value in others.items():
        if value is not None:
            raise InputError(f"{option} {value}: for one process, and --cluster has many of one thread. Leave one out")
    try:
        clusters.require_cluster(cluster)
    except ValueError as error:
        raise InputError(f"--cluster {error}") from None


def require_choice(text: str, known: Sequence[str], option: str) -> None:
    """Refuse a word that is none of those known.

    Args:
        text: The word as typed.
        known: Words that mean something.
        option: The option it was typed for, as messages name it.
    """
    if text not in known:
        if FORMER_WORDS.get(text) in known:
            raise InputError(f"{option} {text} is called {FORMER_WORDS[text]}. Write {option} {FORMER_WORDS[text]}")
        near = difflib.get_close_matches(text.lower(), known, n=1)
        hint = f"Did you mean {near[0]}?" if near else f"Choose one of {', '.join(known)}"
        raise InputError(f"{option} {text}: there is no such choice. {hint}")


def require_writable(path: Path, option: str, kind: str = "picture", suffixes: Sequence[str] = PICTURES) -> None:
    """Refuse a name under which no picture or report can be written, before anything is computed.

    Args:
        path: The file.
        option: The option it was typed for, as messages name it.
        kind: What it is, as messages name it.
        suffixes: Suffixes of such files.
    """
    if path.suffix.lower() not in suffixes:
        raise InputError(f"{option} {path}: not a {kind}; end its name in {', '.join(suffixes)}")
    if not path.parent.is_dir():
        raise InputError(f"{option} {path}: there is no folder {path.parent}. Make it first: mkdir -p {path.parent}")
    try:
        if path.exists():
            path.open("ab").close()
        else:  # the system's own test of write access does not suffice: it is true for /proc
            tempfile.TemporaryFile(dir=path.parent).close()
    except OSError as error:
        why = error.strerror or "not allowed"
        raise InputError(f"{option} {path}: no {kind} can be written there ({why}). Choose another path") from None


def make_folder(path: Path, option: str) -> None:
    """Make a folder, with those above it, where there is none.

    Args:
        path: The folder.
        option: The option it was typed for, as messages name it.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{option} {path}: no folder can be made there ({error.strerror}). Choose another") from None
