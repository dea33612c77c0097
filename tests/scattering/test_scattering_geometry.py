"""Two directions at a patch: the angles that laws request, from vectors in any frame, and what they refuse."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.scattering.law import checked_angles
from insonify.scattering.scattering_geometry import SPECULAR_BLUR2, local_angles, scattering_geometry

UP = np.array([0.0, 0.0, -1.0])
grazings = st.floats(0.01, np.pi / 2)
azimuths = st.floats(0, np.pi)


def vectors(grazing_in, grazing_out, azimuth):
    """A ray down to a flat bed and a ray up from it, z down: x forward, y to starboard."""
    into = np.array([np.cos(grazing_in), 0.0, np.sin(grazing_in)])
    out = np.array([
        np.cos(grazing_out) * np.cos(azimuth), np.cos(grazing_out) * np.sin(azimuth), -np.sin(grazing_out),
    ])  # fmt: skip
    return into, out


def rotation(seed):
    """A random rotation."""
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.sign(np.linalg.det(q))


@given(grazings, grazings, azimuths)
def test_angles_of_vectors_are_the_angles_they_were_made_of(a, b, azimuth):
    """There and back: grazing in, grazing out and azimuth."""
    found = local_angles(*vectors(a, b, azimuth), UP)
    np.testing.assert_allclose(found[:2], [a, b], atol=2e-8)
    if min(np.cos(a), np.cos(b)) > 1e-3:
        assert found[2] == pytest.approx(azimuth, abs=1e-7)


@given(grazings, grazings, azimuths, st.integers(0, 2**31))
def test_the_frame_does_not_matter(a, b, azimuth, seed):
    """Both rays and the normal turned together: the same angles."""
    turn = rotation(seed)
    here = local_angles(*vectors(a, b, azimuth), UP)
    there = local_angles(*(v @ turn.T for v in vectors(a, b, azimuth)), UP @ turn.T)
    np.testing.assert_allclose(there[:2], here[:2], atol=2e-7)
    if min(np.cos(a), np.cos(b)) > 1e-3:
        assert there[2] == pytest.approx(here[2], abs=1e-5)


@given(grazings, grazings, azimuths)
def test_backwards_the_two_angles_change_places(a, b, azimuth):
    """Reciprocity of the geometry: reverse both rays and in is out."""
    into, out = vectors(a, b, azimuth)
    there = local_angles(-out, -into, UP)
    np.testing.assert_allclose(there[:2], [b, a], atol=2e-8)


def test_a_facet_that_leans_towards_the_sound_is_struck_more_steeply():
    """Tilted by an angle about the axis across the ray, grazing grows by that angle in and falls by it out forward."""
    tilt = np.radians(7)
    into, out = vectors(np.radians(20), np.radians(30), 0.0)
    normal = np.array([-np.sin(tilt), 0.0, -np.cos(tilt)])
    found = local_angles(into, out, normal)
    np.testing.assert_allclose(np.degrees(found[:2]), [27, 23], atol=1e-9)


def test_behind_a_facet_grazing_is_negative():
    """A ray that comes from below the bed, or leaves into it."""
    into, out = vectors(np.radians(20), np.radians(30), 1.0)
    assert local_angles(-into, out, UP)[0] == pytest.approx(-np.radians(20))
    assert local_angles(into, -out, UP)[1] == pytest.approx(-np.radians(30))


@pytest.mark.parametrize("which", [0, 1, 2])
@pytest.mark.parametrize(
    ("wrong", "message"), [([1.0, 0.0], "3 components"), ([2.0, 0, 0], "unit vectors"), (["x"], "")]
)
def test_what_is_no_unit_vector_is_refused_by_name(which, wrong, message):
    """Two components, length 2, a word: the argument is named."""
    given_ = [*vectors(0.3, 0.4, 1.0), UP]
    given_[which] = wrong
    with pytest.raises(ValueError, match=("incoming", "outgoing", "normal")[which]) as caught:
        local_angles(*given_)
    assert message in str(caught.value)


@given(grazings, grazings, azimuths)
def test_the_change_of_wavenumber_is_that_of_the_vectors(a, b, azimuth):
    """Half the difference of the two unit vectors: its part in the plane, across it, and its length."""
    into, out = vectors(a, b, azimuth)
    half = (out - into) / 2
    found = scattering_geometry(a, b, azimuth)
    assert found.transverse2 == pytest.approx(half[0] ** 2 + half[1] ** 2 + SPECULAR_BLUR2, abs=1e-12)
    assert found.vertical == pytest.approx(-half[2], abs=1e-12)
    assert found.facet_grazing_sine == pytest.approx(min(np.linalg.norm(half), 1.0), abs=1e-4)


@given(grazings, grazings, azimuths)
def test_directions_are_symmetric_to_the_bit(a, b, azimuth):
    """Exchanged, nothing but in and out changes places."""
    one, other = scattering_geometry(a, b, azimuth), scattering_geometry(b, a, azimuth)
    assert one.sine_in == other.sine_out and one.sine_out == other.sine_in
    assert (
        one.in_plane_product == other.in_plane_product
        and one.transverse2 == other.transverse2
        and one.vertical == other.vertical
    )


def test_backscatter_changes_the_whole_wavenumber():
    """Straight back the vectors differ by two: half of it is one, at any grazing angle."""
    grazing = np.linspace(0.01, np.pi / 2, 50)
    np.testing.assert_allclose(scattering_geometry(grazing, grazing, np.pi).facet_grazing_sine, 1.0, rtol=1e-7)


def test_at_the_mirror_direction_only_the_blur_is_left():
    """The transverse change vanishes; what is left is the stated least square, so that power laws stay finite."""
    grazing = np.linspace(0.01, np.pi / 2, 50)
    found = scattering_geometry(grazing, grazing, 0.0)
    np.testing.assert_allclose(found.transverse2, SPECULAR_BLUR2, rtol=1e-12)
    np.testing.assert_allclose(found.vertical, np.sin(grazing), rtol=1e-12)


def test_darkness_and_gaps_are_distinguished():
    """Behind the interface a cross section is 0; of a gap nothing is known."""
    found = scattering_geometry([0.3, -0.3, np.nan], 0.4, 1.0)
    np.testing.assert_array_equal(found.is_illuminated, [True, False, True])
    np.testing.assert_array_equal(found.where_illuminated(np.array([2.0, 2.0, np.nan])), [2.0, 0.0, np.nan])


@pytest.mark.parametrize("angle", [1.6, -2.0, 20.0, np.inf])
@pytest.mark.parametrize("which", [0, 1])
def test_degrees_are_not_taken_for_radians(angle, which):
    """A grazing angle beyond a right one is refused, with the way to write degrees."""
    angles = [0.3, 0.3]
    angles[which] = angle
    with pytest.raises(ValueError, match=r"np\.radians\(20\)"):
        checked_angles(*angles, 0.0)


def test_a_right_angle_out_of_an_arcsine_is_right_enough():
    """A billionth too steep by rounding is no error."""
    assert np.allclose(checked_angles(np.pi / 2 + 1e-12, np.pi / 2, 0.0)[:2], np.pi / 2)
