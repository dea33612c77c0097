"""Claims about damage: no crash, no hang, bounded memory; what is left is read, what is not is listed."""

import contextlib
import sys
from time import process_time

import numpy as np
import pytest

from insonify.cli import main
from insonify.formats.instruments import instrument_file, open_instrument
from insonify.formats.instruments.instrument_file import MAX_OMISSIONS
from insonify.formats.instruments.open_instrument import instrument_formats
from insonify.formats.store_description import StoreError
from oracles import imaging_sonar_files, other_datagrams
from oracles import instrument_files as files

MEMORY = 128
"""Most megabytes by which the process may grow over all mutants of files of some kilobytes."""
PATIENCE = 2.0
"""Most seconds of processor time for one."""


def megabytes():
    """Largest memory of this process so far."""
    resource = pytest.importorskip("resource", reason="this system does not report the memory of a process")
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1 << 20 if sys.platform == "darwin" else 1 << 10)


def survive(suffix, whole, path, count, seed):
    """Number of mutants, out of `count`, that are still read in part."""
    random, read, before = np.random.default_rng(seed), 0, megabytes()
    for _ in range(count):
        path.write_bytes(files.damaged(whole, random))
        began = process_time()
        try:
            with open_instrument(path) as opened:
                files.require_survived(opened)
            read += 1
        except StoreError as fault:
            assert str(path) in str(fault) and ("byte" in str(fault) or "pings" in str(fault)), fault
        assert process_time() - began < PATIENCE, suffix
    assert megabytes() - before < MEMORY
    return read


@pytest.mark.parametrize("suffix", files.SYNTHETIC)
def test_mutants_are_read_or_refused(suffix, tmp_path):
    """Twenty-five mutants of each small file."""
    assert survive(suffix, files.SYNTHETIC[suffix](), tmp_path / f"a{suffix}", 25, 1) > 20


@pytest.mark.parametrize("suffix", other_datagrams.OTHERS)
def test_mutants_with_seldom_datagrams_are_read_or_refused(suffix, tmp_path):
    """Twenty-five mutants of each small file with datagrams of sensors, earlier instruments and other programs."""
    assert survive(suffix, other_datagrams.OTHERS[suffix](), tmp_path / f"a{suffix}", 25, 4) > 17


@pytest.mark.validate
@pytest.mark.parametrize("suffix", files.SYNTHETIC)
def test_ten_thousand_mutants_are_read_or_refused(suffix, tmp_path):
    """Ten thousand mutants of each small file."""
    assert survive(suffix, files.SYNTHETIC[suffix](), tmp_path / f"a{suffix}", 10_000, 2) > 8_000


@pytest.mark.parametrize("suffix", files.SYNTHETIC)
def test_every_cut_is_read_as_far_as_it_goes(suffix, tmp_path):
    """Files cut off anywhere, also a byte or two before a datagram ends: what is whole is read, the rest is omitted."""
    whole, path = files.SYNTHETIC[suffix](), tmp_path / f"a{suffix}"
    path.write_bytes(whole)
    with open_instrument(path) as opened:
        ends = opened.datagrams.offset + opened.datagrams.size
    near_ends = {int(end) - missing for end in ends[1:] for missing in (1, 2, 3)}
    for cut in sorted(near_ends.union(range(int(ends[0]), len(whole), 157))):
        path.write_bytes(whole[:cut])
        with open_instrument(path) as opened:
            assert opened.datagrams.offset.size == (ends <= cut).sum()
            listed = [part.offset for part in opened.omissions if "unknown" not in part.reason]
            assert bool(listed) == (cut not in ends)


def test_a_log_with_packed_images_survives_too(tmp_path):
    """Twenty-five mutants of the log of Oculus, whose images are wrapped and one of them compressed."""
    assert survive(".oculus", imaging_sonar_files.oculus_log(), tmp_path / "a.oculus", 25, 3) > 10


@pytest.mark.parametrize(
    ("suffix", "mark"),
    [(".kmall", b"#MWC"), (".xtf", b"\xce\xfa"), (".raw", b"\x20\0\0\0XML0"), (".oculus", b"SO\0\0"),
     (".oculus", b"\xdd\xcc\xbb\xaa"), (".aris", b"DDF\x05")],
)  # fmt: skip
def test_a_file_of_nothing_but_marks_takes_seconds(suffix, mark, tmp_path):
    """A hundred thousand marks that open no datagram: the search starts small, not with a megabyte for each."""
    head = imaging_sonar_files.oculus_log()[:48] if mark[0] == 0xDD else b""
    (tmp_path / f"a{suffix}").write_bytes(head + 100_000 * mark)
    began = process_time()
    with contextlib.suppress(StoreError), open_instrument(tmp_path / f"a{suffix}") as opened:
        assert len(opened.omissions) <= MAX_OMISSIONS + 1
    assert process_time() - began < 8


def test_what_is_no_recording_is_refused(tmp_path, capsys):
    """By name, byte, reason and fix, with exit code 2; an empty file, a text, a text with a suffix of ours."""
    for name, content in (
        ("a.bin", b"hello world"),
        ("a.xtf", b""),
        ("a.kmall", b"hello" * 99),
        ("a.all", b"\0" * 999),
    ):
        (tmp_path / name).write_bytes(content)
        assert main(["info", str(tmp_path / name)]) == 2
        output = capsys.readouterr().err
        assert f"{tmp_path / name}, byte 0" in output and "Give" in output
    assert main(["info", str(tmp_path / "none.kmall")]) == 2 and main(["info", str(tmp_path)]) == 2


def test_too_many_pings_at_once_are_refused_before_memory_is_taken(tmp_path, monkeypatch):
    """The message gives the number that fits."""
    (tmp_path / "a.kmall").write_bytes(files.kmall())
    monkeypatch.setattr(instrument_file, "MAX_VALUES", 45)
    with open_instrument(tmp_path / "a.kmall") as opened:
        with pytest.raises(StoreError, match=r"3 pings of 20 values are too many. Read at most 2 at once"):
            opened.read("water column")
        assert opened.read("water column", slice(2)).sizes["ping"] == 2
        with pytest.raises(StoreError, match="there is no group 'port'"):
            opened.read("port")


def test_each_suffix_belongs_to_one_way_of_reading():
    """Formats have names of their own, and their files are distinguished by content."""
    readers = instrument_formats()
    assert len({reader.format for reader in readers}) == len(readers)
    for suffix, write in files.SYNTHETIC.items():
        head = write()[:2048]
        assert [reader.suffixes[0] for reader in readers if reader.matches(head)] == [suffix]
