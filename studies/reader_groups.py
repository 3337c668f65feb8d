"""Reader groups chosen by convex optimisation beside those of a spec, on the same drives."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar, Final

from layoutopt.protocols import Evaluation, Failure, Plan, StudyCard
from layoutopt.spec.building import Spec
from layoutopt.workers import Workers
from studies.cells import Cell, CellStudy, plan_of
from studies.held_out import failures_of
from studies.page_answer import PageAnswer
from studies.reader_group_page import page_of, summary
from studies.reader_group_setting import Comparison, comparison_of, pairs

CARD: Final = StudyCard(
    summary="D- and A-optimal places of antennas under the robot beside the spec's families, on the same drives.",
    reference="own; Joshi and Boyd, IEEE Trans. Signal Process. 57, 2009 (sensor selection by relaxation)",
    question="Where under the robot should n antennas go?",
    adaptive=False,
    rests_on="Places are optimal for a linear model of a single reading, within the gap that is told. "
    "The drives that compare them are simulated and the same for all.",
    next_step="Copy the lines of a group from its listing into the readers of [space], and run cost_vs_accuracy.",
    guide="reader_groups",
)
TRIALS: Final = 96
_QUICK_TRIALS: Final = 4
_QUICK_SETTINGS: Final = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class ReaderGroups(CellStudy[tuple[int, str]]):
    """The comparison over the middle pattern of a spec, with its first estimator, on its design scenario."""

    comparison: Comparison
    trials: int
    seed: int
    card: ClassVar[StudyCard] = CARD

    @classmethod
    def for_spec(cls, spec: Spec, *, quick: bool, workers: Workers | None = None) -> "ReaderGroups":
        """Return the study of a spec; a quick one has few trials, mounts and numbers of antennas."""
        problem = spec.problem()
        settings = {"most": _QUICK_SETTINGS} if quick else {}
        return cls(
            comparison=comparison_of(
                problem.space, problem.design, problem.estimators[0], seed=spec.seed, **settings
            ),
            trials=_QUICK_TRIALS if quick else TRIALS,
            seed=spec.seed,
        )

    def cells(self) -> Iterator[tuple[tuple[int, str], Cell]]:
        """Yield every cell under the number of its setting and its label; equal groups share their drives."""
        for number, _, contender in pairs(self.comparison.settings):
            yield (
                (number, contender.label),
                Cell(
                    layout=contender.layout,
                    scenario=self.comparison.scenario,
                    estimator=self.comparison.estimator,
                    trials=self.trials,
                ),
            )

    def plan(self) -> Plan:
        """Return the numbers of groups and trials, and a pilot over them."""
        chosen = sum(len(setting.choices) for setting in self.comparison.settings)
        cells = [cell for _, cell in self.cells()]
        lines = [
            f"{len(self.comparison.settings)} mounts and numbers of antennas, {chosen} relaxations solved already",
            f"{len(cells)} groups with {self.trials} drives each",
        ]
        return plan_of(cells, lines)

    def answer(self, evaluations: Sequence[Evaluation | Failure], spec: Spec) -> PageAnswer:
        """Return the outcomes, ready to be told; the spec has nothing to add."""
        found, failures = self.finished(evaluations), failures_of(evaluations)
        return PageAnswer(
            study="reader_groups",
            summary=tuple(summary(self.comparison, found, seed=self.seed)),
            page=lambda _: page_of(self.comparison, found, seed=self.seed, failed=len(failures)),
            failures=failures,
        )
