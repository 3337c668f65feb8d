"""Worst, mean and share of all three estimators against a brute force that is refined where readings change.

Nothing here is shared with the code under test: readings are distances to all tags about a cell, places at which
the same tags are read are gathered under the names of these tags, and smallest circles are found point by point.
"""

import math

import numpy as np
import pytest

from layoutopt.layout import TagPattern
from layoutopt.patterns.equilateral import equilateral
from layoutopt.patterns.parallelogram import parallelogram
from layoutopt.patterns.square import square
from layoutopt.patterns.tilted import tilted
from layoutopt.patterns.triangular import triangular
from objectives.position_bound import ESTIMATORS, static_error

WORST, MEAN = 1e-6, 5e-5
"""What the brute force below is good for, in pitches: less than the 1e-4 that exact errors are held to."""
BESIDE_RAD = 1e-7
"""How far from where two circles cross their rims are looked at."""
SHEARS = ([[1, 2], [0, 1]], [[2, 1], [1, 1]], [[1, 0], [-3, 1]], [[3, 2], [1, 1]], [[0, 1], [1, -2]])
LATTICES = {
    "square": square(pitch_m=1.0),
    "isosceles": triangular(pitch_m=1.0),
    "equilateral": equilateral(side_m=1.0),
    "sheared": parallelogram(tile_m=2.0, shift_m=0.13, form="sheared"),
    "tilted": tilted(tile_m=2.0, angle_rad=0.25),
}


def random_floor(seed):
    """Return tags of a random cell, one to five, in units of the pitch, that cell, a skewed one, and a radius."""
    draws = np.random.Generator(np.random.Philox(seed))
    count = seed % 5 + 1
    cell = np.eye(2) + draws.uniform(-0.35, 0.35, (2, 2))
    cell *= math.sqrt(count / abs(np.linalg.det(cell)))
    points = draws.random((count, 2)) @ cell + draws.uniform(-2.0, 2.0, 2)
    return points, cell, np.array(SHEARS[seed % len(SHEARS)]) @ cell, float(draws.uniform(0.35, 1.3))


def tags_about(points, cell, reach):
    """Return the tags within reach of a cell, shape (m, 2), and their names: number and steps, shape (m, 3)."""
    steps = points @ np.linalg.inv(cell)
    points = (steps - np.floor(steps)) @ cell
    diagonal = max(np.hypot(*(cell[0] + cell[1])), np.hypot(*(cell[0] - cell[1])))
    most = math.ceil((reach + diagonal) * np.linalg.norm(np.linalg.inv(cell), axis=0).max()) + 1
    number, i, j = np.meshgrid(
        np.arange(len(points)), np.arange(-most, most + 1), np.arange(-most, most + 1), indexing="ij"
    )
    names = np.stack([number, i, j], axis=-1).reshape(-1, 3)
    tags = points[names[:, 0]] + names[:, 1:] @ cell
    near = np.hypot(*(tags - cell.sum(axis=0) / 2.0).T) <= reach + diagonal / 2.0
    return tags[near], names[near]


def between(place, tags, low, high):
    """Return which tags lie at least ``low`` and less than ``high`` from places, shape (n, m).

    Tag by tag, and only of places that lie near enough along x: most of the time of this file is spent here.
    """
    order = np.argsort(place[:, 0])
    x, y = place[order].T.copy()
    found = np.zeros((len(tags), len(place)), dtype=np.bool_)
    for row, (tag_x, tag_y) in zip(found, tags.tolist(), strict=True):
        near = slice(*np.searchsorted(x, (tag_x - 1.01 * high, tag_x + 1.01 * high)))
        square = (x[near] - tag_x) ** 2 + (y[near] - tag_y) ** 2
        row[order[near]] = (square >= low**2) & (square < high**2)
    return found.T


def different(read):
    """Return the different rows of readings, shape (s, m), and which of them each row is."""
    weights = np.random.Generator(np.random.Philox(1)).integers(-(2**62), 2**62, read.shape[1])
    _, first, which = np.unique(read @ weights, return_index=True, return_inverse=True)
    return read[first], which


def rims(tags, names, radius):
    """Return places on the circles of a cell's tags and what is read just inside and just outside of them."""
    place, read = [], []
    for own in np.flatnonzero((names[:, 1:] == 0).all(axis=1)):
        away = np.delete(tags - tags[own], own, axis=0)
        away = away[np.hypot(*away.T) < 2.0 * radius]
        towards, wide = np.arctan2(away[:, 1], away[:, 0]), np.arccos(np.hypot(*away.T) / (2.0 * radius))
        ends = np.concatenate([towards - wide, towards + wide])
        angle = np.concatenate([np.arange(2000) * math.pi / 1000.0, ends - BESIDE_RAD, ends + BESIDE_RAD])
        on_rim = tags[own] + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        for inside in (True, False):
            reads = between(on_rim, tags, 0.0, radius)
            reads[:, own] = inside
            some = reads.any(axis=1)
            place.append(on_rim[some])
            read.append(reads[some])
    return np.concatenate(place), np.concatenate(read)


def divided(cell, tags, radius, first=32, halvings=4):
    """Return places over a cell with weights that sum to one: pieces that a circle crosses are halved again.

    A piece that none crosses, and so has one reading, gets a Gauss rule; the last ones four by four places.
    """
    nodes, gauss = np.polynomial.legendre.leggauss(4)
    even = (np.arange(4) - 1.5) / 2.0
    offset, weight, evenly = (
        np.stack(np.meshgrid(way, way), axis=-1).reshape(-1, 2) / 2.0 for way in (nodes, gauss, even)
    )
    middle = (
        np.stack(np.meshgrid(np.arange(first), np.arange(first)), axis=-1).reshape(-1, 2) / first + 0.5 / first
    )
    half = max(np.hypot(*(cell[0] + cell[1])), np.hypot(*(cell[0] - cell[1]))) / 2.0
    size, steps, weights = 1.0 / first, [], []
    for halving in range(halvings + 1):
        least, most = max(radius - size * half, 0.0), radius + size * half
        crossed = between(middle @ cell, tags, least, most).any(axis=1)
        whole = middle[~crossed]
        steps.append((whole[:, None] + size * offset).reshape(-1, 2))
        weights.append(np.tile(weight.prod(axis=1) * size**2, len(whole)))
        middle = middle[crossed]
        if halving == halvings:
            break
        size /= 2.0
        quarters = size / 2.0 * np.array([(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)])
        middle = (middle[:, None] + quarters).reshape(-1, 2)
    steps.append((middle[:, None] + size * evenly).reshape(-1, 2))
    weights.append(np.full(16 * len(middle), size**2 / 16.0))
    return np.concatenate(steps) @ cell, np.concatenate(weights)


def circle_through(held):
    """Return the circle that has two points as ends of a diameter, or that passes three."""
    if len(held) == 2:
        return held.mean(axis=0), math.dist(*held) / 2.0
    centre = np.linalg.solve(2.0 * (held[1:] - held[0]), (held[1:] ** 2 - held[0] ** 2).sum(axis=1))
    return centre, math.dist(centre, held[0])


def outside(points, begin, end, circle):
    """Return the first point from one on and before another that lies outside a circle, or none."""
    centre, size = circle
    found = np.flatnonzero(np.hypot(*(points[begin:end] - centre).T) > size + 1e-12)
    return begin + int(found[0]) if len(found) else None


def least_circle(points):
    """Return the smallest circle round points: one that lies outside the last circle lies on the next (Welzl)."""
    points = np.random.Generator(np.random.Philox(2)).permutation(points)
    first, circle = 0, (points[0], 0.0)
    while (first := outside(points, first + 1, len(points), circle)) is not None:
        second, circle = -1, (points[first], 0.0)
        while (second := outside(points, second + 1, first, circle)) is not None:
            third, circle = -1, circle_through(points[[first, second]])
            while (third := outside(points, third + 1, second, circle)) is not None:
                circle = circle_through(points[[first, second, third]])
    return circle


def named(read, names):
    """Return the names of tags read, seen from the cell of the first of them, and that cell."""
    rows = names[read]
    rows = rows[np.lexsort(rows.T[::-1])]
    return (rows - (0, *rows[0, 1:])).tobytes(), rows[0, 1:]


def brute_force(points, cell, radius):
    """Return worst, mean and share for each estimator."""
    tags, names = tags_about(points, cell, 2.0 * radius)
    on_rim, rim_read = rims(tags, names, radius)
    place, weight = divided(cell, tags, radius)
    read = between(place, tags, 0.0, radius)
    some = read.any(axis=1)
    share = float(weight[some].sum())
    sets, which = different(np.concatenate([rim_read, read[some]]))
    set_names = [named(row, names) for row in sets]
    regions = {}
    for number, (name, steps) in enumerate(set_names):
        regions.setdefault(name, []).append(on_rim[which[: len(on_rim)] == number] - steps @ cell)
    middle = {name: least_circle(np.concatenate(places))[0] for name, places in regions.items()}
    low, high = (np.where(sets[:, :, None], tags, far) for far in (np.inf, -np.inf))
    guess = {
        "midrange": (low.min(axis=1) + high.max(axis=1)) / 2.0,
        "centroid": sets @ tags / sets.sum(axis=1, keepdims=True),
        "minimax": np.array([middle[name] + steps @ cell for name, steps in set_names]),
    }
    found = {}
    for estimator in ESTIMATORS:
        error = np.hypot(*(np.concatenate([on_rim, place[some]]) - guess[estimator][which]).T)
        mean = float(weight[some] @ error[len(on_rim) :]) / share
        found[estimator] = (float(error.max()), mean, share)
    return found


def compare(pattern, radius, truth):
    """Check all three numbers of all three estimators; lengths in pitches."""
    pitch = pattern.density_per_m2**-0.5
    for estimator in ESTIMATORS:
        found = static_error(pattern, radius, estimator)
        worst, mean, share = truth[estimator]
        assert found.worst_m / pitch == pytest.approx(worst / pitch, rel=0.0, abs=WORST), estimator
        assert found.mean_m / pitch == pytest.approx(mean / pitch, rel=0.0, abs=MEAN), estimator
        assert found.detection_probability == pytest.approx(share, rel=0.0, abs=MEAN), estimator


@pytest.mark.parametrize("seed", range(10))
def test_random_cells(seed):
    """One to five tags anywhere in a cell that is given by a skewed basis, discs that meet or not."""
    points, cell, skewed, radius = random_floor(seed)
    compare(TagPattern(name="any", points_m=points, cell_m=skewed), radius, brute_force(points, cell, radius))


@pytest.mark.parametrize(
    ("name", "radius"),
    [
        ("square", 1.31),
        ("isosceles", 0.61),
        ("isosceles", 1.08),
        ("equilateral", 0.77),
        ("sheared", 1.08),
        ("tilted", 0.9),
    ],
)
def test_families(name, radius):
    """Rows and columns, whose faces have the same estimate many times."""
    pattern = LATTICES[name]
    compare(pattern, radius, brute_force(pattern.points_m, pattern.cell_m, radius))


@pytest.mark.parametrize(
    ("pattern", "radius_m"),
    [
        (square(pitch_m=0.35), 0.525),
        (triangular(pitch_m=0.35), 0.35),
        (parallelogram(tile_m=0.7, shift_m=0.0875), 0.35),
        (equilateral(side_m=0.35), 0.35),
    ],
    ids=["square", "isosceles", "parallelogram", "equilateral"],
)
def test_discs_that_only_touch(pattern, radius_m):
    """Two radii are a distance between tags: no place reads both of them, as with a disc a little smaller."""
    compare(pattern, radius_m, brute_force(pattern.points_m, pattern.cell_m, radius_m * (1.0 - 1e-9)))
