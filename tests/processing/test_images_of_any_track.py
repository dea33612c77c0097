"""Back-projection as its definition states, in float64, for tracks of any shape and sonars that run on."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.processing import backproject
from oracles.point_echoes import bell

RATE, PULSE = 40e3, bell(6e3)
SEEDS = st.integers(0, 10**6)


def delays(places, sent, received, velocity, speed):
    """Out to places (n, 3) and back to receivers that run on [s], shape (ping, channel, n): by iteration."""
    out = np.linalg.norm(places - sent[:, None], axis=-1)[:, None]
    late = np.zeros((*received.shape[:2], len(places)))
    for _ in range(12):  # each step gains a factor of v / c
        there = received[:, :, None] + velocity[:, :, None] * late[..., None]
        late = (out + np.linalg.norm(places - there, axis=-1)) / speed
    return late


def drawn(seed):
    """Three pings of up to three receivers somewhere, echoes of four points, and pixels among these."""
    rng = np.random.default_rng(seed)
    home, channels = rng.uniform(-2000, 2000, 3), int(rng.integers(1, 4))
    sent = home + rng.uniform(-1, 1, (3, 3))
    received = sent[:, None] + rng.uniform(-0.5, 0.5, (3, channels, 3))
    velocity = rng.uniform(-8, 8, (3, channels, 3))
    away = rng.normal(size=3)
    points = home + 25 * away / np.linalg.norm(away) + rng.uniform(-0.3, 0.3, (4, 3))
    values = {"centre_frequency": float(rng.uniform(50e3, 400e3)), "sound_speed": float(rng.uniform(1420, 1560))}
    late = delays(points, sent, received, velocity, values["sound_speed"])
    time = np.arange(late.min() - 1.5e-3, late.max() + 1.5e-3, 1 / RATE)
    amplitude = rng.normal(size=4) + 1j * rng.normal(size=4)
    turn = amplitude * np.exp(-2j * np.pi * (values["centre_frequency"] * late % 1))
    series = np.einsum("pcn,pcnt->pct", turn, PULSE(time - late[..., None])).astype(np.complex64)
    pixels = np.concatenate([points, points.mean(axis=0) + rng.uniform(-0.5, 0.5, (30, 3))])
    return values, series, time, (sent, received, velocity), (late, turn), pixels, rng


def amplitude_weights(values, way, echoes, pixels, weight):
    """Weighted mean over the series of what each received at a pixel's own delay, turned back, shape (pixel,)."""
    expected = delays(pixels, *way, values["sound_speed"])
    read = np.einsum("pcn,pcxn->pcx", echoes[1], PULSE(expected[..., None] - echoes[0][:, :, None]))
    back = np.exp(2j * np.pi * (values["centre_frequency"] * expected % 1))
    weights = np.broadcast_to(weight, expected.shape)
    return np.sum(weights * read * back, axis=(0, 1)) / np.sum(weights, axis=(0, 1))


@settings(max_examples=40)
@given(SEEDS)
def test_an_image_is_the_sum_written_out(seed):
    """Any track, receivers apart that run on at up to 14 m/s, weights for each series: within -60 dB."""
    values, series, time, way, echoes, pixels, rng = drawn(seed)
    weight = rng.uniform(0.1, 1, series.shape[:2])
    found = backproject(
        series, time, way[0], way[1], pixels, receive_velocity=way[2], shading=weight, threads=1, **values
    )
    exact = amplitude_weights(values, way, echoes, pixels, weight[..., None])
    assert np.abs(found - exact).max() < 1e-3 * np.abs(echoes[1]).sum(axis=-1).max()


@settings(max_examples=20)
@given(SEEDS, st.floats(0.02, 1.2))
def test_a_limit_of_angles_leaves_out_what_lies_beyond_it(seed, widest):
    """Pings from which a pixel lies within the angle off broadside, seen from the transmitter, and no others."""
    values, series, time, way, echoes, pixels, rng = drawn(seed)
    along = rng.normal(size=(3, 3))
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    seen = pixels - way[0][:, None]
    sine = np.abs(np.einsum("pxi,pi->px", seen, along)) / np.linalg.norm(seen, axis=-1)
    clear = np.all(np.abs(sine / np.sin(widest) - 1) > 1e-6, axis=0)
    some = clear & (sine <= np.sin(widest)).any(axis=0)
    found = backproject(
        series,
        time,
        way[0],
        way[1],
        pixels,
        receive_velocity=way[2],
        track_direction=along,
        max_angle=widest,
        threads=1,
        **values,
    )
    np.testing.assert_array_equal(found[clear & ~some], 0)
    if some.any():
        inside = (sine <= np.sin(widest))[:, None, some]
        exact = amplitude_weights(values, way, echoes, pixels[some], inside)
        assert np.abs(found[some] - exact).max() < 1e-3 * np.abs(echoes[1]).sum(axis=-1).max()


@settings(max_examples=15)
@given(SEEDS)
def test_ends_may_be_exchanged(seed):
    """Reciprocity: stop and hop, one receiver, transmitter and receiver in each other's places: the same image."""
    values, series, time, way, _, pixels, _ = drawn(seed)
    sent, received = way[0], way[1][:, :1]
    there = backproject(series[:, :1], time, sent, received, pixels, threads=1, **values)
    back = backproject(series[:, :1], time, received[:, 0], sent[:, None], pixels, threads=1, **values)
    np.testing.assert_allclose(back, there, atol=1e-5 * np.abs(series).max())


@settings(max_examples=15)
@given(SEEDS)
def test_an_image_of_all_pings_is_the_mean_of_the_images_of_each(seed):
    """One ping at a time, in any order, and one channel at a time: the same sum."""
    values, series, time, way, _, pixels, rng = drawn(seed)
    whole = backproject(series, time, *way[:2], pixels, receive_velocity=way[2], threads=1, **values)
    parts = [
        backproject(series[p : p + 1, c : c + 1], time, way[0][p : p + 1], way[1][p : p + 1, c : c + 1], pixels,
                    receive_velocity=way[2][p : p + 1, c : c + 1], threads=1, **values)
        for p in rng.permutation(3) for c in range(series.shape[1])
    ]  # fmt: skip
    np.testing.assert_allclose(np.mean(parts, axis=0), whole, atol=1e-5 * np.abs(series).max())


@settings(max_examples=15)
@given(SEEDS, st.floats(-5, 5))
def test_a_clock_that_is_set_anew_moves_nothing(seed, half_metres):
    """Time and echoes later by what a place farther by as much on both ways would be: phases and all.

    A point on the ray beyond all ends of a sonar in one place is farther by the same from each.
    """
    drawn_values, *_, rng = drawn(seed)
    f, c = drawn_values["centre_frequency"], drawn_values["sound_speed"]
    look = rng.normal(size=3)
    look /= np.linalg.norm(look)
    values = []
    for far in (25.0, 25.0 + half_metres):
        time = 2 * far / c + np.arange(-60, 61) / RATE
        echo = np.exp(-2j * np.pi * (f * 2 * far / c % 1)) * PULSE(time - 2 * far / c)
        pixels = (far + np.linspace(-0.1, 0.1, 5))[:, None] * look
        values.append(
            backproject(
                echo[None, None].astype(np.complex64),
                time,
                np.zeros((1, 3)),
                np.zeros((1, 1, 3)),
                pixels,
                **drawn_values,
            )
        )
    np.testing.assert_allclose(values[1], values[0], atol=5e-4)
