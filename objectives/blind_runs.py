"""Blind runs over periodic discs: how probable they are, how long, and in which direction.

A straight run of length L in direction theta, with a start that is uniform over the plane, is blind if it meets no
disc. Its probability is one less the share of the plane that stadia about the discs cover,
B_L(theta) = (A_free - sum over exits of the integral of min(gap, L)) / A, and all else follows from it.

Every function takes a sight: fixed discs, or a group of antennas that turns with the robot. Scan periods are left
out, as if every antenna read all the time.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray
from objectives.corridors import Corridor, corridors_in, corridors_of
from objectives.directions import DirectionRule, direction_rule, largest_over, period_rad
from objectives.gap_pieces import GapPieces, gap_pieces
from objectives.periodic_discs import PeriodicDiscs, Sight, columns

DIRECTIONS: Final = 360
"""Directions of a mean, unless told otherwise."""
_GAUSS_NODES: Final = 32
_STEPS: Final = 100
_EXACT: Final = 1e-13
_ROUNDING: Final = 1e-14


@dataclass(frozen=True, slots=True, kw_only=True)
class OverDirections:
    """Blind probability over all directions: its mean, the worst and where, and on what the search rests.

    ``resolution_rad`` is the largest step of the directions from which the worst was refined.
    """

    mean: float
    worst: float
    worst_direction_rad: float
    resolution_rad: float

    @property
    def anisotropy(self) -> float:
        """Worst over mean; NaN where no run is blind, but for rounding."""
        return self.worst / self.mean if self.mean > _ROUNDING else math.nan


@dataclass(frozen=True, slots=True, kw_only=True)
class MeanBlindRun:
    """Mean blind run from a uniform start in a uniform direction, m, and why it is infinite if it is."""

    value_m: float
    reason: str = ""


def blind_probabilities(sight: Sight, length_m: float, direction_rad: FloatArray) -> FloatArray:
    """Return the probability that a run of a length is blind, in directions of any shape; the same shape.

    Raises
    ------
    ValueError
        If the length is negative or not finite, or a direction is not finite.
    """
    direction_rad = _checked_directions(direction_rad)
    gaps = gap_pieces(sight, direction_rad.ravel(), _checked_length(length_m))
    return blind_in(gaps, length_m).reshape(direction_rad.shape)


def over_directions(sight: Sight, length_m: float, count: int = DIRECTIONS) -> OverDirections:
    """Return mean and worst blind probability of a run over the direction of travel.

    The mean is taken over about ``count`` directions (see `objectives.directions.direction_rule`), the worst
    refined from those, as many even ones and all directions of corridors.
    """
    length_m = _checked_length(length_m)
    corridors = corridors_of(sight)
    rule = direction_rule(sight, corridors, _checked_count(count))
    mean = rule.mean(blind_probabilities(sight, length_m, rule.direction_rad), length_m)
    turn_rad = period_rad(sight)
    even_rad = np.arange(count) * turn_rad / count
    places = np.concatenate([even_rad, rule.direction_rad, [item.direction_rad for item in corridors]])
    worst, where_rad = largest_over(lambda place: blind_probabilities(sight, length_m, place), places, turn_rad)
    return OverDirections(mean=mean, worst=worst, worst_direction_rad=where_rad, resolution_rad=turn_rad / count)


def survival(sight: Sight, length_m: FloatArray, count: int = DIRECTIONS) -> FloatArray:
    """Return the probability, mean over direction, that a blind run is longer than each length, shape (k,)."""
    lengths_m = np.array([_checked_length(length) for length in np.asarray(length_m, dtype=np.float64).ravel()])
    rule = direction_rule(sight, corridors_of(sight), _checked_count(count))
    gaps = gap_pieces(sight, rule.direction_rad, float(lengths_m.max(initial=0.0)))
    return np.array([rule.mean(blind_in(gaps, length), length) for length in lengths_m])


def run_quantile(sight: Sight, probability: float, count: int = DIRECTIONS) -> float:
    """Return the length that a blind run exceeds with the probability that is left, mean over direction, m.

    Starts in sight of a tag count as runs of length zero, so the quantile is zero where that is enough.

    Raises
    ------
    ValueError
        If the probability is not at least 0 and below 1.
    """
    rule = direction_rule(sight, corridors_of(sight), _checked_count(count))
    return run_quantiles(sight, [probability], rule)[0]


def run_quantiles(sight: Sight, probabilities: Sequence[float], rule: DirectionRule) -> list[float]:
    """Return `run_quantile` of several probabilities, with the mean over given directions.

    Raises
    ------
    ValueError
        If a probability is below 0, or 1 and more.
    """
    for share in probabilities:
        if not 0.0 <= share < 1.0:
            raise ValueError(f"the probability of a quantile must be at least 0 and below 1, got {share}")
    gaps = gaps_until(sight, max(probabilities), rule)
    return [crossing(gaps, rule, 1.0 - share) for share in probabilities]


def gaps_until(sight: Sight, probability: float, rule: DirectionRule, least_m: float = 0.0) -> GapPieces:
    """Return gaps in the directions of a rule, followed beyond a quantile of the blind run and a least length.

    The first guess, four gaps between discs that do not overlap and what the corridors alone take, is seldom too
    short. Every quantile is finite: only single directions have corridors.
    """
    left = 1.0 - probability
    tail_m = float((rule.share_per_m * rule.width_m**2).sum()) / rule.turn_rad
    longest_m = 2.0 * sight.cell_area_m2 / float(columns(sight).radius.sum()) + 1.5 * tail_m / left
    longest_m = max(longest_m, least_m)
    while True:
        gaps = gap_pieces(sight, rule.direction_rad, longest_m)
        if rule.mean(blind_in(gaps, longest_m), longest_m) <= left:
            return gaps
        longest_m *= 2.0


def crossing(gaps: GapPieces, rule: DirectionRule, left: float) -> float:
    """Return the length at which the mean blind probability falls to a value, m.

    By Newton's method on the logarithm; the slope is exact, and a bracket keeps every step inside.
    """
    low_m, high_m, length_m = 0.0, gaps.longest_m, 0.0
    for step in range(_STEPS):
        area_m2, width_m = gaps.within(length_m)
        mean = rule.mean((gaps.free_m2 - area_m2) / gaps.cell_area_m2, length_m)
        if step == 0 and mean <= left:
            return 0.0
        low_m, high_m = (length_m, high_m) if mean > left else (low_m, length_m)
        slope_per_m = rule.slope_per_m(-width_m / gaps.cell_area_m2, length_m)
        next_m = (
            length_m - mean / slope_per_m * math.log(mean / left) if mean > 0.0 and slope_per_m < 0.0 else high_m
        )
        next_m = next_m if low_m < next_m < high_m else 0.5 * (low_m + high_m)
        if abs(next_m - length_m) <= _EXACT * high_m:
            return next_m
        length_m = next_m
    return length_m


def mean_gap(sight: Sight, direction_rad: float) -> float:
    """Return the mean way from losing sight of the tags to the next sighting, in one direction, m.

    Exits are weighted as they are met by uniform lines. Lines in corridors have no exit and do not count. For
    discs that do not overlap it is (A (1 - b) - N pi r²) / (2 r N), the same in every direction without corridor.
    Zero where the discs cover everything.

    Raises
    ------
    ValueError
        If the direction is not finite.

    References
    ----------
    Santaló, Integral Geometry and Geometric Probability, 2nd ed. 2004, Chapter 8, in each direction by itself.
    """
    gaps = gap_pieces(sight, _checked_directions(direction_rad).reshape(1), 0.0)
    free_m2, exposed_m = float(gaps.free_m2[0]), float(gaps.exposed_m[0])
    if exposed_m == 0.0:
        return 0.0
    corridors = corridors_in(sight, direction_rad)
    blind = corridors[0].blind_fraction if corridors else 0.0
    return (free_m2 - blind * sight.cell_area_m2) / exposed_m


def gap_exceedance(sight: Sight, length_m: float, direction_rad: FloatArray) -> FloatArray:
    """Return the probability that the gap between two sightings is longer than a length, in directions.

    It is -dB_L/dL over its value at L = 0: lines are uniform, and every gap counts once. Zero where the discs
    cover everything and there is no gap.
    """
    direction_rad = _checked_directions(direction_rad)
    gaps = gap_pieces(sight, direction_rad.ravel(), _checked_length(length_m))
    _, width_m = gaps.within(length_m)
    shown = gaps.exposed_m > 0.0
    share = np.zeros(len(width_m))
    share[shown] = width_m[shown] / gaps.exposed_m[shown]
    return share.reshape(direction_rad.shape)


def tail_constant_of(sight: Sight, count: int = DIRECTIONS) -> float:
    """Return C, m, for which a blind run that starts blind is longer than T with a probability of about C / T.

    C is the sum of w² |v| over all corridors, of width w along period v, over pi A_free; zero without corridors.
    A line that leaves the direction of a corridor by delta leaves the corridor after w / |delta|, and that is all
    that remains at great lengths. For a group of antennas, which has corridors for a full turn and a free area
    that depends on its heading, the sum is halved and the free area is the mean over ``count`` headings.
    """
    found = corridors_of(sight)
    rule = direction_rule(sight, (), _checked_count(count))
    return tail_of(sight, found, float(rule.weight @ gap_pieces(sight, rule.direction_rad, 0.0).free_m2))


def tail_of(sight: Sight, corridors: Sequence[Corridor], free_m2: float) -> float:
    """Return `tail_constant_of` for corridors and a free area of the cell that are known."""
    if not corridors:
        return 0.0
    weight_m3 = math.fsum(corridor.weight_m3 for corridor in corridors)
    return weight_m3 / ((math.pi if isinstance(sight, PeriodicDiscs) else 2.0 * math.pi) * free_m2)


def mean_run(sight: Sight, count: int = DIRECTIONS) -> MeanBlindRun:
    """Return the mean blind run from a uniform start in a uniform direction; a start in sight is a run of zero.

    Where a corridor has any width the tail falls as C / T and the mean is infinite. Else all gaps end, and the
    mean is half the integral of the squared gap over all exits of a cell, over its area, mean over direction.
    """
    corridors = corridors_of(sight)
    if corridors:
        widest = max(corridors, key=lambda corridor: corridor.width_m)
        return MeanBlindRun(
            value_m=math.inf,
            reason=(
                f"infinite, because {len(corridors)} corridors let a robot drive blind for ever, the widest of "
                f"{widest.width_m * 1000.0:.3g} mm in direction {math.degrees(widest.direction_rad):.4g}°"
            ),
        )
    rule = direction_rule(sight, corridors, _checked_count(count))
    gaps = gap_pieces(sight, rule.direction_rad, math.inf)
    # At its ends a gap may vary as a root; in the angle of s = middle - half cos(angle) it is smooth.
    x, weight = np.polynomial.legendre.leggauss(_GAUSS_NODES)
    angle_rad = 0.5 * math.pi * (x + 1.0)
    low, high, own, t, s, r = gaps.rows.T[:, :, None]
    half = 0.5 * (high - low)
    offset = 0.5 * (low + high) - half * np.cos(angle_rad)
    gap = t - np.sqrt(np.maximum(r**2 - (offset - s) ** 2, 0.0)) - np.sqrt(np.maximum(own**2 - offset**2, 0.0))
    squares = 0.5 * math.pi * half[:, 0] * ((gap**2 * np.sin(angle_rad)) @ weight)
    mean_of = np.repeat(rule.weight, np.diff(gaps.start))
    return MeanBlindRun(value_m=0.5 * float(mean_of @ squares) / gaps.cell_area_m2)


def blind_in(gaps: GapPieces, length_m: float) -> FloatArray:
    """Return the probability that a run is blind in each direction of known gaps, shape (k,)."""
    area_m2, _ = gaps.within(length_m)
    # Rounding may leave a trace of what is covered.
    return np.asarray(np.maximum(gaps.free_m2 - area_m2, 0.0) / gaps.cell_area_m2)


def _checked_length(length_m: float) -> float:
    if not 0.0 <= length_m < math.inf:
        raise ValueError(f"the length of a run must be zero or more and finite, got {length_m}")
    return float(length_m)


def _checked_directions(direction_rad: FloatArray | float) -> FloatArray:
    directions_rad = np.asarray(direction_rad, dtype=np.float64)
    if not np.isfinite(directions_rad).all():
        raise ValueError(f"a direction must be finite, got {direction_rad}")
    return directions_rad


def _checked_count(count: int) -> int:
    if count < 1:
        raise ValueError(f"a mean over directions needs at least one direction, got {count}")
    return count
