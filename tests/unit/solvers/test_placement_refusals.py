"""Questions of placement without an answer: a status and a sentence, never tags that answer nothing."""

from dataclasses import replace

import numpy as np
import pytest
from placement_cases import ROUGH, antennas_at, hall

from layoutopt.result import Status
from layoutopt.site import Site
from solvers.covering import search
from solvers.demands import Demand
from solvers.placement import floor_tags_of, place_tags
from solvers.placement_budget import cover_within, coverage_front
from solvers.placement_relaxation import ways_out
from solvers.slots import Slots, grid_slots


def test_a_budget_below_the_bound_is_refused_with_what_is_needed():
    """The sentence names the least cost; there are no tags to be taken for an answer."""
    question = hall()
    needed = place_tags(question, effort=ROUGH)
    cents = 200 * needed.new
    assert place_tags(question, budget_cents=cents, effort=ROUGH).new == needed.new
    refused = place_tags(question, budget_cents=cents - 1, effort=ROUGH)
    assert refused.status is Status.BUDGET_TOO_SMALL
    assert refused.xy_m is None
    assert refused.gap is None
    assert refused.bound == needed.new
    assert f"pays for {needed.new - 1} new tags" in refused.message
    assert f"has fewer than {needed.new}" in refused.message
    with pytest.raises(ValueError, match="no tag to lay"):
        floor_tags_of(refused, "label", (0.02, 0.01))


def test_more_tags_than_any_run_can_see_are_infeasible():
    """The runs that cannot be served are named."""
    placed = place_tags(hall(demands=(Demand(length_m=0.3, tags=40),)), effort=ROUGH)
    assert placed.status is Status.INFEASIBLE
    assert placed.xy_m is None
    assert len(placed.lost) > 0
    assert placed.samples == 0
    assert "runs see too few slots whatever is chosen, the first from" in placed.message


def test_rules_between_slots_that_leave_no_choice_are_infeasible():
    """Every run sees two slots that exclude each other and wants both."""
    question = hall(antennas=antennas_at([(0.0, 0.0)], 2.0), tags_per_tile=None, spacing_m=5.0)
    placed = place_tags(replace(question, demands=(Demand(length_m=0.3, tags=2),)), effort=ROUGH)
    assert placed.status is Status.INFEASIBLE
    assert placed.xy_m is None


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"required": np.arange(6) == 3, "forbidden": np.arange(6) == 3}, "required and forbidden at once"),
        ({"required": np.arange(6) < 2, "spacing_m": 0.5}, "are closer than 500 mm"),
        ({"required": np.arange(6) == 0, "installed_m": np.array([(0.41, 0.4)])}, "are closer than 20 mm"),
        ({"required": np.arange(6) < 6, "tags_per_tile": 1}, ""),
    ],
)
def test_required_tags_that_contradict_each_other_are_refused_with_their_places(given, words):
    """Where they do not, there is an answer."""
    question = hall(**given)
    placed = place_tags(question, effort=ROUGH)
    if not words:
        assert placed.xy_m is not None
        return
    for ending in (placed, cover_within(question, 10_000, effort=ROUGH)):
        assert (ending.status, ending.xy_m) == (Status.INFEASIBLE, None)
        assert words in ending.message
    refused = coverage_front(question, effort=ROUGH).refused
    assert words in refused.message
    assert not coverage_front(question, effort=ROUGH).complete
    assert ways_out(question, ROUGH)


def test_more_required_tags_than_a_tile_takes_are_refused_with_the_tile():
    """Two in one tile of 0.4 m that takes one."""
    question = hall()
    places_m = np.array([(0.5, 0.5), (0.6, 0.6), (1.0, 1.0)])
    slots = replace(question.slots, kind="listed", xy_m=places_m, place=None, pitch_m=None)
    placed = place_tags(hall(slots=slots, required=np.arange(3) < 2, tags_per_tile=1), effort=ROUGH)
    assert placed.status is Status.INFEASIBLE
    assert "2 tags must lie on the floor tile of (0.5, 0.5) m, which takes 1" in placed.message


def test_a_demand_that_speaks_of_no_run_is_refused_and_not_answered_by_no_tags():
    """Runs of five metres have no room in a hall of 1.6 m."""
    question = hall(demands=(Demand(length_m=0.3), Demand(length_m=5.0)))
    for ending in (place_tags(question, effort=ROUGH), cover_within(question, 400, effort=ROUGH)):
        assert (ending.status, ending.xy_m) == (Status.INFEASIBLE, None)
        assert "room for none of the runs that a demand speaks of: runs of 5 m see 1 tag" in ending.message
    assert ways_out(question, ROUGH) == ()


def test_without_a_slot_every_question_is_refused():
    """Nothing is chosen, and that is no answer; within a budget nothing is served."""
    none = Slots(kind="listed", xy_m=np.empty((0, 2)))
    placed = place_tags(hall(slots=none), effort=ROUGH)
    assert (placed.status, placed.xy_m) == (Status.INFEASIBLE, None)
    covered = cover_within(hall(slots=none), 1_000, effort=ROUGH)
    assert (covered.met_share, covered.new) == (0.0, 0)
    assert len(covered.lost) == covered.samples


def test_without_a_solver_the_answer_is_bounded_and_says_so(monkeypatch):
    """The local search still answers; nothing is called optimal that is not."""
    monkeypatch.setattr(search, "missing_solver", lambda: "nothing was solved exactly: no solver")
    question = hall(slots=grid_slots(hall().scenario.site, 0.2, 0.01))
    placed = place_tags(question, effort=replace(ROUGH, cover=replace(ROUGH.cover, iterations=1, exact_slots=0)))
    assert placed.status is Status.BOUNDED
    assert "no solver" in placed.message
    assert 0 < placed.bound < placed.new


@pytest.mark.parametrize("budget_cents", [None, 10_000])
def test_a_search_that_ends_without_any_choice_says_so(monkeypatch, budget_cents):
    """No tags, and no claim that there are none."""
    monkeypatch.setattr(search, "searched", lambda *given, **named: None)
    effort = replace(ROUGH, cover=replace(ROUGH.cover, exact_slots=0))
    placed = place_tags(hall(), budget_cents=budget_cents, effort=effort)
    assert (placed.status, placed.xy_m) == (Status.STOPPED_BY_LIMIT, None)
    assert "none was shown to be impossible" in placed.message
    assert placed.gap is None


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"demands": ()}, "at least one demand"),
        ({"tag_price_cents": 0}, "must cost something"),
        ({"tag_size_m": 0.0}, "size of a tag"),
        ({"spacing_m": float("nan")}, "the spacing"),
        ({"spacing_m": -0.1}, "the spacing"),
        ({"tags_per_tile": 0}, "at least one tag"),
        ({"forbidden": np.zeros(3, dtype=np.bool_)}, "3 marks of forbidden"),
        ({"required": np.zeros(3, dtype=np.bool_)}, "3 marks of required"),
        ({"installed_m": np.array([(0.5, np.inf)])}, "pairs of finite numbers"),
        ({"demands": (Demand(zone="attic"),)}, "names zone 'attic'"),
        ({"demands": (Demand(without=("attic",)),)}, "names zone 'attic'"),
        ({"unserved_share": 1.0}, "below one"),
    ],
)
def test_a_question_that_contradicts_itself_is_refused(values, words):
    """Each with a sentence."""
    with pytest.raises(ValueError, match=words):
        hall(**values)


def test_a_limit_of_tags_a_tile_needs_tiles():
    """A floor without tiles would count as one tile."""
    question = hall()
    bare = replace(question.scenario, site=Site(name="bare", floor=question.scenario.site.floor))
    with pytest.raises(ValueError, match="has no floor tiles"):
        replace(question, scenario=bare, tags_per_tile=1)
    with pytest.raises(ValueError, match="zero or more"):
        place_tags(question, budget_cents=-1)
