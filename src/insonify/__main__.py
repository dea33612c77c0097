"""`python -m insonify` is the command `insonify`."""

import sys

from insonify.cli import main

if __name__ == "__main__":
    sys.exit(main())
