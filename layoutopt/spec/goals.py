"""From ``[goal]`` to limits: ``"dock.position_error_mean <= 8 mm"`` and its like."""

import re
from typing import Final

from layoutopt.errors import did_you_mean
from layoutopt.problem import Limit
from layoutopt.scores import SCORE_UNITS
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


def goals_of(table: GoalTable, site: Site | None, findings: Findings) -> tuple[str, ...]:
    """Return the names of the scores to minimise."""
    path: KeyPath = (*_GOAL, "minimise")
    names = tuple(table.minimise)
    for number, name in enumerate(names):
        _score_exists(name, (*path, number), site, findings)
        if name in names[:number]:
            findings.add((*path, number), "this goal stands twice", "Remove one of them.")
    if len(names) < 2 or names[0] != "cost":
        findings.add(
            path, "goals are cost and at least one other score, in this order",
            'Write ["cost", "position_error_mean"].',
        )  # fmt: skip
    return names


def limits_of(table: GoalTable, site: Site | None, findings: Findings) -> tuple[Limit, ...]:
    """Return the listed demands."""
    found: list[Limit] = []
    for number, text in enumerate(table.limits):
        limit = _limit(text, (*_GOAL, "limits", number), site, findings)
        if limit is not None and any(limit.score == other.score for other in found):
            findings.add((*_GOAL, "limits", number), f"'{limit.score}' is limited twice", "Keep the tighter one.")
        elif limit is not None:
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
