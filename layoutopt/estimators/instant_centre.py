"""Orientation of a robot with one reader: from two places, and from a turn about an instantaneous centre."""

import math

import numpy as np

from layoutopt.geometry import wrapped
from layoutopt.identity import FloatArray


def initial_orientation(first_m: FloatArray, second_m: FloatArray) -> float:
    """Return the direction from one place to the next, rad: the heading of a robot that drove straight ahead.

    Raises
    ------
    ValueError
        If the places are one.

    References
    ----------
    han2006, Eq. 1-3.

    Examples
    --------
    >>> round(math.degrees(initial_orientation(np.array([0.0, 0.0]), np.array([1.0, 1.0]))), 6)
    45.0
    """
    away_m = np.asarray(second_m, dtype=np.float64) - np.asarray(first_m, dtype=np.float64)
    if not away_m.any():
        raise ValueError("two places that are one have no direction")
    return math.atan2(away_m[1], away_m[0])


def instant_centre(start: tuple[float, float, float], place_m: FloatArray) -> FloatArray | None:
    """Return the centre of the circle on which a robot went from a pose to a place, m; ``None`` if it is a line.

    The centre lies on the normal of the start's heading and on the perpendicular bisector of the chord.

    References
    ----------
    han2006, Eq. 5-6 (instantaneous centre of curvature).
    """
    chord_m = np.asarray(place_m, dtype=np.float64) - start[:2]
    normal = np.array([-math.sin(start[2]), math.cos(start[2])])
    across_m = float(chord_m @ normal)
    squared_m2 = float(chord_m @ chord_m)
    if squared_m2 == 0.0 or abs(across_m) <= 1e-12 * math.sqrt(squared_m2):
        return None
    return np.asarray(start[:2] + squared_m2 / (2.0 * across_m) * normal)


def travelling_orientation(start: tuple[float, float, float], place_m: FloatArray) -> float:
    """Return the heading at a place that a robot reached on a circular arc from a pose, rad.

    The angle of rotation is arccos(1 - l² / 2 R²), to the side of the centre (Eq. 4, 7 and 8): twice the angle
    between the start's heading and the chord.

    Raises
    ------
    ValueError
        If the place is that of the start.

    Examples
    --------
    >>> round(math.degrees(travelling_orientation((0.0, 0.0, 0.0), np.array([1.0, 1.0]))), 6)
    90.0
    """
    chord_rad = initial_orientation(np.array(start[:2]), place_m)
    centre_m = instant_centre(start, place_m)
    if centre_m is None:
        return float(wrapped(2.0 * chord_rad - start[2]))
    radius_m = math.dist(centre_m, start[:2])
    cosine = 1.0 - math.dist(place_m, start[:2]) ** 2 / (2.0 * radius_m**2)
    rotation_rad = math.acos(min(1.0, max(-1.0, cosine)))
    to_left = float(np.dot(centre_m - start[:2], (-math.sin(start[2]), math.cos(start[2])))) > 0.0
    # Driven ahead, an arc of more than half a turn has its chord behind the start.
    if math.cos(chord_rad - start[2]) < 0.0:
        rotation_rad = 2.0 * math.pi - rotation_rad
    return float(wrapped(start[2] + (rotation_rad if to_left else -rotation_rad)))
