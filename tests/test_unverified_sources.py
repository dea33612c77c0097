"""The page on validation lists each citation whose publication was not at hand."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
MARK = re.compile(r"not\s+verified")


def test_every_file_with_an_unverified_source_is_listed():
    """Files of the package that mark a citation as not verified, and the table: the same files."""
    table = (ROOT / "docs" / "explanation" / "validation.md").read_text(encoding="utf-8")
    table = table.split("## Sources not verified")[1].split("\n## ")[0]
    package = ROOT / "src" / "insonify"
    marked = [path for path in package.rglob("*.py") if MARK.search(path.read_text(encoding="utf-8"))]
    listed, folder = set(), Path()
    for name in re.findall(r"`([\w/]+\.py)`", table):
        folder = Path(name).parent if "/" in name else folder  # later names of a row are in the folder of the first
        listed.add((folder / Path(name).name).as_posix())
    names = {path.relative_to(package).as_posix() for path in marked}
    assert names <= listed, sorted(names - listed)
    assert all((package / name).is_file() for name in listed), sorted(listed)
