"""Trials: the same world for everybody, and outcomes that follow from it."""

import dataclasses

import numpy as np
import pytest
from shapely.geometry import box

from layoutopt import registry
from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.errors import InvalidInput
from layoutopt.estimators.mcl import MonteCarloLocalisation
from layoutopt.estimators.midrange import Midrange
from layoutopt.estimators.odometry import OdometryAlone
from layoutopt.estimators.odometry_gyro import OdometryWithGyro
from layoutopt.geometry import wrapped
from layoutopt.layout import FloorTags, Layout, ReaderProfile, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.protocols import Mount
from layoutopt.readers.mi2016 import eight
from layoutopt.robot import Odometry, Robot
from layoutopt.scenario import Faults, Judgement, Role, Routes, Scenario
from layoutopt.scores import OUTCOME_COLUMNS, joined
from layoutopt.simulation.trials import knowledge_of, prior_of, record_trial, run_trials, warm_up
from layoutopt.site import Site, Zone
from layoutopt.streams import Streams

ESTIMATORS = (MonteCarloLocalisation(particles=100), Midrange(), OdometryAlone(), OdometryWithGyro())
ZONES = (
    Zone(name="dock", region=box(-1.0, -1.0, 1.0, 0.0), target_error_m=0.005),
    Zone(name="shelf", region=box(1.5, 1.5, 2.0, 2.0), target_error_m=0.02),
    Zone(name="aisle", region=box(-1.0, 0.0, 1.0, 1.0)),
)


def layout(pitch_m=0.1, tags_per_scan="several"):
    mount = Mount(
        antenna=SphereAntenna(side_m=0.06),
        height_m=0.024,
        profile=ReaderProfile(name="mi2016", scan_period_s=0.05, tags_per_scan=tags_per_scan),
    )
    floor_tags = FloorTags(zones=(ZonePattern(zone="", pattern=square(pitch_m=pitch_m)),))
    return Layout(floor_tags=floor_tags, readers=(eight(mount=mount),))


def scenario(**changes):
    outline_m = np.array([(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3)])
    world = Scenario(
        name="room",
        role=Role.DESIGN,
        site=Site(name="room", floor=box(-2.0, -2.0, 2.0, 2.0), zones=ZONES),
        robot=Robot(outline_m=outline_m, speed_m_s=0.2),
        routes=Routes(kind="circle"),
        judgement=Judgement(settle_s=1.0),
        step_count=200,
        start_sigma_m=0.01,
        start_sigma_rad=0.01,
    )
    return dataclasses.replace(world, **changes)


@pytest.mark.parametrize("estimator", ESTIMATORS, ids=lambda estimator: estimator.name)
def test_every_column_is_filled(estimator):
    """All outcome columns and those of zones with a target; NaN only where a zone was not entered or nothing
    is stated.
    """
    outcomes = run_trials(layout(), scenario(), estimator, Streams(seed=1), 0, 2)
    zones = [name for name in outcomes.columns if "." in name]
    assert outcomes.columns == (*OUTCOME_COLUMNS, *zones)
    assert {name.partition(".")[0] for name in zones} == {"dock", "shelf"}
    assert {name.partition(".")[2] for name in zones} == {
        f"{axis}_error_{statistic}"
        for axis in ("position", "heading")
        for statistic in ("mean", "p95", "max", "variance")
    }
    unknown = {name for name in outcomes.columns if np.isnan(outcomes.column(name)).any()}
    nees = set() if estimator.card.states_covariance else {"nees"}
    assert unknown == {name for name in zones if name.startswith("shelf")} | nees | {"recovery_time"}
    assert (outcomes.column("position_error_mean") <= outcomes.column("position_error_p95")).all()
    assert (outcomes.column("position_error_p95") <= outcomes.column("position_error_max")).all()
    assert (outcomes.column("dock.position_error_max") <= outcomes.column("position_error_max")).all()
    assert outcomes.score("dock.position_error_mean").unit == "m"


def test_every_estimator_meets_the_same_world():
    """One replication has one drive and one set of reads, whoever estimates, whatever is spoiled."""
    world = scenario(faults=Faults(missed_read_share=0.2, tag_placement_sigma_m=0.005, wrong_identity_share=0.01))
    first, *others = (record_trial(layout(), world, one, Streams(seed=2), 3) for one in ESTIMATORS)
    for other in others:
        for name in ("poses", "increments", "sigma", "gyro_turn_rad", "gyro_sigma_rad"):
            np.testing.assert_array_equal(getattr(first.drive, name), getattr(other.drive, name))
        for name in ("read_start", "read_antenna", "read_tag", "active"):
            np.testing.assert_array_equal(getattr(first.observations, name), getattr(other.observations, name))


def test_every_layout_meets_the_same_drive():
    """The streams do not know the layout: drive and start are the same for all (common random numbers)."""
    sparse, dense = (
        record_trial(layout(pitch_m), scenario(), OdometryAlone(), Streams(seed=2), 1) for pitch_m in (0.4, 0.05)
    )
    np.testing.assert_array_equal(sparse.drive.poses, dense.drive.poses)
    np.testing.assert_array_equal(sparse.trajectory.poses, dense.trajectory.poses)
    assert len(sparse.observations.read_tag) < len(dense.observations.read_tag)


def test_blocks_of_replications_do_not_matter():
    """Replications 4 to 7 in one block, in two, or after others: the same bits."""
    world = scenario(faults=Faults(missed_read_share=0.2))
    run = [
        run_trials(layout(), world, ESTIMATORS[0], Streams(seed=3), first, count)
        for first, count in ((4, 4), (6, 2), (4, 2))
    ]
    assert joined([run[1], run[2]]) == run[0]
    assert run[0] != run_trials(layout(), world, ESTIMATORS[0], Streams(seed=4), 4, 4)


WITHOUT_DRAWS = [estimator for estimator in ESTIMATORS if estimator.name != "mcl"]


@pytest.mark.parametrize("estimator", WITHOUT_DRAWS, ids=lambda estimator: estimator.name)
def test_run_is_start_and_step(estimator):
    """A whole drive at once gives what the same drive gives step by step, reads spoiled and all.

    Both forms of a particle filter draw their own numbers; they are compared in ``statistics/test_filter_twins``.
    """
    world = scenario(
        faults=Faults(missed_read_share=0.2, tag_placement_sigma_m=0.004, wrong_identity_share=0.02),
        step_count=400,
    )
    for proposal in (layout(), layout(0.05, "one"), layout(0.3)):
        record = record_trial(proposal, world, estimator, Streams(seed=5), 0)
        knowledge = knowledge_of(proposal, world, estimator)
        start = tuple(float(value) for value in record.drive.poses[0])
        prior = prior_of(start, world, np.random.default_rng(1))
        run = estimator.run(prior, knowledge, record.observations, np.random.default_rng(2))
        running = estimator.start(prior, knowledge, np.random.default_rng(2))
        steps = np.array([running.step(*step).values for step in record.observations.steps()])
        np.testing.assert_allclose(run.poses[:, :2], steps[:, :2], rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(wrapped(run.poses[:, 2] - steps[:, 2]), 0.0, atol=1e-9)


def test_a_trial_too_short_to_settle_is_refused():
    """Errors that would be taken over no step at all are a fault of the scenario, and the message says which."""
    with pytest.raises(InvalidInput, match=r"scenario 'room': a trial of 0\.5 s ends before"):
        run_trials(layout(), scenario(step_count=10), OdometryAlone(), Streams(seed=1), 0, 1)


def test_an_estimator_without_readings_is_refused():
    """A layout that reads no floor tags leaves odometry alone as the only estimator."""
    bare = layout()
    bare = bare.replace(readers=tuple(dataclasses.replace(group, kind="signal") for group in bare.readers))
    for estimator in ESTIMATORS[:2]:
        with pytest.raises(InvalidInput, match="does not apply, because it needs readers of floor tags"):
            run_trials(bare, scenario(), estimator, Streams(seed=1), 0, 1)
    outcomes = run_trials(bare, scenario(), ESTIMATORS[2], Streams(seed=1), 0, 1)
    assert outcomes.column("reads_per_step")[0] == 0.0


def test_a_perfect_world_is_followed_closely():
    """No noise, known start, 400 tags a square metre: odometry and the filter are exact but for rounding."""
    robot = dataclasses.replace(
        scenario().robot, odometry=Odometry(translation_share=0.0, rotation_rad_per_m=0.0, lateral_share=0.0)
    )
    world = scenario(robot=robot, start_sigma_m=0.0, start_sigma_rad=0.0)
    for estimator, rounding_m in ((OdometryAlone(), 1e-9), (MonteCarloLocalisation(), 1e-5)):
        outcomes = run_trials(layout(0.05), world, estimator, Streams(seed=1), 0, 1)
        assert outcomes.column("position_error_max")[0] < rounding_m
        assert outcomes.column("time_to_localise")[0] == pytest.approx(0.05)


def test_dense_tags_pull_a_rough_start_together():
    """From 5 cm and 3 degrees off, 400 tags a square metre bring the filter below 5 mm within a second."""
    world = scenario(start_sigma_m=0.05, start_sigma_rad=0.05)
    outcomes = run_trials(layout(0.05), world, MonteCarloLocalisation(), Streams(seed=6), 0, 8)
    assert outcomes.column("position_error_mean").max() < 0.005
    assert np.isfinite(outcomes.column("nees")).all()
    blind = run_trials(layout(0.05), world, OdometryAlone(), Streams(seed=6), 0, 8)
    assert blind.column("position_error_mean").mean() > 0.02


def test_the_start_that_is_told_may_be_off():
    """The offset moves the mean of the prior and nothing else: its deviations are those of an honest one."""
    start = (0.5, -0.25, 1.0)
    honest = prior_of(start, scenario(), np.random.default_rng(1))
    faults = Faults(start_offset=(0.165, -0.153, 1.5))
    off = prior_of(start, scenario(faults=faults), np.random.default_rng(1))
    np.testing.assert_allclose(np.subtract(off.pose, honest.pose), faults.start_offset, atol=1e-12)
    assert (off.sigma_m, off.sigma_rad) == (honest.sigma_m, honest.sigma_rad) == (0.01, 0.01)


def test_of_an_unknown_start_nothing_is_told():
    """The prior is the middle of the floor with infinite deviations, wherever the robot is; nothing is drawn."""
    world = scenario(start_known=False, site=Site(name="off", floor=box(1.0, 2.0, 5.0, 8.0)))
    for start in ((1.5, 2.5, 1.0), (4.5, 7.5, -2.0)):
        prior = prior_of(start, world, None)
        assert prior.pose == (3.0, 5.0, 0.0)
        assert prior.sigma_m == prior.sigma_rad == np.inf


@pytest.mark.parametrize("name", ["midrange", "odometry", "odometry_gyro"])
def test_every_fault_at_once_gives_numbers(name):
    """Slips, asynchrony, a fitted gyro, noise of time, a wrong start and a kidnapping: outcomes stay finite."""
    world = scenario(
        faults=Faults(
            slips_per_m=1.0, slip_sigma_m=0.05, asynchronous=True, clock_error_s=0.02, kidnapped_at_s=4.0,
            start_offset=(0.1, 0.1, 1.0), missed_read_share=0.1, read_edge_m=0.002,
        ),
        robot=dataclasses.replace(
            scenario().robot, gyro_fitted=True, odometry=Odometry(rotation_rad_per_sqrt_s=0.05)
        ),
        routes=Routes(kind="circle", centre_spread_m=0.2),
    )  # fmt: skip
    estimator = registry.load("estimators", name)()
    outcomes = run_trials(layout(), world, estimator, Streams(seed=8), 0, 3)
    whole = [column for column in outcomes.columns if "." not in column and column != "nees"]
    assert all(np.isfinite(outcomes.column(column)).all() for column in whole)
    assert (outcomes.column("recovery_time") <= 6.0).all()


def test_an_estimator_that_does_not_read_never_recovers():
    """Odometry alone does not notice that it was carried off: its recovery takes the rest of the trial."""
    world = scenario(faults=Faults(kidnapped_at_s=4.0))
    outcomes = run_trials(layout(), world, OdometryAlone(), Streams(seed=8), 0, 3)
    np.testing.assert_allclose(outcomes.column("recovery_time"), 6.0)


def test_warm_up_compiles_both_kernels():
    """After the warm-up each kernel has its one signature."""
    from layoutopt.estimators.mcl_kernels import localise
    from layoutopt.simulation.sensing_kernels import detections

    warm_up()
    assert len(localise.signatures) == len(detections.signatures) == 1


def test_the_table_names_all_estimators():
    """Every estimator of the table can be loaded, and bears its own name and card."""
    for name in ("mcl", "midrange", "odometry", "odometry_gyro"):
        estimator = registry.load("estimators", name)()
        assert estimator.name == name
        assert registry.card("estimators", name) is estimator.card
        assert estimator.applies(layout()) == ""
        assert estimator == registry.load("estimators", name)()


@pytest.mark.parametrize(
    "settings",
    [
        {"particles": 0},
        {"likelihood": "uniform"},
        {"beta": 0.0},
        {"alpha": 0.0},
        {"alpha": 1.5},
        {"sigma_scale": -1.0},
        {"sigma_floor_m": 0.0},
        {"motion_scale": float("nan")},
    ],
)
def test_settings_out_of_range_are_refused(settings):
    """A filter that could divide by zero cannot be made."""
    with pytest.raises(ValueError, match=r"\d|uniform|nan"):
        MonteCarloLocalisation(**settings)


@pytest.mark.parametrize("name", ["mcl", "mcl_adaptive", "mcl_crossings", "mcl_negative_information", "midrange"])
def test_an_unknown_start_is_found(name):
    """Every estimator of tags gives a pose in every step, and is within 60 mm at the end of most drives."""
    estimator = registry.load("estimators", name)()
    found = run_trials(layout(), scenario(start_known=False), estimator, Streams(seed=8), 0, 6)
    assert np.isfinite(found.column("position_error_mean")).all()
    assert np.median(found.column("time_to_localise")) < 3.0


def test_an_estimator_without_a_pose_is_an_error(monkeypatch):
    """A pose that is no number would vanish from every mean; it is refused by name, step and replication."""
    plain = OdometryAlone.run

    def broken(self, prior, knowledge, observations, draws):
        trajectory = plain(self, prior, knowledge, observations, draws)
        trajectory.poses[4, 1] = np.nan
        return trajectory

    monkeypatch.setattr(OdometryAlone, "run", broken)
    with pytest.raises(ValueError, match=r"'odometry' gave no pose in step 4 of replication 3"):
        run_trials(layout(), scenario(), OdometryAlone(), Streams(seed=8), 3, 1)
