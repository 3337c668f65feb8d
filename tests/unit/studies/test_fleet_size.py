"""The study of fleet sizes: exact costs for any number of robots, and the cheapest layout that is shown to do."""

from dataclasses import replace

import numpy as np
import pytest

from layoutopt.evaluate import outcomes_of
from layoutopt.protocols import Evaluation
from layoutopt.scores import OUTCOME_COLUMNS, TrialOutcomes
from layoutopt.spec.reading import read_spec
from studies.fleet_size import DECIDING, LOOK, SIZES, FleetSize
from studies.fleet_size_page import antenna_count, cheaper_from, tag_count
from studies.swept import cost_of


@pytest.fixture(scope="module")
def spec(tmp_path_factory, tiny_text):
    path = tmp_path_factory.mktemp("spec") / "tiny.toml"
    path.write_text(tiny_text, encoding="utf-8")
    return read_spec(path)


@pytest.fixture(scope="module")
def study(spec):
    return FleetSize.for_spec(spec, quick=False)


def played(study, error_m):
    """Return the evaluations of all rounds, in which a layout errs as told by it, in the look and after."""
    found = []
    while batch := study.next_batch(found).tasks:
        for task in batch:
            replications = np.arange(task.first, task.first + task.count)
            error = np.array([error_m(task.layout, number) for number in replications])
            values = np.repeat(error[:, None], len(OUTCOME_COLUMNS), axis=1)
            outcomes = TrialOutcomes(replications=replications, columns=OUTCOME_COLUMNS, values=values)
            found.append(Evaluation(group=task.group, first=task.first, outcomes=outcomes, seconds=0.0))
    return found


def test_floor_and_readers_add_up_to_the_bill_of_every_number_of_robots(spec, study):
    for item in study.layouts[:4]:
        for robots in (1, 7, 50):
            bill = replace(cost_of(spec), robot_count=robots).bill(item.layout, spec.design)
            assert item.cost_eur(robots, spec.prices) == pytest.approx(bill.total_eur, abs=1e-9)
        assert tag_count(item) == len(item.layout.floor_tags.lay_on(spec.site))
        assert antenna_count(item.layout) == 4


def test_the_cheapest_layout_that_holds_is_chosen_for_every_number_of_robots(spec, study):
    """By brute force over all layouts; a layout that was lucky in its first look does not get through."""
    good = {item.layout.key for number, item in enumerate(study.layouts) if number % 3 == 0}
    lucky = {item.layout.key for number, item in enumerate(study.layouts) if number % 3 == 1}

    def error_m(layout, number):
        well = layout.key in good or (layout.key in lucky and number < LOOK)
        return (0.02 if well else 0.05) + 1e-4 * (number % 2)

    found = played(study, error_m)
    for chosen in study.chosen(outcomes_of(found), {}):
        costs = {
            item.layout.key: item.cost_eur(chosen.robots, spec.prices)
            for item in study.layouts
            if item.layout.key in good
        }
        assert chosen.priced.layout.key in good
        assert costs[chosen.priced.layout.key] == min(costs.values())
        assert chosen.error.count == DECIDING
    assert "robot" in study.answer(found, spec).lines(None)[0]


def test_where_nothing_holds_the_answer_says_so(spec, study):
    found = played(study, lambda layout, number: 0.05)
    assert all(chosen.priced is None and not chosen.tried for chosen in study.chosen(outcomes_of(found), {}))
    assert (
        study.answer(found, spec).lines(None)[0].startswith("No layout was shown to reach a mean error of 30 mm")
    )


def test_without_a_target_the_first_layout_of_the_space_sets_the_demand(spec):
    study = FleetSize.for_spec(replace(spec, target_error_m=None), quick=True)
    known = outcomes_of(played(study, lambda layout, number: 0.02))
    assert study.demand_m({}) is None
    assert study.demand_m(known) == pytest.approx(0.02)


def test_a_crossover_is_the_least_number_from_which_a_layout_stays_cheaper(spec, study):
    """Few tags and dear readers against many tags and cheap readers; by brute force over 1 to 50."""
    some = study.layouts[::2]
    pairs = [(a, b) for a in some for b in some if a is not b]
    sizes = [cheaper_from(study, a, b) for a, b in pairs]
    for (before, after), size in zip(pairs, sizes, strict=True):
        cheaper = [after.cost_eur(n, spec.prices) < before.cost_eur(n, spec.prices) for n in range(1, 51)]
        least = next((n for n in range(1, 51) if all(cheaper[n - 1 :])), None)
        assert size == least
    assert any(size is not None and size > 1 for size in sizes)
    assert SIZES[0] == 1
    assert SIZES[-1] == 50
