"""The command dataset: labelled images about a scenario whose values vary."""

from pathlib import Path
from typing import Annotated

import typer

from insonify.cli.arguments import Cluster, Cores, InputError, Quiet, parse_part, require_cluster, require_writable
from insonify.cli.pictures import start_drawing


def dataset(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="File of the data set (YAML).")],
    out: Annotated[Path | None, typer.Option("-o", "--out", metavar="DIR", help="Folder of the data set.")] = None,
    preview: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, help="Only draw a contact sheet of N images, to FILE-preview.png or to -o."),
    ] = None,
    part: Annotated[str | None, typer.Option(metavar="i/N", help="Only this part of the scenes, such as 3/64.")] = None,
    processes: Cores = None,
    cluster: Cluster = None,
    quiet: Quiet = False,
) -> None:
    """Simulate a data set of labelled images; a job that was stopped is resumed.

    With the last of its scenes come the card (README.md, card.json) and the lists of annotations.

    Example: insonify dataset dataset.yaml -o mines --preview 12

    Example: insonify dataset dataset.yaml -o mines --part 3/64

    Example: insonify dataset dataset.yaml -o mines --cluster local:2
    """
    from insonify.cli.progress import progress
    from insonify.datasets.dataset import WHOLE, make_dataset

    if cluster is not None:
        require_cluster(cluster, {"--part": part, "--processes": processes, "--preview": preview})
    if preview is not None:
        from insonify.datasets.contact_sheet import write_contact_sheet

        start_drawing()
        picture = out or file.with_name(f"{file.stem}-preview.png")
        require_writable(picture, "-o")
        typer.echo(write_contact_sheet(file, picture, preview))
        return
    if out is None:
        raise InputError("-o DIR is missing: the folder that the images go to")
    with progress(quiet, "scene", f"delete {out} to start anew") as on_scene:
        whole = make_dataset(
            file, out, part=parse_part(part) or WHOLE, processes=processes, cluster=cluster, on_scene=on_scene
        )  # fmt: skip
    typer.echo(out)
    if not whole:
        typer.echo("scenes of other parts are missing; the last part to end writes card and annotations", err=True)
