"""The smallest set of limits in conflict and the least that has to give, against brute force."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from layoutopt import registry
from layoutopt.layout import WHOLE_FLOOR, FloorTags, Layout, ZonePattern
from layoutopt.problem import Limit
from layoutopt.protocols import Mount
from layoutopt.readers.profiles import MI2016
from layoutopt.result import Evaluated
from layoutopt.scores import Score
from solvers.conflicts import conflict_text, conflicts_of, relaxations_of, shortfalls, smallest_conflicts

LIMITS = (
    Limit(score="cost", upper=2000.0),
    Limit(score="position_error_mean", upper=0.010),
    Limit(score="pose_coverage", lower=0.9),
)


def _layout(number):
    pattern = registry.load("patterns", "square")(pitch_m=0.1 + 0.01 * number)
    mount = Mount(antenna=registry.load("antennas", "sphere")(side_m=0.06), height_m=0.02, profile=MI2016)
    return Layout(
        floor_tags=FloorTags(zones=(ZonePattern(zone=WHOLE_FLOOR, pattern=pattern),)),
        readers=(registry.load("readers", "ring")(count=3, radius_m=0.15, mount=mount),),
    )


LAYOUTS = [_layout(number) for number in range(8)]


def _item(number, cost, error_m, coverage=1.0):
    return Evaluated(
        layout=LAYOUTS[number],
        scores={
            "cost": Score(value=cost, unit="EUR"),
            "position_error_mean": Score(value=error_m, unit="m"),
            "pose_coverage": Score(value=coverage, unit=""),
        },
    )


def test_a_layout_that_meets_everything_leaves_no_conflict():
    """Then there is nothing to say."""
    found = conflicts_of(LIMITS, [_item(0, 3000.0, 0.02), _item(1, 1500.0, 0.009)])
    assert found.sets == ()
    assert found.relaxations == ()
    assert conflict_text(found) == ""


def test_budget_and_target_that_exclude_each_other_are_named_with_both_ways_out():
    """The dear layout is accurate, the cheap one is not: either 340 EUR more or 13.1 mm."""
    found = conflicts_of(LIMITS, [_item(0, 2340.0, 0.009), _item(1, 1900.0, 0.0131), _item(2, 1000.0, 0.04)])
    assert found.sets == ((LIMITS[0], LIMITS[1]),)
    assert [way.item.layout for way in found.relaxations] == [LAYOUTS[0], LAYOUTS[1]]
    assert found.relaxations[0].share == pytest.approx(340.0 / 2000.0)
    assert found.relaxations[1].gives[0].end == pytest.approx(0.0131)
    text = conflict_text(found)
    assert "are not met together by any of 3 layouts judged" in text
    assert "+340.00 EUR" in text
    assert "mean position error at most 13.1 mm" in text


def test_a_limit_that_nothing_meets_is_a_conflict_of_its_own():
    """One limit alone is the smallest set, whatever else is missed."""
    found = conflicts_of(LIMITS, [_item(0, 2340.0, 0.011), _item(1, 1900.0, 0.0131)])
    assert found.sets == ((LIMITS[1],),)
    assert "is not met by any of 2 layouts" in conflict_text(found)


def test_all_smallest_sets_are_listed():
    """Three layouts that each miss another limit exclude no pair; two leave every pair they break."""
    three = [_item(0, 2100.0, 0.009), _item(1, 1900.0, 0.011), _item(2, 1900.0, 0.009, 0.8)]
    assert conflicts_of(LIMITS, three).sets == (LIMITS,)
    two = [_item(0, 2100.0, 0.011), _item(1, 1900.0, 0.009, 0.8)]
    assert conflicts_of(LIMITS, two).sets == ((LIMITS[0], LIMITS[2]), (LIMITS[1], LIMITS[2]))


def test_simulated_limits_give_up_to_their_confidence_bound():
    """A mean within the limit whose bound is not has to be allowed its bound."""
    score = Score(value=0.0099, unit="m", standard_error=0.001, count=30)
    limit = LIMITS[1]
    item = Evaluated(layout=LAYOUTS[0], scores={"position_error_mean": score})
    found = conflicts_of((limit,), [item])
    assert found.relaxations[0].gives[0].end == pytest.approx(score.upper(0.95))


def test_a_lower_limit_gives_downwards():
    """At least 90 % becomes at least 80 %."""
    found = conflicts_of(LIMITS, [_item(0, 1900.0, 0.009, 0.8)])
    assert found.relaxations[0].gives[0].end == pytest.approx(0.8)
    assert "at least 80 %" in conflict_text(found)


def test_what_is_not_known_is_no_way_out():
    """A layout without a score may be a conflict's witness against, never its cure."""
    unknown = Evaluated(layout=LAYOUTS[0], scores={"cost": Score(value=100.0, unit="EUR")})
    nothing = Evaluated(
        layout=LAYOUTS[1],
        scores={
            **_item(1, 100.0, 0.005).scores,
            "position_error_mean": Score(value=math.nan, unit="m", standard_error=math.inf, count=1),
        },
    )
    found = conflicts_of(LIMITS, [unknown, nothing])
    assert np.isinf(shortfalls(LIMITS, [unknown, nothing])[:, 1]).all()
    assert found.sets == ((LIMITS[1],),)
    assert found.relaxations == ()
    assert "it would take" not in conflict_text(found)


def test_without_candidates_nothing_is_said():
    """No layout judged, no statement about layouts."""
    assert conflict_text(conflicts_of(LIMITS, [])) == ""


def test_a_larger_set_is_offered_only_where_no_smaller_one_helps():
    """All three limits have to give for the only layout there is."""
    found = conflicts_of(LIMITS, [_item(0, 2100.0, 0.011, 0.8)])
    assert len(found.relaxations) == 1
    assert len(found.relaxations[0].gives) == 3


@given(arrays(np.bool_, st.tuples(st.integers(1, 6), st.integers(1, 5))))
def test_the_smallest_conflicts_are_those_of_brute_force(met):
    """Over all subsets: no smaller set is in conflict, and the list is complete."""
    rows = [set(np.flatnonzero(row)) for row in met]
    every = [
        set(chosen)
        for size in range(1, met.shape[1] + 1)
        for chosen in itertools.combinations(range(met.shape[1]), size)
    ]
    clashing = [chosen for chosen in every if not any(chosen <= row for row in rows)]
    least = min(map(len, clashing), default=0)
    assert [set(found) for found in smallest_conflicts(met)] == [
        chosen for chosen in clashing if len(chosen) == least
    ]


@given(st.lists(st.tuples(*[st.sampled_from([0.5, 1.0, 1.1, 1.5, 2.0])] * 3), min_size=1, max_size=8))
def test_each_relaxation_is_the_least_of_brute_force(ratios):
    """For every set of at most two limits, no layout that meets all others misses these by less."""
    candidates = [
        _item(number, 2000.0 * cost, 0.010 * error, 0.9 / cover)
        for number, (cost, error, cover) in enumerate(ratios)
    ]
    gap = shortfalls(LIMITS, candidates)
    shares = gap / np.array([limit.end for limit in LIMITS])
    found = relaxations_of(LIMITS, candidates, gap)
    told = {tuple(LIMITS.index(give.limit) for give in way.gives): way.share for way in found}
    for size in (1, 2):
        for chosen in itertools.combinations(range(3), size):
            exactly = [
                float(row.sum()) for row in shares if {int(place) for place in np.flatnonzero(row)} == set(chosen)
            ]
            if exactly:
                assert told[chosen] == pytest.approx(min(exactly))
            else:
                assert chosen not in told
    assert [way.share for way in found] == sorted(way.share for way in found)
    for way in found:
        eased = {give.limit.score: give.end for give in way.gives}
        for limit in LIMITS:
            end = eased.get(limit.score, limit.end)
            assert limit.excess(way.item.scores[limit.score].value) - abs(end - limit.end) <= 1e-9 * end
