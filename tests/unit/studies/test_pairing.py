"""What common drives save: known variance ratios, intervals that hold, and the comparisons that a race makes."""

import math

import numpy as np
import pytest
from shapely.geometry import box

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.estimators.midrange import Midrange
from layoutopt.estimators.odometry import OdometryAlone
from layoutopt.layout import FloorTags, Layout, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.problem import Problem
from layoutopt.protocols import Mount, group_of
from layoutopt.readers.cross import cross
from layoutopt.readers.profiles import COMMERCIAL
from layoutopt.result import Evaluated, Front
from layoutopt.robot import Robot
from layoutopt.scenario import Role, Scenario
from layoutopt.scores import Score, TrialOutcomes, paired_difference
from layoutopt.site import Site
from layoutopt.space import DesignSpace, Family
from solvers.front import front_of
from studies.output import write_pairing
from studies.pairing import (
    Pair,
    VarianceRatio,
    mean_variance_ratio,
    pair_of,
    pairing_lines,
    pairing_of,
    pairing_text,
    ratio_text,
)

GOAL = "position_error_mean"
GOALS = ("cost", GOAL)
ROBOT = Robot(outline_m=[(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3)])
DESIGN = Scenario(name="design", role=Role.DESIGN, site=Site(name="room", floor=box(0, 0, 4, 4)), robot=ROBOT)
ESTIMATORS = (Midrange(), OdometryAlone())
PITCHES_M = (0.1, 0.2, 0.3, 0.4, 0.5)
PROBLEM = Problem(
    space=DesignSpace(
        readers=(Family(name="cross", build=cross, values={"count": (4,)}),),
        patterns={"": (Family(name="square", build=square, values={"pitch_m": PITCHES_M}),)},
    ),
    design=DESIGN,
    held_out=(),
    objectives=(),
    goals=GOALS,
    limits=(),
    estimators=ESTIMATORS,
)
MOUNT = Mount(antenna=SphereAntenna(side_m=0.06), height_m=0.02, profile=COMMERCIAL)
LAYOUTS = [
    Layout(
        floor_tags=FloorTags(zones=(ZonePattern(zone="", pattern=square(pitch_m=pitch_m)),)),
        readers=(cross(count=4, mount=MOUNT),),
    )
    for pitch_m in PITCHES_M
]


def pair(first, second, replications=None):
    first, second = np.array(first, dtype=np.float64), np.array(second, dtype=np.float64)
    return Pair(
        replications=np.arange(len(first)) if replications is None else np.array(replications),
        first=first,
        second=second,
    )


def table(values, replications=None):
    values = np.array(values, dtype=np.float64)
    numbers = np.arange(len(values)) if replications is None else replications
    return TrialOutcomes(replications=numbers, columns=(GOAL,), values=values.reshape(-1, 1))


def search(*rows, estimator=ESTIMATORS[0]):
    """Return finalists, front and outcomes of a search, given cost and values of each layout in turn."""
    finalists, known = [], {}
    for layout, (cost, values) in zip(LAYOUTS, rows, strict=False):
        outcomes = table(values)
        known[group_of(layout, DESIGN, estimator)] = outcomes
        finalists.append(
            Evaluated(layout=layout, scores={"cost": Score(value=cost, unit="EUR"), GOAL: outcomes.score(GOAL)})
        )
    return finalists, front_of(finalists, GOALS), known


def test_a_ratio_by_hand():
    """Values 1, 2, 3, 6 and 2, 2, 4, 4: variances 14/3 and 4/3, differences -1, 0, -1, 2 of variance 2."""
    found = mean_variance_ratio([pair([1, 2, 3, 6], [2, 2, 4, 4])])
    assert found.value == pytest.approx(2.0 / (14.0 / 3.0 + 4.0 / 3.0))
    assert 0.0 < found.low < found.value < found.high < 2.0


def test_the_interval_is_the_jackknife_written_out():
    """The spread of log(ratio / (2 - ratio)) with one replication left out, and Student's quantile."""
    first, second = np.array([1.0, 2.0, 3.0, 6.0]), np.array([2.0, 2.0, 4.0, 4.5])

    def logit(x, y):
        ratio = np.var(x - y, ddof=1) / (np.var(x, ddof=1) + np.var(y, ddof=1))
        return math.log(ratio / (2.0 - ratio))

    left_out = [logit(np.delete(first, row), np.delete(second, row)) for row in range(4)]
    spread = math.sqrt(3.0 / 4.0 * sum((one - np.mean(left_out)) ** 2 for one in left_out))
    ends = [logit(first, second) + sign * 3.182446305 * spread for sign in (-1, 1)]
    found = mean_variance_ratio([pair(first, second)])
    assert [found.low, found.high] == pytest.approx([2.0 / (1.0 + math.exp(-end)) for end in ends], rel=1e-6)


def test_perfectly_correlated_values_need_no_trials():
    """A layout that is worse by the same amount on every drive: nothing is left of the variance."""
    found = mean_variance_ratio([pair([1, 2, 3, 4], [5, 6, 7, 8])])
    assert (found.value, found.low, found.high) == (0.0, 0.0, 0.0)


def test_opposite_values_need_twice_the_trials():
    """What is hard for one is easy for the other: the variance of the difference is twice the sum."""
    assert mean_variance_ratio([pair([1, 2, 3, 4], [4, 3, 2, 1])]).value == pytest.approx(2.0)


def test_independent_values_save_nothing():
    """On drives of their own the ratio is 1 but for chance: deviation 1/sqrt(n), false alarm 1e-6."""
    first, second = np.random.Generator(np.random.Philox(1)).normal(size=(2, 20_000))
    found = mean_variance_ratio([pair(first[:400], second[:400])])
    assert found.value == pytest.approx(1.0, abs=4.9 / math.sqrt(400))
    assert found.low < 1.0 < found.high
    assert found.high - found.low < 0.3
    whole = np.var(first - second, ddof=1) / (np.var(first, ddof=1) + np.var(second, ddof=1))
    assert whole == pytest.approx(1.0, abs=4.9 / math.sqrt(20_000))


def test_scale_and_shift_in_common_do_not_matter():
    """Millimetres or metres, and whatever the layouts have in common on average."""
    draws = np.random.Generator(np.random.Philox(2)).normal(size=(2, 12))
    found = mean_variance_ratio([pair(*draws)])
    moved = mean_variance_ratio([pair(1000.0 * draws[0] + 7.0, 1000.0 * draws[1] - 3.0)])
    for end in ("value", "low", "high"):
        assert getattr(moved, end) == pytest.approx(getattr(found, end))


@pytest.mark.parametrize("count", [4, 16, 64])
@pytest.mark.parametrize("scale", [1.0, 3.0])
def test_the_interval_of_a_ratio_holds_its_promise(count, scale):
    """95 % intervals over 1000 samples of normal pairs with correlation 0.7 hold the true ratio.

    The share has a standard deviation of 0.69 %; beyond 4 of them lies a right interval once in 16 000 runs. One
    more per cent is for the approximation.
    """
    draws = np.random.Generator(np.random.Philox(3))
    true = (1.0 + scale**2 - 2.0 * 0.7 * scale) / (1.0 + scale**2)
    held = 0
    for _ in range(1000):
        common, first, second = draws.normal(size=(3, count))
        found = mean_variance_ratio(
            [
                pair(
                    math.sqrt(0.7) * common + math.sqrt(0.3) * first,
                    scale * (math.sqrt(0.7) * common + math.sqrt(0.3) * second),
                )
            ]
        )
        held += found.low <= true <= found.high
    assert held / 1000 == pytest.approx(0.95, abs=4 * math.sqrt(0.95 * 0.05 / 1000) + 0.01)


def test_the_interval_of_a_mean_knows_that_pairs_share_drives():
    """Six pairs of seven layouts on 32 common drives: 95 % intervals over 400 searches hold the true mean ratio.

    Taken for independent pairs, the interval would be too narrow. The share has a standard deviation of 1.1 %;
    beyond 4 of them and a per cent for the approximation lies a right interval once in 16 000 runs.
    """
    draws = np.random.Generator(np.random.Philox(4))
    held = 0
    for _ in range(400):
        common = draws.normal(size=32)
        values = math.sqrt(0.6) * common + math.sqrt(0.4) * draws.normal(size=(7, 32))
        found = mean_variance_ratio([pair(values[row + 1], values[row]) for row in range(6)])
        held += found.low <= 0.4 <= found.high
    assert held / 400 == pytest.approx(0.95, abs=4 * math.sqrt(0.95 * 0.05 / 400) + 0.01)


def test_a_mean_over_pairs_of_different_length():
    """The mean is that of the ratios; replications that a pair lacks do not touch its own."""
    draws = np.random.Generator(np.random.Philox(5)).normal(size=(4, 40))
    long, short = pair(draws[0], draws[1]), pair(draws[2, :5], draws[3, :5])
    alone = [mean_variance_ratio([one]) for one in (long, short)]
    found = mean_variance_ratio([long, short])
    assert found.value == pytest.approx((alone[0].value + alone[1].value) / 2.0)
    assert found.low < found.value < found.high
    assert found.high - found.low > (alone[1].high - alone[1].low) / 4.0


def test_a_ratio_that_is_not_known():
    """No trial, one trial, or values that never change: no ratio; two trials: a ratio without interval."""
    for unknown in (pair([], []), pair([1.0], [2.0]), pair([1.0, 1.0, 1.0], [2.0, 2.0, 2.0])):
        found = mean_variance_ratio([unknown])
        assert math.isnan(found.value)
        assert ratio_text(found) == "not known"
    two = mean_variance_ratio([pair([1.0, 2.0], [1.0, 3.0])])
    assert two.value == pytest.approx(0.5 / 2.5)
    assert math.isnan(two.low)
    assert math.isnan(two.high)
    assert ratio_text(two) == "0.20 (interval not known)"
    assert math.isnan(mean_variance_ratio([]).value)


def test_a_pair_is_what_both_have():
    """Replications of one table alone, and those in which one has no value, are left out."""
    first = table([1.0, math.nan, 3.0, 4.0], [0, 1, 2, 5])
    second = table([20.0, 30.0, 40.0], [1, 2, 5])
    found = pair_of(first, second, GOAL)
    assert found.replications.tolist() == [2, 5]
    assert found.first.tolist() == [3.0, 4.0]
    assert found.second.tolist() == [30.0, 40.0]


def test_rivals_are_the_best_that_cost_no_more():
    """Costs 1 to 5 with mean errors 5, 3, 4, 2.5, 2.6: the third and the fifth are off the front."""
    ramp = np.array([-0.1, 0.0, 0.1, 0.2])
    means = (5.0, 3.0, 4.0, 2.5, 2.6)
    finalists, front, known = search(*[(float(row + 1), mean + ramp) for row, mean in enumerate(means)])
    found = pairing_of(PROBLEM, finalists, front, known)
    rows = {layout.key: row for row, layout in enumerate(LAYOUTS)}
    pairs = [(rows[item.layout.key], rows[item.rival.key], item.on_front) for item in found.comparisons]
    assert pairs == [(1, 0, True), (2, 1, False), (3, 1, True), (4, 3, False)]
    assert [item.difference.value for item in found.comparisons] == pytest.approx([-2.0, 1.0, -0.5, 0.1])
    assert (found.front.comparisons, found.finalists.comparisons) == (2, 4)


def test_comparisons_hold_the_numbers_of_the_trials():
    """Common replications, paired difference and ratio of each; means over the front and over all."""
    draws = np.random.Generator(np.random.Philox(6)).normal(size=(3, 16))
    finalists, front, known = search((1.0, 3.0 + draws[0]), (2.0, 9.0 + draws[1, :8]), (3.0, draws[2, :12]))
    found = pairing_of(PROBLEM, finalists, front, known)
    tables = [known[group_of(layout, DESIGN, ESTIMATORS[0])] for layout in LAYOUTS[:3]]
    assert [item.trials for item in found.comparisons] == [8, 12]
    assert [item.on_front for item in found.comparisons] == [False, True]
    for item, row in zip(found.comparisons, (1, 2), strict=True):
        assert item.difference == paired_difference(tables[row], tables[0], GOAL)
        assert item.ratio == mean_variance_ratio([pair_of(tables[row], tables[0], GOAL)])
    assert found.front.ratio == found.comparisons[1].ratio
    assert (found.front.fewest_trials, found.front.most_trials) == (12, 12)
    assert found.finalists.ratio.value == pytest.approx(np.mean([item.ratio.value for item in found.comparisons]))
    assert (found.finalists.fewest_trials, found.finalists.most_trials) == (8, 12)


def test_only_trials_of_the_search_count():
    """Outcomes of another estimator on the same drives change nothing."""
    draws = np.random.Generator(np.random.Philox(7)).normal(size=(4, 8))
    finalists, front, known = search((1.0, 9.0 + draws[0]), (2.0, draws[1]))
    _, _, other = search((1.0, draws[2]), (2.0, draws[3]), estimator=ESTIMATORS[1])
    assert pairing_of(PROBLEM, finalists, front, {**known, **other}) == pairing_of(
        PROBLEM, finalists, front, known
    )


def test_the_line_states_ratio_interval_comparisons_and_trials():
    """One line; the share on the front first, then that of all finalists."""
    draws = np.random.Generator(np.random.Philox(8)).normal(size=(3, 16))
    finalists, front, known = search((1.0, 3.0 + draws[0]), (2.0, 9.0 + draws[1, :8]), (3.0, draws[2]))
    found = pairing_of(PROBLEM, finalists, front, known)
    assert pairing_lines(found) == [
        "comparisons of the mean position error on common drives need this share of the trials that independent "
        f"ones would: {ratio_text(found.front.ratio)} between neighbours on the front (1 comparison of 16 trials)"
        f", {ratio_text(found.finalists.ratio)} between finalists and the best that costs no more (2 comparisons "
        "of 8 to 16 trials)"
    ]


def test_without_a_comparison_there_is_nothing_to_tell():
    """No finalist, or one: no comparison, no line."""
    nobody = Front(goals=GOALS, members=())
    for finalists, front, known in (([], nobody, {}), search((1.0, [1.0, 2.0]))):
        found = pairing_of(PROBLEM, finalists, front, known)
        assert found.comparisons == ()
        assert pairing_text(found) == ""
        assert pairing_lines(found) == []


def test_a_front_of_one_tells_of_the_finalists_alone():
    """The dearer of two is beaten: no neighbours on the front, one comparison of finalists."""
    finalists, front, known = search((1.0, [1.0, 2.0, 3.0]), (2.0, [4.0, 5.5, 6.0]))
    text = pairing_text(pairing_of(PROBLEM, finalists, front, known))
    assert "front" not in text
    assert "between finalists and the best that costs no more (1 comparison of 3 trials)" in text


def test_the_table_holds_every_comparison_and_the_means(tmp_path):
    """A row for each comparison by rising cost, then the means; what is not known is empty."""
    finalists, front, known = search((1.0, [3.0, 4.0]), (2.0, [1.0, 3.0]), (3.0, [2.0, 5.0]))
    write_pairing(pairing_of(PROBLEM, finalists, front, known), tmp_path / "pairing.csv")
    lines = (tmp_path / "pairing.csv").read_text(encoding="utf-8").splitlines()
    keys = [layout.short_key for layout in LAYOUTS]
    assert lines == [
        "comparison,layout,rival,trials,difference_m,difference_se_m,variance_ratio,variance_ratio_low,"
        "variance_ratio_high",
        f"front,{keys[1]},{keys[0]},2,-1.5,0.5,0.2,,",
        f"finalist,{keys[2]},{keys[1]},2,1.5,0.5,0.0769230769,,",
        "mean of front,,,2,,,0.2,,",
        "mean of all,,,2,,,0.138461538,,",
    ]


def test_a_ratio_in_words():
    """Two decimals each."""
    assert ratio_text(VarianceRatio(value=0.3149, low=0.2, high=0.4049)) == "0.31 (0.20 to 0.40)"
