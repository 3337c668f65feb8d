"""Answers that are one page: told by its summary, written as its report."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from layoutopt.protocols import Group
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
