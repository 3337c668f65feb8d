"""The half-gap rule: printed and derived numbers, and where it does not apply."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import box

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.layout import FloorTags, Layout, ReaderGroup, TagPattern, ZonePattern
from layoutopt.patterns.listed import listed
from layoutopt.patterns.square import square
from layoutopt.patterns.triangular import triangular
from layoutopt.readers.profiles import COMMERCIAL
from layoutopt.robot import Robot
from layoutopt.scenario import Role, Scenario
from layoutopt.site import Site, Zone
from objectives.position_bound import CARD, PositionBound, half_gap_bound, half_gap_failures, static_error

DISTANCE = st.floats(0.01, 2.0)


def scores(*zones):
    """Return the scores of (zone name, pattern) pairs."""
    group = ReaderGroup(
        name="one", poses=[(0, 0, 0.02, 0)], antenna=SphereAntenna(side_m=0.06), profile=COMMERCIAL, slots=(0,)
    )
    floor_tags = FloorTags(zones=tuple(ZonePattern(zone=name, pattern=pattern) for name, pattern in zones))
    site = Site(name="room", floor=box(0, 0, 2, 2), zones=(Zone(name="dock", region=box(0, 0, 1, 1)),))
    robot = Robot(outline_m=[(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3)])
    world = Scenario(name="design", role=Role.DESIGN, site=site, robot=robot)
    found = PositionBound()(Layout(floor_tags=floor_tags, readers=(group,)), world, None)
    return {name: score.value for name, score in found.items()}


@given(DISTANCE)
def test_square(pitch_m):
    """Half a pitch in x and in y: sqrt(1/2) pitches, printed as 0.707 (han2006, Eq. 16)."""
    gap = half_gap_bound(square(pitch_m=pitch_m))
    assert gap.derived_m == pytest.approx(math.sqrt(0.5) * pitch_m)
    assert gap.published_m == pytest.approx(0.707 * pitch_m)


@given(DISTANCE)
def test_isosceles(pitch_m):
    """Rows one pitch apart: sqrt(1/16 + 1/4) = 0.559 pitches by Eq. 19, where Eq. 20 prints 0.58."""
    gap = half_gap_bound(triangular(pitch_m=pitch_m))
    assert gap.derived_m == pytest.approx(0.5590170 * pitch_m, rel=1e-6)
    assert gap.published_m == pytest.approx(0.58 * pitch_m)


@given(DISTANCE)
def test_equilateral_with_row_gap(row_gap_m):
    """Equilateral triangles with rows d apart: sqrt(1/12 + 1/4) = 1/sqrt(3) d, likely the origin of 0.58."""
    gap = half_gap_bound(triangular(pitch_m=2.0 * row_gap_m / math.sqrt(3.0), row_gap_m=row_gap_m))
    assert gap.derived_m == pytest.approx(row_gap_m / math.sqrt(3.0))
    assert gap.published_m is None


@given(DISTANCE)
def test_equilateral_with_side(side_m):
    """Equilateral triangles of side d: sqrt(1/16 + 3/16) = 0.5 d; the paper prints nothing for them."""
    gap = half_gap_bound(triangular(pitch_m=side_m, row_gap_m=side_m * math.sqrt(3.0) / 2.0))
    assert gap.derived_m == pytest.approx(0.5 * side_m)
    assert gap.published_m is None


@given(
    st.lists(st.tuples(st.integers(0, 30), st.integers(0, 20)), min_size=1, max_size=6, unique=True),
    st.tuples(st.integers(-100, 100), st.integers(-100, 100)),
)
def test_the_rule_is_the_largest_gap_of_columns_and_rows(places, shift):
    """A midrange reading through a long box sees no farther than the next columns and rows; the origin is free.

    Places are whole millimetres in a cell of 31 mm by 21 mm; gaps are counted off on the ruler.
    """
    pattern = listed(points_m=np.add(places, shift) / 1000.0, cell_m=(0.031, 0.021))
    gaps = []
    for axis, period in ((0, 31), (1, 21)):
        taken = {place[axis] for place in places}
        free = [0]
        for step in range(2 * period):
            free.append(0 if step % period in taken else free[-1] + 1)
        gaps.append(max(free) + 1 if len(taken) > 1 else period)
    assert half_gap_bound(pattern).derived_m == pytest.approx(math.hypot(*gaps) / 2000.0)
    assert half_gap_bound(pattern).published_m is None


@pytest.mark.parametrize(
    ("pattern", "why"),
    [
        (listed(points_m=[(0, 0)]), "laid once"),
        (TagPattern(name="sheared", points_m=[(0, 0)], cell_m=[(0.1, 0.0), (0.05, 0.1)]), "axis-parallel"),
        (TagPattern(name="empty", points_m=[], cell_m=np.eye(2)), "no tag"),
    ],
    ids=["once", "sheared", "empty"],
)
def test_where_the_rule_does_not_apply(pattern, why):
    """The reason is given, and the objective makes no scores."""
    with pytest.raises(ValueError, match=f"does not apply, because .*{why}"):
        half_gap_bound(pattern)
    assert scores(("", pattern)) == {}


def test_zones_with_their_own_pattern_are_scored_apart():
    """The base pattern under the plain names, the dock's under its own; flat rows have no printed number."""
    found = scores(("", square(pitch_m=0.1)), ("dock", triangular(pitch_m=0.06, row_gap_m=0.05)))
    assert set(found) == {"published_half_gap", "derived_half_gap", "dock.derived_half_gap"}
    assert found["derived_half_gap"] == pytest.approx(0.0707107, rel=1e-5)
    assert found["dock.derived_half_gap"] == pytest.approx(math.hypot(0.015, 0.025))


def test_a_floor_with_tags_in_a_zone_only():
    """Then the zone's pattern is the base."""
    found = scores(("dock", square(pitch_m=0.1)))
    assert found["derived_half_gap"] == found["dock.derived_half_gap"]


def test_the_card_claims_no_bound():
    """The published number is no proven bound, and the card says so."""
    assert CARD.bounds == ""
    assert CARD.fidelity == "published"
    assert "no proven bound" in CARD.summary.lower()


@pytest.mark.parametrize("published", [True, False])
def test_failing_radii_are_those_of_a_sweep(published):
    """A radius lies in one of the ranges if and only if the worst place errs by more than the bound."""
    pattern = triangular(pitch_m=1.0)
    ranges = half_gap_failures(pattern, 0.5, 3.0, published=published)
    assert all(low < high for low, high in ranges)
    bound_m = 0.58 if published else math.sqrt(5.0) / 4.0
    for radius_m in np.linspace(0.5, 3.0, 173):
        inside = any(low <= radius_m <= high for low, high in ranges)
        assert inside == (static_error(pattern, float(radius_m)).worst_m > bound_m * (1.0 + 1e-9)), radius_m


def test_failing_radii_end_where_the_worst_error_meets_the_bound():
    """At the end of a range the worst error is the bound, unless it jumps there."""
    pattern = triangular(pitch_m=1.0)
    for _, high_m in half_gap_failures(pattern, 0.5, 3.0):
        before, after = (static_error(pattern, high_m + side * 1e-7).worst_m for side in (-1.0, 1.0))
        assert after <= 0.58 < before + 1e-6


def test_the_bound_of_the_square_pattern_never_fails():
    """From half a pitch to three pitches, printed and derived."""
    for published in (True, False):
        assert half_gap_failures(square(pitch_m=0.1), 0.05, 0.3, published=published) == ()


@pytest.mark.parametrize(
    ("pattern", "low_m", "high_m", "message"),
    [
        (triangular(pitch_m=0.1, row_gap_m=0.05), 0.05, 0.1, "prints no bound"),
        (square(pitch_m=0.1), 0.1, 0.05, "ascending"),
        (square(pitch_m=0.1), 0.0, 0.05, "positive"),
        (square(pitch_m=0.1), 0.1, math.inf, "ascending"),
    ],
)
def test_failing_radii_refuse_what_has_no_answer(pattern, low_m, high_m, message):
    """Patterns without a printed bound, and radii that are none."""
    with pytest.raises(ValueError, match=message):
        half_gap_failures(pattern, low_m, high_m)
