"""From ``[goal]`` to limits: ``"position_error_mean <= 8 mm"``, ``"pose_coverage >= 99 %"`` and their like."""

import re
from dataclasses import dataclass
from typing import Final

from layoutopt import registry
from layoutopt.errors import did_you_mean
from layoutopt.problem import Limit
from layoutopt.scores import (
    DOCKING_UNITS,
    EXACT_UNITS,
    MORE_IS_BETTER,
    OUTCOME_COLUMNS,
    SCORE_UNITS,
    SHARES,
    SPEED_UNITS,
    TRACKING_UNITS,
)
from layoutopt.simulation.outcomes import ZONE_COLUMNS
from layoutopt.site import Site
from layoutopt.spec.findings import Findings
from layoutopt.spec.lines import KeyPath
from layoutopt.spec.quantities import Unfit, in_si
from layoutopt.spec.schema import GoalTable
from layoutopt.units import Dimension

UNIT_DIMENSIONS: Final[dict[str, Dimension]] = {
    "m": "length",
    "rad": "angle",
    "s": "time",
    "m/s": "speed",
    "EUR": "price",
    "m²": "area",
    "": "share",
}
ZONE_EXACT: Final = tuple(name for name in EXACT_UNITS if name != "cost" and name not in SPEED_UNITS)
_LIMIT = re.compile(r"\s*([^\s<>=]+)\s*(<=|>=|<|>|=+)\s*(.*?)\s*")
_EXAMPLE: Final = 'Write "heading_error_p95 <= 5 deg".'
_GOAL: Final = ("goal",)


@dataclass(frozen=True, slots=True, kw_only=True)
class Search:
    """What a score may depend on: the search's estimator, and whether its robots are kidnapped."""

    estimator: str
    kidnapped: bool


def goals_of(table: GoalTable, site: Site | None, search: Search | None, findings: Findings) -> tuple[str, ...]:
    """Return the names of the scores to minimise: cost, and one that the ``search`` can answer.

    ``site`` and ``search`` are ``None`` where their own tables have faults.
    """
    path: KeyPath = (*_GOAL, "minimise")
    names = tuple(table.minimise)
    for number, name in enumerate(names):
        unit = _score_exists(name, (*path, number), site, findings)
        if name in names[:number]:
            findings.add((*path, number), "this goal stands twice", "Remove one of them.")
        elif unit is not None and name in (*TRACKING_UNITS, *DOCKING_UNITS):
            findings.add(
                (*path, number), f"no search of floor tags minimises '{name}'",
                "The studies antenna_yaw and transponder_placement do, whatever stands here; demand it under "
                "goal.limits.",
            )  # fmt: skip
        elif unit is not None and name.rpartition(".")[2] not in ("cost", *OUTCOME_COLUMNS):
            findings.add(
                (*path, number), f"no search minimises '{name}' yet, because no drive is simulated for it",
                'Minimise "position_error_mean"; a half-gap can stand under goal.limits.',
            )  # fmt: skip
        elif unit is not None:
            _search_answers(name, (*path, number), search, findings)
    if len(names) < 2 or names[0] != "cost":
        findings.add(
            path, "goals are cost and one other score, in this order", 'Write ["cost", "position_error_mean"].'
        )
    elif len(names) > 2:
        findings.add(
            path, f"no search minimises {len(names)} goals yet, only cost and one other score",
            "Keep cost and the one that matters most, and demand the rest under goal.limits.",
        )  # fmt: skip
    return names


def limits_of(table: GoalTable, site: Site | None, search: Search | None, findings: Findings) -> tuple[Limit, ...]:
    """Return the listed demands; ``site`` and ``search`` as in `goals_of`."""
    found: list[Limit] = []
    for number, text in enumerate(table.limits):
        path: KeyPath = (*_GOAL, "limits", number)
        limit = _limit(text, path, site, findings)
        if limit is None:
            continue
        if any(limit.score == other.score for other in found):
            findings.add(path, f"'{limit.score}' is limited twice", "Keep the tighter one.")
            continue
        _search_answers(limit.score, path, search, findings)
        found.append(limit)
    return tuple(found)


def _limit(text: str, path: KeyPath, site: Site | None, findings: Findings) -> Limit | None:
    match = _LIMIT.fullmatch(text) if len(text) <= 200 else None
    if match is None:
        findings.add(path, "this is no limit: score, <= or >=, number and unit", _EXAMPLE)
        return None
    name, sign, end = match.groups()
    if sign not in ("<=", ">="):
        findings.add(path, f"a limit says <= or >=, not {sign}", f'Write "{name} <= {end}".')
        return None
    unit = _score_exists(name, path, site, findings)
    if unit is None:
        return None
    least = name.rpartition(".")[2] in MORE_IS_BETTER
    if (sign == ">=") is not least:
        sense, right = ("more", ">=") if least else ("less", "<=")
        findings.add(path, f"of '{name}' {sense} is better", f'Write "{name} {right} {end}".')
        return None
    number = _end(name, end, unit, path, findings)
    if number is None:
        return None
    return Limit(score=name, lower=number) if least else Limit(score=name, upper=number)


def _end(name: str, end: str, unit: str, path: KeyPath, findings: Findings) -> float | None:
    """Return the number of a limit in SI; of a score whose unit cannot be written, such as rad², a bare one."""
    if unit not in UNIT_DIMENSIONS:
        bare = _number_if_bare(end, "")
        if isinstance(bare, float) and 0.0 < bare < 1e300:
            return bare
        findings.add(path, f"'{name}' takes a bare positive number in {unit}", f'Write "{name} <= 0.01".')
        return None
    try:
        number = in_si(_number_if_bare(end, unit), UNIT_DIMENSIONS[unit])
    except Unfit as error:
        findings.add(path, error.problem, error.repair)
        return None
    if not number > 0.0:
        findings.add(path, "a limit must be positive", _EXAMPLE)
        return None
    if name.rpartition(".")[2] in SHARES and number > 1.0:
        meant = f"{number:g} %" if number <= 100.0 else "5 %"
        sign = ">=" if name.rpartition(".")[2] in MORE_IS_BETTER else "<="
        findings.add(
            path,
            f"'{name}' is a share, and none is more than 100 %",
            f'Write for example "{name} {sign} {meant}".',
        )
        return None
    return number


def _number_if_bare(end: str, unit: str) -> str | float:
    """Return the end of a limit as a number where the score has no unit that would have to be named."""
    if unit == "":
        try:
            return float(end)
        except ValueError:
            return end
    return end


def _score_exists(name: str, path: KeyPath, site: Site | None, findings: Findings) -> str | None:
    """Return the unit of a score; note one that is unknown, or of an unknown zone."""
    zone, _, score = name.rpartition(".")
    if score not in SCORE_UNITS:
        findings.add(path, f"no score named '{score[:80]}'", did_you_mean(score[:80], SCORE_UNITS))
        return None
    if not zone or site is None:
        return SCORE_UNITS[score]
    if zone not in site.zone_names:
        known = did_you_mean(zone[:80], site.zone_names) if site.zones else "The site has no [[site.zone]]."
        findings.add(path, f"the site has no zone '{zone[:80]}'", known)
        return None
    if score not in (*ZONE_COLUMNS, *ZONE_EXACT):
        known = ", ".join(ZONE_COLUMNS)
        findings.add(path, f"'{score}' is not known for a zone alone", f"Known for zones: {known}.")
        return None
    if score in ZONE_COLUMNS and site.zone(zone).target_error_m is None:
        findings.add(
            path,
            f"zone '{zone}' is not judged by itself, because it has no target_error",
            "Give the zone a target.",
        )
        return None
    return SCORE_UNITS[score]


def _search_answers(name: str, path: KeyPath, search: Search | None, findings: Findings) -> None:
    """Note a score that stays unknown in the search: it needs a covariance, or a robot that is kidnapped."""
    score = name.rpartition(".")[2]
    if search is None:
        return
    if score == "recovery_time" and not search.kidnapped:
        findings.add(
            path, f"'{name}' stays unknown: no robot of the search is kidnapped",
            'Write kidnapped_at = "30 s" under [study.design_faults].',
        )  # fmt: skip
    if score != "nees" or registry.card("estimators", search.estimator).states_covariance:
        return
    cards = {known: registry.card("estimators", known) for known in registry.names("estimators")}
    able = [known for known, card in cards.items() if card.states_covariance and card.estimates == "robot"]
    findings.add(
        path, f"'{name}' stays unknown: '{search.estimator}', the estimator of the search, states no covariance",
        f"Put first in study.validate_with: {', '.join(able)}.",
    )  # fmt: skip
