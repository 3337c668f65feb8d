"""The magnetic field of loops of thin wire, by the exact field of their straight sides."""

import math

import numpy as np

from layoutopt.identity import FloatArray


def polygon_loop_field(offset_m: FloatArray, corners_m: FloatArray) -> FloatArray:
    """Return the field of a plane loop that carries 1 A, shape (..., 3), A/m.

    A side from corner i to corner f adds (R_i × R_f) (R_i + R_f) / (4 pi R_i R_f (R_i R_f + R_i · R_f)), where R_i
    and R_f lead from the corners to the place (Hanson and Hirshman, Physics of Plasmas 9, 4410 (2002)). It is the
    field of direct current: at 13.56 MHz the wavelength is 22 m, and an antenna is small against that. On the wire
    itself, which has no thickness here, the field is not a number.

    Parameters
    ----------
    offset_m
        Places in the frame of the loop, which lies in the plane z = 0; shape (..., 3), m.
    corners_m
        Corners of the loop in the direction of the current, shape (n, 2), m.
    """
    offset_m = np.asarray(offset_m, dtype=np.float64)
    x_m = offset_m[..., 0, None] - corners_m[:, 0]
    y_m = offset_m[..., 1, None] - corners_m[:, 1]
    z_m = offset_m[..., 2, None]
    distance_m = np.sqrt(x_m**2 + y_m**2 + z_m**2)
    next_x_m, next_y_m, next_m = (np.roll(values, -1, axis=-1) for values in (x_m, y_m, distance_m))
    product_m2 = distance_m * next_m
    with np.errstate(invalid="ignore", divide="ignore"):
        weight = (distance_m + next_m) / (
            4.0 * np.pi * product_m2 * (product_m2 + x_m * next_x_m + y_m * next_y_m + z_m**2)
        )
        return np.stack(
            [
                (weight * z_m * (y_m - next_y_m)).sum(axis=-1),
                (weight * z_m * (next_x_m - x_m)).sum(axis=-1),
                (weight * (x_m * next_y_m - y_m * next_x_m)).sum(axis=-1),
            ],
            axis=-1,
        )


def square_loop_field(offset_m: FloatArray, side_m: float) -> FloatArray:
    """Return the field of a square loop about the origin that carries 1 A, shape (..., 3), A/m.

    Its sides lie along x and y, its current runs counter-clockwise seen from above; see `polygon_loop_field`.

    Examples
    --------
    >>> square_loop_field(np.zeros(3), 1.0).round(6).tolist()  # 2 sqrt(2) / pi in the middle
    [0.0, 0.0, 0.900316]
    """
    corners_m = side_m / 2.0 * np.array([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])
    return polygon_loop_field(offset_m, corners_m)


def field_on_axis(side_m: float, depth_m: float) -> float:
    """Return the field of a square loop on its axis, A/m for 1 A, in closed form.

    It is a² / (2 pi (z² + a²/4) sqrt(z² + a²/2)) (textbook; four sides seen from the axis).

    Examples
    --------
    >>> round(field_on_axis(1.0, 0.0), 6)
    0.900316
    """
    squared_m2 = side_m * side_m
    distance_m = math.sqrt(depth_m * depth_m + squared_m2 / 2.0)
    return squared_m2 / (2.0 * math.pi * (depth_m * depth_m + squared_m2 / 4.0) * distance_m)
