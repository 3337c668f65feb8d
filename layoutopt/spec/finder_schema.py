"""The tables ``[tracking]`` and ``[docking]`` of a spec: keys, types, ranges and defaults."""

import math
from typing import Annotated, Any

from pydantic import AfterValidator, Field, model_validator

from layoutopt.spec.quantities import (
    Distance,
    Duration,
    Frequency,
    Length,
    Point,
    Share,
    SmallAngle,
    Speed,
    Unfit,
    check_point,
    in_si,
    quantity,
    within,
)
from layoutopt.spec.schema import Name, Table

_Decibels = Annotated[float, Field(ge=-200.0, le=200.0)]
_Spread = Annotated[float, Field(ge=0.0, le=100.0)]
_Number = Annotated[int, Field(ge=0, le=1_000)]
_People = Annotated[int, Field(ge=0, le=100)]
"""Each casts a shadow on every ray of every scan; a room of a hundred hides the target for good."""
_Beam = Annotated[Any, AfterValidator(quantity("angle", above=0.0, most=math.pi))]
_Turn = Annotated[Any, AfterValidator(quantity("angle", above=0.0, most=2.0 * math.pi))]
_Trials = Annotated[int, Field(ge=2, le=1_000_000)]
"""One trial alone has no standard error."""


def _points(value: Any, least: int) -> Any:
    if not (isinstance(value, list) and len(value) >= least):
        raise Unfit(f"this is a list of at least {least} points", "Write [[1, 1], [4, 1]].")
    for number, point in enumerate(value):
        with within(number):
            check_point(point)
    return value


def _walk(value: Any) -> Any:
    return _points(value, 2)


def _places(value: Any) -> Any:
    return _points(value, 0)


def _pose(value: Any) -> Any:
    if not (isinstance(value, list) and len(value) == 3):
        raise Unfit("a pose is a list of x, y and heading", 'Write [2, 1.5, "90 deg"].')
    check_point(value[:2])
    with within(2):
        quantity("angle", least=-2.0 * math.pi, most=2.0 * math.pi)(value[2])
    return value


class TrackingTable(Table):
    """``[tracking]``: UHF antennas on the robots, and the person with a UHF tag whom they track.

    ``antennas``, ``yaw`` and ``interval`` take one value, a list or a range, as in ``[space]``; the first of each
    is fitted to every layout. With ``fitted = false`` layouts carry none, and only studies of tracking read the
    table. Without ``robot_at`` and ``walk`` both are chosen by `layoutopt.spec.finder_places`. Without ``dwell``
    the reader stays on its first channel.
    """

    fitted: bool = True
    antennas: Any = 2
    yaw: Any = "45 deg"
    interval: Any = "0.4 s"
    beam: _Beam = "70 deg"
    height: Distance = "0.8 m"
    tags: Annotated[int, Field(ge=1, le=1_000_000)] = 1
    robot_at: Annotated[Any, AfterValidator(_pose)] = None
    walk: Annotated[Any, AfterValidator(_walk)] = None
    walking_speed: Speed = "0.4 m/s"
    person_radius: Length = "0.22 m"
    bystanders: _People = 0
    clutter: _Number = 12
    clutter_radius: Length = "0.15 m"
    strength_at_1m_dbm: _Decibels = -42.0
    path_exponent: Annotated[float, Field(gt=0.0, le=10.0)] = 3.0
    fading_db: _Spread = 2.0
    fading_correlation: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.6
    noise_db: _Spread = 1.0
    half_range: Length = "7 m"
    detection_width_db: Annotated[float, Field(gt=0.0, le=100.0)] = 1.0
    tag_offset_db: _Decibels = 0.0
    phase_noise: SmallAngle = "0.1 rad"
    phase_bits: Annotated[int, Field(ge=1, le=24)] = 12
    channels: Annotated[list[Frequency], Field(min_length=1, max_length=100)] = Field(default=["920 MHz"])
    dwell: Duration | None = None
    laser_noise: Distance = "10 mm"
    laser_range: Length = "20 m"
    laser_step: _Turn = "0.5 deg"
    laser_field: _Turn = "270 deg"
    estimator: Name = "uhf_laser"
    trials: _Trials = 16
    duration: Duration = "150 s"

    @model_validator(mode="after")
    def _hops_among_several(self) -> "TrackingTable":
        """Refuse channels that are never used, and hopping that has nowhere to go."""
        if len(self.channels) > 1 and self.dwell is None:
            raise Unfit(
                "a reader that never hops stays on the first channel",
                'Write dwell = "4 s", or one channel.',
                ("channels",),
            )
        if len(self.channels) == 1 and self.dwell is not None:
            raise Unfit(
                "there is only one channel to dwell on", "List more channels, or leave it out.", ("dwell",)
            )
        return self


class DockingTable(Table):
    """``[docking]``: crossed antennas on the robots, and the transponder at whose direction they dock.

    Without ``transponder`` its place is sought. With ``fitted = false`` layouts carry neither, and only studies of
    docking read the table.
    """

    fitted: bool = True
    transponder: Point | None = None
    scatterers: Annotated[Any, AfterValidator(_places)] = Field(default=[])
    random_scatterers: _Number = 0
    reflection: Share = "50 %"
    wall_reflection: Share = "0 %"
    scatterer_radius: Distance = "0.1 m"
    blocks_wave: bool = False
    frequency: Frequency = "303.2 MHz"
    clearance: Distance = "0.5 m"
    least_start: Distance = "1 m"
    noise: SmallAngle = "2 deg"
    step: Length = "0.5 m"
    stop: Length = "0.5 m"
    steps: Annotated[int, Field(ge=1, le=10_000)] = 40
    detour: bool = True
    candidate_pitch: Length = "0.5 m"
    estimator: Name = "bearing_filter"
    trials: _Trials = 200

    @model_validator(mode="after")
    def _sizes_fit(self) -> "DockingTable":
        """Refuse waves that are blocked by things without a size, and things that stand on one another."""
        radius_m = in_si(self.scatterer_radius, "length")
        if self.blocks_wave and not radius_m > 0.0:
            raise Unfit(
                "things without a radius block no wave",
                'Write scatterer_radius = "0.1 m", or blocks_wave = false.',
                ("blocks_wave",),
            )
        if self.random_scatterers and in_si(self.clearance, "length") <= radius_m:
            raise Unfit(
                "scatterers that are drawn keep a clearance beyond their own radius",
                "Give more than scatterer_radius.",
                ("clearance",),
            )
        return self
