"""The world in which a robot tracks what wears a UHF tag: how signals go, what the laser sees, who walks where."""

import math
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray, by_content, check_not_negative, read_only

SPEED_OF_LIGHT_M_S: Final = 299_792_458.0
UHF_BAND_HZ: Final = (860e6, 960e6)
"""Frequencies at which UHF tags answer (ISO 18000-63); liang2020 names 865 to 928 MHz."""


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SignalWorld:
    """How the answers of UHF tags fare between tag and reader.

    Attributes
    ----------
    strength_at_1m_dbm
        Strength received from a tag 1 m ahead of an antenna, dBm.
    path_exponent
        The strength falls by ten times this many dB for each tenfold distance, both ways together.
    fading_sigma_db, fading_correlation
        Standard deviation of slow fading, and its correlation from one reading of an antenna to its next.
    noise_sigma_db
        Standard deviation of what is new in each reading.
    half_range_m
        Distance ahead of an antenna at which half of the readings succeed, without fading.
    detection_width_db
        Scale of the logistic curve by which the chance of a reading falls with the strength.
    tag_offset_db
        How much stronger the tag answers than the type with which sensor models are learned.
    phase_sigma_rad, phase_bits
        Standard deviation of a phase, and the bits of the word that tells it.
    channels_hz
        Frequencies of the channels among which the reader hops.
    dwell_s
        Time for which it stays on one; infinite for a reader that never hops.

    Raises
    ------
    ValueError
        If a number is not finite or outside its range, or a channel lies outside the band of UHF tags.
    """

    strength_at_1m_dbm: float = -42.0
    path_exponent: float = 3.0
    fading_sigma_db: float = 2.0
    fading_correlation: float = 0.6
    noise_sigma_db: float = 1.0
    half_range_m: float = 7.0
    detection_width_db: float = 1.0
    tag_offset_db: float = 0.0
    phase_sigma_rad: float = 0.1
    phase_bits: int = 12
    channels_hz: tuple[float, ...] = (920e6,)
    dwell_s: float = math.inf
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        """Check every number."""
        names = ("fading_sigma_db", "noise_sigma_db", "phase_sigma_rad")
        check_not_negative("the signals", **{name: getattr(self, name) for name in names})
        for name in ("path_exponent", "half_range_m", "detection_width_db"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be positive and finite, got {getattr(self, name)!r}")
        if not 0.0 <= self.fading_correlation < 1.0:
            raise ValueError(
                f"fading_correlation lies between 0 and 1, 1 excluded, got {self.fading_correlation!r}"
            )
        if not (math.isfinite(self.strength_at_1m_dbm) and math.isfinite(self.tag_offset_db)):
            raise ValueError("strengths must be finite")
        if not 1 <= self.phase_bits <= 24:
            raise ValueError(f"a phase word has 1 to 24 bits, got {self.phase_bits!r}")
        if not self.channels_hz:
            raise ValueError("a reader needs a channel")
        low_hz, high_hz = UHF_BAND_HZ
        for frequency_hz in self.channels_hz:
            if not low_hz <= frequency_hz <= high_hz:
                raise ValueError(
                    f"UHF tags answer at {low_hz / 1e6:g} to {high_hz / 1e6:g} MHz, got {frequency_hz / 1e6:g} MHz"
                )
        if not self.dwell_s > 0.0:
            raise ValueError(f"dwell_s must be positive, got {self.dwell_s!r}")
        object.__setattr__(self, "channels_hz", tuple(float(frequency_hz) for frequency_hz in self.channels_hz))


@dataclass(frozen=True, slots=True, kw_only=True)
class LaserScanner:
    """A laser scanner at the middle of the robot; its beams lie evenly over ``field_rad`` about straight ahead.

    Raises
    ------
    ValueError
        If a number is not finite or outside its range.

    References
    ----------
    liang2020, Section 4.1: half a degree, 270 degrees, 20 m (SICK S300).
    """

    step_rad: float = math.radians(0.5)
    field_rad: float = math.radians(270.0)
    range_m: float = 20.0
    range_sigma_m: float = 0.01

    def __post_init__(self) -> None:
        """Check every number."""
        if not 0.0 < self.step_rad <= self.field_rad <= 2.0 * math.pi:
            raise ValueError("the beams of a laser scanner lie a positive angle apart, within one turn")
        if not 0.0 < self.range_m < math.inf:
            raise ValueError(f"range_m must be positive and finite, got {self.range_m!r}")
        check_not_negative("the laser scanner", range_sigma_m=self.range_sigma_m)

    @property
    def beam_rad(self) -> FloatArray:
        """Direction of each beam in the robot's frame, ascending, shape (beams,), rad."""
        half = math.floor(self.field_rad / 2.0 / self.step_rad + 1e-9)
        return np.arange(-half, half + 1, dtype=np.float64) * self.step_rad


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrackingWorld:
    """Where the robot stands, who walks with the tag, who else walks and what stands about.

    Attributes
    ----------
    robot_pose
        x, y (m) and heading (rad) of the robot, which stands still and knows where.
    walk_m
        Corners of the way on which the target walks round and round, shape (n, 2), m.
    walking_speed_m_s
        How fast it walks.
    person_radius_m
        Radius of a person at the height of the laser.
    bystanders
        Number of people without a tag who walk to and fro anywhere on the site, at the target's speed.
    clutter_count, clutter_radius_m
        Number of round things that stand at random places of the floor, drawn anew for every trial, off the
        target's way and the robot; and their radius.
    clutter_hides
        Whether clutter may hide the target from the robot. If not, none stands between robot and walk or on the
        ground that the walk encloses, as in the model by which liang2020 was reproduced.
    signal, laser
        What signals meet, and the robot's scanner.

    Raises
    ------
    ValueError
        If a number is not finite or outside its range, or the walk has fewer than two corners or no length.
    """

    robot_pose: tuple[float, float, float]
    walk_m: FloatArray
    walking_speed_m_s: float = 0.4
    person_radius_m: float = 0.22
    bystanders: int = 0
    clutter_count: int = 12
    clutter_radius_m: float = 0.15
    clutter_hides: bool = False
    signal: SignalWorld = field(default_factory=SignalWorld)
    laser: LaserScanner = field(default_factory=LaserScanner)
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        """Freeze the walk and check every number."""
        object.__setattr__(self, "walk_m", read_only(self.walk_m, (-1, 2)))
        object.__setattr__(self, "robot_pose", tuple(float(value) for value in self.robot_pose))
        if len(self.robot_pose) != 3 or not all(math.isfinite(value) for value in self.robot_pose):
            raise ValueError(f"robot_pose must be three finite numbers, got {self.robot_pose!r}")
        ways_m = np.hypot(*(np.roll(self.walk_m, -1, axis=0) - self.walk_m).T)
        if len(self.walk_m) < 2 or not np.isfinite(ways_m).all() or ways_m.sum() <= 0.0:
            raise ValueError("a walk needs two finite corners or more that are not all one place")
        for name in ("walking_speed_m_s", "person_radius_m", "clutter_radius_m"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be positive and finite, got {getattr(self, name)!r}")
        for name in ("bystanders", "clutter_count"):
            if getattr(self, name) < 0:
                raise ValueError(f"{name} counts from 0, got {getattr(self, name)!r}")
