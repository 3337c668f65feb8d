"""A floor that grows: what is installed stays, with its numbers, and the layouts of the new area go around it."""

import functools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, TypeVar

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from layoutopt.errors import Fault, InvalidInput
from layoutopt.identity import FloatArray
from layoutopt.layout import WHOLE_FLOOR, InstalledTags, Layout, ReaderGroup, TagMap, Transponder, ZonePattern
from layoutopt.space import DesignSpace, Family
from layoutopt.spec.building import Spec
from layoutopt.tables.tag_files import read_tag_file
from layoutopt.tables.tags import TagRow
from layoutopt.units import format_length

FLOOR_TOLERANCE_M: Final = 0.02
"""Two plans of one wall differ by as much; the strip between them is no new floor."""
TAG_TOLERANCE_M: Final = 0.001
"""A tag map and a layout file of one floor state places to micrometres; survey and layout must not be mixed up."""
MOST_INSTALLED: Final = 75_000
"""A layout file lists installed tags one by one, at up to 60 bytes each, and is read up to 5 MB."""
_LEAST_AREA_M2: Final = 0.01
"""Less new floor than a tile is none."""
_MOST_NAMED: Final = 20
_SAME_PLAN: Final = "Both plans need the same origin and direction, and the new one holds the whole old floor."
_AS_BUILT: Final = "Give the tags.csv that stands beside the layout file, as layoutopt commission wrote both."
_Option = TypeVar("_Option")


@dataclass(frozen=True, slots=True, kw_only=True)
class Expansion:
    """An installed floor within a larger plan.

    Attributes
    ----------
    installed
        The tags as they lie, and the open floor of the old plan.
    readers
        What the robots carry.
    equipped_count
        How many robots carry it.
    continued
        The installed pattern, where it can go on beyond the old floor; ``None`` for tags that follow no period.
    transponders, target_tags
        Transponders that stand, and UHF tags that are given out.
    """

    installed: InstalledTags
    readers: tuple[ReaderGroup, ...]
    equipped_count: int
    continued: ZonePattern | None
    transponders: tuple[Transponder, ...] = ()
    target_tags: int = 0

    def extended(self, layout: Layout) -> Layout:
        """Return a layout of the new area with the installed tags, under the robots' readers if it has these.

        The whole floor's pattern goes on from the installed one, in place and turn, if it is the same pattern.
        """
        zones = layout.floor_tags.zones
        if (old := self.continued) is not None:
            zones = tuple(
                replace(entry, origin_m=old.origin_m, angle_rad=old.angle_rad)
                if entry.zone == WHOLE_FLOOR and entry.pattern.key == old.pattern.key
                else entry
                for entry in zones
            )
        readers = layout.readers
        if layout.floor_readers == _floor(self.readers)[:1]:
            # What the robots have of UHF and docking stays; a kind that only the new plan asks for is added.
            kinds = {group.kind for group in self.readers}
            readers = (*self.readers, *(group for group in layout.readers if group.kind not in kinds))
        floor_tags = replace(layout.floor_tags, zones=zones, installed=self.installed)
        more = tuple(item for item in layout.transponders if item not in self.transponders)
        return replace(
            layout,
            floor_tags=floor_tags,
            readers=readers,
            transponders=(*self.transponders, *more),
            target_tags=max(self.target_tags, layout.target_tags),
        )


def expansion_of(old: Spec, layout: Layout, new: Spec) -> Expansion:
    """Return what is kept of an installed floor in a new plan.

    Parameters
    ----------
    old, layout
        The installed floor, as its layout file holds it.
    new
        The spec of the larger floor.

    Raises
    ------
    InvalidInput
        With everything that does not fit: another tag or reader part, an old floor that the new plan does not
        hold, installed tags where the new plan lets none lie, a plan that adds no floor, or more tags than a
        layout file holds.
    """
    tags = layout.floor_tags.lay_on(old.site)
    faults = [*_other_parts(old, layout, new), *_beyond(old.site.floor, new.site.floor)]
    if not len(tags):
        repair = "Plan the new floor with layoutopt solve."
        faults.append(Fault(place="installed layout", problem="no tag is installed", repair=repair))
    if len(tags) > MOST_INSTALLED:
        problem = f"{len(tags)} tags are installed, and a layout file lists {MOST_INSTALLED} at most"
        repair = "Expand one part of the building, with a plan of that part."
        faults.append(Fault(place="installed layout", problem=problem, repair=repair))
    if not layout.floor_readers:
        repair = "Plan the new floor with layoutopt solve."
        faults.append(Fault(place="installed layout", problem="no antenna reads the floor", repair=repair))
    if not faults:
        faults += _barred(tags, new)
    # The strip along an old wall is as wide as two plans of it differ.
    area = old.site.open_floor.buffer(FLOOR_TOLERANCE_M, join_style="mitre")
    if not faults and new.site.open_floor.difference(area).area < _LEAST_AREA_M2:
        repair = "Draw the new area into the plan, in the frame of the old one."
        faults.append(
            Fault(place="site.floor", problem="the plan adds no floor to the installed one", repair=repair)
        )
    if faults:
        raise InvalidInput(faults)
    base = layout.floor_tags.base
    return Expansion(
        installed=InstalledTags(ids=tags.ids, xy_m=tags.xy_m, area=area),
        readers=layout.readers,
        equipped_count=min(old.robot_count, new.robot_count),
        continued=None if base.pattern.cell_m is None else base,
        transponders=layout.transponders,
        target_tags=layout.target_tags,
    )


def expanded_space(expansion: Expansion, new: Spec, *, new_readers: bool) -> DesignSpace:
    """Return the layouts of the new area: each pattern of the plan, and the installed one carried on.

    Readers are those of the robots; with ``new_readers`` those of the plan compete. Patterns of zones that are
    equipped already are left out.

    Raises
    ------
    InvalidInput
        If no pattern is left.
    ValueError
        If the space of the plan does something to its layouts already.
    """
    space, site, area = new.space, new.site, expansion.installed.area
    if space.finish is not None:
        raise ValueError("the installed floor is added by the finish of a space, and this one has a finish")
    patterns = {
        zone: families
        for zone, families in space.patterns.items()
        if zone == WHOLE_FLOOR or site.zone(zone).region.difference(area).area >= _LEAST_AREA_M2
    }
    if not patterns:
        problem = "every pattern is for a zone that is equipped already"
        raise InvalidInput.at("space.patterns", problem, "List patterns for the new area.")
    old = expansion.continued
    if old is not None and WHOLE_FLOOR in patterns:
        known = {pattern.key for family in patterns[WHOLE_FLOOR] for pattern in family.options()}
        if old.pattern.key not in known:
            patterns[WHOLE_FLOOR] = (*patterns[WHOLE_FLOOR], _only(old.pattern.name, old.pattern))
    carried = _floor(expansion.readers)[0]
    readers = (_only(carried.name, carried), *(space.readers if new_readers else ()))
    return replace(space, readers=readers, patterns=patterns, finish=expansion.extended)


def equipped_parts(expansion: Expansion) -> tuple[Polygon, ...]:
    """Return the connected parts of the area that is equipped already, the largest first."""
    area = expansion.installed.area
    parts = list(area.geoms) if isinstance(area, MultiPolygon) else [area]
    return tuple(sorted(parts, key=lambda part: -part.area))


def recorded_tags(path: Path, installed: InstalledTags) -> dict[int, TagRow]:
    """Return the rows of a tag map for the installed tags, by number.

    Raises
    ------
    InvalidInput
        If the file cannot be read, or it is not of this floor: it lacks an installed tag, has one that the layout
        does not have and that is not missing, or tells another place.
    """
    rows = {row.tag_id: row for row in read_tag_file(path) if row.install_status != "missing"}
    faults = []
    for tag_id, (x_m, y_m) in zip(installed.ids.tolist(), installed.xy_m.tolist(), strict=True):
        row = rows.get(tag_id)
        if row is None:
            faults.append(f"installed tag {tag_id} is not in it")
        elif (off_m := float(np.hypot(row.x_m - x_m, row.y_m - y_m))) > TAG_TOLERANCE_M:
            faults.append(f"tag {tag_id} lies {format_length(off_m)} from its place in the layout")
    known = set(installed.ids.tolist())
    faults += [f"the layout has no tag {tag_id}" for tag_id in rows if tag_id not in known]
    if faults:
        raise InvalidInput(
            [Fault(place=str(path), problem=problem, repair=_AS_BUILT) for problem in faults[:_MOST_NAMED]]
        )
    return rows


def with_records(tags: TagMap, rows: Mapping[int, TagRow]) -> tuple[TagMap, FloatArray]:
    """Return a tag map with identities and deviations as recorded, and the surveyed places, shape (n, 2), m.

    Places that were not surveyed are NaN.
    """
    uid, sigma_m = list(tags.uid), tags.sigma_m.copy()
    surveyed_m = np.full((len(tags), 2), np.nan)
    for number, tag_id in enumerate(tags.ids.tolist()):
        if (row := rows.get(tag_id)) is not None:
            uid[number], sigma_m[number] = row.uid, row.sigma_m
            if row.surveyed_x_m is not None and row.surveyed_y_m is not None:
                surveyed_m[number] = row.surveyed_x_m, row.surveyed_y_m
    return replace(tags, uid=tuple(uid), sigma_m=sigma_m), surveyed_m


def _other_parts(old: Spec, layout: Layout, new: Spec) -> Iterator[Fault]:
    tags, space = layout.floor_tags, new.space
    if tags.tag_part != space.tag_part:
        problem = f"'{tags.tag_part}' tags are installed, and the plan lays '{space.tag_part}'"
        repair = "Robots read one kind of tag: write the installed one."
        yield Fault(place="parts.tag", problem=problem, repair=repair)
    elif tags.tag_size_m != space.tag_size_m:
        sizes = [
            " × ".join(format_length(side_m) for side_m in size) for size in (tags.tag_size_m, space.tag_size_m)
        ]
        problem = f"tags of {sizes[0]} are installed, and those of the price list have {sizes[1]}"
        yield Fault(place="parts.prices", problem=problem, repair="Give the size of the installed tags.")
    if old.reader_part != new.reader_part:
        problem = f"the robots carry '{old.reader_part}' readers, and the plan has '{new.reader_part}'"
        yield Fault(place="parts.reader", problem=problem, repair="Write the readers that the robots carry.")


def _beyond(old: BaseGeometry, new: BaseGeometry) -> Iterator[Fault]:
    """Tell where the old floor reaches beyond the new one."""
    beyond = old.difference(new.buffer(FLOOR_TOLERANCE_M, join_style="mitre"))
    if beyond.is_empty:
        return
    corners_m = shapely.get_coordinates(beyond)
    away_m = shapely.distance(shapely.points(corners_m), new)
    x_m, y_m = corners_m[int(np.argmax(away_m))].tolist()
    problem = (
        f"the installed floor reaches {format_length(float(away_m.max()))} beyond the plan near "
        f"({x_m:.3f}, {y_m:.3f}) m"
    )
    yield Fault(place="site.floor", problem=problem, repair=_SAME_PLAN)


def _barred(tags: TagMap, new: Spec) -> list[Fault]:
    """Tell which installed tags lie where the new plan lets none lie, and not just by the difference of plans."""
    part = new.space.tag_part
    away_m = shapely.distance(shapely.points(tags.xy_m), new.site.taggable_region(tag_part=part))
    wrong = tags.take(np.flatnonzero(away_m > FLOOR_TOLERANCE_M))
    reasons = new.site.why_barred(wrong.xy_m, 0.0, part)
    found = [
        f"installed tag {tag_id} at ({x_m:.3f}, {y_m:.3f}) m lies where the plan lets none lie: {why}"
        for tag_id, (x_m, y_m), why in zip(wrong.ids.tolist(), wrong.xy_m.tolist(), reasons, strict=True)
    ]
    more = [f"{len(found) - _MOST_NAMED} more installed tags lie so"] if len(found) > _MOST_NAMED else []
    repair = 'Correct the plan, or take the tag out of the layout file: an edit of the kind "dropped".'
    return [Fault(place="site", problem=text, repair=repair) for text in (*found[:_MOST_NAMED], *more)]


def _only(name: str, option: _Option) -> Family[_Option]:
    return Family(name=name, build=functools.partial(_same, option), values={})


def _same(option: _Option) -> _Option:
    return option


def _floor(readers: tuple[ReaderGroup, ...]) -> tuple[ReaderGroup, ...]:
    """Return the groups that read tags on the floor."""
    return tuple(group for group in readers if group.kind == "tag_read")
