"""Whole drives: the compiled run and the plain filter, step by step, differ by chance alone.

They draw other numbers, so their errors are compared: on each of some drives the mean of the plain form's errors
with the mean over six compiled runs. The differences of independent drives go through Student's t test; over the
choice of seeds one suite of all rows and figures raises a false alarm in 10,000.
"""

import math

import numpy as np
import pytest
from filter_worlds import antennas, by_steps, drive, errors, knowledge, lattice_m
from scipy import stats

from layoutopt.estimators.bayes_limit import BayesLimit
from layoutopt.estimators.mcl import MonteCarloLocalisation
from layoutopt.estimators.mcl_adaptive import AdaptiveParticles
from layoutopt.estimators.mcl_crossings import CrossingConstraints
from layoutopt.estimators.mcl_negative_information import NegativeInformation
from layoutopt.readings import Prior

STEPS = 200
RUNS = 6
FIGURES = ("position error", "heading error", "stated deviation", "share of steps lost")
ROWS = {
    "mcl": MonteCarloLocalisation(particles=200),
    "mcl without anew": MonteCarloLocalisation(particles=200, reinitialise=False),
    "mcl gaussian": MonteCarloLocalisation(particles=200, likelihood="gaussian"),
    "mcl gaussian without anew": MonteCarloLocalisation(particles=200, likelihood="gaussian", reinitialise=False),
    "mcl strict": MonteCarloLocalisation(particles=200, alpha=0.3, beta=0.5),
    "crossings": CrossingConstraints(particles=200),
    "negative information": NegativeInformation(particles=200),
    "adaptive": AdaptiveParticles(particles=400, least_particles=50),
    "limit": BayesLimit(particles=400),
}
WORLDS = {
    "dense": {"pitch_m": 0.1},
    "sparse, spoiled": {"pitch_m": 0.2, "one_tag": True, "period": 2, "missed": 0.1, "wrong": 0.03},
    "unknown start, kidnapped": {"pitch_m": 0.15, "kidnapped": 100},
}
CASES = [(row, world) for row in ROWS for world in WORLDS]
SHORT = [
    *((row, "dense") for row in ROWS if row not in ("limit", "mcl gaussian")),
    *((row, "sparse, spoiled") for row in ROWS if row not in ("limit", "mcl gaussian without anew")),
    *((row, "unknown start, kidnapped") for row in ("mcl", "crossings", "adaptive")),
]


def figures(poses, covariance, lost, true, settle):
    """Return what is compared: see ``FIGURES``; the deviation as its logarithm."""
    position_m, heading_rad = errors(poses, true)
    deviation = 0.5 * np.log(np.trace(covariance, axis1=1, axis2=2) + 1e-12)
    return position_m[settle:].mean(), heading_rad[settle:].mean(), deviation[settle:].mean(), np.mean(lost)


def both(estimator, prior, known, told, true, seed, settle=20):
    """Return the figures of the plain form, and the mean of those of some compiled runs."""
    estimates = by_steps(estimator, prior, known, told, seed)
    plain = figures(
        np.array([one.values for one in estimates]),
        np.array([one.covariance for one in estimates]),
        np.array([bool(one.health) for one in estimates]),
        true,
        settle,
    )
    runs = [estimator.run(prior, known, told, np.random.default_rng([seed, run])) for run in range(RUNS)]
    compiled = [figures(run.poses, run.covariance, run.lost, true, settle) for run in runs]
    return plain, np.mean(compiled, axis=0)


def assert_equal_by_chance(plain, compiled, false_alarm, within):
    """Test the paired differences, shape (drives, figures), and that the test could have seen ``within``.

    ``within`` are shares of the mean for the two errors, and absolute for deviation and health; ``None`` where
    a world is too wild for a bound on what the test sees.
    """
    plain, compiled = np.array(plain), np.array(compiled)
    drives = len(plain)
    differences = plain - compiled
    limit = stats.t.isf(false_alarm / (2 * len(FIGURES)), drives - 1)
    for place, name in enumerate(FIGURES):
        mean = differences[:, place].mean()
        # What hardly ever varies has no t distribution: one lost step of a drive is chance too.
        least = 1.0 / STEPS if name == "share of steps lost" else 1e-9
        standard_error = max(differences[:, place].std(ddof=1), least) / np.sqrt(drives)
        assert abs(mean) < limit * standard_error, (name, mean, standard_error)
        if within is not None and within[place] is not None:
            scale = compiled[:, place].mean() if place < 2 else 1.0
            assert limit * standard_error < within[place] * scale, (name, limit * standard_error / scale)


def compare(row, world, drives, false_alarm, within):
    conditions = dict(WORLDS[world])
    carried = {name: conditions.pop(name) for name in ("one_tag", "period") if name in conditions}
    known = knowledge(lattice_m(conditions.pop("pitch_m")), antennas(radius_m=0.05, **carried))
    pairs = []
    for number in range(drives):
        draws = np.random.default_rng([number, 7])
        true, told = drive(draws, known, STEPS, **conditions)
        start = tuple(true[0] + 0.02 * draws.standard_normal(3))
        sigma = math.inf if "kidnapped" in conditions else 0.02
        prior = Prior(pose=start, sigma_m=sigma, sigma_rad=sigma)
        pairs.append(both(ROWS[row], prior, known, told, true[1:], number))
    assert_equal_by_chance(*zip(*pairs, strict=True), false_alarm, within)


@pytest.mark.parametrize(("row", "world"), SHORT)
def test_run_and_steps_differ_by_chance(row, world):
    """On 12 drives; in the dense world a position error 15 % off, or a deviation 10 % off, would be seen."""
    within = (0.15, None, 0.1, None) if world == "dense" else None
    compare(row, world, 12, 1e-4 / len(SHORT), within)


@pytest.mark.long
@pytest.mark.parametrize(("row", "world"), CASES)
def test_run_and_steps_differ_by_chance_on_many_drives(row, world):
    """On 30 drives, where position errors 6 % off and heading errors 25 % off would be seen."""
    within = (0.06, 0.25, 0.03, 0.01) if world == "dense" else None
    compare(row, world, 30, 1e-4 / len(CASES), within)
