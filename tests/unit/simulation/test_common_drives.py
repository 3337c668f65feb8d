"""Common random numbers: what two layouts share bit for bit in one trial, and what they do not."""

import dataclasses
import itertools
from dataclasses import dataclass, field

import numpy as np
import pytest
from shapely.geometry import box

from layoutopt import registry
from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.estimators import mcl_kernels
from layoutopt.estimators.counter_normals import Draw, key_words
from layoutopt.estimators.odometry import OdometryAlone
from layoutopt.layout import FloorTags, Layout, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.patterns.triangular import triangular
from layoutopt.protocols import Mount
from layoutopt.readers.cross import cross
from layoutopt.readers.mi2016 import eight
from layoutopt.readers.profiles import PROFILES
from layoutopt.robot import Gyro, Odometry, Robot
from layoutopt.scenario import Faults, Judgement, Role, Routes, Scenario
from layoutopt.simulation import motion, sensing
from layoutopt.simulation.trials import record_trial, run_trials
from layoutopt.site import Site
from layoutopt.streams import Purpose, Streams

SEED = 11
OF_THE_FLOOR = [purpose for purpose in Purpose if purpose <= Purpose.ASYNCHRONY]
"""What streams drives over the floor ask for; later ones are of tracking and docking."""
EVERY_FAULT = Faults(
    tag_placement_sigma_m=0.003,
    tag_offset_m=(0.002, -0.001),
    dead_tag_share=0.05,
    missed_read_share=0.1,
    wrong_identity_share=0.02,
    read_edge_m=0.002,
    kidnapped_at_s=2.0,
    slips_per_m=2.0,
    slip_sigma_m=0.01,
    asynchronous=True,
    start_offset=(0.01, 0.0, 0.02),
)
WORLD = Scenario(
    name="room",
    role=Role.DESIGN,
    site=Site(name="room", floor=box(-2.0, -2.0, 2.0, 2.0)),
    robot=Robot(
        outline_m=[(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3)],
        odometry=Odometry(translation_m_per_sqrt_s=0.002),
        gyro=Gyro(),
        gyro_fitted=True,
    ),
    routes=Routes(kind="point_to_point"),
    faults=EVERY_FAULT,
    judgement=Judgement(settle_s=0.5),
    step_count=80,
    start_sigma_m=0.01,
    start_sigma_rad=0.01,
)


def mount(profile, side_m):
    return Mount(antenna=SphereAntenna(side_m=side_m), height_m=0.02, profile=PROFILES[profile])


def tags(pattern):
    return FloorTags(zones=(ZonePattern(zone="", pattern=pattern),))


DENSE = tags(square(pitch_m=0.1))
EIGHT = Layout(floor_tags=DENSE, readers=(eight(mount=mount("mi2016", 0.06)),))
FOUR = Layout(floor_tags=DENSE, readers=(cross(count=4, spacing_m=0.12, mount=mount("commercial", 0.03)),))
SPARSE = Layout(
    floor_tags=tags(triangular(pitch_m=0.3)),
    readers=(cross(count=4, spacing_m=0.12, mount=mount("commercial", 0.03)),),
)


@dataclass(frozen=True, kw_only=True)
class Witness(OdometryAlone):
    """Dead reckoning that writes down what an estimator is told and given to draw from."""

    seen: list = field(default_factory=list)

    def run(self, prior, knowledge, observations, draws):
        state = draws.bit_generator.state["state"]
        self.seen.append((prior, state["key"].tolist(), state["counter"].tolist(), draws.random(8).tolist()))
        return super().run(prior, knowledge, observations, draws)


@pytest.fixture(autouse=True)
def drives_are_made_anew():
    """Nothing is the same only because it was kept."""
    motion.drive.cache_clear()
    yield
    motion.drive.cache_clear()


def witnessed(layout, replication, world=WORLD):
    """Return the record of a trial with a fresh drive, and what its estimator was given."""
    motion.drive.cache_clear()
    witness = Witness()
    record = record_trial(layout, world, witness, Streams(seed=SEED), replication)
    return record, witness.seen[0]


def truth_of(layout, replication, monkeypatch):
    """Return where the tags truly were in a trial, as the readers met them."""
    found = []

    def kept(*arguments):
        found.append(true_tags(*arguments))
        return found[-1]

    true_tags = sensing.true_tags
    with monkeypatch.context() as patch:
        patch.setattr(sensing, "true_tags", kept)
        record_trial(layout, WORLD, OdometryAlone(), Streams(seed=SEED), replication)
    return found[0]


@pytest.mark.parametrize("replication", [0, 1, 17])
def test_layouts_meet_the_same_truth_odometry_and_gyro(replication):
    """Eight readers or four, dense or sparse tags: the same bits, with slips, a kidnapping and a fitted gyro."""
    first, *others = (witnessed(layout, replication)[0] for layout in (EIGHT, FOUR, SPARSE))
    for other in others:
        for part in dataclasses.fields(first.drive):
            np.testing.assert_array_equal(getattr(first.drive, part.name), getattr(other.drive, part.name))
        for name in ("increments", "sigma", "gyro_turn_rad", "gyro_sigma_rad"):
            np.testing.assert_array_equal(getattr(first.observations, name), getattr(other.observations, name))
    assert len({len(record.observations.read_tag) for record in (first, *others)}) == 3


@pytest.mark.parametrize("replication", [0, 1, 17])
def test_estimators_of_all_layouts_get_the_same_start_and_draws(replication):
    """The prior, and a stream from its beginning, whose first words are the key of a compiled filter."""
    first, *others = (witnessed(layout, replication)[1] for layout in (EIGHT, FOUR, SPARSE))
    assert all(other == first for other in others)
    own = Streams(seed=SEED).generator("room", replication, Purpose.FILTER)
    assert first[1] == own.bit_generator.state["state"]["key"].tolist()
    assert first[3] == own.random(8).tolist()


def test_the_same_tags_have_the_same_faults_under_any_readers(monkeypatch):
    """Tags beside their place and dead tags of one floor, bit for bit, for eight readers and for four."""
    ours, theirs = (truth_of(layout, 5, monkeypatch) for layout in (EIGHT, FOUR))
    np.testing.assert_array_equal(ours.xy_m, theirs.xy_m)
    np.testing.assert_array_equal(ours.tag, theirs.tag)
    assert len(ours.tag) < len(DENSE.lay_on(WORLD.site))
    assert not np.array_equal(ours.xy_m, truth_of(EIGHT, 6, monkeypatch).xy_m)


def test_another_floor_has_the_same_draws_for_its_tags(monkeypatch):
    """The k-th tag of two floors is off by the same error, as long as it is there at all."""
    off_m = []
    for layout in (EIGHT, SPARSE):
        truth, planned_m = truth_of(layout, 5, monkeypatch), layout.floor_tags.lay_on(WORLD.site).xy_m
        off_m.append(np.full(planned_m.shape, np.nan))
        off_m[-1][truth.tag] = truth.xy_m - planned_m[truth.tag]
    count = min(len(one) for one in off_m)
    ours, theirs = (one[:count] for one in off_m)
    both = ~np.isnan(ours[:, 0]) & ~np.isnan(theirs[:, 0])
    assert both.sum() > 50
    np.testing.assert_allclose(ours[both], theirs[both], atol=1e-12)


def test_streams_are_asked_for_by_scenario_replication_and_purpose_alone(monkeypatch):
    """Trials of all layouts ask for the same streams, each once and each of their own replication."""
    asked = []
    generator = Streams.generator

    def told(self, scenario, replication, purpose):
        asked.append((self.seed, scenario, replication, purpose))
        return generator(self, scenario, replication, purpose)

    monkeypatch.setattr(Streams, "generator", told)
    for layout in (EIGHT, FOUR, SPARSE):
        asked.clear()
        motion.drive.cache_clear()
        run_trials(layout, WORLD, OdometryAlone(), Streams(seed=SEED), 4, 2)
        assert sorted(asked) == [(SEED, "room", number, purpose) for number in (4, 5) for purpose in OF_THE_FLOOR]


def test_streams_that_know_their_turn_would_be_seen(monkeypatch):
    """Were the count of streams asked for before part of the key, layouts would meet other drives and draws."""
    generator, turn = Streams.generator, itertools.count()

    def turned(self, scenario, replication, purpose):
        return generator(self, f"{scenario}, {next(turn)}", replication, purpose)

    monkeypatch.setattr(Streams, "generator", turned)
    (first, given), (other, others) = (witnessed(layout, 0) for layout in (EIGHT, FOUR))
    assert not np.array_equal(first.drive.poses, other.drive.poses)
    assert not np.array_equal(first.observations.increments, other.observations.increments)
    assert given[1] != others[1]


def test_other_replications_scenarios_and_seeds_meet_other_drives():
    """What layouts share, nothing else does: route, odometry noise and start differ in each of the three."""
    world = dataclasses.replace(WORLD, name="another room")
    base, draws = witnessed(EIGHT, 0)
    motion.drive.cache_clear()
    reseeded = Witness()
    others = [witnessed(EIGHT, 1), witnessed(EIGHT, 0, world)]
    others.append((record_trial(EIGHT, WORLD, reseeded, Streams(seed=SEED + 1), 0), reseeded.seen[0]))
    for other, given in others:
        assert not np.array_equal(base.drive.poses, other.drive.poses)
        assert not np.array_equal(base.drive.gyro_turn_rad, other.drive.gyro_turn_rad)
        assert draws[1] != given[1]
        assert draws[0].pose != given[0].pose


def test_order_of_layouts_and_of_replications_does_not_matter():
    """Trials forward layout by layout, or backward in turn, with drives kept or made anew: the same outcomes."""
    estimator = registry.load("estimators", "mcl_adaptive")(particles=60)
    streams = Streams(seed=SEED)
    forward = {
        (layout.key, number): run_trials(layout, WORLD, estimator, streams, number, 1).values
        for layout in (EIGHT, SPARSE)
        for number in range(3)
    }
    motion.drive.cache_clear()
    for number in reversed(range(3)):
        for layout in (SPARSE, EIGHT):
            values = run_trials(layout, WORLD, estimator, Streams(seed=SEED), number, 1).values
            np.testing.assert_array_equal(values, forward[layout.key, number])


def watched_drive(name, monkeypatch):
    """Return the poses of a drive, and every call for words: key, step, purpose, first index and their number.

    The functions of the kernel that draw run uncompiled, so that what they ask of the generator is written down.
    """
    used = []
    words, normals = mcl_kernels.philox_words, mcl_kernels.normals

    def told_words(key_0, key_1, step, draw, first, out):
        used.append(((key_0, key_1), step, int(draw), first, out.shape[1]))
        words(key_0, key_1, step, draw, first, out)

    def told_normals(key_0, key_1, step, scratch, out):
        used.append(((key_0, key_1), step, int(Draw.NORMALS), 0, out.shape[1]))
        normals(key_0, key_1, step, scratch, out)

    with monkeypatch.context() as patch:
        for function in ("localise", "_normals", "_start", "_draw", "_replace_below", "_start_anew"):
            patch.setattr(mcl_kernels, function, getattr(mcl_kernels, function).py_func)
        patch.setattr(mcl_kernels, "philox_words", told_words)
        patch.setattr(mcl_kernels, "normals", told_normals)
        estimator = registry.load("estimators", name)(particles=40)
        return record_trial(EIGHT, WORLD, estimator, Streams(seed=SEED), 3).trajectory.poses, used


def counters_of(used):
    """Return step, purpose and index of every counter."""
    return [(step, draw, index) for _, step, draw, first, count in used for index in range(first, first + count)]


@pytest.mark.parametrize(
    "name", ["mcl", "mcl_adaptive", "mcl_crossings", "mcl_negative_information", "bayes_limit"]
)
def test_no_filter_uses_a_counter_twice(name, monkeypatch):
    """Every counter that a compiled filter asks for in a drive is asked for once, under the key of its trial."""
    streams = Streams(seed=SEED)
    compiled = record_trial(EIGHT, WORLD, registry.load("estimators", name)(particles=40), streams, 3)
    poses, used = watched_drive(name, monkeypatch)
    np.testing.assert_allclose(poses[:20], compiled.trajectory.poses[:20], atol=1e-3)
    counters = counters_of(used)
    assert len(counters) == len(set(counters)) > 80 * 30
    assert {key for key, *_ in used} == {key_words(streams.generator("room", 3, Purpose.FILTER))}
    # The kidnapping makes every filter start anew under way, and those on discs with pairs of reads.
    assert {draw for _, step, draw, *_ in used if step > 0} >= set(Draw) - {Draw.RESTART_PARTNER}
    assert (Draw.RESTART_PARTNER in {draw for _, _, draw, *_ in used}) is (name != "mcl")


def test_a_counter_that_is_used_twice_is_seen(monkeypatch):
    """Resampling that took its number from the counters of the noise would use the first of each step again."""
    monkeypatch.setattr(mcl_kernels, "_RESAMPLING", int(Draw.NORMALS))
    counters = counters_of(watched_drive("mcl", monkeypatch)[1])
    assert len(set(counters)) < len(counters)
