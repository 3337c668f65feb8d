"""Outcomes of drives whose errors are written down by hand."""

import dataclasses
import math

import numpy as np
import pytest
from shapely.geometry import box

from layoutopt.errors import InvalidInput
from layoutopt.readings import Observations, Trajectory
from layoutopt.robot import Robot
from layoutopt.scenario import Faults, Judgement, Role, Scenario
from layoutopt.simulation.motion import Drive
from layoutopt.simulation.outcomes import outcome_columns, outcome_row, time_to_localise_s
from layoutopt.site import Site, Zone

STEPS = 10
JUDGEMENT = Judgement(settle_s=0.4, localised_within_m=0.05, hold_s=0.3, lost_beyond_m=0.25)


def row_of(off, covariance=None, zones=(), true=None, judgement=JUDGEMENT, **faults):
    """Return the outcomes, by name, of estimates that are ``off`` the truth by (x, y, heading) in each step."""
    world = Scenario(
        name="hand",
        role=Role.DESIGN,
        site=Site(name="room", floor=box(-9.0, -9.0, 9.0, 9.0), zones=zones),
        robot=Robot(outline_m=np.array([(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3)])),
        faults=Faults(**faults),
        judgement=judgement,
        step_s=0.1,
        step_count=STEPS,
    )
    still = np.zeros((STEPS, 3))
    poses = np.zeros((STEPS + 1, 3)) if true is None else true
    observations = Observations(
        step_s=0.1,
        increments=still,
        sigma=still,
        read_start=np.arange(STEPS + 1) * 2,
        read_antenna=np.zeros(2 * STEPS, dtype=np.int64),
        read_tag=np.zeros(2 * STEPS, dtype=np.int64),
        active=np.ones((STEPS, 1), dtype=bool),
    )
    trajectory = Trajectory(poses=poses[1:] + np.array(off), covariance=covariance)
    driven = Drive(
        poses=poses, increments=still, sigma=still, gyro_turn_rad=still[:, 2], gyro_sigma_rad=still[:, 2]
    )
    row = outcome_row(driven, observations, trajectory, world)
    return dict(zip(outcome_columns(world), row.tolist(), strict=True))


def test_statistics_count_from_the_settling_time():
    """The steps that end at 0.4 s or later count: seven of ten."""
    off = np.zeros((STEPS, 3))
    off[:3] = 9.0
    off[3:, 0] = [-0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.8]
    row = row_of(off)
    assert row["x_error_mean"] == pytest.approx(0.2)
    assert row["x_error_max"] == pytest.approx(0.8)
    # Of the absolute error: six times 0.1² and once 0.6².
    assert row["x_error_variance"] == pytest.approx((6 * 0.1**2 + 0.6**2) / 7)
    assert row["x_error_p95"] == pytest.approx(np.quantile([0.1] * 6 + [0.8], 0.95))
    assert row["y_error_mean"] == row["heading_error_max"] == 0.0
    assert row["lost_share"] == pytest.approx(1 / 7)
    assert row["reads_per_step"] == 2.0
    assert math.isnan(row["nees"])


def test_position_is_the_length_and_heading_wraps():
    """3 and 4 mm make 5 mm; one turn and 0.1 rad are 0.1 rad."""
    row = row_of(np.tile([0.003, -0.004, 2 * np.pi - 0.1], (STEPS, 1)))
    assert row["position_error_mean"] == pytest.approx(0.005)
    assert row["heading_error_mean"] == pytest.approx(0.1)


def test_nees_is_one_for_an_error_as_large_as_stated():
    """Errors of one standard deviation in both axes give (1 + 1) / 2; of three, nine; a zero covariance is no
    division by zero.
    """
    covariance = np.tile(np.diag([0.01**2, 0.02**2]), (STEPS, 1, 1))
    assert row_of(np.tile([0.01, -0.02, 0.0], (STEPS, 1)), covariance)["nees"] == pytest.approx(1.0, rel=1e-6)
    assert row_of(np.tile([0.03, 0.06, 0.0], (STEPS, 1)), covariance)["nees"] == pytest.approx(9.0, rel=1e-6)
    assert math.isfinite(row_of(np.full((STEPS, 3), 0.01), np.zeros((STEPS, 2, 2)))["nees"])


@pytest.mark.parametrize(
    ("error_m", "expected_s"),
    [
        ([0.0] * 10, 0.1),
        ([0.1, 0.1, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.1, 0.1], 0.6),
        ([0.1] * 7 + [0.05, 0.05, 0.05], 0.8),
        ([0.1] * 8 + [0.0, 0.0], 1.0),
        ([0.1] * 10, 1.0),
    ],
)
def test_time_to_localise(error_m, expected_s):
    """The first step of three good ones in a row; the duration where there is none."""
    assert time_to_localise_s(np.array(error_m), 0.1, JUDGEMENT) == pytest.approx(expected_s)


@pytest.mark.parametrize(
    ("error_m", "at_s", "expected_s"),
    [
        ([0.0] * 4 + [0.9, 0.9, 0.0, 0.0, 0.0, 0.0], 0.4, 0.3),
        ([0.9] * 10, 0.4, 0.6),
        ([0.9] * 4 + [0.0] * 6, 0.0, 0.5),
        ([0.9] * 8 + [0.0] * 2, 0.8, 0.2),
        ([0.0] * 10, 0.35, 0.1),
    ],
)
def test_recovery_is_timed_from_the_kidnapping(error_m, at_s, expected_s):
    """It counts from the instant the robot is lifted; what is left of the trial if it never recovers."""
    off = np.zeros((STEPS, 3))
    off[:, 0] = error_m
    assert row_of(off, kidnapped_at_s=at_s)["recovery_time"] == pytest.approx(expected_s)


def test_without_a_kidnapping_there_is_no_recovery():
    """No kidnapping, or one after the end of the drive, leaves the column unknown."""
    assert math.isnan(row_of(np.zeros((STEPS, 3)))["recovery_time"])
    assert math.isnan(row_of(np.zeros((STEPS, 3)), kidnapped_at_s=1.0)["recovery_time"])


def test_standing_only_judges_the_steps_at_rest():
    """Errors while the robot moves or turns do not count, before and after the settling time."""
    true = np.zeros((STEPS + 1, 3))
    true[5:, 0] = 0.1
    true[8:, 2] = 0.1
    off = np.zeros((STEPS, 3))
    off[:, 0] = 0.01
    off[[1, 4, 7], 0] = 9.0
    standing = dataclasses.replace(JUDGEMENT, standing_only=True)
    assert row_of(off, true=true)["position_error_max"] == pytest.approx(9.0)
    row = row_of(off, true=true, judgement=standing)
    assert row["position_error_max"] == pytest.approx(0.01)
    assert row["position_error_mean"] == pytest.approx(0.01)
    assert row["lost_share"] == 0.0


def test_standing_only_needs_a_robot_that_stands():
    """A drive without a pause is refused with what would help, not judged over nothing."""
    true = np.zeros((STEPS + 1, 3))
    true[:, 0] = np.arange(STEPS + 1)
    standing = dataclasses.replace(JUDGEMENT, standing_only=True)
    with pytest.raises(InvalidInput, match=r"scenario 'hand': errors count while the robot stands.*pause"):
        row_of(np.zeros((STEPS, 3)), true=true, judgement=standing)


def test_zones_judge_the_steps_inside():
    """A zone counts the settled steps whose true place lies in it; one without a target is not judged."""
    true = np.zeros((STEPS + 1, 3))
    true[1:, 0] = np.arange(STEPS)
    zones = (
        Zone(name="end", region=box(7.5, -1.0, 9.0, 1.0), target_error_m=0.01),
        Zone(name="begin", region=box(-1.0, -1.0, 2.5, 1.0), target_error_m=0.01),
        Zone(name="free", region=box(3.0, -1.0, 4.0, 1.0)),
    )
    off = np.zeros((STEPS, 3))
    off[:, 1] = 0.001 * np.arange(STEPS)
    row = row_of(off, zones=zones, true=true)
    assert row["end.position_error_mean"] == pytest.approx(0.0085)
    assert row["end.position_error_max"] == pytest.approx(0.009)
    assert math.isnan(row["begin.position_error_mean"])
    assert not any(name.startswith("free.") for name in row)
