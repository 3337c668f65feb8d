"""Placing templates at 1:1, on as many pages as they take: pattern of the floor, underside of the robot.

Printers scale. So each page has two bars of exactly 100 mm to be measured before anything is placed, and crosses
in the overlap by which neighbouring pages are laid on each other.
"""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from layoutopt.drawings.dimensions import letters
from layoutopt.drawings.lettering import fit_text
from layoutopt.drawings.sheet import PAPERS_MM, Box, Entity, Line, Marks, PaperName, Polyline, Sheet, Text, View
from layoutopt.drawings.text_boxes import full_extent

OVERLAP_MM: Final = 10.0
CHECK_MM: Final = 100.0
_MARGIN_MM: Final = 10.0
_STRIP_MM: Final = 14.0
"""Height below the picture for words and the check bar."""
_SIDE_MM: Final = 12.0
"""Width left of the picture for the upright check bar."""
_AROUND_MM: Final = 4.0


def template_sheets(
    entities: Sequence[Entity], *, paper: PaperName, number: str, title: str, words: str
) -> tuple[Sheet, ...]:
    """Return pages at 1:1 that together show all entities, given in true millimetres.

    Pages are named by column (A, B, ...) and row (1, 2, ...), from the lower left. Neighbours overlap by 10 mm,
    with registration crosses in the middle of the overlap.

    Parameters
    ----------
    number
        Number of the template in the set of sheets.
    words
        What to do with it, one line.
    """
    shown = full_extent(entities, 1)
    window = _window(paper)
    steps = (window.width - OVERLAP_MM, window.height - OVERLAP_MM)
    columns, rows = _pages(shown, steps)
    left = shown.centre[0] - (columns * steps[0] + OVERLAP_MM) / 2.0
    below = shown.centre[1] - (rows * steps[1] + OVERLAP_MM) / 2.0
    crosses = _crosses(left, below, columns, rows, steps)
    sheets = []
    for row in range(rows):
        for column in range(columns):
            name = f"{letters(column)}{row + 1}"
            corner = (left + column * steps[0], below + row * steps[1])
            view = View(
                name=f"{title} {name}",
                scale=1,
                at_mm=(window.xmin, window.ymin),
                origin_mm=corner,
                window_mm=window,
                entities=(*entities, *crosses),
            )
            page = f"page {name} of A1 to {letters(columns - 1)}{rows}" if columns * rows > 1 else "one page"
            sheets.append(
                Sheet(
                    title=f"Template 1:1: {title}",
                    paper=paper,
                    number=number if columns * rows == 1 else f"{number}-{name}",
                    views=(view,),
                    entities=(
                        _frame(window),
                        *_check_bars(window),
                        *_words(window, f"{number}  {page}  {title}", words),
                    ),
                )
            )
    return tuple(sheets)


def page_count(entities: Sequence[Entity], paper: PaperName) -> int:
    """Return how many pages `template_sheets` takes."""
    window = _window(paper)
    return math.prod(_pages(full_extent(entities, 1), (window.width - OVERLAP_MM, window.height - OVERLAP_MM)))


def page_room_mm(paper: PaperName) -> tuple[float, float]:
    """Return width and height of what fits on one page."""
    window = _window(paper)
    return window.width - 2.0 * _AROUND_MM, window.height - 2.0 * _AROUND_MM


def _pages(shown: Box, steps: tuple[float, float]) -> tuple[int, int]:
    """Return how many columns and rows of pages show a box, each page a step beside the one before."""
    columns, rows = (
        max(1, math.ceil((size + 2.0 * _AROUND_MM - OVERLAP_MM) / step - 1e-9))
        for size, step in zip((shown.width, shown.height), steps, strict=True)
    )
    return columns, rows


def _window(paper: PaperName) -> Box:
    width, height = PAPERS_MM[paper]
    return Box(_MARGIN_MM + _SIDE_MM, _MARGIN_MM + _STRIP_MM, width - _MARGIN_MM, height - _MARGIN_MM)


def _crosses(left: float, below: float, columns: int, rows: int, steps: tuple[float, float]) -> tuple[Marks, ...]:
    """Return registration crosses at the corners of pages, in the middle of their overlaps."""
    half = OVERLAP_MM / 2.0
    places = [
        (left + column * steps[0] + half, below + row * steps[1] + half)
        for row in range(rows + 1)
        for column in range(columns + 1)
    ]
    return (Marks(layer="A-TITLE", points_mm=np.array(places), symbol="target", size_mm=6.0, kind="registration"),)


def _check_bars(window: Box) -> list[Entity]:
    """Return a bar of 100 mm along each direction, with ends and words."""
    x, y = window.xmin, window.ymin - 4.0
    upright = window.xmin - 4.0
    foot = window.ymin
    words = "measure: 100 mm"
    return [
        Line(layer="A-TITLE", start_mm=(x, y), end_mm=(x + CHECK_MM, y)),
        *(Line(layer="A-TITLE", start_mm=(end, y - 1.5), end_mm=(end, y + 1.5)) for end in (x, x + CHECK_MM)),
        Text(
            layer="A-TITLE", text=words, position_mm=(x + CHECK_MM + 2.0, y), height_mm=2.5, anchor="middle-left"
        ),
        Line(layer="A-TITLE", start_mm=(upright, foot), end_mm=(upright, foot + CHECK_MM)),
        *(
            Line(layer="A-TITLE", start_mm=(upright - 1.5, end), end_mm=(upright + 1.5, end))
            for end in (foot, foot + CHECK_MM)
        ),
        Text(
            layer="A-TITLE",
            text=words,
            position_mm=(upright - 2.5, foot + CHECK_MM / 2.0),
            height_mm=2.5,
            anchor="centre",
            angle_deg=90.0,
        ),
    ]


def _words(window: Box, first: str, second: str) -> list[Entity]:
    """Return number, page and title, and what to do, in two lines below the check bar."""
    entities: list[Entity] = []
    for words, foot in ((first, window.ymin - 9.0), (second, window.ymin - 13.0)):
        fitted, height_mm = fit_text(words, window.width, 2.5)
        entities.append(
            Text(
                layer="A-TITLE",
                text=fitted,
                position_mm=(window.xmin, foot),
                height_mm=height_mm,
                anchor="left",
            )
        )
    return entities


def _frame(window: Box) -> Polyline:
    corners = [
        (window.xmin, window.ymin),
        (window.xmax, window.ymin),
        (window.xmax, window.ymax),
        (window.xmin, window.ymax),
    ]
    return Polyline(layer="A-TITLE", points_mm=np.array(corners), closed=True)
