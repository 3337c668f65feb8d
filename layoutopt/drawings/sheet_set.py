"""The set of sheets from which a layout is installed: cover, plans, robot, wiring, schedules, templates at 1:1.

Sheets are numbered as installers are used to: G for general, A for the floor, R for the robot, W for wiring, S for
schedules, T for templates.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import Final

import numpy as np

from layoutopt.drawings.cover_sheet import cover_sheet
from layoutopt.drawings.field_sheet import FloorTagsView, field_sheet, field_size_m
from layoutopt.drawings.fields import Field, fields_of, tags_within
from layoutopt.drawings.frame import TitleBlock
from layoutopt.drawings.key_plan import key_plan
from layoutopt.drawings.pattern_template import pattern_template, robot_template
from layoutopt.drawings.robot_sheets import robot_sheets, wiring_rows
from layoutopt.drawings.sheet import PaperName, Sheet
from layoutopt.drawings.sheet_notes import QUICK_LOOK_NOTE, quick_look_title
from layoutopt.drawings.table_sheet import Column, rows_on_sheet, table_sheets
from layoutopt.drawings.tag_grid import FLOOR, TagGroup, tag_groups
from layoutopt.drawings.templates import page_count, page_room_mm, template_sheets
from layoutopt.drawings.transponder_sheet import transponder_sheets
from layoutopt.errors import InvalidInput
from layoutopt.layout import Layout, TagMap, TagPattern
from layoutopt.robot import Robot
from layoutopt.site import Site
from layoutopt.tables.tags import tag_rows

Bounds = tuple[float, float, float, float]

MOST_TAGS: Final = 20_000
"""A set of more tags than this is drawn by area: a schedule of more would be a book."""
PLAN_SCALES: Final = (50, 20, 10)
CLOSEST_MM: Final = 3.0
"""Tags lie at least this far apart on a tag plan, if any of its scales can do that."""
MOST_PAGES: Final = 24
"""A template of a pattern on more pages than this is laid worse than tags are by their dimensions."""
PAPER: Final[PaperName] = "A3"
TEMPLATE_PAPERS: Final[tuple[PaperName, ...]] = ("A3", "A4")
FILL_IN: Final = "to be filled in"

_SCHEDULE: Final = (
    Column(head="tag", width_mm=13.0, number=True),
    Column(head="x mm", width_mm=17.0, number=True),
    Column(head="y mm", width_mm=17.0, number=True),
    Column(head="tile", width_mm=14.0),
    Column(head="state", width_mm=15.0),
    Column(head="laid", width_mm=8.0),
    Column(head="identity", width_mm=36.0),
)
_WIRING: Final = (
    Column(head="module", width_mm=16.0, number=True),
    Column(head="what it is", width_mm=44.0),
    Column(head="port / slot", width_mm=20.0, number=True),
    Column(head="antenna", width_mm=18.0, number=True),
    Column(head="where", width_mm=16.0),
    Column(head="side mm", width_mm=18.0, number=True),
    Column(head="x mm", width_mm=20.0, number=True),
    Column(head="y mm", width_mm=20.0, number=True),
    Column(head="link", width_mm=46.0),
)
_WIRED: Final = (
    "Each robot is wired like this. Modules, ports and antennas are counted from 0, as in readers.yaml.",
    "x and y in mm from base_link, see the sheets R. A module listens at its ports in turn, from port 0.",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """What is to be installed, and how its sheets are called.

    With ``quick_look`` the title of every sheet and the notes of the cover say that a quick look chose the layout.
    """

    layout: Layout
    site: Site
    robot: Robot
    tag_map: TagMap
    title: str
    notes: tuple[str, ...] = ()
    quick_look: bool = False

    def called(self, title: str) -> str:
        """Return a title, marked if a quick look chose the layout."""
        return quick_look_title(title) if self.quick_look else title


def sheet_set(
    job: Job, *, area_m: Bounds | None = None, tags: bool = True, template_paper: PaperName = "A3"
) -> tuple[Sheet, ...]:
    """Return all sheets of a job, or those of a rectangle of its floor, numbered and with an index on the cover.

    Parameters
    ----------
    area_m
        xmin, ymin, xmax, ymax in the floor frame: only tag plans and schedules of fields that meet it are drawn.
    tags
        Whether tag plans and schedules are drawn at all.
    template_paper
        Paper of the templates at 1:1.

    Raises
    ------
    InvalidInput
        If there are more than `MOST_TAGS` tags on the sheets, or no tag in the area.
    """
    groups = tag_groups(job.layout, job.site, job.tag_map)
    scale = plan_scale(groups)
    floor = FloorTagsView(layout=job.layout, site=job.site, tag_map=job.tag_map, groups=groups)
    fields = fields_of(job.site, field_size_m(PAPER, scale, groups))
    drawn = tuple(field for field in fields if tags and (area_m is None or _meets(field, area_m)))
    inside = [tags_within(job.tag_map, field.bounds_m, job.site) for field in drawn]
    if area_m is not None and not sum(map(len, inside)):
        raise InvalidInput.at("area", "there is no tag in it", f"The floor is {_words(job.site.bounds_m)}.")
    if sum(map(len, inside)) > MOST_TAGS:
        raise InvalidInput.at(
            "sheets",
            f"they would show {sum(map(len, inside))} tags",
            f"At most {MOST_TAGS} are drawn at a time: give an area of the floor, {_words(job.site.bounds_m)}.",
        )
    block = title_block(job)
    marks = (QUICK_LOOK_NOTE,) if job.quick_look else ()
    numbers = {field: f"A-{201 + place}" for place, field in enumerate(fields)}
    plans = tuple(
        field_sheet(
            floor,
            field,
            paper=PAPER,
            scale=scale,
            block=replace(
                block, sheet_number=numbers[field], title=f"Tag plan: {block.title}", scale=f"1:{scale}"
            ),
            fields=fields,
            neighbours=_neighbours(field, numbers),
        )
        for field in drawn
    )
    templates, missing = _templates(job, template_paper)
    sheets = (
        key_plan(job.site, numbers, plan_scale=scale, block=replace(block, sheet_number="A-101")),
        *transponder_sheets(
            job.layout, job.site, block=replace(block, title=f"Transponder: {block.title}"), remarks=marks
        ),
        *plans,
        *robot_sheets(job.layout, job.robot, paper=PAPER, block=block),
        *_tables(_WIRING, wiring_rows(job.layout), "W-10", replace(block, title=f"Wiring: {block.title}"), _WIRED),
        *_schedules(job, drawn, inside, numbers, block),
        *templates,
    )
    cover = cover_sheet(
        job.layout,
        job.site,
        job.tag_map,
        (*marks, *job.notes, *missing),
        sheets,
        scale=scale,
        paper=PAPER,
        block=replace(block, title=f"Installation: {block.title}"),
    )
    return (cover, *sheets)


def plan_scale(groups: Sequence[TagGroup]) -> int:
    """Return the scale of the tag plans: the coarsest at which no group is closer than `CLOSEST_MM` on paper."""
    closest_mm = min((group.spacing_mm for group in groups), default=np.inf)
    return next((scale for scale in PLAN_SCALES if closest_mm >= CLOSEST_MM * scale), PLAN_SCALES[-1])


def title_block(job: Job) -> TitleBlock:
    """Return the title block of the cover; other sheets of the set change number, title and scale."""
    return TitleBlock(
        legal_owner=FILL_IN,
        identification_number=job.layout.short_key,
        date_of_issue="-",
        sheet_number="G-001",
        title=job.called(job.title),
        approval_person=FILL_IN,
        creator="layoutopt",
        document_type="Installation drawing",
    )


def _meets(field: Field, area_m: Bounds) -> bool:
    xmin, ymin, xmax, ymax = field.bounds_m
    return xmin < area_m[2] and xmax > area_m[0] and ymin < area_m[3] and ymax > area_m[1]


def _neighbours(field: Field, numbers: dict[Field, str]) -> dict[str, str]:
    places = {(other.column, other.row): number for other, number in numbers.items()}
    around = {"left": (-1, 0), "right": (1, 0), "above": (0, 1), "below": (0, -1)}
    return {
        side: places[place]
        for side, (dx, dy) in around.items()
        if (place := (field.column + dx, field.row + dy)) in places
    }


def _tables(
    columns: Sequence[Column],
    rows: Sequence[Sequence[str]],
    prefix: str,
    block: TitleBlock,
    remarks: Sequence[str],
) -> tuple[Sheet, ...]:
    pages = max(1, -(-len(rows) // rows_on_sheet(columns, PAPER)))
    numbers = [f"{prefix}{page}" for page in range(1, pages + 1)]
    return table_sheets(columns, rows, paper=PAPER, block=block, numbers=numbers, remarks=remarks)


def _schedules(
    job: Job, drawn: Sequence[Field], inside: Sequence[np.ndarray], numbers: dict[Field, str], block: TitleBlock
) -> tuple[Sheet, ...]:
    """Return the schedule of the tags of each plan: S-201-1 and S-201-2 are those of plan A-201."""
    sheets: list[Sheet] = []
    room = rows_on_sheet(_SCHEDULE, PAPER)
    for field, kept in zip(drawn, inside, strict=True):
        if not len(kept):
            continue
        rows = [
            [
                str(row.tag_id),
                f"{1000.0 * (row.x_m - job.site.datum_m[0]) + 0.0:.1f}",
                f"{1000.0 * (row.y_m - job.site.datum_m[1]) + 0.0:.1f}",
                row.tile,
                row.install_status,
                "",
                row.uid or "",
            ]
            for row in tag_rows(job.tag_map.take(kept), job.site, job.layout.floor_tags.tag_part)
        ]
        pages = [f"S-{numbers[field][2:]}-{page + 1}" for page in range(-(-len(rows) // room))]
        sheets += table_sheets(
            _SCHEDULE,
            rows,
            paper=PAPER,
            block=replace(block, title=f"Schedule of tags: {block.title}"),
            numbers=pages,
            remarks=(f"Tags of plan {numbers[field]}; x and y in mm from the datum, as on the plan.",),
        )
    return tuple(sheets)


def _templates(job: Job, paper: PaperName) -> tuple[list[Sheet], list[str]]:
    """Return a template for each pattern and turn of it, then that of the underside; and which there are not."""
    sheets: list[Sheet] = []
    missing: list[str] = []
    number = count(101)
    where: dict[tuple[TagPattern, float], list[str]] = {}
    for entry in job.layout.floor_tags.zones:
        if entry.pattern.cell_m is not None:
            # Tags that were chosen one by one have no period: their template would be the floor.
            where.setdefault((entry.pattern, entry.angle_rad), []).append(entry.zone or FLOOR)
    for (pattern, angle_rad), zones in where.items():
        shown = pattern_template(pattern, job.layout.floor_tags, angle_rad=angle_rad, page_mm=page_room_mm(paper))
        pages = page_count(shown, paper)
        if pages > MOST_PAGES:
            missing.append(
                f"No template of {', '.join(zones)}: the pattern repeats so late that it would take {pages} pages "
                f"of {paper}. Lay its tags by plans and schedules."
            )
            continue
        turn = f"{np.degrees(angle_rad):.3f}".rstrip("0").rstrip(".")
        sheets += template_sheets(
            shown,
            paper=paper,
            number=f"T-{next(number)}",
            title=job.called(f"Tags of {', '.join(zones)}"),
            words=f"Lay the long line along a row of tags, {turn}° from x of the floor. {_periods(pattern)}",
        )
    if not job.layout.floor_readers:
        missing.append("No template of the robot's underside: all antennas are on top of it.")
        return sheets, missing
    sheets += template_sheets(
        robot_template(job.layout, job.robot),
        paper=paper,
        number=f"T-{next(number)}",
        title=job.called("Robot seen from below"),
        words="Hold it against the underside. Long lines: axes of base_link, x to the right, y down.",
    )
    return sheets, missing


def _periods(pattern: TagPattern) -> str:
    """Return by how much the template moves on to the tags beside it."""
    if pattern.cell_m is None:
        return ""
    steps = (f"({x:.1f}, {y:.1f})" for x, y in (1000.0 * pattern.cell_m + 0.0).tolist())
    return f"It repeats after {' and '.join(steps)} mm."


def _words(bounds_m: Bounds) -> str:
    xmin, ymin, xmax, ymax = bounds_m
    return f"{xmin + 0.0:g} to {xmax:g} m by {ymin + 0.0:g} to {ymax:g} m"
