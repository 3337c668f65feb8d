"""The key plan: tiles by the names of the tag map, numbers that have room and cross no line."""

import numpy as np
import pytest
from shapely.geometry import Polygon, box

from layoutopt.drawings.fields import fields_of
from layoutopt.drawings.frame import TitleBlock
from layoutopt.drawings.key_plan import key_plan
from layoutopt.drawings.sheet import Text
from layoutopt.drawings.text_boxes import text_box
from layoutopt.site import Site, Tiling

BLOCK = TitleBlock(
    **dict.fromkeys(("legal_owner", "identification_number", "date_of_issue", "sheet_number"), "x"),
    **dict.fromkeys(("title", "approval_person", "creator", "document_type"), "x"),
)


def made(site, size_m):
    """Return the key plan of a site in fields of a size, and their numbers."""
    numbers = {field: f"A-{201 + place}" for place, field in enumerate(fields_of(site, (size_m, size_m)))}
    return key_plan(site, numbers, plan_scale=20, block=BLOCK), numbers


def labels(sheet, layer):
    """Return the texts of a layer in the view of the sheet."""
    return [item for item in sheet.views[0].entities if isinstance(item, Text) and item.layer == layer]


@pytest.mark.parametrize("origin_m", [(0.0, 0.0), (0.2, 0.1), (-3.3, 7.7)])
def test_tiles_of_the_key_plan_are_those_of_the_tag_map(origin_m):
    """A label stands at a tile of its column or row, from the first to the last that the floor meets."""
    tiling = Tiling(size_m=0.5, origin_m=origin_m)
    site = Site(name="L", floor=Polygon([(1, -1), (13, -1), (13, 3), (6, 3), (6, 8), (1, 8)]), tiling=tiling)
    sheet, _ = made(site, 6.0)
    found = {"c": [], "r": []}
    for label in labels(sheet, "A-DIMS"):
        axis = "cr".index(label.text[0])
        place_m = np.zeros((1, 2))
        place_m[0, axis] = label.position_mm[axis] / 1000.0
        assert site.tile_of(place_m)[0, axis] == int(label.text[1:])
        found[label.text[0]].append(int(label.text[1:]))
    corners = site.tile_of(np.array([(1.001, -0.999), (12.999, 7.999)]))
    for axis, numbers in enumerate(found.values()):
        assert (numbers[0], numbers[-1]) == tuple(corners[:, axis])


def test_turned_tiles_have_no_columns_along_the_edges():
    """Nothing stands there rather than something wrong; the note says where their names are."""
    sheet, _ = made(Site(name="hall", floor=box(0, 0, 10, 6), tiling=Tiling(size_m=0.5, angle_rad=0.1)), 5.0)
    assert labels(sheet, "A-DIMS") == []
    assert any("tags.csv" in item.text for item in sheet.entities if isinstance(item, Text))


@pytest.mark.parametrize(
    ("side_m", "size_m", "paper"), [(20.0, 5.0, "A3"), (100.0, 4.7, "A2"), (2000.0, 40.0, "A0")]
)
def test_many_fields_are_on_larger_paper_or_it_is_said_how_they_are_numbered(side_m, size_m, paper):
    """Those of a hall of 100 m have no room for numbers on A3; those of one of 2 km have none at all."""
    sheet, numbers = made(Site(name="hall", floor=box(0, 0, side_m, side_m)), size_m)
    assert sheet.paper == paper
    numbered = {label.text for label in labels(sheet, "A-DATUM")} >= set(numbers.values())
    assert numbered == (side_m < 1000.0)
    counted = [item.text for item in sheet.entities if isinstance(item, Text) and "row by row" in item.text]
    assert bool(counted) != numbered
    assert all("A-201 and on" in text for text in counted)


def test_numbers_give_way_to_what_stands_in_the_middle_of_a_field():
    """An obstacle there would be crossed by the number."""
    column = box(4.4, 4.4, 5.6, 5.6)
    sheet, _ = made(Site(name="hall", floor=box(0, 0, 10, 10), obstacles=(column,)), 10.0)
    (number,) = [label for label in labels(sheet, "A-DATUM") if label.text == "A-201"]
    edges_m = np.array(text_box(number, sheet.views[0].scale)) * sheet.views[0].scale / 1000.0
    assert not box(*edges_m).intersects(column.boundary)
    assert box(0, 0, 10, 10).contains(box(*edges_m))
