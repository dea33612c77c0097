"""Targets in layered water are left out where no two paths reach them above the floor of the beams, and only there."""

from typing import Any

import numpy as np
import pytest

from engines.test_fast_reverberation_layered import DOWNWARD, DUCT, UPWARD, in_water
from insonify.engines.resolution import two_way_gain_bound
from insonify.engines.targets import received_targets
from insonify.propagation.families import families_reaching
from insonify.scene.scatterers import Scatterers
from insonify.simulator import Simulator, build_simulator, simulate


@pytest.mark.parametrize("profile", [DOWNWARD, DUCT, UPWARD])
def test_no_ray_to_a_target_has_more_than_its_bound(profile: list[list[float]]) -> None:
    """Upright cylinders anywhere in the water: two-way gains of all pairs of rays to 300 points of each."""
    simulator, random = in_water(profile, 2), np.random.default_rng(0)
    engine, sonar = simulator.engine, simulator.ping_geometry(0)
    families = families_reaching("target", engine.path_settings.followed_families)
    law = engine.scene.seabed.law(sonar.frequency, 1500.0)
    assert law is not None
    ratios = []
    for _ in range(25):
        middle, radius, top = random.uniform(-30, 30, 2), random.uniform(0.3, 1.5), random.uniform(1.0, 8.0)
        base = random.uniform(top + 0.1, 9.9)
        bound = two_way_gain_bound(middle[None], np.array([radius]), sonar, (top + base) / 2, engine.rays, families,
                                   rise=(base - top) / 2)[0]  # fmt: skip
        angle, away = random.uniform(0, 2 * np.pi, 300), radius * np.sqrt(random.uniform(0, 1, 300))
        points = np.column_stack([middle[0] + away * np.cos(angle), middle[1] + away * np.sin(angle),
                                  random.uniform(top, base, 300)])  # fmt: skip
        scatterers = Scatterers("target", "target", law, points, np.tile([0.0, 0.0, -1.0], (300, 1)), np.ones(300),
                                np.ones(300, complex), np.zeros(300, np.uint64))  # fmt: skip
        legs = engine.rays.legs(sonar.transmit_position, scatterers, families, sonar.frequency)
        gains = [
            np.abs(beams.gain(legs.departure.reshape(-1, 3))[0]).reshape(legs.delay.shape) * (legs.spreading > 0)
            for beams in (sonar.transmit_beams, sonar.receive_beams)
        ]
        actual = (gains[0].max(axis=0) * gains[1].max(axis=0)).max()
        assert actual <= bound * (1 + 1e-9)
        ratios.append(actual / bound if bound > 0 else 0.0)
    assert max(ratios) > 0.9  # the bound is not needlessly high


def with_target(position: list[float], cutoff_db: float = -60.0, **changes: Any) -> Simulator:
    """The sidescan in layered water with a box at a position north and east of the sonar."""
    box = {"shape": "box", "label": "crate", "position": position, "size": [0.5, 0.5, 0.5]}
    paths = {"max_reflections": 1, "edge_diffraction": "none", "beam_cutoff_db": cutoff_db, "contributions": ["target"]}
    return in_water(DOWNWARD, targets=[box], paths=paths, **changes)


def is_received(simulator: Simulator) -> bool:
    """True if the only target is received at the first ping."""
    engine = simulator.engine
    return received_targets(engine.scene, engine.path_settings, simulator.ping_geometry(0), engine.rays)[0]


def test_a_target_far_off_the_beam_is_left_out_in_layered_water_too() -> None:
    """Abeam it is received; 60 degrees ahead only with a floor below the side lobes there."""
    assert is_received(with_target([0.0, 20.0]))
    assert not is_received(with_target([17.0, 10.0]))
    assert is_received(with_target([17.0, 10.0], cutoff_db=-120.0))


def test_what_is_left_out_is_below_the_floor() -> None:
    """A coherent ping with the target 60 degrees ahead: its echo is 60 dB below that of the target abeam."""
    coherent = {"field": "coherent", "seabed": {"depth": 10.0}}
    ahead, abeam = (
        simulate(with_target(position, cutoff_db=-120.0, **coherent).scenario, pings=[0]).pressure.values
        for position in ([17.0, 10.0], [0.0, 20.0])
    )
    assert 0 < np.abs(ahead).max() < 1e-3 * np.abs(abeam).max()
    left_out = with_target([17.0, 10.0], **coherent)
    assert build_simulator(left_out.scenario).engine.scene.targets
    assert np.abs(simulate(left_out.scenario, pings=[0]).pressure.values).max() == 0
