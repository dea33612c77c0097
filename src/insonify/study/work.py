"""Work of one ping: scatterers, legs, pairs and transforms, counted without drawing any, and priced.

The ground in reach is walked in rings and sectors; where the beams hear anything, the density of scatterers that the
sampling asks for is added up. Targets are counted by the area of their faces, at a few pings, where beams and window
may hear them; faces that look away are reached but send nothing back.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from insonify.engines import rings
from insonify.engines.glint_spread import glint_spread
from insonify.engines.loudness import Loudness
from insonify.engines.room import legs_per_point
from insonify.engines.sampling import Resolution, beam_bound, reach, tiles_in_view, widest_way
from insonify.engines.targets import solid_pieces, target_count
from insonify.engines.view import view
from insonify.engines.volume import Suspended
from insonify.propagation.families import bounces, families_for
from insonify.propagation.images import StraightRays
from insonify.propagation.rays import Rays
from insonify.scattering.lambert import Lambert
from insonify.scenario.scenario import Scenario
from insonify.scene.lattice import BASE_PITCH, FINEST_LEVEL, TILE
from insonify.scene.scatterers import Boundary
from insonify.simulation import Listening
from insonify.sonar.stance import Stance
from insonify.study import prices
from insonify.study.smooth_work import smooth_work
from insonify.synthesis.labels import POINTS
from insonify.synthesis.shapes import shapes_of
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]

FINEST_CELL = (BASE_PITCH * 2.0**FINEST_LEVEL) ** 2
"""Area of the smallest cells of the scatterers' grid [m^2]."""
RINGS, SECTORS = 48, 360
"""Number of rings and sectors in which the seabed is counted [1]."""
PLACES = 12
"""Distances, and depths, at which pairs of legs to points in the water are counted [1]."""
TARGET_PINGS, TARGET_LOOKS = 9, 300
"""Most pings at which targets are counted, and counts of single targets from which on there are fewer pings [1]."""


@dataclass(frozen=True, slots=True)
class Work:
    """Work of one ping, or of some part of it."""

    points: float = 0.0
    """Scatterers [1]."""
    seconds: float = 0.0
    """Processor time [s]."""
    tiles: float = 0.0
    """Tiles of the boundaries [1]."""
    pieces: tuple[float, ...] = ()
    """Pieces that each body is cut into, once for all pings [1]."""
    facets: float = 0.0
    """Memory of the facets of smooth targets [bytes]."""

    def __add__(self, other: "Work") -> "Work":
        """Both together."""
        return Work(
            self.points + other.points,
            self.seconds + other.seconds,
            self.tiles + other.tiles,
            self.pieces + other.pieces,
            max(self.facets, other.facets),
        )


def ping_work(listening: Listening, *, labels: bool = False) -> Work:
    """Work of the first ping of a run, all sides; that on targets is the mean of a few pings.

    Args:
        listening: A prepared scenario.
        labels: Whether its samples are labelled too.
    """
    total = sum((_side_work(listening, side) for side in listening.stances(0)), Work())
    total += _on_targets(listening)
    if labels:
        more = label_work(listening)
        total = replace(total, seconds=total.seconds + more.seconds, tiles=max(total.tiles, more.tiles))
    return total


def label_work(listening: Listening) -> Work:
    """Work of the labels of one ping: those of an expectation of its own, and a place for each pair."""
    scenario = listening.scenario
    fewer = min(scenario.paths.scatterers_per_cell, POINTS)
    paths = scenario.paths.unchecked_copy(scatterers_per_cell=fewer, engine="paths")
    # unchecked: an expectation's work is counted, though sub-bands and the like are for pressures
    expected = replace(listening, scenario=scenario.unchecked_copy(field="incoherent", paths=paths), tracer=None)
    total, names, apart = _on_targets(expected, label=True), listening.label_names, False
    for side in listening.stances(0):
        fast = _label_swath(listening, side)
        total += _boundaries(expected, side, label=True, seabed=fast is None) + _water(expected, side, label=True)
        total, apart = total + (fast or Work()), apart or fast is None
    # by the fast path pairs share the owner's curve out
    curves = (len(names.owners) + len(names.pairs) * apart) * scenario.sonar.channel_count
    return Work(total.points, total.seconds + curves * transform_seconds(listening, expected=True), total.tiles)


def transform_seconds(listening: Listening, *, expected: bool, shapes: int = 1) -> float:
    """Processor time from cells to a time series in one channel [s].

    Args:
        listening: A prepared scenario.
        expected: Whether the series is an expected intensity.
        shapes: Waveforms that it is a sum of.
    """
    cells = listening.grid.padded
    return float(prices.SECONDS_PER_CELL[expected] * cells * np.log2(cells) * (1 + shapes) / 2)


def _side_work(listening: Listening, stance: Stance) -> Work:
    """Work of one side of the sonar at one ping, but for targets."""
    scenario = listening.scenario
    expected, shapes = scenario.field == "incoherent", shape_count(stance)
    beams = scenario.sonar.beam_count
    slow = expected and listening.tracer is None and _quick_steps(listening, stance) is None
    start = prices.PING_SECONDS + prices.EXPECTED_SECONDS * slow
    start += prices.ELEMENTS_SECONDS * (stance.elements is not None)
    fixed = Work(seconds=start + beams * transform_seconds(listening, expected=expected, shapes=shapes))
    if scenario.paths.geometry == "slice":
        return fixed + _slice(listening, stance)
    if listening.tracer is not None:
        return fixed + Work(float(scenario.paths.rays), scenario.paths.rays * prices.SECONDS_PER_RAY)
    return fixed + _boundaries(listening, stance) + _water(listening, stance)


def _slice(listening: Listening, stance: Stance) -> Work:
    """Points along the one line of each boundary, and their pairs."""
    scenario = listening.scenario
    seen = view(listening.engine.scene, scenario.paths, scenario.seed, stance, listening.engine.rays)
    found: list[tuple[Boundary, float]] = [("seabed", scenario.seabed.depth), ("surface", 0.0)]
    total = Work(seconds=prices.SECONDS_PER_SLICE)
    for boundary, level in found:
        kept = families_for(boundary, scenario.paths.followed)
        if boundary not in scenario.paths.causes or _law(scenario, boundary) is None or not kept:
            continue
        heard = reach(stance, level, listening.engine.rays, kept, rise=seen.rise(boundary))
        points = max(heard.farthest - heard.nearest, 0.0) / (seen.resolution.slant / seen.resolution.per_cell)
        each = sum(_legs(listening, stance, name) for name in kept)
        each += len(kept) ** 2 * _pair_seconds(listening, stance, _law(scenario, boundary), boundary)
        total += Work(points, points * each)
    return total


def _boundaries(listening: Listening, stance: Stance, *, label: bool = False, seabed: bool = True) -> Work:
    """Scatterers of the seabed, unless it is counted apart, and of the surface."""
    scenario, total = listening.scenario, Work()
    seen = view(listening.engine.scene, scenario.paths, scenario.seed, stance, listening.engine.rays)
    found: list[tuple[Boundary, float]] = [("seabed", scenario.seabed.depth), ("surface", 0.0)]
    for boundary, level in found:
        kept, law = families_for(boundary, scenario.paths.followed), _law(scenario, boundary)
        if boundary not in scenario.paths.causes or law is None or not kept or (boundary == "seabed" and not seabed):
            continue
        if boundary == "seabed" and not label and (steps := _quick_steps(listening, stance)) is not None:
            total += Work(steps, _swath_seconds(steps, len(kept)))
            continue
        points, place, tiles = _on_boundary(
            stance, level, listening.engine.rays, kept, seen.resolution, scenario, seen.rise(boundary)
        )
        legs, pairs = _met(listening, stance, boundary, kept, points, place)
        each = _pair_seconds(listening, stance, law, boundary, label=label)
        relief = len(scenario.seabed.relief) if boundary == "seabed" else 0
        count = float(points.sum())
        total += Work(count, legs + pairs * each + count * prices.SECONDS_PER_GROUND * relief, tiles)
    return total


def _swath_seconds(steps: float, families: int) -> float:
    """Processor time of the fast reverberation path for so many steps and families of legs [s]."""
    price = prices.SECONDS_PER_STEP + families * prices.SECONDS_PER_STEP_LEG
    return prices.SECONDS_PER_SWATH + steps * price


def _label_swath(listening: Listening, stance: Stance) -> Work | None:
    """Work of labels on the seabed by the fast path, of one side; None where they do not take it."""
    scenario = listening.scenario
    kept = families_for("seabed", scenario.paths.followed)
    if "seabed" not in scenario.paths.causes or not kept or not listening.incoherent(stance).brief:
        return None
    ground = listening.label_ground(stance)
    if ground is None:
        return None
    steps = float(ground.plan.steps)
    seconds = prices.LABEL_SWATH_SECONDS + steps * len(kept) * prices.SECONDS_PER_LABEL_STEP_LEG
    return Work(steps, seconds + (0.0 if listening.shares_ground else _swath_seconds(steps, len(kept))))


def _law(scenario: Scenario, boundary: Boundary) -> object:
    """Scattering law of a boundary; None where it does not scatter."""
    return (scenario.seabed if boundary == "seabed" else scenario.surface).scattering


def _water(listening: Listening, stance: Stance, *, label: bool = False) -> Work:
    """Points in the water."""
    scenario = listening.scenario
    if "water" not in scenario.paths.causes or not scenario.water.scatters:
        return Work()
    seen = view(listening.engine.scene, scenario.paths, scenario.seed, stance, listening.engine.rays)
    suspended = Suspended(listening.engine.scene, scenario.paths, scenario.seed, stance, seen.resolution)
    count, kept = suspended.count(even=scenario.field == "incoherent"), scenario.paths.followed
    pair = _pair_seconds(listening, stance, boundary="water", label=label)
    distance, depth = _in_the_water(listening, stance)
    pairs = _pairs_received(listening, stance, kept, distance, depth)
    near = 1 / np.maximum(distance**2 + (depth - stance.transmit_place[2]) ** 2, 1.0)  # cells widen with the range
    met = float(np.average(pairs[pairs > 0], weights=(distance * near)[pairs > 0])) if pairs.any() else 0.0
    each = sum(_legs(listening, stance, name) for name in kept) + met * pair
    return Work(count, count * (each + prices.SECONDS_PER_GROUND * len(scenario.seabed.relief)))


def _in_the_water(listening: Listening, stance: Stance) -> tuple[Floats, Floats]:
    """Horizontal distances and depths of places all over the water that the window reaches [m], shape (n,) each."""
    farthest = listening.scenario.water.fastest * stance.heard_delays[1] / 2
    part = (np.arange(PLACES) + 0.5) / PLACES
    distance, depth = np.meshgrid(farthest * part, listening.scenario.seabed.depth * part)
    return distance.ravel(), depth.ravel()


def _pairs_received(
    listening: Listening, stance: Stance, kept: tuple[str, ...], distance: Floats, depth: Floats
) -> Floats:  # fmt: skip
    """Number of pairs of straight legs to places, by their distance and depth [m], that fall into the window, (n,)."""
    lengths = []
    for end in (stance.transmit_place, stance.receive_place):
        images = np.full(len(kept), float(end[2]))
        for row, name in enumerate(kept):
            for bounce in bounces(name):
                images[row] = -images[row] if bounce == "S" else 2 * listening.scenario.seabed.depth - images[row]
        lengths.append(np.hypot(distance, depth - images[:, None]))
    both = lengths[0][:, None] + lengths[1]
    first, last = (stance.sound_speed * delay for delay in stance.heard_delays)
    return np.asarray(((both >= first) & (both <= last)).sum(axis=(0, 1)), float)


def _met(
    listening: Listening, stance: Stance, boundary: Boundary, kept: tuple[str, ...], points: Floats, place: Floats
) -> tuple[float, float]:
    """A core's time for the legs to some scatterers at some distances [s], and the pairs that are met there."""
    drawn = boundary == "seabed" and listening.scenario.field == "coherent"
    known = listening.engine.met(stance, place) if drawn else None
    if known is None:
        level = listening.scenario.seabed.depth if boundary == "seabed" else 0.0
        pairs = np.full(len(place), len(kept) ** 2.0)
        if stance.receive_survey is None:
            pairs = _pairs_received(listening, stance, kept, place, np.full(len(place), level))
        count = float(points.sum())
        return count * sum(_legs(listening, stance, name) for name in kept), float(points @ pairs)
    families, share = known
    followed, fitted = ((points * part).sum(axis=1) for part in ((share > 0).any(axis=1), share.max(axis=1)))
    seconds = sum(
        _legs(listening, stance, name, fitted=float(part)) * float(count)
        for name, count, part in zip(families, followed, fitted / np.maximum(followed, 1e-300), strict=True)
    )
    return seconds, float((points * share).sum())


def _legs(listening: Listening, stance: Stance, family: str, *, fitted: float = 1.0) -> float:
    """A core's time for the legs of one family to a scatterer from all ends [s], a part of them off fitted planes."""
    scenario = listening.scenario
    each = prices.SECONDS_PER_LEG
    if not isinstance(listening.engine.rays, StraightRays):
        each += prices.SECONDS_PER_BEND
    if scenario.seabed.relief and "B" in family:
        each += prices.SECONDS_PER_FIT * fitted
    if "S" in family and scenario.surface.bounce == "waves":
        each += prices.SECONDS_PER_WAVE_LEG
    elif "S" in family and scenario.field == "coherent" and scenario.surface.bounce != "mirror":
        each += prices.SECONDS_PER_GLINT
    return each * (1 if stance.together else 2)


def _on_targets(listening: Listening, *, label: bool = False) -> Work:
    """Points on targets in one ping, all sides: means of a few pings."""
    scenario = listening.scenario
    if "target" not in scenario.paths.causes or not scenario.targets or scenario.paths.geometry == "slice":
        return Work()
    kept, scene, total, seconds = scenario.paths.followed, listening.engine.scene, 0.0, 0.0
    looks = int(np.clip(TARGET_LOOKS // len(scenario.targets), 2, TARGET_PINGS))
    pings = np.unique(np.linspace(0, scenario.track.ping_count - 1, looks).round().astype(int)).tolist()
    pieces: list[float] = []
    fullest: tuple[float, Stance | None] = (0.0, None)
    for stance in (side for ping in pings for side in listening.stances(ping)):
        seen = view(scene, scenario.paths, scenario.seed, stance, listening.engine.rays)
        pieces = pieces or solid_pieces(scene, stance, seen.resolution)
        drawn = seen.resolution if scenario.field == "coherent" or label else None  # labels take as few points
        asked, facing = target_count(scene, scenario.paths, stance, seen.resolution.slant, listening.engine.rays, drawn)
        total += asked
        fullest = max(fullest, (asked, stance), key=lambda one: one[0])
        seconds += asked * sum(_legs(listening, stance, name) for name in kept)
        seconds += facing * len(kept) ** 2 * _pair_seconds(listening, stance, label=label)
    most, stance_there = fullest
    if stance_there is None:
        return Work(pieces=tuple(pieces))
    # pings that meet fewer points meet fewer facets
    facets, split, held = smooth_work(listening, stance_there)
    part = total / len(pings) / most
    return Work(total / len(pings) + facets * part, seconds / len(pings) + split * part, pieces=tuple(pieces),
                facets=held)  # fmt: skip


def _quick_steps(listening: Listening, stance: Stance) -> float | None:
    """Steps along the lines of the ground by which one side is heard the quick way; None where it is not."""
    if listening.scenario.field == "coherent" or not listening.incoherent(stance).brief:
        return None
    ground = listening.ground(stance)
    return None if ground is None else float(ground.plan.steps)


def shape_count(stance: Stance) -> int:
    """Waveforms that each channel's sound is a sum of."""
    made = shapes_of(stance)
    return len(made.band) * len(made.doppler)


def _expected_pair_seconds(listening: Listening, stance: Stance, section: float, boundary: Boundary) -> float:
    """Processor time for the expectation of one pair of families in all channels of one side [s]."""
    scenario = listening.scenario
    if not stance.together:
        return prices.SECONDS_PER_PAIR_APART * scenario.sonar.beam_count + (
            prices.SECONDS_PER_SURFACE_SECTION if section and boundary == "surface" else section
        )
    kept = len(families_for(boundary, scenario.paths.followed))
    legs = legs_per_point(listening.engine.scene, scenario.paths, boundary, drawn=boundary == "water")
    glints = (legs**2 - kept**2) / kept**2 * prices.SECONDS_PER_GLINT_PAIR
    return section + (prices.SECONDS_PER_EXPECTED_PAIR + glints) * scenario.sonar.beam_count


def _pair_seconds(
    listening: Listening, stance: Stance, law: object = None, boundary: Boundary = "target", *, label: bool = False
) -> float:  # fmt: skip
    """Processor time for one pair of legs in all channels of one side [s], by a law; None: one without angles."""
    beams = listening.scenario.sonar.beam_count
    section = 0.0 if law is None or isinstance(law, Lambert) else prices.SECONDS_PER_SECTION
    if label:
        return section + (prices.SECONDS_PER_PAIR + prices.SECONDS_PER_LABEL) * beams
    if listening.scenario.field == "incoherent":
        return _expected_pair_seconds(listening, stance, section, boundary)
    if stance.still and stance.elements is None and not stance.bands:
        return section + prices.SECONDS_PER_PAIR * beams
    shapes = prices.SECONDS_PER_SHAPE * (shape_count(stance) - 1)
    return section + prices.SECONDS_PER_PAIR + (prices.SECONDS_PER_ELEMENT + shapes) * beams


def _on_boundary(
    stance: Stance, level: float, rays: Rays, families: tuple[str, ...], resolution: Resolution,
    scenario: Scenario, rise: float,
) -> tuple[Floats, Floats, float]:  # fmt: skip
    """Scatterers at some distances [m], and tiles, in reach of window and beams: of a boundary so far [m] off level."""
    floor = float(amplitude_ratio(scenario.paths.beam_floor_db))
    glints = glint_spread(scenario.scene, stance.frequency)
    if stance.receive_survey is not None:  # no rings about two places: its tiles are counted
        widest = widest_way(stance, scenario.water.fastest)
        found, density = tiles_in_view(
            stance,
            scenario.seabed.lattice,
            level,
            rays,
            families,
            resolution,
            floor,
            rise=rise,
            widest=widest,
            glints=glints,
        )
        return density * TILE**2, np.zeros(len(density)), float(len(found.level))
    heard = reach(stance, level, rays, families, rise=rise)
    if heard.farthest <= heard.nearest:
        return np.zeros(1), np.zeros(1), 0.0
    far = np.array([heard.farthest])
    margin = _tile(resolution, far, heard.height, scenario)[0] / 2  # ground comes in whole tiles
    outer = heard.farthest + margin
    edges = np.geomspace(max(heard.nearest - margin, outer * 1e-3), outer, RINGS + 1)
    middle = np.sqrt(edges[:-1] * edges[1:])
    tile = _tile(resolution, middle, heard.height, scenario)
    azimuth = (np.arange(SECTORS) + 0.5) * 2 * np.pi / SECTORS
    place = np.stack(np.broadcast_arrays(middle[:, None] * np.cos(azimuth), middle[:, None] * np.sin(azimuth)), -1)
    half = np.hypot(np.diff(edges), middle * 2 * np.pi / SECTORS) / 2 + tile / 2
    bound = beam_bound(
        place.reshape(-1, 2) + stance.transmit_place[:2], np.repeat(half, SECTORS), stance, level, rays, families,
        rise=rise, glints=glints,
    )  # fmt: skip
    loud = (bound >= floor).reshape(RINGS, SECTORS)
    ground = np.pi * np.diff(edges**2)
    tiles = ground * loud.mean(axis=1) / tile**2
    loudness = Loudness(
        stance, level, rays, families, scenario.seabed.lattice, outer, scenario.paths.thinning, glints
    )  # fmt: skip
    if scenario.field == "incoherent":
        wide = min(resolution.width, rings.WIDEST_CELL) / np.sqrt(resolution.per_cell)
        cell = resolution.slant / np.sqrt(resolution.per_cell) * np.hypot(middle, heard.height) * wide
        tiles = ground * loud.mean(axis=1) / (cell * rings.TILE * rings.ACROSS)
    else:
        cell = np.maximum(resolution.cell_area(middle, heard.height), FINEST_CELL)
    return ground * np.minimum(loudness.mean_share(middle), loud.mean(axis=1)) / cell, middle, float(tiles.sum())


def _tile(resolution: Resolution, distance: Floats, height: float, scenario: Scenario) -> Floats:
    """Side of the tiles that the sampling wants at some distances [m], shape (n,)."""
    pitch = np.sqrt(resolution.cell_area(distance, height))
    if scenario.field == "coherent":  # the lattice's cells come in powers of two
        pitch = BASE_PITCH * 2.0 ** np.maximum(np.floor(np.log2(pitch / BASE_PITCH)), FINEST_LEVEL)
    return np.asarray(TILE * pitch)
