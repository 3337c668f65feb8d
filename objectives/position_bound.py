"""Error of one static reading: the half-gap rule of han2006, and what is true instead.

The rule is no bound. It assumes a reading area that acts like a box aligned with the pattern and always holds
tags. A disc does neither: on the triangular pattern a midrange reading errs by up to 0.649 pitches (at a radius
of 1.08) where the rule says 0.559 and the paper 0.58. A filter that joins many readings beats the rule. The
scores rank patterns and let the published numbers stand beside simulated ones.

`static_error` gives the true worst case and mean for a disc, and `objectives.box_error` those for a box. Both are
exact: the plane is cut where what is read changes, and nothing is sampled.
"""

import math
from dataclasses import dataclass, field
from functools import lru_cache
from typing import ClassVar, Final

import numpy as np

from layoutopt.circles import Arrangement, arrangement
from layoutopt.geometry import lattice_points, reduced_cell
from layoutopt.identity import FloatArray, by_content
from layoutopt.layout import Layout, TagPattern
from layoutopt.protocols import ObjectiveCard
from layoutopt.scenario import Scenario
from layoutopt.scores import SCORE_UNITS, Score, Scores, TrialOutcomes
from objectives.box_error import BoxError, box_error, rectangular_cell_m

__all__ = [
    "BoxError",
    "HalfGap",
    "HalfGapCheck",
    "PositionBound",
    "StaticError",
    "box_error",
    "check_half_gap",
    "covering_density",
    "covering_radius",
    "half_gap_bound",
    "static_error",
]

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
_PRINTED: Final = 1e-3
"""Half a unit of the third digit, relative to the number."""


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
    width_m, height_m = rectangular_cell_m(pattern)
    gap_x_m = _largest_gap(pattern.points_m[:, 0], width_m)
    gap_y_m = _largest_gap(pattern.points_m[:, 1], height_m)
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


ESTIMATORS: Final = ("midrange", "centroid", "minimax")


@dataclass(frozen=True, slots=True, kw_only=True)
class StaticError:
    """Error of the place that one reading gives, over all places where something is read.

    Attributes
    ----------
    worst_m, mean_m
        Largest and mean distance between estimate and place, given that a tag is read.
    detection_probability
        Share of places where one is.
    """

    worst_m: float
    mean_m: float
    detection_probability: float


@dataclass(frozen=True, slots=True, kw_only=True)
class HalfGapCheck:
    """The half-gap figures of a pattern beside the true worst case of a disc."""

    half_gap: HalfGap
    worst_m: float

    @property
    def published_holds(self) -> bool | None:
        """Whether no place errs by more than the paper prints; ``None`` where it prints nothing.

        The 0.707 of the square is sqrt(1/2) in three digits, and is taken for what it was rounded from.
        """
        published_m = self.half_gap.published_m
        if published_m is None:
            return None
        rounded = math.isclose(published_m, self.half_gap.derived_m, rel_tol=_PRINTED)
        return self.derived_holds if rounded else self.worst_m <= published_m

    @property
    def derived_holds(self) -> bool:
        """Whether no place errs by more than the rule gives."""
        return self.worst_m <= self.half_gap.derived_m * (1.0 + 1e-9)


def static_error(pattern: TagPattern, radius_m: float, estimator: str = "midrange") -> StaticError:
    """Return the exact error of a disc reader that stands somewhere on a pattern and reads once.

    Parameters
    ----------
    pattern
        A periodic pattern.
    radius_m
        Radius of the read disc.
    estimator
        ``"midrange"``: middle of the extreme tag places in x and in y of the pattern frame (han2006, Eq. 9-10);
        ``"centroid"``: mean of the tag places; ``"minimax"``: centre of the smallest circle round all places at
        which just these tags are read. The worst error of the last is the least that any estimator can have that
        knows the tags read and the pattern, and nothing else.

    Notes
    -----
    The circles of the radius about all tags are cut at their intersections (`layoutopt.circles.Arrangement`). On
    each face the estimate is constant, so the worst error lies at an end of an arc or at its farthest point, and
    the mean is a sum over arcs by Green's theorem.

    Raises
    ------
    ValueError
        If the pattern is laid once or has no tag, the radius is not positive and finite, or the estimator unknown.

    Examples
    --------
    >>> from layoutopt.patterns.square import square
    >>> error = static_error(square(pitch_m=1.0), 1.0)
    >>> round(error.worst_m, 4), round(error.mean_m, 4)
    (0.7071, 0.3231)
    """
    if estimator not in ESTIMATORS:
        raise ValueError(f"estimator is one of {', '.join(ESTIMATORS)}, not {estimator!r}")
    _check_periodic(pattern)
    if not 0.0 < radius_m < math.inf:
        raise ValueError(f"a read radius must be positive and finite, got {radius_m}")
    return _static_error(pattern, float(radius_m), estimator)


def check_half_gap(pattern: TagPattern, radius_m: float) -> HalfGapCheck:
    """Return the half-gap figures beside the true worst error of the midrange, which may exceed them.

    Raises
    ------
    ValueError
        Where the rule does not apply, or as `static_error`.
    """
    return HalfGapCheck(half_gap=half_gap_bound(pattern), worst_m=static_error(pattern, radius_m).worst_m)


def covering_radius(pattern: TagPattern) -> float:
    """Return the largest distance of any place from its nearest tag: a smaller disc leaves places without a tag.

    It is the largest distance of a corner of a Voronoi cell from its tags (Conway and Sloane, Sphere Packings,
    Lattices and Groups, Section 2.1.2).

    Raises
    ------
    ValueError
        If the pattern is laid once or has no tag.

    Examples
    --------
    >>> from layoutopt.patterns.square import square
    >>> round(covering_radius(square(pitch_m=1.0)), 4)
    0.7071
    """
    _check_periodic(pattern)
    return _covering_radius(pattern)


def covering_density(radius_m: float, k: int = 1) -> float:
    """Return how many tags per square metre any pattern needs at least, so that a disc always sees ``k`` of them.

    For one tag the equilateral lattice reaches it (Kershner, Amer. J. Math. 61, 1939: covering density
    2 pi / sqrt(27)); for more it is the bound of G. Fejes Toth (Acta Math. Acad. Sci. Hungar. 27, 1976) on k-fold
    coverings by equal discs, covering density (pi / 3) / sin(pi / 3k), which no pattern need reach.

    Raises
    ------
    ValueError
        If the radius is not positive and finite, or ``k`` is no whole number from 1 on.

    Examples
    --------
    >>> round(covering_density(0.1), 2)
    38.49
    """
    if not 0.0 < radius_m < math.inf:
        raise ValueError(f"a read radius must be positive and finite, got {radius_m}")
    if not (1 <= k < math.inf and k == int(k)):
        raise ValueError(f"a disc is to see at least one tag, and a whole number of them, got k = {k}")
    return 1.0 / (3.0 * radius_m**2 * math.sin(math.pi / (3.0 * k)))


def _check_periodic(pattern: TagPattern) -> None:
    if pattern.cell_m is None:
        raise ValueError("does not apply, because the pattern is laid once and has no period")
    if len(pattern.points_m) == 0:
        raise ValueError("does not apply, because the cell of the pattern is empty")


@lru_cache(maxsize=4096)
def _static_error(pattern: TagPattern, radius_m: float, estimator: str) -> StaticError:
    circles = _arrangement(pattern, radius_m)
    places = circles.centres() if estimator == "minimax" else circles.middles(centroid=estimator == "centroid")
    return StaticError(
        worst_m=circles.largest_distance_m(places),
        mean_m=circles.mean_distance_m(places),
        detection_probability=min(1.0, circles.covered_area_m2() / pattern.cell_area_m2),
    )


@lru_cache(maxsize=4)
def _arrangement(pattern: TagPattern, radius_m: float) -> Arrangement:
    assert pattern.cell_m is not None
    return arrangement(pattern.points_m, pattern.cell_m, radius_m)


@lru_cache(maxsize=1024)
def _covering_radius(pattern: TagPattern) -> float:
    from scipy.spatial import Voronoi, cKDTree

    assert pattern.cell_m is not None
    cell_m = reduced_cell(pattern.cell_m)
    corners_m = np.array([(0.0, 0.0), cell_m[0], cell_m[1], cell_m.sum(axis=0)])
    # A reduced lattice alone leaves no hole wider than its longer vector, so neighbours lie within two of them.
    reach_m = 2.0 * float(np.linalg.norm(cell_m, axis=1).max())
    low, high = corners_m.min(axis=0) - reach_m, corners_m.max(axis=0) + reach_m
    points_m = lattice_points(pattern.points_m, cell_m, (low[0], low[1], high[0], high[1]))
    corners = Voronoi(points_m).vertices
    steps = corners @ np.linalg.inv(cell_m)
    inside = corners[((steps > -0.01) & (steps < 1.01)).all(axis=1)]
    return float(np.max(cKDTree(points_m).query(inside)[0]))


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
        for prefix, pattern in layout.floor_tags.patterns():
            try:
                gap = half_gap_bound(pattern)
            except ValueError:
                continue  # an objective that does not apply gives no scores
            for name, value_m in (("published_half_gap", gap.published_m), ("derived_half_gap", gap.derived_m)):
                if value_m is not None:
                    scores[prefix + name] = Score(value=value_m, unit=CARD.scores[name])
        return scores
