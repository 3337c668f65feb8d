"""The compiled Monte Carlo localisation is its plain twin, number by number."""

import numpy as np
import pytest

from layoutopt.detection import bucket_grid
from layoutopt.estimators.mcl import MonteCarloLocalisation
from layoutopt.estimators.mcl_kernels import exponentials, localise
from layoutopt.geometry import wrapped
from layoutopt.layout import TagMap
from layoutopt.protocols import Antennas, FloorKnowledge
from layoutopt.readings import UNKNOWN_TAG, Observations, Prior
from layoutopt.simulation.sensing import antenna_centres, compiled_detections

STEPS = 150
LAYOUTS = {
    "cross, dense": (8, 0.03, 0.05, False),
    "cross, sparse": (8, 0.03, 0.25, False),
    "one antenna": (1, 0.06, 0.1, False),
    "one tag a scan": (6, 0.06, 0.1, True),
    "small and many": (60, 0.009, 0.1, False),
    "out of reach": (3, 0.0, 0.1, False),
}


def tag_map(xy_m, sigma_m=0.0):
    count = len(xy_m)
    return TagMap(
        ids=np.arange(1, count + 1),
        xy_m=xy_m,
        tile=np.zeros((count, 2), dtype=np.int64),
        zone=np.full(count, -1),
        sigma_m=np.full(count, sigma_m),
        status=("planned",) * count,
        uid=(None,) * count,
    )


def drive(draws, count, radius_m, pitch_m, one_tag, turn_sigma_rad=0.0025):
    """Return the true poses, what a robot is told of its drive over a lattice, and what it knows."""
    antennas = Antennas(
        xy_m=draws.uniform(-0.25, 0.25, (count, 2)),
        height_m=np.full(count, 0.02),
        radius_m=np.full(count, radius_m),
        period_steps=np.ones(count, dtype=np.int64),
        phase_steps=np.zeros(count, dtype=np.int64),
        one_tag=np.full(count, one_tag),
    )
    axis_m = np.arange(-1.5, 1.5, pitch_m)
    xy_m = np.stack(np.meshgrid(axis_m, axis_m), axis=-1).reshape(-1, 2)
    sigma = np.tile([0.0015, 0.001, turn_sigma_rad], (STEPS, 1))
    true = np.column_stack([np.full(STEPS, 0.005), np.zeros(STEPS), draws.uniform(-0.3, 0.35, STEPS)])
    poses = np.zeros((STEPS + 1, 3))
    for step, (forward, _, turn) in enumerate(true):
        heading = poses[step, 2]
        poses[step + 1] = poses[step] + [np.cos(heading) * forward, np.sin(heading) * forward, turn]
    grid = bucket_grid(xy_m, radius_m)
    active = np.ones((STEPS, count), dtype=bool)
    centre_m = antenna_centres(poses[1:], antennas)
    step, antenna, tag = compiled_detections(centre_m, active, antennas.radius_m, grid)
    observations = Observations(
        step_s=0.05,
        increments=true + sigma * draws.standard_normal((STEPS, 3)),
        sigma=sigma,
        read_start=np.searchsorted(step, np.arange(STEPS + 1)).astype(np.int64),
        read_antenna=antenna,
        read_tag=tag,
        active=active,
    )
    return poses[1:], observations, FloorKnowledge(tags=tag_map(xy_m), antennas=antennas)


def with_reads(observations, antenna, tag, start):
    return Observations(
        step_s=observations.step_s,
        increments=observations.increments,
        sigma=observations.sigma,
        read_start=start,
        read_antenna=antenna,
        read_tag=tag,
        active=observations.active,
    )


def assert_twins_agree(estimator, prior, knowledge, observations, seed=0):
    run = estimator.run(prior, knowledge, observations, np.random.Generator(np.random.Philox(seed)))
    filtering = estimator.start(prior, knowledge, np.random.Generator(np.random.Philox(seed)))
    estimates = [filtering.step(motion, readings) for motion, readings in observations.steps()]
    poses = np.array([estimate.values for estimate in estimates])
    assert np.isfinite(run.poses).all()
    assert np.isfinite(run.covariance).all()
    np.testing.assert_allclose(run.poses[:, :2], poses[:, :2], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(wrapped(run.poses[:, 2] - poses[:, 2]), 0.0, rtol=0.0, atol=1e-9)
    covariance = np.array([estimate.covariance for estimate in estimates])
    np.testing.assert_allclose(run.covariance, covariance, rtol=1e-7, atol=1e-12)
    return run, estimates


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("likelihood", ["combination", "gaussian"])
@pytest.mark.parametrize("reinitialise", [True, False])
def test_twins_agree(layout, likelihood, reinitialise):
    """From a start that is roughly known, over several layouts."""
    draws = np.random.default_rng(list(LAYOUTS).index(layout))
    _, observations, knowledge = drive(draws, *LAYOUTS[layout])
    estimator = MonteCarloLocalisation(
        particles=200, likelihood=likelihood, reinitialise=reinitialise, beta=0.5, sigma_scale=1.2
    )
    prior = Prior(pose=(0.01, -0.02, 0.03), sigma_m=0.02, sigma_rad=0.05)
    assert_twins_agree(estimator, prior, knowledge, observations)


@pytest.mark.parametrize("reinitialise", [True, False])
@pytest.mark.parametrize("place_m", [0.3, 50.0, 1e6])
def test_twins_agree_when_lost(place_m, reinitialise):
    """From a wrong start, however far, where every plain product of likelihoods underflows."""
    draws = np.random.default_rng(5)
    _, observations, knowledge = drive(draws, *LAYOUTS["small and many"])
    assert len(observations.read_tag) > STEPS
    estimator = MonteCarloLocalisation(particles=100, reinitialise=reinitialise)
    prior = Prior(pose=(place_m, -place_m, 2.0), sigma_m=0.01, sigma_rad=0.1)
    _, estimates = assert_twins_agree(estimator, prior, knowledge, observations)
    lost = [bool(estimate.health) for estimate in estimates]
    assert any(lost)
    if reinitialise:
        assert not all(lost[-20:])


def test_twins_agree_with_wide_noise():
    """Noise in heading beyond the range of the kernel's short series."""
    draws = np.random.default_rng(6)
    _, observations, knowledge = drive(draws, *LAYOUTS["cross, dense"], turn_sigma_rad=0.4)
    prior = Prior(pose=(0.0, 0.0, 0.0), sigma_m=0.01, sigma_rad=1.0)
    assert_twins_agree(MonteCarloLocalisation(particles=200), prior, knowledge, observations)


@pytest.mark.parametrize("particles", [1, 2, 7])
def test_twins_agree_with_few_particles(particles):
    """One particle is a filter too, and numbers that fill no vector register work."""
    draws = np.random.default_rng(7)
    _, observations, knowledge = drive(draws, *LAYOUTS["cross, dense"])
    prior = Prior(pose=(0.0, 0.0, 0.0), sigma_m=0.01, sigma_rad=0.01)
    assert_twins_agree(MonteCarloLocalisation(particles=particles, alpha=0.5), prior, knowledge, observations)


def test_twins_agree_on_nonsense():
    """Reads at random, a third of them of unknown tags, several of one antenna in a step."""
    draws = np.random.default_rng(8)
    _, observations, knowledge = drive(draws, *LAYOUTS["cross, sparse"])
    start = np.sort(draws.integers(0, 601, STEPS + 1))
    start[0], start[-1] = 0, 600
    tag = draws.integers(0, len(knowledge.tags), 600)
    tag[draws.random(600) < 1 / 3] = UNKNOWN_TAG
    nonsense = with_reads(observations, draws.integers(0, 8, 600), tag, start)
    prior = Prior(pose=(0.0, 0.0, 0.0), sigma_m=0.01, sigma_rad=0.01)
    assert_twins_agree(MonteCarloLocalisation(particles=150), prior, knowledge, nonsense)


def test_unknown_tags_say_nothing():
    """A drive on which every identity is unknown is a drive without reads, and gives no NaN."""
    draws = np.random.default_rng(9)
    _, observations, knowledge = drive(draws, *LAYOUTS["cross, dense"])
    unknown = with_reads(
        observations,
        observations.read_antenna,
        np.full_like(observations.read_tag, UNKNOWN_TAG),
        observations.read_start,
    )
    nothing = np.empty(0, dtype=np.int64)
    silent = with_reads(observations, nothing, nothing, np.zeros(STEPS + 1, dtype=np.int64))
    prior = Prior(pose=(0.0, 0.0, 0.0), sigma_m=0.01, sigma_rad=0.01)
    estimator = MonteCarloLocalisation(particles=50)
    first, _ = assert_twins_agree(estimator, prior, knowledge, unknown)
    second, _ = assert_twins_agree(estimator, prior, knowledge, silent)
    np.testing.assert_array_equal(first.poses, second.poses)


def test_an_empty_map_and_a_robot_that_stands():
    """No tags, no motion, no noise: the estimate stays the mean of the particles at the start."""
    draws = np.random.default_rng(10)
    _, observations, knowledge = drive(draws, *LAYOUTS["cross, dense"])
    nothing = np.empty(0, dtype=np.int64)
    still = Observations(
        step_s=0.05,
        increments=np.zeros((STEPS, 3)),
        sigma=np.zeros((STEPS, 3)),
        read_start=np.zeros(STEPS + 1, dtype=np.int64),
        read_antenna=nothing,
        read_tag=nothing,
        active=observations.active,
    )
    empty = FloorKnowledge(tags=tag_map(np.empty((0, 2))), antennas=knowledge.antennas)
    prior = Prior(pose=(1.0, 2.0, 3.0), sigma_m=0.0, sigma_rad=0.0)
    run, _ = assert_twins_agree(MonteCarloLocalisation(particles=20), prior, empty, still)
    np.testing.assert_allclose(run.poses, np.tile([1.0, 2.0, 3.0], (STEPS, 1)), atol=1e-12)


def test_same_seed_same_bits():
    """Two runs with one seed agree to the last bit, and another seed differs."""
    draws = np.random.default_rng(11)
    _, observations, knowledge = drive(draws, *LAYOUTS["cross, dense"])
    prior = Prior(pose=(0.0, 0.0, 0.0), sigma_m=0.01, sigma_rad=0.01)
    first, second, other = (
        MonteCarloLocalisation().run(prior, knowledge, observations, np.random.default_rng(seed)).poses
        for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(first, second)
    assert (first != other).any()


def test_the_kernel_is_compiled_once():
    """Every way to call the kernel shares one signature, so nothing is compiled twice."""
    draws = np.random.default_rng(12)
    _, observations, knowledge = drive(draws, *LAYOUTS["cross, dense"])
    for array in (observations.increments, observations.sigma, observations.read_start, knowledge.tags.xy_m):
        array.setflags(write=False)
    prior = Prior(pose=(0.0, 0.0, 0.0), sigma_m=0.01, sigma_rad=0.01)
    for scale in (1.0, 2.0):
        settings = MonteCarloLocalisation(particles=5, motion_scale=scale, likelihood="gaussian")
        settings.run(prior, knowledge, observations, np.random.Generator(np.random.PCG64(1)))
    assert len(localise.signatures) == 1


def test_exponentials_match_numpy():
    """The kernel's exponential is right to 1e-11 where a weight counts, and zero far below."""
    exponent = np.concatenate([np.linspace(-699.0, 0.0, 5001), [-701.0, -1e4, -1e300]]) + 3.0
    found = np.empty_like(exponent)
    exponentials(exponent, 3.0, found)
    np.testing.assert_allclose(found, np.where(exponent - 3.0 < -700.0, 0.0, np.exp(exponent - 3.0)), rtol=1e-11)
