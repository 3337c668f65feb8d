"""Optimisers of scipy that ask instead of calling: run again from the start on what is known already.

scipy's optimisers call their function and cannot be stopped and taken up again. But each is a pure function of its
settings and of the values it is given. So it is run from its beginning, its function looks values up, and the
first points of which no value is known end the run: these are the points to be evaluated next. Once they are known
the run is repeated and comes farther. What is asked for next follows from the settings and the known values alone,
so a search that was killed goes on where it stopped, and the number of workers changes nothing.

The optimiser itself takes milliseconds, a simulated value takes seconds; running it again costs next to nothing.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from layoutopt.identity import FloatArray

Function = Callable[[FloatArray], FloatArray]
"""From points, shape (n, d), in the unit cube to values, shape (n,)."""


class _UnknownValues(Exception):
    """Ends a run at points, shape (n, d), whose values are not known."""

    def __init__(self, points: FloatArray) -> None:
        self.points = points
        super().__init__(f"{len(points)} values are not known")


class Method(Protocol):
    """An optimiser over the unit cube: a frozen value that holds its settings."""

    def run(self, function: Function, dimensions: int) -> tuple[FloatArray, float]:
        """Return the best point, shape (d,), and its value."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """What a run came to: ``points`` to evaluate, shape (n, d), or none and the ``best`` point with its value."""

    points: FloatArray
    best: FloatArray | None = None
    value: float = np.nan


def asked(method: Method, lookup: Function, dimensions: int) -> Asked:
    """Return what a method wants evaluated next, or its answer.

    Parameters
    ----------
    lookup
        Gives NaN for a point whose value is not known; a pure function.
    dimensions
        Number of coordinates, at least 1.
    """

    def known(points: FloatArray) -> FloatArray:
        values = lookup(points)
        unknown = np.isnan(values)
        if unknown.any():
            raise _UnknownValues(points[unknown])
        return values

    try:
        best, value = method.run(known, dimensions)
    except _UnknownValues as ended:
        return Asked(points=ended.points)
    return Asked(points=np.empty((0, dimensions)), best=best, value=value)


@dataclass(frozen=True, slots=True, kw_only=True)
class DifferentialEvolution:
    """Differential evolution that asks for a generation at a time; its settings are the defaults of scipy.

    Parameters
    ----------
    population, generations
        Points of a generation, and generations after the first, which is a Latin hypercube.
    seed
        Of the first generation and of all mutations.
    starts
        Points that take the first places of the first generation, such as layouts that are known to be good.

    References
    ----------
    Storn and Price, J. Global Optim. 11, 1997; Latin hypercube: McKay, Beckman and Conover, Technometrics 21,
    1979.
    """

    population: int
    generations: int
    seed: int
    starts: tuple[tuple[float, ...], ...] = ()

    def first(self, dimensions: int) -> FloatArray:
        """Return the first generation, shape (population, d): without starts, a point in every stratum."""
        draws = np.random.Generator(np.random.Philox(self.seed))
        strata = np.stack([draws.permutation(self.population) for _ in range(dimensions)], axis=1)
        points = np.asarray((strata + draws.random(strata.shape)) / self.population)
        for row, start in enumerate(self.starts[: self.population]):
            points[row] = start
        return points

    def run(self, function: Function, dimensions: int) -> tuple[FloatArray, float]:
        """Return the best point and its value."""
        from scipy import optimize

        # Its type hints know functions of one point only.
        evolve: Callable[..., Any] = optimize.differential_evolution
        done = evolve(
            lambda columns: function(np.ascontiguousarray(columns.T)),
            [(0.0, 1.0)] * dimensions,
            init=self.first(dimensions),
            maxiter=self.generations,
            rng=np.random.Generator(np.random.Philox(self.seed)),
            vectorized=True,
            updating="deferred",
            polish=False,
            tol=0.0,
        )
        return _answer(done)


@dataclass(frozen=True, slots=True, kw_only=True)
class DualAnnealing:
    """Generalised simulated annealing without its local search, which needs derivatives; one point at a time.

    References
    ----------
    Xiang, Sun, Fan and Gong, Phys. Lett. A 233, 1997.
    """

    evaluations: int
    seed: int

    def run(self, function: Function, dimensions: int) -> tuple[FloatArray, float]:
        """Return the best point and its value."""
        from scipy.optimize import dual_annealing

        done = dual_annealing(
            _one_by_one(function),
            [(0.0, 1.0)] * dimensions,
            maxfun=self.evaluations,
            maxiter=self.evaluations,
            rng=np.random.Generator(np.random.Philox(self.seed)),
            no_local_search=True,
        )
        return _answer(done)


@dataclass(frozen=True, slots=True, kw_only=True)
class Direct:
    """Division of the cube into rectangles, without any random number; one point at a time.

    References
    ----------
    Jones, Perttunen and Stuckman, J. Optim. Theory Appl. 79, 1993; Gablonsky and Kelley, J. Global Optim. 21,
    2001.
    """

    evaluations: int

    def run(self, function: Function, dimensions: int) -> tuple[FloatArray, float]:
        """Return the best point and its value."""
        from scipy import optimize

        divide: Callable[..., Any] = optimize.direct
        done = divide(
            _one_by_one(function),
            [(0.0, 1.0)] * dimensions,
            maxfun=self.evaluations,
            maxiter=self.evaluations,
            vol_tol=0.0,
        )
        return _answer(done)


@dataclass(frozen=True, slots=True, kw_only=True)
class Polishing:
    """Descent without derivatives from a point, in some of its coordinates, the others staying as they are.

    With common random numbers the mean over a fixed set of replications is an ordinary function of the layout, so
    such a descent works on it as on any other.

    Parameters
    ----------
    start
        The point, as numbers in [0, 1].
    coordinates
        Which of them move.
    step
        Size of the first simplex.
    algorithm
        ``"Nelder-Mead"`` or ``"Powell"``.

    References
    ----------
    Nelder and Mead, Comput. J. 7, 1965; Powell, Comput. J. 7, 1964.
    """

    start: tuple[float, ...]
    coordinates: tuple[int, ...]
    evaluations: int
    step: float = 0.05
    algorithm: str = "Nelder-Mead"

    def run(self, function: Function, dimensions: int) -> tuple[FloatArray, float]:
        """Return the best point and its value."""
        from scipy import optimize

        descend: Callable[..., Any] = optimize.minimize
        whole, moving = np.array(self.start), list(self.coordinates)

        def placed(part: FloatArray) -> FloatArray:
            point = whole.copy()
            point[moving] = part
            return point

        options: dict[str, Any] = {"maxfev": self.evaluations}
        if self.algorithm == "Nelder-Mead":
            steps = np.where(whole[moving] + self.step <= 1.0, self.step, -self.step)
            options["initial_simplex"] = np.concatenate([whole[moving][None], whole[moving] + np.diag(steps)])
        one = _one_by_one(function)
        done = descend(
            lambda part: one(placed(part)),
            whole[moving],
            method=self.algorithm,
            bounds=[(0.0, 1.0)] * len(moving),
            options=options,
        )
        best, value = _answer(done)
        return placed(best), value


def _one_by_one(function: Function) -> Callable[[FloatArray], float]:
    return lambda point: float(function(np.array(point, dtype=np.float64)[None])[0])


def _answer(done: Any) -> tuple[FloatArray, float]:
    return np.asarray(done.x, dtype=np.float64), float(np.asarray(done.fun).item())
