"""Claims about what all readers share: files larger than memory, odd clocks, empty pings, marks without datagrams."""

import re
import tracemalloc
from time import process_time

import numpy as np
import pytest

from insonify import open_instrument
from insonify.formats.instruments.instrument_file import Omission
from insonify.formats.instruments.kongsberg_text import installation_settings, runtime_settings
from insonify.formats.store_description import StoreError
from oracles import instrument_files as files

K, A = files.kmall_parts, files.all_parts


def opened(path, content):
    """A file with this content, open."""
    path.write_bytes(content)
    return open_instrument(path)


def test_a_file_larger_than_memory_opens(tmp_path):
    """Eight datagrams of half a gigabyte, of which only headers and trailers are read; then a ping behind them."""
    path, size = tmp_path / "a.kmall", 1 << 29
    head = files.record(K.HEADER, size=size, kind=b"#FCF", model=2042, seconds=files.START)
    with path.open("wb") as file:
        for number in range(8):
            file.seek(number * size)
            file.write(head)
            file.seek((number + 1) * size - 4)
            file.write(size.to_bytes(4, "little"))
        file.write(files.kmall_datagram("#MWC", 0, files.kmall_water(0)))
    with opened(tmp_path / "small.kmall", files.kmall_datagram("#MWC", 0, files.kmall_water(0))) as file:
        file.read("water column")  # so that imports do not count
    tracemalloc.start()
    with open_instrument(path) as file:
        assert file.datagrams.size.sum() == path.stat().st_size > 4 << 30
        np.testing.assert_array_equal(file.read("water column").level[0, :4], 0.5 * files.kmall_level(0)[:4])
        assert file.omissions == ()
    assert tracemalloc.get_traced_memory()[1] < 5e6
    tracemalloc.stop()


@pytest.mark.parametrize("step", [-3600.0, 200_000.0])
def test_a_clock_that_jumps_is_reported_and_read(step, tmp_path):
    """Pings after an hour back, or two days ahead, keep their place in the file; a second of disorder is usual."""
    times = [0.0, 1.0, 0.5, 1.0 + step, 2.0 + step]
    content = b"".join(files.kmall_datagram("#MWC", time, files.kmall_water(0)) for time in times)
    with opened(tmp_path / "a.kmall", content) as file:
        np.testing.assert_allclose(file.read("water column").time - files.START, times)
        (jump,) = file.clock_jumps
        way = "back" if step < 0 else "ahead"
        assert jump == Omission(3 * len(content) // 5, f"#MWC: the clock jumps {way} by {abs(step + 0.5):.3f} s")


def test_a_date_that_does_not_exist_is_no_time(tmp_path):
    """Of an .all datagram with a month 13: it is read, without a time."""
    body = files.record(A.POSITION, latitude=45 * 20_000_000)
    good, bad = files.all_datagram("P", 0, body), bytearray(files.all_datagram("P", 1, body))
    bad[8:12] = (20231314).to_bytes(4, "little")
    bad[-2:] = (sum(bad[5:-3]) & 0xFFFF).to_bytes(2, "little")
    with opened(tmp_path / "a.all", good + bytes(bad)) as file:
        assert np.isnan(file.datagrams.time).tolist() == [False, True] and file.clock_jumps == ()
        assert file.navigation().sizes["time"] == 2 and file.check() == ()


def test_pings_without_beams_or_samples_are_read(tmp_path):
    """Zero beams, and beams of zero samples: pings of no size beside others, padded."""
    empty = files.record(K.PARTITION, count=1, number=1) + files.record(K.BODY, ping=9) + files.record(
        K.WATER_TX, sector_size=16) + files.record(K.WATER_RX, beam_size=16)  # fmt: skip
    pings = [files.kmall_datagram("#MWC", n, body) for n, body in enumerate((empty, files.kmall_water(1), empty))]
    with opened(tmp_path / "a.kmall", b"".join(pings)) as file:
        found = file.read("water column")
        assert dict(found.sizes) == {"ping": 3, "beam": 5, "sample": 4, "tx_sector": 1} and not file.omissions
        assert np.isnan(found.level[[0, 2]]).all() and (found.sample_count[0] == -1).all()
        assert file.read("water column", slice(0, 1)).level.shape == (1, 0, 0)
        assert file.read("water column", slice(3, None)).sizes["ping"] == 0
    beams = files.record(A.IMAGE_BEAM, 2, order=1)
    images = [files.all_datagram("Y", 0, files.record(A.IMAGE, beams=count) + beams[: 6 * count]) for count in (0, 2)]
    with opened(tmp_path / "a.all", b"".join(images)) as file:
        assert file.read("seabed image").level.shape == (2, 2, 0) and file.check() == ()


@pytest.mark.parametrize("suffix", [".kmall", ".all", ".xtf"])
def test_a_file_without_one_kind_of_datagram_is_read(suffix, tmp_path):
    """Each kind left out in turn: what depends on it is None or empty, all else is as before."""
    with opened(tmp_path / f"a{suffix}", whole := files.SYNTHETIC[suffix]()) as file:
        index, every = file.datagrams, {name: getattr(file, name)() for name in ("attitude", "navigation", "soundings")}
    head = whole[: int(index.offset[0])]
    for kind in np.unique(index.kind):
        left = [whole[o : o + n] for o, n, k in zip(index.offset, index.size, index.kind, strict=True) if k != kind]
        with opened(tmp_path / f"b{suffix}", head + b"".join(left)) as file:
            assert not [part for part in file.check() if "unknown" not in part.reason]
            for name, before in every.items():
                after = getattr(file, name)()
                if after is not None and before is not None and set(after.variables) == set(before.variables):
                    same = before[next(iter(before.data_vars))].dtype == after[next(iter(after.data_vars))].dtype
                    assert same and set(after.sizes) == set(before.sizes)
    lost = {".kmall": ("#SKM", "attitude"), ".all": ("A", "attitude"), ".xtf": ("SONAR", "navigation")}[suffix]
    left = [whole[o : o + n] for o, n, k in zip(index.offset, index.size, index.kind, strict=True) if k != lost[0]]
    with opened(tmp_path / f"c{suffix}", head + b"".join(left)) as file:
        assert getattr(file, lost[1])() is None


@pytest.mark.parametrize(
    ("name", "mark"), [("a.kmall", b"#MRZ"), ("a.all", b"\2X\xf8\7\xb5\x8c\x34\1"), ("a.xtf", b"\xce\xfa")]
)
def test_half_a_megabyte_of_marks_is_one_omission(name, mark, tmp_path):
    """A stretch full of what begins a datagram, between two that are sound: seconds, and one line."""
    whole = files.SYNTHETIC[name[1:]]()
    with opened(tmp_path / name, whole) as file:
        cut, pings = int(file.datagrams.offset[-1]), dict(file.groups)
    began = process_time()
    with opened(tmp_path / name, whole[:cut] + mark * (500_000 // len(mark)) + whole[cut:]) as file:
        damage = [part for part in file.omissions if "unknown" not in part.reason]
        assert len(damage) == 1 and damage[0].offset == cut
        assert sum(file.groups.values()) >= sum(pings.values()) - 1
    assert process_time() - began < 15


def test_damage_at_either_end_costs_what_it_covers(tmp_path):
    """Bytes in front of the first datagram and behind the last; a name of a kind cut by the end of a window."""
    whole = files.kmall()
    for front in (1, 3, 255, 256, 257, 5000, (1 << 20) + 61):
        with opened(tmp_path / "a.kmall", b"\7" * front + whole + b"\7" * front) as file:
            assert file.datagrams.offset[0] == front and file.groups["water column"] == files.PINGS
            offsets = [part.offset for part in file.omissions if "unknown" not in part.reason]
            assert offsets == [0, front + len(whole)]


def test_a_phase_of_low_resolution_and_one_of_a_kind_unknown(tmp_path):
    """One byte in 180/128 deg; a flag of 3 is no phase that the format has."""
    body = (
        files.record(K.PARTITION, count=1, number=1) + files.record(K.BODY) + files.record(K.WATER_TX, sector_size=16)
    )
    beam = files.record(K.WATER_BEAM, sample_count=2) + bytes([2, 4]) + bytes([64, 192])
    for flag in (1, 3):
        rx = files.record(K.WATER_RX, beams=1, beam_size=16, phase=flag)
        with opened(tmp_path / "a.kmall", files.kmall_datagram("#MWC", 0, body + rx + beam)) as file:
            found = file.read("water column")
            if flag == 3:
                assert found.sizes["ping"] == 0 and "phases of an unknown kind, 3" in file.omissions[0].reason
            else:
                np.testing.assert_allclose(found.phase.values, [[[np.pi / 2, -np.pi / 2]]], rtol=1e-6)
                assert found.level.values.tolist() == [[[1.0, 2.0]]]


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        (b"\1\0\1\0" + b"\x0c\0", "records of"),
        (b"\1\0\1\0\0\0", "records of"),
        (files.kmall_water(0)[:-3], "samples are stated up to byte"),
        (files.kmall_water(0)[:46] + b"\xff\xff" + files.kmall_water(0)[48:], "records of"),
    ],
)
def test_sizes_that_contradict_the_length_cost_one_ping(body, reason, tmp_path):
    """The reason gives what is stated and what there is."""
    good = files.kmall_datagram("#MWC", 0, files.kmall_water(0))
    with opened(tmp_path / "a.kmall", good + files.kmall_datagram("#MWC", 1, body) + good) as file:
        assert file.read("water column").ping.values.tolist() == [0, 2]
        (left_out,) = file.omissions
        assert left_out.offset == len(good) and reason in left_out.reason


def test_texts_become_settings_with_units():
    """Lever arms in metres, angles in radians, numbers as numbers, all else as text; headings stand in front."""
    text = (
        "OSCV:Empty,SN=12,TRAI_TX1:N=5001;X=-0.512;IPY=0.1;R=90;S=0.7,POSI_2:U=NOT_SET,S1P=-90.0,DSV=3.1.8 141125,,X="
    )
    found = {s.name: (s.value, s.unit) for s in installation_settings(text, "#IIP", 7)}
    half = pytest.approx(np.pi / 2)
    assert found == {
        "SN": (12, "1"), "TRAI_TX1.N": (5001, "1"), "TRAI_TX1.X": (-0.512, "m"), "TRAI_TX1.IPY": (0.1, "m"),
        "TRAI_TX1.R": (half, "rad"), "TRAI_TX1.S": (0.7, "1"), "POSI_2.U": ("NOT_SET", ""), "DSV": ("3.1.8 141125", ""),
        "S1P": (pytest.approx(-np.pi / 2), "rad"),
    }  # fmt: skip
    runtime = list(runtime_settings("a: 1\nDepth\nMax: 40.0\nForced: --\nempty:\n\nGain\nMax: Off", "#IOP", 9))
    assert [(s.name, s.value) for s in runtime] == [
        ("a", 1),
        ("Depth.Max", 40.0),
        ("Depth.Forced", "--"),
        ("Gain.Max", "Off"),
    ]
    assert {(s.datagram, s.offset) for s in runtime} == {("#IOP", 9)}


def test_a_closed_file_and_a_missing_one_are_refused(tmp_path):
    """Reading after `with`; names that are none."""
    with opened(tmp_path / "a.kmall", files.kmall()) as file:
        pass
    with pytest.raises(ValueError, match="closed file"):
        file.read("water column")
    for path, why in ((tmp_path / "b.kmall", "there is no such file"), (tmp_path / "a.doc", "no such file")):
        with pytest.raises(StoreError, match=re.escape(str(path)) + ".*" + why):
            open_instrument(path)
