"""Crossing-time localisation by least squares over all crossings of a leg, started on every mirror branch.

What kim2010 leaves on the table: each crossing there is used alone, the place at which a leg begins is believed as
it is, and a wrong branch stays wrong. Here a leg is a straight line with four unknowns (place of its begin, speed,
direction), each with what is known of it before, and every edge crossed is one equation.
"""

import math
from dataclasses import dataclass, field
from typing import ClassVar, Final

import numpy as np

from layoutopt.estimators.crossing_time import LegFit, RunningCrossingTime, without_one_antenna
from layoutopt.estimators.crossing_velocity import velocity
from layoutopt.estimators.step_by_step import step_by_step
from layoutopt.estimators.straight_legs import Crossing, Leg
from layoutopt.geometry import wrapped
from layoutopt.identity import FloatArray, by_content
from layoutopt.layout import Layout
from layoutopt.protocols import EstimatorCard, FloorKnowledge
from layoutopt.readings import Motion, Observations, Prior, Trajectory

CARD: Final = EstimatorCard(
    summary="Least squares over all crossings of a straight leg, from every mirror branch; the wheels as clock.",
    reference="own, after kim2010, Eq. 1-6",
    estimates="robot",
    needs="tag_read",
)
CLOCKS: Final = ("wheels", "time")
_LATEST: Final = 20
"""Crossings of one leg that are fitted; older ones add little."""
_ITERATIONS: Final = 8
_DONE: Final = 1e-7
_LEAST_RAD2: Final = 1e-8
_BOUNDS_M2: Final = (1e-10, 1e6)
"""Least and largest variance of a place in any direction: equations stay solvable where it is known exactly."""
_ROBUST: Final = 3.0
"""Residuals beyond so many deviations count less and less (Cauchy's weight): scans miss, tags die."""


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CrossingTimeBranches:
    """Crossing times by least squares over branches.

    The leg is fitted anew at each crossing: once from what was believed, once from each mirror branch of the
    newest crossing, and the best fit is kept. Its covariance goes into the next leg.

    Attributes
    ----------
    clock
        What passes along a leg. ``"wheels"``: their way, so that the robot may speed up and stop. ``"time"``:
        steps, for a robot at constant speed, as kim2010 assumes; then the wheels' noise does not count.
    scale_sigma
        Standard deviation of the scale of the wheels, by which a fit may differ from them.
    edge_sigma_m
        Standard deviation of the edge of a read disc, beside that of its time.

    Raises
    ------
    ValueError
        If the clock is unknown, or a deviation is not positive and finite.
    """

    clock: str = "wheels"
    scale_sigma: float = 0.03
    edge_sigma_m: float = 0.003
    key: str = field(init=False, repr=False, default="")
    card: ClassVar[EstimatorCard] = CARD

    def __post_init__(self) -> None:
        """Check the settings."""
        if self.clock not in CLOCKS:
            raise ValueError(f"clock is one of {', '.join(CLOCKS)}, not {self.clock!r}")
        for name in ("scale_sigma", "edge_sigma_m"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be positive and finite, got {getattr(self, name)}")

    @property
    def name(self) -> str:
        """Name in the estimator table."""
        return "crossing_time_branches"

    def applies(self, layout: Layout) -> str:
        """Return why crossing times cannot localise a layout's robot, or an empty string."""
        return without_one_antenna(layout)

    def start(
        self, prior: Prior, knowledge: FloorKnowledge, draws: np.random.Generator
    ) -> "RunningCrossingTimeBranches":
        """Return the estimator at work, step by step."""
        return RunningCrossingTimeBranches(self, prior, knowledge)

    def run(
        self, prior: Prior, knowledge: FloorKnowledge, observations: Observations, draws: np.random.Generator
    ) -> Trajectory:
        """Return the estimates of a whole drive, step by step."""
        return step_by_step(self.start(prior, knowledge, draws), observations)


class RunningCrossingTimeBranches(RunningCrossingTime):
    """The estimator at work: place and heading as in crossing-time localisation, legs by least squares."""

    def __init__(self, settings: CrossingTimeBranches, prior: Prior, knowledge: FloorKnowledge) -> None:
        super().__init__(prior, knowledge, by_way=settings.clock == "wheels")
        self._settings = settings
        known = math.isfinite(prior.sigma_m) and math.isfinite(prior.sigma_rad)
        # Of x and y of the antenna, and of the heading, where the leg begins.
        self._place_m2 = np.eye(2) * (prior.sigma_m**2 if known else 1.0)
        self._heading_rad2 = prior.sigma_rad**2 if known else 1.0

    def fitted(self, leg: Leg, number: int) -> LegFit | None:
        """Return the best straight leg through all that is known of it."""
        crossings = leg.crossings[max(0, number + 1 - _LATEST) : number + 1]
        before = self._before(leg)
        guesses = [LegFit(at_m=before.start_m, speed=before.speed, direction_rad=before.direction_rad)]
        guesses += self._branches(crossings[-1], before)
        if self.fit is not None:
            guesses.append(self.fit)
        return self._best(guesses, before, leg, crossings)

    def started(self, leg: Leg, fit: LegFit) -> LegFit:
        """Return the first leg from an unknown start, fitted to all crossings, of which it has nothing before."""
        before = _Before(
            start_m=fit.place_m(0.0),
            start=np.zeros((2, 2)),
            speed=self._speed(leg)[0],
            speed_information=self._speed(leg)[1],
            direction_rad=fit.direction_rad,
            direction_information=0.0,
        )
        return self._best([fit], before, leg, leg.crossings) or fit

    def _speed(self, leg: Leg) -> tuple[float, float]:
        """Return the speed on the leg's clock by odometry, and its information."""
        way_m = math.hypot(*leg.displacement_m)
        wander_m2 = 0.0 if self._settings.clock == "wheels" else leg.variance_m2
        speed = way_m / leg.clock
        return speed, 1.0 / ((self._settings.scale_sigma * speed) ** 2 + wander_m2 / leg.clock**2)

    def _before(self, leg: Leg) -> "_Before":
        """Return what is known of the leg before any crossing."""
        return _Before(
            start_m=self.begun_at_m(),
            start=_information(self._place_m2),
            speed=self._speed(leg)[0],
            speed_information=self._speed(leg)[1],
            direction_rad=self.reference_rad(leg),
            direction_information=1.0 / (self._heading_rad2 + _LEAST_RAD2),
        )

    def _branches(self, crossing: Crossing, before: "_Before") -> list[LegFit]:
        """Return the legs on either mirror branch of one crossing, from the place that was believed."""
        to_tag_m = crossing.tag_m - before.start_m
        found = velocity(math.hypot(*to_tag_m), self.radius_m, crossing.entered, crossing.left - crossing.entered)
        line_rad = math.atan2(to_tag_m[1], to_tag_m[0])
        return [
            LegFit(at_m=before.start_m, speed=found.speed_m_s, direction_rad=line_rad + heading)
            for heading in found.headings_rad
        ]

    def _best(
        self, guesses: list[LegFit], before: "_Before", leg: Leg, crossings: list[Crossing]
    ) -> LegFit | None:
        """Return the fit with the least cost from several guesses; ``None`` if none has a solution."""
        now = crossings[-1].left
        edges = _Edges(
            tag_m=np.repeat([crossing.tag_m for crossing in crossings], 2, axis=0),
            since=np.array([clock for item in crossings for clock in (item.entered, item.left)]) - now,
            sigma_m=np.hypot(
                before.speed * np.repeat([item.sigma for item in crossings], 2), self._settings.edge_sigma_m
            ),
            radius_m=self.radius_m,
            wander_m=leg.variance_m2 / leg.clock if self._settings.clock == "wheels" else 0.0,
        )
        starts = [np.array([*guess.place_m(now), guess.speed, guess.direction_rad]) for guess in guesses]
        fits = [_descended(start, before, edges, now) for start in starts]
        cost, best, normal = min(fits, key=lambda fit: fit[0])
        if not math.isfinite(cost):
            return None
        return LegFit(
            at_m=best[:2],
            speed=float(best[2]),
            direction_rad=float(best[3]),
            at_clock=now,
            covariance=np.asarray(np.linalg.pinv(normal, hermitian=True), dtype=np.float64),
        )

    def end(self, leg: Leg, motion: Motion) -> None:
        """Carry the covariance over a leg and the step after it."""
        heading_rad2 = self._heading_rad2 + leg.variance_rad2
        if self.fit is not None and self.fit.covariance is not None:
            cos, sin = math.cos(self.fit.direction_rad), math.sin(self.fit.direction_rad)
            since = leg.clock - self.fit.at_clock
            way_m = self.fit.speed * since
            slopes = np.array([[1.0, 0.0, since * cos, -way_m * sin], [0.0, 1.0, since * sin, way_m * cos]])
            wander_m2 = leg.variance_m2 * since / leg.clock if self._settings.clock == "wheels" else 0.0
            self._place_m2 = slopes @ self.fit.covariance @ slopes.T + np.eye(2) * wander_m2
            heading_rad2 = float(self.fit.covariance[3, 3])
        else:
            way_m2 = float(leg.displacement_m @ leg.displacement_m)
            along_m2 = self._settings.scale_sigma**2 * way_m2 + leg.variance_m2
            across_m2 = (self._heading_rad2 + leg.variance_rad2) * way_m2
            self._place_m2 = self._place_m2 + np.eye(2) * (along_m2 + across_m2)
        self._heading_rad2 = heading_rad2 + motion.sigma[2] ** 2
        if not self._known:
            # Which of two mirror images this is may change, and with it the axes.
            self._place_m2 = np.eye(2) * float(np.trace(self._place_m2))
        # The step in between may be partly on the old way and partly on the new one.
        step_m2 = motion.sigma[0] ** 2 + math.hypot(motion.forward_m, motion.left_m) ** 2 / 12.0
        self._place_m2 = self._place_m2 + np.eye(2) * step_m2
        super().end(leg, motion)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Before:
    """What is known of a leg before its crossings: values, and their information (inverse variances)."""

    start_m: FloatArray
    start: FloatArray
    speed: float
    speed_information: float
    direction_rad: float
    direction_information: float


@dataclass(frozen=True, slots=True, kw_only=True)
class _Edges:
    """Edges crossed, shape (n, ...): tag, clock since the latest, deviation; ``wander_m`` is m² a metre of way."""

    tag_m: FloatArray
    since: FloatArray
    sigma_m: FloatArray
    radius_m: float
    wander_m: float


def _descended(
    start: FloatArray, before: _Before, edges: _Edges, now: float
) -> tuple[float, FloatArray, FloatArray]:
    """Return cost, (x, y, speed, direction) at the latest edge, and normal matrix, by Gauss and Newton's steps.

    Older edges lie the more uncertain along the way the more the wheels have wandered since; so does the begin of
    the leg. Residuals have Cauchy's weights.
    """
    place, normal, cost = start.copy(), np.eye(4), math.inf
    for _ in range(_ITERATIONS):
        unit = np.array([math.cos(place[3]), math.sin(place[3])])
        left = np.array([-unit[1], unit[0]])
        away_m = place[:2] + np.outer(place[2] * edges.since, unit) - edges.tag_m
        distance_m = np.maximum(np.hypot(away_m[:, 0], away_m[:, 1]), 1e-9)
        outward = away_m / distance_m[:, None]
        along, across = outward @ unit, outward @ left
        sigma_m = np.sqrt(edges.sigma_m**2 + along**2 * edges.wander_m * np.abs(edges.since))
        residual = (distance_m - edges.radius_m) / sigma_m
        slopes = (
            np.column_stack([outward, edges.since * along, place[2] * edges.since * across]) / sigma_m[:, None]
        )
        weight = 1.0 / (1.0 + (residual / _ROBUST) ** 2)
        normal = (slopes * weight[:, None]).T @ slopes
        pull = slopes.T @ (weight * residual)
        cost = _ROBUST**2 * float(np.log1p((residual / _ROBUST) ** 2).sum())
        # The begin of the leg, seen from here.
        off_m = place[:2] - place[2] * now * unit - before.start_m
        back = np.column_stack([np.eye(2), -now * unit, -place[2] * now * left])
        information = _widened(before.start, edges.wander_m * now, unit)
        normal += back.T @ information @ back
        pull += back.T @ information @ off_m
        turn_rad = float(wrapped(place[3] - before.direction_rad))
        off = np.array([place[2] - before.speed, turn_rad])
        own = np.array([before.speed_information, before.direction_information])
        normal[2, 2] += own[0]
        normal[3, 3] += own[1]
        pull[2:] += own * off
        cost += float(off_m @ information @ off_m) + float(own @ off**2)
        step = np.linalg.lstsq(normal, -pull, rcond=1e-12)[0]
        place = place + step
        if float(np.abs(step).max()) < _DONE:
            break
    return (cost if np.isfinite(place).all() else math.inf), place, normal


def _information(covariance_m2: FloatArray) -> FloatArray:
    """Return the inverse of the covariance of a place, its variances kept within bounds."""
    if not np.isfinite(covariance_m2).all():
        return np.zeros((2, 2))
    variances_m2, axes = np.linalg.eigh(covariance_m2)
    return np.asarray((axes / np.clip(variances_m2, *_BOUNDS_M2)) @ axes.T)


def _widened(information: FloatArray, variance: float, unit: FloatArray) -> FloatArray:
    """Return the information of a place that is uncertain by a further variance along a direction."""
    along = information @ unit
    # Sherman and Morrison's formula.
    return np.asarray(information - variance * np.outer(along, along) / (1.0 + variance * float(unit @ along)))
