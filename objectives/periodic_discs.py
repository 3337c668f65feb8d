"""Discs that repeat over the plane: where a robot must be for its antennas to read a tag.

A robot at p with heading h reads a tag with antenna j if the tag lies within r_j of p + R(h) a_j, that is if p
lies in the disc of radius r_j about the tag less R(h) a_j. N tags a cell and M antennas make N M discs a cell, and
the robot is blind where none of them is. All that invisibility asks for follows from these discs.
"""

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from layoutopt.geometry import reduced_cell, turned
from layoutopt.identity import FloatArray, by_content, read_only
from layoutopt.layout import TagPattern


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PeriodicDiscs:
    """Closed discs that repeat with a cell.

    Attributes
    ----------
    cell_m
        Rows are the two period vectors, shape (2, 2), m.
    centre_m, radius_m
        Discs of one cell, shapes (n, 2) and (n,), m.

    Raises
    ------
    ValueError
        If there is no disc, a radius is not positive, the cell has no area, or a number is not finite.
    """

    cell_m: FloatArray
    centre_m: FloatArray
    radius_m: FloatArray
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        """Freeze the arrays and check them."""
        object.__setattr__(self, "cell_m", _checked_cell(self.cell_m))
        object.__setattr__(self, "centre_m", read_only(self.centre_m, (-1, 2)))
        object.__setattr__(self, "radius_m", _checked_radii(self.radius_m, len(self.centre_m)))

    @property
    def cell_area_m2(self) -> float:
        """Area of one cell."""
        return float(abs(np.linalg.det(self.cell_m)))

    def at(self, direction_rad: float) -> "PeriodicDiscs":
        """Return the discs that count on a way in that direction: always these."""
        return self


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AntennaGroup:
    """Antennas that move together over a pattern, on a robot that keeps an angle to its way.

    Attributes
    ----------
    cell_m
        Rows are the two period vectors of the pattern, shape (2, 2), m.
    tag_m
        Tags of one cell, shape (n, 2), m.
    antenna_m, radius_m
        Antenna centres in ``base_link``, shape (m, 2), and the radius within which each reads, shape (m,), m.
    heading_rad
        Heading less direction of travel: zero for a robot that drives ahead, a quarter turn to the left for one
        that drives to its right.

    Raises
    ------
    ValueError
        If there is no tag or antenna, a radius is not positive, the cell has no area, or a number is not finite.
    """

    cell_m: FloatArray
    tag_m: FloatArray
    antenna_m: FloatArray
    radius_m: FloatArray
    heading_rad: float = 0.0
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        """Freeze the arrays and check them."""
        object.__setattr__(self, "cell_m", _checked_cell(self.cell_m))
        object.__setattr__(self, "tag_m", read_only(self.tag_m, (-1, 2)))
        object.__setattr__(self, "antenna_m", read_only(self.antenna_m, (-1, 2)))
        object.__setattr__(self, "radius_m", _checked_radii(self.radius_m, len(self.antenna_m)))
        object.__setattr__(self, "heading_rad", float(self.heading_rad))
        if len(self.tag_m) == 0:
            raise ValueError("a cell without tags shows nothing: at least one tag a cell is needed")
        if not math.isfinite(self.heading_rad):
            raise ValueError(f"a heading must be finite, got {self.heading_rad}")

    @property
    def cell_area_m2(self) -> float:
        """Area of one cell."""
        return float(abs(np.linalg.det(self.cell_m)))

    def at(self, direction_rad: float) -> PeriodicDiscs:
        """Return the discs that count on a way in that direction."""
        return self.facing(direction_rad + self.heading_rad)

    def facing(self, heading_rad: float) -> PeriodicDiscs:
        """Return the discs of a robot that keeps a heading on the floor, whatever its direction of travel."""
        lever_m = turned(self.antenna_m, heading_rad)
        return PeriodicDiscs(
            cell_m=self.cell_m,
            centre_m=(self.tag_m[:, None, :] - lever_m[None, :, :]).reshape(-1, 2),
            radius_m=np.tile(self.radius_m, len(self.tag_m)),
        )


Sight = PeriodicDiscs | AntennaGroup
"""What decides whether a robot sees a tag: discs that stay as they are, or that turn with its heading."""


def one_antenna(pattern: TagPattern, radius_m: float) -> PeriodicDiscs:
    """Return the discs in which a single antenna of a read radius sees a tag of the pattern.

    Raises
    ------
    ValueError
        If the radius is not positive and finite, or the pattern has no period or no tag.
    """
    cell_m = _period_of(pattern)
    if not (radius_m > 0.0 and math.isfinite(radius_m)):
        raise ValueError(f"a read radius must be positive and finite, got {radius_m}")
    return PeriodicDiscs(
        cell_m=cell_m, centre_m=pattern.points_m, radius_m=np.full(len(pattern.points_m), radius_m)
    )


def antenna_group(
    pattern: TagPattern, antenna_m: FloatArray, radius_m: FloatArray, *, heading_rad: float = 0.0
) -> AntennaGroup:
    """Return a group of antennas over a pattern; ``heading_rad`` is the heading less the direction of travel.

    Raises
    ------
    ValueError
        If a radius is not positive and finite, there is no antenna, or the pattern has no period or no tag.
    """
    return AntennaGroup(
        cell_m=_period_of(pattern),
        tag_m=pattern.points_m,
        antenna_m=antenna_m,
        radius_m=radius_m,
        heading_rad=heading_rad,
    )


class Columns(NamedTuple):
    """A sight as compiled code wants it: disc k lies at ``centre[k]`` less ``lever[k]`` turned by the heading.

    ``cell`` is reduced; ``ahead_rad`` is the heading less the direction of travel.
    """

    cell: FloatArray
    centre: FloatArray
    lever: FloatArray
    radius: FloatArray
    ahead_rad: float


def columns(sight: Sight) -> Columns:
    """Return the discs of a sight with their lever arms, shape (n, ...)."""
    cell = reduced_cell(sight.cell_m)
    if isinstance(sight, PeriodicDiscs):
        return Columns(
            cell, np.array(sight.centre_m), np.zeros_like(sight.centre_m), np.array(sight.radius_m), 0.0
        )
    tags, antennas = len(sight.tag_m), len(sight.antenna_m)
    return Columns(
        cell,
        np.repeat(sight.tag_m, antennas, axis=0),
        np.tile(sight.antenna_m, (tags, 1)),
        np.tile(sight.radius_m, tags),
        sight.heading_rad,
    )


def _period_of(pattern: TagPattern) -> FloatArray:
    if pattern.cell_m is None:
        raise ValueError("invisibility of a pattern needs its period, and this one is laid once: give it a cell")
    if len(pattern.points_m) == 0:
        raise ValueError("a cell without tags shows nothing: at least one tag a cell is needed")
    return pattern.cell_m


def _checked_cell(cell_m: FloatArray) -> FloatArray:
    cell_m = read_only(cell_m, (2, 2))
    if not abs(np.linalg.det(cell_m)) > 0.0:
        raise ValueError("a cell needs two period vectors that span an area")
    return cell_m


def _checked_radii(radius_m: FloatArray, count: int) -> FloatArray:
    radius_m = np.asarray(radius_m, dtype=np.float64).reshape(-1)
    if len(radius_m) != count or count == 0:
        raise ValueError(f"{count} centres and {len(radius_m)} radii: at least one disc, and a radius for each")
    wrong = radius_m[~((radius_m > 0.0) & np.isfinite(radius_m))]
    if len(wrong):
        raise ValueError(f"a read radius must be positive and finite, got {wrong[0]}")
    return read_only(radius_m, (-1,))
