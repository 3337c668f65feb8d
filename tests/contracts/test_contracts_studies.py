"""What every study of the table promises: pure rounds, and a card that asks the user's question."""

import re
from html import unescape
from pathlib import Path

import pytest
from harmless import check_page

from layoutopt import registry
from layoutopt.evaluate import Evaluator
from layoutopt.progress import Silent
from layoutopt.protocols import Evaluation, StudyCard
from layoutopt.spec.reading import read_spec
from layoutopt.streams import Streams
from studies.runner import run_rounds

NAMES = registry.names("studies")
SLOW = {"estimator_comparison", "pattern_comparison", "pattern_search", "published/mi2016"}
"""Studies whose quick look takes tens of seconds on any spec."""
DOCS = Path(__file__).parents[2] / "docs"
MOST_LINES = 27
"""Of an answer on the command line: what a screen holds, with what the command line adds."""
MAY_BE_EMPTY = {"exchange_rates.csv", "portfolio.csv"}
"""Tables of what need not exist: neighbours on a front of one, and other layouts that are about as good."""


@pytest.fixture(
    scope="module",
    params=[pytest.param(name, marks=pytest.mark.long) if name in SLOW else name for name in NAMES],
)
def name(request):
    """Every study in turn: of the module, so that all tests of one study follow each other and share its run."""
    return request.param


@pytest.fixture(scope="module")
def spec(tmp_path_factory, tiny_text):
    """The tiny spec, read."""
    path = tmp_path_factory.mktemp("spec") / "tiny.toml"
    path.write_text(tiny_text, encoding="utf-8")
    return read_spec(path)


@pytest.fixture(scope="module")
def finished(spec):
    """Return by name the evaluations of a quick study run to its end, each run once."""
    known = {}

    def evaluations(name):
        if name not in known:
            streams = Streams(seed=spec.seed)
            ran = run_rounds(_study(name, spec), streams=streams, journal=None, progress=Silent())
            known[name] = ran.evaluations
        return known[name]

    return evaluations


@pytest.fixture(scope="module")
def written(spec, finished, tmp_path_factory):
    """Return by name the folder that the answer of a quick study wrote, and the answer's lines, each made once."""
    known = {}

    def folder_and_lines(name):
        if name not in known:
            folder = tmp_path_factory.mktemp("written")
            answer = _study(name, spec).answer(finished(name), spec)
            answer.write(folder, streams=Streams(seed=spec.seed), quick=True)
            known[name] = folder, answer.lines(folder)
        return known[name]

    return folder_and_lines


def _study(name, spec):
    return registry.load("studies", name).for_spec(spec, quick=True)


@pytest.mark.parametrize("study", NAMES)
def test_card_asks_a_question(study):
    """A study's card holds the user's question."""
    card = registry.card("studies", study)
    assert isinstance(card, StudyCard)
    assert card.question.endswith("?")


def test_next_batch_is_a_pure_function(name, spec, finished):
    """The same evaluations give the same tasks, in another object and in another order too."""
    study, twin = _study(name, spec), _study(name, spec)
    first = study.next_batch(())
    assert first.tasks
    assert [task.layout.key for task in first.tasks] == [task.layout.key for task in twin.next_batch(()).tasks]
    wanted = {(task.group, task.first) for task in first.tasks}
    found = tuple(item for item in finished(name) if (item.group, item.first) in wanted)
    assert len(found) == len(wanted)
    forwards, backwards = study.next_batch(found), twin.next_batch(tuple(reversed(found)))
    assert [(t.group, t.first, t.count) for t in forwards.tasks] == [
        (t.group, t.first, t.count) for t in backwards.tasks
    ]


def test_a_study_ends_and_then_wants_nothing(name, spec, finished):
    """Run to its end, a study has no further task, and no task was wanted twice."""
    evaluations = finished(name)
    assert not _study(name, spec).next_batch(evaluations).tasks
    keys = [(e.group, e.first) for e in evaluations]
    assert len(set(keys)) == len(keys)


def test_answers_rest_on_the_evaluations_alone(name, spec, finished):
    """Answers made twice from the same evaluations are the same, whatever their order."""
    study, evaluations = _study(name, spec), finished(name)
    first, second = study.answer(evaluations, spec), study.answer(tuple(reversed(evaluations)), spec)
    assert first.lines(None) == second.lines(None)
    assert first.exit_code == second.exit_code


def test_an_answer_writes_a_report_that_needs_nothing_else(name, written):
    """Report and tables are there, the report loads nothing and shows no missing number as one."""
    folder, _ = written(name)
    text = (folder / "report.html").read_text(encoding="utf-8")
    assert "Quick look" in text
    assert not re.search(r"<(link|img)|src=", text)
    check_page(text, folder)
    assert not re.search(r"[> ](nan|inf)[< ,]", text)
    tables = list(folder.rglob("*.csv"))
    assert tables
    empty = {path.name for path in tables if len(path.read_text(encoding="utf-8").splitlines()) < 2}
    assert empty <= MAY_BE_EMPTY


def test_a_page_answers_first_and_tells_what_the_answer_rests_on(name, written):
    """In this order: question, answer, how sure, what next, figure, tables, measurement, sources, files."""
    if name == "cost_vs_accuracy":
        pytest.skip("its report is one of its own")
    text = unescape((written(name)[0] / "report.html").read_text(encoding="utf-8"))
    card = registry.card("studies", name)
    parts = [
        "<h1>",
        card.question,
        "<dt>Answer</dt>",
        "<dt>How sure</dt>",
        "Trials: ",
        "<dt>What next</dt>",
        "<figure>",
        '<nav class="contents"',
        "<caption>",
        'id="how-it-was-measured"',
        f"layoutopt study {name} spec.toml --quick",
        '<th scope="row">Seed</th>',
        '<th scope="row">Versions</th>',
        'id="sources"',
        f"docs/{card.guide}.md",
        'id="files"',
        'href="tables/',
    ]
    places = [text.find(part) for part in parts]
    assert -1 not in places, parts[places.index(-1)]
    assert places == sorted(places)
    assert text.count("<figure>") == len(re.findall(r"<figcaption>[^<]{15,}</figcaption>", text))
    if re.search(r"\d EUR|cost, EUR", text):
        assert re.search(r'<th scope="row">Prices</th><td>[^<]*\d{4}-\d\d', text)


def test_the_command_line_answers_in_few_lines(name, written):
    """The answer first, how sure it is and what to do next last."""
    if name == "cost_vs_accuracy":
        pytest.skip("its front is told in lines of its own")
    _, lines = written(name)
    assert len(lines) <= MOST_LINES
    assert not lines[0].startswith(("How sure", "Next", "report"))
    closing = [line.partition(":")[0] for line in lines if line.startswith(("How sure:", "Next:"))]
    assert closing == ["How sure", "Next"]


def test_a_guide_is_a_page_of_the_documentation(name):
    """What a card calls its guide exists and names the study."""
    card = registry.card("studies", name)
    text = (DOCS / f"{card.guide}.md").read_text(encoding="utf-8")
    assert name in text or card.guide == "guide"
    assert card.rests_on.endswith(".")
    assert card.next_step.endswith(".")


def test_a_plan_can_be_told_before_a_trial_is_run(name, spec):
    """A plan has words, and its pilot is made of tasks that run."""
    plan = _study(name, spec).plan()
    assert plan.lines
    assert plan.pilot
    assert all(trials > 0 for _, trials in plan.pilot)
    assert all(isinstance(item, Evaluation) for item in Evaluator(Streams(seed=0))([plan.pilot[0][0]]))


def test_the_key_tells_questions_apart(name, spec):
    """Made twice, a study has one key; a quick one asks another question."""
    study = registry.load("studies", name)
    assert _study(name, spec).key == _study(name, spec).key
    assert study.for_spec(spec, quick=False).key
