"""Tables of comma-separated values: rows and their lines, whatever separates cells and lines; errors name the line."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.data_file import is_number, name_and_unit, table_rows

CELLS = st.text("abc 012.-+e", min_size=1).map(str.strip).filter(bool)


def written(folder: Path, text: str) -> Path:
    """A table with this text."""
    file = folder / "table.csv"
    file.write_bytes(text.encode())
    return file


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder for tables."""
    return tmp_path_factory.mktemp("tables")


@given(st.lists(st.tuples(CELLS, CELLS), min_size=1), st.sampled_from(",;\t"), st.sampled_from(["\n", "\r\n", "\r"]))
def test_cells_are_read_as_written(folder: Path, cells: list[tuple[str, str]], mark: str, end: str) -> None:
    """Any rows of two cells between comments and blank lines: the same cells, with the numbers of their lines."""
    lines = [line for a, b in cells for line in ("# a comment, of; any kind", f"{a}{mark} {b}", " ")]
    rows = list(table_rows(written(folder, end.join(lines)), "a,b"))
    assert rows == [(3 * n + 2, list(row)) for n, row in enumerate(cells)]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"table.csv, line 1: the file is empty. Write a header: depth,speed"),
        ("# only\n\n", r"line 1: the file is empty"),
        ("a,b\n\n1,2,3\n", r"line 3: 3 columns where the header has 2. Is a value missing\?"),
        ('a,b\n1,"2\n3,4"\n', r"line 2: a quote is opened and not closed"),
    ],
)
def test_errors_name_the_line(folder: Path, text: str, message: str) -> None:
    """An empty file, a row of another length, and a cell that would continue in the next line."""
    with pytest.raises(ValueError, match=message):
        list(table_rows(written(folder, text), "depth,speed"))


def test_headers_have_a_name_and_a_unit() -> None:
    """In brackets of either kind, or none; capitals and synonyms are one name."""
    titles = ("Depth [m]", " speed (m/s)", "c", "heading[deg ]")
    found = [name_and_unit(title, {"c": "speed"}) for title in titles]
    assert found == [("depth", "m"), ("speed", "m/s"), ("speed", ""), ("heading", "deg")]
    assert [text for text in ("1", " -2e3", "nan", "1,5", "", "m") if is_number(text)] == ["1", " -2e3", "nan"]
