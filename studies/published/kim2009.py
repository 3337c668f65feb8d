"""kim2009 run again: maps of direction errors, docking with and without its correction, and what docks better."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar, Final

from layoutopt.protocols import Evaluation, Failure, StudyCard
from layoutopt.spec.building import Spec
from layoutopt.workers import Workers
from studies.cells import BLOCK, Cell, CellStudy
from studies.held_out import failures_of
from studies.page_answer import PageAnswer
from studies.published import kim2009_page
from studies.published.kim2009_printed import CHAIRS, OBSTACLES
from studies.published.kim2009_setting import (
    BUMPER,
    CHANGED,
    CHANGED_OBSTACLES,
    CORRECTED,
    GROUPS,
    MEASURED,
    Choice,
    driven,
    estimators,
    layout,
    scenario,
)

CARD: Final = StudyCard(
    summary="Tables I to III of kim2009 again: direction errors, docking among obstacles, a better estimator.",
    reference="kim2009, Tables I-III, Fig. 5-7, 13, 14",
    question="Does a robot that follows a direction of arrival dock, and what does the published correction "
    "bring?",
    adaptive=False,
    rests_on="Docking is simulated from the formulas of the paper; where it is silent, a choice was "
    "made that is listed and varied. The field of a real room is richer.",
    next_step="Ask transponder_placement for a place in your own room.",
    guide="published_kim2009",
)
Place = tuple[str, Choice]
"""Estimator and choices of one cell."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Kim2009(CellStudy[Place]):
    """The published simulations of kim2009; of a spec it takes the seed alone.

    ``trials`` are drives a cell of Table II, ``more_trials`` those of Table III and of the open choices, which are
    left as they are unless ``open_choices``; ``rooms`` are the random rooms of Table I, row (d).
    """

    trials: int
    rooms: int
    more_trials: int
    open_choices: bool
    seed: int
    card: ClassVar[StudyCard] = CARD
    trials_are: ClassVar[str] = "drives"
    pilot_trials: ClassVar[int] = BLOCK

    @classmethod
    def for_spec(cls, spec: Spec, *, quick: bool, workers: Workers | None = None) -> "Kim2009":
        """Return the study with the seed of a spec; a quick one leaves the open choices as they are."""
        if quick:
            return cls(trials=24, rooms=40, more_trials=24, open_choices=False, seed=spec.seed)
        return cls(trials=1000, rooms=400, more_trials=300, open_choices=True, seed=spec.seed)

    def cells(self) -> Iterator[tuple[Place, Cell]]:
        """Yield every cell: Table II under each group of rules, Table III, and Table II at other choices."""
        for group, rules in GROUPS.items():
            for obstacles in OBSTACLES:
                for name in driven(group):
                    yield self._cell(name, rules.with_obstacles(obstacles), self.trials)
        for chairs in CHAIRS:
            for name in estimators():
                yield self._cell(name, Choice(obstacles=chairs, experiment=True), self.more_trials)
        if self.open_choices:
            for changed in CHANGED.values():
                for obstacles in CHANGED_OBSTACLES:
                    for name in (MEASURED, CORRECTED, BUMPER):
                        yield self._cell(name, changed.with_obstacles(obstacles), self.more_trials)

    def _cell(self, name: str, choice: Choice, trials: int) -> tuple[Place, Cell]:
        return (name, choice), Cell(
            layout=layout(experiment=choice.experiment),
            scenario=scenario(choice),
            estimator=estimators()[name],
            trials=trials,
        )

    def answer(self, evaluations: Sequence[Evaluation | Failure], spec: Spec) -> PageAnswer:
        """Return the paper's tables beside ours; the spec has nothing to add."""
        found, failures = self.finished(evaluations), failures_of(evaluations)
        return PageAnswer(
            study="published/kim2009",
            summary=tuple(kim2009_page.summary(found)),
            page=lambda streams: kim2009_page.page_of(found, streams, rooms=self.rooms, failed=len(failures)),
            failures=failures,
        )
