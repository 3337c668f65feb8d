"""Which tag pattern to lay at a given number of tags: bounds, blind runs, and what each estimator makes of it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, Final

from layoutopt import registry
from layoutopt.protocols import Estimator, Evaluation, Failure, StudyCard
from layoutopt.spec.building import Spec
from layoutopt.workers import Workers
from studies import pattern_setting
from studies.cells import Cell, CellStudy
from studies.held_out import failures_of
from studies.page_answer import PageAnswer
from studies.pattern_page import page_of, summary

CARD: Final = StudyCard(
    summary="All tag patterns at equal density: bounds, invisibility, each estimator on the same drives.",
    reference="own; patterns and robots of han2006, kim2010 and mi2016",
    question="Which pattern makes the most of the same number of tags?",
    adaptive=False,
    rests_on="Bounds and blind runs are exact. Errors are simulated in an empty hall with perfect "
    "tags, on the same drives for all patterns; your floor and your faults are not in them.",
    next_step="Put the patterns that do well into the patterns of [space], and let cost_vs_accuracy "
    "judge them in your own rooms.",
    guide="patterns",
)
ESTIMATORS: Final = (
    "odometry",
    "odometry_gyro",
    "midrange",
    "one_reader",
    "one_reader_centroid",
    "one_reader_minimax",
    "crossing_time",
    "crossing_time_branches",
    "mcl",
    "mcl_crossings",
    "mcl_negative_information",
    "mcl_adaptive",
)
"""All but the filter near the Bayes limit, which takes as long as all others together."""
QUICK: Final = ("square", "tilted")
"""Patterns of a quick look."""


@lru_cache(maxsize=1)
def estimators() -> tuple[Estimator, ...]:
    """Return the estimators with their own settings."""
    return tuple(registry.load("estimators", name)() for name in ESTIMATORS)


@dataclass(frozen=True, slots=True, kw_only=True)
class PatternComparison(CellStudy[tuple[str, str, str]]):
    """The comparison of the patterns with these labels; of a spec it takes the seed alone."""

    trials: int
    labels: tuple[str, ...]
    seed: int
    card: ClassVar[StudyCard] = CARD

    @classmethod
    def for_spec(cls, spec: Spec, *, quick: bool, workers: Workers | None = None) -> "PatternComparison":
        """Return the study with the seed of a spec; a quick one has few trials and patterns."""
        every = tuple(pattern_setting.patterns(pattern_setting.settings()[0]))
        return cls(trials=2 if quick else 24, labels=QUICK if quick else every, seed=spec.seed)

    def cells(self) -> Iterator[tuple[tuple[str, str, str], Cell]]:
        """Yield every cell under its setting, pattern and estimator, where the estimator applies."""
        scenario = pattern_setting.world()
        for setting in pattern_setting.settings():
            for label, pattern in pattern_setting.patterns(setting).items():
                if label not in self.labels:
                    continue
                layout = setting.layout(pattern)
                for estimator in estimators():
                    if not estimator.applies(layout):
                        yield (
                            (setting.name, label, estimator.name),
                            Cell(layout=layout, scenario=scenario, estimator=estimator, trials=self.trials),
                        )

    def answer(self, evaluations: Sequence[Evaluation | Failure], spec: Spec) -> PageAnswer:
        """Return the outcomes, ready to be told; the spec has nothing to add."""
        found, failures = self.finished(evaluations), failures_of(evaluations)
        return PageAnswer(
            study="pattern_comparison",
            summary=tuple(summary(found)),
            page=lambda _: page_of(found, self.labels, seed=self.seed, failed=len(failures)),
            failures=failures,
        )
