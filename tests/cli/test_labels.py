"""Labels from the command line: made with a run, or later, and drawn."""

from pathlib import Path

import pytest

from insonify.cli import main
from insonify.formats.label_store import open_labels
from oracles.short_window import WITH_TARGET


def test_a_recording_is_labelled_and_drawn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without labels `show --labels` states how to make them (2); `run --labels` adds them; then there is a picture."""
    monkeypatch.chdir(tmp_path)
    Path("a.yaml").write_text(WITH_TARGET, encoding="utf-8")
    assert main(["run", "a.yaml", "-o", "a.zarr"]) == 0
    assert main(["show", "a.zarr", "--labels", "-o", "a.png"]) == 2
    assert "insonify run FILE -o a.zarr --labels" in capsys.readouterr().err
    assert main(["run", "a.yaml", "-o", "a.zarr", "--labels"]) == 0
    assert open_labels("a.zarr").highlight.values.any()
    assert main(["show", "a.zarr", "--labels", "-o", "a.png"]) == 0
    assert Path("a.png").read_bytes().startswith(b"\x89PNG")
    assert main(["show", "a.zarr", "--labels", "--ground", "--ping", "0", "-o", "a.png"]) == 2


def test_elements_are_not_labelled_and_a_demo_needs_a_folder(tmp_path, capsys):
    """What output.labels is refused, --labels is; a file is no folder: both are wrong input, and nothing is written."""
    assert main(["new", str(tmp_path / "ahead"), "--template", "forward-looking"]) == 0
    out = tmp_path / "ahead.zarr"
    assert main(["run", str(tmp_path / "ahead.yaml"), "-o", str(out), "--labels"]) == 2
    assert main(["demo", "forward-looking", "-o", str(tmp_path / "ahead.yaml")]) == 2
    output = capsys.readouterr().err
    assert "--labels is for beams" in output and "no folder can be made there" in output and not out.exists()


def test_labels_of_elements_are_not_offered(tmp_path, capsys):
    """What `run --labels` refuses, `show --labels` does not advise: a recording of elements can have none."""
    text = WITH_TARGET.replace(
        "receive: {kind: line, length: 1.5 m}", "receive: {kind: line, length: 0.1 m, elements: 4}"
    )
    text = text.replace("sonar:\n", "sonar:\n  receiver: {record: elements}\n").replace("geometry: slice, ", "")
    text = text.replace("199 ms, 204 ms", "20 ms, 21 ms")
    (tmp_path / "a.yaml").write_text(text, encoding="utf-8")
    assert main(["run", str(tmp_path / "a.yaml"), "-o", str(tmp_path / "a.zarr")]) == 0
    assert main(["show", str(tmp_path / "a.zarr"), "--labels", "-o", str(tmp_path / "a.png")]) == 2
    output = capsys.readouterr().err
    assert "labels are those of beams" in output and "insonify run" not in output
