"""The study of antennas and their yaw: what is compared, what is recommended on made-up trials, and the page."""

import csv
import math
from dataclasses import replace

import numpy as np
import pytest
from tracking_specs import TEXT, spec_of

from layoutopt import registry
from layoutopt.errors import InvalidInput
from layoutopt.protocols import Evaluation, Failure
from layoutopt.result import Status
from layoutopt.scores import TRACKING_UNITS, TrialOutcomes
from layoutopt.spec.layout_file import read_layout
from layoutopt.spec.reading import read_spec
from layoutopt.streams import Streams
from studies.antenna_yaw import AntennaYaw
from studies.antenna_yaw_results import MOST_CANDIDATES
from studies.antenna_yaw_setting import EVERY_COUNT, EVERY_YAW_RAD, choice_label, thinned
from studies.antenna_yaw_statistics import bootstrapped_correlation, chance_to_be_best

BEST_M = {1: 0.8, 2: 0.25, 3: 0.24, 4: 0.2}
"""Made-up errors at the best yaw, by number of antennas: the knee is at two."""


@pytest.fixture(scope="module")
def spec(tmp_path_factory):
    return spec_of(tmp_path_factory.mktemp("spec"))


def made_up(study, tasks, *, fresh_more_m=0.0):
    """Return outcomes as if the error grew from 45 degrees to both sides and fell with the number of antennas.

    Replications share a part of their error, as paired trials do; fresh ones may all be worse.
    """
    choices = {choice.layout.key: choice for choice in study.choices}
    found = []
    for task in tasks:
        choice = choices[task.layout.key]
        replications = np.arange(task.first, task.first + task.count)
        off = abs(math.degrees(choice.yaw_rad) - 45.0) / 100.0
        shared_m = 0.02 * np.sin(12.9898 * (replications + 1.0))
        error_m = BEST_M[choice.count] + off + shared_m + np.where(replications >= study.trials, fresh_more_m, 0.0)
        shares = (0.0, 0.9, 0.5, 0.8)
        columns = [error_m, 2 * error_m, 3 * error_m, *(0 * error_m + share for share in shares)]
        outcomes = TrialOutcomes(
            replications=replications, columns=tuple(TRACKING_UNITS), values=np.stack(columns, axis=1)
        )
        found.append(Evaluation(group=task.group, first=task.first, outcomes=outcomes, seconds=0.0))
    return found


def run(study, **changes):
    """Return all evaluations of a study, and the names of its rounds, with made-up outcomes."""
    found, names = [], []
    while batch := study.next_batch(found).tasks:
        names.append(study.next_batch(found).name)
        found += made_up(study, batch, **changes)
    return found, names


def answer_of(spec, **changes):
    """Return the answer on made-up outcomes, and the names of the rounds."""
    study = AntennaYaw.for_spec(spec, quick=False)
    found, names = run(study, **changes)
    return study.answer(found, spec), names


def recommended(answer):
    """Return number and yaw (degrees) of the antennas of the layout that is written."""
    (layout,) = answer.layouts
    parameters = layout.readers[0].parameters
    return int(parameters["count"]), round(math.degrees(float(parameters["yaw_rad"])))


def test_a_spec_that_lists_one_choice_asks_for_all(spec, tmp_path):
    """One number and one yaw are no question; lists are taken as they stand, one by one."""
    every = {(choice.count, choice.yaw_rad) for choice in AntennaYaw.for_spec(spec, quick=False).choices}
    assert every == {(count, yaw_rad) for count in EVERY_COUNT for yaw_rad in EVERY_YAW_RAD}
    listed = spec_of(tmp_path, 'antennas = [1, 2]\nyaw = ["10 deg", "50 deg"]\n')
    choices = AntennaYaw.for_spec(listed, quick=False).choices
    assert [choice.label for choice in choices] == [
        choice_label(count, math.radians(yaw_deg)) for count in (1, 2) for yaw_deg in (10.0, 50.0)
    ]


def test_a_quick_look_takes_the_ends_and_the_middle(spec):
    quick = AntennaYaw.for_spec(spec, quick=True)
    assert {choice.count for choice in quick.choices} == {1, 2, 4}
    assert {round(math.degrees(choice.yaw_rad)) for choice in quick.choices} == {0, 45, 90}
    assert quick.problem.design.duration_s == 60.0
    assert thinned("abcdefg") == ["a", "d", "g"]


def test_without_a_limit_the_knee_of_cost_and_error_is_recommended(spec):
    """Two antennas are much better than one, and three and four hardly better than two."""
    answer, names = answer_of(spec)
    assert recommended(answer) == (2, 45)
    assert (answer.status, answer.exit_code) == (Status.SEARCHED, 0)
    assert names == ["28 cells", "fresh trials of 2 antennas at ±45°"]
    assert any("knee" in line for line in answer.lines(None))


@pytest.mark.parametrize(("limit", "count"), [("1 m", 1), ("0.3 m", 2), ("0.22 m", 4)])
def test_with_a_limit_the_cheapest_choice_within_it_is_recommended(tmp_path, limit, count):
    limited = spec_of(tmp_path, f'[goal]\nlimits = ["tracking_error_mean <= {limit}"]\n')
    answer, _ = answer_of(limited)
    assert recommended(answer) == (count, 45)
    assert (answer.status, answer.exit_code) == (Status.TARGET_MET, 0)


def test_a_limit_that_no_choice_meets_is_told_with_its_shortfall(tmp_path):
    """The nearest choice is written all the same; the exit code says that it does not do."""
    limited = spec_of(tmp_path, '[goal]\nlimits = ["tracking_error_mean <= 0.1 m"]\n')
    answer, names = answer_of(limited)
    assert (answer.status, answer.exit_code) == (Status.TARGET_NOT_MET, 1)
    assert recommended(answer) == (4, 45)
    assert names == ["28 cells"]
    told = " ".join(answer.lines(None))
    assert "where 100 mm is allowed" in told
    assert " short" in told


def test_a_candidate_that_fails_on_fresh_trials_is_not_recommended(tmp_path):
    """What holds in the search and not on fresh trials is dropped; after the last candidate the study gives up."""
    limited = spec_of(tmp_path, '[goal]\nlimits = ["tracking_error_mean <= 0.45 m"]\n')
    answer, names = answer_of(limited, fresh_more_m=0.5)
    assert answer.status is Status.TARGET_NOT_MET
    assert len(names) == 1 + MOST_CANDIDATES
    assert len(set(names)) == len(names)
    assert "on fresh trials" in " ".join(answer.lines(None))


def test_limits_of_other_studies_are_left_alone(tmp_path):
    """An error of localisation says nothing of tracking; that it is not looked at is told."""
    limited = spec_of(tmp_path, '[goal]\ntarget_error = "1 mm"\n')
    assert AntennaYaw.for_spec(limited, quick=False).problem.limits == ()
    answer, _ = answer_of(limited)
    assert answer.exit_code == 0
    assert "Other studies look at these limits: mean position error at most 1 mm." in answer.lines(None)


def test_a_choice_that_fails_is_left_out_and_told(spec):
    study = AntennaYaw.for_spec(spec, quick=False)
    first = study.next_batch(()).tasks
    lost = first[0].group
    found = made_up(study, [task for task in first if task.group != lost])
    found.append(Failure(group=lost, first=0, message="no room for the antenna"))
    while batch := study.next_batch(found).tasks:
        found += made_up(study, batch)
    answer = study.answer(found, spec)
    assert answer.exit_code == 1
    assert recommended(answer) == (2, 45)
    assert "failed: no room for the antenna" in answer.lines(None)


def test_the_page_tells_every_choice_and_the_layout_file_is_read_again(spec, tmp_path):
    answer, _ = answer_of(spec)
    answer.write(tmp_path, streams=Streams(seed=3), quick=False)
    with (tmp_path / "tables" / "choices.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 28
    at_45 = next(row for row in rows if row["antennas"] == "2" and row["yaw_rad"].startswith("0.785"))
    assert float(at_45["tracking_error_mean_m"]) == pytest.approx(0.25, abs=0.02)
    with (tmp_path / "tables" / "differences.csv").open(encoding="utf-8") as file:
        differences = {row["choice"]: float(row["error_more_m"]) for row in csv.DictReader(file)}
    assert differences["1 antenna at 45°"] == pytest.approx(0.55, abs=1e-9)
    assert min(differences[label] for label in differences if label.startswith("2")) == pytest.approx(
        0.15, abs=1e-9
    )
    (written,) = (tmp_path / "layouts").iterdir()
    assert read_layout(written)[1] == answer.layouts[0]
    assert (tmp_path / "figures" / "reach.svg").exists()


def test_a_site_without_room_for_a_walk_is_refused_before_any_trial(tmp_path):
    text = TEXT.partition("[tracking]")[0].replace(
        "[[-1,-3],[5,-3],[5,3],[-1,3]]", "[[0,0],[1.2,0],[1.2,1.2],[0,1.2]]"
    )
    with pytest.raises(InvalidInput, match="robot_at"):
        AntennaYaw.for_spec(spec_of(tmp_path, text=text), quick=False)


def test_prices_change_no_trial(spec):
    """Cost is not part of the question that trials answer."""
    dearer = replace(spec, robot_count=9)
    assert AntennaYaw.for_spec(dearer, quick=False).key == AntennaYaw.for_spec(spec, quick=False).key


def test_the_bootstrap_of_a_rank_correlation_covers_its_value():
    """Of errors that follow a score without noise it is certain; with noise it is an interval about the value."""
    score = np.arange(8.0)
    errors = np.tile(-score[:, None], (1, 12))
    sure = bootstrapped_correlation(score, errors, 1)
    assert (sure.value, sure.low, sure.high) == (-1.0, -1.0, -1.0)
    noise = np.random.Generator(np.random.Philox(5)).standard_normal((8, 12))
    found = bootstrapped_correlation(score, errors + 6.0 * noise, 1)
    assert found.low - 1e-12 <= found.value <= found.high + 1e-12
    assert found.high - found.low > 0.1
    assert found == bootstrapped_correlation(score, errors + 6.0 * noise, 1)
    assert math.isnan(bootstrapped_correlation(np.ones(8), errors, 1).value)


def test_the_chance_to_be_best_is_even_among_equals_and_sure_among_unequals():
    """Of two that differ by noise each is best about as often (five standard errors of 400 cases)."""
    draws = np.random.Generator(np.random.Philox(6))
    shares = [chance_to_be_best(draws.standard_normal((2, 16)), seed) for seed in range(400)]
    assert abs(np.mean(shares) - 0.5) < 5.0 * np.std(shares) / 20.0
    apart = draws.standard_normal((3, 16)) + np.array([[0.0], [9.0], [9.0]])
    assert chance_to_be_best(apart, 1) == 1.0


@pytest.mark.parametrize("name", ["antenna_yaw", "sampling"])
@pytest.mark.parametrize(
    ("line", "said"),
    [
        ('clutter = 12\nclutter_radius = "1 m"', "find room on the floor"),
        ('half_range = "1 mm"', "reaches any place of the walk"),
    ],
    ids=["no room for clutter", "never in range"],
)
def test_a_world_in_which_no_trial_can_run_is_refused_before_any(tmp_path, tiny_text, name, line, said):
    """It would fail in every trial; so it is bad input, told once."""
    path = tmp_path / "world.toml"
    path.write_text(f"{tiny_text}\n[tracking]\n{line}\n", encoding="utf-8")
    with pytest.raises(InvalidInput, match=said):
        registry.load("studies", name).for_spec(read_spec(path), quick=True)


def test_the_yaw_of_a_spec_is_among_the_choices(tmp_path, tiny_text):
    """Also in a quick look, which takes few of the others."""
    path = tmp_path / "own.toml"
    path.write_text(f'{tiny_text}\n[tracking]\nyaw = "20 deg"\nclutter = 0\n', encoding="utf-8")
    study = AntennaYaw.for_spec(read_spec(path), quick=True)
    assert any(choice.yaw_rad == pytest.approx(math.radians(20.0)) for choice in study.choices)
