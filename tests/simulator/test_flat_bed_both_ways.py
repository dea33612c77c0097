"""A flat Lambert bed from 20 to 150 m is the sonar equation, by the fast reverberation and in general."""

from dataclasses import replace

import numpy as np
import pytest

from insonify.engines.fast_reverberation import prepare_fast_reverberation
from insonify.simulator import build_simulator
from oracles.scenes import nominal
from oracles.sonar_equation import bed_reverberation, pulse_energy

ALPHA = 0.035
WATER = {"noise_level_db": None, "absorption_db_per_m": ALPHA}
STARTS = {
    "nominal": {"height": 9.0, "length": 1.5, "strength": -27.0, "level": 220.0},
    "higher and shorter": {"height": 15.0, "length": 0.4, "strength": -20.0, "level": 190.0},
    "lower": {"height": 4.0, "length": 0.8, "strength": -33.0, "level": 205.0},
}


def scenario_of(kind, sides=None):
    """The bed alone, direct paths, over 20 to 150 m of slant range."""
    sonar = {"source_level_db": kind["level"], **({"sides": sides} if sides else {})}
    return nominal(
        field="incoherent", water=WATER, line={"length": kind["length"]}, sonar=sonar, paths={"max_reflections": 0},
        track={"position": (0.0, 0.0, 20.0 - kind["height"]), "window": (2 * 20 / 1500, 2 * 150 / 1500 + 2e-4)},
        seabed={"scattering": {"law": "lambert", "strength_db": kind["strength"]}},
    )  # fmt: skip


def quickly(simulator):
    """The ping by lines over the ground."""
    here, engine = simulator.ping_geometry(0), simulator.engine
    reading, ground = (
        simulator.incoherent_accumulator(here),
        prepare_fast_reverberation(engine.scene, engine.path_settings, here, engine.rays),
    )
    assert ground is not None
    received = reading.empty()
    ground.accumulate(map, lambda swath: reading.add_fast_reverberation(received, swath))
    for pairs in replace(engine, path_settings=ground.remaining_path_settings).all_pairs(here, quadrature=True):
        reading.add(received, pairs)
    return reading.time_series(received)[0]


def thoroughly(simulator):
    """The ping by blocks of points."""
    here = simulator.ping_geometry(0)
    reading = simulator.incoherent_accumulator(here)
    received = reading.empty()
    for pairs in simulator.engine.all_pairs(here, quadrature=True):
        reading.add(received, pairs)
    return reading.time_series(received)[0]


def closed_form(kind, time):
    """Of the bed [uPa^2]."""
    energy = pulse_energy(duration=0.2e-3, fraction=0.2, band=20e3)
    return bed_reverberation(
        time, level_db=kind["level"], strength_db=kind["strength"], height=kind["height"], speed=1500.0,
        absorption=ALPHA, duration=0.2e-3, energy=energy, length=kind["length"], wavelength=0.015,
    )  # fmt: skip


@pytest.mark.parametrize("way", [quickly, thoroughly])
@pytest.mark.parametrize("name", STARTS)
def test_the_bed_is_the_sonar_equation_from_20_to_150_metres(name, way):
    """Each of eight parts of the range within 0.2 dB, all of it within 0.1 dB; source, strength and height are free."""
    simulator = build_simulator(scenario_of(STARTS[name]))
    time = simulator.grid.time
    ratio = way(simulator) / closed_form(STARTS[name], time)
    parts = [10 * np.log10(part.mean()) for part in np.array_split(ratio[time > 2 * 20 / 1500 + 2e-4], 8)]
    assert np.max(np.abs(parts)) < 0.2, parts
    assert abs(np.mean(parts)) < 0.1, parts
