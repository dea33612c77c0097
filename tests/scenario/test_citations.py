"""A recording names what it rests on: the laws and methods that ran in it, and no others."""

import pytest

from insonify.scenario import citations as sources
from insonify.scenario.citations import citations
from oracles.scenes import nominal

SAND = {"depth": 20.0, "scattering": {"law": "jackson", "sediment": "medium sand"}, "reflection": "medium sand"}
FRACTAL = {"kind": "power-law", "hurst": 0.8, "rms": 0.05}


@pytest.mark.parametrize(
    ("settings", "named", "not_named"),
    [
        ({}, sources.LAMBERT, sources.JACKSON),
        ({"seabed": SAND}, sources.JACKSON, sources.LAMBERT),
        ({"seabed": SAND}, sources.SEDIMENT, sources.FRACTAL),
        ({"seabed": {"relief": FRACTAL}}, sources.FRACTAL, sources.WINDY),
        ({"surface": {"scattering": {"law": "apl-surface", "wind_speed": 5}}}, sources.WINDY, sources.JACKSON),
        ({"field": "incoherent"}, sources.GRIDDING, sources.DRAWS),
        ({"field": "coherent"}, sources.DRAWS, sources.WINDY),
        ({"water": {"absorption_db_per_m": 0.03}}, sources.IMAGES, sources.ABSORPTION),
        ({}, sources.ABSORPTION, sources.SEDIMENT),
    ],
)
def test_a_scenario_names_what_it_uses_and_nothing_else(settings, named, not_named):
    """Each law brings its source; a measured absorption, an incoherent reading, a plain coefficient need none."""
    found = citations(nominal(**settings))
    assert named in found and not_named not in found
    assert len(found) == len(set(found))


def test_a_box_is_lambert_whatever_the_bed():
    """Targets scatter by Lambert's law: its source stands there beside Jackson's."""
    assert sources.LAMBERT in citations(nominal(seabed=SAND, box={}))


def test_every_source_is_an_author_a_year_and_a_subject():
    """One line each: author, year, publication, and what it is cited for."""
    for name in ("IMAGES", "DRAWS", "GRIDDING", "ABSORPTION", "LAMBERT", "JACKSON"):
        author, colon, subject = getattr(sources, name).rpartition(":")
        assert colon and subject.strip() and "(" in author and any(year in author for year in ("19", "20"))
