"""Medians have the intervals of order statistics, and those hold what they promise."""

import math

import numpy as np
import pytest

from studies.published.medians import median, ratio_of_medians

RANKS = {6: 1, 8: 1, 9: 2, 12: 3, 16: 4, 24: 7, 32: 10}
"""Rank of the lower end by the number of values, as tables of the sign test have it (Conover, 1999, Table A3)."""


@pytest.mark.parametrize(("count", "rank"), RANKS.items())
def test_the_interval_goes_from_rank_to_rank(count, rank):
    """Of the values 1, 2, ..., n the ends are their own ranks, in whatever order the values come."""
    values = np.random.Generator(np.random.Philox(count)).permutation(np.arange(1.0, count + 1.0))
    found = median(values)
    assert (found.low, found.high) == (rank, count + 1 - rank)
    assert found.value == (count + 1) / 2.0


def test_five_values_have_no_interval():
    """All five lie on one side of the median in one case of sixteen."""
    found = median(np.arange(5.0))
    assert (found.value, found.low, found.high) == (2.0, -math.inf, math.inf)
    assert found.text == "2.000"


def test_intervals_hold_the_median_as_often_as_they_say():
    """Twelve values of a lopsided distribution: 96.1 %; 94 % of 4,000 or fewer has a chance below 1e-9."""
    draws = np.random.Generator(np.random.Philox(7)).exponential(size=(4000, 12))
    found = [median(row) for row in draws]
    inside = sum(item.low <= math.log(2.0) <= item.high for item in found)
    assert 0.94 < inside / 4000 < 0.98


def test_no_value_and_no_number_are_refused():
    """A median of nothing would be NaN in a table."""
    for values in ([], [1.0, math.nan]):
        with pytest.raises(ValueError, match="a median needs one number or more"):
            median(np.array(values))


def test_the_ratio_of_medians_goes_with_the_pairs():
    """Twice the same values are twice as large with certainty, however much they vary; unlike mates are not."""
    values = np.random.Generator(np.random.Philox(1)).lognormal(size=24)
    found = ratio_of_medians(2.0 * values, values)
    assert found.value == found.low == found.high == 2.0
    other = ratio_of_medians(2.0 * values[::-1], values)
    assert other.value == 2.0
    assert other.low < 1.8 < 2.2 < other.high


def test_a_ratio_of_unequal_numbers_is_refused():
    """Pairs need mates."""
    with pytest.raises(ValueError, match="as many values on both sides"):
        ratio_of_medians(np.ones(3), np.ones(4))
    assert math.isinf(ratio_of_medians(np.ones(5), np.ones(5)).high)
