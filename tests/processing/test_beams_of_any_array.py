"""Delay and sum as its definition states, in float64, for arrays of any shape in any place."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.processing import beamform_delay_sum, beamform_fft
from oracles.point_echoes import bell, received, two_way

RATE, WIDTH = 40e3, 6e3
PULSE = bell(WIDTH)
SEEDS = st.integers(0, 10**6)


def unit(rng, count):
    """Directions at random."""
    vectors = rng.normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def drawn(seed):
    """An array of any shape, a transmitter apart from it, echoes that all come back in 3 ms, and some beams."""
    rng = np.random.default_rng(seed)
    values = {
        "centre_frequency": float(rng.uniform(30e3, 400e3)), "sound_speed": float(rng.uniform(1420, 1560)),
        "shading": rng.uniform(0.2, 1, int(rng.integers(1, 9))), "transmitter": rng.uniform(-300, 300, 3),
    }  # fmt: skip
    elements = values["transmitter"] + rng.uniform(-2, 2, 3) + rng.uniform(-0.4, 0.4, (values["shading"].size, 3))
    looks, middle = unit(rng, 3), elements.mean(axis=0)
    points = middle + rng.uniform(8, 9, (4, 1)) * np.concatenate([looks, unit(rng, 1)])
    delay = two_way(points, values["transmitter"], elements, values["sound_speed"])
    time = np.arange(delay.min() - 1e-3, delay.max() + 1e-3, 1 / RATE)
    return values, elements, looks, points, delay, time, rng.normal(size=4) + 1j * rng.normal(size=4)


def amplitude_weights(values, elements, looks, delay, time, amplitude, *, focus=None, centre=None):
    """Sum over elements of their pressure at the time when an echo of the focus arrives, turned back in phase."""
    middle = elements.mean(axis=0) if centre is None else centre
    f, c, sent = values["centre_frequency"], values["sound_speed"], values["transmitter"] - middle
    out = np.zeros((len(looks), time.size), complex)
    for row, look in zip(out, looks, strict=True):
        # the range r of an echo that is received in the middle at t: |r u - d| + r = c t
        away = ((c * time) ** 2 - sent @ sent) / (2 * (c * time - sent @ look))
        away = away if focus is None else np.full(time.size, focus)
        for weight, place, late in zip(values["shading"] / values["shading"].sum(), elements, delay.T, strict=True):
            later = (np.linalg.norm(away[:, None] * look - (place - middle), axis=1) - away) / c
            turned = np.exp(2j * np.pi * (f * (later[:, None] - late) % 1))
            row += weight * (turned * PULSE((time + later)[:, None] - late)) @ amplitude
    return out


@settings(max_examples=40)
@given(SEEDS)
def test_a_beam_is_the_sum_written_out(seed):
    """Elements in three dimensions, kilometres from nowhere, any carrier, speed and weights: within -60 dB."""
    values, elements, looks, _, delay, time, amplitude = drawn(seed)
    series = received(time, delay, values["centre_frequency"], PULSE, amplitude)
    found = beamform_delay_sum(series, elements, time, looks, threads=1, **values)
    exact = amplitude_weights(values, elements, looks, delay, time, amplitude)
    assert np.abs(found - exact).max() < 1e-3 * np.abs(amplitude).sum()


@settings(max_examples=20)
@given(SEEDS, st.floats(2, 30))
def test_a_fixed_focus_and_a_centre_of_ones_own_are_the_sum_written_out(seed, focus):
    """Beams that start elsewhere, focused at one range: within -60 dB."""
    values, elements, looks, _, delay, time, amplitude = drawn(seed)
    centre = elements.mean(axis=0) + np.random.default_rng(seed + 1).uniform(-0.3, 0.3, 3)
    series = received(time, delay, values["centre_frequency"], PULSE, amplitude)
    found = beamform_delay_sum(series, elements, time, looks, threads=1, focus=focus, centre=centre, **values)
    exact = amplitude_weights(values, elements, looks, delay, time, amplitude, focus=focus, centre=centre)
    assert np.abs(found - exact).max() < 1e-3 * np.abs(amplitude).sum()


@settings(max_examples=20)
@given(SEEDS)
def test_a_beam_at_a_point_receives_it_as_its_centre_would(seed):
    """At the point's delay by way of the centre: its amplitude and the carrier's phase there, whatever the array."""
    values, elements, looks, points, delay, time, _ = drawn(seed)
    middle = elements.mean(axis=0)
    for look, point, late in zip(looks, points, delay, strict=False):
        series = received(time, late[None], values["centre_frequency"], PULSE)
        found = beamform_delay_sum(series, elements, time, look[None], threads=1, **values)[0]
        alone = two_way(point[None], values["transmitter"], middle[None], values["sound_speed"])[0, 0]
        turn = np.exp(-2j * np.pi * (values["centre_frequency"] * alone % 1))
        bins = np.fft.fftfreq(time.size, 1 / RATE)
        read = np.mean(np.fft.fft(found) * np.exp(2j * np.pi * bins * (alone - time[0])))
        assert read == pytest.approx(turn, abs=5e-3)


@settings(max_examples=20)
@given(SEEDS)
def test_a_mirrored_array_receives_the_mirrored_world(seed):
    """Elements, transmitter and beams reflected in a plane: no beam changes, to -80 dB."""
    values, elements, looks, _, delay, time, amplitude = drawn(seed)
    series = received(time, delay, values["centre_frequency"], PULSE, amplitude)
    normal = unit(np.random.default_rng(seed), 1)[0]
    mirror = np.eye(3) - 2 * np.outer(normal, normal)
    plain = beamform_delay_sum(series, elements, time, looks, threads=1, **values)
    there = {**values, "transmitter": values["transmitter"] @ mirror}
    found = beamform_delay_sum(series, elements @ mirror, time, looks @ mirror, threads=1, **there)
    assert np.abs(found - plain).max() < 1e-4 * np.abs(amplitude).sum()


@pytest.mark.parametrize("count", [8, 17, 64])
def test_a_full_set_of_beams_holds_all_that_the_elements_received(count):
    """N beams 2 / N apart in sine over a line of half wavelengths: mean power of beams is that of elements over N.

    Parseval for the transform along the line; of a tone, since off the carrier the beams are not quite square to one
    another: the slow rise takes 1e-3 of it.
    """
    rng, time = np.random.default_rng(count), np.arange(4000) / RATE
    tones = rng.normal(size=(count, 1)) + 1j * rng.normal(size=(count, 1))
    series = (tones * np.hanning(time.size)).astype(np.complex64)
    sines = (np.arange(count) - (count - 1) / 2) * 2 / count
    beams = beamform_fft(series, time, sines, spacing=0.0075, centre_frequency=100e3)
    assert np.mean(np.abs(beams) ** 2) * count == pytest.approx(np.mean(np.abs(series) ** 2), rel=1e-3)


@settings(max_examples=15)
@given(SEEDS)
def test_both_ways_of_forming_beams_agree_far_away(seed):
    """A line of any spacing, noise in half the band: chirp transform and delay and sum within -60 dB (rms)."""
    rng = np.random.default_rng(seed)
    count, pitch, f = int(rng.integers(2, 20)), float(rng.uniform(0.002, 0.02)), float(rng.uniform(50e3, 300e3))
    time, sines = 0.02 + np.arange(400) / RATE, np.sort(rng.uniform(-0.9, 0.9, 2))
    white = rng.normal(size=(count, 400)) + 1j * rng.normal(size=(count, 400))
    series = (np.fft.ifft(white * (np.abs(np.fft.fftfreq(400)) < 0.25)) * np.hanning(400)).astype(np.complex64)
    line = np.zeros((count, 3))
    line[:, 0] = (np.arange(count) - (count - 1) / 2) * pitch
    looks = np.stack([sines, np.sqrt(1 - sines**2), 0 * sines], axis=1)
    summed = beamform_delay_sum(series, line, time, looks, centre_frequency=f, focus="far", threads=1)
    turned = beamform_fft(series, time, sines, spacing=pitch, centre_frequency=f)
    assert np.linalg.norm(turned - summed) < 1e-3 * np.linalg.norm(summed)
