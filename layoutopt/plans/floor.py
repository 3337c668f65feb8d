"""What every plan reader returns, and the checks that all of them share.

Coordinates are checked for being finite and in range before any of them reaches GEOS, which calls a polygon with
a corner at ``1e308`` valid and finds its area infinite.
"""

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import shapely
from shapely.errors import ShapelyError
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.polygon import orient

from layoutopt.errors import Fault, InvalidInput
from layoutopt.identity import FloatArray
from layoutopt.plans.joining import check_crossings
from layoutopt.site import INLINE, Zone

LARGEST_COORDINATE_M: Final = 1e6
SMALLEST_AREA_M2: Final = 1e-6
EXTENTS_M: Final = (0.5, 1000.0)
LARGEST_FILE_BYTES: Final = 50_000_000

_MOST_FAULTS: Final = 20
_EXPLANATION: Final = re.compile(r"(?P<reason>[^\[]*)\[(?P<x>\S+) (?P<y>\S+)\]")
_REASONS: Final = {
    "Self-intersection": ("crosses itself", "List the corners in the order in which one walks round."),
    "Ring Self-intersection": ("touches itself", "Split it into two outlines, or move the corner."),
    "Hole lies outside shell": ("has a hole outside it", "Move the hole inside, or drop it."),
    "Holes are nested": ("has a hole within a hole", "Give the inner one as a part of its own."),
    "Nested shells": ("has a part within a part", "Drop one of the two."),
    "Interior is disconnected": ("is cut in two by its holes", "Give the two parts one by one."),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Floor:
    """A floor as a plan shows it.

    Attributes
    ----------
    polygon
        Everything inside the walls; may have holes and several parts.
    obstacles
        Things that the plan shows standing on the floor.
    zones
        Parts of the floor on which no tag may lie, or that are of metal.
    rooms
        Rooms that the plan draws one by one; empty if it shows free space only.
    notes
        What the reader read, left out, simplified or repaired, one sentence each: nothing is done silently.
    source
        Name of the plan file, and by how much it was moved if it was; or ``"inline"``.
    pixel_m
        Side of the pixels whose edges the outlines follow; zero where the plan draws lines.
    """

    polygon: Polygon | MultiPolygon
    obstacles: tuple[Polygon, ...] = ()
    zones: tuple[Zone, ...] = ()
    rooms: tuple[Polygon, ...] = ()
    notes: tuple[str, ...] = ()
    source: str = INLINE
    pixel_m: float = 0.0


def checked_polygon(
    shell: Sequence[Sequence[float]] | FloatArray,
    place: str,
    holes: Sequence[Sequence[Sequence[float]] | FloatArray] = (),
) -> Polygon:
    """Return the polygon of an outline in metres, counter-clockwise; the first corner may be repeated last.

    Raises
    ------
    InvalidInput
        If a corner is not finite or beyond `LARGEST_COORDINATE_M`, there are fewer than three different
        corners, or the outline crosses itself or holds no area; ``place`` and the corner are named.
    """
    polygon = _unchecked_polygon(shell, place, holes)
    check_region(polygon, place)
    return orient(polygon)


def mended_polygon(
    shell: Sequence[Sequence[float]] | FloatArray,
    place: str,
    holes: Sequence[Sequence[Sequence[float]] | FloatArray] = (),
) -> tuple[tuple[Polygon, ...], str]:
    """Return an outline as valid polygons, and what had to be repaired; nothing is said of a valid outline.

    An outline that crosses itself becomes the parts that it encloses (GEOS's structure method: shells joined,
    holes cut out).

    Raises
    ------
    InvalidInput
        As `checked_polygon`, but not for an outline that crosses or touches itself; also if it crosses itself
        so often that its corners must be in no order at all.
    """
    polygon = _unchecked_polygon(shell, place, holes)
    if polygon.is_valid:
        check_region(polygon, place)
        return (orient(polygon),), ""
    corners_m, ring = shapely.get_coordinates(polygon.boundary, return_index=True)
    follows = ring[1:] == ring[:-1]
    sides_m = np.stack([corners_m[:-1][follows], corners_m[1:][follows]], axis=1)
    check_crossings(sides_m, place, "list the corners in the order in which one walks round")
    mended = shapely.make_valid(polygon, method="structure", keep_collapsed=False)
    parts = tuple(orient(part) for part in shapely.get_parts(mended) if part.area >= SMALLEST_AREA_M2)
    if not parts:
        check_region(polygon, place)
    reason, at = _invalidity(polygon)
    return parts, (
        f"repaired {place}, which {reason}{at}: area {polygon.area:.4g} m² became {mended.area:.4g} m² "
        f"in {len(parts)} part(s)"
    )


def _unchecked_polygon(
    shell: Sequence[Sequence[float]] | FloatArray,
    place: str,
    holes: Sequence[Sequence[Sequence[float]] | FloatArray],
) -> Polygon:
    """Return the polygon of rings whose corners are usable numbers."""
    rings = [_checked_ring(shell, place)]
    rings += [_checked_ring(hole, f"{place}.hole[{number}]") for number, hole in enumerate(holes)]
    return Polygon(rings[0], rings[1:])


def check_region(region: Polygon | MultiPolygon, place: str) -> None:
    """Check that a region is finite, valid and not empty.

    Raises
    ------
    InvalidInput
        Otherwise, with the point at which GEOS sees the fault.
    """
    faults = _corner_faults(shapely.get_coordinates(region), place)
    if faults:
        raise InvalidInput(faults)
    # An outline without area is also called invalid, with a reason that helps nobody.
    if region.is_empty or shapely.area(shapely.convex_hull(shapely.get_parts(region))).max() < SMALLEST_AREA_M2:
        raise InvalidInput.at(place, "the outline holds no area", "Its corners must not all lie on one line.")
    if not region.is_valid:
        reason, at = _invalidity(region)
        repair = next((repair for known, repair in _REASONS.values() if known == reason), "")
        raise InvalidInput.at(place, f"the outline {reason}{at}", repair)
    if region.area < SMALLEST_AREA_M2:
        small = f"the outline holds an area of only {region.area:.3g} m²"
        raise InvalidInput.at(place, small, "Check the unit: corners are in metres.")


def _invalidity(region: Polygon | MultiPolygon) -> tuple[str, str]:
    """Return what is wrong with an invalid region, and where: ``"crosses itself"``, ``" at (1, 2) m"``."""
    explanation = shapely.is_valid_reason(region)
    match = _EXPLANATION.fullmatch(explanation)
    if match is None:
        return f"is invalid: {explanation}", ""
    reason, _ = _REASONS.get(match["reason"], (f"is invalid ({match['reason']})", ""))
    return reason, f" at ({float(match['x']):.4g}, {float(match['y']):.4g}) m"


def check_extents(bounds_m: tuple[float, float, float, float], place: str) -> None:
    """Check that a floor is neither smaller than half a metre nor larger than a kilometre.

    Such extents come from a wrong unit far more often than from a real site.

    Raises
    ------
    InvalidInput
        Otherwise, with the extents.
    """
    width_m, height_m = bounds_m[2] - bounds_m[0], bounds_m[3] - bounds_m[1]
    if not all(EXTENTS_M[0] <= side_m <= EXTENTS_M[1] for side_m in (width_m, height_m)):
        raise InvalidInput.at(
            place,
            f"the floor is {width_m:.4g} m x {height_m:.4g} m",
            f"Each side must lie between {EXTENTS_M[0]:g} m and {EXTENTS_M[1]:g} m; check the unit.",
        )


def reason_of(error: Exception) -> str:
    """Return what kind of error it is and the first line of what it says, for a message of ours."""
    lines = str(error).splitlines()
    return f"{type(error).__name__}: {lines[0][:200]}" if lines else type(error).__name__


@contextmanager
def within_bounds(name: str, place: str) -> Iterator[None]:
    """Turn what geometry ends in when there is too much of it into an error that names the file.

    Raises
    ------
    InvalidInput
        If memory ends within the context, or GEOS gives up.
    """
    try:
        yield
    except (MemoryError, ShapelyError) as error:
        raise InvalidInput.at(
            place,
            f"{name} is too intricate: {reason_of(error)}",
            "Leave out what shows no floor or walls.",
        ) from error


def file_bytes(path: Path, place: str, largest: int = LARGEST_FILE_BYTES) -> bytes:
    """Return what a regular file holds.

    Raises
    ------
    InvalidInput
        If the path names no regular file, or one that is empty, larger than ``largest`` or cannot be read.
    """
    try:
        if path.is_dir():
            raise InvalidInput.at(place, f"{_shown(path)} is a folder", "Give the file itself.")
        if not path.is_file():
            state = "is no regular file" if path.exists() else "does not exist"
            raise InvalidInput.at(place, f"{_shown(path)} {state}", "Check the path.")
        size = path.stat().st_size
        if size > largest:
            raise InvalidInput.at(
                place, f"{_shown(path)} has {size / 1e6:.1f} MB", f"At most {largest / 1e6:.3g} MB are read."
            )
        content = path.read_bytes()
    except (OSError, ValueError, RuntimeError) as error:
        # The path itself may be what is wrong: too long, a null byte (ValueError), a loop of links.
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise InvalidInput.at(
            place, f"{_shown(path)} cannot be read: {reason}", "Check its name and the right to read it."
        ) from error
    if not content:
        raise InvalidInput.at(place, f"{_shown(path)} is empty", "Save the plan again, or name another file.")
    return content


def _checked_ring(points: Sequence[Sequence[float]] | FloatArray, place: str) -> FloatArray:
    corners_m = np.asarray(points, dtype=np.float64)
    if corners_m.ndim != 2 or corners_m.shape[1] != 2:
        raise InvalidInput.at(place, "the corners are no pairs of x and y", "Write [[0, 0], [12, 0], [12, 8]].")
    faults = _corner_faults(corners_m, place)
    if faults:
        raise InvalidInput(faults)
    different = len(np.unique(corners_m, axis=0))
    if different < 3:
        raise InvalidInput.at(
            place, f"the outline has {different} different corners", "An outline needs at least three."
        )
    return corners_m


def _corner_faults(corners_m: FloatArray, place: str) -> list[Fault]:
    with np.errstate(invalid="ignore"):
        wrong = np.flatnonzero(~(np.abs(corners_m) < LARGEST_COORDINATE_M).all(axis=1))
    return [
        Fault(
            place=f"{place}[{number}]",
            problem=f"the corner ({corners_m[number, 0]:.6g}, {corners_m[number, 1]:.6g}) m is not usable",
            repair=f"Both numbers must be finite and below {LARGEST_COORDINATE_M:g} m; move the origin.",
        )
        for number in wrong[:_MOST_FAULTS]
    ]


def _shown(path: Path) -> str:
    text = str(path)
    return repr(text if len(text) <= 200 else f"{text[:100]}...{text[-100:]}")
