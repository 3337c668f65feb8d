"""The half-gap rule of han2006: how far a midrange estimate of one static reading may be off.

The rule is no bound. It assumes a reading area that acts like a box aligned with the pattern and always holds
tags. A disc does neither: on the triangular pattern a midrange reading errs by up to 0.649 pitches (at a radius
of 1.08) where the rule says 0.559 and the paper 0.58. A filter that joins many readings beats the rule. The
scores rank patterns and let the published numbers stand beside simulated ones.
"""

import math
from dataclasses import dataclass, field
from typing import ClassVar, Final

import numpy as np

from layoutopt.identity import FloatArray, by_content
from layoutopt.layout import WHOLE_FLOOR, Layout, TagPattern
from layoutopt.protocols import ObjectiveCard
from layoutopt.scenario import Scenario
from layoutopt.scores import SCORE_UNITS, Score, Scores, TrialOutcomes

CARD: Final = ObjectiveCard(
    summary=(
        "Half-gap error of one static midrange reading: as han2006 prints it, and as its rule gives it. "
        "No proven bound: it assumes a box-like reading area that always holds tags."
    ),
    reference="han2006, Eq. 15, 16, 19 and 20",
    scores={name: SCORE_UNITS[name] for name in ("published_half_gap", "derived_half_gap")},
    fidelity="published",
    bounds="",
    per_zone=True,
)
PUBLISHED_SQUARE: Final = 0.707
"""Eq. 16 of han2006, in pitches."""
PUBLISHED_TRIANGULAR: Final = 0.58
"""Eq. 20 of han2006, in pitches; the arithmetic of its Eq. 19 gives 0.559."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HalfGap:
    """Half-gap error of a pattern, m: the printed one, if the paper prints one, and the derived one."""

    published_m: float | None
    derived_m: float


def half_gap_bound(pattern: TagPattern) -> HalfGap:
    """Return the half-gap error sqrt((g_x/2)^2 + (g_y/2)^2) of a pattern with an axis-parallel cell.

    g_x is the largest gap between neighbouring columns of tags (places that differ in x, whatever their y) and
    g_y between rows, over the whole period. The published numbers hold for the square pattern and for rows one
    pitch apart that are shifted by half a pitch.

    Raises
    ------
    ValueError
        If the rule does not apply; the message says why.

    References
    ----------
    han2006, Eq. 15-16 (0.707 d, square) and Eq. 19-20 (printed 0.58 d, derived 0.559 d, triangular).

    Examples
    --------
    >>> from layoutopt.patterns.square import square
    >>> round(half_gap_bound(square(pitch_m=0.1)).derived_m, 5)
    0.07071
    """
    if pattern.cell_m is None:
        raise ValueError("does not apply, because the pattern is laid once and has no period")
    width_m, height_m = np.diag(pattern.cell_m)
    if not (np.array_equal(pattern.cell_m, np.diag([width_m, height_m])) and min(width_m, height_m) > 0.0):
        raise ValueError("does not apply, because the cell of the pattern is no axis-parallel rectangle")
    if len(pattern.points_m) == 0:
        raise ValueError("does not apply, because the pattern has no tag")
    gap_x_m = _largest_gap(pattern.points_m[:, 0], float(width_m))
    gap_y_m = _largest_gap(pattern.points_m[:, 1], float(height_m))
    return HalfGap(published_m=_published(pattern), derived_m=math.hypot(gap_x_m / 2.0, gap_y_m / 2.0))


def _published(pattern: TagPattern) -> float | None:
    pitch_m = float(pattern.parameters.get("pitch_m", math.nan))
    if pattern.name == "square":
        return PUBLISHED_SQUARE * pitch_m
    row_gap_m = float(pattern.parameters.get("row_gap_m", math.nan))
    if pattern.name == "triangular" and math.isclose(row_gap_m, pitch_m):
        return PUBLISHED_TRIANGULAR * pitch_m
    return None


def _largest_gap(places_m: FloatArray, period_m: float) -> float:
    """Return the largest gap between different places on a line that repeats after ``period_m``."""
    places_m = np.sort(np.mod(places_m, period_m))
    gaps_m = np.diff(places_m, append=places_m[0] + period_m)
    return float(gaps_m.max())


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PositionBound:
    """Published and derived half-gap error of the base pattern, and of each zone with a pattern of its own."""

    key: str = field(init=False, repr=False, default="")
    card: ClassVar[ObjectiveCard] = CARD

    def __post_init__(self) -> None:
        """Nothing to check: the objective has no settings."""

    def __call__(self, layout: Layout, scenario: Scenario, outcomes: TrialOutcomes | None) -> Scores:
        """Return the scores of the patterns to which the rule applies; those of a zone are ``zone.name``."""
        scores: dict[str, Score] = {}
        floor_tags = layout.floor_tags
        named = [(f"{entry.zone}.", entry.pattern) for entry in floor_tags.zones if entry.zone != WHOLE_FLOOR]
        for prefix, pattern in [("", floor_tags.base.pattern), *named]:
            try:
                gap = half_gap_bound(pattern)
            except ValueError:
                continue  # an objective that does not apply gives no scores
            for name, value_m in (("published_half_gap", gap.published_m), ("derived_half_gap", gap.derived_m)):
                if value_m is not None:
                    scores[prefix + name] = Score(value=value_m, unit=CARD.scores[name])
        return scores
