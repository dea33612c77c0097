"""Claims about a measured law: its own numbers back, a symmetric rule between, advice for broken files."""

import numpy as np
import pytest

from insonify.scattering import Lambert, TableScatteringLaw

BACK = np.pi


def test_straight_back_it_is_the_table():
    """At its own angles a table returns its own strengths; in between, decibels are linear in angle."""
    grazing, strength = np.radians([5.0, 20, 60, 90]), np.array([-45.0, -30, -20, -8])
    law = TableScatteringLaw(grazing, strength)
    np.testing.assert_allclose(10 * np.log10(law.cross_section(grazing, grazing, BACK)), strength, atol=1e-9)
    middle = np.radians(40)
    assert 10 * np.log10(law.cross_section(middle, middle, BACK)) == pytest.approx(-25)


def test_a_table_of_lamberts_law_is_lamberts_law():
    """The bistatic rule, a geometric mean, is exact for Lambert, below the table's first angle too."""
    grazing = np.radians(np.arange(1, 91.0))
    law = TableScatteringLaw(grazing, -27 + 20 * np.log10(np.sin(grazing)))
    a, b = np.radians([0.3, 2, 33, 71]), np.radians([80.0, 5, 17, 0.5])
    np.testing.assert_allclose(law.cross_section(a, b, 0.7), Lambert().cross_section(a, b, 0.7), rtol=1e-4 + 0.002)


def test_a_file_may_hold_it(tmp_path):
    """Two named columns, in degrees and decibels; other columns are passed over."""
    file = tmp_path / "law.csv"
    file.write_text("strength_db,note,grazing_deg\n-40,quiet,10\n-20,strong,80\n")
    assert TableScatteringLaw.from_csv(file) == TableScatteringLaw(np.radians([10.0, 80]), [-40, -20])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("grazing,strength_db\n1,2\n", r"line 1: no column grazing_deg"),
        ("grazing_deg,strength_db\n1,-20\n2,strong\n", r"line 3, column strength_db: 'strong' is not a number"),
        ("grazing_deg,strength_db\n1,-20\n2\n", r"line 3, column strength_db"),
        ("grazing_deg,strength_db\n20,-20\n10,-30\n", r"line 3: .*10 deg does not exceed"),
        ("grazing_deg,strength_db\n20,-20\n\n110,-30\n", r"line 4: .*110 deg.*0 and 90"),
        ("grazing_deg,strength_db\n20,-20\n30,nan\n", r"line 3: column strength_db: not a finite number"),
        ("grazing_deg,strength_db\n20,-20\n", r"at least two rows"),
        ("grazing_deg,strength_db\n", r"at least two rows"),
    ],
)
def test_a_broken_file_is_reported_with_its_line(tmp_path, text, message):
    """File, line and column are named."""
    file = tmp_path / "law.csv"
    file.write_text(text)
    with pytest.raises(ValueError, match=r"law\.csv, " + (message if message.startswith("line") else f".*{message}")):
        TableScatteringLaw.from_csv(file)


@pytest.mark.parametrize(
    ("grazing", "strength"),
    [([0.1], [-20]), ([0.1, 0.2], [-20]), ([0.2, 0.1], [-20, -30]), ([0.1, 0.2], [-20, np.inf])],
)
def test_columns_that_are_no_table_are_refused(grazing, strength):
    """Equal lengths, at least two rows, increasing, finite."""
    with pytest.raises(ValueError, match="TableScatteringLaw, row"):
        TableScatteringLaw(grazing, strength)


def test_equal_tables_are_equal():
    """A law is a value: it can be compared and be a key."""
    assert hash(TableScatteringLaw([0.1, 1], [-30, -20])) == hash(
        TableScatteringLaw(np.array([0.1, 1.0]), (-30.0, -20.0))
    )


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"grazing_deg,strength_db\n1,-3\n\xff,-3\n", "line 3: not text"),
        (b"grazing_deg,strength_db\n1\n2,-3\n", "line 2, column strength_db: the cell is empty"),
        (b"grazing_deg,strength_db\n5,-3\n1,-3\n", "line 3: column grazing: 1 deg does not exceed"),
        (b"grazing_deg,strength_db\n5,-inf\n6,-3\n", "line 2: column strength_db: not a finite"),
    ],
)
def test_a_broken_file_is_reported_with_its_location(tmp_path, content, message):
    """Bytes that are no text, a cell that is missing, angles in disorder: file, line and column are named."""
    file = tmp_path / "measured.csv"
    file.write_bytes(content)
    with pytest.raises(ValueError, match=f"measured.csv, {message}"):
        TableScatteringLaw.from_csv(file)
