"""Hypervolume against grids and inclusion-exclusion, exchange rates against hand-made and random pairs."""

import math
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from layoutopt import registry
from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.layout import FloorTags, Layout, ZonePattern
from layoutopt.protocols import Mount
from layoutopt.readers.profiles import PROFILES
from layoutopt.result import Evaluated
from layoutopt.scores import Score
from solvers.front import front_of
from solvers.front_measures import (
    additive_epsilon,
    exchange_rate,
    exchange_rates,
    hypervolume,
    hypervolumes,
    independent_gain,
    reference_point,
)

GOALS = ("cost", "error")


def evaluated(cost, error, standard_error=0.0, count=0):
    mount = Mount(antenna=SphereAntenna(side_m=0.06), height_m=0.024, profile=PROFILES["mi2016"])
    group = registry.load("readers", "cross")(count=4, mount=mount)
    pattern = registry.load("patterns", "square")(pitch_m=0.1 + cost / 1e6)
    layout = Layout(floor_tags=FloorTags(zones=(ZonePattern(zone="", pattern=pattern),)), readers=(group,))
    score = Score(value=error, unit="m", standard_error=standard_error, count=count)
    return Evaluated(layout=layout, scores={"cost": Score(value=cost, unit="EUR"), "error": score})


def cells_dominated(points, reference):
    """Return the volume on a grid of unit cells: exact for whole numbers."""
    axes = np.meshgrid(*(np.arange(end) for end in reference), indexing="ij")
    cells = np.stack(axes, axis=-1).reshape(-1, len(reference))
    return sum(bool((points <= cell).all(axis=1).any()) for cell in cells)


def by_inclusion_and_exclusion(points, reference):
    """Return the volume of a union of boxes from the volumes of all their intersections."""
    total = 0.0
    for size in range(1, len(points) + 1):
        for chosen in combinations(points, size):
            total -= (-1) ** size * np.prod(np.maximum(reference - np.max(chosen, axis=0), 0.0))
    return total


@given(st.integers(1, 4), st.data())
def test_the_hypervolume_counts_the_cells_that_are_dominated(goals, data):
    """For whole numbers the volume is the number of unit cells behind a point, in one to four goals."""
    points = data.draw(st.lists(st.tuples(*[st.integers(0, 6)] * goals), max_size=8))
    array = np.array(points, dtype=np.float64).reshape(-1, goals)
    assert hypervolume(array, np.full(goals, 5.0)) == pytest.approx(cells_dominated(array, [5] * goals))


@pytest.mark.parametrize("goals", [2, 3, 4, 5])
def test_the_hypervolume_equals_inclusion_and_exclusion(goals):
    """Random points with random references, some of which they do not beat."""
    generator = np.random.Generator(np.random.Philox(goals))
    for _ in range(20):
        points, reference = generator.random((8, goals)), 0.5 + generator.random(goals)
        expected = by_inclusion_and_exclusion(points, reference)
        assert hypervolume(points, reference) == pytest.approx(expected, rel=1e-10, abs=1e-12)


def test_the_logarithmic_hypervolume_does_not_depend_on_units():
    """Cents instead of euros and millimetres instead of metres leave it as it is; the plain one they scale."""
    points, reference = np.array([[100.0, 0.02], [400.0, 0.005]]), np.array([500.0, 0.03])
    units = np.array([100.0, 1000.0])
    volume = hypervolume(points, reference, logarithmic=True)
    assert hypervolume(points * units, reference * units, logarithmic=True) == pytest.approx(volume, rel=1e-12)
    assert hypervolume(points * units, reference * units) == pytest.approx(1e5 * hypervolume(points, reference))
    assert volume == pytest.approx(math.log(4) * math.log(1.5) + math.log(1.25) * math.log(6))


def test_the_hypervolumes_of_draws_are_those_of_each_draw():
    """One product of arrays gives what the sweep gives draw by draw, with points beyond the reference."""
    generator = np.random.Generator(np.random.Philox(9))
    costs, errors = generator.random(7), generator.random((20, 7))
    reference = np.array([0.8, 0.9])
    expected = [hypervolume(np.stack([costs, row], axis=1), reference) for row in errors]
    np.testing.assert_allclose(hypervolumes(costs, errors, reference), expected, rtol=1e-12)


def test_what_makes_no_hypervolume_is_refused():
    """Wrong shapes, numbers that are none and logarithms of zero."""
    with pytest.raises(ValueError, match="do not fit"):
        hypervolume(np.ones((3, 2)), np.ones(3))
    with pytest.raises(ValueError, match="numbers in every goal"):
        hypervolume(np.array([[1.0, math.nan]]), np.ones(2))
    with pytest.raises(ValueError, match="positive"):
        hypervolume(np.array([[0.0, 1.0]]), np.ones(2), logarithmic=True)


def test_the_reference_lies_a_tenth_beyond_the_worst():
    """It takes the worst of each goal, and refuses goals of which a tenth more is no worse."""
    assert reference_point(np.array([[1.0, 8.0], [3.0, 2.0]])) == pytest.approx([3.3, 8.8])
    with pytest.raises(ValueError, match="positive"):
        reference_point(np.array([[-1.0, 2.0]]))
    with pytest.raises(ValueError, match="at least one"):
        reference_point(np.empty((0, 2)))


@given(st.lists(st.tuples(*[st.integers(0, 9)] * 3), min_size=1, max_size=6), st.data())
def test_points_that_improve_by_epsilon_match_every_target_and_by_less_do_not(points, data):
    """The indicator is the least shift after which each target is matched or dominated."""
    target = data.draw(st.lists(st.tuples(*[st.integers(0, 9)] * 3), min_size=1, max_size=6))
    goals, wanted = np.array(points, dtype=np.float64), np.array(target, dtype=np.float64)
    epsilon = additive_epsilon(goals, wanted)

    def matched(shift):
        return all((goals - shift <= row).all(axis=1).any() for row in wanted)

    assert matched(epsilon)
    assert not matched(epsilon - 0.5)


def test_an_exchange_rate_is_the_extra_cost_over_the_gain_with_its_interval():
    """500 EUR for 2 ± 0.25 mm with many trials: 250 EUR a millimetre, from 201 to 331."""
    gain = Score(value=0.002, unit="m", standard_error=0.00025, count=100_000)
    found = exchange_rate(evaluated(1000, 0.02), evaluated(1500, 0.018), GOALS, gain)
    assert found.significant
    assert np.array([found.rate, found.low, found.high]) / 1000 == pytest.approx([250, 200.8, 331.1], rel=1e-3)


def test_a_rate_whose_gain_may_be_zero_has_no_upper_end():
    """The interval of the gain reaches below zero, so the extra money may buy nothing."""
    gain = Score(value=0.001, unit="m", standard_error=0.001, count=30)
    found = exchange_rate(evaluated(1000, 0.02), evaluated(1500, 0.019), GOALS, gain)
    assert not found.significant
    assert found.high == math.inf
    assert 0.0 < found.low < found.rate == pytest.approx(500_000)


def test_a_layout_shown_to_be_worse_has_no_finite_rate():
    """A gain below zero with certainty costs infinitely much at either end."""
    gain = Score(value=-0.001, unit="m", standard_error=0.0001, count=30)
    found = exchange_rate(evaluated(1000, 0.02), evaluated(1500, 0.021), GOALS, gain)
    assert (found.rate, found.low, found.high) == (math.inf, math.inf, math.inf)


def test_the_second_layout_has_to_cost_more():
    """Equal costs have no rate."""
    with pytest.raises(ValueError, match="dearer"):
        exchange_rate(evaluated(1000, 0.02), evaluated(1000, 0.01), GOALS, Score(value=0.01, unit="m"))


def test_neighbours_of_a_front_have_rates_in_order_of_cost():
    """Without paired outcomes the errors of both scores add up as squares; exact scores give exact rates."""
    front = front_of([evaluated(3, 1.0, 0.03, 20), evaluated(1, 5.0, 0.04, 10), evaluated(9, 0.5)], GOALS)
    first, second = exchange_rates(front)
    assert (first.rate, second.rate) == (0.5, 12.0)
    assert first.gain.standard_error == pytest.approx(0.05)
    assert first.gain.count == 10
    assert second.gain.count == 20
    exact = exchange_rates(front_of([evaluated(1, 3.0), evaluated(2, 1.0)], GOALS))[0]
    assert (exact.low, exact.rate, exact.high) == (0.5, 0.5, 0.5)
    with pytest.raises(ValueError, match="two goals"):
        exchange_rates(front_of([evaluated(1, 3.0)], ("cost",)))


def test_intervals_of_rates_cover_the_true_rate_as_often_as_they_say():
    """Of 2000 pairs about 95 % cover; less than 92.5 % or more than 97.5 % by chance: p = 3e-7."""
    generator = np.random.Generator(np.random.Philox(5))
    first, second = evaluated(1000, 0.02), evaluated(1400, 0.018)
    truth, covered = 400 / 0.002, 0
    for _ in range(2000):
        sample = 0.002 + 0.004 * generator.standard_normal(12)
        gain = Score(
            value=float(sample.mean()),
            unit="m",
            standard_error=float(sample.std(ddof=1)) / math.sqrt(12),
            count=12,
        )
        found = exchange_rate(first, second, GOALS, gain)
        covered += found.low <= truth <= found.high
    assert 0.925 <= covered / 2000 <= 0.975


def test_scores_taken_for_independent_ignore_what_drives_share():
    """The helper subtracts values and adds variances."""
    gain = independent_gain(evaluated(1, 0.5, 0.3, 9), evaluated(2, 0.2, 0.4, 4), "error")
    assert (gain.value, gain.standard_error, gain.count) == (pytest.approx(0.3), pytest.approx(0.5), 4)
