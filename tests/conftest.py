"""How every test is run."""

from hypothesis import settings

# The first call of a kernel compiles it, which no deadline can know; the same examples every time, so that
# a failure on one machine is a failure on all.
settings.register_profile("insonify", deadline=None, derandomize=True)
settings.load_profile("insonify")
