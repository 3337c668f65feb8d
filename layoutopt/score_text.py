"""Scores in words and figures for people: millimetres, degrees, euros, each with what is known of its error."""

import math
from typing import Final

from layoutopt.problem import Limit
from layoutopt.scores import SCORE_UNITS, SHARES, Score

NOT_KNOWN: Final = "not known"
_AXES: Final = {"position": "position error", "x": "error in x", "y": "error in y", "heading": "heading error"}
_STATISTICS: Final = {"mean": "mean", "p95": "95 %", "max": "largest", "variance": "variance of the"}
_NAMES: Final = {
    "cost": "cost",
    "published_half_gap": "published half-gap (no bound)",
    "derived_half_gap": "derived half-gap (no bound)",
    "expected_reads_per_step": "expected reads per step",
    "expected_reads_per_m": "expected reads per metre",
    "expected_new_tags_per_m": "expected new tags per metre",
    "static_error_worst": "worst static error of one reading",
    "static_error_mean": "mean static error of one reading",
    "no_detection_share": "share of places where an antenna sees no tag",
    "heading_bound": "bound of a static heading",
    "blind_probability_mean": "mean chance that 1 m is blind",
    "blind_probability_worst": "chance that 1 m is blind in the worst direction",
    "blind_run_p95": "95 % blind run",
    "blind_run_p99": "99 % blind run",
    "tail_constant": "constant of the blind tail",
    "speed_limit": "speed limit of the readers, mean crossing",
    "speed_limit_centre": "speed limit of the readers, under the middle",
    "missed_crossing_share": "share of tags passed without a read by an antenna",
    "pose_coverage": "share of poses that see a tag",
    "pose_coverage_two": "share of poses that see two tags",
    "run_coverage": "share of 1 m runs that see a tag",
    "lost_share": "share of time lost",
    "time_to_localise": "time to localise",
    "recovery_time": "time to recover from kidnapping",
    "nees": "consistency (NEES)",
    "reads_per_step": "reads per step",
    "area_coverage": "UHF coverage of the floor ahead",
    "walk_coverage": "UHF coverage of the walk",
    "expected_alias_share": "expected share of ambiguous phase pairs",
    "tracking_error_mean": "mean tracking error",
    "tracking_error_p95": "95 % tracking error",
    "tracking_error_max": "largest tracking error",
    "tracking_lost_share": "share of time that the target is lost",
    "detection_share": "share of instants at which the tag is heard",
    "alias_share": "share of ambiguous phase pairs",
    "laser_match_share": "share of instants at which a laser cluster matches",
    "direction_error_mean": "mean error of the direction",
    "direction_bad_share": "share of places with a misleading direction",
    "scatterer_clearance": "clearance of the transponder",
    "docking_success": "share of drives that dock",
    "docking_steps": "steps to dock",
    "docking_direction_error_mean": "mean error of the direction on the way",
    **{
        f"{axis}_error_{statistic}": f"{statistic_words} {axis_words}"
        for axis, axis_words in _AXES.items()
        for statistic, statistic_words in _STATISTICS.items()
    },
}
_SHOWN: Final = {
    "m": (1000.0, "mm"),
    "m²": (1e6, "mm²"),
    "rad": (180.0 / math.pi, "°"),
    "rad²": ((180.0 / math.pi) ** 2, "deg²"),
}
_MOST_DECIMALS: Final = 6
_ROUNDING: Final = 1e-9
"""What rounds up only because binary fractions are inexact stays as it is."""
_THIN_SPACE: Final = "\u202f"


def shown_unit(name: str) -> tuple[float, str]:
    """Return by what a score of that name is multiplied to be shown, and the unit then; empty for bare numbers.

    >>> shown_unit("dock.position_error_p95"), shown_unit("lost_share")
    ((1000.0, 'mm'), (100.0, '%'))
    """
    quantity = name.rpartition(".")[2]
    if quantity in SHARES:
        return 100.0, "%"
    unit = SCORE_UNITS.get(quantity, "")
    return _SHOWN.get(unit, (1.0, unit))


def score_name(name: str) -> str:
    """Return what a score is called in a sentence.

    >>> score_name("dock.position_error_mean")
    "mean position error in zone 'dock'"
    """
    zone, _, quantity = name.rpartition(".")
    words = _NAMES.get(quantity, quantity)
    return f"{words} in zone '{zone}'" if zone else words


def score_text(score: Score | None, name: str = "", *, signed: bool = False, bounded: bool = True) -> str:
    """Return value, standard error and number of replications, or ``"not known"``.

    Digits follow the standard error: two of its own are shown. ``name`` tells shares, which are shown in per
    cent, from other bare numbers.

    >>> score_text(Score(value=0.00831, unit="m", standard_error=0.00015, count=200))
    '8.31 ± 0.15 mm (n = 200)'

    A share that no replication showed, or every one, has no error of its own; what it may still be is told
    instead, unless the caller tells it (``bounded`` is false).

    >>> score_text(Score(value=0.0, unit="", standard_error=0.0, count=200, share=True), "lost_share")
    '0 % (n = 200, at most 1.5 % at 95 % confidence)'
    """
    if score is None or math.isnan(score.value):
        return NOT_KNOWN
    factor, unit = _shown(score, name)
    if _all_or_nothing(score) and not signed:
        bound = f", {_share_bound_text(score)} at 95 % confidence" if bounded else ""
        return f"{percent_text(score.value)} (n = {score.count}{bound})"
    value, error = score.value * factor, score.standard_error * factor
    space = "" if unit == "°" else " "
    if score.exact:
        return f"{_exact(value, score.unit, signed=signed)}{space}{unit}".rstrip()
    sign = "+" if signed else ""
    counted = f" (n = {score.count})"
    if not math.isfinite(error):
        counted = f" (n = {score.count}, standard error {NOT_KNOWN})"
        return f"{value:{sign}.3g}{space}{unit}".rstrip() + counted
    decimals = _decimals(error, value)
    return f"{value:{sign}.{decimals}f} ± {error:.{decimals}f}{space}{unit}".rstrip() + counted


def quantity_text(value: float, like: Score, name: str = "") -> str:
    """Return a bare value in the unit in which a score like this one is shown.

    >>> quantity_text(0.0125, Score(value=0.01, unit="m"))
    '12.5 mm'
    """
    factor, unit = _shown(like, name)
    space = "" if unit == "°" else " "
    return f"{value * factor:.4g}{space}{unit}".rstrip()


def rough_text(value: float, like: Score, name: str = "") -> str:
    """Return a bare value in two digits: of a bound less a limit no more is known.

    >>> rough_text(0.0006719, Score(value=0.01, unit="m"))
    '0.67 mm'
    """
    return quantity_text(float(f"{value:.2g}"), like, name)


def interval_text(score: Score | None, name: str = "", *, signed: bool = False) -> str:
    """Return the two-sided 95 % interval of a simulated score, or ``"not known"``.

    No score is negative, only the difference of two (``signed``): of what few replications leave below zero, an
    interval loses nothing by ending there.

    >>> interval_text(Score(value=0.010, unit="m", standard_error=0.001, count=31))
    '8.0 to 12.0 mm'
    """
    if score is None:
        return NOT_KNOWN
    factor, unit = _shown(score, name)
    low, high = (end * factor for end in score.interval())
    low = low if signed else max(0.0, low)
    if not (math.isfinite(low) and math.isfinite(high)):
        return NOT_KNOWN
    decimals = _decimals(score.standard_error * factor, score.value * factor)
    space = "" if unit == "°" else " "
    return f"{low:.{decimals}f} to {high:.{decimals}f}{space}{unit}".rstrip()


def euros(amount: float) -> str:
    """Return an amount of money, to the cent.

    >>> euros(1240.5).replace(chr(0x202f), "_")
    '1_240.50 EUR'
    """
    return f"{_grouped(amount)} EUR"


def percent_text(share: float, decimals: int = 0) -> str:
    """Return a share in per cent.

    >>> percent_text(0.95), percent_text(0.2974, 1)
    ('95 %', '29.7 %')
    """
    return f"{100.0 * share:.{decimals}f} %"


def counted_text(count: int, word: str) -> str:
    """Return a number with what it counts.

    >>> counted_text(1, "layout"), counted_text(3, "layout")
    ('1 layout', '3 layouts')
    """
    return f"{count} {word}{'s' if count != 1 else ''}"


def limit_text(limit: Limit) -> str:
    """Return a demand as people read it.

    >>> limit_text(Limit(score="heading_error_p95", upper=0.0872664626))
    '95 % heading error at most 5°'
    >>> limit_text(Limit(score="pose_coverage", lower=0.99))
    'share of poses that see a tag at least 99 %'
    """
    end = Score(value=limit.end, unit=SCORE_UNITS.get(limit.score.rpartition(".")[2], ""))
    side = "at most" if limit.upper is not None else "at least"
    return f"{score_name(limit.score)} {side} {score_text(end, limit.score)}"


def _share_bound_text(score: Score) -> str:
    """Return the one-sided bound of a share of none or all, rounded away from it to two digits of the distance."""
    none = score.value == 0.0
    distance = 100.0 * (score.upper() if none else 1.0 - score.lower())
    decimals = min(_MOST_DECIMALS, max(1, 1 - math.floor(math.log10(distance))))
    rounded = math.ceil(distance * 10.0**decimals - _ROUNDING) / 10.0**decimals
    return f"{'at most' if none else 'at least'} {rounded if none else 100.0 - rounded:.{decimals}f} %"


def _all_or_nothing(score: Score) -> bool:
    share = score.share and not score.exact and score.least == 0.0
    return share and score.standard_error == 0.0 and score.value in (0.0, 1.0)


def _shown(score: Score, name: str) -> tuple[float, str]:
    return shown_unit(name) if name else _SHOWN.get(score.unit, (1.0, score.unit))


def _exact(value: float, unit: str, *, signed: bool) -> str:
    return _grouped(value) if unit == "EUR" else f"{value:{'+' if signed else ''}.4g}"


def _grouped(amount: float) -> str:
    return f"{amount:,.2f}".replace(",", _THIN_SPACE)


def _decimals(error: float, value: float) -> int:
    """Return the decimals that show two digits of the error, or three of the value if it is zero or not known."""
    digits, number = (1, error) if 0.0 < error < math.inf else (2, abs(value))
    if number <= 0.0:
        return 1
    return min(_MOST_DECIMALS, max(0, digits - math.floor(math.log10(number))))
