"""The place: regions, zones and floor tiles."""

import numpy as np
import pytest
from shapely.geometry import MultiPolygon, Polygon, box

from layoutopt.site import Site, Tiling, Zone


def hall(**fields):
    """Return a hall of 4 m by 2 m."""
    return Site(**{"name": "hall", "floor": box(0, 0, 4, 2), **fields})


def test_the_margin_shrinks_the_floor_on_all_sides():
    """Half a metre off each wall of 4 m by 2 m leaves 3 m by 1 m."""
    region = hall().taggable_region(margin_m=0.5)
    assert region.area == pytest.approx(3.0, abs=1e-7)
    assert region.bounds == pytest.approx((0.5, 0.5, 3.5, 1.5))


def test_obstacles_grow_by_the_margin():
    """A square obstacle of 1 m takes 1.2 m by 1.2 m at a margin of 0.1 m."""
    region = hall(obstacles=(box(1.5, 0.5, 2.5, 1.5),)).taggable_region(margin_m=0.1)
    assert region.area == pytest.approx(3.8 * 1.8 - 1.2**2, abs=1e-7)


@pytest.mark.parametrize("rule", [{"metal": True}, {"tags": False}])
def test_barred_zones_take_no_tags(rule):
    """Metal and zones without tags are left out, with the margin, and are no place for a pattern of their own."""
    zone = Zone(name="plate", region=box(0, 0, 1, 2), **rule)
    site = hall(zones=(zone,))
    assert not zone.taggable
    assert site.taggable_region(margin_m=0.1).bounds == pytest.approx((1.1, 0.1, 3.9, 1.9))
    assert site.taggable_region("plate", 0.1).area == 0.0


def test_the_region_of_a_zone_keeps_off_walls_only():
    """A zone inside the hall has its full region; only walls cost a margin."""
    site = hall(zones=(Zone(name="dock", region=box(0, 0, 1, 1)),))
    assert site.taggable_region("dock", 0.1).bounds == pytest.approx((0.1, 0.1, 1.0, 1.0))


def test_the_last_zone_that_holds_a_point_counts():
    """Zones may overlap; the later one rules, its border included, and only the named ones count."""
    site = hall(zones=(Zone(name="a", region=box(0, 0, 2, 2)), Zone(name="b", region=box(1, 0, 3, 2))))
    places_m = np.array([(0.5, 1.0), (1.0, 1.0), (1.5, 1.0), (2.5, 1.0), (3.0 + 1e-12, 1.0), (3.5, 1.0)])
    assert site.zone_of(places_m).tolist() == [0, 1, 1, 1, 1, -1]
    assert site.zone_of(places_m, {"a"}).tolist() == [0, 0, 0, -1, -1, -1]
    assert site.zone_names == ("a", "b")
    assert site.zone("b") is site.zones[1]
    with pytest.raises(KeyError):
        site.zone("c")


def test_floor_tiles_count_from_the_corner():
    """Column and row, negative before the corner; a tag on a joint belongs to the tile beyond it."""
    site = hall(tiling=Tiling(size_m=0.1, origin_m=(1.0, 0.0)))
    places_m = np.array([(1.05, 0.05), (1.3, 0.0), (0.95, 0.15)])
    assert site.tile_of(places_m).tolist() == [[0, 0], [3, 0], [-1, 1]]


def test_turned_floor_tiles():
    """With rows turned by a right angle, columns run along y and rows along -x."""
    site = hall(tiling=Tiling(size_m=0.5, angle_rad=np.pi / 2))
    assert site.tile_of(np.array([(0.25, 1.25)])).tolist() == [[2, -1]]


def test_no_tiling_means_tile_zero():
    """Without a tiling all tags share tile (0, 0)."""
    assert hall().tile_of(np.array([(3.0, 1.0)])).tolist() == [[0, 0]]


def test_the_robot_keeps_its_radius():
    """The centre of a robot of radius 0.5 m stays that far from walls and obstacles."""
    site = hall(obstacles=(box(0, 0, 1, 2),))
    assert site.robot_region(0.5).bounds == pytest.approx((1.5, 0.5, 3.5, 1.5))
    assert site.robot_region(1.1).is_empty


def test_a_floor_of_two_rooms():
    """A floor may have several parts; the datum is the lower left corner of all."""
    site = hall(floor=MultiPolygon([box(1, 1, 2, 2), box(3, 0, 4, 1)]))
    assert site.open_floor.area == pytest.approx(2.0)
    assert site.datum_m == (1.0, 0.0)


def test_impossible_sites_are_refused():
    """No area, two zones of one name, a zone without a name."""
    with pytest.raises(ValueError, match="positive area"):
        hall(floor=Polygon())
    with pytest.raises(ValueError, match="must differ"):
        hall(zones=(Zone(name="a", region=box(0, 0, 1, 1)),) * 2)
    with pytest.raises(ValueError, match="needs a name"):
        Zone(name="", region=box(0, 0, 1, 1))
