"""Velocity from crossing times (kim2010): known numbers, random ways, degenerate cases, starts from two tags."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from layoutopt.estimators import crossing_time
from layoutopt.estimators.crossing_velocity import Degenerate, sensitivity, two_tag_start, velocity

RADIUS_M = 0.1


def times(start_distance, radius, speed, heading_rad):
    """Return the time to entry and the time inside of a straight way, by solving for its meeting with the disc."""
    beside = start_distance * math.sin(heading_rad)
    middle, half = start_distance * math.cos(heading_rad), math.sqrt(radius**2 - beside**2)
    return (middle - half) / speed, 2.0 * half / speed


def test_the_example():
    """l = 100, r = 10, v = 10, 3 degrees: both times to twelve digits, and back."""
    assert times(100.0, 10.0, 10.0, math.radians(3.0)) == pytest.approx(
        (9.134183401606, 1.704223891880), rel=1e-12
    )
    found = crossing_time.velocity(100.0, 10.0, 9.134183401606, 1.704223891880)
    assert found.speed_m_s == pytest.approx(10.0, rel=1e-12)
    assert np.degrees(found.headings_rad) == pytest.approx([3.0, -3.0], rel=1e-9)
    assert found.degenerate == ()


@given(st.floats(0.12, 5.0), st.floats(0.001, 3.0), st.floats(0.02, 0.98))
def test_speed_and_heading_come_back(start_m, speed_m_s, part):
    """For any way that crosses the disc, to rounding."""
    heading_rad = part * math.asin(RADIUS_M / start_m)
    found = velocity(start_m, RADIUS_M, *times(start_m, RADIUS_M, speed_m_s, heading_rad))
    assert found.speed_m_s == pytest.approx(speed_m_s, rel=1e-9)
    assert found.headings_rad == pytest.approx((heading_rad, -heading_rad), abs=1e-6)


def test_late_readings_move_speed_and_heading_as_derived():
    """50 ms on the time inside: -0.0230 and -0.226 degrees; on the time to entry: -0.0502 and +0.040 degrees."""
    entry_s, inside_s = times(100.0, 10.0, 10.0, math.radians(3.0))
    base = velocity(100.0, 10.0, entry_s, inside_s)
    for late, dv, dtheta in (((0.0, 0.05), -0.0230, -0.226), ((0.05, 0.0), -0.0502, 0.040)):
        moved = velocity(100.0, 10.0, entry_s + late[0], inside_s + late[1])
        assert moved.speed_m_s - base.speed_m_s == pytest.approx(dv, abs=1e-4)
        assert math.degrees(moved.headings_rad[0] - base.headings_rad[0]) == pytest.approx(dtheta, abs=1e-3)


@given(st.floats(0.15, 3.0), st.floats(0.05, 0.9))
def test_sensitivity_is_the_derivative(start_m, part):
    """Against central differences."""
    heading_rad = part * math.asin(RADIUS_M / start_m)
    entry_s, inside_s = times(start_m, RADIUS_M, 0.3, heading_rad)
    found, step_s = sensitivity(start_m, RADIUS_M, entry_s, inside_s), 1e-7
    for name, way in (("entry", (step_s, 0.0)), ("inside", (0.0, step_s))):
        low = velocity(start_m, RADIUS_M, entry_s - way[0], inside_s - way[1])
        high = velocity(start_m, RADIUS_M, entry_s + way[0], inside_s + way[1])
        slope = (high.speed_m_s - low.speed_m_s) / (2.0 * step_s)
        turn = (high.headings_rad[0] - low.headings_rad[0]) / (2.0 * step_s)
        assert getattr(found, f"speed_to_{name}") == pytest.approx(slope, rel=1e-3)
        assert getattr(found, f"heading_to_{name}") == pytest.approx(turn, rel=2e-2, abs=1e-4)


@pytest.mark.parametrize(
    ("given_times", "flags", "branches"),
    [
        ((0.1, 0.1, 1.0, 1.0), (Degenerate.INSIDE,), 0),
        ((0.05, 0.1, 1.0, 1.0), (Degenerate.INSIDE,), 0),
        ((1.0, 0.1, 0.0, 1.0), (Degenerate.NO_TIME,), 0),
        ((0.05, 0.1, 0.0, 1.0), (Degenerate.INSIDE, Degenerate.NO_TIME), 0),
        ((0.105, 0.1, *times(0.105, 0.1, 0.2, 0.5)), (Degenerate.NEAR_EDGE,), 2),
        ((0.105, 0.1, *times(0.105, 0.1, 0.2, 1.26)), (Degenerate.NEAR_EDGE, Degenerate.TANGENT), 2),
        ((0.105, 0.1, *times(0.105, 0.1, 0.2, 0.0)), (Degenerate.NEAR_EDGE, Degenerate.THROUGH_MIDDLE), 1),
        ((1.0, 0.1, *times(1.0, 0.1, 0.2, 0.9999 * math.asin(0.1))), (Degenerate.TANGENT,), 2),
        ((1.0, 0.1, 5.0, 0.0), (Degenerate.TANGENT,), 2),
        ((1.0, 0.1, *times(1.0, 0.1, 0.2, 0.0)), (Degenerate.THROUGH_MIDDLE,), 1),
        ((1.0, 0.1, 4.5, 1.2), (Degenerate.IMPOSSIBLE,), 1),
        ((0.105, 0.1, 0.025, 2.0), (Degenerate.NEAR_EDGE, Degenerate.IMPOSSIBLE), 1),
        ((1.0, 0.1, *times(1.0, 0.1, 0.2, 0.05)), (), 2),
    ],
)
def test_every_degenerate_case_has_its_flag(given_times, flags, branches):
    """All of them where several coincide, and as many headings as there are."""
    found = velocity(*given_times)
    assert found.degenerate == flags
    assert len(found.headings_rad) == branches
    assert math.isnan(found.speed_m_s) is (branches == 0)
    if branches == 2:
        assert found.headings_rad[0] == -found.headings_rad[1] > 0.0


def test_what_timing_explains_is_not_impossible():
    """Through the middle at 0.2 m/s the chord takes 1 s; 0.2 s more need 0.1 s on either edge."""
    entry_s, inside_s = times(1.0, 0.1, 0.2, 0.0)
    late = (1.0, 0.1, entry_s - 0.1, inside_s + 0.2)
    assert velocity(*late, timing_s=0.099).degenerate == (Degenerate.IMPOSSIBLE,)
    assert velocity(*late, timing_s=0.101).degenerate == (Degenerate.THROUGH_MIDDLE,)
    assert velocity(*late, timing_s=10.0).headings_rad == (0.0,)


_SIZES = st.floats(0.0, allow_infinity=False) | st.sampled_from([5e-324, 1e-200, 1e200, 1.7e308])


@given(_SIZES, _SIZES.filter(lambda size: size > 0.0), _SIZES, _SIZES, _SIZES)
@settings(max_examples=500)
def test_no_numbers_are_too_large_or_too_small(start_m, radius_m, entry_s, inside_s, timing_s):
    """Headings are numbers; the speed is one, unless a flag says that there is none."""
    found = velocity(start_m, radius_m, entry_s, inside_s, timing_s=timing_s)
    assert all(math.isfinite(heading) for heading in found.headings_rad)
    nothing = bool({Degenerate.INSIDE, Degenerate.NO_TIME} & set(found.degenerate))
    assert math.isfinite(found.speed_m_s) is bool(found.headings_rad) is not nothing
    if found.headings_rad:
        slopes = sensitivity(start_m, radius_m, entry_s, inside_s)
        assert not math.isnan(slopes.heading_to_entry + slopes.heading_to_inside)


def test_extreme_times_keep_their_ratio():
    """The headings of a crossing depend on the ratio of its times alone."""
    usual = velocity(1.0, 0.1, 1.0, 0.2)
    for unit_s in (1e-200, 1e-100, 1e100, 1e307):
        found = velocity(1.0, 0.1, unit_s, 0.2 * unit_s)
        assert found.headings_rad == pytest.approx(usual.headings_rad, rel=1e-9)
        assert found.speed_m_s * unit_s == pytest.approx(usual.speed_m_s, rel=1e-9)


@pytest.mark.parametrize("wrong", [(1.0, 0.0, 1.0, 1.0), (-1.0, 0.1, 1.0, 1.0), (1.0, 0.1, -1.0, 1.0)])
def test_impossible_numbers_are_refused(wrong):
    """With the numbers."""
    with pytest.raises(ValueError, match="a crossing needs a positive radius"):
        velocity(*wrong)
    with pytest.raises(ValueError, match="a crossing needs a positive radius"):
        velocity(1.0, 0.1, math.nan, 1.0)
    with pytest.raises(ValueError, match="start lies within the disc"):
        sensitivity(0.05, 0.1, 1.0, 1.0)


@given(st.integers(0, 2**32))
@settings(max_examples=300)
def test_a_start_from_two_tags(seed):
    """The true way is among the answers, all of which cross both discs at the given times."""
    generator = np.random.Generator(np.random.Philox(seed))
    start_m, angle, speed = (
        generator.uniform(-1.0, 1.0, 2),
        generator.uniform(-3.1, 3.1),
        generator.uniform(0.05, 1.0),
    )
    along, left = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
    ways = np.sort(generator.uniform(0.0, 3.0, 2))
    beside = generator.uniform(-0.97, 0.97, 2) * RADIUS_M
    if ways[1] - ways[0] < 0.01:
        return
    tags_m = start_m + ways[:, None] * along + beside[:, None] * left
    half = np.sqrt(RADIUS_M**2 - beside**2)
    entries, exits = tuple((ways - half) / speed), tuple((ways + half) / speed)
    found = two_tag_start(tags_m, RADIUS_M, entries, exits)
    assert 1 <= len(found) <= 4
    for item in found:
        way = np.array([math.cos(item.direction_rad), math.sin(item.direction_rad)])
        for tag_m, entry, leave in zip(tags_m, entries, exits, strict=True):
            for moment in (entry, leave):
                place_m = np.array(item.place_m) + item.speed_m_s * (moment - item.time_s) * way
                assert math.dist(place_m, tag_m) == pytest.approx(RADIUS_M, abs=2e-6)
    true_m = start_m + speed * max(exits) * along
    off = [abs(item.speed_m_s - speed) + math.dist(item.place_m, true_m) for item in found]
    assert min(off) < 1e-4


def test_mirror_images_come_in_pairs():
    """About the line through both tags; tags on one side of the way, or on both."""
    found = two_tag_start(np.array([(0.0, 0.0), (1.0, 0.0)]), RADIUS_M, (0.0, 5.0), (0.9, 5.7))
    assert len(found) == 4
    for first, second in ((0, 1), (2, 3)):
        assert found[first].speed_m_s == pytest.approx(found[second].speed_m_s)
        assert found[first].place_m == pytest.approx((found[second].place_m[0], -found[second].place_m[1]))
        assert found[first].direction_rad == pytest.approx(-found[second].direction_rad)


def test_times_that_no_way_has():
    """Discs ten metres apart cannot be crossed a second after each other by a way that stays a second in each."""
    assert two_tag_start(np.array([(0.0, 0.0), (10.0, 0.0)]), RADIUS_M, (0.0, 1.5), (1.0, 2.5)) == ()
    with pytest.raises(ValueError, match="a start from two tags needs"):
        two_tag_start(np.zeros((2, 2)), RADIUS_M, (0.0, 1.0), (0.5, 1.5))


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
def test_a_start_from_two_tags_needs_numbers(wrong):
    """Every one of its numbers."""
    tags_m, entries, exits = np.array([(0.0, 0.0), (1.0, 0.0)]), (0.0, 5.0), (0.9, 5.7)
    for changed in (
        (tags_m, RADIUS_M, (wrong, 5.0), exits),
        (tags_m, RADIUS_M, (0.0, wrong), exits),
        (tags_m, RADIUS_M, entries, (wrong, 5.7)),
        (tags_m, RADIUS_M, entries, (0.9, wrong)),
        (tags_m, wrong, entries, exits),
        (np.array([(0.0, 0.0), (1.0, wrong)]), RADIUS_M, entries, exits),
    ):
        with pytest.raises(ValueError, match="a start from two tags needs"):
            two_tag_start(*changed)


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=8, max_size=8), _SIZES)
@settings(max_examples=500)
def test_a_start_from_two_tags_answers_in_numbers_or_refuses(values, radius_m):
    """Whatever their size."""
    tags_m, edges = np.array(values[:4]).reshape(2, 2), sorted(values[4:])
    try:
        found = two_tag_start(tags_m, radius_m, (edges[0], edges[2]), (edges[1], edges[3]))
    except ValueError:
        return
    for item in found:
        assert all(map(math.isfinite, (*item.place_m, item.speed_m_s, item.direction_rad)))
