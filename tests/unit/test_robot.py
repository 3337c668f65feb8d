"""Robots: what their odometry and their gyro say of themselves, and which numbers are refused."""

import dataclasses
import math

import numpy as np
import pytest

from layoutopt.robot import BIAS_TIME_S, Gyro, Odometry, Robot

OUTLINE_M = [(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)]


def test_variances_of_way_and_time_add_up():
    """In each axis the square of the deviation is that of the way plus that of the time."""
    both = Odometry(translation_m_per_sqrt_s=0.004, rotation_rad_per_sqrt_s=0.03)
    increments = np.array([[0.5, 0.1, 0.2], [0.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    of_way = Odometry().sigma(increments, 0.1)
    of_time = np.array([0.004, 0.004, 0.03]) * math.sqrt(0.1)
    np.testing.assert_allclose(both.sigma(increments, 0.1) ** 2, of_way**2 + of_time**2, rtol=1e-12)


def test_without_terms_of_time_nothing_is_added():
    """A robot that stands does not err, and the deviations are the old ones to the last bit."""
    increments = np.array([[0.3, 0.1, -0.4], [0.0, 0.0, 0.0]])
    sigma = Odometry().sigma(increments, 7.0)
    root = math.sqrt(math.hypot(0.3, 0.1) + 0.2 * 0.4)
    assert sigma[0].tolist() == [0.02 * root, 0.005 * root, float(np.deg2rad(1.0)) * root]
    assert sigma[1].tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("parts", [1, 4, 25])
def test_noise_of_time_does_not_depend_on_the_step(parts):
    """Two seconds at rest have the same variance in one step or in many."""
    odometry = Odometry(translation_m_per_sqrt_s=0.03, rotation_rad_per_sqrt_s=0.05)
    sigma = odometry.sigma(np.zeros((parts, 3)), 2.0 / parts)
    np.testing.assert_allclose((sigma**2).sum(axis=0), 2.0 * np.array([0.03, 0.03, 0.05]) ** 2, rtol=1e-12)


def test_a_gyro_states_the_variance_that_its_bias_has_after_the_stated_time():
    """Random walk and bias add up to the true variance at that time, whatever the step."""
    gyro = Gyro(random_walk_rad_per_sqrt_s=0.002, bias_sigma_rad_s=0.01)
    true_rad2 = 0.002**2 * BIAS_TIME_S + (0.01 * BIAS_TIME_S) ** 2
    for step_s in (0.01, 0.05, 0.5):
        assert gyro.sigma(step_s) ** 2 * BIAS_TIME_S / step_s == pytest.approx(true_rad2)


def test_the_stated_time_suits_a_filter():
    """Of five candidates it gives a Kalman filter the least error: bias 0.1 °/s, a fix of 0.5 ° each second."""
    errors = {}
    for time_s in (BIAS_TIME_S / 4, BIAS_TIME_S / 2, BIAS_TIME_S, BIAS_TIME_S * 2, BIAS_TIME_S * 4):
        noise_deg2 = 0.1**2 * time_s
        stated = true = lag_deg = total = 0.0
        for second in range(400):
            stated += noise_deg2
            lag_deg += 0.1
            gain = stated / (stated + 0.25)
            stated *= 1.0 - gain
            true = (1.0 - gain) ** 2 * true + gain**2 * 0.25
            lag_deg *= 1.0 - gain
            total += (true + lag_deg**2) * (second >= 200)
        errors[time_s] = total
    assert min(errors, key=errors.get) == BIAS_TIME_S


@pytest.mark.parametrize("kind", [Odometry, Gyro])
@pytest.mark.parametrize("value", [-1e-9, math.nan, math.inf])
def test_noise_that_is_no_size_is_refused_by_name(kind, value):
    """Every number of odometry and gyro must be finite and not negative; the message names the one that is not."""
    for one in dataclasses.fields(kind):
        with pytest.raises(ValueError, match=rf"{one.name} of the .* zero or positive"):
            kind(**{one.name: value})


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_a_speed_must_be_positive_and_finite(value):
    """A robot that never arrives, or is everywhere, is refused."""
    for name in ("speed_m_s", "turn_rate_rad_s"):
        with pytest.raises(ValueError, match="speed and turn rate"):
            Robot(outline_m=OUTLINE_M, **{name: value})


def test_the_gyro_is_part_of_the_key():
    """Robots that differ in their gyro alone, or in whether it is fitted, are different values."""
    keys = {
        Robot(outline_m=OUTLINE_M, **gyro).key
        for gyro in ({}, {"gyro_fitted": True}, {"gyro": Gyro(bias_sigma_rad_s=0)})
    }
    assert len(keys) == 3
