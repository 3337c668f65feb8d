"""Which estimator makes the most of the same readings, and how far from the limit it stays."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, Final

from layoutopt import registry
from layoutopt.protocols import AnyEstimator, Estimator, Evaluation, Failure, Plan, StudyCard, Task
from layoutopt.scenario import Faults, Scenario
from layoutopt.spec.building import Spec
from layoutopt.workers import Workers
from studies.cells import Cell, CellStudy
from studies.estimator_page import BASE, LIMIT, page_of, summary
from studies.held_out import failures_of
from studies.page_answer import PageAnswer
from studies.published import mi2016_setting as setting

CARD: Final = StudyCard(
    summary="Every estimator of floor tags on the same drives of mi2016's eight readers, with and without faults.",
    reference="own; the world is that of mi2016, Table 4",
    question="Which estimator makes the most of the same readings, and how far is it from the limit?",
    adaptive=False,
    rests_on="Errors are simulated, for one robot over two densities of tags, on the same drives for "
    "all estimators. Real readers have faults beside those simulated.",
    next_step="Name the best one that your robots can run first in validate_with under [study]: all "
    "studies then judge by it. Try it on a drive of your own with layoutopt replay.",
    guide="estimators",
)
DENSITIES: Final = (100, 16)
FAULTS: Final = Faults(
    tag_placement_sigma_m=0.003,
    dead_tag_share=0.01,
    missed_read_share=0.02,
    wrong_identity_share=0.01,
    read_edge_m=0.002,
)
"""What a real floor does, as the main study's held-out faults have it, and one read in a hundred misread."""
KIDNAPPED_AT_S: Final = 20.0
WORLDS: Final = ("as planned", "faults", "kidnapped")


@dataclass(frozen=True, slots=True, kw_only=True)
class Contender:
    """An estimator with its settings, by a label; ``limit`` if it is too slow for anything but comparison."""

    label: str
    estimator: Estimator
    limit: bool = False


@lru_cache(maxsize=1)
def contenders() -> tuple[Contender, ...]:
    """Return the estimators: each at the paper's number of particles, and at others that tell what these buy."""

    def made(name: str, label: str, *, limit: bool = False, **settings: object) -> Contender:
        return Contender(label=label, estimator=registry.load("estimators", name)(**settings), limit=limit)

    return (
        made("mcl", "mcl (Gaussian), 500", likelihood="gaussian"),
        made("mcl", BASE),
        made("mcl", "mcl, 2,000", particles=2000),
        made("mcl", "mcl, 8,000", particles=8000),
        made("mcl_crossings", "mcl_crossings, 250", particles=250),
        made("mcl_crossings", "mcl_crossings, 500"),
        made("mcl_negative_information", "mcl_negative_information, 250", particles=250),
        made("mcl_negative_information", "mcl_negative_information, 500"),
        made("mcl_negative_information", "mcl_negative_information, 2,000", particles=2000),
        made("mcl_adaptive", "mcl_adaptive, 100 to 4,000"),
        made("bayes_limit", "bayes_limit, 10,000", particles=10_000, limit=True),
        made("bayes_limit", LIMIT, limit=True),
        made("midrange", "midrange"),
        made("odometry", "odometry"),
    )


def world(name: str) -> Scenario:
    """Return one of the worlds; all have the same drives, because they share the name of their streams."""
    if name == "as planned":
        return setting.scenario()
    faults = FAULTS if name == "faults" else Faults(kidnapped_at_s=KIDNAPPED_AT_S)
    return setting.scenario(faults=faults)


@dataclass(frozen=True, slots=True, kw_only=True)
class EstimatorComparison(CellStudy[tuple[str, int, str]]):
    """The comparison; of a spec it takes the seed alone."""

    trials: int
    limit_trials: int
    seed: int
    card: ClassVar[StudyCard] = CARD

    @classmethod
    def for_spec(cls, spec: Spec, *, quick: bool, workers: Workers | None = None) -> "EstimatorComparison":
        """Return the study with the seed of a spec; a quick one has few trials."""
        return cls(trials=4 if quick else 96, limit_trials=1 if quick else 24, seed=spec.seed)

    def cells(self) -> Iterator[tuple[tuple[str, int, str], Cell]]:
        """Yield every cell under its world, density and estimator; the limits run in the planned world only."""
        for name in WORLDS:
            for density in DENSITIES:
                for item in contenders():
                    if item.limit and name != "as planned":
                        continue
                    yield (
                        (name, density, item.label),
                        Cell(
                            layout=setting.layout(8, density),
                            scenario=world(name),
                            estimator=item.estimator,
                            trials=self.limit_trials if item.limit else self.trials,
                        ),
                    )

    def plan(self) -> Plan:
        """Return the numbers of trials; the pilot has one of every estimator, because their costs differ most."""
        cells = [cell for _, cell in self.cells()]
        trials = Counter[AnyEstimator]()
        for cell in cells:
            trials[cell.estimator] += cell.trials
        first = {cell.estimator: cell for cell in reversed(cells)}
        pilot = [
            (
                Task(layout=cell.layout, scenario=cell.scenario, estimator=estimator, first=0, count=1),
                trials[estimator],
            )
            for estimator, cell in first.items()
        ]
        return Plan(lines=(f"{len(cells)} cells, {trials.total()} trials",), pilot=tuple(pilot))

    def answer(self, evaluations: Sequence[Evaluation | Failure], spec: Spec) -> PageAnswer:
        """Return the outcomes, ready to be told; the spec has nothing to add."""
        found, failures = self.finished(evaluations), failures_of(evaluations)
        return PageAnswer(
            study="estimator_comparison",
            summary=tuple(summary(found)),
            page=lambda _: page_of(found, self.seed, len(failures)),
            failures=failures,
        )
