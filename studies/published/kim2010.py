"""kim2010 run again: the tour of its Fig. 11 to 15 over its floor and two others, and what its open choices do."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, Final

from layoutopt.estimators.crossing_time import CrossingTime
from layoutopt.estimators.crossing_time_branches import CrossingTimeBranches
from layoutopt.estimators.odometry import OdometryAlone
from layoutopt.protocols import Estimator, Evaluation, Failure, StudyCard
from layoutopt.spec.building import Spec
from layoutopt.workers import Workers
from studies.cells import Cell, CellStudy
from studies.held_out import failures_of
from studies.page_answer import PageAnswer
from studies.published import kim2010_page
from studies.published.kim2010_setting import Choice, layout, patterns, scenario

CARD: Final = StudyCard(
    summary="Homing tours of kim2010 over Sudoku, tilted and square floors; open choices one at a time.",
    reference="kim2010, Fig. 12-15",
    question="Does a robot that measures crossing times come home within 5 cm, and on what does it depend?",
    adaptive=False,
    rests_on="Tours are simulated from what the paper states and from what was chosen where it is "
    "silent; choices are varied one at a time, on the same tours.",
    next_step="Ask pattern_comparison and pattern_search for patterns of your own; docs/invisibility.md "
    "explains blind directions.",
    guide="published_kim2010",
)
Place = tuple[str, str, Choice]
"""Floor, estimator and open choices of one cell."""
HEADINGS_DEG: Final = (0.25, 0.5, 1.0, 2.0)
SCANS_S: Final = (0.02, 0.05, 0.1)
GRIDS: Final = (1, 2, 3)
RADII_M: Final = (0.09, 0.1, 0.11)


@lru_cache(maxsize=1)
def estimators() -> Mapping[str, Estimator]:
    """Return the estimators by the names of the page."""
    return {
        "paper": CrossingTime(),
        "branches, time": CrossingTimeBranches(clock="time"),
        "branches, wheels": CrossingTimeBranches(),
        "wheels alone": OdometryAlone(),
    }


@dataclass(frozen=True, slots=True, kw_only=True)
class Kim2010(CellStudy[Place]):
    """The published experiment of kim2010; of a spec it takes the seed alone."""

    trials: int
    open_choices: bool
    seed: int
    card: ClassVar[StudyCard] = CARD
    trials_are: ClassVar[str] = "tours"

    @classmethod
    def for_spec(cls, spec: Spec, *, quick: bool, workers: Workers | None = None) -> "Kim2010":
        """Return the study with the seed of a spec; a quick one leaves the open choices as they are."""
        return cls(trials=4 if quick else 100, open_choices=not quick, seed=spec.seed)

    def cells(self) -> Iterator[tuple[Place, Cell]]:
        """Yield every cell: all floors and estimators at the base choices, and the paper's floor at others."""
        base = Choice()
        for floor in patterns():
            for name in estimators():
                yield self._cell(floor, name, base)
        if not self.open_choices:
            return
        changed = [Choice(heading_deg=heading) for heading in HEADINGS_DEG]
        changed += [Choice(scan_s=scan) for scan in SCANS_S]
        changed += [Choice(grid=seed) for seed in GRIDS] + [Choice(radius_m=radius_m) for radius_m in RADII_M]
        for choice in dict.fromkeys(changed):
            if choice != base:
                for name in ("paper", "branches, time", "branches, wheels"):
                    yield self._cell("Sudoku", name, choice)

    def _cell(self, floor: str, name: str, choice: Choice) -> tuple[Place, Cell]:
        return (floor, name, choice), Cell(
            layout=layout(floor, choice),
            scenario=scenario(choice),
            estimator=estimators()[name],
            trials=self.trials,
        )

    def answer(self, evaluations: Sequence[Evaluation | Failure], spec: Spec) -> PageAnswer:
        """Return the homing errors beside the paper; the spec has nothing to add."""
        found, failures = self.finished(evaluations), failures_of(evaluations)
        return PageAnswer(
            study="published/kim2010",
            summary=tuple(kim2010_page.summary(found)),
            page=lambda streams: kim2010_page.page_of(found, streams, failed=len(failures)),
            failures=failures,
        )
