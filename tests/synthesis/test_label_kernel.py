"""All pairs of a block deposited in one pass state what each pair by itself, and all together, state."""

import numpy as np
import pytest

from insonify.records.labels import COLUMNS
from insonify.simulator import labels
from insonify.synthesis.incoherent import IncoherentAccumulator
from insonify.synthesis.label_accumulator import LabelAccumulator
from oracles.scenes import nominal

BOX = {"label": "box", "position": (0.0, 60.0), "size": (4.0, 1.0, 1.0)}


@pytest.mark.parametrize(("depth", "error_db"), [(0.08, 0.3), (11.0, 0.01)])
def test_one_pass_is_all_passes(monkeypatch: pytest.MonkeyPatch, depth: float, error_db: float) -> None:
    """A box, paths of two bounces; just under the surface they overlap within the pulse and make fringes.

    As a pulse that is no short one, summed coherently: to 1e-4. Interference half way between: so many dB rms, and 0.02
    dB in the mean, where each arrival begins and ends apart.
    """
    scene = nominal(box=BOX, track={"position": (0.0, 0.0, depth), "window": (0.081, 0.086)},
                    surface={"scattering": None}, paths={"max_reflections": 2, "scatterers_per_cell": 2})  # fmt: skip
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
