"""The laws of seabed and surface, as a recording receives them."""

from typing import Any

import numpy as np
import pytest

import insonify
from insonify.scattering import AplSurface, Jackson, Lambert, Sediment
from insonify.scene.seabed_law import SedimentLaw
from oracles.scenes import nominal

SPEED, FREQUENCY = 1500.0, 100e3


def direct_level(contribution: str, **scene: Any) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and levels [dB re 1 uPa] of the direct paths of one contribution."""
    scenario = nominal(paths={"max_reflections": 0, "scatterers_per_cell": 10}, targets=[], **scene)
    curves = insonify.levels(scenario).level_db.sel(contribution=contribution, pair="D-D")
    return curves.time.values, curves.values


@pytest.mark.parametrize("name", ["medium sand", "silty clay"])
def test_reverberation_rises_by_what_the_law_rises(name: str) -> None:
    """Jackson's bed over Lambert's, at one delay and so one grazing angle: 10 log of their cross sections, to 0.15 dB.

    From 30 to 200 ms; both beds are received through the same geometry, so only the laws differ. The tolerance is the
    change of the law over one pulse.
    """
    bed = {"depth": 20.0, "reflection": 0.35}
    time, plain = direct_level("seabed", seabed={**bed, "scattering": {"law": "lambert", "strength_db": -27}})
    _, received = direct_level("seabed", seabed={**bed, "scattering": {"law": "jackson", "sediment": name}})
    inside = (time > 0.03) & (time < 0.2)
    middle = SPEED * (time[inside] - 0.1e-3) / 2
    grazing = np.arcsin(9 / middle)
    back = np.full(grazing.shape, np.pi)
    law = Jackson(Sediment.named(name), FREQUENCY, sound_speed=SPEED)
    change = 10 * np.log10(
        law.cross_section(grazing, grazing, back) / Lambert(-27.0).cross_section(grazing, grazing, back)
    )
    np.testing.assert_allclose(received[inside] - plain[inside], change, atol=0.15)


def test_a_windy_surface_echoes_by_its_law() -> None:
    """TR 9407's surface at 8 m/s over a Lambert surface, 40 to 200 ms: the ratio of the laws, to 0.3 dB."""
    time, plain = direct_level("surface", surface={"scattering": {"law": "lambert", "strength_db": -30}})
    _, received = direct_level("surface", surface={"scattering": {"law": "apl-surface", "wind_speed": 8}})
    inside = (time > 0.04) & (time < 0.2)
    grazing = np.arcsin(11 / (SPEED * (time[inside] - 0.1e-3) / 2))
    back = np.full(grazing.shape, np.pi)
    windy, flat = AplSurface(8.0, FREQUENCY), Lambert(-30.0)
    change = 10 * np.log10(windy.cross_section(grazing, grazing, back) / flat.cross_section(grazing, grazing, back))
    np.testing.assert_allclose(received[inside] - plain[inside], change, atol=0.3)


def test_a_seabed_left_out_is_jackson_over_medium_sand() -> None:
    """The default bed scatters and mirrors as one sediment."""
    bed = insonify.Scenario.model_validate(
        {"sonar": nominal().sonar.model_dump(), "track": {"kind": "static", "position": [0, 0, 11]}}
    ).seabed
    assert bed.scattering is not None and bed.scattering.law == "jackson"
    assert bed.reflection == "medium sand"
    assert abs(bed.reflection_coefficient(np.array([np.radians(4.0)]))[0]) == pytest.approx(0.98, abs=0.005)


def test_a_sediment_may_be_a_grain_size() -> None:
    """1.5 phi is medium sand, in the law as in the mirror."""
    by_name, by_size = SedimentLaw(sediment="medium sand"), SedimentLaw(sediment=1.5)
    down, up = np.array([[0.0], [0.6], [0.8]]), np.array([[0.0], [0.0], [-1.0]])
    there, here = (law.at(FREQUENCY, SPEED).cross_section(down, -down, up) for law in (by_name, by_size))
    assert there == pytest.approx(here, rel=1e-3)
    assert there > 0


@pytest.mark.parametrize(
    ("seabed", "word"),
    [
        ({"scattering": {"law": "jackson", "sediment": "medum sand"}}, "medium sand"),
        ({"scattering": {"law": "jackson", "sediment": 12}}, "12"),
        ({"reflection": "medum sand"}, "medium sand"),
        ({"scattering": {"law": "jacksn"}}, "jackson"),
    ],
)
def test_a_wrong_sediment_is_reported_with_the_right_ones(seabed: dict[str, Any], word: str) -> None:
    """Names that are not known, sizes that do not exist."""
    with pytest.raises(ValueError, match=word):
        nominal(seabed={"depth": 20.0, **seabed})
