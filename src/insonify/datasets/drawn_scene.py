"""Scenes of a data set: the scenario with the values that belong to one image.

Every number follows from the seed of the data set, the key and the number of the image, so that an image is the same in
any part of the job, and a key that is added changes no other.
"""

import hashlib
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify import random_keys
from insonify.datasets.dataset_file import Clutter, DatasetFile
from insonify.datasets.distributions import Draw, SwathArea, in_si
from insonify.datasets.swath import TRIES, PlacementError, free_position, swath_of
from insonify.datasets.varied_keys import VariedKey, varied_keys
from insonify.diagnostics.diagnostic import ScenarioError
from insonify.scenario.scenario import Scenario
from insonify.scene.shape_library import preset_triangles

Floats = NDArray[np.float64]
SWATH_KEYS = ("track", "sonar", "water", "seabed.depth")
"""Keys that the swath depends on."""
WITHOUT_MULTIPATH = {"paths.max_reflections": 0, "paths.families": None}


def uniforms(seed: int, key: str, image: int | NDArray[np.int64], turn: int | NDArray[np.int64] = 0) -> Floats:
    """Four uniform numbers that belong to a key and an image.

    Args:
        seed: Seed of the data set [1].
        key: The key.
        image: Numbers of the images, any shape.
        turn: Numbers of the draw, where one value takes several.

    Returns:
        Numbers above 0 and below 1, shape (..., 4).
    """
    digest = hashlib.blake2b(key.encode(), digest_size=8).digest()
    first, second = (int.from_bytes(half, "little") for half in (digest[:4], digest[4:]))
    return random_keys.uniforms(seed, random_keys.DATASET, image, first, second, turn)


@dataclass(frozen=True)
class SceneDraws:
    """Draws of all images about one scenario."""

    file: DatasetFile
    base: Scenario

    def varied(self) -> list[tuple[VariedKey, Draw]]:
        """Keys that vary, those of groups before those inside them."""
        pairs = [(one, draw) for key, draw in self.file.vary.items() for one in varied_keys(self.base, key)]
        return sorted(pairs, key=lambda pair: pair[0].path.count("."))

    def values(self, key: str, draw: Draw, images: NDArray[np.int64]) -> list[Any]:
        """Values of one key in some images."""
        return draw.values(uniforms(self.file.dataset.seed, key, images)[:, 0])

    def scene(self, image: int) -> tuple[Scenario, dict[str, Any]]:
        """Scenario of an image, and the values that were drawn for it, by key.

        Args:
            image: Number of the image, from 0.

        Raises:
            ScenarioError: The drawn values contradict each other.
            PlacementError: A position cannot be placed in the swath.
        """
        try:
            return self._scene(image)
        except ScenarioError as error:
            faults = [replace(fault, problem=f"image {image}: {fault.problem}") for fault in error.faults]
            raise ScenarioError(faults) from None

    def _scene(self, image: int) -> tuple[Scenario, dict[str, Any]]:
        rows, seed = np.array([image]), self.file.dataset.seed
        drawn: dict[str, Any] = {}
        changes: dict[str, Any] = {"seed": int(uniforms(seed, "seed", image)[0] * 2**31)}
        placed: list[tuple[VariedKey, SwathArea]] = []
        for key, draw in self.varied():
            if draw.uniform_in is not None:
                placed.append((key, draw.uniform_in))
                continue
            drawn[key.key] = changes[key.path] = self.values(key.key, draw, rows)[0]
        scene, taken = self._scene_of_swath(changes), list[tuple[float, float]]()
        for key, area in placed:
            position = self._free_position(scene, key.key, area, image, taken)
            depth = value_at(self.base, key.path)[2:]  # of a point, which has one
            drawn[key.key] = changes[key.path] = [*position, *depth]
        for kind, clutter in enumerate(self.file.clutter):
            things = self._clutter(scene, kind, clutter, image, taken)
            drawn[f"clutter[{kind}]"] = things
        things = [thing for kind in range(len(self.file.clutter)) for thing in drawn[f"clutter[{kind}]"]]
        scenario = self.base.with_(changes)
        if things:
            scenario = scenario.with_("targets", [*scenario.targets, *things])
        return scenario, drawn

    def _scene_of_swath(self, changes: dict[str, Any]) -> Scenario:
        """Scenario with the swath of an image: the base, where nothing varies that its swath depends on.

        It is without targets, which are placed later: warnings about their places in the base would be wrong.
        """
        own = {path: value for path, value in changes.items() if path.startswith(SWATH_KEYS)}
        return self.base.with_({**own, "targets": ()}) if own else self.base

    def _clutter(
        self, scene: Scenario, kind: int, clutter: Clutter, image: int, taken: list[tuple[float, float]]
    ) -> list[dict[str, Any]]:
        """Things of one kind of clutter, as targets."""
        name, rows = f"clutter[{kind}]", np.array([image])
        count = clutter.count
        if isinstance(count, Draw):
            count = self.values(f"{name}.count", count, rows)[0]
        things = []
        for n in range(count):
            one = f"{name}.{n}"
            own = uniforms(self.file.dataset.seed, one, image)
            thing = {"heading": float(2 * np.pi * own[0])} | clutter.target
            thing["label"] = f"{clutter.label} {n + 1}"
            if clutter.preset == "rock":
                thing.setdefault("variant", int(own[1] * 2**31))
            for key, draw in clutter.draws.items():
                thing[key] = self.values(f"{one}.{key}", draw, rows)[0]
            if clutter.length is not None:
                thing["size"] = _size(clutter.preset, in_si(self.values(f"{one}.length", clutter.length, rows)[0]))
            thing["position"] = list(self._free_position(scene, one, clutter.position, image, taken))
            things.append(thing)
        return things

    def _free_position(
        self, scenario: Scenario, key: str, area: SwathArea, image: int, taken: list[tuple[float, float]]
    ) -> tuple[float, float]:
        """Position in the swath, apart from those taken, to which it is added."""
        tries = uniforms(self.file.dataset.seed, key, image, np.arange(TRIES))
        try:
            position = free_position(swath_of(scenario, area), area, tries, taken)
        except PlacementError as fault:
            raise PlacementError(f"image {image}, {key}: {fault}") from None
        taken.append(position)
        return position


def twin(scenario: Scenario, pair: str, targets: int) -> Scenario:
    """The scenario of a twin that differs in one thing.

    Args:
        scenario: Scenario of the image.
        pair: Thing in which the twin differs, one of `dataset_file.Pair`; anything else leaves it as it is.
        targets: Number of targets, the first ones; clutter after them stays.
    """
    if pair == "no_multipath":
        return scenario.with_(WITHOUT_MULTIPATH)
    if pair == "no_target":
        return scenario.with_("targets", scenario.targets[targets:])
    return scenario


def value_at(scenario: Scenario, path: str) -> Any:
    """Value of a scenario at a path of keys and indices."""
    value: Any = scenario
    for step in path.split("."):
        value = value[int(step)] if isinstance(value, tuple) else getattr(value, step)
    return value


def _size(preset: str, length: float) -> list[float]:
    """Length, width and height of a shape of the library, in its own proportions [m]."""
    extent = np.ptp(preset_triangles(preset).vertices, axis=0)
    return [float(side) for side in length * extent / extent[0]]
