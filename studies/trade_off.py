"""What more accuracy costs along a front, and how sure the front is: exchange rates, membership, hypervolume.

All of it is made of the trials of the search; nothing is simulated for it.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.problem import Problem
from layoutopt.protocols import Group, group_of
from layoutopt.result import Evaluated, Front
from layoutopt.score_text import NOT_KNOWN, euros, quantity_text, score_name, score_text, shown_unit
from layoutopt.scores import Score, TrialOutcomes, paired_difference
from solvers.front_measures import ExchangeRate, exchange_rate, exchange_rates, hypervolumes, reference_point
from solvers.front_membership import RESAMPLES, goal_values, mean_draws, on_front

LIKELY: Final = 0.5
"""From this probability on a layout is rather on the front than not."""
_FLOOR_SHARE: Final = 0.01
"""A drawn error is taken for no less than this share of the measured one: its logarithm has to exist."""
_LEAST_GROUPED: Final = 1000.0


Gain = Callable[[Evaluated, Evaluated], Score]


@dataclass(frozen=True, slots=True, kw_only=True)
class TradeOff:
    """What can be said of a front as a whole.

    Attributes
    ----------
    goal
        The simulated goal.
    rates
        Exchange rates between neighbours on the front, by rising cost.
    next_steps
        By role of a recommended layout: the exchange rate to the cheapest dearer member of the front that is shown
        to be more accurate. Missing where there is none.
    membership
        By key of each layout with trials: the probability that it is on the true front of all of them.
    reference
        Cost and error of the reference point; ``None`` without a front or where its logarithms do not exist.
    hypervolume
        In natural logarithms of both goals, within the reference; ``None`` without one.
    misjudged
        How many layouts the race expects on the wrong side of its front, at most; ``None`` if it did not end.
    """

    goal: str
    rates: tuple[ExchangeRate, ...]
    next_steps: Mapping[str, ExchangeRate]
    membership: Mapping[str, float]
    reference: tuple[float, float] | None
    hypervolume: Score | None
    misjudged: float | None = None


def trade_off_of(
    problem: Problem,
    raced: Sequence[Evaluated],
    front: Front,
    recommended: Mapping[str, Evaluated],
    known: Mapping[Group, TrialOutcomes],
    seed: int,
    misjudged: float | None = None,
) -> TradeOff:
    """Return exchange rates, membership and hypervolume of a front.

    Parameters
    ----------
    raced
        All layouts that may be on the front; those without trials in the design scenario do not count.
    recommended
        Layouts by role.
    known
        Outcomes of every group.
    misjudged
        As the race gave it.
    """
    cost, goal = problem.goals[:2]

    def table(item: Evaluated) -> TrialOutcomes | None:
        return known.get(group_of(item.layout, problem.design, problem.estimators[0]))

    def gain(cheaper: Evaluated, dearer: Evaluated) -> Score:
        first, second = table(cheaper), table(dearer)
        if first is None or second is None:
            return Score(value=math.nan, unit=cheaper.scores[goal].unit, standard_error=math.inf, count=1)
        return paired_difference(first, second, goal)

    judged = [item for item in raced if table(item) is not None]
    costs = np.array([item.scores[cost].value for item in judged])
    values = goal_values([table(item) for item in judged], goal)
    # With a single drive of each layout nothing is known of any error.
    enough = bool(((~np.isnan(values)).sum(axis=1) > 1).any())
    draws = mean_draws(costs, values, seed=seed) if enough else np.full((1, len(judged)), math.nan)
    shares = on_front(costs, draws).mean(axis=0) if enough else []
    reference, volume = _hypervolume(front, judged, draws)
    steps = {role: _next_step(item, front, gain) for role, item in recommended.items()}
    return TradeOff(
        goal=goal,
        rates=exchange_rates(front, gain),
        next_steps={role: step for role, step in steps.items() if step is not None},
        membership={item.layout.key: float(share) for item, share in zip(judged, shares, strict=False)},
        reference=reference,
        hypervolume=volume,
        misjudged=misjudged,
    )


def trade_off_lines(found: TradeOff, recommended: Mapping[str, Evaluated]) -> list[str]:
    """Return for people what the next step costs from each recommended layout, and how sure the front is."""
    lines = [next_step_text(found, role) for role in recommended if role != "most accurate"]
    return [*lines, *([text] if (text := front_text(found)) else [])]


def next_step_text(found: TradeOff, role: str) -> str:
    """Return in words what more accuracy costs from a recommended layout on."""
    step = found.next_steps.get(role)
    if step is None:
        return f"beyond the layout “{role}” no dearer one of the front is shown to be more accurate"
    item = step.dearer
    unit = shown_unit(found.goal)[1]
    one = "millimetre" if unit == "mm" else unit or "unit"
    return (
        f"beyond the layout “{role}” the next {one} costs {rate_text(step, found.goal)}: "
        f"{euros(step.extra_cost)} more for {score_text(step.gain, found.goal)} "
        f"with {item.layout.label} [{item.layout.short_key}]"
    )


def rate_text(rate: ExchangeRate, goal: str) -> str:
    """Return the euros for one unit of accuracy with their 95 % interval, or that no gain is shown.

    Of a gain that is not shown the lower end is told where there is one: so much it costs at least.
    """
    factor = shown_unit(goal)[0]
    if math.isnan(rate.gain.value):
        return NOT_KNOWN
    if rate.significant:
        low, high = (amount_text(end / factor) for end in (rate.low, rate.high))
        return f"{amount_text(rate.rate / factor)} EUR ({low} to {high})"
    if math.isinf(rate.low):
        return "shown to be no better"
    return "not significant" + (f", at least {amount_text(rate.low / factor)} EUR" if rate.low > 0.0 else "")


def front_text(found: TradeOff) -> str:
    """Return in words how large the front is and how sure; empty where neither is known."""
    told = []
    if found.membership:
        likely = sum(share >= LIKELY for share in found.membership.values())
        told.append(
            f"{likely} of {len(found.membership)} layouts with trials are on the true front with a probability of "
            f"at least {LIKELY * 100.0:.0f} % ({RESAMPLES} resamples of the drives)"
        )
    if found.misjudged is not None:
        told.append(
            f"at most {found.misjudged:.1f} layouts are expected on the wrong side of the front, differences too "
            "small to matter aside"
        )
    if found.hypervolume is not None and found.reference is not None:
        cost, error = found.reference
        value, spread = found.hypervolume.value, found.hypervolume.standard_error
        told.append(
            f"hypervolume of the front {value:.3f} ± {spread:.3f} in natural logarithms of cost and "
            f"{score_name(found.goal)}, within the reference {euros(round(cost, 2))} and "
            f"{quantity_text(error, found.hypervolume, found.goal)}"
        )
    return "; ".join(told)


def _hypervolume(
    front: Front, judged: Sequence[Evaluated], draws: FloatArray
) -> tuple[tuple[float, float] | None, Score | None]:
    """Return reference and hypervolume of a front, with the spread that the draws give the same members."""
    goals = np.array([[item.scores[goal].value for goal in front.goals] for item in front.members])
    if not len(goals) or not (goals > 0.0).all():
        return None, None
    reference = reference_point(goals)
    rows = {item.layout.key: row for row, item in enumerate(judged)}
    logs, end = np.log(goals), np.log(reference)
    value = float(hypervolumes(logs[:, 0], logs[None, :, 1], end)[0])
    places = [rows[item.layout.key] for item in front.members if item.layout.key in rows]
    error = math.inf
    if len(draws) > 1 and len(places) == len(goals):
        drawn = np.log(np.maximum(draws[:, places], _FLOOR_SHARE * goals[:, 1]))
        error = float(hypervolumes(logs[:, 0], drawn, end).std(ddof=1))
    fewest = min(item.scores[front.goals[1]].count for item in front.members)
    return (float(reference[0]), float(reference[1])), Score(
        value=value, unit="", standard_error=error, count=fewest
    )


def _next_step(item: Evaluated, front: Front, gain: Gain) -> ExchangeRate | None:
    """Return the rate to the cheapest dearer member of the front that is shown to be better, if any is."""
    cost = front.goals[0]
    for member in front.members:
        if member.scores[cost].value > item.scores[cost].value:
            rate = exchange_rate(item, member, front.goals, gain(item, member))
            if rate.significant:
                return rate
    return None


def amount_text(euros_per_unit: float) -> str:
    """Return an amount with three digits.

    >>> amount_text(243.4), amount_text(1.236), amount_text(12340).replace(chr(0x202f), "_")
    ('243', '1.24', '12_300')
    """
    if euros_per_unit < _LEAST_GROUPED:
        return f"{euros_per_unit:.3g}"
    return f"{float(f'{euros_per_unit:.3g}'):,.0f}".replace(",", "\u202f")
