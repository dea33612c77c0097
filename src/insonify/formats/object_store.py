"""Recordings in object stores, where objects are put whole, and neither renamed nor appended to.

Descriptions and small arrays are put once, the description of each group last, so that a recording is either complete
or absent. Before them, a claim with the scenario is put: another scenario is refused from then on, and all writers of
the same scenario put the same bytes. An object of the mask `done` is put after the shards of its pings.
"""

import hashlib
import json
import os
import re
import uuid
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from zarr.storage import FsspecStore

from insonify.data_file import install_advice
from insonify.formats.checked_store import CheckedStore
from insonify.formats.named_chunks import open_named_chunks
from insonify.formats.shards import RowArray, described_array
from insonify.formats.store_description import (
    IDENTITY,
    MUST_AGREE,
    StoreError,
    WriteError,
    errors_as_store_errors,
    parse_description,
    require_consistent_sizes,
    require_same_scenario,
)
from insonify.kernel_cache import user_cache

CLAIM = ".insonify.json"
"""Object with the scenario and the identity of a recording, the first that is put."""
SPOOL = "INSONIFY_SPOOL"
"""Variable of the environment with the folder in which pings wait for the others of their shard."""
BUCKETS = ("s3", "s3a", "gs", "gcs", "az", "abfs", "abfss")
"""Schemes whose URLs begin with a bucket or container that must be there."""
_SAME = ("shape", "chunk_grid", "codecs")


class StoredGroup(NamedTuple):
    """Arrays over pings of a recording, or of its labels, with names relative to the recording."""

    folder: str
    """Folder of the labels; empty: the recording itself."""
    done: RowArray
    arrays: list[RowArray]
    """Arrays with the results of pings, or of lines of a recorder."""
    needed: list[RowArray]
    """Those of them without which a ping is missing."""

    def rows(self, names: set[str]) -> NDArray[np.bool_]:
        """Mask of the pings in a store, shape (ping,).

        Args:
            names: Names of the objects.
        """
        mask = np.zeros(self.done.shape, bool)
        for shard in range(-(-mask.size // self.done.per_shard)):
            rows = self.done.rows(shard)
            mask[rows.start : rows.stop] = all(
                array.shard_file(shard).as_posix() in names for array in (self.done, *self.needed)
            )
        return mask

    def below(self, folder: Path) -> "StoredGroup":
        """The same arrays in a recording on disk."""
        done, *arrays = (array._replace(group=folder / array.group) for array in (self.done, *self.arrays))
        needed = {array.name for array in self.needed}
        return self._replace(done=done, arrays=arrays, needed=[array for array in arrays if array.name in needed])


def stored_group(description: Mapping[str, Any], folder: str, names: tuple[str, ...], needed: tuple[str, ...]
                 ) -> StoredGroup:  # fmt: skip
    """Arrays over pings of a group, by its description.

    Args:
        description: Description of the group, with those of its arrays.
        folder: Folder of the group in the recording.
        names: Names of arrays with results that it may have.
        needed: Names of those without which a ping is missing.
    """
    found = description["consolidated_metadata"]["metadata"]
    arrays = {name: described_array(Path(folder), name, found[name]) for name in (*names, "done") if name in found}
    done = arrays.pop("done")
    return StoredGroup(folder, done, list(arrays.values()), [arrays[name] for name in needed if name in arrays])


class ObjectStore:
    """Objects of one recording, by its URL, such as s3://bucket/harbour.zarr."""

    def __init__(self, url: str) -> None:
        """Find the store; nothing is read or written.

        Raises:
            StoreError: There is no such store, or a package is missing.
        """
        self.url = url.rstrip("/")
        if "://" not in self.url:
            raise StoreError(f"{url} names no folder in a store. Give one: {url}harbour.zarr")
        self.is_created = False
        """True: a failure is one of the run, and no longer one of the URL."""
        try:
            import fsspec

            self.is_local = self.url.startswith(("file:", "local:"))
            options = {"auto_mkdir": True} if self.is_local else {}
            self.files, self.root = fsspec.url_to_fs(self.url, **options)
        except ImportError as error:
            raise StoreError(
                f"{self.url} needs a package that is not installed ({error}). Install it: {install_advice('remote')}, "
                "and that of the store: s3fs for s3://, gcsfs for gs://, adlfs for az://"
            ) from None
        except Exception as error:  # of the package of any store
            raise StoreError(f"{self.url} is no URL of a store: {_reason(error)}. Such as s3://bucket/a.zarr") from None

    @contextmanager
    def _failures(self) -> Iterator[None]:
        """Convert failures of a store, which are of any type."""
        try:
            yield
        except (StoreError, WriteError, MemoryError):
            raise
        except Exception as error:
            if self.is_created:
                raise WriteError(
                    f"{self.url} cannot be written: {_reason(error)}. What was computed is kept in {spool_folder()}; "
                    "the same command goes on from there"
                ) from error
            raise StoreError(
                f"{self.url} cannot be reached: {_reason(error)}. Check the URL, the credentials and the permission to "
                "list, read and write"
            ) from error

    def sizes(self) -> dict[str, int]:
        """Size of all objects [bytes], by their names relative to the recording."""
        with self._failures():
            self.files.invalidate_cache()
            try:
                found = self.files.find(self.root, detail=True)
            except FileNotFoundError:
                return {}
        sizes = {str(name).removeprefix(f"{self.root}/"): int(about["size"]) for name, about in found.items()}
        return {name: size for name, size in sizes.items() if not name.endswith(".partial")}

    def names(self) -> set[str]:
        """Names of all objects, relative to the recording."""
        return set(self.sizes())

    def read(self, name: str) -> bytes | None:
        """Content of an object; None without."""
        with self._failures():
            try:
                return bytes(self.files.cat_file(f"{self.root}/{name}"))
            except (FileNotFoundError, NotADirectoryError):
                return None

    def put(self, name: str, content: bytes | Path) -> None:
        """Put an object whole.

        Args:
            name: Name, relative to the recording.
            content: The bytes, or a file with them.
        """
        path = f"{self.root}/{name}"
        folder, _, last = path.rpartition("/")
        aside = f"{folder}/.{last}.{uuid.uuid4().hex}.partial" if self.is_local else path
        with self._failures():
            if isinstance(content, Path):
                self.files.put_file(str(content), aside)
            else:
                self.files.pipe_file(aside, content)
            if aside != path:
                os.replace(aside, path)

    def claim(self, attributes: Mapping[str, Any]) -> str:
        """Identity of the recording, which is claimed for a scenario where there is none.

        Args:
            attributes: Attributes of the recording.

        Raises:
            StoreError: There is a recording of another scenario, or something else.
        """
        names = self.names()  # before the attributes, which another writer may put meanwhile
        stored = self.attributes()
        if stored is None:
            if names:
                raise StoreError(f"{self.url} exists and is not a recording. Choose another name")
            mine: dict[str, Any] = {name: attributes.get(name) for name in MUST_AGREE}
            mine[IDENTITY] = hashlib.sha256(json.dumps(mine, sort_keys=True).encode()).hexdigest()[:32]
            self._put_first(CLAIM, json.dumps(mine).encode())
            stored = self.attributes()
        require_same_scenario(self.url, stored or {}, attributes, "Choose another name, or delete it first")
        return str((stored or {})[IDENTITY])

    def _put_first(self, name: str, content: bytes) -> None:
        """Put an object unless it is there, as far as a store can; else the last of two puts at once remains."""
        if not self.is_local:
            with suppress(Exception):  # the package of a store may not have this mode
                self.files.pipe_file(f"{self.root}/{name}", content, mode="create")
        if self.read(name) is None:
            self.put(name, content)

    def attributes(self) -> dict[str, Any] | None:
        """Attributes of the recording, or of its claim; None without."""
        if (description := self.description()) is None:
            claim = self.read(CLAIM)
            return None if claim is None else parse_description(claim, f"{self.url}/{CLAIM}")
        attributes: dict[str, Any] = description["attributes"]
        return attributes

    def description(self, folder: str = "") -> dict[str, Any] | None:
        """Description of the recording, or of its labels; None without."""
        name = f"{folder}/zarr.json".lstrip("/")
        if (content := self.read(name)) is None:
            return None
        description = parse_description(content, f"{self.url}/{name}")
        if IDENTITY not in (description.get("attributes") or {}):
            raise StoreError(f"{self.url} exists and is not a recording. Choose another name")
        require_consistent_sizes(description, f"{self.url}/{name}")
        return description

    def require_recording(self) -> dict[str, Any]:
        """Description of the recording, refused if there is none, or a damaged one."""
        if (description := self.description()) is None:
            bucket = self.root.strip("/").partition("/")[0]
            with self._failures():
                has_bucket = self.url.partition("://")[0] not in BUCKETS or self.files.exists(bucket)
            if not has_bucket:
                raise StoreError(f"{self.url}: there is no bucket {bucket}, or no permission to list it. Check the URL "
                                 "and the credentials, or make the bucket with the tool of the store")  # fmt: skip
            raise StoreError(f"{self.url} is not a recording. Make one with: insonify run FILE -o {self.url}")
        return description

    def open_group(self, folder: str = "") -> xr.Dataset:
        """Open the recording, or its labels; values are read on access, and only shards are seen.

        Raises:
            StoreError: It is not there, or is damaged.
        """
        recording = self.require_recording()
        if (description := self.description(folder)) is None or (
            description["attributes"].get(IDENTITY) != recording["attributes"][IDENTITY]
        ):
            raise StoreError(f"{self.url} has no labels. Make them: insonify run FILE -o {self.url} --labels")
        url = f"{self.url}/{folder}".rstrip("/")
        with errors_as_store_errors(url):
            store = CheckedStore(FsspecStore.from_url(url, read_only=True), self.url, description, folder)
            return open_named_chunks(store, None, mask_and_scale=not folder)

    def create(self, group: StoredGroup, recording: Path) -> None:
        """Put descriptions and small arrays of a recording on disk, unless they are there.

        Args:
            group: The recording, or its labels.
            recording: Folder of the recording on disk.

        Raises:
            StoreError: The arrays in the store have other shapes or chunks.
        """
        folder = recording / group.folder
        described = parse_description((folder / "zarr.json").read_bytes(), folder / "zarr.json")
        arrays = described["consolidated_metadata"]["metadata"]
        if (stored := self.description(group.folder)) is not None:
            there = stored["consolidated_metadata"]["metadata"]
            if [[there.get(name, {}).get(key) for key in _SAME] for name in arrays] != [
                [array.get(key) for key in _SAME] for array in arrays.values()
            ]:
                raise StoreError(
                    f"{self.url} was made with arrays of other shapes or chunks, by another version. Choose another "
                    "name, or go on with that version"
                )
            return
        results = {array.name for array in (group.done, *group.arrays)}
        for name in arrays:
            files = [folder / name / "zarr.json"] if name in results else (folder / name).rglob("*")
            for file in files:
                if file.is_file():
                    self.put(file.relative_to(recording).as_posix(), file)
        self.put((folder / "zarr.json").relative_to(recording).as_posix(), folder / "zarr.json")

    def require_own(self, mine: str) -> None:
        """Refuse to write into another recording than the intended one.

        Raises:
            StoreError: Another recording is there.
            WriteError: None is there.
        """
        if (stored := self.attributes()) is None:
            raise WriteError(f"{self.url} was deleted during the run. The same command starts anew")
        if stored[IDENTITY] != mine:
            raise StoreError(f"{self.url} was replaced by another run while this one went on. Choose another name")


def spool_folder() -> Path:
    """Folder in which pings wait for the others of their shard: that of the user's choice, or in the cache."""
    return Path(os.environ.get(SPOOL) or user_cache("insonify") / "spool")


def spooled_recording(url: str, mine: str) -> Path:
    """Folder of the waiting pings of one recording.

    Args:
        url: URL of the recording, without a slash at its end.
        mine: Identity of the recording.
    """
    return spool_folder() / hashlib.sha256(f"{mine} {url}".encode()).hexdigest()[:32]


def _reason(error: Exception) -> str:
    """One line about a failure."""
    return re.sub(r"\s+", " ", str(error)).rstrip(". ")[:200] or type(error).__name__
