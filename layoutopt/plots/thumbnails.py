"""Small pictures of a robot over the tags, light enough for a page to hold dozens of them."""

import math
from typing import Final

import numpy as np

from layoutopt.geometry import turned
from layoutopt.identity import FloatArray
from layoutopt.layout import Layout, TagMap
from layoutopt.plots.figures import INK, PAPER, SERIES
from layoutopt.plots.finder_marks import BEAM, DOCK, beam_of, sector_radius_m
from layoutopt.plots.layout_plan import in_read_disc, sample_place_m
from layoutopt.robot import Robot
from layoutopt.site import Site

_MARGIN: Final = 1.5
"""Side of the picture over the longer side of the robot, so that the floor round it is seen."""
_MOST_TAGS: Final = 400
"""More tags than this in the picture would be a grey field: the picture shows a smaller piece of floor instead."""
_SECTOR_STEPS: Final = 13
"""Corners on the rim of a sector: few bytes, and round at the size of a thumbnail."""
_SQUARE: Final = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])
_INK: Final = f"var(--ink, {INK})"
_PAPER: Final = f"var(--paper, {PAPER})"


def underside_svg(*, layout: Layout, site: Site, robot: Robot, tag_map: TagMap) -> str:
    """Return an ``<svg>`` element, to scale: chassis, antennas and read discs over the tags.

    Tags in a read disc are filled. Sectors show where UHF antennas look and how wide, not how far; a ring stands
    for crossed antennas, a diamond for a transponder that lies within the picture. All layouts for one robot have
    one scale, unless more than 400 tags would lie under it. The element holds no text, no id and nothing that is
    loaded; ink and paper are those of the page. One unit is a millimetre.

    Parameters
    ----------
    tag_map
        The tags, from ``layout.floor_tags.lay_on(site)``.
    """
    centre_m = sample_place_m(layout=layout, site=site, robot=robot, tag_map=tag_map)
    low, high = robot.outline_m.min(axis=0), robot.outline_m.max(axis=0)
    half_m = _MARGIN / 2.0 * float((high - low).max())
    middle_m = np.array(centre_m) + (low + high) / 2.0
    near, half_m = _shown(tag_map, middle_m, half_m)
    xy_m = tag_map.xy_m[near] - middle_m
    read = in_read_disc(layout, tag_map.xy_m[near], centre_m)
    robot_m = np.array(centre_m) - middle_m
    side = round(2.0 * half_m * 1000.0)
    chassis = _path(robot.outline_m + robot_m)
    parts = [f'<path d="{chassis}" fill="{SERIES[5]}" fill-opacity="0.15"/>']
    discs, squares = [], []
    for group in layout.floor_readers:
        for x_m, y_m, z_m, yaw_rad in group.poses.tolist():
            place_m = robot_m + np.array([x_m, y_m])
            x, y = _millimetres(place_m)
            radius = round(group.antenna.read_radius_m(z_m) * 1000.0, 1)
            discs.append(f'<circle cx="{x}" cy="{y}" r="{radius:g}"/>')
            squares.append(_path(turned(_SQUARE * group.antenna.side_m, yaw_rad) + place_m))
    parts.append(f'<g fill="{SERIES[1]}" fill-opacity="0.4">{"".join(discs)}</g>')
    tag_m = _SQUARE * np.array(layout.floor_tags.tag_size_m)
    for chosen, fill in ((~read, _PAPER), (read, _INK)):
        outlines = "".join(_path(tag_m + place_m) for place_m in xy_m[chosen])
        parts.append(_drawn(outlines, fill=fill, stroke=_INK, width=0.004 * side))
    parts.append(_drawn(chassis, fill="none", stroke=SERIES[0], width=0.01 * side))
    parts.append(_drawn("".join(squares), fill="none", stroke=_INK, width=0.008 * side))
    parts += _finders(layout, robot, robot_m, middle_m, half_m)
    frame = f"{-side / 2:g} {-side / 2:g} {side} {side}"
    return f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{frame}">{"".join(parts)}</svg>'


def _finders(layout: Layout, robot: Robot, robot_m: FloatArray, middle_m: FloatArray, half_m: float) -> list[str]:
    """Return what finds things off the floor, as elements: beams, rings, and transponders in the picture."""
    side = 2000.0 * half_m
    beams = []
    for group in layout.readers_of("signal"):
        for x_m, y_m, _, yaw_rad in group.poses.tolist():
            place_m = robot_m + np.array([x_m, y_m])
            beams.append(_sector(place_m, sector_radius_m(robot), yaw_rad, beam_of(group)))
    parts = [
        f'<path d="{"".join(beams)}" fill="{BEAM}" fill-opacity="0.25" stroke="{BEAM}" '
        f'stroke-width="{0.008 * side:.3g}"/>'
    ] * bool(beams)
    for group in layout.readers_of("direction"):
        for x_m, y_m in group.poses[:, :2].tolist():
            x, y = _millimetres(robot_m + np.array([x_m, y_m]))
            parts.append(
                f'<circle cx="{x}" cy="{y}" r="{500.0 * group.antenna.side_m:g}" fill="none" stroke="{DOCK}" '
                f'stroke-width="{0.012 * side:.3g}"/>'
            )
    for transponder in layout.transponders:
        place_m = np.array(transponder.position_m[:2]) - middle_m
        if np.abs(place_m).max() <= half_m:
            diamond = turned(_SQUARE, math.pi / 4.0) * 0.1 * half_m + place_m
            parts.append(_drawn(_path(diamond), fill=DOCK, stroke=_INK, width=0.008 * side))
    return parts


def _sector(place_m: FloatArray, radius_m: float, yaw_rad: float, beam_rad: float) -> str:
    """Return the path of a sector about a direction."""
    angles = np.linspace(yaw_rad - beam_rad / 2.0, yaw_rad + beam_rad / 2.0, _SECTOR_STEPS)
    rim_m = radius_m * np.stack((np.cos(angles), np.sin(angles)), axis=1)
    return _path(np.concatenate((np.zeros((1, 2)), rim_m)) + place_m)


def _shown(tag_map: TagMap, middle_m: FloatArray, half_m: float) -> tuple[np.ndarray, float]:
    """Return which tags lie in the picture, and half of its side, m: less than asked where tags are very dense."""
    away_m = np.abs(tag_map.xy_m - middle_m).max(axis=1, initial=0.0)
    near = away_m <= half_m
    if near.sum() > _MOST_TAGS:
        half_m = float(np.sort(away_m)[_MOST_TAGS])
        near = away_m < half_m
    return near, half_m


def _millimetres(place_m: FloatArray) -> tuple[float, float]:
    """Return where a place is drawn: y points down in a picture."""
    return round(float(place_m[0]) * 1000.0, 1), round(-float(place_m[1]) * 1000.0, 1)


def _path(corners_m: FloatArray) -> str:
    places = [_millimetres(corner) for corner in corners_m]
    return "M" + "L".join(f"{x:g} {y:g}" for x, y in places) + "Z"


def _drawn(path: str, *, fill: str, stroke: str, width: float) -> str:
    style = f"fill: {fill}; stroke: {stroke}; stroke-width: {width:.3g}"
    return f'<path d="{path}" style="{style}"/>' if path else ""
