"""Where a transponder goes so that robots dock at it by its direction: a race of places on common drives."""

import math
import shutil
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar, Final

from layoutopt.drawings.installation import write_transponder_sheets
from layoutopt.evaluate import outcomes_of
from layoutopt.identity import content_key
from layoutopt.protocols import Evaluation, Failure, Plan, Round, StudyCard
from layoutopt.score_text import counted_text, percent_text
from layoutopt.spec.building import Spec
from layoutopt.streams import Streams
from layoutopt.workers import Workers
from studies.cells import missing, plan_of
from studies.held_out import failures_of
from studies.page_answer import LayoutsAnswer, PageAnswer
from studies.transponder_placement_page import page_of
from studies.transponder_placement_race import (
    GOES_ON,
    Standing,
    fresh_cells,
    hits_of,
    race_cell,
    race_outcomes,
    standing,
)
from studies.transponder_placement_results import Results, results_of
from studies.transponder_placement_setting import Asked, Place, asked_of, places_of
from studies.transponder_placement_words import place_text, summary

CARD: Final = StudyCard(
    summary="A race of places for a transponder by simulated docking, with exact direction errors beside it.",
    reference="kim2009; Wilson, J. Am. Stat. Assoc. 22, 1927, for who goes on",
    question="Where does the transponder go so that robots find it?",
    adaptive=True,
    rests_on="Docking is simulated with the radio field of kim2009 in your room; shares have 95 % "
    "intervals, and the last places are tried on fresh drives. The field of a real room is not known "
    "before it is measured.",
    next_step="Mount the transponder as the drawing shows, and measure a few directions in the room "
    "before you rely on it.",
    guide="docking",
)
_PILOT_PLACES: Final = 6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TransponderPlacement:
    """The race, then fresh drives to its last places and the best one with every guide.

    The places are scored when they are first asked for; they are a function of the question.
    """

    asked: Asked
    known: dict[str, tuple[Place, ...]] = field(default_factory=dict, repr=False)
    card: ClassVar[StudyCard] = CARD

    @classmethod
    def for_spec(cls, spec: Spec, *, quick: bool, workers: Workers | None = None) -> "TransponderPlacement":
        """Return the study of a spec; a quick one tries fewer places on fewer drives.

        Raises
        ------
        InvalidInput
            If the spec says nothing of docking, its estimator guides no docking robot, there are too many places,
            or no robot can dock at the given one.
        """
        return cls(asked=asked_of(spec, quick=quick))

    @property
    def places(self) -> tuple[Place, ...]:
        """Every place with its exact scores."""
        if self.asked.key not in self.known:
            self.known[self.asked.key] = places_of(self.asked)
        return self.known[self.asked.key]

    @property
    def key(self) -> str:
        """Content key of the question."""
        return content_key("transponder_placement", self.asked.key)

    def plan(self) -> Plan:
        """Return the numbers of places and drives, at most, and a pilot over a few places."""
        running = [place for place in self.places if not place.refusal]
        effort, at_most, count = self.asked.effort, 0, len(running)
        before = 0
        for level in effort.levels:
            at_most += count * (level - before)
            before, count = level, max(effort.finalists, math.ceil(GOES_ON * count))
        fresh = (effort.finalists + len(self.asked.guides)) * effort.fresh
        lines = (
            f"{counted_text(len(self.places), 'place')}, of which {len(running)} keep clear of walls and "
            "scatterers and can be reached",
            f"race: up to {at_most} drives; fresh drives: up to {fresh}",
        )
        chosen = running[:: max(1, len(running) // _PILOT_PLACES)]
        pilot = plan_of(race_cell(self.asked, place, effort.levels[0]) for place in chosen).pilot
        share = (at_most + fresh) / max(1, sum(trials for _, trials in pilot))
        return Plan(lines=lines, pilot=tuple((task, max(1, round(trials * share))) for task, trials in pilot))

    def next_batch(self, evaluations: Sequence[Evaluation | Failure]) -> Round:
        """Return the next round of the race, then the fresh drives."""
        found = self.standing(evaluations)
        if found.tasks:
            places = len({task.layout.key for task in found.tasks})
            drives = max(task.first + task.count for task in found.tasks)
            return Round(name=f"{counted_text(places, 'place')}, {drives} drives each", tasks=found.tasks)
        cells = fresh_cells(self.asked, self.places, found).values()
        return Round(name="fresh drives", tasks=missing(cells, outcomes_of(evaluations), failures_of(evaluations)))

    def standing(self, evaluations: Sequence[Evaluation | Failure]) -> Standing:
        """Return how the race stands."""
        return standing(self.asked, self.places, evaluations)

    def best_so_far(self, evaluations: Sequence[Evaluation | Failure]) -> str:
        """Return the best place so far, and how many drives docked there; empty before there is one."""
        found = self.standing(evaluations)
        if not found.ranked:
            return ""
        best = found.ranked[0]
        outcomes = race_outcomes(self.asked, best, found.level, outcomes_of(evaluations))
        assert outcomes is not None
        return f"{place_text(best)}: {percent_text(hits_of(outcomes) / found.level)} of {found.level} drives dock"

    def results(self, evaluations: Sequence[Evaluation | Failure]) -> Results:
        """Return what the race and the fresh drives gave; every number comes from them or is exact."""
        return results_of(self.asked, self.places, evaluations)

    def answer(self, evaluations: Sequence[Evaluation | Failure], spec: Spec) -> "TransponderAnswer":
        """Return the best place with what the drives say of it."""
        results = self.results(evaluations)
        page = PageAnswer(
            study="transponder_placement",
            summary=tuple(summary(results)),
            page=lambda _: page_of(results, spec),
            failures=results.failures,
        )
        best = () if results.best is None else (results.best.layout,)
        return TransponderAnswer(page=page, layouts=best, status=results.status, spec=spec)


@dataclass(frozen=True, slots=True, kw_only=True)
class TransponderAnswer(LayoutsAnswer):
    """The page, the layout, and the drawing of where the transponder goes."""

    def write(self, folder: Path, *, streams: Streams, quick: bool) -> None:
        """Write tables, figures, report, the layout and its drawing; those of an earlier best place go first."""
        shutil.rmtree(folder / "drawings", ignore_errors=True)
        LayoutsAnswer.write(self, folder, streams=streams, quick=quick)
        title = f"{self.spec.site.name}: transponder"
        for layout in self.layouts:
            write_transponder_sheets(self.spec, layout, folder / "drawings", title=title, quick_look=quick)
