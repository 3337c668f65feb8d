"""liang2020 run again: its Tables 1 to 5 and Fig. 6, what it leaves open, and what aliases and headings gain."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Final

from layoutopt.protocols import Evaluation, Failure, Group, StudyCard
from layoutopt.spec.building import Spec
from layoutopt.streams import Streams
from layoutopt.workers import Workers
from studies.cells import Cell, CellStudy
from studies.held_out import failures_of
from studies.page_answer import PageAnswer
from studies.published import liang2020_page
from studies.published.liang2020_cells import Place, choices, quick_choices
from studies.published.liang2020_setting import cell
from studies.published.liang2020_timing import timing_lines

CARD: Final = StudyCard(
    summary="Tables of liang2020 again: tags, antennas, K, N, speeds, σ and ρ; aliases and headings beside them.",
    reference="liang2020, Tables 1-5, Fig. 3, 5 and 6",
    question="How well do UHF signals and a laser scanner track a walking person, and on what does it depend?",
    adaptive=False,
    rests_on="Walks are simulated from what the paper states; offsets of tags were fitted to one "
    "column of one table, everything else is compared. An ordering holds only where its 95 % interval "
    "says so.",
    next_step="Ask antenna_yaw and sampling for your own room.",
    guide="published_liang2020",
)
TRIALS: Final = 24
QUICK_TRIALS: Final = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class Liang2020(CellStudy[Place]):
    """The published experiment of liang2020; of a spec it takes the seed alone."""

    trials: int
    quick: bool
    seed: int
    card: ClassVar[StudyCard] = CARD
    trials_are: ClassVar[str] = "walks"

    @classmethod
    def for_spec(cls, spec: Spec, *, quick: bool, workers: Workers | None = None) -> "Liang2020":
        """Return the study with the seed of a spec; a quick one has few rows, and few walks of each."""
        return cls(trials=QUICK_TRIALS if quick else TRIALS, quick=quick, seed=spec.seed)

    def cells(self) -> Iterator[tuple[Place, Cell]]:
        """Yield every cell under its part, row and approach."""
        for place, choice in (quick_choices() if self.quick else choices()).items():
            yield place, cell(choice, self.trials)

    def answer(self, evaluations: Sequence[Evaluation | Failure], spec: Spec) -> "TimedAnswer":
        """Return our errors beside the paper's; the spec has nothing to add."""
        found, failures = self.finished(evaluations), failures_of(evaluations)
        page = PageAnswer(
            study="published/liang2020",
            summary=tuple(liang2020_page.summary(found)),
            page=lambda streams: liang2020_page.page_of(found, streams, failed=len(failures)),
            failures=failures,
        )
        return TimedAnswer(page=page, seed=self.seed)


@dataclass(frozen=True, slots=True, kw_only=True)
class TimedAnswer:
    """A page, and running times measured when it is told: they differ from run to run and are not on it."""

    page: PageAnswer
    seed: int

    @property
    def exit_code(self) -> int:
        """That of the page."""
        return self.page.exit_code

    @property
    def failures(self) -> Mapping[Group, str]:
        """Messages of tasks that raised, by group."""
        return self.page.failures

    def lines(self, folder: Path | None) -> list[str]:
        """Return what the page says, then the running times of Table 4 as measured now.

        Without a folder, for a program instead of a person, there are no running times: those lines rest on the
        evaluations alone.
        """
        lines = self.page.lines(folder)
        return lines if folder is None else [*lines, *timing_lines(Streams(seed=self.seed))]

    def write(self, folder: Path, *, streams: Streams, quick: bool) -> None:
        """Write tables, figures and report."""
        self.page.write(folder, streams=streams, quick=quick)
