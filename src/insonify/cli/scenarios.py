"""Commands about scenario files: new, check, schema."""

import warnings
from pathlib import Path
from typing import Annotated, Any

import typer

from insonify.cli.arguments import InputError, ScenarioFile, require_choice

SCHEMA_FILE = "insonify.schema.json"
"""File that `schema` writes and that the first line of a new scenario names."""
MODELINE = f"# yaml-language-server: $schema={SCHEMA_FILE}\n"
"""First line of a new scenario, by which editors with a YAML language server find the schema."""


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the scenario; the file will be NAME.yaml.")],
    template: Annotated[
        str,
        typer.Option(
            metavar="TEMPLATE",
            help="What to start from: nominal, sidescan, coherent-sidescan, forward-looking, multibeam, "
            "interferometric, synthetic-aperture or echosounder.",
        ),
    ] = "nominal",
) -> None:
    """Write a commented scenario to edit.

    Example: insonify new harbour
    """
    if not Path(name).stem.strip(". "):
        raise InputError(f"{name!r} is no name of a scenario. Give one, such as harbour")
    target = Path(name if name.endswith((".yaml", ".yml")) else f"{name}.yaml")
    text = _renamed(_template(template), template, target)
    try:
        with target.open("x", encoding="utf-8") as file:
            file.write(MODELINE + text)
    except FileExistsError:
        raise InputError(f"{target} exists already. Choose another name, or delete it first") from None
    except OSError as error:
        raise InputError(f"{target} cannot be written: {error.strerror}") from None
    typer.echo(target)
    _hint_at_schema(target)


def scenario_from(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Recording of a real instrument.")],
    out: Annotated[Path, typer.Option("-o", "--out", metavar="PATH", help="Scenario to write.")],
    group: Annotated[
        str | None, typer.Option(help="Group of the file, such as '38 kHz'; the soundings or the first by default.")
    ] = None,
    sector: Annotated[
        str | None,
        typer.Option(metavar="N|all", help="Transmit sector of a multibeam, from 0, or a file each. [default: middle]"),
    ] = None,
    flat: Annotated[bool, typer.Option("--flat", help="One depth, however much the soundings vary.")] = False,
) -> None:
    """Write the scenario of a recording of a real instrument, with the source of each value.

    Positions and attitude become a navigation log beside the scenario, soundings that vary a grid of depths. What the
    file does not state has a default marked `assumed`.

    Example: insonify scenario-from line.kmall -o harbour.yaml

    Example: insonify scenario-from line.kmall -o harbour.yaml --sector all
    """
    from insonify.formats.instruments import open_instrument
    from insonify.formats.instruments.navigation_text import navigation_log
    from insonify.formats.instruments.scenario_text import scenario_text
    from insonify.formats.instruments.scenario_values import ScenarioValues, preferred_group
    from insonify.formats.instruments.soundings_grid import soundings_grid

    log_path, grid_path = out.with_name(f"{out.stem}-navigation.csv"), out.with_name(f"{out.stem}-bathymetry.npz")
    if sector is not None and sector != "all" and not sector.isdecimal():
        raise InputError(f"--sector {sector}: give a number from 0, or all")
    with open_instrument(file) as opened:
        log, names = navigation_log(opened, group), {"log": log_path.name, "bathymetry": grid_path.name}
        grid = soundings_grid(opened, *map(float, log.splitlines()[1].split(",")[1:3])) if log and not flat else None
        names = {"log": names["log"] if log else "", "bathymetry": "" if grid is None else names["bathymetry"]}
        texts = {out: int(sector) if sector and sector != "all" else None}
        if sector == "all":
            count = ScenarioValues(opened, preferred_group(opened, group)).sector_count
            texts = {out.with_name(f"{out.stem}-sector-{k}{out.suffix}"): k for k in range(count)}
        written = {
            path: MODELINE + scenario_text(opened, _title(path), group, sector=chosen, **names)
            for path, chosen in texts.items()
        } | ({log_path: log} if log else {})
    for path in (*written, *([] if grid is None else [grid_path])):
        if path.exists():
            raise InputError(f"{path} exists already. Choose another name with -o, or delete it first")
    try:
        if grid is not None:
            grid.write(grid_path)
            typer.echo(grid_path)
        for path, content in reversed(written.items()):
            with path.open("x", encoding="utf-8") as target:
                target.write(content)
            typer.echo(path)
    except OSError as error:
        raise InputError(f"{out} cannot be written: {error.strerror}") from None
    _hint_at_schema(out)


def _hint_at_schema(scenario: Path) -> None:
    """Print the command that writes the schema which a new scenario names, unless the schema is there."""
    import shlex

    schema_file = scenario.with_name(SCHEMA_FILE)
    if not schema_file.exists():
        option = "" if schema_file == Path(SCHEMA_FILE) else f" -o {shlex.quote(str(schema_file))}"
        typer.echo(f"for completion and explanations of its keys in an editor: insonify schema{option}", err=True)


def _title(path: Path) -> str:
    """Title of a scenario after its file, as YAML that stays a text."""
    import json

    return json.dumps(path.stem, ensure_ascii=False)


def schema(
    out: Annotated[
        Path,
        typer.Option("-o", "--out", metavar="PATH", help="File to write; by default the one that new scenarios name."),
    ] = Path(SCHEMA_FILE),
) -> None:
    """Write the JSON schema of scenario files: editors then complete and explain every key.

    To a file .md: a page with unit, range, default and description of every key, as docs/reference/scenario.md.

    Example: insonify schema

    Example: insonify schema -o keys.md
    """
    import json

    if out.suffix == ".md":
        from insonify.scenario.reference import scenario_reference

        text = scenario_reference()
    else:
        from insonify.scenario.schema import json_schema

        text = json.dumps(json_schema(), indent=1) + "\n"
    try:
        out.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"{out} cannot be written: {error.strerror}") from None
    typer.echo(out)


def check(
    file: ScenarioFile,
    labels: Annotated[bool, typer.Option("--labels", help="For a run with --labels.")] = False,
) -> None:
    """Report what is wrong with a scenario, line by line.

    Example: insonify check harbour.yaml
    """
    from insonify.scenario.load import load_scenario

    with warnings.catch_warnings():
        show, shown = warnings.showwarning, set()

        def show_and_count(*words: Any, **named: Any) -> None:
            shown.add(str(words[0]))  # each text is printed once
            show(*words, **named)

        warnings.showwarning = show_and_count
        scenario = load_scenario(file)
        from insonify.estimates.run_cost import estimate_cost
        from insonify.estimates.run_limits import run_refusal

        whole = estimate_cost(scenario, labels=labels)
        trouble = run_refusal(scenario, whole, labels=labels)
    if trouble:
        raise InputError(f"{file}: {trouble}")
    but = "" if not shown else " but the warning above" if len(shown) == 1 else f" but the {len(shown)} warnings above"
    typer.echo(f"{file}: nothing wrong{but}")
    typer.echo(whole.on_this_machine().summary())
    if scenario.field == "coherent":
        from insonify.estimates.sub_band_error import estimate_sub_band_error

        note = estimate_sub_band_error(scenario).summary()
    else:
        from insonify.estimates.expectation_ripple import expectation_ripple

        note = expectation_ripple(scenario)
    if note:
        typer.echo(note)


def _renamed(text: str, template: str, target: Path) -> str:
    """A template whose title and comments name the file that it becomes."""
    import re
    import shlex

    title = f"title: {_title(target)}"
    text = re.sub(r"^title:[^#\n]*$", lambda _: title, text, count=1, flags=re.MULTILINE)
    for suffix in (".yaml", ".zarr", ".png"):
        name = str(target) if suffix == ".yaml" else str(target.with_suffix(suffix))
        text = text.replace(f"{template}{suffix}", shlex.quote(name))
    return text


def _template(name: str) -> str:
    from insonify.scenario.template import template_names, template_text

    require_choice(name, template_names(), "--template")
    return template_text(name)
