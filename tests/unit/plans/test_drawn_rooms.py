"""Rooms, walls and doors from lines."""

import numpy as np
import pytest
from plan_drawings import as_segments, rectangle, two_rooms
from shapely.geometry import Point

from layoutopt.errors import InvalidInput
from layoutopt.plans.drawn_rooms import DoorSymbol, closed_areas, drawn_floor

DOUBLE = np.array(two_rooms()) / 1000.0
SINGLE = [*rectangle(0, 0, 8, 3), (4, 0, 4, 3)]


def floor_of(pairs, doors=(), **settings):
    given = {
        "gap_m": 0.0,
        "thickest_wall_m": 0.5,
        "line_wall_m": 0.1,
        "smallest_room_m2": 1.0,
        "place": "site.plan",
    }
    return drawn_floor(as_segments(pairs), doors, **{**given, **settings})


def areas(rooms):
    return [room.area for room in rooms]


def door(x, y, width, jamb_up=True):
    """A door in a wall along y: hinge at (x, y), jamb above it, and the leaf open along x."""
    jamb = (x, y + width) if jamb_up else (x, y - width)
    return DoorSymbol(hinge_m=(x, y), ends_m=((x + width, y), jamb))


def test_walls_of_two_lines_are_no_floor_and_an_open_door_is():
    drawn = floor_of(DOUBLE)
    assert drawn.polygon.area == pytest.approx(4 * 3 + 4 * 3 + 0.9 * 0.2)
    assert len(drawn.rooms) == 1
    assert any("900 mm from (4.100, 1.050) to (4.100, 1.950)" in note for note in drawn.notes)


def test_a_gap_divides_rooms_and_robots_pass_it_all_the_same():
    drawn = floor_of(DOUBLE, gap_m=1.0)
    assert areas(drawn.rooms) == pytest.approx([12.09, 12.09])
    assert drawn.polygon.geom_type == "Polygon"
    assert drawn.polygon.area == pytest.approx(24.18)
    assert "closed a gap of 900 mm from (4.100, 1.050) to (4.100, 1.950)" in drawn.notes


def test_a_wall_of_one_line_gets_its_thickness_and_divides_the_floor():
    drawn = floor_of(SINGLE)
    assert areas(drawn.rooms) == pytest.approx([12.0, 12.0])
    assert drawn.polygon.geom_type == "MultiPolygon"
    assert drawn.polygon.area == pytest.approx(24.0 - 0.1 * 3.0)
    assert any("3 m of walls drawn by a single line are taken as 100 mm thick" in note for note in drawn.notes)


def test_a_door_symbol_opens_a_wall_of_one_line():
    drawn = floor_of(SINGLE, [door(4.0, 1.0, 0.9)])
    assert drawn.polygon.geom_type == "Polygon"
    assert drawn.polygon.area == pytest.approx(24.0 - 0.1 * 3.0 + 0.1 * 0.9)
    assert areas(drawn.rooms) == pytest.approx([12.0, 12.0])


def test_a_door_symbol_opens_a_wall_of_two_lines_that_runs_on_behind_it():
    walls = [*rectangle(-0.2, -0.2, 8.6, 3.4), *rectangle(0, 0, 4, 3), *rectangle(4.2, 0, 4, 3)]
    assert floor_of(walls).polygon.geom_type == "MultiPolygon"
    drawn = floor_of(walls, [door(4.1, 1.0, 0.9)])
    assert drawn.polygon.geom_type == "Polygon"
    assert drawn.polygon.area == pytest.approx(24.0 + 0.2 * 0.9)


def test_the_end_of_the_arc_at_the_wall_is_the_jamb_whichever_comes_first():
    symbol = door(4.0, 1.0, 0.9)
    swapped = DoorSymbol(hinge_m=symbol.hinge_m, ends_m=symbol.ends_m[::-1])
    assert floor_of(SINGLE, [symbol]).polygon.equals(floor_of(SINGLE, [swapped]).polygon)


def test_a_door_symbol_closes_a_room_whose_wall_is_interrupted():
    walls = [*rectangle(0, 0, 8, 3)[1:], (0, 0, 1, 0), (1.9, 0, 8, 0)]
    with pytest.raises(InvalidInput, match=r"900 mm from \(1\.000, 0\.000\) to \(1\.900, 0\.000\)"):
        floor_of(walls)
    symbol = DoorSymbol(hinge_m=(1.0, 0.0), ends_m=((1.0, 0.9), (1.9, 0.0)))
    assert floor_of(walls, [symbol]).polygon.area == pytest.approx(24.0)


def test_an_arc_away_from_walls_opens_nothing_and_is_told():
    drawn = floor_of(SINGLE, [door(2.0, 1.2, 0.4)])
    assert drawn.polygon.geom_type == "MultiPolygon"
    assert any(
        "1 arc(s) on door layers stand at no wall" in note and "(2.000, 1.200)" in note for note in drawn.notes
    )


def test_columns_and_crossings_of_walls_are_no_rooms():
    """A column of 0.4 m is a wall; so is a net of walls of 0.45 m whose crossings hold a disc of 0.63 m."""
    drawn = floor_of([*rectangle(0, 0, 8, 8), *rectangle(2, 2, 0.4, 0.4)])
    assert areas(drawn.rooms) == pytest.approx([64.0 - 0.16])
    rooms = [rectangle(x, y, 3.0, 3.0) for x in (0.0, 3.45) for y in (0.0, 3.45)]
    net = [*rectangle(-0.45, -0.45, 7.35, 7.35), *(side for room in rooms for side in room)]
    assert areas(floor_of(net).rooms) == pytest.approx([9.0] * 4)


def test_a_wall_that_ends_in_a_room_stands_there_and_its_end_is_told():
    drawn = floor_of([*rectangle(0, 0, 8, 3), (4, 0, 4, 2)])
    assert drawn.polygon.area == pytest.approx(24.0 - 2 * 0.1)
    assert not drawn.polygon.contains(Point(4, 1))
    assert any("1 dangling end(s) of lines: (4.000, 2.000)" in note for note in drawn.notes)


def test_rooms_below_the_least_area_are_left_out_and_told():
    drawn = floor_of([*SINGLE, *rectangle(9, 0, 0.9, 0.9)])
    assert len(drawn.rooms) == 2
    assert any("left out 1 room(s) below 1 m², 0.81 m²" in note for note in drawn.notes)


def test_walls_that_enclose_nothing_are_refused_with_their_ends():
    with pytest.raises(InvalidInput, match="enclose no room") as caught:
        floor_of(rectangle(0, 0, 8, 3)[:3])
    assert "(0.000, 3.000)" in str(caught.value)


def test_lines_of_other_layers_become_areas_and_open_ones_are_told():
    notes = []
    shapes = as_segments([*rectangle(1, 1, 2, 1), (5, 0, 6, 1)])
    assert areas(closed_areas(shapes, "layers.obstacles", "p", notes)) == pytest.approx([2.0])
    assert "(5.000, 0.000)" in notes[0]
    with pytest.raises(InvalidInput, match=r"layers\.metal enclose nothing"):
        closed_areas(as_segments([(5, 0, 6, 1)]), "layers.metal", "p", [])
    assert closed_areas(np.empty((0, 2, 2)), "layers.metal", "p", []) == []
