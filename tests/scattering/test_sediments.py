"""Claims about sediments: the printed table, and advice for names."""

import csv
import dataclasses
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from insonify.scattering import Sediment
from insonify.scattering.sediments import GRAIN_SIZE, STONES
from insonify.validity import PhysicsWarning

PRINTED = list(
    csv.DictReader((Path(__file__).parents[1] / "published" / "apl_uw_tr9407_table2_geoacoustics.csv").open())
)


def _half_a_digit(printed: str) -> float:
    # a hair more than half: rounding to print, then comparing in binary
    return 0.5 * 10.0 ** -len(printed.partition(".")[2]) * (1 + 1e-6)


@pytest.mark.parametrize("column", ["density_ratio", "speed_ratio", "loss"])
@pytest.mark.parametrize("row", PRINTED, ids=lambda row: row["name"])
def test_the_handbook_prints_these_sediments(row, column):
    """APL-UW TR 9407, Table 2, to half of the last printed digit, by name and by grain size."""
    for sediment in (Sediment.named(row["name"]), Sediment.from_grain_size(float(row["grain_size_phi"]))):
        digits = {"density_ratio": "0.000", "speed_ratio": "0.0000", "loss": "0.00000"}[column]
        assert getattr(sediment, column) == pytest.approx(float(row[column]), abs=_half_a_digit(digits))


ROUGH = list(csv.DictReader((Path(__file__).parents[1] / "published" / "apl_uw_tr9407_table2_roughness.csv").open()))


@pytest.mark.parametrize("row", ROUGH, ids=lambda row: row["name"])
def test_the_handbook_prints_these_roughnesses(row):
    """APL-UW TR 9407, Table 2: rock and stones, and the roughness of sand, to half of the last printed digit.

    In SI: w2 in cm^4 for wavenumbers in 1/cm is w2 1e-8 0.01^-gamma m^(4 - gamma); medium sand 1.406e-4 m^0.75.
    """
    bed = Sediment.named(row["name"])
    for column in ("density_ratio", "speed_ratio", "loss", "volume_parameter", "spectral_exponent"):
        assert getattr(bed, column) == pytest.approx(float(row[column]), abs=_half_a_digit(row[column]))
    printed = bed.spectral_strength * 1e8 * 0.01**3.25
    assert printed == pytest.approx(
        float(row["spectral_strength_cm4"]), abs=_half_a_digit(row["spectral_strength_cm4"])
    )


def test_si_strength_of_sand():
    """0.004446 cm^4 is 1.406e-4 m^0.75, the input of Jackson's own program for medium sand."""
    assert Sediment.named("medium sand").spectral_strength == pytest.approx(1.406e-4, abs=5e-8)


def test_twenty_three_rows_have_a_name():
    """Twenty grain sizes and three beds without one: each row of Table 2 has a name."""
    beds = [Sediment.named(name) for name in [*GRAIN_SIZE, *STONES]]
    assert len({(b.density_ratio, b.speed_ratio, b.loss, b.spectral_strength) for b in beds}) == 23


def test_mud_is_quieter_inside():
    """TR 9407 halves the volume parameter from 5.5 phi on."""
    assert Sediment.from_grain_size(5.4).volume_parameter == 0.002
    assert Sediment.from_grain_size(5.5).volume_parameter == 0.001


@given(st.floats(-1, 9))
def test_finer_grains_are_slower_and_lighter_or_nearly(phi):
    """Half a phi finer is never denser or faster by more than the regression's joins allow (0.5 %)."""
    coarse, fine = Sediment.from_grain_size(phi), Sediment.from_grain_size(min(phi + 0.5, 9.0))
    assert fine.density_ratio <= coarse.density_ratio * 1.005
    assert fine.speed_ratio <= coarse.speed_ratio * 1.005
    assert 0 < fine.loss <= 0.1


def test_a_name_may_be_written_as_people_write():
    """Capitals and doubled spaces do not make another sediment."""
    assert Sediment.named(" Medium  SAND ") == Sediment.named("medium sand")


@pytest.mark.parametrize(("message", "meant"), [("medium snad", "medium sand"), ("sandy clya", "sandy clay")])
def test_a_misspelt_name_is_reported_with_the_nearest(message, meant):
    """The error states what was probably meant."""
    with pytest.raises(ValueError, match=f"{message}.*did you mean .*{meant}"):
        Sediment.named(message)


def test_a_name_like_no_other_is_reported_with_all():
    """Where nothing is near, the list is the advice."""
    with pytest.raises(ValueError, match=r"known ones are .*sandy gravel, .* or clay"):
        Sediment.named("zzz")


@pytest.mark.parametrize("phi", [-3.0, 11.0])
def test_grains_outside_the_table_are_warned_of(phi):
    """Boulders and colloids were not measured; one warning names the law and its range."""
    with pytest.warns(PhysicsWarning, match="TR 9407.*-1 to 9 phi") as caught:
        Sediment.from_grain_size(phi)
    assert len(caught) == 1


@pytest.mark.parametrize(
    "wrong",
    [
        {"density_ratio": 0},
        {"speed_ratio": -1},
        {"loss": -0.01},
        {"loss": float("nan")},
        {"speed_ratio": float("inf")},
        {"volume_parameter": -1},
        {"spectral_exponent": 2.0},
        {"spectral_exponent": 4.0},
        {"spectral_exponent": float("nan")},
        {"spectral_strength": 0},
    ],
)
def test_impossible_sediment_is_refused(wrong):
    """No medium has zero density, negative speed or gain."""
    with pytest.raises(ValueError, match=next(iter(wrong))):
        Sediment(**({"density_ratio": 2.0, "speed_ratio": 1.1, "loss": 0.01} | wrong))


@pytest.mark.parametrize("phi", [float("nan"), -9.0, 15.0])
def test_a_grain_size_that_is_none_is_refused(phi):
    """NaN is not a grain size, and no grain is half a metre or a molecule."""
    with pytest.raises(ValueError, match="grain size"):
        Sediment.from_grain_size(phi)


def test_a_scenario_may_describe_its_own_sediment():
    """Density, speed and loss from a file; a misspelt one is an error of the file."""
    own = {"density_ratio": 1.9, "speed_ratio": 1.15, "loss": 0.01}
    assert TypeAdapter(Sediment).validate_python(own) == Sediment(1.9, 1.15, 0.01)
    with pytest.raises(ValidationError, match="los"):
        TypeAdapter(Sediment).validate_python({**own, "los": 0.02})


NAMES_PRINTED = """
-1 sandy gravel, -0.5 very coarse sand, 0 muddy sandy gravel, 0.5 coarse sand, 0.5 gravelly sand,
1 gravelly muddy sand, 1.5 medium sand, 2 muddy gravel, 2.5 fine sand, 2.5 silty sand, 3 muddy sand,
3.5 very fine sand, 4 clayey sand, 4.5 coarse silt, 5 sandy silt, 5 gravelly mud, 5.5 medium silt,
5.5 sand-silt-clay, 6 sandy mud, 6.5 fine silt, 6.5 clayey silt, 7 sandy clay, 7.5 very fine silt,
8 silty clay, 9 clay
"""


@pytest.mark.parametrize("entry", [entry.strip() for entry in NAMES_PRINTED.split(",")])
def test_a_name_is_its_printed_grain_size(entry):
    """TR 9407, Table 2: each name stands for a mean grain size, and for nothing else."""
    size, name = entry.split(" ", 1)
    named = Sediment.named(name)
    assert dataclasses.replace(named, name="") == dataclasses.replace(Sediment.from_grain_size(float(size)), name="")


def test_two_programs_of_the_regressions_agree():
    """TR 9407, eqs. 2-10, as one table of pieces: every hundredth of a phi, both sides of each break, to 1e-12."""
    z = np.unique(np.concatenate([np.arange(-100, 901) / 100, [b - 1e-9 for b in (0, 1, 2.6, 4.5, 5, 5.3, 5.5, 6)]]))
    three = [z < 1, z < 5.3, z >= 5.3]
    cubic = np.polynomial.polynomial.polyval
    density = np.select(
        three,
        [
            cubic(z, [2.3139, -0.17057, 0.007797]),
            cubic(z, [3.0455, -1.1069031, 0.2290201, -0.0165406]),
            1.1565 - 0.0012973 * z,
        ],
    )
    speed = np.select(
        three,
        [
            cubic(z, [1.2778, -0.056452, 0.002709]),
            cubic(z, [1.3425, -0.1382798, 0.0213937, -0.0014881]),
            1.0019 - 0.0024324 * z,
        ],
    )
    per_khz = np.select(
        [z < 0, z < 2.6, z < 4.5, z < 6, z < 9.5],
        [
            0.4556 + 0 * z,
            0.4556 + 0.0245 * z,
            0.1978 + 0.1245 * z,
            cubic(z, [8.0399, -2.5228, 0.20098]),
            cubic(z, [0.9431, -0.2041, 0.0117]),
        ],
    )
    height = np.where(z < 5, (2.03846 - 0.26923 * z) / (1 + 0.076923 * z), 0.5)
    beds = [Sediment.from_grain_size(float(size)) for size in z]
    loss = per_khz * speed * 1.528 * np.log(10) / (40 * np.pi)
    strength = 0.00207 * height**2 * 1e-8 * 0.01**-3.25
    for field, expected in {
        "density_ratio": density,
        "speed_ratio": speed,
        "loss": loss,
        "spectral_strength": strength,
        "volume_parameter": np.where(z < 5.5, 0.002, 0.001),
    }.items():
        np.testing.assert_allclose([getattr(bed, field) for bed in beds], expected, rtol=1e-12)
