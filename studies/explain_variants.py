"""Layouts one step away from a given one: an antenna less or more, the next size, the next pattern, a row out."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from layoutopt import feasibility
from layoutopt.identity import FloatArray
from layoutopt.layout import Layout, ReaderGroup, TagPattern, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.patterns.triangular import triangular
from layoutopt.protocols import AntennaModel
from layoutopt.readers.mounting import scan_slots
from layoutopt.robot import Robot
from layoutopt.scenario import Scenario
from layoutopt.spec.building import Spec
from layoutopt.units import format_length

ROWS_OUT: Final = (2, 4)
"""One row of tags in so many is taken out: half of them, and the mildest thinning that an installer can follow."""
PLACES: Final = 4
"""Places that are tried for one antenna more."""
_SIDE_STEP_M: Final = 0.010
"""Step of an antenna's side where the space lists no next one: sizes on the market differ by about as much."""
_HEIGHT_STEP_M: Final = 0.005
"""Step of the height where the space lists no next one: what a washer under the mount changes."""
_PITCH_STEP: Final = 1.1
"""Step of a pitch where the space lists no next one: a fifth of the tags more or less."""
_SAME_DENSITY: Final = 1.05
"""Patterns whose densities differ by less than this factor have the same number of tags for an installer."""
_MOST_ROWS: Final = 2
"""A pattern with more rows of tags in its cell is no lattice of rows: to take one out would tear its tiles."""
_LATTICE_M: Final = 0.02
"""Distance of the places under the robot that are looked at for one antenna more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Variant:
    """A layout one step away; ``kind`` is what was changed, ``change`` says it in words."""

    kind: str
    change: str
    layout: Layout


def variants_of(spec: Spec, layout: Layout) -> tuple[Variant, ...]:
    """Return every layout one step away, but for those with one antenna more; see `places_for_one_more`.

    Steps are those of the spec's design space, and round ones where the space lists no next value. A layout that
    cannot be built is returned like any other.
    """
    found: dict[str, Variant] = {}
    for variant in (*_reader_variants(spec, layout), *_tag_variants(spec, layout)):
        if variant.layout.key != layout.key:
            found.setdefault(variant.layout.key, variant)
    return tuple(found.values())


def places_for_one_more(layout: Layout, scenario: Scenario) -> tuple[Variant, ...]:
    """Return layouts with one antenna more in the first floor group, at a few places where it can be built.

    The places are far from the antennas there are and from each other: each is the one of a lattice under the
    robot whose nearest neighbour is farthest. None come back where no place obeys the rules of distance.
    """
    first = next((place for place, group in enumerate(layout.readers) if group.kind == "tag_read"), None)
    if first is None:
        return ()
    group = layout.readers[first]
    found: list[Variant] = []
    taken = group.poses[:, :2]
    free = _places_under(scenario.robot, group.antenna.side_m)
    while len(free) and len(found) < PLACES:
        gaps_m = np.linalg.norm(free[:, None, :] - taken[None, :, :], axis=2).min(axis=1)
        chosen = int(np.round(gaps_m, 9).argmax())
        place_m, free = free[chosen], np.delete(free, chosen, axis=0)
        pose = np.array([[place_m[0], place_m[1], group.poses[:, 2].mean(), 0.0]])
        grown = _with_poses(group, np.concatenate((group.poses, pose)))
        changed = _with_group(layout, first, grown)
        if feasibility.check(changed, scenario):
            continue
        taken = np.concatenate((taken, place_m[None, :]))
        found.append(
            Variant(kind="antenna more", change=f"one antenna more at {_place_text(place_m)}", layout=changed)
        )
    return tuple(found)


def _reader_variants(spec: Spec, layout: Layout) -> Iterator[Variant]:
    mounts = [mount for family in spec.mounts for mount in family]
    first = 0
    for number, group in enumerate(layout.readers):
        if group.kind != "tag_read":
            # What finds things off the floor changes nothing on drives over it.
            first += group.count
            continue
        of = f" of group {number + 1}" if len(layout.floor_readers) > 1 else ""

        def made(kind: str, change: str, changed: ReaderGroup, number: int = number, of: str = of) -> Variant:
            return Variant(kind=kind, change=change + of, layout=_with_group(layout, number, changed))

        if group.count > 1:
            for antenna in range(group.count):
                # Antennas are counted as on the sheet and in readers.yaml: from 0, through all groups.
                words = f"without antenna {first + antenna} at {_place_text(group.poses[antenna, :2])}"
                yield made("antenna less", words, _with_poses(group, np.delete(group.poses, antenna, axis=0)))
        elif len(layout.floor_readers) > 1:
            rest = tuple(other for place, other in enumerate(layout.readers) if place != number)
            yield Variant(
                kind="antenna less", change=f"without group {number + 1}", layout=layout.replace(readers=rest)
            )
        known = {mount.antenna.side_m: mount.antenna for mount in mounts}
        known = {side_m: antenna for side_m, antenna in known.items() if type(antenna) is type(group.antenna)}
        for side_m in _neighbours(group.antenna.side_m, [*known], _other_sides(group.antenna)):
            model = known.get(side_m) or _of_side(group.antenna, side_m)
            words = f"antennas of {format_length(side_m)} instead of {format_length(group.antenna.side_m)}"
            yield made("antenna side", words, replace(group, antenna=model))
        height_m = float(group.poses[0, 2])
        other = [round(height_m - _HEIGHT_STEP_M, 6), round(height_m + _HEIGHT_STEP_M, 6)]
        for next_m in _neighbours(height_m, [mount.height_m for mount in mounts], other):
            if next_m > 0.0:
                poses = group.poses.copy()
                poses[:, 2] += next_m - height_m
                words = f"antennas {format_length(next_m)} above the floor instead of {format_length(height_m)}"
                yield made("antenna height", words, replace(group, poses=poses))
        ports = [mount.antennas_per_module for mount in mounts if mount.antennas_per_module <= group.count]
        for port in _neighbours(group.antennas_per_module, ports, []):
            words = f"antennas a module: {int(port)} instead of {group.antennas_per_module}"
            slots = scan_slots(group.poses[:, :2], int(port))
            yield made("module", words, replace(group, antennas_per_module=int(port), slots=slots))
        first += group.count


def _tag_variants(spec: Spec, layout: Layout) -> Iterator[Variant]:
    for number, entry in enumerate(layout.floor_tags.zones):
        where = f" in zone '{entry.zone}'" if entry.zone else ""

        def made(kind: str, change: str, pattern: TagPattern, number: int = number, where: str = where) -> Variant:
            return Variant(kind=kind, change=change + where, layout=_with_pattern(layout, number, pattern))

        for pattern in _next_patterns(spec, entry):
            if pattern.density_per_m2 > entry.pattern.density_per_m2 * _SAME_DENSITY:
                word = "denser"
            elif pattern.density_per_m2 < entry.pattern.density_per_m2 / _SAME_DENSITY:
                word = "sparser"
            else:
                word = "of the same density"
            words = f"tags {word}: {_pattern_text(pattern)} instead of {_pattern_text(entry.pattern)}"
            yield made("tag pattern", words, pattern)
        for rows in ROWS_OUT:
            thinned = without_rows(entry.pattern, rows)
            if thinned is not None:
                yield made("tag row", f"without one row of tags in {rows}", thinned)


def without_rows(pattern: TagPattern, every: int) -> TagPattern | None:
    """Return a pattern without the first of every ``every`` rows along its first period vector.

    ``None`` for a pattern that is laid once, or whose cell holds more than two rows.
    """
    if pattern.cell_m is None:
        return None
    along, across = pattern.cell_m
    normal = np.array([-along[1], along[0]]) / np.linalg.norm(along)
    height_m = float(across @ normal)
    if height_m < 0.0:
        normal, height_m = -normal, -height_m
    offsets_m = np.mod(np.round(pattern.points_m @ normal, 9), round(height_m, 9))
    rows = np.unique(offsets_m)
    if not 1 <= len(rows) <= _MOST_ROWS:
        return None
    cells = every // math.gcd(every, len(rows))
    kept = []
    for cell in range(cells):
        for point_m, offset_m in zip(pattern.points_m, offsets_m, strict=True):
            row = cell * len(rows) + int(np.searchsorted(rows, offset_m))
            if row % every:
                # The point may lie in another cell than its row does; whole cells apart are the same place.
                shift = cell - math.floor(round(float(point_m @ normal) / height_m, 9))
                kept.append(point_m + shift * across)
    return TagPattern(
        name=pattern.name,
        points_m=np.array(kept),
        cell_m=np.array([along, cells * across]),
        parameters={**pattern.parameters, "rows_out": f"1 row in {every} out"},
    )


def _next_patterns(spec: Spec, entry: ZonePattern) -> list[TagPattern]:
    """Return the next denser and sparser pattern of the family, and other families at the same density."""
    density = entry.pattern.density_per_m2
    if density <= 0.0:
        return []
    families = spec.space.patterns.get(entry.zone, ())
    options = [pattern for family in families for pattern in family.options() if pattern.density_per_m2 > 0.0]
    own = {pattern.density_per_m2: pattern for pattern in options if pattern.name == entry.pattern.name}
    scaled = {pattern.density_per_m2: pattern for pattern in _scaled(entry.pattern)}
    chosen = [
        own.get(value) or scaled[value] for value in _neighbours(density, [*own], [*scaled], apart=_SAME_DENSITY)
    ]
    others: dict[str, TagPattern] = {}
    for pattern in options:
        ratio = pattern.density_per_m2 / density
        if pattern.name != entry.pattern.name and 1.0 / _SAME_DENSITY <= ratio <= _SAME_DENSITY:
            others.setdefault(pattern.name, pattern)
    return [*chosen, *others.values()]


def _scaled(pattern: TagPattern) -> list[TagPattern]:
    """Return a lattice a step denser and a step sparser, to whole millimetres; none for other families."""
    builders: dict[str, Callable[..., TagPattern]] = {"square": square, "triangular": triangular}
    lengths = {name: float(value) for name, value in pattern.parameters.items() if name.endswith("_m")}
    if pattern.name not in builders or set(lengths) != set(pattern.parameters):
        return []
    return [
        builders[pattern.name](**{name: round(value * factor, 3) for name, value in lengths.items()})
        for factor in (1.0 / _PITCH_STEP, _PITCH_STEP)
    ]


def _neighbours(
    value: float, known: Sequence[float], otherwise: Sequence[float], *, apart: float = 1.0 + 1e-9
) -> list[float]:
    """Return the next smaller and the next larger value, of ``known`` where it has one, else of ``otherwise``."""

    def beyond(values: Sequence[float], sense: float) -> list[float]:
        return [other for other in values if sense * other > sense * value * apart**sense]

    smaller, larger = (beyond(known, sense) or beyond(otherwise, sense) for sense in (-1.0, 1.0))
    return [*([max(smaller)] if smaller else []), *([min(larger)] if larger else [])]


def _other_sides(antenna: AntennaModel) -> list[float]:
    """Return a step down and up within the range for which the model is calibrated; none where it has no end.

    A disc that was measured for one antenna says nothing of another size.
    """
    low_m, high_m = antenna.card.valid_side_m
    if not math.isfinite(high_m):
        return []
    steps = (round(antenna.side_m - _SIDE_STEP_M, 6), round(antenna.side_m + _SIDE_STEP_M, 6))
    return [side_m for side_m in steps if low_m <= side_m <= high_m]


def _of_side(antenna: AntennaModel, side_m: float) -> AntennaModel:
    return replace(antenna, side_m=side_m)  # type: ignore[type-var]


def _with_poses(group: ReaderGroup, poses: FloatArray) -> ReaderGroup:
    """Return the group with other antennas; no module gets more ports than there are antennas."""
    ports = min(group.antennas_per_module, len(poses))
    return replace(
        group,
        name="listed",
        poses=poses,
        slots=scan_slots(poses[:, :2], ports),
        antennas_per_module=ports,
        parameters={"count": len(poses)},
    )


def _with_group(layout: Layout, number: int, group: ReaderGroup) -> Layout:
    readers = tuple(group if place == number else other for place, other in enumerate(layout.readers))
    return layout.replace(readers=readers)


def _with_pattern(layout: Layout, number: int, pattern: TagPattern) -> Layout:
    zones = tuple(
        replace(entry, pattern=pattern) if place == number else entry
        for place, entry in enumerate(layout.floor_tags.zones)
    )
    return layout.replace(floor_tags=replace(layout.floor_tags, zones=zones))


def _places_under(robot: Robot, side_m: float) -> FloatArray:
    """Return the points of a lattice, symmetric about the middle, at which an antenna lies under the robot."""
    import shapely
    from shapely.geometry import Polygon

    room = Polygon(robot.outline_m).buffer(-side_m / 2.0, join_style="mitre")
    if room.is_empty:
        return np.empty((0, 2))
    reach = int(np.abs(np.array(room.bounds)).max() / _LATTICE_M)
    steps_m = _LATTICE_M * np.arange(-reach, reach + 1)
    places_m = np.stack(np.meshgrid(steps_m, steps_m), axis=-1).reshape(-1, 2)
    return np.asarray(places_m[shapely.covers(room, shapely.points(places_m))])


def _place_text(place_m: FloatArray) -> str:
    x_mm, y_mm = (float(value) * 1000.0 + 0.0 for value in np.round(place_m, 9))
    return f"({x_mm:.0f}, {y_mm:.0f}) mm"


def _pattern_text(pattern: TagPattern) -> str:
    sizes = [format_length(float(value)) for name, value in pattern.parameters.items() if name.endswith("_m")]
    return " ".join([pattern.name, *sizes[:1]])
