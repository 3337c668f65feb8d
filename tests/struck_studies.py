"""What a study survives: every fault here strikes a study that runs for real, and none may cost a finished task.

Afterwards the study, gone on with if it ended, has the same bytes in every table as one that nothing disturbed.
Its journal still begins with every line that it held when the fault struck.
"""

import contextlib
import io
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from small_studies import TABLES

from layoutopt.cli import main
from layoutopt.journal import JOURNAL
from studies import output

SPEC = """
schema = 1
seed = 3
[site]
floor = [[0,0],[3,0],[3,2],[0,2]]
[robots]
count = 2
outline = [["-0.2 m","-0.2 m"],["0.2 m","-0.2 m"],["0.2 m","0.2 m"],["-0.2 m","0.2 m"]]
[space]
antenna_side = ["50 mm", "60 mm"]
antenna_height = "20 mm"
antennas_per_module = 4
readers = [{ family = "ring", count = 4, radius = "0.15 m" }]
patterns = [{ family = "square", pitch = { from = "150 mm", to = "300 mm", steps = 4 } }]
[goal]
target_error = "60 mm"
[study]
search_trials = 40
validation_trials = 20
duration = "4 s"
particles = 50
validate_with = ["midrange", "odometry"]
"""
"""Eight layouts, of which three are on the front: three rounds of 8, 12 and 16 tasks."""
STUDY = ("study", "cost_vs_accuracy", "spec.toml", "--out", "out")
INTERRUPTED = 130
NEEDS_PROC = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes in /proc")


class Running:
    """A command that runs in a session of its own, with its output in files; ends with the test at the latest."""

    def __init__(self, home, arguments, environment, *, before=None):
        self.home = home
        with (home / "stdout.txt").open("wb") as out, (home / "stderr.txt").open("wb") as err:
            self.process = subprocess.Popen(
                [str(argument) for argument in arguments],
                cwd=home,
                env=environment,
                stdout=out,
                stderr=err,
                start_new_session=True,
                preexec_fn=before,
            )

    @property
    def told(self):
        return (self.home / "stderr.txt").read_text(encoding="utf-8")

    def wait_until(self, holds, *, within_s=120.0):
        """Wait until something holds while the command runs."""
        end = time.monotonic() + within_s
        while not holds():
            assert self.process.poll() is None, f"ended with {self.process.returncode}: {self.told}"
            assert time.monotonic() < end, self.told
            time.sleep(0.01)

    def wait_for_tasks(self, count):
        """Wait until the journal holds so many tasks, and return what it holds then."""
        self.wait_until(lambda: len(tasks(self.home)) >= count)
        return journal(self.home)

    def ended(self, *, within_s=120.0):
        """Return the exit code."""
        return self.process.wait(timeout=within_s)

    def processes(self):
        """Return the living processes of the session: the command and whatever it started."""
        return [
            number
            for number, (state, session) in _processes().items()
            if session == self.process.pid and state != "Z"
        ]

    def workers(self):
        """Return the living worker processes."""
        return [number for number in self.processes() if "LokyProcess" in _command_line(number)]

    def are_gone(self, *, within_s=12.0):
        """Return whether no process of the session is left after a while."""
        end = time.monotonic() + within_s
        while self.processes() and time.monotonic() < end:
            time.sleep(0.05)
        return not self.processes()

    def end_at_once(self):
        for number in self.processes():
            with contextlib.suppress(ProcessLookupError):
                os.kill(number, signal.SIGKILL)
        self.process.wait()


def _processes():
    """Return state and session of every process by number."""
    found = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            fields = path.read_text().rpartition(")")[2].split()
            found[int(path.parent.name)] = (fields[0], int(fields[3]))
    return found


def _command_line(number):
    try:
        return Path(f"/proc/{number}/cmdline").read_text()
    except OSError:
        return ""


def journal(home):
    """Return the whole lines of the journal."""
    path = home / "out" / JOURNAL
    content = path.read_bytes() if path.exists() else b""
    return content[: content.rfind(b"\n") + 1]


def tasks(home):
    """Return the records of finished tasks in the journal."""
    records = [json.loads(line) for line in journal(home).splitlines()]
    return [record for record in records if "key" in record]


def here(home, *arguments):
    """Run the command in this process, without drawings and report, and return exit code, output and errors."""
    out, err = io.StringIO(), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        patch.chdir(home)
        patch.setattr(sys, "argv", ["layoutopt", *map(str, arguments)])
        patch.setattr(output, "write_overview", lambda *_, **__: [])
        patch.setattr(output, "write_report", lambda *_, **__: None)
        with pytest.raises(SystemExit) as ended:
            main()
    return ended.value.code or 0, out.getvalue(), err.getvalue()


def gone_on_with(home):
    """Go on with the study in this process, and return what was told."""
    code, _, told = here(home, *STUDY, "--backend", "serial", "--resume")
    assert code == 0, told
    return told


def nothing_is_lost(home, undisturbed, before, *, more=False):
    """Check tables and journal against those of the undisturbed study and what the journal held before.

    There may be ``more`` tasks where layouts failed at first: the race gave their trials to others meanwhile,
    which the tables do not count.
    """
    after = (home / "out" / JOURNAL).read_bytes()
    assert after.endswith(b"\n")
    assert after.startswith(before)
    keys = [record["key"] for record in tasks(home) if "failure" not in record]
    assert len(set(keys)) == len(keys), "a task was run twice"
    wanted = sorted(record["key"] for record in tasks(undisturbed))
    assert set(keys) >= set(wanted) if more else sorted(keys) == wanted
    for name in TABLES:
        assert (home / "out" / name).read_bytes() == (undisturbed / "out" / name).read_bytes(), name
    assert not list((home / "out").rglob("*.part"))


def is_one_message(told, *words):
    """Check that an error is one line with certain words, and no traceback."""
    lines = told.strip().splitlines()
    assert "Traceback" not in told
    assert len(lines) == 1, told
    assert all(word in told for word in words), told


def new_seed():
    """Return a new seed and print it; a failure can be had again by setting the variable."""
    seed = int(os.environ.get("LAYOUTOPT_TEST_SEED", time.time_ns() % 10**9))
    print(f"LAYOUTOPT_TEST_SEED={seed}")
    return seed
