"""Commands about recordings: run, show, explain."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from insonify.cli import arguments
from insonify.cli.arguments import Cluster, Cores, InputError, Quiet, ScenarioFile
from insonify.cli.pictures import start_drawing
from insonify.formats.locations import location

if TYPE_CHECKING:
    import xarray as xr

Recording = Annotated[str, typer.Argument(metavar="OUT", help="Recording made by `insonify run`: folder, URL or .nc.")]
Beam = Annotated[int | None, typer.Option(metavar="B", min=0, help="Which beam, from 0.")]


def run(
    file: ScenarioFile,
    out: Annotated[
        str,
        typer.Option("-o", "--out", metavar="OUT", help="Folder of the recording, such as harbour.zarr, or a URL."),
    ],
    pings: Annotated[
        str | None,
        typer.Option(metavar="RANGE", help="Only these pings: 10:20 (20 not included), 10: (to the end) or just 7."),
    ] = None,
    threads: Cores = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace a recording that is there.")] = False,
    quiet: Quiet = False,
    labels: Annotated[
        bool, typer.Option("--labels", help="Label every sample: object, paths, shadow. As output.labels.")
    ] = False,
    part: Annotated[
        str | None,
        typer.Option(metavar="I/N", help="Only this part of the pings, from 1/N; other processes simulate the others."),
    ] = None,
    cluster: Cluster = None,
) -> None:
    """Simulate a scenario; a run that was stopped is resumed.

    Example: insonify run harbour.yaml -o harbour.zarr

    Example: insonify run harbour.yaml -o harbour.zarr --part 3/64

    Example: insonify run harbour.yaml -o harbour.zarr --cluster local:2

    Example: insonify run harbour.yaml -o s3://bucket/harbour.zarr --part 3/64
    """
    mine, target = arguments.parse_part(part), location(out)
    if mine is not None and overwrite:
        raise InputError(f"--part {part}: with --overwrite, each part would delete the others. Delete {target} first")
    from insonify.cli.progress import progress
    from insonify.scenario.load import load_scenario

    scenario = load_scenario(file)
    requested = arguments.parse_ping_range(pings, scenario.track.ping_count)
    from insonify.estimates.run_cost import estimate_cost
    from insonify.estimates.run_limits import run_refusal
    from insonify.recording_run import record

    if cluster is not None:
        arguments.require_cluster(cluster, {
            "--part": part, "--threads": threads, "-o": out if out.startswith("memory:") else None,
        })  # fmt: skip
        threads = 1
    cost = estimate_cost(scenario, labels=labels, threads=threads)
    if trouble := run_refusal(scenario, cost, labels=labels):
        raise InputError(f"{file}: {trouble}")
    path = target.absolute() if isinstance(target, Path) else target
    simulate = partial(record, path=path, pings=requested, threads=threads, with_labels=True if labels else None)
    if cluster is None:
        with progress(quiet) as on_ping:
            simulate(scenario, overwrite=overwrite, on_ping=on_ping, part=mine)
    else:
        from insonify.cluster import run_parts
        from insonify.formats.recording_state import recording_state

        def divide(workers: int) -> list[range]:
            simulate(scenario, overwrite=overwrite, pings=[])  # the recording is there when the parts begin
            return recording_state(path).shares(requested, workers)

        with progress(quiet, "part") as on_part:
            run_parts(
                simulate, scenario, cluster, divide, request=lambda jobs: cost.of_task(jobs).job_request(),
                on_part=on_part,
            )  # fmt: skip
    typer.echo(target)


def show(
    what: Annotated[
        str,
        typer.Argument(
            metavar="WHAT", help="A recording or a scenario; or a sediment, a profile (.csv), sea, absorption."
        ),
    ],
    out: Annotated[
        Path, typer.Option("-o", "--out", metavar="PNG", help="Picture to write, such as harbour.png, .pdf or .svg.")
    ],
    ping: Annotated[
        int | None,
        typer.Option(metavar="P", min=0, help="Only this ping, from 0. [default: all; of a fan the first]"),
    ] = None,
    beam: Beam = None,
    ground: Annotated[
        bool, typer.Option("--ground", help="Of many pings: distance on a level bed instead of slant range.")
    ] = False,
    gain: Annotated[
        str | None,
        typer.Option(
            metavar="GAIN",
            help="Of many pings: none, tvg20, tvg30, tvg40, lambert (a level bed is uniform) "
            "or empirical (the usual level at each range is uniform). [default: empirical, of fewer than 16 pings "
            "lambert; of one side in slant range none]",
        ),
    ] = None,
    labels: Annotated[
        bool, typer.Option("--labels", help="Of a recording made with --labels: highlights, shadows, ghosts.")
    ] = False,
    frequency: Annotated[str, typer.Option(metavar="F", help="Of a sediment or the sea.")] = "100 kHz",
    wind: Annotated[str, typer.Option(metavar="SPEED", help="Over the sea.")] = "7 m/s",
    rays: Annotated[
        bool, typer.Option("--rays", help="Of a profile (.csv) or a scenario (.yaml): where its sound goes.")
    ] = False,
    source_depth: Annotated[
        str | None, typer.Option(metavar="DEPTH", help="Where rays start. [default: at the scenario's sonar]")
    ] = None,
    reach: Annotated[
        str | None,
        typer.Option("--range", metavar="RANGE", help="Range of the rays. [default: the window's; of a profile 200 m]"),
    ] = None,
) -> None:
    """Draw a recording, a scenario before it is simulated, or the physics of sediments, water and sea.

    Example: insonify show harbour.zarr -o harbour.png

    Example: insonify show harbour.zarr -o harbour.png --ground --gain empirical

    Example: insonify show harbour.yaml -o scene.png

    Example: insonify show harbour.zarr -o harbour-labels.png --labels --ground

    Example: insonify show "medium sand" -o sand.png --frequency "300 kHz"

    Example: insonify show "sandy gravel, 1.5 phi, clay" -o beds.png

    Example: insonify show cast.csv --rays --source-depth "11 m" -o rays.png
    """
    from insonify.cli.physics_plots import show_physics

    arguments.require_writable(out, "-o")
    start_drawing()
    if rays:
        from insonify.cli.ray_plots import show_rays

        show_rays(what, out, source_depth=source_depth, farthest=reach)
        typer.echo(out)
        return
    if source_depth is not None or reach is not None:
        raise InputError(f"{'--source-depth' if source_depth else '--range'} is for rays; add --rays, or leave it out")
    if Path(what).suffix.lower() in (".yaml", ".yml"):
        _show_scenario(Path(what), out, ping, ground or labels or gain is not None or beam is not None)
        typer.echo(out)
        return
    quantities = (
        arguments.parse_quantity(frequency, "frequency", "--frequency"),
        arguments.parse_quantity(wind, "speed", "--wind"),
    )
    recording = location(what)
    if labels:
        _show_labels(recording, out, ping, beam, ground, gain)
    elif isinstance(recording, str) or not show_physics(what, out, frequency=quantities[0], wind=quantities[1]):
        _show_recording(recording, out, ping, beam, ground, gain)
    typer.echo(out)


def _show_scenario(file: Path, out: Path, ping: int | None, of_a_recording: bool) -> None:
    """Draw what a scenario describes, from above and from the side."""
    if of_a_recording or ping is not None:
        raise InputError(f"{file} is a scenario: --ping, --beam, --ground, --gain and --labels draw a recording. Make "
                         f"one: insonify run {file} -o {file.stem}.zarr")  # fmt: skip
    from insonify.scenario.load import load_scenario

    scenario = load_scenario(file)
    from insonify import plotting

    plotting.scene(scenario, out)


def _show_recording(
    recording: str | Path, out: Path, ping: int | None, beam: int | None, ground: bool, gain: str | None
) -> None:
    from insonify.formats.stored_recording import stored_recording

    _check_image(ping, ground, gain)
    dataset = stored_recording(recording)
    if ping is not None:
        _check_ping(dataset, recording, ping)
    elif not dataset["done"].values.any():
        raise InputError(f"{recording} holds no ping yet. {_run_again(recording, 0)}")
    _check_beam(dataset, beam)
    if (ground or gain) and "receiver_position" in dataset:
        raise InputError(f"{'--ground' if ground else '--gain'}: {recording} was recorded on another platform than "
                                          "transmitted, and a time is no range then. Leave it out")  # fmt: skip
    from insonify import plotting
    from insonify.demos.products import draw_product

    with _reading(recording):
        if beam is None and not ground and gain is None and draw_product(dataset, out, ping=ping):
            return
        plotting.recording(dataset, out, ping=ping, beam=beam, ground=ground, gain=gain)


def _of_elements(dataset: "xr.Dataset") -> bool:
    """Return True if the channels of a recording are elements."""
    return "record: elements" in dataset.attrs.get("scenario", "")


def _check_image(ping: int | None, ground: bool, gain: str | None) -> None:
    """Refuse a gain that does not exist, and options of an image for a picture of one ping."""
    if gain is not None:
        from insonify.processing.sidescan import GAINS

        arguments.require_choice(gain, GAINS, "--gain")
    if ping is not None and (ground or gain):
        raise InputError(f"--ping {ping}: --ground and --gain make an image of many pings. Leave one or the other out.")


def _show_labels(
    recording: str | Path, out: Path, ping: int | None, beam: int | None, ground: bool, gain: str | None
) -> None:
    from insonify.formats.label_store import open_labels
    from insonify.formats.stored_recording import is_netcdf
    from insonify.formats.zarr_store import open_recording

    _check_image(ping, ground, gain)
    if is_netcdf(recording):
        raise InputError(f"{recording} is a netCDF file, which holds no labels. Leave --labels out, "
                         "or draw the folder of the run: insonify show harbour.zarr --labels -o PNG")  # fmt: skip
    dataset = open_recording(recording)
    if _of_elements(dataset):
        raise InputError(f"{recording} records elements, and labels are those of beams: it can have none. Leave "
                         "--labels out; a run of the same scene with record: beams and sonar.receive.steer, the "
                         "bearings of the beams, has them")  # fmt: skip
    masks = open_labels(recording)
    if ping is not None:
        _check_ping(dataset, recording, ping)
    _check_beam(dataset, beam)
    labelled = masks["done"].values & dataset["done"].values
    if not (labelled.any() if ping is None else labelled[ping]):
        which = "no ping" if ping is None else f"ping {ping} not"
        raise InputError(f"{recording} has {which} labelled yet. Label it: insonify run FILE -o {recording} --labels")
    from insonify import plotting

    with _reading(recording):
        plotting.labels(dataset, masks, out, ping=ping, beam=beam, ground=ground, gain=gain)


def explain(
    recording: Recording,
    time: Annotated[str, typer.Option(metavar="TIME", help='When: "201.9 ms" after the start of transmission.')],
    ping: Annotated[int, typer.Option(metavar="P", min=0, help="Which ping, from 0.")] = 0,
    beam: Annotated[
        int | None, typer.Option(metavar="B", min=0, help="Number of the beam, from 0. [default: the strongest then]")
    ] = None,
    bearing: Annotated[
        str | None,
        typer.Option(metavar="ANGLE", help='Of recorded elements: the beam they form towards "20 deg" from the bow.'),
    ] = None,
) -> None:
    """List the arrivals behind one sample, with their losses in dB.

    Example: insonify explain harbour.zarr --ping 12 --time "201.9 ms"
    """
    from insonify.explanation.sample_report import explain_sample
    from insonify.formats.stored_recording import stored_recording

    when = arguments.parse_quantity(time, "time", "--time")
    dataset = stored_recording(location(recording))
    if not {"pressure", "intensity"} & set(dataset.variables):
        raise InputError(f"{recording} keeps recorded numbers only. Simulate with sonar.recorder.keep: both")
    _check_ping(dataset, recording, ping)
    _check_beam(dataset, beam)
    arguments.require_time(time, when, (float(dataset["time"][0]), float(dataset["time"][-1])), "--time")

    look = None if bearing is None else arguments.parse_quantity(bearing, "angle", "--bearing")
    if look is not None and (beam is not None or not _of_elements(dataset)):
        raise InputError(f"--bearing {bearing}: for recordings of elements, and without --beam. Leave one of them out")
    with _reading(recording):
        typer.echo(explain_sample(dataset, ping=ping, time=when, channel=beam, bearing=look))


@contextmanager
def _reading(recording: str | Path) -> Iterator[None]:
    """Errors in a recording are reported with its name."""
    from insonify.diagnostics.diagnostic import ScenarioError

    try:
        yield
    except ScenarioError as error:
        raise InputError(f"{recording}, the scenario in zarr.json: {error}") from None


def _check_ping(dataset: "xr.Dataset", recording: str | Path, ping: int) -> None:
    """Refuse a ping that the recording does not have, or not yet."""
    pings = dataset.sizes["ping"]
    if ping >= pings:
        raise InputError(f"--ping {ping}: the recording has {_numbered('ping', pings)}")
    if not dataset["done"].values[ping]:
        raise InputError(f"--ping {ping}: not simulated yet. {_run_again(recording, ping)}")


def _run_again(recording: str | Path, ping: int) -> str:
    """Advice to simulate a ping."""
    if str(recording).lower().endswith((".nc", ".nc4")):
        return f"Simulate it first: insonify run FILE -o harbour.zarr --pings {ping}, and export that again"
    return f"Simulate it first: insonify run FILE -o {recording} --pings {ping}"


def _check_beam(dataset: "xr.Dataset", beam: int | None) -> None:
    """Refuse a beam that the recording does not have."""
    beams = dataset.sizes["channel"]
    if beam is not None and beam >= beams:
        raise InputError(f"--beam {beam}: the recording has {_numbered('beam', beams)}")


def _numbered(what: str, count: int) -> str:
    return f"{what}s 0 to {count - 1}" if count > 1 else f"only {what} 0"
