"""A study goes on after full disks, read-only folders and torn journals."""

import os
import random
import resource
import shutil
import subprocess
import sys

import fault_hooks
import pytest
from small_studies import TABLES
from struck_studies import NEEDS_PROC, STUDY, gone_on_with, is_one_message, journal, new_seed, nothing_is_lost

from layoutopt.journal import JOURNAL, MANIFEST
from studies.status import STATUS

pytestmark = NEEDS_PROC


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
    gone_on_with(home)
    nothing_is_lost(home, undisturbed, content)


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
    gone_on_with(home)
    nothing_is_lost(home, undisturbed, content)


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
    nothing_is_lost(home, undisturbed, content)


def test_a_disk_that_fills_up_while_tables_are_written_leaves_no_half_table(start, home, undisturbed):
    """Each table is there whole or not at all, and going on writes them all."""
    (home / "out").mkdir()
    for name in (JOURNAL, MANIFEST):
        shutil.copy(undisturbed / "out" / name, home / "out" / name)
    before = journal(home)
    sizes = {name: (undisturbed / "out" / name).stat().st_size for name in TABLES}
    largest = max(sizes, key=sizes.__getitem__)
    most = sizes[largest] - 1
    running = start(
        "--backend",
        "serial",
        "--resume",
        before=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (most, resource.RLIM_INFINITY)),
    )
    assert running.ended() == 3, running.told
    assert "Traceback" not in running.told
    assert f"out/{largest}" in running.told
    assert "File too large" in running.told
    _has_only_whole_tables(home / "out", undisturbed / "out")
    written = [name for name in TABLES if (home / "out" / name).exists()]
    assert written == list(TABLES)[: list(TABLES).index(largest)]
    gone_on_with(home)
    nothing_is_lost(home, undisturbed, before)


def _has_only_whole_tables(folder, whole):
    """Check that every file of a folder is as it is in a whole one."""
    assert not list(folder.rglob("*.part"))
    for path in folder.rglob("*"):
        if path.is_file() and path.name not in (MANIFEST, STATUS, ".lock"):
            assert path.read_bytes() == (whole / path.relative_to(folder)).read_bytes(), path


@pytest.mark.long
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
    is_one_message(running.told, "out/spec.toml: " if what == "folder" else "out: ", "Permission denied")
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
    lines = journal(undisturbed).splitlines(keepends=True)
    before = b"".join(lines[:20])
    (home / "out" / JOURNAL).write_bytes(before + tail)
    told = gone_on_with(home)
    assert "run again" in told
    nothing_is_lost(home, undisturbed, before)


@pytest.mark.long
def test_a_journal_cut_anywhere_goes_on(home, undisturbed):
    """Cut at twenty places at random, a study goes on to the same bytes."""
    whole = journal(undisturbed)
    shutil.copytree(undisturbed / "out", home / "out")
    dice = random.Random(new_seed())
    for _ in range(20):
        content = whole[: dice.randrange(len(whole))]
        (home / "out" / JOURNAL).write_bytes(content)
        for name in TABLES:
            (home / "out" / name).unlink()
        gone_on_with(home)
        nothing_is_lost(home, undisturbed, content[: content.rfind(b"\n") + 1])
