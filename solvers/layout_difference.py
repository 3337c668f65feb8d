"""How different two layouts are, in what an installer would see: antennas and tags.

Five parts, each from 0 (no difference) to 1 (as different as it is counted), and their weighted mean:

- ``antennas``: number and places of the antennas under the robot. They are paired so that the ways between
  partners are shortest in sum, a way counts as its share of `ANTENNA_CUTOFF_M`, and an antenna without partner as
  1 (the OSPA metric of order 1: Schuhmacher, Vo and Vo, IEEE Trans. Signal Process. 56(8), 2008).
- ``antenna_side``: sides of the antennas, geometric mean; twice as large is 1.
- ``modules``: reader modules of one robot; four times as many is 1.
- ``density``: tags per square metre; four times as many is 1.
- ``arrangement``: another pattern family is 1; within a family its stretch, the angles among its parameters and
  its turn on the floor count, each modulo what its symmetry does not show.

Tags are compared zone by zone; a zone without a pattern of its own has that of the floor. Half of the part is the
difference on the floor, half the largest one of all zones and the floor.

The total is a pseudometric: never negative, zero for identical layouts, symmetric, and the triangle inequality
holds, because it holds for each part. It is no metric: layouts that differ only in what is not counted are zero
apart. Not counted are where a pattern starts, edits of single tags, the part used as a tag, seeds of random
patterns, the order of scans, antenna models of one side, and transponders.
"""

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray, content_key
from layoutopt.layout import WHOLE_FLOOR, FloorTags, Layout, TagPattern

ANTENNA_CUTOFF_M: Final = 0.2
"""An antenna this far off is another antenna; robots that carry arrays are two to three times as wide."""
WEIGHTS: Final = {
    "antennas": 0.3,
    "antenna_side": 0.1,
    "modules": 0.1,
    "density": 0.25,
    "arrangement": 0.25,
}
"""Half for what is under the robot, half for what is on the floor; where antennas sit counts for more than their
size."""
_SYMMETRY: Final = {"square": 4, "equilateral": 6}
"""Turns of a full circle by such a part leave the pattern as it is; other lattices of one tag a cell have two."""
_TILT_RAD: Final = math.pi / 4.0
"""The farthest that the tags of a tile can be tilted; beyond that they look less tilted again."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LayoutDifference:
    """The parts of a difference, each from 0 to 1."""

    antennas: float
    antenna_side: float
    modules: float
    density: float
    arrangement: float

    @property
    def total(self) -> float:
        """Weighted mean of the parts, 0 to 1."""
        return sum(weight * float(getattr(self, part)) for part, weight in WEIGHTS.items())


@dataclass(frozen=True, slots=True, kw_only=True)
class _Pattern:
    """What is compared of a pattern on a zone.

    ``size`` is the logarithm of tags a square metre, or of tags; ``shape`` its lengths in units of the first one,
    and its angles in eighths of a circle.
    """

    kind: tuple[str, ...]
    periodic: bool
    size: float
    shape: Mapping[str, float]
    turn: complex


def layout_difference(first: Layout, second: Layout) -> LayoutDifference:
    """Return how different two layouts are."""
    one, other = antenna_places_m(first), antenna_places_m(second)
    zones = {entry.zone for layout in (first, second) for entry in layout.floor_tags.zones} - {WHOLE_FLOOR}
    parts = [
        _pattern_difference(_pattern_on(first.floor_tags, zone), _pattern_on(second.floor_tags, zone))
        for zone in (WHOLE_FLOOR, *sorted(zones))
    ]
    density, arrangement = (0.5 * (part[0] + max(part)) for part in zip(*parts, strict=True))
    return LayoutDifference(
        antennas=_ospa(one, other),
        antenna_side=min(1.0, abs(_log_side(first) - _log_side(second))),
        modules=min(1.0, abs(_log_modules(first) - _log_modules(second)) / 2.0),
        density=density,
        arrangement=arrangement,
    )


def difference_matrix(layouts: Sequence[Layout]) -> FloatArray:
    """Return the total difference of every two layouts, shape (n, n).

    Layouts of a design space are combinations of a few readers with a few arrangements of tags, so the parts are
    found once for every two of those.
    """
    readers: dict[tuple[str, ...], Layout] = {}
    tags: dict[str, Layout] = {}
    for layout in layouts:
        readers.setdefault(tuple(group.key for group in layout.readers), layout)
        tags.setdefault(layout.floor_tags.key, layout)
    under = _parts_between(list(readers.values()), ("antennas", "antenna_side", "modules"))
    above = _parts_between(list(tags.values()), ("density", "arrangement"))
    reader_rows = {key: row for row, key in enumerate(readers)}
    tag_rows = {key: row for row, key in enumerate(tags)}
    r = np.array([reader_rows[tuple(group.key for group in layout.readers)] for layout in layouts], dtype=np.int64)
    t = np.array([tag_rows[layout.floor_tags.key] for layout in layouts], dtype=np.int64)
    return np.asarray(under[np.ix_(r, r)] + above[np.ix_(t, t)])


def antenna_places_m(layout: Layout) -> FloatArray:
    """Return the centres of all antennas of a layout that read the floor in ``base_link``, shape (n, 3), m."""
    return np.concatenate([np.empty((0, 3)), *(group.poses[:, :3] for group in layout.floor_readers)])


def _parts_between(layouts: Sequence[Layout], parts: tuple[str, ...]) -> FloatArray:
    found = np.zeros((len(layouts), len(layouts)))
    for row, first in enumerate(layouts):
        for column in range(row):
            difference = layout_difference(first, layouts[column])
            found[row, column] = found[column, row] = sum(
                WEIGHTS[part] * getattr(difference, part) for part in parts
            )
    return found


def _ospa(one_m: FloatArray, other_m: FloatArray) -> float:
    """Return the OSPA distance of order 1 between two sets of places, from 0 to 1."""
    # Imported here: it costs more than all the rest of a short command.
    from scipy.optimize import linear_sum_assignment

    most = max(len(one_m), len(other_m))
    if most == 0:
        return 0.0
    ways = np.linalg.norm(one_m[:, None, :] - other_m[None, :, :], axis=2) / ANTENNA_CUTOFF_M
    ways = np.minimum(ways, 1.0)
    rows, columns = linear_sum_assignment(ways)
    # Exactly rounded, so that the order of the antennas changes nothing.
    return (math.fsum(ways[rows, columns]) + most - len(rows)) / most


def _log_side(layout: Layout) -> float:
    sides = [math.log2(group.antenna.side_m) for group in layout.floor_readers for _ in range(group.count)]
    return math.fsum(sides) / len(sides) if sides else 0.0


def _log_modules(layout: Layout) -> float:
    return math.log2(max(1, sum(group.module_count for group in layout.floor_readers)))


def _pattern_on(tags: FloorTags, zone: str) -> _Pattern | None:
    """Return what lies on a zone: its own pattern, else that of the floor, else nothing."""
    own = {entry.zone: entry for entry in tags.zones}
    entry = own.get(zone, own.get(WHOLE_FLOOR))
    return None if entry is None else _described(entry.pattern, entry.angle_rad)


def _described(pattern: TagPattern, angle_rad: float) -> _Pattern:
    lengths = [float(value) for name, value in pattern.parameters.items() if name.endswith("_m")]
    others = {name: str(value) for name, value in pattern.parameters.items() if not name.endswith(("_m", "_rad"))}
    others.pop("seed", None)
    # Of listed patterns, and of those without parameters, the points alone say what the pattern is.
    by_points = pattern.name == "listed" or not lengths
    points = () if not by_points else (content_key(pattern.points_m, pattern.cell_m),)
    folds = _SYMMETRY.get(pattern.name, 2 if len(pattern.points_m) == 1 else 1)
    periodic = pattern.cell_m is not None
    return _Pattern(
        kind=(pattern.name, *points, *(f"{name} {others[name]}" for name in sorted(others))),
        periodic=periodic,
        # Rounded, so that equal densities of different cells are equal.
        size=round(math.log2(pattern.density_per_m2 if periodic else max(1, len(pattern.points_m))), 9),
        shape={
            name: float(value) / (lengths[0] if name.endswith("_m") else _TILT_RAD)
            for name, value in pattern.parameters.items()
            if name.endswith(("_m", "_rad"))
        },
        turn=cmath.exp(1j * folds * angle_rad),
    )


def _pattern_difference(one: _Pattern | None, other: _Pattern | None) -> tuple[float, float]:
    """Return the differences in density and in arrangement; tags against none are 1 in both."""
    if one is None or other is None:
        return (0.0, 0.0) if one is other else (1.0, 1.0)
    density = min(1.0, abs(one.size - other.size) / 2.0) if one.periodic == other.periodic else 1.0
    if one.kind != other.kind:
        return density, 1.0
    names = sorted({*one.shape, *other.shape})
    shape = math.fsum(abs(one.shape.get(name, 0.0) - other.shape.get(name, 0.0)) for name in names)
    arrangement = shape + abs(one.turn - other.turn) / 2.0
    return density, min(1.0, arrangement)
