"""Reports of studies that are not about one front: text, tables and figures on a page that needs nothing else."""

import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Final

from layoutopt.atomic_file import replacing
from layoutopt.tables.cells import text_cell, write_csv

if TYPE_CHECKING:
    from layoutopt.plots.figures import Drawn

REPORT: Final = "report.html"
_MADE_ANEW: Final = ("figures", "tables")
_NUMBER: Final = re.compile(r"-?\d+(\.\d+)?(e[-+]?\d+)?")


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """A table as people read it; the first ``words`` columns are words, the others numbers.

    Raises
    ------
    ValueError
        If a row has not as many cells as the head.
    """

    caption: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    words: int = 1

    def __post_init__(self) -> None:
        """Check the widths."""
        if any(len(row) != len(self.head) for row in self.rows):
            raise ValueError(f"table '{self.caption}': every row needs {len(self.head)} cells")


@dataclass(frozen=True, slots=True, kw_only=True)
class Data:
    """A table as programs read it: SI units in the head, a cell a value; written to ``tables/NAME.csv``."""

    name: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """A figure that was drawn, written to ``figures/NAME.svg`` and ``.png``."""

    name: str
    caption: str
    drawn: "Drawn"


@dataclass(frozen=True, slots=True, kw_only=True)
class Listing:
    """Lines to be copied as they stand, into a spec for example."""

    caption: str
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """A heading with paragraphs, then pictures, tables and listings in their order."""

    heading: str
    paragraphs: tuple[str, ...] = ()
    parts: tuple[Table | Picture | Listing, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Page:
    """A whole report.

    Attributes
    ----------
    title, question
        Heading, and the question that the study answers.
    summary
        The answer in a few sentences, each a paragraph.
    facts
        Seed, counts and other facts by name; nothing that differs from run to run.
    refused
        Whether what was asked for was not found, which the colour of the summary shows.
    """

    title: str
    question: str
    summary: tuple[str, ...]
    sections: tuple[Section, ...]
    facts: Mapping[str, str]
    data: tuple[Data, ...] = field(default=())
    refused: bool = False


def write_page(page: Page, folder: Path, *, quick: bool) -> None:
    """Write tables, figures and report; what an earlier run left of them goes first."""
    from layoutopt.plots.figures import inline_svg, save

    for name in _MADE_ANEW:
        shutil.rmtree(folder / name, ignore_errors=True)
        (folder / name).mkdir()
    for data in page.data:
        write_csv(
            folder / "tables" / f"{data.name}.csv",
            list(data.head),
            [[cell if _NUMBER.fullmatch(cell) else text_cell(cell) for cell in row] for row in data.rows],
        )
    figures = {}
    for picture in _pictures(page):
        svg, _ = save(picture.drawn, folder / "figures" / picture.name)
        figures[picture.name] = inline_svg(svg.read_text(encoding="utf-8"))
    with replacing(folder / REPORT) as temporary:
        temporary.write_text(_rendered(page, figures, quick=quick), encoding="utf-8", newline="\n")


def render_page(page: Page, *, quick: bool) -> str:
    """Return the report as one HTML page without scripts or anything to be loaded."""
    from layoutopt.plots.figures import as_svg

    return _rendered(page, {picture.name: as_svg(picture.drawn) for picture in _pictures(page)}, quick=quick)


def _rendered(page: Page, figures: Mapping[str, str], *, quick: bool) -> str:
    from jinja2 import Environment, StrictUndefined
    from markupsafe import Markup

    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.tests["table"] = lambda part: isinstance(part, Table)
    environment.tests["listing"] = lambda part: isinstance(part, Listing)
    files = resources.files("studies")
    return environment.from_string(files.joinpath("page.html").read_text("utf-8")).render(
        page=page,
        quick=quick,
        style=Markup(files.joinpath("style.css").read_text("utf-8")),
        figures={name: Markup(svg) for name, svg in figures.items()},
        anchors=[_anchor(section.heading) for section in page.sections],
        data=[f"tables/{data.name}.csv" for data in page.data],
    )


def _pictures(page: Page) -> Sequence[Picture]:
    found = [part for section in page.sections for part in section.parts if isinstance(part, Picture)]
    names = [picture.name for picture in found]
    if len(set(names)) < len(names):
        raise ValueError(f"figures need different names, got {names}")
    return found


def _anchor(heading: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", heading.lower()).strip("-")
