"""Commands about scenario files: new, check."""

from pathlib import Path
from typing import Annotated

import typer

from insonify.cli.words import InputError


def new(
    name: Annotated[str, typer.Argument(help="Name of the scenario; the file will be NAME.yaml.")],
    template: Annotated[str, typer.Option(help="Which scenario to start from.")] = "nominal",
) -> None:
    """Write a commented scenario to edit.

    Example: insonify new harbour
    """
    target = Path(name if name.endswith((".yaml", ".yml")) else f"{name}.yaml")
    text = _template(template)
    try:
        with target.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise InputError(f"{target} exists already. Choose another name, or delete it first") from None
    except OSError as error:
        raise InputError(f"{target} cannot be written: {error.strerror}") from None
    typer.echo(target)


def check(file: Annotated[Path, typer.Argument(help="Scenario file (YAML).")]) -> None:
    """Say what is wrong with a scenario, line by line.

    Example: insonify check harbour.yaml
    """
    from insonify.scenario.load import load_scenario

    load_scenario(file)
    typer.echo(f"{file}: nothing wrong")


def _template(name: str) -> str:
    from importlib.resources import files

    from insonify.scenario.advice import nearest

    folder = files("insonify.scenario") / "templates"
    known = sorted(entry.name.removesuffix(".yaml") for entry in folder.iterdir() if entry.name.endswith(".yaml"))
    if name not in known:
        meant = nearest(name, known)
        hint = f"Did you mean {meant}?" if meant else f"Choose one of {', '.join(known)}"
        raise InputError(f"--template {name}: there is no such template. {hint}")
    return (folder / f"{name}.yaml").read_text(encoding="utf-8")
