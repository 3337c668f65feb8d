"""Checks that all plan readers share."""

import os
from pathlib import Path

import numpy as np
import pytest
import shapely
from shapely.geometry import MultiPolygon, Polygon, box

from layoutopt.errors import InvalidInput
from layoutopt.plans.floor import check_extents, check_region, checked_polygon, file_bytes, within_bounds

SQUARE = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)]


@pytest.mark.parametrize("corners", [SQUARE, SQUARE[::-1], [*SQUARE, SQUARE[0]]])
def test_outline_in_any_order_is_the_same_counter_clockwise_polygon(corners):
    """Direction and a repeated first corner do not matter."""
    polygon = checked_polygon(corners, "site.floor")
    assert polygon.area == 16.0
    assert polygon.exterior.is_ccw
    assert len(polygon.exterior.coords) == 5


def test_hole_is_cut_out():
    """A hole takes its area away."""
    assert checked_polygon(SQUARE, "floor", [[(1, 1), (2, 1), (2, 3), (1, 3)]]).area == 14.0


@pytest.mark.parametrize(
    ("corners", "holes", "words"),
    [
        ([(0, 0), (2, 2), (2, 0), (0, 2)], (), ["crosses itself at (1, 1) m", "order"]),
        ([(0, 0), (4, 0), (4, 4), (2, 0), (0, 4)], (), ["touches itself at (2, 0) m"]),
        ([(0, 0), (1, 1), (2, 2)], (), ["holds no area", "one line"]),
        ([(0, 0), (1, 1), (0, 0), (1, 1)], (), ["2 different corners", "at least three"]),
        ([(0, 0, 0), (1, 1, 0), (0, 1, 0)], (), ["pairs of x and y"]),
        (SQUARE, [[(6, 6), (7, 6), (7, 7)]], ["hole outside", "(6, 6) m"]),
        ([(0, 0), (1e-4, 0), (1e-4, 1e-4)], (), ["holds no area"]),
    ],
)
def test_bad_outline_is_refused_with_place_and_reason(corners, holes, words):
    """Each fault of an outline names the place and what is wrong where."""
    with pytest.raises(InvalidInput) as caught:
        checked_polygon(corners, "plan.toml:3 site.floor", holes)
    for word in ["plan.toml:3 site.floor", *words]:
        assert word in str(caught.value)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e6, -1e308])
def test_unusable_number_never_reaches_geos(bad):
    """Numbers that are not finite or far off are named by their corner; GEOS would warn, which fails here."""
    with pytest.raises(InvalidInput, match=r"site\.floor\[2\]: the corner"):
        checked_polygon([(0, 0), (4, 0), (4, bad), (0, 4)], "site.floor")
    if np.isfinite(bad):
        with pytest.raises(InvalidInput, match=r"floor\[2\]"):
            check_region(Polygon([(0, 0), (4, 0), (4, bad), (0, 4)]), "floor")


def test_every_bad_corner_is_reported():
    """Two bad corners give two faults."""
    with pytest.raises(InvalidInput) as caught:
        checked_polygon([(0, np.nan), (4, 0), (4, np.inf), (0, 4)], "floor")
    assert [fault.place for fault in caught.value.faults] == ["floor[0]", "floor[2]"]


def test_region_of_several_parts_is_checked_as_a_whole():
    """Parts that overlap are refused, parts apart are not."""
    check_region(MultiPolygon([box(0, 0, 1, 1), box(2, 0, 3, 1)]), "plan")
    with pytest.raises(InvalidInput, match="outline"):
        check_region(MultiPolygon([box(0, 0, 2, 2), box(1, 1, 3, 3)]), "plan")
    with pytest.raises(InvalidInput, match="no area"):
        check_region(Polygon(), "plan")


@pytest.mark.parametrize(("width", "height"), [(0.49, 3.0), (3.0, 1000.5), (12400.0, 8150.0)])
def test_absurd_extents_are_refused_with_the_extents(width, height):
    """A plan in the wrong unit shows by its size."""
    with pytest.raises(InvalidInput, match=f"{width:.4g} m x {height:.4g} m".replace("+", r"\+")):
        check_extents((1.0, 2.0, 1.0 + width, 2.0 + height), "plan")


def test_extents_at_their_limits_are_accepted():
    """Half a metre and a kilometre are still floors."""
    check_extents((0.0, 0.0, 0.5, 1000.0), "plan")


def test_file_is_read_as_it_is(tmp_path):
    """The bytes come back unchanged."""
    (tmp_path / "plan file.yaml").write_bytes(b"\x00abc")
    assert file_bytes(tmp_path / "plan file.yaml", "site.plan") == b"\x00abc"


def test_paths_that_are_no_readable_file_are_refused(tmp_path):
    """Folder, nothing, pipe, loop of links, empty file, endless name, null byte: one clear error each, no hang."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    (tmp_path / "empty").write_bytes(b"")
    (tmp_path / "large").write_bytes(b"x" * 11)
    wrong = {
        tmp_path: "is a folder",
        tmp_path / "none.yaml": "does not exist",
        tmp_path / "pipe": "no regular file",
        tmp_path / "loop": "loop",
        tmp_path / "empty": "is empty",
        tmp_path / ("x" * 5000): "cannot be read",
        Path("a\0b"): "a",
        tmp_path / "large": "MB",
    }
    for path, words in wrong.items():
        with pytest.raises(InvalidInput, match=words) as caught:
            file_bytes(path, "site.plan", largest=10)
        assert str(caught.value).startswith("site.plan: ")
        assert len(str(caught.value)) < 600


def test_too_much_geometry_is_an_error_that_names_the_file():
    """Memory that ends and geometry that GEOS gives up are faults of the plan; a bug of ours is none."""
    for raised in (MemoryError(), shapely.errors.GEOSException("TopologyException: side location conflict")):
        refused = pytest.raises(InvalidInput, match=r"site\.plan: hall\.dxf is too intricate")
        with refused, within_bounds("hall.dxf", "site.plan"):
            raise raised
    with pytest.raises(KeyError), within_bounds("hall.dxf", "site.plan"):
        raise KeyError("bug")
