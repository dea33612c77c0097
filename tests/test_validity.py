"""Claims about the one warning that a law gives outside its range."""

import warnings

import numpy as np
import pytest

from insonify.validity import PhysicsWarning, warn_outside


def test_inside_and_on_the_edge_nothing_is_reported():
    """The limits belong to the range."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert not warn_outside("law", "depth", [0.0, 5.0, 10.0], 0, 10, "m")


def test_outside_one_warning_names_law_range_and_worst_value():
    """However many values lie outside, one sentence gives the reader what and how far."""
    with pytest.warns(PhysicsWarning) as caught:
        assert warn_outside("Author (1990)", "depth", np.array([[-1.0, 12.0], [5.0, 17.0]]), 0, 10, "m")
    assert len(caught) == 1
    text = str(caught[0].message)
    assert "Author (1990)" in text
    assert "depth 0 to 10 m" in text
    assert "17 m is outside" in text


def test_the_same_sentence_is_shown_once_per_run():
    """Under Python's default filter a loop over pings repeats nothing."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("default")
        for _ in range(5):
            warn_outside("once", "depth", 11.0, 0, 10, "m")
    assert len(caught) == 1
