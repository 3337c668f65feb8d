"""The race of places for a transponder: rounds on common drives, as a pure function of what is known.

All places meet the same drives. Each round doubles the drives of those that go on: at most a third of the places,
and none whose share of docked drives is told from that of the best by their Wilson intervals.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from layoutopt.evaluate import outcomes_of
from layoutopt.protocols import Evaluation, Failure, Group, Task
from layoutopt.scores import Scores, TrialOutcomes, wilson
from studies.cells import Cell, missing
from studies.held_out import failures_of
from studies.transponder_placement_setting import Asked, Place, limited

SUCCESS: Final = "docking_success"
STEPS: Final = "docking_steps"
ERROR: Final = "direction_error_mean"
GOES_ON: Final = 1.0 / 3.0
"""Share of the places that go on at most: first rounds over many places are what a race costs."""
_FEWEST: Final = 2
"""So many places always go on, so that the best has a rival."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Standing:
    """How the race stands.

    Attributes
    ----------
    level
        Drives to each place in the last round that is finished; zero before there is one.
    ranked
        The places of that round, the best first; those in which a drive failed are left out.
    tasks
        What is still to be run of the next round; none at the end.
    """

    level: int
    ranked: tuple[Place, ...]
    tasks: tuple[Task, ...]


def race_cell(asked: Asked, place: Place, trials: int) -> Cell:
    """Return the drives of the race to a place."""
    return Cell(layout=place.layout, scenario=asked.scenario, estimator=asked.estimator, trials=trials)


def standing(asked: Asked, places: Sequence[Place], evaluations: Sequence[Evaluation | Failure]) -> Standing:
    """Return how the race of all places that are not refused stands."""
    known, failed = outcomes_of(evaluations), failures_of(evaluations)
    running = [place for place in places if not place.refusal]
    found = Standing(level=0, ranked=(), tasks=())
    for level in asked.effort.levels:
        cells = [race_cell(asked, place, level) for place in running]
        tasks = missing(cells, known, failed)
        if tasks:
            return Standing(level=found.level, ranked=found.ranked, tasks=tasks)
        ranked = _ranked(asked, running, known, level)
        found = Standing(level=level, ranked=ranked, tasks=())
        running = list(_kept(asked, ranked, known, level))
    return found


def fresh_cells(asked: Asked, places: Sequence[Place], found: Standing) -> dict[tuple[str, str], Cell]:
    """Return the drives that no choice was made on, by key of the layout and name of the estimator.

    They go to the places that came last in the race and to the given one, and to the best with every guide.
    """
    finalists = finalists_of(asked, places, found)
    wanted = [(place, asked.estimator) for place in finalists]
    wanted += [(found.ranked[0], guide) for guide in asked.guides] if found.ranked else []
    return {
        (place.key, estimator.name): Cell(
            layout=place.layout, scenario=asked.fresh, estimator=estimator, trials=asked.effort.fresh
        )
        for place, estimator in wanted
    }


def finalists_of(asked: Asked, places: Sequence[Place], found: Standing) -> tuple[Place, ...]:
    """Return the best places of the race, and the given one if it is not among them, whether refused or not."""
    best = found.ranked[: asked.effort.finalists]
    return (*best, *(place for place in places if place.given and place not in best))


def race_outcomes(
    asked: Asked, place: Place, trials: int, known: Mapping[Group, TrialOutcomes]
) -> TrialOutcomes | None:
    """Return the outcomes of the first drives of the race to a place; ``None`` where there are not so many."""
    return race_cell(asked, place, trials).outcomes(known)


def hits_of(outcomes: TrialOutcomes) -> int:
    """Return how many drives docked."""
    return int(outcomes.column(SUCCESS).sum())


def chance_better(first: TrialOutcomes, second: TrialOutcomes) -> float:
    """Return the probability that one place docks more drives than another, after drives that both met.

    Only drives that dock at one place alone tell: of these, how many favour the first has a binomial share, with
    Jeffreys' prior. One half where no drive told them apart.

    Examples
    --------
    >>> import numpy as np
    >>> first, second = (
    ...     TrialOutcomes(replications=np.arange(5), columns=("docking_success",), values=np.c_[values])
    ...     for values in ([1.0, 1.0, 1.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0, 0.0])
    ... )
    >>> round(chance_better(first, second), 3), round(chance_better(first, first), 3)
    (0.967, 0.5)
    """
    # Imported here: it costs more than all the rest of a short command.
    from scipy.special import betainc

    difference = first.column(SUCCESS) - second.column(SUCCESS)
    ahead, behind = int((difference > 0.0).sum()), int((difference < 0.0).sum())
    return float(betainc(behind + 0.5, ahead + 0.5, 0.5))


def _ranked(
    asked: Asked, places: Sequence[Place], known: Mapping[Group, TrialOutcomes], level: int
) -> tuple[Place, ...]:
    """Return the places, best first: nearest to the limits, most drives docked, fewest steps, least error."""
    rows = []
    for place in places:
        outcomes = race_outcomes(asked, place, level, known)
        if outcomes is not None:
            scores: Scores = {name: outcomes.score(name) for name in outcomes.columns}
            off = max([0.0, *(limit.excess(score.value) for limit, score in limited(asked.limits, scores))])
            error = place.scores[ERROR].value if ERROR in place.scores else math.inf
            rows.append(((off, -hits_of(outcomes), scores[STEPS].value, error, *place.xy_m), place))
    return tuple(place for _, place in sorted(rows, key=lambda row: row[0]))


def _kept(
    asked: Asked, ranked: Sequence[Place], known: Mapping[Group, TrialOutcomes], level: int
) -> tuple[Place, ...]:
    """Return the places that go on."""
    hits = [hits_of(outcomes) for place in ranked if (outcomes := race_outcomes(asked, place, level, known))]
    least = max((wilson(count, level)[0] for count in hits), default=0.0)
    room = max(asked.effort.finalists, math.ceil(GOES_ON * len(ranked)))
    return tuple(
        place
        for number, (place, count) in enumerate(zip(ranked, hits, strict=True))
        if number < _FEWEST or (number < room and wilson(count, level)[1] >= least)
    )
