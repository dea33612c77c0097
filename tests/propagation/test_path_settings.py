"""Which paths are followed."""

import pytest
from pydantic import ValidationError

from insonify.propagation.path_settings import PathSettings


def test_families_are_switched_off_by_naming_the_others():
    """What is followed is named, in the order of their bounces."""
    assert PathSettings(max_reflections=1).followed_families == ("D", "S", "B")
    assert PathSettings(max_reflections=2, families=("BS", "D")).followed_families == ("D", "BS")


@pytest.mark.parametrize("wrong", [("X",), ("SS",), ("D", "D"), ("DS",)])
def test_a_family_that_cannot_be_is_refused(wrong):
    """Bounces alternate, and a family is named once."""
    with pytest.raises(ValidationError):
        PathSettings(families=wrong)


def test_a_family_beyond_the_most_bounces_is_refused():
    """Requesting BS with one reflection contradicts itself."""
    with pytest.raises(ValidationError):
        PathSettings(max_reflections=1, families=("BS", "D"))
