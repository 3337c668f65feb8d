"""Rooms of floors that draw none."""

import pytest
import shapely
from shapely import box

from layoutopt.plans.rooms import rooms_of


def areas(floor, *passage):
    return [round(room.area, 6) for room in rooms_of(floor, *passage)]


def test_doors_divide_rooms_and_wide_openings_do_not():
    """Two rooms with an opening of 1.2 m are two; with one of 1.4 m they are one."""
    rooms = [box(0, 0, 4, 3), box(4.2, 0, 9.2, 3)]
    narrow, wide = (shapely.union_all([*rooms, box(4, 1, 4.2, 1 + width)]) for width in (1.2, 1.4))
    assert areas(narrow) == [15.0, 12.0]
    assert areas(wide) == [round(27.0 + 0.2 * 1.4, 6)]
    assert areas(wide, 1.5) == [15.0, 12.0]


def test_rooms_never_overlap_and_lie_on_the_floor():
    """An L with a pinch at its corner: the arms would share the corner."""
    floor = box(0, 0, 6, 2).union(box(4, 0, 6, 6)).difference(box(4.0, 1.2, 4.9, 2.2))
    rooms = rooms_of(floor)
    assert sum(room.area for room in rooms) == pytest.approx(shapely.union_all(rooms).area)
    assert shapely.union_all(rooms).difference(floor).area == pytest.approx(0.0, abs=1e-9)


def test_niches_and_cupboards_are_no_rooms():
    assert areas(box(0, 0, 0.9, 0.9)) == []
    assert areas(box(0, 0, 4, 3).union(box(4, 0, 4.4, 1))) == [12.0]
