"""Answers that are one page: told by its summary, written as its report."""

import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

from layoutopt.layout import Layout
from layoutopt.protocols import Group
from layoutopt.result import Status
from layoutopt.spec.building import Spec
from layoutopt.spec.layout_file import write_layout
from layoutopt.streams import Streams
from studies.page import REPORT, Page, write_page
from studies.page_frame import closing_lines


@dataclass(frozen=True, slots=True, kw_only=True)
class PageAnswer:
    """What a study of a page found.

    Attributes
    ----------
    study
        Name of the study in the table of studies.
    summary
        The answer in a few sentences, the first of which answers the question.
    page
        Makes the page only when it is to be written, because its figures take time.
    failures
        Messages of tasks that raised, by group.
    found
        Whether what was asked for was found; if not, the next step is another.
    nothing_tried
        Whether no trial could be run, so that no report is written that could be named.
    """

    study: str
    summary: tuple[str, ...]
    page: Callable[[Streams], Page]
    failures: Mapping[Group, str]
    found: bool = True
    nothing_tried: bool = False

    @property
    def exit_code(self) -> int:
        """Zero, unless a task failed."""
        return 1 if self.failures else 0

    def lines(self, folder: Path | None) -> list[str]:
        """Return the answer, how sure it is, what to do next, failures, and where to look."""
        lines = [*self.summary, *closing_lines(self.study, found=self.found)]
        lines += [f"failed: {text}" for text in sorted(set(self.failures.values()))]
        return lines if folder is None or self.nothing_tried else [*lines, f"report: {folder / REPORT}"]

    def write(
        self,
        folder: Path,
        *,
        streams: Streams,
        quick: bool,
        links: Mapping[str, str] = MappingProxyType({}),
    ) -> None:
        """Write tables, figures and report; ``links`` are further files of the folder, with what they are."""
        write_page(self.page(streams), folder, quick=quick, links=links)


@dataclass(frozen=True, slots=True, kw_only=True)
class LayoutsAnswer:
    """A page with the layouts on it, each as a file of its own; ``status`` says how the search ended."""

    page: PageAnswer
    layouts: tuple[Layout, ...]
    spec: Spec
    status: Status = Status.SEARCHED

    @property
    def exit_code(self) -> int:
        """That of the status, or one if a task failed."""
        return self.status.exit_code or self.page.exit_code

    def lines(self, folder: Path | None) -> list[str]:
        """Return the answer, how sure it is, what to do next, failures, and where to look."""
        return replace(self.page, found=self.status.exit_code == 0).lines(folder)

    def write(self, folder: Path, *, streams: Streams, quick: bool) -> None:
        """Write tables, figures, report and a file for each layout; those of an earlier run go first.

        The files of a quick look carry its mark, see `layoutopt.spec.layout_file.write_layout`.
        """
        shutil.rmtree(folder / "layouts", ignore_errors=True)
        (folder / "layouts").mkdir()
        links = {}
        for layout in self.layouts:
            link = f"layouts/{layout.short_key}.toml"
            write_layout(layout, self.spec, folder / link, quick_look=quick)
            links[link] = f"layout {layout.label}"
        self.page.write(folder, streams=streams, quick=quick, links=links)
