"""Samples of every kind of source: ranges, gains undone, groups, sides, angles."""

import numpy as np
import pytest
import xarray as xr

from insonify.comparison.instrument_samples import group_samples
from insonify.comparison.sources import samples_of
from insonify.formats.store_description import StoreError
from insonify.records.image import image_dataset
from oracles import instrument_files as files
from oracles.compared_scenes import SIDESCAN, drawn


def pings(values, **settings):
    """Pings of an instrument as a reader returns them."""
    dims = ("ping", "beam", "sample")[: values.ndim] if values.ndim == 3 else ("ping", "sample")
    name = settings.pop("name", "level")
    return xr.Dataset({name: (dims, values), **settings})


def test_every_side_of_a_file_becomes_samples(tmp_path):
    """Both sides of a small XTF file have their pings and a rising range; without a group, both are named."""
    path = tmp_path / "a.xtf"
    path.write_bytes(files.SYNTHETIC[".xtf"]())
    for group in ("port", "starboard"):
        found = samples_of(path, group)
        assert found.name == f"a.xtf, {group}" and found.values.shape == (3, 1, 4)
        assert (np.diff(found.slant_range) > 0).all()
    with pytest.raises(StoreError, match="--group 'port' or 'starboard'"):
        samples_of(path)


@pytest.mark.parametrize("suffix", [".kmall", ".all"])
def test_a_file_without_sound_speed_is_refused_by_name(suffix, tmp_path):
    """Files that state a sound speed of zero have no ranges: the message names file, group and remedy."""
    path = tmp_path / f"a{suffix}"
    path.write_bytes(files.SYNTHETIC[suffix]())
    with pytest.raises(StoreError, match=f"a{suffix}, water column: no ping states.*another group"):
        samples_of(path, "water column")
    with pytest.raises(StoreError, match="there is no group '38 kHz'"):
        samples_of(path, "38 kHz")


def test_the_stated_gain_of_a_water_column_is_undone():
    """A level of 30 log10(r) + 30 dB is 0 dB at all ranges behind it; the note reports it."""
    slant = 0.05 * np.arange(1, 201)
    level = np.broadcast_to(30 * np.log10(np.maximum(slant, 0.1)) + 30, (2, 3, 200))
    found = group_samples(
        pings(
            level.copy(),
            sample_rate=("ping", [15e3, 15e3]),
            sound_speed=("ping", [1500.0, 1500.0]),
            first_sample=(("ping", "beam"), np.ones((2, 3), int)),
            gain_exponent=("ping", [30.0, 30.0]),
            gain_offset=("ping", [30.0, 30.0]),
        ),
        "a",
    )
    np.testing.assert_allclose(found.slant_range, slant)
    np.testing.assert_allclose(20 * np.log10(found.values), 0, atol=1e-9)
    assert any("undone" in note for note in found.notes)


def test_beams_are_set_at_their_own_ranges():
    """Beams that start at samples 10 and 14 lie 4 samples apart on the common axis, NaN elsewhere."""
    found = group_samples(
        pings(
            np.zeros((1, 2, 3)),
            image_sample_rate=("ping", [75e3]),
            sound_speed=("ping", [1500.0]),
            first_sample=(("ping", "beam"), np.array([[10, 14]])),
        ),
        "a",
    )
    assert found.slant_range[[0, -1]] == pytest.approx([0.10, 0.16])
    np.testing.assert_array_equal(np.isfinite(found.values[0]), [[1, 1, 1, 0, 0, 0, 0], [0, 0, 0, 0, 1, 1, 1]])


def test_the_gamma_of_an_image_is_undone():
    """Counts that are the 127/255th power of an amplitude are that amplitude again."""
    amplitude = np.linspace(1, 200, 40).reshape(1, 2, 20)
    found = group_samples(
        pings(amplitude ** (127 / 255), name="amplitude", gamma=("ping", [127]), range_step=("ping", [0.01])), "a"
    )
    np.testing.assert_allclose(found.values, amplitude)


def test_pings_of_another_step_are_left_out():
    """Of three pings one has another sample interval: two remain, and the note counts them."""
    found = group_samples(
        pings(
            np.ones((3, 8)),
            name="amplitude",
            sound_speed=("ping", [1500.0] * 3),
            sample_interval=("ping", [1e-4, 1e-4, 2e-4]),
        ),
        "a",
    )
    assert found.values.shape == (2, 1, 8) and "1 of 3 pings" in found.notes[0]


@pytest.mark.parametrize("edge", [6, 20])
def test_ranges_count_from_the_transmitted_pulse(edge):
    """A pulse that rises `edge` samples behind the start of the record is at range zero, within 0.6 samples."""
    values = np.full((2, 4, 400), 1e-3, complex)
    values[..., edge : edge + 10] = 1.0
    found = group_samples(
        pings(
            values,
            name="voltage",
            sound_speed=("ping", [1500.0] * 2),
            pulse_length=("ping", [2e-4] * 2),
            sample_interval=("ping", [1e-5] * 2),
        ).rename(beam="sector"),
        "a",
    )
    assert found.parts and found.slant_range[edge] == pytest.approx(0.0, abs=0.6 * 7.5e-3)


def test_recordings_of_ours_state_their_geometry():
    """A simulated sidescan: ranges by its sound speed, altitude 5 m, depth 3 m, pulse and frequency."""
    found = samples_of(drawn(SIDESCAN, 1))
    assert found.slant_range[-1] == pytest.approx(30.0, rel=0.01) and found.unit == "uPa"
    assert found.altitude == pytest.approx(5.0) and found.depth == pytest.approx(3.0)
    assert (found.frequency, found.pulse_length) == pytest.approx((1e5, 2e-4))


def test_sides_and_pings_that_are_missing_are_named():
    """Two sides need --group; a recording without pings states how to simulate one."""
    one = drawn(SIDESCAN, 1)
    both = xr.concat(
        [one.assign_coords(side=("channel", [side])) for side in (-1.0, 1.0)], "channel", data_vars="minimal"
    )
    with pytest.raises(StoreError, match="--group port or --group starboard"):
        samples_of(both)
    assert samples_of(both, "port").values.shape[1] == 1
    with pytest.raises(StoreError, match="holds no ping yet"):
        samples_of(one.isel(ping=slice(0)))
    with pytest.raises(StoreError, match="Give a recording"):
        samples_of(xr.Dataset({"temperature": ("x", [1.0])}))


def test_images_are_read_from_near_to_far():
    """Starboard of an image of both sides: ranges rise from 0, -inf becomes silence, NaN stays."""
    level = np.array([[0.0, 1.0, 2.0, -np.inf, 20.0, np.nan]] * 2)
    across = np.array([-2.5, -1.5, -0.5, 0.5, 1.5, 2.5])
    found = samples_of(
        image_dataset(
            level, across, np.arange(2.0), geometry="slant", gain="none", altitude=np.full(2, 4.0), pings=np.arange(2)
        )
    )
    np.testing.assert_allclose(found.slant_range, [0.5, 1.5, 2.5])
    np.testing.assert_allclose(found.values[0, 0], [0.0, 10.0, np.nan])
    assert found.altitude.size == 2 and "starboard" in found.notes[0]
