"""What the robustness study found: both layouts, the price of robustness, error against tolerance."""

from collections.abc import Mapping, Sequence

import numpy as np

from layoutopt.plots.curves import Curve, Panel, draw_curves
from layoutopt.problem import Limit
from layoutopt.score_text import (
    euros,
    interval_text,
    score_name,
    score_text,
    shown_unit,
)
from solvers.robust import Combined
from studies import columns
from studies.page import Data, Page, Picture, Section, Table
from studies.published.comparison import half_width
from studies.robustness_findings import SWEEP, Judged, RobustnessFindings
from studies.robustness_words import combined_text, faults_text, judged_by, price_lines, summary, tolerance_text


def page_of(found: RobustnessFindings, *, prices: str) -> Page:
    """Return the whole page; ``prices`` names the price list and its date."""
    sections = [_choices_section(found)] if found.choices else []
    sections += [_sweep_section(found)] if any(sweep.scores for sweep in found.sweeps) else []
    sections += [_worlds_section(found), _contenders_section(found)] if found.contenders else []
    return Page(
        study="robustness",
        title="Robust layouts",
        summary=tuple(summary(found)),
        sections=tuple(sections),
        facts={
            "Seed": str(found.seed),
            "Estimator": found.problem.estimators[0].name,
            "Prices": prices,
            "Trials": f"{found.trials}, scenario {found.nominal.name}; all layouts and all worlds share their "
            "random numbers",
            "Failed tasks": str(len(found.failures)),
            "Intervals": "two-sided 95 % (Student) for one world; over the tolerance the one-sided 95 % bound of "
            "the worst case or quantile",
        },
        data=(_contenders_data(found), _worlds_data(found)),
        found=found.status.exit_code == 0,
    )


def _choices_section(found: RobustnessFindings) -> Section:
    goals = found.problem.goals
    rows = [
        (
            name,
            f"{choice.judged.evaluated.layout.label} [{choice.judged.evaluated.layout.short_key}]",
            euros(choice.judged.evaluated.scores[goals[0]].value),
            score_text(choice.judged.scores[0], goals[1]),
            combined_text(choice.judged, goals[1]),
            "yes" if choice.held else "not shown",
        )
        for name, choice in found.choices.items()
    ]
    head = (
        "for",
        "layout",
        "cost",
        "as planned",
        "over the tolerance",
        "limits met" if found.limits else "chosen",
    )
    return Section(
        heading="Two layouts",
        paragraphs=(
            f"Over the tolerance means {judged_by(found)}: {tolerance_text(found.tolerance)}.",
            *price_lines(found),
        ),
        parts=(Table(caption=f"{score_name(goals[1])}", head=head, rows=tuple(rows), words=2),),
    )


def _sweep_section(found: RobustnessFindings) -> Section:
    goal = found.problem.goals[1]
    factor, unit = shown_unit(goal)
    names = {key: name for key, (name, _) in _chosen(found).items()}
    curves = []
    for sweep in found.sweeps:
        if sweep.scores is None:
            continue
        halves = factor * np.array([half_width(score) for score in sweep.scores])
        curves.append(
            Curve(
                name=f"{names[sweep.layout_key]} layout",
                x=100.0 * np.array(sweep.shares),
                y=factor * np.array([score.value for score in sweep.scores]),
                half_width=halves if np.isfinite(halves).all() else np.empty(0),
            )
        )
    for limit in found.limits:
        if limit.score == goal:
            level = np.full(2, factor * limit.end)
            curves.append(Curve(name="demand, at most", x=100.0 * np.array([SWEEP[0], SWEEP[-1]]), y=level))
    panel = Panel(
        title="",
        x_label="share of the tolerance used by all ranges together (%)",
        y_label=f"{score_name(goal)} ({unit})" if unit else score_name(goal),
        curves=tuple(curves),
    )
    return Section(
        heading="Error against tolerance",
        paragraphs=("At 0 % every range is at its low end, at 100 % at its high end.",),
        parts=(
            Picture(
                name="error_against_tolerance",
                caption="Mean over drives with two-sided 95 % intervals; the same drives at every point. A demand "
                "is met where its one-sided bound over all worlds meets it, not where a point lies below it.",
                drawn=draw_curves([panel]),
            ),
        ),
    )


def _worlds_section(found: RobustnessFindings) -> Section:
    goal = found.problem.goals[1]
    chosen = dict(_chosen(found).values())
    rows = tuple(
        (
            "as planned" if number == 0 else faults_text(scenario),
            *(f"{score_text(judged.scores[number], goal)}" for judged in chosen.values()),
            *(interval_text(judged.scores[number], goal) for judged in chosen.values()),
        )
        for number, scenario in enumerate((found.nominal, *found.scenarios))
    )
    head = ("world", *(f"{name}" for name in chosen), *(f"{name}, 95 % interval" for name in chosen))
    return Section(heading="World by world", parts=(Table(caption=score_name(goal), head=head, rows=rows),))


def _contenders_section(found: RobustnessFindings) -> Section:
    goals = found.problem.goals
    rows = tuple(
        (
            f"{judged.evaluated.layout.label} [{judged.evaluated.layout.short_key}]",
            _met_text(judged.robust, found.limits),
            euros(judged.evaluated.scores[goals[0]].value),
            score_text(judged.scores[0], goals[1]),
            combined_text(judged, goals[1]),
        )
        for judged in found.contenders
    )
    return Section(
        heading="All contenders",
        paragraphs=(
            "The finalists nearest to the front of the search as planned, and to that of the search with all "
            "faults at the high ends of the tolerance. A limit counts as met here as a search takes it: a share "
            "by the spread that its drives showed.",
        ),
        parts=(
            Table(
                caption=score_name(goals[1]),
                head=("layout", "limits missed", "cost", "as planned", "over the tolerance"),
                rows=rows,
                words=2,
            ),
        ),
    )


def _chosen(found: RobustnessFindings) -> dict[str, tuple[str, Judged]]:
    """Return name and scores of each chosen layout by its key; one that is chosen for both has both names."""
    names: dict[str, tuple[str, Judged]] = {}
    for name, choice in found.choices.items():
        key = choice.judged.evaluated.layout.key
        names[key] = (f"{names[key][0]} and {name}" if key in names else name, choice.judged)
    return names


def _met_text(scores: Mapping[str, Combined], limits: Sequence[Limit]) -> str:
    missed = [score_name(limit.score) for limit in limits if not scores[limit.score].met_in_search(limit)]
    return ", ".join(missed) or "–"


def _contenders_data(found: RobustnessFindings) -> Data:
    cost, goal = found.problem.goals[:2]
    unit = f"_{columns.unit_of(goal)}" if columns.unit_of(goal) else ""
    rows = []
    for judged in found.contenders:
        nominal, robust = judged.scores[0], judged.robust[goal]
        key = judged.evaluated.layout.key
        roles = [name for name, choice in found.choices.items() if choice.judged.evaluated.layout.key == key]
        numbers = (
            judged.evaluated.scores[cost].value,
            nominal.value,
            nominal.standard_error,
            robust.value,
            robust.lower,
            robust.upper,
        )
        rows.append(
            (
                key,
                judged.evaluated.layout.label,
                " ".join(roles),
                str(nominal.count),
                *map(columns.number, numbers),
            )
        )
    names = ("nominal", "nominal_se", "robust", "robust_lower", "robust_upper")
    head = ("layout", "label", "chosen_for", "trials", "cost_eur", *(f"{name}{unit}" for name in names))
    return Data(name="contenders", head=head, rows=tuple(rows))


def _worlds_data(found: RobustnessFindings) -> Data:
    rows = []
    for judged in found.contenders:
        for number, (scenario, score) in enumerate(
            zip((found.nominal, *found.scenarios), judged.scores, strict=True)
        ):
            faults = scenario.faults
            numbers = (
                faults.tag_placement_sigma_m,
                faults.dead_tag_share,
                faults.missed_read_share,
                faults.antenna_height_error_m,
                score.value,
                score.standard_error,
            )
            rows.append(
                (judged.evaluated.layout.key, str(number), str(score.count), *map(columns.number, numbers))
            )
    head = ("layout", "world", "trials", "tag_placement_sigma_m", "dead_tag_share", "missed_read_share")
    goal = found.problem.goals[1]
    errors = columns.named(goal, columns.unit_of(goal))
    return Data(name="worlds", head=(*head, "antenna_height_error_m", *errors), rows=tuple(rows))
