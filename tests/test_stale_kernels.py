from pathlib import Path

import pytest

from insonify.stale_kernels import forget_stale_kernels

SOURCES = {
    "sum.py": "from numba import njit\nfrom insonify.parts import piece\n",
    "parts/piece.py": "from numba import njit\n",
    "parts/other.py": "from numba import njit\n",
    "plain.py": "x = 1\n",
}


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package of two kernels, one of which calls the other, with machine code beside each."""
    for name, text in SOURCES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    forget_stale_kernels(tmp_path)
    for name in SOURCES:
        cache = (tmp_path / name).parent / "__pycache__"
        cache.mkdir(exist_ok=True)
        for suffix in ("nbi", "1.nbc"):
            (cache / f"{Path(name).stem}.f-1.py311.{suffix}").touch()
    return tmp_path


def _kept(package: Path) -> set[str]:
    return {path.name.split(".")[0] for path in package.rglob("*.nb?")}


def test_nothing_is_dropped_where_nothing_changed(package):
    """Machine code stays while its sources do."""
    assert forget_stale_kernels(package) == []
    assert _kept(package) == {"sum", "piece", "other", "plain"}


def test_a_changed_kernel_takes_its_callers_with_it(package):
    """The caller of a changed kernel holds its old code, so both go; a neighbour that does not call it stays."""
    (package / "parts/piece.py").write_text("from numba import njit\n# faster\n")
    assert sorted(forget_stale_kernels(package)) == ["parts/piece.py", "sum.py"]
    assert _kept(package) == {"other", "plain"}


def test_a_changed_caller_leaves_what_it_calls(package):
    """Only machine code that depends on the change is compiled again; plain files do not count."""
    (package / "sum.py").write_text(SOURCES["sum.py"] + "# slower\n")
    (package / "plain.py").write_text("x = 22\n")
    assert forget_stale_kernels(package) == ["sum.py"]
    assert _kept(package) == {"piece", "other", "plain"}


def test_a_folder_that_cannot_be_written_is_left_alone(package, monkeypatch):
    """A read-only installation still works."""

    def refuse(*_: object, **__: object) -> None:
        raise PermissionError

    (package / "sum.py").write_text("from numba import njit\n")
    monkeypatch.setattr(Path, "unlink", refuse)
    assert forget_stale_kernels(package) == []
