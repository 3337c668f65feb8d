"""Sites, layouts, fronts and results as pieces of HTML with a picture, for notebooks.

A piece loads nothing, runs no script, and is well-formed, so that it also stands in a page of XHTML.
"""

from collections.abc import Iterable, Mapping, Sequence
from functools import singledispatch
from html import escape
from typing import Final

import numpy as np

from layoutopt.geometry import turned
from layoutopt.identity import FloatArray
from layoutopt.layout import Layout, TagPattern
from layoutopt.plots.figures import FAINT, INK, PAPER, SERIES, as_svg, new_axes
from layoutopt.plots.floor_plan import draw_floor, frame_site
from layoutopt.plots.front import draw_front
from layoutopt.result import Evaluated, Front, Result
from layoutopt.score_text import euros, score_name, score_text
from layoutopt.site import CORNERS, INLINE, Site
from layoutopt.units import format_length

_MOST_ROWS: Final = 25
"""More members of a front than this are counted, not listed."""
_MOST_TAGS: Final = 400
_MARGIN_M: Final = 0.1
_UNDERSIDE_PIXELS: Final = 260
_PICTURE_MM: Final = 120.0
_SQUARE: Final = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])
_COST: Final = "cost"


@singledispatch
def html_of(value: object) -> str:
    """Return a value as a ``<div>`` of HTML; all texts in it are escaped.

    Raises
    ------
    TypeError
        If values of this type have no such form.
    """
    raise TypeError(f"a {type(value).__name__} has no form for notebooks")


@html_of.register
def _(site: Site) -> str:
    xmin, ymin, xmax, ymax = site.bounds_m
    width_m, height_m = xmax - xmin, ymax - ymin
    axes = new_axes(_PICTURE_MM, float(np.clip(_PICTURE_MM * height_m / width_m, 40.0, _PICTURE_MM)))
    draw_floor(axes, site)
    frame_site(axes, site)
    rows = [
        ("extents", f"{width_m:.2f} m × {height_m:.2f} m"),
        ("open floor", f"{site.open_floor.area:.1f} m²"),
        ("obstacles", f"{len(site.obstacles)}"),
        ("plan", CORNERS if site.source == INLINE else site.source),
    ]
    for zone in site.zones:
        rule = "" if zone.tags and not zone.metal else ", no plain tags"
        target = "" if zone.target_error_m is None else f", target {format_length(zone.target_error_m)}"
        rows.append((f"zone {zone.name}", f"{zone.region.area:.2f} m²{rule}{target}"))
    return _piece(f"Site {site.name}", _pairs(rows), as_svg(axes))


@html_of.register
def _(layout: Layout) -> str:
    rows = [("key", layout.short_key)]
    rows += [(f"readers, {group.count}", group.label) for group in layout.readers]
    rows += [
        (f"tags, zone {entry.zone}" if entry.zone else "tags", _pattern_text(entry.pattern))
        for entry in layout.floor_tags.zones
    ]
    rows.append(("kind of tag", layout.floor_tags.tag_part))
    if layout.floor_tags.edits:
        rows.append(("tags moved, dropped or added", f"{len(layout.floor_tags.edits)}"))
    for one in layout.transponders:
        x_m, y_m, _ = one.position_m
        rows.append((f"transponder {one.name}", f"({x_m:.3f}, {y_m:.3f}) m"))
    return _piece(f"Layout {layout.label}", _pairs(rows), _underside(layout))


@html_of.register
def _(front: Front) -> str:
    return _piece(f"Front of {len(front)} layouts", _members(front), _front_picture(front, {}))


@html_of.register
def _(result: Result) -> str:
    return html_of_result(result, result.status.value)


def html_of_result(result: Result, status: str, more: Iterable[tuple[str, str]] = ()) -> str:
    """Return a result as a ``<div>``, with how it ended in words and with more rows below those of its layouts."""
    rows = [("status", status)]
    rows += [("shortfall", result.shortfall)] if result.shortfall else []
    rows += [("bound", f"{result.bound:.6g}")] if result.bound is not None else []
    rows += [("gap", f"{100.0 * result.gap:.3g} %")] if result.gap is not None else []
    rows.append(("search trials", f"{result.trials}"))
    rows += [(role, _in_words(item, result.front.goals)) for role, item in result.recommended.items()]
    rows += more
    pictures = _front_picture(result.front, result.recommended)
    return _piece("Result", _pairs(rows) + _members(result.front), pictures)


def _pattern_text(pattern: TagPattern) -> str:
    if pattern.cell_m is None:
        return f"{pattern.name}, {len(pattern.points_m)} places"
    return f"{pattern.name}, {pattern.density_per_m2:.4g} per m²"


def _members(front: Front) -> str:
    """Return the table of the members, of a long front evenly spaced ones."""
    shown = front.members
    note = ""
    if len(shown) > _MOST_ROWS:
        chosen = np.unique(np.linspace(0, len(shown) - 1, _MOST_ROWS).round().astype(int))
        shown = tuple(front.members[index] for index in chosen)
        note = f"<p>{len(shown)} of {len(front)} members, evenly spaced along the front</p>"
    head = [*(score_name(goal) for goal in front.goals), "layout"]
    rows = [[*_goal_texts(item, front.goals), item.layout.label] for item in shown]
    return _table(head, rows) + note if rows else ""


def _goal_texts(item: Evaluated, goals: Sequence[str]) -> list[str]:
    return [
        euros(item.scores[goal].value)
        if goal == _COST and goal in item.scores
        else score_text(item.scores.get(goal), goal)
        for goal in goals
    ]


def _in_words(item: Evaluated, goals: Sequence[str]) -> str:
    return f"{item.layout.label} [{item.layout.short_key}]: {', '.join(_goal_texts(item, goals))}"


def _front_picture(front: Front, recommended: Mapping[str, Evaluated]) -> str:
    if len(front.goals) < 2 or front.goals[0] != _COST or not front.members:
        return ""
    drawn = draw_front(designs=(), front=front, recommended=recommended, references=(), target_m=None)
    return as_svg(drawn)


def _underside(layout: Layout) -> str:
    """Return antennas and read discs over the tags of the floor, to scale in mm; forward is to the right."""
    groups = layout.floor_readers
    if not groups:
        return ""
    furthest_m = max(float(np.abs(group.poses[:, :2]).max()) + group.antenna.side_m for group in groups)
    half_m = furthest_m + _MARGIN_M
    discs, squares = [], []
    for group in groups:
        for x_m, y_m, z_m, yaw_rad in group.poses.tolist():
            radius = 1000.0 * group.antenna.read_radius_m(z_m)
            discs.append(f'<circle cx="{1000.0 * x_m:.1f}" cy="{-1000.0 * y_m:.1f}" r="{radius:.1f}"/>')
            squares.append(_path(turned(_SQUARE * group.antenna.side_m, yaw_rad) + np.array([x_m, y_m])))
    side = round(2000.0 * half_m)
    line = side / _UNDERSIDE_PIXELS
    corner = f"{-side / 2:g}"
    picture = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{_UNDERSIDE_PIXELS}" height="{_UNDERSIDE_PIXELS}" '
        f'viewBox="{corner} {corner} {side} {side}">'
        f'<rect x="{corner}" y="{corner}" width="{side}" height="{side}" fill="{PAPER}"/>'
        f'<g fill="{SERIES[1]}" fill-opacity="0.35">{"".join(discs)}</g>'
        f"{_outlined(_tag_path(layout, half_m), FAINT, line)}{_outlined(''.join(squares), INK, 1.5 * line)}</svg>"
    )
    return picture + f"<p>antennas, read discs and tags to scale, {side} mm wide; forward is to the right</p>"


def _tag_path(layout: Layout, half_m: float) -> str:
    """Return the outlines of the tags round the robot, of none if they have no period or would be a grey field."""
    if not layout.floor_tags.zones or layout.floor_tags.base.pattern.cell_m is None:
        return ""
    pattern = layout.floor_tags.base.pattern
    tags_m = pattern.points_in((-half_m, -half_m, half_m, half_m))
    size_m = _SQUARE * np.array(layout.floor_tags.tag_size_m)
    return "".join(_path(size_m + place) for place in tags_m) if len(tags_m) <= _MOST_TAGS else ""


def _outlined(path: str, colour: str, width: float) -> str:
    return f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="{width:.2f}"/>' if path else ""


def _path(corners_m: FloatArray) -> str:
    places = (f"{1000.0 * x_m:.1f} {-1000.0 * y_m:.1f}" for x_m, y_m in corners_m)
    return "M" + "L".join(places) + "Z"


def _pairs(rows: Iterable[tuple[str, str]]) -> str:
    cells = "".join(f"<tr><th>{escape(name)}</th><td>{escape(text)}</td></tr>" for name, text in rows)
    return f"<table>{cells}</table>"


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    titles = "".join(f"<th>{escape(text)}</th>" for text in head)
    body = "".join(f"<tr>{''.join(f'<td>{escape(text)}</td>' for text in row)}</tr>" for row in rows)
    return f"<table><thead><tr>{titles}</tr></thead><tbody>{body}</tbody></table>"


def _piece(title: str, text: str, picture: str) -> str:
    return f'<div class="layoutopt"><p><strong>{escape(title)}</strong></p>{text}{picture}</div>'
