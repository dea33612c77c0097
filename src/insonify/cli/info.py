"""The command info: the content of a file, a recording of ours or of a real instrument, or a scenario."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from insonify.formats.locations import location

if TYPE_CHECKING:
    from rich.table import Table

_UNITS = {
    "frequency": ("kHz", 1e-3), "pulse_length": ("ms", 1e3), "sample_interval": ("us", 1e6),
    "sample_rate": ("kHz", 1e-3), "sound_speed": ("m/s", 1.0), "source_level": ("dB", 1.0), "depth": ("m", 1.0),
}  # fmt: skip
_LISTED = 20  # omissions that a terminal shows; JSON has them all


def info(
    file: Annotated[
        str,
        typer.Argument(metavar="FILE", help="Recording of a real instrument or of ours (or its URL), or a scenario."),
    ],
    as_json: Annotated[bool, typer.Option("--json", help="All of it as JSON, in SI units.")] = False,
    check: Annotated[
        bool, typer.Option("--check", help="Read every datagram, not only headers and some pings.")
    ] = False,
) -> None:
    """Print the content of a file: instrument, time span, datagrams, groups of data, and what could not be read.

    Example: insonify info line.kmall

    Example: insonify info harbour.zarr --json

    Example: insonify info harbour.nc

    Example: insonify info s3://bucket/harbour.zarr
    """
    about = _about(location(file), check)
    if as_json:
        typer.echo(json.dumps(about, indent=2))
        return
    from rich.console import Console

    console = Console(highlight=False, soft_wrap=True)
    console.print(_heading(about), markup=False)
    if (table := _datagrams(about)) is not None:
        console.print(table)
    for line in (*_groups(about), *_remarks(about)):
        console.print(line, markup=False)


def _about(file: str | Path, check: bool) -> dict[str, Any]:
    if isinstance(file, str) or file.is_dir() or file.suffix.lower() in (".nc", ".nc4"):
        return _of_recording(file)
    return _of_scenario(file) if file.suffix.lower() in (".yaml", ".yml") else _of_instrument(file, check)


def _of_instrument(file: Path, check: bool) -> dict[str, Any]:
    from insonify.formats.instruments import open_instrument
    from insonify.formats.instruments.file_summary import file_summary

    with open_instrument(file) as opened:
        if check:
            opened.check()
        return file_summary(opened)


def _of_recording(where: str | Path) -> dict[str, Any]:
    from insonify.formats.stored_recording import is_netcdf, outlined
    from insonify.formats.zarr_store import stored_bytes
    from insonify.records.netcdf_recording import REAL

    with outlined(where) as (stored, recording):
        sizes = {str(dim): int(size) for dim, size in recording[stored].sizes.items() if dim != "ping"}
        pings, version = recording.sizes["ping"], str(recording.attrs.get("version", ""))
        done = int(recording["done"].values.sum()) if "done" in recording else pings
    of_file = is_netcdf(where)
    return {
        "file": str(where), "format": "insonify recording" + (" in netCDF" if of_file else ""),
        "bytes": Path(where).stat().st_size if of_file else stored_bytes(where), "maker": "insonify", "model": version,
        "serial": "", "start": None, "end": None, "simulated": done,
        "groups": [{"name": stored.removesuffix(REAL), "pings": pings, "pings_read": done, "shape": sizes}],
    }  # fmt: skip


def _of_scenario(file: Path) -> dict[str, Any]:
    from insonify.scenario.load import load_scenario

    scenario = load_scenario(file)
    return {
        "file": str(file), "format": "insonify scenario", "bytes": file.stat().st_size, "maker": "", "model": "",
        "serial": "", "start": None, "end": None,
        "groups": [{"name": "sonar", "pings": scenario.track.ping_count, "pings_read": 0, "shape": {}}],
    }  # fmt: skip


def _heading(about: dict[str, Any]) -> str:
    device = " ".join(word for word in (about["maker"], about["model"]) if word)
    serial = f", serial {about['serial']}" if about["serial"] else ""
    lines = [
        about["file"],
        f"  {about['format']}, {about['bytes'] / 1e6:,.2f} MB" + (f", {device}{serial}" if device else ""),
    ]
    if about["start"]:
        lines.append(f"  {about['start']} to {about['end']}")
    return "\n".join(lines)


def _datagrams(about: dict[str, Any]) -> "Table | None":
    if not about.get("datagrams"):
        return None
    from rich.table import Table

    table = Table(box=None, pad_edge=False)
    for name in ("datagrams", "content"):
        table.add_column(name)
    for name in ("count", "bytes"):
        table.add_column(name, justify="right")
    for row in about["datagrams"]:
        table.add_row(row["kind"], row["content"], f"{row['count']:,}", f"{row['bytes']:,}")
    return table


def _groups(about: dict[str, Any]) -> list[str]:
    """Lines of the groups: number of pings, shape of the largest, ranges of their settings."""
    lines = []
    for group in about["groups"]:
        shape = "".join(f" x {size} {dim.replace('_', ' ')}s" for dim, size in group["shape"].items())
        lines.append(f"{group['name']}: {group['pings']:,} pings{shape}")
        lines += [
            f"  {name.replace('_', ' ')} {_range(group[name], scale)} {unit}"
            for name, (unit, scale) in _UNITS.items() if name in group
        ]  # fmt: skip
    return lines


def _range(values: list[float], scale: float) -> str:
    low, high = (f"{value * scale:.5g}" for value in values)
    return low if low == high else f"{low} to {high}"


def _remarks(about: dict[str, Any]) -> list[str]:
    """Lines below the tables: series, profiles, the state of the clock, parts left out."""
    lines = [f"{name}: {series['samples']:,} samples" for name, series in about.get("series", {}).items()]
    if about.get("sound_speed_profiles"):
        lines.append(f"sound-speed profiles: {about['sound_speed_profiles']}")
    if about.get("settings"):
        lines.append(f"settings: {about['settings']}")
    if "simulated" in about:
        lines.append(f"simulated: {about['simulated']:,} pings")
    for title, key in (("clock", "clock_jumps"), ("left out", "omissions")):
        parts = about.get(key, [])
        lines += [f"{title}: byte {part['offset']}: {part['reason']}" for part in parts[:_LISTED]]
        if len(parts) > _LISTED:
            lines.append(f"{title}: {len(parts) - _LISTED} more; --json lists them")
    return lines
