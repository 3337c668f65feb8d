"""What gets installed: tag patterns on zones of the floor, reader groups under the robots.

A `TagPattern` is periodic and infinite; exact bounds need its period. `FloorTags` says which pattern goes on
which zone; `FloorTags.lay_on` makes the finite `TagMap` of one site, which simulation and drawings use.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum, unique
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import numpy as np

from layoutopt.geometry import lattice_points, reduced_cell
from layoutopt.identity import LATER, FloatArray, IntArray, by_content, read_only
from layoutopt.shown import Shown

if TYPE_CHECKING:
    from shapely.geometry import MultiPolygon, Polygon

    from layoutopt.protocols import AntennaModel
    from layoutopt.site import Site

Parameters = Mapping[str, float | int | str]
INSTALLED: Final = "installed"
"""The state of a tag that lies on the floor already."""
WHOLE_FLOOR: Final = ""
"""The zone name of the pattern that lies wherever no zone has its own."""
PLAIN_TAG: Final = "label"
"""The tag part of a price list that is neither drilled in nor read on metal, and that is laid unless told."""


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TagPattern:
    """Arrangement of points that repeats over the plane, or is laid once.

    Attributes
    ----------
    name
        Family in the pattern table, for example ``"square"``.
    points_m
        Tag centres, shape (k, 2), m, in the pattern frame: those of one cell, or all if laid once.
    cell_m
        Rows are the two period vectors, shape (2, 2), m; ``None`` for a pattern that is laid once.
    parameters
        What the family was called with, for labels and files.

    Raises
    ------
    ValueError
        If the cell has no area or a number is not finite.
    """

    name: str
    points_m: FloatArray
    cell_m: FloatArray | None = None
    parameters: Parameters = field(default_factory=dict)
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        """Freeze the arrays and check the cell."""
        object.__setattr__(self, "points_m", read_only(self.points_m, (-1, 2)))
        object.__setattr__(self, "parameters", _numbers(self.parameters))
        if self.cell_m is not None:
            object.__setattr__(self, "cell_m", read_only(self.cell_m, (2, 2)))
            if self.cell_area_m2 <= 0.0:
                raise ValueError("the cell of a pattern needs a positive area")

    @property
    def cell_area_m2(self) -> float:
        """Area of one cell; infinite for a pattern that is laid once."""
        return float("inf") if self.cell_m is None else float(abs(np.linalg.det(self.cell_m)))

    @property
    def density_per_m2(self) -> float:
        """Tags per square metre; zero for a pattern that is laid once."""
        return len(self.points_m) / self.cell_area_m2

    def minimum_spacing_m(self) -> float:
        """Return the smallest distance between two tags of the pattern, ``inf`` if it has only one."""
        from scipy.spatial import cKDTree

        if len(self.points_m) == 0:
            return float("inf")
        points_m = others_m = self.points_m
        if self.cell_m is not None:
            # In a sheared cell the next tag may lie many steps away; in a reduced one it is next door.
            cell_m = reduced_cell(self.cell_m)
            steps = points_m @ np.linalg.inv(cell_m)
            points_m = (steps - np.floor(steps)) @ cell_m
            shifts = np.array([(i, j) for i in range(-2, 3) for j in range(-2, 3)], dtype=np.float64) @ cell_m
            others_m = (points_m[None, :, :] + shifts[:, None, :]).reshape(-1, 2)
        # The nearest is the tag itself; two tags on one spot are a distance of zero.
        distance_m, _ = cKDTree(others_m).query(points_m, k=2)
        nearest_m = float(np.asarray(distance_m)[:, 1].min())
        return nearest_m if nearest_m > 1e-9 else 0.0

    def points_in(self, bounds_m: tuple[float, float, float, float]) -> FloatArray:
        """Return the tag centres within ``(xmin, ymin, xmax, ymax)``, shape (n, 2), sorted by y, then x."""
        return lattice_points(self.points_m, self.cell_m, bounds_m)


@dataclass(frozen=True, slots=True, kw_only=True)
class ZonePattern:
    """A pattern on one zone, with the place and turn of the pattern frame in the floor frame."""

    zone: str
    pattern: TagPattern
    origin_m: tuple[float, float] = (0.0, 0.0)
    angle_rad: float = 0.0

    def __post_init__(self) -> None:
        """Take whole numbers for what they mean, so that keys agree."""
        object.__setattr__(self, "origin_m", (float(self.origin_m[0]), float(self.origin_m[1])))
        object.__setattr__(self, "angle_rad", float(self.angle_rad))


@unique
class EditKind(Enum):
    """What an edit does to the tag that the pattern put nearest to the edit's place.

    ``ADDED`` lays a tag more, for one that the pattern put where no tag may lie.
    """

    MOVED = "moved"
    DROPPED = "dropped"
    SNAPPED = "snapped"
    LOCKED = "locked"
    ADDED = "added"


@dataclass(frozen=True, slots=True, kw_only=True)
class TagEdit:
    """A change of one tag: where the pattern puts it, and where it goes instead (nowhere if dropped).

    A tag that an edit added is named by the place where it was added.

    Raises
    ------
    ValueError
        If an edit that gives a tag another place has none.
    """

    kind: EditKind
    from_m: tuple[float, float]
    to_m: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        """Check that there is a place to go to."""
        if self.to_m is None and self.kind in (EditKind.MOVED, EditKind.SNAPPED, EditKind.ADDED):
            raise ValueError(f"a tag that is {self.kind.value} needs a place to go to, got none for {self.from_m}")


@dataclass(frozen=True, slots=True, kw_only=True)
class TagMap:
    """The concrete tags of one site, one row each, in the floor frame.

    Attributes
    ----------
    ids
        Running number from 1, shape (n,); a tag that was dropped leaves a gap, so that the others keep theirs, and
        tags that were added count on after the last of the pattern.
    xy_m
        Tag centres, shape (n, 2), m.
    tile
        Column and row of the floor tile that holds the tag, shape (n, 2); zeros if the site has no tiling.
    zone
        Index into the site's zones, -1 outside all of them, shape (n,).
    sigma_m
        Standard deviation of the installed position, shape (n,), m.
    status
        ``"planned"``, ``"moved"``, ``"snapped"``, ``"locked"`` or ``"added"``, one per tag; ``"installed"`` for
        one that lies there already and that no edit speaks of.
    uid
        Identity of each tag, ``None`` until commissioning.
    """

    ids: IntArray
    xy_m: FloatArray
    tile: IntArray
    zone: IntArray
    sigma_m: FloatArray
    status: tuple[str, ...]
    uid: tuple[str | None, ...]

    def __len__(self) -> int:
        """Return the number of tags."""
        return len(self.ids)

    def to_lay(self) -> "TagMap":
        """Return the tags that are still to be laid: all but the installed ones."""
        rows = [row for row, status in enumerate(self.status) if status != INSTALLED]
        return self if len(rows) == len(self) else self.take(np.array(rows, dtype=np.int64))

    def take(self, index: IntArray) -> "TagMap":
        """Return the tags of the given rows, shape (m,)."""
        rows = index.tolist()
        return TagMap(
            ids=self.ids[index],
            xy_m=self.xy_m[index],
            tile=self.tile[index],
            zone=self.zone[index],
            sigma_m=self.sigma_m[index],
            status=tuple(self.status[row] for row in rows),
            uid=tuple(self.uid[row] for row in rows),
        )


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class InstalledTags:
    """Tags that lie on the floor already, each with its number, and the area that they equip.

    Attributes
    ----------
    ids
        Numbers of the tags, ascending, shape (n,).
    xy_m
        Tag centres, shape (n, 2), m, in the floor frame.
    area
        Where patterns lay no tag.

    Raises
    ------
    ValueError
        If there is no tag, numbers do not rise from 1 or more, or there is not one place a number.
    """

    ids: IntArray
    xy_m: FloatArray
    area: "Polygon | MultiPolygon"
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        """Freeze the arrays and check that they fit."""
        ids = np.array(self.ids, dtype=np.int64)
        ids.setflags(write=False)
        object.__setattr__(self, "ids", ids)
        object.__setattr__(self, "xy_m", read_only(self.xy_m, (-1, 2)))
        if not len(ids) or ids[0] < 1 or (np.diff(ids) < 1).any():
            raise ValueError("the numbers of installed tags rise from 1 or more, without a repetition")
        if len(ids) != len(self.xy_m):
            raise ValueError(f"{len(ids)} numbers of installed tags but {len(self.xy_m)} places")


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FloorTags:
    """Patterns on zones, plus edits of single tags; independent of the site it is laid on.

    ``zones`` holds one entry for the whole floor (zone name ``""``) and at most one for each named zone;
    ``tag_part`` names the tag in the price list; ``installed`` holds the tags that lie there already.

    Without any pattern there are no tags on the floor.

    Raises
    ------
    ValueError
        If a zone has two patterns.
    """

    zones: tuple[ZonePattern, ...]
    edits: tuple[TagEdit, ...] = ()
    tag_part: str = PLAIN_TAG
    tag_size_m: tuple[float, float] = (0.02, 0.01)
    placement_sigma_m: float = 0.0
    installed: InstalledTags | None = field(default=None, metadata=LATER)
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        """Check that no zone has two patterns."""
        names = [zone.zone for zone in self.zones]
        if len(set(names)) != len(names):
            raise ValueError(f"floor tags take one pattern a zone, got zones {names}")

    @property
    def base(self) -> ZonePattern:
        """The pattern of the whole floor, or the first if only named zones have tags.

        Raises
        ------
        ValueError
            If there is no pattern.
        """
        if not self.zones:
            raise ValueError("there are no tags on the floor, so no pattern either")
        return next((zone for zone in self.zones if zone.zone == WHOLE_FLOOR), self.zones[0])

    def patterns(self) -> Iterator[tuple[str, TagPattern]]:
        """Yield the base pattern, if any, then that of every named zone, each after the prefix of its scores."""
        if not self.zones:
            return
        yield "", self.base.pattern
        for entry in self.zones:
            if entry.zone != WHOLE_FLOOR:
                yield f"{entry.zone}.", entry.pattern

    def lay_on(self, site: "Site") -> TagMap:
        """Return the tags of this arrangement on a site.

        A tag is laid where its centre keeps half its longer side from walls, obstacles and zones that bar its
        part. Where zones with patterns of their own overlap, the last one of the site rules. Where two patterns
        meet, it rules too: a tag of the floor's pattern, or of an earlier zone, is left out where it would lie
        nearer than a tag's longer side to one of a later zone. Tags that one pattern puts too close all stay, and
        so do those of edits: `layoutopt.feasibility` names them. Installed tags lie where they lie and keep their
        numbers; patterns stay out of their area and a tag's longer side away from them, and their tags count on
        after the last installed number. The map is made once for each pair of floor tags and site.

        Raises
        ------
        KeyError
            If a pattern names a zone that the site does not have.
        ValueError
            If an edit names a place where there is no tag, or adds one where the pattern lays one.
        """
        # Imported here because laying needs what this module defines.
        from layoutopt.laying import laid

        return laid(self, site)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReaderProfile:
    """How readers scan: what may be built, how often an antenna listens, and what it makes of several tags.

    Attributes
    ----------
    name
        ``"mi2016"`` (independent readers) or ``"commercial"`` (modules with a multiplexer).
    scan_period_s
        Time that one scan of one antenna takes.
    tags_per_scan
        ``"one"``: two tags in the field collide and none is read; ``"several"``: all are read.
    spacing_sides
        Least distance of antenna centres, in antenna sides, whatever the scan order (mechanical).
    simultaneous_spacing_sides
        The same between antennas that are on in the same slot (coupling of their fields).
    """

    name: str
    scan_period_s: float
    tags_per_scan: str
    spacing_sides: float = 1.1
    simultaneous_spacing_sides: float = 1.1
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        """Check the fields that have few legal values."""
        if self.tags_per_scan not in ("one", "several"):
            raise ValueError(f"tags_per_scan is 'one' or 'several', not {self.tags_per_scan!r}")
        if not self.scan_period_s > 0.0:
            raise ValueError("a scan takes a positive time")


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReaderGroup:
    """Antennas of one kind under one robot, with the modules that drive them.

    Attributes
    ----------
    kind
        What the readings are: ``"tag_read"`` of HF floor readers, ``"signal"`` of UHF antennas, ``"direction"`` of
        the crossed antennas by which a robot docks.
    poses
        x, y, z of each antenna centre, m, and yaw, rad, in ``base_link``; shape (n, 4).
    slots
        Turn of each antenna in its module's scan cycle, 0 to ``antennas_per_module`` - 1, shape (n,).
    name, parameters
        Reader family and what it was called with, for labels and files.
    """

    name: str
    poses: FloatArray
    antenna: "AntennaModel"
    profile: ReaderProfile
    slots: tuple[int, ...]
    antennas_per_module: int = 1
    kind: str = "tag_read"
    parameters: Parameters = field(default_factory=dict)
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        """Freeze the poses and check that antennas, slots and modules agree."""
        object.__setattr__(self, "poses", read_only(self.poses, (-1, 4)))
        object.__setattr__(self, "parameters", _numbers(self.parameters))
        if len(self.slots) != len(self.poses):
            raise ValueError(f"{len(self.poses)} antennas but {len(self.slots)} scan slots")
        if self.antennas_per_module < 1 or not all(0 <= slot < self.antennas_per_module for slot in self.slots):
            raise ValueError(f"slots {self.slots} do not fit {self.antennas_per_module} antennas a module")

    @property
    def count(self) -> int:
        """Number of antennas."""
        return len(self.poses)

    @property
    def module_count(self) -> int:
        """Number of reader modules: as many as the fullest scan slot has antennas."""
        return int(np.bincount(self.slots).max()) if self.count else 0

    @property
    def label(self) -> str:
        """Return words such as ``cross 8 × 60 mm``, ``UHF 2 at ±45°`` or ``docking``."""
        from layoutopt.labels import group_label

        return group_label(self)

    @property
    def cycle_s(self) -> float:
        """Time after which the same antenna listens again."""
        return self.antennas_per_module * self.profile.scan_period_s


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Layout(Shown):
    """One complete proposal: tags on the floor, readers on the robot, transponders at places of interest.

    ``target_tags`` is how many UHF tags are given out to people and things that robots are to find.
    """

    floor_tags: FloorTags
    readers: tuple[ReaderGroup, ...]
    transponders: tuple["Transponder", ...] = ()
    target_tags: int = field(default=0, metadata=LATER)
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        """Check that there is something to read with."""
        if not self.readers:
            raise ValueError("a layout needs at least one reader group")
        if self.target_tags < 0:
            raise ValueError(f"tags are counted from 0, got {self.target_tags}")

    def replace(self, **changes: object) -> "Layout":
        """Return a copy with some fields changed."""
        return replace(self, **changes)  # type: ignore[arg-type]

    @property
    def floor_readers(self) -> tuple[ReaderGroup, ...]:
        """The groups that read tags on the floor."""
        return self.readers_of("tag_read")

    def readers_of(self, kind: str) -> tuple[ReaderGroup, ...]:
        """Return the groups of one kind."""
        return tuple(group for group in self.readers if group.kind == kind)

    @property
    def short_key(self) -> str:
        """First ten digits of the key: the layout's name in files and tables."""
        return self.key[:10]

    @property
    def extrapolated(self) -> bool:
        """Whether the model of any antenna goes beyond the sides for which it is calibrated."""
        return any(group.antenna.extrapolated for group in self.readers)

    @property
    def label(self) -> str:
        """Return a line such as ``cross 8 × 60 mm, square 100 mm``; installed tags are counted in it."""
        from layoutopt.labels import layout_label

        return layout_label(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class Transponder:
    """A UHF or docking transponder at a fixed place on the site."""

    name: str
    position_m: tuple[float, float, float]


def _numbers(parameters: Parameters) -> Parameters:
    """Return the parameters read-only; a length of 1 is the same as one of 1.0, so that keys agree."""
    return MappingProxyType(
        {
            name: float(value) if name.endswith(("_m", "_rad")) and not isinstance(value, str) else value
            for name, value in parameters.items()
        }
    )
