"""How every test is run."""

import gc
import os
from collections.abc import Callable, Iterator

import pytest
from hypothesis import settings

# Tests run side by side, a process on each core: the threads of the linear algebra would wait for each other, at full
# power. Set before NumPy is imported, for the processes that tests start as well.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# For the same reason each process compiles its kernels itself.
os.environ.setdefault("INSONIFY_COMPILE_PROCESSES", "0")

# The first call of a kernel compiles it, which no deadline can know; the same examples every time, so that
# a failure on one machine is a failure on all. `--hypothesis-profile many` tries twice as many as `make test`.
settings.register_profile("insonify", deadline=None, derandomize=True, max_examples=50)
settings.register_profile("many", deadline=None, derandomize=True, max_examples=100)
settings.load_profile("insonify")

gc.disable()  # while tests are collected: next to nothing that is made there is garbage


def pytest_collection_finish() -> None:
    """Leave the collected tests and all modules out of garbage collection: a pass over them takes 0.2 s."""
    gc.freeze()
    gc.enable()


@pytest.fixture(scope="session", autouse=True)
def print_progress() -> Iterator[Callable[..., None]]:
    """The printer of the compiler's progress, silent: the first test to need a kernel depends on their order."""
    from insonify.cli.compile_progress import Progress

    with pytest.MonkeyPatch.context() as patched:
        printer = Progress._print
        patched.setattr(Progress, "_print", lambda *_: None)
        yield printer


@pytest.fixture(scope="module", autouse=True)
def layout_of_pictures_alone(request: pytest.FixtureRequest) -> Iterator[None]:
    """Leave out the layout of figures, half of the time that they take, where no test is about pictures."""
    if {"plotting", "paper", "demos"} & set(request.path.parts):
        yield
        return
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(ConstrainedLayoutEngine, "execute", lambda *_: None)
        yield
