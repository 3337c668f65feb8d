"""What the robustness study found: both layouts, the price of robustness, error against tolerance."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from layoutopt.plots.curves import Curve, Panel, draw_curves
from layoutopt.problem import Limit, Problem
from layoutopt.protocols import Group
from layoutopt.result import Evaluated, Status
from layoutopt.scenario import Scenario
from layoutopt.score_text import (
    NOT_KNOWN,
    euros,
    interval_text,
    limit_text,
    quantity_text,
    score_name,
    score_text,
    shown_unit,
)
from layoutopt.scores import SCORE_UNITS, Score
from layoutopt.streams import Streams
from layoutopt.tolerance import Tolerance
from layoutopt.units import format_length
from solvers.conflicts import conflict_text, conflicts_of
from solvers.robust import Combined
from studies.page import REPORT, Data, Page, Picture, Section, Table, write_page
from studies.published.comparison import half_width

QUESTION: Final = "What does it cost to be safe against how it is installed?"


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged:
    """A contender: its scores in the nominal world and over the tolerance, and its goal in each world.

    ``scores`` begin with the nominal world.
    """

    evaluated: Evaluated
    nominal: Mapping[str, Combined]
    robust: Mapping[str, Combined]
    scores: tuple[Score, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """A layout chosen; ``held`` if its deciding drives met every limit, ``tried`` how many got such drives."""

    judged: Judged
    held: bool
    tried: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Price:
    """What robustness costs, in money and in the goal; differences are paired on common drives.

    Attributes
    ----------
    cost_eur
        The robust layout's cost less the nominal one's.
    loss
        What the nominal layout loses in the world that is worst for it, against the nominal world.
    gain
        By how much the robust layout is better in that world.
    nominal_gain
        By how much it is better in the nominal world.
    hardest
        That world.
    """

    cost_eur: float
    loss: Score
    gain: Score
    nominal_gain: Score
    hardest: Scenario


@dataclass(frozen=True, slots=True, kw_only=True)
class Sweep:
    """The goal of a layout at rising shares of the tolerance; ``None`` where a trial failed."""

    layout_key: str
    shares: tuple[float, ...]
    scores: tuple[Score, ...] | None


@dataclass(frozen=True, slots=True, kw_only=True)
class RobustnessFindings:
    """Everything that the robustness study hands to its readers.

    Attributes
    ----------
    limits
        Those on simulated scores.
    refusal
        Why no layout may be judged at all.
    choices
        ``nominal`` and ``robust``, as far as there is such a layout.
    """

    problem: Problem
    limits: tuple[Limit, ...]
    seed: int
    tolerance: Tolerance
    nominal: Scenario
    scenarios: tuple[Scenario, ...]
    refusal: str
    contenders: tuple[Judged, ...]
    choices: Mapping[str, Choice]
    price: Price | None
    sweeps: tuple[Sweep, ...]
    failures: Mapping[Group, str]

    @property
    def status(self) -> Status:
        """How the study ended."""
        if self.refusal:
            return Status.INFEASIBLE
        robust = self.choices.get("robust")
        if robust is None or not robust.held:
            return Status.TARGET_NOT_MET
        return Status.TARGET_MET if self.limits else Status.SEARCHED


@dataclass(frozen=True, slots=True, kw_only=True)
class RobustnessAnswer:
    """The findings, ready to be told and written."""

    findings: RobustnessFindings

    @property
    def exit_code(self) -> int:
        """That of the status; one if a task failed."""
        return self.findings.status.exit_code or int(bool(self.findings.failures))

    def lines(self, folder: Path | None) -> list[str]:
        """Return status, both layouts, the price of robustness, and where to look."""
        failed = [f"failed: {text}" for text in sorted(set(self.findings.failures.values()))]
        lines = [*summary(self.findings), *failed]
        return lines if folder is None or not self.findings.contenders else [*lines, f"report: {folder / REPORT}"]

    def write(self, folder: Path, *, streams: Streams, quick: bool) -> None:
        """Write tables, figure and report."""
        write_page(page_of(self.findings), folder, quick=quick)


def tolerance_text(tolerance: Tolerance) -> str:
    """Return the ranges in words."""
    lengths = {
        "tags off their place by": tolerance.placement_m,
        "antennas too high by": tolerance.antenna_height_m,
    }
    shares = {"dead tags": tolerance.dead_tags, "missed reads": tolerance.missed_reads}
    told = [
        f"{words} {format_length(low)} to {format_length(high)}"
        for words, (low, high) in lengths.items()
        if low < high
    ]
    told += [
        f"{words} {100.0 * low:.3g} to {100.0 * high:.3g} %" for words, (low, high) in shares.items() if low < high
    ]
    return ", ".join(told) or "no range has any width"


def judged_by(found: RobustnessFindings) -> str:
    """Return in words how scores over the tolerance are made one."""
    if found.tolerance.combine == "worst":
        return f"the worst of {len(found.scenarios)} corners"
    return f"the {found.tolerance.quantile:.0%} quantile over {len(found.scenarios)} drawn installations"


def summary(found: RobustnessFindings) -> list[str]:
    """Return the answer in a few sentences."""
    lines = [found.status.value]
    if found.refusal:
        return [*lines, f"Shortfall: {found.refusal}."]
    lines.append(f"Tolerance: {tolerance_text(found.tolerance)}; judged by {judged_by(found)}.")
    if found.limits:
        lines.append(f"Demand: {'; '.join(limit_text(limit) for limit in found.limits)}.")
    lines += [_choice_text(found, name, choice) for name, choice in found.choices.items()]
    lines += _price_lines(found)
    if found.status is Status.TARGET_NOT_MET and found.contenders:
        text = robust_conflict(found)
        lines += [f"Over the tolerance: {text}."] if text else []
    lines.append(
        f"{len(found.contenders)} contenders judged, estimator {found.problem.estimators[0].name}, "
        f"seed {found.seed}"
    )
    return lines


def robust_conflict(found: RobustnessFindings) -> str:
    """Return which limits no contender meets together over the tolerance, by its bounds; empty if none."""
    items = [
        Evaluated(
            layout=judged.evaluated.layout,
            scores={
                **judged.evaluated.scores,
                **{
                    limit.score: Score(
                        value=judged.robust[limit.score].bound(limit), unit=judged.robust[limit.score].unit
                    )
                    for limit in found.limits
                },
            },
        )
        for judged in found.contenders
    ]
    return conflict_text(conflicts_of(found.limits, items), "judged over the tolerance")


def _choice_text(found: RobustnessFindings, name: str, choice: Choice) -> str:
    goal = found.problem.goals[1]
    item, judged = choice.judged.evaluated, choice.judged
    if not found.limits:
        why = "the knee of cost against error in its worlds"
    elif choice.held:
        why = f"the cheapest shown to meet every limit, {_counted(choice.tried)} tried"
    else:
        why = f"not shown to meet every limit, {_counted(choice.tried)} tried; the nearest to it"
    return (
        f"{name}: {item.layout.label} [{item.layout.short_key}], "
        f"{euros(item.scores[found.problem.goals[0]].value)}; "
        f"{score_name(goal)} {score_text(judged.scores[0], goal)} as planned, "
        f"{_combined_text(judged, goal)} over the tolerance; {why}"
    )


def _price_lines(found: RobustnessFindings) -> list[str]:
    price, goal = found.price, found.problem.goals[1]
    if price is None:
        return []
    plain, safe = (found.choices[name].judged.evaluated.layout for name in ("nominal", "robust"))
    lines = [
        f"Left as it is, the nominal layout loses {score_text(price.loss, goal, signed=True)} in the world that "
        f"is worst for it ({faults_text(price.hardest)})."
    ]
    if not all(choice.held for choice in found.choices.values()):
        return [*lines, "Without a layout shown to meet every limit in both there is no price of robustness."]
    if plain.key == safe.key:
        return [*lines, "The nominal layout is the robust one: to be safe costs nothing."]
    sign = "-" if price.cost_eur < 0.0 else "+"
    return [
        *lines,
        f"Price of robustness: {sign}{euros(abs(price.cost_eur))}; for it the robust layout is better by "
        f"{score_text(price.gain, goal, signed=True)} in that world and by "
        f"{score_text(price.nominal_gain, goal, signed=True)} as planned.",
    ]


def faults_text(scenario: Scenario) -> str:
    """Return the faults that a tolerance speaks of, in words."""
    faults = scenario.faults
    height_m = faults.antenna_height_error_m
    return (
        f"tags off by {format_length(faults.tag_placement_sigma_m)}, {100.0 * faults.dead_tag_share:.3g} % dead, "
        f"{100.0 * faults.missed_read_share:.3g} % of reads missed"
        + (f", antennas {1000.0 * height_m:+.3g} mm" if height_m else "")
    )


def page_of(found: RobustnessFindings) -> Page:
    """Return the whole page."""
    sections = [_choices_section(found)] if found.choices else []
    sections += [_sweep_section(found)] if any(sweep.scores for sweep in found.sweeps) else []
    sections += [_worlds_section(found), _contenders_section(found)] if found.contenders else []
    return Page(
        title="Robust layouts",
        question=QUESTION,
        summary=tuple(summary(found)),
        sections=tuple(sections),
        facts={
            "Command": "layoutopt study robustness",
            "Seed": str(found.seed),
            "Estimator": found.problem.estimators[0].name,
            "Drives": f"scenario {found.nominal.name}; all layouts and all worlds share their random numbers",
            "Failed tasks": str(len(found.failures)),
            "Intervals": "two-sided 95 % (Student) for one world; over the tolerance the one-sided 95 % bound of "
            "the worst case or quantile",
        },
        data=(_contenders_data(found), _worlds_data(found)),
    )


def _choices_section(found: RobustnessFindings) -> Section:
    goals = found.problem.goals
    rows = [
        (
            name,
            f"{choice.judged.evaluated.layout.label} [{choice.judged.evaluated.layout.short_key}]",
            euros(choice.judged.evaluated.scores[goals[0]].value),
            score_text(choice.judged.scores[0], goals[1]),
            _combined_text(choice.judged, goals[1]),
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
            *_price_lines(found),
        ),
        parts=(Table(caption=f"{score_name(goals[1])}", head=head, rows=tuple(rows), words=2),),
    )


def _sweep_section(found: RobustnessFindings) -> Section:
    goal = found.problem.goals[1]
    factor, unit = shown_unit(goal)
    names: dict[str, str] = {}
    for name, choice in found.choices.items():
        key = choice.judged.evaluated.layout.key
        names[key] = f"{names[key]} and {name}" if key in names else name
    curves = tuple(
        Curve(
            name=f"{names[sweep.layout_key]} layout",
            x=100.0 * np.array(sweep.shares),
            y=factor * np.array([score.value for score in sweep.scores]),
            half_width=factor * np.array([_finite(half_width(score)) for score in sweep.scores]),
        )
        for sweep in found.sweeps
        if sweep.scores is not None
    )
    panel = Panel(
        title="",
        x_label="share of the tolerance used by all ranges together, %",
        y_label=f"{score_name(goal)}, {unit}".rstrip(", "),
        curves=curves,
    )
    return Section(
        heading="Error against tolerance",
        paragraphs=("At 0 % every range is at its low end, at 100 % at its high end.",),
        parts=(
            Picture(
                name="error_against_tolerance",
                caption="Mean over drives with two-sided 95 % intervals; the same drives at every point.",
                drawn=draw_curves([panel]),
            ),
        ),
    )


def _worlds_section(found: RobustnessFindings) -> Section:
    goal = found.problem.goals[1]
    chosen = {name: choice.judged for name, choice in found.choices.items()}
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
            euros(judged.evaluated.scores[goals[0]].value),
            score_text(judged.scores[0], goals[1]),
            _combined_text(judged, goals[1]),
            _met_text(judged.robust, found.limits),
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
                head=("layout", "cost", "as planned", "over the tolerance", "limits missed"),
                rows=rows,
            ),
        ),
    )


def _met_text(scores: Mapping[str, Combined], limits: Sequence[Limit]) -> str:
    missed = [score_name(limit.score) for limit in limits if not scores[limit.score].met_in_search(limit)]
    return ", ".join(missed) or "–"


def _combined_text(judged: Judged, name: str) -> str:
    """Return value and bound on the bad side of a score over the tolerance."""
    found, like = judged.robust[name], judged.scores[0]
    if math.isnan(found.value):
        return NOT_KNOWN
    bound = f"at most {quantity_text(found.upper, like, name)}" if math.isfinite(found.upper) else "no bound"
    return f"{quantity_text(found.value, like, name)} ({bound})"


def _contenders_data(found: RobustnessFindings) -> Data:
    cost, goal = found.problem.goals[:2]
    unit = _unit_suffix(goal)
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
            (key, judged.evaluated.layout.label, " ".join(roles), str(nominal.count), *map(_plain, numbers))
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
            rows.append((judged.evaluated.layout.key, str(number), str(score.count), *map(_plain, numbers)))
    head = ("layout", "world", "trials", "tag_placement_sigma_m", "dead_tag_share", "missed_read_share")
    goal, unit = found.problem.goals[1], _unit_suffix(found.problem.goals[1])
    errors = (f"{goal}{unit}", f"{goal}_se{unit}")
    return Data(name="worlds", head=(*head, "antenna_height_error_m", *errors), rows=tuple(rows))


def _unit_suffix(name: str) -> str:
    unit = SCORE_UNITS[name.rpartition(".")[2]]
    return f"_{unit}" if unit else ""


def _counted(layouts: int) -> str:
    return f"{layouts} layout{'s' if layouts != 1 else ''}"


def _plain(value: float) -> str:
    return f"{value:.9g}" if math.isfinite(value) else ""


def _finite(value: float) -> float:
    return value if math.isfinite(value) else 0.0
