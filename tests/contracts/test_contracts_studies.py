"""What every study of the table promises: pure rounds, and a card that asks the user's question."""

import pytest

from layoutopt import registry
from layoutopt.evaluate import Evaluator
from layoutopt.protocols import StudyCard
from layoutopt.spec.reading import read_spec
from layoutopt.streams import Streams
from studies.progress import Silent
from studies.runner import run_rounds

NAMES = registry.names("studies")


@pytest.fixture
def spec(tiny_spec):
    """The tiny spec, read."""
    return read_spec(tiny_spec)


def _study(name, spec):
    return registry.load("studies", name).for_spec(spec, quick=True)


@pytest.mark.parametrize("name", NAMES)
def test_card_asks_a_question(name):
    """A study's card holds the user's question."""
    card = registry.card("studies", name)
    assert isinstance(card, StudyCard)
    assert card.question.endswith("?")


@pytest.mark.parametrize("name", NAMES)
def test_next_batch_is_a_pure_function(name, spec):
    """The same evaluations give the same tasks, in another object and in another order too."""
    study, twin = _study(name, spec), _study(name, spec)
    first = study.next_batch(())
    assert first.tasks
    assert [task.layout.key for task in first.tasks] == [task.layout.key for task in twin.next_batch(()).tasks]
    found = Evaluator(Streams(seed=spec.seed))(first.tasks)
    forwards, backwards = study.next_batch(found), twin.next_batch(tuple(reversed(found)))
    assert [(t.layout.key, t.first, t.count) for t in forwards.tasks] == [
        (t.layout.key, t.first, t.count) for t in backwards.tasks
    ]


@pytest.mark.parametrize("name", NAMES)
def test_a_study_ends_and_then_wants_nothing(name, spec):
    """Run to its end, a study has no further task, and no task was wanted twice."""
    study = _study(name, spec)
    evaluations = run_rounds(study, streams=Streams(seed=spec.seed), jobs=1, journal=None, progress=Silent())
    assert not study.next_batch(evaluations).tasks
    keys = [(e.layout_key, e.scenario, e.estimator, e.first) for e in evaluations]
    assert len(set(keys)) == len(keys)


@pytest.mark.parametrize("name", NAMES)
def test_findings_rest_on_the_evaluations_alone(name, spec):
    """Findings made twice from the same evaluations are the same, whatever their order."""
    study = _study(name, spec)
    evaluations = run_rounds(study, streams=Streams(seed=spec.seed), jobs=1, journal=None, progress=Silent())
    first, second = study.findings(evaluations), study.findings(tuple(reversed(evaluations)))
    assert [member.layout.key for member in first.result.front.members] == [
        member.layout.key for member in second.result.front.members
    ]
    assert first.result.status is second.result.status
    assert first.validations == second.validations
