"""The plan shows floor, tags and robot where they are, to scale."""

import numpy as np
import pytest
from matplotlib.collections import EllipseCollection, PolyCollection
from shapely.geometry import MultiPolygon, Point, Polygon, box

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.layout import FloorTags, Layout, ReaderProfile, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.plots.figures import as_svg, figure_of, new_axes
from layoutopt.plots.floor_plan import frame_site
from layoutopt.plots.layout_plan import draw_layout_plan, robot_place_m, sample_place_m
from layoutopt.protocols import Mount
from layoutopt.readers.cross import cross
from layoutopt.robot import Robot
from layoutopt.site import Site, Tiling, Zone

PROFILE = ReaderProfile(name="commercial", scan_period_s=0.05, tags_per_scan="several")
ROBOT = Robot(outline_m=np.array([(-0.3, -0.25), (0.3, -0.25), (0.3, 0.25), (-0.3, 0.25)]))
SITE = Site(
    name="ward",
    floor=Polygon([(0, 0), (6, 0), (6, 4), (0, 4)]),
    obstacles=(box(2.8, 1.8, 3.4, 2.4),),
    zones=(
        Zone(name="$dock$", region=box(0, 0, 1, 1), target_error_m=0.005),
        Zone(name="plate", region=box(5, 3, 6, 4), metal=True),
    ),
    tiling=Tiling(size_m=0.5),
)


def layout_of(pitch_m=0.2, origin_m=(0.1, 0.1)):
    mount = Mount(antenna=SphereAntenna(side_m=0.06), height_m=0.024, profile=PROFILE)
    tags = FloorTags(zones=(ZonePattern(zone="", pattern=square(pitch_m=pitch_m), origin_m=origin_m),))
    return Layout(floor_tags=tags, readers=(cross(count=4, mount=mount),))


def draw(layout=None, site=SITE, **options):
    layout = layout_of() if layout is None else layout
    tag_map = layout.floor_tags.lay_on(site)
    return draw_layout_plan(layout=layout, site=site, robot=ROBOT, tag_map=tag_map, **options), tag_map


def dots(ax):
    return next(item for item in ax.collections if isinstance(item, EllipseCollection))


def test_axes_are_metres_to_scale():
    """Plan and underside have equal aspect and metres on every axis."""
    ax, _ = draw()
    for axes in figure_of(ax).axes:
        assert axes.get_aspect() == 1.0
        assert axes.get_xlabel() == "x (m)"
        assert axes.get_ylabel() == "y (m)"


def test_every_tag_is_drawn_where_it_lies():
    """The dots are the tags of the map, and the whole floor is in view."""
    ax, tag_map = draw()
    assert dots(ax).get_offsets() == pytest.approx(tag_map.xy_m)
    assert ax.get_xlim()[0] < 0.0
    assert ax.get_xlim()[1] > 6.0
    assert ax.get_ylim()[1] > 4.0


def test_dots_are_true_to_scale_or_say_that_they_are_not():
    """On a room the dots have the tag's longer side; on a hall they are larger and the legend says so."""
    ax, _ = draw(site=Site(name="closet", floor=box(0, 0, 2, 2)))
    assert np.max(dots(ax).get_widths()) == pytest.approx(0.02)
    assert "tag" in [text.get_text() for text in ax.get_legend().get_texts()]
    ax, _ = draw(layout_of(pitch_m=2.0), site=Site(name="hall", floor=box(0, 0, 60, 40)))
    assert np.max(dots(ax).get_widths()) > 0.02
    assert "tag (drawn larger than it is)" in [text.get_text() for text in ax.get_legend().get_texts()]


def test_robot_stands_where_it_can_turn():
    """The place shown keeps the robot clear of walls and obstacles; it is the middle if that is free."""
    place = Point(robot_place_m(SITE, ROBOT))
    assert place.distance(SITE.obstacles[0]) >= ROBOT.radius_m - 1e-6
    assert SITE.robot_region(ROBOT.radius_m).buffer(1e-6).contains(place)
    assert robot_place_m(Site(name="free", floor=box(0, 0, 4, 2)), ROBOT) == (2.0, 1.0)


def test_the_robot_is_shown_in_the_largest_room():
    """A room with no door lies nearer the middle of the floor, but no drive is there."""
    rooms = Site(name="rooms", floor=box(0, 0, 12, 3), obstacles=(box(6.9, 0, 7.0, 3), box(4.9, 0, 5.0, 3)))
    x_m, _ = robot_place_m(rooms, ROBOT)
    assert x_m < 4.9 or x_m > 7.0


def test_robot_is_shown_where_it_reads_a_tag():
    """With sparse tags the robot is moved so that at least one disc holds a tag, and never into an obstacle."""
    layout = layout_of(pitch_m=0.9, origin_m=(0.13, 0.21))
    ax, tag_map = draw(layout)
    assert not figure_of(ax).axes[1].get_title(loc="left").endswith("filled: 0 here")
    place = sample_place_m(layout=layout, site=SITE, robot=ROBOT, tag_map=tag_map)
    assert place != robot_place_m(SITE, ROBOT)
    assert SITE.robot_region(ROBOT.radius_m).buffer(1e-6).contains(Point(place))


def test_robot_stays_where_no_tag_can_be_read():
    """Tags only in a corner that no antenna reaches leave the robot at the middle, with none filled."""
    layout = layout_of(pitch_m=20.0, origin_m=(0.02, 0.02))
    room = Site(name="room", floor=box(0, 0, 4, 4))
    ax, tag_map = draw(layout, site=room)
    assert len(tag_map) == 1
    assert sample_place_m(layout=layout, site=room, robot=ROBOT, tag_map=tag_map) == (2.0, 2.0)
    assert figure_of(ax).axes[1].get_title(loc="left").endswith("filled: 0 here")


def test_holes_of_the_floor_look_like_obstacles():
    """A pillar that a map shows as a hole is hatched, an island in it is not, and the legend says so."""
    ring = box(0, 0, 6, 6).difference(box(2, 2, 4, 4))
    site = Site(name="map", floor=MultiPolygon([ring, box(2.5, 2.5, 3.5, 3.5)]))
    ax, _ = draw(site=site)
    (hatched,) = [patch for patch in ax.patches if patch.get_hatch() == "////"]
    assert hatched.get_path().get_extents().bounds == pytest.approx((2.0, 2.0, 2.0, 2.0))
    rings = [Polygon(ring) for ring in hatched.get_path().to_polygons()]
    assert sorted(ring.area for ring in rings) == pytest.approx([1.0, 4.0])
    # Rings that run in opposite directions leave the island bare.
    assert {ring.exterior.is_ccw for ring in rings} == {False, True}
    assert "obstacle" in [text.get_text() for text in ax.get_legend().get_texts()]
    bare, _ = draw(site=Site(name="bare", floor=box(0, 0, 4, 4)))
    assert "obstacle" not in [text.get_text() for text in bare.get_legend().get_texts()]


def test_zone_names_keep_off_obstacles():
    """The name of a zone with an obstacle in its middle stands in the zone beside the obstacle."""
    block = box(2.5, 1.5, 3.5, 2.5)
    zone = Zone(name="ward", region=box(1, 0.2, 5, 3.8), target_error_m=0.005)
    ax, _ = draw(site=Site(name="room", floor=box(0, 0, 6, 4), obstacles=(block,), zones=(zone,)))
    (name,) = [text for text in ax.texts if text.get_text().startswith("ward")]
    figure_of(ax).draw_without_rendering()
    extent = name.get_window_extent().transformed(ax.transData.inverted())
    assert box(extent.x0, extent.y0, extent.x1, extent.y1).intersection(block).area == pytest.approx(0.0, abs=1e-3)
    assert zone.region.contains(Point(name.get_position()))


def test_robot_that_fits_nowhere_is_still_shown_on_the_floor():
    """In a slot narrower than the robot the plan is drawn and the place lies on the open floor."""
    slot = Site(name="slot", floor=box(0, 0, 3, 0.3))
    assert slot.floor.contains(Point(robot_place_m(slot, ROBOT)))
    draw(site=slot)


def test_underside_shows_discs_and_fills_what_they_read():
    """Read discs have the antenna's radius, and the tags filled are those whose centres lie in one."""
    room = Site(name="room", floor=box(0, 0, 4, 4))
    ax, tag_map = draw(layout_of(pitch_m=0.05, origin_m=(0.01, 0.0)), site=room)
    underside = figure_of(ax).axes[1]
    place = np.array(robot_place_m(room, ROBOT))
    antennas = layout_of().readers[0].poses[:, :2] + place
    radius_m = SphereAntenna(side_m=0.06).read_radius_m(0.024)
    distance_m = np.linalg.norm(tag_map.xy_m[:, None, :] - antennas[None, :, :], axis=2).min(axis=1)
    expected = int((distance_m < radius_m).sum())
    assert expected == 4
    filled = [item for item in underside.collections if isinstance(item, PolyCollection)][1]
    assert len(filled.get_paths()) == expected
    assert underside.get_title(loc="left").endswith(f"filled: {expected} here")
    discs = underside.collections[2].get_paths()
    assert [path.get_extents().width / 2.0 for path in discs] == pytest.approx([radius_m] * 4, rel=1e-3)


def test_a_zone_too_small_for_its_name_is_named_beside_it_with_a_line_and_one_without_room_in_it():
    """The name hides none of a small zone's tags; where the floor ends all round, there is no other place."""
    small = Zone(name="dock", region=box(1.0, 1.0, 2.2, 1.6), target_error_m=0.01)
    ax, _ = draw(site=Site(name="hall", floor=box(0, 0, 15, 8), zones=(small,)))
    (name,) = [text for text in ax.texts if text.get_text().startswith("dock")]
    extent = name.get_window_extent().transformed(ax.transData.inverted())
    assert not box(*extent.extents).intersects(small.region)
    (line,) = [line for line in ax.lines if line.get_zorder() == 7.5]
    assert small.region.touches(Point(line.get_xydata()[-1]))

    whole = Zone(name="closet", region=box(0, 0, 1, 1), target_error_m=0.01)
    ax, _ = draw(site=Site(name="closet", floor=box(0, 0, 1, 1), zones=(whole,)))
    (name,) = [text for text in ax.texts if text.get_text().startswith("closet")]
    assert whole.region.contains(Point(name.get_position()))


def test_zones_are_named_as_plain_text():
    """Zone names, their targets and bars on tags are written, without reading mathematics."""
    ax, _ = draw()
    texts = {note.get_text(): note for note in ax.texts}
    assert "$dock$\ntarget 5 mm" in texts
    assert "plate\nmetal, on-metal tags only" in texts
    assert not any(note.get_parse_math() for note in texts.values())


def test_many_tags_become_a_picture():
    """More than 5000 tags are drawn as a picture; fewer stay shapes."""
    few, _ = draw(layout_of(pitch_m=0.1))
    assert "<image" not in as_svg(few)
    many, tag_map = draw(layout_of(pitch_m=0.05))
    assert len(tag_map) > 5000
    assert "<image" in as_svg(many)


def test_floors_with_holes_and_parts_draw():
    """A floor of two parts with a hole, a turned tiling and a long corridor all give a figure."""
    holed = Polygon(box(0, 0, 5, 5).exterior, [box(2, 2, 3, 3).exterior])
    site = Site(name="odd", floor=MultiPolygon([holed, box(6, 0, 9, 5)]), tiling=Tiling(size_m=0.4, angle_rad=0.5))
    ax, tag_map = draw(site=site)
    assert len(dots(ax).get_offsets()) == len(tag_map)
    draw(site=Site(name="corridor", floor=box(0, 0, 30, 2)))


def test_draws_into_given_axes_the_same_every_time():
    """With ``ax`` the same axes come back, and two drawings are equal byte for byte."""
    first, second = new_axes(180.0, 100.0), new_axes(180.0, 100.0)
    assert draw(ax=first)[0] is first
    draw(ax=second)
    assert as_svg(first) == as_svg(second)


@pytest.mark.parametrize(
    ("width_m", "length_m", "text"), [(4.0, 0.5, "500 mm"), (6.0, 1.0, "1 m"), (60.0, 10.0, "10 m")]
)
def test_the_bar_has_the_length_that_it_names(width_m, length_m, text):
    """On plans of several sizes it ends at the right end of the axes, below them."""
    ax = new_axes(120.0, 100.0)
    frame_site(ax, Site(name="hall", floor=box(0, 0, width_m, 0.7 * width_m)))
    (bar,) = [line for line in ax.lines if line.get_marker() == "|"]
    start_m, end_m = bar.get_xdata()
    assert end_m - start_m == pytest.approx(length_m)
    assert end_m == ax.get_xlim()[1]
    assert [note.get_text().strip() for note in ax.texts] == [text]


def test_names_of_zones_keep_off_the_robot():
    """A zone round the place of the robot has its name elsewhere in it."""
    zone = Zone(name="ward", region=box(0.2, 0.2, 5.8, 3.8), target_error_m=0.005)
    ax, _ = draw(site=Site(name="room", floor=box(0, 0, 6, 4), zones=(zone,)))
    underside = figure_of(ax).axes[1]
    (name,) = [text for text in ax.texts if text.get_text().startswith("ward")]
    extent = name.get_window_extent().transformed(ax.transData.inverted())
    (left, right), (low, high) = underside.get_xlim(), underside.get_ylim()
    assert not box(*extent.extents).intersects(box(left, low, right, high))
    assert zone.region.contains(Point(name.get_position()))
