"""Where a transponder is, from the bearings at all positions so far: a Bayes filter that expects wrong bearings.

Scattered waves turn bearings by tens of degrees, by another angle every half wavelength. A bearing is therefore
believed loosely, and with some probability it says nothing at all. Many of them from many places leave one region,
where three positions and their ranges (`direction_of_arrival.correct_direction`) leave almost everything open. No
range is used.
"""

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Final

import numpy as np
from numpy.typing import ArrayLike

from layoutopt.estimators.bearings import BearingKnowledge, BearingReadings, without_docking
from layoutopt.estimators.direction_of_arrival import finite
from layoutopt.geometry import covers
from layoutopt.identity import BoolArray, FloatArray, IntArray, by_content
from layoutopt.layout import Layout
from layoutopt.protocols import EstimatorCard

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

CARD: Final = EstimatorCard(
    summary="The bearing that all directions of arrival so far make likely; expects wrong ones.",
    reference="ours; Thrun and others, Probabilistic Robotics, Section 6.3 for the mixture",
    estimates="bearing",
    needs="direction",
)
_CANDIDATE_PITCH_M: Final = 0.2
"""Pitch of the filter's candidates: small against the distance at which docking ends."""
_MOST_CANDIDATES: Final = 4000
"""On larger floors the pitch grows, so that a step takes no longer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BearingBelief:
    """How much a bearing is believed.

    Attributes
    ----------
    spread_rad
        Standard deviation of a bearing that is turned by scattered waves in the usual way, rad.
    wrong_share
        Probability that a bearing says nothing.
    apart_m
        A bearing counts if the receiver moved this far since the last that counted, m: nearer ones share their
        error.

    Notes
    -----
    The defaults were chosen for the least mean error of the bearing, added up over five worlds: the paper's room
    with seven obstacles, blocking or not, and with nine of R = 0.65 that hide the direct wave, and a hall of 10 m
    by 8 m with ten scatterers, with and without walls that reflect (150 to 300 drives each, seeds of their own).
    The valley is flat: spreads of 20 to 40 degrees with shares of 0.3 to 0.5 differ by 6 %, and how far apart
    bearings count hardly matters. Where little scatters, a narrow spread with few wrong ones is better (by 1 to 2
    degrees in the hall), where much does a wide one.
    """

    spread_rad: float = math.radians(25.0)
    wrong_share: float = 0.4
    apart_m: float = 0.2

    def __post_init__(self) -> None:
        if not 0.0 < self.spread_rad < math.pi:
            raise ValueError(f"spread_rad is {self.spread_rad!r}, but lies between 0 and pi, both excluded")
        if not 0.0 < self.wrong_share < 1.0:
            raise ValueError(f"wrong_share is {self.wrong_share!r}, but lies between 0 and 1, both excluded")
        if not 0.0 <= self.apart_m < math.inf:
            raise ValueError(f"apart_m is {self.apart_m!r}, but is zero or positive and finite")

    def log_evidence(
        self, candidates_m: FloatArray, receiver_m: FloatArray, bearing_rad: FloatArray
    ) -> FloatArray:
        """Return the log-likelihood of each candidate after one bearing, up to a constant.

        The bearing is of von Mises' distribution about the true direction, mixed with a uniform one.

        Parameters
        ----------
        candidates_m
            Possible places of the transponder, shape (c, 2), m.
        receiver_m, bearing_rad
            Places of receivers, shape (n, 2), m, and their bearings in the floor frame, shape (n,).

        Returns
        -------
        numpy.ndarray
            Shape (n, c).

        References
        ----------
        Mardia and Jupp, Directional Statistics, Section 3.5; Thrun and others, Probabilistic Robotics, Section 6.3
        for the mixture.
        """
        # Imported here: it costs more than all the rest of a short command.
        from scipy.special import i0e

        away_x = candidates_m[:, 0] - receiver_m[:, None, 0]
        away_y = candidates_m[:, 1] - receiver_m[:, None, 1]
        # A candidate at the receiver has no direction; whatever it is told, it is as likely as any.
        far_m = np.maximum(np.hypot(away_x, away_y), np.finfo(float).tiny)
        cosine = (away_x * np.cos(bearing_rad)[:, None] + away_y * np.sin(bearing_rad)[:, None]) / far_m
        concentration = 1.0 / self.spread_rad**2
        peak = 1.0 / i0e(concentration)
        right = (1.0 - self.wrong_share) * peak * np.exp(concentration * (cosine - 1.0))
        return np.asarray(np.log(right + self.wrong_share))


def expected_bearing(candidates_m: FloatArray, log_weights: FloatArray, receiver_m: FloatArray) -> FloatArray:
    """Return the mean direction from each receiver to the candidates, rad, weighted by their probability.

    Parameters
    ----------
    candidates_m, log_weights
        Possible places, shape (c, 2), m, and the logarithms of their probabilities, shape (n, c).
    receiver_m
        Places of receivers, shape (n, 2), m.

    References
    ----------
    Mardia and Jupp, Directional Statistics, Section 2.2.
    """
    away_x = candidates_m[:, 0] - receiver_m[:, None, 0]
    away_y = candidates_m[:, 1] - receiver_m[:, None, 1]
    far_m = np.maximum(np.hypot(away_x, away_y), np.finfo(float).tiny)
    weights = np.exp(log_weights - log_weights.max(axis=1, keepdims=True)) / far_m
    return np.asarray(np.arctan2((weights * away_y).sum(axis=1), (weights * away_x).sum(axis=1)))


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FilteredBearing:
    """Follows the mean direction to where the transponder may be (`BearingFilter`); a row of the estimator table.

    Candidates lie on a lattice over the floor. A robot that hears nothing follows what it has heard before; one
    that has never heard anything keeps its heading.

    Attributes
    ----------
    belief
        How much a direction is believed.
    """

    belief: BearingBelief = field(default_factory=BearingBelief)
    key: str = field(init=False, repr=False, default="")
    card: ClassVar[EstimatorCard] = CARD

    def __post_init__(self) -> None:
        """Nothing to check: the belief has checked itself."""

    @property
    def name(self) -> str:
        """Name in the estimator table."""
        return "bearing_filter"

    def applies(self, layout: Layout) -> str:
        """Return why it cannot work with a layout, or an empty string."""
        return without_docking(layout)

    def start(self, knowledge: BearingKnowledge, drives: int) -> "FilterAtWork":
        """Return the estimator at work on so many drives."""
        return FilterAtWork(BearingFilter(candidates_on(knowledge.floor), drives, self.belief), drives)


class FilterAtWork:
    """A bearing filter that is fed by drives."""

    def __init__(self, bearing_filter: "BearingFilter", drives: int) -> None:
        self._filter = bearing_filter
        self._informed: BoolArray = np.zeros(drives, dtype=np.bool_)

    def step(self, readings: BearingReadings) -> FloatArray:
        """Take what was heard and return the bearings that all so far make likely, shape (n,), rad."""
        on, heard = readings.drives, readings.heard
        chosen = readings.headings_rad.copy()
        chosen[heard] = self._filter.step(on[heard], readings.places_m[heard], readings.bearings_rad[heard])
        self._informed[on[heard]] = True
        left = ~heard & self._informed[on]
        chosen[left] = self._filter.bearing(on[left], readings.places_m[left])
        return chosen


def candidates_on(floor: "BaseGeometry") -> FloatArray:
    """Return where on a floor the filter thinks that a transponder may be, evenly, shape (c, 2), m."""
    left, low, right, high = floor.bounds
    pitch_m = max(_CANDIDATE_PITCH_M, math.sqrt(floor.area / _MOST_CANDIDATES))
    axes = [
        np.linspace(begin, end, max(2, math.ceil((end - begin) / pitch_m) + 1))
        for begin, end in ((left, right), (low, high))
    ]
    places_m = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    return places_m[covers(floor, places_m)]


class BearingFilter:
    """The posterior of many drives at once, bearing by bearing.

    Parameters
    ----------
    candidates_m
        Possible places of the transponder, shape (c, 2), m, equally likely before the first bearing.
    drives
        Number of drives.
    belief
        How much a bearing is believed.

    Raises
    ------
    ValueError
        If there is no candidate or one is not finite.
    """

    def __init__(self, candidates_m: ArrayLike, drives: int, belief: BearingBelief | None = None) -> None:
        self.candidates_m = finite("candidates_m", candidates_m)
        if self.candidates_m.ndim != 2 or self.candidates_m.shape[1:] != (2,) or not len(self.candidates_m):
            raise ValueError(f"candidates_m needs rows of x and y, got shape {self.candidates_m.shape}")
        self._belief = BearingBelief() if belief is None else belief
        self.log_weights = np.zeros((drives, len(self.candidates_m)))
        self._counted_m = np.full((drives, 2), np.inf)

    def step(self, drives: IntArray, receiver_m: ArrayLike, bearing_rad: ArrayLike) -> FloatArray:
        """Take one bearing of each of some drives and return the bearing that all so far make likely, rad.

        Parameters
        ----------
        drives
            Numbers of the drives that go on, shape (n,).
        receiver_m, bearing_rad
            Their places, shape (n, 2), m, and bearings in the floor frame, shape (n,).

        Raises
        ------
        ValueError
            If a number is not finite.
        """
        places, bearings = finite("receiver_m", receiver_m), finite("bearing_rad", bearing_rad)
        moved = places - self._counted_m[drives]
        counts = np.hypot(moved[:, 0], moved[:, 1]) >= self._belief.apart_m
        counted = drives[counts]
        self.log_weights[counted] += self._belief.log_evidence(self.candidates_m, places[counts], bearings[counts])
        self._counted_m[counted] = places[counts]
        return self.bearing(drives, places)

    def bearing(self, drives: IntArray, receiver_m: FloatArray) -> FloatArray:
        """Return the bearing that all so far make likely without a new one, rad; arguments as in `step`."""
        return expected_bearing(self.candidates_m, self.log_weights[drives], receiver_m)
