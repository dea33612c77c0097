"""A warning stands at the line of the program that called the library."""

import inspect
import warnings
from concurrent.futures import ThreadPoolExecutor

import pytest

import insonify
from insonify.caller_warning import warn_caller
from insonify.ocean import absorption_db_per_m
from insonify.scenario.write import to_yaml
from insonify.scene import Box
from oracles.scenes import nominal

FAR = {"temperature": 30}


def test_warnings_stand_at_the_line_of_the_caller(tmp_path):
    """Of a law, a model, a scenario, a change, a file: this file and the line of the call, not the library's."""
    base = nominal()
    (tmp_path / "warm.yaml").write_text(to_yaml(base).replace("temperature: 10.0", "temperature: 30.0"))
    calls = {
        "law": lambda: absorption_db_per_m(100e3, temperature=30),
        "model": lambda: Box(position=(0, 50), size=(1, 1, 1), heading=5),
        "scenario": lambda: insonify.Scenario(sonar=base.sonar, track=base.track, water=FAR),
        "change": lambda: base.with_("water.temperature", 30),
        "file": lambda: insonify.load_scenario(tmp_path / "warm.yaml"),
    }
    for name, call in calls.items():
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            call()
        assert caught, name
        line = inspect.getsourcelines(call)[1]
        assert {(one.filename, one.lineno) for one in caught} == {(__file__, line)}, name


def test_a_thread_that_no_program_called_warns_where_it_stands():
    """No line of the standard library is blamed."""
    names = {"__name__": "insonify.somewhere", "warn_caller": warn_caller}
    exec(compile("def task():\n    warn_caller('deep')\n", "somewhere.py", "exec"), names)
    with pytest.warns(UserWarning, match="deep") as caught, ThreadPoolExecutor(1) as pool:
        pool.submit(names["task"]).result()
    assert [(one.filename, one.lineno) for one in caught] == [("somewhere.py", 2)]
