"""The compiled steps of a particle filter do what the plain ones do, function by function."""

import math

import numpy as np
import pytest
from scipy import stats

from layoutopt.estimators import particles, particles_kernels
from layoutopt.readings import Motion

COUNTS = (1, 2, 3, 4, 5, 7, 8, 31, 500)


def compiled_cloud(cloud, room=0):
    """Return a plain cloud, shape (3, n), as the kernels hold it: shape (4, n + room), float32."""
    found = np.full((4, cloud.shape[1] + room), 7.0, np.float32)
    found[:, : cloud.shape[1]] = cloud[0], cloud[1], np.cos(cloud[2]), np.sin(cloud[2])
    return found


def cloud_at_random(draws, count, spread_m=1.0):
    return np.stack(
        [*draws.normal(0.0, spread_m, (2, count)), draws.uniform(-math.pi, math.pi, count)],
    )


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("turn_sigma_rad", [0.0, 0.0025, 0.05, 0.169, 0.17, 3.0])
def test_move(count, turn_sigma_rad):
    """To float32's accuracy, on both sides of where the series for small turns ends (1 rad, 5.9 deviations)."""
    draws = np.random.default_rng(count)
    cloud = cloud_at_random(draws, count)
    noise = np.clip(draws.standard_normal((3, count)), -5.9, 5.9)
    noise[2, 0] = 5.89
    sigma = np.array([0.02, 0.01, turn_sigma_rad])
    motion = Motion(forward_m=0.3, left_m=-0.1, turn_rad=2.5, sigma=(0.0, 0.0, 0.0))
    expected = particles.moved(cloud, motion, sigma, noise)
    found = compiled_cloud(cloud, room=3)
    before = found[:, count:].copy()
    increment = np.array([motion.forward_m, motion.left_m, motion.turn_rad])
    particles_kernels.move(found, count, increment, sigma, noise.astype(np.float32).ravel())
    np.testing.assert_allclose(found[:, :count], compiled_cloud(expected), rtol=0.0, atol=2e-6)
    np.testing.assert_array_equal(found[:, count:], before)


@pytest.mark.parametrize("turn_sigma_rad", [0.0025, 0.3])
def test_a_long_way_keeps_the_heading_on_the_circle(turn_sigma_rad):
    """After 10,000 turns cosine and sine still belong to an angle, and to the plain twin's."""
    draws = np.random.default_rng(1)
    cloud = cloud_at_random(draws, 8)
    found = compiled_cloud(cloud)
    sigma = np.array([0.0, 0.0, turn_sigma_rad])
    for _ in range(10_000):
        noise = draws.standard_normal((3, 8)).astype(np.float32)
        motion = Motion(forward_m=0.0, left_m=0.0, turn_rad=0.01, sigma=(0.0, 0.0, 0.0))
        cloud = particles.moved(cloud, motion, sigma, noise.astype(np.float64))
        particles_kernels.move(found, 8, np.array([0.0, 0.0, 0.01]), sigma, noise.ravel())
    np.testing.assert_allclose(np.hypot(found[2], found[3]), 1.0, rtol=0.0, atol=3e-7)
    off_rad = np.arctan2(found[3], found[2]) - cloud[2]
    np.testing.assert_allclose(np.angle(np.exp(1j * off_rad)), 0.0, atol=1e-4)


def test_small_steps_far_from_the_origin_are_not_lost():
    """Half a kilometre off, 1,000 steps of 5 mm add up to 5 m within a millimetre of rounding for each."""
    found = compiled_cloud(np.array([[500.0], [-500.0], [0.0]]))
    for _ in range(1000):
        particles_kernels.move(found, 1, np.array([0.005, 0.0, 0.0]), np.zeros(3), np.zeros(3, np.float32))
    assert abs(found[0, 0] - 505.0) < 1000 * 2.0**-16


def test_exponentials():
    """Right to 3e-7 where a weight counts, zero far below, one at the largest."""
    exponent = np.concatenate([np.linspace(-86.9, 0.0, 50_001), [-87.5, -1e4, -1e30, -np.inf]]).astype(np.float32)
    found = np.empty_like(exponent)
    particles_kernels.exponentials(exponent, 0.0, found)
    kept = exponent > -87.0
    np.testing.assert_allclose(found[kept], np.exp(exponent[kept].astype(np.float64)), rtol=3e-7)
    np.testing.assert_array_equal(found[~kept], 0.0)
    assert found[exponent == 0.0] == 1.0


def test_exponentials_of_differences():
    """What counts is the difference to the shift, however large both are."""
    exponent = np.array([-5000.0, -5001.0, -5002.5, -6000.0], np.float32)
    found = np.empty_like(exponent)
    particles_kernels.exponentials(exponent, -5000.0, found)
    np.testing.assert_allclose(found, [1.0, math.exp(-1.0), math.exp(-2.5), 0.0], rtol=3e-7)


@pytest.mark.parametrize("count", COUNTS)
def test_extremes(count):
    """The smallest and the largest, wherever they stand, infinities included."""
    draws = np.random.default_rng(count)
    for _ in range(20):
        values = draws.normal(0.0, 10.0, count).astype(np.float32)
        values[draws.integers(count)] = draws.choice([-1e30, -np.inf, 1e30, 0.0])
        assert particles_kernels.extremes(values) == (values.min(), values.max())


def test_extremes_of_nothing():
    """Infinity and minus infinity, so that nothing is found between them."""
    assert particles_kernels.extremes(np.empty(0, np.float32)) == (np.inf, -np.inf)


def compiled_estimate(cloud, weight, origin_m=(0.0, 0.0), room=0):
    pose, covariance = np.empty(3), np.empty((2, 2))
    total = particles_kernels.estimate(
        compiled_cloud(cloud, room), weight.astype(np.float32), np.array(origin_m), pose, covariance
    )
    return pose, covariance, total


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("spread_m", [1e-4, 0.01, 3.0])
def test_estimate(count, spread_m):
    """Mean, circular heading and covariance of weighted particles, of the first ones only."""
    draws = np.random.default_rng(count)
    cloud = cloud_at_random(draws, count, spread_m)
    cloud[2] = 3.1 + 0.2 * draws.standard_normal(count)
    weight = draws.random(count) ** 4
    pose, covariance, total = compiled_estimate(cloud, weight, (100.0, -50.0), room=5)
    expected_pose, expected_covariance = particles.weighted_mean(cloud, weight)
    np.testing.assert_allclose(
        pose[:2] - [100.0, -50.0], expected_pose[:2], rtol=0.0, atol=1e-6 * spread_m + 1e-12
    )
    assert abs(math.remainder(pose[2] - expected_pose[2], 2 * math.pi)) < 2e-6
    np.testing.assert_allclose(covariance, expected_covariance, rtol=1e-4, atol=1e-5 * spread_m**2)
    assert abs(total / weight.sum() - 1.0) < 1e-5


@pytest.mark.parametrize("away_m", [0.3, 10.0, 300.0])
def test_estimate_survives_an_outlier_in_the_first_place(away_m):
    """A first particle without weight, however far from a cloud of 3 mm, spoils neither mean nor covariance."""
    draws = np.random.default_rng(2)
    cloud = cloud_at_random(draws, 500, 0.003)
    cloud[:2, 0] = away_m
    weight = np.ones(500)
    weight[0] = 0.0
    pose, covariance, _ = compiled_estimate(cloud, weight)
    expected_pose, expected_covariance = particles.weighted_mean(cloud, weight)
    np.testing.assert_allclose(pose[:2], expected_pose[:2], atol=1e-6 + 1e-6 * away_m)
    np.testing.assert_allclose(covariance, expected_covariance, rtol=0.02, atol=2e-7)


def test_a_covariance_that_some_cloud_has():
    """Particles on a line or in one place give no negative variance and no correlation beyond one."""
    along = np.linspace(-1.0, 1.0, 501)
    for slope in (0.0, 1.0, -3.0, 1e-4):
        _, covariance, _ = compiled_estimate(np.stack([along + 5.0, slope * along, 0.0 * along]), np.ones(501))
        assert (np.linalg.eigvalsh(covariance) >= -1e-12).all()
    _, covariance, _ = compiled_estimate(np.full((3, 7), 0.3), np.ones(7))
    np.testing.assert_array_equal(covariance, 0.0)


def compiled_parents(weight, count, uniform):
    size = len(weight)
    parent = np.full(count, 2**32 - 1, np.uint32)
    particles_kernels.systematic_parents(
        uniform, weight.astype(np.float32), np.empty(size + 3), np.empty(size + 4, np.uint32), parent
    )
    return parent.astype(np.int64)


@pytest.mark.parametrize("size", COUNTS)
@pytest.mark.parametrize("count", [1, 2, 6, 100, 777])
def test_systematic_parents(size, count):
    """The twin's parents for more or fewer children than weights, some of them zero."""
    draws = np.random.default_rng([size, count])
    for trial in range(20):
        weight = draws.random(size) ** (1 + trial) * (draws.random(size) < (0.3 if trial % 2 else 1.0))
        weight[draws.integers(size)] = 1.0
        weight = weight.astype(np.float32).astype(np.float64)
        uniform = float(draws.random())
        expected = particles.systematic_parents(weight, count, uniform)
        found = compiled_parents(weight, count, uniform)
        # A mark within rounding of where a particle ends may fall to its neighbour.
        assert (found != expected).sum() <= (0 if size * count < 10_000 else 1)
        assert (weight[found] > 0.0).all()
        assert (np.diff(found) >= 0).all()
        children = np.bincount(found, minlength=size)
        assert (np.abs(children - count * weight / weight.sum()) < 1.0 + 1e-6).all()


@pytest.mark.parametrize("uniform", [2.0**-33, 0.5, 1.0 - 2.0**-33])
def test_no_child_without_weight(uniform):
    """Zeros at the beginning, in the middle and at the end, at both ends of the range of the one random number."""
    weight = np.zeros(40)
    weight[[7, 20]] = 1.0, 1e-6
    for count in (1, 40, 5000):
        found = compiled_parents(weight, count, uniform)
        np.testing.assert_array_equal(found, particles.systematic_parents(weight, count, uniform))
        assert set(found) <= {7, 20}


def test_equal_weights_keep_every_particle():
    """Then each is its own only child."""
    for size in COUNTS:
        np.testing.assert_array_equal(compiled_parents(np.ones(size), size, 0.3), np.arange(size))


def test_gather():
    """The rows that the parents name, one after the other; what lies beyond stays."""
    draws = np.random.default_rng(3)
    cloud = draws.random((4, 50)).astype(np.float32)
    parent = draws.integers(0, 50, 37).astype(np.uint32)
    out = np.full((4, 50), -1.0, np.float32)
    particles_kernels.gather(cloud, parent, out)
    np.testing.assert_array_equal(out[:, :37], cloud[:, parent])
    np.testing.assert_array_equal(out[:, 37:], -1.0)


@pytest.mark.parametrize(
    ("bins", "error", "count"), [(0, 0.05, 1), (1, 0.05, 1), (2, 0.05, 66), (10, 0.05, 217), (100, 0.05, 1347)]
)
def test_kld_particles(bins, error, count):
    """Fox's number of particles is a quantile of chi-squared over twice the bound, to the approximation's 1 %."""
    found = particles.kld_particles(bins, error)
    assert round(found) == pytest.approx(count, abs=1)
    if bins > 2:
        assert found == pytest.approx(stats.chi2.ppf(0.99, bins - 1) / (2.0 * error), rel=0.01)


def test_kld_particles_grow_with_bins_and_shrink_with_the_error():
    """More bins take more particles, a wider bound fewer."""
    counts = [particles.kld_particles(bins, 0.05) for bins in range(1, 300)]
    assert (np.diff(counts) > 0).all()
    assert particles.kld_particles(50, 0.1) == pytest.approx(particles.kld_particles(50, 0.05) / 2.0)
