"""Reflections between a hull and a rough seabed: coherent part, energies, and their mean over seeds."""

from functools import partial

import numpy as np
import pytest

from insonify.engines.multiple_bed_scattering import incoherent_bounces, other_scatterers
from insonify.propagation.bed_roughness import bed_roughness
from insonify.records.legs import GlintPhasors, Legs
from insonify.scattering import SmallSlope
from insonify.scattering.reflection import reflection_coefficient
from insonify.scattering.roughness import band_variance
from insonify.scattering.sediments import Sediment
from insonify.simulator import arrivals, build_simulator, levels, simulate
from oracles.few_of import few_of
from oracles.forward_scatter import ring_energies
from oracles.scenes import each_ping, nominal

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


@few_of((0,), "frequency", [15e3, 30e3])
def test_each_bottom_bounce_under_a_hull_has_eckart_s_factor_and_the_energy_of_the_mirror(frequency):
    """BH and BHB to a point: exp(-2 Gamma^2) of the smooth seabed's pressure for each B; energies but for the law's.

    Gamma by the sediment's waves from the Fresnel zone's to the sound's.
    """
    smooth, rough = (arrivals(afloat(kind, frequency, paths={"contributions": ["target"]}, **TARGET))
                     for kind in ("smooth", "rough"))  # fmt: skip
    k, sediment, aside = 2 * np.pi * frequency / C, Sediment.named(SEDIMENT), np.hypot(1.0, 0.5)
    for family, vertical in (("BH", 2 * Z + 3.4), ("BHB", 4 * Z - 3.4)):
        mirror, here = (found.amplitude[(found.transmit_family == "D") & (found.receive_family == family)]
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


@pytest.mark.parametrize(
    ("out", "back", "order", "count"),
    [("BH", "D", 2, (1, 0)), ("BH", "BH", 4, (1, 1)), ("BH", "BH", 2, (0, 0)), ("BHBH", "D", 4, (2, 0)),
     ("BS", "BH", 4, (0, 0)), ("S", "D", 2, (0, 0)), ("SBH", "D", 4, (1, 0))],
)  # fmt: skip
def test_the_same_path_has_its_scatterer_at_every_place_from_which_both_legs_are_followed(out, back, order, count):
    """b-H-b is D-BH and BH-D; b-H-b-H-b is BH-BH, D-BHBH and BHBH-D, of which order 2 has the first alone."""
    followed = {"", "S", "BH", "BHBH", "BS", "SBS", "BSBS"} if order == 4 else {"", "S", "BH", "BS"}
    assert other_scatterers(out, back, followed) == count


@pytest.mark.parametrize("bounces", [1, 2, 3])
@pytest.mark.parametrize("quanta", [1e-3, 0.5, 30.0])
def test_places_share_the_energy_of_a_path_in_closed_form(bounces, quanta):
    """E[1 / (1 + m)] of a binomial m above 0 = (1 - q^(N+1)) / ((N + 1) p) - q^N, over 1 - q^N: 1/2 for one place."""
    legs = object.__new__(Legs)
    bed = np.array([quanta, bounces * quanta])[:, None, None]
    object.__setattr__(legs, "glints", GlintPhasors((7,), np.ones((1, 1), complex), bed))
    found = incoherent_bounces(legs, 0, bounces, np.zeros(1, int))
    p, q = -np.expm1(-quanta), np.exp(-quanta)
    due = ((1 - q ** (bounces + 1)) / ((bounces + 1) * p) - q**bounces) / (1 - q**bounces)
    assert np.sum(found) == pytest.approx(1.0)
    assert sum(float(one[0]) / (1 + m) for m, one in enumerate(found)) == pytest.approx(due, rel=1e-6)
    assert due <= 0.5 + 1e-9


def glint_excess(sediment, frequency, rings=24):
    """Energy of glints at the vertical re that of the law, by rings of the change of horizontal wavenumber over k [1].

    Kirchhoff's distribution within k/3, with the energy that the coherent leg and the law beyond k/3 leave.
    """
    made_of, k = Sediment.named(sediment), 2 * np.pi * frequency / C
    edges = np.linspace(0, 1 / 3, rings + 1)
    low = np.pi / np.sqrt(C / frequency * Z * 2 * Z / (3 * Z))
    lobe, none = ring_energies(k, 2 * k, made_of, low, edges)
    share = bed_roughness(afloat("rough", seabed={
        "scattering": {"law": "small-slope", "sediment": sediment}, "reflection": sediment}).seabed, frequency, C
    ).scattered_fraction[-1]  # fmt: skip
    reflected = np.abs(reflection_coefficient(made_of, np.array(np.pi / 2))) ** 2
    change, azimuth = (edges[1:] + edges[:-1]) / 2, np.full(rings, np.pi)
    section = SmallSlope(made_of, frequency).cross_section(np.full(rings, np.pi / 2 - 1e-3), np.arccos(change), azimuth)
    law = section * np.pi * np.diff(edges**2) / np.sqrt(1 - change**2)
    return change, reflected * (1 - share - none) * lobe / lobe.sum() / law


def twice_scattered(scenario, sediment, frequency, size, count=200_000):
    """Energies of the first and the second bottom echo: integrals over one and over two places, by chance.

    The second arrives in both senses, which interfere: twice the integral over ordered places. The law counts at one of
    them, glints at the other.
    """
    here, law = build_simulator(scenario).ping_geometry(0), SmallSlope(Sediment.named(sediment), frequency)
    generator, width = np.random.default_rng(1), Z * 1.06 * C / frequency / size

    def section(into, off):
        azimuth = np.arctan2(into[:, 0] * off[:, 1] - into[:, 1] * off[:, 0], np.sum(into[:, :2] * off[:, :2], axis=1))
        return law.cross_section(np.arcsin(into[:, 2]), np.arcsin(-off[:, 2]), np.abs(azimuth))

    places, ways, ranges, densities = [], [], [], []
    for _ in range(2):
        at = generator.standard_normal((count, 2)) * width
        ray = np.column_stack([at, np.full(count, Z)])
        places.append(at)
        ranges.append(np.linalg.norm(ray, axis=1))
        ways.append(ray / ranges[-1][:, None])
        densities.append(np.exp(-np.sum(at**2, axis=1) / 2 / width**2) / (2 * np.pi * width**2))
    sent, received = (beams.gain(way)[0] ** 2 for beams, way in
                      zip((here.transmit_beams, here.receive_beams), ways, strict=True))  # fmt: skip
    alone = sent * here.receive_beams.gain(ways[0])[0] ** 2 * section(ways[0], -ways[0]) / ranges[0] ** 4
    between = np.column_stack([places[1] - places[0], np.full(count, -2 * Z)])
    length = np.linalg.norm(between, axis=1)
    up = between / length[:, None]
    both = section(ways[0], up) * section(up * [1, 1, -1], -ways[1]) / (ranges[0] * length * ranges[1]) ** 2
    changes = (np.hypot(*(off - into)[:, :2].T) for into, off in ((ways[0], up), (up, -ways[1])))
    excess = glint_excess(sediment, frequency)
    both *= np.mean([np.interp(change, *excess, right=1.0) for change in changes], axis=0)
    return np.mean(alone / densities[0]), 2 * 0.9**2 * np.mean(sent * received * both / densities[0] / densities[1])


@pytest.mark.slow
def test_a_second_echo_without_coherent_part_is_the_law_s_integral_over_two_places():
    """Clayey sand at 300 kHz, 8 degrees: second re first echo within 0.4 dB; 3 dB more if both orders counted fully.

    16 quanta leave nothing in phase. In the middle of their lobe glints are 1.3 dB above the law.
    """
    sediment, frequency, size = "clayey sand", 300e3, 0.036
    paths = {"contributions": ["seabed"], "families": ["D", "BS"], "beam_cutoff_db": -20}  # -50 dB: 1e-6 dB more
    scenario = afloat("rough", frequency, order=2, down=size, field="incoherent", paths=paths,
                      seabed={"scattering": {"law": "small-slope", "sediment": sediment}, "reflection": sediment}
                      )  # fmt: skip
    track = scenario.track.model_copy(update={"window": (1e-3, 18e-3)})  # until the second echo, at 16 ms, has passed
    scenario = scenario.model_copy(update={"track": track})
    power = 10 ** (levels(scenario).level_db.sel(contribution="seabed") / 10)
    first, second = (float(np.nansum(power.sel(pair=pair).values)) for pair in ("D-D", "D-BH"))
    once, twice = twice_scattered(scenario, sediment, frequency, size)
    assert 10 * np.log10(second / first / (twice / once)) == pytest.approx(0.0, abs=0.4)


def second_echo(field, seed, interface="rough", **seabed):
    """Mean power of the second bottom echo of one ping: seabed, hull, seabed."""
    found = simulate(afloat(interface, 100e3, order=2, down=0.06, seed=seed, field=field, seabed={"seed": 5, **seabed},
                            paths={"contributions": ["seabed"], "families": ["D", "BS"]}), threads=1)  # fmt: skip
    time, sound = found["time"].values, found["intensity" if field == "incoherent" else "pressure"].values
    second = (time > 4 * Z / C) & (time < 4 * Z / C + 1e-3)
    return np.mean(sound[..., second] if field == "incoherent" else np.abs(sound[..., second]) ** 2)


@pytest.mark.validate
def test_the_mean_second_echo_of_coherent_pings_is_the_expectation():
    """Medium sand at 100 kHz: 3600 seeds (std of one ping 0.7 of the mean: 0.05 dB) against 4 (0.03 dB): 0.2 dB."""
    coherent, expected = (
        np.mean(each_ping(range(count), partial(second_echo, field)))
        for field, count in (("coherent", 3600), ("incoherent", 4))
    )
    assert 10 * np.log10(coherent / expected) == pytest.approx(0.0, abs=0.2)
