"""The command line, called within this process: a test that needs no process of its own is spared its start."""

import sys
from contextlib import chdir, redirect_stderr, redirect_stdout
from io import StringIO
from subprocess import CompletedProcess
from unittest.mock import patch

from layoutopt.cli import main
from layoutopt.workers import Backend, Workers

# One process for all commands: most of the time of each is the start of Python and of the compiled kernels.
PROGRAM = """
import sys
from layoutopt.cli import main
for line in sys.stdin.read().splitlines():
    sys.argv = ["layoutopt", *line.split("|")]
    try:
        main()
    except SystemExit as ended:
        print("ENDED", ended.code, line)
"""
_begin = Workers.__init__


def _here(self, backend=Backend.SERIAL, **settings):
    _begin(self, Backend.SERIAL, **settings)


def called(*arguments, cwd):
    """Return what a process would: its exit code and what it printed; trials run in this process as well."""
    words = ["layoutopt", *map(str, arguments)]
    out, err, code = StringIO(), StringIO(), None
    replaced = patch.object(sys, "argv", words), patch.object(Workers, "__init__", _here)
    with chdir(cwd), redirect_stdout(out), redirect_stderr(err), replaced[0], replaced[1]:
        try:
            main()
        except SystemExit as ended:
            code = ended.code
    return CompletedProcess(words, code, out.getvalue(), err.getvalue())
