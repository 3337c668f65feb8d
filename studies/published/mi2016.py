"""mi2016 run again: its simulated tables, its real robot, and what each choice it leaves open does."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Final

from layoutopt.evaluate import outcomes_of
from layoutopt.identity import content_key
from layoutopt.protocols import Evaluation, Failure, Plan, Round, StudyCard
from layoutopt.spec.building import Spec
from layoutopt.workers import Workers
from studies import cells as grid
from studies.held_out import failures_of
from studies.page_answer import PageAnswer
from studies.published import mi2016_cells, mi2016_real
from studies.published.mi2016_cells import FULL, QUICK, Effort
from studies.published.mi2016_page import page_of
from studies.published.mi2016_results import Results

CARD: Final = StudyCard(
    summary="Tables of mi2016 again, with intervals; open choices one at a time; its real robot predicted.",
    reference="mi2016, Tables 2-6, Fig. 9, 10, 14 and 15",
    question="Does the simulation give the accuracy that mi2016 reports, and what do its unstated choices do?",
    adaptive=True,
    rests_on="Trials are simulated from what the paper states and from what was chosen where it is "
    "silent; choices are varied one at a time. Faults of the real robot were fitted on two rows and "
    "tried on the others.",
    next_step="Ask against_reference how a layout of your own compares with this one.",
    guide="published_mi2016",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Mi2016:
    """The published experiment of mi2016; of a spec it takes the seed alone."""

    effort: Effort
    seed: int
    card: ClassVar[StudyCard] = CARD

    @classmethod
    def for_spec(cls, spec: Spec, *, quick: bool, workers: Workers | None = None) -> "Mi2016":
        """Return the study with the seed of a spec."""
        return cls(effort=QUICK if quick else FULL, seed=spec.seed)

    @property
    def key(self) -> str:
        """Content key of all cells and of the fit."""
        cells = [(*cell.group, cell.trials) for cell in mi2016_cells.all_cells(self.effort)]
        return content_key("published/mi2016", sorted(cells), mi2016_real.key(self.effort))

    def plan(self) -> Plan:
        """Return the numbers of trials; the fit's later rounds depend on its earlier ones."""
        simulated = list(mi2016_cells.all_cells(self.effort))
        real = list(mi2016_real.plan_cells(self.effort))
        counts = [sum(task.count for task in grid.missing(cells, {}, {})) for cells in (simulated, real)]
        lines = (f"simulated tables: {counts[0]} trials; real robot: about {counts[1]} trials",)
        return grid.plan_of([*simulated, *real], lines)

    def next_batch(self, evaluations: Sequence[Evaluation | Failure]) -> Round:
        """Return the next round: all simulated cells, then the rounds of the fit, then its predictions."""
        tasks = grid.missing(
            mi2016_cells.all_cells(self.effort), outcomes_of(evaluations), failures_of(evaluations)
        )
        if tasks:
            return Round(name="simulated tables, open choices, speeds", tasks=tasks)
        return mi2016_real.next_round(evaluations, self.effort)

    def best_so_far(self, evaluations: Sequence[Evaluation | Failure]) -> str:
        """Return how many mean cells lie within a factor of 1.5 of the paper's so far."""
        cells = self.results(evaluations).mean_cells()
        known = [cell for cell in cells if cell.ours is not None]
        return f"{sum(cell.within(1.5) for cell in known)} of {len(known)} means within a factor of 1.5"

    def results(self, evaluations: Sequence[Evaluation | Failure]) -> Results:
        """Return what the trials gave, beside the paper."""
        return Results(
            effort=self.effort,
            seed=self.seed,
            known=outcomes_of(evaluations),
            fit=mi2016_real.best_fit(evaluations, self.effort),
            failures=failures_of(evaluations),
        )

    def answer(self, evaluations: Sequence[Evaluation | Failure], spec: Spec) -> PageAnswer:
        """Return the results; the spec has nothing to add."""
        results = self.results(evaluations)
        return PageAnswer(
            study="published/mi2016",
            summary=tuple(results.summary()),
            page=lambda streams: page_of(results, streams),
            failures=results.failures,
        )
