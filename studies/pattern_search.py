"""Search for tag patterns that are better than those of the papers, and drives over what it finds."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Final

from layoutopt.identity import content_key
from layoutopt.protocols import Evaluation, Failure, Plan, Round, StudyCard
from layoutopt.scores import TrialOutcomes
from layoutopt.spec.building import Spec
from layoutopt.workers import Workers
from solvers.pattern_search import FoundPattern
from studies import cells as grid
from studies.cells import Cell
from studies.held_out import failures_of
from studies.page_answer import PageAnswer
from studies.pattern_goals import BEST_SUDOKU, BEST_TILT, GRID_M, Goal, Laid, goals, label_of, rivals, search
from studies.pattern_search_page import Searched, page_of, summary
from studies.pattern_setting import world

if TYPE_CHECKING:
    from studies.page import Page

CARD: Final = StudyCard(
    summary="Searches patterns of up to nine tags a tile for fewer blind runs and for smaller static errors.",
    reference="own; beside the patterns of kim2010 and han2006",
    question="Is there a tag pattern that beats those of the papers with as many tags?",
    adaptive=True,
    rests_on="What is minimised is exact, but a search proves no optimum: a better pattern may exist. "
    "Errors over the finds are simulated, on the same drives as over the patterns of the papers.",
    next_step="Copy the lines of a pattern from its listing into [space] of your spec, and run cost_vs_accuracy.",
    guide="patterns",
)
Place = tuple[str, str, str]
"""Goal, label of the pattern, and estimator."""
DRIVEN: Final = ("square", BEST_TILT, BEST_SUDOKU)
"""Patterns of the papers over which robots drive too."""
QUICK: Final = ("mean_blind_1m", "mean_midrange")
"""Goals of a quick look."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PatternSearch:
    """One search for every goal and number of tags a tile; of a spec it takes the seed alone.

    Attributes
    ----------
    names
        Goals by name.
    counts
        Numbers of tags a tile.
    starts, kept
        Random starts of a search, and how many of them go on after its first stage; four times as many for the
        goals that have many valleys.
    trials
        Drives over each pattern with each estimator.
    """

    names: tuple[str, ...]
    counts: tuple[int, ...]
    starts: int
    kept: int
    trials: int
    seed: int
    card: ClassVar[StudyCard] = CARD

    @classmethod
    def for_spec(cls, spec: Spec, *, quick: bool, workers: Workers | None = None) -> "PatternSearch":
        """Return the study with the seed of a spec; a quick one has one number of tags and few starts."""
        if quick:
            return cls(names=QUICK, counts=(2,), starts=1, kept=1, trials=2, seed=spec.seed)
        return cls(names=tuple(goals()), counts=(1, 2, 3, 4, 6, 9), starts=6, kept=1, trials=32, seed=spec.seed)

    @property
    def goals(self) -> tuple[Goal, ...]:
        """The goals themselves."""
        return tuple(goals()[name] for name in self.names)

    @property
    def key(self) -> str:
        """Content key of the searches and drives."""
        estimators = [estimator.key for goal in self.goals for estimator in goal.estimators]
        effort = (self.names, self.counts, self.starts, self.kept, self.trials, self.seed)
        return content_key("pattern_search", effort, world().key, estimators)

    def plan(self) -> Plan:
        """Return the numbers of searches and drives, and a pilot over drives that need no search."""
        searches = len(self.goals) * len(self.counts)
        patterns = len(self.goals) * len(DRIVEN) + searches
        known = grid.plan_of(cell for _, cell in self._rival_cells())
        share = len(DRIVEN) * len(self.goals) / patterns
        return Plan(
            lines=(
                f"{searches} searches from {self.starts} or more starts, whose time is not in the prediction",
                f"{patterns} patterns with {self.trials} drives for each of two estimators",
            ),
            pilot=tuple((task, round(trials / share)) for task, trials in known.pilot),
        )

    def next_batch(self, evaluations: Sequence[Evaluation | Failure]) -> Round:
        """Return the drives over the patterns of the papers, then over one pattern after the other as found."""
        rounds: list[tuple[str, Iterator[tuple[Place, Cell]]]] = [("patterns of the papers", self._rival_cells())]
        rounds += [
            (f"{goal.name}, {label_of(count)}", self._found_cells(goal, count))
            for goal in self.goals
            for count in self.counts
        ]
        for name, cells in rounds:
            batch = grid.next_round((cell for _, cell in cells), evaluations)
            if batch.tasks:
                return Round(name=name, tasks=batch.tasks)
        return Round(name="done", tasks=())

    def best_so_far(self, evaluations: Sequence[Evaluation | Failure]) -> str:
        """Return the number of trials so far; what a search found is told at the end."""
        return f"{grid.drives_in(evaluations)} drives"

    def answer(self, evaluations: Sequence[Evaluation | Failure], spec: Spec) -> PageAnswer:
        """Return what was found; the spec has nothing to add."""
        searched = self.searched()
        driven = grid.finished(self._cells(), evaluations)
        failures = failures_of(evaluations)
        return PageAnswer(
            study="pattern_search",
            summary=tuple(summary(searched)),
            page=lambda _: self._page(searched, driven, len(failures)),
            failures=failures,
        )

    def searched(self) -> tuple[Searched, ...]:
        """Return what each search found, in the order of goals and numbers of tags."""
        return tuple(
            Searched(
                goal=goal.name,
                count=count,
                laid=self._laid(goal, count),
                evaluated=self._found(goal, count).evaluated,
            )
            for goal in self.goals
            for count in self.counts
        )

    def _page(self, searched: tuple[Searched, ...], driven: Mapping[Place, TrialOutcomes], failed: int) -> "Page":
        return page_of(
            searched,
            driven,
            facts={
                "Searches": f"{len(searched)}, each from {self.starts} random starts, of which the best "
                f"{self.kept} went on after the first stage (for blind runs four times as many), and from what "
                "fewer tags gave",
                "Seed": str(self.seed),
                "Trials": f"{sum(map(len, driven.values()))}; {self.trials} a cell",
                "Failed tasks": str(failed),
            },
        )

    def _found(self, goal: Goal, count: int) -> FoundPattern:
        return search(goal.name, count, self.starts, self.kept, self.seed, self.counts)

    def _laid(self, goal: Goal, count: int) -> Laid:
        unknowns, space = self._found(goal, count).unknowns, goal.space(count)
        return Laid(pattern=space.pattern(unknowns, GRID_M), angle_rad=space.tilt_rad(unknowns))

    def _cells(self) -> Iterator[tuple[Place, Cell]]:
        yield from self._rival_cells()
        for goal in self.goals:
            for count in self.counts:
                yield from self._found_cells(goal, count)

    def _rival_cells(self) -> Iterator[tuple[Place, Cell]]:
        for goal in self.goals:
            for label in DRIVEN:
                yield from self._cells_of(goal, label, rivals(goal.name)[label])

    def _found_cells(self, goal: Goal, count: int) -> Iterator[tuple[Place, Cell]]:
        yield from self._cells_of(goal, label_of(count), self._laid(goal, count))

    def _cells_of(self, goal: Goal, label: str, laid: Laid) -> Iterator[tuple[Place, Cell]]:
        layout = goal.setting.layout(laid.pattern, laid.angle_rad)
        for estimator in goal.estimators:
            yield (
                (goal.name, label, estimator.name),
                Cell(layout=layout, scenario=world(), estimator=estimator, trials=self.trials),
            )
