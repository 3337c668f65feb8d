"""The screen: priced first, scored by whoever works, and never stopped by an objective."""

import math
import time
from dataclasses import dataclass, replace
from typing import ClassVar

import pytest

from layoutopt.errors import StudyStopped
from layoutopt.problem import Limit
from layoutopt.protocols import ObjectiveCard
from layoutopt.result import Status
from layoutopt.scores import Score
from layoutopt.spec.reading import read_spec
from layoutopt.workers import Backend, Workers
from solvers.exhaustive import Exhaustive, entered, scored, screen
from solvers.stop import Never


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Sampled:
    """An objective of which every layout has nine hits in ten samples, and one a hit in each."""

    sure: str
    card: ClassVar[ObjectiveCard] = ObjectiveCard(
        summary="a test", reference="a test", scores={"pose_coverage": ""}, fidelity="sampled"
    )

    def __call__(self, layout, scenario, outcomes):
        hits = 400 if layout.key == self.sure else 360
        error = math.sqrt(hits / 400 * (1 - hits / 400) / 399)
        return {"pose_coverage": Score(value=hits / 400, unit="", standard_error=error, count=400, share=True)}


def _exhaustive(problem, limits):
    return Exhaustive()(replace(problem, goals=("cost",), limits=limits), None, Never())


def test_enumeration_recommends_only_what_is_shown_to_meet_a_sampled_limit(problem):
    """Nine of ten may be 87.2 %, which does not show 87.4 %; the one layout that does is the front, or none."""
    items = [item.evaluated for item in screen(problem) if not item.refusal]
    dearest = max(items, key=lambda item: item.scores["cost"].value).layout
    limits = (Limit(score="pose_coverage", lower=0.874),)
    one = replace(problem, objectives=(*problem.objectives, Sampled(sure=dearest.key)))
    found = _exhaustive(one, limits)
    assert found.status is Status.OPTIMAL
    assert [member.layout.key for member in found.front.members] == [dearest.key]
    none = replace(problem, objectives=(*problem.objectives, Sampled(sure="")))
    found = _exhaustive(none, limits)
    assert found.status is Status.TARGET_NOT_MET
    assert not found.recommended
    assert "share of poses that see a tag" in found.shortfall
    assert "87.4 % is demanded: 0." in found.shortfall
    with pytest.raises(ValueError, match="pose_coverage is sampled"):
        Exhaustive()(replace(one, goals=("cost", "pose_coverage")), None, Never())


def test_enumeration_says_why_it_has_no_answer(problem):
    """A budget below the cheapest layout, a space without layouts that can be built, and none at all."""
    poor = _exhaustive(problem, (Limit(score="cost", upper=10.0),))
    cheapest = min(
        item.evaluated.scores["cost"].value for item in screen(problem) if "cost" in item.evaluated.scores
    )
    assert poor.status is Status.BUDGET_TOO_SMALL
    assert f"cost of {cheapest:.6g} EUR exceeds 10 EUR" in poor.shortfall
    tiny = replace(problem.design.robot, outline_m=problem.design.robot.outline_m / 100.0)
    narrow = _exhaustive(replace(problem, design=replace(problem.design, robot=tiny)), ())
    assert narrow.status is Status.INFEASIBLE
    assert "beyond the robot's outline" in narrow.shortfall
    for result in (poor, narrow):
        assert not result.front.members
        assert result.bound is None


def test_a_stop_ends_the_screen(problem):
    """A request to stop is no answer with layouts missing."""
    with pytest.raises(StudyStopped, match="before the first trial"):
        scored(problem, entered(problem), workers=Workers(stop=lambda: True))
