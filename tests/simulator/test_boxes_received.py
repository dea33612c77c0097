"""A box in the water: what its faces send back, what its body hides, and what its corner with the bed returns."""

import numpy as np
import pytest

from insonify.propagation.image_sources import image_legs
from insonify.records.legs import LegStatus
from insonify.scenario.scenario import Scenario
from insonify.scene.scene import point_scatterer
from insonify.scene.target import Box, PointTarget
from insonify.simulator import arrivals, build_simulator, levels
from oracles.scenes import nominal
from oracles.sonar_equation import pulse_energy
from oracles.water import Block, cut, fold

WATER = {"noise_level_db": None, "absorption_db_per_m": 0.03}
NARROW = {"size": (0.2, 1.0, 1.0), "position": (0.0, 150.5)}
ECHO = {"window": (0.1995, 0.2035)}


def seen(box: dict[str, object], **paths: object) -> Scenario:
    """The nominal box alone, received about its direct echo."""
    return nominal(box=box, water=WATER, track=ECHO, paths={"contributions": ["target"], **paths})


def energy(scenario: Scenario, pair: str = "all") -> float:
    """Energy of the target's echo [uPa^2 s]."""
    curve = levels(scenario).level_db.sel(contribution="target", pair=pair).values
    return float(np.sum(10 ** (curve / 10)) / 25e3)


def leg(depth: float, family: str) -> tuple[float, float]:
    """Length of the walked leg to the near face at a depth [m], and cosine of its angle from the face's normal."""
    path = fold((0, 0, 11), (0, 150, depth), family, 20.0)
    return path.length, path.arrival[1]


@pytest.mark.parametrize("family", ["D", "S", "B"])
def test_a_wall_scatters_by_lamberts_law(family: str) -> None:
    """Energy of a 0.2 m wide face by one family: integral over its height of mu cos^2 / L^4, times the pulse's energy.

    Faces are drawn in 0.05 m cells; the beam is flat over the width to 0.1 dB. Within 0.15 dB.
    """
    depth = np.linspace(19, 20, 201)
    length, cosine = np.array([leg(z, family) for z in depth]).T
    bounced = {"D": 1.0, "S": 1.0, "B": 0.35**4}[family]
    face = 0.2 * np.trapezoid(0.1 * cosine**2 / length**4 * 10 ** (-2 * 0.03 * length / 10), depth)
    expected = 10**22 * face * bounced * pulse_energy(duration=0.2e-3, fraction=0.2, band=20e3)
    window = {"D": ECHO["window"], "S": (0.2025, 0.2085), "B": ECHO["window"]}[family]
    scenario = nominal(box=NARROW, water=WATER, track={"window": window},
                       paths={"max_reflections": 1, "families": (family,), "contributions": ["target"]})  # fmt: skip
    # the top, 0.2 m^2, is reached at 3 degrees: cos^2 of 87 degrees is 1/300 of the wall's
    assert 10 * np.log10(energy(scenario, f"{family}-{family}") / expected) == pytest.approx(0, abs=0.15)


@pytest.mark.parametrize("strength", [-20.0, -5.5])
def test_a_brighter_box_is_brighter_by_as_much(strength: float) -> None:
    """Decibels of the faces' strength are decibels of the echo."""
    bright, plain = (
        energy(seen({**NARROW, "scattering": {"strength_db": s}}, max_reflections=0)) for s in (strength, -10.0)
    )
    assert 10 * np.log10(bright / plain) == pytest.approx(strength + 10, abs=1e-6)


def test_only_faces_towards_the_sonar_scatter() -> None:
    """Of a square box in the east: the west face and the top by direct paths; the far side stays silent."""
    found = arrivals(nominal(box={"position": (0.0, 150.5), "size": (1.0, 1.0, 1.0)}, track=ECHO,
                             paths={"max_reflections": 0, "contributions": ["target"]}))  # fmt: skip
    east = found.position[:, 1]
    top = np.isclose(found.position[:, 2], 19.0)
    ends = np.isclose(np.abs(found.position[:, 0]), 0.5)
    assert np.all(np.isclose(east, 150.0) | top | ends)
    assert np.isclose(east, 150.0).sum() > 100 and top.sum() > 100
    assert not np.any(np.isclose(east, 151.0) & ~top & ~ends)


def test_a_wall_on_the_bed_is_a_corner() -> None:
    """Wall and its image: D and B interfere at every point, so aa + ac + ca + cc are more than their energies.

    With R = 1 near the foot all four paths arrive within a pulse, and the mixed pair brings 4 |A|^2: 6 |A|^2 over the
    two squares plus fringes that average away over the height; 10 log10(6/4) = 1.8 dB above the sum of energies.
    """
    corner = {"water": WATER, "track": {"window": (0.1995, 0.205)}, "seabed": {"depth": 20, "reflection": 1.0}}
    paths = {"max_reflections": 1, "families": ("D", "B"), "contributions": ["target"]}
    still, shaken = (energy(nominal(box=NARROW, **corner, paths={**paths, "jitter": jitter})) for jitter in (0.0, 1.0))
    assert 10 * np.log10(still / shaken) == pytest.approx(10 * np.log10(6 / 4), abs=0.3)


def test_a_floating_box_beside_the_sonar_shows_its_sides_only() -> None:
    """From 11 m deep neither a top at 10 m nor a base at 12 m is seen: all that scatters lies between them."""
    box = {"position": (0.0, 150.5), "size": (1.0, 1.0, 2.0), "base_depth": 12.0}
    found = arrivals(nominal(box=box, track=ECHO, paths={"max_reflections": 0, "contributions": ["target"]}))
    depth = found.position[:, 2]
    assert len(found) > 100
    assert depth.min() > 10.0 and depth.max() < 12.0


@pytest.mark.parametrize("heading", [0.0, 0.35, 1.2])
def test_what_a_box_hides_from_each_family_is_what_a_walked_path_cannot_reach(heading: float) -> None:
    """Bed points behind a high box, order 2: the families that arrive are those whose folded path misses the box.

    600 points of the drawn bed, three families; paths that graze an edge within 1 cm are left out.
    """
    box = {"position": (0.0, 60.0), "size": (4.0, 2.0, 8.0), "heading": heading}
    scenario = nominal(
        box=box,
        track={"window": (0.083, 0.1)},
        line={"length": 0.2},
        paths={"contributions": ["seabed"], "beam_cutoff_db": -20, "scatterers_per_cell": 1},
    )
    simulator = build_simulator(scenario)
    here = simulator.ping_geometry(0)
    plain, small, large = (
        Block((0.0, 60.0), heading, (2.0 + d, 1.0 + d), 12.0 - d, 20.0 + d) for d in (0, -0.01, 0.01)
    )
    checked, hidden = 0, 0
    for pairs in simulator.engine.all_pairs(here):
        for n in range(0, len(pairs.scatterers), 13):
            place = pairs.scatterers.position[n]
            if np.abs(plain.within(place)).max() < 1.3:
                continue
            for f, family in enumerate(pairs.transmit_legs.families):
                path = fold(here.transmit_position, place, family, 20.0)
                if cut(path, small) == cut(path, large):
                    assert (pairs.transmit_legs.visibility[f, n] == 0) == cut(path, plain), (family, place)
                    checked, hidden = checked + 1, hidden + cut(path, plain)
    assert checked > 300 and 0.02 * checked < hidden < 0.98 * checked


def test_a_box_has_the_size_that_it_states() -> None:
    """Length along its heading: 4 m by 1 m turned by 90 degrees lies east-west."""
    along, across = (
        arrivals(
            nominal(
                targets=[Box(position=(0, 60), size=(4, 1, 1), heading=turn).model_dump()],
                track={"window": (0.075, 0.09)},
                paths={"max_reflections": 0, "contributions": ["target"]},
            )
        ).position
        for turn in (0.0, np.pi / 2)
    )
    assert np.ptp(along[:, 0]) == pytest.approx(4, abs=0.1) and np.ptp(along[:, 1]) == pytest.approx(1, abs=0.1)
    assert np.ptp(across[:, 0]) == pytest.approx(1, abs=0.1) and np.ptp(across[:, 1]) == pytest.approx(4, abs=0.1)


@pytest.mark.parametrize("aside", [0.0, 0.9, 1.1, 10.0, -1.1])
@pytest.mark.parametrize("turn", [0.0, np.pi / 2])
def test_a_leg_along_a_wall_is_cut_by_what_stands_in_it_only(turn: float, aside: float) -> None:
    """Due east (or north) from the sonar past a box 2 m wide: cut within 1 m of its middle, clear beside it.

    The leg runs exactly along two of the box's sides, where a slab is never entered nor left.
    """
    ahead, right = np.array([np.sin(turn), np.cos(turn)]), np.array([np.cos(turn), -np.sin(turn)])
    scene = nominal(box={"position": tuple(50 * ahead + aside * right), "size": (2.0, 2.0, 19.0)}).scene
    far = point_scatterer(PointTarget(position=(*(100 * ahead), 15.0)))
    families = ("D", "S", "B")
    legs = image_legs(scene, np.array([0.0, 0.0, 11.0]), far, families, 1e5)
    walked = [fold((0, 0, 11), far.position[0], name, 20.0) for name in families]
    block = Block(tuple(50 * ahead + aside * right), 0.0, (1.0, 1.0), 1.0, 20.0)
    assert [status == LegStatus.OCCLUDED for status in legs.status[:, 0]] == [cut(path, block) for path in walked]
    assert bool(legs.status[0, 0] == LegStatus.OCCLUDED) is (abs(aside) < 1)
