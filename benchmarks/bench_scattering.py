"""Evaluations per second of a seabed's scattering law."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from insonify.scattering import Jackson, Kirchhoff, Lambert, Sediment, SmallSlope, TableScatteringLaw, compile_law
from measure import Result, best_seconds

SAND = Sediment.named("medium sand")
LAWS = {
    "Jackson": Jackson(SAND, 100e3),
    "SmallSlope": SmallSlope(SAND, 100e3),
    "Kirchhoff": Kirchhoff(SAND, 100e3),
    "Lambert": Lambert(),
    "TableScatteringLaw": TableScatteringLaw([0.1, 0.5, 1.5], [-40, -25, -10]),
}
UNIT = "M evaluations/s"
GROUP, GROUPS = 8192, 128


def vectors(count: int) -> tuple[np.ndarray, ...]:
    """Random unit vectors down, up, and a flat seabed's normals, float32, shape (3, count)."""
    random = np.random.default_rng(1)
    both = random.normal(size=(2, 3, count))
    both /= np.linalg.norm(both, axis=1, keepdims=True)
    both[0, 2], both[1, 2] = np.abs(both[0, 2]), -np.abs(both[1, 2])
    up = np.zeros((3, count), np.float32)
    up[2] = -1
    return both[0].astype(np.float32), both[1].astype(np.float32), up


def fast_laws() -> list[Result]:
    """Compiled laws, in groups that fit the cache: on one thread, and on two."""
    columns = vectors(GROUP)

    def work(law, groups):
        section = np.empty(GROUP, np.float32)
        for _ in range(groups):
            law.fill(*columns, section)

    made = {name: compile_law(law) for name, law in LAWS.items()}
    with ThreadPoolExecutor(2) as two:
        runs = {f"{name}, one thread": lambda law=law: work(law, GROUPS) for name, law in made.items()}
        runs |= {
            f"{name}, two threads": lambda law=law: list(two.map(work, [law] * 2, [GROUPS // 2] * 2))
            for name, law in made.items()
        }
        seconds = best_seconds(runs)
    goal = "goal 100"
    rates = {name: GROUP * GROUPS / best / 1e6 for name, best in seconds.items()}
    return [Result(f"fast {name}", rate, UNIT, goal if "two" in name else "") for name, rate in rates.items()]


def exact_laws() -> list[Result]:
    """The same laws from angles, in numpy."""
    random = np.random.default_rng(2)
    angles = random.uniform(0.05, 1.5, (3, 100_000))
    seconds = best_seconds({name: lambda law=law: law.cross_section(*angles) for name, law in LAWS.items()})
    return [Result(f"exact {name}", 0.1 / best, UNIT) for name, best in seconds.items()]


SMALL = {"GROUP": 512, "GROUPS": 2}
BENCHES = [fast_laws, exact_laws]
