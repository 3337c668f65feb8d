"""Outlines written as corners."""

import numpy as np
import pytest

from layoutopt.errors import InvalidInput
from layoutopt.plans.inline import floor_from, polygon_from


def test_corners_take_units():
    """Strings with units and bare metres mix."""
    outline = [["-300 mm", "-0.25 m"], ["0.3 m", -0.25], [0.3, "25 cm"], ["-30 cm", 0.25]]
    assert polygon_from(outline, "robots.outline").bounds == (-0.3, -0.25, 0.3, 0.25)


def test_array_and_tuples_are_corners_too():
    """Python users give arrays or tuples."""
    corners = ((0, 0), (2, 0), (2, 1))
    assert polygon_from(corners, "x").equals(polygon_from(np.array(corners), "x"))


def test_floor_keeps_its_source():
    """An inline floor says so and has no notes."""
    floor = floor_from([[0, 0], [12, 0], [12, 8], [0, 8]], "site.floor")
    assert (floor.polygon.area, floor.source, floor.notes) == (96.0, "inline", ())


def test_each_bad_corner_is_named():
    """All corners that cannot be read are reported at once, by index."""
    with pytest.raises(InvalidInput) as caught:
        polygon_from(
            [[0, 0], [1], "12", [1, "2 kg"], [True, 0], [float("nan"), 0], None, [10**400, 0]], "site.floor"
        )
    assert [fault.place for fault in caught.value.faults] == [f"site.floor[{n}]" for n in (1, 2, 3, 4, 5, 6, 7)]
    assert all("[x, y]" in fault.repair for fault in caught.value.faults)
    assert len(str(caught.value)) < 3000


@pytest.mark.parametrize("points", ["floor", 12, None, [], {}, b"ab", {"x": 1}])
def test_what_is_no_list_is_refused_with_an_example(points):
    """The message shows how a floor is written."""
    with pytest.raises(InvalidInput, match=r"\[\[0, 0\], \[12, 0\]"):
        polygon_from(points, "site.floor")


def test_millimetres_taken_for_metres_are_noticed():
    """A floor of 12 km is refused, a pillar of 10 cm is not."""
    with pytest.raises(InvalidInput, match=r"1\.2e\+04 m x 8000 m"):
        floor_from([[0, 0], [12000, 0], [12000, 8000], [0, 8000]], "site.floor")
    assert polygon_from([[0, 0], [0.1, 0], [0.1, 0.1]], "site.obstacle").area == pytest.approx(0.005)
