"""The nominal template, which explains every key: what it states of keys that are left out."""

import copy

import pytest
import yaml

from insonify.scenario.scenario import Scenario
from insonify.scenario.template import template_text

TEXT = template_text("nominal")
LINES = TEXT.splitlines()


def keys(node, path=()):
    """Path and line of each key of a mapping, nested ones included."""
    for key, value in node.value:
        yield (*path, key.value), key.start_mark.line
        if isinstance(value, yaml.MappingNode):
            yield from keys(value, (*path, key.value))


def comment(line):
    """Comment behind a key, and on the lines of comment that follow."""
    words = [LINES[line].partition(" # ")[2]]
    for following in LINES[line + 1 :]:
        if not following.lstrip().startswith("#"):
            break
        words.append(following)
    return " ".join(words)


@pytest.mark.parametrize(("path", "line"), list(keys(yaml.compose(TEXT))), ids=lambda value: ".".join(map(str, value))
                         if isinstance(value, tuple) else "")  # fmt: skip
def test_a_key_that_is_left_out_takes_the_value_shown_or_its_comment_states_another(path, line):
    """Unless the key is needed; text that the file explains itself by does not count."""
    written = yaml.safe_load(TEXT)
    without = copy.deepcopy(written)
    parent = without
    for name in path[:-1]:
        parent = parent[name]
    del parent[path[-1]]
    if path == ("title",):
        return
    try:
        same = Scenario.model_validate(without) == Scenario.model_validate(written)
    except ValueError:
        assert "needed" in comment(line), LINES[line]
        return
    assert same or "left out" in comment(line), LINES[line]
