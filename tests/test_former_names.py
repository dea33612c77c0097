"""Claims about keys and values that were renamed: each is reported with its new name, in files and in Python."""

import re
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from pydantic import ValidationError

import insonify
from insonify.cli import main
from insonify.cli.arguments import InputError, require_choice
from insonify.former_names import FORMER_KEYS, FORMER_VALUES
from insonify.model import Model
from insonify.processing import GAINS, sidescan
from insonify.propagation.path_settings import PathSettings
from insonify.scenario.load import load_scenario, parse_model
from insonify.scenario.scenario import Scenario

NOMINAL = Path(__file__).parents[1] / "examples" / "nominal.yaml"


def models(base: type[Model] = Model) -> dict[str, type[Model]]:
    """Every model of the package by its name."""
    import_module("insonify.simulator")
    found = {base.__name__: base}
    for below in base.__subclasses__():
        found |= models(below)
    return found


@pytest.mark.parametrize("name", sorted(FORMER_KEYS))
def test_former_keys_are_gone_and_new_ones_exist(name):
    """The table is about models that exist: no old key is a field, and every new one is."""
    fields = models()[name].model_fields
    assert not fields.keys() & FORMER_KEYS[name].keys()
    assert fields.keys() >= set(FORMER_KEYS[name].values())
    assert fields.keys() >= FORMER_VALUES.get(name, {}).keys()


@pytest.mark.parametrize(
    ("old", "line", "message"),
    [
        ("importance_sampling: true", "thinning: false", "paths.thinning: is called importance_sampling."),
        (
            "edge_diffraction: knife-edge",
            "edge_diffraction: fresnel",
            "paths.edge_diffraction: fresnel is called knife-edge.",
        ),
        ("engine: eigenrays", "engine: paths", "paths.engine: paths is called eigenrays."),
    ],
)
def test_a_file_of_old_names_is_reported_with_the_new_one(tmp_path, capsys, old, line, message):
    """Exit code 2, the line of the file, the old name and the new one."""
    text = NOMINAL.read_text()
    assert old in text
    file = tmp_path / "old.yaml"
    file.write_text(text.replace(old, line, 1))
    assert main(["check", str(file)]) == 2
    number = next(k for k, row in enumerate(file.read_text().splitlines(), start=1) if line in row)
    assert f"old.yaml:{number}: {message} Write" in capsys.readouterr().err


def test_python_is_reported_with_the_new_name():
    """Construction, a copy with changes, a change by dotted name and an unchecked copy: the same result."""
    with pytest.raises(ValidationError, match="thinning: is called importance_sampling"):
        PathSettings(thinning=False)
    with pytest.raises(ValidationError, match="engine: paths is called eigenrays"):
        PathSettings(engine="paths")
    for copy in (PathSettings().model_copy, lambda update: PathSettings().unchecked_copy(**update)):
        with pytest.raises(AttributeError, match=r"called PathSettings\.importance_sampling"):
            copy(update={"thinning": False})
    with pytest.raises(AttributeError, match="did you mean 'geometry'"):
        PathSettings().unchecked_copy(geometri="slice")
    with pytest.raises(ValueError, match="is called importance_sampling"):
        load_scenario(NOMINAL).with_("paths.thinning", False)


def test_no_text_of_the_program_names_a_former_key():
    """Neither messages nor docstrings: by section and key, such as paths.thinning."""
    sections = {"PathSettings": "paths", "Receiver": "receiver", "Surface": "surface", "Seabed": "seabed"}
    former = [rf"{sections[model]}\.{old}" for model, keys in FORMER_KEYS.items() if model in sections for old in keys]
    for file in Path(insonify.__file__).parent.rglob("*.py"):
        assert re.findall(rf"\b(?:{'|'.join(former)})\b", file.read_text(encoding="utf-8")) == [], file


def test_a_former_gain_is_reported_with_the_new_one():
    """On the command line with the option to write, in Python with the value."""
    with pytest.raises(InputError, match=r"--gain learnt is called empirical\. Write --gain empirical"):
        require_choice("learnt", GAINS, "--gain")
    recording = xr.Dataset({"pressure": (("ping", "channel", "time"), np.zeros((1, 1, 4), complex))})
    with pytest.raises(ValueError, match="gain is 'learnt', which is called 'empirical'"):
        sidescan(recording, gain="learnt")


def test_a_key_of_the_same_name_elsewhere_is_left_alone():
    """`length` was renamed in a texture and in an inhomogeneity, not in an array; `shape` not in a target."""
    scenario = parse_model(Scenario, NOMINAL.read_text())
    assert scenario.sonar.transmit.length > 0
    assert scenario.targets[0].shape == "box"
