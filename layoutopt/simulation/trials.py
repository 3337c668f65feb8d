"""Trials: simulated drives of a layout in a scenario, estimated and judged, one row a replication."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, cast

import numpy as np
from shapely.geometry import box

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.detection import antennas_of
from layoutopt.errors import InvalidInput, NotANumber
from layoutopt.estimators.mcl import MonteCarloLocalisation
from layoutopt.layout import WHOLE_FLOOR, FloorTags, Layout, ReaderProfile, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.protocols import AnyEstimator, Estimator, FloorKnowledge, Mount
from layoutopt.readers.mi2016 import eight
from layoutopt.readings import Observations, Prior, Trajectory
from layoutopt.robot import Robot
from layoutopt.scenario import Judgement, Role, Routes, Scenario
from layoutopt.scores import TrialOutcomes
from layoutopt.simulation.motion import Drive, drive
from layoutopt.simulation.outcomes import outcome_columns, outcome_row
from layoutopt.simulation.sensing import observe
from layoutopt.site import Site
from layoutopt.streams import Purpose, Streams

if TYPE_CHECKING:
    from layoutopt.estimators.bearings import BearingEstimator
    from layoutopt.estimators.targets import TargetEstimator

MODEL_VERSION: Final = "3"
"""Part of every key under which trials are kept; raised whenever the same trial would give other numbers."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialRecord:
    """One trial in full: the true drive, what the robot was told of it, and what the estimator made of that."""

    drive: Drive
    observations: Observations
    trajectory: Trajectory


def run_trials(
    layout: Layout, scenario: Scenario, estimator: AnyEstimator, streams: Streams, first: int, count: int
) -> TrialOutcomes:
    """Return the outcomes of replications ``first`` to ``first + count - 1``.

    A replication has the same drive and start for every layout, and for one layout the same reads for every
    estimator; which other replications run, where and when changes no bit of it. What the estimator estimates says
    which trials these are: drives over the floor, of tracking, or of docking.

    Raises
    ------
    InvalidInput
        If the estimator cannot work with the layout, or the trial is shorter than its settling time.
    ValueError
        If ``count`` is not positive.
    """
    if count < 1:
        raise ValueError(f"trials are counted from 1, got {count}")
    # Imported where they are asked for: studies of floor tags need nothing of UHF and docking.
    if estimator.card.estimates == "target":
        from layoutopt.simulation.tracking_trials import run_tracking_trials

        return run_tracking_trials(layout, scenario, cast("TargetEstimator", estimator), streams, first, count)
    if estimator.card.estimates == "bearing":
        from layoutopt.simulation.docking_trials import run_docking_trials

        return run_docking_trials(layout, scenario, cast("BearingEstimator", estimator), streams, first, count)
    of_robot = cast("Estimator", estimator)
    knowledge = knowledge_of(layout, scenario, of_robot)
    rows = []
    for replication in range(first, first + count):
        record = _trial(layout, scenario, of_robot, knowledge, streams, replication)
        rows.append(outcome_row(record.drive, record.observations, record.trajectory, scenario))
    return TrialOutcomes(
        replications=np.arange(first, first + count),
        columns=outcome_columns(scenario),
        values=np.array(rows),
    )


def record_trial(
    layout: Layout, scenario: Scenario, estimator: Estimator, streams: Streams, replication: int
) -> TrialRecord:
    """Return one trial in full; the same trial that `run_trials` judges.

    Raises
    ------
    InvalidInput
        If the estimator cannot work with the layout.
    """
    knowledge = knowledge_of(layout, scenario, estimator)
    return _trial(layout, scenario, estimator, knowledge, streams, replication)


def knowledge_of(layout: Layout, scenario: Scenario, estimator: Estimator) -> FloorKnowledge:
    """Return what an estimator knows beforehand: the plan, whatever the faults of the scenario.

    Raises
    ------
    InvalidInput
        If the estimator cannot work with the layout.
    """
    reason = estimator.applies(layout)
    if reason:
        repair = "Choose another estimator, or a layout that it can work with."
        raise InvalidInput.at(f"estimator '{estimator.name}'", f"does not apply, because {reason}", repair)
    return FloorKnowledge(
        tags=layout.floor_tags.lay_on(scenario.site), antennas=antennas_of(layout, scenario.step_s)
    )


def prior_of(true_start: tuple[float, float, float], scenario: Scenario, draws: np.random.Generator) -> Prior:
    """Return what the estimator is told of the start.

    That is the truth plus as much error as it is told to expect, plus ``Faults.start_offset``, of which it is told
    nothing. Of an unknown start it is told the middle of the floor's bounds and heading 0, with infinite
    deviations.
    """
    if not scenario.start_known:
        xmin, ymin, xmax, ymax = scenario.site.bounds_m
        return Prior(pose=((xmin + xmax) / 2.0, (ymin + ymax) / 2.0, 0.0), sigma_m=math.inf, sigma_rad=math.inf)
    noise = draws.standard_normal(3)
    offset = scenario.faults.start_offset
    return Prior(
        pose=(
            true_start[0] + scenario.start_sigma_m * float(noise[0]) + offset[0],
            true_start[1] + scenario.start_sigma_m * float(noise[1]) + offset[1],
            true_start[2] + scenario.start_sigma_rad * float(noise[2]) + offset[2],
        ),
        sigma_m=scenario.start_sigma_m,
        sigma_rad=scenario.start_sigma_rad,
    )


def warm_up(estimates: Iterable[str] = ("robot",)) -> None:
    """Compile, or load from the cache, every kernel that trials use, by running tiny ones.

    Parameters
    ----------
    estimates
        Of what the estimators of these trials are, as their cards say it.
    """
    for kind in estimates:
        if kind == "target":
            from layoutopt.simulation import tracking_trials

            tracking_trials.warm_up()
        elif kind == "bearing":
            from layoutopt.simulation import ray_casting

            ray_casting.warm_up()
        else:
            _warm_up_floor()


def _warm_up_floor() -> None:
    mount = Mount(
        antenna=SphereAntenna(side_m=0.06),
        height_m=0.024,
        profile=ReaderProfile(name="mi2016", scan_period_s=0.05, tags_per_scan="several"),
    )
    layout = Layout(
        floor_tags=FloorTags(zones=(ZonePattern(zone=WHOLE_FLOOR, pattern=square(pitch_m=0.1)),)),
        readers=(eight(mount=mount),),
    )
    scenario = Scenario(
        name="warm-up",
        role=Role.DESIGN,
        site=Site(name="warm-up", floor=box(-1.0, -1.0, 1.0, 1.0)),
        robot=Robot(outline_m=np.array([(-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)])),
        routes=Routes(kind="circle"),
        judgement=Judgement(settle_s=0.0),
        step_count=5,
    )
    run_trials(layout, scenario, MonteCarloLocalisation(particles=10), Streams(seed=0), 0, 1)


def _trial(
    layout: Layout,
    scenario: Scenario,
    estimator: Estimator,
    knowledge: FloorKnowledge,
    streams: Streams,
    replication: int,
) -> TrialRecord:
    driven = drive(scenario, streams, replication)
    observations = observe(driven, layout, scenario, knowledge.tags, streams, replication)
    x_m, y_m, heading_rad = (float(value) for value in driven.poses[0])
    prior = prior_of(
        (x_m, y_m, math.remainder(heading_rad, 2.0 * math.pi)),
        scenario,
        streams.generator(scenario.name, replication, Purpose.START),
    )
    trajectory = estimator.run(
        prior, knowledge, observations, streams.generator(scenario.name, replication, Purpose.FILTER)
    )
    if not np.isfinite(trajectory.poses).all():
        # Errors that are no numbers would drop out of every mean without a word.
        step = int(np.flatnonzero(~np.isfinite(trajectory.poses).all(axis=1))[0])
        raise NotANumber(f"estimator '{estimator.name}' gave no pose in step {step} of replication {replication}")
    return TrialRecord(drive=driven, observations=observations, trajectory=trajectory)
