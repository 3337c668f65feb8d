"""What a spec says of finding things off the floor: tracking by UHF and laser, and docking by direction."""

import math
from dataclasses import dataclass, field

from layoutopt import registry
from layoutopt.docking_world import DockingWorld
from layoutopt.identity import FloatArray, by_content, read_only
from layoutopt.layout import ReaderGroup, Transponder
from layoutopt.readers.finders import UHF_HEIGHT_M, docking_antennas, yawed_antennas
from layoutopt.tracking_world import TrackingWorld


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackingSettings:
    """The question of tracking.

    Attributes
    ----------
    world
        Where the robot stands, who walks where, signals and scanner.
    fitted
        Whether layouts of the spec carry UHF antennas: the first count, yaw and interval.
    counts, yaws_rad, intervals_s
        Numbers of antennas, yaws and sampling intervals to choose from.
    beam_rad, height_m
        Beam of an antenna and its height above the floor.
    target_tags
        UHF tags that are given out.
    estimator
        Name of the tracker.
    trials, duration_s
        Trials of each choice, and how long each lasts.
    lack
        What the site has no room for, where nobody said where the robot stands and the target walks and the
        defaults do not fit; empty if nothing is amiss.
    """

    world: TrackingWorld
    fitted: bool = False
    counts: tuple[int, ...] = (2,)
    yaws_rad: tuple[float, ...] = (math.radians(45.0),)
    intervals_s: tuple[float, ...] = (0.4,)
    beam_rad: float = math.radians(70.0)
    height_m: float = UHF_HEIGHT_M
    target_tags: int = 1
    estimator: str = "uhf_laser"
    trials: int = 16
    duration_s: float = 150.0
    lack: str = ""

    def antennas(
        self, *, count: int | None = None, yaw_rad: float | None = None, interval_s: float | None = None
    ) -> ReaderGroup:
        """Return the antennas of a choice; what is left out is the first of its list."""
        return yawed_antennas(
            antenna=registry.load("antennas", "uhf_patch")(beam_rad=self.beam_rad),
            count=self.counts[0] if count is None else count,
            yaw_rad=self.yaws_rad[0] if yaw_rad is None else yaw_rad,
            interval_s=self.intervals_s[0] if interval_s is None else interval_s,
            height_m=self.height_m,
        )


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DockingSettings:
    """The question of docking.

    Attributes
    ----------
    world
        How waves and robots meet what stands on the site.
    fitted
        Whether layouts of the spec carry crossed antennas and the transponder.
    transponder_m
        Where the transponder is; ``None`` where it is sought.
    scatterers_m
        What scatters waves, shape (n, 2), m.
    candidate_pitch_m
        Pitch of the lattice of places among which one is sought.
    noise_rad
        Standard deviation of a direction, beside what scattering does.
    estimator
        Name of what chooses headings.
    trials
        Drives to each candidate.
    """

    world: DockingWorld = field(default_factory=DockingWorld)
    fitted: bool = False
    transponder_m: tuple[float, float] | None = None
    scatterers_m: FloatArray = field(default_factory=lambda: read_only([], (-1, 2)))
    candidate_pitch_m: float = 0.5
    noise_rad: float = math.radians(2.0)
    estimator: str = "bearing_filter"
    trials: int = 200
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        """Freeze the places."""
        object.__setattr__(self, "scatterers_m", read_only(self.scatterers_m, (-1, 2)))

    def antennas(self) -> ReaderGroup:
        """Return the crossed antennas of a robot."""
        return docking_antennas(antenna=registry.load("antennas", "crossed_loops")())

    def transponder(self) -> Transponder | None:
        """Return the transponder, at the height of the antennas; ``None`` where its place is sought."""
        if self.transponder_m is None:
            return None
        return Transponder(name="dock", position_m=(*self.transponder_m, float(self.antennas().poses[0, 2])))
