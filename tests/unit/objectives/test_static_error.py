"""True errors of static readings against brute force and closed cases; covering radius, box, heading bound."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from layoutopt.geometry import lattice_points
from layoutopt.patterns.equilateral import equilateral
from layoutopt.patterns.listed import listed
from layoutopt.patterns.square import square
from layoutopt.patterns.tilted import tilted
from layoutopt.patterns.triangular import triangular
from objectives.heading_bound import heading_bound
from objectives.invisibility import blind_probability
from objectives.position_bound import (
    ESTIMATORS,
    box_error,
    check_half_gap,
    covering_density,
    covering_radius,
    half_gap_bound,
    static_error,
)

EQUAL_DENSITY = equilateral(side_m=math.sqrt(2.0 / math.sqrt(3.0)))
PATTERNS = {
    "square": square(pitch_m=1.0),
    "isosceles": triangular(pitch_m=1.0),
    "tilted": tilted(tile_m=2.0, angle_rad=0.25),
    "four tags": listed(points_m=[(0.1, 0.2), (0.9, 0.7), (1.3, 1.6), (0.2, 1.2)], cell_m=[2.0, 1.8], shift_m=0.3),
}


def box_errors(pattern, place_m, half_m):
    """Return the distance of a box reader's midrange from places, shape (n,); NaN where nothing is read."""
    low, high = place_m.min(axis=0) - half_m, place_m.max(axis=0) + half_m
    tags_m = lattice_points(pattern.points_m, pattern.cell_m, (low[0], low[1], high[0], high[1]))
    read = np.abs(place_m[:, None] - tags_m).max(axis=2) < half_m
    some = read.any(axis=1)
    spread = np.where(read[some, :, None], tags_m, np.nan)
    found = np.full(len(place_m), np.nan)
    found[some] = np.hypot(*(place_m[some] - (np.nanmin(spread, axis=1) + np.nanmax(spread, axis=1)) / 2.0).T)
    return found


def midpoints(pattern, count):
    """Return the midpoints of a fine division of the cell."""
    steps = (np.arange(count) + 0.5) / count
    return np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2) @ pattern.cell_m


def refined_worst(pattern, half_m):
    """Return the worst error of a box reader over a grid that is refined about its worst places."""
    place_m, size_m = midpoints(pattern, 150), math.sqrt(pattern.cell_area_m2) / 150
    offset = np.stack(np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9)), axis=-1).reshape(-1, 2)
    for _ in range(6):
        found = box_errors(pattern, place_m, half_m)
        best = np.argsort(-np.nan_to_num(found))[:60]
        place_m = (place_m[best, None] + size_m * offset).reshape(-1, 2)
        size_m /= 4.0
    return float(np.nanmax(found))


@given(st.floats(0.3, 3.0), st.sampled_from(sorted(PATTERNS)))
@settings(max_examples=40)
def test_no_estimator_is_better_in_the_worst_case_than_the_minimax(radius_m, name):
    """The definition of the minimax estimator; and no mean is above its worst."""
    found = {which: static_error(PATTERNS[name], radius_m, which) for which in ESTIMATORS}
    assert found["minimax"].worst_m <= min(found["midrange"].worst_m, found["centroid"].worst_m) * (1.0 + 1e-9)
    for error in found.values():
        assert 0.0 < error.mean_m <= error.worst_m * (1.0 + 1e-9)


@given(st.floats(0.05, 3.0), st.sampled_from(sorted(PATTERNS)), st.sampled_from(ESTIMATORS))
@settings(max_examples=60)
def test_a_tag_is_seen_where_a_run_of_no_length_is_not_blind(radius_m, name, which):
    """Whatever the estimator: two codes find the area of a union of discs, this one and that of blind runs."""
    found = static_error(PATTERNS[name], radius_m, which).detection_probability
    assert found == pytest.approx(1.0 - blind_probability(PATTERNS[name], radius_m, 0.0, 0.0), abs=1e-9)


@given(st.floats(0.01, 0.49))
def test_one_tag_in_view_errs_by_the_distance_to_it(radius_m):
    """Discs that do not meet: worst r, mean 2 r / 3, seen in pi r² of the area, for every estimator."""
    for which in ESTIMATORS:
        found = static_error(square(pitch_m=1.0), radius_m, which)
        assert found.worst_m == pytest.approx(radius_m, rel=1e-9)
        assert found.mean_m == pytest.approx(2.0 * radius_m / 3.0, rel=1e-9)
        assert found.detection_probability == pytest.approx(math.pi * radius_m**2, rel=1e-9)


def test_a_radius_of_one_pitch_on_the_square():
    """The disc touches four tags from each tag: half a diagonal for midrange, half a pitch for centroid."""
    assert static_error(square(pitch_m=1.0), 1.0).worst_m == pytest.approx(math.sqrt(0.5), abs=1e-9)
    assert static_error(square(pitch_m=1.0), 1.0).mean_m == pytest.approx(0.3231, abs=5e-5)
    assert static_error(square(pitch_m=1.0), 1.0, "centroid").worst_m == pytest.approx(0.5, abs=1e-9)


@given(st.floats(0.05, 5.0), st.floats(0.2, 3.0))
@settings(max_examples=25)
def test_errors_scale_with_the_floor(scale, radius_m):
    """Pitch and radius in other units give the same error in these units."""
    base, scaled = (
        static_error(square(pitch_m=1.0), radius_m),
        static_error(square(pitch_m=scale), scale * radius_m),
    )
    assert scaled.worst_m == pytest.approx(scale * base.worst_m, rel=1e-7)
    assert scaled.mean_m == pytest.approx(scale * base.mean_m, rel=1e-7)


def test_where_the_published_bound_fails():
    """The half-gap bound holds on the square, and fails on the triangular pattern about a radius of one pitch."""
    assert all(check_half_gap(square(pitch_m=1.0), radius).derived_holds for radius in np.arange(0.54, 3.0, 0.03))
    peak = check_half_gap(triangular(pitch_m=1.0), 1.08)
    assert peak.worst_m == pytest.approx(0.649, abs=5e-4)
    assert (peak.published_holds, peak.derived_holds) == (False, False)
    between = check_half_gap(triangular(pitch_m=1.0), 1.56)
    assert (between.published_holds, between.derived_holds) == (True, False)
    assert check_half_gap(triangular(pitch_m=1.0), 1.3).derived_holds
    assert check_half_gap(EQUAL_DENSITY, 1.0).published_holds is None


@pytest.mark.parametrize(
    ("radius_m", "square_m", "isosceles_m", "equilateral_m"),
    [
        (0.075, 0.0216, 0.0190, 0.0187),
        (0.080, 0.0202, 0.0184, 0.0182),
        (0.120, 0.0221, 0.0180, 0.0164),
        (0.125, 0.0199, 0.0171, 0.0160),
    ],
)
def test_mean_errors_at_a_tenth_of_a_metre(radius_m, square_m, isosceles_m, equilateral_m):
    """Mean midrange errors of han2006's tag gap; 125 mm comes to the 0.020 and 0.016 m of its Table 1."""
    patterns = (square(pitch_m=0.1), triangular(pitch_m=0.1), equilateral(side_m=0.1 * EQUAL_DENSITY.cell_m[0, 0]))
    found = [static_error(pattern, radius_m).mean_m for pattern in patterns]
    assert found == pytest.approx([square_m, isosceles_m, equilateral_m], abs=6e-5)


def test_covering_radii():
    """Half the diagonal, the circumradius of an isosceles and of an equilateral cell."""
    assert covering_radius(square(pitch_m=1.0)) == pytest.approx(math.sqrt(0.5), rel=1e-9)
    assert covering_radius(triangular(pitch_m=1.0)) == pytest.approx(0.625, rel=1e-9)
    assert covering_radius(equilateral(side_m=1.0)) == pytest.approx(1.0 / math.sqrt(3.0), rel=1e-9)


@pytest.mark.parametrize("name", PATTERNS)
def test_from_the_covering_radius_on_nothing_is_missed(name):
    """The share of places that read a tag is one just above it, and below one just beneath."""
    radius_m = covering_radius(PATTERNS[name])
    assert static_error(PATTERNS[name], radius_m * 1.001).detection_probability == pytest.approx(1.0, abs=1e-12)
    assert static_error(PATTERNS[name], radius_m * 0.97).detection_probability < 1.0 - 1e-6


@pytest.mark.parametrize("name", PATTERNS)
def test_no_pattern_beats_kershner(name):
    """Every pattern whose discs cover the floor has at least that density; the equilateral lattice has just it."""
    pattern = PATTERNS[name]
    assert pattern.density_per_m2 >= covering_density(covering_radius(pattern)) * (1.0 - 1e-12)
    best = equilateral(side_m=math.sqrt(3.0))
    assert best.density_per_m2 == pytest.approx(covering_density(covering_radius(best)), rel=1e-9)


def test_seeing_more_tags_needs_more():
    """Never fewer than k per disc on average, and more for every further tag."""
    needed = [covering_density(0.3, k) for k in range(1, 8)]
    assert (np.diff(needed) > 0.0).all()
    assert all(density * math.pi * 0.09 >= k for k, density in enumerate(needed, start=1))
    assert covering_density(0.2171) == pytest.approx(4.0 / 0.49, rel=1e-3)


@given(st.integers(1, 4), st.floats(0.0, 0.999))
def test_box_on_the_square_lattice(whole, part):
    """Side (k + f) d: worst max(f, 1 - f) d / 2 and mean (f² + (1 - f)²) d / 4 along each axis."""
    found = box_error(square(pitch_m=1.0), whole + part)
    part = (whole + part) - whole
    for axis in (0, 1):
        assert found.worst_axis_m[axis] == pytest.approx(max(part, 1.0 - part) / 2.0, abs=1e-9)
        assert found.mean_axis_m[axis] == pytest.approx((part**2 + (1.0 - part) ** 2) / 4.0, abs=1e-9)
    assert found.worst_m == pytest.approx(math.hypot(*found.worst_axis_m), abs=1e-9)


@pytest.mark.parametrize(("side_m", "worst_m"), [(1.0, math.sqrt(0.5)), (2.0, math.sqrt(5.0) / 4.0)])
def test_box_on_the_isosceles_pattern(side_m, worst_m):
    """The stagger helps only where two rows are always seen."""
    assert box_error(triangular(pitch_m=1.0), side_m).worst_m == pytest.approx(worst_m, abs=1e-9)


@pytest.mark.parametrize("name", ["square", "isosceles", "tilted"])
def test_box_agrees_with_brute_force(name):
    """Worst to 1e-4, mean to what a grid allows."""
    pattern, side_m = PATTERNS[name], 1.37
    found = box_error(pattern, side_m)
    assert found.worst_m == pytest.approx(refined_worst(pattern, side_m / 2.0), abs=1e-4)
    brute = box_errors(pattern, midpoints(pattern, 500), side_m / 2.0)
    assert found.mean_m == pytest.approx(np.nanmean(brute), abs=1e-3)


@given(st.integers(0, 2**32))
@settings(max_examples=50)
def test_no_error_turns_the_heading_beyond_its_bound(seed):
    """Errors of any direction up to their bounds, and the least-squares turn."""
    generator = np.random.Generator(np.random.Philox(seed))
    antenna_m = generator.normal(size=(4, 2))
    error_m = generator.uniform(0.0, 0.6, 4)
    bound_rad = heading_bound(antenna_m, error_m)
    if bound_rad is None:
        return
    for _ in range(30):
        angle = generator.uniform(0.0, 2.0 * math.pi, 4)
        moved_m = antenna_m + error_m[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        centred, seen = antenna_m - antenna_m.mean(axis=0), moved_m - moved_m.mean(axis=0)
        product = np.sum(np.conj(centred @ (1, 1j)) * (seen @ (1, 1j)))
        assert abs(np.angle(product)) <= bound_rad + 1e-12


def test_no_heading_from_one_antenna_or_from_errors_as_wide_as_the_robot():
    """There is no bound, rather than a clamped one."""
    assert heading_bound(np.array([(0.3, 0.0)]), np.array([0.01])) is None
    assert heading_bound(np.array([(-0.1, 0.0), (0.1, 0.0)]), np.array([0.1, 0.1])) is None


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: static_error(square(pitch_m=1.0), 0.0), "positive and finite"),
        (lambda: static_error(square(pitch_m=1.0), math.inf), "positive and finite"),
        (lambda: static_error(square(pitch_m=1.0), 1.0, "median"), "midrange, centroid, minimax"),
        (lambda: static_error(listed(points_m=[(0.0, 0.0)]), 1.0), "laid once"),
        (lambda: covering_radius(listed(points_m=[(0.0, 0.0)])), "laid once"),
        (lambda: covering_density(-1.0), "positive and finite"),
        (lambda: covering_density(1.0, 0), "at least one tag"),
        (lambda: box_error(square(pitch_m=1.0), 0.0), "positive, finite side"),
        (lambda: box_error(PATTERNS["four tags"], 1.0), "no axis-parallel rectangle"),
        (lambda: half_gap_bound(PATTERNS["four tags"]), "no axis-parallel rectangle"),
    ],
)
def test_wrong_input_is_named(call, message):
    """Each with the rule."""
    with pytest.raises(ValueError, match=message):
        call()
