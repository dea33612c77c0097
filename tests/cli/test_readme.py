"""Claims about the first page and the shell: what they state works, wherever one stands."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from typer.main import get_command

from insonify.cli import main
from insonify.cli.app import app

README = Path(__file__).parents[2] / "README.md"


@pytest.fixture
def blocks():
    """Python of the first page."""
    if not README.is_file():
        pytest.skip("no README here: an installation, not a checkout")
    return re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), flags=re.DOTALL)


def test_the_first_page_runs_in_an_empty_folder(tmp_path, monkeypatch, capsys, blocks):
    """After the command that it names, and with no file of the repository; on a short window."""
    monkeypatch.chdir(tmp_path)
    assert "`insonify new nominal`" in README.read_text(encoding="utf-8")
    assert main(["new", "nominal"]) == 0
    path = Path("nominal.yaml")
    path.write_text(path.read_text().replace("window: [0 ms, 240 ms]", "window: [199 ms, 204 ms]"))
    names: dict[str, object] = {}
    exec(blocks[0], names)
    assert Path("nominal.nc").is_file() and names["calmer"].surface.wind_speed == 2  # type: ignore[attr-defined]
    assert "Arrivals" in capsys.readouterr().out


def test_the_nominal_scene_is_a_demonstration(tmp_path, capsys):
    """Scenario, recording, picture, and the box where it was put."""
    assert main(["demo", "nominal", "-o", str(tmp_path)]) == 0
    output = capsys.readouterr().out
    assert "holds" in output and "FAILS" not in output
    for suffix in (".yaml", ".zarr", ".png", ".json"):
        assert (tmp_path / f"nominal{suffix}").exists()


def test_the_shell_completes_commands():
    """Completion as bash requests it."""
    variables = {"_INSONIFY_COMPLETE": "complete_bash", "COMP_WORDS": "insonify expl", "COMP_CWORD": "1"}
    completed = subprocess.run(
        [sys.executable, "-m", "insonify"], env=os.environ | variables, capture_output=True, text=True, check=False
    )
    assert completed.stdout.split() == ["explain"]


def test_completion_can_be_installed_and_help_loads_nothing_for_it(capsys):
    """The option is there, and --help imports no numerical package."""
    assert main(["--help"]) == 0
    assert "--install-completion" in capsys.readouterr().out
    heavy = "{'numpy', 'numba', 'rich'}"
    code = f"import sys; from insonify.cli import main; main(['--help']); print({heavy} & set(sys.modules))"
    completed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert completed.stdout.splitlines()[-1] == "set()"


def test_the_table_of_the_first_page_has_every_command():
    """Rows of the table are the commands of the help, and no others."""
    if not README.is_file():
        pytest.skip("no README here: an installation, not a checkout")
    rows = re.findall(r"^\| `insonify ([a-z-]+)", README.read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert sorted(rows) == sorted(get_command(app).commands)  # type: ignore[attr-defined]
