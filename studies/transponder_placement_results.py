"""What the race of places and the fresh drives gave: the best place, who is as good, guides, and cheap scores."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.evaluate import outcomes_of
from layoutopt.problem import Limit
from layoutopt.protocols import Evaluation, Failure, Group
from layoutopt.result import Status
from layoutopt.scores import Score, TrialOutcomes, paired_difference
from studies.held_out import failures_of
from studies.screening import Correlation, rank_correlation
from studies.transponder_placement_race import (
    SUCCESS,
    Standing,
    chance_better,
    finalists_of,
    fresh_cells,
    hits_of,
    race_outcomes,
    standing,
)
from studies.transponder_placement_setting import GUIDES, Asked, Place, limited

_SHOWN: Final = 0.975
"""The best place is shown to be the better of two beyond this probability, as by an interval of 95 %."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Finalist:
    """A place with its fresh drives.

    Attributes
    ----------
    drives
        The fresh drives.
    lead
        Share of drives that dock at the best place less that here, on the same drives; ``None`` for the best.
    better
        Probability that the best place is the better one of the two.
    as_good
        Whether that leaves open which of the two is better.
    """

    place: Place
    drives: TrialOutcomes
    lead: Score | None
    better: float
    as_good: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Guided:
    """The fresh drives to the best place with one guide, and what it gains on the first of them."""

    name: str
    drives: TrialOutcomes
    gain: Score | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Results:
    """All that the page is made of.

    Attributes
    ----------
    raced
        The drives of the race to each place by the key of its layout, as many as it has.
    finalists
        The best place first; the given one among them.
    best
        The winner of the race, if its fresh drives did not fail; ``None`` where there is none.
    misses
        Limits on docking that the best place was not shown to keep, with its scores.
    failures
        Messages of tasks that failed, by group.
    """

    asked: Asked
    places: tuple[Place, ...]
    race: Standing
    raced: Mapping[str, TrialOutcomes]
    finalists: tuple[Finalist, ...]
    best: Place | None
    guides: tuple[Guided, ...]
    misses: tuple[tuple[Limit, Score], ...]
    failures: Mapping[Group, str]

    @property
    def running(self) -> tuple[Place, ...]:
        """The places that robots were sent to in the race."""
        return tuple(place for place in self.places if not place.refusal)

    @property
    def status(self) -> Status:
        """How the search ended."""
        if self.best is None:
            return Status.INFEASIBLE
        if not self.asked.limits:
            return Status.SEARCHED
        return Status.TARGET_NOT_MET if self.misses else Status.TARGET_MET

    @property
    def rivals(self) -> tuple[Finalist, ...]:
        """The last places of the race but for the best."""
        return tuple(item for item in self.finalists[1:] if item.place in self.race.ranked)

    @property
    def correct(self) -> float:
        """A lower bound of the probability that none of the rivals docks more drives than the best."""
        return max(0.0, 1.0 - sum(1.0 - item.better for item in self.rivals))

    def correlation(self, score: str) -> tuple[Correlation, int]:
        """Return how a cheap score ranks the places of the first round as their drives do, and of how many."""
        level = self.asked.effort.levels[0]
        pairs = [
            (place.scores[score].value, hits_of(self.raced[place.key].head(level)))
            for place in self.running
            if score in place.scores and place.key in self.raced and len(self.raced[place.key]) >= level
        ]
        # Values that only differ by rounding are one rank.
        values = np.round(np.array(pairs, dtype=np.float64).reshape(-1, 2), 9)
        return rank_correlation(*values.T), len(pairs)


def results_of(asked: Asked, places: tuple[Place, ...], evaluations: Sequence[Evaluation | Failure]) -> Results:
    """Return what the evaluations of a finished study gave."""
    known = outcomes_of(evaluations)
    race = standing(asked, places, evaluations)
    fresh = {
        place: outcomes
        for place, cell in fresh_cells(asked, places, race).items()
        if (outcomes := cell.outcomes(known)) is not None
    }
    finalists = _finalists(asked, finalists_of(asked, places, race), fresh)
    best = finalists[0] if finalists and race.ranked and finalists[0].place == race.ranked[0] else None
    scores = {} if best is None else {name: best.drives.score(name) for name in best.drives.columns}
    return Results(
        asked=asked,
        places=places,
        race=race,
        raced=_raced(asked, places, known),
        finalists=finalists,
        best=None if best is None else best.place,
        guides=() if best is None else _guided(asked, best.place, fresh),
        misses=tuple((limit, score) for limit, score in limited(asked.limits, scores) if not limit.met(score)),
        failures=failures_of(evaluations),
    )


def _raced(
    asked: Asked, places: Sequence[Place], known: Mapping[Group, TrialOutcomes]
) -> dict[str, TrialOutcomes]:
    """Return the drives of the race, cut to the last round that each place ended."""
    found = {}
    for place in places:
        for level in asked.effort.levels:
            outcomes = race_outcomes(asked, place, level, known)
            if outcomes is not None:
                found[place.key] = outcomes
    return found


def _finalists(
    asked: Asked, places: Sequence[Place], fresh: Mapping[tuple[str, str], TrialOutcomes]
) -> tuple[Finalist, ...]:
    """Return the places that have their fresh drives, compared with the first."""
    driven = [(place, fresh[key]) for place in places if (key := (place.key, asked.estimator.name)) in fresh]
    found: list[Finalist] = []
    for place, drives in driven:
        best = driven[0][1]
        better = chance_better(best, drives) if found else 1.0
        found.append(
            Finalist(
                place=place,
                drives=drives,
                lead=paired_difference(best, drives, SUCCESS) if found else None,
                better=better,
                as_good=not found or better < _SHOWN,
            )
        )
    return tuple(found)


def _guided(asked: Asked, best: Place, fresh: Mapping[tuple[str, str], TrialOutcomes]) -> tuple[Guided, ...]:
    """Return every guide at the best place, with what it gains on directions as measured."""
    driven = {guide.name: fresh[key] for guide in asked.guides if (key := (best.key, guide.name)) in fresh}
    measured = driven.get(GUIDES[0])
    return tuple(
        Guided(
            name=name,
            drives=drives,
            gain=None if measured is None or name == GUIDES[0] else paired_difference(drives, measured, SUCCESS),
        )
        for name, drives in driven.items()
    )
