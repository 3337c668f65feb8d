"""The figure of a plan shows its rooms and where the robot can drive."""

import pytest
from shapely import MultiPolygon, Point, box

from layoutopt.plots.figures import as_svg, new_axes
from layoutopt.plots.floor_rooms import draw_floor_rooms
from layoutopt.site import Site, Zone

ROOMS = (box(0, 0, 5, 3), box(5.2, 0, 9, 3))
SITE = Site(name="hall", floor=MultiPolygon(list(ROOMS)), zones=(Zone(name="dock", region=box(0, 0, 1, 1)),))


def test_rooms_are_named_by_number_and_area_within_themselves():
    ax = draw_floor_rooms(site=SITE, rooms=ROOMS, reachable=box(0.5, 0.5, 4.5, 2.5))
    names = [text for text in ax.texts if "m²" in text.get_text()]
    assert [name.get_text() for name in names] == ["1\n15.0 m²", "2\n11.4 m²"]
    for text, room in zip(names, ROOMS, strict=True):
        assert room.contains(Point(text.get_position()))
    assert [text.get_text() for text in ax.get_legend().get_texts()] == [
        "where the robot's centre can drive (8.0 m²)",
        "rooms (2)",
    ]


def test_a_plan_is_drawn_to_scale_into_given_axes():
    ax = new_axes(100.0, 60.0)
    assert draw_floor_rooms(site=SITE, rooms=(), reachable=box(0, 0, 0, 0), ax=ax) is ax
    assert ax.get_aspect() == 1.0
    low, high = ax.get_xlim()
    assert (low, high) == pytest.approx((-0.27, 9.27))
    assert as_svg(ax).startswith("<svg")
