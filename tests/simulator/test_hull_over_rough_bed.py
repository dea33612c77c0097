"""Reflections between a hull and a rough seabed: coherent part, energies, and their mean over seeds."""

import numpy as np
import pytest

from insonify.propagation.bed_roughness import bed_roughness
from insonify.scattering.roughness import band_variance
from insonify.scattering.sediments import Sediment
from insonify.simulator import arrivals
from oracles.scenes import nominal

SEDIMENT, C, Z = "very fine sand", 1500.0, 6.0
OMNI = {"kind": "point", "element": "omni", "length": None}
pytestmark = pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")


def afloat(interface, frequency=30e3, *, order=3, size=400.0, paths=None, seabed=None, depth=0.6, down=None, **top):
    """A transducer at the depth of a wide hull, 6 m above a seabed that reflects as its sediment does."""
    pulse = {"kind": "cw", "frequency": frequency, "duration": 3e-4}
    ends = {end: OMNI for end in ("transmit", "receive")}
    if down is not None:  # a square aperture that looks straight down
        ends = {end: {"kind": "planar", "width": down, "height": down, "length": None} for end in ends}
    return nominal(
        **{**ends, **top},
        sonar={"hull": {"length": size, "width": min(size, 100.0), "reflection": 0.9}, "pulse": pulse,
               **({} if down is None else {"mounting": {"bearing": 0.0, "tilt": "90 deg"}})},
        seabed={"depth": Z + depth, "reflecting_interface": interface, "reflection": SEDIMENT,
                "scattering": {"law": "jackson", "sediment": SEDIMENT}, **(seabed or {})},
        track={"position": (0.0, 0.0, depth), "window": (1e-3, 0.03)}, water={"absorption_db_per_m": 0.0},
        paths={"max_reflections": order, **(paths or {})},
    )  # fmt: skip


TARGET = {"targets": [{"shape": "point", "label": "p", "position": (1.0, 0.5, 4.0), "target_strength_db": 0.0}]}


@pytest.mark.parametrize("frequency", [15e3, 30e3])
def test_each_bottom_bounce_under_a_hull_has_eckart_s_factor_and_the_energy_of_the_mirror(frequency):
    """BH and BHB to a point: exp(-2 Gamma^2) of the smooth seabed's pressure for each B; energies but for the law's.

    Gamma by the sediment's waves from the Fresnel zone's to the sound's.
    """
    smooth, rough = (arrivals(afloat(kind, frequency, paths={"contributions": ["target"]}, **TARGET))
                     for kind in ("smooth", "rough"))  # fmt: skip
    k, sediment, aside = 2 * np.pi * frequency / C, Sediment.named(SEDIMENT), np.hypot(1.0, 0.5)
    for family, vertical in (("BH", 2 * Z + 3.4), ("BHB", 4 * Z - 3.4)):
        mirror, here = (found.amplitude[(found.transmit_family == "D") & (found.receive_family == family), 0]
                        for found in (smooth, rough))  # fmt: skip
        length, bounces = np.hypot(aside, vertical), family.count("B")
        sine = vertical / length
        before = Z / sine
        low = np.pi / np.sqrt(C / frequency * before * (length - before) / length / sine)
        quanta = (2 * k * sine) ** 2 * band_variance(sediment, low, k)
        assert len(mirror) == 1
        assert np.abs(here[0] / mirror[0]) == pytest.approx(np.exp(-bounces * quanta / 2), rel=5e-3)
        roughness = bed_roughness(afloat("rough").seabed, frequency, C)
        share = float(roughness.mean_quanta(np.array([2 * k * sine]), np.array([sine]), np.zeros(1))[1][0])
        assert np.sum(np.abs(here / mirror[0]) ** 2) == pytest.approx((1 - share) ** bounces, rel=0.02)
