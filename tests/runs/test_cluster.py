"""A real cluster on this machine: a scheduler and workers, some of which die, and what a study makes of it."""

import contextlib
import functools
import importlib.util
import json
import logging
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from small_studies import SPEC, called, leave_out_drawings, tables

from layoutopt import cluster
from layoutopt.errors import FailureKind, InvalidInput, WorkerDied
from layoutopt.journal import JOURNAL
from layoutopt.stopping import StopRequest
from layoutopt.workers import Backend, Lost, Workers

pytestmark = pytest.mark.skipif(importlib.util.find_spec("distributed") is None, reason="needs dask.distributed")

STUDY = ("study", "cost_vs_accuracy", "spec.toml", "--out")
_PATIENCE_S = 60.0


class Cluster:
    """Processes of a scheduler and of workers, which keep their files in a folder of their own and end with it."""

    def __init__(self, folder):
        self.folder = folder
        self.scheduler = None
        self.workers = []
        self.address = ""

    def start(self, *, port=0):
        """Start a scheduler, on a free port if none is given, and take note of its address."""
        file = self.folder / "scheduler.json"
        file.unlink(missing_ok=True)
        options = ["--host", "127.0.0.1", "--port", str(port), "--no-dashboard", "--scheduler-file", str(file)]
        self.scheduler = self._process("dask_scheduler", options)
        _wait_for(file.exists)
        self.address = json.loads(file.read_text(encoding="utf-8"))["address"]

    def add_worker(self, *, nanny=False):
        """Start a worker of one thread, without a nanny that would start it again unless it is to have one."""
        keeper = "--nanny" if nanny else "--no-nanny"
        options = [
            self.address,
            "--nthreads",
            "1",
            "--no-dashboard",
            keeper,
            "--local-directory",
            str(self.folder),
        ]
        self.workers.append(self._process("dask_worker", options))
        return self.workers[-1]

    def _process(self, module, options):
        tests = Path(__file__).parents[1]
        path = os.pathsep.join(filter(None, [str(tests), str(tests / "runs"), os.environ.get("PYTHONPATH")]))
        with (self.folder / "log").open("ab") as log:
            return subprocess.Popen(
                [sys.executable, "-m", f"distributed.cli.{module}", *options],
                cwd=self.folder,
                env={**os.environ, "PYTHONPATH": path},
                stdout=log,
                stderr=log,
            )

    def stop(self):
        """End what is left, workers with a nanny by asking it."""
        for process in (*self.workers, self.scheduler):
            if process is not None and process.poll() is None:
                process.terminate()
        for process in (*self.workers, self.scheduler):
            if process is not None:
                try:
                    process.wait(10)
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.wait()


def _wait_for(condition):
    deadline = time.monotonic() + _PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.05)


@pytest.fixture(scope="module")
def silent():
    """Loggers of dask as they were, for the other tests of this process."""
    before = {name: logging.getLogger(name).level for name in cluster._LOGGERS}
    yield
    for name, level in before.items():
        logging.getLogger(name).setLevel(level)


@pytest.fixture
def here(tmp_path, silent):
    """A cluster whose connections end with the test."""
    (tmp_path / "cluster").mkdir()
    made = Cluster(tmp_path / "cluster")
    made.start()
    yield made
    with contextlib.suppress(KeyError):
        cluster._close(cluster._clients.pop(made.address))
    made.stop()


def double(item):
    return 2 * item


def slow_double(item):
    time.sleep(0.2)
    return 2 * item


def own_process(item):
    time.sleep(0.1)
    return os.getpid()


def kill_at_three(item):
    if item == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(0.05)
    return 2 * item


def hang_at_two(item):
    while item == 2:
        time.sleep(0.01)
    return 2 * item


def _workers(here, **settings):
    return Workers(Backend.DASK, scheduler=here.address, **settings)


def _sorted(workers, function, items):
    return [result for _, result in sorted(workers.map(function, items), key=lambda entry: entry[0])]


def _without(number, results):
    return [result for index, result in enumerate(results) if index != number]


@pytest.fixture
def home(tmp_path, monkeypatch):
    """A folder with the spec, in which no drawings are made."""
    leave_out_drawings(monkeypatch)
    (tmp_path / "spec.toml").write_text(SPEC, encoding="utf-8")
    return tmp_path


def _on_cluster(here):
    return ("--backend", "dask", "--scheduler", here.address)


def _begin(here, folder, home, *more):
    """Begin a study on the cluster in a process of its own."""
    command = [sys.executable, "-m", "layoutopt", *STUDY, folder, *_on_cluster(here), *more]
    return subprocess.Popen(command, cwd=home, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def _has_begun(folder):
    journal = folder / JOURNAL
    return journal.exists() and journal.read_bytes().count(b"\n") > 3


def test_a_study_on_a_cluster_has_the_bytes_of_one_here(here, home):
    """Tables of a study computed by two workers are those of this process, and dask leaves nothing beside them."""
    for _ in range(2):
        here.add_worker()
    done = called(*STUDY, "out", *_on_cluster(here), cwd=home)
    assert done.returncode == 0, done.stderr
    assert called(*STUDY, "one", "--backend", "serial", cwd=home).returncode == 0
    assert tables(home / "out") == tables(home / "one")
    assert {path.name for path in home.iterdir()} == {"spec.toml", "out", "one", "cluster"}
    names = [sorted(path.relative_to(home / out) for path in (home / out).rglob("*")) for out in ("out", "one")]
    assert names[0] == names[1]


@pytest.mark.long
def test_a_worker_that_is_killed_and_one_that_comes_change_nothing(here, home):
    """With one of two workers killed and another started in mid-study, the tables are those of this process."""
    for _ in range(2):
        here.add_worker()
    study = _begin(here, "out", home)
    _wait_for(lambda: _has_begun(home / "out"))
    here.workers[0].kill()
    here.add_worker()
    _, told = study.communicate(timeout=120)
    assert study.returncode == 0, told
    assert called(*STUDY, "one", "--backend", "serial", cwd=home).returncode == 0
    assert tables(home / "out") == tables(home / "one")


@pytest.mark.long
def test_a_scheduler_that_dies_ends_the_study_in_a_minute(here, home):
    """One message, exit 3, no traceback; gone on with by processes here, the study has the same bytes."""
    here.add_worker()
    study = _begin(here, "out", home, "--json-progress")
    _wait_for(lambda: _has_begun(home / "out"))
    here.scheduler.kill()
    began = time.monotonic()
    _, told = study.communicate(timeout=120)
    assert study.returncode == 3, told
    assert time.monotonic() - began < 75.0
    *events, message, go_on = told.splitlines()
    assert message == f"the scheduler {here.address} does not answer any more; what was finished is kept"
    assert go_on.startswith("go on with: layoutopt study cost_vs_accuracy")
    assert {json.loads(line)["event"] for line in events} <= {"round", "progress", "best", "note"}
    kept = (home / "out" / JOURNAL).read_bytes()
    assert kept.endswith(b"\n")
    done = called(*STUDY, "out", "--resume", "--jobs", 2, cwd=home)
    assert done.returncode == 0, done.stderr
    assert (home / "out" / JOURNAL).read_bytes().startswith(kept)
    assert called(*STUDY, "one", "--backend", "serial", cwd=home).returncode == 0
    assert tables(home / "out") == tables(home / "one")


@pytest.mark.long
@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "tcp://no.such.host.invalid:8786", "smoke://signals"])
def test_a_wrong_address_is_told_before_anything_is_made(home, silent, address):
    """Where no scheduler answers, one line and exit 2 within about half a minute."""
    began = time.monotonic()
    done = called(*STUDY, "out", "--scheduler", address, cwd=home)
    assert done.returncode == 2
    assert time.monotonic() - began < 60.0
    assert done.stderr.startswith(f"--scheduler {address}: no scheduler answers (")
    assert done.stderr.count("\n") == 1
    assert not (home / "out" / JOURNAL).exists()


@pytest.mark.long
def test_a_cluster_without_workers_is_given_up(here, home, monkeypatch):
    """A scheduler that never has a worker ends the study with exit 3 and says so."""
    monkeypatch.setattr("layoutopt.workers._CLUSTER_WAIT_S", 2)
    done = called(*STUDY, "out", *_on_cluster(here), cwd=home)
    assert done.returncode == 3
    assert "has had no worker for 2 s; what was finished is kept" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.long
def test_a_cluster_that_loses_all_workers_is_given_up(here, monkeypatch):
    """When the last worker dies in the middle of the work, the end comes once none came for too long."""
    monkeypatch.setattr("layoutopt.workers._CLUSTER_WAIT_S", 3)
    here.add_worker()
    results = _workers(here).map(slow_double, range(200))
    for _ in range(3):
        next(results)
    here.workers[0].kill()
    with pytest.raises(WorkerDied, match="no worker for 3 s"):
        list(results)


@pytest.mark.long
def test_workers_that_come_later_get_work_at_once(here):
    """A worker that joins in the middle of a round takes its share of it."""
    here.add_worker()
    timer = threading.Timer(1.0, here.add_worker)
    timer.start()
    found = _sorted(_workers(here), own_process, range(120))
    timer.join()
    assert len(set(found)) == 2
    assert min(found.count(process) for process in set(found)) > 20


@pytest.mark.long
def test_a_call_that_kills_its_worker_is_lost_and_the_rest_goes_on(here):
    """Nannies start workers again; one call is lost and all others have their results."""
    for _ in range(2):
        here.add_worker(nanny=True)
    notes = []
    found = _sorted(_workers(here, note=notes.append), kill_at_three, range(12))
    assert found[3] == Lost(kind=FailureKind.KILLED, message="killed two workers (a worker process died)")
    assert _without(3, found) == [2 * item for item in range(12) if item != 3]
    assert notes == ["a worker process died: what was under way is run again, one task at a time"]


@pytest.mark.long
def test_a_call_that_never_ends_is_lost_and_the_rest_goes_on(here):
    """Workers end themselves after the longest time; the call counts as hung."""
    for _ in range(2):
        here.add_worker(nanny=True)
    found = _sorted(_workers(here, longest_s=1.0), hang_at_two, range(8))
    assert found[2].kind is FailureKind.HUNG
    assert _without(2, found) == [2 * item for item in range(8) if item != 2]


@pytest.mark.long
def test_calls_raise_stop_and_cannot_be_sent_as_elsewhere(here):
    """What cannot be pickled is lost with the reason, a stop begins nothing more, who leaves early may return."""
    here.add_worker()
    found = _sorted(_workers(here), str, [1, threading.Lock(), 2])
    assert (found[0], found[2]) == ("1", "2")
    assert found[1] == Lost(kind=FailureKind.NOT_SENT, message="TypeError: cannot pickle '_thread.lock' object")
    raised = _sorted(_workers(here), functools.partial(divmod, 1), [1, 0])
    assert raised[0] == (1, 0)
    assert raised[1].kind is FailureKind.RAISED
    assert raised[1].message.startswith("ZeroDivisionError")
    stop, numbers = StopRequest(), []
    for number, _ in _workers(here, stop=stop).map(slow_double, range(200)):
        numbers.append(number)
        if len(numbers) == 3:
            stop.ask()
    assert 3 <= len(numbers) < 60
    results = _workers(here).map(slow_double, range(100))
    next(results)
    results.close()
    assert _sorted(_workers(here), double, range(4)) == [0, 2, 4, 6]


@pytest.mark.long
def test_a_scheduler_that_is_back_is_found_again(here):
    """Started again at its address in time, with a worker, a scheduler is given the calls that were under way."""
    here.add_worker()
    notes, port = [], int(here.address.rpartition(":")[2])
    found = {}
    for number, result in _workers(here, note=notes.append).map(slow_double, range(40)):
        found[number] = result
        if len(found) == 3:
            here.scheduler.kill()
            here.scheduler.wait()
            here.start(port=port)
            here.add_worker()
    assert found == {number: 2 * number for number in range(40)}
    assert notes[0].startswith(f"ConnectionError: the scheduler {here.address} is gone: what was under way")


@pytest.mark.timeout(60)
def test_without_dask_one_line_says_what_to_install(home, monkeypatch):
    """Where dask is missing, `--backend dask` ends with exit 2 and the command that installs it."""
    monkeypatch.setattr("layoutopt.cluster._dask.distributed", None)
    done = called(*STUDY, "out", "--backend", "dask", "--scheduler", "tcp://x:1", cwd=home)
    assert done.returncode == 2
    assert done.stderr == (
        "--backend dask needs dask.distributed; install it with: pip install 'layoutopt[dask]'\n"
    )
    assert not (home / "out" / JOURNAL).exists()


def test_the_error_of_a_wrong_address_is_one_of_ours(silent):
    """An address of no known kind is refused at once, as input of the user's."""
    with pytest.raises(InvalidInput, match="no scheduler answers"):
        cluster.settings("smoke://signals", wait_s=1.0)


def test_workers_with_different_processors_are_told_once():
    """The first answer from another kind of processor gives a note that names both, and no second one."""
    notes = []
    workers = Workers(note=notes.append)
    for name in ("A", "A", "B", "A", "B"):
        workers._learn(_answer(name))
    assert notes == ["workers have different processors (A, B): the last bits of results may differ"]


def _answer(name):
    from layoutopt.workers import _Answer

    return _Answer(results=[], seconds=0.1, processor=name)
