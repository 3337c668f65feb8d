"""The midrange estimator and odometry alone, against answers worked out by hand."""

import math

import numpy as np
import pytest

from layoutopt.estimators.midrange import Midrange
from layoutopt.estimators.odometry import OdometryAlone
from layoutopt.layout import TagMap
from layoutopt.protocols import Antennas, FloorKnowledge
from layoutopt.readings import UNKNOWN_TAG, Motion, Prior, TagRead

DRAWS = np.random.default_rng(0)
STILL = Motion(forward_m=0.0, left_m=0.0, turn_rad=0.0, sigma=(0.0, 0.0, 0.0))


def knowledge(tags_m, antennas_m=((0.1, 0.0), (-0.1, 0.0)), radius_m=0.03):
    tags, antennas = len(tags_m), len(antennas_m)
    return FloorKnowledge(
        tags=TagMap(
            ids=np.arange(1, tags + 1),
            xy_m=np.array(tags_m, dtype=float),
            tile=np.zeros((tags, 2), dtype=np.int64),
            zone=np.full(tags, -1),
            sigma_m=np.zeros(tags),
            status=("planned",) * tags,
            uid=(None,) * tags,
        ),
        antennas=Antennas(
            xy_m=np.array(antennas_m, dtype=float),
            height_m=np.full(antennas, 0.02),
            radius_m=np.full(antennas, radius_m),
            period_steps=np.ones(antennas, dtype=np.int64),
            phase_steps=np.zeros(antennas, dtype=np.int64),
            one_tag=np.zeros(antennas, dtype=bool),
        ),
    )


def reads(*pairs):
    return tuple(TagRead(time_s=0.0, antenna=antenna, tag=tag) for antenna, tag in pairs)


def prior(x_m=0.0, y_m=0.0, heading_rad=0.0, sigma_rad=0.0):
    return Prior(pose=(x_m, y_m, heading_rad), sigma_m=0.0, sigma_rad=sigma_rad)


def test_one_read_puts_the_antenna_over_the_tag():
    """Facing up (90 degrees), an antenna 0.1 m ahead over (1, 2) means a robot at (1, 1.9)."""
    running = Midrange().start(prior(heading_rad=math.pi / 2), knowledge([(1.0, 2.0)]), DRAWS)
    np.testing.assert_allclose(running.step(STILL, reads((0, 0))).values, (1.0, 1.9, math.pi / 2), atol=1e-12)


def test_the_middle_of_the_extremes_counts():
    """Tags at x = 0, 1 and 4 cm give 2 cm (Eq. 9-10 of han2006), not their mean."""
    floor = knowledge([(0.0, 0.0), (0.01, 0.03), (0.04, 0.0)], antennas_m=[(0.0, 0.0)])
    running = Midrange().start(prior(), floor, DRAWS)
    np.testing.assert_allclose(running.step(STILL, reads((0, 0), (0, 1), (0, 2))).values, (0.02, 0.015, 0.0))


def test_odometry_fills_the_gaps():
    """Steps without a read, or with an unknown tag only, add the way in the heading before the turn."""
    running = Midrange().start(prior(1.0, 1.0), knowledge([(0.0, 0.0)]), DRAWS)
    step = Motion(forward_m=0.2, left_m=0.1, turn_rad=math.pi / 2, sigma=(0.0, 0.0, 0.0))
    running.step(step, ())
    estimate = running.step(step, reads((0, UNKNOWN_TAG)))
    np.testing.assert_allclose(estimate.values[:2], (1.2 - 0.1, 1.1 + 0.2), atol=1e-12)
    assert abs(estimate.values[2]) == pytest.approx(math.pi)


def test_two_antennas_correct_the_heading():
    """Tags 0.2 m apart along 0.1 rad, below antennas 0.2 m apart ahead, say that the heading is 0.1 rad; it is
    believed in proportion to the variances: (r/2)² / (baseline²/2) for the tags.
    """
    tags_m = [(0.1 * math.cos(0.1), 0.1 * math.sin(0.1)), (-0.1 * math.cos(0.1), -0.1 * math.sin(0.1))]
    measured_variance = 0.015**2 / 0.02
    sigma_rad = math.sqrt(measured_variance)
    both = reads((0, 0), (1, 1))
    half = Midrange().start(prior(sigma_rad=sigma_rad), knowledge(tags_m), DRAWS).step(STILL, both)
    np.testing.assert_allclose(half.values, (0.0, 0.0, 0.05), atol=1e-12)
    all_of_it = Midrange().start(prior(sigma_rad=100.0), knowledge(tags_m), DRAWS).step(STILL, both)
    np.testing.assert_allclose(all_of_it.values[2], 0.1, atol=1e-5)
    sure = Midrange().start(prior(sigma_rad=0.0), knowledge(tags_m), DRAWS).step(STILL, both)
    assert sure.values[2] == 0.0
    too_near = Midrange(baseline_m=0.21).start(prior(sigma_rad=100.0), knowledge(tags_m), DRAWS)
    assert too_near.step(STILL, both).values[2] == 0.0


def test_tags_that_cannot_be_right_do_not_turn_the_robot():
    """Antennas 0.2 m apart cannot lie over tags 0.5 m apart within discs of 30 mm: an identity is wrong."""
    floor = knowledge([(0.1, 0.0), (0.1, 0.5)])
    running = Midrange().start(prior(sigma_rad=1.0), floor, DRAWS)
    assert running.step(STILL, reads((0, 0), (1, 1))).values[2] == 0.0


def test_antennas_out_of_reach_measure_no_heading():
    """A read of an antenna without a disc gives a place, but no heading of infinite certainty, and no NaN."""
    floor = knowledge([(0.1, 0.0), (-0.1, 0.0)], radius_m=0.0)
    running = Midrange().start(prior(heading_rad=0.2), floor, DRAWS)
    estimate = running.step(STILL, reads((0, 0), (1, 1)))
    assert estimate.values[2] == pytest.approx(0.2)
    assert np.isfinite(estimate.values).all()


def test_odometry_alone_reads_nothing():
    """It goes from the prior's mean whatever is read, and states no covariance."""
    running = OdometryAlone().start(prior(1.0, 2.0, math.pi / 2), knowledge([(0.0, 0.0)]), DRAWS)
    motion = Motion(forward_m=0.5, left_m=0.0, turn_rad=math.pi, sigma=(0.1, 0.1, 0.1))
    estimate = running.step(motion, reads((0, 0)))
    np.testing.assert_allclose(estimate.values, (1.0, 2.5, -math.pi / 2), atol=1e-12)
    assert estimate.covariance is None


def test_a_baseline_must_be_positive():
    """Zero would make every pair of reads a compass."""
    with pytest.raises(ValueError, match="baseline"):
        Midrange(baseline_m=0.0)


def test_an_unknown_heading_takes_the_first_measured_one():
    """Two tags under two antennas turn a robot of unknown heading at once, and it stays turned."""
    ahead = knowledge([(0.0, 0.1), (0.0, -0.1)])
    running = Midrange().start(prior(heading_rad=-2.0, sigma_rad=math.inf), ahead, DRAWS)
    estimate = running.step(STILL, reads((0, 0), (1, 1)))
    assert estimate.values == pytest.approx((0.0, 0.0, math.pi / 2.0))
    again = running.step(STILL, reads((0, 0), (1, 1)))
    assert again.values == pytest.approx((0.0, 0.0, math.pi / 2.0))
