"""Placement of single tags: equal to brute force on small floors, rules kept, nothing missed."""

from dataclasses import replace

import numpy as np
import pytest
from placement_cases import ROUGH, antennas_at, fewest, hall, plate
from scipy.spatial import cKDTree
from shapely.geometry import box

from layoutopt import feasibility
from layoutopt.layout import Layout
from layoutopt.protocols import Mount
from layoutopt.readers.mounting import mounted
from layoutopt.readers.profiles import PROFILES
from layoutopt.registry import load
from layoutopt.result import Status
from layoutopt.site import Zone
from solvers.demands import Demand, runs_of
from solvers.placement import floor_tags_of, place_tags, sampled
from solvers.placement_answer import fresh_runs, too_many
from solvers.placement_budget import cover_within
from solvers.placement_check import tags_in_view
from solvers.placement_model import contradiction, covering_of, missed_runs, served
from solvers.slots import Slots, grid_slots

HALF = Zone(name="left", region=box(0.0, 0.0, 0.8, 1.2))
FINE = replace(ROUGH, rounds=1, mending_rounds=4)


def _forbidden(question, *numbers):
    marks = np.zeros(len(question.slots), dtype=np.bool_)
    marks[list(numbers)] = True
    return marks


def _random_question(case):
    """Return a random question of seven slots with rules and marks of every kind."""
    draws = np.random.Generator(np.random.Philox([41, case]))
    marks = draws.integers(0, 6, 7)
    half = Zone(name="left", region=box(0.0, 0.0, 0.8, 1.2))
    demands = [
        Demand(length_m=float(draws.choice([0.0, 0.2, 0.4])), tags=int(draws.integers(1, 3)), zone=zone)
        for zone in ("", "left")[: draws.integers(1, 3)]
    ]
    return hall(
        slots=Slots(kind="listed", xy_m=draws.uniform((0.02, 0.02), (1.58, 1.18), (7, 2))),
        antennas=antennas_at(draws.uniform(-0.2, 0.2, (2, 2)), float(draws.uniform(0.3, 0.7))),
        demands=tuple(demands),
        zones=(half,),
        spacing_m=float(draws.choice([0.0, 0.3])),
        tags_per_tile=None if draws.random() < 0.5 else 1,
        installed_m=draws.uniform((0.02, 0.02), (1.58, 1.18), (draws.integers(0, 3), 2)),
        forbidden=marks == 0,
        required=marks == 1,
        unserved_share=0.9,
    )


def test_random_small_placements_have_as_few_tags_as_brute_force():
    """Of forty random questions each has the fewest tags of all subsets, or its rules leave none."""
    endings = set()
    for case in range(40):
        question = _random_question(case)
        placed = place_tags(question, effort=ROUGH)
        endings.add(placed.status)
        if contradiction(question):
            assert placed.message == contradiction(question)
            continue
        sample = sampled(question, ROUGH)
        kept = served(question, sample)
        looked_at = sum(map(len, sample))
        if too_many(len(kept.lost), looked_at, looked_at, question.unserved_share):
            assert "too few slots" in placed.message
            continue
        best = fewest(covering_of(question, kept.runs))
        if best is None:
            assert placed.status is Status.INFEASIBLE
            assert placed.xy_m is None
        else:
            assert placed.status is Status.OPTIMAL
            assert placed.new == placed.bound == best + question.required_count
    assert endings == {Status.OPTIMAL, Status.INFEASIBLE}


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
        {"required": np.arange(6) == 4},
    ],
)
def test_a_small_placement_has_as_few_tags_as_any_subset_of_slots(given):
    """Brute force over all subsets of the same sampled runs finds no fewer, and the answer says so."""
    question = hall(**given)
    placed = place_tags(question, effort=ROUGH)
    best = fewest(covering_of(question, sampled(question, ROUGH)))
    assert placed.status is Status.OPTIMAL
    assert placed.new == best + question.required_count == placed.bound
    assert placed.gap == 0.0


def test_the_independent_check_agrees_with_the_compiled_count():
    """Every fresh run counts as missed by plain numpy exactly if the compiled search says so."""
    question = hall(demands=(Demand(length_m=0.3), Demand(length_m=0.5, tags=2)))
    chosen = np.zeros(len(question.slots), dtype=np.bool_)
    chosen[::2] = True
    fresh = fresh_runs(question, ROUGH, 3)
    assert [len(runs) for runs in fresh] == [500, 500]
    for demand, runs in zip(question.demands, missed_runs(question, chosen, fresh), strict=True):
        assert 0 < len(runs) < 500
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


def test_a_required_slot_gets_a_tag_and_is_paid_for():
    """One more than without it where it serves nothing; the budget and the bound count it."""
    question = hall(antennas=antennas_at([(0.0, 0.0)], 0.6))
    corner = np.arange(len(question.slots)) == 0
    needed = place_tags(replace(question, forbidden=corner), effort=ROUGH)
    fixed = replace(question, required=corner)
    placed = place_tags(fixed, effort=ROUGH)
    assert (placed.xy_m == question.slots.xy_m[0]).all(axis=1).any()
    assert placed.bound == placed.new
    assert needed.new <= placed.new <= needed.new + 1
    cents = question.tag_price_cents * placed.new
    assert place_tags(fixed, budget_cents=cents, effort=ROUGH).new == placed.new
    assert place_tags(fixed, budget_cents=cents - 1, effort=ROUGH).status is Status.BUDGET_TOO_SMALL
    within = cover_within(fixed, question.tag_price_cents, effort=ROUGH)
    assert np.array_equal(within.xy_m, question.slots.xy_m[:1])
    for none in (
        place_tags(fixed, budget_cents=question.tag_price_cents - 1, effort=ROUGH),
        cover_within(fixed, question.tag_price_cents - 1, effort=ROUGH),
    ):
        assert (none.status, none.xy_m) == (Status.BUDGET_TOO_SMALL, None)


def test_an_installed_tag_costs_nothing_and_is_never_taken_away():
    """With all that is needed installed, nothing is laid."""
    once = place_tags(hall(), effort=FINE)
    again = place_tags(hall(installed_m=once.xy_m), effort=FINE)
    assert (again.new, again.bound, again.status) == (0, 0.0, Status.OPTIMAL)
    assert np.array_equal(again.xy_m, once.xy_m)


def test_a_share_of_runs_may_go_unserved_and_is_told():
    """Over a plate nothing is seen; with the share allowed the rest is served, with less it is refused."""
    question = hall(
        zones=(plate(0.5, 0.2, 1.1, 1.0),),
        demands=(Demand(length_m=0.1),),
        antennas=antennas_at([(0.0, 0.0)], 0.3),
    )
    runs = sampled(question, ROUGH)
    lost = served(question, runs).lost
    share = len(lost) / sum(map(len, runs))
    assert 0.0 < share < 0.6
    assert place_tags(question, effort=FINE).status is Status.INFEASIBLE
    assert place_tags(replace(question, unserved_share=share / 3.0), effort=FINE).status is Status.INFEASIBLE
    placed = place_tags(replace(question, unserved_share=min(1.6 * share, 0.9)), effort=FINE)
    assert placed.xy_m is not None
    assert len(placed.lost) >= len(lost)
    assert covering_of(question, [placed.lost]).hopeless().size == len(placed.lost)


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
    coarse = replace(ROUGH, step_m=0.4, headings=2, mending_rounds=12, trial_runs=2_000, check_runs=2_000)
    fine = grid_slots(hall().scenario.site, 0.1, 0.01)
    question = hall(slots=fine, antennas=antennas_at([(0.0, 0.0)], 0.15))
    before = place_tags(question, effort=replace(coarse, mending_rounds=0))
    after = place_tags(question, effort=coarse)
    assert before.missed[0].count > 20
    assert after.missed[0].count <= before.missed[0].count // 10
    assert after.new > before.new
    assert after.bound == before.bound


def test_mending_ends_when_a_look_misses_what_the_check_would_hardly_find():
    """With a check of one run the first look is enough; with one of many they go on to the last, which is told."""
    coarse = replace(ROUGH, step_m=0.4, headings=2, mending_rounds=3, trial_runs=2_000)
    question = hall(slots=grid_slots(hall().scenario.site, 0.1, 0.01), antennas=antennas_at([(0.0, 0.0)], 0.15))
    short = place_tags(question, effort=replace(coarse, check_runs=1))
    assert (short.rounds, short.message) == (2, "")
    long = place_tags(question, effort=replace(coarse, check_runs=10_000, mending_rounds=2))
    assert long.rounds == 3
    assert "ended before fresh runs missed little enough" in long.message
    assert long.new > short.new
    assert long.missed[0].runs == 10_000


def test_lost_runs_of_few_routes_refuse_no_question_that_chance_alone_may_have_made():
    """A hundred lost runs of a thousand are too many for 1 % if they are draws, and may be one route of ten."""
    assert too_many(100, 1000, 1000, 0.01)
    assert not too_many(100, 1000, 10, 0.01)
    assert too_many(900, 1000, 10, 0.01)
    assert too_many(1, 1000, 10, 0.0)
    assert not too_many(0, 1000, 10, 0.0)
