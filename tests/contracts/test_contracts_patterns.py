"""What every tag pattern promises."""

import numpy as np
import pytest
from shapely.geometry import Point, box

from layoutopt import registry
from layoutopt.layout import FloorTags, ZonePattern
from layoutopt.site import Site, Zone

EXAMPLES = {
    "square": [{"pitch_m": 0.1}, {"pitch_m": 0.173}],
    "triangular": [{"pitch_m": 0.1}, {"pitch_m": 0.12, "row_gap_m": 0.07}],
    "equilateral": [{"side_m": 0.11}],
    "parallelogram": [
        {"tile_m": 0.24, "shift_m": 0.02},
        {"tile_m": 0.24, "shift_m": 0.02, "form": "sheared"},
        {"tile_m": 0.3, "shift_m": 0.0},
    ],
    "line": [{"spacing_m": 0.13}],
    "tilted": [{"tile_m": 0.24, "angle_rad": 0.2}, {"tile_m": 0.24, "angle_rad": 0.7, "radius_m": 0.03}],
    "sudoku": [
        {"tile_m": 0.24, "seed": 4, "radius_m": 0.035},
        {"tile_m": 0.2, "seed": 0, "rule": "diagonals", "bond": "running"},
    ],
    "random": [{"tile_m": 0.3, "radius_m": 0.03, "seed": 2}],
    "listed": [
        {"points_m": [(0.02, 0.03), (0.1, 0.11), (0.15, 0.04)], "cell_m": (0.2, 0.17)},
        {"points_m": [(0.3, 0.3), (0.5, 0.41), (1.1, 0.9)]},
        {"points_m": [(0.02, 0.03), (0.1, 0.11)], "cell_m": (0.2, 0.17), "shift_m": 0.1},
    ],
}
"""Arguments for each row of the table; a new row needs its own."""

EVERY_EXAMPLE = [(name, number) for name, rows in EXAMPLES.items() for number in range(len(rows))]
ONCE = [("listed", 1)]
PERIODIC = [example for example in EVERY_EXAMPLE if example not in ONCE]
LENGTHS = [(name, key) for name, (row, *_) in EXAMPLES.items() for key in row if key.endswith("_m")]
LENGTHS.remove(("listed", "points_m"))
LENGTHS.remove(("parallelogram", "shift_m"))  # tiles without a shift are the square pattern


def build(name, number=0, **changes):
    """Return the pattern of an example."""
    return registry.load("patterns", name)(**{**EXAMPLES[name][number], **changes})


def around(pattern, within_m):
    """Return the tags of a pattern and of all its cells that may hold a tag within a distance of its own."""
    if pattern.cell_m is None:
        return pattern.points_m
    # The least distance between opposite sides of a cell; one step more, because points lie anywhere in theirs.
    height_m = pattern.cell_area_m2 / np.linalg.norm(pattern.cell_m, axis=1).max()
    reach = int(np.ceil(within_m / height_m)) + 2
    steps = np.array([(i, j) for i in range(-reach, reach + 1) for j in range(-reach, reach + 1)])
    return (pattern.points_m[None] + (steps @ pattern.cell_m)[:, None]).reshape(-1, 2)


def site():
    """Return a room with an obstacle, a metal plate and a zone without tags."""
    return Site(
        name="room",
        floor=box(-0.7, -0.4, 1.4, 1.1),
        obstacles=(box(0.2, 0.2, 0.45, 0.4),),
        zones=(
            Zone(name="plate", region=box(-0.7, -0.4, -0.3, 0.0), metal=True),
            Zone(name="bare", region=box(1.0, 0.5, 1.2, 0.8), tags=False),
        ),
    )


def test_every_pattern_has_an_example():
    """A new row without an example would go untested."""
    assert set(EXAMPLES) == set(registry.names("patterns"))


@pytest.mark.parametrize(("name", "number"), EVERY_EXAMPLE)
def test_name_and_parameters(name, number):
    """A pattern knows its row, and its parameters are plain values that a file can hold."""
    pattern = build(name, number)
    assert pattern.name == name
    assert all(isinstance(value, (int, float, str)) for value in pattern.parameters.values())
    assert build(name, number) == pattern


@pytest.mark.parametrize(("name", "number"), ONCE)
def test_what_is_laid_once_has_no_density(name, number):
    """A finite set of tags on the infinite plane."""
    pattern = build(name, number)
    assert pattern.cell_m is None
    assert (pattern.density_per_m2, pattern.cell_area_m2) == (0.0, np.inf)


@pytest.mark.parametrize(("name", "number"), PERIODIC)
def test_density_is_tags_by_area(name, number):
    """Counted over a large window, there are as many tags as the density says."""
    pattern = build(name, number)
    side_m = 200 / np.sqrt(pattern.density_per_m2)
    counted = len(pattern.points_in((0.0, 0.0, side_m, side_m))) / side_m**2
    assert counted == pytest.approx(pattern.density_per_m2, rel=0.02)
    assert pattern.density_per_m2 == pytest.approx(len(pattern.points_m) / pattern.cell_area_m2)


@pytest.mark.parametrize(("name", "number"), EVERY_EXAMPLE)
def test_the_stated_spacing_is_the_least_distance(name, number):
    """No two tags of the plane are closer than stated, and two are just that far apart."""
    pattern = build(name, number)
    distance_m = np.linalg.norm(pattern.points_m[:, None] - around(pattern, 0.1)[None], axis=2)
    own = distance_m < 1e-12
    assert own.sum() == len(pattern.points_m)
    assert pattern.minimum_spacing_m() == pytest.approx(distance_m[~own].min())


@pytest.mark.parametrize(("name", "number"), PERIODIC)
def test_the_pattern_repeats(name, number):
    """Moved by a period vector, the tags of a window are the tags of the moved window."""
    pattern = build(name, number)
    window_m = np.array([0.013, 0.017, 1.013, 0.877])
    for period_m in pattern.cell_m:
        moved_m = pattern.points_in(tuple(window_m + np.tile(period_m, 2)))
        assert moved_m == pytest.approx(pattern.points_in(tuple(window_m)) + period_m, abs=1e-9)


@pytest.mark.parametrize("angle_rad", [0.0, 0.4])
@pytest.mark.parametrize(("name", "number"), EVERY_EXAMPLE)
def test_tags_lie_on_the_floor_and_nowhere_else(name, number, angle_rad):
    """Half a tag off walls, obstacles, metal and zones without tags; and no other place is left out."""
    size_m, room = (0.02, 0.01), site()
    entry = ZonePattern(zone="", pattern=build(name, number), origin_m=(0.031, 0.007), angle_rad=angle_rad)
    laid_m = FloorTags(zones=(entry,), tag_size_m=size_m).lay_on(room).xy_m
    barred = [room.floor.exterior, *room.obstacles, *(zone.region for zone in room.zones)]
    for place in laid_m:
        assert room.floor.covers(Point(place))
        assert min(shape.distance(Point(place)) for shape in barred) >= max(size_m) / 2 - 1e-8
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    whole_m = around(build(name, number), 4.0) @ np.array([[cos, sin], [-sin, cos]]) + entry.origin_m
    near = whole_m[(whole_m > (-0.7, -0.4)).all(axis=1) & (whole_m < (1.4, 1.1)).all(axis=1)]
    gaps_m = np.array([min(shape.distance(Point(place)) for shape in barred) for place in near])
    assert len(laid_m) == (gaps_m > max(size_m) / 2 + 1e-8).sum() > 0


@pytest.mark.parametrize("value", [0.0, -0.1, float("nan"), float("inf")])
@pytest.mark.parametrize(("name", "key"), LENGTHS)
def test_lengths_are_positive(name, key, value):
    """Zero, negative, NaN and infinity make no pattern and end in a ValueError."""
    given = EXAMPLES[name][0][key]
    with pytest.raises(ValueError, match=r"positive|finite"):
        build(name, **{key: value if isinstance(given, float) else (value, *given[1:])})


@pytest.mark.parametrize(("name", "number"), EVERY_EXAMPLE)
def test_the_card_says_whether_the_pattern_repeats(name, number):
    """A card that promises a period is held to it."""
    if registry.card("patterns", name).periodic:
        assert build(name, number).cell_m is not None
