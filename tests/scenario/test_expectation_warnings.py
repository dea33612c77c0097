"""Warnings about expectations: given where shadows are coarsely sampled, and only there."""

from typing import Any

import pytest

from insonify.paper import sidescan_model
from insonify.scenario.expectation_warnings import FEWEST, MIN_RAYS, expectation_warnings


def message(relief: float = 0.0, **changes: Any) -> list[str]:
    """Warnings about the paper's first model with some changes of paths, or of others by dotted name."""
    settings = {key if "." in key else f"paths.{key}": value for key, value in changes.items()}
    return expectation_warnings(sidescan_model.scene("one speed", settings, relief=relief))


@pytest.mark.parametrize(("relief", "few"), [(0.02, 3.0), (0.02, 1.0), (0.0, 0.5)])
def test_too_few_points_for_a_shadow_are_mentioned_with_how_many_do(relief: float, few: float) -> None:
    """Key, value and the least number that is enough."""
    (word,) = message(relief, scatterers_per_cell=few)
    assert word.startswith(f"paths.scatterers_per_cell: {few:g} points")
    assert f"Give {FEWEST[relief > 0]:g} or more" in word


@pytest.mark.parametrize(("relief", "enough"), [(0.02, 4.0), (0.02, 5.0), (0.0, 2.0)])
def test_enough_points_are_not_mentioned(relief: float, enough: float) -> None:
    """The default over relief, and 2 on a flat bed."""
    assert message(relief, scatterers_per_cell=enough) == []


@pytest.mark.parametrize(
    "changes", [{"targets": []}, {"field": "coherent"}, {"contributions": ["target"]}, {"geometry": "slice"}]
)
def test_nothing_is_reported_where_no_shadow_is_summed(changes: dict[str, Any]) -> None:
    """No target, drawn scatterers, no seabed, one plane."""
    named = {"targets", "field"}
    settings = {f"paths.{key}" if key not in named else key: value for key, value in changes.items()}
    assert (
        expectation_warnings(
            sidescan_model.scene("one speed", {**settings, "paths.scatterers_per_cell": 1.0}, relief=0.02)
        )
        == []
    )


def test_a_tracer_of_few_rays_is_mentioned_and_its_points_are_not() -> None:
    """Rays count there, points do not."""
    (word,) = message(0.02, engine="tracer", rays=MIN_RAYS // 2, scatterers_per_cell=1.0)
    assert word.startswith(f"paths.rays: {MIN_RAYS // 2:,} rays")
    assert message(0.02, engine="tracer", rays=MIN_RAYS, scatterers_per_cell=1.0) == []
