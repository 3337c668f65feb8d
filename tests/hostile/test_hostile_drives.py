"""No drive, start, map or reading makes a particle filter fail: it answers in numbers, and says if it is lost.

`test_kernel_bounds` runs this file again with every index of the kernels checked.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from filter_worlds import CROSS_M, SIGMA, antennas, drive, knowledge, lattice_m, without_reads

from layoutopt.estimators.bayes_limit import BayesLimit
from layoutopt.estimators.mcl import MonteCarloLocalisation
from layoutopt.estimators.mcl_adaptive import AdaptiveParticles
from layoutopt.estimators.mcl_crossings import CrossingConstraints
from layoutopt.estimators.mcl_negative_information import NegativeInformation
from layoutopt.protocols import FloorKnowledge
from layoutopt.readings import UNKNOWN_TAG, Prior

STEPS = 60
ROWS = {
    "mcl": MonteCarloLocalisation(particles=60),
    "mcl gaussian": MonteCarloLocalisation(particles=60, likelihood="gaussian", reinitialise=False),
    "crossings": CrossingConstraints(particles=60),
    "negative information": NegativeInformation(particles=60),
    "adaptive": AdaptiveParticles(particles=300, least_particles=20),
    "limit": BayesLimit(particles=100),
}
NEAR = Prior(pose=(0.0, 0.0, 0.0), sigma_m=0.5, sigma_rad=0.5)


def with_increments(told, increments, sigma):
    return replace(
        told, increments=np.broadcast_to(increments, (STEPS, 3)), sigma=np.broadcast_to(sigma, (STEPS, 3))
    )


def reads_at_random(told, known, draws, count=600):
    """Any antenna, any tag, a third of them unknown, in any step; several of one antenna and tag in a step too."""
    start = np.sort(draws.integers(0, count + 1, STEPS + 1))
    start[0], start[-1] = 0, count
    tag = draws.integers(0, len(known.tags), count)
    tag[draws.random(count) < 1 / 3] = UNKNOWN_TAG
    return replace(told, read_start=start, read_antenna=draws.integers(0, 8, count), read_tag=tag)


def base(pitch_m=0.1, **carried):
    draws = np.random.default_rng(1)
    known = knowledge(lattice_m(pitch_m), antennas(**{"radius_m": 0.05, **carried}))
    return draws, known, drive(draws, known, STEPS)[1]


def start(place_m=0.0, sigma_m=0.02, sigma_rad=0.05):
    return Prior(pose=(0.5 + place_m, -place_m, 1.0), sigma_m=sigma_m, sigma_rad=sigma_rad)


def cases():
    """Yield name, prior, knowledge and observations of every case."""
    draws, known, told = base()
    yield "as it should be", NEAR, known, told
    yield "several readers that collide", NEAR, *base(0.04, one_tag=True, period=4)[1:]
    yield "seventy tags in a field", NEAR, *base(0.05, radius_m=0.24, period=4)[1:]
    yield "out of reach", NEAR, *base(radius_m=0.0)[1:]
    for place_m in (1.0, 50.0, 1e6, 1e12):
        yield f"told to be {place_m:g} m off", start(place_m), known, told
    yield "sure and wrong", start(0.3, 0.0, 0.0), known, told
    yield "start unknown", start(0.0, math.inf, math.inf), known, told
    yield "place unknown", start(0.0, math.inf, 0.0), known, told
    yield "heading unknown", start(0.0, 0.1, math.inf), known, told
    yield "nothing known, nothing read", start(0.0, math.inf, math.inf), known, without_reads(told)
    yield "leaves the floor", NEAR, known, with_increments(told, [1.0, 0.2, 0.01], SIGMA)
    yield "leaves the country", NEAR, known, with_increments(told, [1e6, 0.0, 0.3], SIGMA)
    yield "no noise", start(0.0, 0.0, 0.0), known, with_increments(told, told.increments, [0.0, 0.0, 0.0])
    yield "stands", NEAR, known, with_increments(told, [0.0, 0.0, 0.0], [0.0, 0.0, 0.0])
    yield "huge noise", NEAR, known, with_increments(told, told.increments, [1e3, 1e3, 1e3])
    yield "huge noise in the heading", NEAR, known, with_increments(told, told.increments, [1e-3, 1e-3, 0.4])
    empty = FloorKnowledge(tags=knowledge(np.empty((0, 2))).tags, antennas=known.antennas)
    for name, prior in (("known", NEAR), ("unknown", start(0.0, math.inf, math.inf)), ("far", start(1e6))):
        yield f"no tag on the floor, start {name}", prior, empty, without_reads(told)
    one = FloorKnowledge(tags=knowledge(np.array([[0.5, 0.1]])).tags, antennas=known.antennas)
    for name, prior in (("known", NEAR), ("unknown", start(0.0, math.inf, math.inf))):
        yield f"one tag, start {name}", prior, one, drive(draws, one, STEPS)[1]
    same = FloorKnowledge(tags=knowledge(np.full((70, 2), 0.4)).tags, antennas=known.antennas)
    yield "seventy tags in one place", start(0.0, math.inf, math.inf), same, drive(draws, same, STEPS)[1]
    yield "all identities unknown", NEAR, known, replace(told, read_tag=np.full_like(told.read_tag, UNKNOWN_TAG))
    for prior in (NEAR, start(0.0, math.inf, math.inf)):
        yield "reads at random", prior, known, reads_at_random(told, known, draws)
    yield "no antenna scans", NEAR, known, replace(without_reads(told), active=np.zeros_like(told.active))
    yield "reads of antennas that do not scan", NEAR, known, replace(told, active=np.zeros_like(told.active))
    yield "identities wrong", NEAR, known, drive(draws, known, STEPS, wrong=1.0)[1]
    loose = knowledge(lattice_m(0.1), known.antennas, sigma_m=3.0)
    yield "tags laid anywhere", NEAR, loose, told
    yield "one antenna", NEAR, *base(xy_m=CROSS_M[:1])[1:]


CASES = [(f"{number}: {name}", *case) for number, (name, *case) in enumerate(cases())]


def assert_sound(run, steps=STEPS):
    assert run.poses.shape == (steps, 3)
    assert np.isfinite(run.poses).all()
    assert (np.abs(run.poses[:, 2]) <= math.pi + 1e-12).all()
    assert run.covariance.shape == (steps, 2, 2)
    assert np.isfinite(run.covariance).all()
    np.testing.assert_array_equal(run.covariance, run.covariance.transpose(0, 2, 1))
    scale = np.abs(run.covariance).max(initial=0.0) + 1e-30
    assert (np.linalg.eigvalsh(run.covariance) >= -1e-9 * scale).all()
    assert run.lost.dtype == np.bool_
    assert run.lost.shape == (steps,)
    assert run.log_evidence.shape == (steps,)
    assert np.isfinite(run.log_evidence).all()
    assert (run.log_evidence <= 1e-5).all()


@pytest.mark.parametrize("case", CASES, ids=[case[0] for case in CASES])
@pytest.mark.parametrize("row", ROWS)
def test_answers_stay_finite(row, case):
    """Poses, covariances and evidence are numbers, health is yes or no; a second run gives the same bits."""
    _, prior, known, told = case
    first, second = (ROWS[row].run(prior, known, told, np.random.default_rng(3)) for _ in range(2))
    assert_sound(first)
    for name in ("poses", "covariance", "lost", "log_evidence"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))


@pytest.mark.parametrize("case", CASES, ids=[case[0] for case in CASES])
@pytest.mark.parametrize("row", ROWS)
def test_the_plain_form_stays_finite(row, case):
    """The same for the filter step by step, over the first steps."""
    _, prior, known, told = case
    running = ROWS[row].start(prior, known, np.random.default_rng(3))
    for motion, readings in list(told.steps())[:8]:
        estimate = running.step(motion, readings)
        assert np.isfinite(estimate.values).all()
        assert np.isfinite(estimate.covariance).all()


@pytest.mark.parametrize("particles", [1, 2, 3, 5, 9, 10_000])
@pytest.mark.parametrize("row", ROWS)
def test_any_number_of_particles(row, particles):
    """One particle is a filter too, numbers that fill no vector register work, and many do."""
    _, known, told = base()
    least = {"least_particles": max(1, particles // 3)} if row == "adaptive" else {}
    estimator = replace(ROWS[row], particles=particles, **least)
    for prior in (NEAR, start(0.0, math.inf, math.inf), start(0.3, 0.0, 0.0)):
        assert_sound(estimator.run(prior, known, told, np.random.default_rng(4)))


@pytest.mark.parametrize(
    "settings",
    [
        {"least_particles": 1, "bin_m": 1e-9},
        {"least_particles": 1, "bin_m": 1e9},
        {"kld_error": 1e-9},
        {"kld_error": 1e9, "least_particles": 1},
        {"bin_m": 1e-5, "kld_error": 1.0},
        {"edge_share": 1e-12, "outlier": 1e-300, "doubt": 1e-300, "miss_share": 1e-300, "alpha": 1e-300},
        {"edge_share": 1e12, "roughening_m": 1e3, "motion_scale": 1e6},
        {"patience": 1, "alpha": 1.0 - 1e-12, "outlier": 1.0 - 1e-12},
        {"patience": 10**9, "motion_scale": 0.0, "roughening_m": 0.0},
    ],
)
def test_settings_at_the_ends_of_their_ranges(settings):
    """Bins finer than an atom or wider than the earth, likelihoods near 0 and near 1."""
    draws, known, told = base()
    for prior in (NEAR, start(0.0, math.inf, math.inf)):
        for seen in (told, reads_at_random(told, known, draws)):
            run = replace(ROWS["adaptive"], **settings).run(prior, known, seen, np.random.default_rng(5))
            assert_sound(run)


@pytest.mark.parametrize("row", ROWS)
def test_another_seed_differs(row):
    """The filter's numbers come from the stream that it is given."""
    _, known, told = base()
    first, other = (ROWS[row].run(NEAR, known, told, np.random.default_rng(seed)).poses for seed in (1, 2))
    assert (first != other).any(axis=1).all()


@pytest.mark.parametrize("row", ROWS)
def test_nothing_is_left_over_from_runs_before(row):
    """Whatever ran before, with more particles or on another floor, a run gives the same bits."""
    _, known, told = base()
    first = ROWS[row].run(NEAR, known, told, np.random.default_rng(6))
    for _, prior, floor, seen in CASES[3:10]:
        replace(ROWS[row], particles=400).run(prior, floor, seen, np.random.default_rng(7))
    again = ROWS[row].run(NEAR, known, told, np.random.default_rng(6))
    for name in ("poses", "covariance", "lost", "log_evidence"):
        np.testing.assert_array_equal(getattr(first, name), getattr(again, name))


@pytest.mark.parametrize("row", ROWS)
def test_the_readings_are_left_as_they_were(row):
    """Read-only columns are enough, so a filter cannot have written to them."""
    _, known, told = base()
    columns = ("increments", "sigma", "read_start", "read_antenna", "read_tag", "active")
    frozen = replace(told, **{name: getattr(told, name).copy() for name in columns})
    for name in columns:
        getattr(frozen, name).setflags(write=False)
    first, second = (ROWS[row].run(NEAR, known, one, np.random.default_rng(8)).poses for one in (told, frozen))
    np.testing.assert_array_equal(first, second)


@pytest.mark.parametrize("row", ROWS)
def test_a_drive_without_steps(row):
    """Nothing in, nothing out."""
    _, known, told = base()
    none = replace(
        told,
        increments=told.increments[:0],
        sigma=told.sigma[:0],
        read_start=told.read_start[:1],
        read_antenna=told.read_antenna[:0],
        read_tag=told.read_tag[:0],
        active=told.active[:0],
        gyro_turn_rad=np.empty(0),
        gyro_sigma_rad=np.empty(0),
    )
    assert_sound(ROWS[row].run(NEAR, known, none, np.random.default_rng(9)), steps=0)


@pytest.mark.parametrize("row", ROWS)
def test_unknown_tags_say_nothing(row):
    """A drive on which every identity is unknown is to the bit a drive without reads."""
    _, known, told = base()
    unknown = replace(told, read_tag=np.full_like(told.read_tag, UNKNOWN_TAG))
    first, second = (
        ROWS[row].run(NEAR, known, one, np.random.default_rng(10)) for one in (unknown, without_reads(told))
    )
    np.testing.assert_array_equal(first.poses, second.poses)
    np.testing.assert_array_equal(first.log_evidence, second.log_evidence)


@pytest.mark.parametrize("row", ROWS)
def test_a_robot_that_stands_and_sees_nothing_stays(row):
    """No tags, no motion, no noise: the estimate stays where the robot was told to be, sure of it."""
    _, known, told = base()
    empty = FloorKnowledge(tags=knowledge(np.empty((0, 2))).tags, antennas=known.antennas)
    still = with_increments(without_reads(told), [0.0, 0.0, 0.0], [0.0, 0.0, 0.0])
    rough = {} if row.startswith("mcl") else {"roughening_m": 0.0}
    prior = Prior(pose=(1.0, 2.0, 3.0), sigma_m=0.0, sigma_rad=0.0)
    run = replace(ROWS[row], **rough).run(prior, empty, still, np.random.default_rng(11))
    np.testing.assert_allclose(run.poses, np.tile([1.0, 2.0, 3.0], (STEPS, 1)), atol=1e-6)
    np.testing.assert_array_equal(run.covariance, 0.0)
    assert not run.lost.any()
