"""Claims about fast laws on facets of any attitude: the slow law's result, symmetries, groups of questions."""

import numpy as np
import pytest

from insonify.scattering import (
    Jackson,
    Kirchhoff,
    Lambert,
    Perturbation,
    Sediment,
    SedimentVolume,
    SmallSlope,
    TableScatteringLaw,
    albedo,
    compile_law,
    local_angles,
)
from insonify.scattering.compiled_law import GROUP

SAND = Sediment.named("medium sand")
JAGGED = Sediment(3.0, 3.0, 0.001, spectral_exponent=2.6, spectral_strength=1e-4)
UNEVEN = Sediment(1.2, 1.0, 0.01, volume_parameter=0.5)
LAWS = {
    "Lambert": Lambert(-20.0),
    "table": TableScatteringLaw(np.radians([5, 30, 90]), [-40, -25, -10]),
    "Kirchhoff": Kirchhoff(SAND, 100e3),
    "gratings": Perturbation(SAND, 30e3),
    "small slope": SmallSlope(SAND, 100e3),
    "inside": SedimentVolume(SAND, 100e3),
    "Jackson": Jackson(SAND, 50e3),
    "capped surface": SmallSlope(JAGGED, 30e3),
    "capped inside": SedimentVolume(UNEVEN, 100e3),
    "capped both": Jackson(UNEVEN, 100e3),
}
every_law = pytest.mark.parametrize("name", LAWS)
pytestmark = pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")


def _units(count, seed):
    vectors = np.random.default_rng(seed).normal(size=(3, count))
    return vectors / np.linalg.norm(vectors, axis=0)


def _questions(count=4000, seed=1):
    """Ways in and out that are lit, on facets turned anywhere: (3, n) columns of float64 unit vectors."""
    into, out, up = (_units(count, seed + n) for n in range(3))
    into, out = -np.sign(np.sum(into * up, axis=0)) * into, np.sign(np.sum(out * up, axis=0)) * out
    return into, out, up


def _decibels(one, other):
    return np.abs(10 * np.log10(one / other)).max()


@every_law
def test_a_facet_of_any_attitude_scatters_as_the_law_at_its_angles(name):
    """Through angles and the slow law, or through unit vectors and tables.

    Within 0.05 dB where stronger than -80 dB.
    """
    into, out, up = _questions()
    exact = LAWS[name].cross_section(*local_angles(into.T, out.T, up.T))
    fast = compile_law(LAWS[name]).cross_section(into, out, up)
    strong = exact > 1e-8
    assert strong.sum() > 2000
    assert _decibels(fast[strong], exact[strong]) < 0.05


@every_law
def test_reciprocity_of_tilted_facets(name):
    """Source and receiver exchanged: the incident direction becomes the scattered one, reversed.

    0.005 dB of single precision.
    """
    into, out, up = _questions(seed=7)
    law = compile_law(LAWS[name])
    there, back = law.cross_section(into, out, up), law.cross_section(-out, -into, up)
    strong = there > 1e-8
    assert _decibels(there[strong], back[strong]) < 0.005


@every_law
def test_a_mirrored_world_scatters_alike(name):
    """All east turned into west, or the axes exchanged: no law knows left from right, nor one axis from another."""
    into, out, up = _questions(500, seed=9)
    law = compile_law(LAWS[name])
    here = law.cross_section(into, out, up)
    flip = np.array([[1.0], [-1.0], [1.0]])
    for turned in (
        law.cross_section(flip * into, flip * out, flip * up),
        law.cross_section(into[[2, 0, 1]], out[[2, 0, 1]], up[[2, 0, 1]]),
    ):
        strong = here > 1e-8
        assert _decibels(turned[strong], here[strong]) < 0.005


@every_law
def test_a_facet_turned_over_is_dark(name):
    """The normal on the other side of the facet: both directions are behind it, and exactly nothing comes."""
    into, out, up = _questions(500)
    assert np.all(compile_law(LAWS[name]).cross_section(into, out, -up) == 0)


@every_law
def test_groups_leave_no_seam(name):
    """One question more than a group, and the same ones in two halves or one by one: the same within rounding."""
    into, out, up = _questions(GROUP + 1)
    law = compile_law(LAWS[name])
    whole = law.cross_section(into, out, up)
    halves = [
        law.cross_section(into[:, part], out[:, part], up[:, part]) for part in (slice(0, 4001), slice(4001, None))
    ]
    np.testing.assert_allclose(whole, np.concatenate(halves), rtol=1e-4)
    for n in (0, GROUP - 1, GROUP):
        alone = law.cross_section(into[:, n : n + 1], out[:, n : n + 1], up[:, n : n + 1])
        assert alone.shape == (1,)
        assert alone[0] == pytest.approx(whole[n], rel=1e-4)


@every_law
def test_grazing_and_steepest_are_finite(name):
    """Sines of 0, of single precision's smallest steps, and of 1: finite, never negative."""
    sine = np.array([0.0, 1e-38, 1e-20, 1e-7, 1e-4, 0.5, 1 - 1e-7, 1.0])
    cosine = np.sqrt(1 - sine**2)
    into, out = np.array([cosine, 0 * sine, sine]), np.array([cosine[::-1], 0 * sine, -sine[::-1]])
    for way_out in (out, np.array([-cosine, 0 * sine, -sine]), np.array([cosine, 0 * sine, -sine])):
        found = compile_law(LAWS[name]).cross_section(into, way_out, [[0.0], [0.0], [-1.0]])
        assert np.all(np.isfinite(found))
        assert np.all(found >= 0)


def test_one_normal_serves_all():
    """A column of one normal is that normal for every question; results are single precision."""
    into, out, _ = _questions(300)
    up = np.array([[0.6], [0.0], [-0.8]])
    law = compile_law(LAWS["Jackson"])
    one, many = law.cross_section(into, out, up), law.cross_section(into, out, np.repeat(up, 300, axis=1))
    np.testing.assert_array_equal(one, many)
    assert one.dtype == np.float32


def test_filling_an_array_is_evaluation():
    """The engine's way in, without checks, gives what the checked one gives."""
    columns = [np.ascontiguousarray(c, dtype=np.float32) for c in _questions(1000)]
    section = np.full(1000, -1, np.float32)
    for name in ("Lambert", "Kirchhoff", "capped both"):
        compile_law(LAWS[name]).fill(*columns, section)
        np.testing.assert_array_equal(section, compile_law(LAWS[name]).cross_section(*columns))


@pytest.mark.parametrize("name", ["capped surface", "capped inside", "capped both"])
def test_a_cap_is_tabled_only_where_one_is_needed(name):
    """Impossible beds carry a table of factors below 1; sand carries none."""
    assert compile_law(LAWS[name]).cap.min() < 1
    assert compile_law(LAWS["Jackson"]).cap.size == 1


class _Slow:
    """A fast law requested by angles."""

    def __init__(self, law):
        self.law = compile_law(law)

    def cross_section(self, grazing_in, grazing_out, azimuth):
        a, b, c = np.broadcast_arrays(grazing_in, grazing_out, azimuth)
        into = np.array([np.cos(a), 0 * a, np.sin(a)]).reshape(3, -1)
        out = np.array([np.cos(b) * np.cos(c), np.cos(b) * np.sin(c), -np.sin(b)]).reshape(3, -1)
        return self.law.cross_section(into, out, [[0.0], [0.0], [-1.0]]).astype(float).reshape(a.shape)


@pytest.mark.parametrize("name", ["Lambert", "inside", "Jackson", "capped surface", "capped both"])
def test_fast_laws_send_out_what_slow_ones_do(name):
    """White furnace of both forms: the same albedo to 1 %, and never above 1."""
    grazing = np.radians([3, 20, 60, 90])
    fast, slow = albedo(_Slow(LAWS[name]), grazing, points=32), albedo(LAWS[name], grazing, points=32)
    np.testing.assert_allclose(fast, slow, rtol=0.01)
    assert np.all(fast <= 1.001)
