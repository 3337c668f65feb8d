"""Buildings whose rooms are known, drawn in many ways."""

import re
import time

import numpy as np
import pytest
from plan_drawings import building, shuffled

from layoutopt.plans.drawn_rooms import drawn_floor
from layoutopt.plans.rooms import rooms_of

WALL_M, DOOR_M = 0.2, 0.9
# Snapping to the grid of 0.1 mm moves a wall of 5 m by at most that.
TOLERANCE_M2 = 5e-3


def floor_of(segments_m, gap_m=1.0):
    return drawn_floor(
        segments_m, (), gap_m=gap_m, thickest_wall_m=0.5, line_wall_m=0.1, smallest_room_m2=1.0, place="p"
    )


@pytest.mark.parametrize("seed", range(12))
def test_rooms_of_a_building_are_found_however_it_is_drawn(seed):
    """Turned, cut, doubled and out of order: rooms, doors and floor have the areas that they were drawn with."""
    draws = np.random.default_rng(seed)
    widths, depths = draws.uniform(2.0, 6.0, draws.integers(1, 5)), draws.uniform(2.0, 6.0, draws.integers(1, 5))
    lines = shuffled(building(widths, depths, WALL_M, DOOR_M), draws, draws.uniform(-np.pi, np.pi))
    drawn = floor_of(lines)
    rooms = np.multiply.outer(widths, depths)
    doors = (len(widths) - 1) * len(depths) + len(widths) * (len(depths) - 1)
    assert len(drawn.rooms) == rooms.size
    assert drawn.polygon.geom_type == "Polygon"
    assert drawn.polygon.area == pytest.approx(
        rooms.sum() + doors * DOOR_M * WALL_M, abs=TOLERANCE_M2 * rooms.size
    )
    # Each room has half of the thickness of its doors.
    assert sum(room.area for room in drawn.rooms) == pytest.approx(drawn.polygon.area, abs=1e-6)
    told = [note for note in drawn.notes if re.match(r"closed a gap of (899\.9|900|900\.1) mm", note)]
    assert len(told) == min(doors, 10)
    assert [note for note in drawn.notes if "more gaps" in note] == (
        [f"closed {doors - 10} more gaps up to 1 m"] if doors > 10 else []
    )
    assert not any("dangling" in note or "single line" in note for note in drawn.notes)


@pytest.mark.parametrize("seed", range(3))
def test_rooms_from_passages_are_those_that_were_drawn(seed):
    """Where no gap is closed the floor is one room of the drawing, and narrow passages divide it all the same."""
    draws = np.random.default_rng(seed)
    widths, depths = draws.uniform(2.0, 6.0, 3), draws.uniform(2.0, 6.0, 2)
    drawn = floor_of(building(widths, depths, WALL_M, DOOR_M), gap_m=0.0)
    assert len(drawn.rooms) == 1
    found = sorted(room.area for room in rooms_of(drawn.polygon))
    assert found == pytest.approx(sorted(np.multiply.outer(widths, depths).ravel()), abs=TOLERANCE_M2)


def test_effort_grows_little_faster_than_the_building():
    """10,000 m² take less than ten times as long as a quarter of them; squared it would be sixteen times."""
    taken = []
    for side in (10, 20):
        lines = building([5.0] * side, [5.0] * side, WALL_M, DOOR_M)
        began = time.process_time()
        drawn = floor_of(lines)
        taken.append(time.process_time() - began)
        assert len(drawn.rooms) == side**2
    assert drawn.polygon.area == pytest.approx(400 * 25.0 + 760 * DOOR_M * WALL_M, abs=0.1)
    assert taken[1] < 10.0 * taken[0]
