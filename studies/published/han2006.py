"""han2006 run again: its Tables 1 and 2, what its open choices do, and what better estimators gain."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, Final

from layoutopt.estimators.one_reader import OneReader
from layoutopt.estimators.one_reader_centroid import OneReaderCentroid
from layoutopt.estimators.one_reader_minimax import OneReaderMinimax
from layoutopt.protocols import Estimator, Evaluation, Failure, StudyCard
from layoutopt.spec.building import Spec
from layoutopt.workers import Workers
from studies.cells import Cell, CellStudy
from studies.held_out import failures_of
from studies.page_answer import PageAnswer
from studies.published import han2006_page
from studies.published.han2006_setting import Choice, layout, patterns, scenario
from studies.published.one_by_one import OneByOne

CARD: Final = StudyCard(
    summary="Tables of han2006 again: floors, compensation, orientation; open choices one at a time.",
    reference="han2006, Tables 1-2, Fig. 15 and 17",
    question="Does one reader localise as han2006 reports, and what do triangular floors and compensation bring?",
    adaptive=False,
    rests_on="Errors are simulated from what the paper states and from what was chosen where it is "
    "silent; choices are varied one at a time, on the same drives. Agreement with a table is no proof "
    "of either.",
    next_step="Take the choices that matter into your own robot's [robots] and faults; "
    "pattern_comparison asks the question for your own floor.",
    guide="published_han2006",
)
Place = tuple[str, str, str, Choice]
"""Path, floor, estimator and open choices of one cell."""
PATHS: Final = ("line", "circle")
GAINS: Final = (0.7, 0.5, 0.3, 0.2, 0.1, 0.05)
WHEELS: Final = (0.005, 0.05)
RADII_M: Final = (0.075, 0.1, 0.15)
QUICK: Final = ("midrange", "midrange, gain 0.3", "minimax, variances")


@lru_cache(maxsize=1)
def estimators() -> Mapping[str, Estimator]:
    """Return the estimators by the names of the page."""
    single = OneReader(compensation="none", gathering="one_by_one")
    return {
        "midrange": OneReader(compensation="none"),
        **{f"midrange, gain {gain:g}": OneReader(gain=gain) for gain in GAINS},
        "midrange, variances": OneReader(compensation="variance"),
        "centroid": OneReaderCentroid(compensation="none"),
        "minimax": OneReaderMinimax(compensation="none"),
        "centroid, variances": OneReaderCentroid(),
        "minimax, variances": OneReaderMinimax(),
        "midrange, chained arcs": OneReader(compensation="none", orientation="arc"),
        "midrange, wheels": OneReader(compensation="none", orientation="wheels"),
        "midrange, tags one by one": OneByOne(inner=single),
    }


@dataclass(frozen=True, slots=True, kw_only=True)
class Han2006(CellStudy[Place]):
    """The published experiment of han2006 with these estimators; of a spec it takes the seed alone."""

    trials: int
    names: tuple[str, ...]
    open_choices: bool
    seed: int
    card: ClassVar[StudyCard] = CARD
    trials_are: ClassVar[str] = "drives"

    @classmethod
    def for_spec(cls, spec: Spec, *, quick: bool, workers: Workers | None = None) -> "Han2006":
        """Return the study with the seed of a spec; a quick one has few estimators and no open choices."""
        if quick:
            return cls(trials=2, names=QUICK, open_choices=False, seed=spec.seed)
        return cls(trials=32, names=tuple(estimators()), open_choices=True, seed=spec.seed)

    def cells(self) -> Iterator[tuple[Place, Cell]]:
        """Yield every cell: all floors, paths and estimators at the base choices, and some at others."""
        base = Choice()
        for path in PATHS:
            for floor in patterns():
                for name in self.names:
                    yield self._cell(path, floor, name, base)
        if not self.open_choices:
            return
        for wheels in WHEELS:
            for name in ("midrange", "midrange, gain 0.3", "midrange, gain 0.05", "midrange, variances"):
                yield self._cell("circle", "isosceles", name, Choice(wheels=wheels))
        for radius_m in RADII_M:
            for floor in patterns():
                yield self._cell("circle", floor, "midrange", Choice(radius_m=radius_m))

    def _cell(self, path: str, floor: str, name: str, choice: Choice) -> tuple[Place, Cell]:
        return (path, floor, name, choice), Cell(
            layout=layout(patterns()[floor], choice),
            scenario=scenario(path, choice),
            estimator=estimators()[name],
            trials=self.trials,
        )

    def answer(self, evaluations: Sequence[Evaluation | Failure], spec: Spec) -> PageAnswer:
        """Return our numbers beside the paper's; the spec has nothing to add."""
        found, failures = self.finished(evaluations), failures_of(evaluations)
        return PageAnswer(
            study="published/han2006",
            summary=tuple(han2006_page.summary(found)),
            page=lambda streams: han2006_page.page_of(found, streams, failed=len(failures)),
            failures=failures,
        )
