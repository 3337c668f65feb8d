"""The cheapest pattern for each zone: equal to brute force, and predictions that add up."""

import itertools
import math

import numpy as np
import pytest

from layoutopt.problem import Limit
from layoutopt.scores import TrialOutcomes
from solvers.zone_terms import Shares, zone_terms
from solvers.zones import ZoneChoices, cheapest, composition, most_accurate, tightened, worst_predicted

ALL = 10_000
ZONES = ("", "dock", "ward")
NAMES = ("position_error_mean", "dock.position_error_mean", "ward.position_error_mean", "lost_share")


def _made(seed, *, slots=3, options=4, drives=6, limits=3):
    """Return made-up choices: the first limit sums over all slots, the others belong to one slot each."""
    draws = np.random.Generator(np.random.Philox(seed))
    terms = []
    for slot in range(slots):
        values = draws.gamma(4.0, 0.25, (options, limits, drives))
        for limit in range(1, limits):
            values[:, limit] *= limit == slot
        terms.append(values)
    # Dearer options err less, as tags do, but not always.
    costs = tuple(np.round(100.0 / (0.3 + values[:, 0].mean(axis=1)), 2) for values in terms)
    return ZoneChoices(base_eur=50.0, costs_eur=costs, terms=tuple(terms))


def _brute(choices, limits, *, shown):
    """Return every composition that meets the limits, by cost, looked at one by one."""
    every = itertools.product(*(range(len(costs)) for costs in choices.costs_eur))
    found = [composition(choices, options) for options in every]
    kept = [
        one
        for one in found
        if all(
            limit.met(score) if shown else not limit.broken(score)
            for limit, score in zip(limits, one.scores, strict=True)
        )
    ]
    return sorted(kept, key=lambda one: (one.cost_eur, one.options))


@pytest.mark.parametrize("shown", [True, False])
def test_the_compositions_are_those_of_brute_force_in_the_order_of_their_cost(shown):
    """On small cases all feasible products come, cheapest first, and no other one."""
    counts = []
    for seed in range(16):
        choices = _made(seed)
        tight = (2.4 if shown else 1.4) + 0.25 * seed
        limits = [Limit(score="a", upper=tight), Limit(score="b", upper=1.5), Limit(score="c", upper=1.6)]
        brute = _brute(choices, limits, shown=shown)
        search = cheapest(choices, limits, count=ALL, shown=shown)
        assert (search.rest_eur, search.cut) == (math.inf, False)
        found = search.compositions
        assert {one.options for one in found} == {one.options for one in brute}
        np.testing.assert_allclose([one.cost_eur for one in found], [one.cost_eur for one in brute], rtol=1e-7)
        counts.append(len(brute))
    # Limits keep some out in some cases, and leave many in others.
    assert min(counts) < 30
    assert max(counts) > 20


@pytest.mark.parametrize("shown", [True, False])
def test_what_a_search_leaves_out_costs_no_less_than_it_says(shown):
    """However early a search ends, at a count, a cost or a cap on nodes, its bound holds for all the rest."""
    cuts = 0
    for seed in range(3):
        choices = _made(seed, options=3)
        limits = [Limit(score="a", upper=4.0), Limit(score="b", upper=2.0), Limit(score="c", upper=2.0)]
        brute = _brute(choices, limits, shown=shown)
        assert len(brute) > 2
        middle = brute[len(brute) // 2].cost_eur
        for count, most_eur, most_nodes in itertools.product((1, 3, ALL), (middle, math.inf), (1, 3, 6, ALL)):
            search = cheapest(choices, limits, count=count, shown=shown, most_eur=most_eur, most_nodes=most_nodes)
            first = [one.options for one in search.compositions]
            assert first == [one.options for one in brute[: len(first)]]
            assert all(one.cost_eur >= search.rest_eur - 1e-6 for one in brute[len(first) :])
            complete = len(first) == count or search.rest_eur > most_eur or math.isinf(search.rest_eur)
            assert search.cut == (not complete)
            cuts += search.cut
    assert cuts > 10


def test_scores_of_which_more_is_better_are_held_from_below():
    """A lower limit keeps what brute force keeps, beside an upper one on the same slots."""
    for seed in range(8):
        choices = _made(seed, limits=2)
        choices = ZoneChoices(base_eur=0.0, costs_eur=choices.costs_eur, terms=choices.terms)
        limits = [Limit(score="reads", lower=2.2), Limit(score="b", upper=1.4)]
        brute = _brute(choices, limits, shown=True)
        found = cheapest(choices, limits, count=ALL).compositions
        assert [one.options for one in found] == [one.options for one in brute]


def test_many_zones_are_answered_without_going_through_their_products():
    """Seven slots of eight options, two million products: no cheaper change of one slot of the first meets."""
    draws = np.random.Generator(np.random.Philox(7))
    drives = draws.gamma(4.0, 0.25, 40)  # what a drive is like, it is for every pattern, but for a little
    levels = np.sort(draws.uniform(0.5, 1.5, (7, 8)), axis=1)
    terms = levels[:, :, None, None] * drives * draws.normal(1.0, 0.02, (7, 8, 1, 40))
    choices = ZoneChoices(
        base_eur=50.0, costs_eur=tuple(100.0 / levels * draws.uniform(0.5, 1.5, (7, 1))), terms=tuple(terms)
    )
    limits = [Limit(score="a", upper=7.0)]
    search = cheapest(choices, limits, count=1)
    assert not search.cut
    best = search.compositions[0]
    assert limits[0].met(best.scores[0])
    for slot in range(7):
        for option in range(8):
            changed = composition(choices, (*best.options[:slot], option, *best.options[slot + 1 :]))
            assert changed.cost_eur >= best.cost_eur - 1e-6 or not limits[0].met(changed.scores[0])


def test_a_demand_that_nothing_meets_has_no_composition_and_a_nearest_one():
    """Where a zone's limit is out of reach nothing is yielded, and the nearest misses that limit by most."""
    choices = _made(3)
    limits = [Limit(score="a", upper=9.0), Limit(score="b", upper=0.01), Limit(score="c", upper=9.0)]
    assert not cheapest(choices, limits, count=1).compositions
    ratio, limit = worst_predicted(most_accurate(choices, limits), limits)
    assert limit is limits[1]
    assert ratio > 10.0


def test_a_zone_that_no_drive_enters_is_not_shown_to_meet_and_not_shown_to_miss():
    """Unknown scores keep a composition from being shown, and leave it open."""
    choices = _made(5)
    terms = [values.copy() for values in choices.terms]
    for values in terms:
        values[:, 1] = np.nan
    unknown = ZoneChoices(base_eur=0.0, costs_eur=choices.costs_eur, terms=tuple(terms))
    limits = [Limit(score="a", upper=99.0), Limit(score="b", upper=1.0), Limit(score="c", upper=99.0)]
    assert not cheapest(unknown, limits, count=1).compositions
    opened = cheapest(unknown, limits, count=1, shown=False).compositions[0]
    assert opened.cost_eur == pytest.approx(sum(costs.min() for costs in choices.costs_eur))


def test_tightened_limits_leave_a_share_on_either_side():
    """An upper end shrinks, a lower one grows."""
    upper, lower = tightened([Limit(score="a", upper=2.0), Limit(score="b", lower=3.0)], 0.5)
    assert (upper.upper, lower.lower) == (1.0, 6.0)


def test_slots_without_options_are_refused():
    """Every slot needs something to choose from."""
    with pytest.raises(ValueError, match="every slot needs options"):
        ZoneChoices(base_eur=0.0, costs_eur=(np.empty(0),), terms=(np.empty((0, 1, 2)),))


def _world(seed, drives=9):
    """Return shares of disjoint zones, and the true error of two patterns in each part, drive by drive."""
    draws = np.random.Generator(np.random.Philox(seed))
    ruled = draws.dirichlet((2.0, 1.0, 1.0), drives)
    ruled[0] = (0.6, 0.4, 0.0)
    within = {}
    for slot, zone in enumerate(ZONES[1:], start=1):
        within[zone] = np.tile(np.eye(3)[slot], (drives, 1))
        within[zone][ruled[:, slot] == 0.0] = np.nan
    return Shares(ruled=ruled, within=within), draws.gamma(3.0, 0.01, (2, 3, drives))


def _outcomes(shares, errors):
    """Return the outcomes of a layout whose error in each slot is given, shape (slots, drives)."""
    whole = (shares.ruled.T * errors).sum(axis=0)
    zones = [np.where(shares.ruled[:, slot] > 0.0, errors[slot], np.nan) for slot in (1, 2)]
    lost = (errors > 0.03).mean(axis=0)
    return TrialOutcomes(
        replications=np.arange(errors.shape[1]), columns=NAMES, values=np.array([whole, *zones, lost]).T
    )


def test_the_prediction_is_exact_where_errors_stay_in_their_zones():
    """Means of a composed layout follow on every drive from those of uniform ones, the rest of the floor too."""
    shares, errors = _world(1)
    terms = [zone_terms(_outcomes(shares, of_pattern), NAMES, ZONES, shares) for of_pattern in errors]
    for options in itertools.product((0, 1), repeat=3):
        predicted = np.sum([terms[option][slot] for slot, option in enumerate(options)], axis=0)
        mixed = np.array([errors[option, slot] for slot, option in enumerate(options)])
        np.testing.assert_allclose(predicted[:3], _outcomes(shares, mixed).values.T[:3], rtol=1e-12)


def test_one_pattern_everywhere_gives_back_its_own_outcomes():
    """The terms of one layout sum to what it did, of every score, whether or not it is known by zone."""
    shares, errors = _world(2)
    outcomes = _outcomes(shares, errors[0])
    summed = zone_terms(outcomes, NAMES, ZONES, shares).sum(axis=0)
    np.testing.assert_allclose(summed, outcomes.values.T, rtol=1e-12)


def test_where_zones_overlap_a_zone_is_weighted_by_the_patterns_that_rule_it():
    """A zone of which a later one rules a quarter takes a quarter of its score from the other's pattern."""
    shares, errors = _world(3)
    within = dict(shares.within)
    within["dock"] = np.tile((0.0, 0.75, 0.25), (len(shares.ruled), 1))
    overlapped = Shares(ruled=shares.ruled, within=within)
    first, second = (zone_terms(_outcomes(shares, of_pattern), NAMES, ZONES, overlapped) for of_pattern in errors)
    predicted = (first[0] + first[1] + second[2])[1]
    np.testing.assert_allclose(predicted, 0.75 * errors[0, 1] + 0.25 * errors[1, 1], rtol=1e-12)


def test_shares_that_do_not_sum_to_one_are_refused():
    """Time that is nowhere would make every prediction too good."""
    with pytest.raises(ValueError, match="must sum to 1"):
        Shares(ruled=np.array([[0.5, 0.4]]), within={})


def test_outcomes_of_later_drives_are_refused():
    """Shares are of the drives from 0 on, so outcomes must be too."""
    shares, errors = _world(4)
    outcomes = _outcomes(shares, errors[0])
    late = TrialOutcomes(replications=outcomes.replications + 1, columns=NAMES, values=outcomes.values)
    with pytest.raises(ValueError, match="shares of"):
        zone_terms(late, NAMES, ZONES, shares)
