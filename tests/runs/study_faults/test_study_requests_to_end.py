"""A study that is asked to end finishes what is under way, or ends at once when asked twice."""

import contextlib
import fcntl
import os
import shlex
import signal
import subprocess
import sys
import termios
import threading
import time

import fault_hooks
import pytest
from struck_studies import INTERRUPTED, NEEDS_PROC, STUDY, gone_on_with, here, journal, nothing_is_lost, tasks

from layoutopt.journal import JOURNAL

pytestmark = NEEDS_PROC

_SEARCH_TASKS = 8
_FRONT_TASKS = 12


def _interrupted(start, home, undisturbed, number, options, *, group):
    """Check that a signal ends a study after what was under way; return what goes on with it, and the journal."""
    begun = home / "begun.txt"
    # With tasks of that length each goes out alone, so that most of a round is not under way.
    running = start(*options, pause_s=0.6, begun=begun)
    running.wait_for_tasks(_SEARCH_TASKS + 1)
    before = journal(home)
    (os.killpg if group else os.kill)(running.process.pid, number)
    assert running.ended() == INTERRUPTED, running.told
    assert running.are_gone()
    assert "Traceback" not in running.told
    assert running.told.count("stopping: what is under way is finished and written") == 1
    assert "\nstopped as asked; what was finished is kept\ngo on with: " in running.told
    go_on = next(line for line in running.told.splitlines() if line.startswith("go on with: "))
    after = journal(home)
    assert after.startswith(before)
    known = {f"{' '.join(record['group'][:3])} {record['first']}" for record in tasks(home)}
    assert set(begun.read_text().splitlines()) == known
    assert len(known) < _SEARCH_TASKS + _FRONT_TASKS, "the round was run to its end"
    _, said, _ = here(home, "status", "out")
    assert "stopped" in said.splitlines()[0]
    assert go_on in said
    return go_on.removeprefix("go on with: "), after


def test_ctrl_c_once_finishes_what_is_under_way(start, home, undisturbed):
    """A terminal interrupts the whole group; what was under way is written, and nothing is lost."""
    _, before = _interrupted(start, home, undisturbed, signal.SIGINT, ["--jobs", 2], group=True)
    gone_on_with(home)
    nothing_is_lost(home, undisturbed, before)


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
    nothing_is_lost(home, undisturbed, before)


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
        while len(tasks(home)) <= _SEARCH_TASKS:
            assert process.poll() is None, shown.decode()
            time.sleep(0.01)
        before = journal(home)
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
    gone_on_with(home)
    nothing_is_lost(home, undisturbed, before)


@pytest.mark.long
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("group", [True, False])
@pytest.mark.parametrize("options", [("--jobs", 1), ("--jobs", 2), ("--backend", "serial")])
def test_every_request_to_end_finishes_what_is_under_way(start, home, undisturbed, number, group, options):
    """Both signals, to the group and to the command, with two workers, one and none."""
    _, before = _interrupted(start, home, undisturbed, number, options, group=group)
    gone_on_with(home)
    nothing_is_lost(home, undisturbed, before)


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
    before = journal(home)
    os.killpg(running.process.pid, numbers[1])
    assert running.ended(within_s=10) == INTERRUPTED, running.told
    assert running.are_gone(within_s=5.0)
    assert "Traceback" not in running.told
    assert "Warning" not in running.told
    assert "stopped at once\ngo on with: layoutopt study " in running.told
    gone_on_with(home)
    nothing_is_lost(home, undisturbed, before)


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
