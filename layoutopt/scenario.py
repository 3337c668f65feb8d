"""The world a layout is judged in: site, robot, routes and what goes wrong."""

from dataclasses import dataclass, field
from enum import Enum, unique

from layoutopt.identity import FloatArray, by_content, read_only
from layoutopt.robot import Robot
from layoutopt.site import Site


@unique
class Role(Enum):
    """What a scenario may be used for."""

    DESIGN = "design"
    HELD_OUT = "held-out"


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


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Routes:
    """Where robots drive.

    ``kind`` is ``"patrol"`` (a closed tour through the free space that passes every zone with a target of its
    own), ``"point_to_point"`` (errands, first to those zones, then anywhere), ``"circle"`` (about the middle of
    the floor) or ``"way_points"`` (the points given, shape (n, 2), m, one after the other and back to the first).
    """

    kind: str = "patrol"
    way_points_m: FloatArray = field(default_factory=lambda: read_only([], (-1, 2)))
    circle_radius_m: float = 0.5
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        """Freeze the way points."""
        object.__setattr__(self, "way_points_m", read_only(self.way_points_m, (-1, 2)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Judgement:
    """How a trial is judged.

    Errors are taken from ``settle_s`` on. The robot counts as localised from the first time its position error
    stays within ``localised_within_m`` for ``hold_s``, and as lost in every step after ``settle_s`` with an error
    beyond ``lost_beyond_m``, whether it was localised before or not.
    """

    settle_s: float = 3.0
    localised_within_m: float = 0.05
    hold_s: float = 1.0
    lost_beyond_m: float = 0.25


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
    targets_m, scatterers_m
        Things to be tracked and things that reflect, shape (n, 2), m; for UHF and docking.
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
    targets_m: FloatArray = field(default_factory=lambda: read_only([], (-1, 2)))
    scatterers_m: FloatArray = field(default_factory=lambda: read_only([], (-1, 2)))
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        """Freeze the arrays and check the time step."""
        object.__setattr__(self, "targets_m", read_only(self.targets_m, (-1, 2)))
        object.__setattr__(self, "scatterers_m", read_only(self.scatterers_m, (-1, 2)))
        if not self.step_s > 0.0 or self.step_count < 1:
            raise ValueError("a trial needs a positive time step and at least one step")

    @property
    def duration_s(self) -> float:
        """Time that one trial lasts."""
        return self.step_s * self.step_count
