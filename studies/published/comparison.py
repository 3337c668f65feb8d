"""What a paper prints beside what trials gave: ratios with their intervals, tables for people and programs."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from layoutopt.score_text import NOT_KNOWN
from layoutopt.scores import Score, TrialOutcomes, wilson
from studies.page import Data, Table


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """A column of outcomes beside a paper's: SI values times ``factor``, in ``unit``."""

    column: str
    heading: str
    unit: str
    factor: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Compared:
    """One printed number and ours, both in the unit of the quantity.

    Attributes
    ----------
    table, row
        Where the number stands in the paper: number of the table, and labels of its row.
    printed
        ``None`` where the paper prints nothing.
    ours
        ``None`` where the trials failed.
    """

    table: str
    row: tuple[str, ...]
    quantity: Quantity
    printed: float | None
    ours: Score | None

    @property
    def ratio(self) -> Score | None:
        """Ours over the printed number; ``None`` if one is not there or the paper's rounds to zero."""
        if not self.printed or self.ours is None:
            return None
        return scaled(self.ours, 1.0 / self.printed, unit="")

    def within(self, factor: float) -> bool:
        """Return whether the ratio lies between 1 / factor and factor."""
        return self.ratio is not None and 1.0 / factor <= self.ratio.value <= factor


def scaled(score: Score, factor: float, *, unit: str) -> Score:
    """Return a score in another unit."""
    return Score(
        value=score.value * factor, unit=unit, standard_error=score.standard_error * factor, count=score.count
    )


def score_of(outcomes: TrialOutcomes | None, quantity: Quantity) -> Score | None:
    """Return the mean of a quantity over trials, in the paper's unit."""
    if outcomes is None:
        return None
    return scaled(outcomes.score(quantity.column), quantity.factor, unit=quantity.unit)


def paired_ratio(first: TrialOutcomes, second: TrialOutcomes, column: str) -> Score:
    """Return the ratio of the means over the replications that both have, first over second.

    The standard error is that of a ratio of means of pairs (Cochran, Sampling Techniques, 1977, Eq. 2.46): the
    two met the same random numbers, and what these have in common cancels.
    """
    _, left, right = np.intersect1d(first.replications, second.replications, return_indices=True)
    above, below = first.column(column)[left], second.column(column)[right]
    ratio = float(above.mean() / below.mean())
    rest = above - ratio * below
    error = float(rest.std(ddof=1)) / math.sqrt(len(rest)) / float(below.mean()) if len(rest) > 1 else math.inf
    return Score(value=ratio, unit="", standard_error=error, count=len(rest))


def half_width(score: Score) -> float:
    """Return half the width of the two-sided 95 % interval."""
    low, high = score.interval()
    return (high - low) / 2.0


def with_interval(score: Score | None, decimals: int | None = None) -> str:
    """Return value and half-width of the 95 % interval, with as many decimals as the half-width has meaning.

    >>> with_interval(Score(value=3.627, unit="mm", standard_error=0.05, count=30))
    '3.63 ± 0.10'
    """
    if score is None or math.isnan(score.value):
        return NOT_KNOWN
    half = half_width(score)
    if not math.isfinite(half):
        return f"{score.value:.3g}"
    if decimals is None:
        decimals = min(6, max(0, 1 - math.floor(math.log10(half)))) if half > 0.0 else 3
    return f"{score.value:.{decimals}f} ± {half:.{decimals}f}"


def percent_text(hits: int, count: int) -> str:
    """Return a share in per cent with its 95 % interval after Wilson.

    >>> percent_text(7, 10)
    '70.0 (39.7 to 89.2)'
    """
    low, high = wilson(hits, count)
    return f"{100.0 * hits / count:.1f} ({100.0 * low:.1f} to {100.0 * high:.1f})"


def printed_text(value: float | None) -> str:
    """Return a printed number as it stands in the paper, but for zeros at its end."""
    return "–" if value is None else f"{value:g}"


def comparison_table(
    caption: str, row_head: tuple[str, ...], found: Sequence[Compared], *, with_paper: bool = True
) -> Table:
    """Return a table with a row for each row of the paper, and paper, ours and ratio side by side."""
    quantities = list({item.quantity.column: item.quantity for item in found}.values())
    rows: dict[tuple[str, ...], dict[str, Compared]] = {}
    for item in found:
        rows.setdefault(item.row, {})[item.quantity.column] = item
    head = list(row_head)
    for quantity in quantities:
        unit = f", {quantity.unit}"
        head += [f"{quantity.heading}{unit}: paper", "ours", "ratio"] if with_paper else [quantity.heading + unit]
    body = []
    for row, items in rows.items():
        cells = list(row)
        for quantity in quantities:
            item = items[quantity.column]
            ours = with_interval(item.ours)
            if with_paper:
                ratio = "–" if item.ratio is None else with_interval(item.ratio, 2)
                cells += [printed_text(item.printed), ours, ratio]
            else:
                cells.append(ours)
        body.append(tuple(cells))
    return Table(caption=caption, head=tuple(head), rows=tuple(body), words=len(row_head))


def comparison_data(name: str, row_head: tuple[str, ...], found: Sequence[Compared]) -> Data:
    """Return the same in long form: a line a number, values in the unit named."""
    head = ("table", *row_head, "quantity", "unit", "paper", "ours", "ours_low", "ours_high")
    rows = []
    for item in found:
        ours, ratio = item.ours, item.ratio
        rows.append(
            (
                item.table,
                *item.row,
                item.quantity.column,
                item.quantity.unit,
                "" if item.printed is None else f"{item.printed:g}",
                *_ends(ours),
                *_ends(ratio),
                "0" if ours is None else str(ours.count),
            )
        )
    return Data(name=name, head=(*head, "ratio", "ratio_low", "ratio_high", "trials"), rows=tuple(rows))


def _ends(score: Score | None) -> tuple[str, str, str]:
    if score is None or math.isnan(score.value):
        return "", "", ""
    return _number(score.value), _number(score.interval()[0]), _number(score.interval()[1])


def _number(value: float) -> str:
    return f"{value:.9g}" if math.isfinite(value) else ""
