"""Compiled arrangement of equal circles about a periodic set; `circles` has the plain twin of `arcs`."""

import math

import numpy as np
from numba import njit

from layoutopt.identity import FloatArray, IntArray

TOUCHING = 1e-12
"""Circles whose centres are this share short of two radii apart count as touching: their lens has no area."""
SHORTEST_RAD = 1e-11
"""Arcs between corners that are one but for rounding, as where three circles meet in a point."""


@njit(cache=True, error_model="numpy")
def arcs(
    points_m: FloatArray,
    near_start: IntArray,
    near_m: FloatArray,
    radius_m: float,
) -> tuple[IntArray, FloatArray, IntArray, IntArray]:
    """Return the arcs of all circles of one cell, and who reads on them.

    Parameters
    ----------
    points_m
        Centres of the circles of one cell, shape (n, 2).
    near_start, near_m
        Centres closer than two radii to centre i, without itself, are the rows ``near_start[i]`` to
        ``near_start[i + 1]`` of ``near_m``, shape (k, 2).
    radius_m
        Radius of all circles.

    Returns
    -------
    circle, shape (a,)
        Which circle each arc is a part of.
    ends_rad, shape (a, 2)
        Its ends, counter-clockwise; the second may exceed 2 pi.
    held_start, shape (a + 1,); held
        The near centres whose discs hold the arc, as rows of ``near_m``.
    """
    count = len(points_m)
    widest = 0
    for index in range(count):
        widest = max(widest, near_start[index + 1] - near_start[index])
    corners, cutting = np.empty(2 * widest + 1), np.empty(widest, np.int64)
    room = 2 * len(near_m) + count
    circle = np.empty(room, np.int64)
    ends = np.empty((room, 2))
    held_start = np.zeros(room + 1, np.int64)
    held = np.empty(max(64, 4 * room), np.int64)
    made, kept = 0, 0
    for index in range(count):
        x, y = points_m[index, 0], points_m[index, 1]
        first, last = near_start[index], near_start[index + 1]
        found = 0
        for other in range(first, last):
            across, up = near_m[other, 0] - x, near_m[other, 1] - y
            half = math.hypot(across, up) / (2.0 * radius_m)
            if half >= 1.0 - TOUCHING:
                continue
            towards, wide = math.atan2(up, across), math.acos(half)
            corners[found] = (towards - wide) % (2.0 * math.pi)
            corners[found + 1] = (towards + wide) % (2.0 * math.pi)
            cutting[found // 2] = other
            found += 2
        if found == 0:
            circle[made], ends[made, 0], ends[made, 1] = index, 0.0, 2.0 * math.pi
            made += 1
            held_start[made] = kept
            continue
        on_circle = np.sort(corners[:found])
        for corner in range(found):
            start = on_circle[corner]
            stop = on_circle[corner + 1] if corner + 1 < found else on_circle[0] + 2.0 * math.pi
            if stop - start < SHORTEST_RAD:
                continue
            middle = 0.5 * (start + stop)
            at_x, at_y = x + radius_m * math.cos(middle), y + radius_m * math.sin(middle)
            if kept + last - first > len(held):
                larger = np.empty(2 * (kept + last - first), np.int64)
                larger[:kept] = held[:kept]
                held = larger
            # A disc that only touches holds no arc, though rounding may put its one point inside.
            for number in range(found // 2):
                other = cutting[number]
                if (near_m[other, 0] - at_x) ** 2 + (near_m[other, 1] - at_y) ** 2 < radius_m**2:
                    held[kept] = other
                    kept += 1
            circle[made], ends[made, 0], ends[made, 1] = index, start, stop
            made += 1
            held_start[made] = kept
    return circle[:made], ends[:made], held_start[: made + 1], held[:kept]


@njit(cache=True, error_model="numpy")
def estimates(
    points_m: FloatArray,
    circle: IntArray,
    held_start: IntArray,
    held: IntArray,
    near_m: FloatArray,
    centroid: bool,
) -> tuple[FloatArray, FloatArray]:
    """Return the estimate from the tags on either side of each arc, shape (a, 2) each; NaN where none is read.

    The estimate is the mean of the tags' places, or the middle of their extremes. Inside means within the circle
    that the arc belongs to, whose own tag is read there.
    """
    made = len(circle)
    inside, outside = np.empty((made, 2)), np.empty((made, 2))
    for arc in range(made):
        size = held_start[arc + 1] - held_start[arc]
        for axis in range(2):
            own = points_m[circle[arc], axis]
            low, high, total = math.inf, -math.inf, 0.0
            for row in range(held_start[arc], held_start[arc + 1]):
                value = near_m[held[row], axis]
                low, high, total = min(low, value), max(high, value), total + value
            if centroid:
                inside[arc, axis] = (total + own) / (size + 1)
                outside[arc, axis] = total / size if size else math.nan
            else:
                inside[arc, axis] = 0.5 * (min(low, own) + max(high, own))
                outside[arc, axis] = 0.5 * (low + high) if size else math.nan
    return inside, outside


@njit(cache=True, error_model="numpy")
def distance_flux(
    centre_m: FloatArray,
    ends_rad: FloatArray,
    from_m: FloatArray,
    radius_m: float,
    nodes: FloatArray,
    weights: FloatArray,
) -> FloatArray:
    """Return for each arc the integral of |p - e| (p - e) . u r / 3 over its angle, shape (a,).

    p is the point of the arc, u the unit vector from its centre and e the row of ``from_m``. Over the boundary of
    a region these sum up to the integral of |p - e| over its area (Green's theorem, since the divergence of |p -
    e| (p - e) / 3 is |p - e|). Where e is NaN the flux is zero.
    """
    flux = np.zeros(len(centre_m))
    for arc in range(len(centre_m)):
        q_x, q_y = centre_m[arc, 0] - from_m[arc, 0], centre_m[arc, 1] - from_m[arc, 1]
        if math.isnan(q_x):
            continue
        away, nearest = math.hypot(q_x, q_y), math.atan2(-q_y, -q_x)
        first = _flux_up_to(ends_rad[arc, 0] - nearest, away, radius_m, nodes, weights)
        flux[arc] = (
            (_flux_up_to(ends_rad[arc, 1] - nearest, away, radius_m, nodes, weights) - first) * radius_m / 3.0
        )
    return flux


@njit(cache=True, error_model="numpy")
def _flux_up_to(angle: float, away: float, radius: float, nodes: FloatArray, weights: FloatArray) -> float:
    """Return the integral of sqrt(q² + r² - 2 q r cos t) (r - q cos t) for t from 0 to an angle, q = ``away``.

    The integrand is even and has the period 2 pi. Near t = 0 the root is nearly singular if q is about r: the way
    is cut into pieces that grow by a factor of three, each with a Gauss rule, whose error then falls with every
    node alike.
    """
    turns = math.floor(angle / (2.0 * math.pi) + 0.5)
    rest = angle - 2.0 * math.pi * turns
    total = 0.0
    if turns != 0.0:
        total = 2.0 * turns * _half_flux(math.pi, away, radius, nodes, weights)
    part = _half_flux(abs(rest), away, radius, nodes, weights)
    return total + (part if rest >= 0.0 else -part)


@njit(cache=True, error_model="numpy")
def _half_flux(end: float, away: float, radius: float, nodes: FloatArray, weights: FloatArray) -> float:
    total, start = 0.0, 0.0
    stop = max(abs(away - radius) / radius, 1e-7)
    while start < end:
        stop = min(stop, end)
        half, middle = 0.5 * (stop - start), 0.5 * (stop + start)
        for node in range(len(nodes)):
            # 1 - cos t without cancellation keeps the digits of a root that is nearly zero.
            versine = 2.0 * math.sin(0.5 * (middle + half * nodes[node])) ** 2
            root = math.sqrt((away - radius) ** 2 + 2.0 * away * radius * versine)
            total += half * weights[node] * root * (radius - away + away * versine)
        start, stop = stop, 3.0 * stop
    return total


@njit(cache=True, error_model="numpy")
def farthest_m(centre_m: FloatArray, ends_rad: FloatArray, from_m: FloatArray, radius_m: float) -> FloatArray:
    """Return the largest distance from e to a point of each arc, shape (a,); NaN where e is NaN."""
    largest = np.empty(len(centre_m))
    for arc in range(len(centre_m)):
        q_x, q_y = centre_m[arc, 0] - from_m[arc, 0], centre_m[arc, 1] - from_m[arc, 1]
        start, stop = ends_rad[arc, 0], ends_rad[arc, 1]
        best = math.nan
        if not math.isnan(q_x):
            opposite = math.atan2(q_y, q_x)
            opposite += 2.0 * math.pi * math.ceil((start - opposite) / (2.0 * math.pi))
            if opposite <= stop:
                best = math.hypot(q_x, q_y) + radius_m
            else:
                first = math.hypot(q_x + radius_m * math.cos(start), q_y + radius_m * math.sin(start))
                second = math.hypot(q_x + radius_m * math.cos(stop), q_y + radius_m * math.sin(stop))
                best = max(first, second)
        largest[arc] = best
    return largest


@njit(cache=True, error_model="numpy")
def enclosing_circles(
    group_start: IntArray, centre_m: FloatArray, ends_rad: FloatArray, radius_m: float, slack_m: float
) -> tuple[FloatArray, FloatArray]:
    """Return centre and radius of the smallest circle round the arcs of each group, shapes (g, 2) and (g,).

    Arcs of group i are the rows ``group_start[i]`` to ``group_start[i + 1]``. Starting from the ends of its arcs,
    the farthest point of all arcs from the middle of the last circle joins those that held it, until it lies on
    the circle: each step's radius is a lower bound of the answer, and the farthest distance an upper one.
    """
    groups = len(group_start) - 1
    middle_m, size_m = np.empty((groups, 2)), np.empty(groups)
    holding = np.empty((4, 2))
    for group in range(groups):
        first, last = group_start[group], group_start[group + 1]
        holding[0, 0] = centre_m[first, 0] + radius_m * math.cos(ends_rad[first, 0])
        holding[0, 1] = centre_m[first, 1] + radius_m * math.sin(ends_rad[first, 0])
        count, x, y, size = 1, holding[0, 0], holding[0, 1], 0.0
        for _ in range(1000):
            best, far_x, far_y = -1.0, 0.0, 0.0
            for arc in range(first, last):
                c_x, c_y = centre_m[arc, 0], centre_m[arc, 1]
                start, stop = ends_rad[arc, 0], ends_rad[arc, 1]
                opposite = math.atan2(c_y - y, c_x - x)
                opposite += 2.0 * math.pi * math.ceil((start - opposite) / (2.0 * math.pi))
                for angle in (opposite if opposite < stop else start, start, stop):
                    p_x, p_y = c_x + radius_m * math.cos(angle), c_y + radius_m * math.sin(angle)
                    distance = math.hypot(p_x - x, p_y - y)
                    if distance > best:
                        best, far_x, far_y = distance, p_x, p_y
            if best <= size + slack_m:
                break
            holding[count, 0], holding[count, 1] = far_x, far_y
            count, x, y, size = _held_by(holding, count + 1, slack_m)
        middle_m[group, 0], middle_m[group, 1], size_m[group] = x, y, max(size, best)
    return middle_m, size_m


@njit(cache=True, error_model="numpy")
def _held_by(points: FloatArray, count: int, slack: float) -> tuple[int, float, float, float]:
    """Return the smallest circle round up to four points as number of points that hold it, x, y and radius.

    Those that hold it are moved to the front of ``points``.
    """
    best_x, best_y, best_size = 0.0, 0.0, math.inf
    best = (0, 0, -1)
    for i in range(count):
        for j in range(i + 1, count):
            x, y = 0.5 * (points[i, 0] + points[j, 0]), 0.5 * (points[i, 1] + points[j, 1])
            size = 0.5 * math.hypot(points[i, 0] - points[j, 0], points[i, 1] - points[j, 1])
            if size < best_size and _holds(points, count, x, y, size + 0.5 * slack):
                best_x, best_y, best_size, best = x, y, size, (i, j, -1)
    if best_size == math.inf:
        for i in range(count):
            for j in range(i + 1, count):
                for k in range(j + 1, count):
                    b_x, b_y = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
                    c_x, c_y = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1]
                    twice = 2.0 * (b_x * c_y - b_y * c_x)
                    if twice == 0.0:
                        continue
                    b, c = b_x * b_x + b_y * b_y, c_x * c_x + c_y * c_y
                    x, y = (c_y * b - b_y * c) / twice, (b_x * c - c_x * b) / twice
                    size = math.hypot(x, y)
                    x, y = x + points[i, 0], y + points[i, 1]
                    if size < best_size and _holds(points, count, x, y, size + 0.5 * slack):
                        best_x, best_y, best_size, best = x, y, size, (i, j, k)
    kept = 0
    for index in best:
        if index >= 0:
            first, second = points[index, 0], points[index, 1]
            points[index, 0], points[index, 1] = points[kept, 0], points[kept, 1]
            points[kept, 0], points[kept, 1] = first, second
            kept += 1
    return kept, best_x, best_y, best_size


@njit(cache=True, error_model="numpy")
def _holds(points: FloatArray, count: int, x: float, y: float, size: float) -> bool:
    inside = True
    for index in range(count):
        inside = inside and math.hypot(points[index, 0] - x, points[index, 1] - y) <= size
    return inside


@njit(cache=True, error_model="numpy")
def read_sets(
    near_step: IntArray, circle: IntArray, held_start: IntArray, held: IntArray
) -> tuple[IntArray, IntArray]:
    """Return for either side of each arc which tags are read there, as a number, and the cell of its frame.

    Parameters
    ----------
    near_step
        Of each near centre: number of the point of its cell, and the steps to that cell, shape (k, 3).

    Returns
    -------
    number, shape (2, a)
        Inside and outside of each arc: equal for sets that are the same but for a shift by whole cells, different
        for any two others but for a chance of 2^-64. Zero for the empty set.
    cell, shape (2, a, 2)
        Steps to the cell of the set's first tag: moved back by these, equal sets lie in one place.
    """
    made = len(circle)
    number = np.zeros((2, made), np.int64)
    cell = np.zeros((2, made, 2), np.int64)
    for arc in range(made):
        first, last = held_start[arc], held_start[arc + 1]
        for side in range(2):
            if side == 1 and first == last:
                continue
            tag, i, j = circle[arc], 0, 0
            if side == 1:
                tag, i, j = near_step[held[first], 0], near_step[held[first], 1], near_step[held[first], 2]
            for row in range(first, last):
                step = near_step[held[row]]
                if step[0] < tag or (step[0] == tag and (step[1] < i or (step[1] == i and step[2] < j))):
                    tag, i, j = step[0], step[1], step[2]
            total = _mixed(circle[arc], -i, -j) if side == 0 else np.uint64(0)
            for row in range(first, last):
                step = near_step[held[row]]
                total += _mixed(step[0], step[1] - i, step[2] - j)
            number[side, arc] = np.int64(total)
            cell[side, arc, 0], cell[side, arc, 1] = i, j
    return number, cell


@njit(cache=True, error_model="numpy")
def _mixed(tag: int, i: int, j: int) -> int:
    """Return a number of 64 well mixed bits (the finaliser of SplitMix64), whose sums tell sets apart."""
    word = (np.uint64(tag) << np.uint64(40)) ^ (np.uint64(i + 2**19) << np.uint64(20)) ^ np.uint64(j + 2**19)
    word += np.uint64(0x9E3779B97F4A7C15)
    word = (word ^ (word >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    word = (word ^ (word >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return int(word ^ (word >> np.uint64(31)))
