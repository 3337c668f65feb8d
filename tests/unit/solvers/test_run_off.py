"""The run-off of a race: a replay that does not mind where it was interrupted."""

import numpy as np
import pytest

from layoutopt.evaluate import Evaluator
from layoutopt.spec.reading import read_spec
from layoutopt.streams import Streams
from solvers.allocation import probability_of_correct_selection
from solvers.exhaustive import screen
from solvers.racing import Racing
from solvers.run_off import run_off

SETTINGS = {"trials": 400, "confidence": 0.95, "indifference": 0.0}


def _world(seed=1, layouts=30):
    """Return costs and a long table in which every third layout is on the front."""
    draws = np.random.default_rng(seed)
    costs = np.arange(layouts, dtype=np.float64)
    means = np.where(costs % 3 == 0, 30.0, 33.0) - 0.6 * costs
    noise = draws.normal(0.0, 2.0, 500)[None, :] + draws.normal(0.0, 1.0, (layouts, 500))
    return costs, means[:, None] + noise


def _ended(costs, full, counts, candidates, reveal, **settings):
    """Run a run-off to its end; ``reveal`` says how much of what is wanted is there the next time."""
    available = counts.copy()
    while True:
        table = np.where(np.arange(full.shape[1]) < available[:, None], full, np.nan)
        found = run_off(table, costs, available, counts, candidates, **{**SETTINGS, **settings})
        if (available >= found.wanted).all():
            return found, available
        available = np.maximum(available, reveal(available, found.wanted))


def _one_at_a_time(seed):
    draws = np.random.default_rng(seed)

    def one(available, wanted):
        row = draws.choice(np.flatnonzero(available < wanted))
        return np.where(np.arange(len(wanted)) == row, wanted, available)

    return one


def _standardised(features):
    return (features - features.mean(axis=0)) / features.std(axis=0)


def _at_once(_, wanted):
    return wanted


def test_an_interrupted_run_off_ends_as_one_that_was_not():
    """Tasks that come one at a time, in any order, give the same trials and the same front."""
    costs, full = _world()
    counts, candidates = np.full(30, 4), np.ones(30, dtype=bool)
    whole, trials = _ended(costs, full, counts, candidates, _at_once)
    broken, others = _ended(costs, full, counts, candidates, _one_at_a_time(2))
    assert trials.tolist() == others.tolist()
    assert whole.found.members.tolist() == broken.found.members.tolist()
    assert whole.found.wrong.tolist() == broken.found.wrong.tolist()


def test_trials_beyond_what_is_wanted_are_not_looked_at():
    """A journal that holds more, from a run with other settings, changes nothing."""
    costs, full = _world()
    counts, candidates = np.full(30, 4), np.ones(30, dtype=bool)
    plain, _ = _ended(costs, full, counts, candidates, _at_once)
    rich = run_off(full, costs, np.full(30, 500), counts, candidates, **SETTINGS)
    assert plain.wanted.tolist() == rich.wanted.tolist()
    assert plain.found.wrong.tolist() == rich.found.wrong.tolist()


def test_no_layout_gets_more_than_the_most():
    """A table that ends there is enough, and what one may not have goes to others."""
    costs, full = _world()
    counts, candidates = np.full(30, 4), np.ones(30, dtype=bool)
    _, free = _ended(costs, full, counts, candidates, _at_once)
    _, bounded = _ended(costs, full, counts, candidates, _at_once, most=8)
    assert free.max() > 8 == bounded.max()
    assert (bounded > free).any()


def test_a_run_off_ends_when_it_is_sure_or_has_spent_its_trials():
    """An easy question leaves trials unspent, a hard one takes all and says that it is not sure."""
    costs, full = _world()
    counts, candidates = np.full(30, 4), np.ones(30, dtype=bool)
    easy, trials = _ended(costs, full, counts, candidates, _at_once, indifference=0.3)
    assert probability_of_correct_selection(easy.found) >= 0.95
    assert trials.sum() - counts.sum() < 400
    hard, trials = _ended(costs, full, counts, candidates, _at_once, trials=40)
    assert probability_of_correct_selection(hard.found) < 0.95
    assert trials.sum() - counts.sum() == 40
    none, trials = _ended(costs, full, counts, candidates, _at_once, trials=0)
    assert trials.tolist() == none.wanted.tolist() == counts.tolist()


def test_a_layout_dropped_by_bad_luck_comes_back():
    """A layout that left after few drives and is far better than its rival joins the front again."""
    costs, full = _world()
    full[16] -= 8.0
    counts = np.where(np.arange(30) == 16, 2, 8)
    candidates = np.arange(30) != 16
    found, trials = _ended(costs, full, counts, candidates, _at_once)
    assert trials[16] >= 8
    assert 16 in found.found.members


def test_drives_without_a_value_are_no_evidence():
    """Drives that entered no zone are left out of all comparisons, and the run-off still ends."""
    costs, full = _world()
    full[:, 1::2] = np.nan
    found, trials = _ended(costs, full, np.full(30, 4), np.ones(30, dtype=bool), _at_once)
    assert trials.sum() - 120 <= 400
    assert (found.found.pairs <= -(-trials[found.found.rows] // 2)).all()
    full[:] = np.nan
    found, trials = _ended(costs, full, np.full(30, 4), np.ones(30, dtype=bool), _at_once)
    assert probability_of_correct_selection(found.found) == 0.0


def test_a_front_that_borrows_is_replayed_like_any_other():
    """Features change who is a member, not that an interrupted run-off ends as one that was not."""
    costs, full = _world()
    features = _standardised(np.stack([costs, full.mean(axis=1)], axis=1))
    counts, candidates = np.full(30, 2), np.arange(30) < 20

    whole, trials = _ended(costs, full, counts, candidates, _at_once, features=features)
    broken, others = _ended(costs, full, counts, candidates, _one_at_a_time(3), features=features)
    assert whole.borrowed
    assert broken.borrowed
    assert trials.tolist() == others.tolist()
    assert whole.found.members.tolist() == broken.found.members.tolist()
    assert whole.found.members.max() >= 20, "the model may bring back what the rounds dropped"


def test_members_that_trials_speak_against_make_the_selection_unsure():
    """Features that name the worst layouts choose members, but the probability rests on the trials."""
    costs, full = _world(3, layouts=40)
    known = full[:, :2]
    features = _standardised(np.stack([costs, known.mean(axis=1)], axis=1))
    settings = {**SETTINGS, "trials": 0}
    counts, candidates = np.full(40, 2), np.ones(40, dtype=bool)
    plain = run_off(known, costs, counts, counts, candidates, **settings)
    drawn = run_off(known, costs, counts, counts, candidates, features=features[:, :1], **settings)
    assert drawn.borrowed
    assert not plain.borrowed
    assert drawn.found.members.tolist() != plain.found.members.tolist()
    against = drawn.found.margin < 0.0
    assert against.any()
    assert (drawn.found.wrong[against] >= 0.5).all()
    assert drawn.found.wrong.sum() > plain.found.wrong.sum()


def test_without_a_model_the_front_is_that_of_the_trials():
    """A goal with a zero has no logarithm: the front is the plain one, and it says so."""
    costs, full = _world()
    full[4] = 0.0
    counts, candidates = np.full(30, 4), np.ones(30, dtype=bool)
    plain, _ = _ended(costs, full, counts, candidates, _at_once)
    same, _ = _ended(costs, full, counts, candidates, _at_once, features=_standardised(costs[:, None]))
    assert not same.borrowed
    assert same.found.members.tolist() == plain.found.members.tolist()


@pytest.fixture(scope="module")
def problem(tiny_text, tmp_path_factory):
    """The tiny problem with one pitch more, so that there are enough layouts to borrow from."""
    path = tmp_path_factory.mktemp("run_off") / "tiny.toml"
    path.write_text(tiny_text.replace("steps = 3", "steps = 4"), encoding="utf-8")
    return read_spec(path).problem()


@pytest.mark.parametrize("borrowing", [False, True])
def test_a_race_that_is_killed_ends_as_one_that_was_not(problem, borrowing):
    """Whatever part of a round the journal holds, the same layouts end with the same trials."""
    racing, evaluate = Racing(trials=90, borrowing=borrowing), Evaluator(Streams(seed=1))
    contenders = [item.evaluated for item in screen(problem) if not item.refusal]

    def ended(part):
        known = []
        while (now := racing.standing(problem, contenders, known)).tasks:
            known += evaluate(now.tasks[: part(len(now.tasks))])
            if now.correct_selection is not None and part(2) == 1:
                break
        while (now := racing.standing(problem, contenders, known)).tasks:
            known += evaluate(now.tasks)
        return now

    assert len(contenders) == 12
    whole, killed = ended(lambda count: count), ended(lambda count: max(1, count // 2))
    assert whole == killed
    assert 0.0 <= whole.correct_selection <= 1.0
    assert whole.correct_selection == max(0.0, 1.0 - whole.misjudged)
    assert whole.borrowed == borrowing
    assert {item.layout.key for item in whole.front} <= {item.layout.key for item in whole.finalists}
    costs = [item.scores[problem.goals[0]].value for item in whole.front]
    assert costs == sorted(set(costs))
