"""Claims about compressed chunks: none unpacks to more than its array has, and no memory is taken to find out."""

import json
import shutil
import struct
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from numcodecs.blosc import Blosc
from numcodecs.zstd import Zstd

import insonify
from insonify.cli import main
from insonify.formats.chunk_sizes import HEAD, require_declared_size
from insonify.formats.label_store import open_labels
from insonify.formats.zarr_store import StoreError, open_recording, recorded_pings
from insonify.paper.nominal_scenario import nominal
from insonify.recording_run import record

LARGE = 10 << 30


def frame(size: int, declared: int | None = None) -> bytes:
    """Frame of zstd by RFC 8878 with zeros in blocks of one repeated byte."""
    blocks = [min(131072, size - begin) for begin in range(0, size, 131072)]
    heads = (struct.pack("<I", (row == len(blocks) - 1) | 2 | n << 3)[:3] + b"\0" for row, n in enumerate(blocks))
    size_and_segment = b"\xe0" + struct.pack("<Q", size if declared is None else declared)
    return b"\x28\xb5\x2f\xfd" + size_and_segment + b"".join(heads)


def scenario(pings: int, *, labels: bool = False) -> insonify.Scenario:
    """Pings of a target in one vertical plane."""
    changes = {"paths.geometry": "slice", "paths.max_reflections": 0, "track.window": [0.195, 0.205]}
    return nominal({**changes, "track.pings": pings, "track.interval": 0.5, "paths.contributions": ["target"],
                    "output.labels": labels})  # fmt: skip


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A recording with labels, and one in shards."""
    folder = tmp_path_factory.mktemp("recordings")
    record(scenario(2, labels=True), folder / "single")
    record(scenario(70), folder / "shards")
    return {name: folder / name for name in ("single", "shards")}


@pytest.mark.parametrize("size", [0, 1, 255, 256, 300, 65_791, 65_792, 10_000_000])
def test_the_declared_size_is_the_unpacked_size(size):
    """Frames of zstd and blosc, in every width of their size field: accepted at that size, refused at one byte less."""
    content = np.random.default_rng(1).integers(0, 4, size, np.uint8).tobytes()
    for codec in (Zstd(level=0), Blosc("lz4", 5, Blosc.SHUFFLE)):
        packed = bytes(codec.encode(content))
        require_declared_size(packed[:HEAD], size)
        if size:
            with pytest.raises(ValueError, match=f"it declares {size} bytes, and a chunk has {size - 1}"):
                require_declared_size(packed, size - 1)


def test_a_frame_of_this_test_is_one_of_zstd():
    """The library unpacks it to the zeros that it stands for."""
    assert bytes(Zstd().decode(frame(300_000))) == bytes(300_000)


@pytest.mark.parametrize(
    "content", [b"", b"\x28\xb5\x2f\xfd", b"\x28\xb5\x2f\xfd\x00\x58", b"\x50\x2a\x4d\x18\4\0\0\0"]
)
def test_a_chunk_without_a_size_is_refused(content):
    """Empty, torn, of unknown length, or a frame to be skipped."""
    with pytest.raises(ValueError, match="it declares no size"):
        require_declared_size(content, 100)


@pytest.mark.parametrize("chunk", ["pressure/c/1/0/0", "time/c/0", "done/c/1", "labels/done/c/0", "labels/time/c/0"])
@pytest.mark.parametrize("declared", [LARGE, 10**13])
def test_a_chunk_of_ten_gigabytes_takes_no_memory(recordings, tmp_path, chunk, declared):
    """Any chunk of a recording or its labels: refused with its name, before 20 MB are allocated."""
    path = tmp_path / "a.zarr"
    shutil.copytree(recordings["single"], path)
    assert (path / chunk).is_file()
    (path / chunk).write_bytes(frame(LARGE if declared == LARGE else 1000, declared))
    tracemalloc.start()
    try:
        with pytest.raises(StoreError, match=rf"a\.zarr.*it declares {declared} bytes, and a chunk has \d+"):
            (open_labels if "labels" in chunk else open_recording)(path).load()
        assert recorded_pings(path).sum() == (1 if chunk == "done/c/1" else 2)
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()


def test_a_row_of_a_shard_of_ten_gigabytes_takes_no_memory(recordings, tmp_path):
    """By the index of the shard; the other rows are read."""
    path = tmp_path / "a.zarr"
    shutil.copytree(recordings["shards"], path)
    shard = path / "pressure" / "c" / "0" / "0" / "0"
    content = bytearray(shard.read_bytes())
    rows = json.loads((path / "pressure" / "zarr.json").read_text())["chunk_grid"]["configuration"]["chunk_shape"][0]
    offset, _ = struct.unpack_from("<QQ", content, len(content) - 4 - 16 * rows + 16 * 3)
    head = frame(1000, 10**13)[:HEAD]
    content[offset : offset + len(head)] = head
    shard.write_bytes(content)
    read = open_recording(path)
    assert np.isfinite(read["pressure"].isel(ping=[0, 2, 4, 69]).values).all()
    with pytest.raises(StoreError, match=r"a\.zarr.*it declares 10000000000000 bytes"):
        read["pressure"].isel(ping=slice(2, 5)).load()


def test_a_recording_of_more_pieces_than_any_has_is_refused(recordings, tmp_path):
    """Ten million pings in a file each: refused at once; a description that is a folder, with its name."""
    path = tmp_path / "a.zarr"
    shutil.copytree(recordings["single"], path)
    description = json.loads((path / "zarr.json").read_text())
    for array in description["consolidated_metadata"]["metadata"].values():
        if array["dimension_names"][:1] == ["ping"]:
            array["shape"][0] = 10_000_000
    (path / "zarr.json").write_text(json.dumps(description))
    with pytest.raises(StoreError, match=r"a\.zarr.*promises \[10000000.*\] in pieces of"):
        open_recording(path)
    (path / "attitude" / "zarr.json").unlink()
    (path / "attitude" / "zarr.json").mkdir()
    with pytest.raises(StoreError, match=r"attitude.zarr\.json cannot be read: Is a directory"):
        open_recording(path)
    assert main(["show", str(path), "-o", str(tmp_path / "a.png")]) == 2


@pytest.mark.parametrize("axis", ["ping", "time"])
def test_an_axis_without_its_chunk_is_refused(recordings, tmp_path, axis):
    """Lost, it would be read as zeros, and every sample have one time."""
    path = tmp_path / "a.zarr"
    shutil.copytree(recordings["single"], path)
    next(file for file in (path / axis / "c").iterdir()).unlink()
    with pytest.raises(StoreError, match=rf"a\.zarr.{axis} is damaged: its numbers do not increase"):
        open_recording(path)
