"""Folder of a data set: scenes one by one, each whole or not there, and a card and lists when all are there.

A scene is written under a temporary name and its files renamed, its note last, so a job that was stopped goes on where
it stopped, and two jobs with the same scene write the same bytes.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import shutil
import uuid
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from insonify.annotations import merge_coco, write_coco, write_label_maps, write_yolo
from insonify.annotations.coco import empty_coco
from insonify.annotations.yolo import write_yolo_data
from insonify.datasets.dataset_classes import dataset_class_names
from insonify.datasets.dataset_file import DatasetFile, Format
from insonify.datasets.drawn_scene import uniforms
from insonify.datasets.rendered_scene import SceneImage
from insonify.datasets.typed_values import changed_values, typed_values
from insonify.diagnostics.yaml_source import YamlSource
from insonify.formats.store_description import StoreError
from insonify.formats.zarr_store import sweep
from insonify.scenario.scenario import Scenario
from insonify.scenario.write import to_yaml
from insonify.surveys.raster import write_bands

if TYPE_CHECKING:
    from insonify.annotations import LabelledImage

NOTES = "scenes"
"""Folder of the notes, one for each scene."""
DESCRIPTION = "dataset.json"
"""File that names the data set of the folder."""
KILLED = 86_400.0
"""Age of a scene's folder that only a killed job has left: twins of coherent scenes may be hours apart [s]."""
BANDS = ("level with gain [dB]", "expected level with gain [dB]", "class", "target")
"""Bands of a tile of a mosaic as GeoTIFF."""
CHANGES_SHOWN = 8
"""Number of changed values that a message lists."""
PER_FOLDER = {"names.json", "data.yaml"}
"""Files of writers about a whole folder, which are written when all scenes are there."""


@dataclass(frozen=True)
class DatasetFolder:
    """Folder of a data set and what belongs into it."""

    path: Path
    file: DatasetFile
    base: Scenario

    @property
    def fingerprint(self) -> str:
        """Fingerprint of all that the images depend on."""
        from importlib.metadata import version

        own = self.file.model_dump(mode="json", exclude={"scene", "compare"})
        text = json.dumps([own, to_yaml(self.base), version("insonify")], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    def open(self, sources: Sequence[YamlSource] = ()) -> None:
        """Make the folder, or check that it holds this data set.

        Args:
            sources: File of the data set and its scenario as they were typed, for messages about another data set.

        Raises:
            StoreError: It holds something else, or cannot be made.
        """
        described = {"fingerprint": self.fingerprint, "typed": [typed_values(source) for source in sources]}
        text, known = json.dumps(described) + "\n", self.path / DESCRIPTION
        with self._advising("its beginning"):
            (self.path / NOTES).mkdir(parents=True, exist_ok=True)
            if not known.exists():
                others = [entry.name for entry in self.path.iterdir() if not self._may_begin_with(entry.name)]
                if (others or any((self.path / NOTES).iterdir())) and not known.exists():  # another job may be faster
                    raise StoreError(f"{self.path} holds files that are no data set. Choose another folder with -o")
                if not known.exists():
                    write_whole(known, text)
            self._require_same(known.read_text(encoding="utf-8"), sources)
            sweep(self.path / "?????", KILLED)

    def _require_same(self, description: str, sources: Sequence[YamlSource]) -> None:
        """Refuse the folder of another data set, with the values that differ."""
        try:
            recorded = json.loads(description)
            is_same, typed = recorded["fingerprint"] == self.fingerprint, recorded.get("typed", [])
        except (ValueError, TypeError, KeyError, AttributeError):
            raise StoreError(f"{self.path / DESCRIPTION} is damaged. Choose another folder with -o, or delete "
                             f"{self.path}") from None  # fmt: skip
        if is_same:
            return
        changes = changed_values(typed, sources)
        others = [f"and {len(changes) - CHANGES_SHOWN} more"] if len(changes) > CHANGES_SHOWN else []
        why = (
            "these values differ" if changes else "the version of insonify, or a file that the scenario names, differs"
        )
        advice = "Choose another folder with -o, or delete this one" + (", or write the former values" * bool(changes))
        shown = [str(change) for change in changes[:CHANGES_SHOWN]]
        raise StoreError("\n".join([f"{self.path} holds another data set: {why}. {advice}", *shown, *others]))

    @staticmethod
    def _may_begin_with(name: str) -> bool:
        """True of what a job that has just begun, or was stopped there, leaves in the folder."""
        return name in (NOTES, DESCRIPTION) or (name.startswith(f".{DESCRIPTION}.") and name.endswith(".partial"))

    @contextmanager
    def _advising(self, where: str) -> Iterator[None]:
        """Errors of a folder that cannot be written, with the remedy."""
        again = "and give the same command again: it goes on there"
        remedies = {
            errno.ENOSPC: ("the disk is full", f"free some space {again}"),
            errno.EDQUOT: ("the quota is used up", f"free some space {again}"),
            errno.EROFS: ("the disk is read-only", "choose another folder with -o"),
            errno.EACCES: ("permission denied", "choose another folder with -o, or change its permissions"),
            errno.ENOENT: ("a file or folder of the data set was removed", f"leave it as it is, {again}"),
            errno.EEXIST: ("the path is that of a file", "choose another folder with -o"),
            errno.ENOTDIR: ("part of the path is a file", "choose another folder with -o"),
        }
        try:
            yield
        except OSError as fault:
            problem, remedy = remedies.get(fault.errno or 0, (fault.strerror, "choose another folder with -o"))
            raise StoreError(f"{self.path}: {problem} at {where}; {remedy}") from None

    def note(self, scene: int) -> Path:
        """File that is there when all files of a scene are."""
        return self.path / NOTES / f"{scene:05d}.json"

    def missing(self, scenes: Iterable[int]) -> list[int]:
        """Scenes of some that are not there."""
        existing = {entry.name for entry in (self.path / NOTES).iterdir()}
        return [scene for scene in scenes if self.note(scene).name not in existing]

    @cached_property
    def _split_rows(self) -> NDArray[np.intp]:
        """Row of the split of each scene: exact fractions of all, in an order that the seed shuffles."""
        settings = self.file.dataset
        order = np.argsort(uniforms(settings.seed, "split", np.arange(settings.images))[:, 0], kind="stable")
        rows = np.empty(settings.images, np.intp)
        rows[order] = np.repeat(np.arange(len(settings.split)), settings.split_counts)
        return rows

    def write(self, scene: int, images: Iterator[SceneImage]) -> None:
        """Write the images of one scene, and its note.

        Args:
            scene: Number of the scene.
            images: Its images.

        Raises:
            StoreError: The disk is full, or the folder cannot be written any more.
        """
        partial = self.path / f".{scene:05d}.{uuid.uuid4().hex}.partial"
        split = list(self.file.dataset.split)[self._split_rows[scene]]
        try:
            with self._advising(f"scene {scene}"):
                notes = [self._write_image(one, partial, split, scene) for one in images]
                drawn, coco = notes[0].pop("drawn"), partial / "coco"
                note: dict[str, Any] = {"scene": scene, "split": split, "drawn": drawn, "images": notes}
                if "coco" in self.file.write:
                    note["coco"] = self._coco_fragments(coco)
                for entry in sorted(partial.rglob("*")):
                    inside = entry.relative_to(partial)
                    if entry.is_dir() and entry.suffix == ".zarr":
                        _move_folder(entry, self.path / inside)
                    elif entry.is_file() and entry.name not in PER_FOLDER and ".zarr" not in str(inside.parent):
                        (self.path / inside).parent.mkdir(parents=True, exist_ok=True)
                        os.replace(entry, self.path / inside)
                write_whole(self.note(scene), json.dumps(note, allow_nan=False) + "\n")
        finally:
            shutil.rmtree(partial, ignore_errors=True)

    def _write_image(self, one: SceneImage, partial: Path, split: str, scene: int) -> dict[str, Any]:
        """Write one image in all formats; its note."""
        labelled = replace(one.labelled, conditions={**one.labelled.conditions, "scene": scene, "twin": one.twin})
        for name in self.file.write:
            (partial / name).mkdir(parents=True, exist_ok=True)
            self._write_format(name, labelled, partial, split)
        cells, instances = _counts(labelled)
        finite = labelled.image[np.isfinite(labelled.image)]
        return {
            "name": labelled.name, "twin": one.twin, "shape": list(labelled.image.shape), "cells": cells,
            "instances": instances, "targets": list(labelled.instance_names),
            "level_db": [round(float(np.mean(finite)), 3), round(float(np.std(finite)), 3)] if finite.size else None,
            "drawn": one.drawn,
        }  # fmt: skip

    def _write_format(self, name: Format, image: LabelledImage, partial: Path, split: str) -> None:
        folder, span = partial / name, self.file.dataset.span
        if name == "coco":
            write_coco([image], folder, span=span, file=f"{image.name}.json")
        elif name == "yolo":
            write_yolo([image], folder, split=split, span=span)
        elif name == "png":
            write_label_maps([image], folder / split, span=span)
        elif name == "geotiff":
            (folder / split).mkdir(parents=True, exist_ok=True)
            layers = (image.image, image.expected, image.classes, image.instances)
            bands = {band: np.asarray(layer, np.float32) for band, layer in zip(BANDS, layers, strict=True)}
            write_bands(folder / split / f"{image.name}.tif", (image.crs, image.transform), bands)
        else:
            from insonify.datasets.labelled_dataset import labelled_dataset

            (folder / split).mkdir(parents=True, exist_ok=True)
            labelled_dataset(image).to_zarr(folder / split / f"{image.name}.zarr", mode="w", consolidated=False)

    @staticmethod
    def _coco_fragments(coco: Path) -> dict[str, Any]:
        """Entries of a scene's images, whose files are removed."""
        fragments = sorted(coco.glob("*.json"))
        merge_coco(fragments, coco / "all.json")
        content = json.loads((coco / "all.json").read_text(encoding="utf-8"))
        for fragment in (*fragments, coco / "all.json"):
            fragment.unlink()
        return {"images": content["images"], "annotations": content["annotations"]}

    def finish(self) -> bool:
        """Write what is about all scenes, if all are there: lists of annotations, names and the card.

        Returns:
            True if all scenes are there.

        Raises:
            StoreError: The disk is full, or a note of a scene is damaged.
        """
        with self._advising("its end"):
            return self._finish()

    def _finish(self) -> bool:
        if sum(1 for _ in (self.path / NOTES).iterdir()) < self.file.dataset.images:
            return False  # soon, of a data set of millions
        if self.missing(range(self.file.dataset.images)):
            return False
        from insonify.datasets.card import card, card_text

        classes = dataset_class_names(self.file, self.base)
        if "coco" in self.file.write:
            for split in self.file.dataset.split:
                self._write_coco_list(split, classes)
        if "yolo" in self.file.write:
            write_yolo_data(self.path / "yolo", classes)
        if "png" in self.file.write:
            for split in self.file.dataset.split:
                names = {
                    image["name"]: image["targets"]
                    for note in self.notes() if note["split"] == split for image in note["images"]
                }  # fmt: skip
                content = {"classes": ["background", *classes], "instances": names}
                write_whole(self.path / "png" / split / "names.json", json.dumps(content))
        content = card(self.file, self.base, list(self.notes()), self.fingerprint)
        write_whole(self.path / "card.json", json.dumps(content, indent=1, allow_nan=False) + "\n")
        write_whole(self.path / "README.md", card_text(content))
        return True

    def notes(self) -> Iterator[dict[str, Any]]:
        """Notes of all scenes, in their order."""
        for scene in range(self.file.dataset.images):
            try:
                yield json.loads(self.note(scene).read_text(encoding="utf-8"))
            except ValueError:
                raise StoreError(f"{self.note(scene)}: the note is damaged. Delete it and give the same command again: "
                                 "its scene is made anew") from None  # fmt: skip

    def _write_coco_list(self, split: str, classes: tuple[str, ...]) -> None:
        """Write the annotations of one part of the split."""
        content = empty_coco(classes)
        for note in self.notes():
            if note["split"] == split:
                for kind in ("images", "annotations"):
                    content[kind].extend(note["coco"][kind])
        write_whole(self.path / "coco" / f"annotations_{split}.json", json.dumps(content, allow_nan=False))


def _counts(image: LabelledImage) -> tuple[dict[str, int], dict[str, int]]:
    """Cells and targets of each class of an image, by its name."""
    names = image.class_names.names
    cells, instances = dict.fromkeys(names, 0), dict.fromkeys(names, 0)
    for row, layer in enumerate(image.layers):
        for instance, count in zip(*np.unique(layer[layer > 0], return_counts=True), strict=True):
            name = names[image.class_number(row, int(instance)) - 1]
            cells[name] += int(count)
            instances[name] += 1
    return cells, instances


def write_whole(path: Path, text: str) -> None:
    """Write a text under a temporary name and rename it."""
    partial = path.with_name(f".{path.name}.{uuid.uuid4().hex}.partial")
    try:
        partial.write_text(text, encoding="utf-8")
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)


def _move_folder(entry: Path, to: Path) -> None:
    """Move a folder to a path where another job may have put the same one."""
    to.parent.mkdir(parents=True, exist_ok=True)
    shutil.rmtree(to, ignore_errors=True)
    try:
        os.replace(entry, to)
    except OSError:
        if not to.is_dir():
            raise
