"""Pictures of rays: of a measured profile, or of the water and the sonar of a scenario."""

from pathlib import Path
from typing import TYPE_CHECKING

from insonify.cli.arguments import InputError, parse_quantity

if TYPE_CHECKING:
    from insonify.ocean.profile import SoundSpeedProfile

FAR = 200.0
"""Range of the rays of a profile, where none is given [m]."""


def show_rays(what: str, out: Path, *, source_depth: str | None = None, farthest: str | None = None) -> None:
    """Draw a fan of rays beside the profile that bends it.

    Args:
        what: A sound-speed profile (.csv) or a scenario (.yaml).
        out: Picture to write.
        source_depth: Where rays start, as typed; None for the sonar of a scenario.
        farthest: Range of the rays, as typed; None for that of a scenario's window, or 200 m.

    Raises:
        InputError: Neither profile nor scenario, or a depth outside the water; with the fix.
    """
    kind = Path(what).suffix.lower()
    depth = None if source_depth is None else parse_quantity(source_depth, "length", "--source-depth")
    far = None if farthest is None else parse_quantity(farthest, "length", "--range")
    if far is not None and not 0 < far < float("inf"):
        raise InputError(f"--range {farthest}: rays go nowhere; give a distance above 0, such as '200 m'")
    if kind == ".csv":
        _of_a_profile(Path(what), out, depth, far or FAR)
    elif kind in (".yaml", ".yml"):
        _of_a_scenario(Path(what), out, depth, far)
    else:
        raise InputError(f"{what}: --rays draws a sound-speed profile (.csv) or a scenario (.yaml)")


def _of_a_profile(file: Path, out: Path, depth: float | None, far: float) -> None:
    from insonify.cli.physics_plots import profile_in

    profile = profile_in(file)
    try:
        profile.require_depth(float(profile.depth[-1]))
    except ValueError as error:
        raise InputError(f"{file}: {error}") from None
    if depth is None:
        middle = float(profile.depth[-1]) / 2
        raise InputError(f"{file}: where do the rays start? Write --source-depth '{middle:g} m'")
    _draw(profile, out, depth, float(profile.depth[-1]), far, file.name)


def _of_a_scenario(file: Path, out: Path, depth: float | None, far: float | None) -> None:
    from insonify.scenario.load import load_scenario
    from insonify.sonar.sonar import array_position
    from insonify.sonar.track import true_poses

    scenario = load_scenario(file)
    bed = scenario.seabed.depth
    if depth is None:
        track = true_poses(scenario.track)
        depth = float(array_position(scenario.sonar.transmit, track.position[0], track.rotation(0))[2])
    max_range = scenario.water.max_sound_speed * scenario.track.window[1] / 2
    _draw(
        scenario.water.profile_to_depth(bed), out, depth, bed, far or max_range, scenario.title,
        scenario.paths.max_reflections,
    )  # fmt: skip


def _draw(profile: "SoundSpeedProfile", out: Path, depth: float, bed: float, far: float, title: str,
          bounces: int = 2) -> None:  # fmt: skip
    from insonify import plotting

    if not 0 <= depth <= bed:
        raise InputError(f"--source-depth {depth:g} m: not in the water; give a depth from 0 to {bed:g} m")
    plotting.rays(
        profile, out, source_depth=depth, water_depth=bed, max_range=far, bounces=min(bounces, 4), title=title
    )  # fmt: skip
