"""Warnings of smooth faces when a scenario is checked: energy, the tracer."""

import warnings

import numpy as np
import pytest
from pydantic import ValidationError

from insonify.scattering.lambert import Lambert
from insonify.scenario.citations import citations
from insonify.scene.scatterers import Scatterers
from insonify.scene.target import Box, Sphere
from insonify.simulator import build_simulator
from insonify.validity import PhysicsWarning
from oracles.scenes import nominal

BOX = {"shape": "box", "label": "crate", "position": (0.0, 150.5), "size": (2.0, 1.0, 1.0)}


def message(target, **changes):
    """The cautions of a scenario with one target."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", PhysicsWarning)
        nominal(targets=[target], **changes)
    return [str(word.message) for word in caught if "face" in str(word.message)]


def test_a_face_that_sends_back_more_than_it_gets_is_reported():
    """1 and -10 dB make 100 + 31 %; what is offered is accepted without a word."""
    (word,) = message({**BOX, "face_reflection_coefficient": 1.0})
    assert (
        "targets.0.face_reflection_coefficient (crate): 1 and a scattering strength of -10 dB together send back 131 %"
        in word
    )
    assert "Write a magnitude up to 0.82, or a lower strength" in word
    assert (
        message({**BOX, "face_reflection_coefficient": 0.82})
        == message(BOX)
        == message({**BOX, "face_reflection_coefficient": 0.0})
        == []
    )


def test_the_tracer_warns_that_it_simulates_no_flash():
    """Its rays go on from smooth faces."""
    (word,) = message({**BOX, "face_reflection_coefficient": 0.5}, paths={"engine": "tracer"}, field="incoherent")
    assert "simulates no flash" in word


@pytest.mark.parametrize("smooth", [1.1, -1.5])
def test_no_face_mirrors_more_than_all(smooth):
    """From -1 to 1, as a reflection coefficient."""
    with pytest.raises(ValidationError, match="face_reflection_coefficient"):
        Box(position=(0, 50), size=(1, 1, 1), face_reflection_coefficient=smooth)
    assert Sphere(position=(0, 50), diameter=1).face_reflection_coefficient is None


def test_the_author_of_the_closed_form_is_cited_where_it_runs():
    """Gordon's, only with a smooth face."""
    with_it, without = (
        citations(nominal(targets=[{**BOX, "face_reflection_coefficient": smooth}])) for smooth in (0.5, None)
    )
    assert [line for line in with_it if line not in without] and "Gordon (1975)" in str(with_it)


QUAY = {"shape": "box", "label": "quay", "position": (0.0, 60.5), "size": (10.0, 1.0, 20.0),
        "face_reflection_coefficient": 0.5}  # fmt: skip


@pytest.mark.parametrize(
    ("other", "refused"),
    [
        ({"position": (8.0, 60.5)}, True),
        ({"position": (0.0, 61.0), "size": (4.0, 2.0, 6.0)}, True),
        ({"position": (10.0, 60.5)}, False),
        ({"position": (8.0, 60.502)}, False),
        ({"position": (8.0, 60.5), "face_reflection_coefficient": None}, False),
        ({"position": (0.0, 59.5)}, False),
    ],
    ids=["2 m of 10", "smaller, in one plane", "neighbours", "2 mm behind", "rough", "back to face"],
)
def test_smooth_faces_that_lie_on_one_another_are_refused(other, refused):
    """Two walls with 2 m in common would reflect twice there: an error with the fix; neighbours go together."""
    targets = [QUAY, {**QUAY, "label": "jetty", **other}]
    for paths in ({}, {"face_reflections": True}):
        if refused:
            with pytest.raises(ValidationError, match=r"targets\.1\.position: a smooth face of jetty lies on one of"):
                nominal(targets=targets, paths=paths)
        else:
            nominal(targets=targets, paths=paths)


def test_a_target_in_the_place_of_an_equal_one_is_reported():
    """The same rough box twice is a slip of a copied line: named; elsewhere, or of another size, it is not."""
    words = [
        [str(word.message) for word in caught if "targets.1" in str(word.message)]
        for caught in map(_caught, ({}, {"position": (0.0, 155.5)}, {"size": (2.0, 1.0, 1.1)}))
    ]
    assert [len(some) for some in words] == [1, 0, 0]
    assert "targets.1 (second): it is all that targets.0 (crate) is, at the same position" in words[0][0]


def _caught(change):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", PhysicsWarning)
        nominal(targets=[BOX, {**BOX, "label": "second", **change}])
    return caught


def test_neighbouring_faces_reflect_as_one():
    """A wall of two halves is the wall in one piece: F within 1e-7, and near an edge within its ripples (0.02)."""
    halves = [{**QUAY, "label": f"half {n}", "size": (5.0, 1.0, 20.0), "position": (2.5 * n, 60.5)} for n in (-1, 1)]
    bed = np.array([[0.0, 45.0, 20.0], [1.0, 50.0, 20.0], [4.9, 55.0, 20.0]])
    sums = []
    for targets in ([QUAY], halves):
        simulator = build_simulator(
            nominal(targets=targets, paths={"face_reflections": True, "families": ["D"], "max_reflections": 1})
        )
        points = Scatterers("seabed", "seabed", Lambert(strength_db=-27.0), bed, np.tile((0.0, 0.0, -1.0), (3, 1)),
                            np.ones(3), np.ones(3, complex), np.arange(3).astype(np.uint64))  # fmt: skip
        legs = simulator.engine.path_pairs(simulator.ping_geometry(0), points).transmit_legs
        sums.append(sum(legs.amplitude[row] for row, name in enumerate(legs.families) if name == "F"))
    np.testing.assert_allclose(sums[1][:2], sums[0][:2], rtol=1e-7)
    np.testing.assert_allclose(sums[1], sums[0], rtol=0.02)
