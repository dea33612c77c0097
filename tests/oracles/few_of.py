"""Parameters of which a few run in `make test`, and all of them in `make validate`."""

from collections.abc import Iterable
from typing import Any

import pytest


def few_of(
    kept: Iterable[int], names: str | tuple[str, ...], cases: Iterable[Any], **more: Any
) -> pytest.MarkDecorator:
    """`pytest.mark.parametrize`, with the mark `validate` on all cases but those at some places.

    Args:
        kept: Places of the cases that decide the claim: the extremes, or the least similar; from the end if negative.
        names: Names of the parameters.
        cases: All cases.
        more: Further arguments of `parametrize`.
    """
    listed = list(cases)
    places = {place % len(listed) for place in kept}
    single = isinstance(names, str) and "," not in names
    marked = [case if place in places else _later(case, single=single) for place, case in enumerate(listed)]
    return pytest.mark.parametrize(names, marked, **more)


def _later(case: Any, *, single: bool) -> Any:
    if isinstance(case, type(pytest.param())):
        return case._replace(marks=(*case.marks, pytest.mark.validate))
    return pytest.param(*((case,) if single else case), marks=pytest.mark.validate)
