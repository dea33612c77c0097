"""Commands with the URL of a recording in an object store in place of a folder."""

from pathlib import Path

import pytest
from fsspec.implementations.memory import MemoryFileSystem

from insonify.cli import main
from oracles.short_window import SHORT

URL = "memory://store/harbour.zarr"


def test_commands_take_a_url(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Plan, run, status, show, explain keep both slashes, and no folder of that name is made; errors state the fix."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("INSONIFY_SPOOL", str(tmp_path / "spool"))
    Path("a.yaml").write_text(SHORT, encoding="utf-8")
    assert main(["plan", "a.yaml", "--tasks", "1", "-o", URL]) == 0
    assert f"insonify run a.yaml -o {URL} --threads 1 --quiet --part" in capsys.readouterr().out
    assert main(["explain", URL, "--time", "201 ms"]) == 2
    assert f"{URL} is not a recording. Make one with: insonify run FILE -o {URL}" in capsys.readouterr().err
    with monkeypatch.context() as patch:
        patch.setattr(MemoryFileSystem, "put_file", lambda *_, **__: 1 / 0)  # a failure of any type
        assert main(["run", "a.yaml", "-o", URL, "--quiet"]) == 2
    assert f"{URL} cannot be reached: division by zero. Check the URL" in capsys.readouterr().err
    assert main(["run", "a.yaml", "-o", URL, "--quiet", "--labels"]) == 0
    assert capsys.readouterr().out == f"{URL}\n"
    assert main(["run", "a.yaml", "-o", URL, "--quiet", "--overwrite"]) == 2
    assert "Delete it first, or choose another name" in capsys.readouterr().err
    assert main(["status", URL]) == 0
    assert capsys.readouterr().out == f"{URL}: all 1 pings recorded\n  all 1 pings labelled\n"
    assert main(["explain", URL, "--time", "201 ms"]) == 0 and "dB" in capsys.readouterr().out
    assert main(["show", URL, "-o", "a.png", "--ping", "0"]) == 0
    assert main(["show", URL, "-o", "b.png", "--ping", "0", "--labels"]) == 0
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a.png", "a.yaml", "b.png", "spool"]
