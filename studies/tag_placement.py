"""Single tags placed where robots need them, beside regular patterns, on the same drives."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Final

from layoutopt.identity import content_key
from layoutopt.layout import ReaderGroup
from layoutopt.problem import Problem
from layoutopt.protocols import Evaluation, Failure, Plan, StudyCard
from layoutopt.spec.building import Spec
from layoutopt.workers import Workers
from studies.cells import Cell, CellStudy, plan_of
from studies.held_out import failures_of
from studies.page_answer import LayoutsAnswer, PageAnswer
from studies.tag_placement_page import page_of
from studies.tag_placement_rivals import Rival, rivals_of
from studies.tag_placement_setting import Asked, Found, asked_of, found_for, reader_of
from studies.tag_placement_words import Told, summary

CARD: Final = StudyCard(
    summary="The fewest single tags that show a robot what it demands, beside regular patterns on equal drives.",
    reference="own; row weighting local search after Gao, Weise and Li, Eur. J. Oper. Res. 246, 2015",
    question="Where do the tags go on my floor?",
    adaptive=False,
    rests_on="What robots see is checked along their routes and at sampled poses, on finer samples "
    "than the search used; bounds on the number of tags are proven where told. Errors are simulated.",
    next_step="Draw the placement with layoutopt draw, from the file in layouts/ that the report names; or relax "
    "a demand of the placement in your spec and run this again.",
    guide="single_tags",
)
TRIALS: Final = 48
_QUICK_TRIALS: Final = 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TagPlacementStudy(CellStudy[str]):
    """One placement, then drives over it and over regular patterns with the first estimator of the spec.

    The placement is searched when it is first asked for; it is a function of the question.
    """

    problem: Problem
    asked: Asked
    group: ReaderGroup
    trials: int
    card: ClassVar[StudyCard] = CARD
    trials_are: ClassVar[str] = "drives"
    known: dict[str, tuple[Rival, ...]] = field(default_factory=dict, repr=False)

    @classmethod
    def for_spec(cls, spec: Spec, *, quick: bool, workers: Workers | None = None) -> "TagPlacementStudy":
        """Return the study of a spec; a quick one samples coarsely and searches shortly.

        Raises
        ------
        InvalidInput
            If the reader group cannot be built, there is no slot or too many, or a forbidden or required place is
            none.
        """
        problem = spec.problem()
        return cls(
            problem=problem,
            asked=asked_of(spec, problem, quick=quick),
            group=reader_of(spec, problem),
            trials=_QUICK_TRIALS if quick else TRIALS,
        )

    @property
    def found(self) -> Found:
        """The placement."""
        return found_for(self.asked)

    @property
    def rivals(self) -> tuple[Rival, ...]:
        """Layouts that are driven over; empty where none can be built."""
        if self.asked.key not in self.known:
            self.known[self.asked.key] = rivals_of(self.problem, self.asked, self.group, self.found.placed)
        return self.known[self.asked.key]

    @property
    def key(self) -> str:
        """Content key of the question and of the drives."""
        patterns = [
            pattern.key
            for families in self.problem.space.patterns.values()
            for family in families
            for pattern in family.options()
        ]
        estimator = self.problem.estimators[0]
        return content_key("tag_placement", self.asked.key, patterns, estimator.key, self.trials)

    def cells(self) -> Iterator[tuple[str, Cell]]:
        """Yield every cell under its label."""
        for rival in self.rivals:
            yield (
                rival.label,
                Cell(
                    layout=rival.layout,
                    scenario=self.problem.design,
                    estimator=self.problem.estimators[0],
                    trials=self.trials,
                ),
            )

    def plan(self) -> Plan:
        """Return what was placed and the numbers of layouts and drives, with a pilot over them."""
        placed = self.found.placed
        tags = "no tags placed" if placed.xy_m is None else f"{self.found.new} new tags placed already"
        return plan_of(
            (cell for _, cell in self.cells()),
            [tags, f"{len(self.rivals)} layouts with {self.trials} drives each"],
        )

    def answer(self, evaluations: Sequence[Evaluation | Failure], spec: Spec) -> "LayoutsAnswer":
        """Return the placement with what the drives say of it."""
        failures = failures_of(evaluations)
        told = Told(
            spec=spec,
            problem=self.problem,
            asked=self.asked,
            found=self.found,
            rivals=self.rivals,
            driven=self.finished(evaluations),
            trials=self.trials,
            failed=len(failures),
        )
        return LayoutsAnswer(
            page=PageAnswer(
                study="tag_placement",
                summary=tuple(summary(told)),
                page=lambda _: page_of(told),
                failures=failures,
                nothing_tried=not self.rivals,
            ),
            layouts=tuple(rival.layout for rival in self.rivals),
            status=self.found.placed.status,
            spec=spec,
        )
