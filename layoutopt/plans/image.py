"""Floor plans from images: light pixels are floor, dark ones are walls, two known points give the scale.

Light paper around the building is not floor. Everything light that reaches the border of the image is outside,
also through doors, unless a gap is given: then openings up to that width are closed first. In mathematical
morphology that is a closing of the walls (Serra, *Image Analysis and Mathematical Morphology*, 1982), done here
by distances: the outside is what a disc of that diameter can reach from the border.
"""

import math
from pathlib import Path
from typing import Final

import numpy as np

from layoutopt.errors import InvalidInput, did_you_mean
from layoutopt.identity import BoolArray
from layoutopt.plans.floor import Floor, within_bounds
from layoutopt.plans.outlines import check_cells, floor_of_cells
from layoutopt.plans.placing import Scale
from layoutopt.plans.png import read_png
from layoutopt.protocols import Card

CARD: Final = Card(
    summary="PNG image of a plan: light pixels within the walls are floor, two known points give the scale.",
    reference="Serra, Image Analysis and Mathematical Morphology (1982), for the closing of doors",
)
_BORDERS: Final = ("outside", "floor")
# Two points that are nearer give a scale that is wrong by more than 2 % if each is off by a pixel.
_NEAREST_POINTS_PX: Final = 100.0


def read_image(
    path: Path,
    *,
    place: str,
    scale: Scale | None = None,
    threshold: float = 0.5,
    border: str = "outside",
    gap_m: float = 0.0,
    tolerance_m: float | None = None,
    smallest_room_m2: float = 1.0,
) -> Floor:
    """Return the floor of an image, with (0, 0) at its lower left corner and y up.

    Outlines follow the pixels and are then simplified as those of an occupancy map.

    Parameters
    ----------
    path
        A PNG file.
    place
        Where the path was given, for messages.
    scale
        Two points and their distance; they should lie far apart.
    threshold
        Lightness from which a pixel is floor, 0 (black) to 1 (white).
    border
        ``"outside"`` if what reaches the border of the image is not floor, ``"floor"`` if it is.
    gap_m
        Widest opening to the outside, such as an entrance, that is closed.
    tolerance_m
        How far a point of an outline may move; by default one pixel, less if the area would change by 1 %.
    smallest_room_m2
        Parts of the floor below this area are left out.

    Raises
    ------
    InvalidInput
        If the image cannot be read, the scale is missing or cannot be used, or no floor is found.
    """
    picture = read_png(path, place=place)
    height, width = picture.lightness.shape
    cell_m = _cell_m(scale, width, height, picture.name, place)
    if border not in _BORDERS:
        raise InvalidInput.at(place, f"border = {border!r} is no rule", did_you_mean(border, _BORDERS))
    free = ((picture.lightness >= threshold * 255.0) & picture.painted)[::-1]
    if not free.any():
        raise InvalidInput.at(
            place, f"{picture.name} has no pixel as light as {threshold:g} of white", "Give a lower threshold."
        )
    check_cells(free, cell_m, place)
    cell_m2 = cell_m**2
    notes = [
        f"{picture.name}: {width} x {height} pixels of {cell_m:.4g} m from the distance of two points",
        f"lighter than {threshold:g} of white: {free.sum() * cell_m2:.4g} m²",
    ]
    if not picture.painted.all():
        notes.append(f"transparent, so no floor: {(~picture.painted).sum() * cell_m2:.4g} m²")
    if border == "outside":
        # Such a gap closes everything off, and the search for the outside would need its room around the image.
        if gap_m >= cell_m * min(width, height):
            side_m = cell_m * min(width, height)
            raise InvalidInput.at(
                place,
                f"a gap of {gap_m:g} m is wider than {picture.name}, whose shorter side has {side_m:.4g} m",
                'Give the width of a door, such as gap = "1.2 m"; check the scale.',
            )
        with within_bounds(picture.name, place):
            outside = _outside(free, gap_m / cell_m)
        notes.append(f"outside the walls, so no floor: {outside.sum() * cell_m2:.4g} m²")
        if gap_m > 0.0:
            notes.append(f"openings to the outside up to {gap_m:g} m were closed")
        free = free & ~outside
    if not free.any():
        raise InvalidInput.at(
            place,
            f"no light part of {picture.name} is closed off from the border of the image",
            'Check threshold; give gap = "1.2 m" to close doors to the outside, or border = "floor".',
        )
    with within_bounds(picture.name, place):
        floor, told = floor_of_cells(
            free, cell_m, (0.0, 0.0, 0.0), tolerance_m=tolerance_m, minimum_area_m2=smallest_room_m2, place=place
        )
    return Floor(polygon=floor, notes=(*notes, *told), source=picture.name, pixel_m=cell_m)


def _cell_m(scale: Scale | None, width: int, height: int, name: str, place: str) -> float:
    """Return the side of a pixel."""
    scale_text = 'scale = { first = [120, 460], second = [920, 460], distance = "10 m" }'
    example = f'Write plan = {{ file = "{name}", {scale_text} }}, with two pixels whose distance you know.'
    if scale is None:
        raise InvalidInput.at(place, f"the scale of {name} is not stated", example)
    for column, row in (scale.first_px, scale.second_px):
        if not (0.0 <= column <= width and 0.0 <= row <= height):
            raise InvalidInput.at(
                place,
                f"the point ({column:g}, {row:g}) of the scale lies outside {name}, {width} x {height} pixels",
                "Count pixels to the right of and below the upper left corner.",
            )
    apart_px = math.dist(scale.first_px, scale.second_px)
    if apart_px < _NEAREST_POINTS_PX:
        raise InvalidInput.at(
            place,
            f"the two points of the scale are {apart_px:.3g} pixels apart",
            f"Give points that are at least {_NEAREST_POINTS_PX:g} apart, or the scale is too rough.",
        )
    return scale.distance_m / apart_px


def _outside(free: BoolArray, gap: float) -> BoolArray:
    """Return the free cells that a disc of diameter ``gap`` cells covers on its way in from the border."""
    from scipy import ndimage

    if free.all():
        return free
    # The strip between a wall and the border of the image must not be too narrow for the disc.
    margin = math.ceil(gap / 2.0) + 1
    open_field = np.pad(free, margin, constant_values=True)
    room = ndimage.distance_transform_edt(open_field) > gap / 2.0
    labels, _ = ndimage.label(room)
    reached = labels == labels[0, 0]
    if gap > 0.0:
        reached = ndimage.distance_transform_edt(~reached) <= gap / 2.0
    inner = (slice(margin, -margin), slice(margin, -margin))
    return np.asarray(reached[inner] & free, dtype=np.bool_)
