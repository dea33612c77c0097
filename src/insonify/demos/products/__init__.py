"""Products of recordings of elements: the figure for the kind of sonar, and numbers compared with the truth.

A forward-looking sonar gives a sector image, a multibeam soundings, an interferometer depths, a synthetic aperture a
strip map. The kind follows from the sonar in the scenario.
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
"""Kinds of products."""
DOWN = np.sin(np.radians(45))
"""Downward component of a boresight above which a sonar is a multibeam [1]."""
AHEAD = np.cos(np.radians(45))
"""Forward component of a boresight above which a sonar is forward-looking [1]."""
FEWEST = 4
"""Fewest elements for beamforming [1]."""


def product_kind(scenario: Scenario | None) -> str | None:
    """Kind of product of a scenario's recordings, one of `KINDS`; None where the recording has no product.

    Args:
        scenario: Scenario of the recording; None: unknown.
    """
    if scenario is None or scenario.field != "coherent" or scenario.sonar.receiver.record != "elements":
        return None
    sonar = scenario.sonar
    if sonar.receiver.synthetic_aperture is not None and scenario.track.ping_count > 1:
        return "synthetic-aperture" if sonar.sides is None else None
    rotation = mounting_rotation(sonar.mounting.bearing, sonar.mounting.tilt)
    position = element_layout(sonar.receive)[0] @ rotation
    across, high = np.ptp(position[:, 1]), np.ptp(position[:, 2])
    ahead, _, down = rotation[0]
    if sonar.beam_count == 2 and high > 0 and np.ptp(position[:, 0]) < 1e-3 * high:
        return "interferometric"
    if sonar.beam_count < FEWEST or across == 0 or sonar.sides is not None:
        return None
    return "multibeam" if down > DOWN else "forward-looking" if ahead > AHEAD else None


def product(recording: xr.Dataset, *, ping: int | None = None) -> tuple[Figure, list[CheckedNumber]]:
    """Compute the product of a recording of elements: its figure and its numbers.

    Args:
        recording: As from `simulate` or `open_recording`, of a scenario that has a `product_kind`.
        ping: Number of the ping drawn in detail; None: chosen by the product.

    Raises:
        ValueError: The recording has no product, or no ping.
    """
    scenario = _scenario(recording)
    kind = product_kind(scenario)
    if scenario is None or kind is None:
        raise ValueError("there is no product for this recording: it is not one of elements that make beams or depths.")
    pings = recording.sizes["ping"]
    if "done" in recording:
        recording = recording.isel(ping=np.flatnonzero(recording["done"].values))
    if recording.sizes["ping"] == 0:
        raise ValueError("the recording holds no ping yet. Run the scenario to the end, or at least one ping of it.")
    module = kind.replace("-", "_")
    make: Callable[..., tuple[Figure, list[CheckedNumber]]] = getattr(import_module(f"{__name__}.{module}"), module)
    if part := progress_note(recording.sizes["ping"], pings):
        scenario = scenario.model_copy(update={"title": ", ".join(filter(None, (scenario.title, part)))})
    return make(recording.load(), scenario, ping)


def draw(recording: xr.Dataset, path: str | Path, *, ping: int | None = None) -> list[CheckedNumber]:
    """Draw the product of a recording of elements; see `product`.

    Args:
        recording: Recording of elements.
        path: File of the figure, .png, .pdf or .svg.
        ping: Number of the ping drawn in detail.

    Returns:
        Numbers of the product.
    """
    with style.plot_style():
        figure, numbers = product(recording, ping=ping)
        style.save_figure(figure, path)
    return numbers


def draw_product(recording: xr.Dataset, path: str | Path, *, ping: int | None = None) -> bool:
    """Draw the product of a recording, if it has one.

    Args:
        recording: Recording to draw.
        path: File of the figure, .png, .pdf or .svg.
        ping: Number of the ping drawn in detail.

    Returns:
        True where the recording has a product.
    """
    if product_kind(_scenario(recording)) is None:
        return False
    draw(recording, path, ping=ping)
    return True


def _scenario(recording: xr.Dataset) -> Scenario | None:
    """Scenario of a recording; None where it is not stored or a file that it names is missing."""
    return recording_levels(recording.isel(ping=slice(0, 1), channel=slice(0, 1), time=slice(0, 2))).scenario
