"""Scores of what finds things off the floor: tracking by UHF and laser, docking by direction."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from layoutopt import registry
from layoutopt.layout import Layout
from layoutopt.problem import Problem
from layoutopt.protocols import AnyEstimator
from layoutopt.scenario import Scenario
from layoutopt.score_text import percent_text
from layoutopt.scores import SIGNAL_UNITS, Score, TrialOutcomes
from layoutopt.spec.building import Spec

_OFTEN: Final = 0.5
"""Share of instants from which on the laser counts as used: below it, most instants go without."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FinderTrials:
    """Trials in which a layout finds something: their scenario, estimator and number at most."""

    scenario: Scenario
    estimator: AnyEstimator
    trials: int


def finder_trials(spec: Spec, layout: Layout) -> tuple[tuple[FinderTrials, ...], dict[str, str]]:
    """Return the trials of tracking and docking for which a layout is equipped, and why others are left out.

    A layout without antennas of a kind has nothing to be judged by, which is no fault; one with crossed antennas
    and no transponder is told so.
    """
    found: list[FinderTrials] = []
    left_out: dict[str, str] = {}
    if layout.readers_of("signal") and spec.tracking is not None:
        tracker = registry.load("estimators", spec.tracking.estimator)()
        reason = tracker.applies(layout) or spec.tracking.lack
        if reason:
            left_out[tracker.name] = reason
        else:
            found.append(
                FinderTrials(scenario=spec.tracking_scenario, estimator=tracker, trials=spec.tracking.trials)
            )
    if layout.readers_of("direction") and spec.docking is not None:
        bearing = registry.load("estimators", spec.docking.estimator)()
        reason = bearing.applies(layout)
        if reason:
            left_out[bearing.name] = reason
        else:
            found.append(
                FinderTrials(scenario=spec.docking_scenario, estimator=bearing, trials=spec.docking.trials)
            )
    return tuple(found), left_out


def elsewhere_lines(limits: Sequence[str]) -> list[str]:
    """Return in a sentence at which limits, in words, a study does not look; nothing if there are none."""
    return [f"Other studies look at these limits: {'; '.join(limits)}."] if limits else []


def laser_lines(outcomes: TrialOutcomes) -> list[str]:
    """Return that a tracker seldom uses its laser, if so; nothing if a cluster matches at half of all instants.

    Without a match the fused estimate is to the last bit the one by strength alone, and no error tells.
    """
    share = outcomes.score("laser_match_share").value
    if share >= _OFTEN:
        return []
    return [
        f"Only at {percent_text(share)} of the instants does a cluster of the laser scan match the phases: at the "
        "others signals alone tell the place, as without a laser."
    ]


def exact_finder_scores(problem: Problem, layout: Layout, trials: tuple[FinderTrials, ...]) -> Mapping[str, Score]:
    """Return the exact scores of UHF antennas and transponders, in the scenarios of the trials."""
    scores: dict[str, Score] = {}
    for objective in problem.objectives:
        if objective.card.fidelity == "exact" and set(objective.card.scores) <= set(SIGNAL_UNITS):
            for entry in trials:
                scores.update(objective(layout, entry.scenario, None))
    return scores
