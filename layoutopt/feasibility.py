"""Whether a layout can be built: plain checks that share nothing with any search."""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
import shapely
from shapely.geometry import Polygon

from layoutopt.layout import EditKind, FloorTags, Layout, ReaderGroup
from layoutopt.readers.finders import LARGEST_UHF_PORTS
from layoutopt.robot import Robot
from layoutopt.scenario import Scenario
from layoutopt.site import Site
from layoutopt.units import format_length

LARGEST_MULTIPLEXER_PORTS: Final = 8
_ON_BORDER_M: Final = 1e-8


@dataclass(frozen=True, slots=True, kw_only=True)
class Violation:
    """A rule that a layout breaks, in words, and by how much (m; infinite where no length would cure it)."""

    rule: str
    message: str
    shortfall_m: float


def check(layout: Layout, scenario: Scenario) -> tuple[Violation, ...]:
    """Return every rule that the layout breaks; none means that it can be built.

    Outline, spacing and height bind the antennas that read the floor, which hang below the robot. Of UHF antennas
    only the ports of a reader are counted, and crossed antennas are a device of their own: both sit on top.

    Raises
    ------
    KeyError
        If floor tags with more than one pattern name a zone that the scenario's site does not have.
    ValueError
        If an edit names a place where the pattern put no tag.
    """
    found: list[Violation] = []
    spacings_m = [entry.pattern.minimum_spacing_m() for entry in layout.floor_tags.zones]
    for spacing_m in spacings_m:
        found += _pattern_rules(spacing_m, layout)
    nearest_m, place = _nearest_laid(layout.floor_tags, scenario.site)
    if nearest_m < min(spacings_m, default=math.inf) - 1e-9:
        found += _laid_rules(nearest_m, place, layout)
    found += _barred_zones(layout.floor_tags, scenario.site)
    found += _barred_places(layout.floor_tags, scenario.site)
    for group in layout.readers_of("signal"):
        found += _uhf_ports(group)
    for group in layout.floor_readers:
        found += _inside_outline(group, scenario.robot)
        found += _spacing(group)
        found += _ports(group)
        found += _reach(group)
        if group.profile.tags_per_scan == "one":
            found += _one_tag(group, layout, min(*spacings_m, nearest_m))
    return tuple(found)


def _pattern_rules(have_m: float, layout: Layout) -> list[Violation]:
    need_m = max(layout.floor_tags.tag_size_m)
    if have_m >= need_m - 1e-9:
        return []
    message = f"tags of {format_length(need_m)} overlap at a spacing of {format_length(have_m)}"
    return [Violation(rule="tag spacing", message=message, shortfall_m=need_m - have_m)]


def _laid_rules(have_m: float, place: tuple[float, float], layout: Layout) -> list[Violation]:
    """Check two tags that no single pattern puts so close: at the border of two patterns, or after an edit."""
    need_m = max(layout.floor_tags.tag_size_m)
    if have_m >= need_m - 1e-9:
        return []
    message = (
        f"tags of {format_length(need_m)} overlap near ({place[0]:.3f}, {place[1]:.3f}) m on the floor: an edit "
        f"or two patterns lay them {format_length(have_m)} apart"
    )
    return [Violation(rule="laid tags", message=message, shortfall_m=need_m - have_m)]


def _barred_zones(floor_tags: FloorTags, site: Site) -> list[Violation]:
    """Check that no zone has a pattern of its own whose tags it bars: they would be left out without a word."""
    found = []
    own = {entry.zone for entry in floor_tags.zones}
    for zone in site.zones:
        rule = zone.rule_against(floor_tags.tag_part)
        if rule and zone.name in own:
            message = (
                f"zone '{zone.name}' bars tags of the part '{floor_tags.tag_part}' ({rule}) and has a pattern"
            )
            found.append(Violation(rule="barred zone", message=message, shortfall_m=math.inf))
    return found


@lru_cache(maxsize=1024)
def _barred_places(floor_tags: FloorTags, site: Site) -> tuple[Violation, ...]:
    """Check that edits lay no tag where none may lie.

    A tag that was moved may have been measured, so its centre alone counts; others keep half their longer side.
    """
    if not floor_tags.edits:
        return ()
    tags = floor_tags.lay_on(site).to_lay()
    moved = np.array([status == EditKind.MOVED.value for status in tags.status], dtype=np.bool_)
    found = []
    for xy_m, margin_m in ((tags.xy_m[moved], 0.0), (tags.xy_m[~moved], max(floor_tags.tag_size_m) / 2.0)):
        # The map itself is cut at the same border: a tag on it must not come and go with the last bit of a sum.
        reasons = site.why_barred(xy_m, max(0.0, margin_m - _ON_BORDER_M), floor_tags.tag_part)
        barred = [(why, place) for why, place in zip(reasons, xy_m.tolist(), strict=True) if why]
        if barred:
            why, (x_m, y_m) = barred[0]
            more = f", and {len(barred) - 1} more tags lie so" if len(barred) > 1 else ""
            message = f"an edit lays a tag at ({x_m:.3f}, {y_m:.3f}) m, where none may lie: {why}{more}"
            found.append(Violation(rule="barred place", message=message, shortfall_m=math.inf))
    return tuple(found)


@lru_cache(maxsize=1024)
def _nearest_laid(floor_tags: FloorTags, site: Site) -> tuple[float, tuple[float, float]]:
    """Return the least distance of a tag to be laid from any other, and the place between them.

    One pattern without edits is not laid for this: its own spacing says all, and thousands of such are checked.
    Two installed tags lie as they lie, however near.
    """
    from scipy.spatial import cKDTree

    if len(floor_tags.zones) == 1 and not floor_tags.edits and floor_tags.installed is None:
        return math.inf, (math.nan, math.nan)
    tags = floor_tags.lay_on(site)
    xy_m, new_m = tags.xy_m, tags.to_lay().xy_m
    if len(xy_m) < 2 or not len(new_m):
        return math.inf, (math.nan, math.nan)
    distances_m, neighbours = (np.asarray(found) for found in cKDTree(xy_m).query(new_m, k=2))
    first = int(distances_m[:, 1].argmin())
    x_m, y_m = xy_m[neighbours[first]].mean(axis=0)
    return float(distances_m[first, 1]), (float(x_m), float(y_m))


def _inside_outline(group: ReaderGroup, robot: Robot) -> list[Violation]:
    outline = Polygon(robot.outline_m)
    half_m = group.antenna.side_m / 2.0
    corners = half_m * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    beyond_m = 0.0
    for x_m, y_m, _, yaw_rad in group.poses:
        cos, sin = np.cos(yaw_rad), np.sin(yaw_rad)
        square = corners @ np.array([[cos, sin], [-sin, cos]]) + (x_m, y_m)
        outside = shapely.distance(shapely.points(square), outline)
        beyond_m = max(beyond_m, float(outside.max()))
    if beyond_m <= 1e-9:
        return []
    message = f"an antenna reaches {format_length(beyond_m)} beyond the robot's outline"
    return [Violation(rule="robot outline", message=message, shortfall_m=beyond_m)]


def _spacing(group: ReaderGroup) -> list[Violation]:
    """Check the distances of antennas, all of them and those that are on at the same time."""
    gap_m = np.linalg.norm(group.poses[:, None, :2] - group.poses[None, :, :2], axis=2)
    np.fill_diagonal(gap_m, np.inf)
    slots = np.array(group.slots)
    together = slots[:, None] == slots[None, :]
    found = []
    for rule, which, sides, nearest_m, way_out in (
        (
            "antenna spacing",
            "antennas",
            group.profile.spacing_sides,
            float(gap_m.min(initial=np.inf)),
            "take smaller antennas (antenna_side) or set them farther apart",
        ),
        (
            "simultaneous antennas",
            "antennas that are on at the same time",
            group.profile.simultaneous_spacing_sides,
            float(gap_m[together].min(initial=np.inf)),
            "let more of them share a reader module (antennas_per_module), set them farther apart or take smaller "
            "ones (antenna_side)",
        ),
    ):
        need_m = sides * group.antenna.side_m
        if nearest_m < need_m - 1e-9:
            message = (
                f"cannot be built under profile '{group.profile.name}': {which} need {sides:g} sides between "
                f"their centres, {format_length(need_m)} for antennas of {format_length(group.antenna.side_m)}; "
                f"{_arrangement(group)} has {format_length(nearest_m)}; {way_out}"
            )
            found.append(Violation(rule=rule, message=message, shortfall_m=need_m - nearest_m))
    return found


def _arrangement(group: ReaderGroup) -> str:
    """Return a family with its number of antennas and its lengths, such as ``ring 3 of radius 150 mm``."""
    lengths = [
        f"{name.removesuffix('_m').replace('_', ' ')} {format_length(value)}"
        for name, value in group.parameters.items()
        if name.endswith("_m") and isinstance(value, float)
    ]
    return f"{group.name} {group.count}" + (f" of {', '.join(lengths)}" if lengths else "")


def _ports(group: ReaderGroup) -> list[Violation]:
    """Check that there is a multiplexer for every module."""
    antennas = len(set(group.slots))  # the first module takes one antenna of every slot
    if antennas <= LARGEST_MULTIPLEXER_PORTS:
        return []
    message = f"no multiplexer with more than {LARGEST_MULTIPLEXER_PORTS} ports; a module has {antennas} antennas"
    return [Violation(rule="multiplexer ports", message=message, shortfall_m=math.inf)]


def _uhf_ports(group: ReaderGroup) -> list[Violation]:
    """Check that a UHF reader has a port for each of its antennas."""
    antennas = len(set(group.slots))
    if antennas <= LARGEST_UHF_PORTS:
        return []
    message = f"a UHF reader has {LARGEST_UHF_PORTS} ports; one has {antennas} antennas"
    return [Violation(rule="UHF ports", message=message, shortfall_m=math.inf)]


def _reach(group: ReaderGroup) -> list[Violation]:
    """Check that an antenna can read the floor at all from its height."""
    height_m = float(group.poses[:, 2].max(initial=0.0))
    if group.antenna.read_radius_m(height_m) > 0.0:
        return []
    message = f"an antenna of {format_length(group.antenna.side_m)} reads no tag from {format_length(height_m)}"
    return [Violation(rule="antenna height", message=message, shortfall_m=height_m)]


def _one_tag(group: ReaderGroup, layout: Layout, have_m: float) -> list[Violation]:
    """Check that a reader that takes one tag a scan never has two tags, ``have_m`` apart, in its field."""
    heights_m = group.poses[:, 2].tolist()
    # Two tags collide wherever both are read, and some outlines reach beyond their disc.
    reach_m = max(
        group.antenna.read_radius_m(height_m) + group.antenna.disc_error_m(height_m) for height_m in heights_m
    )
    need_m = 2.0 * reach_m + max(layout.floor_tags.tag_size_m)
    if have_m >= need_m - 1e-9:
        return []
    message = (
        f"cannot be built under profile '{group.profile.name}', which reads one tag a scan: tags "
        f"{format_length(have_m)} apart where the field needs {format_length(need_m)}"
    )
    return [Violation(rule="one tag a scan", message=message, shortfall_m=need_m - have_m)]
