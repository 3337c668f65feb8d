"""What does it cost to be safe against how it is installed? The nominal layout beside a robust one."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar, Final

from layoutopt.evaluate import outcomes_of
from layoutopt.identity import content_key
from layoutopt.problem import Problem
from layoutopt.protocols import Evaluation, Failure, Plan, Round, StudyCard, Task
from layoutopt.result import Evaluated
from layoutopt.scenario import Role, Scenario
from layoutopt.score_text import counted_text, euros
from layoutopt.scores import Score, paired_difference
from layoutopt.spec.building import Spec
from layoutopt.tolerance import Tolerance, scenario_at, tolerance_scenarios
from layoutopt.workers import Workers
from solvers.front import front_of
from solvers.racing import Standing
from solvers.robust import Combined, scenarios_needed
from studies import held_out
from studies.cells import drives_in
from studies.cost_vs_accuracy import CostVersusAccuracy
from studies.page_answer import LayoutsAnswer, PageAnswer
from studies.robustness_findings import SWEEP, Choice, Judged, Price, RobustnessFindings, Sweep
from studies.robustness_page import page_of
from studies.robustness_picks import Effort, Judgement, Pick
from studies.robustness_words import summary

CARD: Final = StudyCard(
    summary="Finalists of two searches judged over a tolerance of installation; the robust layout and its price.",
    reference="own; order statistics after David and Nagaraja, Order Statistics, 2003",
    question="What does it cost to be safe against how it is installed?",
    adaptive=True,
    rests_on="Errors are simulated in worlds of the tolerance, with the same random numbers for all "
    "layouts. A layout counts as safe only where the one-sided 95 % bound of its worst case says so; "
    "tolerances beyond yours are not looked at.",
    next_step="Draw the robust layout from layouts/ with layoutopt draw; or hold the installer to less "
    "under [study.tolerance] and run this again.",
    guide="guide",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Robustness:
    """The study: two races as in the main study, then their best layouts over the scenarios of a tolerance.

    One race is run as planned and one with all faults at the high ends of the tolerance, on the same drives: what
    is safe need not be near the front of what is good. The second race only proposes. Where the high ends are not
    the worst corner, such as with an error of height that does harm at its low end, it may propose too little; the
    judgement is the same.

    Attributes
    ----------
    search
        Enumeration of the design space, and the race as planned.
    nominal
        The world of the judgement without any tolerance: other routes than the search's, the same faults.
    scenarios
        The worlds of the tolerance. All, and the nominal one, share their drives.
    """

    search: CostVersusAccuracy
    tolerance: Tolerance
    nominal: Scenario
    scenarios: tuple[Scenario, ...]
    effort: Effort
    card: ClassVar[StudyCard] = CARD

    @classmethod
    def for_spec(cls, spec: Spec, *, quick: bool, workers: Workers | None = None) -> "Robustness":
        """Return the study that a spec asks for; a quick one looks at fewer layouts on fewer drives."""
        tolerance, settings, problem = spec.study.tolerance, spec.study, spec.problem()
        worst = tolerance.combine == "worst"
        effort = Effort(
            contenders=3 if quick else 12,
            screening_trials=2 if quick else 24 if worst else 8,
            deciding_trials=max(2, settings.validation_trials // (40 if quick else 1)),
            most_candidates=1 if quick else 6,
            drawn=4 if quick else scenarios_needed(tolerance.quantile),
        )
        search = CostVersusAccuracy.of(
            problem,
            seed=spec.seed,
            search_trials=settings.search_trials // (100 if quick else 1),
            validation_trials=effort.deciding_trials,
            front_trials=effort.screening_trials,
            reference_trials=0,
            most_layouts=12 if quick else None,
            workers=workers,
        )
        return cls.of(search, tolerance, effort)

    @classmethod
    def of(cls, search: CostVersusAccuracy, tolerance: Tolerance, effort: Effort) -> "Robustness":
        """Return the study of a search's problem, with the worlds of a tolerance about its first held-out one."""
        world = search.problem.held_out[0]
        # A name of its own: neither the search nor the main study's validation has seen these drives.
        nominal = replace(world, name=f"tolerance/{world.routes.kind}", role=Role.HELD_OUT)
        scenarios = tolerance_scenarios(nominal, tolerance, count=effort.drawn, seed=search.seed)
        return cls(search=search, tolerance=tolerance, nominal=nominal, scenarios=scenarios, effort=effort)

    @property
    def problem(self) -> Problem:
        """The question of the search."""
        return self.search.problem

    @property
    def key(self) -> str:
        """Content key of the question, prices and effort aside."""
        return content_key(
            "robustness", self.search.key, self.nominal.key, [scenario.key for scenario in self.scenarios]
        )

    def plan(self) -> Plan:
        """Return numbers of layouts, scenarios and trials, at most; the pilot is a few contenders in each part."""
        effort, worlds = self.effort, len(self.scenarios) + 1
        contenders, races = self.search.contenders, self._races
        judged = min(len(races) * effort.contenders, len(contenders))
        search = self.search.racing.trials
        screening = judged * worlds * effort.screening_trials
        deciding = min(effort.most_candidates, judged) * worlds * effort.deciding_trials
        sweep = 2 * len(SWEEP) * effort.deciding_trials
        lines = (
            f"layouts: {len(self.search.screened)}, of which {len(contenders)} can be built within the limits on "
            "exact scores",
            f"search: up to {len(races) * search} trials; up to {judged} contenders in {worlds} worlds: "
            f"{screening} trials; deciding: up to {deciding + sweep} trials",
        )
        chosen = contenders[:: max(1, len(contenders) // 4)][:4]
        parts = (
            *((problem.design, search) for problem in races.values()),
            (self.scenarios[-1], screening + deciding + sweep),
        )
        pilot = tuple(
            (self._task(item, scenario), max(1, trials // len(chosen)))
            for item in chosen
            for scenario, trials in parts
        )
        return Plan(lines=lines, pilot=pilot)

    def next_batch(self, evaluations: Sequence[Evaluation | Failure]) -> Round:
        """Return the next round: both races, contenders in all worlds, candidates to be decided, the sweep."""
        if not self.search.contenders:
            return Round(name="nothing can be built and judged", tasks=())
        standings = self._standings(evaluations)
        for name, standing in standings.items():
            if standing.tasks:
                return Round(
                    name=f"search {name}, {counted_text(len(standing.tasks), 'layout')}", tasks=standing.tasks
                )
        judgement = self._judgement(evaluations)
        missing = partial(self._missing, judgement)
        contenders = self.contenders(standings.values())
        screening, deciding = self.effort.screening_trials, self.effort.deciding_trials
        tasks = missing(contenders, (self.nominal, *self.scenarios), screening)
        if tasks:
            return Round(name=f"{len(contenders)} contenders over the tolerance", tasks=tasks)
        picks = self.picks(contenders, judgement)
        for name, worlds in self._worlds.items():
            pick = picks.get(name)
            if pick is not None and pick.held is None:
                tasks = missing([pick.item], worlds, deciding)
                return Round(name=f"deciding drives, {name}, layout {pick.tried}", tasks=tasks)
        chosen = list({pick.item.layout.key: pick.item for pick in picks.values()}.values())
        tasks = missing(chosen, (self.nominal, *self.scenarios, *self._sweep_worlds), deciding)
        return Round(name="error against tolerance", tasks=tasks)

    def best_so_far(self, evaluations: Sequence[Evaluation | Failure]) -> str:
        """Return the cost of the robust layout as it stands; empty before there is one."""
        standings = self._standings(evaluations).values()
        if any(standing.tasks for standing in standings) or not self.search.contenders:
            return ""
        pick = self.picks(self.contenders(standings), self._judgement(evaluations)).get("robust")
        if pick is None:
            return ""
        cost = euros(pick.item.scores[self.problem.goals[0]].value)
        return f"{cost}, the cheapest that may be safe ({pick.item.layout.short_key})"

    def answer(self, evaluations: Sequence[Evaluation | Failure], spec: Spec) -> LayoutsAnswer:
        """Return both layouts, the price of robustness, and the error against the tolerance."""
        found = self.findings(evaluations)
        return LayoutsAnswer(
            page=PageAnswer(
                study="robustness",
                summary=tuple(summary(found)),
                page=lambda _: page_of(found, prices=f"{spec.prices.name}, {spec.prices.date}"),
                failures=found.failures,
                nothing_tried=not found.contenders,
            ),
            layouts=tuple({layout.key: layout for layout in found.layouts}.values()),
            spec=spec,
            status=found.status,
        )

    def findings(self, evaluations: Sequence[Evaluation | Failure]) -> RobustnessFindings:
        """Return what the study found; every number in it comes from the evaluations or is exact."""
        judgement = self._judgement(evaluations)
        contenders = self.contenders(self._standings(evaluations).values()) if self.search.contenders else []
        picks = self.picks(contenders, judgement)
        judged = [self._judged(item, judgement) for item in contenders]
        by_key = {item.evaluated.layout.key: item for item in judged if item is not None}
        choices = {
            name: Choice(judged=by_key[pick.item.layout.key], held=bool(pick.held), tried=pick.tried)
            for name, pick in picks.items()
        }
        return RobustnessFindings(
            problem=self.problem,
            limits=judgement.limits,
            seed=self.search.seed,
            tolerance=self.tolerance,
            nominal=self.nominal,
            scenarios=self.scenarios,
            refusal="" if self.search.contenders else self.search.findings(()).result.shortfall,
            contenders=tuple(by_key.values()),
            choices=choices,
            price=self._price(choices, judgement),
            sweeps=tuple(
                Sweep(
                    layout_key=key,
                    shares=SWEEP,
                    scores=judgement.scores(by_key[key].evaluated, self._sweep_worlds),
                )
                for key in dict.fromkeys(choice.judged.evaluated.layout.key for choice in choices.values())
            ),
            trials=drives_in(evaluations),
            failures=judgement.failed,
        )

    def contenders(self, standings: Iterable[Standing]) -> list[Evaluated]:
        """Return the finalists near the front of any race, by cost, with their exact scores."""
        keys = {item.layout.key for standing in standings for item in self._near_front(standing)}
        found = [item for item in self.search.contenders if item.layout.key in keys]
        return sorted(found, key=lambda item: (item.scores[self.problem.goals[0]].value, item.layout.key))

    def _near_front(self, standing: Standing) -> list[Evaluated]:
        """Return the finalists nearest to a race's front: the front, then the front of the rest, and so on."""
        goals = self.problem.goals
        left = [item for item in standing.finalists if goals[1] in item.scores]
        found: list[Evaluated] = []
        while left and len(found) < self.effort.contenders:
            members = front_of(left, goals).members
            if not members:
                break
            found += members
            keys = {item.layout.key for item in members}
            left = [item for item in left if item.layout.key not in keys]
        # A front that does not fit is thinned evenly by cost, and keeps both of its ends.
        room, last = self.effort.contenders, len(found) - 1
        if len(found) > room > 1:
            found = [found[round(place * last / (room - 1))] for place in range(room)]
        return found

    def picks(self, contenders: Sequence[Evaluated], judgement: Judgement) -> dict[str, Pick]:
        """Return the layout for the nominal world and the one for the tolerance, as ``nominal`` and ``robust``."""
        found = {name: judgement.pick(contenders, worlds) for name, worlds in self._worlds.items()}
        return {name: pick for name, pick in found.items() if pick is not None}

    @property
    def _worlds(self) -> dict[str, tuple[Scenario, ...]]:
        return {"nominal": (self.nominal,), "robust": self.scenarios}

    @property
    def _sweep_worlds(self) -> tuple[Scenario, ...]:
        return tuple(scenario_at(self.nominal, self.tolerance, share) for share in SWEEP)

    @property
    def _races(self) -> dict[str, Problem]:
        """The question as planned and at the far end of the tolerance; one where both are the same."""
        far = replace(self.problem, design=scenario_at(self.problem.design, self.tolerance, 1.0))
        planned = {"as planned": self.problem}
        return planned if far.design.key == self.problem.design.key else {**planned, "at the far end": far}

    def _standings(self, evaluations: Sequence[Evaluation | Failure]) -> dict[str, Standing]:
        """Return how each race stands."""
        return {
            name: self.search.racing.standing(problem, self.search.contenders, evaluations)
            for name, problem in self._races.items()
        }

    def _judgement(self, evaluations: Sequence[Evaluation | Failure]) -> Judgement:
        return Judgement(
            problem=self.problem,
            tolerance=self.tolerance,
            effort=self.effort,
            known=outcomes_of(evaluations),
            failed=held_out.failures_of(evaluations),
        )

    def _judged(self, item: Evaluated, judgement: Judgement) -> Judged | None:
        """Return a contender with its scores as planned and over the tolerance; ``None`` without both."""
        over: dict[str, dict[str, Combined]] = {}
        for name, worlds in self._worlds.items():
            scores = dict.fromkeys((self.problem.goals[1], *(limit.score for limit in judgement.limits)))
            found = {score: judgement.combined(item, score, worlds) for score in scores}
            over[name] = {score: value for score, value in found.items() if value is not None}
            if len(over[name]) < len(scores):
                return None
        worlds = (self.nominal, *self.scenarios)
        return Judged(
            evaluated=item,
            nominal=over["nominal"],
            robust=over["robust"],
            scores=judgement.scores(item, worlds) or (),
        )

    def _price(self, choices: Mapping[str, Choice], judgement: Judgement) -> Price | None:
        """Return what robustness costs, by paired differences on common drives; ``None`` without both layouts."""
        if len(choices) < 2:
            return None
        cost, goal = self.problem.goals[:2]
        plain, safe = (choices[name].judged for name in ("nominal", "robust"))
        hardest = self.scenarios[plain.robust[goal].scenario]
        tables = {
            (layout, world): judgement.known[judgement.groups(judged.evaluated, [scenario])[0]]
            for layout, judged in (("plain", plain), ("safe", safe))
            for world, scenario in (("nominal", self.nominal), ("hardest", hardest))
        }

        def less(first: tuple[str, str], second: tuple[str, str]) -> Score:
            return paired_difference(tables[first], tables[second], goal)

        return Price(
            cost_eur=safe.evaluated.scores[cost].value - plain.evaluated.scores[cost].value,
            loss=less(("plain", "hardest"), ("plain", "nominal")),
            gain=less(("plain", "hardest"), ("safe", "hardest")),
            nominal_gain=less(("plain", "nominal"), ("safe", "nominal")),
            hardest=hardest,
        )

    def _missing(
        self, judgement: Judgement, items: Sequence[Evaluated], worlds: Sequence[Scenario], trials: int
    ) -> tuple[Task, ...]:
        unique = list({scenario.key: scenario for scenario in worlds}.values())
        layouts = [item.layout for item in items]
        estimators = self.problem.estimators[:1]
        return held_out.tasks(layouts, unique, estimators, trials, judgement.known, judgement.failed)

    def _task(self, item: Evaluated, scenario: Scenario) -> Task:
        return Task(layout=item.layout, scenario=scenario, estimator=self.problem.estimators[0], first=0, count=1)
