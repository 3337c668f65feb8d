"""How much the antennas under a robot tell of its pose, and how much of that a filter keeps on a drive.

One look of one antenna at a floor with tags at random places, of which the map is known:

Reads
    A tag that is read lies somewhere in the disc of radius r about the antenna's centre, so that centre is uniform
    in the disc about the tag, with the variance r² / 4 along each axis. A Gaussian of that variance has the
    information 4 / r²; of density rho, pi r² rho tags are read on average. The product, 4 pi rho, does not depend
    on the radius.
Edge
    If a tag at the distance d is read with the chance p = 1 / (1 + exp((d - r) / s)), a logistic edge of scale s,
    then reads and silences together have the Fisher information p'² / (p (1 - p)) along the line to each tag. Over
    all tags of the plane that is pi rho ln(1 + exp(r / s)) along each axis, exactly. The reads above are worth an
    edge of r / 4.

Both are isotropic, so the heading does not enter. With the centre at a = (a_x, a_y) in ``base_link``, a small
change of pose (forward, left, turn) moves it by G = [I, (-a_y, a_x)], seen from the robot: the information of the
pose is G' G times that of the place. That of several antennas adds up: given the map and the pose, reads of one
tag by two antennas are independent, even where their discs overlap.

On a drive the odometry loses a part between two looks. The information M after a look is the fixed point of

    M = A' M (I + N M)^-1 A + J,    A = F^-1,    N = F^-1 Q F^-T,

the Riccati equation of the Kalman filter in information form (Anderson and Moore, Optimal Filtering, 1979,
Chapters 4.4 and 6.3), with the covariance Q of the drift and F, by which an error of heading becomes one to the
side. The prior of a look is what the odometry left of the looks before it: it has not to be chosen, and one
antenna has a finite answer. Begun at M = J, each step is monotone and concave in J, as the parallel sum is
(Anderson and Duffin, J. Math. Anal. Appl. 26, 1969), and so is the fixed point: what is concave and monotone in M
is so in J.

The model does not have: looks at which no antenna sees a tag and looks that see several (the information is that
of the mean look), tags of one lattice that several antennas meet in step, hard discs, which intersect faster than
Gaussians, and turns of the robot.
"""

import math
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray, by_content, read_only
from layoutopt.robot import Odometry

CRITERIA: Final = ("D", "A")
LEAST_DRIFT: Final = 1e-5
"""Least deviation of a drift, m and rad: without any error nothing is left to be told, and no fixed point is."""
_DOUBLINGS: Final = 60
_CONVERGED: Final = 1e-14


def place_information(radius_m: float, density_per_m2: float, edge_m: float | None = None) -> float:
    """Return the information of one look of one antenna about its own place, along each axis, 1/m².

    Parameters
    ----------
    edge_m
        Scale of the logistic edge of the disc; without it only what a read says is counted.

    Raises
    ------
    ValueError
        If a number is not positive.

    Examples
    --------
    >>> round(place_information(0.03, 100.0) / math.pi, 6)
    400.0
    """
    numbers = (radius_m, density_per_m2, *([] if edge_m is None else [edge_m]))
    if not all(0.0 < number < math.inf for number in numbers):
        raise ValueError(f"radius, density and edge must be positive and finite, got {numbers}")
    if edge_m is None:
        return math.pi * radius_m**2 * density_per_m2 * 4.0 / radius_m**2
    return math.pi * density_per_m2 * float(np.logaddexp(0.0, radius_m / edge_m))


def pose_information(
    xy_m: FloatArray, radius_m: float, density_per_m2: float, *, edge_m: float | None = None
) -> FloatArray:
    """Return the information of one look of each antenna about (forward, left, turn), shape (n, 3, 3).

    ``xy_m`` are the antennas in ``base_link``, shape (n, 2), m; units of the result are 1/m², 1/(m rad), 1/rad².

    Raises
    ------
    ValueError
        As `place_information`.
    """
    xy_m = np.asarray(xy_m, dtype=np.float64).reshape(-1, 2)
    moved = np.zeros((len(xy_m), 2, 3))
    moved[:, 0, 0] = moved[:, 1, 1] = 1.0
    moved[:, 0, 2], moved[:, 1, 2] = -xy_m[:, 1], xy_m[:, 0]
    return np.asarray(place_information(radius_m, density_per_m2, edge_m) * np.swapaxes(moved, 1, 2) @ moved)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PoseDrift:
    """What the odometry adds between two looks, ``way_m`` of straight way apart.

    ``covariance`` is that of (forward, left, turn), shape (3, 3), m², m rad and rad².

    Raises
    ------
    ValueError
        If the way is not positive, because a heading would not show, or the covariance not positive definite.
    """

    way_m: float
    covariance: FloatArray
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        """Freeze and check the covariance."""
        object.__setattr__(self, "covariance", read_only(self.covariance, (3, 3)))
        if not 0.0 < self.way_m < math.inf:
            raise ValueError(f"a way between looks must be positive and finite, got {self.way_m}")
        if not np.linalg.eigvalsh(self.covariance).min() > 0.0:
            raise ValueError("the covariance of a drift must be positive definite")

    @property
    def backwards(self) -> FloatArray:
        """The matrix A, shape (3, 3), that takes an error after the way to the one before it."""
        back = np.eye(3)
        back[1, 2] = -self.way_m
        return back

    @property
    def loss(self) -> FloatArray:
        """The matrix N, shape (3, 3): the covariance of the drift, taken back to the look before."""
        back = self.backwards
        return back @ self.covariance @ back.T


def drift_of(odometry: Odometry, way_m: float, speed_m_s: float) -> PoseDrift:
    """Return the drift on ``way_m`` of straight way; deviations below `LEAST_DRIFT` are taken as that."""
    sigma = odometry.sigma(np.array([(way_m, 0.0, 0.0)]), way_m / speed_m_s)[0]
    return PoseDrift(way_m=way_m, covariance=np.diag(np.maximum(sigma, LEAST_DRIFT) ** 2))


def kept_information(information: FloatArray, drift: PoseDrift) -> FloatArray:
    """Return the information after each look of an endless drive, shape (..., 3, 3), for that of one look.

    References
    ----------
    Chu, Fan, Lin and Wang, Int. J. Control 77, 2004 (structure-preserving doubling).
    """
    kept = np.asarray(information, dtype=np.float64)
    back, loss, eye = drift.backwards, drift.loss, np.eye(3)
    for _ in range(_DOUBLINGS):
        inverse = np.linalg.inv(eye + loss @ kept)
        through = inverse @ back
        gained = np.swapaxes(back, -1, -2) @ kept @ through
        loss = loss + back @ inverse @ loss @ np.swapaxes(back, -1, -2)
        back = back @ through
        kept = kept + (gained + np.swapaxes(gained, -1, -2)) / 2.0
        if (np.abs(gained).max(axis=(-1, -2)) <= _CONVERGED * np.abs(kept).max(axis=(-1, -2))).all():
            break
    return kept


@dataclass(frozen=True, slots=True, kw_only=True)
class Merit:
    """What is to be maximised, a concave function of the information of one look, in natural logarithms.

    ``"D"`` is a third of log det M; exp of a difference is the ratio of two standard deviations' variances, the
    D-efficiency. ``"A"`` is -log of the mean square error, m², of a point of the robot ``lever_m`` from
    ``base_link``, averaged over its direction: tr cov(x, y) + lever² var(turn); the harmonic mean is concave, and
    so is its logarithm (Boyd and Vandenberghe, Convex Optimization, 2004, Sections 3.1.5, 3.2.4, 7.5).

    Raises
    ------
    ValueError
        If the criterion is neither, or the lever is not positive.
    """

    criterion: str
    drift: PoseDrift
    lever_m: float

    def __post_init__(self) -> None:
        """Check the criterion and the lever."""
        if self.criterion not in CRITERIA:
            raise ValueError(f"a criterion is one of {', '.join(CRITERIA)}, got {self.criterion!r}")
        if not 0.0 < self.lever_m < math.inf:
            raise ValueError(f"a lever must be positive and finite, got {self.lever_m}")

    @property
    def weight(self) -> FloatArray:
        """Weights of the variances in the mean square error, shape (3, 3)."""
        return np.diag([1.0, 1.0, self.lever_m**2])

    def __call__(self, information: FloatArray) -> FloatArray:
        """Return the merit, shape (...,), of the information of one look, shape (..., 3, 3); -inf if singular."""
        kept = kept_information(information, self.drift)
        sign, log_det = np.linalg.slogdet(kept)
        if self.criterion == "D":
            return np.asarray(np.where(sign > 0.0, log_det, -np.inf) / 3.0)
        known = sign > 0.0
        safe = np.where(known[..., None, None], kept, np.eye(3))
        error_m2 = np.einsum("ij,...ji->...", self.weight, np.linalg.inv(safe))
        return np.asarray(np.where(known, -np.log(error_m2), -np.inf))

    def slope(self, information: FloatArray) -> FloatArray:
        """Return the gradient, shape (3, 3), at the information of one look, shape (3, 3).

        A change dJ changes M by dM = S' dM S + dJ with S = (I + N M)^-1 A, so the gradient Y solves
        Y = Y_0 + S Y S', where Y_0 is that with respect to M.
        """
        from scipy.linalg import solve_discrete_lyapunov

        kept = kept_information(information, self.drift)
        covariance = np.linalg.inv(kept)
        if self.criterion == "D":
            direct = covariance / 3.0
        else:
            direct = covariance @ self.weight @ covariance / float(np.trace(self.weight @ covariance))
        step = np.linalg.solve(np.eye(3) + self.drift.loss @ kept, self.drift.backwards)
        # In units in which the direct part is about one, so that no digits are lost to metres and radians.
        unit = np.sqrt(np.diag(direct))
        scaled = solve_discrete_lyapunov(step / unit[:, None] * unit, direct / np.outer(unit, unit))
        found = np.asarray(scaled) * np.outer(unit, unit)
        return np.asarray((found + found.T) / 2.0)
