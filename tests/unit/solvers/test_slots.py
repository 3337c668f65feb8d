"""Slots of every kind lie where tags may lie, and only there."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Point, box

from layoutopt.site import Site, Tiling, Zone
from solvers.slots import centre_slots, grid_slots, joint_slots, listed_slots

MARGIN_M = 0.02


@st.composite
def sites(draw):
    """Random halls with an obstacle, a metal plate, a zone without tags and turned tiles."""
    corner = st.floats(0.0, 2.0)
    obstacle = box(x := draw(corner), y := draw(corner), x + 0.5, y + 0.3)
    metal = box(x := draw(corner), y := draw(corner), x + 0.4, y + 0.6)
    barred = box(x := draw(corner), y := draw(corner), x + 0.3, y + 0.3)
    return Site(
        name="hall",
        floor=box(0.0, 0.0, 3.0, 2.6),
        obstacles=(obstacle,),
        zones=(
            Zone(name="plate", region=metal, metal=True),
            Zone(name="bare", region=barred, tags=False),
            Zone(name="dock", region=box(0.1, 0.1, 1.0, 1.0)),
        ),
        tiling=Tiling(
            size_m=draw(st.floats(0.2, 0.5)),
            origin_m=(draw(corner), draw(corner)),
            angle_rad=draw(st.floats(-3.0, 3.0)),
        ),
    )


def _barred(site):
    return shapely.union_all([*site.obstacles, *(zone.region for zone in site.zones if not zone.taggable)])


@settings(max_examples=25)
@given(sites())
def test_slots_keep_the_margin_from_whatever_bars_tags(site):
    """No slot is nearer than the margin to wall, obstacle or barred zone, and all lie on their grid."""
    barred, tiling = _barred(site), site.tiling
    for slots in (joint_slots(site, MARGIN_M), centre_slots(site, MARGIN_M), grid_slots(site, 0.17, MARGIN_M)):
        assert len(slots) == len(slots.place)
        for place_m in slots.xy_m:
            point = Point(place_m)
            assert site.floor.contains(point)
            assert site.floor.exterior.distance(point) >= MARGIN_M - 1e-6
            assert barred.distance(point) >= MARGIN_M * (1.0 - 1e-6) - 1e-6 or barred.distance(point) == 0.0
            assert not barred.contains(point)
    cos, sin = np.cos(tiling.angle_rad), np.sin(tiling.angle_rad)
    turn = np.array([[cos, -sin], [sin, cos]])
    for slots, half in ((joint_slots(site, MARGIN_M), 0.0), (centre_slots(site, MARGIN_M), 0.5)):
        steps = ((slots.xy_m - tiling.origin_m) @ turn) / tiling.size_m - half
        assert np.allclose(steps, np.round(steps), atol=1e-6)


@settings(max_examples=25)
@given(sites())
def test_no_place_of_a_grid_with_room_is_left_out(site):
    """Counted point by point, the grid has as many slots as places well away from everything."""
    pitch_m = 0.17
    slots = grid_slots(site, pitch_m, MARGIN_M)
    known = {tuple(place) for place in slots.place.tolist()}
    barred = _barred(site)
    for column in range(18):
        for row in range(16):
            point = Point(column * pitch_m, row * pitch_m)
            near = min(site.floor.exterior.distance(point), barred.distance(point))
            # A mitred corner keeps more than the distance.
            if near > MARGIN_M * 1.5 and site.floor.contains(point) and not barred.contains(point):
                assert (column, row) in known


def test_listed_places_where_no_tag_may_lie_are_refused_with_the_first_of_them():
    """Off the floor and on metal are counted together."""
    site = Site(
        name="hall", floor=box(0, 0, 2, 2), zones=(Zone(name="plate", region=box(1, 1, 2, 2), metal=True),)
    )
    assert len(listed_slots(site, [(0.5, 0.5), (0.9, 0.2)], MARGIN_M)) == 2
    with pytest.raises(ValueError, match=r"2 of 3 places .* the first at \(1\.5, 1\.5\) m"):
        listed_slots(site, [(0.5, 0.5), (1.5, 1.5), (3.0, 0.0)], MARGIN_M)
    with pytest.raises(ValueError, match="finite"):
        listed_slots(site, [(0.5, np.nan)], MARGIN_M)


def test_a_floor_without_tiles_has_no_joints_and_a_grid_needs_a_pitch():
    """Both are told."""
    site = Site(name="hall", floor=box(0, 0, 2, 2))
    for kind in (joint_slots, centre_slots):
        with pytest.raises(ValueError, match="no floor tiles"):
            kind(site, MARGIN_M)
    with pytest.raises(ValueError, match="positive"):
        grid_slots(site, 0.0, MARGIN_M)


def test_a_floor_with_no_room_for_a_tag_has_no_slot():
    """The margin eats a narrow floor."""
    assert len(grid_slots(Site(name="slit", floor=box(0, 0, 2, 0.03)), 0.1, MARGIN_M)) == 0
