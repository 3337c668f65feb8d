"""A study cut short: reproducible by trials, marked, and never more certain than it is."""

from dataclasses import replace

import pytest

from layoutopt.errors import Interrupted, StoppedByLimit
from layoutopt.journal import read_recorded
from layoutopt.progress import Silent
from layoutopt.protocols import Failure
from layoutopt.result import Status
from layoutopt.spec.reading import read_spec
from layoutopt.stopping import StopReason, StopRequest
from layoutopt.streams import Streams
from layoutopt.workers import Backend, Workers
from studies.cost_vs_accuracy import CostVersusAccuracy
from studies.folder import Run, run_study
from studies.runner import run_rounds


@pytest.fixture(scope="module")
def spec(tiny_text, tmp_path_factory):
    """The tiny spec with short drives and a demand that some layouts meet."""
    path = tmp_path_factory.mktemp("spec") / "short.toml"
    text = tiny_text.replace('duration = "15 s"', 'duration = "4 s"').replace("particles = 200", "particles = 100")
    path.write_text(text.replace('target_error = "30 mm"', 'target_error = "60 mm"'), encoding="utf-8")
    return read_spec(path)


@pytest.fixture(scope="module")
def question(spec):
    """Its study, without published layouts."""
    return replace(CostVersusAccuracy.for_spec(spec, quick=True), reference_trials=0)


def _ran(question, most_trials, **settings):
    return run_rounds(
        question, streams=Streams(seed=3), journal=None, progress=Silent(), most_trials=most_trials, **settings
    )


@pytest.mark.parametrize("most", [1, 7, 18, 31])
def test_a_budget_of_trials_cuts_at_the_same_task_whoever_works(question, most):
    """The same evaluations with workers as without, within the budget and with the next task beyond it."""
    here = _ran(question, most)
    there = _ran(question, most, workers=Workers(Backend.LOKY, jobs=2))
    assert here.stopped is there.stopped is StopReason.TRIALS
    assert [(item.group, item.first, item.outcomes) for item in here.evaluations] == [
        (item.group, item.first, item.outcomes) for item in there.evaluations
    ]
    largest_task = 5
    assert most - largest_task < sum(len(item.outcomes) for item in here.evaluations) <= most


def test_a_budget_that_is_enough_stops_nothing(question):
    """With more trials than the study wants it is whole."""
    assert not _ran(question, 10**6).stopped


def test_an_answer_so_far_says_that_it_is_one(question):
    """Status and reason say that the study was stopped; the cheapest says that its held-out drives are missing."""
    whole = question.findings(_ran(question, None).evaluations)
    assert whole.result.status is not Status.STOPPED_BY_LIMIT
    trials = whole.result.trials
    findings = question.findings(_ran(question, trials).evaluations, stopped="stopped by a test")
    assert findings.result.status is Status.STOPPED_BY_LIMIT
    assert findings.result.status.exit_code == 3
    assert findings.result.shortfall == "stopped by a test"
    assert findings.result.front == whole.result.front
    assert "held-out drives are not complete" in findings.reasons["cheapest"]
    assert not any(row.scores for row in findings.validations)


@pytest.mark.parametrize("most", [1, 5, 19])
def test_an_answer_from_few_trials_ranks_only_what_was_driven(question, most):
    """A layout without trials stands on no front and is not recommended."""
    ran = _ran(question, most)
    findings = question.findings(ran.evaluations, stopped="a test")
    driven = {item.group.layout_key for item in ran.evaluations if not isinstance(item, Failure)}
    assert {item.layout.key for item in findings.result.front.members} <= driven
    assert bool(findings.result.front.members) == bool(driven)


def test_a_stop_by_somebody_gives_no_answer_but_keeps_what_was_finished(question, spec, tmp_path):
    """Asked to stop in mid-round, a study ends without tables; gone on with, it has everything."""
    stop = StopRequest()

    class AskAfterThree(Silent):
        count = 0

        def result(self, evaluation):
            self.count += 1
            if self.count == 3:
                stop.ask()

    run = Run(quick=True, stop=stop, workers=Workers(stop=stop))
    with pytest.raises(Interrupted):
        run_study("cost_vs_accuracy", question, spec, tmp_path / "out", run=run, progress=AskAfterThree())
    assert len(read_recorded(tmp_path / "out")) == 3
    assert not (tmp_path / "out/designs.csv").exists()
    answer = run_study(
        "cost_vs_accuracy", question, spec, tmp_path / "out", run=Run(quick=True, resume=True), progress=Silent()
    )
    assert answer.findings == question.findings(_ran(question, None).evaluations)


def test_a_study_that_cannot_answer_so_far_says_that_it_was_stopped(spec, tmp_path):
    """A study of fixed cells ends with the reason of the stop and keeps its trials."""
    from studies.pattern_comparison import PatternComparison

    study = PatternComparison.for_spec(spec, quick=True)
    first = study.next_batch(()).tasks[0]
    with pytest.raises(StoppedByLimit, match=r"--max-trials .* no answer yet"):
        run_study(
            "pattern_comparison",
            study,
            spec,
            tmp_path / "out",
            run=Run(quick=True, most_trials=first.count),
            progress=Silent(),
        )
    assert len(read_recorded(tmp_path / "out")) == 1
