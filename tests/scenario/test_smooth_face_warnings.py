"""Warnings of smooth faces when a scenario is checked: energy, the tracer."""

import warnings

import pytest
from pydantic import ValidationError

from insonify.scenario.citations import citations
from insonify.scene.target import Box, Sphere
from insonify.validity import PhysicsWarning
from oracles.scenes import nominal

BOX = {"shape": "box", "label": "crate", "position": (0.0, 150.5), "size": (2.0, 1.0, 1.0)}


def said(target, **changes):
    """The cautions of a scenario with one target."""
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always", PhysicsWarning)
        nominal(targets=[target], **changes)
    return [str(word.message) for word in heard if "face" in str(word.message)]


def test_a_face_that_sends_back_more_than_it_gets_is_told():
    """1 and -10 dB make 100 + 31 %; what is offered is accepted without a word."""
    (word,) = said({**BOX, "face_reflection_coefficient": 1.0})
    assert (
        "targets.0.face_reflection_coefficient (crate): 1 and a scattering strength of -10 dB together send back 131 %"
        in word
    )
    assert "Write a magnitude up to 0.82, or a lower strength" in word
    assert (
        said({**BOX, "face_reflection_coefficient": 0.82})
        == said(BOX)
        == said({**BOX, "face_reflection_coefficient": 0.0})
        == []
    )


def test_the_tracer_warns_that_it_simulates_no_flash():
    """Its rays go on from smooth faces."""
    (word,) = said({**BOX, "face_reflection_coefficient": 0.5}, paths={"engine": "tracer"}, field="incoherent")
    assert "simulates no flash" in word


@pytest.mark.parametrize("smooth", [1.1, -1.5])
def test_no_face_mirrors_more_than_all(smooth):
    """From -1 to 1, as a reflection coefficient."""
    with pytest.raises(ValidationError, match="face_reflection_coefficient"):
        Box(position=(0, 50), size=(1, 1, 1), face_reflection_coefficient=smooth)
    assert Sphere(position=(0, 50), diameter=1).face_reflection_coefficient is None


def test_who_has_the_closed_form_is_cited_where_it_runs():
    """Gordon's, only with a smooth face."""
    with_it, without = (
        citations(nominal(targets=[{**BOX, "face_reflection_coefficient": smooth}])) for smooth in (0.5, None)
    )
    assert [line for line in with_it if line not in without] and "Gordon (1975)" in str(with_it)
