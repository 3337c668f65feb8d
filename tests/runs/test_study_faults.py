"""What a study survives: every fault here strikes a study that runs for real, and none may cost a finished task.

Afterwards the study, gone on with if it ended, has the same bytes in every table as one that nothing disturbed.
Its journal still begins with every line that it held when the fault struck.
"""

import contextlib
import csv
import fcntl
import io
import json
import os
import random
import resource
import shlex
import shutil
import signal
import subprocess
import sys
import termios
import threading
import time
from pathlib import Path

import fault_hooks
import pytest
from small_studies import TABLES

from layoutopt.cli import main
from layoutopt.journal import JOURNAL, MANIFEST
from layoutopt.spec.reading import read_spec
from studies import output
from studies.status import STATUS

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes in /proc")

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
_SEARCH_TASKS = 8
_FRONT_TASKS = 12


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
        self.wait_until(lambda: len(_tasks(self.home)) >= count)
        return _journal(self.home)

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


def _journal(home):
    """Return the whole lines of the journal."""
    path = home / "out" / JOURNAL
    content = path.read_bytes() if path.exists() else b""
    return content[: content.rfind(b"\n") + 1]


def _tasks(home):
    """Return the records of finished tasks in the journal."""
    records = [json.loads(line) for line in _journal(home).splitlines()]
    return [record for record in records if "key" in record]


def _here(home, *arguments):
    """Run the command in this process, without drawings and report, and return exit code, output and errors."""
    out, err = io.StringIO(), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        patch.chdir(home)
        patch.setattr(sys, "argv", ["layoutopt", *map(str, arguments)])
        patch.setattr(output, "write_drawings", lambda *_, **__: [])
        patch.setattr(output, "write_report", lambda *_, **__: None)
        with pytest.raises(SystemExit) as ended:
            main()
    return ended.value.code or 0, out.getvalue(), err.getvalue()


def _gone_on_with(home):
    """Go on with the study in this process, and return what was told."""
    code, _, told = _here(home, *STUDY, "--backend", "serial", "--resume")
    assert code == 0, told
    return told


def _nothing_is_lost(home, undisturbed, before, *, more=False):
    """Check tables and journal against those of the undisturbed study and what the journal held before.

    There may be ``more`` tasks where layouts failed at first: the race gave their trials to others meanwhile,
    which the tables do not count.
    """
    after = (home / "out" / JOURNAL).read_bytes()
    assert after.endswith(b"\n")
    assert after.startswith(before)
    keys = [record["key"] for record in _tasks(home) if "failure" not in record]
    assert len(set(keys)) == len(keys), "a task was run twice"
    wanted = sorted(record["key"] for record in _tasks(undisturbed))
    assert set(keys) >= set(wanted) if more else sorted(keys) == wanted
    for name in TABLES:
        assert (home / "out" / name).read_bytes() == (undisturbed / "out" / name).read_bytes(), name
    assert not list((home / "out").rglob("*.part"))


def _is_one_message(told, *words):
    """Check that an error is one line with certain words, and no traceback."""
    lines = told.strip().splitlines()
    assert "Traceback" not in told
    assert len(lines) == 1, told
    assert all(word in told for word in words), told


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """A folder with the spec and a finished study in ``out`` that nothing disturbed."""
    home = tmp_path_factory.mktemp("undisturbed")
    (home / "spec.toml").write_text(SPEC, encoding="utf-8")
    code, _, told = _here(home, *STUDY, "--backend", "serial")
    assert code == 0, told
    return home


@pytest.fixture
def home(tmp_path):
    """A folder with the spec, for a study to be disturbed."""
    (tmp_path / "spec.toml").write_text(SPEC, encoding="utf-8")
    return tmp_path


@pytest.fixture
def start(home):
    """Start the study with faults, by options of the command line; whatever still runs after the test is ended."""
    started = []

    def start(*options, through=(), before=None, changed=None, **faults):
        environment = {**fault_hooks.environment(home / "hooks", **faults), **(changed or {})}
        arguments = [*through, sys.executable, "-m", "layoutopt", *STUDY, *options]
        started.append(Running(home, arguments, environment, before=before))
        return started[-1]

    yield start
    for running in started:
        running.end_at_once()


@pytest.fixture(scope="module")
def layout_keys(undisturbed):
    """The keys of all layouts of the spec, those off the front first."""
    keys = [layout.key for layout in read_spec(undisturbed / "spec.toml").problem().space.layouts()]
    with (undisturbed / "out/front.csv").open(encoding="utf-8", newline="") as file:
        front = {row["layout"] for row in csv.DictReader(file)}
    return sorted(keys, key=lambda key: (key[:10] in front, key))


def test_after_a_kill_the_study_goes_on_where_it_was(start, home, undisturbed):
    """Killed without warning, a study frees its folder and leaves no process, and what it had finished counts."""
    running = start("--jobs", 2, pause_s=0.1)
    before = running.wait_for_tasks(10)
    running.process.kill()
    running.ended()
    _, said, _ = _here(home, "status", "out")
    assert "ended without a word" in said
    assert "go on with: layoutopt study cost_vs_accuracy spec.toml --out out --jobs 2 --resume" in said
    _gone_on_with(home)
    _nothing_is_lost(home, undisturbed, before)
    assert running.are_gone()


def test_a_killed_worker_costs_nothing(start, home, undisturbed):
    """The study goes on with new workers, without help, and says so."""
    running = start("--jobs", 2, pause_s=0.1)
    before = running.wait_for_tasks(5)
    killed = running.workers()[0]
    os.kill(killed, signal.SIGKILL)
    assert running.ended() == 0, running.told
    assert "note: a worker process died: what was under way is run again" in running.told
    assert "Traceback" not in running.told
    _nothing_is_lost(home, undisturbed, before)
    assert running.are_gone()


MISBEHAVIOUR = {
    "raises": ("raised an error", "RuntimeError: a wheel came off (in _raises, line "),
    "gives_no_number": ("gave no number", "gave no pose in step 7 of replication 0"),
    "finds_no_memory": ("out of memory", "MemoryError"),
    "is_killed": ("killed its worker", "killed two workers"),
    "sleeps": ("never ended", "took longer than 5 s, twice"),
    "waits_in_compiled_code": ("never ended", "took longer than 5 s, twice"),
    "spins_in_compiled_code": ("never ended", "took longer than 5 s, twice"),
}


def _misbehaves(start, home, undisturbed, layout_keys, ways):
    """Check a study in which the estimator misbehaves for a layout in each of the ways, and its going on."""
    misbehave = dict(zip(layout_keys, ways, strict=False))
    assert len(misbehave) == len(ways)
    running = start("--jobs", 2, "--longest-task", "5 s", misbehave=misbehave)
    assert running.ended() == 0, running.told
    before = _journal(home)
    with (home / "out/designs.csv").open(encoding="utf-8", newline="") as file:
        refusals = {row["layout"]: row["refusal"] for row in csv.DictReader(file)}
    failures = {record["group"][0]: record for record in _tasks(home) if "failure" in record}
    _, said, _ = _here(home, "status", "out")
    for key in layout_keys:
        if key not in misbehave:
            assert refusals[key[:10]] == ""
            continue
        kind, reason = MISBEHAVIOUR[misbehave[key]]
        assert refusals[key[:10]].startswith("failed: ")
        assert reason in refusals[key[:10]]
        assert f"failed: layout {key[:10]} {kind}: " in running.told
        assert failures[key]["kind"] == kind
        assert f"{sum(MISBEHAVIOUR[way][0] == kind for way in ways)} {kind}" in said
    assert set(failures) == set(misbehave)
    assert running.are_gone()
    _gone_on_with(home)
    _nothing_is_lost(home, undisturbed, before, more=True)
    _, said, _ = _here(home, "status", "out")
    assert "failed" not in said


def test_one_bad_layout_of_each_kind_fails_alone(start, home, undisturbed, layout_keys):
    """An estimator that raises, gives no number, finds no memory, is killed or hangs fails for that layout only.

    The layout is marked with kind and reason in table, progress and status, and tried again on going on.
    """
    ways = ["raises", "gives_no_number", "finds_no_memory", "is_killed", "waits_in_compiled_code"]
    _misbehaves(start, home, undisturbed, layout_keys, ways)


@pytest.mark.long
@pytest.mark.parametrize("way", MISBEHAVIOUR)
def test_each_kind_of_bad_layout_fails_alone(start, home, undisturbed, layout_keys, way):
    """Each way of misbehaving alone, so that no other hides it."""
    _misbehaves(start, home, undisturbed, layout_keys, [way])


def test_a_full_disk_ends_the_study_with_whole_lines(start, home, undisturbed):
    """Where a file may grow no further, the study ends with one message, and goes on once there is room."""
    most = 100_000
    running = start(
        "--jobs", 1, before=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (most, resource.RLIM_INFINITY))
    )
    assert running.ended() == 3, running.told
    _tells_of_a_full_disk(running)
    content = (home / "out" / JOURNAL).read_bytes()
    assert content.endswith(b"\n")
    assert most - 20_000 < len(content) <= most
    assert running.are_gone()
    _gone_on_with(home)
    _nothing_is_lost(home, undisturbed, content)


def _tells_of_a_full_disk(running):
    """Check that the last words are what cannot be written and how to go on, each said once."""
    assert "Traceback" not in running.told
    assert "Warning" not in running.told
    *_, message, go_on = running.told.splitlines()
    assert message.startswith(f"out/{JOURNAL}: cannot be written (")
    assert message.endswith("); what it holds is whole")
    assert go_on.startswith("go on with: layoutopt study ")
    assert running.told.count("cannot be written") == 1


ON_A_SMALL_DISK = """
set -e
mkdir out
mount -t tmpfs -o size={size} none out
if [ -d seed ]; then cp seed/* out; fi
code=0
"$@" || code=$?
cp -r out kept
if [ {room} = yes ]; then
    mount -o remount,size=100m none out
    "$@" --resume
    cp -r out after
fi
exit $code
"""


def _on_a_small_disk(home, size, *, room="no"):
    """Return what a command runs through to have ``out`` on a small file system of its own."""
    for options in (["-m"], ["-Urm"]):
        try:
            tried = subprocess.run(
                ["unshare", *options, "mount", "-t", "tmpfs", "-o", "size=1m", "none", str(home)],
                capture_output=True,
                check=False,
            )
        except OSError:
            break
        if tried.returncode == 0:
            return ("unshare", *options, "sh", "-c", ON_A_SMALL_DISK.format(size=size, room=room), "sh")
    pytest.skip("no file system of one's own may be mounted here")


@pytest.mark.long
def test_a_small_file_system_that_fills_up_loses_nothing(start, home, undisturbed):
    """On a file system without room the study ends with one message and whole lines, and goes on elsewhere."""
    running = start("--backend", "serial", through=_on_a_small_disk(home, "100k"))
    assert running.ended() == 3, running.told
    _tells_of_a_full_disk(running)
    (home / "out").rmdir()
    (home / "kept").rename(home / "out")
    content = (home / "out" / JOURNAL).read_bytes()
    assert content.endswith(b"\n")
    assert 40_000 < len(content) < 100_000
    _gone_on_with(home)
    _nothing_is_lost(home, undisturbed, content)


@pytest.mark.long
def test_a_file_system_with_room_made_goes_on(start, home, undisturbed):
    """The same with workers, and gone on with in place after room was made."""
    running = start("--jobs", 2, through=_on_a_small_disk(home, "100k", room="yes"))
    assert running.ended() == 3, running.told
    assert "Traceback" not in running.told
    content = (home / "kept" / JOURNAL).read_bytes()
    assert content.endswith(b"\n")
    (home / "out").rmdir()
    (home / "after").rename(home / "out")
    _nothing_is_lost(home, undisturbed, content)


def test_a_disk_that_fills_up_while_tables_are_written_leaves_no_half_table(start, home, undisturbed):
    """Each table is there whole or not at all, and going on writes them all."""
    (home / "out").mkdir()
    for name in (JOURNAL, MANIFEST):
        shutil.copy(undisturbed / "out" / name, home / "out" / name)
    before = _journal(home)
    sizes = {name: (undisturbed / "out" / name).stat().st_size for name in TABLES}
    most = sizes.pop("screening.csv") - 1
    assert max(sizes.values()) <= most
    running = start(
        "--backend",
        "serial",
        "--resume",
        before=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (most, resource.RLIM_INFINITY)),
    )
    assert running.ended() == 3, running.told
    assert "Traceback" not in running.told
    assert "out/screening.csv" in running.told
    assert "File too large" in running.told
    _has_only_whole_tables(home / "out", undisturbed / "out")
    assert (home / "out/designs.csv").exists()
    assert not (home / "out/screening.csv").exists()
    _gone_on_with(home)
    _nothing_is_lost(home, undisturbed, before)


def _has_only_whole_tables(folder, whole):
    """Check that every file of a folder is as it is in a whole one."""
    assert not list(folder.rglob("*.part"))
    for path in folder.rglob("*"):
        if path.is_file() and path.name not in (MANIFEST, STATUS, ".lock"):
            assert path.read_bytes() == (whole / path.relative_to(folder)).read_bytes(), path


@pytest.mark.long
@pytest.mark.timeout(900)
def test_a_file_system_that_fills_up_anywhere_leaves_no_half_file(start, home, undisturbed):
    """Whatever is written when the room ends, drawings and report included, no file is left half-written."""
    whole = home / "whole"
    shutil.copytree(undisturbed, whole)
    environment = fault_hooks.environment(home / "hooks", drawings=True)
    subprocess.run(
        [sys.executable, "-m", "layoutopt", *STUDY, "--resume"],
        cwd=whole,
        env=environment,
        check=True,
        capture_output=True,
    )
    (home / "seed").mkdir()
    for name in (JOURNAL, MANIFEST):
        shutil.copy(undisturbed / "out" / name, home / "seed" / name)
    for more_kb in (8, 16, 30, 50, 90, 150, 300, 600):
        size = (home / "seed" / JOURNAL).stat().st_size + 8192 + 1024 * more_kb
        running = start("--backend", "serial", "--resume", through=_on_a_small_disk(home, size), drawings=True)
        assert running.ended() == 3, running.told
        assert "Traceback" not in running.told
        _has_only_whole_tables(home / "kept", whole / "out")
        shutil.rmtree(home / "kept")
        (home / "out").rmdir()


def _without_override():
    """Return what a command runs through so that the permissions of files count for it."""
    if os.geteuid() != 0:
        return ()
    caps = "-dac_override,-dac_read_search"
    through = ("setpriv", f"--bounding-set={caps}", f"--inh-caps={caps}")
    try:
        subprocess.run([*through, "true"], capture_output=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("permissions of files count for nothing here")
    return through


@pytest.mark.parametrize("what", ["folder", pytest.param("parent", marks=pytest.mark.long)])
def test_a_read_only_folder_is_refused_in_one_line(start, home, undisturbed, what):
    """A folder that may not be written to ends the command before any work, and nothing in it changes."""
    if what == "folder":
        shutil.copytree(undisturbed / "out", home / "out")
        (home / "out").chmod(0o555)
    else:
        (home / "hooks").mkdir()
        for name in ("stdout.txt", "stderr.txt", "hooks/sitecustomize.py"):
            (home / name).touch()
        home.chmod(0o555)
    before = {path: path.read_bytes() for path in (home / "out").rglob("*") if path.is_file()}
    running = start("--backend", "serial", "--resume", through=_without_override())
    assert running.ended() == 2, running.told
    _is_one_message(running.told, "out/spec.toml: " if what == "folder" else "out: ", "Permission denied")
    home.chmod(0o755)
    after = {path: path.read_bytes() for path in (home / "out").rglob("*") if path.is_file()}
    assert after == before


@pytest.mark.parametrize(
    "tail",
    [
        pytest.param(b'{"key":"b8ed10151e6b', id="cut line", marks=pytest.mark.long),
        pytest.param('{"key":"b8","failure":"Fehler: zu groß'.encode()[:-1], id="cut sign"),
        pytest.param(bytes(4096), id="zeros", marks=pytest.mark.long),
        pytest.param(b'{"key":"b8' + bytes(4086) + b'"}\n', id="zeros within"),
    ],
)
def test_a_torn_end_is_dropped_and_run_again(home, undisturbed, tail):
    """Half a line, half a letter, or the zeros that a power failure leaves cost the last task and no other."""
    shutil.copytree(undisturbed / "out", home / "out")
    lines = _journal(undisturbed).splitlines(keepends=True)
    before = b"".join(lines[:20])
    (home / "out" / JOURNAL).write_bytes(before + tail)
    told = _gone_on_with(home)
    assert "run again" in told
    _nothing_is_lost(home, undisturbed, before)


@pytest.mark.long
def test_a_journal_cut_anywhere_goes_on(home, undisturbed):
    """Cut at twenty places at random, a study goes on to the same bytes."""
    whole = _journal(undisturbed)
    shutil.copytree(undisturbed / "out", home / "out")
    dice = random.Random(_seed())
    for _ in range(20):
        content = whole[: dice.randrange(len(whole))]
        (home / "out" / JOURNAL).write_bytes(content)
        for name in TABLES:
            (home / "out" / name).unlink()
        _gone_on_with(home)
        _nothing_is_lost(home, undisturbed, content[: content.rfind(b"\n") + 1])


def _seed():
    """Return a new seed and print it; a failure can be had again by setting the variable."""
    seed = int(os.environ.get("LAYOUTOPT_TEST_SEED", time.time_ns() % 10**9))
    print(f"LAYOUTOPT_TEST_SEED={seed}")
    return seed


def test_a_second_run_on_the_folder_is_refused(start, home, undisturbed):
    """The second one is told so at once, with or without --resume, and the first one takes no harm."""
    running = start("--backend", "serial", pause_s=0.05)
    before = running.wait_for_tasks(3)
    code, _, told = _here(home, *STUDY, "--backend", "serial", "--resume")
    assert code == 2
    _is_one_message(told, "another run is writing to this folder")
    code, _, told = _here(home, *STUDY, "--backend", "serial")
    assert code == 2
    _is_one_message(told, "holds a study already")
    _, said, _ = _here(home, "status", "out")
    assert "running" in said
    assert running.ended() == 0, running.told
    _nothing_is_lost(home, undisturbed, before)


JUMPING_CLOCK = """
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdatomic.h>
#include <sys/time.h>
#include <time.h>

static long jump_s(void)
{
    static atomic_uint calls;
    long days = atomic_fetch_add(&calls, 1) % 5000;
    return 86400L * (days % 2 ? days : -days);
}

int clock_gettime(clockid_t clock, struct timespec *now)
{
    static int (*real)(clockid_t, struct timespec *);
    if (!real)
        real = dlsym(RTLD_NEXT, "clock_gettime");
    int result = real(clock, now);
    if (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE)
        now->tv_sec += jump_s();
    return result;
}

int gettimeofday(struct timeval *restrict now, void *restrict zone)
{
    struct timespec precise;
    clock_gettime(CLOCK_REALTIME, &precise);
    now->tv_sec = precise.tv_sec;
    now->tv_usec = precise.tv_nsec / 1000;
    return 0;
}

time_t time(time_t *now)
{
    struct timespec precise;
    clock_gettime(CLOCK_REALTIME, &precise);
    if (now)
        *now = precise.tv_sec;
    return precise.tv_sec;
}
"""


@pytest.fixture
def jumping_clock(tmp_path):
    """The environment in which every look at the clock finds another day."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler")
    (tmp_path / "clock.c").write_text(JUMPING_CLOCK, encoding="utf-8")
    library = tmp_path / "clock.so"
    subprocess.run([compiler, "-O1", "-shared", "-fPIC", "-o", library, tmp_path / "clock.c", "-ldl"], check=True)
    changed = {"LD_PRELOAD": str(library)}
    looks = "import time; print(*(time.time() for _ in range(9)))"
    shown = subprocess.run(
        [sys.executable, "-c", looks], env={**os.environ, **changed}, capture_output=True, text=True, check=True
    )
    times = [float(value) for value in shown.stdout.split()]
    assert max(times) - min(times) > 10 * 86400
    return changed


@pytest.mark.parametrize("options", [("--backend", "serial"), pytest.param(("--jobs", 2), marks=pytest.mark.long)])
def test_a_clock_that_jumps_changes_nothing(start, home, undisturbed, jumping_clock, options):
    """With a clock that is off by days at every look, back and forth, bytes are the same and status is sane."""
    running = start(*options, "--time-limit", "1 h", pause_s=0.05, changed=jumping_clock)
    before = running.wait_for_tasks(5)
    assert running.ended() == 0, running.told
    _nothing_is_lost(home, undisturbed, before)
    status = json.loads((home / "out" / STATUS).read_text(encoding="utf-8"))
    assert status["state"] == "finished"
    assert 1.0 < status["trials_per_s"] < 1e5
    assert 0.0 <= status["left_s"] < 60.0
    code, said, _ = _here(home, "status", "out")
    assert code == 0
    assert "finished" in said
    assert running.are_gone()


def _interrupted(start, home, undisturbed, number, options, *, group):
    """Check that a signal ends a study after what was under way; return what goes on with it, and the journal."""
    begun = home / "begun.txt"
    # With tasks of that length each goes out alone, so that most of a round is not under way.
    running = start(*options, pause_s=0.6, begun=begun)
    running.wait_for_tasks(_SEARCH_TASKS + 1)
    before = _journal(home)
    (os.killpg if group else os.kill)(running.process.pid, number)
    assert running.ended() == INTERRUPTED, running.told
    assert running.are_gone()
    assert "Traceback" not in running.told
    assert running.told.count("stopping: what is under way is finished and written") == 1
    assert "\nstopped as asked; what was finished is kept\ngo on with: " in running.told
    go_on = next(line for line in running.told.splitlines() if line.startswith("go on with: "))
    after = _journal(home)
    assert after.startswith(before)
    known = {f"{' '.join(record['group'][:3])} {record['first']}" for record in _tasks(home)}
    assert set(begun.read_text().splitlines()) == known
    assert len(known) < _SEARCH_TASKS + _FRONT_TASKS, "the round was run to its end"
    _, said, _ = _here(home, "status", "out")
    assert "stopped" in said.splitlines()[0]
    assert go_on in said
    return go_on.removeprefix("go on with: "), after


def test_ctrl_c_once_finishes_what_is_under_way(start, home, undisturbed):
    """A terminal interrupts the whole group; what was under way is written, and nothing is lost."""
    _, before = _interrupted(start, home, undisturbed, signal.SIGINT, ["--jobs", 2], group=True)
    _gone_on_with(home)
    _nothing_is_lost(home, undisturbed, before)


def test_a_request_to_end_tells_the_command_that_goes_on(start, home, undisturbed):
    """SIGTERM to the command alone, as batch systems send it, does the same; the command told works as printed."""
    options = ["--backend", "serial", "--time-limit", "1 h"]
    command, before = _interrupted(start, home, undisturbed, signal.SIGTERM, options, group=False)
    program = home / "bin/layoutopt"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} -m layoutopt "$@"\n', encoding="utf-8")
    program.chmod(0o755)
    environment = fault_hooks.environment(home / "hooks")
    environment["PATH"] = os.pathsep.join([str(program.parent), os.environ["PATH"]])
    subprocess.run(command, shell=True, cwd=home, env=environment, capture_output=True, check=True, timeout=120)
    _nothing_is_lost(home, undisturbed, before)


@pytest.mark.long
@pytest.mark.parametrize("times", [1, 2])
def test_ctrl_c_on_a_terminal(home, undisturbed, times):
    """The key itself, pressed on a terminal with a live line: once and twice, the study ends as it should."""
    terminal, inside = os.openpty()
    shown = bytearray()

    def watch():
        # A terminal whose program has ended gives an error.
        with contextlib.suppress(OSError):
            while content := os.read(terminal, 4096):
                shown.extend(content)

    watcher = threading.Thread(target=watch)
    process = subprocess.Popen(
        [sys.executable, "-m", "layoutopt", *STUDY, "--jobs", "2"],
        cwd=home,
        env={**fault_hooks.environment(home / "hooks", pause_s=0.6), "TERM": "xterm-256color", "COLUMNS": "200"},
        stdin=inside,
        stdout=inside,
        stderr=inside,
        start_new_session=True,
        preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
    )
    os.close(inside)
    watcher.start()
    try:
        while len(_tasks(home)) <= _SEARCH_TASKS:
            assert process.poll() is None, shown.decode()
            time.sleep(0.01)
        before = _journal(home)
        os.write(terminal, b"\x03")
        while b"stopping:" not in shown:
            assert process.poll() is None, shown.decode()
            time.sleep(0.01)
        if times == 2:
            os.write(terminal, b"\x03")
        assert process.wait(timeout=60) == INTERRUPTED, shown.decode()
    finally:
        process.kill()
        watcher.join(timeout=60)
        os.close(terminal)
    text = shown.decode()
    assert "trials/s" in text, "there was no live line"
    assert text.rfind("\x1b[?25h") > text.rfind("\x1b[?25l") >= 0, "the cursor is still hidden"
    assert "Traceback" not in text
    assert ("stopped at once" if times == 2 else "stopped as asked") in text
    assert "go on with: layoutopt study" in text
    _gone_on_with(home)
    _nothing_is_lost(home, undisturbed, before)


@pytest.mark.long
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("group", [True, False])
@pytest.mark.parametrize("options", [("--jobs", 1), ("--jobs", 2), ("--backend", "serial")])
def test_every_request_to_end_finishes_what_is_under_way(start, home, undisturbed, number, group, options):
    """Both signals, to the group and to the command, with two workers, one and none."""
    _, before = _interrupted(start, home, undisturbed, number, options, group=group)
    _gone_on_with(home)
    _nothing_is_lost(home, undisturbed, before)


def _interrupted_twice(start, home, undisturbed, layout_keys, numbers, options):
    """Check that a second signal ends a study at once although a task never ends."""
    begun = home / "begun.txt"
    running = start(*options, begun=begun, misbehave={layout_keys[-1]: "sleeps"})
    running.wait_until(lambda: begun.exists() and layout_keys[-1] in begun.read_text())
    time.sleep(0.3)
    os.killpg(running.process.pid, numbers[0])
    running.wait_until(lambda: "stopping:" in running.told)
    time.sleep(0.5)
    assert running.process.poll() is None
    before = _journal(home)
    os.killpg(running.process.pid, numbers[1])
    assert running.ended(within_s=10) == INTERRUPTED, running.told
    assert running.are_gone(within_s=5.0)
    assert "Traceback" not in running.told
    assert "Warning" not in running.told
    assert "stopped at once\ngo on with: layoutopt study " in running.told
    _gone_on_with(home)
    _nothing_is_lost(home, undisturbed, before)


def test_ctrl_c_twice_ends_at_once(start, home, undisturbed, layout_keys):
    """The second Ctrl-C waits for nobody, even if a task never ends, and leaves no process."""
    _interrupted_twice(start, home, undisturbed, layout_keys, [signal.SIGINT, signal.SIGINT], ["--jobs", 1])


@pytest.mark.long
@pytest.mark.parametrize("first", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("second", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("options", [("--jobs", 1), ("--jobs", 2), ("--backend", "serial")])
def test_every_second_request_ends_at_once(start, home, undisturbed, layout_keys, first, second, options):
    """Both signals in any order, with two workers, one and none."""
    _interrupted_twice(start, home, undisturbed, layout_keys, [first, second], options)


@pytest.mark.long
@pytest.mark.parametrize("module", ["layoutopt.spec.reading", "studies.cost_vs_accuracy", "objectives.blind_runs"])
def test_ctrl_c_before_the_first_task_needs_no_traceback(start, home, module):
    """Interrupted while it reads, imports and screens, the command ends with 130 and leaves no journal."""
    running = start("--jobs", 2, interrupt_at=module)
    assert running.ended() == INTERRUPTED, running.told
    assert "Traceback" not in running.told
    assert not (home / "out" / JOURNAL).exists()
    assert running.are_gone()


@pytest.mark.long
@pytest.mark.timeout(900)
def test_twenty_kills_at_random_instants(start, home, undisturbed):
    """Killed twenty times, each time at another instant, the study is gone on with to the same bytes."""
    dice = random.Random(_seed())
    before = b""
    for number in range(20):
        running = start("--jobs", 2, "--resume", pause_s=0.3)
        with contextlib.suppress(subprocess.TimeoutExpired):
            running.ended(within_s=dice.uniform(0.5, 6.0))
        running.process.kill()
        running.ended()
        now = _journal(home)
        assert now.startswith(before), f"kill {number} lost a task"
        before = now
    _gone_on_with(home)
    _nothing_is_lost(home, undisturbed, before)
    assert running.are_gone()


@pytest.mark.long
@pytest.mark.timeout(900)
def test_random_workers_killed_every_second(start, home, undisturbed):
    """However often workers die, the study ends by itself; what it took for deadly is run when it goes on.

    The next one is killed as soon as the last death was survived, so that workers have the time to start.
    """
    dice = random.Random(_seed())
    running = start("--jobs", 2, pause_s=0.3)
    done, kills = 0, 0
    while running.process.poll() is None:
        time.sleep(1.0)
        now, workers = sum("failure" not in record for record in _tasks(home)), running.workers()
        if now > done and workers:
            with contextlib.suppress(ProcessLookupError):
                os.kill(dice.choice(workers), signal.SIGKILL)
            done, kills = now, kills + 1
    assert kills > 2
    assert running.ended() in (0, 1), running.told
    assert "Traceback" not in running.told
    before = _journal(home)
    _gone_on_with(home)
    _nothing_is_lost(home, undisturbed, before)
    assert running.are_gone()
