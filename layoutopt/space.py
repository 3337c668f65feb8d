"""The layouts to choose from: families of readers and patterns with the values of their parameters.

A parameter takes one of a list of values, or any number of an `Interval`; it may also be built by a `Family` of
its own, as a mount is of a side and a height. Enumeration takes evenly spaced levels of each interval, so that a
space is always finite; `DesignSpace.decode` reaches what lies between them.

A point of the unit cube has a coordinate for every choice there is. For the readers, and for the patterns of each
zone, these are the family, if there are several, and then every parameter that any of the families leaves free.
Families share the coordinate of a parameter of one name, each over its own range, so that a step from one family
to another keeps pitch or height where it was in its range; what a family does not have is not read.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Generic, TypeVar

from layoutopt.layout import FloorTags, Layout, ReaderGroup, TagPattern, Transponder, ZonePattern

Option = TypeVar("Option")

INTERVAL_LEVELS: Final = 5
"""Evenly spaced values, both ends among them, that enumeration takes of an interval."""
_DECIMALS: Final = 4
"""Of a value within an interval: a tenth of a millimetre, or of a milliradian; nobody mounts closer."""
READERS: Final = "readers"
PATTERNS: Final = "patterns"
FAMILY: Final = "family"


@dataclass(frozen=True, slots=True, kw_only=True)
class Interval:
    """A parameter that takes any number from ``low`` to ``high``, on a grid of a tenth of a thousandth.

    ``levels`` is how many evenly spaced values enumeration takes; a single one is the middle.

    Raises
    ------
    ValueError
        If the ends are not finite, the interval does not rise, or there is no level.
    """

    low: float
    high: float
    levels: int = INTERVAL_LEVELS

    def __post_init__(self) -> None:
        """Check the ends."""
        if not (math.isfinite(self.low) and math.isfinite(self.high) and self.low < self.high):
            raise ValueError(f"an interval needs finite ends that rise, got {self.low} and {self.high}")
        if self.levels < 1:
            raise ValueError(f"an interval has at least one level, got {self.levels}")

    def at(self, unit: float) -> float:
        """Return the value at a share of the way from the low end to the high one."""
        value = round(self.low + (self.high - self.low) * unit, _DECIMALS)
        return min(max(value, self.low), self.high)

    def values(self) -> tuple[float, ...]:
        """Return the levels, ascending."""
        if self.levels == 1:
            return (self.at(0.5),)
        return tuple(self.at(number / (self.levels - 1)) for number in range(self.levels))


Free = tuple[Any, ...] | Interval
"""What leaves a choice: a list of several values, or an interval."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Family(Generic[Option]):
    """A function, such as one of the pattern or reader table, with the values that its parameters may take."""

    name: str
    build: Callable[..., Option]
    values: Mapping[str, Any]

    @property
    def size(self) -> int:
        """Number of options."""
        return math.prod(size_of(values) for values in self.values.values())

    @property
    def free(self) -> dict[str, Free]:
        """Every parameter that leaves a choice, by name; those of a family within as ``mount.height_m``."""
        found: dict[str, Free] = {}
        for name, values in self.values.items():
            if isinstance(values, Family):
                found |= {f"{name}.{inner}": choice for inner, choice in values.free.items()}
            elif isinstance(values, Interval) or len(values) > 1:
                found[name] = values
        return found

    def options(self) -> Iterator[Option]:
        """Yield every option; the last parameter varies fastest."""
        for combination in itertools.product(*(values_of(values) for values in self.values.values())):
            yield self.build(**dict(zip(self.values, combination, strict=True)))

    def option(self, number: int) -> Option:
        """Return the option of that number, in the order of `options`."""
        chosen: dict[str, object] = {}
        for name, values in reversed(list(self.values.items())):
            number, index = divmod(number, size_of(values))
            chosen[name] = values.option(index) if isinstance(values, Family) else values_of(values)[index]
        return self.build(**chosen)

    def at(self, place: Mapping[str, float]) -> Option:
        """Return the option at a place: for each name of `free` a share of its range or list.

        Raises
        ------
        ValueError
            If the function makes nothing of these parameters.
        """
        chosen: dict[str, object] = {}
        for name, values in self.values.items():
            if isinstance(values, Family):
                chosen[name] = values.at({inner: place[f"{name}.{inner}"] for inner in values.free})
            elif isinstance(values, Interval):
                chosen[name] = values.at(place[name])
            else:
                chosen[name] = values[_index(place[name], len(values))] if len(values) > 1 else values[0]
        return self.build(**chosen)


Values = tuple[Any, ...] | Interval | Family[Any]
"""What a parameter may be: one of a list, any number of an interval, or an option of a family of its own."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Axis:
    """One coordinate of the unit cube over a space.

    ``part`` is ``"readers"`` or ``"patterns"``, the latter with its ``zone``; ``name`` is ``"family"`` or that of
    a parameter. It is ``continuous`` if some family has an interval there.
    """

    part: str
    zone: str
    name: str
    continuous: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignSpace:
    """All combinations of a reader group with one pattern for each zone.

    Attributes
    ----------
    readers
        Families of reader groups.
    patterns
        For each zone (``""`` is the whole floor) the families that may lie there.
    tag_part, tag_size_m
        The tag of the price list that is laid, and its size.
    origin_m
        Where the pattern frame lies in the floor frame.
    finders, transponders, target_tags
        What every layout has beside its choice of readers and patterns: groups that find things off the floor,
        transponders for docking, and how many UHF tags are given out.
    finish
        What is done to every layout once it is made, such as `layoutopt.reach.OnlyInReach`; ``None`` for nothing.
    """

    readers: tuple[Family[ReaderGroup], ...]
    patterns: Mapping[str, tuple[Family[TagPattern], ...]]
    tag_part: str = "label"
    tag_size_m: tuple[float, float] = (0.02, 0.01)
    placement_sigma_m: float = 0.0
    origin_m: tuple[float, float] = (0.0, 0.0)
    finish: Callable[[Layout], Layout] | None = None
    finders: tuple[ReaderGroup, ...] = ()
    transponders: tuple[Transponder, ...] = ()
    target_tags: int = 0

    @property
    def axis_sizes(self) -> tuple[int, ...]:
        """Number of enumerated options: of the readers first, then of each zone."""
        return (_count(self.readers), *(_count(families) for families in self.patterns.values()))

    @property
    def size(self) -> int:
        """Number of enumerated layouts, without building one."""
        return math.prod(self.axis_sizes)

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The coordinates of a point of the unit cube, in their order."""
        found = _axes(READERS, "", self.readers)
        for zone, families in self.patterns.items():
            found += _axes(PATTERNS, zone, families)
        return tuple(found)

    def layouts(self) -> Iterator[Layout]:
        """Yield every enumerated layout, in an order that depends on the spec alone."""
        groups = [group for family in self.readers for group in family.options()]
        zones = [
            [self._zone_pattern(zone, pattern) for family in families for pattern in family.options()]
            for zone, families in self.patterns.items()
        ]
        for zone_patterns in itertools.product(*zones):
            floor_tags = self._floor_tags(zone_patterns)
            for group in groups:
                yield self.layout(floor_tags, group)

    def decode(self, unit: Sequence[float]) -> Layout:
        """Return the layout at a point of the unit cube, one coordinate for each of `axes`.

        Raises
        ------
        ValueError
            If the number of coordinates differs from the number of axes, or one is outside [0, 1]; or if a family
            makes nothing of the parameters there.
        """
        axes = self.axes
        if len(unit) != len(axes) or not all(0.0 <= value <= 1.0 for value in unit):
            raise ValueError(f"a point needs {len(axes)} coordinates in [0, 1], got {list(unit)}")
        places: dict[tuple[str, str], dict[str, float]] = {}
        for axis, value in zip(axes, unit, strict=True):
            places.setdefault((axis.part, axis.zone), {})[axis.name] = float(value)
        zone_patterns = tuple(
            self._zone_pattern(zone, _decoded(families, places.get((PATTERNS, zone), {})))
            for zone, families in self.patterns.items()
        )
        group = _decoded(self.readers, places.get((READERS, ""), {}))
        return self.layout(self._floor_tags(zone_patterns), group)

    def layout(self, floor_tags: FloorTags, group: ReaderGroup) -> Layout:
        """Return the finished layout of floor tags with a reader group."""
        layout = self.equipped(floor_tags, group)
        return layout if self.finish is None else self.finish(layout)

    def equipped(self, floor_tags: FloorTags, group: ReaderGroup) -> Layout:
        """Return floor tags with a reader group and all that finds things off the floor, as it is."""
        return self.with_finders(Layout(floor_tags=floor_tags, readers=(group,)))

    def with_finders(self, layout: Layout) -> Layout:
        """Return a layout of the floor alone with what every layout of the space has beside it."""
        return replace(
            layout,
            readers=(*layout.readers, *self.finders),
            transponders=self.transponders,
            target_tags=self.target_tags,
        )

    def _zone_pattern(self, zone: str, pattern: TagPattern) -> ZonePattern:
        return ZonePattern(zone=zone, pattern=pattern, origin_m=self.origin_m)

    def _floor_tags(self, zone_patterns: tuple[ZonePattern, ...]) -> FloorTags:
        return FloorTags(
            zones=zone_patterns,
            tag_part=self.tag_part,
            tag_size_m=self.tag_size_m,
            placement_sigma_m=self.placement_sigma_m,
        )


def size_of(values: Values) -> int:
    """Return how many values of a parameter are enumerated."""
    if isinstance(values, Interval):
        return values.levels
    return values.size if isinstance(values, Family) else len(values)


def values_of(values: Values) -> tuple[Any, ...]:
    """Return the values of a parameter that are enumerated."""
    if isinstance(values, Interval):
        return values.values()
    return tuple(values.options()) if isinstance(values, Family) else values


def _axes(part: str, zone: str, families: Sequence[Family[Any]]) -> list[Axis]:
    names: dict[str, bool] = {}
    for family in families:
        for name, values in family.free.items():
            names[name] = names.get(name, False) or isinstance(values, Interval)
    choice = [Axis(part=part, zone=zone, name=FAMILY, continuous=False)] if len(families) > 1 else []
    return choice + [Axis(part=part, zone=zone, name=name, continuous=free) for name, free in names.items()]


def _decoded(families: Sequence[Family[Option]], place: Mapping[str, float]) -> Option:
    return families[_index(place.get(FAMILY, 0.0), len(families))].at(place)


def _index(unit: float, count: int) -> int:
    return min(int(unit * count), count - 1)


def _count(families: Sequence[Family[Any]]) -> int:
    return sum(family.size for family in families)
