"""What straight ways meet: compiled code against its plain twin, and blind stretches against brute force."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from layoutopt.detection import bucket_grid
from layoutopt.protocols import Antennas
from layoutopt.sightings import (
    Sightings,
    antenna_segments,
    grid_for_ways,
    plain_segment_sightings,
    plain_tags_on_runs,
    run_sightings,
    segment_sightings,
    tags_on_runs,
)

SEEDS = st.integers(0, 2**32)


def world(seed, tags=60):
    """Return a generator and the bucket grid over random tags, with cells of any size."""
    generator = np.random.Generator(np.random.Philox(seed))
    xy_m = generator.uniform(-2.0, 2.0, (tags, 2))
    return generator, bucket_grid(xy_m, generator.uniform(0.05, 3.0)), xy_m


def group(generator, count):
    """Return antennas anywhere on a robot, with radii of their own."""
    ones = np.ones(count, dtype=np.int64)
    return Antennas(
        xy_m=generator.uniform(-0.4, 0.4, (count, 2)),
        height_m=np.zeros(count),
        radius_m=generator.uniform(0.0, 0.4, count),
        period_steps=ones,
        phase_steps=0 * ones,
        one_tag=np.zeros(count, dtype=np.bool_),
    )


@given(SEEDS, st.booleans())
@settings(max_examples=60)
def test_segments_equal_their_plain_twin(seed, axis_parallel):
    """The same tags at the same places to the last bit; points and axis-parallel ways included."""
    generator, grid, _ = world(seed)
    segment_m = generator.uniform(-3.0, 3.0, (20, 4))
    if axis_parallel:
        segment_m[:10, 3] = segment_m[:10, 1]
        segment_m[10:, 2] = segment_m[10:, 0]
    segment_m[0, 2:] = segment_m[0, :2]
    radius_m = generator.uniform(0.0, 0.5, 20)
    found = segment_sightings(segment_m, radius_m, grid)
    truth = plain_segment_sightings(segment_m, radius_m, grid)
    for name in ("way", "tag", "enter_m", "leave_m", "length_m"):
        np.testing.assert_array_equal(getattr(found, name), getattr(truth, name))


@given(SEEDS)
@settings(max_examples=40)
def test_sightings_are_where_the_tag_is_near(seed):
    """Just within each sighting the tag is nearer than the radius, just outside it is not."""
    generator, grid, xy_m = world(seed)
    segment_m, radius_m = generator.uniform(-2.5, 2.5, (8, 4)), 0.3
    found = segment_sightings(segment_m, radius_m, grid)
    unit = (segment_m[:, 2:] - segment_m[:, :2]) / found.length_m[:, None]
    for way, tag, enter_m, leave_m in zip(found.way, found.tag, found.enter_m, found.leave_m, strict=True):
        for place_m, inside in ((enter_m, -1e-7), (enter_m, 1e-7), (leave_m, -1e-7), (leave_m, 1e-7)):
            along_m = place_m + inside
            if not 0.0 <= along_m <= found.length_m[way] or leave_m - enter_m < 1e-6:
                continue
            away_m = math.dist(segment_m[way, :2] + along_m * unit[way], xy_m[tag])
            assert (away_m < radius_m) is bool(enter_m < along_m < leave_m)


@given(SEEDS, st.integers(1, 4), st.integers(1, 3), st.booleans())
@settings(max_examples=60)
def test_runs_equal_their_plain_twin(seed, antennas, most, stands):
    """How many different tags a group sees on its way, and from where it stands."""
    generator, grid, _ = world(seed)
    poses = np.column_stack([generator.uniform(-2.0, 2.0, (15, 2)), generator.uniform(-7.0, 7.0, 15)])
    way_m = np.zeros((15, 2)) if stands else generator.uniform(-1.0, 1.0, (15, 2))
    readers = group(generator, antennas)
    found = tags_on_runs(poses, way_m, readers, grid, most)
    np.testing.assert_array_equal(found, plain_tags_on_runs(poses, way_m, readers, grid, most))


def test_blind_and_covered_stretches_share_the_way():
    """Two sightings that overlap, one apart, one at the end, and a way without any."""
    seen = Sightings(
        way=np.array([0, 0, 0, 0]),
        tag=np.array([3, 4, 5, 6]),
        enter_m=np.array([1.0, 1.5, 3.0, 4.5]),
        leave_m=np.array([2.0, 2.5, 3.5, 5.0]),
        length_m=np.array([5.0, 2.0]),
    )
    covered, blind = seen.covered(), seen.blind()
    np.testing.assert_array_equal(covered.start_m, [1.0, 3.0, 4.5])
    np.testing.assert_array_equal(covered.end_m, [2.5, 3.5, 5.0])
    np.testing.assert_array_equal(blind.way, [0, 0, 0, 1])
    np.testing.assert_array_equal(blind.length_m, [1.0, 0.5, 1.0, 2.0])
    np.testing.assert_array_equal(seen.first_m(), [1.0, np.inf])
    np.testing.assert_array_equal(seen.tag_counts(), [4, 0])


@given(SEEDS)
@settings(max_examples=30)
def test_blind_stretches_agree_with_points_on_the_way(seed):
    """A place on the way is blind just if no antenna is near any tag there."""
    generator, grid, xy_m = world(seed, tags=25)
    readers = group(generator, 2)
    poses = np.array([[*generator.uniform(-2.0, 2.0, 2), generator.uniform(-3.0, 3.0)]])
    way_m = generator.uniform(-2.0, 2.0, (1, 2))
    blind = run_sightings(poses, way_m, readers, grid).blind()
    length_m = math.hypot(*way_m[0])
    start_m = antenna_segments(poses, way_m, readers.xy_m)[:, :2]
    for along_m in generator.uniform(0.0, length_m, 50):
        place_m = start_m + along_m / length_m * way_m[0]
        away_m = np.hypot(*(place_m[:, None] - xy_m).transpose(2, 0, 1)) - readers.radius_m[:, None]
        if abs(away_m.min()) > 1e-9:
            told = ((blind.start_m <= along_m) & (along_m <= blind.end_m)).any()
            assert told == (away_m.min() > 0.0)


def test_no_tag_and_no_way():
    """An empty floor shows nothing; a robot that stands sees a way of no length."""
    empty = bucket_grid(np.empty((0, 2)), 1.0)
    assert len(segment_sightings(np.ones((3, 4)), 0.5, empty)) == 0
    assert grid_for_ways(np.empty((0, 2))).columns >= 1
    grid = grid_for_ways(np.array([(0.1, 0.0), (2.0, 2.0)]))
    seen = segment_sightings(np.zeros((1, 4)), 0.5, grid)
    assert (seen.tag.tolist(), seen.enter_m.tolist(), seen.leave_m.tolist()) == ([0], [0.0], [0.0])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda grid, readers: segment_sightings(np.full((1, 4), np.nan), 0.5, grid), "must be finite"),
        (lambda grid, readers: segment_sightings(np.ones((1, 4)), -0.5, grid), "zero or more"),
        (
            lambda grid, readers: tags_on_runs(np.zeros((1, 3)), np.zeros((1, 2)), readers, grid, 0),
            "positive number",
        ),
        (
            lambda grid, readers: tags_on_runs(np.full((1, 3), np.inf), np.zeros((1, 2)), readers, grid, 1),
            "finite",
        ),
    ],
)
def test_wrong_input_is_named(call, message):
    """Each with what would be right."""
    generator, grid, _ = world(1)
    with pytest.raises(ValueError, match=message):
        call(grid, group(generator, 1))
