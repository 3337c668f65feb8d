"""Whatever a robot is told, the estimators of one reader answer with finite poses and raise nothing."""

import math

import numpy as np
import pytest
from filter_worlds import antennas, by_steps, knowledge, observations
from hypothesis import given, settings
from hypothesis import strategies as st
from reader_worlds import driven

from layoutopt.estimators.crossing_time import CrossingTime
from layoutopt.estimators.crossing_time_branches import CrossingTimeBranches
from layoutopt.estimators.one_reader import COMPENSATIONS, GATHERINGS, ORIENTATIONS, OneReader
from layoutopt.estimators.one_reader_centroid import OneReaderCentroid
from layoutopt.estimators.one_reader_minimax import OneReaderMinimax
from layoutopt.readings import UNKNOWN_TAG, Prior
from studies.published.one_by_one import OneByOne

CROSSING = [CrossingTime(), CrossingTimeBranches(), CrossingTimeBranches(clock="time")]
READER = [
    kind(gathering=gathering, compensation=compensation, orientation=orientation)
    for kind in (OneReader, OneReaderCentroid, OneReaderMinimax)
    for gathering in GATHERINGS
    for compensation in COMPENSATIONS
    for orientation in ORIENTATIONS
]
WRAPPED = [OneByOne(inner=OneReader(gathering="one_by_one")), OneByOne(inner=CrossingTimeBranches())]


def moved(kind, count, draws):
    """Return steps of a robot that moves in some way."""
    steps = np.zeros((count, 3))
    if kind == "anyhow":
        return draws.normal(0.0, (0.01, 0.005, 0.1), (count, 3))
    if kind == "spot":
        steps[:, 2] = draws.choice([0.001, 0.01, 0.5])
    elif kind != "still":
        angle = draws.uniform(-math.pi, math.pi) if kind == "sideways" else 0.0
        steps[:, :2] = draws.choice([0.001, 0.01, 1.0 / 128.0]) * np.array([math.cos(angle), math.sin(angle)])
    if kind == "to and fro":
        steps[np.arange(count) // int(draws.integers(1, 40)) % 2 == 1, 0] *= -1.0
    if kind == "corners":
        steps[np.arange(count) // int(draws.integers(5, 60)) % 2 == 1] = (0.0, 0.01, draws.choice([0.0, 0.05]))
    return steps


def read(kind, known, start, steps, draws):
    """Return the reads of a drive, (step, antenna, tag): true ones, some wrong, or any at all."""
    _, told = driven(known, start, steps)
    step = np.repeat(np.arange(len(steps)), np.diff(told.read_start))
    reads = [(int(number), 0, int(tag)) for number, tag in zip(step, told.read_tag, strict=True)]
    if kind == "true":
        return reads
    if kind == "wrong":
        return [
            (number, 0, tag if draws.random() < 0.7 else int(draws.integers(UNKNOWN_TAG, len(known.tags))))
            for number, _, tag in reads
        ]
    count = int(draws.integers(0, 2 * len(steps) + 1))
    return [
        (int(draws.integers(len(steps))), 0, int(draws.integers(UNKNOWN_TAG, len(known.tags))))
        for _ in range(count if len(steps) else 0)
    ]


def world_of(seed, motion, reading, sigma):
    """Return floor and antenna, what a robot is told on a drive, and where it starts."""
    draws = np.random.default_rng(seed)
    side_m = np.arange(6) * draws.choice([0.05, 0.1, 0.35])
    xy_m = np.stack(np.meshgrid(side_m, side_m), axis=-1).reshape(-1, 2)
    # Some tags lie at one place: nobody should lay them so, but somebody will.
    xy_m[: int(draws.integers(1, 4))] = xy_m[0]
    lever_m = draws.choice([0.0, 0.15], (1, 2))
    known = knowledge(xy_m, antennas(lever_m, draws.choice([0.03, 0.1, 0.125]), int(draws.choice([1, 1, 3]))))
    steps = moved(motion, int(draws.integers(0, 160)), draws)
    start = (*draws.uniform(0.0, side_m[-1], 2).tolist(), float(draws.uniform(-3.0, 3.0)))
    active = np.arange(len(steps))[:, None] % known.antennas.period_steps == 0
    reads = read(reading, known, start, steps, draws)
    told = observations(
        steps + sigma * draws.standard_normal(steps.shape), np.full(steps.shape, sigma), active, reads
    )
    return known, told, start


any_stream = given(
    seed=st.integers(0, 2**32),
    motion=st.sampled_from(["anyhow", "ahead", "sideways", "spot", "still", "to and fro", "corners"]),
    reading=st.sampled_from(["true", "wrong", "any"]),
    sigma=st.sampled_from([0.0, 1e-6, 1e-3, 0.1]),
    sigma_m=st.sampled_from([0.0, 0.02, math.inf]),
    sigma_rad=st.sampled_from([0.0, 0.02, math.inf]),
    estimators=st.tuples(st.sampled_from(CROSSING), st.sampled_from(READER + WRAPPED)),
)


def assert_finite(seed, motion, reading, sigma, sigma_m, sigma_rad, estimators):
    known, told, start = world_of(seed, motion, reading, sigma)
    prior = Prior(pose=start, sigma_m=sigma_m, sigma_rad=sigma_rad)
    for estimator in estimators:
        poses = estimator.run(prior, known, told, np.random.default_rng(0)).poses
        assert poses.shape == (len(told), 3)
        assert np.isfinite(poses).all()


@any_stream
@settings(max_examples=50)
def test_any_stream_gives_finite_poses(**drawn):
    """Reads of any tag, several at once, still robots, reversals, unknown starts, deviations of zero."""
    assert_finite(**drawn)


@pytest.mark.long
@any_stream
@settings(max_examples=1000)
def test_many_streams_give_finite_poses(**drawn):
    """Twenty times as many of them."""
    assert_finite(**drawn)


@pytest.mark.parametrize("estimator", [*CROSSING, *WRAPPED, OneReader(), OneReaderMinimax()])
def test_step_by_step_as_in_one_run(estimator):
    """Reads of unknown tags and steps between scans included."""
    for seed in range(6):
        known, told, start = world_of(seed, "corners", "wrong", 1e-3)
        prior = Prior(pose=start, sigma_m=0.02, sigma_rad=0.02)
        steps = np.array([item.values for item in by_steps(estimator, prior, known, told, 0)]).reshape(-1, 3)
        np.testing.assert_array_equal(steps, estimator.run(prior, known, told, np.random.default_rng(0)).poses)
