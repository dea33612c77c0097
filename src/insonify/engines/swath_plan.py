"""What the quick way knows before any ping: all that stays while the sonar only moves on.

Lines about the sonar, the share of each pair of paths along them, tables of bounces. A sonar that keeps its depth and
its attitude asks for the same again at every ping.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.engines._points_kernel import Points, list_points
from insonify.engines.skyline import fresnel_half_length
from insonify.engines.thinning import Thinning, thinning
from insonify.propagation.families import bounces, image_depth
from insonify.propagation.rims import rims
from insonify.scattering.fast import FastLaw
from insonify.scene.scene import Scene
from insonify.sonar.stance import Stance

Floats = NDArray[np.float64]

MIRROR_NODES = 2049
"""Sines of the grazing angle at which the bounces of a family are tabled."""
STEEPNESS = 0.05
"""Slope that is reckoned with where ground is rough, to tell which pairs are faint [1]."""


@dataclass(frozen=True, eq=False)
class Plan:
    """What all pings from one depth in one attitude have in common."""

    families: tuple[str, ...]
    law: FastLaw
    lines: Floats
    """As of `_swath_kernel.walk`, (s, 9)."""
    step: float
    """Distance of samples along the lines [m]."""
    thinning: Thinning
    letters: NDArray[np.int64]
    """As of `_swath_kernel.walk`, like all that follow."""
    prefix: NDArray[np.int64]
    images: Floats
    way_images: Floats
    way_rising: NDArray[np.bool_]
    mirrors: NDArray[np.complex64]
    factor: NDArray[np.float32]
    loss: float
    rims: Floats
    """Middle, north and east, radius, depths of top and base of an upright cylinder about each target that casts a
    shadow [m], (t, 5)."""
    lists: Points
    """Points of each line where it passes no target."""

    @property
    def steps(self) -> int:
        """Samples of the ground that a ping looks at whose lines pass no target."""
        return int(self.lists.samples.sum())

    @cached_property
    def energy(self) -> NDArray[np.float32]:
        """Energy of every pair from each stretch of each line without targets, all across the line [m^-2], (s, b, p).

        A line beside a null of the beam has more than its middle tells.
        """
        across = self.lines.copy()
        across[:, 3] = across[:, 2]
        return self.thinning.energies(across)

    def listed(self, lines: Floats, heading: float, share: NDArray[np.uint8]) -> Points:
        """Points of lines that are not the plan's own.

        Args:
            lines: As of `_swath_kernel.walk`, (m, 9).
            heading: Heading of their frame [rad].
            share: Part of the points of each line and stretch that every pair takes, in parts of `WHOLE`, (m, b, p).
        """
        ways = len(self.way_images)
        return _listed(lines, heading, self.step, self.thinning, share, self.letters, self.prefix, ways)


def planned(
    scene: Scene, stance: Stance, families: tuple[str, ...], law: FastLaw, lines: Floats, step: float, heading: float,
    rise: float,
) -> Plan:  # fmt: skip
    """The plan of a ping, kept for all that `lines_in_view` gives the same lines.

    Args:
        scene: The scene.
        stance: The sonar.
        families: Families that reach the seabed.
        law: How the seabed answers.
        lines: Of `lines_in_view`.
        step: Distance of samples along them [m].
        heading: Of their frame [rad].
        rise: How far the ground may stand above or lie below its mean depth [m].
    """
    key = id(lines), id(scene), id(law), step, stance.pulse.pulse, stance.pulse.receiver
    held = _LAST.get(key)
    if held is None:
        if len(_LAST) >= _MOST:
            _LAST.clear()
        # what the key names is kept, so that nothing else can take its number
        held = _LAST[key] = _plan(scene, stance, families, law, lines, step, heading, rise), (lines, scene, law)
    return held[0]


_LAST: dict[Any, tuple[Plan, Any]] = {}
_MOST = 8


def _plan(
    scene: Scene, stance: Stance, families: tuple[str, ...], law: FastLaw, lines: Floats, step: float, heading: float,
    rise: float,
) -> Plan:  # fmt: skip
    """The same, made anew."""
    source, depth, rough = float(stance.transmit_place[2]), scene.seabed.depth, scene.seabed.bed is not None
    mirrors = _mirror_table(scene, families, round(source, 2), stance.wavelength, rough)
    absorption_db = float(scene.water.absorption(stance.frequency))
    thin = thinning(
        stance, depth, rise, families, lines, step, heading, law, mirrors, absorption_db, STEEPNESS if rough else 0.0
    )
    lines, (letters, prefix, ways) = thin.lines, _ways(families)
    lists = _listed(lines, heading, step, thin, thin.share, letters, prefix, len(ways))
    return Plan(
        families, law, lines, step, thin, letters, prefix,
        images=np.array([image_depth(name, source, depth) for name in families]),
        way_images=np.array([image_depth(name, source, depth) for name in ways]),
        way_rising=np.array([way.endswith("B") for way in ways]),
        mirrors=mirrors,
        factor=np.zeros(0, np.float32) if law.factor is None else law.factor,
        loss=absorption_db / 20 * float(np.log2(10)),
        rims=rims(scene),
        lists=lists,
    )  # fmt: skip


def _listed(
    lines: Floats, heading: float, step: float, thin: Thinning, share: NDArray[np.uint8], letters: NDArray[np.int64],
    prefix: NDArray[np.int64], ways: int,
) -> Points:  # fmt: skip
    """Points of some lines with some shares: counted first, then filled in."""

    def room(points: int, rows: int, ranges: int) -> Points:
        count = len(lines)
        return Points(
            np.zeros(count + 1, np.int64), np.zeros(count, np.int64), np.zeros(count, np.int64),
            np.zeros((count, ways), bool), np.empty(points, np.int32), np.empty(points, np.int32), np.empty(points),
            np.empty((2, points), np.float32), np.zeros((count, len(thin.pair) + 1), np.int64),
            np.empty(rows, np.int32), np.empty(rows, np.float32), np.zeros(count + 1, np.int64),
            np.empty((ranges, 2), np.int64),
        )  # fmt: skip

    asked = lines, heading, step, thin.edges, thin.pair, share, thin.close, letters, prefix
    counted = room(0, 0, 0)
    list_points(*asked, counted, False)
    rows = int(counted.pair_first[-1, -1]) if len(lines) else 0
    lists = room(int(counted.first[-1]), rows, int(counted.close_first[-1]))
    list_points(*asked, lists, True)
    return lists


def _ways(families: tuple[str, ...]) -> tuple[NDArray[np.int64], NDArray[np.int64], tuple[str, ...]]:
    """Letters of each family as numbers, the row of what has been passed up to each segment, and these rows' names."""
    strings = [bounces(name) for name in families]
    longest = max(1, *(len(string) for string in strings))
    letters = np.zeros((len(families), longest), np.int64)
    prefix = np.zeros((len(families), longest + 1), np.int64)
    ways: list[str] = []
    for f, string in enumerate(strings):
        letters[f, : len(string)] = [1 + (letter == "B") for letter in string]
        for k in range(len(string) + 1):
            if k == 0 and string.startswith("S"):
                continue  # on its way up it meets no ground
            name = string[:k] or "D"
            if name not in ways:
                ways.append(name)
            prefix[f, k] = ways.index(name)
    return letters, prefix, tuple(ways)


@lru_cache(maxsize=32)
def _mirror_table(
    scene: Scene, families: tuple[str, ...], source: float, wavelength: float, rough: bool
) -> NDArray[np.complex64]:
    """All bounces of each family over evenly spaced sines, on ground at the mean depth, (f, nodes)."""
    sine = np.linspace(0, 1, MIRROR_NODES)
    grazing, depth, bed = np.arcsin(sine), scene.seabed.depth, scene.seabed.bed
    tangent = np.maximum(sine, 1e-6) / np.sqrt(np.maximum(1 - sine**2, 1e-12))
    table = np.ones((len(families), MIRROR_NODES), np.complex128)
    for row, string in enumerate(map(bounces, families)):
        distance = np.abs(depth - image_depth(families[row], source, depth)) / tangent
        first = depth - source if string.startswith("B") else source
        for k, letter in enumerate(string):
            if letter == "S":
                table[row] *= scene.surface.mirror(grazing)
                continue
            table[row] *= scene.seabed.mirror(grazing)
            if rough and bed is not None:
                half = fresnel_half_length((first + k * depth) / tangent, distance, tangent, wavelength)
                zone = np.maximum(2 * half * np.sqrt(np.maximum(sine, 1e-6)), 1e-6)
                table[row] *= bed.smoothness(sine, wavelength, np.asarray(zone, float))
    return table.astype(np.complex64)
