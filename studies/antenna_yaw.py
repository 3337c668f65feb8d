"""How many UHF antennas a robot needs to track a tagged person, and where they look."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Final

from layoutopt.estimators.targets import TargetEstimator
from layoutopt.evaluate import outcomes_of
from layoutopt.identity import content_key
from layoutopt.layout import Layout
from layoutopt.problem import Problem
from layoutopt.protocols import Evaluation, Failure, Plan, Round, StudyCard
from layoutopt.score_text import counted_text
from layoutopt.spec.building import Spec
from layoutopt.workers import Workers
from studies.antenna_yaw_page import page_of
from studies.antenna_yaw_results import Driven, driven_of, next_to_try, verdict_of
from studies.antenna_yaw_setting import (
    Choice,
    choices_of,
    problem_of,
    scenario_of,
    settings_of,
    tracker_of,
)
from studies.antenna_yaw_words import Told, summary
from studies.cells import Cell, missing, next_round, plan_of
from studies.held_out import failures_of
from studies.page_answer import LayoutsAnswer, PageAnswer

CARD: Final = StudyCard(
    summary="Numbers and yaws of UHF antennas against cost and simulated tracking error, exact coverage beside.",
    reference="liang2020 (two antennas at 45 degrees, fused with a laser); own",
    question="How many UHF antennas does a robot need to track a tagged person, and where do they look?",
    adaptive=True,
    rests_on="Tracking is simulated with signals after liang2020 in one room; differences are paired "
    "by trial, and what could be recommended is tried on fresh trials. Walls that reflect are not in "
    "the model.",
    next_step="Mount the antennas as the layout in layouts/ says; run sampling to learn how often a "
    "tag has to be read.",
    guide="tracking",
)
_QUICK_TRIALS: Final = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class AntennaYaw:
    """The comparison on the drives of a spec's tracking, then fresh drives of those that could be recommended.

    Attributes
    ----------
    trials
        Of each choice; a candidate gets as many fresh ones.
    """

    problem: Problem
    choices: tuple[Choice, ...]
    estimator: TargetEstimator
    trials: int
    seed: int
    card: ClassVar[StudyCard] = CARD

    @classmethod
    def for_spec(cls, spec: Spec, *, quick: bool, workers: Workers | None = None) -> "AntennaYaw":
        """Return the study of a spec; a quick one looks at few choices on few and short trials."""
        settings = settings_of(spec)
        problem = problem_of(spec, scenario_of(spec, quick=quick))
        return cls(
            problem=problem,
            choices=choices_of(spec, problem, quick=quick),
            estimator=tracker_of(settings),
            trials=_QUICK_TRIALS if quick else settings.trials,
            seed=spec.seed,
        )

    @property
    def key(self) -> str:
        """Content key of choices, world, tracker and trials; prices and limits aside."""
        layouts = [choice.layout.key for choice in self.choices]
        return content_key("antenna_yaw", layouts, self.problem.design.key, self.estimator.key, self.trials)

    def plan(self) -> Plan:
        """Return the numbers of choices and trials, with a pilot over them."""
        lines = [f"{counted_text(len(self.choices), 'choice')} with {counted_text(self.trials, 'trial')} each"]
        return plan_of((self._cell(choice.layout, self.trials) for choice in self.choices), lines)

    def next_batch(self, evaluations: Sequence[Evaluation | Failure]) -> Round:
        """Return the round of all choices, then one of fresh trials for a candidate at a time."""
        cells = [self._cell(choice.layout, self.trials) for choice in self.choices]
        first = next_round(cells, evaluations)
        if first.tasks:
            return first
        failed = failures_of(evaluations)
        entry = next_to_try(self.problem, self.driven(evaluations), self.trials, failed)
        if entry is None:
            return Round(name="done", tasks=())
        cell = self._cell(entry.choice.layout, 2 * self.trials)
        tasks = missing([cell], outcomes_of(evaluations), failed)
        return Round(name=f"fresh trials of {entry.choice.label}", tasks=tasks)

    def best_so_far(self, evaluations: Sequence[Evaluation | Failure]) -> str:
        """Return the number of choices that have their trials."""
        return f"{len(self.driven(evaluations))} of {counted_text(len(self.choices), 'choice')}"

    def answer(self, evaluations: Sequence[Evaluation | Failure], spec: Spec) -> LayoutsAnswer:
        """Return what is recommended, ready to be told, with its layout as a file."""
        failures, driven = failures_of(evaluations), self.driven(evaluations)
        told = Told(
            problem=self.problem,
            driven=tuple(driven),
            verdict=verdict_of(self.problem, driven),
            trials=self.trials,
            seed=self.seed,
            tracker=self.estimator.name,
            prices=f"{spec.prices.name}, {spec.prices.date}",
            failed=len(failures),
        )
        chosen = told.verdict.recommended
        return LayoutsAnswer(
            page=PageAnswer(
                study="antenna_yaw", summary=tuple(summary(told)), page=lambda _: page_of(told), failures=failures
            ),
            layouts=() if chosen is None else (chosen.choice.layout,),
            status=told.verdict.status,
            spec=spec,
        )

    def _cell(self, layout: Layout, trials: int) -> Cell:
        return Cell(layout=layout, scenario=self.problem.design, estimator=self.estimator, trials=trials)

    def driven(self, evaluations: Sequence[Evaluation | Failure]) -> list[Driven]:
        """Return the choices that have their trials, with what these gave."""
        known = {group.layout_key: table for group, table in outcomes_of(evaluations).items()}
        return driven_of(self.problem, self.choices, known, self.trials)
