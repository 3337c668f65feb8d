"""The layouts to choose from: families of readers and patterns with the values of their parameters."""

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from layoutopt.layout import FloorTags, Layout, ReaderGroup, TagPattern, ZonePattern

Option = TypeVar("Option", ReaderGroup, TagPattern)


@dataclass(frozen=True, slots=True, kw_only=True)
class Family(Generic[Option]):
    """A function of the pattern or reader table, with the values that each of its parameters may take."""

    name: str
    build: Callable[..., Option]
    values: Mapping[str, tuple[object, ...]]

    @property
    def size(self) -> int:
        """Number of options."""
        return math.prod(len(values) for values in self.values.values())

    def options(self) -> Iterator[Option]:
        """Yield every option; the last parameter varies fastest."""
        for combination in itertools.product(*self.values.values()):
            yield self.build(**dict(zip(self.values, combination, strict=True)))

    def option(self, number: int) -> Option:
        """Return the option of that number, in the order of `options`."""
        chosen: dict[str, object] = {}
        for name, values in reversed(list(self.values.items())):
            number, index = divmod(number, len(values))
            chosen[name] = values[index]
        return self.build(**chosen)


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
    """

    readers: tuple[Family[ReaderGroup], ...]
    patterns: Mapping[str, tuple[Family[TagPattern], ...]]
    tag_part: str = "label"
    tag_size_m: tuple[float, float] = (0.02, 0.01)
    placement_sigma_m: float = 0.0
    origin_m: tuple[float, float] = (0.0, 0.0)

    @property
    def axis_sizes(self) -> tuple[int, ...]:
        """Number of options on each axis: readers first, then each zone."""
        return (_count(self.readers), *(_count(families) for families in self.patterns.values()))

    @property
    def size(self) -> int:
        """Number of layouts, without building one."""
        return math.prod(self.axis_sizes)

    def layouts(self) -> Iterator[Layout]:
        """Yield every layout, in an order that depends on the spec alone."""
        groups = [group for family in self.readers for group in family.options()]
        zones = [
            [self._zone_pattern(zone, pattern) for family in families for pattern in family.options()]
            for zone, families in self.patterns.items()
        ]
        for zone_patterns in itertools.product(*zones):
            floor_tags = self._floor_tags(zone_patterns)
            for group in groups:
                yield Layout(floor_tags=floor_tags, readers=(group,))

    def decode(self, unit: Sequence[float]) -> Layout:
        """Return the layout at a point of the unit cube, one coordinate an axis; for global search.

        Raises
        ------
        ValueError
            If the number of coordinates differs from the number of axes, or one is outside [0, 1].
        """
        sizes = self.axis_sizes
        if len(unit) != len(sizes) or not all(0.0 <= value <= 1.0 for value in unit):
            raise ValueError(f"a point needs {len(sizes)} coordinates in [0, 1], got {list(unit)}")
        numbers = [min(int(value * size), size - 1) for value, size in zip(unit, sizes, strict=True)]
        zone_patterns = tuple(
            self._zone_pattern(zone, _pick(families, number))
            for (zone, families), number in zip(self.patterns.items(), numbers[1:], strict=True)
        )
        return Layout(floor_tags=self._floor_tags(zone_patterns), readers=(_pick(self.readers, numbers[0]),))

    def _zone_pattern(self, zone: str, pattern: TagPattern) -> ZonePattern:
        return ZonePattern(zone=zone, pattern=pattern, origin_m=self.origin_m)

    def _floor_tags(self, zone_patterns: tuple[ZonePattern, ...]) -> FloorTags:
        return FloorTags(
            zones=zone_patterns,
            tag_part=self.tag_part,
            tag_size_m=self.tag_size_m,
            placement_sigma_m=self.placement_sigma_m,
        )


def _count(families: Sequence[Family[Option]]) -> int:
    return sum(family.size for family in families)


def _pick(families: Sequence[Family[Option]], number: int) -> Option:
    for family in families:
        if number < family.size:
            return family.option(number)
        number -= family.size
    raise IndexError(number)
