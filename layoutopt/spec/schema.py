"""The tables of a spec: keys, types, ranges and defaults, checked by pydantic.

Each class is one table of the file. Values keep the form in which they were written; what they mean together
is checked in `layoutopt.spec.reading`. All tables refuse unknown keys.
"""

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from layoutopt.errors import did_you_mean
from layoutopt.readers.inventory import SLOTS
from layoutopt.readers.profiles import PROFILES
from layoutopt.spec.building import DEFAULT_ESTIMATORS
from layoutopt.spec.quantities import (
    Angle,
    Area,
    Budget,
    Distance,
    Drift,
    Duration,
    FloorShape,
    Length,
    Pixel,
    Point,
    Price,
    Ring,
    Share,
    SignedLength,
    SmallAngle,
    Speed,
    Target,
    Time,
    TurnPerWay,
    TurnRate,
    Unfit,
    check_point,
    quantity,
    within,
)

SCHEMA = 1
"""Version of the grammar; a spec of another one is refused."""

ROUTE_KINDS = ("patrol", "point_to_point")
SLOT_KINDS = ("grid", "joints", "centres")
Count = Annotated[int, Field(ge=1, le=10_000)]
Trials = Annotated[int, Field(ge=1, le=100_000_000)]
PerMetre = Annotated[float, Field(ge=0.0, le=1_000.0)]
Sides = Annotated[float, Field(gt=0.0, le=100.0)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{1,64}$")]
Title = Annotated[str, Field(min_length=1, max_length=200)]


class Table(BaseModel):
    """What all tables share: no unknown key, no silent conversion, no change."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


def _routes(value: Any) -> Any:
    if isinstance(value, str):
        if value not in ROUTE_KINDS:
            raise Unfit("no such kind of routes", did_you_mean(value, ROUTE_KINDS))
        return value
    if not (isinstance(value, list) and len(value) >= 2):
        known = " or ".join(f'"{kind}"' for kind in ROUTE_KINDS)
        raise Unfit(f"routes are {known}, or a list of at least two way points", "Write [[1, 1], [4, 1]].")
    for number, point in enumerate(value):
        with within(number):
            check_point(point)
    return value


def as_list(value: Any) -> Any:
    """Return a list of tables where one alone is written as itself."""
    return [value] if isinstance(value, dict) else value


class TilingTable(Table):
    """``tiling``: floor tiles, for tile numbers and snapping; no default, a floor may have none."""

    size: Length
    origin: Point = [0, 0]
    angle: Angle = "0 deg"


class ZoneTable(Table):
    """``[[site.zone]]``: a part of the floor with a demand or a rule of its own."""

    name: Name
    region: Ring
    target_error: Target | None = None
    tags: bool = True
    metal: bool = False
    drill: bool = True


class LayersTable(Table):
    """``layers``: what the layers of a drawing show; layers that are not named are left out, which is told."""

    walls: Annotated[list[Title], Field(min_length=1)]
    doors: list[Title] = []
    obstacles: list[Title] = []
    no_tags: list[Title] = []
    metal: list[Title] = []


class ScaleTable(Table):
    """``scale``: two points of an image, in pixels to the right of and below its upper left corner."""

    first: Pixel
    second: Pixel
    distance: Length


class PlanTable(Table):
    """``[site.plan]``: the name of a plan file, and what its reader has to be told.

    A key that is not given leaves the reader its own default; one that it does not know is refused.
    """

    file: Annotated[str, Field(min_length=1)]
    units: Literal["m", "mm", "cm", "in", "ft"] | None = None
    layers: LayersTable | None = None
    gap: Distance | None = None
    thickest_wall: Length | None = None
    line_wall: Length | None = None
    smallest_room: Area | None = None
    tolerance: Distance | None = None
    scale: ScaleTable | None = None
    threshold: Share | None = None
    border: Literal["outside", "floor"] | None = None
    repair: bool | None = None
    accept_recovered: bool | None = None


def _plan(value: Any) -> Any:
    return {"file": value} if isinstance(value, str) else value


class SiteTable(Table):
    """``[site]``: ``plan``, a floor plan file or a table of it, or ``floor`` with ``obstacles``.

    ``floor`` is a ring of points; a floor with holes is a list of rings, outline first; a floor in several
    parts is a list of such lists. ``source`` says in frozen copies where the floor came from.
    """

    name: Title = "site"
    plan: Annotated[PlanTable | None, BeforeValidator(_plan)] = None
    floor: FloorShape | None = None
    obstacles: list[Ring] = Field(default=[], max_length=10_000)
    source: Title | None = None
    tiling: TilingTable | None = None
    zone: list[ZoneTable] = Field(default=[], max_length=1_000)


class OdometryTable(Table):
    """``odometry``: standard deviations after 1 m of way and after 1 s of time.

    The variances grow with way and time, whatever the step, and add up.
    """

    translation: Share = "2 %"
    rotation: TurnPerWay = "1 deg/m"
    lateral: Share = "0.5 %"
    half_track: Distance = "0.2 m"
    translation_after_1s: Distance = "0 mm"
    rotation_after_1s: SmallAngle = "0 deg"


class GyroTable(Table):
    """``gyro``: standard deviation of its angle after 1 s, and of its bias; ``fitted`` if the robot uses it."""

    random_walk_after_1s: SmallAngle = "0.005 deg"
    bias: Drift = "0.1 deg/s"
    fitted: bool = False


class RobotsTable(Table):
    """``[robots]``: the fleet; the floor is paid once, readers once for each robot."""

    count: Count = 1
    drive: Literal["differential", "omnidirectional"] = "differential"
    outline: Ring = [
        ["-0.3 m", "-0.25 m"],
        ["0.3 m", "-0.25 m"],
        ["0.3 m", "0.25 m"],
        ["-0.3 m", "0.25 m"],
    ]
    speed: Speed = "0.3 m/s"
    turn_rate: TurnRate = "45 deg/s"
    odometry: OdometryTable = OdometryTable()
    gyro: GyroTable = GyroTable()
    routes: Annotated[Any, AfterValidator(_routes)] = "patrol"
    pause: Time = "0 s"
    heading: Angle | None = None


class ProfileTable(Table):
    """``reader_profile`` as a table: how a reader of one's own scans; `layoutopt.readers.profiles` explains.

    ``scan_period``, by default 50 ms, or a ``protocol`` from which it follows with the tags that a scan must have
    room for (four, of a reader of one tag a scan one) and what the host adds (10 ms).
    """

    name: Name = "own"
    scan_period: Duration | None = None
    protocol: Literal["iso15693"] | None = None
    tags_in_view: Annotated[int, Field(ge=1, le=SLOTS)] | None = None
    host_time: Time | None = None
    tags_per_scan: Literal["one", "several"] = "several"
    spacing_sides: Sides = 1.1
    simultaneous_spacing_sides: Sides = 4.0

    @model_validator(mode="after")
    def _one_source_of_the_period(self) -> "ProfileTable":
        """Refuse a period that is stated and follows from a protocol too, and what only a protocol needs."""
        if self.protocol is not None and self.scan_period is not None:
            raise Unfit("the period follows from the protocol", "Keep scan_period or protocol.", ("scan_period",))
        for key in ("tags_in_view", "host_time"):
            if self.protocol is None and getattr(self, key) is not None:
                raise Unfit(f"without a protocol {key} says nothing", 'Write protocol = "iso15693".', (key,))
        if self.tags_per_scan == "one" and self.tags_in_view not in (None, 1):
            raise Unfit(
                "a reader of one tag a scan reads none where several are in view",
                'Write tags_in_view = 1, or tags_per_scan = "several".',
                ("tags_in_view",),
            )
        return self


def profile_named(value: Any) -> Any:
    """Return the table of a profile given by name: a frozen copy must not change when that profile does."""
    if not isinstance(value, str):
        return value
    if value not in PROFILES:
        raise Unfit("no such reader profile", did_you_mean(value, PROFILES))
    profile = PROFILES[value]
    return ProfileTable(
        name=profile.name,
        scan_period=f"{profile.scan_period_s * 1000:g} ms",
        tags_per_scan="one" if profile.tags_per_scan == "one" else "several",
        spacing_sides=profile.spacing_sides,
        simultaneous_spacing_sides=profile.simultaneous_spacing_sides,
    )


class PriceTable(Table):
    """``[parts.price_list.items.NAME]``: one item of a price list within a frozen copy."""

    description: str
    price: Price
    unit: str
    source: str
    date: str
    labour: Time = "0 s"
    spare: Share = "0 %"
    size: list[Length] | None = Field(default=None, min_length=2, max_length=2)
    base_side: Length | None = None


class PriceListTable(Table):
    """``[parts.price_list]``: the whole price list, so that a frozen copy needs no other file."""

    name: str
    date: str
    currency: Literal["EUR"] = "EUR"
    items: dict[str, PriceTable]


class PartsTable(Table):
    """``[parts]``: ``prices`` is a list that comes with layoutopt or the name of a file."""

    prices: Annotated[str, Field(min_length=1)] | None = None
    price_list: PriceListTable | None = None
    tag: str = "label"
    reader: str = "reader_module"
    reader_profile: Annotated[ProfileTable, BeforeValidator(profile_named)] = profile_named("commercial")


class SpaceTable(Table):
    """``[space]``: the layouts to choose from; without ``readers``, rings that fit under the robot.

    A value may be one, a list, ``{ from, to, steps }``, or ``{ from, to }`` for all in between, of which studies
    that enumerate take five levels; `layoutopt.spec.options` reads them, because the parameters of families are
    known to their functions only.
    """

    antenna: Any = "sphere"
    antenna_side: Any = ["40 mm", "60 mm", "80 mm"]
    antenna_height: Any = "20 mm"
    antennas_per_module: Any = [1, 4]
    readers: Annotated[list[dict[str, Any]], Field(max_length=1_000)] | None = None
    patterns: Annotated[list[dict[str, Any]], Field(max_length=1_000)] = [
        {"family": "square", "pitch": {"from": "60 mm", "to": "300 mm", "steps": 9}},
    ]
    origin: Point = [0, 0]
    placement_sigma: Distance = "0 mm"


class GoalTable(Table):
    """``[goal]``: what to minimise and what is demanded; ``target_error`` means ``position_error_mean``."""

    minimise: list[str] = ["cost", "position_error_mean"]
    limits: list[str] = []
    target_error: Target | None = None
    budget: Budget | None = None


class StartTable(Table):
    """``start_uncertainty``: standard deviations of the start that an estimator is told."""

    position: Distance = "50 mm"
    heading: SmallAngle = "3 deg"


class StartOffsetTable(Table):
    """``start_offset``: by how much the start is off that estimators are told, beyond what they expect."""

    x: SignedLength = "0 mm"
    y: SignedLength = "0 mm"
    heading: Angle = "0 deg"


class FaultsTable(Table):
    """``[study.design_faults]``: what goes wrong in the trials of the search."""

    tag_placement_sigma: Distance = "0 mm"
    tag_offset: Point = [0, 0]
    dead_tag_share: Share = "0 %"
    missed_read_share: Share = "2 %"
    wrong_identity_share: Share = "0 %"
    antenna_height_error: SignedLength = "0 mm"
    read_edge: Distance = "0 mm"
    clock_error: Time = "0 ms"
    slips_per_m: PerMetre = 0.0
    slip_sigma: Distance = "0 mm"
    asynchronous: bool = False
    start_offset: StartOffsetTable = StartOffsetTable()
    kidnapped_at: Time | None = None


class HeldOutFaultsTable(FaultsTable):
    """``[study.held_out_faults]``: what goes wrong in the second of the held-out scenarios."""

    tag_placement_sigma: Distance = "3 mm"
    dead_tag_share: Share = "1 %"
    read_edge: Distance = "2 mm"


class ToleranceTable(Table):
    """``[study.tolerance]``: ranges, lowest and highest value, in which the installation may turn out.

    Everything else goes wrong as in ``design_faults``. ``quantile`` counts only where ``combine`` asks for one.
    """

    placement: Annotated[list[Distance], Field(min_length=2, max_length=2)] = ["0 mm", "5 mm"]
    dead_tags: Annotated[list[Share], Field(min_length=2, max_length=2)] = ["0 %", "5 %"]
    missed_reads: Annotated[list[Share], Field(min_length=2, max_length=2)] = ["2 %", "10 %"]
    antenna_height: Annotated[list[SignedLength], Field(min_length=2, max_length=2)] = ["0 mm", "0 mm"]
    combine: Literal["worst", "quantile"] = "worst"
    quantile: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.9


class StudyTable(Table):
    """``[study]``: effort and trials; the first of ``validate_with`` is the estimator of the search."""

    search_trials: Trials = 4000
    validate_with: list[str] = list(DEFAULT_ESTIMATORS)
    validation_trials: Annotated[int, Field(ge=2, le=1_000_000)] = 200
    alternatives: Annotated[int, Field(ge=0, le=20)] = 3
    least_difference: Share = "20 %"
    alternative_tolerance: Share = "20 %"
    step: Annotated[Any, AfterValidator(quantity("time", least=1e-4, most=10.0))] = "50 ms"
    duration: Duration = "60 s"
    start_known: bool = True
    start_uncertainty: StartTable = StartTable()
    particles: Annotated[int, Field(ge=1, le=1_000_000)] | None = None
    design_faults: FaultsTable = FaultsTable()
    held_out_faults: HeldOutFaultsTable = HeldOutFaultsTable()
    tolerance: ToleranceTable = ToleranceTable()


class DemandTable(Table):
    """``demand``: what robots must see; ``without`` is by default every zone in which no tag may lie."""

    zone: str = ""
    length: Distance = "1 m"
    tags: Count = 1
    along: Literal["everywhere", "routes"] = "routes"
    without: list[str] | None = None


def _slots(value: Any) -> Any:
    if isinstance(value, str):
        if value not in SLOT_KINDS:
            raise Unfit("no such kind of slots", did_you_mean(value, SLOT_KINDS))
        return value
    if not (isinstance(value, list) and value):
        known = ", ".join(f'"{kind}"' for kind in SLOT_KINDS)
        raise Unfit(f"slots are {known}, or a list of points", "Write [[1, 1], [1.2, 1]].")
    for number, point in enumerate(value):
        with within(number):
            check_point(point)
    return value


class PlacementTable(Table):
    """``[placement]``: where single tags may lie and what robots must see of them, for `tag_placement`."""

    slots: Annotated[Any, AfterValidator(_slots)] = "grid"
    pitch: Length = "47 mm"
    demand: Annotated[list[DemandTable], Field(min_length=1, max_length=100), BeforeValidator(as_list)] = [
        DemandTable()
    ]
    spacing: Distance = "0 mm"
    tags_per_tile: Count | None = None
    installed: Annotated[list[Point], Field(max_length=1_000_000)] = []
    forbidden: Annotated[list[Point], Field(max_length=1_000_000)] = []
    required: Annotated[list[Point], Field(max_length=1_000_000)] = []
    unserved: Share = "1 %"
    aim: Literal["cost", "coverage", "gap", "front"] = "cost"
    budget: Budget | None = None
    stages: Annotated[list[list[str]], Field(max_length=100)] = []
    reader: Count | None = None
