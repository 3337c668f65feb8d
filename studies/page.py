"""Reports of studies that are not about one front: text, tables and figures on a page that needs nothing else."""

import re
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from layoutopt.atomic_file import replacing
from layoutopt.journal import FROZEN_SPEC, JOURNAL, MANIFEST
from layoutopt.tables.cells import text_cell, write_csv
from studies.page_frame import NOT_FOUND, card_of, frame_of

if TYPE_CHECKING:
    from layoutopt.plots.figures import Drawn

REPORT: Final = "report.html"
_MADE_ANEW: Final = ("figures", "tables")
_ALWAYS_TOLD: Final = ("Seed", "Trials")
_RECORDS: Final = {
    FROZEN_SPEC: "the spec of this study, with everything that a file named by it held",
    JOURNAL: "the outcomes of all trials",
    MANIFEST: "seed, versions and processor",
}
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
    """A whole report, of which each study gives what is its own; the frame about it is the same for all.

    In this order stand: question, answer, how sure it is and what to do next, the first figure, the sections,
    how it was measured, words, sources and files. Question, next step and source are those of the study's card.

    Attributes
    ----------
    study
        Name of the study in the table of studies.
    title
        Heading.
    summary
        The answer in a few sentences, each a paragraph, the first of which answers the question.
    sections
        One figure of them stands before them all, because it answers at a glance.
    lead
        Name of that figure; the first one if it is empty or was not drawn.
    facts
        ``"Seed"``, ``"Trials"`` and other facts by name, with ``"Prices"`` where money is told; nothing that
        differs from run to run.
    found
        Whether what was asked for was found. If it was not, the colour of the summary shows it, and the page says
        what to do instead of the study's next step.

    Raises
    ------
    ValueError
        If seed or trials are not told, or two figures have one name.
    """

    study: str
    title: str
    summary: tuple[str, ...]
    sections: tuple[Section, ...]
    facts: Mapping[str, str]
    data: tuple[Data, ...] = field(default=())
    lead: str = ""
    found: bool = True

    def __post_init__(self) -> None:
        """Check that everything is told that a reader needs to judge the figures."""
        if untold := [name for name in _ALWAYS_TOLD if name not in self.facts]:
            raise ValueError(f"page of {self.study}: the facts have to tell {' and '.join(untold)}")
        names = [picture.name for picture in self.pictures]
        if len(set(names)) < len(names):
            raise ValueError(f"page of {self.study}: figures need different names, got {names}")

    @property
    def pictures(self) -> tuple[Picture, ...]:
        """All figures in their order."""
        return tuple(part for section in self.sections for part in section.parts if isinstance(part, Picture))

    @property
    def leading(self) -> Picture | None:
        """The figure that stands before the sections; none where nothing was drawn."""
        drawn = self.pictures
        return next((one for one in drawn if one.name == self.lead), drawn[0] if drawn else None)

    @property
    def text(self) -> str:
        """All its words, in which the frame looks for what it has to explain."""
        words = [self.title, *self.summary, *self.facts.values()]
        for section in self.sections:
            words += [section.heading, *section.paragraphs]
            for part in section.parts:
                words.append(part.caption)
                if isinstance(part, Table):
                    words += [*part.head, *(cell for row in part.rows for cell in row)]
        return "\n".join(words)


def write_page(page: Page, folder: Path, *, quick: bool, links: Mapping[str, str] = MappingProxyType({})) -> None:
    """Write tables, figures and report; what an earlier run left of them goes first.

    ``links`` are further files of the folder that the page leads to, with what they are.
    """
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
    for picture in page.pictures:
        svg, _ = save(picture.drawn, folder / "figures" / picture.name)
        figures[picture.name] = inline_svg(svg.read_text(encoding="utf-8"))
    records = {name: told for name, told in _RECORDS.items() if (folder / name).exists()}
    with replacing(folder / REPORT) as temporary:
        temporary.write_text(
            _rendered(page, figures, quick=quick, files={**links, **_tables(page), **records}),
            encoding="utf-8",
            newline="\n",
        )


def _tables(page: Page) -> dict[str, str]:
    return {f"tables/{data.name}.csv": "numbers of tables and figures, in SI units" for data in page.data}


def _rendered(page: Page, figures: Mapping[str, str], *, quick: bool, files: Mapping[str, str]) -> str:
    from jinja2 import Environment, StrictUndefined
    from markupsafe import Markup

    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.tests["table"] = lambda part: isinstance(part, Table)
    environment.tests["listing"] = lambda part: isinstance(part, Listing)
    package = resources.files("studies")
    return environment.from_string(package.joinpath("page.html").read_text("utf-8")).render(
        page=page,
        quick=quick,
        style=Markup(package.joinpath("style.css").read_text("utf-8")),
        figures={name: Markup(svg) for name, svg in figures.items()},
        lead=page.leading,
        next_step=card_of(page.study).next_step if page.found else NOT_FOUND,
        frame=frame_of(page.study, page.text, quick=quick),
        anchors=[_anchor(section.heading) for section in page.sections],
        files=files,
    )


def _anchor(heading: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", heading.lower()).strip("-")
