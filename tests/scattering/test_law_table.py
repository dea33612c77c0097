"""Claims about the numeric table of a scattering law of any form."""

from dataclasses import dataclass

import numpy as np
import pytest

from insonify.scattering import Lambert, TableScatteringLaw, compile_law
from insonify.scattering.law_table import TOLERANCE_DB
from insonify.validity import PhysicsWarning

FLAT = np.array([[0.0], [0.0], [-1.0]])


@dataclass(frozen=True)
class Diffuse:
    """Lommel-Seeliger's law times a phase function of Henyey and Greenstein of an asymmetry [1]; 0 for none."""

    asymmetry: float = 0.0

    def cross_section(self, grazing_in, grazing_out, azimuth):
        """Cross section [1]."""
        a, b = (np.maximum(np.sin(grazing), 1e-12) for grazing in (grazing_in, grazing_out))
        g, turn = self.asymmetry, np.cos(grazing_in) * np.cos(grazing_out) * np.cos(azimuth) - a * b
        return 0.05 * (1 - g * g) / (1 + g * g - 2 * g * turn) ** 1.5 * a * b / (a + b)


@dataclass(frozen=True)
class OfValues:
    """Law of which nothing but the cross section is known."""

    law: object

    def cross_section(self, *angles):
        """Cross section [1]."""
        return self.law.cross_section(*angles)


@dataclass(frozen=True)
class Returned:
    """Law that returns one value, or a list of them."""

    value: object

    def cross_section(self, grazing_in, grazing_out, azimuth):
        """Cross section [1]."""
        return self.value


def errors_db(law, count=20_000):
    """Errors of the compiled form where the law exceeds -80 dB; one direction even in its sine, one low."""
    random = np.random.default_rng(7)
    a, b = np.arcsin(random.uniform(0.06, 1, (2, count)) ** np.array([[1.0], [3.0]]))
    azimuth = random.uniform(0, np.pi, count)
    into = np.array([np.cos(a), 0 * a, np.sin(a)])
    out = np.array([np.cos(b) * np.cos(azimuth), np.cos(b) * np.sin(azimuth), -np.sin(b)])
    exact = law.cross_section(a, b, azimuth)
    strong = exact > 1e-8
    assert strong.sum() > count / 2
    return np.abs(10 * np.log10(compile_law(law).cross_section(into, out, FLAT)[strong] / exact[strong]))


@pytest.mark.parametrize("law", [Diffuse(), OfValues(Lambert()), Diffuse(0.3)], ids=str)
def test_a_smooth_law_is_within_a_twentieth_of_a_decibel(law):
    """Laws that are no products, with and without azimuth, and Lambert's by its values alone, in all directions."""
    assert errors_db(law).max() < TOLERANCE_DB


def test_a_law_with_a_sharp_lobe_has_a_finer_table():
    """Forward lobe of an asymmetry of 0.8: all but a thousandth of the directions are within the tolerance."""
    assert np.quantile(errors_db(Diffuse(0.8)), 0.999) < TOLERANCE_DB
    assert compile_law(Diffuse(0.8)).table.size > 10 * compile_law(Diffuse(0.3)).table.size


def test_few_entries_serve_a_law_without_azimuth():
    """One azimuth; four nodes in each octave of both grazing angles."""
    assert compile_law(Diffuse()).table.size == 57**2


def test_a_law_with_edges_has_a_finer_table_without_a_warning():
    """Strengths measured at four angles, which join at edges."""
    law = compile_law(OfValues(TableScatteringLaw(np.radians([1, 20, 60, 90]), [-50, -30, -22, -12])))
    assert law.table.size > 100**2


def test_a_law_that_no_table_resolves_gives_a_warning():
    """A ripple of the strength every tenth of a degree in azimuth."""

    class Rippled(Diffuse):
        def cross_section(self, grazing_in, grazing_out, azimuth):
            return super().cross_section(grazing_in, grazing_out, azimuth) * (1.5 + np.cos(3600 * azimuth))

    with pytest.warns(PhysicsWarning, match="the table of Rippled has errors of .* dB"):
        compile_law(Rippled())


@pytest.mark.parametrize("value", [-1.0, np.nan, np.zeros(3)], ids=str)
def test_a_value_that_is_no_cross_section_is_refused(value):
    """A negative one, one that is not a number, and one of another shape than the angles."""
    with pytest.raises(ValueError, match=r"Returned.cross_section (is negative or not a number|has shape \(3,\))"):
        compile_law(Returned(value))


def test_directions_that_are_none_do_no_harm():
    """NaN reads no memory outside the table; grazing 0 is finite, and nothing is scattered from behind."""
    law = compile_law(Diffuse(0.3))
    nothing = np.full((3, 100), np.nan)
    assert law.cross_section(nothing, nothing, nothing).shape == (100,)
    along, down = np.array([[1.0], [0.0], [0.0]]), -FLAT
    assert np.isfinite(law.cross_section(along, along, FLAT)).all()
    assert law.cross_section(down, down, FLAT) == 0 and law.cross_section(-down, -down, FLAT) == 0


@dataclass(frozen=True)
class Product:
    """Lambert's law of a strength, as a product of which nothing but its factor is known."""

    strength_db: float

    def cross_section(self, grazing_in, grazing_out, azimuth):
        """Cross section [1]."""
        return self.direction_factor(grazing_in) * self.direction_factor(grazing_out) + 0 * azimuth

    def direction_factor(self, grazing):
        """Factor of one direction [1]."""
        return 10 ** (self.strength_db / 20) * np.sin(grazing)


@pytest.mark.parametrize("form", [Product, lambda strength: OfValues(Product(strength))])
def test_a_law_that_scatters_more_than_arrives_is_reported(form, recwarn):
    """The albedo of Lambert's law is pi mu: 1 at -4.97 dB, and 1.26 one decibel above that, at every angle."""
    white = 10 * np.log10(1 / np.pi)
    compile_law(form(white))
    assert not recwarn.list
    with pytest.warns(PhysicsWarning, match=r"scatters 1\.26 times the energy that arrives at a grazing angle of"):
        compile_law(form(white + 1.0))
