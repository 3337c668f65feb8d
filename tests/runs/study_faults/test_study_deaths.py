"""A study goes on after kills, dead workers, bad layouts, a second run and a clock that jumps."""

import contextlib
import csv
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time

import pytest
from struck_studies import (
    NEEDS_PROC,
    STUDY,
    gone_on_with,
    here,
    is_one_message,
    journal,
    new_seed,
    nothing_is_lost,
    tasks,
)

from studies.status import STATUS

pytestmark = NEEDS_PROC


def test_after_a_kill_the_study_goes_on_where_it_was(start, home, undisturbed):
    """Killed without warning, a study frees its folder and leaves no process, and what it had finished counts."""
    running = start("--jobs", 2, pause_s=0.1)
    before = running.wait_for_tasks(10)
    running.process.kill()
    running.ended()
    _, said, _ = here(home, "status", "out")
    assert "ended without a word" in said
    assert "go on with: layoutopt study cost_vs_accuracy spec.toml --out out --jobs 2 --resume" in said
    gone_on_with(home)
    nothing_is_lost(home, undisturbed, before)
    assert running.are_gone()


@pytest.mark.long
def test_a_killed_worker_costs_nothing(start, home, undisturbed):
    """The study goes on with new workers, without help, and says so."""
    running = start("--jobs", 2, pause_s=0.1)
    before = running.wait_for_tasks(5)
    killed = running.workers()[0]
    os.kill(killed, signal.SIGKILL)
    assert running.ended() == 0, running.told
    assert "note: a worker process died: what was under way is run again" in running.told
    assert "Traceback" not in running.told
    nothing_is_lost(home, undisturbed, before)
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
    before = journal(home)
    with (home / "out/designs.csv").open(encoding="utf-8", newline="") as file:
        refusals = {row["layout"]: row["refusal"] for row in csv.DictReader(file)}
    failures = {record["group"][0]: record for record in tasks(home) if "failure" in record}
    _, said, _ = here(home, "status", "out")
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
    gone_on_with(home)
    nothing_is_lost(home, undisturbed, before, more=True)
    _, said, _ = here(home, "status", "out")
    assert "failed" not in said


@pytest.mark.long
def test_one_bad_layout_of_each_kind_fails_alone(start, home, undisturbed, layout_keys):
    """An estimator that raises, gives no number, finds no memory, is killed or hangs fails for that layout only.

    The layout is marked with kind and reason in table, progress and status, and tried again on going on.
    """
    ways = ["raises", "gives_no_number", "finds_no_memory", "is_killed", "waits_in_compiled_code"]
    _misbehaves(start, home, undisturbed, layout_keys, ways)


@pytest.mark.parametrize(
    "way", [pytest.param(way, marks=[] if way == "raises" else [pytest.mark.long]) for way in MISBEHAVIOUR]
)
def test_each_kind_of_bad_layout_fails_alone(start, home, undisturbed, layout_keys, way):
    """Each way of misbehaving alone, so that no other hides it."""
    _misbehaves(start, home, undisturbed, layout_keys, [way])


def test_a_second_run_on_the_folder_is_refused(start, home, undisturbed):
    """The second one is told so at once, with or without --resume, and the first one takes no harm."""
    running = start("--backend", "serial", pause_s=0.05)
    before = running.wait_for_tasks(3)
    code, _, told = here(home, *STUDY, "--backend", "serial", "--resume")
    assert code == 2
    is_one_message(told, "another run is writing to this folder")
    code, _, told = here(home, *STUDY, "--backend", "serial")
    assert code == 2
    is_one_message(told, "holds a study already")
    _, said, _ = here(home, "status", "out")
    assert "running" in said
    assert running.ended() == 0, running.told
    nothing_is_lost(home, undisturbed, before)


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
    nothing_is_lost(home, undisturbed, before)
    status = json.loads((home / "out" / STATUS).read_text(encoding="utf-8"))
    assert status["state"] == "finished"
    assert 1.0 < status["trials_per_s"] < 1e5
    assert 0.0 <= status["left_s"] < 60.0
    code, said, _ = here(home, "status", "out")
    assert code == 0
    assert "finished" in said
    assert running.are_gone()


@pytest.mark.long
def test_twenty_kills_at_random_instants(start, home, undisturbed):
    """Killed twenty times, each time at another instant, the study is gone on with to the same bytes."""
    dice = random.Random(new_seed())
    before = b""
    for number in range(20):
        running = start("--jobs", 2, "--resume", pause_s=0.3)
        with contextlib.suppress(subprocess.TimeoutExpired):
            running.ended(within_s=dice.uniform(0.5, 6.0))
        running.process.kill()
        running.ended()
        now = journal(home)
        assert now.startswith(before), f"kill {number} lost a task"
        before = now
    gone_on_with(home)
    nothing_is_lost(home, undisturbed, before)
    assert running.are_gone()


@pytest.mark.long
def test_random_workers_killed_every_second(start, home, undisturbed):
    """However often workers die, the study ends by itself; what it took for deadly is run when it goes on.

    The next one is killed as soon as the last death was survived, so that workers have the time to start.
    """
    dice = random.Random(new_seed())
    running = start("--jobs", 2, pause_s=0.3)
    done, kills = 0, 0
    while running.process.poll() is None:
        time.sleep(1.0)
        now, workers = sum("failure" not in record for record in tasks(home)), running.workers()
        if now > done and workers:
            with contextlib.suppress(ProcessLookupError):
                os.kill(dice.choice(workers), signal.SIGKILL)
            done, kills = now, kills + 1
    assert kills > 2
    assert running.ended() in (0, 1), running.told
    assert "Traceback" not in running.told
    before = journal(home)
    gone_on_with(home)
    nothing_is_lost(home, undisturbed, before, more=True)
    assert running.are_gone()
