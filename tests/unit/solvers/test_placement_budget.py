"""What a budget can show: most runs, the shortest runs, and the front of tags and runs."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from placement_cases import ROUGH, antennas_at, hall, plate, scenario_of
from shapely.geometry import box

from layoutopt.result import Status
from layoutopt.scenario import Routes
from layoutopt.site import Site, Tiling
from solvers.demands import Demand, random_runs_of
from solvers.placement import place_tags
from solvers.placement_budget import cover_within, coverage_front, smallest_gap
from solvers.placement_model import TagPlacement, covering_of
from solvers.slots import listed_slots


def test_coverage_within_a_budget_is_the_most_that_any_subset_meets():
    """All pairs of slots are tried by hand; the bound is a share of the sampled runs."""
    question = hall()
    drawn = random_runs_of(question.demands[0], question.scenario, ROUGH.budget_runs, ROUGH.seed_of(0), routes=8)
    problem = covering_of(question, [drawn])
    placed = cover_within(question, 400, effort=ROUGH)
    best = 0
    for one in range(problem.slot_count):
        for other in range(one):
            chosen = np.zeros(problem.slot_count, dtype=np.bool_)
            chosen[[one, other]] = True
            best = max(best, problem.worth_of(chosen))
    assert placed.status is Status.OPTIMAL
    assert placed.new <= 2
    assert placed.met_share == pytest.approx(best / problem.row_count)
    assert placed.bound == pytest.approx(placed.met_share)
    assert placed.gap == pytest.approx(0.0)
    everything = cover_within(question, 10**6, effort=ROUGH)
    assert everything.met_share == 1.0


def _corridor():
    """A line of way points along x over slots every 0.1 m; the antenna reads 0.05 m."""
    site = Site(name="corridor", floor=box(0.0, 0.0, 4.4, 0.6), tiling=Tiling(size_m=0.4))
    line = Routes(kind="way_points", way_points_m=np.array([(0.2, 0.3), (4.2, 0.3)]), start="first")
    slots = listed_slots(site, [(0.25 + 0.1 * number, 0.3) for number in range(40)], 0.01)
    return TagPlacement(
        scenario=replace(scenario_of(site, line), step_count=600),
        antennas=antennas_at([(0.0, 0.0)], 0.051),
        slots=slots,
        demands=(Demand(length_m=1.0, along_routes=True),),
        tag_size_m=0.02,
        tag_price_cents=100,
    )


def test_the_smallest_gap_of_a_corridor_is_known_from_both_sides():
    """n tags of 0.1 m view cut 4 m of way into n + 1 blind pieces: with 4 tags none can be under 0.72 m."""
    effort = replace(ROUGH, step_m=0.02, mending_rounds=2)
    gap = smallest_gap(_corridor(), 400, longest_m=2.0, step_m=0.1, effort=effort)
    # The blind pieces lie on slots every 0.1 m, so that the best is (4 - 4 * 0.102) / 5 rounded up to slots.
    assert gap.impossible_m == pytest.approx(0.7)
    assert gap.length_m == pytest.approx(0.8)
    assert gap.placed.new <= 4
    assert gap.decided
    refused = smallest_gap(_corridor(), 0, longest_m=2.0, step_m=0.1, effort=effort)
    assert (refused.length_m, refused.placed.status) == (None, Status.BUDGET_TOO_SMALL)
    assert not refused.decided


def test_poses_stay_poses_where_the_smallest_gap_of_runs_is_sought():
    """A demand of poses that nothing can meet refuses every length of the other."""
    question = _corridor()
    poses = Demand(length_m=0.0, tags=9, along_routes=True)
    gap = smallest_gap(
        replace(question, demands=(*question.demands, poses)), 4000, longest_m=1.0, step_m=0.5, effort=ROUGH
    )
    assert (gap.length_m, gap.placed.status) == (None, Status.INFEASIBLE)
    with pytest.raises(ValueError, match="all demands are of poses"):
        smallest_gap(replace(question, demands=(poses,)), 400, longest_m=1.0, effort=ROUGH)
    with pytest.raises(ValueError, match="no longer"):
        smallest_gap(question, 400, longest_m=0.05, step_m=0.1, effort=ROUGH)


def test_a_search_for_the_gap_that_is_stopped_claims_nothing_of_shorter_runs():
    """The longest length was met before the stop; what lies below is told to be open."""
    question, asked = _corridor(), []

    def stop():
        asked.append(None)
        return len(asked) > most

    most = 10**9
    longest = replace(question, demands=(replace(question.demands[0], length_m=2.0),))
    assert place_tags(longest, budget_cents=4000, effort=ROUGH, stop=stop).xy_m is not None
    most, asked = len(asked) + 1, []
    gap = smallest_gap(question, 4000, longest_m=2.0, step_m=0.1, effort=ROUGH, stop=stop)
    assert gap.placed.status is Status.STOPPED_BY_LIMIT
    assert gap.length_m > 0.1
    assert not gap.decided
    assert gap.impossible_m == 0.0


def _by_brute_force(question):
    """Return the least number of runs left out by so many tags or fewer, for every number of tags."""
    drawn = random_runs_of(question.demands[0], question.scenario, ROUGH.budget_runs, ROUGH.seed_of(0), routes=8)
    problem = covering_of(question, [drawn])
    slots = len(question.slots)
    least = np.full(slots + 1, problem.row_count)
    for number in range(2**slots):
        chosen = problem.locked.copy()
        chosen[:slots] |= (number >> np.arange(slots)) & 1 == 1
        count = int(chosen[:slots].sum())
        if not problem.broken_rules(chosen):
            least[count] = min(least[count], len(problem.unmet(chosen)))
    return np.minimum.accumulate(least), problem.row_count


SMALL = {"width_m": 1.3, "height_m": 1.0}


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"spacing_m": 0.5},
        {"installed_m": np.array([(0.6, 0.5)])},
        {"zones": (plate(0.5, 0.2, 0.8, 0.8),), "antennas": antennas_at([(0.0, 0.0)], 0.2)},
        {"required": np.arange(6) == 1},
    ],
)
def test_the_front_of_a_small_floor_is_the_one_of_all_subsets(given):
    """Complete, and each choice leaves as few runs unserved as any of as many tags."""
    question = hall(**SMALL, **given)
    least, runs = _by_brute_force(question)
    front = coverage_front(question, effort=replace(ROUGH, budgets=100))
    assert front.complete
    first = question.required_count
    members = [first + int(number) for number in np.flatnonzero(np.diff(least[first:], prepend=runs + 1) < 0)]
    assert [point.placed.new for point in front.points] == members
    assert [round((1.0 - point.placed.met_share) * runs) for point in front.points] == least[members].tolist()
    assert all(point.placed.status is Status.OPTIMAL for point in front.points)


def test_what_lies_between_coarse_budgets_is_an_open_range_with_a_bound_that_holds():
    """Two budgets: every better choice that was not looked at lies in a range, and none is above its bound."""
    question = hall(**SMALL)
    least, runs = _by_brute_force(question)
    front = coverage_front(question, effort=replace(ROUGH, budgets=2))
    found = {point.placed.new: round((1.0 - point.placed.met_share) * runs) for point in front.points}
    assert not front.complete
    assert len(found) < len(set(least.tolist()))
    for tags, unmet in enumerate(least.tolist()):
        best = min(value for new, value in found.items() if new <= tags)
        inside = [item for item in front.open_ranges if item.low_cost <= tags <= item.high_cost]
        assert best == unmet or inside
        assert all(unmet >= item.bound * runs - 1e-6 for item in inside if tags in found or best > unmet)
    assert all(left.high_cost < right.low_cost for left, right in pairwise(front.open_ranges))


def test_a_front_ends_at_its_budget_and_a_stopped_one_is_open():
    """With money for two tags no choice has three; a stop before the first answer leaves everything open."""
    question = hall(**SMALL)
    least, runs = _by_brute_force(question)
    front = coverage_front(question, budget_cents=2 * question.tag_price_cents, effort=ROUGH)
    assert front.points[-1].placed.new == 2
    assert round((1.0 - front.points[-1].placed.met_share) * runs) == least[2]
    stopped = coverage_front(question, effort=ROUGH, stop=lambda: True)
    assert not stopped.complete
    assert stopped.open_ranges
    with pytest.raises(ValueError, match="zero or more"):
        coverage_front(question, budget_cents=-1, effort=ROUGH)
