"""Choice of reader groups: against every group there is, with bounds that hold whatever a solver says."""

import itertools
import math
import sys

import numpy as np
import pytest

from layoutopt.result import Status
from layoutopt.robot import Odometry
from solvers.antenna_slots import ReaderSlots, arranged, packing_of
from solvers.exchange import is_mirrored
from solvers.information import CRITERIA, Merit, drift_of, pose_information
from solvers.relaxation import choose_group, dual_value, largest_sum, relaxed_shares, upper_bound

DRIFT = drift_of(Odometry(), 0.06, 0.3)
DENSITY = 60.0


def merit_of(criterion):
    return Merit(criterion=criterion, drift=DRIFT, lever_m=0.35)


def slots_at(xy_m, antennas_per_module=1, spacing_m=0.1, simultaneous_spacing_m=0.2):
    return ReaderSlots(
        xy_m=np.asarray(xy_m),
        side_m=0.06,
        radius_m=0.03,
        spacing_m=spacing_m,
        simultaneous_spacing_m=simultaneous_spacing_m,
        antennas_per_module=antennas_per_module,
    )


def best_by_brute_force(slots, count, merit):
    """Best merit over every group that can be arranged; ``None`` if there is none."""
    packing = packing_of(slots, count)
    information = pose_information(slots.xy_m, slots.radius_m, DENSITY)
    groups = [
        group
        for group in itertools.combinations(range(len(slots)), count)
        if arranged(slots, packing, group) is not None
    ]
    return max((float(merit(information[list(group)].sum(axis=0))) for group in groups), default=None)


@pytest.mark.parametrize("criterion", CRITERIA)
@pytest.mark.parametrize("antennas_per_module", [1, 2, 8])
def test_the_choice_is_the_best_group_by_brute_force(criterion, antennas_per_module):
    """Nine random cases of up to twelve places: the value is the best, the bound above it, or none exists."""
    draws = np.random.Generator(np.random.Philox([1, antennas_per_module, ord(criterion)]))
    merit = merit_of(criterion)
    none = 0
    for _ in range(9):
        slots = slots_at(draws.uniform(-0.3, 0.3, (draws.integers(6, 13), 2)), antennas_per_module)
        count = int(draws.integers(1, 6))
        best = best_by_brute_force(slots, count, merit)
        found = choose_group(slots, count, DENSITY, merit)
        if best is None:
            none += 1
            assert found.status in (Status.INFEASIBLE, Status.STOPPED_BY_LIMIT)
            assert not found.chosen
            continue
        assert found.value == pytest.approx(best, abs=1e-9)
        assert found.bound >= best - 1e-12
        assert found.bound - found.relaxed < 1e-5  # nothing is lost by not trusting the solver
        assert found.relaxed <= found.bound
        assert found.message == ""
        assert found.efficiency == pytest.approx(math.exp(best - found.bound))
        assert found.status is (Status.OPTIMAL if found.gap <= 1e-6 else Status.SEARCHED)
    assert none < 7


@pytest.mark.parametrize("criterion", CRITERIA)
def test_any_shares_and_any_prices_give_a_bound(criterion):
    """Tangents at random shares and duals at random prices stay above every group; those solved are tighter."""
    draws = np.random.Generator(np.random.Philox(2))
    merit = merit_of(criterion)
    slots = slots_at(draws.uniform(-0.3, 0.3, (10, 2)))
    packing = packing_of(slots, 3)
    information = pose_information(slots.xy_m, slots.radius_m, DENSITY)
    best = best_by_brute_force(slots, 3, merit)
    solved, message = relaxed_shares(information, packing, merit)
    assert message == ""
    tight = upper_bound(solved, information, packing, merit)
    for _ in range(30):
        bound = upper_bound(draws.random(10), information, packing, merit)
        assert bound >= tight - 1e-6
        assert bound >= best
    rows = np.concatenate([np.ones((1, 10)), packing.rows])
    limits = np.concatenate([[3.0], packing.limits])
    gain = draws.standard_normal(10)
    least = largest_sum(gain, packing)
    groups = [g for g in itertools.combinations(range(10), 3) if arranged(slots, packing, g) is not None]
    assert least >= max(gain[list(group)].sum() for group in groups) - 1e-12
    for _ in range(30):
        assert dual_value(gain, rows, limits, draws.exponential(1.0, len(limits))) >= least - 1e-9


def test_rows_of_cliques_make_the_bound_tighter_than_pairs():
    """Five places within one spacing: pairs would allow half of each, the clique one of them, as it is."""
    slots = slots_at([(0.25, 0.01 * step) for step in range(5)] + [(-0.25, 0.0)])
    packing = packing_of(slots, 2)
    assert largest_sum(np.array([1.0, 1.0, 1.0, 1.0, 1.0, 0.0]), packing) == pytest.approx(1.0)
    found = choose_group(slots, 2, DENSITY, merit_of("D"))
    assert found.efficiency > 0.999
    assert 5 in found.chosen


def test_the_same_seed_gives_the_same_choice():
    """To the last bit of value and bound."""
    draws = np.random.Generator(np.random.Philox(3))
    slots = slots_at(draws.uniform(-0.3, 0.3, (40, 2)))
    first, second = (choose_group(slots, 4, DENSITY, merit_of("A"), seed=5) for _ in range(2))
    assert first == second


def test_of_equally_good_groups_the_symmetric_one_is_taken():
    """Two front corners tell as much as their images; with one antenna and two corners the earlier place wins."""
    slots = slots_at([(x, y) for x in (-0.25, 0.0, 0.25) for y in (-0.2, 0.0, 0.2)])
    pair = choose_group(slots, 2, DENSITY, merit_of("D"))
    assert is_mirrored(pair.chosen, slots)
    assert pair.status is Status.OPTIMAL
    single = choose_group(slots, 1, DENSITY, merit_of("D"))
    left, right = slots.mirrored[single.chosen[0]], single.chosen[0]
    assert left > right


def test_more_antennas_than_fit_are_a_status_that_says_how_many_do():
    """Four corners a spacing apart, and a fifth antenna."""
    slots = slots_at([(x, y) for x in (-0.1, 0.1) for y in (-0.1, 0.1)] + [(0.0, 0.0)])
    found = choose_group(slots, 5, DENSITY, merit_of("D"))
    assert found.status is Status.INFEASIBLE
    assert "at most 4 do, among 5 places" in found.message
    assert found.efficiency == 0.0
    assert choose_group(slots, 4, DENSITY, merit_of("D")).status is Status.OPTIMAL


def test_a_ring_of_five_that_rows_cannot_refuse_is_refused_by_the_integer_program():
    """Neighbours on a pentagon conflict: halves of all five keep the rows, but only two antennas fit."""
    angle = 2.0 * np.pi * np.arange(5) / 5.0
    slots = slots_at(0.16 * np.stack([np.cos(angle), np.sin(angle)], axis=1))
    packing = packing_of(slots, 3)
    assert packing.rows.sum() == 10.0
    assert largest_sum(np.ones(5), packing) == pytest.approx(2.5)
    found = choose_group(slots, 3, DENSITY, merit_of("A"))
    assert found.status is Status.INFEASIBLE
    assert "at most 2 do" in found.message


@pytest.mark.parametrize("broken", ["solver", "package"])
def test_without_a_solver_the_choice_is_made_and_says_so(broken, monkeypatch):
    """The value is the best all the same, the bound holds, and the sentence says why it is loose."""
    draws = np.random.Generator(np.random.Philox(4))
    slots, merit = slots_at(draws.uniform(-0.3, 0.3, (10, 2))), merit_of("D")
    if broken == "package":
        monkeypatch.setitem(sys.modules, "cvxpy", None)
    found = choose_group(slots, 3, DENSITY, merit, solver="CLARABEL" if broken == "package" else "NO_SUCH_SOLVER")
    best = best_by_brute_force(slots, 3, merit)
    assert found.value == pytest.approx(best, abs=1e-9)
    assert found.bound >= best - 1e-12
    assert "the relaxation was not solved" in found.message
    assert math.isnan(found.relaxed)
