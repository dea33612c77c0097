"""Angular response at another place: a two-headed multibeam of 300 kHz from 5 to 65 degrees, real and simulated.

A Kongsberg EM2040, 9.8 m above the bed, with a head turned to each side. Its soundings state backscatter strength,
freed by the maker of spreading, absorption, area and the sonar's own levels; its seabed image is flattened besides, by
20 log cos(angle) beyond the crossover angle. The sediment is fitted to one head and predicts the other.
"""

from pathlib import Path

import numpy as np
import xarray as xr

from insonify.formats.instruments import open_instrument
from insonify.formats.instruments.scenario_text import scenario_text
from insonify.scenario.load import parse_model
from insonify.scenario.scenario import Scenario
from insonify.studies.harbour_angular_response import (
    DRAWS,
    OUTER,
    SEDIMENTS,
    AngularResults,
    Floats,
    Response,
    draw,
    mean_by_angle,
    middle_level,
    response_table,
    simulated_response,
    simulated_speckle,
    speckle,
    speckle_table,
)
from insonify.studies.page import Section

FILE = "em2040-belgica-0077.all"


def evaluate(folder: Path) -> AngularResults:
    """Fit the sediment to one head, and predict the other."""
    with open_instrument(folder / FILE) as file:
        soundings, image = file.read("soundings").load(), file.read("seabed image").load()
        base = parse_model(Scenario, scenario_text(file, "bed", "soundings"))
        arm = file.lever_arm()
    angle = signed_angle(soundings, np.zeros(3) if arm is None else np.asarray(arm.position))
    frequency, heads = float(soundings["frequency"].median()), np.unique(soundings["serial"].values)
    rows = [np.flatnonzero(soundings["serial"].values == head) for head in heads]
    real = [mean_by_angle(np.abs(angle[row]).ravel(), soundings["backscatter"].values[row].ravel()) for row in rows]
    simulated = {sediment: simulated_response(base, frequency, sediment) for sediment in SEDIMENTS}
    misfit = {}
    for sediment in SEDIMENTS:
        misfit[sediment] = float(np.sqrt(np.nanmean(_response("", *real[0], simulated[sediment]).difference ** 2)))
        print(f"{sediment}: {misfit[sediment]:.1f} dB rms")
    best = min(misfit, key=lambda name: misfit[name])
    responses = [_response(f"head {head}", *one, simulated[best]) for head, one in zip(heads, real, strict=True)]
    sides = [(row, side) for row in np.concatenate(rows) for side in (-1, 1)]
    contrasts = [_one_side(image, angle, row, side) for row, side in sides]
    outer = (np.abs(angle) > OUTER[0]) & (np.abs(angle) < OUTER[1])
    spacing = np.abs(np.diff(angle, axis=1))[outer[:, 1:]]
    drawn = [simulated_speckle(base, frequency, best, seed + 1, float(np.median(spacing))) for seed in range(DRAWS)]
    return AngularResults(responses, best, misfit, contrasts, drawn)


def signed_angle(soundings: xr.Dataset, arm: Floats) -> Floats:
    """Angle of each sounding from the vertical through the transducer, positive to starboard [deg], (ping, beam).

    Args:
        soundings: Soundings, whose positions are re the antenna.
        arm: The transducer from the antenna: forward, starboard, down [m], shape (3,).
    """
    across, along = soundings["starboard"].values - arm[1], soundings["forward"].values - arm[0]
    return np.asarray(np.degrees(np.sign(across) * np.arctan2(np.hypot(across, along), soundings["down"].values)))


def _response(name: str, mean: Floats, error: Floats, simulated: Floats) -> Response:
    """Response of a head, both sides together, re its mean over the angles."""
    known = np.isfinite(mean)
    predicted = np.where(known, simulated, np.nan)
    return Response(name, mean - mean[known].mean(), error, predicted - predicted[known].mean())


def _one_side(image: xr.Dataset, angle: Floats, ping: int, side: int) -> Floats:
    """Speckle of the beams to one side."""
    level = middle_level(image.isel(ping=ping))
    on_side = (side * angle[ping] > 0) & np.isfinite(level)
    return speckle(side * angle[ping][on_side], level[on_side])


def section(results: AngularResults) -> Section:
    """Text and picture of the recording."""
    fits = ", ".join(f"{name} {rms:.1f} dB" for name, rms in results.misfit.items())
    text = f"""## Angular response at another place: Kongsberg EM2040, 300 kHz, two heads

Nine pings, five of one head and four of the other; both sides together. The sediment fitted to the first head is
{results.sediment} (rms difference by sediment: {fits}).

{response_table(results.responses, (0,))}

{speckle_table(results.speckle, results.simulated_speckle)}"""
    return Section(text, draw(results.responses), "two-headed-angular-response", "Backscatter by angle of two heads")
