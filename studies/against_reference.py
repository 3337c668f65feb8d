"""Search for layouts that are cheaper or more accurate than the published one, judged on held-out drives."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar, Final

from layoutopt.identity import content_key
from layoutopt.layout import Layout
from layoutopt.problem import Problem
from layoutopt.protocols import Evaluation, Failure, Group, Plan, Round, StudyCard, Task
from layoutopt.reach import OnlyInReach
from layoutopt.result import Status
from layoutopt.spec.building import Spec
from layoutopt.streams import Streams
from layoutopt.workers import Workers
from objectives.cost import Cost
from solvers.candidates import Candidates
from solvers.global_search import GlobalSearch
from solvers.search_stages import SearchStanding
from studies import cells as grid
from studies.against_reference_page import page_of
from studies.against_reference_results import Compared, Found, Results, compared, summary
from studies.against_reference_setting import (
    Search,
    base_problem,
    cost_of,
    reference_layout,
    searches,
    space_key,
    start_points,
)
from studies.cells import Cell
from studies.held_out import failures_of
from studies.page import Page
from studies.page_answer import LayoutsAnswer, PageAnswer

CARD: Final = StudyCard(
    summary="Searches the best layout for shares of the published one's cost, and compares on held-out drives.",
    reference="own; the reference is the combination array of 8 readers over 100 tags/m² of mi2016",
    question="How much cheaper, or how much more accurate, than the published layout can I build?",
    adaptive=True,
    rests_on="Errors are simulated and judged on held-out drives that no search saw; a gain counts "
    "only where its one-sided 95 % bound shows it. The published layout is rebuilt from its paper and "
    "costed with your prices.",
    next_step="Draw the layout of the share that suits you from layouts/ with layoutopt draw, or run "
    "cost_vs_accuracy for the whole front.",
    guide="against_reference",
)
Place = tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class AgainstReference:
    """One search for each filter and each budget, a share of the reference's cost; then all on held-out drives.

    Attributes
    ----------
    problem
        Space and scenarios; the estimators are the paper's filter and the best one.
    reference
        The published layout, simulated on the same floor with its own reader profile.
    shares
        Budgets, as shares of what the reference costs.
    search
        Effort of each search.
    trials
        Held-out drives of each layout in each scenario.
    """

    problem: Problem
    reference: Layout
    cost: Cost
    shares: tuple[float, ...]
    search: GlobalSearch
    trials: int
    card: ClassVar[StudyCard] = CARD
    known: dict[tuple[str, float], tuple[GlobalSearch, Candidates]] = field(
        default_factory=dict, repr=False, compare=False
    )

    @classmethod
    def for_spec(cls, spec: Spec, *, quick: bool, workers: Workers | None = None) -> "AgainstReference":
        """Return the study of a spec; a quick one has one budget, few layouts and few drives."""
        if quick:
            shares: tuple[float, ...] = (0.3,)
            effort = GlobalSearch(
                population=8,
                generations=3,
                replications=1,
                finalists=2,
                race_trials=2,
                polish_evaluations=4,
                fresh_trials=2,
                seed=spec.seed,
            )
        else:
            shares = (0.2, 0.3, 1.0)
            effort = GlobalSearch(
                population=18,
                generations=10,
                replications=6,
                finalists=8,
                race_trials=24,
                polish_evaluations=10,
                fresh_trials=48,
                seed=spec.seed,
            )
        return cls(
            problem=base_problem(spec),
            reference=reference_layout(spec),
            cost=cost_of(spec),
            shares=shares,
            search=effort,
            trials=4 if quick else 300,
        )

    @property
    def key(self) -> str:
        """Content key of the searches and drives."""
        problem = self.problem
        worlds = [scenario.key for scenario in (problem.design, *problem.held_out)]
        estimators = [estimator.key for estimator in problem.estimators]
        effort = (self.shares, self.search, self.trials)
        return content_key(
            "against_reference",
            worlds,
            estimators,
            effort,
            space_key(problem.space),
            self.cost.key,
            self.reference.key,
        )

    @property
    def reference_cost_eur(self) -> float:
        """What the published layout costs on this floor for this fleet."""
        return self.cost(self.reference, self.problem.design, None)["cost"].value

    @property
    def _cost_in_reach_eur(self) -> float:
        """What the published layout would cost without the tags that none of its antennas can read."""
        design = self.problem.design
        layout = OnlyInReach(design.site, design.robot.radius_m)(self.reference)
        return self.cost(layout, design, None)["cost"].value

    def plan(self) -> Plan:
        """Return the numbers of searches and drives, and a pilot over the reference and a first generation."""
        wanted = self._searches()
        most = self.search.population * (self.search.generations + 1)
        trials = len(wanted) * (
            most * self.search.replications
            + self.search.polish_evaluations * self.search.race_trials
            + self.search.finalists * self.search.race_trials
        )
        known = grid.plan_of(cell for _, cell in self._reference_cells())
        share = sum(count for _, count in known.pilot) / max(1, trials)
        return Plan(
            lines=(
                f"{len(wanted)} searches, each of at most {most} layouts with {self.search.replications} drives; "
                "those beyond their budget get none",
                f"{len(wanted) + 1} layouts with {self.trials} held-out drives in each of "
                f"{len(self.problem.held_out)} scenarios",
            ),
            pilot=tuple((task, max(1, round(count / share))) for task, count in known.pilot),
        )

    def next_batch(self, evaluations: Sequence[Evaluation | Failure]) -> Round:
        """Return what all searches ask for, then the held-out drives of what they found."""
        standings = self._standings(evaluations)
        tasks: dict[tuple[Group, int], Task] = {}
        for standing in standings.values():
            for task in standing.tasks:
                place = (task.group, task.first)
                # Two searches may ask for one layout at different stages; the larger task serves both.
                if place not in tasks or tasks[place].count < task.count:
                    tasks[place] = task
        if tasks:
            stages = dict.fromkeys(standing.stage for standing in standings.values() if standing.tasks)
            return Round(name=", ".join(stages), tasks=tuple(tasks.values()))
        cells = (cell for _, cell in self._cells(standings))
        return replace(grid.next_round(cells, evaluations), name="held-out drives")

    def best_so_far(self, evaluations: Sequence[Evaluation | Failure]) -> str:
        """Return the number of drives so far: scores of a search are no answers."""
        return f"{grid.drives_in(evaluations)} drives"

    def answer(self, evaluations: Sequence[Evaluation | Failure], spec: Spec) -> LayoutsAnswer:
        """Return the comparison; the spec goes into the files of the layouts."""
        results = self.results(evaluations)
        failures = failures_of(evaluations)

        def page(_: Streams) -> Page:
            return page_of(results, facts=self._facts(evaluations, len(failures), spec))

        return LayoutsAnswer(
            page=PageAnswer(
                study="against_reference", summary=tuple(summary(results)), page=page, failures=failures
            ),
            layouts=tuple({item.layout.key: item.layout for item in results.found}.values()),
            spec=spec,
            status=Status.SEARCHED if results.found or not results.refused else Status.BUDGET_TOO_SMALL,
        )

    def results(self, evaluations: Sequence[Evaluation | Failure]) -> Results:
        """Return what was found and how it compares, of whatever is finished."""
        standings = self._standings(evaluations)
        found = tuple(
            Found(
                filter=search.estimator.name,
                share=search.share,
                layout=standings[search.place].finalists[0].layout,
                scores=standings[search.place].finalists[0].scores,
                stage=standings[search.place].stage,
                layouts=standings[search.place].layouts,
                trials=standings[search.place].trials,
            )
            for search in self._searches()
            if standings[search.place].stage == "done" and standings[search.place].finalists
        )
        driven = grid.finished(self._cells(standings), evaluations)
        refused = {
            search.place: standings[search.place].reason
            for search in self._searches()
            if not standings[search.place].finalists
        }
        rows: tuple[Compared, ...] = compared(found, driven, self._filters, self._scenarios)
        return Results(
            found=found,
            rows=rows,
            refused=refused,
            reference=self.reference,
            reference_cost_eur=self.reference_cost_eur,
            reference_in_reach_eur=self._cost_in_reach_eur,
            driven=driven,
            cost=self.cost,
            design=self.problem.design,
            seed=self.search.seed,
        )

    @property
    def _filters(self) -> tuple[str, ...]:
        return tuple(estimator.name for estimator in self.problem.estimators)

    @property
    def _scenarios(self) -> tuple[str, ...]:
        return tuple(scenario.name for scenario in self.problem.held_out)

    def _searches(self) -> tuple[Search, ...]:
        return searches(self.problem, self.reference_cost_eur, self.shares)

    def _standings(
        self, evaluations: Sequence[Evaluation | Failure]
    ) -> Mapping[tuple[str, float], SearchStanding]:
        found = {}
        for search in self._searches():
            if search.place not in self.known:
                candidates = self.search.candidates(search.problem)
                # Half of the first generation stays random, or differences between its points would span nothing.
                starts = start_points(candidates, self.search.population // 2)
                begun = replace(self.search, starts=starts)
                self.known[search.place] = begun, candidates
            solver, candidates = self.known[search.place]
            mine = [item for item in evaluations if item.group.estimator == search.estimator.name]
            found[search.place] = solver.standing(candidates, mine)
        return found

    def _cells(self, standings: Mapping[tuple[str, float], SearchStanding]) -> Iterator[tuple[Place, Cell]]:
        yield from self._reference_cells()
        for search in self._searches():
            for item in standings[search.place].finalists[:1]:
                for scenario in self.problem.held_out:
                    yield (
                        (search.estimator.name, str(search.share), scenario.name),
                        Cell(
                            layout=item.layout, scenario=scenario, estimator=search.estimator, trials=self.trials
                        ),
                    )

    def _reference_cells(self) -> Iterator[tuple[Place, Cell]]:
        for estimator in self.problem.estimators:
            for scenario in self.problem.held_out:
                yield (
                    (estimator.name, "reference", scenario.name),
                    Cell(layout=self.reference, scenario=scenario, estimator=estimator, trials=self.trials),
                )

    def _facts(self, evaluations: Sequence[Evaluation | Failure], failed: int, spec: Spec) -> Mapping[str, str]:
        drives = grid.drives_in(evaluations)
        return {
            "Seed": str(spec.seed),
            "Robots": str(spec.robot_count),
            "Reader profile": spec.reader_profile.name,
            "Prices": f"{spec.prices.name}, {spec.prices.date}",
            "Searches": f"{len(self._searches())}, each over {len(self.problem.space.axes)} coordinates with "
            f"{self.search.population} points in {self.search.generations + 1} generations, "
            f"drives a layout: {self.search.replications} in the search, {self.search.race_trials} in race and "
            f"descent, {self.search.fresh_trials} fresh ones",
            "Trials": f"{drives} in all, {self.trials} held-out ones of each layout in each scenario",
            "Failed tasks": str(failed),
        }
