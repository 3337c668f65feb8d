"""Short ways and random points on triangle meshes."""

import numpy as np
import pytest
import shapely
from scipy.sparse.csgraph import dijkstra
from scipy.stats import chi2
from shapely.geometry import LineString, Point, Polygon, box

from layoutopt.simulation.free_space import mesh, random_points, triangles_of

PILLARS = box(0, 0, 10, 6).difference(
    shapely.union_all([Point(x, y).buffer(0.6, quad_segs=3) for x in (2, 4.5, 7) for y in (1.5, 4)])
)
SPIRAL = Polygon([(0, 0), (7, 0), (7, 7), (1, 7), (1, 3), (4, 3), (4, 4), (2, 4), (2, 6), (6, 6), (6, 1), (0, 1)])
DOOR = shapely.union_all([box(0, 0, 4, 4), box(4.5, 0, 9, 4), box(3.9, 2, 4.6, 2.004)])


def shortest_m(region, start, goal):
    """Return the length of the shortest way by the visibility graph of all corners: slow, but exact."""
    points = np.concatenate([[start, goal], np.unique(shapely.get_coordinates(region), axis=0)])
    first, second = np.triu_indices(len(points), 1)
    lines = shapely.linestrings(np.stack([points[first], points[second]], axis=1))
    grown = region.buffer(1e-9)
    seen = shapely.covers(grown, lines)
    graph = np.zeros((len(points), len(points)))
    graph[first[seen], second[seen]] = shapely.length(lines[seen])
    return dijkstra(graph, directed=False, indices=[0])[0, 1]


@pytest.mark.parametrize("region", [PILLARS, SPIRAL, DOOR], ids=["pillars", "spiral", "door"])
def test_triangles_cover_the_region_once(region):
    """The areas add up, no triangle sticks out, and each knows what lies beyond its edges."""
    triangles_m = triangles_of(region)
    shapes = shapely.polygons(triangles_m)
    assert shapely.area(shapes).sum() == pytest.approx(region.area, rel=1e-12)
    assert shapely.covers(region.buffer(1e-9), shapes).all()
    space = mesh(region)
    for number, beyond in enumerate(space.across):
        for other in beyond[beyond >= 0]:
            assert number in space.across[other]


@pytest.mark.parametrize("region", [PILLARS, SPIRAL, DOOR], ids=["pillars", "spiral", "door"])
def test_way_is_inside_and_the_shortest(region):
    """Ways keep inside; of 30, none is more than 5 % longer than the shortest, and 0.3 % on average."""
    space = mesh(region)
    draws = np.random.default_rng(5)
    starts, _ = space.draw(draws, 30)
    goals, triangles = space.draw(draws, 30)
    excess = []
    for number in range(30):
        ways = space.ways_from(starts[number])
        way = ways.to(goals[number])
        assert way[0].tolist() == starts[number].tolist()
        assert way[-1].tolist() == goals[number].tolist()
        line = LineString(way)
        assert region.buffer(1e-9).covers(line)
        exact_m = shortest_m(region, starts[number], goals[number])
        assert exact_m * (1 - 1e-9) <= line.length <= exact_m * 1.05
        excess.append(line.length / exact_m - 1.0)
        estimate_m = ways.lengths_m(goals[number : number + 1], triangles[number : number + 1])[0]
        assert line.length * (1 - 1e-9) <= estimate_m <= line.length * 1.5 + 0.5
    assert np.mean(excess) < 0.003


def test_way_out_of_sight_is_searched():
    """Round a pillar the short cut for points in sight does not apply."""
    space = mesh(PILLARS)
    start, goal = np.array([1.0, 1.5]), np.array([9.0, 1.6])
    assert len(space.way(start, goal)) > 2
    np.testing.assert_array_equal(space.way(start, goal), space.ways_from(start).to(goal))


def test_way_goes_both_ways():
    """There and back are equally long."""
    space = mesh(SPIRAL)
    there = space.ways_from(np.array([0.1, 0.5])).to(np.array([3.5, 3.9]))
    back = space.ways_from(np.array([3.5, 3.9])).to(np.array([0.1, 0.5]))
    np.testing.assert_allclose(there, back[::-1])
    assert len(there) >= 6


def test_way_between_points_in_sight_is_straight():
    """Nothing is added between two points that see each other, or between a point and itself."""
    space = mesh(PILLARS)
    start, goal = np.array([0.5, 0.2]), np.array([9.5, 0.3])
    assert space.ways_from(start).to(goal).tolist() == space.way(start, goal).tolist() == [[0.5, 0.2], [9.5, 0.3]]
    assert len(space.way(start, start)) == 2
    assert len(space.ways_from(np.array([0.5, 0.2])).to(np.array([0.5, 0.2]))) == 2


@pytest.mark.parametrize("corner", [(0.0, 0.0), (10.0, 6.0), (0.0, 3.0), (5.0, 0.0)])
def test_points_on_the_border_are_reached(corner):
    """Corners and points on walls belong to the region."""
    way = mesh(PILLARS).ways_from(np.array([5.5, 3.0])).to(np.array(corner))
    assert way[-1].tolist() == list(corner)
    assert PILLARS.buffer(1e-9).covers(LineString(way))


def test_random_points_are_even():
    """Counts in 60 cells of an L pass a chi-squared test with a false-alarm rate of 1e-6."""
    region = Polygon([(0, 0), (8, 0), (8, 2), (4, 2), (4, 11), (0, 11)])
    points_m, index = random_points(triangles_of(region), np.random.default_rng(11), 60_000)
    cells = np.floor(points_m).astype(int)
    counts = np.unique(cells, axis=0, return_counts=True)[1]
    assert len(counts) == 52
    expected = len(points_m) / 52
    assert ((counts - expected) ** 2 / expected).sum() < chi2.isf(1e-6, 51)
    triangles = shapely.polygons(triangles_of(region)[index])
    assert (shapely.distance(triangles, shapely.points(points_m)) < 1e-9).all()
