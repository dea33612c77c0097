"""Multipath reverberation of flat boundaries is a closed sum over pairs of legs: no sampling, no grid, no FFT."""

from itertools import combinations_with_replacement

import numpy as np
import pytest
import xarray as xr

from insonify.scattering.lambert import Lambert
from insonify.scattering.sediments import Sediment
from insonify.scene.scatterers import Scatterers
from insonify.simulator import build_simulator, levels, simulate
from insonify.synthesis.level_curves import pair_name
from oracles.multipath import Leg, Sonar, pair_intensity, reverberation, ring_width
from oracles.scenes import each_ping, nominal
from oracles.sonar_equation import bed_reverberation, pulse_energy

ALPHA, DEPTH, SPEED = 0.035, 20.0, 1500.0
SONAR = Sonar(11.0, 220.0, 100.0, pulse_energy(duration=0.2e-3, fraction=0.2, band=20e3), 0.1e-3)
WINDOW = (0.17, 0.20)
SAND = Sediment.named("medium sand")


def sand(sine: np.ndarray) -> np.ndarray:
    """Rayleigh's coefficient of medium sand, written with impedances."""
    wave = (1 - 1j * SAND.loss) / SAND.speed_ratio
    below = np.sqrt(wave**2 - (1 - sine**2) + 0j)
    below = np.where(below.imag < 0, below, -below)
    return (SAND.density_ratio * sine - below) / (SAND.density_ratio * sine + below)


def number(sine: np.ndarray) -> np.ndarray:
    """The paper's bed: one number at all angles."""
    return np.full_like(sine, 0.35)


MIRRORS = {"0.35": (0.35, number), "medium sand": ("medium sand", sand)}


def curves(contribution: str, reflection: object, **changes: object) -> xr.Dataset:
    """Levels of one contribution, pair by pair, of an otherwise empty world, over four beds."""
    settings = {
        "water": {"noise_level_db": None, "absorption_db_per_m": ALPHA},
        "seabed": {"depth": DEPTH, "reflection": reflection},
        "surface": {"scattering": {"strength_db": -30}},
        "track": {"window": WINDOW},
        "paths": {"max_reflections": 2, "contributions": [contribution], "beam_cutoff_db": -40},
        **changes,
    }
    beds = [levels(nominal(seed=seed, **settings)).level_db.sel(contribution=contribution) for seed in (1, 2)]
    return 10 * np.log10(sum(10 ** (bed / 10) for bed in beds) / len(beds))


def closed(contribution: str, mirror: object) -> dict[str, object]:
    """What the closed form needs to know of the same world."""
    return {
        "strength_db": -27.0 if contribution == "seabed" else -30.0, "speed": SPEED, "span": (20.0, 200.0),
        "target": DEPTH if contribution == "seabed" else 0.0, "depth": DEPTH, "mirror": mirror, "absorption": ALPHA,
    }  # fmt: skip


FAMILIES = {"seabed": ("D", "S", "BS"), "surface": ("D", "B", "SB")}


@pytest.mark.parametrize("bed", MIRRORS)
@pytest.mark.parametrize("contribution", FAMILIES)
def test_every_pair_of_legs_brings_its_closed_sum(contribution: str, bed: str) -> None:
    """Six unordered pairs of either boundary, 4 |A|^2 for the mixed ones.

    mu sin sin' |R|^2n / (L L')^2, both absorptions, and a ring as deep as both clocks make it: every curve within
    0.3 dB over 30 ms, their sum within 0.15 dB. What is left is the draw of places, 0.1 dB, and the floor of the
    beam, -40 dB, which leaves out 0.03 dB of the side lobes.
    """
    reflection, mirror = MIRRORS[bed]
    seen = curves(contribution, reflection)
    power = 10 ** (seen / 10)
    time = seen.time.values
    for pair in combinations_with_replacement(FAMILIES[contribution], 2):
        expected = pair_intensity(time, pair, SONAR, **closed(contribution, mirror))
        ratio = (power.sel(pair=pair_name(*pair)).values / expected).mean()
        assert 10 * np.log10(ratio) == pytest.approx(0, abs=0.3), pair
    whole = reverberation(time, FAMILIES[contribution], SONAR, **closed(contribution, mirror))
    assert 10 * np.log10((power.sel(pair="all").values / whole).mean()) == pytest.approx(0, abs=0.15)


def test_the_closed_sum_of_direct_paths_is_the_sonar_equation() -> None:
    """Two references that share no formula for the annulus: 0.01 dB of each other."""
    time = np.linspace(0.1, 0.2, 50)
    expected = bed_reverberation(time, level_db=220, strength_db=-27, height=9.0, speed=SPEED, absorption=ALPHA,
                             duration=0.2e-3, energy=SONAR.energy, length=1.5, wavelength=0.015)  # fmt: skip
    ours = pair_intensity(time, ("D", "D"), SONAR, **closed("seabed", number))
    np.testing.assert_allclose(10 * np.log10(ours / expected), 0, atol=0.01)


def test_a_ring_seen_by_two_equal_lines_is_two_thirds_of_a_beam_wide() -> None:
    """Integral of sinc^4 = 2/3: far away a ring is 2/3 wavelength/length of its radius (Urick 1983, ch. 8)."""
    radius = np.array([100.0, 180.0])
    far = Leg(radius, radius, radius)
    np.testing.assert_allclose(ring_width(far, far, radius, 100.0), radius * 2 / 3 / 100, rtol=1e-3)


@pytest.mark.parametrize(("order", "ordered"), [(0, 1), (1, 4), (2, 9), (3, 16)])
def test_a_surface_point_counts_no_bounce_on_its_own_face(order: int, ordered: int) -> None:
    """D; D, B; D, B, SB; D, B, SB, BSB reach the surface: 1, 4, 9, 16 ordered pairs; the rest are its own result."""
    simulator = build_simulator(nominal(paths={"max_reflections": order}))
    one = Scatterers("surface", "surface", Lambert(), np.array([[0, 150.0, 0]]), np.array([[0, 0, 1.0]]), np.ones(1),
                     np.ones(1, complex), np.ones(1, np.uint64))  # fmt: skip
    pairs = simulator.engine.path_pairs(simulator.ping_geometry(0), one)
    assert len(pairs.pair) == ordered
    assert {name[-1] for name in pairs.transmit_legs.families} <= {"D", "B"}
    assert np.all(pairs.strength > 0)


def test_a_rough_surface_is_as_strong_from_below_as_a_rough_bed_is_from_above() -> None:
    """The world turned upside down.

    A sonar 9 m below the surface receives it as one 9 m above the bed receives the bed.
    """
    settings = {"water": {"noise_level_db": None, "absorption_db_per_m": ALPHA}, "track": {"window": WINDOW}}
    law = {"strength_db": -27}
    above = levels(nominal(**settings, paths={"max_reflections": 0}))
    below = levels(
        nominal(
            **{**settings, "track": {"window": WINDOW, "position": (0, 0, 9.0)}},
            surface={"scattering": law},
            seabed={"depth": DEPTH, "scattering": None},
            paths={"max_reflections": 0},
        )
    )
    of = [
        10 ** (seen.level_db.sel(contribution=contribution, pair="all") / 10)
        for seen, contribution in ((above, "seabed"), (below, "surface"))
    ]
    assert 10 * np.log10(of[0].mean() / of[1].mean()) == pytest.approx(0, abs=0.2)


@pytest.mark.parametrize("window", [(0.014, 0.017), (0.017, 0.03), (0.03, 0.06)], ids="{0[0]} s".format)
def test_near_the_sonar_the_closed_sum_holds_too(window: tuple[float, float]) -> None:
    """From 36 degrees off the nadir outwards, where cells are short, beams wide and tiles coarse.

    Direct paths of four beds within 0.25 dB of the sum over rings; the draw of places leaves 0.1 dB.
    """
    settings = {"water": {"noise_level_db": None, "absorption_db_per_m": ALPHA}, "track": {"window": window}}
    scenario = nominal(**settings, field="incoherent", paths={"max_reflections": 0, "beam_cutoff_db": -60})
    beds = [simulate(scenario.model_copy(update={"seed": seed})) for seed in range(1, 5)]
    time = beds[0].time.values
    closed_near = {**closed("seabed", number), "span": (0.3, 60.0)}
    ratio = np.mean([bed.intensity.values[0, 0] for bed in beds], axis=0)
    ratio = ratio / pair_intensity(time, ("D", "D"), SONAR, **closed_near)
    assert 10 * np.log10(ratio.mean()) == pytest.approx(0, abs=0.25)


@pytest.mark.validate
@pytest.mark.parametrize("contribution", FAMILIES)
def test_the_mean_coherent_power_of_sand_and_surface_is_the_closed_sum(contribution: str) -> None:
    """All nine ordered pairs over medium sand, 100 worlds of 190 cells, 0.05 dB standard error: within 0.2 dB."""
    scenario = nominal(
        water={"noise_level_db": None, "absorption_db_per_m": ALPHA}, track={"window": WINDOW},
        seabed={"depth": DEPTH, "reflection": "medium sand"}, surface={"scattering": {"strength_db": -30}},
        paths={"max_reflections": 2, "contributions": [contribution], "beam_cutoff_db": -40},
    )  # fmt: skip
    worlds = [scenario.model_copy(update={"seed": seed}) for seed in range(100)]
    received = each_ping(worlds, lambda world: simulate(world, threads=1).pressure.values[0, 0])
    whole = reverberation(
        build_simulator(scenario).grid.time, FAMILIES[contribution], SONAR, **closed(contribution, sand)
    )
    assert 10 * np.log10(np.mean(np.abs(received) ** 2 / whole)) == pytest.approx(0, abs=0.2)
