"""Do I need RFID here? The demand held against dead reckoning on the same held-out drives as the layouts."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum, unique
from typing import Final

from layoutopt.problem import Limit
from layoutopt.score_text import interval_text, score_name, score_text
from layoutopt.scores import OUTCOME_UNITS, Score, Scores
from studies.findings import Findings

QUESTION: Final = "Do I need RFID here?"
_WORDS: Final = {"odometry": "odometry alone", "odometry_gyro": "odometry with a gyro of this class"}


@unique
class Need(Enum):
    """Whether tags are needed; the value is the answer in short."""

    NEEDED = "Yes"
    NOT_NEEDED = "Perhaps not"
    UNDECIDED = "Not decided"
    NO_TARGET = "No target was set"
    NOT_ASKED = "Not asked"


@dataclass(frozen=True, slots=True, kw_only=True)
class Reckoning:
    """Dead reckoning in one held-out scenario: its error, that of the recommended layout, and the verdict.

    ``verdict`` is ``"met"``, ``"broken"`` or ``"undecided"`` over all demands, empty if there are none.
    """

    estimator: str
    scenario: str
    error: Score
    layout_error: Score | None
    verdict: str

    @property
    def words(self) -> str:
        """The estimator in words."""
        return _WORDS.get(self.estimator, self.estimator)


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """The answer, a sentence that gives its reason in numbers, and the rows that it rests on."""

    need: Need
    sentence: str
    rows: tuple[Reckoning, ...]

    @property
    def text(self) -> str:
        """The answer with its sentence."""
        return f"{self.need.value}: {self.sentence}"


def need_for_tags(findings: Findings) -> Verdict:
    """Return whether the demand can be met without tags.

    It can if some estimator that needs odometry alone is shown to meet every simulated demand in every held-out
    scenario, and it cannot if each of them is shown to break one. The confidence of the demands, 95 % as a rule,
    is that of the whole answer: the chance of error is divided among all that could bring it about (Bonferroni).

    Such estimators read no tags, so their errors are the same beside every layout; where layouts differ in the
    number of drives, the row with most of them counts. A demand on the consistency of a filter is no demand on
    the robot and is left out.
    """
    problem, goal = findings.problem, findings.problem.goals[1]
    names = [one.name for one in problem.estimators if one.card.needs == "odometry"]
    demands = [limit for limit in problem.limits if _is_demand(limit)]
    found = {
        (name, scenario.name): scores
        for name in names
        for scenario in problem.held_out
        if (scores := _most_tried(findings, name, scenario.name, goal)) is not None
    }
    tried = list(dict.fromkeys(name for name, _ in found))
    if not tried:
        sentence = "no estimator without tags was run; put odometry into study.validate_with."
        return Verdict(need=Need.NOT_ASKED, sentence=sentence, rows=())
    checks = len(demands) * len(problem.held_out)
    rows = tuple(
        Reckoning(
            estimator=name,
            scenario=scenario,
            error=scores[goal],
            layout_error=_layout_error(findings, scenario),
            verdict=_verdict(demands, scores, of_all=len(tried), of_any=checks),
        )
        for (name, scenario), scores in found.items()
    )
    need = _need(rows, tried, len(problem.held_out))
    return Verdict(need=need, sentence=_sentence(need, rows, findings), rows=rows)


def _is_demand(limit: Limit) -> bool:
    quantity = limit.score.rpartition(".")[2]
    return quantity in OUTCOME_UNITS and quantity != "nees"


def _most_tried(findings: Findings, estimator: str, scenario: str, goal: str) -> Scores | None:
    rows = [
        row.scores
        for row in findings.validations
        if row.estimator == estimator
        and row.scenario == scenario
        and row.scores is not None
        and goal in row.scores
    ]
    return max(rows, key=lambda scores: scores[goal].count, default=None)


def _layout_error(findings: Findings, scenario: str) -> Score | None:
    """Return the error of the first recommended layout with the estimator of the search."""
    first = next(iter(findings.result.recommended.values()), None)
    own = findings.problem.estimators[0].name
    for row in findings.validations:
        if first is not None and (row.layout_key, row.scenario, row.estimator) == (
            first.layout.key,
            scenario,
            own,
        ):
            return (row.scores or {}).get(findings.problem.goals[1])
    return None


def _verdict(demands: Sequence[Limit], scores: Scores, *, of_all: int, of_any: int) -> str:
    """Return the verdict over all demands.

    The chance of error of "met" is divided by ``of_all``, the number of estimators, one of which has to meet
    everything; that of "broken" by ``of_any``, the number of demands on one estimator, one of which has to break.
    """
    if not demands:
        return ""
    known = [(limit, scores[limit.score]) for limit in demands if limit.score in scores]
    if any(_stricter(limit, of_any).broken(score) for limit, score in known):
        return "broken"
    met = len(known) == len(demands) and all(_stricter(limit, of_all).met(score) for limit, score in known)
    return "met" if met else "undecided"


def _stricter(limit: Limit, number: int) -> Limit:
    return replace(limit, confidence=1.0 - (1.0 - limit.confidence) / number)


def _need(rows: Sequence[Reckoning], estimators: Sequence[str], scenarios: int) -> Need:
    verdicts = {name: [row.verdict for row in rows if row.estimator == name] for name in estimators}
    if any("" in own for own in verdicts.values()):
        return Need.NO_TARGET
    if any(own == ["met"] * scenarios for own in verdicts.values()):
        return Need.NOT_NEEDED
    return Need.NEEDED if all("broken" in own for own in verdicts.values()) else Need.UNDECIDED


def _sentence(need: Need, rows: Sequence[Reckoning], findings: Findings) -> str:
    goal = findings.problem.goals[1]
    worst = [_worst([row.error for row in rows if row.words == words]) for words in _estimators(rows)]
    errors = [
        f"{_error_text(error, goal)} for {words}" for words, error in zip(_estimators(rows), worst, strict=True)
    ]
    figures = (
        f"on held-out drives of {findings.problem.design.duration_s:g} s the {score_name(goal)} without tags is "
        f"{' and '.join(errors)}"
    )
    beside = [row.layout_error for row in rows if row.layout_error is not None]
    if beside:
        role = next(iter(findings.result.recommended))
        figures += f"; with the layout “{role}” it is {_error_text(_worst(beside), goal)}"
    figures += " (95 % intervals, in the worse scenario)."
    if need is Need.NEEDED:
        return f"{figures} Without tags the demand is broken: they are needed."
    if need is Need.NOT_NEEDED:
        able = next(row.words for row in rows if all(o.verdict == "met" for o in rows if o.words == row.words))
        return (
            f"{figures} {able.capitalize()} meets the demand on these drives: you may not need RFID. But its "
            "error grows with the way; longer drives or a start that is not known need a fix from somewhere."
        )
    if need is Need.UNDECIDED:
        return f"{figures} Whether the demand is met without tags, these drives do not decide; more of them would."
    return f"{figures} Whether that is enough is for you to say; with a target_error the study decides it."


def _estimators(rows: Sequence[Reckoning]) -> list[str]:
    return list(dict.fromkeys(row.words for row in rows))


def _worst(errors: Sequence[Score]) -> Score:
    return max(errors, key=lambda error: -math.inf if math.isnan(error.value) else error.value)


def _error_text(error: Score, goal: str) -> str:
    return f"{score_text(error, goal).partition(' (')[0]} ({interval_text(error, goal)})"
