"""The tilted square tile of kim2010."""

import math
from typing import Final

import numpy as np

from layoutopt.geometry import turned
from layoutopt.identity import FloatArray
from layoutopt.layout import TagPattern
from layoutopt.patterns.checks import check_lengths, check_tile
from layoutopt.protocols import PatternCard

CARD: Final = PatternCard(
    summary="Tiles of four tags on a square that is turned about the tile's middle.",
    reference="kim2010, Fig. 5c and 6c",
)


def tilted(*, tile_m: float, angle_rad: float, radius_m: float | None = None) -> TagPattern:
    """Return square tiles whose four tags, half a tile apart, are turned by an angle about the tile's middle.

    The tiles lie side by side, so this is no turned lattice: the period stays the tile. An angle and its
    complement to 90° are mirror images; 0 and 90° are the square pattern.

    With ``radius_m`` the read discs have to lie within their tile without overlap, as kim2010 demands. For an
    angle the tile has to be at least 2 r / (1 - cos(45° - angle) / sqrt(2)): 4 r at 0°, 6.83 r at 45°.

    Raises
    ------
    ValueError
        If a length is not positive and finite, the angle lies outside 0 to 90°, or the tile is too small for discs
        of the radius at this angle.
    """
    check_lengths(tile_m=tile_m)
    check_angle(angle_rad)
    if radius_m is not None:
        check_lengths(radius_m=radius_m)
        check_tile(
            tile_m,
            least_tile_m(radius_m, angle_rad),
            f"“discs of {1e3 * radius_m:g} mm inside a tile tilted by {math.degrees(angle_rad):g}°”",
        )
    parameters = {"tile_m": tile_m, "angle_rad": angle_rad}
    return TagPattern(
        name="tilted",
        points_m=tile_points_m(tile_m, angle_rad),
        cell_m=np.eye(2) * tile_m,
        parameters=parameters if radius_m is None else {**parameters, "radius_m": radius_m},
    )


def tile_points_m(tile_m: float, angle_rad: float) -> FloatArray:
    """Return the four tags of a tile whose lower left corner is the origin, shape (4, 2)."""
    quarter_m = tile_m / 4.0
    corners = quarter_m * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    return turned(corners, angle_rad) + tile_m / 2.0


def least_tile_m(radius_m: float, angle_rad: float) -> float:
    """Return the smallest tile that holds the four discs at a tilt, without overlap."""
    return 2.0 * radius_m / (1.0 - math.cos(math.pi / 4.0 - angle_rad) / math.sqrt(2.0))


def check_angle(angle_rad: float) -> None:
    """Check that a tilt lies between 0 and 90°.

    Raises
    ------
    ValueError
        If it does not.
    """
    if not -1e-12 <= angle_rad <= math.pi / 2.0 + 1e-12:
        raise ValueError(
            f"angle must lie between 0 and 90°, after which tiles repeat, got {math.degrees(angle_rad):g}°"
        )
