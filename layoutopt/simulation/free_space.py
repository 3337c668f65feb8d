"""Short ways and random points within a polygon, by a triangle mesh of it.

A constrained Delaunay triangulation covers the polygon exactly, so that narrow doors are neither lost nor
widened as on a grid. A way is searched over points on the edges that two triangles share, and the string is
then pulled tight through the triangles that it crosses.

References
----------
D. T. Lee, F. P. Preparata, *Euclidean shortest paths in the presence of rectilinear barriers*, Networks 14
(1984): the funnel that pulls the string. L. Aleksandrov et al., *Determining approximate shortest paths on
weighted polyhedral surfaces*, J. ACM 52 (2005): points on edges as nodes of the search.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from layoutopt.identity import FloatArray, IntArray

# The nodes of the search on one shared edge. Taut strings bend at the ends of edges, so the outer nodes lie almost
# there; border edges are cut so that triangles are not too slender. On the floors of nav2's depot and sandbox maps
# ways are then 0.06 % longer than the shortest on average and 1.4 % at most (150 pairs each, against the
# visibility graph), because one of two nearly equal ways round an obstacle is taken.
_NODE_SPACING_M: Final = 0.4
_FEWEST_NODES: Final = 5
_MOST_NODES: Final = 12
_OUTER_SHARE: Final = 0.02
_BORDER_EDGE_M: Final = 1.0


def triangles_of(region: BaseGeometry) -> FloatArray:
    """Return triangles that together are the region's polygons, counter-clockwise, shape (t, 3, 2)."""
    found = shapely.get_parts(shapely.constrained_delaunay_triangles(region))
    corners_m = shapely.get_coordinates(found).reshape(-1, 4, 2)[:, :3]
    first, second = corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0]
    clockwise = first[:, 0] * second[:, 1] < first[:, 1] * second[:, 0]
    corners_m[clockwise] = corners_m[clockwise, ::-1]
    return np.asarray(corners_m)


def random_points(triangles_m: FloatArray, draws: np.random.Generator, count: int) -> tuple[FloatArray, IntArray]:
    """Return points drawn evenly over triangles, shape (count, 2), and the triangle that holds each."""
    sides = np.diff(triangles_m, axis=1)
    area = np.abs(sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0])
    cumulative = np.cumsum(area)
    uniform = draws.random((count, 3))
    index = np.minimum(np.searchsorted(cumulative, uniform[:, 0] * cumulative[-1], side="right"), len(area) - 1)
    # Turk, Graphics Gems (1990), "Generating random points in triangles".
    root, along = np.sqrt(uniform[:, 1]), uniform[:, 2]
    weights = np.stack([1.0 - root, root * (1.0 - along), root * along], axis=1)
    return np.einsum("ni,nix->nx", weights, triangles_m[index]), index.astype(np.int64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FreeSpace:
    """A polygon in one part, with its mesh.

    Attributes
    ----------
    region
        The polygon itself.
    triangles_m
        Corners, shape (t, 3, 2), m; edge k of a triangle runs from corner k to corner k + 1.
    across
        Triangle beyond each edge, -1 for none, shape (t, 3).
    edge
        Number of each edge if two triangles share it, else -1, shape (t, 3).
    edge_nodes
        Nodes of the search on each edge, filled up with -1, shape (t, 3, k).
    nodes_m, node_edge
        Nodes of the search, shape (m, 2), m, and the edge on which each lies, shape (m,).
    graph
        Distances between the nodes of each triangle, shape (m, m).
    """

    region: Polygon
    triangles_m: FloatArray
    across: IntArray
    edge: IntArray
    edge_nodes: IntArray
    nodes_m: FloatArray
    node_edge: IntArray
    graph: csr_matrix

    def draw(self, draws: np.random.Generator, count: int) -> tuple[FloatArray, IntArray]:
        """Return points drawn evenly over the region, shape (count, 2), and their triangles."""
        return random_points(self.triangles_m, draws, count)

    def triangle_at(self, point_m: FloatArray) -> int:
        """Return the triangle that holds a point of the region, the nearest by its edges if rounding hides it."""
        start = self.triangles_m
        side = np.roll(start, -1, axis=1) - start
        to_point = point_m - start
        cross = side[..., 0] * to_point[..., 1] - side[..., 1] * to_point[..., 0]
        return int(np.argmax((cross / np.hypot(side[..., 0], side[..., 1])).min(axis=1)))

    def way(self, start_m: FloatArray, goal_m: FloatArray) -> FloatArray:
        """Return the corners of a short way between two points of the region, both included, shape (k, 2)."""
        straight = np.stack([start_m, goal_m])
        if self.region.covers(LineString(straight)):
            return straight
        return self.ways_from(start_m).to(goal_m)

    def ways_from(self, source_m: FloatArray) -> "Ways":
        """Return short ways from a point of the region to everywhere else."""
        triangle = self.triangle_at(source_m)
        nodes = self.nodes_of(triangle)
        near_m = np.hypot(*(self.nodes_m[nodes] - source_m).T)
        # The source is one more node with edges to those of its triangle, none leading back.
        count = len(self.nodes_m)
        graph = csr_matrix(
            (
                np.concatenate([self.graph.data, np.maximum(near_m, 1e-12)]),
                np.concatenate([self.graph.indices, nodes]),
                np.append(self.graph.indptr, self.graph.nnz + len(nodes)),
            ),
            shape=(count + 1, count + 1),
        )
        lengths_m, before = dijkstra(graph, indices=[count], return_predecessors=True)
        if not np.isfinite(lengths_m).all():
            raise RuntimeError("the mesh of a polygon in one part is not connected")
        return Ways(space=self, source_m=source_m, triangle=triangle, length_m=lengths_m[0], before=before[0])

    def nodes_of(self, triangle: int) -> IntArray:
        """Return the nodes on the edges of a triangle."""
        nodes = self.edge_nodes[triangle]
        return np.asarray(nodes[nodes >= 0])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ways:
    """Short ways from one source: length to each node of the mesh, and the node before it."""

    space: FreeSpace
    source_m: FloatArray
    triangle: int
    length_m: FloatArray
    before: NDArray[np.int32]

    def lengths_m(self, points_m: FloatArray, triangles: IntArray) -> FloatArray:
        """Return the approximate length of the way to points in given triangles, shape (n,)."""
        space = self.space
        nodes = space.edge_nodes[triangles]
        last_m = np.linalg.norm(space.nodes_m[nodes] - points_m[:, None, None, :], axis=-1)
        total_m = np.where(nodes >= 0, self.length_m[nodes] + last_m, np.inf).min(axis=(1, 2))
        direct_m = np.hypot(*(points_m - self.source_m).T)
        return np.asarray(np.where(triangles == self.triangle, direct_m, total_m))

    def to(self, goal_m: FloatArray) -> FloatArray:
        """Return the corners of the way to a point of the region, source and goal included, shape (k, 2).

        The way is the shortest of all that pass obstacles on the same sides.
        """
        space, triangle = self.space, self.triangle
        goal = space.triangle_at(goal_m)
        if goal == triangle:
            return np.stack([self.source_m, goal_m])
        last = space.nodes_of(goal)
        node = int(last[np.argmin(self.length_m[last] + np.hypot(*(space.nodes_m[last] - goal_m).T))])
        edges = []
        while node < len(space.nodes_m):
            edges.append(int(space.node_edge[node]))
            node = int(self.before[node])
        return _pulled(self.source_m, goal_m, self._gates(edges[::-1], goal))

    def _gates(self, edges: list[int], goal: int) -> list[tuple[complex, complex]]:
        """Return right and left end of each edge that the way crosses."""
        space, triangle = self.space, self.triangle
        gates = []
        for edge, following in zip(edges, [*edges[1:], None], strict=True):
            # A node may be touched without its edge being crossed, when the next lies in the same triangle.
            if triangle == goal if following is None else following in space.edge[triangle]:
                continue
            side = int(np.flatnonzero(space.edge[triangle] == edge)[0])
            right, left = space.triangles_m[triangle, side], space.triangles_m[triangle, (side + 1) % 3]
            gates.append((complex(*right), complex(*left)))
            triangle = int(space.across[triangle, side])
        return gates


def mesh(region: Polygon) -> FreeSpace:
    """Return a polygon with its mesh."""
    triangles_m = triangles_of(shapely.segmentize(region, _BORDER_EDGE_M))
    corners_m, index = np.unique(triangles_m.reshape(-1, 2), axis=0, return_inverse=True)
    corner = index.reshape(-1, 3)
    ends = np.stack([corner, np.roll(corner, -1, axis=1)], axis=-1).reshape(-1, 2)
    unique, edge, shared = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True, return_counts=True)
    inner = shared == 2
    across = np.full(len(ends), -1, dtype=np.int64)
    order = np.argsort(edge, kind="stable")
    pairs = order[inner[edge[order]]].reshape(-1, 2)
    across[pairs] = pairs[:, ::-1] // 3
    nodes_m, node_edge, nodes = _edge_nodes(corners_m[unique[inner]])
    number = np.where(inner, np.cumsum(inner) - 1, -1)[edge].reshape(-1, 3)
    edge_nodes = np.where(number[:, :, None] >= 0, nodes[number], -1)
    shapely.prepare(region)
    return FreeSpace(
        region=region,
        triangles_m=triangles_m,
        across=across.reshape(-1, 3),
        edge=number,
        edge_nodes=edge_nodes,
        nodes_m=nodes_m,
        node_edge=node_edge,
        graph=_graph(edge_nodes, nodes_m),
    )


def _edge_nodes(ends_m: FloatArray) -> tuple[FloatArray, IntArray, IntArray]:
    """Return the nodes on edges, shape (e, 2, 2): their places, the edge of each, and the nodes of each edge."""
    length_m = np.linalg.norm(ends_m[:, 1] - ends_m[:, 0], axis=1)
    count = np.clip(np.ceil(length_m / _NODE_SPACING_M), _FEWEST_NODES, _MOST_NODES).astype(np.int64)
    place = np.arange(_MOST_NODES)
    used = place < count[:, None]
    edge, nth = np.nonzero(used)
    share = _OUTER_SHARE + (1.0 - 2.0 * _OUTER_SHARE) * nth / (count[edge] - 1)
    nodes_m = ends_m[edge, 0] + share[:, None] * (ends_m[edge, 1] - ends_m[edge, 0])
    nodes = np.where(used, np.cumsum(used).reshape(used.shape) - 1, -1)
    return nodes_m, edge, nodes


def _graph(edge_nodes: IntArray, nodes_m: FloatArray) -> csr_matrix:
    """Return the distances between nodes on different edges of the same triangle, both ways."""
    pairs = []
    for first, second in ((0, 1), (1, 2), (2, 0)):
        one, other = np.broadcast_arrays(edge_nodes[:, first, :, None], edge_nodes[:, second, None, :])
        both = (one >= 0) & (other >= 0)
        pairs += [np.stack([one[both], other[both]]), np.stack([other[both], one[both]])]
    row, column = np.concatenate(pairs, axis=1)
    length_m = np.linalg.norm(nodes_m[row] - nodes_m[column], axis=1)
    return csr_matrix((length_m, (row, column)), shape=(len(nodes_m), len(nodes_m)))


def _pulled(start_m: FloatArray, goal_m: FloatArray, gates: list[tuple[complex, complex]]) -> FloatArray:
    """Return the shortest line through gates (right, left), which is straight between some of their ends."""
    apex, goal = complex(*start_m), complex(*goal_m)
    gates = [*gates, (goal, goal)]
    way = [apex]
    right, left = gates[0]
    right_at = left_at = 0
    number = 1
    while number < len(gates):
        new_right, new_left = gates[number]
        if _turn(apex, right, new_right) >= 0.0:
            if apex == right or _turn(apex, left, new_right) < 0.0:
                right, right_at = new_right, number
            else:
                way.append(left)
                apex, number = left, left_at
                right, right_at = apex, number
                number += 1
                continue
        if _turn(apex, left, new_left) <= 0.0:
            if apex == left or _turn(apex, right, new_left) > 0.0:
                left, left_at = new_left, number
            else:
                way.append(right)
                apex, number = right, right_at
                left, left_at = apex, number
                number += 1
                continue
        number += 1
    way.append(goal)
    kept = [point for point, before in zip(way, [None, *way[:-1]], strict=True) if point != before]
    return np.array([(point.real, point.imag) for point in kept])


def _turn(origin: complex, first: complex, second: complex) -> float:
    """Return twice the area of a triangle: positive if ``second`` lies to the left of ``first``."""
    return ((first - origin).conjugate() * (second - origin)).imag
