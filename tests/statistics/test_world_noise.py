"""The errors of a simulated robot have the sizes and shapes that the scenario states.

Every test below has a false alarm rate of at most 1e-6 over the choice of its seed.
"""

import dataclasses

import numpy as np
import pytest
from scipy.stats import chi2, kstest, norm
from shapely.geometry import box

from layoutopt.robot import Gyro, Odometry, Robot
from layoutopt.scenario import Faults, Role, Routes, Scenario
from layoutopt.simulation.motion import drive, increments_between
from layoutopt.simulation.outcomes import standing_steps
from layoutopt.site import Site
from layoutopt.streams import Streams

STREAMS = Streams(seed=21)
FALSE_ALARM = 1e-6
SILENT = Odometry(translation_share=0.0, rotation_rad_per_m=0.0, lateral_share=0.0)


def scenario(*, odometry=SILENT, gyro=None, fitted=False, **fields):
    fields = {"routes": Routes(kind="circle", circle_radius_m=1.0), **fields}
    return Scenario(
        name="noise",
        role=Role.DESIGN,
        site=Site(name="hall", floor=box(0, 0, 8, 5)),
        robot=Robot(
            outline_m=[(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)],
            odometry=odometry,
            gyro=gyro or Gyro(),
            gyro_fitted=fitted,
        ),
        **fields,
    )


def errors_of(world, trials, column=slice(None)):
    """Return what the increments of many trials say beyond the truth, and their stated deviations."""
    driven = [drive(world, STREAMS, number) for number in range(trials)]
    errors = np.concatenate([(one.increments - increments_between(one.poses))[:, column] for one in driven])
    return errors, np.concatenate([one.sigma[:, column] for one in driven])


def assert_variance(values, variance):
    """Check a sum of squares of independent normals against chi-squared."""
    total = (np.asarray(values) ** 2).sum() / variance
    assert chi2.isf(1 - FALSE_ALARM / 2, np.size(values)) < total < chi2.isf(FALSE_ALARM / 2, np.size(values))


@pytest.mark.parametrize("routes", ["circle", "pauses"])
def test_noise_of_time_is_normal_with_the_stated_deviations(routes):
    """Driving or standing, forward and left err by 3 mm and the turn by 20 mrad after a second."""
    odometry = dataclasses.replace(SILENT, translation_m_per_sqrt_s=0.003, rotation_rad_per_sqrt_s=0.02)
    world = scenario(odometry=odometry)
    if routes == "pauses":
        stands = Routes(kind="way_points", way_points_m=[(2.0, 2.0), (4.0, 2.0)], pause_s=60.0)
        world = dataclasses.replace(world, routes=stands)
        assert standing_steps(drive(world, STREAMS, 0).poses).all()
    errors, sigma = errors_of(world, 20)
    deviations = np.array([0.003, 0.003, 0.02])
    for axis in range(3):
        assert_variance(errors[:, axis], deviations[axis] ** 2 * 0.05)
        assert kstest(errors[:, axis] / sigma[:, axis], "norm").pvalue > FALSE_ALARM
    # The place after a whole trial: 60 s of a random walk.
    finals = errors[:, 0].reshape(20, -1).sum(axis=1)
    assert_variance(finals, 0.003**2 * 60.0)


def test_slips_come_as_often_as_stated_and_are_as_large():
    """Slipped steps are counted against Poisson's share of them, their sizes against the normal distribution."""
    world = scenario(faults=Faults(slips_per_m=1.0, slip_sigma_m=0.01))
    errors, sigma = errors_of(world, 60)
    slipped = np.abs(errors[:, 0]) > 1e-12
    # A way of 15 mm and half a track of 0.2 m that turns by 15 mrad: 18 mm of a wheel in every step.
    way_m = 0.3 * 0.05 * (1.0 + 0.2)
    share = 1.0 - np.exp(-way_m)
    expected = share * len(slipped)
    allowed = norm.isf(FALSE_ALARM / 2) * np.sqrt(expected * (1.0 - share))
    assert abs(slipped.sum() - expected) < allowed
    assert kstest(errors[slipped, 0] / 0.01, "norm").pvalue > FALSE_ALARM
    # Nothing else slips, and nobody is told.
    assert np.abs(errors[:, 1:]).max() < 1e-12
    assert sigma.max() == 0.0


def test_several_slips_of_one_step_add_up_in_variance():
    """At 2,000 slips a metre each step has dozens: the sum has the variance of them all."""
    faults = Faults(slips_per_m=2000.0, slip_sigma_m=0.001)
    errors, _ = errors_of(scenario(faults=faults), 10)
    # The number of slips in a step varies by a sixth; over 12,000 steps that widens chi-squared by 2 %.
    variance = 2000.0 * 0.3 * 0.05 * 1.2 * 0.001**2
    ratio = (errors[:, 0] ** 2).mean() / variance
    assert abs(ratio - 1.0) < 1.05 * norm.isf(FALSE_ALARM / 2) * np.sqrt(2.0 / len(errors))


def test_a_robot_that_stands_does_not_slip():
    """Slips come with the way, so a pause has none."""
    routes = Routes(kind="way_points", way_points_m=[(2.0, 2.0), (4.0, 2.0)], pause_s=60.0)
    errors, _ = errors_of(scenario(routes=routes, faults=Faults(slips_per_m=100.0, slip_sigma_m=0.1)), 2)
    assert np.abs(errors).max() < 1e-12


def test_gyro_errs_by_a_walk_within_a_trial_and_a_bias_between_trials():
    """Over 300 trials: the noise about each trial's mean, and the means, have the variances stated."""
    gyro = Gyro(random_walk_rad_per_sqrt_s=0.004, bias_sigma_rad_s=0.01)
    world = scenario(gyro=gyro, step_count=200)
    turned = []
    for number in range(300):
        one = drive(world, STREAMS, number)
        turned.append(one.gyro_turn_rad - np.diff(one.poses[:, 2]))
        assert set(one.gyro_sigma_rad.tolist()) == {gyro.sigma(0.05)}
    rate_rad_s = np.array(turned) / 0.05
    mean_rad_s = rate_rad_s.mean(axis=1)
    within = (rate_rad_s - mean_rad_s[:, None]) ** 2
    total = within.sum() / (0.004**2 / 0.05)
    freedom = 300 * 199
    assert chi2.isf(1 - FALSE_ALARM / 2, freedom) < total < chi2.isf(FALSE_ALARM / 2, freedom)
    # The mean of a trial of 10 s is its bias and what the walk adds.
    deviation = np.sqrt(0.01**2 + 0.004**2 / 10.0)
    assert_variance(mean_rad_s, deviation**2)
    assert kstest(mean_rad_s / deviation, "norm").pvalue > FALSE_ALARM


def test_wheels_and_gyro_together_err_as_stated():
    """Without a bias the fitted turn is normal over its sigma, which is below that of each of the two."""
    gyro = Gyro(random_walk_rad_per_sqrt_s=0.01, bias_sigma_rad_s=0.0)
    odometry = dataclasses.replace(SILENT, rotation_rad_per_m=0.02)
    errors, sigma = errors_of(scenario(odometry=odometry, gyro=gyro, fitted=True), 30, 2)
    wheels = odometry.sigma(np.array([[0.3 * 0.05, 0.0, 0.3 * 0.05]]), 0.05)[0, 2]
    joint = 1.0 / np.sqrt(1.0 / wheels**2 + 1.0 / gyro.sigma(0.05) ** 2)
    # The steps are chords of the circle, a little shorter than its arc.
    np.testing.assert_allclose(sigma, joint, rtol=1e-4)
    assert_variance(errors / sigma, 1.0)
    assert kstest(errors / sigma, "norm").pvalue > FALSE_ALARM


def test_a_fitted_gyro_changes_the_turn_alone():
    """Forward and left are those of the wheels, drawn from the same stream; the true drive is the same."""
    plain = drive(scenario(odometry=Odometry()), STREAMS, 4)
    fitted = drive(scenario(odometry=Odometry(), fitted=True), STREAMS, 4)
    np.testing.assert_array_equal(plain.poses, fitted.poses)
    np.testing.assert_array_equal(plain.increments[:, :2], fitted.increments[:, :2])
    np.testing.assert_array_equal(plain.gyro_turn_rad, fitted.gyro_turn_rad)
    assert (fitted.sigma[:, 2] < plain.sigma[:, 2]).all()
    between = np.sort(np.stack([plain.increments[:, 2], plain.gyro_turn_rad]), axis=0)
    assert ((between[0] <= fitted.increments[:, 2]) & (fitted.increments[:, 2] <= between[1])).all()


def test_wheels_that_stand_outvote_a_gyro_that_drifts():
    """Wheels that cannot err at rest say that the robot does not turn, and that is believed."""
    routes = Routes(kind="way_points", way_points_m=[(2.0, 2.0), (4.0, 2.0)], pause_s=60.0)
    world = scenario(odometry=Odometry(), gyro=Gyro(bias_sigma_rad_s=0.1), fitted=True, routes=routes)
    driven = drive(world, STREAMS, 0)
    assert (driven.increments[:, 2] == 0.0).all()
    assert (driven.sigma[:, 2] == 0.0).all()
    assert np.abs(driven.gyro_turn_rad).max() > 1e-4


def test_new_errors_leave_the_old_draws_alone():
    """Slips, another gyro and asynchronous readers change neither the way nor the noise of the wheels."""
    plain = drive(scenario(odometry=Odometry()), STREAMS, 7)
    faults = Faults(slips_per_m=2.0, slip_sigma_m=0.02, asynchronous=True)
    spoiled = drive(scenario(odometry=Odometry(), gyro=Gyro(bias_sigma_rad_s=1.0), faults=faults), STREAMS, 7)
    assert plain.poses.tobytes() == spoiled.poses.tobytes()
    assert plain.sigma.tobytes() == spoiled.sigma.tobytes()
    assert plain.increments[:, 1:].tobytes() == spoiled.increments[:, 1:].tobytes()
    slipped = plain.increments[:, 0] != spoiled.increments[:, 0]
    assert 0 < slipped.sum() < 0.2 * len(slipped)


def test_a_kidnapped_robot_feels_no_turn():
    """In the air neither wheels nor gyro count: the jump is in the poses alone."""
    world = scenario(
        gyro=Gyro(random_walk_rad_per_sqrt_s=0.0, bias_sigma_rad_s=0.0),
        faults=Faults(kidnapped_at_s=20.0),
        routes=Routes(kind="patrol"),
    )
    driven = drive(world, STREAMS, 3)
    np.testing.assert_allclose(driven.gyro_turn_rad, driven.increments[:, 2], atol=1e-15)
    assert np.abs(driven.gyro_turn_rad).max() <= np.deg2rad(45.0) * 0.05 * (1 + 1e-9)
