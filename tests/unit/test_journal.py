"""The journal of a study folder: what is written comes back, whatever happens in between."""

import json
import math

import numpy as np
import pytest

from layoutopt.errors import StudyDamaged
from layoutopt.journal import JOURNAL, MANIFEST, Journal, read_recorded
from layoutopt.protocols import Evaluation, Failure, Group
from layoutopt.scores import TrialOutcomes

FACTS = {"schema": 1, "study": "front", "seed": 7, "spec": "abc", "model": "1", "quick": False}


def _evaluation(first: int = 0, layout: str = "l1") -> Evaluation:
    values = np.array([[0.1, math.nan], [1 / 3, 2e-17]])
    outcomes = TrialOutcomes(
        replications=np.array([first, first + 1]), columns=("nees", "dock.nees"), values=values
    )
    return Evaluation(group=Group(layout, "s", "mcl", "k"), first=first, outcomes=outcomes, seconds=0.25)


def test_what_was_written_is_read_back_to_the_last_bit(tmp_path):
    """Outcomes, NaN included, and failures survive a round trip exactly."""
    failure = Failure(group=Group("l2", "s", "mcl", "k"), first=0, message="ValueError: no")
    with Journal(tmp_path, facts=FACTS) as journal:
        journal.append("a", _evaluation())
        journal.append("b", failure)
    with Journal(tmp_path, facts=FACTS) as journal:
        assert len(journal) == 1
        assert journal.get("a") == _evaluation()
        assert not journal.dropped_torn_line
    assert read_recorded(tmp_path) == {"a": _evaluation(), "b": failure}


def test_what_failed_is_tried_again(tmp_path):
    """A journal that is opened again does not know of failed tasks, and a later success counts."""
    failure = Failure(group=Group("l1", "s", "mcl", "k"), first=0, message="MemoryError: ")
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
        assert journal.dropped_torn_line
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
