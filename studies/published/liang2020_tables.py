"""Cells and tables of the liang2020 page."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Final

from layoutopt.scores import TrialOutcomes
from studies.page import Table
from studies.published.comparison import half_width, printed_text, with_interval
from studies.published.liang2020_orderings import GOAL
from studies.published.medians import median

HEAD: Final = ("paper, m", "median, m (95 % interval)", "mean, m")
"""Head of what `error_cells` gives."""


def error_cells(printed: float | None, table: TrialOutcomes | None) -> tuple[str, str, str]:
    """Return the printed number, our median and our mean with their intervals; dashes where there is none."""
    if table is None:
        return printed_text(printed), "–", "–"
    return printed_text(printed), median(table.column(GOAL)).text, with_interval(table.score(GOAL), 3)


def share_cell(table: TrialOutcomes | None, column: str = "detection_share") -> str:
    """Return the mean of a share in percent with its interval."""
    if table is None:
        return "–"
    # Between walks: how the share varies, not what no walk showed.
    score = replace(table.score(column), share=False)
    return f"{100.0 * score.value:.1f} ± {100.0 * half_width(score):.1f} %"


def table_of(
    caption: str, head: tuple[str, ...], rows: Iterable[tuple[str, ...]], *, words: int = 1
) -> tuple[Table, ...]:
    """Return the table, or nothing without a row."""
    rows = tuple(rows)
    return (Table(caption=caption, head=head, rows=rows, words=words),) if rows else ()
