"""The study of zones in a made-up world, in which the error follows from the pattern: its answer is known."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from layoutopt.protocols import Evaluation
from layoutopt.score_text import euros
from layoutopt.scores import TrialOutcomes
from layoutopt.simulation.outcomes import outcome_columns
from layoutopt.spec.reading import read_spec
from studies.zones import Zones
from studies.zones_candidates import Effort, chosen_from
from studies.zones_page import page_of
from studies.zones_results import summary
from studies.zones_search import COMPOSED, UNIFORM

ERROR_PER_PITCH = 0.2
HARDER = 1.1
"""Held-out drives err by so much more than those of the search."""
EFFORT = Effort(
    stages=(4, 8),
    most_times=4,
    shares=(1.0, 0.8),
    best=6,
    race_trials=60,
    looks=3,
    look_trials=10,
    most_tried=4,
    validation_trials=30,
    spare_tries=1,
    closing_window=6,
    closing_block=4,
    closing_trials=200,
)


def _spec(tmp_path, text, *, dock, whole):
    for old, new in (("40 mm", dock), ("30 mm", whole)):
        assert text.count(f'target_error = "{old}"') == 1
        text = text.replace(f'target_error = "{old}"', f'target_error = "{new}"')
    path = tmp_path / "spec.toml"
    path.write_text(text, encoding="utf-8")
    return read_spec(path)


def _outcomes(setting, task, penalty):
    """Return errors in proportion to the pitch of each slot, with a spread that drives share, and nothing else."""
    held_out = task.scenario.name != setting.problem.design.name
    pitches = {entry.zone: entry.pattern.parameters["pitch_m"] for entry in task.layout.floor_tags.zones}
    pitch = np.array([pitches.get(zone, pitches[""]) for zone in setting.zones])
    draws = np.random.Generator(np.random.Philox(key=int(held_out))).normal(1.0, 0.05, 1000)
    errors = ERROR_PER_PITCH * pitch * draws[task.first : task.first + task.count, None]
    errors *= HARDER * penalty(len(set(pitches.values()))) if held_out else 1.0
    shares = setting.shares(task.first + task.count)
    columns = outcome_columns(task.scenario)
    values = np.zeros((task.count, len(columns)))
    values[:, columns.index("position_error_mean")] = (shares.ruled[task.first :] * errors).sum(axis=1)
    within = (shares.within["dock"][task.first :] * errors).sum(axis=1)
    values[:, columns.index("dock.position_error_mean")] = within
    return TrialOutcomes(
        replications=np.arange(task.first, task.first + task.count), columns=columns, values=values
    )


def _run(spec, penalty=lambda patterns: 1.0, effort=EFFORT):
    """Return the study and all its evaluations where held-out errors have a penalty by the number of patterns."""
    study = replace(Zones.for_spec(spec, quick=True), effort=effort)
    found = {}
    while tasks := study.next_batch(tuple(found[place] for place in sorted(found))).tasks:
        for task in tasks:
            outcomes = _outcomes(study.setting, task, penalty)
            assert (task.group, task.first) not in found, "no drive is asked for twice"
            found[task.group, task.first] = Evaluation(
                group=task.group, first=task.first, outcomes=outcomes, seconds=0.0
            )
    return study, tuple(found[place] for place in sorted(found))


def _cheapest(setting, *, dock_m, whole_m):
    """Return the least costs with and without patterns by zone, every layout looked at one by one."""
    costs = {COMPOSED: [], UNIFORM: []}
    share = setting.shares(200).ruled.mean(axis=0)
    for group in setting.uniform.values():
        readers = next(iter(group.values())).layout.readers[0]
        for patterns in itertools.product(*(slot.patterns for slot in setting.slots)):
            pitch = np.array([pattern.parameters["pitch_m"] for pattern in patterns])
            if HARDER * ERROR_PER_PITCH * pitch[1] > dock_m or HARDER * ERROR_PER_PITCH * pitch @ share > whole_m:
                continue
            item, refusal = setting.judged(setting.composed(readers, patterns))
            if not refusal:
                costs[UNIFORM if pitch[0] == pitch[1] else COMPOSED].append(item.scores["cost"].value)
    return {kind: min(values) for kind, values in costs.items()}


def test_a_demand_of_one_zone_alone_is_served_by_its_pattern_and_the_saving_is_that_of_brute_force(
    tmp_path, tiny_text
):
    """The dock needs the dense pattern and the floor does not: the text says what that saves, how surely."""
    spec = _spec(tmp_path, tiny_text, dock="25 mm", whole="1 m")
    study, evaluations = _run(spec)
    results = study.results(evaluations)
    known = _cheapest(study.setting, dock_m=0.025, whole_m=1.0)
    for kind in (COMPOSED, UNIFORM):
        assert results.accepted(kind).scores["cost"].value == pytest.approx(known[kind])
    saving = known[UNIFORM] - known[COMPOSED]
    assert saving > 0.0
    assert results.saving_eur == pytest.approx(saving)
    assert results.saving_ends_eur == (results.saving_eur, results.saving_eur)
    text = " ".join(study.answer(evaluations, spec).lines(None))
    assert f"save {euros(saving)}, {saving / known[UNIFORM]:.1%} of the layout with one pattern" in text
    assert "every cheaper layout that was simulated was shown to miss a limit" in text
    assert "It was the first one tried" in text
    held = [one for one in results.verdicts() if one.word == "held"]
    assert [one.kind for one in held] == [COMPOSED, UNIFORM]
    assert all(one.worst.ratio <= 1.0 for one in held)
    sparsest = min(study.setting.layouts, key=lambda item: item.scores["cost"].value)
    unsure = replace(results, open_layouts={UNIFORM: (sparsest, 3), COMPOSED: (None, 0)})
    less = known[COMPOSED] - sparsest.scores["cost"].value
    assert less > 0.0
    assert f"between −{euros(less)} and {euros(saving)}" in " ".join(summary(unsure))
    page = page_of(results, facts={"Seed": "7", "Trials": "made up"})
    assert "What was tried" in [section.heading for section in page.sections]


def test_where_the_sparse_pattern_does_for_all_the_layout_with_one_pattern_wins(tmp_path, tiny_text):
    """Patterns by zone then cost more, and the text says by how much."""
    spec = _spec(tmp_path, tiny_text, dock="1 m", whole="1 m")
    study, evaluations = _run(spec)
    results = study.results(evaluations)
    known = _cheapest(study.setting, dock_m=1.0, whole_m=1.0)
    more = known[COMPOSED] - known[UNIFORM]
    assert more > 0.0
    assert results.saving_eur == pytest.approx(-more)
    text = " ".join(study.answer(evaluations, spec).lines(None))
    assert f"save nothing: the cheapest layout that has them costs {euros(more)} more" in text


@pytest.mark.parametrize(("failing", "holding"), [(UNIFORM, COMPOSED), (COMPOSED, UNIFORM)])
def test_a_kind_of_which_none_holds_is_told_with_what_was_tried_and_the_nearest_miss(
    tmp_path, tiny_text, failing, holding
):
    """Held-out drives err three times as much over layouts of one kind: no saving is claimed."""
    spec = _spec(tmp_path, tiny_text, dock="25 mm", whole="1 m")
    study, evaluations = _run(spec, lambda patterns: 3.0 if (patterns == 1) == (failing == UNIFORM) else 1.0)
    results = study.results(evaluations)
    assert results.accepted(failing) is None
    assert results.accepted(holding) is not None
    assert results.saving_eur is None
    kind = results.kinds[failing]
    assert kind.looked == kind.candidates
    # First looks leave all of them out; the nearest is tried all the same, so that the verdict rests on drives.
    assert len(kind.tried) == EFFORT.spare_tries
    text = " ".join(study.answer(evaluations, spec).lines(None))
    assert f"{len(kind.candidates)} were not shown to miss a limit in search" in text
    assert "nearest is" in text
    assert "zone 'dock'" in text
    assert "Patterns by zone save" not in text
    assert ("cannot be told" in text) == (failing == UNIFORM)


def test_a_uniform_layout_that_is_not_shown_to_miss_is_kept_unless_it_costs_more_than_those_shown_to_do(
    tmp_path, tiny_text
):
    """One layout is shown to meet the limits, all others are open: what is cheaper than it stays in the search."""
    study = Zones.for_spec(_spec(tmp_path, tiny_text, dock="25 mm", whole="1 m"), quick=True)
    setting = study.setting
    by_cost = sorted(setting.layouts, key=lambda item: item.scores["cost"].value)
    shown = by_cost[7]
    columns = outcome_columns(setting.problem.design)
    tables = {}
    for item in by_cost:
        values = np.zeros((8, len(columns)))
        spread = 0.0001 if item is shown else 0.02
        values[:, columns.index("dock.position_error_mean")] = 0.024 + spread * np.tile((1.0, -1.0), 4)
        tables[item.layout.key] = TrialOutcomes(replications=np.arange(8), columns=columns, values=values)
    effort = replace(EFFORT, best=1, shares=(1.0,))
    chosen = chosen_from(setting, effort, by_cost, tables, 8, last=False)
    kept = {item.layout.key for item in chosen.uniform}
    assert kept == {item.layout.key for item in by_cost if item.scores["cost"].value <= shown.scores["cost"].value}
    assert chosen_from(setting, effort, by_cost, tables, 8, last=True).uniform == chosen.uniform


def test_layouts_that_are_still_open_are_driven_in_the_closing_round_and_the_page_says_how_it_ended(
    tmp_path, tiny_text
):
    """Few drives of the search leave layouts open: with a budget all of them miss, without one they stay open."""
    spec = _spec(tmp_path, tiny_text, dock="25 mm", whole="1 m")
    few = replace(EFFORT, stages=(2,), race_trials=0)
    study, evaluations = _run(spec, effort=few)
    closed = study.results(evaluations)
    entered = closed.progress.closing.entered
    assert sum(entered.values()) > 0
    assert {one.word for closed_of_kind in closed.progress.closing.closed.values() for one in closed_of_kind} == {
        "missed"
    }
    assert 0 < closed.progress.closing.spent <= few.closing_trials
    assert closed.saving_ends_eur == (closed.saving_eur, closed.saving_eur)
    text = " ".join(study.answer(evaluations, spec).lines(None))
    assert f"Closing round, {closed.progress.closing.spent} held-out drives" in text
    assert f"of {entered[UNIFORM]} cheaper layouts with one pattern that were open" in text
    page = page_of(closed, facts={"Seed": "7", "Trials": "made up"})
    assert "What remains open" in [section.heading for section in page.sections]
    assert len(next(data for data in page.data if data.name == "closing").rows) == 2 * sum(entered.values())

    study, evaluations = _run(spec, effort=replace(few, closing_trials=0))
    left = study.results(evaluations)
    assert left.progress.closing.spent == 0
    assert left.progress.closing.entered == entered
    assert left.accepted(UNIFORM).layout.key == closed.accepted(UNIFORM).layout.key
    low, high = left.saving_ends_eur
    assert low <= left.saving_eur <= high
    assert low < high
    assert "neither shown to meet every limit nor to miss one" in " ".join(summary(left))
