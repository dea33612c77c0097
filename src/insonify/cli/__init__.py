"""The command line: files in, files out, and exit codes that scripts can trust.

0 done, 1 the run failed, 2 the input is wrong. Results go to stdout, everything else to
stderr. Nothing heavy is imported before a command needs it, so that --help is instant.
"""

from insonify.cli.app import main

__all__ = ["main"]
