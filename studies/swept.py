"""Studies that vary one quantity of a spec's own layout or world: points, base, and which layout is varied."""

from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import ClassVar, Final, NamedTuple

from layoutopt import feasibility
from layoutopt.errors import InvalidInput
from layoutopt.layout import Layout
from layoutopt.parts import Scope
from layoutopt.plots.curves import Panel
from layoutopt.protocols import Estimator, Evaluation, Failure, StudyCard
from layoutopt.scenario import Scenario
from layoutopt.scores import Score, TrialOutcomes, paired_difference
from layoutopt.spec.building import Spec
from layoutopt.workers import Workers
from objectives.cost import Cost
from studies.cells import Cell, CellStudy
from studies.held_out import failures_of
from studies.page_answer import PageAnswer

GOAL: Final = "position_error_mean"
ALLOWANCE: Final = 0.1
"""By which share an error may grow and still count as the same: about what `TRIALS` drives resolve."""
TRIALS: Final = 48
QUICK_TRIALS: Final = 2
BASE_RULE: Final = (
    "The layout is the first of the design space that can be built and that the estimators apply to. To ask of "
    "another, put its values first in the lists of [space]."
)
_NO_NUMBERS: Final[Mapping[str, float]] = MappingProxyType({})


class Place(NamedTuple):
    """A point of a sweep: the series, and the value of what is varied, in SI units."""

    series: str
    value: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Axis:
    """What is varied: name of its column with unit, words, and how it is shown: times ``factor``, in ``unit``."""

    name: str
    words: str
    unit: str = ""
    factor: float = 1.0

    @property
    def label(self) -> str:
        """Words and unit, for an axis of a figure."""
        return f"{self.words} ({self.unit})" if self.unit else self.words

    def text(self, value: float) -> str:
        """Return a value with its unit."""
        return f"{self.factor * value:.4g} {self.unit}".rstrip()


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """One point: its cell, and exact numbers by the names of their columns, with unit."""

    place: Place
    cell: Cell
    exact: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sweep:
    """All points of a study.

    Attributes
    ----------
    base
        By series, the place with which its points are compared.
    target_m
        The spec's demand on the mean position error; ``None`` for none.
    layout
        Label of the layout that is varied.
    prices
        Name and date of the price list.
    refused
        What was left out, each with the reason.
    """

    axis: Axis
    points: tuple[Point, ...]
    base: Mapping[str, Place]
    target_m: float | None
    layout: str
    world: str
    estimators: str
    seed: int
    prices: str
    refused: tuple[tuple[str, str], ...] = ()

    @property
    def series(self) -> tuple[str, ...]:
        """Names of the series in their order."""
        return tuple(dict.fromkeys(point.place.series for point in self.points))

    def of(self, series: str) -> list[Point]:
        """Return the points of a series by rising value."""
        return sorted((p for p in self.points if p.place.series == series), key=lambda p: p.place.value)


Found = Mapping[Place, TrialOutcomes]


class SweepStudy(CellStudy[Place]):
    """What studies of one sweep share: cells and the page; each says its title, its words and what is drawn."""

    __slots__ = ()
    card: ClassVar[StudyCard]
    title: ClassVar[str]
    command: ClassVar[str]
    sweep: Sweep

    @classmethod
    @abstractmethod
    def for_spec(cls, spec: Spec, *, quick: bool, workers: Workers | None = None) -> "SweepStudy":
        """Return the study that a spec asks for."""

    @abstractmethod
    def summary(self, found: Found) -> list[str]:
        """Return the answer in a few sentences."""

    @abstractmethod
    def panels(self, found: Found) -> list[Panel]:
        """Return what is drawn, side by side; each with a curve or nothing at all."""

    @abstractmethod
    def words(self) -> tuple[str, ...]:
        """Return what is to be known of the figure and the table, in paragraphs."""

    def cells(self) -> Iterator[tuple[Place, Cell]]:
        """Yield every cell under its place."""
        for point in self.sweep.points:
            yield point.place, point.cell

    def answer(self, evaluations: Sequence[Evaluation | Failure], spec: Spec) -> PageAnswer:
        """Return the outcomes, ready to be told; the spec has nothing to add."""
        # Imported here because the page needs what this module defines.
        from studies.swept_page import page_of

        found, failures = self.finished(evaluations), failures_of(evaluations)
        return PageAnswer(
            study=self.command,
            summary=tuple(self.summary(found)),
            page=lambda _: page_of(self, found, failed=len(failures)),
            failures=failures,
        )


def first_layout(spec: Spec) -> Layout:
    """Return the layout that is varied: see `BASE_RULE`.

    Raises
    ------
    InvalidInput
        If no layout of the space can be built and judged; the message holds the first reason.
    """
    scenario, estimator = spec.design, spec.problem().estimators[0]
    first = ""
    for layout in spec.space.layouts():
        reason = reason_against(layout, scenario, estimator)
        if not reason:
            return layout
        first = first or f"{layout.label}: {reason}"
    raise InvalidInput.at(
        "space",
        f"no layout can be built and judged; the first, {first}",
        "Widen the lists of [space], or allow more with another reader_profile.",
    )


def reason_against(layout: Layout, scenario: Scenario, estimator: Estimator) -> str:
    """Return why a layout cannot be built or judged; empty if it can."""
    broken = feasibility.check(layout, scenario)
    return broken[0].message if broken else estimator.applies(layout)


def point_of(
    place: Place,
    layout: Layout,
    scenario: Scenario,
    estimator: Estimator,
    *,
    quick: bool,
    exact: Mapping[str, float] = _NO_NUMBERS,
) -> Point:
    """Return a point with as many drives as all have; ``exact`` are numbers by the names of their columns."""
    trials = QUICK_TRIALS if quick else TRIALS
    return Point(
        place=place,
        cell=Cell(layout=layout, scenario=scenario, estimator=estimator, trials=trials),
        exact=exact,
    )


def tag_estimators(spec: Spec, layout: Layout) -> tuple[list[Estimator], list[tuple[str, str]]]:
    """Return the spec's estimators that read tags and apply to a layout, and the others' names and reasons."""
    kept, refused = [], []
    for estimator in spec.problem().estimators:
        reason = estimator.applies(layout)
        if estimator.card.needs != "tag_read":
            reason = "reads no tags, so that nothing about them matters to it"
        if reason:
            refused.append((estimator.name, reason))
        else:
            kept.append(estimator)
    return kept, refused


def cost_of(spec: Spec) -> Cost:
    """Return the objective of cost of a spec, for its robots and prices."""
    return Cost(prices=spec.prices, robot_count=spec.robot_count, reader_part=spec.reader_part)


def costs_eur(spec: Spec, layout: Layout) -> dict[str, float]:
    """Return the cost of a layout for a spec's robots, and of one robot's bare readers, EUR, by their columns."""
    cost = cost_of(spec)
    readers = replace(cost, robot_count=1).bill(layout, spec.design).total_of(Scope.ROBOT)
    return {"cost_eur": cost.bill(layout, spec.design).total_eur, "readers_of_a_robot_eur": readers}


def world_text(spec: Spec) -> str:
    """Return the world of the drives in words."""
    scenario = spec.design
    return (
        f"{spec.site.name or 'the site'}, {scenario.name.partition('/')[2]} routes at "
        f"{scenario.robot.speed_m_s:g} m/s for {scenario.duration_s:g} s, the faults of the spec's search"
    )


def change(sweep: Sweep, found: Found, place: Place, column: str = GOAL) -> Score | None:
    """Return by how much a score is above that of the base, paired by drive; ``None`` while one is missing."""
    base = sweep.base.get(place.series)
    if base is None or base == place or place not in found or base not in found:
        return None
    return paired_difference(found[place], found[base], column)


def sweep_of(
    spec: Spec,
    layout: str,
    *,
    axis: Axis,
    points: Sequence[Point],
    base: Mapping[str, Place],
    estimators: str,
    refused: Sequence[tuple[str, str]] = (),
) -> Sweep:
    """Return a sweep in the world of a spec, with its demand and seed; ``layout`` says what is varied."""
    return Sweep(
        axis=axis,
        points=tuple(points),
        base=base,
        target_m=spec.target_error_m,
        layout=layout,
        world=world_text(spec),
        estimators=estimators,
        seed=spec.seed,
        prices=f"{spec.prices.name}, {spec.prices.date}",
        refused=tuple(refused),
    )


def largest_within(sweep: Sweep, found: Found, series: str) -> float | None:
    """Return the largest value above the base up to which the error grows by no more than `ALLOWANCE`.

    Values are asked in their order, each at a one-sided 95 %, and the first that fails ends it: so the chance that
    any value told does not hold is 5 % (fixed-sequence testing). ``None`` if not even the first holds.
    """
    base = sweep.base[series]
    if base not in found:
        return None
    allowed_m = ALLOWANCE * found[base].score(GOAL).value
    last = None
    for point in sweep.of(series):
        if point.place.value <= base.value:
            continue
        difference = change(sweep, found, point.place)
        if difference is None or not difference.upper(0.95) <= allowed_m:
            return last
        last = point.place.value
    return last


def largest_meeting(sweep: Sweep, found: Found, series: str) -> float | None:
    """Return the largest value up to which the demand on the mean error is met, asked as `largest_within` does.

    ``None`` without a demand, or if it is not met at the first value.
    """
    if sweep.target_m is None:
        return None
    last = None
    for point in sweep.of(series):
        table = found.get(point.place)
        if table is None or not table.score(GOAL).upper(0.95) <= sweep.target_m:
            return last
        last = point.place.value
    return last


def cheapest_meeting(sweep: Sweep, found: Found) -> Point | None:
    """Return the cheapest point that is shown to meet the demand on the mean error; ``None`` without one.

    Points are asked from the cheapest on, of one cost the least error first, each at a one-sided 95 %.
    """
    if sweep.target_m is None:
        return None
    scored = [(point, found[point.place].score(GOAL)) for point in sweep.points if point.place in found]
    for point, error in sorted(scored, key=lambda item: (item[0].exact["cost_eur"], item[1].value)):
        if error.upper(0.95) <= sweep.target_m:
            return point
    return None
