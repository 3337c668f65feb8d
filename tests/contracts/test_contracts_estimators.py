"""What every estimator of the table promises, on the same short drives."""

from dataclasses import replace

import numpy as np
import pytest

from layoutopt import registry
from layoutopt.detection import antennas_of
from layoutopt.geometry import wrapped
from layoutopt.protocols import EstimatorCard, FloorKnowledge
from layoutopt.readings import UNKNOWN_TAG, Prior
from layoutopt.simulation.trials import knowledge_of, record_trial, run_trials
from layoutopt.spec.reading import read_spec
from layoutopt.streams import Purpose, Streams

NAMES = registry.names("estimators")
WITH_PARTICLES = {name for name in NAMES if hasattr(registry.load("estimators", name), "particles")}
"""Estimators whose two forms draw numbers of their own."""
STREAMS = Streams(seed=11)


@pytest.fixture
def world(tiny_spec, request):
    """Layout and scenario of the tiny spec; one of its antennas alone for an estimator that works with one."""
    problem = read_spec(tiny_spec).problem()
    layout = next(iter(problem.space.layouts()))
    if _estimator(request.node.callspec.params["name"]).applies(layout):
        group = layout.readers[0]
        layout = replace(layout, readers=(replace(group, poses=group.poses[:1], slots=(0,)),))
    return layout, problem.design


def _estimator(name):
    return registry.load("estimators", name)()


@pytest.mark.parametrize("name", NAMES)
def test_card_and_name(name):
    """An estimator knows its own name, and its card says what it estimates from what."""
    estimator = _estimator(name)
    assert estimator.name == name
    assert isinstance(estimator.card, EstimatorCard)
    assert estimator.card.estimates == "robot"
    assert estimator.card.needs
    assert estimator.card.reference


@pytest.mark.parametrize("name", NAMES)
def test_equal_settings_have_one_key(name):
    """Two estimators with the same settings are the same value."""
    assert _estimator(name) == _estimator(name)
    assert _estimator(name).key == _estimator(name).key


def _both_forms(name, world, replication):
    """Return a trial's record with the poses of the batch run and of the plain form, reading by reading."""
    layout, scenario = world
    estimator = _estimator(name)
    if name in WITH_PARTICLES:
        # As many as are enough to agree: the plain form of the largest filter takes minutes.
        estimator = replace(estimator, particles=300)
    record = record_trial(layout, scenario, estimator, STREAMS, replication)
    knowledge = knowledge_of(layout, scenario, estimator)
    start = record.drive.poses[0]
    prior = Prior(pose=tuple(float(value) for value in start), sigma_m=0.05, sigma_rad=0.05)

    def draws():
        return STREAMS.generator(scenario.name, replication, Purpose.FILTER)

    batch = estimator.run(prior, knowledge, record.observations, draws())
    running = estimator.start(prior, knowledge, draws())
    steps = np.array([running.step(*step).values for step in record.observations.steps()])
    return record, batch, steps


@pytest.mark.parametrize("name", [name for name in NAMES if name not in WITH_PARTICLES])
def test_step_by_step_equals_the_batch_run(name, world):
    """The plain form fed reading by reading gives the poses of the batch run."""
    _, batch, steps = _both_forms(name, world, 3)
    np.testing.assert_allclose(steps[:, :2], batch.poses[:, :2], atol=1e-7)
    assert np.abs(wrapped(steps[:, 2] - batch.poses[:, 2])).max() < 1e-6


@pytest.mark.parametrize("name", sorted(WITH_PARTICLES))
def test_step_by_step_is_as_good_as_the_batch_run(name, world):
    """Where the two draw other numbers they answer one question: they lie nearer to each other than to the truth.

    That they differ by chance alone is tested in ``statistics/test_filter_twins``.
    """
    record, batch, steps = _both_forms(name, world, 3)
    apart_m, off_m = (
        np.hypot(*(steps - other)[100:, :2].T).mean() for other in (batch.poses, record.drive.poses[1:])
    )
    assert apart_m < max(off_m, 0.002)


@pytest.mark.parametrize("name", NAMES)
def test_all_estimators_see_the_same_drive(name, world):
    """Drive and reads do not depend on who estimates (common random numbers)."""
    layout, scenario = world
    mine = record_trial(layout, scenario, _estimator(name), STREAMS, 5)
    other = record_trial(layout, scenario, _estimator("odometry"), STREAMS, 5)
    np.testing.assert_array_equal(mine.drive.poses, other.drive.poses)
    np.testing.assert_array_equal(mine.observations.read_tag, other.observations.read_tag)


@pytest.mark.parametrize("name", NAMES)
def test_never_a_nan(name, world):
    """Estimates stay finite when nothing is read, and when every identity is unknown."""
    layout, scenario = world
    record = record_trial(layout, scenario, _estimator(name), STREAMS, 1)
    knowledge = FloorKnowledge(
        tags=layout.floor_tags.lay_on(scenario.site), antennas=antennas_of(layout, scenario.step_s)
    )
    seen = record.observations
    blind = replace(
        seen,
        read_start=np.zeros_like(seen.read_start),
        read_antenna=seen.read_antenna[:0],
        read_tag=seen.read_tag[:0],
    )
    strange = replace(seen, read_tag=np.full_like(seen.read_tag, UNKNOWN_TAG))
    prior = Prior(pose=(1.0, 1.0, 0.0), sigma_m=0.05, sigma_rad=0.05)
    for observations in (blind, strange):
        poses = _estimator(name).run(prior, knowledge, observations, np.random.default_rng(0)).poses
        assert poses.shape == (len(seen), 3)
        assert np.isfinite(poses).all()


@pytest.mark.parametrize("name", NAMES)
def test_same_seed_same_bits(name, world):
    """Outcomes are the same to the last bit on a second run, and in any blocks."""
    layout, scenario = world
    whole = run_trials(layout, scenario, _estimator(name), STREAMS, 0, 3)
    again = run_trials(layout, scenario, _estimator(name), STREAMS, 0, 3)
    part = run_trials(layout, scenario, _estimator(name), STREAMS, 2, 1)
    np.testing.assert_array_equal(whole.values, again.values)
    np.testing.assert_array_equal(whole.values[2], part.values[0])
