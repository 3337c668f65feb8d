"""Marks and cut tiles against plain lists of them, on floors with turned tiles."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from shapely.geometry import Polygon, box
from snapping_cases import KINDS, MARGIN_M, STEP_M, all_marks, grid_of, local, sites, tile

from layoutopt.errors import InvalidInput
from layoutopt.site import Site, Tiling
from layoutopt.snapping.cut_tiles import cut_tiles
from layoutopt.snapping.marks import marks_of

PLACES_M = np.random.default_rng(5).uniform(0.0, (1.5, 1.2), (60, 2))


def marks(site, kind):
    """Return the marks of a site for plain tags."""
    spacing_m = 0.07 if kind == "chalk" else None
    return marks_of(site, kind, margin_m=MARGIN_M, tag_part="label", chalk_spacing_m=spacing_m)


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=8, deadline=None)
@given(site=sites())
def test_the_mark_of_a_place_is_the_nearest_of_all(kind, site):
    """No mark of the plain list is nearer; on joints no point of a fine row. Cut tiles have their own test."""
    found_m, why = marks(site, kind).nearest(PLACES_M)
    listed_m = all_marks(site, kind)
    nearest_m, _ = cKDTree(listed_m).query(PLACES_M)
    away_m = np.linalg.norm(PLACES_M - found_m, axis=1)
    cut = {(item.column, item.row) for item in cut_tiles(site)} if kind == "centres" else set()
    for place_m, distance_m, least_m, words in zip(PLACES_M, away_m, nearest_m, why, strict=True):
        own = tuple(np.floor(local(place_m, grid_of(site, kind))[0] / grid_of(site, kind).size_m).astype(int))
        around = {(own[0] + across, own[1] + along) for across in (-1, 0, 1) for along in (-1, 0, 1)}
        if not around & cut:
            assert not words
            # The fine row of points on a joint may miss the nearest one by half a step.
            assert least_m - (0.5 * STEP_M if kind == "joints" else 1e-9) <= distance_m <= least_m + 1e-9


@settings(max_examples=10, deadline=None)
@given(site=sites())
def test_every_cut_tile_is_listed_with_what_is_left(site):
    """Tile by tile: the area that lies on the floor, and the rectangle along the tile that holds it."""
    found = {(item.column, item.row): item for item in cut_tiles(site)}
    expected = {}
    reach = int(np.ceil(2.8 / site.tiling.size_m))
    for column in range(-reach, reach + 1):
        for row in range(-reach, reach + 1):
            whole = tile(site.tiling, column, row)
            left = whole.intersection(site.floor)
            if 1e-6 < left.area / whole.area < 1 - 1e-6:
                expected[column, row] = left
    assert set(found) == set(expected)
    for key, left in expected.items():
        item, corners_m = found[key], local(left.exterior.coords, site.tiling)
        assert item.share == pytest.approx(left.area / site.tiling.size_m**2, rel=1e-6, abs=1e-9)
        sides_m = np.ptp(corners_m, axis=0)
        assert (item.width_m, item.height_m) == pytest.approx(tuple(sides_m), abs=1e-9)
        middle_m = (corners_m.min(axis=0) + corners_m.max(axis=0)) / 2
        assert local(item.middle_m, site.tiling)[0] == pytest.approx(middle_m, abs=1e-9)
    assert [(item.row, item.column) for item in cut_tiles(site)] == sorted((row, column) for column, row in found)


def test_known_cut_tiles():
    """A room of 1.2 m by 1 m with tiles of 0.5 m: of the third column 200 mm are left, and nothing else is cut."""
    site = Site(name="room", floor=box(0, 0, 1.2, 1), tiling=Tiling(size_m=0.5))
    found = cut_tiles(site)
    assert [(item.column, item.row) for item in found] == [(2, 0), (2, 1)]
    assert all(item.share == pytest.approx(0.4) for item in found)
    assert [item.width_m for item in found] == pytest.approx([0.2, 0.2])
    assert found[1].middle_m == pytest.approx((1.1, 0.75))
    found_m, why = marks(site, "centres").nearest(np.array([(0.9, 0.1), (1.15, 0.9)]))
    assert found_m[0].tolist() == pytest.approx([0.75, 0.25])
    assert why == ("", "cut tile c2r1: 40 % left, within 200 x 500 mm")
    wider = Site(name="room", floor=box(0, 0, 1.3, 1), tiling=Tiling(size_m=0.5))
    found_m, why = marks(wider, "centres").nearest(np.array([(1.15, 0.9)]))
    assert (found_m[0].tolist(), why) == (pytest.approx([1.15, 0.75]), ("",))
    assert cut_tiles(Site(name="room", floor=box(0, 0, 1.2, 1))) == ()


def test_a_hole_cuts_tiles_and_an_obstacle_does_not():
    """A pillar that the plan leaves out of the floor cuts the tiles about it."""
    tiling = Tiling(size_m=0.5)
    pillar = box(0.6, 0.6, 0.9, 0.9)
    holed = Polygon(box(0, 0, 2, 2).exterior, [pillar.exterior])
    assert [(item.column, item.row) for item in cut_tiles(Site(name="a", floor=holed, tiling=tiling))] == [(1, 1)]
    assert cut_tiles(Site(name="b", floor=box(0, 0, 2, 2), obstacles=(pillar,), tiling=tiling)) == ()


@settings(max_examples=30, deadline=None)
@given(x_mm=st.integers(-1000, 1000), y_mm=st.integers(-1000, 1000))
def test_a_joint_keeps_the_place_along_it(x_mm, y_mm):
    """One coordinate stays, the other goes to the next joint; halfway it goes up or right."""
    site = Site(name="room", floor=box(-2, -2, 2, 2), tiling=Tiling(size_m=0.5))
    place_m = np.array([(x_mm / 1000, y_mm / 1000)])
    found_m = marks(site, "joints").nearest(place_m)[0][0]
    away = [min(number % 500, 500 - number % 500) for number in (x_mm, y_mm)]
    moved = 0 if away[0] <= away[1] else 1
    assert found_m[1 - moved] == pytest.approx(place_m[0][1 - moved], abs=1e-12)
    joint = (place_m[0][moved] * 1000 + 250.0000001) // 500
    assert found_m[moved] == pytest.approx(joint * 0.5, abs=1e-9)


@pytest.mark.parametrize(
    ("kind", "spacing_m", "said"),
    [
        ("corner", None, "Did you mean 'corners'?"),
        ("chalk", None, "Add --chalk-spacing"),
        ("joints", 0.05, "Leave it out"),
        ("centres", None, "has no floor tiles"),
    ],
)
def test_marks_that_cannot_be_are_refused_with_what_to_do(kind, spacing_m, said):
    """Unknown marks, a spacing that is missing or of no use, a floor without tiles."""
    site = Site(name="room", floor=box(0, 0, 2, 2))
    with pytest.raises(InvalidInput) as caught:
        marks_of(site, kind, margin_m=MARGIN_M, tag_part="label", chalk_spacing_m=spacing_m)
    assert said in str(caught.value)
