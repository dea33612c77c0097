"""Products of element recordings: the picture of their kind of sonar, and numbers beside the truth.

A forward-looking sonar gives a fan, a multibeam soundings, an interferometer depths, a synthetic aperture a strip.
Which of them a recording is follows from the sonar in its scenario.
"""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from insonify.frames import mounting_rotation
from insonify.paper.checked_numbers import CheckedNumber
from insonify.plotting import style
from insonify.plotting.recording_levels import progress_note, recording_levels
from insonify.scenario.scenario import Scenario
from insonify.sonar.hydrophones import element_layout

KINDS = ("forward-looking", "multibeam", "interferometric", "synthetic-aperture")
"""Products that can be recognised from a recording."""
DOWN = np.sin(np.radians(45))
"""A boresight that looks further down than this is a multibeam's [1]."""
AHEAD = np.cos(np.radians(45))
"""One that looks further ahead than this is a forward-looking sonar's [1]."""
FEWEST = 4
"""Elements from which on beams are made [1]."""


def product_kind(scenario: Scenario | None) -> str | None:
    """Product of a scenario's recordings: one of `KINDS`; None where the recording is drawn as it is.

    Args:
        scenario: What was simulated; None: it is not known.
    """
    if scenario is None or scenario.field != "coherent" or scenario.sonar.receiver.record != "elements":
        return None
    sonar = scenario.sonar
    if sonar.receiver.synthetic_aperture is not None and scenario.track.ping_count > 1:
        return "synthetic-aperture" if sonar.sides is None else None
    turned = mounting_rotation(sonar.mounting.bearing, sonar.mounting.tilt)
    place = element_layout(sonar.receive)[0] @ turned
    across, high = np.ptp(place[:, 1]), np.ptp(place[:, 2])
    ahead, _, down = turned[0]
    if sonar.beam_count == 2 and high > 0 and np.ptp(place[:, 0]) < 1e-3 * high:
        return "interferometric"
    if sonar.beam_count < FEWEST or across == 0 or sonar.sides is not None:
        return None
    return "multibeam" if down > DOWN else "forward-looking" if ahead > AHEAD else None


def product(recording: xr.Dataset, *, ping: int | None = None) -> tuple[Figure, list[CheckedNumber]]:
    """The picture of a recording of elements, and its numbers.

    Args:
        recording: As from `simulate` or `open_recording`, of a scenario that has a `product_kind`.
        ping: Number of the ping that is looked at closer; None: one that is chosen.

    Raises:
        ValueError: A recording of no such kind, or without a ping.
    """
    scenario = _scenario(recording)
    what = product_kind(scenario)
    if scenario is None or what is None:
        raise ValueError("there is no product for this recording: it is not one of elements that make beams or depths.")
    pings = recording.sizes["ping"]
    if "done" in recording:
        recording = recording.isel(ping=np.flatnonzero(recording["done"].values))
    if recording.sizes["ping"] == 0:
        raise ValueError("the recording holds no ping yet. Run the scenario to the end, or at least one ping of it.")
    module = what.replace("-", "_")
    make: Callable[..., tuple[Figure, list[CheckedNumber]]] = getattr(import_module(f"{__name__}.{module}"), module)
    if part := progress_note(recording.sizes["ping"], pings):
        scenario = scenario.model_copy(update={"title": ", ".join(filter(None, (scenario.title, part)))})
    return make(recording.load(), scenario, ping)


def draw(recording: xr.Dataset, path: str | Path, *, ping: int | None = None) -> list[CheckedNumber]:
    """Draw what a recording of elements is made into; see `product`.

    Args:
        recording: The recording.
        path: Picture to write, .png, .pdf or .svg.
        ping: Number of the ping that is looked at closer.

    Returns:
        Its numbers.
    """
    with style.plot_style():
        figure, numbers = product(recording, ping=ping)
        style.save_figure(figure, path)
    return numbers


def draw_product(recording: xr.Dataset, path: str | Path, *, ping: int | None = None) -> bool:
    """Draw a recording's product where it has one, and say whether it has.

    Args:
        recording: The recording.
        path: Picture to write, .png, .pdf or .svg.
        ping: Number of the ping that is looked at closer.
    """
    if product_kind(_scenario(recording)) is None:
        return False
    draw(recording, path, ping=ping)
    return True


def _scenario(recording: xr.Dataset) -> Scenario | None:
    """Simulated scenario, where the recording holds it and its files exist."""
    return recording_levels(recording.isel(ping=slice(0, 1), channel=slice(0, 1), time=slice(0, 2))).scenario
