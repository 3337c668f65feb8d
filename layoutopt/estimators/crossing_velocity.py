"""Velocity and place of a robot on a straight way, from the times at which it enters and leaves discs about tags.

All functions are free of units: times may be steps or ways of a wheel as well, and speeds follow.

References
----------
kim2010, Section 2.1, Eq. 1-6, and Fig. 4 for the start from an unknown place, without equations.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, unique
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray

_NEAR_EDGE: Final = 0.1
_SHORT_CHORD: Final = 0.1
_THROUGH_MIDDLE: Final = 0.999
_ROUNDING: Final = 1e-9


@unique
class Degenerate(Enum):
    """Why a crossing tells less than it should; the value says it in words."""

    INSIDE = "the start lies within the disc: one equation for two unknowns"
    NO_TIME = "no time passed before the disc was entered"
    NEAR_EDGE = "the start lies within a tenth of the radius from the edge: the speed is badly conditioned"
    TANGENT = "the chord is shorter than a tenth of the diameter: a sampled reader may miss it"
    THROUGH_MIDDLE = "the way leads through the middle: both headings are one, and badly conditioned"
    IMPOSSIBLE = "the chord is longer than the disc is wide: no straight way at constant speed takes these times"


@dataclass(frozen=True, slots=True, kw_only=True)
class CrossingVelocity:
    """Speed and headings that fit one crossing.

    Attributes
    ----------
    speed_m_s
        NaN where the crossing gives none.
    headings_rad
        The mirror branches as seen from the line from start to tag, counter-clockwise one first; one of zero if
        the chord is as long as the disc is wide or longer, none where the crossing gives no speed.
    degenerate
        All that is wrong with this crossing, in the order of `Degenerate`; empty if nothing is.
    """

    speed_m_s: float
    headings_rad: tuple[float, ...]
    degenerate: tuple[Degenerate, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensitivity:
    """Derivatives of speed and of the counter-clockwise heading with respect to both times."""

    speed_to_entry: float
    speed_to_inside: float
    heading_to_entry: float
    heading_to_inside: float


@dataclass(frozen=True, slots=True, kw_only=True)
class StraightStart:
    """A straight way that fits the crossings of two tags: where it was at a time, its speed and its direction."""

    place_m: tuple[float, float]
    time_s: float
    speed_m_s: float
    direction_rad: float


def velocity(
    start_distance_m: float,
    radius_m: float,
    time_to_entry_s: float,
    time_inside_s: float,
    *,
    timing_s: float = 0.0,
) -> CrossingVelocity:
    """Return speed and headings of a robot that started somewhere known and crossed the disc of a tag.

    Parameters
    ----------
    start_distance_m
        Distance of the start from the tag.
    radius_m
        Radius of the disc in which the tag is read.
    time_to_entry_s, time_inside_s
        Time from the start to entering the disc, and from there to leaving it.
    timing_s
        By how much the moment of either edge may be off. A chord that is too long for the disc is impossible if it
        is still too long when the disc was entered so much later and left so much earlier.

    Raises
    ------
    ValueError
        If a number is not finite, the radius is not positive, or a distance or time negative.

    References
    ----------
    kim2010, Eq. 4-6: v = sqrt((l² - r²) / (t1 (t1 + t2))), cos(theta) = v (2 t1 + t2) / (2 l).

    Examples
    --------
    >>> found = velocity(100.0, 10.0, 9.134183401606, 1.704223891880)
    >>> round(found.speed_m_s, 9), [round(math.degrees(angle), 6) for angle in found.headings_rad]
    (10.0, [3.0, -3.0])
    """
    sizes = (start_distance_m, radius_m, time_to_entry_s, time_inside_s, timing_s)
    if not all(map(math.isfinite, sizes)) or radius_m <= 0.0 or min(sizes) < 0.0:
        raise ValueError(
            f"a crossing needs a positive radius, and distance and times of zero or more, got {sizes}"
        )
    # In shares of the longer time and of the distance no number is too large or too small.
    longer_s = max(time_to_entry_s, time_inside_s)
    entry = time_to_entry_s / longer_s if longer_s > 0.0 else 0.0
    if start_distance_m <= radius_m or entry == 0.0:
        return CrossingVelocity(
            speed_m_s=math.nan,
            headings_rad=(),
            degenerate=_those_that_hold(
                {Degenerate.INSIDE: start_distance_m <= radius_m, Degenerate.NO_TIME: entry == 0.0}
            ),
        )
    inside = time_inside_s / longer_s
    pace = _pace(start_distance_m, radius_m, entry, inside)
    speed = pace * start_distance_m / longer_s
    if not math.isfinite(speed):
        return CrossingVelocity(speed_m_s=math.nan, headings_rad=(), degenerate=(Degenerate.NO_TIME,))
    chord_share = pace * inside * start_distance_m / (2.0 * radius_m)
    off = timing_s / longer_s
    later, shorter = entry + off, max(inside - 2.0 * off, 0.0)
    least_share = _pace(start_distance_m, radius_m, later, shorter) * shorter * start_distance_m / (2.0 * radius_m)
    impossible = least_share > 1.0 + _ROUNDING
    flags = {
        Degenerate.NEAR_EDGE: start_distance_m - radius_m < _NEAR_EDGE * radius_m,
        Degenerate.TANGENT: chord_share < _SHORT_CHORD,
        Degenerate.THROUGH_MIDDLE: chord_share > _THROUGH_MIDDLE and not impossible,
        Degenerate.IMPOSSIBLE: impossible,
    }
    cosine = pace * (2.0 * entry + inside) / 2.0
    heading_rad = math.atan2(math.sqrt((1.0 - cosine) * (1.0 + cosine)), cosine) if cosine < 1.0 else 0.0
    return CrossingVelocity(
        speed_m_s=speed,
        headings_rad=(heading_rad, -heading_rad) if cosine < 1.0 else (0.0,),
        degenerate=_those_that_hold(flags),
    )


def _pace(start_distance_m: float, radius_m: float, entry: float, inside: float) -> float:
    """Return the speed of Eq. 4, in distances of the start in a unit of the times."""
    share = radius_m / start_distance_m
    # As (l - r) (l + r): near the edge the difference of squares would cancel.
    power = (start_distance_m - radius_m) / start_distance_m * (1.0 + share)
    return math.sqrt(power) / (math.sqrt(entry) * math.sqrt(entry + inside))


def _those_that_hold(flags: Mapping[Degenerate, bool]) -> tuple[Degenerate, ...]:
    return tuple(flag for flag, holds in flags.items() if holds)


def sensitivity(
    start_distance_m: float, radius_m: float, time_to_entry_s: float, time_inside_s: float
) -> Sensitivity:
    """Return how `velocity` changes with its times; infinite headings where the way leads through the middle.

    Raises
    ------
    ValueError
        As `velocity`, or where the crossing gives no speed.
    """
    found = velocity(start_distance_m, radius_m, time_to_entry_s, time_inside_s)
    if not found.headings_rad:
        reasons = "; ".join(flag.value for flag in found.degenerate)
        raise ValueError(f"nothing follows from this crossing: {reasons}")
    longer_s = max(time_to_entry_s, time_inside_s)
    entry, inside = time_to_entry_s / longer_s, time_inside_s / longer_s
    speed, sine = found.speed_m_s, math.sin(found.headings_rad[0])
    to_entry, to_inside = -0.5 * (1.0 / entry + 1.0 / (entry + inside)), -0.5 / (entry + inside)
    turns = [
        -speed * (slope * (2.0 * entry + inside) + share) / (2.0 * start_distance_m * sine)
        if sine > 0.0
        else math.inf
        for slope, share in ((to_entry, 2.0), (to_inside, 1.0))
    ]
    return Sensitivity(
        speed_to_entry=to_entry * speed / longer_s,
        speed_to_inside=to_inside * speed / longer_s,
        heading_to_entry=turns[0],
        heading_to_inside=turns[1],
    )


def two_tag_start(
    tags_m: FloatArray, radius_m: float, entries_s: tuple[float, float], exits_s: tuple[float, float]
) -> tuple[StraightStart, ...]:
    """Return all straight ways at constant speed that cross the discs of two tags at given times.

    The foot of a tag on the way is the middle of its chord, so the feet lie v Δm apart for middles Δm apart in
    time, and the tags lie c = ± sqrt(r² - (v h)²) beside the way, where h is half the time inside. With the
    distance D of the tags (v Δm)² + (c2 - c1)² = D², a quadratic equation in v². Either root has tags on one side
    or on both, and every way has a mirror image about the line through the tags: up to four in all.

    Parameters
    ----------
    tags_m
        The tags in the order in which their chords have their middles, shape (2, 2).
    entries_s, exits_s
        Times of entering and leaving each disc.

    Returns
    -------
    tuple of StraightStart
        Each at the later exit, by rising speed; empty if no such way exists.

    Raises
    ------
    ValueError
        If the two tags are one, a number is not finite, an exit lies before its entry, the middles are not in
        order, or the radius is not positive.

    References
    ----------
    kim2010, Fig. 4; the equations are ours.
    """
    (x_m, y_m), (to_x_m, to_y_m) = np.asarray(tags_m, dtype=np.float64).reshape(2, 2).tolist()
    edges_s = [(float(entry), float(leave)) for entry, leave in zip(entries_s, exits_s, strict=True)]
    distance_m = math.hypot(to_x_m - x_m, to_y_m - y_m)
    middles_s = [entry / 2.0 + leave / 2.0 for entry, leave in edges_s]
    halves_s = [leave / 2.0 - entry / 2.0 for entry, leave in edges_s]
    between_s = middles_s[1] - middles_s[0]
    if not (
        all(map(math.isfinite, (radius_m, distance_m, *halves_s, between_s)))
        and min(radius_m, distance_m, between_s) > 0.0
        and min(halves_s) >= 0.0
    ):
        raise ValueError(
            "a start from two tags needs a positive radius, two places, finite times, exits after entries, first "
            "tag first"
        )
    # Lengths in radii, times in that between the middles; then a root is the square of the way between the feet.
    squares = [(half / between_s) * (half / between_s) for half in halves_s]
    apart = distance_m / radius_m
    rest, offset = 1.0 - sum(squares), 2.0 - apart * apart
    roots = _positive_roots(
        rest * rest - 4.0 * squares[0] * squares[1],
        2.0 * rest * offset + 4.0 * sum(squares),
        offset * offset - 4.0,
    )
    line_rad = math.atan2(to_y_m - y_m, to_x_m - x_m)
    latest_s = max(leave for _, leave in edges_s)
    found = []
    for root in roots:
        beside = [1.0 - root * square for square in squares]
        way_m = math.sqrt(root) * radius_m
        speed, on_m = way_m / between_s, way_m * ((latest_s - middles_s[0]) / between_s)
        if not (min(beside) >= -_ROUNDING and math.isfinite(speed) and math.isfinite(on_m + abs(x_m) + abs(y_m))):
            continue
        first_m, second_m = (radius_m * math.sqrt(max(value, 0.0)) for value in beside)
        # The sum of squares decides on which sides of the way the tags lie.
        same_side = rest * root + offset >= 0.0
        across_m = (second_m if same_side else -second_m) - first_m
        for sign in (1.0, -1.0):
            # The tags' line leaves the way by the angle whose sine is what they differ beside it.
            direction_rad = line_rad - sign * math.atan2(across_m, way_m)
            cos, sin, left_m = math.cos(direction_rad), math.sin(direction_rad), -sign * first_m
            found.append(
                StraightStart(
                    place_m=(x_m + on_m * cos - left_m * sin, y_m + on_m * sin + left_m * cos),
                    time_s=latest_s,
                    speed_m_s=speed,
                    direction_rad=direction_rad,
                )
            )
    return tuple(sorted(found, key=lambda start: start.speed_m_s))


def _positive_roots(square: float, linear: float, constant: float) -> list[float]:
    """Return the positive roots of a quadratic, or of what is left of it; a double one once."""
    scale = max(abs(square), abs(linear), abs(constant))
    if scale == 0.0:
        return []
    if abs(square) <= 1e-14 * scale:
        return [-constant / linear] if linear != 0.0 and -constant / linear > 0.0 else []
    inside = linear * linear - 4.0 * square * constant
    if inside < -1e-12 * linear * linear:
        return []
    # Without cancellation: Press et al., Numerical Recipes, Section 5.6.
    half = -0.5 * (linear + math.copysign(math.sqrt(max(inside, 0.0)), linear))
    roots = {half / square, constant / half if half != 0.0 else 0.0}
    return sorted(root for root in roots if root > 0.0)
