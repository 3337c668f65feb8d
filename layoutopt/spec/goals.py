"""From ``[goal]`` to limits: ``"dock.position_error_mean <= 8 mm"`` and its like."""

import re
from typing import Final

from layoutopt import registry
from layoutopt.errors import did_you_mean
from layoutopt.problem import Limit
from layoutopt.scores import OUTCOME_COLUMNS, SCORE_UNITS
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
    "EUR": "price",
    "m²": "area",
    "": "share",
}
ZONE_HALF_GAPS: Final = ("published_half_gap", "derived_half_gap")
_LIMIT = re.compile(r"\s*([^\s<>=]+)\s*(<=|>=|<|>|=+)\s*(.*?)\s*")
_EXAMPLE: Final = 'Write "heading_error_p95 <= 5 deg".'
_GOAL: Final = ("goal",)


def goals_of(table: GoalTable, site: Site | None, estimator: str | None, findings: Findings) -> tuple[str, ...]:
    """Return the names of the scores to minimise: cost, and one that the search's ``estimator`` can answer.

    ``site`` and ``estimator`` are ``None`` where their own tables have faults.
    """
    path: KeyPath = (*_GOAL, "minimise")
    names = tuple(table.minimise)
    for number, name in enumerate(names):
        unit = _score_exists(name, (*path, number), site, findings)
        if name in names[:number]:
            findings.add((*path, number), "this goal stands twice", "Remove one of them.")
        elif unit is not None and name.rpartition(".")[2] not in ("cost", *OUTCOME_COLUMNS):
            findings.add(
                (*path, number), f"no search minimises '{name}' yet, because no drive is simulated for it",
                'Minimise "position_error_mean"; a half-gap can stand under goal.limits.',
            )  # fmt: skip
        elif unit is not None:
            _estimator_answers(name, (*path, number), estimator, findings)
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


def limits_of(table: GoalTable, site: Site | None, estimator: str | None, findings: Findings) -> tuple[Limit, ...]:
    """Return the listed demands; ``site`` and ``estimator`` as in `goals_of`."""
    found: list[Limit] = []
    for number, text in enumerate(table.limits):
        path: KeyPath = (*_GOAL, "limits", number)
        limit = _limit(text, path, site, findings)
        if limit is None:
            continue
        if any(limit.score == other.score for other in found):
            findings.add(path, f"'{limit.score}' is limited twice", "Keep the tighter one.")
            continue
        _estimator_answers(limit.score, path, estimator, findings)
        found.append(limit)
    return tuple(found)


def _limit(text: str, path: KeyPath, site: Site | None, findings: Findings) -> Limit | None:
    match = _LIMIT.fullmatch(text) if len(text) <= 200 else None
    if match is None:
        findings.add(path, "this is no limit: score, <=, number and unit", _EXAMPLE)
        return None
    name, sign, bound = match.groups()
    if sign != "<=":
        findings.add(path, f"a limit says <=, not {sign}", f'Write "{name} <= {bound}".')
        return None
    unit = _score_exists(name, path, site, findings)
    if unit is None:
        return None
    if unit not in UNIT_DIMENSIONS:
        return _bare_limit(name, bound, unit, path, findings)
    try:
        upper = in_si(_number_if_bare(bound, unit), UNIT_DIMENSIONS[unit])
    except Unfit as error:
        findings.add(path, error.problem, error.repair)
        return None
    if not upper > 0.0:
        findings.add(path, "a limit must be positive", _EXAMPLE)
        return None
    return Limit(score=name, upper=upper)


def _bare_limit(name: str, bound: str, unit: str, path: KeyPath, findings: Findings) -> Limit | None:
    """Return a limit on a score whose unit cannot be written, such as rad²: a bare number."""
    number = _number_if_bare(bound, "")
    if isinstance(number, float) and 0.0 < number < 1e300:
        return Limit(score=name, upper=number)
    findings.add(path, f"'{name}' takes a bare positive number in {unit}", f'Write "{name} <= 0.01".')
    return None


def _number_if_bare(bound: str, unit: str) -> str | float:
    """Return the bound as a number where the score has no unit that would have to be named."""
    if unit == "":
        try:
            return float(bound)
        except ValueError:
            return bound
    return bound


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
    if score not in (*ZONE_COLUMNS, *ZONE_HALF_GAPS):
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


def _estimator_answers(name: str, path: KeyPath, estimator: str | None, findings: Findings) -> None:
    """Note a score that needs the covariance which the search's estimator does not state."""
    if name.rpartition(".")[2] != "nees" or estimator is None:
        return
    if registry.card("estimators", estimator).states_covariance:
        return
    able = [
        known for known in registry.names("estimators") if registry.card("estimators", known).states_covariance
    ]
    findings.add(
        path, f"'{name}' stays unknown: '{estimator}', the estimator of the search, states no covariance",
        f"Put first in study.validate_with: {', '.join(able)}.",
    )  # fmt: skip
