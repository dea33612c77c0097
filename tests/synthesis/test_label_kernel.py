"""Sums of labels: all pairs in one pass are each pair by itself, and energies in bins are those of the fine grid."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from insonify.records.labels import COLUMNS
from insonify.simulator import Simulator, labels, levels
from insonify.sonar.ping_geometry import PingGeometry
from insonify.synthesis.incoherent import IncoherentAccumulator
from insonify.synthesis.label_accumulator import LabelAccumulator
from oracles.scenes import nominal

WINDOW = (0.081, 0.095)
LONG = {"kind": "lfm", "frequency": 100e3, "bandwidth": 20e3, "duration": 1e-3}
"""A sweep of 20 range cells."""
WIDE = {"kind": "line", "length": 0.15, "steer": [np.radians(angle) for angle in np.linspace(-30, 30, 41)]}
"""Beams that have rows of directions."""
BOX = {"label": "box", "position": (0.0, 60.0), "size": (4.0, 1.0, 1.0)}


@pytest.mark.parametrize(("depth", "error_db"), [(0.08, 0.3), (11.0, 0.01)])
def test_one_pass_is_all_passes(monkeypatch: pytest.MonkeyPatch, depth: float, error_db: float) -> None:
    """A box, paths of two bounces; just under the surface they overlap within the pulse and make fringes.

    As a pulse that is no short one, summed coherently: to 1e-4. Interference half way between: so many dB rms, and 0.02
    dB in the mean, where each arrival begins and ends apart.
    """
    scene = nominal(box=BOX, track={"position": (0.0, 0.0, depth), "window": (0.081, 0.086)},
                    surface={"scattering": None}, paths={"max_reflections": 2, "scatterers_per_cell": 2})  # fmt: skip
    _on_fine_grid(monkeypatch)
    short = labels(scene)
    monkeypatch.setattr(IncoherentAccumulator, "pulse_lags", (np.zeros(0, np.complex64), 1.0))
    once = labels(scene)
    monkeypatch.setattr(LabelAccumulator, "_workspace", lambda *_: None)
    passes = labels(scene)
    assert (once.highlight.values | once.ghost.values).any()
    alone, whole = once.pair_intensity.values.sum(axis=1), once.expected_intensity.values
    if depth < 1:
        assert np.std(10 * np.log10(whole / alone)) > 0.5
    for name in COLUMNS:
        first, second = once[name].values, passes[name].values
        scale = float(np.nanmax(np.abs(second.astype(float)))) or 1.0
        np.testing.assert_allclose(first, second, rtol=1e-4, atol=1e-6 * scale, err_msg=name)
    error = 10 * np.log10(short.expected_intensity.values / whole)
    assert np.sqrt(np.mean(error**2)) < error_db and abs(np.mean(error)) < 0.02


def _on_fine_grid(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let coherent recordings have labels of the fine grid of energies, as expected intensities have."""
    made = Simulator.label_accumulator

    def exact(self: Simulator, geometry: PingGeometry) -> LabelAccumulator:
        return replace(made(self, geometry), uses_energy_grid=True)

    monkeypatch.setattr(Simulator, "label_accumulator", exact)


@pytest.mark.parametrize(
    ("sonar", "error_db"),
    [
        ({}, 0.1),
        ({"pulse": LONG, "receiver": {"bandwidth": 24e3, "matched_filter": True}}, 0.05),
        ({"pulse": LONG, "receiver": {"bandwidth": 24e3}}, 0.3),
        ({"receive": WIDE}, 0.1),
    ],
    ids=["tone", "compressed sweep", "sweep", "beams"],
)
def test_energies_in_bins_are_those_of_the_fine_grid(
    monkeypatch: pytest.MonkeyPatch, sonar: dict[str, Any], error_db: float
) -> None:
    """Energies shared among two bins: none is lost but at the ends of the window, edges of pulses are blurred."""
    scene = nominal(box=BOX, sonar=sonar, track={"window": WINDOW}, surface={"scattering": None},
                    paths={"max_reflections": 1, "scatterers_per_cell": 2})  # fmt: skip
    shared = labels(scene)
    _on_fine_grid(monkeypatch)
    fine = labels(scene)
    for name in ("object_intensity", "pair_intensity"):
        own, exact = shared[name].values.astype(float), fine[name].values.astype(float)
        np.testing.assert_allclose(own.sum(axis=-1), exact.sum(axis=-1), rtol=5e-3, atol=1e-4 * exact.max())
        strong = exact > 0.01 * exact.max()
        assert np.sqrt(np.mean((10 * np.log10(own[strong] / exact[strong])) ** 2)) < error_db
    for name in ("strongest_object", "strongest_pair", "highlight", "shadow", "ghost"):
        assert np.mean(shared[name].values != fine[name].values) < 0.02, name
    away = np.linalg.norm(shared.position.values - fine.position.values, axis=-1)
    assert np.nanquantile(away, 0.95) < 0.1


def test_rings_half_a_pulse_apart_leave_no_ripple() -> None:
    """Labels of a sweep that is not compressed have a tenth of the rings, and the levels of all of them."""
    scene = nominal(sonar={"pulse": LONG, "receiver": {"bandwidth": 24e3}}, track={"window": (0.06, 0.1)},
                    surface={"scattering": None}, paths={"max_reflections": 0})  # fmt: skip
    seen = labels(scene).object_intensity.sel(object="seabed").values[0].astype(float)
    exact = levels(scene).level_db.sel(contribution="seabed", pair="all").values
    error = (10 * np.log10(seen) - exact)[200:-200]
    assert abs(error.mean()) < 0.05 and error.std() < 0.35
