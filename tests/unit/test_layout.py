"""Patterns, floor tags on a site, reader groups and whole layouts."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Point, box

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.geometry import reduced_cell
from layoutopt.layout import EditKind, FloorTags, Layout, ReaderGroup, TagEdit, TagPattern, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.protocols import Mount
from layoutopt.readers.cross import cross
from layoutopt.readers.profiles import COMMERCIAL
from layoutopt.site import Site, Tiling, Zone

COORDINATE = st.floats(-1.0, 1.0).map(lambda value: round(value, 3))


def floor_tags(*zones, **fields):
    """Return floor tags of (zone name, pattern) pairs."""
    return FloorTags(zones=tuple(ZonePattern(zone=name, pattern=pattern) for name, pattern in zones), **fields)


def room(width_m=1.0, height_m=1.0, **fields):
    """Return a room with its corner at the origin."""
    return Site(name="room", floor=box(0, 0, width_m, height_m), **fields)


def group(slots, antennas_per_module):
    """Return a row of antennas 0.1 m apart."""
    poses = [(0.1 * number, 0.0, 0.02, 0.0) for number in range(len(slots))]
    return ReaderGroup(
        name="row",
        poses=poses,
        antenna=SphereAntenna(side_m=0.06),
        profile=COMMERCIAL,
        slots=slots,
        antennas_per_module=antennas_per_module,
    )


def nearest_by_hand(points_m, cell_m):
    """Return the smallest distance of two tags, looking 240 cells far to the sides and 40 up and down."""
    x_m, y_m = (np.array([(i, j) for i in range(-240, 241) for j in range(-40, 41)]) @ np.asarray(cell_m)).T
    middle, best_m2 = len(x_m) // 2, np.inf
    for i, first in enumerate(points_m):
        for j, second in enumerate(points_m[i:], i):
            square_m2 = (x_m + (second[0] - first[0])) ** 2 + (y_m + (second[1] - first[1])) ** 2
            if i == j:
                square_m2[middle] = np.inf
            best_m2 = min(best_m2, square_m2.min())
    return best_m2**0.5


@given(
    points=st.lists(st.tuples(COORDINATE, COORDINATE), min_size=1, max_size=3),
    width=st.integers(2, 20),
    shift=st.integers(-20, 20),
    height=st.integers(2, 20),
    shear=st.integers(-9, 9),
)
def test_minimum_spacing_equals_brute_force(points, width, shift, height, shear):
    """The least spacing is found also in sheared cells and between points many cells apart."""
    cell_m = np.array([(width, 0.0), (shift, height)]) / 20.0
    pattern = TagPattern(name="any", points_m=points, cell_m=[cell_m[0], cell_m[1] + shear * cell_m[0]])
    assert pattern.minimum_spacing_m() == pytest.approx(nearest_by_hand(points, cell_m), abs=1e-9)


def test_minimum_spacing_of_a_flat_cell():
    """A cell written with a vector ten cells long is still the 0.1 m by 0.02 m lattice."""
    pattern = TagPattern(name="any", points_m=[(0, 0)], cell_m=[(0.1, 0.0), (1.0, 0.02)])
    assert pattern.minimum_spacing_m() == pytest.approx(0.02)
    assert np.abs(reduced_cell(pattern.cell_m)) == pytest.approx(np.array([(0.0, 0.02), (0.1, 0.0)]))


def test_minimum_spacing_without_a_period():
    """One tag has no neighbour; two tags on one spot are no distance apart."""
    assert TagPattern(name="any", points_m=[(0, 0)]).minimum_spacing_m() == np.inf
    assert TagPattern(name="any", points_m=[(0, 0), (3, 4)]).minimum_spacing_m() == pytest.approx(5.0)
    assert TagPattern(name="any", points_m=[(0, 0), (0, 0)]).minimum_spacing_m() == 0.0


def test_a_cell_needs_an_area():
    """Two parallel period vectors are no cell."""
    with pytest.raises(ValueError, match="area"):
        TagPattern(name="any", points_m=[(0, 0)], cell_m=[(1, 1), (2, 2)])


@pytest.mark.parametrize("pitch_mm", [50, 80, 100, 110, 180, 200, 220, 400])
@pytest.mark.parametrize("width_m", [1.2, 2.0, 3.0])
def test_rows_on_the_margin_are_all_laid(pitch_mm, width_m):
    """Tags that keep the margin exactly are laid on all four sides, whatever the last bit of a sum."""
    pitch_m = pitch_mm / 1000
    laid = floor_tags(("", square(pitch_m=pitch_m)), tag_size_m=(2 * pitch_m, 0.01)).lay_on(room(width_m, width_m))
    across = (round(width_m * 1000) - pitch_mm) // pitch_mm
    assert len(laid) == across**2


def test_tags_are_numbered_by_row():
    """Numbers run from 1, along x within a row, rows by rising y."""
    laid = floor_tags(("", square(pitch_m=0.3))).lay_on(room())
    assert laid.ids.tolist() == list(range(1, 10))
    assert laid.xy_m[:4] == pytest.approx(np.array([(0.3, 0.3), (0.6, 0.3), (0.9, 0.3), (0.3, 0.6)]))
    assert laid.status == ("planned",) * 9
    assert laid.uid == (None,) * 9


@pytest.mark.parametrize("corner_m", [0.3, 0.5, 0.55, 0.7])
def test_no_tag_is_laid_twice_at_the_border_of_a_zone(corner_m):
    """Where two patterns meet, a place that both want gets one tag."""
    site = room(zones=(Zone(name="dock", region=box(0, 0, corner_m, corner_m)),))
    laid = floor_tags(("", square(pitch_m=0.1)), ("dock", square(pitch_m=0.05))).lay_on(site)
    distance_m = np.linalg.norm(laid.xy_m[:, None] - laid.xy_m[None], axis=2)
    np.fill_diagonal(distance_m, np.inf)
    assert distance_m.min() > 0.049
    inside = (laid.xy_m <= corner_m + 1e-6).all(axis=1)
    assert inside.sum() == round(corner_m / 0.05) ** 2


def nearest_laid_m(xy_m):
    """Return the smallest distance of any two points."""
    distance_m = np.linalg.norm(xy_m[:, None] - xy_m[None], axis=2)
    np.fill_diagonal(distance_m, np.inf)
    return distance_m.min(initial=np.inf)


def test_a_zone_pushes_tags_of_the_floor_aside():
    """Of two labels 7.1 mm apart at the border of a zone, the floor's is left out and the zone's stays."""
    dock = Zone(name="dock", region=box(0.405, 0, 2, 2))
    parts = ("", square(pitch_m=0.2)), ("dock", square(pitch_m=0.135))
    laid = floor_tags(*parts, tag_size_m=(0.02, 0.01)).lay_on(room(2, 2, zones=(dock,)))
    assert np.linalg.norm(np.subtract((0.4, 0.4), (0.405, 0.405))) < 0.0071
    places = {(round(float(x_m), 6), round(float(y_m), 6)) for x_m, y_m in laid.xy_m}
    assert (0.405, 0.405) in places
    # At x = 0.4 a tag of the floor every 200 mm, at x = 0.405 one of the zone every 135 mm.
    assert {y for x, y in places if x == 0.4} == {0.2, 0.6, 1.0, 1.4, 1.6, 1.8}
    assert {y for x, y in places if x == 0.405} == {round(0.135 * row, 6) for row in range(1, 15)}
    assert nearest_laid_m(laid.xy_m) >= 0.02 - 1e-9
    assert laid.ids.tolist() == list(range(1, len(places) + 1))
    assert np.array_equal(laid.xy_m, laid.xy_m[np.lexsort(np.round(laid.xy_m.T, 9))])


def test_the_later_zone_keeps_its_tags_at_a_common_border():
    """Where two zones touch, it is the earlier one's tags that give way, whatever the order of the patterns."""
    zones = (Zone(name="a", region=box(0, 0, 0.5, 1)), Zone(name="b", region=box(0.505, 0, 1, 1)))
    own = ("a", square(pitch_m=0.1)), ("b", square(pitch_m=0.101))
    for parts in (own, own[::-1]):
        laid = floor_tags(*parts, tag_size_m=(0.02, 0.01)).lay_on(room(zones=zones))
        columns = {round(float(x_m), 6) for x_m, y_m in laid.xy_m}
        assert columns == {0.1, 0.2, 0.3, 0.4, 0.505, 0.606, 0.707, 0.808, 0.909}


@given(
    pitches_mm=st.tuples(st.integers(40, 200), st.integers(20, 200), st.integers(20, 200)),
    corner_mm=st.tuples(st.integers(100, 700), st.integers(100, 700)),
    gap_mm=st.integers(-50, 50),
    angle_rad=st.floats(0.0, 1.6),
)
@settings(max_examples=60)
def test_no_two_laid_tags_overlap(pitches_mm, corner_mm, gap_mm, angle_rad):
    """Whatever meets at the borders of two zones, tags keep their longer side; only tags near others give way."""
    (x_m, y_m), size_m = np.array(corner_mm) / 1000, 0.02
    beside_m = x_m + 0.3 + gap_mm / 1000
    zones = (
        Zone(name="a", region=box(x_m, y_m, x_m + 0.3, y_m + 0.3)),
        Zone(name="b", region=box(beside_m, y_m, beside_m + 0.3, y_m + 0.2)),
    )
    patterns = [square(pitch_m=pitch / 1000) for pitch in pitches_mm]
    entries = tuple(
        ZonePattern(zone=name, pattern=pattern, angle_rad=turn)
        for name, pattern, turn in zip(("", "a", "b"), patterns, (0.0, angle_rad, 0.0), strict=True)
    )
    site = room(1.5, 1.2, zones=zones)
    laid_m = FloorTags(zones=entries, tag_size_m=(size_m, 0.01)).lay_on(site).xy_m
    assert nearest_laid_m(laid_m) >= size_m - 2e-9
    # With tags of no size nothing gives way; what is gone lies near a tag of another pattern that stayed.
    points_m = FloorTags(zones=entries, tag_size_m=(1e-6, 1e-6)).lay_on(site).xy_m
    margin_m = size_m / 2.0
    inside = ((points_m >= margin_m - 1e-9) & (points_m <= np.array((1.5, 1.2)) - margin_m + 1e-9)).all(axis=1)
    to_laid_m = np.linalg.norm(points_m[inside][:, None] - laid_m[None], axis=2).min(axis=1)
    assert (to_laid_m < size_m).all()


def test_the_last_of_overlapping_zones_rules():
    """Where two zones with patterns overlap, the tags of the later zone lie, and no others."""
    zones = (Zone(name="a", region=box(0, 0, 0.6, 1)), Zone(name="b", region=box(0.4, 0, 1, 1)))
    site = room(zones=zones)
    laid = floor_tags(("a", square(pitch_m=0.1)), ("b", square(pitch_m=0.2))).lay_on(site)
    columns = {round(float(x_m), 6) for x_m in laid.xy_m[:, 0]}
    assert columns == {0.1, 0.2, 0.3, 0.4, 0.6, 0.8}
    assert set(laid.zone.tolist()) == {0, 1}


def test_zones_without_tags_and_obstacles_stay_free():
    """No tag lies on metal, in a zone without tags or on an obstacle, nor nearer than half a tag."""
    site = room(
        obstacles=(box(0.4, 0.4, 0.6, 0.6),),
        zones=(
            Zone(name="plate", region=box(0, 0, 0.2, 0.2), metal=True),
            Zone(name="out", region=box(0.8, 0.8, 1, 1), tags=False),
        ),
    )
    laid = floor_tags(("", square(pitch_m=0.05)), tag_size_m=(0.04, 0.02)).lay_on(site)
    for barred in (site.obstacles[0], site.zones[0].region, site.zones[1].region, site.floor.exterior):
        assert min(barred.distance(Point(*place)) for place in laid.xy_m) >= 0.02 - 1e-8
    assert len(laid) > 200


def test_a_site_without_room_gets_no_tag():
    """A map of no tags is a legal answer."""
    laid = floor_tags(("", square(pitch_m=0.1)), tag_size_m=(3.0, 3.0)).lay_on(room())
    assert len(laid) == 0
    assert laid.xy_m.shape == (0, 2)


@pytest.mark.parametrize("turn", [0.5, 1.0, 2.0])
def test_a_turned_pattern_keeps_its_distances(turn):
    """Origin and angle place the pattern frame: the lattice point at the origin is there, and its neighbours."""
    entry = ZonePattern(zone="", pattern=square(pitch_m=0.1), origin_m=(0.52, 0.47), angle_rad=turn)
    laid = FloorTags(zones=(entry,)).lay_on(room())
    places_m = laid.xy_m
    expected = np.array([(0.52, 0.47), (0.52 + 0.1 * np.cos(turn), 0.47 + 0.1 * np.sin(turn))])
    for place in expected:
        assert np.linalg.norm(places_m - place, axis=1).min() < 1e-9
    assert len(laid) == pytest.approx(0.98**2 * 100, rel=0.08)


def test_edits_move_drop_and_lock():
    """An edit names the place where the pattern put the tag; a tag keeps its number whatever happens to others."""
    edits = (
        TagEdit(kind=EditKind.DROPPED, from_m=(0.3, 0.3)),
        TagEdit(kind=EditKind.MOVED, from_m=(0.6, 0.3), to_m=(0.61, 0.32)),
        TagEdit(kind=EditKind.LOCKED, from_m=(0.9, 0.3)),
    )
    laid = floor_tags(("", square(pitch_m=0.3)), edits=edits).lay_on(room())
    assert laid.ids.tolist() == list(range(2, 10))
    assert laid.xy_m[0] == pytest.approx((0.61, 0.32))
    assert laid.status[:3] == ("moved", "locked", "planned")


def test_an_edit_of_no_tag_is_an_error():
    """An edit that meets nothing is not passed over in silence."""
    edits = (TagEdit(kind=EditKind.DROPPED, from_m=(0.31, 0.3)),)
    with pytest.raises(ValueError, match=r"no tag lies at \(0.310, 0.300\) m to be dropped"):
        floor_tags(("", square(pitch_m=0.3)), edits=edits).lay_on(room())


def test_a_zone_has_one_pattern():
    """Two patterns on one zone make no floor."""
    with pytest.raises(ValueError, match="one pattern a zone"):
        floor_tags(("", square(pitch_m=0.1)), ("", square(pitch_m=0.2)))


def test_a_floor_without_tags_has_none():
    """No pattern, no tag; and nothing that could be called the pattern of the floor."""
    bare = floor_tags()
    assert len(bare.lay_on(room())) == 0
    assert list(bare.patterns()) == []
    with pytest.raises(ValueError, match="no tags on the floor"):
        _ = bare.base


def test_tags_know_tile_zone_and_sigma():
    """A tag's floor tile counts from the tiling's corner, its zone from the site, its sigma from the plan."""
    site = room(zones=(Zone(name="dock", region=box(0, 0, 0.4, 0.4)),), tiling=Tiling(size_m=0.5))
    laid = floor_tags(("", square(pitch_m=0.3)), placement_sigma_m=0.004).lay_on(site)
    assert laid.tile[0].tolist() == [0, 0]
    assert laid.tile[-1].tolist() == [1, 1]
    assert laid.zone.tolist() == [0] + [-1] * 8
    assert set(laid.sigma_m.tolist()) == {0.004}


@pytest.mark.parametrize(
    ("slots", "ports", "modules", "cycle_s"),
    [((0, 0, 0), 1, 3, 0.05), ((0, 1, 2, 3), 4, 1, 0.2), ((0, 1, 0), 2, 2, 0.1)],
)
def test_modules_and_cycle(slots, ports, modules, cycle_s):
    """The fullest slot counts the modules; a module visits its antennas one after the other."""
    row = group(slots, ports)
    assert (row.count, row.module_count) == (len(slots), modules)
    assert row.cycle_s == pytest.approx(cycle_s)


@pytest.mark.parametrize(("slots", "ports"), [((0, 4), 4), ((-1,), 1), ((0,), 0)])
def test_slots_must_fit_the_module(slots, ports):
    """A slot beyond the multiplexer's ports is an error."""
    with pytest.raises(ValueError, match="slots"):
        group(slots, ports)


def test_a_layout_needs_a_reader():
    """Tags alone are no positioning system."""
    with pytest.raises(ValueError, match="reader group"):
        Layout(floor_tags=floor_tags(("", square(pitch_m=0.1))), readers=())


def test_the_label_says_what_is_built():
    """A line for people: count, side and family of antennas, family and pitch of the pattern."""
    mount = Mount(antenna=SphereAntenna(side_m=0.06), height_m=0.02, profile=COMMERCIAL, antennas_per_module=4)
    floor = floor_tags(("", square(pitch_m=0.1)), ("dock", square(pitch_m=0.05)))
    layout = Layout(floor_tags=floor, readers=(cross(count=8, mount=mount),))
    assert layout.label == "cross 8 × 60 mm (4 a module), square 100 mm, dock: square 50 mm"
    assert layout.key.startswith(layout.short_key)
    assert layout.replace(floor_tags=floor_tags(("", square(pitch_m=0.2)))).label.endswith("square 200 mm")
