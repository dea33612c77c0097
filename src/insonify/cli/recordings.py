"""Commands about recordings: run, show, explain."""

from pathlib import Path
from typing import Annotated

import typer

from insonify.cli import words
from insonify.cli.words import InputError

Recording = Annotated[Path, typer.Argument(metavar="OUT", help="Recording made by `insonify run`.")]


def run(
    file: Annotated[Path, typer.Argument(help="Scenario file (YAML).")],
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder of the recording, such as harbour.zarr.")],
    pings: Annotated[str | None, typer.Option(help="Only these pings: first:end, end not included.")] = None,
    threads: Annotated[int | None, typer.Option(min=1, help="How many cores to use. [default: all]")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace a recording that is there.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress on the terminal.")] = False,
) -> None:
    """Simulate a scenario; a run that was stopped goes on where it was.

    Example: insonify run harbour.yaml -o harbour.zarr
    """
    from insonify.cli.progress import progress
    from insonify.scenario.load import load_scenario

    scenario = load_scenario(file)
    wanted = words.pings(pings, scenario.track.pings)
    from insonify.simulation import record

    with progress(quiet) as on_ping:
        record(scenario, out, pings=wanted, threads=threads, overwrite=overwrite, on_ping=on_ping)
    typer.echo(out)


def show(
    recording: Recording,
    out: Annotated[Path, typer.Option("-o", "--out", help="Picture to write, such as harbour.png.")],
) -> None:
    """Draw a recording.

    Example: insonify show harbour.zarr -o harbour.png
    """
    from insonify.formats.zarr_store import open_recording

    words.check_picture(out, "-o")
    dataset = open_recording(recording)
    from insonify import drawing

    drawing.recording(dataset, out)
    typer.echo(out)


def explain(
    recording: Recording,
    time: Annotated[str, typer.Option(help='When: "201.9 ms" after the start of transmission.')],
    ping: Annotated[int, typer.Option(min=0, help="Which ping, from 0.")] = 0,
) -> None:
    """List the arrivals behind one sample, with their losses in dB.

    Example: insonify explain harbour.zarr --ping 12 --time "201.9 ms"
    """
    from insonify.formats.zarr_store import open_recording

    when = words.seconds(time, "--time")
    dataset = open_recording(recording)
    pings, first, last = dataset.sizes["ping"], float(dataset["time"][0]), float(dataset["time"][-1])
    if ping >= pings:
        raise InputError(f"--ping {ping}: the recording has pings 0 to {pings - 1}")
    if not first <= when <= last:
        raise InputError(f"--time {time}: the recording holds {first * 1e3:g} to {last * 1e3:g} ms")
    from insonify.study.explain import explain as told

    typer.echo(told(dataset, ping=ping, time=when))
