"""Reader groups by convex optimisation: relaxation, rounding, exchange, and a bound that can be checked by hand.

Which n of m places to take is relaxed to shares between 0 and 1 that add up to n and keep the rows of the packing
(Joshi and Boyd, IEEE Trans. Signal Process. 57, 2009). The merit is concave in the shares, and what a filter keeps
is the largest M of a linear matrix inequality, so the relaxation is a semidefinite program:

    maximise    merit of M
    subject to  [[J(z) - M + A' M A, A' M], [M A, M + N^-1]] >= 0,

by the Schur complement of M <= J + A' M (I + N M)^-1 A, with the letters of `solvers.information`.

The bound does not rest on the solver's word. A concave f lies below its tangents, f(z) <= f(z0) + g (z - z0) with
g the gradient at any z0; and a linear function over the relaxed groups is bounded by any point of the dual
program.
Both are computed here in plain numpy; a bad z0 or a bad dual point makes the bound loose, never wrong.
"""

import math
import warnings
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.result import Status
from solvers.antenna_slots import Packing, ReaderSlots, arranged, most_that_fit, packing_of
from solvers.exchange import best_group
from solvers.information import Merit, kept_information, pose_information

PROVEN_GAP: Final = 1e-6
"""A group within this of its bound is called optimal; in efficiency a millionth."""
_SOLVER: Final = "CLARABEL"
_STARTS: Final = 12
"""Random roundings beside the largest shares."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GroupChoice:
    """The group that was chosen, and what is known of it.

    Attributes
    ----------
    chosen
        Indices of places in the order in which the antennas are to be listed; empty without a group.
    value, bound
        Merit of the group, and a proven upper bound on that of every group, as `solvers.information.Merit`.
    relaxed
        Merit of the relaxed shares as the solver gave them.
    shares
        These shares, one for each place.
    status
        ``OPTIMAL`` if value and bound meet, ``SEARCHED`` if not, ``INFEASIBLE`` if it is proven that so many do
        not fit, ``STOPPED_BY_LIMIT`` if that was not decided.
    message
        A sentence where there is something to be said: no group, or no solution of the relaxation.
    """

    chosen: tuple[int, ...]
    value: float
    bound: float
    relaxed: float
    shares: tuple[float, ...]
    status: Status
    message: str = ""

    @property
    def gap(self) -> float:
        """Bound less value, in natural logarithms; never below zero."""
        return max(self.bound - self.value, 0.0) if self.chosen else math.inf

    @property
    def efficiency(self) -> float:
        """D- or A-efficiency of the group beside the best that the bound allows, at least; between 0 and 1."""
        return math.exp(-self.gap)


def choose_group(
    slots: ReaderSlots, count: int, density_per_m2: float, merit: Merit, *, seed: int = 0, solver: str = _SOLVER
) -> GroupChoice:
    """Return the group of ``count`` antennas that exchanges reach from the rounded relaxation.

    Parameters
    ----------
    density_per_m2
        Tags on the floor.
    seed
        Of the random roundings: the same seed gives the same group.
    solver
        Name by which cvxpy knows the solver of the relaxation.

    Raises
    ------
    ValueError
        If the count or the density is not positive.
    """
    packing = packing_of(slots, count)
    information = pose_information(slots.xy_m, slots.radius_m, density_per_m2)
    most = largest_sum(np.ones(len(slots)), packing)
    if most < count - 1e-6:
        return _none(_most_text(slots, packing), Status.INFEASIBLE)
    shares, message = relaxed_shares(information, packing, merit, solver=solver)
    start = np.full(len(slots), count / len(slots)) if shares is None else shares
    found = best_group(start, information, slots, packing, merit, starts=_STARTS, seed=seed)
    if found is None:
        if most_that_fit(slots, packing).bound < count:
            return _none(_most_text(slots, packing), Status.INFEASIBLE)
        return _none(
            f"no group of {count} antennas was found whose scan slots keep the profile's distances; that there is "
            "none is not proven",
            Status.STOPPED_BY_LIMIT,
        )
    group, value = found
    order = arranged(slots, packing, group)
    assert order is not None
    # Without shares the tangent at the group itself gives a bound, though a loose one.
    at = shares if shares is not None else np.isin(np.arange(len(slots)), group).astype(np.float64)
    bound = upper_bound(at, information, packing, merit)
    return GroupChoice(
        chosen=order,
        value=value,
        bound=bound,
        relaxed=float(merit(np.tensordot(at, information, 1))) if shares is not None else math.nan,
        shares=() if shares is None else tuple(shares.tolist()),
        status=Status.OPTIMAL if bound - value <= PROVEN_GAP else Status.SEARCHED,
        message=message,
    )


def relaxed_shares(
    information: FloatArray, packing: Packing, merit: Merit, *, solver: str = _SOLVER
) -> tuple[FloatArray | None, str]:
    """Return the best shares of the places, shape (m,), or ``None`` and a sentence that says why there are none.

    ``information`` is that of one look at each place, shape (m, 3, 3).
    """
    try:
        import cvxpy
    except ImportError as error:
        return None, f"the relaxation was not solved, because cvxpy cannot be imported ({error}); bound is loose"
    convex: Any = cvxpy  # its types leave out most of what it has
    # In coordinates in which equal shares keep the identity: metres and radians are far apart.
    equal = np.tensordot(np.full(len(information), packing.count / len(information)), information, 1)
    turn = np.linalg.inv(np.linalg.cholesky(kept_information(equal, merit.drift)))
    back = np.linalg.solve(turn.T, merit.drift.backwards @ turn.T)
    inverse = turn @ np.linalg.inv(merit.drift.loss) @ turn.T
    columns = (turn @ information @ turn.T).reshape(len(information), 9).T
    share = convex.Variable(len(information))
    kept = convex.Variable((3, 3), symmetric=True)
    look = convex.reshape(columns @ share, (3, 3), order="C")
    inequality = convex.bmat([[look - kept + back.T @ kept @ back, back.T @ kept], [kept @ back, kept + inverse]])
    limits = [inequality >> 0, share >= 0.0, share <= 1.0, convex.sum(share) == float(packing.count)]
    if len(packing.rows):
        limits.append(packing.rows @ share <= packing.limits)
    if merit.criterion == "D":
        # det^(1/3) instead of its logarithm: symmetric cones alone, on which the solver fails less often.
        lower = convex.Variable((3, 3))
        corner = convex.diag(lower)
        limits += [convex.upper_tri(lower) == 0.0]
        limits += [convex.bmat([[kept, lower], [lower.T, convex.diag(corner)]]) >> 0]
        goal = convex.Maximize(convex.geo_mean(corner))
    else:
        # tr(W M^-1) with W = R' R is the trace of the inverse of R^-T M R^-1.
        root = np.sqrt(merit.weight) @ turn.T
        root = np.linalg.inv(root / math.sqrt(float(np.trace(root @ root.T))))
        goal = convex.Minimize(convex.tr_inv(root.T @ kept @ root))
    problem = convex.Problem(goal, limits)
    try:
        with warnings.catch_warnings():
            # That a solution is inaccurate is seen from the bound, which does not trust it.
            warnings.simplefilter("ignore")
            problem.solve(solver=solver)
    except (cvxpy.error.SolverError, ArithmeticError, ValueError) as error:
        return None, f"the relaxation was not solved: {error}; the bound is the tangent's at the group and loose"
    if share.value is None or not np.isfinite(share.value).all():
        return None, f"the relaxation was not solved: {solver} says {problem.status}; the bound is loose"
    return np.clip(np.asarray(share.value, dtype=np.float64), 0.0, 1.0), ""


def upper_bound(shares: FloatArray, information: FloatArray, packing: Packing, merit: Merit) -> float:
    """Return a bound on the merit of every group, from the tangent at any shares, shape (m,)."""
    look = np.tensordot(shares, information, 1)
    gradient = np.einsum("ij,nij->n", merit.slope(look), information)
    return float(merit(look)) - float(gradient @ shares) + largest_sum(gradient, packing)


def largest_sum(gain: FloatArray, packing: Packing) -> float:
    """Return an upper bound on the sum of gains, shape (m,), over all relaxed groups of at most that count.

    It is the value of a point of the dual program, n mu + limits nu + sum of max(0, gain - mu - rows' nu):
    whatever mu >= 0 and nu >= 0, no group has more.
    """
    from scipy.optimize import linprog

    count = float(packing.count)
    rows = np.concatenate([np.ones((1, len(gain))), packing.rows])
    limits = np.concatenate([[count], packing.limits])
    size = float(np.abs(gain).max(initial=0.0)) or 1.0
    found = linprog(-gain / size, A_ub=rows, b_ub=limits, bounds=(0.0, 1.0), method="highs")
    # Without the program's prices, that of the last place taken: valid as well, but blind to the rows.
    prices = np.zeros(len(limits))
    prices[0] = max(float(np.sort(gain)[::-1][min(packing.count, len(gain)) - 1]), 0.0)
    points = [prices]
    if found.success:
        points.append(np.maximum(-found.ineqlin.marginals, 0.0) * size)
    return min(dual_value(gain, rows, limits, point) for point in points)


def dual_value(gain: FloatArray, rows: FloatArray, limits: FloatArray, prices: FloatArray) -> float:
    """Return the dual value of prices of the rows, shape (k,), none below zero: no relaxed group has more."""
    return float(limits @ prices + np.maximum(gain - rows.T @ prices, 0.0).sum())


def _none(message: str, status: Status) -> GroupChoice:
    return GroupChoice(
        chosen=(), value=-math.inf, bound=math.inf, relaxed=math.nan, shares=(), status=status, message=message
    )


def _most_text(slots: ReaderSlots, packing: Packing) -> str:
    most = most_that_fit(slots, packing).bound
    return (
        f"{packing.count} antennas of {1000.0 * slots.side_m:g} mm do not fit at the profile's distances: at most "
        f"{most} do, among {len(slots)} places, by the bound of an integer program"
    )
