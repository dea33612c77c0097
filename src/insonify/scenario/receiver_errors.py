"""Errors and warnings of the receiver: noise, feedthrough, blanking, gain, analog-to-digital conversion."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from pydantic_core import PydanticCustomError

from insonify.model import field_error
from insonify.sonar.received_pulse import received_pulse
from insonify.sonar.receiver import FULL_TO_FLAT_BANDWIDTH
from insonify.synthesis.channel_noise import sea_noise_spectrum
from insonify.synthesis.noise import noise_intensity
from insonify.synthesis.receiver_chain import receiver_gain
from insonify.units import amplitude_ratio, level_db

if TYPE_CHECKING:
    from insonify.scenario.scenario_parts import ScenarioParts

MAX_ELEMENTS = 4096
"""Elements whose noise is drawn together: their covariance takes 0.3 GB."""
MIN_NOISE_STEPS = 0.5
"""Rms noise in one quadrature below which nearly all samples of a converter are 0 [steps]."""


def receiver_errors(scenario: ScenarioParts) -> Iterator[PydanticCustomError]:
    """Errors in the settings of noise and receiver that prevent a simulation."""
    sonar, track, receiver = scenario.sonar, scenario.track, scenario.sonar.receiver
    if receiver.matched_filter and receiver.stages:
        yield field_error("sonar.receiver.matched_filter", "true", "records what a matched filter makes of the sound "
                      f"after {receiver.stages[-1]}. Write matched_filter: false, and compress the recording "
                      "afterwards (insonify.processing.compressed_recording), or leave the part out.")  # fmt: skip
    leak = None if receiver.crosstalk is None else receiver.crosstalk.neighbours_db
    if leak is not None and receiver.record == "beams":
        yield field_error("sonar.receiver.crosstalk.neighbours_db", f"{leak:g} dB", "is between elements, and beams "
                      "are recorded. Write record: elements, or leave it out.")  # fmt: skip
    if receiver.blanking is not None and sonar.pulse.duration + receiver.blanking >= track.window[1]:
        yield field_error("sonar.receiver.blanking", f"{receiver.blanking * 1e3:g} ms", "after the pulse is as long as "
                      f"the window, {track.window[1] * 1e3:g} ms: nothing is recorded. Give less.")  # fmt: skip
    yield from _recorder_errors(scenario)
    yield from _out_of_band_errors(scenario)
    yield from _too_many_elements_error(scenario)


def _recorder_errors(scenario: ScenarioParts) -> Iterator[PydanticCustomError]:
    """Errors of a recorder that needs more samples or pings than there are."""
    recorder, track = scenario.sonar.recorder, scenario.track
    if recorder is None:
        return
    from insonify.processing.recorder import recorded_time  # with xarray, which other checks do without

    if recorder.pings_per_line > track.ping_count:
        yield field_error("sonar.recorder", None, f"makes a line of {recorder.pings_per_line} pings, and the track has "
                          f"{track.ping_count}. Give fewer looks, or more pings.")  # fmt: skip
    rate = scenario.sonar.receiver.sample_rate
    try:
        recorded_time(np.arange(int((track.window[1] - track.window[0]) * rate)) / rate, recorder)
    except ValueError as error:
        yield field_error("sonar.recorder", None, f"{error}.")


def _out_of_band_errors(scenario: ScenarioParts) -> Iterator[PydanticCustomError]:
    """Errors of tones outside the receiver's band."""
    receiver, centre = scenario.sonar.receiver, scenario.sonar.pulse.frequency
    edge = FULL_TO_FLAT_BANDWIDTH / 2 * receiver.bandwidth
    for row, tone in enumerate(() if receiver.self_noise is None else receiver.self_noise.tones):
        if abs(tone.frequency - centre) >= edge:
            yield field_error(
                f"sonar.receiver.self_noise.tones.{row}.frequency", f"{tone.frequency / 1e3:g} kHz",
                f"is not in the band, {(centre - edge) / 1e3:g} to {(centre + edge) / 1e3:g} kHz. Leave the tone out, "
                "or widen the band.",
            )  # fmt: skip


def _too_many_elements_error(scenario: ScenarioParts) -> Iterator[PydanticCustomError]:
    """Elements whose covariance would not fit."""
    sonar, water = scenario.sonar, scenario.water
    noisy = water.noise is not None or water.noise_level_db is not None
    if noisy and sonar.receiver.record == "elements" and sonar.beam_count > MAX_ELEMENTS:
        field = "noise" if water.noise is not None else "noise_level_db"
        yield field_error(f"water.{field}", None, f"is correlated between neighbouring elements, and there are "
                      f"{sonar.beam_count}; record {MAX_ELEMENTS} or fewer, or give sonar.receiver.self_noise "
                      "instead, which is each element's own.")  # fmt: skip


def receiver_warnings(scenario: ScenarioParts) -> Iterator[str]:
    """A sentence on each doubtful setting."""
    sonar, water = scenario.sonar, scenario.water
    receiver, stop = sonar.receiver, scenario.track.window[1]
    if sonar.pulse.duration > stop:
        yield (f"sonar.pulse.duration: {sonar.pulse.duration * 1e3:g} ms is longer than track.window, up to "
               f"{stop * 1e3:g} ms: no echo is recorded whole. Give a shorter pulse or a longer window.")  # fmt: skip
    if receiver.record == "elements" and len(set(receiver.errors.dead)) == sonar.beam_count:
        yield (f"sonar.receiver.errors.dead: all {sonar.beam_count} elements are among them: no echo is recorded. "
               "Leave some out.")  # fmt: skip
    if receiver.adc is None:
        if receiver.gain is not None:
            yield ("sonar.receiver.gain: it is divided out again, and without a converter there is nothing between: "
                   "the recording is the same without it. Give a converter, or leave the gain out.")  # fmt: skip
        _rms_noise(scenario)
        return
    time = np.linspace(*scenario.track.window, 101)
    most = float(np.min(amplitude_ratio(receiver.adc.full_scale_db) / receiver_gain(sonar, water, time)))
    noise = _rms_noise(scenario)
    if noise > most:
        yield (f"sonar.receiver.adc: at full gain it takes {2 * level_db(most):.0f} dB re 1 uPa, and noise alone "
               f"is {2 * level_db(noise):.0f} dB. Give less gain, or a higher full_scale_db.")  # fmt: skip
    if receiver.adc.bits is None:
        return
    step = most * 2.0 ** (1 - receiver.adc.bits)
    if noise < MIN_NOISE_STEPS * np.sqrt(2) * step:
        yield (f"sonar.receiver.adc.bits: at full gain its step is that of {2 * level_db(step):.0f} dB re 1 uPa, "
               "above the noise; sound that is weaker than half a step is rounded to 0. Give more gain or bits, "
               "or a lower full_scale_db.")  # fmt: skip


def _rms_noise(scenario: ScenarioParts) -> float:
    """Noise in the band of one channel, if it had no directivity [uPa]; its laws warn of themselves."""
    water, pulse = scenario.water, received_pulse(scenario.sonar)
    own = scenario.sonar.receiver.self_noise
    levels = [water.noise_level_db, None if own is None else own.level_db]
    if water.noise is not None:
        levels.append(sea_noise_spectrum(water.noise, pulse).level_db)
    return float(np.sqrt(sum(noise_intensity(pulse, level) for level in levels)))
