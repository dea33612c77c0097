"""Number of two-way paths, and the losses of each."""

import numpy as np
import pytest

from insonify.engines import eigenray_engine
from insonify.scattering.lambert import Lambert
from insonify.scattering.reflection import reflection_coefficient
from insonify.scattering.sediments import Sediment
from insonify.scene.scatterers import Scatterers
from insonify.simulator import arrivals, build_simulator, simulate
from oracles.scenes import nominal, point
from oracles.water import fold

SONAR, TARGET = np.array([0.0, 0.0, 11.0]), np.array([0.0, 150.0, 19.5])


def raised(order, **changes):
    """Arrivals of a point target 0.5 m above the seabed and nothing else."""
    return arrivals(
        nominal(targets=[point(*TARGET)], paths={"max_reflections": order, "contributions": ["target"]},
                track={"window": (0.0, 0.5)}, **changes)
    )  # fmt: skip


@pytest.mark.parametrize(("order", "ordered", "distinct"), [(0, 1, 1), (1, 9, 6), (2, 25, 15)])
def test_a_raised_target_pairs_every_transmit_leg_with_every_receive_leg(order, ordered, distinct):
    """1, 3, 5 legs give 1, 9, 25 ordered pairs; reciprocal ones arrive together: 1, 6, 15 delays."""
    found = raised(order)
    assert len(found) == ordered
    assert len({round(delay * 1e9) for delay in found.delay}) == distinct
    assert len(set(zip(found.transmit_family, found.receive_family, strict=True))) == ordered


@pytest.mark.parametrize(("order", "ordered"), [(0, 1), (1, 4), (2, 9), (3, 16), (4, 25)])
def test_a_seabed_point_counts_no_bounce_on_its_own_ground(order, ordered):
    """1, 2, 3, 4, 5 distinct legs reach the seabed at orders 0 to 4: 1, 4, 9, 16, 25 ordered pairs."""
    simulator = build_simulator(nominal(paths={"max_reflections": order}))
    one = Scatterers("seabed", "seabed", Lambert(), np.array([[0, 150.0, 20]]), np.array([[0, 0, -1.0]]), np.ones(1),
                     np.ones(1, complex), np.ones(1, np.uint64))  # fmt: skip
    pairs = simulator.engine.path_pairs(simulator.ping_geometry(0), one)
    assert len(pairs.pair) == ordered
    assert np.all(pairs.strength > 0)


@pytest.mark.parametrize("reflection", [0.35, "medium sand"])
def test_each_pair_has_its_own_sign_phase_and_loss(reflection):
    """Amplitude of each of the 25 = product over both legs of (-1)^S R^B / L 10^(-alpha L / 20), R at its own angle.

    Seen with 0.35: ab turned round, bb upright, ac 0.35 of aa.
    """
    found = raised(2, water={"noise_level_db": None, "absorption_db_per_m": 0.03},
                   seabed={"depth": 20, "reflection": reflection})  # fmt: skip

    def leg(family):
        path = fold(SONAR, TARGET, family, 20.0)
        angle = np.arcsin(path.sine)
        bottom = 0.35 if reflection == 0.35 else reflection_coefficient(Sediment.named(reflection), angle)
        return (-1.0) ** family.count("S") * bottom ** family.count("B") / path.length * 10 ** (-0.0015 * path.length)

    for out, back, amplitude in zip(found.transmit_family, found.receive_family, found.amplitude, strict=True):
        assert amplitude == pytest.approx(leg(out) * leg(back), rel=1e-6)
    if reflection == 0.35:
        of = dict(zip(zip(found.transmit_family, found.receive_family, strict=True), found.amplitude.real, strict=True))
        assert of["D", "S"] < 0 < of["S", "S"]
        assert of["D", "B"] > 0 > of["D", "SB"]


def test_families_that_end_on_the_bed_add_nothing_to_its_reverberation():
    """Paper's c and d are a and b at the seabed: level change 0 +- 0.05 dB (counted twice: 40 log 1.35 = +5.2 dB)."""
    level = [
        10 * np.log10(simulate(nominal(field="incoherent", track={"window": (0.198, 0.235)},
                                       paths={"max_reflections": 2, "families": names})).intensity.values.mean())
        for names in (("D", "S"), ("D", "S", "B", "SB"))
    ]  # fmt: skip
    assert level[1] - level[0] == pytest.approx(0, abs=0.05)


def test_the_records_state_what_happened():
    """Bounces, object, angles and columns of each arrival fit together; the page of the notebook shows them."""
    found = raised(2)
    strings = [(a + b).replace("D", "") for a, b in zip(found.transmit_family, found.receive_family, strict=True)]
    assert list(found.bounces) == [len(string) for string in strings]
    assert set(found.object) == {"point"}
    product = found.spreading * found.absorption * found.scattering_amplitude * np.abs(found.reflection_coefficient)
    np.testing.assert_allclose(np.abs(found.amplitude), product, rtol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(found.departure, axis=1), 1)
    page = repr(found)
    assert "25 paths" in page and "and 5 more" in page and "200.321 ms" in page


def test_a_target_out_of_the_window_leaves_no_arrival():
    """A scene without paths is valid."""
    found = arrivals(
        nominal(targets=[point(*TARGET)], paths={"contributions": ["target"]}, track={"window": (0.0, 0.1)})
    )
    assert len(found) == 0
    assert "no paths" in repr(found)


def test_legs_off_a_moving_surface_are_diffracted_once(monkeypatch):
    """Transmit and receive legs have one visibility around a rock, that which each would have by itself."""
    calls, diffract = [], eigenray_engine.diffract_at_edges

    def counted(*args, **options):
        calls.append(args)
        return diffract(*args, **options)

    rock = {"shape": "library", "name": "rock", "position": (0.0, 60.0)}
    surface = {"reflection": "statistical", "wind_speed": 4.0}
    paths = {"max_reflections": 1, "edge_diffraction": "knife-edge"}
    simulator = build_simulator(nominal(targets=[rock], surface=surface, paths=paths))
    bed = np.stack([np.linspace(-3, 3, 200), np.full(200, 66.0), np.full(200, 20.0)], axis=-1)
    points = Scatterers("seabed", "seabed", Lambert(), bed, np.tile([0, 0, -1.0], (200, 1)), np.ones(200),
                        np.ones(200, complex), np.arange(200, dtype=np.uint64))  # fmt: skip
    monkeypatch.setattr(eigenray_engine, "diffract_at_edges", counted)
    shared = simulator.engine.path_pairs(simulator.ping_geometry(0), points)
    assert len(calls) == 1
    assert (shared.transmit_legs.visibility != 1).any()
    assert not np.array_equal(shared.transmit_legs.glints.phasor, shared.receive_legs.glints.phasor)
    monkeypatch.setattr(eigenray_engine, "have_same_geometry", lambda *_: False)
    apart = simulator.engine.path_pairs(simulator.ping_geometry(0), points)
    assert len(calls) == 3
    np.testing.assert_array_equal(shared.receive_legs.visibility, apart.receive_legs.visibility)
