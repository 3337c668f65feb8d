"""The journal of a study folder: what is written comes back, whatever happens in between."""

import errno
import json
import math
import os
import random
import resource

import numpy as np
import pytest

from layoutopt import journal as journal_module
from layoutopt.errors import FailureKind, JournalNotWritten, StudyDamaged
from layoutopt.journal import JOURNAL, MANIFEST, Journal, read_manifest, read_recorded
from layoutopt.protocols import Evaluation, Failure, Group
from layoutopt.scores import TrialOutcomes

FACTS = {
    "schema": 1,
    "study": "front",
    "seed": 7,
    "spec": "abc",
    "model": "1",
    "quick": False,
    "environments": [{}],
}


def _evaluation(first: int = 0, layout: str = "l1") -> Evaluation:
    values = np.array([[0.1, math.nan], [1 / 3, 2e-17]])
    outcomes = TrialOutcomes(
        replications=np.array([first, first + 1]), columns=("nees", "dock.nees"), values=values
    )
    return Evaluation(group=Group(layout, "s", "mcl", "k"), first=first, outcomes=outcomes, seconds=0.25)


def test_what_was_written_is_read_back_to_the_last_bit(tmp_path):
    """Outcomes, NaN included, and failures survive a round trip exactly."""
    failure = Failure(group=Group("l2", "s", "mcl", "k"), first=0, message="Größe ≠ 1", kind=FailureKind.HUNG)
    with Journal(tmp_path, facts=FACTS) as journal:
        journal.append("a", _evaluation())
        journal.append("b", failure)
    with Journal(tmp_path, facts=FACTS) as journal:
        assert len(journal) == 1
        assert journal.get("a") == _evaluation()
        assert journal.notes == []
    assert read_recorded(tmp_path) == {"a": _evaluation(), "b": failure}


def test_what_failed_is_tried_again(tmp_path):
    """A journal that is opened again does not know of failed tasks, and a later success counts."""
    failure = Failure(group=Group("l1", "s", "mcl", "k"), first=0, message="MemoryError", kind=FailureKind.MEMORY)
    with Journal(tmp_path, facts=FACTS) as journal:
        journal.append("a", failure)
        assert journal.get("a") == failure
    with Journal(tmp_path, facts=FACTS) as journal:
        assert journal.get("a") is None
        journal.append("a", _evaluation())
    assert read_recorded(tmp_path) == {"a": _evaluation()}


@pytest.mark.parametrize("text", ["", "{", "[]", "3"])
def test_a_broken_manifest_is_refused(tmp_path, text):
    """A manifest that is no table is named, not tripped over."""
    Journal(tmp_path, facts=FACTS).close()
    (tmp_path / MANIFEST).write_text(text)
    with pytest.raises(StudyDamaged, match=MANIFEST):
        Journal(tmp_path, facts=FACTS)


@pytest.mark.parametrize("cut", [1, 10, 40])
def test_a_torn_last_line_is_dropped(tmp_path, cut):
    """A line that a kill left half-written is removed; all before it stays."""
    with Journal(tmp_path, facts=FACTS) as journal:
        journal.append("a", _evaluation(0))
        journal.append("b", _evaluation(2))
    path = tmp_path / JOURNAL
    path.write_bytes(path.read_bytes()[:-cut])
    with Journal(tmp_path, facts=FACTS) as journal:
        (note,) = journal.notes
        assert "torn" in note
        assert journal.get("a") == _evaluation(0)
        assert journal.get("b") is None
        journal.append("b", _evaluation(2))
    assert len(read_recorded(tmp_path)) == 2


def test_a_broken_line_within_is_refused_with_its_number(tmp_path):
    """Damage that no kill explains is named with file and line."""
    with Journal(tmp_path, facts=FACTS) as journal:
        journal.append("a", _evaluation())
    path = tmp_path / JOURNAL
    path.write_text("{}\n" + path.read_text())
    with pytest.raises(StudyDamaged, match=rf"{JOURNAL}:1"):
        Journal(tmp_path, facts=FACTS)


def test_two_runs_on_one_folder_are_refused(tmp_path):
    """A second journal on a locked folder says so at once."""
    with Journal(tmp_path, facts=FACTS), pytest.raises(StudyDamaged, match="another run"):
        Journal(tmp_path, facts=FACTS)
    Journal(tmp_path, facts=FACTS).close()


@pytest.mark.parametrize("name", ["seed", "spec", "model", "schema", "quick"])
def test_a_folder_of_another_study_is_refused(tmp_path, name):
    """Seed, spec and model version of a folder must agree with the run."""
    Journal(tmp_path, facts=FACTS).close()
    with pytest.raises(StudyDamaged, match=name):
        Journal(tmp_path, facts={**FACTS, name: "other"})


def test_the_journal_is_strict_json(tmp_path):
    """Every line parses without NaN or infinity, so that any program can read it."""

    def refuse(word):
        raise AssertionError(word)

    with Journal(tmp_path, facts=FACTS) as journal:
        journal.append("a", _evaluation())
    for line in (tmp_path / JOURNAL).read_text().splitlines():
        json.loads(line, parse_constant=refuse)
    json.loads((tmp_path / MANIFEST).read_text(), parse_constant=refuse)


def _append(journal, numbers):
    for number in numbers:
        journal.append(f"task {number}", _evaluation(2 * number))


def _lines(folder):
    return (folder / JOURNAL).read_bytes().splitlines(keepends=True)


@pytest.mark.parametrize("seed", range(20))
def test_a_journal_cut_anywhere_keeps_every_whole_line(tmp_path, seed):
    """Wherever the file ends, also amid a letter of two bytes or in zeros, all whole lines count."""
    with Journal(tmp_path, facts=FACTS) as journal:
        _append(journal, range(6))
    dice = random.Random(seed)
    whole = (tmp_path / JOURNAL).read_bytes()
    cut = dice.randrange(len(whole))
    tail = dice.choice([b"", b"\xc3", bytes(dice.randrange(1, 5000))])
    (tmp_path / JOURNAL).write_bytes(whole[:cut] + tail)
    expected = max(0, whole[:cut].count(b"\n") - 1)
    assert len(read_recorded(tmp_path)) == expected
    with Journal(tmp_path, facts=FACTS) as journal:
        assert len(journal) == expected
        _append(journal, range(expected, 6))
    assert (tmp_path / JOURNAL).read_bytes() == whole


def test_zeros_within_cost_their_lines_only(tmp_path):
    """Where a power failure left zeros within, the lines about them are lost and told of; all others count."""
    with Journal(tmp_path, facts=FACTS) as journal:
        _append(journal, range(6))
    lines = _lines(tmp_path)
    hole = lines[2][:30] + bytes(len(lines[2]) - 60) + lines[2][-30:]
    (tmp_path / JOURNAL).write_bytes(b"".join([*lines[:2], hole, *lines[3:], b"half"]))
    assert set(read_recorded(tmp_path)) == {f"task {number}" for number in (0, 2, 3, 4, 5)}
    with Journal(tmp_path, facts=FACTS) as journal:
        assert len(journal) == 5
        assert ["torn" in note for note in journal.notes] == [True, False]
        assert "gaps" in journal.notes[1]
        journal.append("task 1", _evaluation(2))
    assert sorted(_lines(tmp_path)) == sorted(lines)
    with Journal(tmp_path, facts=FACTS) as journal:
        assert len(journal) == 6
        assert journal.notes == []


def test_a_journal_that_is_refused_is_left_as_it_is(tmp_path):
    """Damage that is not understood is not made worse: neither torn line nor zeros are taken away."""
    with Journal(tmp_path, facts=FACTS) as journal:
        journal.append("a", _evaluation())
    content = b"{}\n" + (tmp_path / JOURNAL).read_bytes() + bytes(9) + b"\nhalf"
    (tmp_path / JOURNAL).write_bytes(content)
    with pytest.raises(StudyDamaged, match=rf"{JOURNAL}:1"):
        Journal(tmp_path, facts=FACTS)
    assert (tmp_path / JOURNAL).read_bytes() == content


class _FullDisk:
    """Where a file may grow to a size and no further."""

    def __init__(self, size):
        self._size = size

    def __enter__(self):
        self._before = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (self._size, self._before[1]))

    def __exit__(self, *_):
        resource.setrlimit(resource.RLIMIT_FSIZE, self._before)


@pytest.mark.parametrize("room", [0, 1, 30, 60, 100, 200, 270])
def test_a_full_disk_leaves_whole_lines(tmp_path, room):
    """A line that finds too little room is taken back; once there is room, all is written as it should be."""
    with Journal(tmp_path / "other", facts=FACTS) as journal:
        _append(journal, range(3))
    whole = (tmp_path / "other" / JOURNAL).read_bytes()
    with Journal(tmp_path, facts=FACTS) as journal:
        with _FullDisk(room), pytest.raises(JournalNotWritten, match=rf"{JOURNAL}: cannot be written \(File too"):
            _append(journal, range(3))
        content = (tmp_path / JOURNAL).read_bytes()
        assert content == whole[: whole.rfind(b"\n", 0, room) + 1]
        done = len(journal)
        assert done == max(0, content.count(b"\n") - 1)
        _append(journal, range(done, 3))
    assert (tmp_path / JOURNAL).read_bytes() == whole


def test_a_line_that_may_not_have_reached_the_disk_does_not_count(tmp_path, monkeypatch):
    """If the disk fails when it is asked to keep what was written, that line is taken back."""

    def fails(file):
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    with Journal(tmp_path, facts=FACTS) as journal:
        journal.append("a", _evaluation(0))
        before = (tmp_path / JOURNAL).read_bytes()
        monkeypatch.setattr(journal_module, "_SYNC_EVERY_S", -1.0)
        monkeypatch.setattr(journal_module.os, "fsync", fails)
        with pytest.raises(JournalNotWritten, match=os.strerror(errno.EIO)):
            journal.append("b", _evaluation(2))
        assert journal.get("b") is None
    assert (tmp_path / JOURNAL).read_bytes() == before
    monkeypatch.undo()
    Journal(tmp_path, facts=FACTS).close()


def test_other_versions_are_added_to_the_manifest_and_told(tmp_path):
    """A folder remembers every environment that wrote to it, and whoever goes on in another one is told."""
    Journal(tmp_path, facts={**FACTS, "environments": [{"python": "3.11"}]}).close()
    with Journal(tmp_path, facts={**FACTS, "environments": [{"python": "3.12"}]}) as journal:
        (note,) = journal.notes
    assert "python 3.11, now 3.12" in note
    assert read_manifest(tmp_path)["environments"] == [{"python": "3.11"}, {"python": "3.12"}]
    with Journal(tmp_path, facts={**FACTS, "environments": [{"python": "3.11"}]}) as journal:
        assert journal.notes == []


@pytest.mark.parametrize("known", [None, 3, ["3.11"]])
def test_a_manifest_without_environments_is_refused(tmp_path, known):
    """What stands in place of the list of environments is named, not tripped over."""
    Journal(tmp_path, facts={**FACTS, "environments": known}).close()
    with pytest.raises(StudyDamaged, match="environments"):
        Journal(tmp_path, facts=FACTS)
