"""Cells of an experiment: a layout in a scenario with an estimator, and how many trials it is to have."""

from abc import ABC, abstractmethod
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Final, Generic, TypeVar

from layoutopt.evaluate import outcomes_of
from layoutopt.identity import content_key
from layoutopt.layout import Layout
from layoutopt.protocols import AnyEstimator, Evaluation, Failure, Group, Plan, Round, Task, group_of
from layoutopt.result import Status
from layoutopt.scenario import Scenario
from layoutopt.score_text import counted_text
from layoutopt.scores import TrialOutcomes
from studies.held_out import failures_of

_Place = TypeVar("_Place", bound=Hashable)

UNFINISHED: Final = "No cell is finished."
BLOCK: Final = 12
"""Trials that go into one task, so that workers share even a single cell."""
_PILOT_CELLS = 12
ENOUGH_TRIALS: Final = 12
"""Fewer trials of a cell are a look: the interval of a handful takes it that all others are like them."""
ENOUGH_HELD_OUT: Final = 29
"""Fewer drives on which nothing got lost do not even show, at 95 %, that fewer than one in ten gets lost."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """One cell: the first ``trials`` replications of a layout in a scenario with an estimator."""

    layout: Layout
    scenario: Scenario
    estimator: AnyEstimator
    trials: int

    @property
    def group(self) -> Group:
        """The group of its outcomes."""
        return group_of(self.layout, self.scenario, self.estimator)

    def outcomes(self, known: Mapping[Group, TrialOutcomes]) -> TrialOutcomes | None:
        """Return its own outcomes, however many more the group has; ``None`` while any is missing."""
        table = known.get(self.group)
        if table is None or len(table) < self.trials:
            return None
        return table if len(table) == self.trials else table.head(self.trials)


def missing(
    cells: Iterable[Cell], known: Mapping[Group, TrialOutcomes], failed: Mapping[Group, str]
) -> tuple[Task, ...]:
    """Return the tasks that are still to be run; groups in which a task raised are left alone.

    Cells that share a group share its trials.
    """
    wanted: dict[Group, Cell] = {}
    for cell in cells:
        group = cell.group
        if group not in failed and (group not in wanted or wanted[group].trials < cell.trials):
            wanted[group] = cell
    return tuple(
        Task(
            layout=cell.layout,
            scenario=cell.scenario,
            estimator=cell.estimator,
            first=first,
            count=min(BLOCK, cell.trials - first),
        )
        for group, cell in wanted.items()
        for first in range(len(known[group]) if group in known else 0, cell.trials, BLOCK)
    )


def next_round(cells: Iterable[Cell], evaluations: Sequence[Evaluation | Failure]) -> Round:
    """Return what is still to be run of an experiment whose cells are known in advance."""
    cells = list(cells)
    return Round(
        name=f"{len(cells)} cells", tasks=missing(cells, outcomes_of(evaluations), failures_of(evaluations))
    )


def finished(
    cells: Iterable[tuple[_Place, Cell]], evaluations: Sequence[Evaluation | Failure]
) -> dict[_Place, TrialOutcomes]:
    """Return the outcomes of the cells that are finished, by their places in the experiment."""
    known = outcomes_of(evaluations)
    outcomes = ((place, cell.outcomes(known)) for place, cell in cells)
    return {place: table for place, table in outcomes if table is not None}


def drives_in(evaluations: Sequence[Evaluation | Failure]) -> int:
    """Return how many trials were run."""
    return sum(len(item.outcomes) for item in evaluations if isinstance(item, Evaluation))


def shown_on(trials: int, *, what: str = "drive", enough: int = ENOUGH_TRIALS) -> str:
    """Return the word for what so many trials say: shown, or seen with their number if they decide nothing.

    >>> shown_on(48), shown_on(2)
    ('shown', 'seen on 2 drives, too few to decide,')
    """
    return "shown" if trials >= enough else f"seen on {counted_text(trials, what)}, too few to decide,"


def status_text(status: Status, drives: int) -> str:
    """Return how a search ended in a sentence; few held-out drives do not show that limits are met.

    >>> status_text(Status.TARGET_MET, 6)
    'A layout is seen on 6 held-out drives, too few to decide, to meet every limit.'
    """
    if status is Status.TARGET_MET and drives < ENOUGH_HELD_OUT:
        return (
            f"A layout is {shown_on(drives, what='held-out drive', enough=ENOUGH_HELD_OUT)} to meet every limit."
        )
    return status.value


def plan_of(cells: Iterable[Cell], lines: Iterable[str] = (), *, pilot_trials: int = 1) -> Plan:
    """Return the plan of an experiment that runs the cells: every few, with so many trials, are its pilot."""
    tasks = missing(cells, {}, {})
    trials = sum(task.count for task in tasks)
    chosen = tasks[:: max(1, len(tasks) // _PILOT_CELLS)]
    pilot = [
        Task(layout=task.layout, scenario=task.scenario, estimator=task.estimator, first=0, count=pilot_trials)
        for task in chosen
    ]
    return Plan(lines=tuple(lines), pilot=tuple((task, max(1, trials // len(pilot))) for task in pilot))


class CellStudy(ABC, Generic[_Place]):
    """What studies share that run a fixed set of cells, each once: plan, rounds, progress and key.

    ``trials_are`` says what its trials are, for the plan. ``pilot_trials`` is how many a task of its pilot has:
    `BLOCK` where the trials of a task run together and cost less than alone.
    """

    __slots__ = ()
    trials_are: ClassVar[str] = "trials"
    pilot_trials: ClassVar[int] = 1

    @abstractmethod
    def cells(self) -> Iterable[tuple[_Place, Cell]]:
        """Return every cell under its place in the experiment."""

    @property
    def key(self) -> str:
        """Content key of all cells."""
        return content_key(type(self).__name__, sorted((*cell.group, cell.trials) for _, cell in self.cells()))

    def plan(self) -> Plan:
        """Return the numbers of cells and trials, and a pilot over them."""
        cells = [cell for _, cell in self.cells()]
        lines = [f"{len(cells)} cells, {sum(cell.trials for cell in cells)} {self.trials_are}"]
        return plan_of(cells, lines, pilot_trials=self.pilot_trials)

    def next_batch(self, evaluations: Sequence[Evaluation | Failure]) -> Round:
        """Return the only round."""
        return next_round((cell for _, cell in self.cells()), evaluations)

    def best_so_far(self, evaluations: Sequence[Evaluation | Failure]) -> str:
        """Return the number of finished cells."""
        return f"{len(self.finished(evaluations))} of {sum(1 for _ in self.cells())} cells"

    def finished(self, evaluations: Sequence[Evaluation | Failure]) -> dict[_Place, TrialOutcomes]:
        """Return the outcomes of the cells that are finished, by their places."""
        return finished(self.cells(), evaluations)
