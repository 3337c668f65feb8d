"""Reader groups without any pattern: antennas at free places, of free side and height, by a global search."""

import math
from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from layoutopt.feasibility import check
from layoutopt.protocols import Evaluation
from layoutopt.scores import TrialOutcomes
from layoutopt.spec.reading import read_spec
from solvers.global_search import GlobalSearch
from solvers.stop import Never

FREE = '{ from = "-150 mm", to = "150 mm" }'
SPEC = """
schema = 1
[site]
floor = [[0,0],[2,0],[2,2],[0,2]]
[robots]
outline = [["-0.2 m","-0.2 m"],["0.2 m","-0.2 m"],["0.2 m","0.2 m"],["-0.2 m","0.2 m"]]
[parts]
reader_profile = "mi2016"
[space]
antenna_side = ["40 mm", "60 mm"]
antenna_height = { from = "12 mm", to = "20 mm" }
antennas_per_module = 1
readers = [READERS]
patterns = [{ family = "square", pitch = "150 mm" }]
[study]
duration = "5 s"
"""
ASYMMETRIC = f'{{ family = "listed", points = [[{FREE}, {FREE}], [{FREE}, {FREE}]] }}'
MIRRORED = (
    '{ family = "mirrored", points = [[{ from = "-150 mm", to = "150 mm" }, { from = "0 mm", to = "150 mm" }]] }'
)
SEARCH = GlobalSearch(
    population=20, generations=28, replications=1, race_trials=1, polish_evaluations=40, fresh_trials=2, seed=1
)


class FarFrom:
    """Made-up drives whose error grows with the way of the antennas from where they should be, in any order."""

    def __init__(self, places_m):
        self.places_m, self.layouts = np.array(places_m), {}

    def __call__(self, tasks):
        return [self._run(task) for task in tasks]

    def way_m(self, layout):
        found_m = layout.readers[0].poses[:, :2]
        return min(
            math.sqrt(((found_m - self.places_m[list(order)]) ** 2).sum())
            for order in permutations(range(len(self.places_m)))
        )

    def _run(self, task):
        self.layouts[task.layout.key] = task.layout
        group = task.layout.readers[0]
        error_m = 0.005 + self.way_m(task.layout) ** 2
        error_m += abs(float(group.poses[0, 2]) - 0.0162) + (0.01 if group.antenna.side_m == 0.04 else 0.0)
        numbers = np.arange(task.first, task.first + task.count)
        table = TrialOutcomes(
            replications=numbers, columns=("position_error_mean",), values=np.full((task.count, 1), error_m)
        )
        return Evaluation(group=task.group, first=task.first, outcomes=table, seconds=0.0)


@pytest.fixture
def problem_of(tmp_path):
    """Return the problem with a family of readers and one simulated goal."""

    def of(readers):
        path = tmp_path / "free.toml"
        path.write_text(SPEC.replace("READERS", readers), encoding="utf-8")
        problem = read_spec(path).problem()
        asked = ("cost", "position_error_mean")
        objectives = tuple(item for item in problem.objectives if set(asked) & set(item.card.scores))
        return replace(problem, limits=(), objectives=objectives)

    return of


@pytest.mark.parametrize(
    ("readers", "places_m", "free"),
    [(ASYMMETRIC, [(0.11, -0.04), (-0.06, 0.13)], 6), (MIRRORED, [(0.07, 0.12), (0.07, -0.12)], 4)],
    ids=["free", "mirrored"],
)
def test_antennas_come_to_where_they_should_be(problem_of, readers, places_m, free):
    """No arrangement is given: places to 15 mm, the height to a millimetre and the larger side are found.

    What overlaps or sticks out is never simulated, though most random groups of two such places can be built.
    """
    problem = problem_of(readers)
    assert len(problem.space.axes) == free
    evaluate = FarFrom(places_m)
    best = SEARCH(problem, evaluate, Never()).recommended["best"].layout
    group = best.readers[0]
    assert evaluate.way_m(best) < 0.015
    assert group.antenna.side_m == 0.06
    assert float(group.poses[0, 2]) == pytest.approx(0.0162, abs=0.001)
    assert len(evaluate.layouts) > 100
    assert not any(check(layout, problem.design) for layout in evaluate.layouts.values())


def test_places_that_exclude_each_other_are_shared_out(problem_of):
    """Both antennas should sit at one place: they end a least distance apart, as near to it as that allows."""
    problem = problem_of(ASYMMETRIC)
    evaluate = FarFrom([(0.05, 0.05), (0.05, 0.05)])
    best = SEARCH(problem, evaluate, Never()).recommended["best"].layout
    gap_m = float(np.linalg.norm(np.diff(best.readers[0].poses[:, :2], axis=0)))
    least_m = 1.1 * best.readers[0].antenna.side_m
    assert least_m <= gap_m < least_m + 0.01
    assert evaluate.way_m(best) == pytest.approx(least_m / math.sqrt(2.0), abs=0.01)


def test_an_objective_that_raises_refuses_its_layout_and_not_the_search(problem_of):
    """Antennas of 40 mm cannot be scored; the search goes on among the others and says why, if there are none."""
    problem = problem_of(MIRRORED)

    class Picky:
        card = problem.objectives[0].card

        def __init__(self, side_m):
            self._side_m = side_m

        def __call__(self, layout, scenario, outcomes):
            if layout.readers[0].antenna.side_m == self._side_m or not self._side_m:
                raise ZeroDivisionError("no such antenna")
            return problem.objectives[0](layout, scenario, outcomes)

    quick = replace(SEARCH, generations=3, polish_evaluations=0)
    evaluate = FarFrom([(0.07, 0.12), (0.07, -0.12)])
    some = replace(problem, objectives=(Picky(0.04), *problem.objectives[1:]))
    assert quick(some, evaluate, Never()).front.members
    assert {layout.readers[0].antenna.side_m for layout in evaluate.layouts.values()} == {0.06}
    fixed = problem_of('{ family = "mirrored", points = [["70 mm", "120 mm"]] }')
    nobody = quick(replace(fixed, objectives=(Picky(0.0), *fixed.objectives[1:])), evaluate, Never())
    assert not nobody.front.members
    assert "no such antenna" in nobody.shortfall
