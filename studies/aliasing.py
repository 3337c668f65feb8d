"""Whether a robot can take one place for another: poses with the same reads, and starts that are never found."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar, Final

from layoutopt.detection import antennas_of
from layoutopt.layout import Layout
from layoutopt.protocols import Antennas, Evaluation, Failure, StudyCard
from layoutopt.spec.building import Spec
from layoutopt.workers import Workers
from studies.cells import Cell, CellStudy
from studies.held_out import failures_of
from studies.page_answer import PageAnswer
from studies.recovery import UNKNOWN_START, Place, Recovery
from studies.same_reads import Likeness, likeness

CARD: Final = StudyCard(
    summary="How far poses with the same reads are apart, and how often an unknown start is never found.",
    reference="own",
    question="Can my robot take one place for another?",
    adaptive=False,
    rests_on="Poses are drawn at random, so that the largest distance found is a lower bound of the "
    "largest there is. Shares of drives have 95 % intervals.",
    next_step="Where two places look alike, let robots start at a known place, or take a pattern and "
    "readers that read several tags at once.",
    guide="study_aliasing",
)
_POSES: Final = 50_000
_QUICK_POSES: Final = 5_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Aliasing(CellStudy[Place]):
    """The patterns of the study of lost robots that repeat, with the estimator of the search.

    Attributes
    ----------
    lost
        The study of lost robots, of which the unknown start is driven.
    poses
        Poses that are drawn over each pattern.
    """

    lost: Recovery
    poses: int
    card: ClassVar[StudyCard] = CARD

    @classmethod
    def for_spec(cls, spec: Spec, *, quick: bool, workers: Workers | None = None) -> "Aliasing":
        """Return the study of a spec; a quick one has two patterns and two drives of each.

        Raises
        ------
        InvalidInput
            If no layout of the space can be built.
        """
        lost = Recovery.for_spec(spec, quick=quick, workers=workers)
        return cls(lost=lost, poses=_QUICK_POSES if quick else _POSES)

    def cells(self) -> Iterator[tuple[Place, Cell]]:
        """Yield the cells of the unknown start with the estimator of the search."""
        search = self.lost.estimators[0].name
        for place, cell in self.lost.cells():
            if place.situation == UNKNOWN_START and place.estimator == search:
                yield place, cell

    def antennas(self, layout: Layout) -> Antennas:
        """Return the antennas of a layout in columns."""
        return antennas_of(layout, self.lost.design.step_s)

    def likenesses(self) -> dict[int, Likeness]:
        """Return how alike poses are over each pattern that repeats, by the number of its layout."""
        found = {}
        for number, layout in enumerate(self.lost.layouts):
            pattern = layout.floor_tags.base.pattern
            if pattern.cell_m is not None:
                found[number] = likeness(pattern, self.antennas(layout), self.poses, self.lost.seed)
        return found

    def answer(self, evaluations: Sequence[Evaluation | Failure], spec: Spec) -> PageAnswer:
        """Return the outcomes, ready to be told; the spec has nothing to add."""
        # Imported here because the page needs what this module defines.
        from studies.aliasing_page import page_of, summary

        found, failures = self.finished(evaluations), failures_of(evaluations)
        alike = self.likenesses()
        return PageAnswer(
            study="aliasing",
            summary=tuple(summary(self, alike, found)),
            page=lambda _: page_of(self, alike, found, failed=len(failures)),
            failures=failures,
        )
