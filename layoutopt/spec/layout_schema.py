"""The table ``[layout]``, one layout beside its spec: keys, types, ranges and defaults."""

from typing import Annotated, Any, Final, Literal

from pydantic import BeforeValidator, ConfigDict, Field

from layoutopt.spec.quantities import Angle, Distance, Length, Point, SignedLength
from layoutopt.spec.schema import Count, Name, ProfileTable, Table, as_list, profile_named

KEY_PATTERN: Final = r"^[0-9a-f]{64}$"
"""What the content key of a layout looks like."""


class LaidTagsTable(Table):
    """``[[layout.tags]]``: the pattern of a zone; the parameters of its family stand beside these keys.

    ``exact`` holds a pattern that no family rebuilds: ``name``, ``points``, ``cell`` and ``parameters``.
    """

    model_config = ConfigDict(extra="ignore")

    zone: str = ""
    origin: Point = Field(default=[0, 0])
    angle: Angle = "0 deg"
    exact: "ExactPatternTable | None" = None


class ExactPatternTable(Table):
    """``[layout.tags.exact]``: points in the pattern frame, and the two period vectors unless laid once."""

    name: Name
    points: list[Point]
    cell: list[Point] | None = Field(default=None, min_length=2, max_length=2)
    parameters: dict[str, str | int | float] = Field(default={})


class MountedProfileTable(ProfileTable):
    """``reader_profile`` of one group: UHF and docking antennas know no least spacing."""

    spacing_sides: Annotated[float, Field(ge=0.0, le=100.0)] = 1.1
    simultaneous_spacing_sides: Annotated[float, Field(ge=0.0, le=100.0)] = 4.0


class MountedReadersTable(Table):
    """``[layout.readers]``: how a group of antennas is built; its family's parameters stand beside these keys.

    ``exact`` holds a group that no family rebuilds: ``name``, ``poses``, ``slots`` and ``parameters``.
    """

    model_config = ConfigDict(extra="ignore")

    antenna: Any = "sphere"
    antenna_side: Length
    antenna_height: Distance
    antennas_per_module: Count = 1
    reader_profile: Annotated[MountedProfileTable | None, BeforeValidator(profile_named)] = None
    exact: "ExactReadersTable | None" = None


class ExactReadersTable(Table):
    """``[layout.readers.exact]``: x, y, z and yaw of each antenna in ``base_link``, m and rad, and its turn."""

    name: Name
    poses: list[Annotated[list[float], Field(min_length=4, max_length=4)]] = Field(min_length=1, max_length=10_000)
    slots: list[int]
    kind: Literal["tag_read", "signal", "direction"] = "tag_read"
    parameters: dict[str, str | int | float] = Field(default={})


class EditTable(Table):
    """``[[layout.edits]]``: one tag moved, dropped, snapped, locked or added."""

    model_config = ConfigDict(populate_by_name=True)

    kind: Literal["moved", "dropped", "snapped", "locked", "added"]
    source: Point = Field(alias="from")
    target: Point | None = Field(default=None, alias="to")


class TransponderTable(Table):
    """``[[layout.transponders]]``: a transponder at x, y and z of the floor frame."""

    name: Name
    position: list[SignedLength] = Field(min_length=3, max_length=3)


class LayoutTable(Table):
    """``[layout]``: one layout beside the spec it belongs to; ``key`` is checked if it is given.

    ``tags`` may be empty: then no tag lies on the floor. ``quick_look`` says that few drives chose the layout;
    it is no part of what the key is made of.
    """

    key: Annotated[str, Field(pattern=KEY_PATTERN)] | None = None
    quick_look: bool = False
    tag: str | None = None
    tag_size: list[Length] | None = Field(default=None, min_length=2, max_length=2)
    placement_sigma: Distance | None = None
    tags: list[dict[str, Any]]
    readers: Annotated[list[dict[str, Any]], BeforeValidator(as_list)] = Field(min_length=1)
    edits: list[EditTable] = Field(default=[])
    transponders: list[TransponderTable] = Field(default=[], max_length=1_000)
    target_tags: Annotated[int, Field(ge=0, le=1_000_000)] = 0
    installed: dict[str, Any] | None = None
