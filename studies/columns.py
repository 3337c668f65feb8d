"""Columns of tables: their heads with units, numbers, and scores with their standard errors."""

import math
from typing import Final

from layoutopt.scores import SCORE_UNITS, Score

_CELL_UNITS: Final = {"m²": "m2", "rad²": "rad2", "EUR": "eur", "1/m": "", "m/s": "m_s"}
"""Units as the heads of columns write them; a score per metre says so in its name."""


def named(name: str, unit: str) -> tuple[str, str]:
    """Return the heads of a score's two columns: value and standard error."""
    suffix = f"_{unit}" if unit else ""
    return f"{name}{suffix}", f"{name}_se{suffix}"


def unit_of(name: str) -> str:
    """Return the unit of a score by its name, as heads of columns write it."""
    unit = SCORE_UNITS[name.rpartition(".")[2]]
    return _CELL_UNITS.get(unit, unit)


def pair(score: Score) -> list[str]:
    """Return value and standard error of a score, the latter 0 if it is exact."""
    return [number(score.value), "0" if score.exact else number(score.standard_error)]


def number(value: float) -> str:
    """Return a number with nine digits; nothing where it is not finite."""
    return f"{value:.9g}" if math.isfinite(value) else ""
