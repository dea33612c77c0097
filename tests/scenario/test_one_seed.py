"""The same seed is the same seabed, whatever else differs between two scenarios."""

import numpy as np
import pytest

import insonify
from insonify.scenario.schema import json_schema
from oracles.scenes import nominal, point

RELIEF = {"kind": "power-law", "hurst": 0.8, "rms": 0.1, "outer_scale": 20.0}
NORTH, EAST = np.random.default_rng(1).uniform(0, 60, (2, 200))
SAND = {"law": "jackson", "sediment": "medium sand"}


def relief_of(scenario):
    """Heights of the seabed about its mean at some positions [m]."""
    return scenario.completed_seabed.depth_at(NORTH, EAST) - scenario.seabed.depth


@pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")
@pytest.mark.parametrize(
    ("change", "is_same"),
    [
        ({"track.position": [3.0, 4.0, 9.0]}, True),
        ({"targets": [point(0.0, 20.0, 10.0)]}, True),
        ({"seabed.depth": 24}, True),
        ({"sonar.pulse.duration": "1 ms"}, True),
        ({"water.temperature": 15}, True),
        ({"paths.max_reflections": 0, "field": "incoherent"}, True),
        ({"seed": 2, "seabed.seed": 1}, True),
        ({"seabed.cutoff_wavelength": 0.3, "sonar.pulse.frequency": 120e3}, False),
        ({"sonar.pulse.frequency": 120e3}, False),
        ({"seed": 2}, False),
    ],
)
def test_the_same_seed_is_the_same_relief(change, is_same):
    """Bit for bit; not with another cutoff, which a law with a sediment takes from the frequency."""
    base = nominal().with_({"seabed.relief": RELIEF, "seabed.scattering": SAND})
    assert np.array_equal(relief_of(base), relief_of(base.with_(change))) == is_same


def test_a_cutoff_that_is_given_keeps_the_relief_at_other_frequencies():
    """Two sonars over one seabed."""
    base = nominal().with_({"seabed.relief": RELIEF, "seabed.scattering": SAND, "seabed.cutoff_wavelength": 0.3})
    assert np.array_equal(relief_of(base), relief_of(base.with_("sonar.pulse.frequency", 120e3)))


@pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")
def test_the_same_seed_is_the_same_speckle_while_the_density_stays():
    """Title and a target out of reach change no bit of the seabed's echo; a pulse 8 times as long its scatterers."""
    base = nominal(targets=[], paths={"contributions": ("seabed",), "max_reflections": 0},
                   track={"window": (0.05, 0.06)})  # fmt: skip
    echo = insonify.simulate(base, threads=1).pressure.values
    other = base.with_({"title": "another file", "targets": [point(0.0, 200.0, 10.0)]})
    assert np.array_equal(insonify.simulate(other, threads=1).pressure.values, echo)
    longer = base.with_("sonar.pulse.duration", 8 * base.sonar.pulse.duration)
    changed = insonify.simulate(longer, threads=1).pressure.values[..., : echo.shape[-1]]
    assert abs(np.vdot(echo, changed)) < 0.5 * np.linalg.norm(echo) * np.linalg.norm(changed)


def test_descriptions_of_the_seeds_state_what_they_share():
    """In editors, at the keys."""
    schema = json_schema()
    assert "share their seabed" in schema["properties"]["seed"]["description"]
    assert "the relief stays" in schema["$defs"]["Seabed"]["properties"]["seed"]["description"]
