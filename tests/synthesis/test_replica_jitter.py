"""The paper's jitter and amplitude perturbation, drawn for each ordered replica."""

import numpy as np
import pytest
from pydantic import ValidationError

from insonify.propagation.families import families_up_to
from insonify.propagation.path_settings import PathSettings
from insonify.simulator import simulate
from insonify.synthesis.replica_jitter import replica_jitter
from oracles.scenes import nominal, point

PLACES = np.arange(40_000, dtype=np.uint64) + np.uint64(1 << 59)


def shaken(jitter=0.0, amplitude=0.0, seed=1, ping=0):
    """One ping's perturbation."""
    return replica_jitter(seed, ping, PathSettings(jitter=jitter, amplitude_perturbation=amplitude))


@pytest.mark.parametrize("jitter", [0.1, 0.25, 0.5, 1.0])
def test_the_mean_phasor_of_a_uniform_delay_is_a_sinc(jitter):
    """E exp(-j 2 pi J u) = sinc(J) exp(-j pi J); its square magnitude is the interference kept. N = 40 000: 0.015."""
    factor = shaken(jitter).factor(PLACES, "D", "S")
    expected = np.sinc(jitter) * np.exp(-1j * np.pi * jitter)
    assert abs(factor.mean() - expected) < 0.015
    assert shaken(jitter).interference_factor == pytest.approx(np.sinc(jitter) ** 2)
    np.testing.assert_allclose(np.abs(factor), 1, rtol=1e-12)
    turned = -np.angle(factor) / (2 * np.pi) % 1
    assert turned.max() <= jitter


def test_a_uniform_change_of_amplitude_adds_a_third_of_its_square():
    """E (1 + e (2u - 1))^2 = 1 + e^2 / 3; N = 40 000: 0.01."""
    factor = shaken(amplitude=0.6).factor(PLACES, "D", "D")
    assert np.mean(np.abs(factor) ** 2) == pytest.approx(1.12, abs=0.01)
    assert shaken(amplitude=0.6).mean_energy == pytest.approx(1.12)
    assert np.abs(factor.imag).max() == 0
    assert factor.real.min() >= 0.4 and factor.real.max() <= 1.6


def test_every_ordered_replica_has_a_draw_of_its_own():
    """Out by one family and back by another is another replica than the reverse.

    So is the next ping, another seed, another place: correlations below 5 / sqrt(40 000).
    """
    one = shaken(1.0).factor(PLACES, "D", "S")
    others = [shaken(1.0).factor(PLACES, out, back) for out in families_up_to(3) for back in families_up_to(3)
              if (out, back) != ("D", "S")]  # fmt: skip
    others += [shaken(1.0, ping=1).factor(PLACES, "D", "S"), shaken(1.0, seed=2).factor(PLACES, "D", "S"),
               np.roll(one, 1)]  # fmt: skip
    for other in others:
        assert abs(np.vdot(one, other)) / len(one) < 0.025


def test_a_draw_belongs_to_its_place_not_to_its_company():
    """Requested alone or among others, a place has the same factor."""
    every = shaken(0.4, 0.3).factor(PLACES, "S", "BS")
    np.testing.assert_array_equal(shaken(0.4, 0.3).factor(PLACES[17:18], "S", "BS"), every[17:18])


def test_no_jitter_is_no_change():
    """Still water leaves the factor one, and reports it."""
    assert shaken().is_zero
    assert not shaken(jitter=0.1).is_zero
    assert not shaken(amplitude=0.1).is_zero
    np.testing.assert_array_equal(shaken().factor(PLACES[:5], "D", "D"), np.ones(5))


def test_some_families_and_objects_may_be_perturbed_alone():
    """Others keep the factor they have without; the last entry that applies counts, for each of the two numbers."""
    some = [
        {"families": ["S", "BH"], "jitter": 0.5},
        {"objects": ["box"], "jitter": 0.0, "amplitude_perturbation": 0.2},
    ]
    every, shaken_some = (replica_jitter(1, 0, PathSettings(jitter=j, replica_perturbations=p)) for j, p in
                          ((0.5, ()), (0.0, some)))  # fmt: skip
    assert not shaken_some.is_zero
    for names in (("S", "D"), ("D", "S2"), ("BH", "D")):
        np.testing.assert_array_equal(shaken_some.factor(PLACES, *names, "seabed"), every.factor(PLACES, *names))
    np.testing.assert_array_equal(shaken_some.factor(PLACES, "D", "B", "seabed"), np.ones(len(PLACES)))
    assert shaken_some.largest("box", "D", "S") == (0.0, 0.2)
    hull, surface = (shaken(1.0).factor(PLACES, name, "D") for name in ("BH", "BS"))
    assert abs(np.vdot(hull, surface)) / len(PLACES) < 0.025


def point_power(field, pings=1, **paths):
    """Energy of a point's echoes by D and S in each ping, which overlap 80 m away from the sonar, 11 m deep."""
    sound = simulate(
        nominal(
            field=field, line={"length": 0.02}, targets=[point(0.0, 80.0, 1.0)],
            sonar={"pulse": {"kind": "cw", "frequency": 100e3, "duration": 1e-3}},
            track={"window": (0.1, 0.115), "pings": pings},
            paths={"contributions": ["target"], "families": ["D", "S"], "max_reflections": 1, **paths},
        )
    )  # fmt: skip
    power = sound["intensity"].values if field == "incoherent" else np.abs(sound["pressure"].values) ** 2
    return np.squeeze(power.sum(axis=(1, 2)))


@pytest.mark.parametrize(
    "some", [{"families": ["S"], "jitter": 0.4}, {"objects": ["point"], "jitter": 0.3, "amplitude_perturbation": 0.5}]
)
def test_the_expectation_is_the_mean_over_perturbed_replicas(some):
    """300 coherent pings against one expectation, for a family alone and for an object: 3 standard errors."""
    power = point_power("coherent", 300, replica_perturbations=[some])
    expected = point_power("incoherent", replica_perturbations=[some])
    assert power.mean() == pytest.approx(expected, abs=3 * power.std() / np.sqrt(len(power)))
    assert abs(expected - point_power("incoherent")) > 6 * power.std() / np.sqrt(len(power))


def test_one_entry_for_all_families_is_the_jitter_of_all():
    """The split into mean factors and independent rests gives the expectation of uniform jitter, to 1e-9."""
    alike = point_power("incoherent", jitter=0.3, amplitude_perturbation=0.2)
    entry = {"objects": ["point"], "jitter": 0.3, "amplitude_perturbation": 0.2}
    assert point_power("incoherent", replica_perturbations=[entry]) == pytest.approx(alike, rel=1e-9)


@pytest.mark.parametrize(
    ("paths", "message"),
    [
        ({"replica_perturbations": [{"jitter": 0.5}]}, "selects no paths"),
        ({"replica_perturbations": [{"families": ["S"]}]}, "changes nothing"),
        ({"replica_perturbations": [{"families": ["SX"], "jitter": 1}]}, "not a path family"),
        ({"replica_perturbations": [{"objects": ["ship"], "jitter": 1}]}, "is no object of the scene"),
        ({"engine": "tracer", "replica_perturbations": [{"families": ["S"], "jitter": 1}]}, "tracer's rays have none"),
    ],
)
def test_perturbations_of_nothing_are_refused(paths, message):
    """One line each, at the key."""
    with pytest.raises(ValidationError, match=message):
        nominal(paths=paths, field="incoherent")
