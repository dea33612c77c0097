"""Claims about cached machine code: it never outlives the sources it was made from."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from insonify import kernel_cache
from insonify.kernel_cache import delete_stale_kernels

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
    delete_stale_kernels(tmp_path)
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
    assert delete_stale_kernels(package) == []
    assert _kept(package) == {"sum", "piece", "other", "plain"}


def test_a_changed_kernel_takes_its_callers_with_it(package):
    """The caller of a changed kernel holds its old code, so both go; a neighbour that does not call it stays."""
    (package / "parts/piece.py").write_text("from numba import njit\n# faster\n")
    assert sorted(delete_stale_kernels(package)) == ["parts/piece.py", "sum.py"]
    assert _kept(package) == {"other", "plain"}


def test_a_changed_caller_leaves_what_it_calls(package):
    """Only machine code that depends on the change is compiled again; plain files do not count."""
    (package / "sum.py").write_text(SOURCES["sum.py"] + "# slower\n")
    (package / "plain.py").write_text("x = 22\n")
    assert delete_stale_kernels(package) == ["sum.py"]
    assert _kept(package) == {"piece", "other", "plain"}


def test_a_folder_that_cannot_be_written_is_left_alone(package, monkeypatch):
    """A read-only installation still works."""

    def refuse(*_: object, **__: object) -> None:
        raise PermissionError

    (package / "sum.py").write_text("from numba import njit\n")
    monkeypatch.setattr(Path, "unlink", refuse)
    assert delete_stale_kernels(package) == []


CALLER = """
from numba import njit
from insonify.callee import turned

@njit(cache=True)
def kernel(x):
    return 10.0 * turned(x)
"""
CALLEE = """
from numba import njit

@njit(inline="always")
def turned(x):
    return {sign} * x
"""
PROGRAM = "from insonify.caller import kernel; print(kernel(1.0), sum(kernel.stats.cache_hits.values()))"


@pytest.fixture
def installed(tmp_path: Path) -> Path:
    """An installation with one kernel, which calls the kernel of another file."""
    package = tmp_path / "site" / "insonify"
    package.mkdir(parents=True)
    (package / "kernel_cache.py").write_bytes(Path(kernel_cache.__file__).read_bytes())
    (package / "__init__.py").write_text(
        "from pathlib import Path\nfrom insonify.kernel_cache import delete_stale_kernels\n"
        "delete_stale_kernels(Path(__file__).parent)\n"
    )
    (package / "caller.py").write_text(CALLER)
    (package / "callee.py").write_text(CALLEE.format(sign="1.0"))
    return package


def _evaluated(package: Path, settings: dict[str, str]) -> tuple[float, bool]:
    """Result of the kernel in a fresh process, and whether its machine code came from the cache."""
    places = {"PYTHONPATH": str(package.parent), "XDG_CACHE_HOME": str(package.parents[1] / "home")}
    own = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_CACHE")}
    completed = subprocess.run(
        [sys.executable, "-c", PROGRAM], env=own | places | settings, check=False, capture_output=True, text=True
    )
    assert completed.returncode == 0, completed.stderr
    value, hits = completed.stdout.split()
    return float(value), hits == "1"


@pytest.mark.slow
@pytest.mark.parametrize("where", ["beside", "named", "read-only"])
def test_an_upgraded_callee_is_compiled_again_wherever_the_cache_lies(installed, tmp_path, where):
    """With the callee's sign turned, a new process gives the new sign; without a change it reads the cache.

    The cache lies beside the sources, in NUMBA_CACHE_DIR, or in the user's where sources cannot be written to.
    """
    settings = {"NUMBA_CACHE_DIR": str(tmp_path / "named")} if where == "named" else {}
    if where == "read-only":  # a file in the folder's place keeps even the superuser out
        (installed / "__pycache__").write_text("")
    assert _evaluated(installed, settings) == (10.0, False)
    assert _evaluated(installed, settings) == (10.0, True)
    root = {"beside": installed, "named": tmp_path / "named", "read-only": tmp_path / "home"}[where]
    assert list(root.rglob("caller.kernel*.nbc"))
    (installed / "callee.py").write_text(CALLEE.format(sign="-1.0"))
    assert _evaluated(installed, settings) == (-10.0, False)


def test_the_place_of_the_cache_is_the_one_that_numba_takes(installed, tmp_path, monkeypatch):
    """The folder is numba's own choice for every setting: named, named in vain, chosen by class, read-only."""
    from numba.core import caching, config

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    (tmp_path / "taken").write_text("a file where a folder should be")
    source = str(installed / "caller.py")
    code = compile("def kernel(): pass", source, "exec")
    scope: dict[str, object] = {}
    exec(code, scope)

    def agree() -> None:
        chosen = caching.CompileResultCacheImpl(scope["kernel"]).locator.get_cache_path()
        assert kernel_cache.cache_folder(installed)(installed) == Path(chosen)

    for named, classes in (
        ("", ""),
        (str(tmp_path / "named"), ""),
        (str(tmp_path / "taken" / "folder"), ""),
        (str(tmp_path / "named"), "InTreeCacheLocator,UserWideCacheLocator"),
        ("", "UserWideCacheLocator"),
    ):
        monkeypatch.setattr(config, "CACHE_DIR", named)
        monkeypatch.setattr(config, "CACHE_LOCATOR_CLASSES", classes)
        agree()
    shutil.rmtree(installed / "__pycache__")
    (installed / "__pycache__").write_text("")
    monkeypatch.setattr(config, "CACHE_LOCATOR_CLASSES", "")
    monkeypatch.setattr(config, "CACHE_DIR", "")
    agree()


def test_stamps_stand_in_the_folder_that_the_user_named(package, tmp_path, monkeypatch):
    """In NUMBA_CACHE_DIR the stale code goes, the rest stays, and code beside the sources is not touched."""
    monkeypatch.setattr(kernel_cache, "_numba_cache_settings", lambda: (str(tmp_path / "named"), []))
    place = kernel_cache.cache_folder(package)
    assert sorted(delete_stale_kernels(package)) == ["parts/other.py", "parts/piece.py", "sum.py"]
    codes = [place(package) / "sum.f-1.py311.nbi", place(package / "parts") / "other.f-1.py311.1.nbc"]
    for code in codes:
        code.parent.mkdir(exist_ok=True)
        code.touch()
    (package / "parts/piece.py").write_text("from numba import njit\n# faster\n")
    assert sorted(delete_stale_kernels(package)) == ["parts/piece.py", "sum.py"]
    assert [code.exists() for code in codes] == [False, True]
    assert _kept(package) == {"sum", "piece", "other", "plain"}
    assert delete_stale_kernels(package) == []


def test_a_source_with_an_old_date_is_seen_to_change(package):
    """An installer that gives every file the date and the size that it had before does not hide a change."""
    file = package / "parts/piece.py"
    was = file.stat()
    file.write_text(SOURCES["parts/piece.py"].replace("njit", "vjit"))
    os.utime(file, ns=(was.st_atime_ns, was.st_mtime_ns))
    assert file.stat().st_size == was.st_size
    assert sorted(delete_stale_kernels(package)) == ["parts/piece.py", "sum.py"]


def test_a_constant_of_a_plain_file_belongs_to_the_code_that_holds_it(package):
    """Machine code holds the constants of plain files as numbers: a change of one takes its kernels and their callers.

    Imports in brackets over several lines count like others; what nothing draws on does not.
    """
    (package / "parts/size.py").write_text("SIZE = 3\n")
    (package / "parts/piece.py").write_text("from numba import njit\nfrom insonify.parts import (\n    size,\n)\n")
    delete_stale_kernels(package)
    (package / "parts/size.py").write_text("SIZE = 4\n")
    assert sorted(delete_stale_kernels(package)) == ["parts/piece.py", "sum.py"]
    (package / "plain.py").write_text("x = 5\n")
    assert delete_stale_kernels(package) == []
