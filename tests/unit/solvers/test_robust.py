"""Worst cases and quantiles over scenarios: known answers, and bounds that hold as often as they say."""

import math

import numpy as np
import pytest
from scipy.stats import binom

from layoutopt.problem import Limit
from layoutopt.protocols import Group
from layoutopt.scores import Score, TrialOutcomes
from solvers.robust import quantile_over, scenarios_needed, scores_over, worst_case

NAME = "position_error_mean"
RUNS = 1500
FALSE_ALARM = 1e-6


def _most_misses(risk):
    """Return how many of the runs may miss: more has a chance of a millionth if the bound holds as stated."""
    return int(binom.isf(FALSE_ALARM, RUNS, risk))


def _scores(means, draws, trials=10, spread=1.0):
    values = draws.normal(np.asarray(means)[:, None], spread, (len(means), trials))
    errors = values.std(axis=1, ddof=1) / math.sqrt(trials)
    return [
        Score(value=float(mean), unit="m", standard_error=float(error), count=trials)
        for mean, error in zip(values.mean(axis=1), errors, strict=True)
    ]


def test_exact_scores_have_exact_worst_cases():
    """Without noise both bounds are the worst value itself."""
    scores = [Score(value=value, unit="m") for value in (0.01, 0.03, 0.02)]
    worst = worst_case(scores, NAME)
    assert (worst.value, worst.lower, worst.upper, worst.scenario) == (0.03, 0.03, 0.03, 1)


def test_where_more_is_better_the_worst_is_the_smallest():
    """Reads per step are bad where they are few, in zones as well."""
    scores = [Score(value=value, unit="", standard_error=0.1, count=20) for value in (3.0, 1.0, 2.0)]
    worst = worst_case(scores, "dock.reads_per_step")
    assert (worst.value, worst.scenario) == (1.0, 1)
    assert worst.lower == scores[1].lower(0.95)
    assert worst.upper == min(score.upper(1.0 - 0.05 / 3.0) for score in scores)
    mirrored = worst_case([Score(value=-s.value, unit="", standard_error=0.1, count=20) for s in scores], NAME)
    assert (mirrored.lower, mirrored.upper) == pytest.approx((-worst.upper, -worst.lower))


def test_one_scenario_is_its_own_worst_case():
    """Then both bounds are those of the score."""
    (score,) = _scores([1.0], np.random.Generator(np.random.Philox(1)))
    worst = worst_case([score], NAME)
    assert (worst.lower, worst.upper) == (score.lower(0.95), score.upper(0.95))


@pytest.mark.parametrize("means", [(1.0, 1.0, 1.0, 1.0, 1.0), (0.0, 0.5, 0.9, 1.0), (1.0, -5.0)])
def test_the_bounds_of_the_worst_case_hold_as_often_as_they_say(means):
    """Equal means, where the largest estimate is most biased, near ones and one that rules: at most 5 % misses."""
    draws = np.random.Generator(np.random.Philox(2))
    found = [worst_case(_scores(means, draws), NAME) for _ in range(RUNS)]
    assert sum(item.upper < max(means) for item in found) <= _most_misses(0.05)
    assert sum(item.lower > max(means) for item in found) <= _most_misses(0.05)


def test_without_its_correction_the_lower_bound_of_the_worst_case_would_fail():
    """The check above has teeth: of five equal means the largest plain lower bound misses far too often."""
    draws = np.random.Generator(np.random.Philox(3))
    plain = [max(score.lower(0.95) for score in _scores([1.0] * 5, draws)) for _ in range(RUNS)]
    assert sum(bound > 1.0 for bound in plain) > _most_misses(0.05)


@pytest.mark.parametrize("count", [36, 60])
def test_the_bounds_of_a_quantile_hold_as_often_as_they_say(count):
    """Means drawn from an exponential distribution, whose 90 % quantile is known, each seen through ten trials."""
    draws = np.random.Generator(np.random.Philox(4))
    truth = -math.log(0.1)
    found = [
        quantile_over(_scores(draws.exponential(1.0, count), draws, spread=0.3), NAME, quantile=0.9)
        for _ in range(RUNS)
    ]
    assert all(math.isfinite(item.upper) for item in found)
    assert sum(item.upper < truth for item in found) <= _most_misses(0.05)
    assert sum(item.lower > truth for item in found) <= _most_misses(0.05)


@pytest.mark.parametrize("count", [36, 60, 110])
def test_a_quantile_lies_between_the_order_statistics_of_the_textbook(count):
    """Ranks by scipy's binomial distribution; each scenario that may upset a rank has its part of the risk."""
    scores = _scores(np.linspace(0.0, 1.0, count), np.random.Generator(np.random.Philox(7)))
    found = quantile_over(scores, NAME, quantile=0.9)
    above = min(rank for rank in range(1, count + 1) if binom.cdf(rank - 1, count, 0.9) >= 0.975)
    below = max(rank for rank in range(1, count + 1) if binom.sf(rank - 1, count, 0.9) >= 0.975)
    assert below < 0.9 * count < above
    highest = 1.0 - 0.025 / (count - above + 1)
    assert found.upper == pytest.approx(sorted(score.upper(highest) for score in scores)[above - 1])
    lowest = 1.0 - 0.025 / below
    assert found.lower == pytest.approx(sorted(score.lower(lowest) for score in scores)[below - 1])


def test_too_few_scenarios_bound_no_quantile():
    """One fewer than needed leaves the bad side open, and no limit is met however good all of them are."""
    needed = scenarios_needed(0.9)
    scores = [Score(value=0.001, unit="m")] * needed
    limit = Limit(score=NAME, upper=0.01)
    assert quantile_over(scores, NAME, quantile=0.9).met(limit)
    few = quantile_over(scores[1:], NAME, quantile=0.9)
    assert few.upper == math.inf
    assert not few.met(limit)


def test_the_quantile_of_exact_scores_is_an_order_statistic():
    """Of ten values the 90 % quantile is the ninth from the good side, whichever that is."""
    values = [7.0, 3.0, 9.0, 1.0, 5.0, 2.0, 8.0, 10.0, 4.0, 6.0]
    scores = [Score(value=value, unit="") for value in values]
    assert quantile_over(scores, NAME, quantile=0.9).value == 9.0
    assert quantile_over(scores, "reads_per_step", quantile=0.9).value == 2.0


def test_what_is_not_known_in_one_scenario_meets_nothing():
    """NaN in a scenario leaves the whole unknown."""
    unknown = Score(value=math.nan, unit="m", standard_error=math.inf, count=1)
    worst = worst_case([Score(value=0.001, unit="m"), unknown], NAME)
    assert math.isnan(worst.value)
    assert not worst.met(Limit(score=NAME, upper=1.0))


def test_a_share_never_seen_passes_in_search_only():
    """Ten trials without a loss in each of three worlds do not show two per cent."""
    scores = [Score(value=0.0, unit="", standard_error=0.0, count=10, share=True)] * 3
    worst, limit = worst_case(scores, "lost_share"), Limit(score="lost_share", upper=0.02)
    assert not worst.met(limit)
    assert worst.met_in_search(limit)


def test_a_share_hardly_seen_passes_in_search_by_the_spread_of_its_trials():
    """Little in one of three worlds passes two per cent there and nowhere else; more of it does not."""
    none = Score(value=0.0, unit="", standard_error=0.0, count=10, share=True)
    limit = Limit(score="lost_share", upper=0.02)
    for value, passes in ((0.001, True), (0.01, False)):
        some = Score(value=value, unit="", standard_error=value, count=10, share=True)
        worst = worst_case([none, some, none], "lost_share")
        assert worst.met_in_search(limit) is passes
        assert not worst.met(limit)
        assert worst.upper >= worst_case([none] * 3, "lost_share").upper


def test_scores_come_in_the_order_of_the_groups_and_only_together():
    """A group without outcomes leaves nothing to combine."""
    groups = [Group("layout", "world", "mcl", str(number)) for number in range(3)]
    known = {
        group: TrialOutcomes(replications=np.arange(2), columns=(NAME,), values=np.full((2, 1), float(number)))
        for number, group in enumerate(groups)
    }
    found = scores_over(known, groups[::-1], NAME)
    assert [score.value for score in found] == [2.0, 1.0, 0.0]
    assert scores_over({groups[0]: known[groups[0]]}, groups, NAME) is None


@pytest.mark.parametrize("quantile", [0.0, 1.0, math.nan])
def test_impossible_quantiles_are_refused(quantile):
    """A quantile lies between 0 and 1."""
    with pytest.raises(ValueError, match="between 0 and 1"):
        quantile_over([Score(value=1.0, unit="m")], NAME, quantile=quantile)


def test_no_scenario_is_refused():
    """There is no worst of nothing."""
    with pytest.raises(ValueError, match="at least one scenario"):
        worst_case([], NAME)
