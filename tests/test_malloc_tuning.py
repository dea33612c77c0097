"""Claims about memory that is freed: pings find it where the last ones left it, other C libraries are left alone."""

import ctypes
import platform
import subprocess
import sys

import pytest

from insonify import malloc_tuning
from insonify.malloc_tuning import MMAP_THRESHOLD_BYTES, TRIM_THRESHOLD_BYTES, keep_freed_memory

GLIBC = sys.platform == "linux" and platform.libc_ver()[0] == "glibc"
PROGRAM = """
import resource, sys
import numpy as np
from insonify.malloc_tuning import keep_freed_memory

def ping():
    return len([np.ones(size // 8) for size in (1 << 18, 1 << 20, 3 << 20, 8 << 20) * 10])

def faults():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    ping()
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before

if sys.argv[1] == "kept":
    assert keep_freed_memory()
for _ in range(3):
    ping()
print(min(faults() for _ in range(3)))
"""


@pytest.fixture
def anew():
    """The C library is called anew, and once more by the next caller."""
    keep_freed_memory.cache_clear()
    yield
    keep_freed_memory.cache_clear()


def page_faults(how):
    """Pages that the fourth ping of a program of its own has the system fill with zeros."""
    done = subprocess.run([sys.executable, "-c", PROGRAM, how], capture_output=True, text=True, check=True)
    return int(done.stdout)


@pytest.mark.skipif(not GLIBC, reason="the C library is another")
def test_arrays_of_a_ping_cause_hardly_a_page_fault():
    """120 MB in arrays, made and freed again: under 100 faults where the library's own way takes thousands."""
    kept, given_back = page_faults("kept"), page_faults("given back")
    assert kept < 100 and given_back > 1000


@pytest.mark.skipif(not GLIBC, reason="the C library is another")
def test_glibc_takes_both_requests(anew):
    """Called twice it is True twice, and set but once."""
    assert keep_freed_memory() and keep_freed_memory()
    assert keep_freed_memory.cache_info().misses == 1


@pytest.mark.parametrize("system", ["darwin", "win32"])
def test_other_systems_are_left_as_they_are(monkeypatch, anew, system):
    """No library is even opened there."""
    monkeypatch.setattr(sys, "platform", system)
    monkeypatch.setattr(ctypes, "CDLL", lambda *_: pytest.fail("a C library was called"))
    assert keep_freed_memory() is False


def test_a_library_without_the_question_is_left_as_it_is(monkeypatch, anew):
    """On Linux musl has no mallopt: no error, and no memory kept."""
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(malloc_tuning.ctypes, "CDLL", lambda *_: object())
    assert keep_freed_memory() is False


@pytest.mark.parametrize("refused", [0, 1])
def test_a_request_that_is_refused_is_reported(monkeypatch, anew, refused):
    """Either of the two: False, whatever the other gives."""
    requests = []

    class Library:
        @staticmethod
        def mallopt(which, size):
            requests.append((which, size))
            return int(len(requests) - 1 != refused)

    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(malloc_tuning.ctypes, "CDLL", lambda *_: Library)
    assert keep_freed_memory() is False
    assert set(requests) <= {(-3, MMAP_THRESHOLD_BYTES), (-1, TRIM_THRESHOLD_BYTES)} and requests[0] == (
        -3,
        MMAP_THRESHOLD_BYTES,
    )
