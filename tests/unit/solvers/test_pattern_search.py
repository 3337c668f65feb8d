"""Search for patterns: known optima, equal density, tilts, rounding, and what it refuses."""

import math

import numpy as np
import pytest

from layoutopt.geometry import lattice_points
from layoutopt.layout import TagPattern
from layoutopt.patterns.listed import listed
from layoutopt.patterns.square import square
from solvers.pattern_search import PatternSpace, laid_at, search_pattern


def space(count, **changes):
    return PatternSpace(**{"count": count, "density_per_m2": 1.0, "least_spacing_m": 0.2, **changes})


def gaussian_energy(pattern):
    """Return the energy a tag of equal ones that repel each other by exp(-pi d²), d in pitches."""
    reach_m = 4.0
    low, high = pattern.points_m.min(axis=0) - reach_m, pattern.points_m.max(axis=0) + reach_m
    all_m = lattice_points(pattern.points_m, pattern.cell_m, (low[0], low[1], high[0], high[1]))
    square_m2 = ((pattern.points_m[:, None] - all_m) ** 2).sum(axis=2)
    return float(np.exp(-math.pi * square_m2).sum() / len(pattern.points_m)) - 1.0


def first_moment(pattern):
    """Return how far the tags reach along x from the first; depends on the angle at which tiles lie."""
    return float(abs(pattern.cell_m[0, 0])) / float(np.hypot(*pattern.cell_m[0]))


def lattice_of_two():
    return search_pattern([gaussian_energy], gaussian_energy, space(2), starts=3, kept=1, seed=3)


@pytest.fixture(scope="module")
def one():
    """The best lattice of one tag a tile."""
    return search_pattern([gaussian_energy], gaussian_energy, space(1), starts=6, kept=2, seed=3)


@pytest.fixture(scope="module")
def two():
    """The best pattern of two tags a tile."""
    return lattice_of_two()


def test_the_best_of_all_lattices_is_found(one):
    """Of all lattices the equilateral has the least Gaussian energy (Montgomery, Glasgow Math. J. 30, 1988)."""
    side_m = math.sqrt(2.0 / math.sqrt(3.0))
    assert space(1).pattern(one.unknowns).minimum_spacing_m() == pytest.approx(side_m, abs=2e-3)
    best = TagPattern(
        name="equilateral",
        points_m=np.zeros((1, 2)),
        cell_m=side_m * np.array([(1.0, 0.0), (0.5, math.sqrt(0.75))]),
        parameters={},
    )
    assert one.value == pytest.approx(gaussian_energy(best), rel=1e-4)


def test_more_tags_a_tile_reach_the_same_lattice(one, two):
    """Two tags a tile hold every lattice that one does, and a descent from several starts gets there."""
    assert two.value <= one.value * (1.0 + 1e-3)


def test_the_same_seed_gives_the_same_pattern(two):
    """To the last bit."""
    again = lattice_of_two()
    assert np.array_equal(two.unknowns, again.unknowns)
    assert (two.value, two.evaluated) == (again.value, again.evaluated)


def test_the_tilt_is_found_where_axes_count():
    """A goal that is least for tiles across the axes turns them, and tiles without a tilt cannot."""
    tilted = search_pattern([first_moment], first_moment, space(1, tilted=True), starts=4, kept=2, seed=2)
    assert tilted.value < 0.01
    assert abs(space(1, tilted=True).tilt_rad(tilted.unknowns) - math.pi / 2.0) < 0.02
    straight = search_pattern([first_moment], first_moment, space(1), starts=4, kept=2, seed=2)
    assert straight.value == 1.0


@pytest.mark.parametrize("count", [1, 2, 5, 9])
@pytest.mark.parametrize("grid_m", [0.0, 0.01])
def test_there_are_never_more_tags_than_asked_for(count, grid_m):
    """Density is that of the space, and on a grid no more and hardly less; places and sides are on the grid."""
    draws = np.random.Generator(np.random.Philox(count))
    for unknowns in draws.random((20, space(count).dimensions)):
        pattern = space(count).pattern(unknowns, grid_m)
        assert len(pattern.points_m) == count
        assert pattern.density_per_m2 <= 1.0 + 1e-12
        assert pattern.density_per_m2 > 0.97
        if grid_m:
            steps = np.concatenate([pattern.points_m.ravel(), pattern.cell_m.ravel()]) / grid_m
            assert np.allclose(steps, np.round(steps), atol=1e-6)


def test_tags_keep_the_spacing_that_is_asked_for():
    """What is found has the least spacing to half a per cent, although the goal wants all tags in one place."""

    def crowd(pattern):
        return float(np.hypot(*(pattern.points_m - pattern.points_m[0]).T).sum())

    found = search_pattern([crowd], crowd, space(3, least_spacing_m=0.5), starts=2, kept=2, seed=1)
    assert 0.4975 <= space(3).pattern(found.unknowns).minimum_spacing_m() < 0.51


def test_a_pattern_laid_at_an_angle_is_that_pattern_turned():
    """Tags and cell turn together, and no angle changes nothing."""
    pattern = listed(points_m=[(0.1, 0.2), (0.5, 0.7)], cell_m=(1.0, 1.5), shift_m=0.3)
    assert laid_at(pattern, 0.0) is pattern
    laid = laid_at(pattern, math.pi / 2.0)
    assert np.allclose(laid.points_m, [(-0.2, 0.1), (-0.7, 0.5)])
    assert np.allclose(laid.cell_m, [(0.0, 1.0), (-1.5, 0.3)])
    assert laid.minimum_spacing_m() == pytest.approx(pattern.minimum_spacing_m())


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: space(0), "at least one tag"),
        (lambda: space(2, density_per_m2=0.0), "must be positive"),
        (lambda: space(2, least_spacing_m=-1.0), "must be positive"),
        (lambda: laid_at(listed(points_m=[(0.0, 0.0)]), 0.1), "laid once"),
        (lambda: search_pattern([], len, space(1), starts=1, kept=1, seed=0), "needs a stage"),
        (lambda: search_pattern([gaussian_energy], len, space(1), starts=1, kept=2, seed=0), "2 of 1"),
        (
            lambda: search_pattern(
                [gaussian_energy], gaussian_energy, space(2, least_spacing_m=5.0), starts=1, kept=1, seed=0
            ),
            "enough room",
        ),
    ],
)
def test_wrong_input_is_named(call, message):
    """Each with its reason."""
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize("times", [2, 3])
@pytest.mark.parametrize("tilted", [False, True])
def test_repeated_tiles_are_the_same_pattern(times, tilted):
    """Tiles put together to a larger one lay the same tags, but for where the frame begins."""
    draws = np.random.Generator(np.random.Philox(11))
    for unknowns in draws.random((20, space(2, tilted=tilted).dimensions)):
        few, many = space(2, tilted=tilted), space(2 * times, tilted=tilted)
        first, second = few.laid(unknowns), many.laid(few.repeated(unknowns, times))
        moved_m = second.points_m[0] - first.points_m[0]
        bounds_m = (-4.0, -4.0, 4.0, 4.0)
        laid_m = lattice_points(first.points_m + moved_m, first.cell_m, bounds_m)
        again_m = lattice_points(second.points_m, second.cell_m, bounds_m)
        assert np.hypot(*(laid_m[:, None] - again_m).transpose(2, 0, 1)).min(axis=1).max() < 1e-9
        assert len(laid_m) == len(again_m)


def test_what_is_known_is_never_lost(one):
    """A search that starts from a good pattern too gives none that is worse."""
    known = [space(1).repeated(one.unknowns, 3)]
    three = search_pattern([first_moment], gaussian_energy, space(3), starts=1, kept=1, seed=1, known=known)
    assert three.value <= one.value * (1.0 + 1e-9)


def test_square_is_among_the_lattices():
    """Unknowns of no shift and even sides give the square pattern."""
    pattern = space(1).pattern(np.array([0.5, 0.5]))
    assert np.allclose(pattern.cell_m, square(pitch_m=1.0).cell_m)
