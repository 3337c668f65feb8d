"""Placement of single tags: equal to brute force on small floors, rules kept, refusals told."""

from dataclasses import replace

import numpy as np
import pytest
from placement_cases import ROUGH, antennas_at, fewest, hall, plate, scenario_of
from scipy.spatial import cKDTree
from shapely.geometry import box

from layoutopt import feasibility
from layoutopt.layout import Layout
from layoutopt.protocols import Mount
from layoutopt.readers.mounting import mounted
from layoutopt.readers.profiles import PROFILES
from layoutopt.registry import load
from layoutopt.result import Status
from layoutopt.scenario import Routes
from layoutopt.site import Site, Tiling, Zone
from solvers.demands import Demand, random_runs_of, runs_of
from solvers.placement import cover_within, floor_tags_of, place_tags, sampled, smallest_gap, staged
from solvers.placement_check import tags_in_view
from solvers.placement_model import TagPlacement, covering_of, missed_runs, servable
from solvers.slots import grid_slots, listed_slots

HALF = Zone(name="left", region=box(0.0, 0.0, 0.8, 1.2))
FINE = replace(ROUGH, rounds=1, mending_rounds=4)


def _forbidden(question, *numbers):
    marks = np.zeros(len(question.slots), dtype=np.bool_)
    marks[list(numbers)] = True
    return marks


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"demands": (Demand(length_m=0.3, tags=2),), "antennas": antennas_at([(0.0, 0.0)], 0.6)},
        {"demands": (Demand(length_m=0.0),), "antennas": antennas_at([(0.0, 0.0)], 0.45)},
        {"demands": (Demand(length_m=0.3, zone="left"), Demand(length_m=0.6)), "zones": (HALF,)},
        {"spacing_m": 0.5, "antennas": antennas_at([(0.0, 0.0)], 0.5)},
        {"tags_per_tile": 1, "antennas": antennas_at([(0.0, 0.0)], 0.6)},
        {"installed_m": np.array([(0.7, 0.7), (0.9, 0.5)])},
    ],
)
def test_a_small_placement_has_as_few_tags_as_any_subset_of_slots(given):
    """Brute force over all subsets of the same sampled runs finds no fewer, and the answer says so."""
    question = hall(**given)
    placed = place_tags(question, effort=ROUGH)
    best = fewest(covering_of(question, sampled(question, ROUGH)))
    assert placed.status is Status.OPTIMAL
    assert placed.new == best == placed.bound
    assert placed.gap == 0.0


def test_the_independent_check_agrees_with_the_compiled_count():
    """Every fresh run counts as missed by plain numpy exactly if the compiled search says so."""
    question = hall(demands=(Demand(length_m=0.3), Demand(length_m=0.5, tags=2)))
    chosen = np.zeros(len(question.slots), dtype=np.bool_)
    chosen[::2] = True
    missed, looked_at = missed_runs(question, chosen, 400, 9)
    assert looked_at == 800
    for demand, runs in zip(question.demands, missed, strict=True):
        assert 0 < len(runs) < 400
        assert (tags_in_view(runs, question.antennas, question.places_m[chosen]) < demand.tags).all()
        every = runs_of(demand, question.scenario, step_m=0.13, headings=7)
        table = covering_of(replace(question, demands=(demand,)), [every])
        plain = tags_in_view(every, question.antennas, question.places_m[chosen])
        assert (table.sees.counts(chosen) == plain).all()


def test_the_delivered_layout_keeps_spacing_tiles_installed_and_forbidden_tags():
    """Counted on the floor itself, and passed by the checks of whole layouts."""
    installed_m = np.array([(0.43, 0.37)])
    question = hall(
        antennas=antennas_at([(0.0, 0.0)], 0.7), spacing_m=0.45, tags_per_tile=1, installed_m=installed_m
    )
    question = replace(question, forbidden=_forbidden(question, 4, 5))
    placed = place_tags(question, effort=FINE)
    assert placed.xy_m is not None
    assert len(placed.xy_m) == placed.new + 1
    assert (placed.xy_m == installed_m[0]).all(axis=1).sum() == 1
    assert not len(cKDTree(placed.xy_m).query_pairs(0.45 - 1e-9))
    tiles = question.scenario.site.tile_of(placed.xy_m)
    assert len(np.unique(tiles, axis=0)) == len(tiles)
    assert cKDTree(placed.xy_m).query(question.slots.xy_m[[4, 5]])[0].min() > 0.01
    tags = floor_tags_of(placed, "label", (0.02, 0.01))
    assert np.allclose(np.sort(tags.lay_on(question.scenario.site).xy_m, axis=0), np.sort(placed.xy_m, axis=0))
    mount = Mount(antenna=load("antennas", "sphere")(side_m=0.04), height_m=0.01, profile=PROFILES["commercial"])
    group = mounted("listed", np.zeros((1, 2)), mount, {"count": 1})
    assert feasibility.check(Layout(floor_tags=tags, readers=(group,)), question.scenario) == ()


def test_an_installed_tag_costs_nothing_and_is_never_taken_away():
    """With all that is needed installed, nothing is laid."""
    once = place_tags(hall(), effort=FINE)
    again = place_tags(hall(installed_m=once.xy_m), effort=FINE)
    assert (again.new, again.bound, again.status) == (0, 0.0, Status.OPTIMAL)
    assert np.array_equal(again.xy_m, once.xy_m)


def test_stages_keep_what_was_laid_and_take_no_fewer_than_all_at_once():
    """Each stage holds the tags of the one before; together they have at least as many as one answer for all."""
    question = hall(zones=(HALF,), demands=(Demand(length_m=0.3, zone="left"), Demand(length_m=0.3)))
    first, second = staged(question, [["left"], [""]], effort=ROUGH)
    laid = {tuple(place) for place in first.xy_m}
    assert laid <= {tuple(place) for place in second.xy_m}
    assert len(second.xy_m) == first.new + second.new
    at_once = place_tags(question, effort=ROUGH)
    assert at_once.status is Status.OPTIMAL
    assert len(second.xy_m) >= at_once.new
    with pytest.raises(ValueError, match="no stage equips the whole floor"):
        staged(question, [["left"]], effort=ROUGH)
    with pytest.raises(ValueError, match="nothing is demanded"):
        staged(question, [["right"], ["left", ""]], effort=ROUGH)


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
    assert f"cost less than {cents / 100:.2f} EUR" in refused.message
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


def test_a_share_of_runs_may_go_unserved_and_is_told():
    """Over a plate nothing is seen; with the share allowed the rest is served, with less it is refused."""
    question = hall(
        zones=(plate(0.5, 0.2, 1.1, 1.0),),
        demands=(Demand(length_m=0.1),),
        antennas=antennas_at([(0.0, 0.0)], 0.3),
    )
    runs = sampled(question, ROUGH)
    _, lost = servable(question, runs)
    share = len(lost) / sum(map(len, runs))
    assert 0.0 < share < 0.6
    assert place_tags(question, effort=FINE).status is Status.INFEASIBLE
    assert place_tags(replace(question, unserved_share=share / 3.0), effort=FINE).status is Status.INFEASIBLE
    placed = place_tags(replace(question, unserved_share=min(1.6 * share, 0.9)), effort=FINE)
    assert placed.xy_m is not None
    assert len(placed.lost) >= len(lost)
    assert covering_of(question, [placed.lost]).hopeless().size == len(placed.lost)


def test_coverage_within_a_budget_is_the_most_that_any_subset_meets():
    """All pairs of slots are tried by hand; the bound is a share of the sampled runs."""
    question = hall()
    drawn = random_runs_of(question.demands[0], question.scenario, ROUGH.trial_runs, ROUGH.seed_of(0))
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
    assert gap is not None
    # The blind pieces lie on slots every 0.1 m, so that the best is (4 - 4 * 0.102) / 5 rounded up to slots.
    assert gap.impossible_m == pytest.approx(0.7)
    assert gap.length_m == pytest.approx(0.8)
    assert gap.placed.new <= 4
    assert smallest_gap(_corridor(), 0, longest_m=2.0, step_m=0.1, effort=effort) is None


def test_the_same_seed_gives_the_same_tags():
    """To the last bit; what was sampled and checked too."""
    one, other = (place_tags(hall(), effort=FINE) for _ in range(2))
    assert np.array_equal(one.xy_m, other.xy_m)
    assert (one.missed, one.samples, one.rounds, one.bound) == (
        other.missed,
        other.samples,
        other.rounds,
        other.bound,
    )


def test_a_search_that_is_stopped_says_so():
    """A stop before the first look at fresh runs is no proof of anything."""
    placed = place_tags(hall(), effort=FINE, stop=lambda: True)
    assert placed.status is Status.STOPPED_BY_LIMIT
    assert placed.message or placed.xy_m is None


def test_what_fresh_runs_still_miss_is_mended():
    """A sample of few headings leaves gaps; after mending trial runs of the same kind find none."""
    coarse = replace(ROUGH, step_m=0.4, headings=2, mending_rounds=12, trial_runs=2_000)
    fine = grid_slots(hall().scenario.site, 0.1, 0.01)
    question = hall(slots=fine, antennas=antennas_at([(0.0, 0.0)], 0.15))
    before = place_tags(question, effort=replace(coarse, mending_rounds=0))
    after = place_tags(question, effort=coarse)
    assert before.missed[0].count > 20
    assert after.missed[0].count <= before.missed[0].count // 10
    assert after.new > before.new
    assert after.bound == before.bound


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"demands": ()}, "at least one demand"),
        ({"tag_price_cents": 0}, "must cost something"),
        ({"tags_per_tile": 0}, "at least one tag"),
        ({"forbidden": np.zeros(3, dtype=np.bool_)}, "3 marks"),
        ({"unserved_share": 1.0}, "below one"),
    ],
)
def test_a_question_that_contradicts_itself_is_refused(values, words):
    """Each with a sentence."""
    with pytest.raises(ValueError, match=words):
        hall(**values)
