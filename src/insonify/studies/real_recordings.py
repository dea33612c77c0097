"""Real recordings beside simulated ones: what the engine predicts of instruments that it was not fitted to."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from insonify.studies import (
    echosounder_noise,
    harbour_angular_response,
    harbour_echo_trains,
    sidescan_wreck,
    two_headed_angular_response,
)
from insonify.studies.harbour_angular_response import ANGLES, AngularResults, speckle_moments
from insonify.studies.page import table, write_page

INTRODUCTION = """Public recordings of real instruments are simulated from their own settings (`insonify
scenario-from`), with one sediment fitted at one frequency and everything else predicted. Differences are shown as they
are, with the spread that few pings have. The recordings are test data of themachinethatgoesping/echosounders (MPL-2.0:
Simrad EK80, Kongsberg EM2042 and EM2040) and of CIDCO-dev/OpenSidescan (MIT: sidescan of a wreck). `insonify study
real-recordings -o docs/validation --recordings FOLDER` writes this page anew from a folder with the files.

The simulations take sediment laws, water and interfaces as the documentation describes them. Nothing was tuned to these
files but what each section states as fitted."""
FILES = (
    harbour_echo_trains.FILE,
    harbour_angular_response.FILE,
    two_headed_angular_response.FILE,
    sidescan_wreck.FILE,
)
"""Names of the recordings."""
HALF_SAMPLE = 0.0045
"""Half a sample of most channels of the echosounder [m]."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """One quantity that was to agree, with the limit that was set before."""

    quantity: str
    limit: str
    found: str
    holds: bool


def located(recordings: Path) -> dict[str, Path]:
    """Folder of each recording, in a folder or below it.

    Raises:
        FileNotFoundError: A recording is missing.
    """
    files = {}
    for name in FILES:
        path = next(iter(sorted(recordings.rglob(name))), None)
        if path is None:
            raise FileNotFoundError(f"{recordings} has no {name}. Give the folder of the recordings: --recordings DIR")
        files[name] = path.parent
    return files


def write(folder: Path, recordings: Path) -> list[Path]:
    """Run the study.

    Args:
        folder: Folder of the page `real-recordings.md` and its pictures.
        recordings: Folder with the recordings, `FILES`.

    Returns:
        Files written, the page first.

    Raises:
        FileNotFoundError: A recording is missing.
    """
    folders = located(recordings)
    noise = echosounder_noise.evaluate(folders[harbour_echo_trains.FILE])
    trains = harbour_echo_trains.evaluate(folders[harbour_echo_trains.FILE])
    harbour = harbour_angular_response.evaluate(folders[harbour_angular_response.FILE])
    heads = two_headed_angular_response.evaluate(folders[two_headed_angular_response.FILE])
    wreck = sidescan_wreck.evaluate(folders[sidescan_wreck.FILE])
    verdicts = [*train_verdicts(trains), *speckle_verdicts("EM2042", harbour), *speckle_verdicts("EM2040", heads),
                angle_verdict("EM2042", harbour), angle_verdict("EM2040", heads), noise_verdict(noise)]  # fmt: skip
    rows = [[one.quantity, one.limit, one.found, "holds" if one.holds else "**fails**"] for one in verdicts]
    summary = table(["quantity", "limit", "found", ""], rows)
    sections = [harbour_echo_trains.section(trains), echosounder_noise.section(noise),
                harbour_angular_response.section(harbour), two_headed_angular_response.section(heads),
                sidescan_wreck.section(wreck)]  # fmt: skip
    text = f"{INTRODUCTION}\n\n## What agrees, and what does not\n\n{summary}\n\n{DISAGREEMENTS}"
    return write_page(folder / "real-recordings.md", "Real recordings and simulated ones", text, sections)


def train_verdicts(results: harbour_echo_trains.TrainResults) -> list[Verdict]:
    """Delays and levels of the multiples."""
    lags = np.array([train.late.mean(axis=0)[1:] for train in results.trains])
    worst = np.abs(lags).max(axis=0)
    beyond = np.array([(train.simulated - train.real.mean(axis=0))[1:] for train in results.trains])
    names = ("second", "third")
    delays = [
        Verdict(f"EK80: {name} echo at {n} times the first range", f"half a sample, {1e3 * HALF_SAMPLE:.1f} mm",
                f"at most {1e3 * worst[n - 2]:.0f} mm; {np.sum(np.abs(lags[:, n - 2]) <= HALF_SAMPLE)} of {len(lags)}",
                bool(worst[n - 2] <= HALF_SAMPLE))
        for n, name in enumerate(names, 2)
    ]  # fmt: skip
    levels = [
        Verdict(f"EK80: level of the {name} echo by frequency", "3 dB",
                f"{', '.join(f'{x:+.1f}' for x in beyond[:, k])} dB",
                bool(np.all(np.abs(beyond[:, k]) <= 3)))
        for k, name in enumerate(names)
    ]  # fmt: skip
    return delays + levels


def speckle_verdicts(name: str, results: AngularResults) -> list[Verdict]:
    """Speckle of a seabed image."""
    difference = speckle_moments(results.simulated_speckle) - speckle_moments(results.speckle)
    lines = [speckle_moments([one])[2] for one in results.speckle if one.size]
    variation = speckle_moments(results.simulated_speckle)[2]
    return [
        Verdict(f"{name}: standard deviation of the level of speckle", "0.4 dB", f"{difference[0]:+.2f} dB",
                bool(abs(difference[0]) <= 0.4)),
        Verdict(f"{name}: its skew", "0.2", f"{difference[1]:+.2f}", bool(abs(difference[1]) <= 0.2)),
        Verdict(f"{name}: standard deviation over mean of intensities", "spread of the pings",
                f"{variation:.2f}; real {min(lines):.2f} to {max(lines):.2f}",
                bool(min(lines) <= variation <= max(lines))),
    ]  # fmt: skip


def angle_verdict(name: str, results: AngularResults) -> Verdict:
    """Backscatter from 10 to 65 degrees."""
    rows = np.array([response.difference for response in results.responses])[:, ANGLES >= 10]
    known = np.abs(rows[np.isfinite(rows)])
    count = int(np.sum(known <= 2))
    text = f"{count} of {known.size} within; rms {np.sqrt(np.mean(known**2)):.1f} dB, at most {known.max():.1f} dB"
    return Verdict(f"{name}: level against angle, 10 to 65 degrees", "2 dB", text, count == known.size)


def noise_verdict(results: echosounder_noise.NoiseResults) -> Verdict:
    """Noise floor of the ping to which it was not fitted."""
    difference = results.simulated.level_db - results.predicted.level_db
    return Verdict("EK80: noise floor of another ping", "2 dB", f"{difference:+.1f} dB", abs(difference) <= 2)


DISAGREEMENTS = """Reasons, as far as they are known:

* *Delays.* The leading edge of the second echo lies within one or two samples of twice the first range in most
  channels, but half a sample is finer than the edge of a speckled echo is defined: single simulated pings scatter by
  more. The third echo is late in the simulation too, by the same definition, and not over a smooth bed: it is
  reverberation of the rough bed between two hull reflections, and no echo off a mirror. Tried: the strongest sample
  (late or early by up to 0.4 m), the centre of the energy (no better), and ranges from the leading edge of the
  transmitted pulse, which removes up to 5 cm.
* *Hull and surface.* An echo behind the second at the depth of the transducer, that of the sea surface, stands out at
  38, 120 and 200 kHz; at 70 and 333 kHz reverberation of the second echo covers it.
* *Levels by frequency.* No loss at the hull that rises or falls with frequency mends them: neither a rough hull nor a
  thin plate is the reason. Two pings 1.2 s apart of a moored ship are one look at the first echo, so that differences
  re the first echo have the standard error of one. Changed on the way: the pulse has the envelope that the file states
  (3 dB less energy at 38 kHz), the bed lies at the leading edge, the fit counts each hull reflection once, and one
  ping of 120 kHz, into which another sonar transmits, is left out.
* *Level against angle.* Near the vertical the real beds return a narrow peak that the simulated sediment spreads. At
  its outermost angles the real level of the EM2040 falls below any sediment of the handbook; its one transmitter serves
  both heads there, near the edge of its sector. Steps between the sectors of the EM2042, whose source levels and
  sensitivities are stated to a few tenths and differ by more, remain in the real responses. All laws are trusted to
  100 kHz: everything from 190 kHz on extrapolates them.
* *Speckle.* Differences are two to three standard errors. Simulated speckle is Rayleigh's; the level of the EM2042 is
  less skewed than that, as if neighbouring samples were averaged a little before they are written.
* *Wreck.* The simulated water holds no scatterers, so that the water column and the shadow of the hull are darker than
  the real ones. Far away, where the grazing angle is 6 degrees, the real bed varies three times as much: relief casts
  shadows there, and the simulated bed is flat. The wreck is a sketch of planks."""
