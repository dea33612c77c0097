"""Tripwires: numbers that only this code has produced, so that a change that claims to move nothing can show it.

After a change that is meant to move numbers, `python tests/golden/record.py` records them anew.
"""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
from fingerprint import digest, processor, projections, stored
from scenes import SCENES

GOLDEN = stored()
LOOSE = 2e-3
"""Largest change of a projection between processors, re the array's root mean square: single-precision rounding, and
samples of a mask that fall on the other side of a threshold [1]."""

FEW = 1e-4
"""Part of the samples that are at a threshold, such as the floor of a level, between processors [1]."""


@pytest.mark.parametrize("name", SCENES)
def test_golden(name):
    """Output does not depend on the number of threads, and equals the record: bits on a known processor, or nearly."""
    one, two = SCENES[name](1), SCENES[name](2)
    assert digest(one) == digest(two)
    golden = GOLDEN[name]
    found = projections(one)
    assert found.keys() == golden["projections"].keys()
    for array, numbers in golden["projections"].items():
        assert found[array][0] == numbers[0], array
        np.testing.assert_allclose(found[array][1], numbers[1], rtol=FEW, err_msg=array)
        np.testing.assert_allclose(found[array][2], numbers[2], rtol=LOOSE, err_msg=array)
        np.testing.assert_allclose(found[array][3:], numbers[3:], atol=LOOSE * 4, err_msg=array)
    if processor() in golden["digests"]:
        assert digest(one) == golden["digests"][processor()]


def test_every_golden_belongs_to_a_scene():
    """The record holds exactly the scenes that exist."""
    assert GOLDEN.keys() == SCENES.keys()
