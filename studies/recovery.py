"""How long a lost robot takes to find itself: kidnapped, or switched on anywhere, by pattern and estimator."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Final, NamedTuple

from layoutopt import feasibility
from layoutopt.layout import WHOLE_FLOOR, Layout, TagPattern
from layoutopt.protocols import Estimator, Evaluation, Failure, StudyCard
from layoutopt.scenario import Scenario
from layoutopt.spec.building import Spec
from layoutopt.workers import Workers
from studies.cells import Cell, CellStudy
from studies.held_out import failures_of
from studies.page_answer import PageAnswer
from studies.reader_group_setting import spread
from studies.swept import QUICK_TRIALS, TRIALS, first_layout, tag_estimators, world_text

CARD: Final = StudyCard(
    summary="Share of robots that are localised over time, after kidnapping and from an unknown start.",
    reference="own; Thrun, Burgard and Fox, Probabilistic Robotics, 2005, Chapter 8, for the terms",
    question="How long does a lost robot take to find itself?",
    adaptive=False,
    rests_on="Robots are simulated with tags that have identities of their own; shares have 95 % "
    "intervals. Robots that are not back at the end of a drive count as not back, however near they "
    "were.",
    next_step="Take the estimator and the pattern that find robots again in the time that you can "
    "wait, and run cost_vs_accuracy with them.",
    guide="study_recovery",
)
KIDNAPPED: Final = "kidnapped"
UNKNOWN_START: Final = "unknown start"
COLUMNS: Final = {KIDNAPPED: "recovery_time", UNKNOWN_START: "time_to_localise"}
KIDNAPPED_AT: Final = 1 / 3
"""Of a drive: so that the filter has settled before, and two thirds are left."""
_PATTERNS: Final = 4
_QUICK_PATTERNS: Final = 2


class Place(NamedTuple):
    """A cell: what happened, the estimator, and the pattern by its number."""

    situation: str
    estimator: str
    pattern: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Recovery(CellStudy[Place]):
    """The spec's first layout with several patterns of its space, on robots that are lost.

    Attributes
    ----------
    layouts
        Layouts by falling density of the tags on the whole floor.
    refused
        Patterns and estimators that were left out, each with the reason.
    """

    layouts: tuple[Layout, ...]
    design: Scenario
    estimators: tuple[Estimator, ...]
    trials: int
    seed: int
    world: str
    refused: tuple[tuple[str, str], ...]
    card: ClassVar[StudyCard] = CARD

    @classmethod
    def for_spec(cls, spec: Spec, *, quick: bool, workers: Workers | None = None) -> "Recovery":
        """Return the study of a spec; a quick one has two patterns and two drives of each.

        Raises
        ------
        InvalidInput
            If no layout of the space can be built.
        """
        first = first_layout(spec)
        estimators, refused = tag_estimators(spec, first)
        layouts = []
        for layout in _by_density(spec, first):
            if broken := feasibility.check(layout, spec.design):
                refused.append((layout.label, broken[0].message))
            else:
                layouts.append(layout)
        return cls(
            layouts=tuple(spread(layouts, _QUICK_PATTERNS if quick else _PATTERNS)),
            design=spec.design,
            estimators=tuple(estimators),
            trials=QUICK_TRIALS if quick else TRIALS,
            seed=spec.seed,
            world=world_text(spec),
            refused=tuple(refused),
        )

    @property
    def kidnapped_at_s(self) -> float:
        """When the robot is lifted, s."""
        return KIDNAPPED_AT * self.design.duration_s

    def limit_s(self, situation: str) -> float:
        """Return how long a robot has to find itself, s."""
        duration_s = self.design.duration_s
        if situation == UNKNOWN_START:
            return duration_s
        lifted = self.scenario(situation).lifted_after
        return duration_s - self.design.step_s * (0 if lifted is None else lifted)

    def scenario(self, situation: str) -> Scenario:
        """Return the world in which a robot gets lost in one of the two ways."""
        faults = replace(self.design.faults, start_offset=(0.0, 0.0, 0.0), kidnapped_at_s=None)
        if situation == UNKNOWN_START:
            return replace(self.design, start_known=False, faults=faults)
        return replace(self.design, start_known=True, faults=replace(faults, kidnapped_at_s=self.kidnapped_at_s))

    def cells(self) -> Iterator[tuple[Place, Cell]]:
        """Yield every cell under its place."""
        for situation in COLUMNS:
            scenario = self.scenario(situation)
            for estimator in self.estimators:
                for number, layout in enumerate(self.layouts):
                    yield (
                        Place(situation, estimator.name, number),
                        Cell(layout=layout, scenario=scenario, estimator=estimator, trials=self.trials),
                    )

    def answer(self, evaluations: Sequence[Evaluation | Failure], spec: Spec) -> PageAnswer:
        """Return the outcomes, ready to be told; the spec has nothing to add."""
        # Imported here because the page needs what this module defines.
        from studies.recovery_page import page_of, summary

        found, failures = self.finished(evaluations), failures_of(evaluations)
        return PageAnswer(
            study="recovery",
            summary=tuple(summary(self, found)),
            page=lambda _: page_of(self, found, failed=len(failures)),
            failures=failures,
        )


def _by_density(spec: Spec, first: Layout) -> list[Layout]:
    """Return the first layout with each pattern that the space has for the whole floor, the densest first."""
    patterns: list[TagPattern] = [
        pattern for family in spec.space.patterns.get(WHOLE_FLOOR, ()) for pattern in family.options()
    ]
    made: dict[str, Layout] = {}
    for pattern in sorted(patterns, key=lambda pattern: -pattern.density_per_m2):
        zones = tuple(
            replace(entry, pattern=pattern) if entry.zone == WHOLE_FLOOR else entry
            for entry in first.floor_tags.zones
        )
        layout = first.replace(floor_tags=replace(first.floor_tags, zones=zones))
        made.setdefault(layout.key, layout)
    return list(made.values()) or [first]
