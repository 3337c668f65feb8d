"""The comparison of estimators: shares of a gap, cells, and the page."""

import math

import numpy as np
import pytest

from layoutopt.protocols import Evaluation
from layoutopt.scores import TrialOutcomes
from layoutopt.simulation.trials import run_trials
from layoutopt.spec.reading import read_spec
from layoutopt.streams import Streams
from studies.estimator_comparison import BASE, WORLDS, EstimatorComparison, contenders
from studies.estimator_page import gap_closed


def table(errors_m, first=0):
    errors_m = np.asarray(errors_m, dtype=np.float64)
    return TrialOutcomes(
        replications=np.arange(first, first + len(errors_m)),
        columns=("position_error_mean",),
        values=errors_m[:, None],
    )


def test_half_of_a_gap():
    """An error in the middle closes half of the gap, the base none of it and the limit all."""
    draws = np.random.default_rng(1)
    base = 0.01 + 0.001 * draws.standard_normal(50)
    half, limit = table(base - 0.002), table(base - 0.004)
    assert gap_closed(table(base), half, limit).value == pytest.approx(0.5)
    assert gap_closed(table(base), table(base), limit).value == 0.0
    assert gap_closed(table(base), limit, limit).value == 1.0
    # The same for every drive: the share is known exactly, however much drives differ.
    assert gap_closed(table(base), half, limit).standard_error == pytest.approx(0.0, abs=1e-9)


def test_only_shared_replications_count():
    """The limit has fewer trials; the others are looked at on the same ones."""
    base, ours, limit = table([4.0, 6.0, 100.0]), table([3.0, 4.0, 0.0]), table([2.0, 2.0])
    found = gap_closed(base, ours, limit)
    assert found.count == 2
    assert found.value == pytest.approx((5.0 - 3.5) / (5.0 - 2.0))


def test_the_standard_error_is_that_of_many_experiments():
    """The jackknife's error agrees with the spread over 400 experiments within 15 %, about four errors."""
    draws = np.random.default_rng(2)
    shares, errors = [], []
    for _ in range(400):
        drive = draws.gamma(50.0, 0.0002, 60)
        base, ours, limit = (
            drive * factor * (1.0 + 0.1 * draws.standard_normal(60)) for factor in (1.0, 0.7, 0.55)
        )
        found = gap_closed(table(base), table(ours), table(limit))
        shares.append(found.value)
        errors.append(found.standard_error)
    assert np.mean(errors) == pytest.approx(np.std(shares), rel=0.15)


def test_one_trial_has_no_error():
    """A single shared trial gives a share, and an unbounded interval."""
    found = gap_closed(table([4.0]), table([3.0]), table([2.0]))
    assert found.value == 0.5
    assert math.isinf(found.standard_error)


def test_every_estimator_meets_the_same_drives():
    """Worlds share the name of their streams; the limits run only where nothing goes wrong."""
    study = EstimatorComparison(trials=2, limit_trials=1, seed=3)
    cells = list(study.cells())
    assert {cell.scenario.name for _, cell in cells} == {"mi2016"}
    assert {place[0] for place, _ in cells} == set(WORLDS)
    limits = {item.label for item in contenders() if item.limit}
    assert {place[0] for place, _ in cells if place[2] in limits} == {"as planned"}
    assert len({cell.group for _, cell in cells}) == len(cells)


def test_the_page_says_what_the_trials_gave(tmp_path):
    """From two trials of three estimators: the numbers of the table are those of the outcomes."""
    study = EstimatorComparison(trials=2, limit_trials=2, seed=3)
    wanted = ("as planned", 100)
    evaluations = [
        Evaluation(
            group=cell.group,
            first=0,
            outcomes=run_trials(cell.layout, cell.scenario, cell.estimator, Streams(seed=3), 0, 2),
            seconds=0.0,
        )
        for place, cell in study.cells()
        if place[:2] == wanted and place[2] in (BASE, "mcl_crossings, 500", "odometry")
    ]
    answer = study.answer(evaluations, read_spec_of_ward())
    answer.write(tmp_path, streams=Streams(seed=3), quick=True)
    csv = (tmp_path / "tables" / "estimators.csv").read_text(encoding="utf-8")
    mean_m = evaluations[0].outcomes.score("position_error_mean").value
    assert f"{mean_m:.9g}" in csv
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert f"{1000.0 * mean_m:.1f}"[:3] in page
    assert answer.exit_code == 0
    lines = answer.lines(None)
    best = min(evaluations, key=lambda item: item.outcomes.score("position_error_mean").value)
    best_mm = 1000.0 * best.outcomes.score("position_error_mean").value
    assert f"{best_mm:.1f}"[:3] in lines[0]
    assert not any("gap is closed" in line for line in lines), "the limit was not driven"


def read_spec_of_ward():
    from layoutopt.spec.template import built_in

    return read_spec(built_in("hospital_ward"))
