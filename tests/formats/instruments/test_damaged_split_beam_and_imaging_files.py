"""Claims about damaged files of EK80, Oculus and ARIS: they are read as far as they go, or refused by name."""

import time
import tracemalloc

import numpy as np
import pytest

from insonify.formats.instruments import open_instrument
from insonify.formats.store_description import StoreError
from oracles import imaging_sonar_files, simrad_files
from oracles.instrument_files import damaged, require_survived

KINDS = {
    "ek80.raw": simrad_files.ek80(),
    "oculus.raw": imaging_sonar_files.oculus(),
    "log.oculus": imaging_sonar_files.oculus_log(),
    "a.aris": imaging_sonar_files.aris(ordered=False),
}


def survives(path, content):
    """Read a damaged file; a refusal names file and byte."""
    path.write_bytes(content)
    try:
        with open_instrument(path) as file:
            require_survived(file)
    except StoreError as refusal:
        assert str(path) in str(refusal), refusal


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("copies", [50, pytest.param(10_000, marks=pytest.mark.validate)])
def test_a_damaged_file_is_read_as_far_as_it_goes(name, copies, tmp_path):
    """Flipped bits, cuts, doubled bytes and lengths that lie: no error but a refusal, no memory beyond 20 MB."""
    random = np.random.default_rng(list(KINDS).index(name))
    survives(tmp_path / name, KINDS[name])
    for copy in range(copies):
        content = KINDS[name]
        for _ in range(random.integers(1, 4)):
            content = damaged(content or b"\0", random)
        if copy % 10:  # tracing takes ten times as long
            survives(tmp_path / name, content)
            continue
        tracemalloc.start()
        survives(tmp_path / name, content)
        assert tracemalloc.get_traced_memory()[1] < 20e6
        tracemalloc.stop()


@pytest.mark.parametrize(
    ("name", "mark"),
    [("a.raw", b"\x20\0\0\0XML0"), ("b.raw", b"SO\0\0"), ("c.oculus", b"\xdd\xcc\xbb\xaa"), ("d.aris", b"DDF\x05")],
)
def test_a_megabyte_of_marks_takes_seconds(name, mark, tmp_path):
    """A file of nothing but the marks of datagrams is searched once, not once for each mark."""
    head = {"c.oculus": KINDS["log.oculus"][:48]}.get(name, b"")
    (tmp_path / name).write_bytes(head + mark * (1_000_000 // len(mark)))
    before = time.process_time()
    with pytest.raises(StoreError, match="no datagram of the format"), open_instrument(tmp_path / name) as file:
        raise StoreError(f"no datagram of the format: {len(file.omissions)} omissions")
    assert time.process_time() - before < 10
