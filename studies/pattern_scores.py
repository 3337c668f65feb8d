"""What geometry alone says of a pattern under one antenna: static error, cover, blind runs."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.layout import TagPattern
from objectives.invisibility import (
    blind_probability,
    blind_probability_over_directions,
    blind_run_quantile,
    blind_run_survival,
    corridors,
    tail_constant,
)
from objectives.position_bound import HalfGap, covering_radius, half_gap_bound, static_error

STATIC_ESTIMATORS: Final = ("midrange", "centroid", "minimax")
LENGTHS_M: Final = (1.0, 2.0)
_DIRECTIONS: Final = 360
_RUNS: Final = 60
_RUN_PITCHES: Final = 16.0
"""Longest run of the curves, in pitches of the square pattern: the same for all patterns of a density."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Static:
    """Static error of one reading by one estimator, m, over all places where a tag is in view."""

    worst_m: float
    mean_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Blindness:
    """Blind runs of a point antenna with a disc over a pattern.

    Attributes
    ----------
    direction_rad, probability
        Directions, shape (n,), and the chance that a run of the first length is blind, shape (n,), for pictures.
    means, worst
        Mean and worst over all directions of the chance that a run of each length is blind.
    run_m, run_probability
        Lengths, shape (k,), and the mean chance over directions that a run so long is blind, shape (k,).
    quantile_m
        Lengths that 95 and 99 % of all blind runs do not exceed.
    corridors, widest_m
        Number of directions with blind corridors, and the width of the widest.
    tail_m
        The constant C of the tail P(run > L) ~ C / L; zero without a corridor.
    """

    direction_rad: FloatArray
    probability: FloatArray
    means: tuple[float, ...]
    worst: tuple[float, ...]
    run_m: FloatArray
    run_probability: FloatArray
    quantile_m: tuple[float, float]
    corridors: int
    widest_m: float
    tail_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PatternScores:
    """All exact numbers of a pattern; ``half_gap`` is ``None`` where the rule does not apply."""

    density_per_m2: float
    spacing_m: float
    covering_m: float
    detection: float
    half_gap: HalfGap | None
    static: dict[str, Static]
    blindness: Blindness | None


def pattern_scores(pattern: TagPattern, radius_m: float) -> PatternScores:
    """Return the numbers of a pattern under a disc; there are no blind runs where a tag is always in view."""
    errors = {name: static_error(pattern, radius_m, name) for name in STATIC_ESTIMATORS}
    detection = errors["midrange"].detection_probability
    try:
        half_gap = half_gap_bound(pattern)
    except ValueError:
        half_gap = None  # the rule speaks of rows and columns, which not every pattern has
    return PatternScores(
        density_per_m2=pattern.density_per_m2,
        spacing_m=pattern.minimum_spacing_m(),
        covering_m=covering_radius(pattern),
        detection=detection,
        half_gap=half_gap,
        static={name: Static(worst_m=error.worst_m, mean_m=error.mean_m) for name, error in errors.items()},
        blindness=_blindness(pattern, radius_m) if covering_radius(pattern) > radius_m else None,
    )


def _blindness(pattern: TagPattern, radius_m: float) -> Blindness:
    direction_rad = np.linspace(0.0, 2.0 * math.pi, _DIRECTIONS, endpoint=False)
    over = [blind_probability_over_directions(pattern, radius_m, length) for length in LENGTHS_M]
    quantile_m = (
        blind_run_quantile(pattern, radius_m, 0.95),
        blind_run_quantile(pattern, radius_m, 0.99),
    )
    run_m = np.linspace(0.0, _RUN_PITCHES / math.sqrt(pattern.density_per_m2), _RUNS)
    found = corridors(pattern, radius_m)
    return Blindness(
        direction_rad=direction_rad,
        probability=blind_probability(pattern, radius_m, LENGTHS_M[0], direction_rad),
        means=tuple(item.mean for item in over),
        worst=tuple(item.worst for item in over),
        run_m=run_m,
        run_probability=blind_run_survival(pattern, radius_m, run_m),
        quantile_m=quantile_m,
        corridors=len({round(item.direction_rad, 9) for item in found}),
        widest_m=max((item.width_m for item in found), default=0.0),
        tail_m=tail_constant(pattern, radius_m),
    )
