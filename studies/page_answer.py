"""Answers that are one page: told by its summary, written as its report."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from layoutopt.layout import Layout
from layoutopt.protocols import Group
from layoutopt.result import Status
from layoutopt.spec.building import Spec
from layoutopt.spec.layout_file import write_layout
from layoutopt.streams import Streams
from studies.page import REPORT, Page, write_page


@dataclass(frozen=True, slots=True, kw_only=True)
class PageAnswer:
    """What a study of a page found.

    ``page`` makes the page only when it is to be written, because its figures take time; ``failures`` are the
    messages of tasks that raised, by group.
    """

    summary: tuple[str, ...]
    page: Callable[[Streams], Page]
    failures: Mapping[Group, str]

    @property
    def exit_code(self) -> int:
        """Zero, unless a task failed."""
        return 1 if self.failures else 0

    def lines(self, folder: Path | None) -> list[str]:
        """Return the summary, failures, and where to look."""
        lines = [*self.summary, *(f"failed: {text}" for text in sorted(set(self.failures.values())))]
        return lines if folder is None else [*lines, f"report: {folder / REPORT}"]

    def write(self, folder: Path, *, streams: Streams, quick: bool) -> None:
        """Write tables, figures and report."""
        write_page(self.page(streams), folder, quick=quick)


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
        """Return the summary, failures, and where to look."""
        return self.page.lines(folder)

    def write(self, folder: Path, *, streams: Streams, quick: bool) -> None:
        """Write tables, figures, report and a file for each layout."""
        self.page.write(folder, streams=streams, quick=quick)
        (folder / "layouts").mkdir(exist_ok=True)
        for layout in self.layouts:
            write_layout(layout, self.spec, folder / "layouts" / f"{layout.short_key}.toml")
