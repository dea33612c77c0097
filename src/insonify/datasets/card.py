"""Card of a data set: counts, ranges, seeds, version and distance to a real recording."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from insonify.datasets.dataset_classes import dataset_class_names

if TYPE_CHECKING:
    from insonify.datasets.dataset_file import DatasetFile
    from insonify.scenario.scenario import Scenario


def card(file: DatasetFile, base: Scenario, notes: list[dict[str, Any]], fingerprint: str) -> dict[str, Any]:
    """Content of the card.

    Args:
        file: The data set.
        base: Its scenario.
        notes: Notes of all its scenes.
        fingerprint: Fingerprint of all that its images depend on.
    """
    from importlib.metadata import version

    classes = dataset_class_names(file, base)
    images = [image for note in notes for image in note["images"]]
    levels = np.array([image["level_db"] for image in images if image["level_db"]])
    return {
        "title": base.title or Path(file.scene).stem,
        "version": f"insonify {version('insonify')}",
        "fingerprint": fingerprint,
        "seed": file.dataset.seed,
        "scenes": len(notes),
        "images": len(images),
        "twins": dict(sorted(Counter(image["twin"] for image in images).items())),
        "split": dict(Counter(note["split"] for note in notes)),
        "shapes": {f"{rows} x {columns}": count for (rows, columns), count in
                   sorted(Counter(tuple(image["shape"]) for image in images).items())},
        "annotations": {name: sum(image["instances"][name] for image in images) for name in classes},
        "cells": {name: sum(image["cells"][name] for image in images) for name in classes},
        "level_db": {"mean": round(float(levels[:, 0].mean()), 3), "std": round(float(levels[:, 1].mean()), 3)},
        "varied": _varied([note["drawn"] for note in notes], file.model_dump(mode="json", exclude_none=True)["vary"]),
        "projection": file.dataset.projection,
        "gain": file.dataset.gain,
        "field": base.field,
        "compared": _compared(file, base),
    }  # fmt: skip


def _varied(drawn: list[dict[str, Any]], distributions: dict[str, Any]) -> dict[str, Any]:
    """Range, or counts, of the values of each key."""
    out: dict[str, Any] = {}
    for key in drawn[0]:
        values = [one[key] for one in drawn if key in one]
        if key.startswith("clutter["):
            out[f"{key} count"] = _summary([len(value) for value in values])
            continue
        out[key] = _summary(values)
        if key in distributions:
            out[key]["distribution"] = distributions[key]
    return out


def _summary(values: list[Any]) -> dict[str, Any]:
    """Least, mean and largest of numbers and of each coordinate; counts of anything else."""
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        return {"least": min(values), "mean": float(np.mean(values)), "largest": max(values)}
    if all(isinstance(value, list) and len(value) in (2, 3) and all(isinstance(x, int | float) for x in value)
           for value in values):  # fmt: skip
        table = np.array(values, float)
        return {"least": table.min(axis=0).tolist(), "mean": table.mean(axis=0).tolist(),
                "largest": table.max(axis=0).tolist()}  # fmt: skip
    return {"counts": dict(sorted(Counter(json.dumps(value) for value in values).items()))}


def _compared(file: DatasetFile, base: Scenario) -> dict[str, Any] | None:
    """Distance of the first scene to the real recording that the file names."""
    if file.compare is None:
        return None
    from insonify import random_keys
    from insonify.comparison.compare import compare
    from insonify.datasets.drawn_scene import SceneDraws
    from insonify.datasets.rendered_scene import expected_recording, with_speckle

    scenario, _ = SceneDraws(file, base).scene(0)
    recording = with_speckle(expected_recording(scenario)[0], scenario, random_keys.SPECKLE)
    result = compare(file.compare, recording).to_dict()
    return {"real": Path(result["real"]).name, **{key: result[key] for key in ("summary", "notes", "findings")}}


def card_text(content: dict[str, Any]) -> str:
    """The card as a page of Markdown."""
    lines = [f"# {content['title']}", "", f"{content['images']} simulated sonar images of {content['scenes']} scenes, "
             f"made by {content['version']}, seed {content['seed']}.", ""]  # fmt: skip
    rows = [("projection", content["projection"]), ("gain", content["gain"]), ("field", content["field"]),
            *((f"images of {name}", count) for name, count in content["twins"].items()),
            *((f"scenes in {name}", count) for name, count in content["split"].items()),
            *((f"images of {shape} cells", count) for shape, count in content["shapes"].items()),
            *((f"annotations: {name}", count) for name, count in content["annotations"].items()),
            ("level, mean and standard deviation",
             f"{content['level_db']['mean']:.1f} dB, {content['level_db']['std']:.1f} dB")]  # fmt: skip
    lines += _table(("", ""), rows)
    lines += ["", "## What varies", ""]
    lines += _table(("key", "least", "mean", "largest", "distribution"), [
        (f"`{key}`", *(_shown(about.get(name)) for name in ("least", "mean", "largest")),
         _shown(about.get("distribution") or about.get("counts")))
        for key, about in content["varied"].items()
    ])  # fmt: skip
    if compared := content["compared"]:
        lines += ["", f"## Compared with {compared['real']}", "", f"Scene 0: {compared['summary']}.", ""]
        lines += _table(("measure", "verdict", ""), [
            (finding["measure"], finding["verdict"], finding["reason"]) for finding in compared["findings"]
        ])  # fmt: skip
    return "\n".join([*lines, "", f"Fingerprint of file, scenario and version: {content['fingerprint']}", ""])


def _shown(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return ", ".join(_shown(one) for one in value)
    return "" if value is None else f"`{json.dumps(value)}`" if isinstance(value, dict) else str(value)


def _table(heads: tuple[str, ...], rows: list[tuple[Any, ...]]) -> list[str]:
    line = "| " + " | ".join(heads) + " |"
    return [line, "|" + " --- |" * len(heads), *("| " + " | ".join(map(str, row)) + " |" for row in rows)]
