"""Claims about sediments: the printed table, and advice for names."""

import csv
from pathlib import Path

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
    """Twenty grain sizes and three beds without one: each row of Table 2 answers to a name."""
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


@pytest.mark.parametrize(("said", "meant"), [("medium snad", "medium sand"), ("sandy clya", "sandy clay")])
def test_a_misspelt_name_is_answered_with_the_nearest(said, meant):
    """The error says what was probably meant."""
    with pytest.raises(ValueError, match=f"{said}.*did you mean .*{meant}"):
        Sediment.named(said)


def test_a_name_like_no_other_is_answered_with_all():
    """Where nothing is near, the list is the advice."""
    with pytest.raises(ValueError, match=r"sandy gravel or .*clay"):
        Sediment.named("zzz")


@pytest.mark.parametrize("phi", [-3.0, 11.0])
def test_grains_outside_the_table_are_warned_of(phi):
    """Boulders and colloids were not measured; one warning names the law and its range."""
    with pytest.warns(PhysicsWarning, match="TR 9407.*-1 to 9 phi") as heard:
        Sediment.from_grain_size(phi)
    assert len(heard) == 1


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
