"""The real robot of mi2016: faults fitted on two rows of Tables 5 and 6, the other six rows predicted."""

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from layoutopt.evaluate import outcomes_of
from layoutopt.identity import content_key
from layoutopt.protocols import Evaluation, Failure, Group, Round
from layoutopt.scores import TrialOutcomes
from studies import cells as grid
from studies.cells import Cell
from studies.held_out import failures_of
from studies.published.mi2016_cells import Effort
from studies.published.mi2016_printed import REAL, TABLE_6, Row
from studies.published.mi2016_tour import PLACES, Carpet, Common, cell

CARPETS: Final = (100, 16)
FITTED: Final = tuple(row for row in TABLE_6 if row.likelihood == "combination")
"""The rows of the fit: the paper's own proposal on both carpets; the whole other array is left to predict."""
SPREADS_M: Final = (0.005, 0.010, 0.020)
"""Placement errors with which the predictions are made again, to show how much hangs on them."""
_SIGMAS_M: Final = (0.0, 0.005, 0.010, 0.015, 0.020, 0.025)
_MISSED: Final = (0.0, 0.3, 0.6)
_OFFSETS_M: Final = tuple(itertools.product((0.0, 0.008), (0.0, 0.010, 0.020)))
_STEP_M: Final = (0.004, 0.005)
_KEPT: Final = (5, 3)
"""Pairs of placement error and missed share that stay after the first and the second round."""
_OFFSETS_KEPT: Final = (2, 2)
"""Places and offsets of a carpet that stay for each pair after the first and the second round."""
_WORST: Final = math.log(100.0)
"""What a number that is not known, or zero, counts for in the loss."""
_FITTED_COLUMNS: Final = (
    "x_error_mean",
    "y_error_mean",
    "heading_error_mean",
    "x_error_variance",
    "y_error_variance",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """The best faults found, how far they miss the fitted rows, and how many candidates were tried.

    ``loss`` is the root mean square of the logarithms of ours over printed.
    """

    common: Common
    carpets: Mapping[int, Carpet]
    loss: float
    candidates: int


def key(effort: Effort) -> str:
    """Return a content key of the question: the first round, how it is cut down, and the rows."""
    first = next(iter(_rounds({}, effort)))
    cells = sorted((*cell.group, cell.trials) for cell in _fit_cells(first, effort.fit[0]))
    return content_key(cells, effort.fit, effort.real, effort.spread, SPREADS_M, _STEP_M, _KEPT, _OFFSETS_KEPT)


def next_round(evaluations: Sequence[Evaluation | Failure], effort: Effort) -> Round:
    """Return the next round of the fit, or the predictions once it is done; no tasks once these are there.

    Three rounds, each with fewer candidates and more trials: a grid; the best of it with finer offsets; the best
    of these. Candidates of one carpet are judged apart from those of the other, because a carpet's own place and
    offset bear on its own row only.
    """
    known, failed = outcomes_of(evaluations), failures_of(evaluations)
    for number, candidates in enumerate(_rounds(known, effort)):
        tasks = grid.missing(_fit_cells(candidates, effort.fit[number]), known, failed)
        if tasks:
            names = ("grid", "finer offsets", "best candidates")
            return Round(name=f"real robot, fit: {names[number]}", tasks=tasks)
    found = best_fit(evaluations, effort)
    if found is None:
        return Round(name="real robot, no fit", tasks=())
    wanted = [*predicted_cells(found, effort).values(), *spread_cells(found, effort).values()]
    return Round(name="real robot, predictions", tasks=grid.missing(wanted, known, failed))


def best_fit(evaluations: Sequence[Evaluation | Failure], effort: Effort) -> Fit | None:
    """Return the best candidate of the last round; ``None`` while a round is not done."""
    known = outcomes_of(evaluations)
    rounds = list(_rounds(known, effort))
    if len(rounds) < len(effort.fit):
        return None
    ranked = _ranked(rounds[-1], known, effort.fit[-1])
    if not ranked:
        return None
    loss, common, carpets = ranked[0]
    tried = {(tags, *pair) for candidates in rounds for tags, pairs in candidates.items() for pair in pairs}
    return Fit(
        common=common,
        carpets={tags: ordered[0] for tags, ordered in carpets.items()},
        loss=math.sqrt(loss / (len(_FITTED_COLUMNS) * len(CARPETS))),
        candidates=len(tried),
    )


def predicted_cells(fit: Fit, effort: Effort) -> dict[tuple[str, Row], Cell]:
    """Return the trials of all eight rows under the fitted faults, on drives that the fit has not seen."""
    return {
        (table, row): cell(row, fit.common, fit.carpets[row.tags_per_m2], name="mi2016/real", trials=effort.real)
        for table, rows in REAL.items()
        for row in rows
    }


def spread_cells(fit: Fit, effort: Effort) -> dict[tuple[float, str, Row], Cell]:
    """Return the trials of all eight rows with other placement errors, the rest as fitted: by sigma and row."""
    return {
        (sigma_m, table, row): cell(
            row,
            replace(fit.common, sigma_m=sigma_m),
            fit.carpets[row.tags_per_m2],
            name="mi2016/real",
            trials=effort.spread,
        )
        for sigma_m in SPREADS_M
        for table, rows in REAL.items()
        for row in rows
    }


def plan_cells(effort: Effort) -> Iterable[Cell]:
    """Return about as many cells as the fit will ask for, for a prediction of the run time."""
    first = next(iter(_rounds({}, effort)))
    return [
        *_fit_cells(first, 2 * effort.fit[0]),
        *(
            cell(
                row,
                Common(sigma_m=0.01, missed=0.0),
                Carpet(place=PLACES[0], offset_m=(0.0, 0.0)),
                name=name,
                trials=24,
            )
            for rows in REAL.values()
            for row in rows
            for name in ("mi2016/fit", "mi2016/real", "mi2016/spread")
        ),
    ]


Candidates = Mapping[int, tuple[tuple[Common, Carpet], ...]]
"""For each carpet, by its tags a square metre, the candidates of a round."""


def _rounds(known: Mapping[Group, TrialOutcomes], effort: Effort) -> Iterable[Candidates]:
    """Yield the candidates of each round that can be made up from what is known."""
    grid_of_common = itertools.product(_SIGMAS_M[:: effort.fit_thinning], _MISSED[:: effort.fit_thinning])
    commons = [Common(sigma_m=sigma_m, missed=missed) for sigma_m, missed in grid_of_common]
    carpets = [Carpet(place=place, offset_m=offset_m) for place in PLACES for offset_m in _OFFSETS_M]
    candidates: Candidates = dict.fromkeys(CARPETS, tuple(itertools.product(commons, carpets)))
    yield candidates
    for number, refine in enumerate((_neighbours, _itself)):
        ranked = _ranked(candidates, known, effort.fit[number])
        if not ranked:
            return
        kept = ranked[: _KEPT[number]]
        candidates = {
            tags: tuple(
                dict.fromkeys(
                    (common, finer)
                    for _, common, best in kept
                    for carpet in best[tags][: _OFFSETS_KEPT[number]]
                    for finer in refine(carpet)
                )
            )
            for tags in CARPETS
        }
        yield candidates


def _neighbours(carpet: Carpet) -> list[Carpet]:
    """Return a carpet and those whose offset is a little less or more; the sign of an offset shows nowhere."""
    x_m, y_m = carpet.offset_m
    return [
        Carpet(
            place=carpet.place, offset_m=(round(abs(x_m + i * _STEP_M[0]), 6), round(abs(y_m + j * _STEP_M[1]), 6))
        )
        for i in (-1, 0, 1)
        for j in (-1, 0, 1)
    ]


def _itself(carpet: Carpet) -> list[Carpet]:
    return [carpet]


def _ranked(
    candidates: Candidates, known: Mapping[Group, TrialOutcomes], trials: int
) -> list[tuple[float, Common, dict[int, list[Carpet]]]]:
    """Return pairs of faults by rising loss, each with its carpets by rising loss; empty if trials are missing."""
    losses: dict[int, dict[tuple[Common, Carpet], float]] = {}
    for row in FITTED:
        losses[row.tags_per_m2] = {}
        for common, carpet in candidates[row.tags_per_m2]:
            table = cell(row, common, carpet, name="mi2016/fit", trials=trials).outcomes(known)
            if table is None:
                return []
            losses[row.tags_per_m2][common, carpet] = loss(row, table)
    ranked = []
    for common in dict.fromkeys(common for common, _ in candidates[CARPETS[0]]):
        best: dict[int, list[Carpet]] = {}
        total = 0.0
        for tags in CARPETS:
            own = sorted((value, carpet) for (other, carpet), value in losses[tags].items() if other == common)
            best[tags] = [carpet for _, carpet in own]
            total += own[0][0] if own else math.inf
        ranked.append((total, common, best))
    return sorted(ranked, key=lambda entry: entry[:2])


def loss(row: Row, outcomes: TrialOutcomes) -> float:
    """Return the sum of squared logarithms of ours over printed: means, and standard deviations in x and y."""
    printed = dict(
        zip(
            _FITTED_COLUMNS,
            (
                row.mean[0] / 1e3,
                row.mean[1] / 1e3,
                row.mean[2] / 1e3,
                row.variance[0] / 1e6,
                row.variance[1] / 1e6,
            ),
            strict=True,
        )
    )
    total = 0.0
    for column, value in printed.items():
        ours = float(outcomes.column(column).mean())
        off = abs(math.log(ours / value)) if ours > 0.0 else _WORST
        total += min(_WORST, off * (0.5 if column.endswith("variance") else 1.0)) ** 2
    return total


def _fit_cells(candidates: Candidates, trials: int) -> list[Cell]:
    return [
        cell(row, common, carpet, name="mi2016/fit", trials=trials)
        for row in FITTED
        for common, carpet in candidates[row.tags_per_m2]
    ]
