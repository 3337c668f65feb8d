"""Optimisers that ask: the same answers as scipy's own, whatever is known already."""

import numpy as np
import pytest
from scipy import optimize

from solvers.replayed import DifferentialEvolution, Direct, DualAnnealing, Polishing, asked

START = (0.9, 0.4, 0.98)
METHODS = {
    "differential evolution": DifferentialEvolution(population=10, generations=8, seed=3),
    "dual annealing": DualAnnealing(evaluations=60, seed=3),
    "direct": Direct(evaluations=60),
    "nelder-mead": Polishing(start=START, coordinates=(0, 2), evaluations=40),
    "powell": Polishing(start=START, coordinates=(0, 2), evaluations=40, algorithm="Powell"),
}


def bumpy(points):
    """Return a function with many valleys, its least near 0.3 in every coordinate (after Rastrigin)."""
    return ((points - 0.3) ** 2).sum(axis=1) + 0.02 * (1.0 - np.cos(25.0 * (points - 0.3))).sum(axis=1)


def one(point):
    """Return the same of one point."""
    return float(bumpy(np.asarray(point)[None])[0])


def plain(name):
    """Return what scipy gives when it calls the function itself."""
    bounds = [(0.0, 1.0)] * 3
    if name == "differential evolution":
        method = METHODS[name]
        return optimize.differential_evolution(
            one,
            bounds,
            init=method.first(3),
            maxiter=8,
            rng=np.random.Generator(np.random.Philox(3)),
            updating="deferred",
            polish=False,
            tol=0.0,
        )
    if name == "dual annealing":
        draws = np.random.Generator(np.random.Philox(3))
        return optimize.dual_annealing(one, bounds, maxfun=60, maxiter=60, rng=draws, no_local_search=True)
    if name == "direct":
        return optimize.direct(one, bounds, maxfun=60, maxiter=60, vol_tol=0.0)
    options = {"maxfev": 40}
    if name == "nelder-mead":
        options["initial_simplex"] = [[0.9, 0.98], [0.9 + 0.05, 0.98], [0.9, 0.98 - 0.05]]
    method = {"nelder-mead": "Nelder-Mead", "powell": "Powell"}[name]
    return optimize.minimize(
        lambda part: one([part[0], 0.4, part[1]]), [0.9, 0.98], method=method, bounds=bounds[:2], options=options
    )


def drive(method, known=None):
    """Return the final answer and the sequence of questions, each answered before the next."""
    known, questions = {} if known is None else dict(known), []

    def lookup(points):
        return np.array([known.get(point.tobytes(), np.nan) for point in points])

    while True:
        answer = asked(method, lookup, 3)
        if answer.best is not None:
            return answer, questions, known
        questions.append(answer.points)
        known |= {point.tobytes(): value for point, value in zip(answer.points, bumpy(answer.points), strict=True)}


@pytest.mark.parametrize("name", METHODS)
def test_an_optimiser_that_asks_comes_to_what_scipy_comes_to(name):
    """Bit for bit the same point and value."""
    answer, _, _ = drive(METHODS[name])
    expected = plain(name)
    best = answer.best if len(expected.x) == 3 else answer.best[[0, 2]]
    assert best.tolist() == np.asarray(expected.x).tolist()
    assert answer.value == expected.fun


@pytest.mark.parametrize("name", METHODS)
def test_a_search_goes_on_from_any_prefix_of_what_is_known(name):
    """Whatever was answered before it was killed, the rest of the questions and the answer are the same."""
    answer, questions, known = drive(METHODS[name])
    sizes = np.cumsum([len(points) for points in questions])
    values = list(known.items())
    for kept in sorted({1, 7, int(sizes[-1]) // 2, int(sizes[-1]) - 1}):
        again, rest, _ = drive(METHODS[name], values[:kept])
        assert again.best.tolist() == answer.best.tolist()
        asked_before = {item for item, _ in values[:kept]}
        expected = [
            point.tobytes() for points in questions for point in points if point.tobytes() not in asked_before
        ]
        assert list(dict.fromkeys(point.tobytes() for points in rest for point in points)) == list(
            dict.fromkeys(expected)
        )


def test_differential_evolution_asks_for_whole_generations():
    """Nine questions of ten points: the first generation and eight more."""
    _, questions, _ = drive(METHODS["differential evolution"])
    assert [len(points) for points in questions] == [10] * 9


def test_the_first_generation_has_a_point_in_every_stratum():
    """Of each coordinate: a Latin hypercube."""
    first = DifferentialEvolution(population=16, generations=0, seed=1).first(4)
    assert (np.sort(np.floor(first * 16), axis=0) == np.arange(16)[:, None]).all()


def test_starts_take_the_first_places_of_the_first_generation():
    """The rest stays as it is without them, and the answer is never worse than a start."""
    plain_method = METHODS["differential evolution"]
    known_good = DifferentialEvolution(
        population=10, generations=0, seed=3, starts=((0.3, 0.3, 0.3), (0.0, 0.5, 1.0))
    )
    first = known_good.first(3)
    assert first[:2].tolist() == [[0.3, 0.3, 0.3], [0.0, 0.5, 1.0]]
    assert first[2:].tolist() == plain_method.first(3)[2:].tolist()
    answer, _, _ = drive(known_good)
    assert answer.best.tolist() == [0.3, 0.3, 0.3]


def test_the_global_methods_find_the_valley():
    """The least value is 0 at 0.3 in all coordinates; a few hundred evaluations come near it."""
    wide = DifferentialEvolution(population=20, generations=40, seed=5)
    answer, _, _ = drive(wide)
    np.testing.assert_allclose(answer.best, 0.3, atol=0.01)
    answer, _, _ = drive(Direct(evaluations=400))
    np.testing.assert_allclose(answer.best, 0.3, atol=0.04)


def test_coordinates_that_do_not_move_stay():
    """A descent in the first and the last leaves the second where it was."""
    answer, questions, _ = drive(METHODS["nelder-mead"])
    assert answer.best[1] == 0.4
    assert all((points[:, 1] == 0.4).all() for points in questions)
