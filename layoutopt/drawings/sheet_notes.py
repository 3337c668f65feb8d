"""Notes and legend of an installation drawing."""

import math
from collections import Counter
from collections.abc import Sequence
from typing import Final

import numpy as np
import shapely

from layoutopt import registry
from layoutopt.drawings.floor_view import (
    INSTALLED_SYMBOL,
    NO_TAGS_FILL,
    OBSTACLE_FILL,
    TRANSPONDER_SYMBOL,
    tag_symbol,
)
from layoutopt.drawings.layers import Layer
from layoutopt.drawings.robot_view import sides
from layoutopt.drawings.symbols import SymbolName
from layoutopt.drawings.text_space import LegendRow
from layoutopt.drawings.zone_names import zone_text
from layoutopt.layout import INSTALLED, Layout, ReaderGroup, TagMap
from layoutopt.site import Site

TAG_TOLERANCE_MM: Final = 5
ANTENNA_TOLERANCE_MM: Final = 1
QUICK_LOOK_NOTE: Final = "A quick look at few layouts and drives chose this layout: do not install from it."
"""Stands among the notes of each drawing of a layout that a quick look chose."""

_ON_TOP: Final[tuple[tuple[str, str, SymbolName], ...]] = (
    ("signal", "UHF antenna, on top", "arrow"),
    ("direction", "docking ring, on top", "ring"),
)
_MOST_ZONES: Final = 8
_ON_WALL_M: Final = 1e-6


def quick_look_title(title: str) -> str:
    """Return the title that a sheet, or its part of a set, has if a quick look chose the layout."""
    return f"QUICK LOOK, NOT FOR INSTALLATION: {title}"


def general_notes(
    layout: Layout, site: Site, tag_map: TagMap, *, plan: str = "view 1", robots: Sequence[str] = ("View 2",)
) -> tuple[str, ...]:
    """Return what an installer must know whatever the scale of the plan is.

    ``plan`` is what the notes call the drawing of the floor, ``robots`` are those of the robot: one of all its
    antennas, or one of each side that has any, the underside first.
    """
    xmin, ymin, xmax, ymax = site.bounds_m
    long_mm, short_mm = (1000.0 * side_m for side_m in layout.floor_tags.tag_size_m)
    return (
        f"Layout {layout.short_key}: {layout.label}. Site '{site.name}', plan: {site.source}, overall "
        f"{_millimetres(xmax - xmin)} x {_millimetres(ymax - ymin)} mm.",
        f"Dimensions are in mm, each measured from the datum, never from tag to tag. The datum 0/0 of {plan} is "
        f"the lower left corner of the floor's bounds, x {_metres(xmin)} m, y {_metres(ymin)} m in the map frame "
        "(REP-103), in which tags.csv is written.",
        *_datum_outside(site),
        _second_point(site),
        f"{len(tag_map)} tags '{layout.floor_tags.tag_part}' of {long_mm:g} x {short_mm:g} mm, first side along "
        "x. Places and identities of all tags: tags.csv." + _counting(tag_map)
        if len(tag_map) or layout.floor_tags.zones
        else "No tags lie on the floor.",
        f"Tolerances, estimated and not measured: tag centres ±{TAG_TOLERANCE_MM} mm, antenna centres "
        f"±{ANTENNA_TOLERANCE_MM} mm.",
        *_edited(tag_map),
        *_tiling(site),
        *_zones(site),
        *_robot_views(layout, robots),
        *_antennas(layout),
        *_transponders(layout, site),
    )


def legend_rows(
    layout: Layout, site: Site, scale: int, *, tiles: bool, top: Layer = "A-READERS-TOP"
) -> tuple[LegendRow, ...]:
    """Return a row for each kind of line, symbol and area, of floor tiles only where ``tiles`` are drawn.

    ``top`` is the layer of antennas on top of the robot.
    """
    size_mm = 1000.0 * max(layout.floor_tags.tag_size_m)
    rows = [
        LegendRow(layer="A-OUTLINE", meaning="edge of the floor"),
        LegendRow(layer="A-OBSTACLE", meaning="obstacle or no floor", fill=OBSTACLE_FILL),
    ]
    if any(zone.taggable for zone in site.zones):
        rows.append(LegendRow(layer="A-ZONE", meaning="zone"))
    if not all(zone.taggable for zone in site.zones):
        rows.append(LegendRow(layer="A-NOTAG", meaning="zone that bars tags", fill=NO_TAGS_FILL))
    if tiles:
        rows.append(LegendRow(layer="A-TILES", meaning="joint of floor tiles"))
    if layout.transponders:
        rows.append(LegendRow(layer="A-READERS", meaning="transponder", symbol=TRANSPONDER_SYMBOL))
    rows += [
        LegendRow(layer="A-TAGS", meaning="tag", symbol=tag_symbol(size_mm, scale)),
        *(
            [LegendRow(layer="A-TAGS", meaning="tag already there", symbol=INSTALLED_SYMBOL)]
            if layout.floor_tags.installed is not None
            else ()
        ),
        LegendRow(layer="A-GRID", meaning="column or row of tags"),
        LegendRow(layer="A-DATUM", meaning="datum; base_link", symbol="datum"),
        LegendRow(layer="A-ROBOT", meaning="chassis, arrow forward"),
    ]
    if layout.floor_readers:
        rows += [
            LegendRow(layer="A-READERS", meaning="antenna, tick on its x", symbol="cross_square"),
            LegendRow(layer="A-READ-DISC", meaning="read disc on the floor"),
        ]
    rows += [
        LegendRow(layer=top, meaning=meaning, symbol=symbol)
        for kind, meaning, symbol in _ON_TOP
        if layout.readers_of(kind)
    ]
    return tuple(rows)


def _millimetres(length_m: float) -> str:
    return f"{round(1000.0 * length_m, 1) + 0.0:.1f}".removesuffix(".0")


def _metres(length_m: float) -> str:
    # Adding zero turns -0.0 into 0.0.
    return f"{round(length_m, 3) + 0.0:.3f}"


def _datum_outside(site: Site) -> tuple[str, ...]:
    """Return from where the datum is set out if it is no point of the floor, such as with an L-shaped one."""
    datum_m = np.array(site.datum_m)
    if shapely.distance(site.floor, shapely.Point(datum_m)) <= _ON_WALL_M:
        return ()
    corners_m = shapely.get_coordinates(shapely.get_parts(site.floor).tolist()) - datum_m
    away_m = np.linalg.norm(corners_m, axis=1)
    nearest = np.lexsort((corners_m[:, 1], corners_m[:, 0], np.round(away_m, 6)))[0]
    x_m, y_m = corners_m[nearest].tolist()
    return (
        "The datum lies outside the walls: set it out from the nearest corner of the floor, which is at "
        f"x {_millimetres(x_m)}, y {_millimetres(y_m)} from it.",
    )


def _second_point(site: Site) -> str:
    """Return from where the direction of x is set out: the corner of the floor that is farthest from the datum."""
    corners_m = shapely.get_coordinates(shapely.get_parts(site.floor).tolist()) - np.array(site.datum_m)
    x_m, y_m = corners_m[np.argmax(np.round(np.linalg.norm(corners_m, axis=1), 6))].tolist()
    return (
        "Set the direction of x out by a second point, the farther the better: the corner of the floor that is "
        f"farthest from the datum is at x {_millimetres(x_m)}, y {_millimetres(y_m)} from it."
    )


def _counting(tag_map: TagMap) -> str:
    """Return how the identities run, if they run in rows."""
    if len(tag_map) < 2:
        return ""
    ids = tag_map.ids[np.lexsort((np.round(tag_map.xy_m[:, 0], 6), np.round(tag_map.xy_m[:, 1], 6)))]
    steps = np.diff(ids)
    if not (steps >= 1).all():
        return ""
    gaps = "" if (steps == 1).all() else ", with gaps where tags are left out"
    return f" They count from {ids[0]} to {ids[-1]}{gaps}, rows from bottom to top, each row from left to right."


def _edited(tag_map: TagMap) -> tuple[str, ...]:
    counts = Counter(status for status in tag_map.status if status != "planned")
    lying = counts.pop(INSTALLED, 0)
    notes = (f"Tags that lie already and stay (install_status in tags.csv): {lying} installed.",) if lying else ()
    if not counts:
        return notes
    words = ", ".join(f"{count} {status}" for status, count in sorted(counts.items()))
    return (*notes, f"Tags that differ from their pattern (install_status in tags.csv): {words}.")


def _tiling(site: Site) -> tuple[str, ...]:
    if site.tiling is None:
        return ()
    x_m, y_m = site.tiling.origin_m
    angle_deg = float(np.rad2deg(site.tiling.angle_rad))
    turn = f", turned by {angle_deg:.4g}°" if angle_deg else ""
    return (
        f"Floor tiles of {_millimetres(site.tiling.size_m)} mm{turn}; tags.csv names the tile of each tag by "
        f"column and row, where c0r0 begins at x {_metres(x_m)} m, y {_metres(y_m)} m in the map frame.",
    )


def _zones(site: Site) -> tuple[str, ...]:
    """Return where zones lie, by their bounds from the datum."""
    if not site.zones:
        return ()
    if len(site.zones) > _MOST_ZONES:
        return (f"The {len(site.zones)} zones are shown on the plan only.",)
    parts = []
    for zone in site.zones:
        edges_m = np.array(zone.region.bounds) - np.tile(site.datum_m, 2)
        left, bottom, right, top = (_millimetres(edge_m) for edge_m in edges_m.tolist())
        parts.append(f"{zone_text(zone)}: x {left} to {right}, y {bottom} to {top}")
    return (f"Zones, bounds in mm from the datum: {'; '.join(parts)}.",)


def _robot_views(layout: Layout, robots: Sequence[str]) -> tuple[str, ...]:
    """Return how the drawings of the robot are to be read, and where all poses are."""
    shown = sides(layout)
    lines = []
    if "below" in shown:
        lines.append(
            f"{robots[0]} is drawn in base_link (REP-103) as seen from above through the chassis; seen from "
            "below, left and right change places."
        )
    if "top" in shown:
        lines.append(
            f"{robots[0]} has what is on top of the robot in violet lines with two dots."
            if len(robots) < len(shown)
            else f"{robots[-1]} shows the top of the robot, in base_link (REP-103), as seen from above."
        )
    return (f"{' '.join(lines)} Poses, modules and scan slots of all antennas: readers.yaml.",)


def _antennas(layout: Layout) -> tuple[str, ...]:
    """Return for each reader group numbers, size, height, read disc and modules, then what is uncertain."""
    lines = []
    known = registry.names("readers")
    first = 0
    for group in layout.readers:
        lines.append(_group_line(group, first))
        if group.name in known and registry.card("readers", group.name).reconstructed:
            lines.append(
                f"Antenna coordinates of '{group.name}' are reconstructed: its source does not print them."
            )
        if group.antenna.extrapolated:
            low_mm, high_mm = (1000.0 * side_m for side_m in group.antenna.card.valid_side_m)
            lines.append(
                f"The antenna model is extrapolated for {1000.0 * group.antenna.side_m:g} mm: it is calibrated "
                f"from {low_mm:g} to {high_mm:g} mm. Measure a read disc before mounting."
            )
        first += group.count
    return tuple(lines)


def _transponders(layout: Layout, site: Site) -> tuple[str, ...]:
    """Return where transponders go, from the datum, and how many UHF tags are given out."""
    notes = []
    for transponder in layout.transponders:
        x_m, y_m = (value - start for value, start in zip(transponder.position_m, site.datum_m, strict=False))
        notes.append(
            f"Transponder '{transponder.name}' for docking: x {_millimetres(x_m)}, y {_millimetres(y_m)} from the "
            f"datum, {_millimetres(transponder.position_m[2])} mm above the floor."
        )
    if layout.target_tags:
        notes.append(f"UHF tags to be given out: {layout.target_tags}.")
    return tuple(notes)


def _group_line(group: ReaderGroup, first: int) -> str:
    numbers = f"Antenna {first}" if group.count == 1 else f"Antennas {first} to {first + group.count - 1}"
    side = f"{1000.0 * group.antenna.side_m:g}"
    heights_m = sorted({round(height_m, 6) for height_m in group.poses[:, 2].tolist()})
    low_m, high_m = heights_m[0], heights_m[-1]
    height = f"{_span(1000.0 * low_m, 1000.0 * high_m)} above the floor"
    if group.kind == "direction":
        return f"{numbers}: crossed antennas for docking, a ring of {side} mm on top of the robot, {height}."
    if group.kind == "signal":
        yaws = ", ".join(f"{round(math.degrees(yaw_rad), 1) + 0.0:g}°" for yaw_rad in group.poses[:, 3].tolist())
        return (
            f"{numbers}: UHF, {side} x {side} mm, on top of the robot, {height}, looking along the arrows: yaw "
            f"{yaws} from forward to the left; one reader, a sample of all every {group.cycle_s:g} s."
        )
    parts = [f"{numbers}: {group.name}, {side} x {side} mm, {height}"]
    diameters_mm = sorted(2000.0 * group.antenna.read_radius_m(height_m) for height_m in heights_m)
    parts.append(f"read disc {_span(diameters_mm[0], diameters_mm[-1])} in diameter")
    modules = "1 module" if group.module_count == 1 else f"{group.module_count} modules"
    each = "one antenna" if group.antennas_per_module == 1 else f"up to {group.antennas_per_module} antennas"
    parts.append(f"{modules} with {each} each, profile '{group.profile.name}'")
    return "; ".join(parts) + "."


def _span(low_mm: float, high_mm: float) -> str:
    low, high = f"{low_mm:.4g}", f"{high_mm:.4g}"
    return f"{low} mm" if low == high else f"{low} to {high} mm"
