"""The world a layout is judged in: site, robot, routes and what goes wrong."""

import math
from dataclasses import dataclass, field
from enum import Enum, unique
from typing import Final

import numpy as np

from layoutopt.docking_world import DockingWorld
from layoutopt.identity import LATER, FloatArray, IntArray, by_content, check_not_negative, read_only
from layoutopt.robot import Drive, Robot
from layoutopt.site import Site
from layoutopt.tracking_world import TrackingWorld

STARTS: Final = ("any", "first")
"""Way points at which a drive may begin."""


@unique
class Role(Enum):
    """What a scenario may be used for."""

    DESIGN = "design"
    HELD_OUT = "held-out"


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TruePlaces:
    """Where certain tags truly are, whatever the tag map says of them.

    Attributes
    ----------
    tag_id
        Their numbers in the tag map, shape (n,).
    xy_m
        Their true places, shape (n, 2), m.
    silent
        Numbers of tags that never answer, shape (m,).
    """

    tag_id: IntArray
    xy_m: FloatArray
    silent: IntArray
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        object.__setattr__(self, "xy_m", read_only(self.xy_m, (len(self.tag_id), 2)))
        for name in ("tag_id", "silent"):
            numbers = np.array(getattr(self, name), dtype=np.int64).reshape(-1)
            numbers.setflags(write=False)
            object.__setattr__(self, name, numbers)


@dataclass(frozen=True, slots=True, kw_only=True)
class Faults:
    """What differs between the planned world and the real one; all zero means nothing goes wrong.

    Attributes
    ----------
    tag_placement_sigma_m
        Standard deviation of a tag's true place about its planned one, per axis.
    tag_offset_m
        Common shift of all tags, x and y.
    dead_tag_share
        Share of tags that never answer.
    missed_read_share
        Chance that a scan in range brings nothing.
    wrong_identity_share
        Chance that a read names another tag.
    antenna_height_error_m
        Added to every antenna's true height.
    read_edge_m
        Width of the soft edge of the read disc (scale of a logistic curve); zero is a hard edge.
    direction_noise_rad
        Standard deviation of a direction of arrival.
    kidnapped_at_s
        Time at which the robot is lifted and put down at the start of another route; ``None`` for never.
    clock_error_s
        Delay of every reading's time stamp.
    slips_per_m
        Mean number of times that a wheel slips on 1 m of its way; slips come independently (Poisson).
    slip_sigma_m
        Standard deviation of what one slip adds to the forward way that the wheels report. The deviations that
        the odometry states know nothing of it.
    asynchronous
        Whether every antenna scans at a moment of its own within the step, of which estimators are not told,
        instead of all at its end.
    true_places
        Tags that are known to lie elsewhere than the tag map says, as of a floor that was surveyed; what is drawn
        for the others is added to these too.
    start_offset
        Added to the start that estimators are told, x m, y m and heading rad, beyond what they are told to expect.

    Raises
    ------
    ValueError
        If a number is not finite, a share lies outside 0 to 1, or a size or a time is negative.
    """

    tag_placement_sigma_m: float = 0.0
    tag_offset_m: tuple[float, float] = (0.0, 0.0)
    dead_tag_share: float = 0.0
    missed_read_share: float = 0.0
    wrong_identity_share: float = 0.0
    antenna_height_error_m: float = 0.0
    read_edge_m: float = 0.0
    direction_noise_rad: float = 0.0
    kidnapped_at_s: float | None = None
    clock_error_s: float = 0.0
    slips_per_m: float = 0.0
    slip_sigma_m: float = 0.0
    asynchronous: bool = False
    true_places: TruePlaces | None = field(default=None, metadata=LATER)
    start_offset: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Check every number."""
        for name in ("dead_tag_share", "missed_read_share", "wrong_identity_share"):
            share = getattr(self, name)
            if not 0.0 <= share <= 1.0:
                raise ValueError(f"{name} must lie between 0 and 1, got {share!r}")
        sizes = ("tag_placement_sigma_m", "read_edge_m", "direction_noise_rad", "clock_error_s", "slips_per_m")
        check_not_negative("the faults", **{name: getattr(self, name) for name in (*sizes, "slip_sigma_m")})
        if self.kidnapped_at_s is not None:
            check_not_negative("the faults", kidnapped_at_s=self.kidnapped_at_s)
        for name, size in (("tag_offset_m", 2), ("start_offset", 3)):
            offset = getattr(self, name)
            if len(offset) != size or not all(math.isfinite(value) for value in offset):
                raise ValueError(f"{name} must be {size} finite numbers, got {offset!r}")
        if not math.isfinite(self.antenna_height_error_m):
            raise ValueError(f"antenna_height_error_m must be finite, got {self.antenna_height_error_m!r}")


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Routes:
    """Where robots drive.

    ``kind`` is ``"patrol"`` (a closed tour through the free space that passes every zone with a target of its
    own), ``"point_to_point"`` (errands, first to those zones, then anywhere), ``"circle"`` (about the middle of
    the floor) or ``"way_points"`` (the points given, shape (n, 2), m, one after the other and back to the first).

    Attributes
    ----------
    circle_radius_m
        Radius of the circle.
    centre_spread_m
        The circle, or all way points together, are shifted in every trial by a uniform draw of at most this in x
        and in y, so that they lie in no fixed place against the tags.
    start
        At which way point a drive begins: ``"any"``, or the ``"first"``.
    pause_s
        How long the robot stands still at each way point, the one it starts from included.
    heading_rad
        Heading that an omnidirectional robot keeps on its whole route; ``None`` for one that looks ahead.

    Raises
    ------
    ValueError
        If a number is negative or not finite, or a route is asked for what only other kinds have.
    """

    kind: str = "patrol"
    way_points_m: FloatArray = field(default_factory=lambda: read_only([], (-1, 2)))
    circle_radius_m: float = 0.5
    centre_spread_m: float = 0.0
    start: str = "any"
    pause_s: float = 0.0
    heading_rad: float | None = None
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        """Freeze the way points and check the numbers."""
        object.__setattr__(self, "way_points_m", read_only(self.way_points_m, (-1, 2)))
        sizes = ("circle_radius_m", "centre_spread_m", "pause_s")
        check_not_negative("the routes", **{name: getattr(self, name) for name in sizes})
        if self.heading_rad is not None and not math.isfinite(self.heading_rad):
            raise ValueError(f"heading_rad of the routes must be finite, got {self.heading_rad!r}")
        if self.start not in STARTS:
            raise ValueError(f"routes start at one of {', '.join(STARTS)}, not {self.start!r}")
        if self.pause_s > 0.0 and self.kind != "way_points":
            raise ValueError(f"pauses are made at way points, and routes of kind {self.kind!r} have none")
        if self.centre_spread_m > 0.0 and self.kind not in ("circle", "way_points"):
            raise ValueError(f"routes of kind {self.kind!r} are random anyway and take no centre_spread_m")


@dataclass(frozen=True, slots=True, kw_only=True)
class Judgement:
    """How a trial is judged.

    Errors are taken from ``settle_s`` on. The robot counts as localised from the first time its position error
    stays within ``localised_within_m`` for ``hold_s``, and as lost in every step after ``settle_s`` with an error
    beyond ``lost_beyond_m``, whether it was localised before or not. With ``standing_only`` errors and shares are
    over those steps alone in which the robot stands still.

    Raises
    ------
    ValueError
        If a number is negative or not finite.
    """

    settle_s: float = 3.0
    localised_within_m: float = 0.05
    hold_s: float = 1.0
    lost_beyond_m: float = 0.25
    standing_only: bool = False

    def __post_init__(self) -> None:
        """Check that all numbers are finite and none is negative."""
        sizes = ("settle_s", "localised_within_m", "hold_s", "lost_beyond_m")
        check_not_negative("the judgement", **{name: getattr(self, name) for name in sizes})


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scenario:
    """A named world with a role; its name keys the random streams.

    Attributes
    ----------
    step_s, step_count
        Time step of a trial, and their number.
    start_sigma_m, start_sigma_rad
        What the estimator knows of the start: its standard deviations per axis and of the heading.
    start_known
        Whether it knows anything of the start. If not, it is told the middle of the floor's bounds and heading 0
        with infinite standard deviations, and ``start_sigma_m`` and ``start_sigma_rad`` say nothing.
    targets_m, scatterers_m
        Things to be found and things that reflect, shape (n, 2), m; for UHF and docking.
    tracking, docking
        What more there is to a world in which a robot tracks a UHF tag, or docks by direction; ``None`` where it
        does not.

    Raises
    ------
    ValueError
        If a number lies outside its range, a robot that cannot go sideways is to keep its heading, or an unknown
        start is to be off.
    """

    name: str
    role: Role
    site: Site
    robot: Robot
    routes: Routes = field(default_factory=Routes)
    faults: Faults = field(default_factory=Faults)
    judgement: Judgement = field(default_factory=Judgement)
    step_s: float = 0.05
    step_count: int = 1200
    start_sigma_m: float = 0.05
    start_sigma_rad: float = 0.05
    start_known: bool = True
    targets_m: FloatArray = field(default_factory=lambda: read_only([], (-1, 2)))
    scatterers_m: FloatArray = field(default_factory=lambda: read_only([], (-1, 2)))
    tracking: TrackingWorld | None = field(default=None, metadata=LATER)
    docking: DockingWorld | None = field(default=None, metadata=LATER)
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        """Freeze the arrays and check the time step."""
        object.__setattr__(self, "targets_m", read_only(self.targets_m, (-1, 2)))
        object.__setattr__(self, "scatterers_m", read_only(self.scatterers_m, (-1, 2)))
        if not 0.0 < self.step_s < math.inf or self.step_count < 1:
            raise ValueError("a trial needs a positive, finite time step and at least one step")
        sigmas = {"start_sigma_m": self.start_sigma_m, "start_sigma_rad": self.start_sigma_rad}
        check_not_negative("the scenario", **sigmas)
        if self.routes.heading_rad is not None and self.robot.drive is not Drive.OMNIDIRECTIONAL:
            raise ValueError(
                f"heading_rad of the routes: a {self.robot.drive.value} drive looks where it goes and cannot keep "
                "a heading; give an omnidirectional robot or leave the heading out"
            )
        if not self.start_known and any(self.faults.start_offset):
            raise ValueError("a start that nobody is told cannot be told wrongly: leave out start_offset")

    @property
    def duration_s(self) -> float:
        """Time that one trial lasts."""
        return self.step_s * self.step_count

    @property
    def lifted_after(self) -> int | None:
        """Number of steps after which a kidnapped robot is lifted; ``None`` where that never comes."""
        kidnapped_at_s = self.faults.kidnapped_at_s
        if kidnapped_at_s is None:
            return None
        steps = int(np.searchsorted(np.arange(self.step_count + 1) * self.step_s, kidnapped_at_s))
        return steps if steps < self.step_count else None
