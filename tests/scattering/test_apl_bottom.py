"""Claims about the handbook's backscatter: its printed table, and what may be requested."""

import csv
from pathlib import Path

import numpy as np
import pytest

from insonify.scattering import Jackson, Sediment, apl_bottom_strength_db
from insonify.validity import PhysicsWarning
from oracles import handbook_bottom

PRINTED = list(
    csv.DictReader((Path(__file__).parents[1] / "published" / "apl_uw_tr9407_table3_bottom_backscatter.csv").open())
)
SAND = Sediment.named("medium sand")


def _bed(row: dict[str, str]) -> Sediment:
    phi = row["grain_size_phi"]
    return Sediment.from_grain_size(float(phi)) if phi else Sediment.named(row["sediment"])


@pytest.mark.parametrize("row", PRINTED, ids=lambda r: f"{r['sediment']}-{r['grazing_deg']}")
def test_the_handbook_prints_these_strengths(row):
    """APL-UW TR 9407, Table 3, to 0.15 dB (three times its rounding)."""
    frequency, grazing = 1e3 * float(row["frequency_khz"]), np.radians(float(row["grazing_deg"]))
    found = apl_bottom_strength_db(_bed(row), frequency, grazing, sound_speed=float(row["sound_speed"]))
    assert found == pytest.approx(float(row["strength_db"]), abs=0.15)


BEDS = [
    *(Sediment.named(name) for name in ("rough rock", "rock", "gravel", "sandy gravel", "coarse sand")),
    *(Sediment.named(name) for name in ("medium sand", "very fine sand", "coarse silt", "sandy mud", "clay")),
    Sediment(1.4, 1.0005, 0.002, 0.004, 2.6, 3e-4),  # hardly any critical angle; jagged
    Sediment(2.2, 1.6, 0.05, 0.0005, 3.8, 2e-4),
]


@pytest.mark.parametrize("bed", BEDS, ids=lambda bed: bed.name or str(bed.spectral_exponent))
@pytest.mark.parametrize("frequency", [10e3, 25e3, 30e3, 60e3, 100e3])
def test_two_programs_of_the_handbook_agree(bed, frequency):
    """A second program of eqs. 29-66, in centimetres and degrees, one angle at a time: the same to 1e-6 dB."""
    degrees = [0.0005, 0.5, 2, 5, 10, 20, 30, 39.99, 40, 45, 55, 60, 65, 70, 75, 80, 84, 87, 89.5, 90]
    page = handbook_bottom.of_sediment(bed, frequency, 1528.0)
    second = [10 * np.log10(handbook_bottom.whole(page, max(d, 1e-3))) for d in degrees]
    found = apl_bottom_strength_db(bed, frequency, np.radians(degrees), sound_speed=1528.0)
    np.testing.assert_allclose(found, second, atol=1e-6)


@pytest.mark.parametrize("name", ["medium sand", "coarse sand", "sandy silt"])
@pytest.mark.parametrize("grazing_deg", [15, 25, 40])
def test_the_bistatic_law_agrees_straight_back(name, grazing_deg):
    """Two models of the same bed: Jackson's small slopes and the handbook's composite roughness, within 2 dB."""
    bed, grazing = Sediment.named(name), np.radians(grazing_deg)
    flat = 10 * np.log10(Jackson(bed, 30e3).cross_section(grazing, grazing, np.pi))
    assert flat == pytest.approx(float(apl_bottom_strength_db(bed, 30e3, grazing)), abs=2.0)


def test_backscatter_at_zero_grazing_is_weak_and_finite():
    """At grazing 0 the handbook takes 0.001 degrees."""
    found = apl_bottom_strength_db(SAND, 30e3, np.array([0.0, np.radians(1e-3)]))
    assert found[0] == found[1]
    assert -200 < found[0] < -60


def test_shape_of_the_angles_is_kept():
    """A table of angles gives a table of strengths."""
    assert apl_bottom_strength_db(SAND, 30e3, np.full((2, 3), 0.3)).shape == (2, 3)


@pytest.mark.parametrize("grazing", [-0.1, 1.7, float("nan")])
def test_what_is_no_grazing_angle_is_refused(grazing):
    """Angles lie between the plane and its normal."""
    with pytest.raises(ValueError, match=r"0 to 1\.5708"):
        apl_bottom_strength_db(SAND, 30e3, grazing)


@pytest.mark.parametrize("wrong", [{"frequency": 0.0}, {"sound_speed": float("nan")}])
def test_what_is_no_sound_is_refused(wrong):
    """No frequency, no speed: no strength."""
    with pytest.raises(ValueError, match=next(iter(wrong))):
        apl_bottom_strength_db(SAND, wrong.get("frequency", 30e3), 0.3, sound_speed=wrong.get("sound_speed", 1500.0))


@pytest.mark.parametrize(
    ("bed", "frequency", "message"),
    [(SAND, 400e3, "frequency"), (Sediment(3.5, 1.1, 0.01), 30e3, "density"), (Sediment(2.0, 1.1, 0.2), 30e3, "loss")],
)
def test_outside_the_handbooks_inputs_one_warning_is_given(bed, frequency, message):
    """The handbook limits its inputs; the warning names the quantity and its range."""
    with pytest.warns(PhysicsWarning, match=f"TR 9407.*{message}") as caught:
        apl_bottom_strength_db(bed, frequency, 0.3)
    assert len(caught) == 1
