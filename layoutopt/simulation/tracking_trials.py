"""Trials of tracking: a person walks with a tag, a robot that stands hears and sees, a tracker is judged."""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, cast

import numpy as np
import shapely
from shapely.geometry import LineString, box

from layoutopt.errors import InvalidInput, NotANumber
from layoutopt.estimators.targets import TargetEstimator, TargetKnowledge, TargetObservations
from layoutopt.identity import BoolArray, FloatArray
from layoutopt.layout import FloorTags, Layout, ReaderGroup
from layoutopt.protocols import AnyEstimator
from layoutopt.robot import Robot
from layoutopt.scenario import Judgement, Role, Scenario
from layoutopt.scores import TRACKING_UNITS, TrialOutcomes
from layoutopt.simulation.calibration import calibrated
from layoutopt.simulation.laser import scans
from layoutopt.simulation.ray_casting import walls_of
from layoutopt.simulation.signals import hear, offsets_m, signal_antenna, ways_m, within_reach
from layoutopt.simulation.walking import bystander_places, clutter, lap_m, target_places, tracking_world
from layoutopt.site import Site
from layoutopt.streams import Purpose, Streams
from layoutopt.tracking_world import SPEED_OF_LIGHT_M_S, TrackingWorld

LOST_BEYOND_M: Final = 1.0
"""Error beyond which a target is lost: four times the mean error of liang2020 (0.25 m), and about the distance
that people keep from each other (Hall, 1966: 0.46 to 1.22 m), so that the place may be somebody else's."""
_REACH_PITCH_M: Final = 0.05
"""Spacing of places of the walk at which antennas are asked whether they reach it."""
_ROUNDING_SHARE: Final = 1e-9
"""Of an interval, by which the last instant may lie after the end of the trial."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Drive:
    """One trial before anybody estimates: what is heard and seen, and the truth."""

    observations: TargetObservations
    places_m: FloatArray
    ways_m: FloatArray


def run_tracking_trials(
    layout: Layout, scenario: Scenario, estimator: AnyEstimator, streams: Streams, first: int, count: int
) -> TrialOutcomes:
    """Return the outcomes of replications ``first`` to ``first + count - 1``, in the columns of `TRACKING_UNITS`.

    Errors (mean, 95 % quantile, maximum) and the share of instants with one beyond `LOST_BEYOND_M` are over the
    instants from ``judgement.settle_s`` on. The share of detections is that of all instants at which at least one
    antenna heard the tag; the share of aliases is that of `alias_share`; the share of laser matches is that of all
    instants at which something that the laser saw counted for the target, zero for a tracker by signals alone.

    A replication has the same walk, clutter and bystanders for every layout. Antennas of one number have the same
    random numbers reading by reading, and a layout with more of them changes nothing for the first ones; with
    another interval readings come at other times, and the k-th has the numbers of the k-th.

    Raises
    ------
    InvalidInput
        If there is nobody to track, nothing to hear the tag with or no place for something; see
        `layoutopt.simulation.walking` and `uhf_antennas`. If the estimator does not apply, or the trial ends
        before it has settled.
    NotANumber
        If the tracker gives a place that is no number.
    ValueError
        If the tracker does not give one place for each instant.
    """
    tracker = cast("TargetEstimator", estimator)
    knowledge = target_knowledge(layout, scenario, tracker)
    judged = judged_instants(scenario, knowledge.antennas)
    rows = []
    for replication in range(first, first + count):
        drive = _drive(layout, scenario, streams, replication)
        draws = streams.generator(scenario.name, replication, Purpose.FILTER)
        track = tracker.run(knowledge, drive.observations, draws)
        if track.places_m.shape != drive.places_m.shape:
            raise ValueError(
                f"estimator '{estimator.name}' gave places of shape {track.places_m.shape} for "
                f"{len(drive.places_m)} instants"
            )
        if not np.isfinite(track.places_m).all():
            # Errors that are no numbers would drop out of every mean without a word.
            instant = int(np.flatnonzero(~np.isfinite(track.places_m).all(axis=1))[0])
            raise NotANumber(
                f"estimator '{estimator.name}' gave no place at instant {instant} of replication {replication}"
            )
        error_m = np.hypot(*(track.places_m - drive.places_m).T)[judged]
        columns = {
            "tracking_error_mean": float(error_m.mean()),
            "tracking_error_p95": float(np.quantile(error_m, 0.95)),
            "tracking_error_max": float(error_m.max()),
            "tracking_lost_share": float((error_m > LOST_BEYOND_M).mean()),
            "detection_share": float((~np.isnan(drive.observations.strength_dbm)).any(axis=1).mean()),
            "alias_share": alias_share(drive.observations, drive.ways_m),
            "laser_match_share": float(track.matched.mean()),
        }
        rows.append([columns[name] for name in TRACKING_UNITS])
    return TrialOutcomes(
        replications=np.arange(first, first + count), columns=tuple(TRACKING_UNITS), values=np.array(rows)
    )


def observe_target(
    layout: Layout, scenario: Scenario, streams: Streams, replication: int
) -> tuple[TargetObservations, FloatArray]:
    """Return what the robot hears and sees in one trial, and where the target is at each instant, shape (n, 2), m.

    Raises
    ------
    InvalidInput
        As `run_tracking_trials`.
    """
    drive = _drive(layout, scenario, streams, replication)
    return drive.observations, drive.places_m


def target_knowledge(layout: Layout, scenario: Scenario, estimator: TargetEstimator) -> TargetKnowledge:
    """Return what a tracker knows beforehand: its antennas and scanner, the floor, a learned sensor model.

    The floor is the part of the open floor on which the target walks.

    Raises
    ------
    InvalidInput
        If the estimator does not apply, or as `run_tracking_trials`.
    """
    reason = estimator.applies(layout)
    if reason:
        repair = "Choose another estimator, or a layout that it can work with."
        raise InvalidInput.at(f"estimator '{estimator.name}'", f"does not apply, because {reason}", repair)
    world = tracking_world(scenario)
    group = uhf_antennas(layout, scenario)
    walk = LineString(world.walk_m)
    floor = next(part for part in shapely.get_parts(scenario.site.open_floor) if part.covers(walk))
    return TargetKnowledge(
        antennas=group,
        robot_pose=world.robot_pose,
        floor=floor,
        laser=world.laser,
        phase_bits=world.signal.phase_bits,
        sensor_model=calibrated(signal_antenna(group), world.signal),
    )


@lru_cache(maxsize=256)
def uhf_antennas(layout: Layout, scenario: Scenario) -> ReaderGroup:
    """Return the UHF antennas of a layout, once the target has been found to come within reach of one.

    Raises
    ------
    InvalidInput
        If the layout has none, or more than one group of them, or no place of the walk is within reach.
    """
    world = tracking_world(scenario)
    groups = layout.readers_of("signal")
    if len(groups) != 1:
        raise InvalidInput.at(
            f"layout {layout.short_key}",
            f"tracking takes one group of UHF antennas, and there are {len(groups)}",
            "Give the layout one, for example yawed_antennas, or fit them with [tracking] in the spec.",
        )
    lap_s = lap_m(world) / world.walking_speed_m_s
    times_s = np.linspace(0.0, lap_s, math.ceil(lap_m(world) / _REACH_PITCH_M), endpoint=False)
    places_m = target_places(world, 0.0, times_s)[:, None].repeat(groups[0].count, axis=1)
    offset_m = offsets_m(groups[0], world.robot_pose, places_m)
    if not within_reach(signal_antenna(groups[0]), world.signal, offset_m).any():
        raise InvalidInput.at(
            f"scenario '{scenario.name}', tracking",
            f"no antenna of layout {layout.short_key} reaches any place of the walk, which comes as near as "
            f"{float(ways_m(offset_m).min()):.1f} m; half of the readings succeed at "
            f"{world.signal.half_range_m:g} m straight ahead",
            "Turn the antennas or the robot towards the walk, or bring them nearer together.",
        )
    return groups[0]


def instants_s(scenario: Scenario, antennas: ReaderGroup) -> FloatArray:
    """Return the sampling instants of a trial, shape (n,): the end of every whole cycle of the antennas.

    Raises
    ------
    InvalidInput
        If the trial is shorter than one cycle.
    """
    count = math.floor(scenario.duration_s / antennas.cycle_s + _ROUNDING_SHARE)
    if count < 1:
        raise InvalidInput.at(
            f"scenario '{scenario.name}'",
            f"a trial of {scenario.duration_s:g} s ends before all antennas have read once, after "
            f"{antennas.cycle_s:g} s",
            "Lengthen the trial or shorten the interval.",
        )
    return np.asarray((np.arange(count) + 1) * antennas.cycle_s, dtype=np.float64)


def judged_instants(scenario: Scenario, antennas: ReaderGroup) -> BoolArray:
    """Return which sampling instants are at ``settle_s`` or later, shape (n,).

    Raises
    ------
    InvalidInput
        If there is none.
    """
    times_s = instants_s(scenario, antennas)
    judged = np.asarray(times_s >= scenario.judgement.settle_s - 1e-9)
    if not judged.any():
        raise InvalidInput.at(
            f"scenario '{scenario.name}'",
            f"the last sampling instant, after {times_s[-1]:g} s, comes before errors count, after "
            f"{scenario.judgement.settle_s:g} s",
            "Lengthen the trial or shorten the settling time.",
        )
    return judged


def read_times_s(scenario: Scenario, antennas: ReaderGroup) -> FloatArray:
    """Return when each antenna reads, shape (n, antennas): at the end of its slot, the last one at the instant."""
    behind = antennas.antennas_per_module - 1 - np.array(antennas.slots)
    return instants_s(scenario, antennas)[:, None] - behind * antennas.profile.scan_period_s


def alias_share(observations: TargetObservations, way_m: FloatArray) -> float:
    """Return the share of phase differences that tell a wrong signed speed, NaN if there is none at all.

    A pair is two readings of one antenna at consecutive instants, both heard and on one channel. It is aliased if
    the target came nearer or went farther by a quarter of the wavelength or more between them: the phase turns by
    half a turn or more then, and forth cannot be told from back.

    Parameters
    ----------
    observations
        What was heard.
    way_m
        True distance between antenna and tag at each reading, shape (n, antennas), m.

    References
    ----------
    liang2020, Eq. 8-9: the phase turns once for half a wavelength of radial way.
    """
    heard = ~np.isnan(observations.strength_dbm)
    frequency_hz = observations.frequency_hz
    pairs = heard[1:] & heard[:-1] & (frequency_hz[1:] == frequency_hz[:-1])
    if not pairs.any():
        return math.nan
    quarter_m = SPEED_OF_LIGHT_M_S / frequency_hz[1:] / 4.0
    return float((np.abs(np.diff(way_m, axis=0)) >= quarter_m)[pairs].mean())


def warm_up() -> None:
    """Compile, or load from the cache, every kernel of trials of tracking, by running a tiny one."""
    # Imported here: only who compiles needs a tracker and antennas of his own.
    from layoutopt.antennas.uhf_patch import UhfPatch
    from layoutopt.estimators.uhf_laser import UhfLaser
    from layoutopt.readers.finders import yawed_antennas

    scenario = Scenario(
        name="warm-up",
        role=Role.DESIGN,
        site=Site(name="warm-up", floor=box(-1.0, -2.0, 4.0, 2.0)),
        robot=Robot(outline_m=np.array([(-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)])),
        judgement=Judgement(settle_s=0.0),
        step_count=40,
        tracking=TrackingWorld(
            robot_pose=(0.0, 0.0, 0.0), walk_m=np.array([(1.0, -1.0), (1.0, 1.0)]), clutter_count=1
        ),
    )
    antennas = yawed_antennas(antenna=UhfPatch(), count=2, yaw_rad=0.5)
    layout = Layout(floor_tags=FloorTags(zones=()), readers=(antennas,))
    run_tracking_trials(layout, scenario, UhfLaser(particles=10), Streams(seed=0), 0, 1)


def _drive(layout: Layout, scenario: Scenario, streams: Streams, replication: int) -> _Drive:
    world = tracking_world(scenario)
    group = uhf_antennas(layout, scenario)
    times_s, read_time_s = instants_s(scenario, group), read_times_s(scenario, group)
    things = clutter(scenario, streams.generator(scenario.name, replication, Purpose.CLUTTER))
    target_draws = streams.generator(scenario.name, replication, Purpose.TARGET)
    start_share = target_draws.random()
    places_m = target_places(world, start_share, times_s)
    bystanders_m = bystander_places(scenario, things, target_draws, times_s)
    ranges_m = scans(
        world.laser,
        world.robot_pose,
        walls_of(scenario.site),
        things,
        np.concatenate([places_m[:, None], bystanders_m], axis=1),
        world.person_radius_m,
        streams.generator(scenario.name, replication, Purpose.LASER),
    )
    offset_m = offsets_m(group, world.robot_pose, target_places(world, start_share, read_time_s))
    signals = hear(
        group,
        world.signal,
        offset_m,
        read_time_s,
        streams.generator(scenario.name, replication, Purpose.SIGNAL),
    )
    observations = TargetObservations(
        interval_s=group.cycle_s,
        read_time_s=read_time_s,
        strength_dbm=signals.strength_dbm,
        phase_word=signals.phase_word,
        frequency_hz=signals.frequency_hz,
        ranges_m=ranges_m,
    )
    return _Drive(observations=observations, places_m=places_m, ways_m=ways_m(offset_m))
