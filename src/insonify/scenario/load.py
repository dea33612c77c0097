"""Scenario files to frozen models, or to advice on every line that is wrong."""

from pathlib import Path

from insonify.caller_warning import warn_caller
from insonify.diagnostics.diagnostic import Diagnostic, ScenarioError
from insonify.diagnostics.yaml_source import read
from insonify.scenario.parsing import ModelT, parse_source
from insonify.scenario.scenario import Scenario
from insonify.scenario.unit_warnings import unit_warnings
from insonify.validity import PhysicsWarning

MAX_TEXT = 64 << 20
"""Most bytes of a file that describes a scenario: hundreds of thousands of targets."""


def load_scenario(path: str | Path) -> Scenario:
    """The scenario that a YAML file describes.

    Args:
        path: The file.

    Raises:
        ScenarioError: Every fault found in the file, one line each.

    Example:
        >>> scenario = insonify.load_scenario("sidescan.yaml")  # of `insonify new sidescan --template sidescan`
        >>> scenario.title, scenario.sonar.pulse.frequency
        ('Sidescan survey', 100000.0)
    """
    return load(Scenario, path)


def load(model: type[ModelT], path: str | Path) -> ModelT:
    """Load a model from the YAML file that describes it.

    Args:
        model: Class of the model.
        path: The file.

    Raises:
        ScenarioError: Every fault found in the file, one line each.
    """
    source = read(_text(Path(path)), str(path))
    parsed = parse_source(model, source, Path(path).parent)
    for doubt in unit_warnings(model, source):
        warn_caller(str(doubt), PhysicsWarning)
    return parsed


def parse_model(
    model: type[ModelT], text: str, *, name: str = "scenario", folder: str | Path = "", recorded: bool = False
) -> ModelT:
    """Parse a model from a YAML text.

    Args:
        model: Class of the model.
        text: The YAML.
        name: Name of the text in messages.
        folder: Where the files stand that it names by relative paths; the working directory by default.
        recorded: True: the text is that of a recording: its parts are not checked against each other again.

    Raises:
        ScenarioError: Every fault found in the text, one line each.
    """
    return parse_source(model, read(text, name), folder, recorded=recorded)


def _text(path: Path) -> str:
    try:
        with path.open("rb") as file:  # a device may never end
            raw = file.read(MAX_TEXT + 1)
        if len(raw) <= MAX_TEXT:
            return raw.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
        fault = Diagnostic(str(path), 0, "", f"it has more than {MAX_TEXT >> 20} MB", fix="Is it the right file?")
    except UnicodeDecodeError as error:
        fault = Diagnostic(str(path), 0, "", f"not text: byte {error.start} is not UTF-8", fix="Save it as UTF-8 text")
    except FileNotFoundError:
        fault = Diagnostic(str(path), 0, "", "there is no such file", fix="Start from a template: insonify new NAME")
    except OSError as error:
        fault = Diagnostic(str(path), 0, "", f"cannot be read: {error.strerror}")
    raise ScenarioError([fault])
