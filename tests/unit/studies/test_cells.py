"""Cells of an experiment: which trials are still to be run, and which outcomes are a cell's own."""

from dataclasses import replace

import numpy as np
import pytest

from layoutopt.protocols import group_of
from layoutopt.scores import TrialOutcomes
from studies.cells import Cell, missing, plan_of
from studies.published import mi2016_setting as setting


@pytest.fixture
def cell():
    """Thirty trials of the eight readers."""
    return Cell(
        layout=setting.layout(8, 100),
        scenario=setting.scenario(),
        estimator=setting.particle_filter("gaussian"),
        trials=30,
    )


def table(count):
    return TrialOutcomes(replications=np.arange(count), columns=("nees",), values=np.arange(float(count))[:, None])


def numbers(tasks):
    return [number for task in tasks for number in range(task.first, task.first + task.count)]


def test_every_trial_is_asked_for_once(cell):
    """A cell of which nothing is known is cut into tasks that hold each of its trials once."""
    assert numbers(missing([cell], {}, {})) == list(range(30))


def test_what_is_known_is_not_asked_for_again(cell):
    """Of a cell with five trials the other 25 are wanted, and none once all are there."""
    assert numbers(missing([cell], {cell.group: table(5)}, {})) == list(range(5, 30))
    assert missing([cell], {cell.group: table(30)}, {}) == ()


def test_cells_of_one_group_share_its_trials(cell):
    """The larger of two wishes counts, in whatever order they come."""
    small = replace(cell, trials=7)
    for cells in ([cell, small], [small, cell]):
        assert numbers(missing(cells, {}, {})) == list(range(30))


def test_a_group_that_failed_is_left_alone(cell):
    """A task that raised would raise again."""
    assert missing([cell], {}, {cell.group: "ValueError: boom"}) == ()


def test_outcomes_are_a_cells_own(cell):
    """A cell sees its first trials only, and nothing while one of them is missing."""
    assert len(cell.outcomes({cell.group: table(40)})) == 30
    assert cell.outcomes({cell.group: table(29)}) is None
    assert cell.outcomes({}) is None


def test_filters_of_one_name_are_different_groups(cell):
    """Another likelihood, or another speed in a scenario of the same name, makes another group."""
    other = replace(cell, estimator=setting.particle_filter("combination"))
    slow = replace(cell, scenario=setting.scenario(speed_m_s=0.05))
    groups = {cell.group, other.group, slow.group}
    assert len(groups) == 3
    assert len({(group.scenario, group.estimator) for group in groups}) == 1
    assert cell.group == group_of(cell.layout, cell.scenario, cell.estimator)


def test_a_plan_stands_for_all_trials(cell):
    """The pilot's weights add up to about all trials of the cells."""
    plan = plan_of([cell, replace(cell, layout=setting.layout(8, 16))], ["two cells"])
    assert plan.lines == ("two cells",)
    assert 50 <= sum(trials for _, trials in plan.pilot) <= 60
