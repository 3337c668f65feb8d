"""Noise of odometry without a true path: the scale under which a particle filter finds the reads likeliest."""

import dataclasses
import math
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np

from layoutopt.commissioning.estimated import Fitted
from layoutopt.commissioning.motion_fit import TERMS, MotionFit
from layoutopt.commissioning.replay import SCENARIO, Replay
from layoutopt.detection import bucket_grid
from layoutopt.geometry import wrapped
from layoutopt.readings import Observations, Prior
from layoutopt.simulation.motion import increments_between
from layoutopt.simulation.sensing import antenna_centres, compiled_detections
from layoutopt.streams import Purpose, Streams

if TYPE_CHECKING:
    from layoutopt.protocols import Estimator

SCALES: Final = tuple(2.0 ** (half / 2.0) for half in range(-8, 9))
"""Factors on the noise of the layout file that are tried: 1/16 to 16, in steps of the root of two."""
COPIES: Final = 12
"""Simulated copies of the drive that tell bias and spread of the scale."""
MOST_STEPS: Final = 6000
"""Steps of a drive that are used: more tell little and take long."""
_TIME_TERMS: Final = ("translation_m_per_sqrt_s", "rotation_rad_per_sqrt_s")
_SETTLE_S: Final = 5.0
_STUDENT: Final = 2.201
"""95 % point of Student's t with `COPIES` - 1 degrees of freedom."""


def fit_scale(replayed: Replay, missed_share: float) -> MotionFit:
    """Return the noise of odometry as one factor on that of the layout file.

    The sum of `Trajectory.log_evidence` is taken at each of `SCALES`, always with the same random numbers, and a
    parabola through the best and its neighbours gives the best scale. The likelihoods of the filters are no exact
    chances, so that scale is biased: on simulated drives it came out 5 to 30 % too small. Therefore the drive is
    simulated `COPIES` times along the estimated path with the scale found and ``missed_share``, each copy is
    fitted alike, and the mean logarithm by which the copies miss their scale is taken off; their spread gives the
    interval (parametric bootstrap: B. Efron, R. J. Tibshirani, An Introduction to the Bootstrap, 1993, chapters 6
    and 10). After a start that was not known, the drive counts from where the filter has found itself.
    """
    estimator = replayed.estimator
    if "motion_scale" not in {field.name for field in dataclasses.fields(cast("Any", estimator))}:
        return _nothing(f"'{estimator.name}' has no scale of motion noise to fit")
    if replayed.trajectory.log_evidence is None:
        return _nothing(f"'{estimator.name}' says not how likely the reads are")
    first, prior = _beginning(replayed)
    observations = _part(replayed.drive.observations, first, first + MOST_STEPS)
    streams = Streams(seed=replayed.seed)
    scale = _best_scale(replayed, observations, prior, streams.generator(SCENARIO, 0, Purpose.FILTER))
    if scale is None:
        return _nothing("the reads are likeliest at the end of the scales tried, a sixteenth to sixteen times")
    missed = []
    for copy in range(1, COPIES + 1):
        again = _best_scale(
            replayed,
            _copy(replayed, observations, scale, missed_share, streams, copy),
            prior,
            streams.generator(SCENARIO, copy, Purpose.FILTER),
        )
        if again is None:
            return _nothing(
                "simulated copies of the drive do not give their scale back, because the tags are too far apart, "
                "or the odometry too good, for reads to tell its noise"
            )
        missed.append(math.log(again / scale))
    bias, spread = float(np.mean(missed)), float(np.std(missed, ddof=1))
    factor = scale * math.exp(-bias)
    reach = math.exp(_STUDENT * spread * math.sqrt(1.0 + 1.0 / COPIES))
    before = replayed.spec.robot.odometry
    terms = {
        name: Fitted(
            value=value * factor,
            se=value * factor * spread,
            low=value * factor / reach,
            high=value * factor * reach,
            count=len(observations.read_tag),
            of="reads",
        )
        for name in (*TERMS, *_TIME_TERMS)
        if (value := getattr(before, name)) > 0.0
    }
    notes = [
        f"without truth the terms of odometry are fitted by one factor, {factor:.2f} times the layout file's: the "
        f"reads are likeliest at {scale:.2f}, and {COPIES} simulated copies of the drive came out at "
        f"{math.exp(bias):.2f} of their own"
    ]
    if len(observations) < len(replayed.drive.observations):
        notes.append(f"for that factor {len(observations)} steps were used, from step {first + 1}")
    return MotionFit(terms=terms, truth_sigma={}, notes=tuple(notes))


def _nothing(reason: str) -> MotionFit:
    return MotionFit(
        terms={},
        truth_sigma={},
        notes=(f"without truth only the path is estimated, no noise of odometry: {reason}",),
    )


def _best_scale(
    replayed: Replay, observations: Observations, prior: Prior, draws: np.random.Generator
) -> float | None:
    """Return the scale of greatest evidence, ``None`` if that is the first or last of `SCALES`."""
    seed = int(draws.integers(2**63))
    evidence = []
    for scale in SCALES:
        estimator: Estimator = dataclasses.replace(cast("Any", replayed.estimator), motion_scale=scale)
        # The same draws at every scale, so that the curve is smooth.
        same = np.random.Generator(np.random.Philox(seed))
        found = estimator.run(prior, replayed.knowledge, observations, same).log_evidence
        evidence.append(-math.inf if found is None else float(found.sum()))
    best = int(np.argmax(evidence))
    if best in (0, len(SCALES) - 1):
        return None
    low, middle, high = evidence[best - 1 : best + 2]
    bend = low - 2.0 * middle + high
    place = best + (0.5 * (low - high) / bend if bend < 0.0 else 0.0)
    return float(2.0 ** ((place - len(SCALES) // 2) / 2.0))


def _beginning(replayed: Replay) -> tuple[int, Prior]:
    """Return the first step that counts, and what is known before it."""
    prior, study = replayed.prior, replayed.spec.study
    sigma_m = replayed.stated_sigma_m
    if math.isfinite(prior.sigma_m) or sigma_m is None:
        return 0, prior
    steps = len(sigma_m)
    found = np.flatnonzero((sigma_m <= study.start_sigma_m) & ~replayed.lost)
    settled = int(found[0]) if len(found) else steps
    # Its heading takes a little longer than its place.
    first = min(settled + round(_SETTLE_S / study.step_s), steps // 2)
    x_m, y_m, heading_rad = (float(value) for value in replayed.trajectory.poses[first])
    pose = (x_m, y_m, heading_rad)
    return first + 1, Prior(pose=pose, sigma_m=study.start_sigma_m, sigma_rad=study.start_sigma_rad)


def _part(observations: Observations, first: int, end: int) -> Observations:
    """Return the steps from ``first`` to before ``end``, or to the last."""
    end = min(end, len(observations))
    steps, reads = slice(first, end), slice(*observations.read_start[[first, end]].tolist())
    return dataclasses.replace(
        observations,
        increments=observations.increments[steps],
        sigma=observations.sigma[steps],
        read_start=observations.read_start[first : end + 1] - observations.read_start[first],
        read_antenna=observations.read_antenna[reads],
        read_tag=observations.read_tag[reads],
        active=observations.active[steps],
        gyro_turn_rad=observations.gyro_turn_rad[steps],
        gyro_sigma_rad=observations.gyro_sigma_rad[steps],
    )


def _copy(
    replayed: Replay, observations: Observations, scale: float, missed_share: float, streams: Streams, copy: int
) -> Observations:
    """Return what a robot would have seen that drove along the estimated path with a known noise of odometry.

    Tags scatter as the layout file has it, by their own deviation and by the placement fault of the search.

    The path is that of `_part`: its first increment is the measured one, because it has no pose before it.
    """
    knowledge, antennas, steps = replayed.knowledge, replayed.knowledge.antennas, len(observations)
    last = _beginning(replayed)[0] + steps
    path = replayed.trajectory.poses[last - steps : last]
    true = np.concatenate([observations.increments[:1], increments_between(path)])
    true[:, 2] = wrapped(true[:, 2])
    noise = streams.generator(SCENARIO, copy, Purpose.ODOMETRY).standard_normal(true.shape)
    draws = streams.generator(SCENARIO, copy, Purpose.SENSING)
    sigma_m = np.hypot(knowledge.tags.sigma_m, replayed.spec.study.design_faults.tag_placement_sigma_m)
    xy_m = knowledge.tags.xy_m + sigma_m[:, None] * draws.standard_normal(knowledge.tags.xy_m.shape)
    grid = bucket_grid(xy_m, float(antennas.radius_m.max(initial=0.0)))
    step, antenna, tag = compiled_detections(
        antenna_centres(path, antennas), observations.active, np.asarray(antennas.radius_m), grid
    )
    scan = step * len(antennas) + antenna
    alone = ~antennas.one_tag[antenna] | (np.bincount(scan, minlength=1)[scan] == 1)
    read = alone & (draws.random(steps * len(antennas))[scan] >= missed_share)
    step, antenna, tag = step[read], antenna[read], tag[read]
    return dataclasses.replace(
        observations,
        increments=true + scale * observations.sigma * noise,
        read_start=np.searchsorted(step, np.arange(steps + 1)).astype(np.int64),
        read_antenna=antenna,
        read_tag=tag,
    )
