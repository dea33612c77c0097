"""Claims about the ruler that measures the code itself."""

from pathlib import Path

import pytest

import shape

WELL = '"""A module."""\n\n\ndef receive() -> int:\n    """A sound."""\n    return 1\n'


def _tree(root: Path, source: str, *, tests: str = "x = 1\n" * 2000) -> shape.Shape:
    (root / "src").mkdir()
    (root / "tests").mkdir()
    (root / "src" / "a.py").write_text(source)
    (root / "tests" / "test_a.py").write_text(tests)
    return shape.measure(root)


def _function(lines: int) -> str:
    return '"""A module."""\n\n\ndef receive() -> None:\n    """A sound."""\n' + "    pass\n" * (lines - 1)


def test_well_shaped_code_breaks_no_bar(tmp_path):
    """A short, documented, typed and tested file breaks no bar."""
    assert shape.broken(_tree(tmp_path, WELL)) == []


@pytest.mark.parametrize(
    ("source", "complaint"),
    [
        (WELL.replace('"""A module."""', "x = 1"), "module has no docstring"),
        (WELL.replace('    """A sound."""\n', ""), "receive has no docstring"),
        (WELL.replace(" -> int", ""), "receive has no return type"),
        (WELL + "\n\nclass Pulse:\n    x = 1\n", "Pulse has no docstring"),
        (
            WELL + '\n\nclass Pulse:\n    """One."""\n\n    def cut(self) -> int:\n        return 1\n',
            "cut has no docstring",
        ),
        (WELL + "\n\n@njit(cache=True)\ndef _bend(x: float) -> float:\n    return x\n", "_bend has no docstring"),
        (_function(101), "no function may pass 100"),
        (_function(46), "more than 10 % of functions pass 45 lines"),
        (_function(13), "the median function passes 12 lines"),
        (WELL + "x = 1\n" * 600, "no file may pass 600"),
        (WELL + "x = 1\n" * 400, "more than 10 % of files pass 400 lines"),
        (WELL + "x = 1\n" * 180, "the median file passes 180 lines"),
    ],
)
def test_each_bar_can_be_broken(tmp_path, source, complaint):
    """Every rule names the code that breaks it."""
    assert complaint in "\n".join(shape.broken(_tree(tmp_path, source)))


def test_too_few_tests_are_noticed(tmp_path):
    """Six source lines require at least five lines of tests."""
    assert shape.broken(_tree(tmp_path, WELL, tests="x = 1\n" * 4)) != []


@pytest.mark.parametrize(
    ("body", "idle"),
    [
        ("receive()", True),
        ("checked(receive())", True),
        ("assert receive()", False),
        ("assert_strong(receive())", False),
        ("np.testing.assert_allclose(receive(), 1)", False),
        ("with pytest.raises(ValueError):\n        receive()", False),
    ],
)
def test_a_test_that_asserts_nothing_is_noticed(tmp_path, body, idle):
    """An assertion stands in the test, or the name of what it calls states that it asserts."""
    project = _tree(tmp_path, WELL, tests=f"def test_a():\n    {body}\n" + "x = 1\n" * 20)
    assert project.undocumented == (["tests/test_a.py:1 test_a asserts nothing"] if idle else [])


def test_functions_with_many_parameters_are_counted(tmp_path):
    """Nine are too many for one function, self left out; the bar is on the number of such functions."""
    wide = "\n\ndef _f(self, a, b, c, d, e, f, g, h, *, {}) -> None:\n    pass\n"
    assert _tree(tmp_path, WELL + wide.format("i")).wide == ["src/a.py:9 _f (9)"]


def test_a_long_explanation_does_not_make_a_function_long(tmp_path):
    """A docstring of 50 lines weighs nothing."""
    source = WELL.replace('"""A sound."""', '"""A sound.' + "\n    more" * 50 + '\n    """')
    assert shape.broken(_tree(tmp_path, source)) == []


def test_private_functions_need_no_page_in_the_manual(tmp_path):
    """A name with an underscore needs neither docstring nor return type."""
    assert shape.broken(_tree(tmp_path, WELL + "\n\ndef _help():\n    return 1\n")) == []


def test_a_folder_that_is_no_package_is_noticed(tmp_path):
    """Without __init__.py the import contract would not see the folder."""
    (tmp_path / "src" / "ocean").mkdir(parents=True)
    (tmp_path / "src" / "ocean" / "water.py").write_text(WELL)
    assert "src/ocean has no __init__.py" in shape.measure(tmp_path).undocumented


def test_the_guide_states_the_bars():
    """CONTRIBUTING.md has the largest number of functions with many parameters, and how many these are."""
    guide = Path(__file__).parents[1] / "CONTRIBUTING.md"
    if not guide.is_file():
        pytest.skip("an installation, not a checkout")
    bar = f"no more than {shape.WIDE_FUNCTIONS} functions pass {shape.PARAMETERS} parameters"
    assert bar in guide.read_text(encoding="utf-8")
