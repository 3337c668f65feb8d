"""How UHF antennas of a standing robot hear a tag, over the floor and along a walk, and how often phases mislead.

The chance that a reading succeeds is that of the simulated signals, averaged over what trials draw: the
strength is its mean plus fading plus noise, both normal, and the chance is logistic in the strength. Antennas
fade on their own, so a tag is missed by all with the product of the chances to be missed by each. Two readings
in a row of one antenna fade alike (by the correlation of the fading), and the chance that both are heard keeps
that. Averages are Gauss-Hermite sums; places are a lattice whose points stand for the squares about them.
"""

import math
from dataclasses import dataclass, field
from functools import lru_cache
from typing import ClassVar, Final

import numpy as np

from layoutopt.geometry import covers, turned
from layoutopt.identity import FloatArray, by_content
from layoutopt.layout import Layout, ReaderGroup
from layoutopt.protocols import ObjectiveCard
from layoutopt.scenario import Scenario
from layoutopt.scores import SCORE_UNITS, Score, Scores, TrialOutcomes
from layoutopt.simulation.signals import (
    detection_chance,
    mean_strength_dbm,
    offsets_m,
    signal_antenna,
    spread_db,
    ways_m,
)
from layoutopt.simulation.walking import lap_m, target_places
from layoutopt.tracking_world import SPEED_OF_LIGHT_M_S, SignalWorld, TrackingWorld

CARD: Final = ObjectiveCard(
    summary=(
        "Chance that UHF antennas hear a tag, mean over the floor ahead of the robot and along the walk, and the "
        "share of phase pairs that a walk makes ambiguous. Rank correlation with simulated errors on two sites: "
        "walk -0.96 and -0.78, floor -0.92 and -0.84, pairs 0.34 and 0.33."
    ),
    reference="own; radial way within a quarter wavelength after liang2020, Eq. 9-10",
    scores={name: SCORE_UNITS[name] for name in ("area_coverage", "walk_coverage", "expected_alias_share")},
    fidelity="exact",
)
_ACROSS: Final = 100
"""Lattice points from the robot to the end of its reach: the mean over an area then has three digits."""
_WALK_STEP_M: Final = 0.04
"""Half of the radial way that makes a phase ambiguous; chances to hear a tag change little over it."""
_FINER: Final = 16
"""Ambiguity begins at a place, so it is looked at this much more finely: every 2.5 mm."""
_NODES: Final = 48
"""With the usual fading the chance at a place is right to 1e-7 for a detection width of 1 dB, to 0.2 % for 0.3 dB,
to 3 % for 0.1 dB; errors of neighbouring places have opposite signs, so means are better."""
_PAIR_NODES: Final = 16
"""Along each axis; pairs are weights, whose ratio needs fewer digits."""


def hearing_chance(group: ReaderGroup, world: TrackingWorld, places_m: FloatArray) -> FloatArray:
    """Return the chance that a reading of each antenna hears a tag, shape (n, antennas), averaged over fading.

    Parameters
    ----------
    group
        Antennas that hear signals.
    world
        Where the robot stands and what signals meet.
    places_m
        Where the tag is in the floor frame, shape (n, 2), m.

    Raises
    ------
    ValueError
        If the group reads something else.
    """
    signal = world.signal
    strength_dbm = _strength_at(group, world, places_m)
    nodes, weights = np.polynomial.hermite_e.hermegauss(_NODES)
    chance = detection_chance(signal, strength_dbm[..., None] + spread_db(signal) * nodes)
    return np.asarray(chance @ (weights / weights.sum()))


def chance_somewhere(chance: FloatArray) -> FloatArray:
    """Return the chance that one antenna or more hears the tag, shape (n,), of those of each, shape (n, antennas).

    >>> chance_somewhere(np.array([[0.5, 0.5], [0.0, 0.2]])).round(9).tolist()
    [0.75, 0.2]
    """
    return np.asarray(1.0 - np.prod(1.0 - chance, axis=-1))


def reach_lattice(scenario: Scenario, world: TrackingWorld) -> FloatArray:
    """Return the places of the open floor within half range of the robot and not behind it, shape (n, 2), m.

    The lattice lies in the robot's frame, so that antennas at opposite yaws have the same coverage of an open
    floor. It is empty where the robot looks at no floor.
    """
    x_m, y_m, heading_rad = world.robot_pose
    low_x, low_y, high_x, high_y = scenario.site.bounds_m
    corners_m = np.array([(low_x, low_y), (low_x, high_y), (high_x, low_y), (high_x, high_y)])
    farthest_m = float(np.hypot(*(corners_m - (x_m, y_m)).T).max())
    reach_m = min(world.signal.half_range_m, farthest_m)
    ahead_m = (np.arange(_ACROSS) + 0.5) * reach_m / _ACROSS
    aside_m = (np.arange(2 * _ACROSS) + 0.5) * reach_m / _ACROSS - reach_m
    places_m = np.stack(np.meshgrid(ahead_m, aside_m, indexing="ij"), axis=-1).reshape(-1, 2)
    places_m = places_m[np.hypot(*places_m.T) <= reach_m]
    on_floor_m = turned(places_m, heading_rad) + np.array([x_m, y_m])
    return np.asarray(on_floor_m[covers(scenario.site.open_floor, on_floor_m)])


@lru_cache(maxsize=512)
def alias_share(groups: tuple[ReaderGroup, ...], world: TrackingWorld) -> float:
    """Return the share of phase pairs whose radial way is a quarter wavelength or more; NaN if none is heard.

    A pair is two readings of one antenna, one scan cycle apart and on one channel. Its weight is the chance that
    both are heard. Starts of pairs are even over the closed walk, channels are equally frequent.
    """
    quarter_m = np.array([SPEED_OF_LIGHT_M_S / frequency_hz / 4.0 for frequency_hz in world.signal.channels_hz])
    times_s, fine_s = _walk_times_s(world), _walk_times_s(world, _FINER)
    misled = heard = 0.0
    for group in groups:
        before_m, after_m = (
            _ways_at(group, world, target_places(world, 0.0, at_s)) for at_s in (fine_s, fine_s + group.cycle_s)
        )
        share = (np.abs(after_m - before_m)[..., None] >= quarter_m).mean(axis=-1)
        share = share.reshape(len(times_s), _FINER, group.count).mean(axis=1)
        before_dbm, after_dbm = (
            _strength_at(group, world, target_places(world, 0.0, at_s))
            for at_s in (times_s, times_s + group.cycle_s)
        )
        both = _both_heard(world.signal, before_dbm, after_dbm)
        misled += float((both * share).sum())
        heard += float(both.sum())
    return misled / heard if heard > 0.0 else math.nan


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UhfCoverage:
    """Coverage by all UHF antennas of a layout together, and the aliases that its sampling interval leaves.

    ``area_coverage`` is the mean over the open floor within half range ahead of the robot (bearings to 90 degrees
    on either side), ``walk_coverage`` that along the target's walk. ``expected_alias_share`` is for phases that
    are believed to the nearest displacement: the limit of a quarter wavelength an interval.

    Notes
    -----
    How far the scores may stand in for trials was measured over 28 choices, 1 to 4 antennas at 0 to 90 degrees,
    with 16 trials of 150 s each and seed 7. Spearman's rank correlation with the mean error of the tracker
    `uhf_laser` was, with 95 % intervals over trials,

    ====================  =======================  =======================
    score                 set-up of liang2020      built-in ward
    ====================  =======================  =======================
    walk_coverage         -0.96 (-0.98 to -0.94)   -0.78 (-0.80 to -0.72)
    area_coverage         -0.92 (-0.95 to -0.89)   -0.84 (-0.87 to -0.80)
    expected_alias_share  0.34 (0.32 to 0.39)      0.33 (0.29 to 0.36)
    ====================  =======================  =======================

    The intervals say what other trials would have given for these choices, not what other choices or sites would.
    """

    key: str = field(init=False, repr=False, default="")
    card: ClassVar[ObjectiveCard] = CARD

    def __post_init__(self) -> None:
        """Nothing to check: the objective has no settings."""

    def __call__(self, layout: Layout, scenario: Scenario, outcomes: TrialOutcomes | None) -> Scores:
        """Return the scores; none without UHF antennas or without a target to track.

        A robot that looks at no floor has no ``area_coverage``, and a walk that is never heard no
        ``expected_alias_share``.
        """
        groups = layout.readers_of("signal")
        if not groups or scenario.tracking is None:
            return {}
        values = _values(groups, scenario)
        return {
            name: Score(value=value, unit=CARD.scores[name])
            for name, value in zip(CARD.scores, values, strict=True)
            if not math.isnan(value)
        }


@lru_cache(maxsize=256)
def _values(groups: tuple[ReaderGroup, ...], scenario: Scenario) -> tuple[float, float, float]:
    """Return the scores in the order of the card, NaN where there is none; layouts share their antennas."""
    world = scenario.tracking
    assert world is not None
    walk_m = target_places(world, 0.0, _walk_times_s(world))
    area, walk = (_coverage(groups, world, places_m) for places_m in (reach_lattice(scenario, world), walk_m))
    return area, walk, alias_share(groups, world)


def _coverage(groups: tuple[ReaderGroup, ...], world: TrackingWorld, places_m: FloatArray) -> float:
    if not len(places_m):
        return math.nan
    chance = np.concatenate([hearing_chance(group, world, places_m) for group in groups], axis=1)
    return float(chance_somewhere(chance).mean())


def _walk_times_s(world: TrackingWorld, finer: int = 1) -> FloatArray:
    """Return times at which the target is at places evenly along its walk, once round.

    With ``finer`` each of these stands for that many, one after the other, which are even as well.
    """
    count = finer * math.ceil(lap_m(world) / _WALK_STEP_M)
    return (np.arange(count) + 0.5) / count * lap_m(world) / world.walking_speed_m_s


def _offsets_at(group: ReaderGroup, world: TrackingWorld, places_m: FloatArray) -> FloatArray:
    """Return where places are in the frames of antennas, shape (n, antennas, 3), m."""
    return offsets_m(group, world.robot_pose, np.repeat(places_m[:, None, :], group.count, axis=1))


def _strength_at(group: ReaderGroup, world: TrackingWorld, places_m: FloatArray) -> FloatArray:
    """Return the mean strength at each antenna, shape (n, antennas), dBm."""
    return mean_strength_dbm(signal_antenna(group), world.signal, _offsets_at(group, world, places_m))


def _ways_at(group: ReaderGroup, world: TrackingWorld, places_m: FloatArray) -> FloatArray:
    """Return the distance from each antenna, shape (n, antennas), m."""
    return ways_m(_offsets_at(group, world, places_m))


def _both_heard(signal: SignalWorld, before_dbm: FloatArray, after_dbm: FloatArray) -> FloatArray:
    """Return the chance that two readings in a row are heard, shape as given.

    What is added to their mean strengths is normal with the variance of fading and noise together and the
    covariance of the fading.
    """
    sigma_db = spread_db(signal)
    correlation = signal.fading_correlation * (signal.fading_sigma_db / sigma_db) ** 2 if sigma_db > 0.0 else 0.0
    nodes, weights = np.polynomial.hermite_e.hermegauss(_PAIR_NODES)
    weights = weights / weights.sum()
    first = detection_chance(signal, before_dbm[..., None] + sigma_db * nodes)
    shared = correlation * nodes[:, None] + math.sqrt(1.0 - correlation**2) * nodes
    second = detection_chance(signal, after_dbm[..., None, None] + sigma_db * shared) @ weights
    return np.asarray((first * second) @ weights)
