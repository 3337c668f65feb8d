"""Everything that goes to those who install and use a layout, written into one folder."""

from collections.abc import Callable
from pathlib import Path
from typing import Final

from layoutopt.drawings.dxf import render_dxf
from layoutopt.drawings.layout_sheet import layout_sheet
from layoutopt.drawings.pdf import render_pdf
from layoutopt.drawings.sheet import PaperName
from layoutopt.drawings.sheet_notes import QUICK_LOOK_NOTE, quick_look_title
from layoutopt.drawings.sheet_set import MOST_TAGS, Bounds, Job, sheet_set, title_block
from layoutopt.drawings.svg import render_svg
from layoutopt.drawings.transponder_sheet import transponder_sheets
from layoutopt.layout import Layout
from layoutopt.parts import bill_of_needs, needs
from layoutopt.score_text import counted_text
from layoutopt.spec.building import Spec
from layoutopt.tables.bill import write_bill_csv
from layoutopt.tables.readers import write_readers_urdf, write_readers_yaml
from layoutopt.tables.robot_map import write_robot_map
from layoutopt.tables.tag_files import tag_header, write_tag_files
from layoutopt.tables.tags import tag_rows
from layoutopt.tables.transponders import write_transponders_csv
from layoutopt.tables.work_plan import work_plan, write_work_plan_csv

MOST_ON_ONE_SHEET: Final = 100_000
"""A single sheet with more tags than this is a grey area, and a file that no program opens."""
_TIME_OF_ONE: Final = "half a second to a second each"
"""Measured: 0.51 s and 0.55 s of a processor on wards of 1,002 and 8,919 tags (19 and 93 sheets)."""
_LISTS: Final = ("S", "W")
"""Kinds of sheets that are tables: only the PDF holds them, since the tables are files of their own."""


def write_overview(
    spec: Spec, layout: Layout, folder: Path, *, title: str = "", quick_look: bool = False
) -> list[Path]:
    """Write the sheet with the whole layout, as PDF, SVG and DXF, and all tables; return the files.

    Without a title the sheet says what is to be installed, see `overview_title`; with ``quick_look`` title and
    notes say that nobody should install from it. A layout of more than `MOST_ON_ONE_SHEET` tags gets tables only.
    """
    folder.mkdir(parents=True, exist_ok=True)
    tag_map = layout.floor_tags.lay_on(spec.site)
    if len(tag_map) > MOST_ON_ONE_SHEET:
        return write_tables(spec, layout, folder)
    called = title or overview_title(layout)
    sheet = layout_sheet(
        layout=layout,
        site=spec.site,
        robot=spec.robot,
        tag_map=tag_map,
        title=quick_look_title(called) if quick_look else called,
        notes=(QUICK_LOOK_NOTE,) if quick_look else (),
    )
    paths = [folder / f"sheet.{suffix}" for suffix in ("pdf", "svg", "dxf")]
    for render, path in zip((render_pdf, render_svg, render_dxf), paths, strict=True):
        render(sheet, path)
    return [*paths, *write_tables(spec, layout, folder)]


def overview_title(layout: Layout) -> str:
    """Return what is to be installed, in one line."""
    parts = [
        name
        for name, there in (
            ("floor tags", layout.floor_tags.zones or layout.floor_tags.edits),
            ("readers", layout.floor_readers),
            ("UHF antennas", layout.readers_of("signal")),
            ("docking antennas", layout.readers_of("direction")),
            ("transponders", layout.transponders),
        )
        if there
    ]
    return f"Installation of {' and '.join(filter(None, [', '.join(parts[:-1]), parts[-1]]))}"


def write_transponder_sheets(
    spec: Spec, layout: Layout, folder: Path, *, title: str, quick_look: bool = False
) -> list[Path]:
    """Write where each transponder of a layout goes, as PDF, SVG and DXF; return the files.

    With ``quick_look`` title and notes say that nobody should install from them.
    """
    folder.mkdir(parents=True, exist_ok=True)
    job = Job(
        layout=layout,
        site=spec.site,
        robot=spec.robot,
        tag_map=layout.floor_tags.lay_on(spec.site),
        title=title,
        quick_look=quick_look,
    )
    remarks = (QUICK_LOOK_NOTE,) if quick_look else ()
    paths = []
    for number, sheet in enumerate(
        transponder_sheets(layout, spec.site, block=title_block(job), remarks=remarks), start=1
    ):
        name = "transponder" if number == 1 else f"transponder_{number}"
        for suffix, render in (("pdf", render_pdf), ("svg", render_svg), ("dxf", render_dxf)):
            paths.append(folder / f"{name}.{suffix}")
            render(sheet, paths[-1])
    return paths


def write_tables(spec: Spec, layout: Layout, folder: Path) -> list[Path]:
    """Write tag map, reader poses, transponders, bill, work plan and robot map of a layout; return the files.

    Bill and work are of the tags that are not installed yet.
    """
    tag_map = layout.floor_tags.lay_on(spec.site)
    to_lay = tag_map.to_lay()
    found = needs(layout, len(to_lay), spec.robot_count, spec.reader_part)
    tables = [folder / name for name in ("readers.yaml", "readers.urdf", "bill_of_material.csv", "work_plan.csv")]
    write_readers_yaml(tables[0], layout)
    write_readers_urdf(tables[1], layout)
    write_bill_csv(tables[2], bill_of_needs(found, spec.robot_count, spec.prices))
    write_work_plan_csv(tables[3], work_plan(found, to_lay, spec.site, spec.robot_count, spec.prices))
    header = tag_header(layout, spec.site, len(tag_map))
    tables += write_tag_files(folder, header, tag_rows(tag_map, spec.site, layout.floor_tags.tag_part))
    if layout.transponders:
        tables.append(folder / "transponders.csv")
        write_transponders_csv(tables[-1], layout)
    return [*tables, *write_robot_map(folder, spec.site)]


def write_sheets(
    spec: Spec,
    layout: Layout,
    folder: Path,
    *,
    title: str,
    area_m: Bounds | None = None,
    template_paper: PaperName = "A3",
    quick_look: bool = False,
    note: Callable[[str], None] | None = None,
) -> tuple[list[Path], str]:
    """Write the set of sheets for the installer: one PDF, and SVG and DXF of each drawing.

    A floor of more than `MOST_TAGS` tags gets its tag plans and schedules only by area.

    Parameters
    ----------
    area_m, template_paper
        As in `sheet_set`.
    quick_look
        Whether the title of every sheet and the cover's notes say that nobody should install from them.
    note
        Is told how many sheets there are, and how long they take, before the first is drawn.

    Returns
    -------
        The files, and what was left out; empty if nothing was.
    """
    folder.mkdir(parents=True, exist_ok=True)
    tag_map = layout.floor_tags.lay_on(spec.site)
    job = Job(layout=layout, site=spec.site, robot=spec.robot, tag_map=tag_map, title=title, quick_look=quick_look)
    whole = area_m is not None or len(tag_map) <= MOST_TAGS
    sheets = sheet_set(job, area_m=area_m, tags=whole, template_paper=template_paper)
    if note is not None:
        note(f"{counted_text(len(sheets), 'sheet')} to draw, {_TIME_OF_ONE}")
    paths = [folder / "installation.pdf"]
    render_pdf(sheets, paths[0])
    for sheet in sheets:
        if sheet.number[0] not in _LISTS:
            for suffix, render in (("svg", render_svg), ("dxf", render_dxf)):
                paths.append(folder / f"{sheet.number}.{suffix}")
                render(sheet, paths[-1])
    left_out = "" if whole else f"{len(tag_map)} tags: their plans and schedules are drawn by area, see --area"
    return paths, left_out
