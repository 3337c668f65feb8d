"""Portfolios against brute force over all choices, and in words where fewer are found than asked for."""

from itertools import combinations

import numpy as np
import pytest
from scipy import optimize

from layoutopt import registry
from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.layout import FloorTags, Layout, ZonePattern
from layoutopt.protocols import Mount
from layoutopt.readers.profiles import PROFILES
from layoutopt.scores import Score
from solvers import portfolio as portfolios
from solvers.layout_difference import difference_matrix
from solvers.portfolio import far_apart, greedily_far_apart, portfolio


def layouts(*pitches_m, families=("square",), counts=(4,)):
    mount = Mount(antenna=SphereAntenna(side_m=0.06), height_m=0.024, profile=PROFILES["mi2016"])
    return [
        Layout(
            floor_tags=FloorTags(
                zones=(ZonePattern(zone="", pattern=registry.load("patterns", family)(pitch_m=pitch_m)),)
            ),
            readers=(registry.load("readers", "ring")(count=count, radius_m=0.15, mount=mount),),
        )
        for pitch_m in pitches_m
        for family in families
        for count in counts
    ]


def exact(*values):
    return [Score(value=value, unit="EUR") for value in values]


def random_problem(seed, number=11):
    generator = np.random.Generator(np.random.Philox(seed))
    places = generator.random((number, 2))
    differences = np.linalg.norm(places[:, None] - places[None, :], axis=2)
    return np.round(generator.random(number), 3), differences


def keeps(rows, differences, least):
    return all(differences[a, b] >= least for a, b in combinations(rows, 2))


def best_by_brute_force(values, differences, count, least, first):
    """Return the number of rows and the least sum of values over all choices that hold ``first``."""
    others = [row for row in range(len(values)) if row != first]
    for size in range(count, 0, -1):
        sums = [
            values[[first, *rows]].sum()
            for rows in combinations(others, size - 1)
            if keeps([first, *rows], differences, least)
        ]
        if sums:
            return size, min(sums)
    raise AssertionError


@pytest.mark.parametrize("seed", range(12))
def test_no_choice_has_more_layouts_or_a_smaller_sum(seed):
    """Random differences, from nearly free choice to so strict that fewer than asked can be had."""
    values, differences = random_problem(seed)
    first = int(values.argmin())
    for count, least in ((1, 0.5), (2, 0.5), (3, 0.3), (4, 0.5), (5, 0.6), (5, 1.2)):
        rows, proven = far_apart(values, differences, count=count, minimum_difference=least, first=first)
        assert proven
        assert rows[0] == first
        assert keeps(rows, differences, least)
        assert list(values[rows[1:]]) == sorted(values[rows[1:]])
        number, total = best_by_brute_force(values, differences, count, least, first)
        assert len(rows) == number
        assert values[rows].sum() == pytest.approx(total, abs=1e-9)


def test_greedy_choice_can_be_beaten():
    """The second best is close to the next two, which are far apart: greedy finds two, the program three."""
    values = np.array([0.0, 1.0, 2.0, 3.0])
    differences = np.ones((4, 4)) - np.eye(4)
    differences[1, 2:] = differences[2:, 1] = 0.1
    chosen = {"count": 3, "minimum_difference": 0.5, "first": 0}
    assert greedily_far_apart(values, differences, **chosen) == [0, 1]
    assert far_apart(values, differences, **chosen) == ([0, 2, 3], True)


def test_a_program_that_is_stopped_gives_the_greedy_choice_unproven(monkeypatch):
    """What the solver did not finish is not called proven."""
    values, differences = random_problem(3)
    monkeypatch.setattr(portfolios, "_solved", lambda *_, **__: ([], False))
    greedy = greedily_far_apart(values, differences, count=4, minimum_difference=0.3, first=0)
    rows, proven = far_apart(values, differences, count=4, minimum_difference=0.3, first=0)
    assert sorted(rows) == sorted(greedy)
    assert not proven


@pytest.mark.parametrize("claimed", [[1, 1, 1, 1, 1], [0, 0, 0, 0, 0]])
def test_a_choice_that_breaks_a_row_does_not_count(claimed, monkeypatch):
    """A solver that calls neighbours far apart, or nothing a choice of two, is not believed."""
    answer = optimize.OptimizeResult(x=np.array(claimed, dtype=float), status=0)
    monkeypatch.setattr(optimize, "milp", lambda *_, **__: answer)
    values, differences = np.arange(6.0), np.ones((6, 6)) - np.eye(6)
    differences[1, 2:] = differences[2:, 1] = 0.1
    chosen = {"count": 3, "minimum_difference": 0.5, "first": 0}
    rows, proven = far_apart(values, differences, **chosen)
    assert rows == greedily_far_apart(values, differences, **chosen)
    assert not proven


def test_without_a_known_goal_there_is_no_best():
    """In a sentence; a row that is named is started from all the same."""
    unknown = [Score(value=float("nan"), unit="m", standard_error=float("inf"), count=1)] * 2
    settings = {"count": 2, "minimum_difference": 0.2, "tolerance": 0.1}
    with pytest.raises(ValueError, match="none is the best"):
        portfolio(layouts(0.1, 0.2), unknown, **settings)
    assert portfolio(layouts(0.1, 0.2), unknown, **settings, best=1).chosen == (1,)


def test_near_optimal_layouts_that_differ_are_found():
    """Of six layouts within a tenth, three truly differ; the dear one is out and the best comes first."""
    items = layouts(0.1, 0.105, families=("square", "triangular"), counts=(4, 8))
    scores = exact(1.00, 1.09, 1.05, 1.02, 1.03, 1.04, 1.06, 1.50)
    found = portfolio(items, scores, count=3, minimum_difference=0.2, tolerance=0.1)
    assert found.chosen[0] == 0
    assert (found.near, found.proven, found.shortfall) == (7, True, "")
    assert len(found.chosen) == 3
    matrix = difference_matrix(items)
    assert keeps(found.chosen, matrix, 0.2 - 1e-9)
    assert 7 not in found.chosen


def test_a_layout_is_near_optimal_only_if_that_is_shown():
    """Both look equal to the best; the one with wide errors may be twice as bad. The best itself need not show
    it."""
    items = layouts(0.1, 0.2, 0.4)
    scores = [
        Score(value=1.0, unit="m", standard_error=0.01, count=50),
        Score(value=1.0, unit="m", standard_error=0.02, count=50),
        Score(value=1.0, unit="m", standard_error=0.5, count=50),
    ]
    found = portfolio(items, scores, count=3, minimum_difference=0.1, tolerance=0.1)
    assert (found.chosen, found.near) == ((0, 1), 2)
    assert found.shortfall == "2 instead of 3: of 3 layouts 2 are shown to be within 10 % of the best"
    paired = {1: Score(value=-0.1, unit="m", standard_error=0.01, count=50)}
    worse = Score(value=0.5, unit="m", standard_error=0.01, count=50)
    found = portfolio(
        items, scores, count=3, minimum_difference=0.1, tolerance=0.1, excess=lambda row: paired.get(row, worse)
    )
    assert found.near == 2


def test_it_says_why_there_are_fewer_than_asked_for():
    """Nothing near the best, or nothing that differs."""
    items = layouts(0.1, 0.101, 0.102)
    near = portfolio(items, exact(1.0, 1.01, 1.02), count=2, minimum_difference=0.2, tolerance=0.1)
    assert near.chosen == (0,)
    assert near.shortfall.endswith("within 10 % of the best, and no more than 1 of them differ by 0.2")
    far = portfolio(items, exact(1.0, 2.0, 3.0), count=2, minimum_difference=0.2, tolerance=0.1)
    assert far.shortfall == "1 instead of 2: of 3 layouts 1 is shown to be within 10 % of the best"


def test_a_given_best_is_what_all_are_measured_by():
    """The recommended layout need not have the smallest score."""
    items = layouts(0.1, 0.2, 0.4)
    found = portfolio(items, exact(1.0, 2.0, 2.1), count=3, minimum_difference=0.1, tolerance=0.1, best=1)
    assert found.chosen == (1, 0, 2)


@pytest.mark.parametrize(
    "changes", [{"count": 0}, {"minimum_difference": 1.5}, {"tolerance": -0.1}, {"tolerance": float("nan")}]
)
def test_numbers_outside_their_range_are_refused(changes):
    """In a sentence."""
    given = {"count": 2, "minimum_difference": 0.2, "tolerance": 0.1, **changes}
    with pytest.raises(ValueError, match="a portfolio needs"):
        portfolio(layouts(0.1), exact(1.0), **given)
    with pytest.raises(ValueError, match="make no portfolio"):
        portfolio([], [], count=1, minimum_difference=0.2, tolerance=0.1)
