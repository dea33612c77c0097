"""Claims about the law of a seabed as a scenario names it: the inside of a sediment, and a measured table."""

from pathlib import Path

import numpy as np
import pytest

import insonify
from insonify.diagnostics.diagnostic import ScenarioError
from insonify.formats.zarr_store import open_recording
from insonify.recording_run import record
from insonify.scattering import Jackson, Sediment, SedimentVolume, TableScatteringLaw, compile_law
from insonify.scattering.compiled_law import CompiledLaw
from insonify.scenario.citations import citations
from insonify.scene.seabed import Seabed

TABLE = "grazing_deg, strength_db\n2, -45\n10, -32\n30, -25\n90, -12\n"
SCENE = """
seabed: {{depth: 15 m, scattering: {law}}}
sonar:
  source_level_db: 200
  pulse: {{kind: cw, frequency: 100 kHz, duration: 0.2 ms}}
  transmit: {{kind: line, length: 0.3 m}}
  receive: {{kind: line, length: 0.3 m}}
track: {{kind: static, position: [0, 0, 8 m], window: [20 ms, 30 ms]}}
paths: {{contributions: [seabed], max_reflections: 0}}
field: incoherent
"""


def _written(folder: Path, law: str) -> Path:
    """A scenario file with a law of the seabed, beside a table of strengths."""
    (folder / "strengths.csv").write_text(TABLE)
    (folder / "bed.yaml").write_text(SCENE.format(law=law))
    return folder / "bed.yaml"


def _evaluated(law: CompiledLaw, degrees: list[float]) -> np.ndarray:
    """Backscattering strength of a law on a flat bed [dB]."""
    g = np.radians(degrees)
    into = np.array([np.cos(g), 0 * g, np.sin(g)])
    return 10 * np.log10(law.cross_section(into, -into, np.array([[0.0], [0.0], [-1.0]])))


@pytest.mark.parametrize(("kind", "law"), [("jackson", Jackson), ("sediment-volume", SedimentVolume)])
@pytest.mark.parametrize("volume", ["power-law", "isotropic"])
def test_a_scenario_names_the_inside_of_its_sediment(kind, law, volume):
    """`volume: power-law` or `isotropic` is the law of that name; left out, it is the power law."""
    degrees = [5.0, 20.0, 60.0]
    named = Seabed(scattering={"law": kind, "sediment": "fine sand", "volume": volume}).law(60e3, 1490.0)
    expected = compile_law(law(Sediment.named("fine sand"), 60e3, sound_speed=1490.0, volume_spectrum=volume))
    np.testing.assert_array_equal(_evaluated(named, degrees), _evaluated(expected, degrees))
    default = Seabed(scattering={"law": kind, "sediment": "fine sand"}).law(60e3, 1490.0)
    assert np.array_equal(_evaluated(default, degrees), _evaluated(named, degrees)) == (volume == "power-law")


@pytest.mark.parametrize(
    ("law", "message"),
    [
        (
            "{sediment: medium sand, volume: white}",
            r"scattering.volume: 'white' is not known here.*power-law, isotropic",
        ),
        ("{sediment: medium sand, volume: isotropc}", "Did you mean 'isotropic'"),
        ("{law: small-slope, volume: isotropic}", r"volume.*surface alone\. Leave volume out, or write law: jackson"),
        ("{file: nowhere.csv}", r"nowhere\.csv cannot be read.*grazing_deg and strength_db"),
        ("{law: table}", r"file: missing"),
        ("{law: table, file: strengths.csv, sediment: clay}", "unknown key 'sediment'"),
    ],
)
def test_a_law_that_is_none_is_advised(tmp_path, law, message):
    """What stands there, what may, and what probably was meant."""
    with pytest.raises(ScenarioError, match=message):
        insonify.load_scenario(_written(tmp_path, law))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("grazing_deg,strength\n1,-30\n", r"line 1: no column strength_db"),
        ("grazing_deg,strength_db\n10,-30\n5,-20\n", r"line 3: .*5 deg does not exceed the one before"),
        ("grazing_deg,strength_db\n10,strong\n20,-20\n", r"line 2, column strength_db: 'strong' is not a number"),
        ("grazing_deg,strength_db\n0,10\n90,10\n", r"would send out 1.69e.03 times the sound that it receives"),
    ],
)
def test_a_table_that_is_none_is_refused_with_its_line(tmp_path, text, message):
    """A scenario is refused with the table's file and line, and a bed that gives more than it gets."""
    file = _written(tmp_path, "{file: strengths.csv}")
    (tmp_path / "strengths.csv").write_text(text)
    with pytest.raises(ScenarioError, match=message):
        insonify.load_scenario(file)


@pytest.mark.parametrize("field", ["incoherent", "coherent"])
def test_a_table_of_lamberts_law_is_lamberts_law(tmp_path, field):
    """A table with 10 log10 mu + 20 log10 sin(grazing) at every degree gives Lambert's echoes, to 0.01 dB."""
    file = _written(tmp_path, "{file: strengths.csv}")
    degrees = np.arange(0.25, 90.1, 0.25)
    rows = (f"{d},{-27 + 20 * np.log10(np.sin(np.radians(d)))}" for d in degrees)
    (tmp_path / "strengths.csv").write_text("\n".join(["grazing_deg,strength_db", *rows]))
    file.write_text(file.read_text().replace("field: incoherent", f"field: {field}"))
    by_table = insonify.simulate(insonify.load_scenario(file))
    file.write_text(file.read_text().replace("{file: strengths.csv}", "{law: lambert, strength_db: -27}"))
    by_law = insonify.simulate(insonify.load_scenario(file))
    name = "intensity" if field == "incoherent" else "pressure"
    np.testing.assert_allclose(by_table[name], by_law[name], rtol=0, atol=2.5e-3 * float(np.abs(by_law[name]).max()))


def test_a_recording_stores_its_table(tmp_path):
    """The recording names the table and its fingerprint, cites it, and reports it when it has changed since."""
    scenario = insonify.load_scenario(_written(tmp_path, "{file: strengths.csv}"))
    assert "Seabed strength table strengths.csv" in citations(scenario)
    record(scenario, tmp_path / "bed.zarr")
    held = open_recording(tmp_path / "bed.zarr")
    law = scenario.seabed.scattering
    assert law.sha256 in held.attrs["scenario"]
    assert law.at(1e5, 1500.0).cross_section is not None
    angles = [2.0, 17.0, 90.0]
    np.testing.assert_allclose(
        _evaluated(law.at(1e5, 1500.0), angles),
        _evaluated(compile_law(TableScatteringLaw.from_csv(law.file)), angles),
        atol=1e-6,
    )
    (tmp_path / "strengths.csv").write_text(TABLE.replace("-25", "-26"))
    with pytest.raises(ValueError, match="the file has changed since"):
        type(law)(file=law.file, sha256=law.sha256)
