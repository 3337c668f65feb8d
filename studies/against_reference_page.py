"""The page of the search against the published layout: the front, the comparisons, and what binds."""

from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np

from layoutopt.plots.curves import Curve, Panel, draw_curves
from layoutopt.score_text import euros, percent_text
from layoutopt.scores import Score
from studies.against_reference_results import (
    ERROR,
    REFERENCE,
    Compared,
    Found,
    Results,
    binding,
    reference_faults,
    summary,
)
from studies.page import Data, Page, Picture, Section, Table
from studies.published.comparison import half_width, scaled, with_interval

TITLE: Final = "Search against the published layout"


def page_of(results: Results, *, facts: Mapping[str, str]) -> Page:
    """Return the whole page."""
    sections = [_reference(results)]
    if results.rows:
        sections += [_front(results), _comparisons(results), _binding(results)]
    return Page(
        study="against_reference",
        title=TITLE,
        summary=tuple(summary(results)),
        sections=tuple(sections),
        facts=facts,
        data=(
            _reference_data(results),
            *((_compared_data(results), _layout_data(results)) if results.rows else ()),
        ),
        found=bool(results.found) or not results.refused,
    )


def _reference(results: Results) -> Section:
    faults = reference_faults(results)
    fits = f"It cannot be built under this robot: {'; '.join(faults)}." if faults else "It fits under this robot."
    driven = [(place, table) for place, table in results.driven.items() if place[1] == REFERENCE]
    rows = tuple(
        (filter_name, scenario, _mm(table.score(ERROR)), _mm(table.score("position_error_p95")))
        for (filter_name, _, scenario), table in driven
    )
    return Section(
        heading="The published layout",
        paragraphs=(
            "Eight readers of 60 mm at 24 mm above 100 tags/m² (mi2016, combination array; coordinates "
            f"reconstructed), with the paper's reader profile, on the floor of the spec: "
            f"{euros(results.reference_cost_eur)}. {fits}",
            "Layouts that were searched leave out the tags that no antenna can come near enough to read, because "
            "the robot keeps its circle free of walls and obstacles. Without such tags the published layout would "
            f"cost {euros(results.reference_in_reach_eur)}; all cost ratios here are to the one as published.",
        ),
        parts=(
            Table(
                caption="Its errors on the held-out drives, mm, with 95 % intervals",
                head=("filter", "scenario", "mean", "95 % of a drive"),
                rows=rows,
                words=2,
            ),
        )
        if rows
        else (),
    )


def _front(results: Results) -> Section:
    scenarios = tuple(dict.fromkeys(row.scenario for row in results.rows))
    figure = draw_curves([_panel(results, scenario) for scenario in scenarios])
    rows = tuple(
        (
            item.filter,
            percent_text(item.share),
            item.layout.short_key,
            item.layout.label,
            f"{item.cost_eur:.2f}",
            percent_text(item.cost_eur / results.reference_cost_eur, 1),
            _mm(item.scores.get(ERROR)),
            str(item.layouts),
            str(item.trials),
        )
        for item in results.found
    )
    return Section(
        heading="The front",
        paragraphs=(
            "The most accurate layout that each search found within its budget. A search picks what was lucky on "
            "its drives; the error given in the table is that of fresh drives of the design scenario, which no "
            "stage of the search has seen, and the figure shows held-out drives. Each layout has a "
            "file in layouts/.",
        ),
        parts=(
            Picture(
                name="front",
                caption="Mean position error on held-out drives over cost, with 95 % intervals. The published "
                "layout costs 1; its error is drawn as a level.",
                drawn=figure,
            ),
            Table(
                caption="Layouts found; mean position error on fresh drives with its 95 % interval",
                head=(
                    "filter",
                    "budget",
                    "layout",
                    "readers and tags",
                    "cost, EUR",
                    "of the reference",
                    "error, mm",
                    "layouts tried",
                    "drives",
                ),
                rows=rows,
                words=4,
            ),
        ),
    )


def _panel(results: Results, scenario: str) -> Panel:
    curves = []
    for name in dict.fromkeys(item.filter for item in results.found):
        rows = {
            row.found.share: row for row in results.rows if row.scenario == scenario and row.found.filter == name
        }
        found = [rows[share] for share in sorted(rows)]
        x = np.array([row.found.cost_eur / results.reference_cost_eur for row in found])
        errors = [scaled(row.error, 1000.0, unit="mm") for row in found]
        halves = np.array([half_width(score) for score in errors])
        curves.append(
            Curve(
                name=f"found, {name}",
                x=x,
                y=np.array([score.value for score in errors]),
                half_width=halves if np.isfinite(halves).all() else np.empty(0),
            )
        )
        table = results.driven.get((name, REFERENCE, scenario))
        if table is not None:
            level = scaled(table.score(ERROR), 1000.0, unit="mm")
            half = half_width(level)
            curves.append(
                Curve(
                    name=f"published, {name}",
                    x=np.array([0.0, 1.0]),
                    y=np.full(2, level.value),
                    half_width=np.array([0.0, half]) if np.isfinite(half) else np.empty(0),
                )
            )
    return Panel(
        title=scenario,
        x_label="cost over that of the published layout",
        y_label="mean position error (mm)",
        curves=tuple(curves),
    )


def _comparisons(results: Results) -> Section:
    rows = tuple(
        (
            row.found.filter,
            row.reference_filter,
            row.scenario,
            percent_text(row.found.cost_eur / results.reference_cost_eur, 1),
            _mm(row.error),
            _mm(row.reference_error),
            with_interval(row.ratio),
            f"{row.ratio.upper():.3f}",
            "yes" if row.as_accurate else "no",
        )
        for row in results.rows
    )
    return Section(
        heading="Against the published layout",
        paragraphs=(
            "Layout and reference met the same drives, so the ratio of their mean errors is paired. A layout "
            "counts as at least as accurate if the one-sided 95 % bound of the ratio is at most 1.",
        ),
        parts=(
            Table(
                caption="Errors in mm and their ratio, with 95 % intervals",
                head=(
                    "filter",
                    "reference's filter",
                    "scenario",
                    "cost ratio",
                    "error",
                    "reference",
                    "ratio",
                    "at most",
                    "as accurate",
                ),
                rows=rows,
                words=3,
            ),
        ),
    )


def _binding(results: Results) -> Section:
    rows = []
    for item in results.found:
        found = binding(item.layout, results)
        rows.append(
            (
                item.filter,
                percent_text(item.share),
                str(found.antennas),
                _millimetres(found.side_m),
                _millimetres(found.height_m),
                f"{_millimetres(found.radius_m)} of {_millimetres(found.widest_radius_m)}",
                _millimetres(found.antenna_room_m),
                _millimetres(found.outline_room_m),
                f"{found.tags_per_m2:.1f}",
                _millimetres(found.tag_room_m),
                percent_text(found.floor_eur / item.cost_eur),
            )
        )
    return Section(
        heading="What binds",
        paragraphs=(
            "The budget binds every search by its make. Room is what a rule leaves: zero means that it binds. The "
            "last column is the share of the cost that goes into the floor; the rest are readers.",
        ),
        parts=(
            Table(
                caption="Antennas, tags and their room, in mm",
                head=(
                    "filter",
                    "budget",
                    "antennas",
                    "side",
                    "height",
                    "disc radius",
                    "antenna room",
                    "outline room",
                    "tags/m²",
                    "tag room",
                    "floor's share",
                ),
                rows=tuple(rows),
                words=2,
            ),
        ),
    )


def _reference_data(results: Results) -> Data:
    costs = (f"{results.reference_cost_eur:.2f}", f"{results.reference_in_reach_eur:.2f}")
    rows = [
        (filter_name, scenario, *_numbers(table.score(ERROR)), str(len(table)), *costs)
        for (filter_name, place, scenario), table in results.driven.items()
        if place == REFERENCE
    ]
    errors = ("error_m", "error_low_m", "error_high_m")
    return Data(
        name="reference",
        head=("filter", "scenario", *errors, "trials", "cost_eur", "cost_in_reach_eur"),
        rows=tuple(rows),
    )


def _compared_data(results: Results) -> Data:
    return Data(
        name="comparisons",
        head=(
            *("filter", "reference_filter", "scenario", "budget_share", "layout", "cost_ratio"),
            *(
                "error_m",
                "error_low_m",
                "error_high_m",
                "ratio",
                "ratio_low",
                "ratio_high",
                "ratio_upper_95",
                "trials",
            ),
        ),
        rows=tuple(_compared_rows(results)),
    )


def _compared_rows(results: Results) -> Iterator[tuple[str, ...]]:
    row: Compared
    for row in results.rows:
        yield (
            row.found.filter,
            row.reference_filter,
            row.scenario,
            f"{row.found.share:g}",
            row.found.layout.short_key,
            f"{row.found.cost_eur / results.reference_cost_eur:.6g}",
            *_numbers(row.error),
            *_numbers(row.ratio),
            f"{row.ratio.upper():.6g}",
            str(row.ratio.count),
        )


def _layout_data(results: Results) -> Data:
    item: Found
    rows = []
    for item in results.found:
        found = binding(item.layout, results)
        lengths_m = (
            *(found.side_m, found.height_m, found.radius_m, found.antenna_room_m, found.outline_room_m),
            found.tag_room_m,
        )
        rows.append(
            (
                item.filter,
                f"{item.share:g}",
                item.layout.key,
                item.layout.label,
                f"{item.cost_eur:.2f}",
                f"{found.floor_eur:.2f}",
                str(found.antennas),
                f"{found.tags_per_m2:.6g}",
                *(f"{value:.6g}" if np.isfinite(value) else "" for value in lengths_m),
                str(item.layouts),
                str(item.trials),
            )
        )
    return Data(
        name="layouts",
        head=(
            *("filter", "budget_share", "layout", "label", "cost_eur", "floor_eur", "antennas", "tags_per_m2"),
            *("side_m", "height_m", "radius_m", "antenna_room_m", "outline_room_m", "tag_room_m"),
            *("layouts", "search_trials"),
        ),
        rows=tuple(rows),
    )


def _mm(score: Score | None) -> str:
    return with_interval(None if score is None else scaled(score, 1000.0, unit="mm"))


def _millimetres(length_m: float) -> str:
    return f"{1000.0 * length_m:.1f}" if np.isfinite(length_m) else "–"


def _numbers(score: Score) -> tuple[str, str, str]:
    low, high = score.interval()
    return f"{score.value:.6g}", f"{low:.6g}", f"{high:.6g}"
