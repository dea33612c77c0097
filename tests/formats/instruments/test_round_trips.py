"""Claims about any content: what is written after the makers' tables is what is read, whatever its sizes and values."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from insonify import open_instrument
from insonify.formats.instruments.file_summary import PINGS_READ, file_summary
from oracles import instrument_files as files

K, A, X = files.kmall_parts, files.all_parts, files.xtf_parts
ANY_SIZES = st.lists(st.lists(st.integers(0, 7), min_size=0, max_size=6), min_size=1, max_size=4)
"""Numbers of samples of each beam of each ping."""
few = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def reopened(path, content):
    """A file with this content, open."""
    path.write_bytes(content)
    return open_instrument(path)


def samples_of(sizes, low, high, kind, seed):
    """Samples of each beam of each ping."""
    random = np.random.default_rng(seed)
    return [[random.integers(low, high, count).astype(kind) for count in beams] for beams in sizes]


def assert_ragged(found, expected, scale):
    """A padded array over (ping, beam, sample) holds the samples of each beam and NaN behind them."""
    for ping, beams in enumerate(expected):
        for beam, samples in enumerate(beams):
            np.testing.assert_array_equal(found[ping, beam, : samples.size], samples * np.float32(scale))
            assert np.isnan(found[ping, beam, samples.size :]).all()
        assert np.isnan(found[ping, len(beams) :]).all()


@few
@given(ANY_SIZES, st.integers(0, 99), st.sampled_from([0, 1, 2]))
def test_a_kmall_water_column_of_any_size(tmp_path, sizes, seed, phase):
    """Beams without samples, pings without beams, with phases of either width or without."""
    expected, content = samples_of(sizes, -128, 128, "i1", seed), b""
    for number, beams in enumerate(expected):
        body = files.record(K.PARTITION, count=1, number=1) + files.record(K.BODY, ping=number)
        body += files.record(K.WATER_TX, sector_size=16)
        body += files.record(K.WATER_RX, beams=len(beams), beam_size=16, phase=phase)
        for samples in beams:
            body += (
                files.record(K.WATER_BEAM, sample_count=samples.size) + samples.tobytes() + bytes(phase * samples.size)
            )
        content += files.kmall_datagram("#MWC", number, body)
    with reopened(tmp_path / "a.kmall", content) as file:
        found = file.read("water column")
        assert_ragged(found.level.values, expected, 0.5)
        assert ("phase" in found) == (phase > 0) and file.check() == ()


@few
@given(ANY_SIZES, st.integers(0, 99))
def test_a_kmall_seabed_image_of_any_size(tmp_path, sizes, seed):
    """Samples of all soundings stand behind one another; the table of soundings has the same numbers."""
    expected, content = samples_of(sizes, -900, 300, "<i2", seed), b""
    for number, beams in enumerate(expected):
        body = files.record(K.PARTITION, count=1, number=1) + files.record(K.BODY, ping=number)
        body += files.record(K.PING, sector_size=48) + files.record(K.RX, soundings=len(beams), sounding_size=120)
        if beams:
            body += files.record(K.SOUNDING, len(beams), sample_count=[samples.size for samples in beams])
        content += files.kmall_datagram("#MRZ", number, body + b"".join(samples.tobytes() for samples in beams))
    with reopened(tmp_path / "a.kmall", content) as file:
        image = file.read("seabed image")
        assert_ragged(image.level.values, expected, 0.1)
        for number, beams in enumerate(expected):
            assert image.sample_count.values[number, : len(beams)].tolist() == [samples.size for samples in beams]


@few
@given(ANY_SIZES, st.integers(0, 99), st.integers(1, 3))
def test_a_wcd_water_column_in_any_number_of_parts(tmp_path, sizes, seed, parts):
    """Beams shared out among datagrams that stand in any order."""
    expected, content = samples_of(sizes, -128, 128, "i1", seed), b""
    for number, beams in enumerate(expected):
        for part in np.random.default_rng(seed).permutation(parts):
            mine = beams[part * len(beams) // parts : (part + 1) * len(beams) // parts]
            body = files.record(A.WATER, parts=parts, part=part + 1, beams=len(mine))
            for samples in mine:
                body += files.record(A.WATER_BEAM, sample_count=samples.size) + samples.tobytes()
            content += files.all_datagram("k", number, body + b"\0")
    with reopened(tmp_path / "a.wcd", content) as file:
        assert_ragged(file.read("water column").level.values, expected, 0.5)
        assert file.groups["water column"] == len(expected) and file.check() == ()


@few
@given(ANY_SIZES, st.integers(0, 99))
def test_an_all_seabed_image_in_any_order(tmp_path, sizes, seed):
    """Falling beams are turned round, with the sample at their detection."""
    expected, content, random = samples_of(sizes, -900, 300, "<i2", seed), b"", np.random.default_rng(seed)
    centres = [[random.integers(0, samples.size + 1) for samples in beams] for beams in expected]
    for number, (beams, centre) in enumerate(zip(expected, centres, strict=True)):
        order = random.choice([1, -1], len(beams))
        counts = np.array([samples.size for samples in beams], int)
        stored = np.where((order < 0) & (np.array(centre, int) > 0), counts + 1 - np.array(centre, int), centre)
        body = files.record(A.IMAGE, beams=len(beams))
        if beams:
            body += files.record(A.IMAGE_BEAM, len(beams), order=order, sample_count=counts, centre_sample=stored)
        body += b"".join(samples[::way].tobytes() for samples, way in zip(beams, order, strict=True))
        content += files.all_datagram("Y", number, body + b"\0")
    with reopened(tmp_path / "a.all", content) as file:
        found = file.read("seabed image")
        assert_ragged(found.level.values, expected, 0.01 * 10)
        for number, centre in enumerate(centres):
            assert found.centre_sample.values[number, : len(centre)].tolist() == centre


@few
@given(st.lists(hnp.arrays("<u2", st.integers(0, 9)), min_size=1, max_size=5))
def test_xtf_pings_of_any_length(tmp_path, pings):
    """Both sides; port is stored from far to near."""
    infos = np.zeros(6, X.CHANNEL)
    infos["kind"][:2], infos["sample_size"][:2] = (1, 2), 2
    content = files.record(X.FILE, format=123, system=1, sonar_channels=2, navigation_units=3) + infos.tobytes()
    for number, samples in enumerate(pings):
        body = b"".join(files.record(X.PING_CHANNEL, channel=side, samples=samples.size) + samples[::way].tobytes()
                        for side, way in ((0, -1), (1, 1)))  # fmt: skip
        head = np.frombuffer(files.record(X.PING, magic=0xFACE, channels=2, ping=number), X.PING).copy()
        head["size"] = X.PING.itemsize + len(body)
        content += head.tobytes() + body
    with reopened(tmp_path / "a.xtf", content) as file:
        for side in ("port", "starboard"):
            found = file.read(side)
            for number, samples in enumerate(pings):
                np.testing.assert_array_equal(found.amplitude.values[number, : samples.size], samples)
                assert np.isnan(found.amplitude.values[number, samples.size :]).all()
        assert file.check() == ()


@pytest.mark.parametrize(
    "pings", [slice(None), slice(1, 3), slice(-1, None), slice(None, None, 2), slice(None, None, -1)]
)
def test_pings_are_chosen_as_in_a_list(tmp_path, pings):
    """Slices with negative ends and steps; `ping` keeps the numbers, times and values follow them."""
    for suffix in (".kmall", ".all", ".xtf"):
        with reopened(tmp_path / f"a{suffix}", files.SYNTHETIC[suffix]()) as file:
            for group in file.groups:
                every, some = file.read(group), file.read(group, pings)
                assert some.ping.values.tolist() == list(range(files.PINGS))[pings]
                np.testing.assert_array_equal(some.time, every.time[pings])
                name = next(name for name in ("level", "depth", "amplitude") if name in every)
                np.testing.assert_array_equal(some[name], every[name][pings])


def test_every_variable_has_a_unit_and_a_meaning(tmp_path):
    """And none is named in a way that a dataset cannot be requested in brackets."""
    for suffix in (".kmall", ".all", ".xtf"):
        with reopened(tmp_path / f"a{suffix}", files.SYNTHETIC[suffix]()) as file:
            series = [file.read(group) for group in file.groups] + [file.attitude(), file.navigation()]
            for found in (*series, *file.sound_speed_profiles()):
                for name, variable in found.variables.items():
                    assert variable.attrs["units"] and variable.attrs["long_name"], (suffix, name)
            assert all(setting.unit or isinstance(setting.value, str) for setting in file.settings())


def test_a_summary_reads_some_pings_of_many(tmp_path):
    """Of 500 pings 50 at most, evenly over the file, so that ranges of settings span it."""
    content = b"".join(files.kmall_datagram("#MWC", ping, files.kmall_water(ping % 3)) for ping in range(500))
    with reopened(tmp_path / "a.kmwcd", content) as file:
        (group,) = file_summary(file)["groups"]
    assert group["pings"] == 500 and 40 <= group["pings_read"] <= PINGS_READ
    assert group["shape"] == {"beam": 5, "sample": 4} and group["frequency"] == [3e5, 3e5]
