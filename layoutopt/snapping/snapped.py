"""Snapping the tags of a floor to marks: each is kept, snapped, moved, added or dropped by a rule, and told."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import Enum, unique
from typing import Final

import numpy as np

from layoutopt.errors import InvalidInput
from layoutopt.geometry import covers
from layoutopt.identity import BoolArray, FloatArray
from layoutopt.laying import EDIT_M, left_out, named_places
from layoutopt.layout import INSTALLED, WHOLE_FLOOR, EditKind, FloorTags, TagEdit, TagMap
from layoutopt.site import Site
from layoutopt.snapping.cut_tiles import CutTile, cut_tiles
from layoutopt.snapping.marks import Marks
from layoutopt.units import format_length

DEFAULT_REACH_M: Final = 0.1
"""How far a tag may go from where the pattern puts it, to a free mark."""
_SAME_M: Final = 1e-9
_LEAST_M: Final = 1e-6
"""Tags of no size are apart if they are that far apart."""
_BUCKETS: Final = 4.0
"""Buckets on the way of the longest reach: few to visit, each with few tags."""
_MOST_PITCHES: Final = 100.0
"""A longer reach, in distances of marks, is a wrong unit, and every tag would look at 10,000 marks."""


@unique
class Fate(Enum):
    """What becomes of a tag."""

    KEPT = "kept"
    SNAPPED = "snapped"
    MOVED = "moved"
    ADDED = "added"
    DROPPED = "dropped"
    NOT_LAID = "not laid"


@dataclass(frozen=True, slots=True, kw_only=True)
class TagFate:
    """What becomes of one tag, and by which rule.

    Attributes
    ----------
    tag_id
        Its number; ``None`` for a tag of the pattern that is not laid.
    from_m, to_m
        Where it lies, or would by its pattern, and where it goes; ``None`` if it goes nowhere.
    why
        The rule in words: the marks, or what barred the tag from its place.
    """

    tag_id: int | None
    fate: Fate
    from_m: tuple[float, float]
    to_m: tuple[float, float] | None
    why: str

    @property
    def by_m(self) -> float:
        """How far the tag goes; zero for one that goes nowhere."""
        return 0.0 if self.to_m is None else float(np.hypot(*np.subtract(self.to_m, self.from_m)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapped:
    """Floor tags that were snapped to marks.

    Attributes
    ----------
    floor_tags
        The snapped tags: those given, with other edits.
    words
        What the marks are.
    fates
        Every tag of the given floor once, by number, then those of the pattern that were not laid there.
    cut_tiles
        Floor tiles that walls cut.
    """

    floor_tags: FloorTags
    words: str
    fates: tuple[TagFate, ...]
    cut_tiles: tuple[CutTile, ...]

    def of(self, *kinds: Fate) -> tuple[TagFate, ...]:
        """Return the tags with one of these fates."""
        return tuple(item for item in self.fates if item.fate in kinds)


def snapped(
    floor_tags: FloorTags, site: Site, marks: Marks, *, move: bool = False, reach_m: float = DEFAULT_REACH_M
) -> Snapped:
    """Return floor tags with every tag on a mark.

    A tag goes to the mark nearest to it. Where two tags would lie nearer to each other than a tag's longer side,
    the one that goes less far stays and the other is dropped; of two that go as far, the one with the lower
    number stays. Locked and installed tags stay where they are, whatever the marks, and come first.

    Parameters
    ----------
    move
        What becomes of a tag whose mark is barred by an obstacle, a zone or a wall: it goes to the nearest free
        mark within reach, or is dropped where there is none; if false, it is dropped. Tags of the pattern that
        were not laid because of an obstacle or a zone are added in the same way.
    reach_m
        How far such a tag may go from its place.

    Raises
    ------
    InvalidInput
        If no tag is left, or the reach is out of reason.
    """
    if reach_m > _MOST_PITCHES * marks.pitch_m:
        problem = f"{format_length(reach_m)} is over {_MOST_PITCHES:g} times the distance of the marks"
        raise InvalidInput.at("--reach", problem, f"Give {format_length(10.0 * marks.pitch_m)} or less.")
    tags, named_m = floor_tags.lay_on(site), named_places(floor_tags, site)
    rules = _Rules(floor_tags, site, marks, named_m, reach_m)
    fates = rules.first(tags)
    for row, (item, why) in enumerate(zip(fates, rules.barred, strict=True)):
        if item is None:
            fates[row] = rules.elsewhere(int(tags.ids[row]), tags.xy_m[row], why, Fate.MOVED, move=move)
    not_laid_m = left_out(floor_tags, site)
    next_id = len(named_m) + 1
    others: list[TagFate] = []
    reasons = site.why_barred(not_laid_m, rules.margin_m, floor_tags.tag_part)
    for place_m, why in zip(not_laid_m, reasons, strict=True):
        asked = move and why.removeprefix("near ").startswith(("obstacle", "zone"))
        why = why or f"nearer than {format_length(rules.least_m)} to a tag of another pattern"
        item = rules.elsewhere(next_id, place_m, why, Fate.ADDED, move=asked)
        next_id += item.fate is Fate.ADDED
        others.append(item)
    known = [item for item in fates if item is not None]
    if not any(item.to_m for item in (*known, *others)):
        if not floor_tags.zones:
            raise InvalidInput.at("layout", "no tags lie on the floor", "Name a layout with floor tags.")
        repair = "Choose other marks, or move what is barred: --obstacles move, with a longer --reach."
        raise InvalidInput.at("--to", f"no tag finds a place on {marks.words}", repair)
    return Snapped(
        floor_tags=replace(floor_tags, edits=_edits(floor_tags, tags, named_m, (*known, *others))),
        words=marks.words,
        fates=(*known, *others),
        cut_tiles=cut_tiles(site),
    )


class _Rules:
    """The rules for one floor, and the places that are taken so far."""

    def __init__(
        self, floor_tags: FloorTags, site: Site, marks: Marks, named_m: FloatArray, reach_m: float
    ) -> None:
        from scipy.spatial import cKDTree

        self.named = cKDTree(named_m[np.isfinite(named_m).all(axis=1)])
        self.site = site
        self.marks = marks
        self.reach_m = reach_m
        self.part = floor_tags.tag_part
        self.margin_m = max(floor_tags.tag_size_m) / 2.0
        self.least_m = max(*floor_tags.tag_size_m, _LEAST_M)
        self.region = site.taggable_region(WHOLE_FLOOR, self.margin_m, self.part)
        self.taken = _Taken(self.least_m, max(self.least_m, reach_m / _BUCKETS))
        self.barred: list[str] = []

    def first(self, tags: TagMap) -> list[TagFate | None]:
        """Return what becomes of each tag by its own mark; ``None`` where that is barred, which `barred` tells."""
        marks_m, why = self.marks.nearest(tags.xy_m)
        fixed = (EditKind.LOCKED.value, INSTALLED)
        locked = np.array([status in fixed for status in tags.status], dtype=np.bool_)
        away_m = np.linalg.norm(marks_m - tags.xy_m, axis=1)
        unmarked = np.array([bool(text) for text in why], dtype=np.bool_)
        stays = locked | (away_m <= _SAME_M) & ~unmarked
        marks_m[stays], away_m[stays] = tags.xy_m[stays], 0.0
        self.barred = [
            "" if stay else text for stay, text in zip(stays.tolist(), self._why_barred(marks_m), strict=True)
        ]
        fates: list[TagFate | None] = [None] * len(tags)
        # What the last bit of a sum says of two ways of one length must not decide which tag stays.
        for row in np.lexsort((tags.ids, np.round(away_m, 9), ~locked)).tolist():
            tag_id, from_m = int(tags.ids[row]), _pair(tags.xy_m[row])
            other = self.taken.nearest(marks_m[row])
            if unmarked[row] and not locked[row]:
                fates[row] = _nowhere(tag_id, from_m, why[row])
            elif self.barred[row]:
                continue
            elif other is not None and not locked[row]:
                fates[row] = _nowhere(tag_id, from_m, self._too_near(other))
            else:
                self.taken.add(marks_m[row], tag_id)
                fate, rule = (Fate.KEPT, "") if stays[row] else (Fate.SNAPPED, self.marks.words)
                fates[row] = TagFate(tag_id=tag_id, fate=fate, from_m=from_m, to_m=_pair(marks_m[row]), why=rule)
        return fates

    def elsewhere(self, tag_id: int, place_m: FloatArray, why: str, fate: Fate, *, move: bool) -> TagFate:
        """Return what becomes of a tag that may not lie where it should."""
        from_m = _pair(place_m)
        gone = _nowhere(tag_id, from_m, why) if fate is Fate.MOVED else _not_laid(from_m, why)
        if not move:
            return gone
        taken_m = self.taken.around(place_m, self.reach_m + self.least_m)
        found_m = self.marks.near(place_m, self.reach_m, taken_m, self.least_m)
        found_m = found_m[covers(self.region, found_m)]
        if fate is Fate.ADDED:
            found_m = found_m[self._unnamed(found_m)]
        away_m = np.round(np.linalg.norm(found_m - place_m, axis=1), 9)
        for row in np.lexsort((np.round(found_m[:, 0], 9), np.round(found_m[:, 1], 9), away_m)).tolist():
            if self.taken.nearest(found_m[row]) is None:
                self.taken.add(found_m[row], tag_id)
                return TagFate(tag_id=tag_id, fate=fate, from_m=from_m, to_m=_pair(found_m[row]), why=why)
        return replace(gone, why=f"{why}; no free mark within {format_length(self.reach_m)}")

    def _unnamed(self, marks_m: FloatArray) -> BoolArray:
        """Return the marks by which no edit names a tag: one that was dropped or moved away stays the only one."""
        distance_m, _ = self.named.query(marks_m, distance_upper_bound=2.0 * EDIT_M)
        return np.asarray(np.isinf(distance_m))

    def _why_barred(self, marks_m: FloatArray) -> tuple[str, ...]:
        reasons = self.site.why_barred(marks_m, self.margin_m, self.part)
        return tuple(f"its mark is {_where(why)}" if why else "" for why in reasons)

    def _too_near(self, other: int) -> str:
        return f"its mark is nearer than {format_length(self.least_m)} to tag {other}"


class _Taken:
    """Places of tags in square buckets, at least as wide as the least distance, so that few are looked at."""

    def __init__(self, least_m: float, bucket_m: float) -> None:
        self.least_m = least_m
        self.bucket_m = bucket_m
        self.buckets: dict[tuple[int, int], list[tuple[float, float, int]]] = {}

    def add(self, place_m: FloatArray, tag_id: int) -> None:
        """Take a place."""
        x_m, y_m = place_m.tolist()
        self.buckets.setdefault(self._bucket(x_m, y_m), []).append((x_m, y_m, tag_id))

    def nearest(self, place_m: FloatArray) -> int | None:
        """Return the number of the nearest tag that is too near to a place; ``None`` if it is free."""
        x_m, y_m = place_m.tolist()
        near = [
            (math.hypot(other_x_m - x_m, other_y_m - y_m), tag_id)
            for other_x_m, other_y_m, tag_id in self._within(x_m, y_m, 1)
        ]
        away_m, tag_id = min(near, default=(math.inf, 0))
        return tag_id if away_m < self.least_m - _SAME_M else None

    def around(self, place_m: FloatArray, radius_m: float) -> FloatArray:
        """Return the places in all buckets within a radius, shape (n, 2)."""
        x_m, y_m = place_m.tolist()
        found = self._within(x_m, y_m, math.ceil(radius_m / self.bucket_m))
        return np.array([(other_x_m, other_y_m) for other_x_m, other_y_m, _ in found]).reshape(-1, 2)

    def _within(self, x_m: float, y_m: float, buckets: int) -> Iterable[tuple[float, float, int]]:
        column, row = self._bucket(x_m, y_m)
        for across in range(column - buckets, column + buckets + 1):
            for along in range(row - buckets, row + buckets + 1):
                yield from self.buckets.get((across, along), ())

    def _bucket(self, x_m: float, y_m: float) -> tuple[int, int]:
        return int(x_m // self.bucket_m), int(y_m // self.bucket_m)


def _edits(
    floor_tags: FloorTags, tags: TagMap, named_m: FloatArray, fates: Sequence[TagFate]
) -> tuple[TagEdit, ...]:
    """Return the edits that make the snapped floor: those that added tags first, then one a tag by its number."""
    edits = [edit for edit in floor_tags.edits if edit.kind is EditKind.ADDED]
    edits += [
        TagEdit(kind=EditKind.ADDED, from_m=item.from_m, to_m=item.to_m)
        for item in fates
        if item.fate is Fate.ADDED
    ]
    status = dict(zip(tags.ids.tolist(), tags.status, strict=True))
    by_id = {item.tag_id: item for item in fates if item.tag_id is not None and item.fate is not Fate.ADDED}
    for tag_id, place_m in enumerate(named_m, start=1):
        if np.isnan(place_m).any():
            continue
        named, item = _pair(place_m), by_id.get(tag_id)
        if item is None or item.to_m is None:
            edits.append(TagEdit(kind=EditKind.DROPPED, from_m=named))
        elif item.fate is not Fate.KEPT:
            edits.append(TagEdit(kind=EditKind(item.fate.value), from_m=named, to_m=item.to_m))
        elif status[tag_id] not in ("planned", EditKind.ADDED.value, INSTALLED):
            edits.append(TagEdit(kind=EditKind(status[tag_id]), from_m=named, to_m=item.to_m))
    return tuple(edits)


def _nowhere(tag_id: int, from_m: tuple[float, float], why: str) -> TagFate:
    return TagFate(tag_id=tag_id, fate=Fate.DROPPED, from_m=from_m, to_m=None, why=why)


def _not_laid(from_m: tuple[float, float], why: str) -> TagFate:
    return TagFate(tag_id=None, fate=Fate.NOT_LAID, from_m=from_m, to_m=None, why=why)


def _where(why: str) -> str:
    """Return in words where a place is that `layoutopt.site.Site.why_barred` tells about."""
    return f"in {why}" if why.startswith(("obstacle", "zone")) else why


def _pair(place_m: FloatArray) -> tuple[float, float]:
    return float(place_m[0]), float(place_m[1])
