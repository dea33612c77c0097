"""Templates are scenarios by name, the same for Python and the command line."""

import pytest

import insonify
from insonify.cli import main
from insonify.scenario.load import load_scenario
from insonify.scenario.template import load_template, template_names


@pytest.mark.parametrize("name", template_names())
def test_a_template_is_the_scenario_that_the_command_writes(name, tmp_path, monkeypatch):
    """All but the title, which is that of the new file."""
    monkeypatch.chdir(tmp_path)
    assert main(["new", "survey", "--template", name]) == 0
    assert load_template(name) == load_scenario("survey.yaml").with_("title", load_template(name).title)


def test_the_error_of_an_unknown_template_has_the_nearest_name():
    """Or with all of them; never with a path."""
    with pytest.raises(ValueError, match=r"no template 'side-scan'; did you mean 'sidescan'\?"):
        insonify.load_template("side-scan")
    with pytest.raises(ValueError, match=r"no template '\.\./x'; give one of coherent-sidescan, echosounder"):
        insonify.load_template("../x")


def test_every_template_is_named_in_the_docstring():
    """As the names of files: a new template is added there."""
    described = str(load_template.__doc__).replace("\n            ", " ")
    assert all(name in described for name in template_names())
