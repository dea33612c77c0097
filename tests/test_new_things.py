"""Claims about new things that are added by the table of CONTRIBUTING.md: a file, and one line that registers it.

The files stand in `tests/new_things`, at the places that the table names. The registered lines are changed in copies of
the package's files, which a process of its own imports instead of them.
"""

import json
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "insonify"
FILES = Path(__file__).parent / "new_things"
REGISTRATIONS = {
    "scattering law": (
        "scene/boundary_law.py", "BoundaryLaw", "BoundaryLaw = Lambert\n",
        "BoundaryLaw = Lambert | LommelSeeliger | SinePower\n",
        "from insonify.scattering.lommel_seeliger import LommelSeeliger\n"
        "from insonify.scattering.sine_power import SinePower\n",
    ),
    "target shape": (
        "scene/target.py", "Solid", "Solid = Box | ", "Solid = Box | Wedge | ",
        "from insonify.scene.wedge import Wedge\n",
    ),
    "pulse": (
        "sonar/pulse.py", "MODULATIONS", '"lfm": LinearSweep()}',
        '"lfm": LinearSweep(), "hfm": HyperbolicSweep(), "coded": Coded()}',
        "from insonify.sonar.hyperbolic_sweep import Coded, HyperbolicSweep\n",
    ),
    "format to export": (
        "writers/export.py", "FORMATS", '    "csv": ExportFormat(',
        '    "listing": ExportFormat((".listing",), "times", "listing.write_listing"),\n    "csv": ExportFormat(', "",
    ),
    "recording format of an instrument": (
        "formats/instruments/open_instrument.py", "READERS", '    "kmall.KmallFile",\n',
        '    "kmall.KmallFile",\n    "listing.ListingFile",\n', "",
    ),
}  # fmt: skip
"""By the row of the table: file, registered name, text that is replaced, its replacement, imports before the line."""
ENGINES = ("coherent", "expected", "fast reverberation", "tracer", "slice", "expected, of the surface")


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """Measurements of `new_things/measure.py` with all new things registered."""
    if not (ROOT / "CONTRIBUTING.md").is_file():
        pytest.skip("an installation, not a checkout")
    folder = tmp_path_factory.mktemp("registered")
    for path, _, line, changed, imports in REGISTRATIONS.values():
        text = (SOURCE / path).read_text(encoding="utf-8")
        assert text.count(line) == 1, path
        before, after = text.split(line)
        head, newline, last = before.rpartition("\n")
        copy = folder / "insonify" / path
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_text(head + newline + imports + last + changed + after, encoding="utf-8")
    command = [sys.executable, "-W", "ignore", str(FILES / "measure.py"), str(folder), str(FILES)]
    process = subprocess.run(
        command, check=False, capture_output=True, text=True, env={**os.environ, "NUMBA_NUM_THREADS": "1"}
    )
    assert process.returncode == 0, process.stderr
    return json.loads(process.stdout)


def result(measured, name):
    """One measurement, or the failure of the test with its error."""
    if isinstance(measured[name], dict) and "error" in measured[name]:
        pytest.fail(measured[name]["error"])
    return measured[name]


@pytest.mark.parametrize("thing", REGISTRATIONS)
def test_the_table_names_file_and_name_of_the_registered_line(thing):
    """The row of CONTRIBUTING.md has what is changed here."""
    lines = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").splitlines()
    (row,) = (line for line in lines if line.startswith(f"| {thing} |"))
    path, name, *_ = REGISTRATIONS[thing]
    assert f"`{name}` in `{path}`" in row or f"`{name}` in `{Path(path).name}`" in row


@pytest.mark.parametrize("engine", ENGINES)
def test_a_law_that_is_a_product_works_in_every_engine(measured, engine):
    """A registered copy of Lambert's law returns what Lambert's law does, to a millionth, at all ranges."""
    levels = result(measured, engine)
    np.testing.assert_allclose(levels["sine-power"], levels["lambert"], rtol=1e-6)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_law_that_is_no_product_works_in_every_engine(measured, engine):
    """Lommel-Seeliger's law re Lambert's: the ratio of both in backscatter, within 0.03 dB at all ranges."""
    levels = result(measured, engine)
    difference = 10 * np.log10(np.divide(levels["lommel-seeliger"], levels["lommel-seeliger by lambert"]))
    np.testing.assert_allclose(difference, 0, atol=0.03)


def test_the_fast_reverberation_is_used(measured):
    """For a seabed with relief under a law that has a table; its citation is listed."""
    assert result(measured, "is fast") is True
    assert "none: a law of a test" in result(measured, "cited")


def test_a_target_shape_is_found_by_its_name_and_returns_sound(measured):
    """A wedge with upright ends returns what a box of its size does; a smooth one, without panels, returns sound."""
    echo = result(measured, "shape")
    strongest = int(np.argmax(echo["box"]))
    assert echo["wedge"][strongest] == pytest.approx(echo["box"][strongest], rel=0.02)
    assert max(echo["smooth"]) > 0


def test_a_pulse_has_the_spectrum_of_its_phase(measured):
    """A hyperbolic sweep, rising and falling: spectrum against a sum over its envelope, band edges, compressed peak."""
    for sweep, (first, last) in (("up", (-7.5e3, 7.5e3)), ("down", (7.5e3, -7.5e3))):
        found = result(measured, "pulse")[sweep]
        assert found["spectrum"] < 1e-5
        assert found["peak"] == pytest.approx(1, abs=2e-3)
        np.testing.assert_allclose(found["frequencies"], [first, last], atol=20)


@pytest.mark.parametrize(
    ("name", "hyperbolic", "without_code", "package"),
    [
        ("a.kmall", 2, "KMALL has no code for a pulse of kind coded", "numpy"),
        ("b.nc", 2, "SONAR-netCDF4 has no code for a pulse of kind coded", "netCDF4"),
        ("a.mcap", 3, 0, "rosbags"),
        ("a.listing", ["ListingFile", 2], ["ListingFile", 2], "numpy"),
    ],
)
def test_files_of_other_programs_state_the_form_of_a_pulse(measured, name, hyperbolic, without_code, package):
    """A falling hyperbolic sweep by its code; a pulse without one is refused or unknown. A new format is read again."""
    if find_spec(package) is None:
        pytest.skip(f"{package} is not installed")
    exported = result(measured, "exported")
    assert exported[f"hfm {name}"] == hyperbolic
    other = exported[f"coded {name}"]
    assert without_code in other if isinstance(without_code, str) else other == without_code


def test_formats_without_a_code_of_pulses_take_any(measured):
    """The recording as netCDF, and XTF."""
    exported = result(measured, "exported")
    assert all(exported[f"{kind} {name}"] > 1000 for kind in ("hfm", "coded") for name in ("a.nc", "a.xtf"))
