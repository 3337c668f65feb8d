"""The screen: priced first, scored by whoever works, and never stopped by an objective."""

import math
import time
from dataclasses import dataclass, replace
from typing import ClassVar

import pytest

from layoutopt.errors import StudyStopped
from layoutopt.protocols import ObjectiveCard
from layoutopt.scores import Score
from layoutopt.spec.reading import read_spec
from layoutopt.workers import Backend, Workers
from solvers.exhaustive import entered, scored, screen


@dataclass(frozen=True, slots=True, kw_only=True)
class Misbehaving:
    """An objective that does, for one layout, what ``deed`` says."""

    layout_key: str
    deed: str
    card: ClassVar[ObjectiveCard] = ObjectiveCard(
        summary="a test", reference="a test", scores={"tail_constant": "m"}, fidelity="exact"
    )

    def __call__(self, layout, scenario, outcomes):
        value = 1.0
        if layout.key == self.layout_key:
            if self.deed == "raise":
                raise ZeroDivisionError("of nothing")
            while self.deed == "hang":
                time.sleep(0.01)
            value = math.nan
        return {"tail_constant": Score(value=value, unit="m")}


@pytest.fixture
def problem(tiny_spec):
    """The tiny problem, with its cost and no other exact objective, so that it is quick."""
    found = read_spec(tiny_spec).problem()
    cost = tuple(item for item in found.objectives if "cost" in item.card.scores)
    return replace(found, objectives=cost, limits=())


def _with(problem, deed):
    chosen = next(item for item in screen(problem) if not item.refusal).evaluated.layout.key
    return chosen, replace(problem, objectives=(*problem.objectives, Misbehaving(layout_key=chosen, deed=deed)))


@pytest.mark.parametrize(
    ("deed", "reason"),
    [("raise", "raised an error: ZeroDivisionError: of nothing"), ("nan", "gave no number: NotANumber")],
)
def test_an_objective_that_fails_refuses_its_layout_only(problem, deed, reason):
    """What an objective raises, or a score that is no number, is the reason of a refusal; the rest may race."""
    chosen, problem = _with(problem, deed)
    found = {item.evaluated.layout.key: item for item in screen(problem)}
    assert found[chosen].rule == "scoring"
    assert f"cannot be scored: {reason}" in found[chosen].refusal
    others = [item for key, item in found.items() if key != chosen and "tail_constant" in item.evaluated.scores]
    assert len(others) == 8
    assert not any(item.refusal for item in others)


def test_an_objective_that_never_ends_refuses_its_layout_only(problem, capfd):
    """On workers an objective that hangs is ended after the longest time."""
    chosen, problem = _with(problem, "hang")
    workers = Workers(Backend.LOKY, jobs=2, longest_s=1.0)
    found = {item.evaluated.layout.key: item for item in screen(problem, workers=workers)}
    assert "cannot be scored: never ended" in found[chosen].refusal
    assert sum("tail_constant" in item.evaluated.scores for item in found.values()) == 8
    assert "Timeout" in capfd.readouterr().err


def test_workers_give_the_same_screen(tiny_spec):
    """Scores, refusals and order do not depend on who computed them."""
    problem = read_spec(tiny_spec).problem()
    assert screen(problem, workers=Workers(Backend.LOKY, jobs=2)) == screen(problem)


def test_entries_are_priced_only_and_in_the_order_of_the_screen(problem):
    """The quick first step refuses what cannot be built, prices the rest, and sorts as the whole screen does."""
    _, problem = _with(problem, "none")
    entries, whole = entered(problem), screen(problem)
    assert [item.evaluated.layout.key for item in entries] == [item.evaluated.layout.key for item in whole]
    assert {tuple(item.evaluated.scores) for item in entries} == {("cost",), ()}
    assert all(bool(item.refusal) == (not item.evaluated.scores) for item in entries)


def test_a_stop_ends_the_screen(problem):
    """A request to stop is no answer with layouts missing."""
    with pytest.raises(StudyStopped, match="before the first trial"):
        scored(problem, entered(problem), workers=Workers(stop=lambda: True))
