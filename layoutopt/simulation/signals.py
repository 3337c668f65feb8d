"""What UHF antennas hear of a tag: strength, whether it is heard at all, phase, and the channel.

Signals go straight through walls, things and people here, as in the model against which liang2020 was reproduced:
nothing attenuates, reflects or shadows them, and what multipath does to strengths is slow fading. So coverage
behind walls, and of a tag that its bearer hides, is too good; behind a wall of loss L a real tag is heard as one
2 L dB weaker. Tags are taken to be at the height of the antennas, as in liang2020 (Section 4.1).
"""

import math
from dataclasses import dataclass
from typing import Final, Protocol, cast

import numpy as np
from scipy.special import expit, logit

from layoutopt.errors import InvalidInput
from layoutopt.geometry import turned
from layoutopt.identity import BoolArray, FloatArray, IntArray
from layoutopt.layout import ReaderGroup
from layoutopt.tracking_world import SPEED_OF_LIGHT_M_S, SignalWorld

NEAREST_M: Final = 0.1
"""A tag that is nearer to an antenna is heard as one so far off: it would be in the antenna's housing."""
LEAST_CHANCE: Final = 0.01
"""Chance of a reading below which a tag counts as out of reach: at 0.4 s a reading, one in 40 seconds."""
REACH_SIGMAS: Final = 2.0
"""Standard deviations of fading and noise, both together, that reach gives on top of the mean strength."""
FARTHEST_M: Final = 10_000.0
"""Passive tags answer over some 10 m; who is told of a thousand times that has mistaken a number."""
_CLOCK_SHARE: Final = 1e-9
"""Of a dwell time, by which a reading at its very end belongs to the next, however intervals are rounded."""


class SignalAntenna(Protocol):
    """What is asked of the model of an antenna that hears UHF tags."""

    @property
    def key(self) -> str:
        """Content key."""
        ...

    def __hash__(self) -> int:
        """Return a hash of the content."""
        ...

    def gain_db(self, offset_m: FloatArray) -> FloatArray:
        """Return the gain on one way against straight ahead, dB, for offsets, shape (..., 3), m."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Signals:
    """What the antennas heard, in columns; as in `layoutopt.estimators.targets.TargetObservations`."""

    strength_dbm: FloatArray
    phase_word: IntArray
    frequency_hz: FloatArray


def signal_antenna(group: ReaderGroup) -> SignalAntenna:
    """Return the antenna model of a group that hears signals.

    Raises
    ------
    ValueError
        If the group reads something else.
    """
    if group.kind != "signal" or not hasattr(group.antenna, "gain_db"):
        raise ValueError(f"antennas of group '{group.name}' (kind '{group.kind}') hear no UHF tags")
    return cast("SignalAntenna", group.antenna)


def offsets_m(group: ReaderGroup, robot_pose: tuple[float, float, float], places_m: FloatArray) -> FloatArray:
    """Return where tags are in the frames of antennas, shape (n, antennas, 3), m; all at the antennas' height.

    Parameters
    ----------
    group
        The antennas.
    robot_pose
        x, y (m) and heading (rad).
    places_m
        Where the tag of each antenna is in the floor frame, shape (n, antennas, 2), m.
    """
    in_robot_m = turned(places_m - np.array(robot_pose[:2]), -robot_pose[2])
    found = np.zeros((*in_robot_m.shape[:2], 3))
    for antenna, (x_m, y_m, _, yaw_rad) in enumerate(group.poses):
        found[:, antenna, :2] = turned(in_robot_m[:, antenna] - (x_m, y_m), -yaw_rad)
    return found


def ways_m(offset_m: FloatArray) -> FloatArray:
    """Return how far tags are from antennas for offsets, shape (..., 3), at least `NEAREST_M`."""
    return np.asarray(np.maximum(np.sqrt((offset_m**2).sum(axis=-1)), NEAREST_M))


def mean_strength_dbm(antenna: SignalAntenna, signal: SignalWorld, offset_m: FloatArray) -> FloatArray:
    """Return the strength received without fading and noise, dBm, for offsets, shape (..., 3), m.

    The signal passes the antenna's pattern on both ways, so its gain counts twice.
    """
    return np.asarray(
        signal.strength_at_1m_dbm
        + signal.tag_offset_db
        + 2.0 * antenna.gain_db(offset_m)
        - 10.0 * signal.path_exponent * np.log10(ways_m(offset_m))
    )


def detection_chance(signal: SignalWorld, strength_dbm: FloatArray) -> FloatArray:
    """Return the chance that a reading of such strength succeeds: logistic in the strength received.

    It is one half at the mean strength of a tag of no offset at ``half_range_m`` straight ahead. Fading and noise
    are symmetric, so half of the readings succeed there with them as well.
    """
    half_dbm = signal.strength_at_1m_dbm - 10.0 * signal.path_exponent * np.log10(signal.half_range_m)
    return np.asarray(expit((strength_dbm - half_dbm) / signal.detection_width_db))


def within_reach(antenna: SignalAntenna, signal: SignalWorld, offset_m: FloatArray) -> BoolArray:
    """Return whether tags at offsets, shape (..., 3), m, are in reach of an antenna.

    That is where a reading that fading and noise help by `REACH_SIGMAS` succeeds with `LEAST_CHANCE` or more.
    """
    lucky_dbm = mean_strength_dbm(antenna, signal, offset_m) + REACH_SIGMAS * spread_db(signal)
    return np.asarray(detection_chance(signal, lucky_dbm) >= LEAST_CHANCE)


def reach_m(signal: SignalWorld) -> float:
    """Return how far straight ahead a tag of no offset is `within_reach`.

    Raises
    ------
    InvalidInput
        If that is beyond `FARTHEST_M`.
    """
    beyond_db = REACH_SIGMAS * spread_db(signal) - signal.detection_width_db * float(logit(LEAST_CHANCE))
    decades = beyond_db / (10.0 * signal.path_exponent)
    if decades > math.log10(FARTHEST_M / signal.half_range_m):
        raise InvalidInput.at(
            "tracking",
            f"signals that fall by {10.0 * signal.path_exponent:g} dB for each tenfold distance and vary by "
            f"{spread_db(signal):.3g} dB are heard beyond {FARTHEST_M / 1000.0:g} km",
            "Raise path_exponent, or lower half_range, fading_db, noise_db or detection_width_db.",
        )
    return float(signal.half_range_m * 10.0**decades)


def spread_db(signal: SignalWorld) -> float:
    """Return the standard deviation of a strength by fading and noise together."""
    return math.hypot(signal.fading_sigma_db, signal.noise_sigma_db)


def hear(
    group: ReaderGroup,
    signal: SignalWorld,
    offset_m: FloatArray,
    read_time_s: FloatArray,
    draws: np.random.Generator,
) -> Signals:
    """Return what each antenna hears of the tag at each of its readings.

    Strength is the mean strength, plus fading that is normal and correlated from one reading of an antenna to its
    next (an autoregression of order 1 that starts in balance), plus noise of each reading. Whether the reading
    succeeds follows from that strength. The phase is that of Eq. 8 of liang2020, 2 pi 2 R / lambda plus an offset
    of each channel and antenna, even over a turn and drawn anew for every trial, plus noise, and is told as the
    nearest word of ``phase_bits``.

    Every antenna has random numbers of its own, by its number, and takes the same for each reading whatever
    comes of it: one antenna more, a longer drive or another tag changes nothing for the others.

    Parameters
    ----------
    group
        The antennas.
    signal
        What signals meet.
    offset_m
        Where the tag is in the frame of each antenna at each of its readings, shape (n, antennas, 3), m.
    read_time_s
        When that is, shape (n, antennas), ascending by row.
    draws
        Random stream of the signals; only its children are drawn from.

    Raises
    ------
    ValueError
        If a place is no finite number.
    """
    if not np.isfinite(offset_m).all():
        raise ValueError("offset_m holds what is no finite number; the tag must be somewhere")
    instants, antennas = offset_m.shape[:2]
    clock, *children = draws.spawn(1 + 3 * antennas)
    channel = channels(signal, read_time_s, clock)
    frequency_hz = np.array(signal.channels_hz)[channel]
    strength_dbm = mean_strength_dbm(signal_antenna(group), signal, offset_m)
    phase_rad = 4.0 * np.pi * ways_m(offset_m) * frequency_hz / SPEED_OF_LIGHT_M_S
    heard = np.empty((instants, antennas), dtype=np.bool_)
    for antenna in range(antennas):
        normal_draws, uniform_draws, trial_draws = children[3 * antenna : 3 * antenna + 3]
        fresh, white, jitter = normal_draws.standard_normal((instants, 3)).T
        strength_dbm[:, antenna] += faded(signal.fading_sigma_db, signal.fading_correlation, fresh)
        strength_dbm[:, antenna] += signal.noise_sigma_db * white
        offset_rad = 2.0 * np.pi * trial_draws.random(len(signal.channels_hz))
        phase_rad[:, antenna] += offset_rad[channel[:, antenna]] + signal.phase_sigma_rad * jitter
        chance = detection_chance(signal, strength_dbm[:, antenna])
        heard[:, antenna] = uniform_draws.random(instants) < chance
    words = 2**signal.phase_bits
    word = np.round(phase_rad / (2.0 * np.pi) * words).astype(np.int64) % words
    return Signals(
        strength_dbm=np.where(heard, strength_dbm, np.nan),
        phase_word=np.where(heard, word, -1),
        frequency_hz=frequency_hz,
    )


def faded(sigma_db: float, correlation: float, normal: FloatArray) -> FloatArray:
    """Return an autoregression of order 1 in balance, shape (n,), dB, from independent standard normals."""
    fresh = sigma_db * np.sqrt(1.0 - correlation**2) * normal
    fading_db = np.empty(len(normal))
    last = 0.0
    for reading, value in enumerate(fresh.tolist()):
        last = sigma_db * float(normal[0]) if reading == 0 else correlation * last + value
        fading_db[reading] = last
    return fading_db


def channels(signal: SignalWorld, times_s: FloatArray, draws: np.random.Generator) -> IntArray:
    """Return the number of the channel on which the reader is at each time, as its clock says.

    From time 0 it stays ``dwell_s`` on a random channel, then goes to a random one of the others, and so on.
    """
    count = len(signal.channels_hz)
    turn = np.floor(times_s / signal.dwell_s + _CLOCK_SHARE).astype(np.int64)
    first = draws.integers(count)
    steps = draws.integers(1, count, int(turn.max(initial=0))) if count > 1 else np.zeros(0, dtype=np.int64)
    sequence = np.cumsum(np.concatenate([[first], steps])) % count
    return np.asarray(sequence[turn] if count > 1 else np.zeros_like(turn))
