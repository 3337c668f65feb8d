"""Trials of tracking: what is counted, by hand; which random numbers are shared; what is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
from shapely.geometry import MultiPolygon, box
from tracking_cases import SCENARIO, SITE, WALK_M, Standing, layout, world

from layoutopt.errors import InvalidInput, NotANumber
from layoutopt.estimators.targets import TargetObservations
from layoutopt.estimators.uhf_laser import UhfLaser
from layoutopt.scenario import Judgement
from layoutopt.scores import TRACKING_UNITS
from layoutopt.simulation.signals import mean_strength_dbm, offsets_m
from layoutopt.simulation.tracking_trials import (
    LOST_BEYOND_M,
    alias_share,
    observe_target,
    run_tracking_trials,
    target_knowledge,
)
from layoutopt.simulation.trials import run_trials, warm_up
from layoutopt.streams import Streams
from layoutopt.tracking_world import SPEED_OF_LIGHT_M_S, SignalWorld

STREAMS = Streams(seed=7)
SHORT = replace(SCENARIO, step_count=400)
PLACE = Standing(place_m=(1.5, 1.0))


def short(**changes):
    """Return a trial of 20 s in another world."""
    return replace(world(**changes), step_count=400)


def heard(strength_dbm, frequency_hz):
    """Return observations of which only strengths and channels matter."""
    strength_dbm = np.array(strength_dbm, dtype=float)
    return TargetObservations(
        interval_s=0.4,
        read_time_s=np.zeros_like(strength_dbm),
        strength_dbm=strength_dbm,
        phase_word=np.zeros(strength_dbm.shape, dtype=np.int64),
        frequency_hz=np.array(frequency_hz, dtype=float),
        ranges_m=np.zeros((len(strength_dbm), 0)),
    )


def test_errors_and_shares_are_those_of_the_instants_that_count():
    """A tracker that says one place, judged by hand from what was observed, from the settling time on."""
    weak = SignalWorld(half_range_m=2.0)
    scenario = replace(short(bystanders=1, signal=weak), judgement=Judgement(settle_s=4.0))
    outcomes = run_trials(layout(), scenario, PLACE, STREAMS, 3, 6)
    assert outcomes.columns == tuple(TRACKING_UNITS)
    for replication in range(3, 9):
        observations, places_m = observe_target(layout(), scenario, STREAMS, replication)
        assert len(observations) == len(places_m) == 50
        error_m = np.hypot(*(places_m - PLACE.place_m).T)[9:]
        row = outcomes.values[replication - 3]
        expected = [error_m.mean(), np.quantile(error_m, 0.95), error_m.max(), (error_m > LOST_BEYOND_M).mean()]
        assert row[:4] == pytest.approx(expected, rel=1e-12)
        assert row[4] == np.mean([any(not math.isnan(value) for value in r) for r in observations.strength_dbm])
        assert row[6] == 0.0
    for name in ("tracking_lost_share", "detection_share"):
        assert 0.1 < outcomes.column(name).mean() < 0.95


def test_observations_fit_together():
    """Instants, slots, beams and words; the second antenna reads at the instant, the first half a cycle before."""
    observations, places_m = observe_target(layout(), SHORT, STREAMS, 0)
    instants_s = 0.4 * (np.arange(50) + 1.0)
    assert observations.interval_s == pytest.approx(0.4)
    assert observations.read_time_s == pytest.approx(np.stack([instants_s - 0.2, instants_s], axis=1))
    assert observations.ranges_m.shape == (50, 541)
    assert (np.isnan(observations.strength_dbm) == (observations.phase_word == -1)).all()
    assert [sample.time_s for sample in observations.samples()] == pytest.approx(instants_s)
    assert places_m.shape == (50, 2)


def test_every_antenna_hears_the_tag_where_it_is_when_that_antenna_reads():
    """Without noise phases tell the radial way between the true reading times, and strengths that of two slots."""
    quiet = SignalWorld(phase_sigma_rad=0.0, half_range_m=1e6, fading_sigma_db=0.0, noise_sigma_db=0.0)
    scenario = short(signal=quiet, walk_m=np.array([(1.0, 0.0), (3.0, 0.0)]), walking_speed_m_s=0.1)
    observations, places_m = observe_target(layout(), scenario, STREAMS, 0)
    turned = np.diff(observations.phase_word[:, 1]) / 4096.0
    turned -= np.round(turned)
    moved_m = np.diff(places_m[:, 0])
    half_m = SPEED_OF_LIGHT_M_S / 920e6 / 2.0
    assert turned * half_m == pytest.approx(moved_m, abs=half_m / 4096.0)
    ahead_db = observations.strength_dbm[:, 0] - observations.strength_dbm[:, 1]
    earlier_m = places_m[:, 0] - 0.02 * np.sign(np.append(moved_m[0], moved_m))
    straight = np.abs(np.append(moved_m[0], moved_m)) > 0.0399
    expected_db = 30.0 * np.log10(places_m[:, 0] / earlier_m)
    assert ahead_db[straight] == pytest.approx(expected_db[straight], abs=1e-9)
    assert straight.sum() > 30


def test_aliases_are_pairs_that_move_a_quarter_wave_or_more():
    """Pairs need two readings heard on one channel; a quarter of a wave just aliases, less does not."""
    quarter_m = SPEED_OF_LIGHT_M_S / 920e6 / 4.0
    ways_m = np.cumsum([0.0, 0.99 * quarter_m, -1.01 * quarter_m, 1.5 * quarter_m, 2.0 * quarter_m])[:, None] + 2.0
    one = np.full((5, 1), 920e6)
    assert alias_share(heard(np.full((5, 1), -50.0), one), ways_m) == 3.0 / 4.0
    missed = np.array([-50.0, math.nan, -50.0, -50.0, -50.0])[:, None]
    assert alias_share(heard(missed, one), ways_m) == 1.0
    hopped = np.array([920e6, 920e6, 902e6, 902e6, 920e6])[:, None]
    assert alias_share(heard(np.full((5, 1), -50.0), hopped), ways_m) == 0.5
    assert math.isnan(alias_share(heard(np.full((5, 1), math.nan), one), ways_m))


@pytest.mark.parametrize(("speed_m_s", "share"), [(0.15, 0.0), (0.6, 1.0)])
def test_slow_targets_have_no_aliases_and_fast_ones_that_come_straight_nothing_else(speed_m_s, share):
    """The limit is a quarter wave in 0.4 s, 0.204 m/s; turns at the ends of the walk apart."""
    walk_m = np.array([(1.0, 0.0), (4.5, 0.0)])
    scenario = short(walk_m=walk_m, walking_speed_m_s=speed_m_s)
    outcomes = run_tracking_trials(layout(), scenario, PLACE, STREAMS, 0, 3)
    assert outcomes.column("alias_share") == pytest.approx(share, abs=0.2 * share)


def test_the_same_seed_gives_the_same_bits_in_any_blocks():
    """Six trials at once, in two blocks, and one alone; another seed gives others."""
    scenario = short(bystanders=2)
    whole = run_tracking_trials(layout(), scenario, PLACE, STREAMS, 0, 6)
    blocks = [run_tracking_trials(layout(), scenario, PLACE, STREAMS, first, 3) for first in (3, 0)]
    assert np.concatenate([blocks[1].values, blocks[0].values]).tobytes() == whole.values.tobytes()
    alone = run_tracking_trials(layout(), scenario, PLACE, STREAMS, 4, 1)
    assert alone.values.tobytes() == whole.values[4:5].tobytes()
    other = run_tracking_trials(layout(), scenario, PLACE, Streams(seed=8), 0, 6)
    assert (other.values[:, 0] != whole.values[:, 0]).all()
    assert len(set(whole.values[:, 0].tolist())) == 6


def test_layouts_meet_the_same_walk_scans_and_fading():
    """Two antennas or four, turned or not: one truth and one scan; the antennas of one number fade alike."""
    scenario = short(bystanders=1)
    two, places_m = observe_target(layout(), scenario, STREAMS, 0)
    four, same_m = observe_target(layout(4, 60.0), scenario, STREAMS, 0)
    assert (places_m == same_m).all()
    assert (two.ranges_m == four.ranges_m).all()
    wide = short(bystanders=1, signal=SignalWorld(half_range_m=1e6))
    left = observe_target(layout(1, 45.0), wide, STREAMS, 0)[0].strength_dbm[:, 0]
    right = observe_target(layout(1, -45.0), wide, STREAMS, 0)[0].strength_dbm[:, 0]
    fading_db = []
    for strength_dbm, yaw_deg in ((left, 45.0), (right, -45.0)):
        group = layout(1, yaw_deg).readers[0]
        offset_m = offsets_m(group, (0.0, 0.0, 0.0), places_m[:, None])
        fading_db.append(strength_dbm - mean_strength_dbm(group.antenna, wide.tracking.signal, offset_m)[:, 0])
    assert fading_db[0] == pytest.approx(fading_db[1], abs=1e-9)


def test_another_interval_changes_the_instants_and_not_the_walk():
    """At instants that both have, the target is at the same place."""
    _, often_m = observe_target(layout(interval_s=0.2), SHORT, STREAMS, 0)
    _, seldom_m = observe_target(layout(interval_s=0.4), SHORT, STREAMS, 0)
    assert len(often_m) == 2 * len(seldom_m)
    assert often_m[1::2] == pytest.approx(seldom_m, abs=1e-9)


def test_a_target_that_nobody_hears_shows_as_such():
    """It is no error of a trial: the share of detections is 0, there are no pairs, and errors are told anyway."""
    scenario = replace(short(signal=SignalWorld(half_range_m=0.8)), step_count=80)
    outcomes = run_tracking_trials(layout(), scenario, PLACE, STREAMS, 0, 10)
    silent = outcomes.column("detection_share") == 0.0
    assert silent.any()
    assert np.isnan(outcomes.column("alias_share")[silent]).all()
    assert np.isfinite(outcomes.column("tracking_error_mean")).all()


def test_a_tracker_knows_its_antennas_its_floor_and_a_learned_model():
    """Of a floor in two parts it knows that of the walk, less the obstacles."""
    obstacle = box(3.5, -0.5, 4.0, 0.5)
    parts = MultiPolygon([box(6.0, 0.0, 8.0, 2.0), SITE.floor])
    scenario = replace(SHORT, site=replace(SITE, floor=parts, obstacles=(obstacle,)))
    knowledge = target_knowledge(layout(), scenario, PLACE)
    assert knowledge.floor.equals(SITE.floor.difference(obstacle))
    assert knowledge.antennas == layout().readers[0]
    assert knowledge.robot_pose == SHORT.tracking.robot_pose
    assert knowledge.phase_bits == 12
    assert knowledge.sensor_model.cell_m == 0.25
    assert target_knowledge(layout(), SHORT, PLACE).sensor_model is knowledge.sensor_model


@pytest.mark.parametrize(
    ("proposal", "scenario", "tracker", "message"),
    [
        (layout(), replace(SHORT, tracking=None), PLACE, "there is nobody to track"),
        (
            layout().replace(readers=2 * layout().readers),
            SHORT,
            PLACE,
            "one group of UHF antennas, and there are 2",
        ),
        (layout(), short(signal=SignalWorld(half_range_m=0.2)), PLACE, "reaches any place of the walk"),
        (layout(1, 180.0), SHORT, PLACE, "Turn the antennas or the robot towards the walk"),
        (layout(), short(robot_pose=(-2.0, 0.0, 0.0)), PLACE, "stands off the floor"),
        (layout(), short(walk_m=WALK_M * 2.0), PLACE, "lead off the floor"),
        (
            layout(),
            replace(SHORT, judgement=Judgement(settle_s=20.2)),
            PLACE,
            "after 20 s, comes before errors count",
        ),
        (layout(interval_s=30.0), SHORT, PLACE, "before all antennas have read once"),
        (layout(), SHORT, Standing(reason="it has no antennas"), "does not apply, because it has no antennas"),
    ],
)
def test_what_cannot_be_tracked_is_refused_with_what_to_do(proposal, scenario, tracker, message):
    """Each fault names the place and the problem."""
    with pytest.raises(InvalidInput, match=message):
        run_trials(proposal, scenario, tracker, STREAMS, 0, 1)


def test_a_layout_without_uhf_antennas_is_refused():
    """A group of another kind is none."""
    group = replace(layout().readers[0], kind="direction")
    with pytest.raises(InvalidInput, match="one group of UHF antennas, and there are 0"):
        run_tracking_trials(layout().replace(readers=(group,)), SHORT, PLACE, STREAMS, 0, 1)


def test_trackers_that_give_no_place_or_too_many_are_told():
    """A NaN by instant and replication, a row too many by shape."""
    with pytest.raises(NotANumber, match="'standing' gave no place at instant 0 of replication 5"):
        run_tracking_trials(layout(), SHORT, Standing(place_m=(math.nan, 0.0)), STREAMS, 5, 1)
    with pytest.raises(ValueError, match=r"gave places of shape \(51, 2\) for 50 instants"):
        run_tracking_trials(layout(), SHORT, Standing(rows=1), STREAMS, 5, 1)


def test_warm_up_compiles_the_kernels_of_tracking_and_of_docking():
    """After it each kernel has its one signature, which trials then use."""
    from layoutopt.estimators.uhf_laser_kernels import track
    from layoutopt.simulation.ray_casting_kernels import distances, sights

    warm_up(["target", "bearing"])
    run_trials(layout(), SHORT, UhfLaser(mode="velocity", particles=5), STREAMS, 0, 1)
    assert len(track.signatures) == len(distances.signatures) == len(sights.signatures) == 1
