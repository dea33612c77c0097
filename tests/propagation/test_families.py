"""Claims about the names of path families: what follows from the order of their bounces."""

import pytest

from insonify.propagation.families import (
    bottom_bounces,
    bounce_count,
    families_up_to,
    family_bounces,
    first_boundary,
    image_depth,
    is_family,
    last_boundary,
    surface_bounces,
)

NAMES = families_up_to(5)


@pytest.mark.parametrize("name", NAMES)
def test_bounces_alternate_between_surface_and_bottom(name):
    """From the first boundary to the last: equal where their number is odd; as many off both where it is even."""
    count = bounce_count(name)
    assert is_family(name) and count == surface_bounces(name) + bottom_bounces(name) == family_bounces(name).number
    assert (first_boundary(name) == "surface") == family_bounces(name).first_up
    if count == 0:
        assert first_boundary(name) == last_boundary(name) == ""
    else:
        assert (first_boundary(name) == last_boundary(name)) == (count % 2 == 1)
        assert surface_bounces(name) - bottom_bounces(name) == (count % 2) * (1 if name[0] == "S" else -1)


@pytest.mark.parametrize("name", NAMES)
def test_the_image_of_an_image_is_the_source(name):
    """The reverse family has the same image for an odd number of bounces, and leads back for an even one."""
    odd = bounce_count(name) % 2 == 1
    assert image_depth(name[::-1], image_depth(name, 7.0, 20.0), 20.0) == pytest.approx(7.0)
    assert (image_depth(name, 7.0, 20.0) == pytest.approx(image_depth(name[::-1], 7.0, 20.0))) == (odd or name == "D")


def test_families_under_a_hull_have_it_as_their_boundary():
    """H stands for the hull, where a family of S has it."""
    assert first_boundary("HB") == last_boundary("BH") == "hull" and surface_bounces("HB") == 0
