"""Arrangements of equal circles: twins, closed cases, brute force; smallest circles, regions of a reading."""

import math

import numpy as np
import pytest
from filter_worlds import antennas, knowledge
from hypothesis import given, settings
from hypothesis import strategies as st

from layoutopt.circles import arcs_plain, arrangement, feasible_circle, neighbours, smallest_circle
from layoutopt.circles_kernels import arcs
from layoutopt.estimators.reader_place import ReaderPlace
from layoutopt.geometry import reduced_cell
from layoutopt.patterns.equilateral import equilateral
from layoutopt.patterns.square import square
from layoutopt.patterns.triangular import triangular

UNIT_CELL = np.eye(2)
LATTICES = {
    "square": lambda pitch_m: square(pitch_m=pitch_m),
    "isosceles": lambda pitch_m: triangular(pitch_m=pitch_m),
    "equilateral": lambda pitch_m: equilateral(side_m=pitch_m),
}
TOUCHING = [
    (name, millimetres / 1000.0, halves)
    for name in LATTICES
    for millimetres, halves in (
        (10, 3),
        (35, 4),
        (50, 2),
        (70, 5),
        (100, 2),
        (100, 3),
        (150, 3),
        (350, 2),
        (350, 3),
    )
]
"""Lattices, pitches (m) and radii in half pitches, at which discs of many tags touch."""


def random_set(seed, count):
    """Return a random cell and points in it."""
    generator = np.random.Generator(np.random.Philox(seed))
    cell_m = reduced_cell(np.eye(2) + generator.uniform(-0.4, 0.4, (2, 2)))
    return generator.random((count, 2)) @ cell_m, cell_m


@given(st.integers(0, 2**32), st.integers(1, 6), st.floats(0.05, 1.5))
@settings(max_examples=60)
def test_arcs_equal_their_plain_twin(seed, count, radius_m):
    """Same arcs, same points on each of them."""
    points_m, cell_m = random_set(seed, count)
    near_m, _, start = neighbours(points_m, cell_m, 2.0 * radius_m)
    found, truth = arcs(points_m, start, near_m, radius_m), arcs_plain(points_m, start, near_m, radius_m)
    for ours, theirs in zip(found, truth, strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-12)


@given(st.integers(0, 2**32), st.integers(1, 5), st.floats(0.05, 1.2))
@settings(max_examples=25)
def test_neighbours_are_all_within_the_distance(seed, count, within_m):
    """Against all places of nine by nine cells."""
    points_m, cell_m = random_set(seed, count)
    near_m, step, start = neighbours(points_m, cell_m, within_m)
    shifts = np.stack(np.meshgrid(np.arange(-4, 5), np.arange(-4, 5)), axis=-1).reshape(-1, 2) @ cell_m
    all_m = (points_m[:, None] + shifts).reshape(-1, 2)
    np.testing.assert_allclose(near_m, points_m[step[:, 0]] + step[:, 1:] @ cell_m, atol=1e-12)
    for number, place_m in enumerate(points_m):
        away_m = np.hypot(*(all_m - place_m).T)
        assert start[number + 1] - start[number] == ((away_m <= within_m) & (away_m > 0.0)).sum()


@pytest.mark.parametrize("radius", [0.1, 0.3, 0.5, 0.6, 0.70, 0.75, 1.3, 2.9])
def test_covered_area_of_the_square_lattice(radius):
    """A disc less two lenses a pair of neighbours, and all of the cell from half the diagonal on."""
    lens = 2.0 * radius**2 * math.acos(min(1.0, 0.5 / radius)) - 0.5 * math.sqrt(max(0.0, 4.0 * radius**2 - 1.0))
    wanted = math.pi * radius**2 - 2.0 * lens if radius < math.sqrt(0.5) else 1.0
    found = arrangement(np.zeros((1, 2)), UNIT_CELL, radius)
    assert found.covered_area_m2() == pytest.approx(wanted, rel=1e-9)


def test_what_is_within_reach_of_a_place_gives_its_estimates():
    """Just inside and just outside every arc, midrange, centroid and centre are those of its points."""
    points_m, cell_m = random_set(11, 3)
    radius_m = 0.83
    circles = arrangement(points_m, cell_m, radius_m)
    middles, centroids, centres = circles.middles(), circles.middles(centroid=True), circles.centres()
    shifts = np.stack(np.meshgrid(np.arange(-5, 6), np.arange(-5, 6)), axis=-1).reshape(-1, 2) @ cell_m
    all_m = (circles.points_m[:, None] + shifts).reshape(-1, 2)
    angle = circles.ends_rad.mean(axis=1)
    outward = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    for side, way_m in (("inside", -1e-9), ("outside", 1e-9)):
        place_m = circles.centre_m + (radius_m + way_m) * outward
        for number in range(0, len(circles), 7):
            near = np.hypot(*(all_m - place_m[number]).T)
            read_m, silent_m = all_m[near < radius_m], all_m[(near >= radius_m) & (near < 3.0 * radius_m)]
            extremes = (read_m.min(axis=0) + read_m.max(axis=0)) / 2.0
            np.testing.assert_allclose(getattr(middles, side)[number], extremes, atol=1e-9)
            np.testing.assert_allclose(getattr(centroids, side)[number], read_m.mean(axis=0), atol=1e-9)
            circle = feasible_circle(read_m, silent_m, radius_m)
            assert circle is not None
            np.testing.assert_allclose(getattr(centres, side)[number], circle.centre_m, atol=1e-7)


@given(st.integers(0, 2**32), st.integers(1, 30))
@settings(max_examples=80)
def test_smallest_circle(seed, count):
    """It holds all points, and no pair or triple of them needs a larger one (Welzl, 1991, has the theorem)."""
    generator = np.random.Generator(np.random.Philox(seed))
    points_m = generator.normal(size=(count, 2))
    circle = smallest_circle(points_m)
    away_m = np.hypot(*(points_m - circle.centre_m).T)
    assert away_m.max() <= circle.radius_m * (1.0 + 1e-9) + 1e-12
    # The centre lies in the hull of the points on the circle; else a move towards them would make it smaller.
    rim = points_m[away_m > circle.radius_m * (1.0 - 1e-7) - 1e-12] - circle.centre_m
    for angle in np.linspace(0.0, 2.0 * math.pi, 360):
        assert (rim @ (math.cos(angle), math.sin(angle))).min() <= 0.02 * circle.radius_m + 1e-12


@given(st.integers(0, 2**32))
@settings(max_examples=40)
def test_the_feasible_circle_holds_every_place_that_reads_the_same(seed):
    """And some of them lie near its rim, so it is no larger than it must be."""
    generator = np.random.Generator(np.random.Philox(seed))
    points_m, radius_m = generator.uniform(-1.2, 1.2, (9, 2)), 0.8
    place_m = generator.uniform(-0.3, 0.3, 2)
    reads = np.hypot(*(points_m - place_m).T) < radius_m
    if not reads.any():
        return
    circle = feasible_circle(points_m[reads], points_m[~reads], radius_m)
    assert circle is not None
    tried_m = generator.uniform(-2.0, 2.0, (60_000, 2))
    away_m = np.hypot(*(tried_m[:, None] - points_m).transpose(2, 0, 1))
    same = ((away_m < radius_m) == reads).all(axis=1)
    from_centre_m = np.hypot(*(tried_m[same] - circle.centre_m).T)
    assert np.hypot(*(place_m - circle.centre_m)) <= circle.radius_m * (1.0 + 1e-9)
    assert (from_centre_m <= circle.radius_m * (1.0 + 1e-9)).all()
    if same.sum() > 3000:
        assert from_centre_m.max() > 0.8 * circle.radius_m


def touching(name, pitch_m, halves, count):
    """Return tags, a radius of some half pitches in whole micrometres, and random places away from all rims."""
    tags_m = LATTICES[name](pitch_m).points_in((-8.0 * pitch_m, -8.0 * pitch_m, 8.0 * pitch_m, 8.0 * pitch_m))
    radius_m = round(halves * pitch_m / 2.0, 6)
    place_m = np.random.Generator(np.random.Philox(halves)).uniform(-pitch_m, pitch_m, (count, 2))
    away_m = np.hypot(*(place_m[:, None] - tags_m).transpose(2, 0, 1))
    return tags_m, radius_m, place_m[np.abs(away_m - radius_m).min(axis=1) > 1e-3 * pitch_m]


@pytest.mark.parametrize(("name", "pitch_m", "halves"), TOUCHING)
def test_discs_that_only_touch_hold_no_arc(name, pitch_m, halves):
    """Arcs and what is read on them are those of a radius a little smaller; kernel and plain twin agree."""
    pattern = LATTICES[name](pitch_m)
    found, below = (
        arrangement(pattern.points_m, pattern.cell_m, round(halves * pitch_m / 2.0, 6) * share)
        for share in (1.0, 1.0 - 1e-9)
    )
    assert found.covered_area_m2() == pytest.approx(below.covered_area_m2(), rel=1e-7)
    truth = arcs_plain(found.points_m, found.near_start, found.near_m, found.radius_m)
    for ours, theirs in zip((found.circle, found.ends_rad, found.held_start, found.held), truth, strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-12)
    # How much of all rims lies within reach of none, one, two and more tags.
    lengths = [
        np.bincount(np.diff(circles.held_start), np.diff(circles.ends_rad, axis=1).ravel())
        for circles in (found, below)
    ]
    np.testing.assert_allclose(*lengths, atol=1e-6)


@pytest.mark.parametrize(("name", "pitch_m", "halves"), TOUCHING)
def test_the_feasible_circle_where_discs_touch(name, pitch_m, halves):
    """It exists wherever something is read, holds the place, and is that of a radius a little smaller."""
    tags_m, radius_m, places_m = touching(name, pitch_m, halves, 25)
    for place_m in places_m:
        away_m = np.hypot(*(tags_m - place_m).T)
        reads, near = away_m < radius_m, (away_m >= radius_m) & (away_m < 3.0 * radius_m)
        if not reads.any():
            continue
        found, below = (
            feasible_circle(tags_m[reads], tags_m[near], radius_m * share) for share in (1.0, 1.0 - 1e-9)
        )
        assert found is not None
        assert below is not None
        assert math.dist(place_m, found.centre_m) <= found.radius_m * (1.0 + 1e-9)
        assert found.radius_m == pytest.approx(below.radius_m, abs=1e-6 * pitch_m)
        assert found.centre_m == pytest.approx(below.centre_m, abs=1e-6 * pitch_m)


@pytest.mark.parametrize(("name", "pitch_m", "halves"), TOUCHING)
def test_the_minimax_place_of_a_reader_where_discs_touch(name, pitch_m, halves):
    """Place and variance are those of a reader a little weaker, and the true place is no farther off."""
    tags_m, radius_m, places_m = touching(name, pitch_m, halves, 25)
    reader, weaker = (
        ReaderPlace(knowledge(tags_m, antennas(np.zeros((1, 2)), radius_m=radius_m * share)), "minimax")
        for share in (1.0, 1.0 - 1e-9)
    )
    for place_m in places_m:
        tags = frozenset(np.flatnonzero(np.hypot(*(tags_m - place_m).T) < radius_m).tolist())
        if not tags:
            continue
        (found_m, variance_m2), (below_m, below_m2) = reader.of(tags), weaker.of(tags)
        assert found_m == pytest.approx(below_m, abs=1e-6 * pitch_m)
        assert variance_m2 == pytest.approx(below_m2, abs=1e-6 * pitch_m**2)
        assert math.dist(found_m, place_m) <= 2.0 * math.sqrt(variance_m2) * (1.0 + 1e-9)


def test_places_that_contradict_each_other_have_no_circle():
    """Two tags farther apart than two radii are never read at once, nor one alone whose disc others cover."""
    assert feasible_circle(np.array([(0.0, 0.0), (3.0, 0.0)]), np.empty((0, 2)), 1.0) is None
    round_it = np.array([(0.3, 0.0), (-0.3, 0.0), (0.0, 0.3), (0.0, -0.3)])
    assert feasible_circle(np.zeros((1, 2)), round_it, 1.0) is None


def test_one_tag_alone_leaves_its_disc():
    """The smallest circle round a disc is its own."""
    circle = feasible_circle(np.array([(2.0, 1.0)]), np.empty((0, 2)), 0.5)
    assert circle is not None
    assert circle.centre_m == pytest.approx((2.0, 1.0))
    assert circle.radius_m == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: arrangement(np.empty((0, 2)), UNIT_CELL, 1.0), "at least one point"),
        (lambda: arrangement(np.zeros((1, 2)), UNIT_CELL, 0.0), "positive and finite"),
        (lambda: arrangement(np.zeros((1, 2)), UNIT_CELL, math.nan), "positive and finite"),
        (lambda: smallest_circle(np.empty((0, 2))), "no points"),
        (lambda: arrangement(np.array([(0.1, 0.0), (1.1, 0.0)]), UNIT_CELL, 1.0), "share a place"),
        (lambda: feasible_circle(np.empty((0, 2)), np.zeros((1, 2)), 1.0), "without a read point"),
        (lambda: feasible_circle(np.zeros((1, 2)), np.empty((0, 2)), -1.0), "positive and finite"),
    ],
)
def test_wrong_input_is_named(call, message):
    """Each with what would be right."""
    with pytest.raises(ValueError, match=message):
        call()
