"""Claims about the small relief of the seabed: its integral, its growth, its slopes."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import gamma, j0

from insonify.scattering import Sediment, roughness_spectrum, structure_constant
from insonify.scattering.roughness import kirchhoff_integral, rms_slope

ALPHAS = [0.2, 0.35, 0.5, 0.625, 0.8, 0.95]


def _by_panels(alpha: float, q: float) -> float:
    """The integral along the real axis, panel by panel of width pi, until nothing is left."""
    x, w = np.polynomial.legendre.leggauss(24)
    end = (45 / q) ** (1 / (2 * alpha))
    fine = np.geomspace(min(end, np.pi) * 1e-7, min(end, np.pi), 60)
    edges = np.unique(np.concatenate([fine, np.arange(np.pi, end + np.pi, np.pi)]))
    half = np.diff(edges)[:, None] / 2
    u = (edges[:-1] + edges[1:])[:, None] / 2 + half * x
    return float(np.sum(j0(u) * np.exp(-q * u ** (2 * alpha)) * u * half * w))


@pytest.mark.parametrize(
    ("alpha", "q"), [(a, q) for a in ALPHAS for q in (0.03, 0.3, 3.0, 300.0) if (45 / q) ** (0.5 / a) < 1e5]
)
def test_a_turned_path_gives_what_the_real_axis_gives(alpha, q):
    """Two ways to Kirchhoff's integral: looked up after a turn in the complex plane, and panels on the real axis."""
    assert kirchhoff_integral(alpha)(q) == pytest.approx(_by_panels(alpha, q), rel=1e-6)


def test_a_brownian_bed_has_a_closed_form():
    """Alpha = 1/2: I = q / (1 + q^2)^1.5, to 1e-6 over 24 decades, beyond the table as well."""
    q = np.geomspace(1e-9, 1e15, 500)
    np.testing.assert_allclose(kirchhoff_integral(0.5)(q), q / (1 + q**2) ** 1.5, rtol=1e-6)


@pytest.mark.parametrize("alpha", ALPHAS)
def test_smooth_and_rough_limits_are_exact(alpha):
    """Small q: q 2^(1 + 2a) a Gamma(1 + a) / Gamma(1 - a); large q: Gamma(1/a) / (2a) q^(-1/a); a is alpha."""
    integral = kirchhoff_integral(alpha)
    smooth = 2 ** (1 + 2 * alpha) * alpha * gamma(1 + alpha) / gamma(1 - alpha)
    assert integral(1e-10) == pytest.approx(1e-10 * smooth, rel=1e-5)
    assert integral(1e14) == pytest.approx(gamma(1 / alpha) / (2 * alpha) * 1e14 ** (-1 / alpha), rel=1e-6)


@pytest.mark.parametrize("exponent", [2.6, 3.25, 3.7])
def test_growth_is_the_spectrums(exponent):
    """<(h(x + r) - h(x))^2> = 2 times the integral of (1 - J0(K r)) W(K) over all K, at r = 1 m, to 0.1 %."""
    bed = Sediment(1.8, 1.2, 0.01, spectral_exponent=exponent, spectral_strength=2e-4)

    def integrand(log_k: float) -> float:
        k = np.exp(log_k)
        return 4 * np.pi * k**2 * (1 - j0(k)) * float(roughness_spectrum(bed, k))

    # Beyond K = 1000 the oscillation averages out and the rest is a power; below K = 1e-6, 1 - J0 = (K r)^2 / 4.
    head = quad(integrand, np.log(1e-6), np.log(1000), limit=4000, epsabs=0, epsrel=1e-6)[0]
    foot = np.pi * 2e-4 * 1e-6 ** (4 - exponent) / (4 - exponent)
    tail = 4 * np.pi * 2e-4 * 1000 ** (2 - exponent) / (exponent - 2)
    assert structure_constant(bed) == pytest.approx(foot + head + tail, rel=1e-3)


def test_slopes_of_sand_are_gentle_and_of_rock_are_not():
    """At 30 kHz medium sand has slopes of 5 to 10 degrees and rough rock more than 20 (TR 9407's regimes)."""
    sand, rock = (np.degrees(rms_slope(Sediment.named(n), 2 * np.pi * 20)) for n in ("medium sand", "rough rock"))
    assert 1 < sand < 10
    assert rock > 20
