"""Point targets at the sonar: nearer than the reference distance they have no level."""

import pytest
from pydantic import ValidationError

from oracles.scenes import nominal, point


@pytest.mark.parametrize("away", [0.0, 0.3, 0.99])
def test_a_point_nearer_than_one_metre_is_refused(away):
    """At the sonar's own position, and within 1 m of it: named with its distance and the fix."""
    with pytest.raises(ValidationError, match="Levels refer to 1 m"):
        nominal(targets=[point(0.0, away, 11.0)])


def test_a_point_at_one_metre_is_let_pass():
    """Just beyond the reference distance."""
    assert nominal(targets=[point(0.0, 1.01, 11.0)]).targets
