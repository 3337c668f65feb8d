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
from itertools import pairwise
from typing import ClassVar, Final

import numpy as np

from layoutopt.circles import Arrangement, arrangement
from layoutopt.geometry import lattice_points, reduced_cell
from layoutopt.identity import by_content
from layoutopt.layout import Layout, TagPattern
from layoutopt.protocols import ObjectiveCard
from layoutopt.scenario import Scenario
from layoutopt.scores import SCORE_UNITS, Score, Scores, TrialOutcomes
from objectives.box_error import BoxError, box_error
from objectives.half_gap import HalfGap, half_gap_bound

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
    "half_gap_failures",
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
_HALVINGS: Final = 40
_PRINTED: Final = 1e-3
"""Half a unit of the third digit, relative to the number."""


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


def half_gap_failures(
    pattern: TagPattern, low_m: float, high_m: float, *, published: bool = True, steps: int = 400
) -> tuple[tuple[float, float], ...]:
    """Return the ranges of read radius in which a midrange reading errs by more than the half-gap rule says.

    Parameters
    ----------
    low_m, high_m
        Radii between which to look.
    published
        Whether the printed number counts, or what the rule gives.
    steps
        Radii that are tried; the ends of a range between two of them are then halved down to rounding. A range
        narrower than a step can be missed.

    Raises
    ------
    ValueError
        Where the rule does not apply or the paper prints nothing for the pattern, or as `static_error`.

    Examples
    --------
    >>> from layoutopt.patterns.triangular import triangular
    >>> [(round(a, 3), round(b, 3)) for a, b in half_gap_failures(triangular(pitch_m=1.0), 0.5, 3.0)]
    [(0.58, 0.653), (0.97, 1.124)]
    """
    if not 0.0 < low_m < high_m < math.inf:
        raise ValueError(f"radii must be positive and ascending, got {low_m} to {high_m}")

    def fails(radius_m: float) -> bool:
        check = check_half_gap(pattern, radius_m)
        holds = check.published_holds if published else check.derived_holds
        if holds is None:
            raise ValueError(f"does not apply, because han2006 prints no bound for {pattern.name!r} as it is here")
        return not holds

    def border_m(first_m: float, second_m: float) -> float:
        before = fails(first_m)
        for _ in range(_HALVINGS):
            middle_m = 0.5 * (first_m + second_m)
            first_m, second_m = (middle_m, second_m) if fails(middle_m) == before else (first_m, middle_m)
        return second_m if not before else first_m

    radii_m = np.linspace(low_m, high_m, steps).tolist()
    failing = [fails(radius_m) for radius_m in radii_m]
    begins, ends = [low_m] if failing[0] else [], list[float]()
    for place, (before, after) in enumerate(pairwise(failing)):
        if before != after:
            (ends if before else begins).append(border_m(radii_m[place], radii_m[place + 1]))
    return tuple(zip(begins, [*ends, *([high_m] if failing[-1] else [])], strict=True))


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
