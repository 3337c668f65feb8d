"""The page of the estimator comparison: errors, how much of the gap to the limit each closes, faults, recovery."""

import math
from collections.abc import Mapping
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.plots.ratios import RatioRow, draw_ratios
from layoutopt.scores import Score, TrialOutcomes
from studies.cells import UNFINISHED
from studies.page import Data, Page, Picture, Section, Table
from studies.published.comparison import paired_ratio, scaled, with_interval

Found = Mapping[tuple[str, int, str], TrialOutcomes]
GOAL: Final = "position_error_mean"
LIMIT: Final = "bayes_limit, 30,000"
BASE: Final = "mcl, 500"
_NO_ROBOT: Final = "bayes_limit"
"""Takes more particles than a robot has time for: it stands for the limit."""
_WORDS: Final = {
    "as planned": "Nothing goes wrong but the odometry.",
    "faults": "Tags 3 mm off, one in a hundred dead, two scans in a hundred missed, one read in a hundred "
    "misread, a soft edge of 2 mm. No estimator is told.",
    "kidnapped": "After 20 s the robot is lifted and put down elsewhere.",
}


def gap_closed(base: TrialOutcomes, ours: TrialOutcomes, limit: TrialOutcomes, column: str = GOAL) -> Score:
    """Return which share of the way from one estimator's error to the limit's another one goes.

    All three met the same drives; the standard error is that of the delete-one jackknife (Efron and Stein, Ann.
    Statist. 9, 1981) over the replications that all have.
    """
    shared = np.array(sorted(set(base.replications) & set(ours.replications) & set(limit.replications)))
    errors = [table.column(column)[np.isin(table.replications, shared)] for table in (base, ours, limit)]
    count = len(shared)
    value = _share(*(float(error.mean()) for error in errors))
    if count < 2:
        return Score(value=value, unit="", standard_error=math.inf, count=max(count, 1))
    without = [(error.sum() - error) / (count - 1) for error in errors]
    parts = np.array([_share(*means) for means in zip(*without, strict=True)])
    spread = math.sqrt((count - 1) / count * float(((parts - parts.mean()) ** 2).sum()))
    return Score(value=value, unit="", standard_error=spread, count=count)


def _share(base: float, ours: float, limit: float) -> float:
    return (base - ours) / (base - limit)


def summary(found: Found) -> list[str]:
    """Return the answer in a few sentences."""
    lines: list[str] = []
    for density in _densities(found):
        tables = _tables(found, "as planned", density)
        able = {label: table for label, table in tables.items() if not label.startswith(_NO_ROBOT)}
        if not lines and able:
            best = min(able, key=lambda label: able[label].score(GOAL).value)
            lines.append(
                f"{best} errs least of those that a robot can run: {_mm(able[best], GOAL)} mm with 8 readers and "
                f"{density} tags/m². It was picked on the drives that it is told of, which flatters it a little."
            )
        base, limit = found.get(("as planned", density, BASE)), found.get(("as planned", density, LIMIT))
        if base is None or limit is None:
            continue
        shares = [
            f"{label.partition(',')[0]} {100.0 * gap_closed(base, table, limit).value:.0f} %"
            for label, table in tables.items()
            if label in ("mcl_crossings, 500", "mcl_negative_information, 500", "mcl_adaptive, 100 to 4,000")
        ]
        lines.append(
            f"8 readers, {density} tags/m²: mean position error {_mm(base, GOAL)} mm with mcl (500 particles), "
            f"{_mm(limit, GOAL)} mm at the limit; this gap is closed by {', '.join(shares)}."
        )
    return lines or [UNFINISHED]


def page_of(found: Found, seed: int, failed: int) -> Page:
    """Return the whole page."""
    names = list(dict.fromkeys(name for name, _, _ in found))
    counts = sorted({len(table) for table in found.values()})
    return Page(
        study="estimator_comparison",
        title="Estimators on the same readings",
        summary=tuple(summary(found)),
        sections=tuple(_section(found, name) for name in names),
        facts={
            "World": "8 readers of mi2016 over square lattices, circle of 0.5 m at 100 mm/s for 60 s, noise of "
            "30 mm/s and 0.05 rad/s, known start",
            "Seed": str(seed),
            "Trials": f"{sum(map(len, found.values()))}; {' or '.join(map(str, counts))} a cell",
            "Failed tasks": str(failed),
            "Intervals": "± is half the width of the two-sided 95 % interval over trials (Student); ratios and "
            "shares are paired by drive",
        },
        data=(_data(found),),
    )


def _section(found: Found, name: str) -> Section:
    rows, ratios = [], []
    lifted = name == "kidnapped"
    for density in _densities(found):
        tables = _tables(found, name, density)
        base, limit = tables.get(BASE), tables.get(LIMIT)
        for label, table in tables.items():
            closed = "–" if base is None or limit is None else with_interval(gap_closed(base, table, limit), 2)
            rows.append(
                (
                    str(density),
                    label,
                    str(len(table)),
                    _mm(table, GOAL),
                    _mm(table, "position_error_p95"),
                    with_interval(scaled(table.score("heading_error_mean"), 1e3, unit="mrad")),
                    "–" if base is None else with_interval(paired_ratio(table, base, GOAL), 2),
                    closed if label != "odometry" else "–",
                    _nees(table),
                    with_interval(table.score("lost_share"), 3),
                    *([with_interval(table.score("recovery_time"))] if lifted else []),
                )
            )
            if base is not None and label not in (BASE, "odometry", "midrange"):
                low, high = paired_ratio(table, base, GOAL).interval()
                ratio = paired_ratio(table, base, GOAL).value
                ends = (ratio, max(low, 1e-3), high if math.isfinite(high) else ratio)
                ratios.append((label, f"{density} tags/m²", ends))
    by_label: dict[str, dict[str, tuple[float, float, float]]] = {}
    for label, series, ends in ratios:
        by_label.setdefault(label, {})[series] = ends
    picture = Picture(
        name=f"ratios_{name.replace(' ', '_')}",
        caption="Mean position error over that of mcl with 500 particles, paired by drive, with 95 % intervals.",
        drawn=draw_ratios(
            [RatioRow(label=label, ratios=series) for label, series in by_label.items()],
            bands=(),
            x_label=f"error over that of {BASE} particles",
        ),
    )
    head = ("tags/m²", "estimator, particles", "trials", "position, mm", "95 %, mm", "heading, mrad")
    return Section(
        heading=name.capitalize(),
        paragraphs=(_WORDS[name],),
        parts=(
            picture,
            Table(
                caption=f"Errors of each trial, averaged over trials: {name}",
                head=(
                    *head,
                    "position over mcl's",
                    "gap closed",
                    "NEES",
                    "share lost",
                    *(["recovery, s"] if lifted else []),
                ),
                rows=tuple(rows),
                words=2,
            ),
        ),
    )


def _densities(found: Found) -> list[int]:
    return list(dict.fromkeys(density for _, density, _ in found))


def _tables(found: Found, name: str, density: int) -> dict[str, TrialOutcomes]:
    return {label: table for (world, tags, label), table in found.items() if (world, tags) == (name, density)}


def _nees(table: TrialOutcomes) -> str:
    nees = table.score("nees").value
    return "–" if math.isnan(nees) else f"{nees:.3g}"


def _mm(table: TrialOutcomes, column: str) -> str:
    return with_interval(scaled(table.score(column), 1e3, unit="mm"))


def _data(found: Found) -> Data:
    columns = (GOAL, "position_error_p95", "heading_error_mean", "lost_share", "nees", "recovery_time")
    rows = []
    for (name, density, label), table in found.items():
        cells = [name, str(density), label, str(len(table))]
        for column in columns:
            score = table.score(column)
            cells += [_plain(score.value), _plain(score.standard_error)]
        rows.append(tuple(cells))
    head = ("world", "tags_per_m2", "estimator", "trials", *(f"{c}{s}" for c in columns for s in ("", "_se")))
    return Data(name="estimators", head=head, rows=tuple(rows))


def _plain(value: float | FloatArray) -> str:
    return f"{float(value):.9g}" if math.isfinite(float(value)) else ""
