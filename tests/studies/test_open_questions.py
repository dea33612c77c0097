"""The studies of the paper's open questions, small, against closed forms that share no code with the engine."""

import math

import numpy as np
import pytest

from insonify.cli.app import main
from insonify.studies import aperture_in_inhomogeneous_water as aperture
from insonify.studies import coherent_model, multipath_contrast
from insonify.studies.page import Section, table, write_page


def test_coherence_of_two_positions_is_that_of_random_scatterers() -> None:
    """Scatterers summed one by one, with exact ranges, decorrelate as the closed form states."""
    rng, slant, distance = np.random.default_rng(5), coherent_model.SLANT_RANGE, np.array([0.0, 0.3, 0.6])
    along = rng.uniform(-14, 14, (4000, 500))
    strength = rng.normal(size=along.shape) + 1j * rng.normal(size=along.shape)
    echoes = []
    for d in distance:
        path = np.hypot(along - d, slant)
        pattern = np.sinc(coherent_model.APERTURE * (along - d) / path / coherent_model.WAVELENGTH) ** 2
        echoes.append(np.sum(strength * pattern * np.exp(4j * np.pi * path / coherent_model.WAVELENGTH), axis=1))
    power = np.mean(np.abs(echoes[0]) ** 2)
    found = [abs(np.mean(echo * np.conj(echoes[0]))) / power for echo in echoes]
    assert found == pytest.approx(coherent_model.coherence_of_lines(distance), abs=0.06)


@pytest.mark.slow
def test_coherent_models_have_the_expected_mean_and_one_has_the_coherence() -> None:
    """Both coherent models have the mean of the expected intensity; only three dimensions remember the last ping."""
    found = coherent_model.evaluate(6)
    plane, space = "coherent, vertical plane", "coherent, three dimensions"
    for model in (plane, space):
        assert found.mean_error_db(model, "seabed before the target") == pytest.approx(0, abs=0.6)
        assert found.scintillation(model, "seabed before the target") == pytest.approx(1, abs=0.25)
    distance = coherent_model.STEP * np.arange(coherent_model.PINGS)
    assert found.coherence[space][:7] == pytest.approx(coherent_model.coherence_of_lines(distance)[:7], abs=0.12)
    assert found.coherence[plane][3:].max() < 0.2
    assert "van Cittert" not in coherent_model.section(found).text
    assert len(coherent_model.section(found).figure.axes) == 5


@pytest.mark.slow
def test_multipath_fills_the_shadow_and_lowers_the_highlight() -> None:
    """One reflection over silt: the surface's path fills the shadow, and brings ghosts into it."""
    found = multipath_contrast.evaluate(("silt, calm",), (0, 1)).contrast["silt, calm"]
    assert found[0].shadow < -18
    assert found[1].shadow > found[0].shadow + 10
    assert found[1].highlight < found[0].highlight - 10
    assert found[1].ghosts > 0 > found[0].ghosts


@pytest.mark.parametrize("length", [0.5, 2.0, 8.0])
def test_the_covariance_of_phases_begins_with_their_variance(length: float) -> None:
    """The numerical double integral is its closed form at no distance, and far apart, where rays share their ends.

    There it is l^2 / b atan(2 / b), b the distance over the path: a Gaussian over the rays' mean, an error function
    over their lag.
    """
    path, wavenumber, index = np.hypot(aperture.RANGE, 5.9), 2 * np.pi * 100e3 / 1500, 1e-4
    x = path / length
    closed = (wavenumber * index * length) ** 2 * (np.sqrt(np.pi) * x * math.erf(x) + np.expm1(-(x**2)))
    apart, covariance = aperture._covariance(index, length)
    assert covariance[0] == pytest.approx(closed, rel=1e-3)
    assert np.all(np.diff(covariance) < 0)
    slope = apart[-1] / path
    far = (wavenumber * index * length) ** 2 / slope * np.arctan(2 / slope)
    assert covariance[-1] == pytest.approx(far, rel=2e-3)
    assert aperture.expected_loss_db(1e-7, length) == pytest.approx(0, abs=1e-4)


@pytest.mark.validate
def test_a_focused_point_loses_what_the_covariance_of_phases_predicts() -> None:
    """Weakly inhomogeneous water: the simulated loss, averaged over few waters, is near its expectation."""
    found = aperture.evaluate(3, (0.5,), (1e-4,))
    mean = 10 * np.log10(np.mean(10 ** (found.loss / 10)))
    assert mean == pytest.approx(found.theory[0, 0], abs=1.2)
    assert found.width == pytest.approx(0.048, rel=0.25)


def test_a_page_has_its_tables_and_pictures(tmp_path) -> None:
    """The page names each picture, and the picture exists."""
    from insonify.plotting import style

    figure = style.new_figure()
    figure.subplots().plot([0, 1])
    files = write_page(tmp_path / "page.md", "Title", "Words.", [Section("## Part", figure, "part", "A part")])
    assert files == [tmp_path / "page.md", tmp_path / "images" / "part.png"]
    assert all(file.stat().st_size > 50 for file in files)
    assert "![A part](images/part.png)" in files[0].read_text()
    assert table(["a"], [["1"]]) == "| a |\n|---|\n| 1 |"


@pytest.mark.parametrize(
    ("words", "advice"),
    [
        (["study", "open-question"], "Did you mean open-questions?"),
        (["study", "real-recordings"], "--recordings DIR"),
        (["study", "real-recordings", "--recordings", "."], "has no ek80"),
    ],
)
def test_wrong_studies_are_reported_with_advice(words, advice, capsys, tmp_path, monkeypatch) -> None:
    """One line and exit code 2; nothing is written."""
    monkeypatch.chdir(tmp_path)
    assert main(words) == 2
    assert advice in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
