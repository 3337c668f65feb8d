"""Blind runs against theorems, closed cases, the plain twins and Monte Carlo; corridors; groups of antennas."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from layoutopt.geometry import lattice_points
from layoutopt.patterns.equilateral import equilateral
from layoutopt.patterns.listed import listed
from layoutopt.patterns.parallelogram import parallelogram
from layoutopt.patterns.square import square
from layoutopt.patterns.sudoku import sudoku
from layoutopt.patterns.tilted import tilted
from objectives import blind_runs
from objectives.corridors import corridors_of
from objectives.disc_outline import distinct, free_area_m2, shown_arcs
from objectives.disc_outline_kernels import bucket_counts, outline, placed
from objectives.gap_pieces import gap_pieces, gap_pieces_plain
from objectives.invisibility import (
    blind_probability,
    blind_probability_over_directions,
    blind_run_quantile,
    blind_run_survival,
    corridors,
    gap_exceedance,
    mean_blind_run,
    mean_gap,
    tail_constant,
)
from objectives.periodic_discs import antenna_group, columns, one_antenna

TILE_M, RADIUS_M = 0.7, 0.1
PATTERNS = {
    "square": square(pitch_m=0.35),
    "equilateral": equilateral(side_m=0.376),
    "tilted": tilted(tile_m=TILE_M, angle_rad=0.22),
    "zigzag": parallelogram(tile_m=TILE_M, shift_m=0.06),
    "four tags": listed(
        points_m=[(0.1, 0.15), (0.45, 0.2), (0.2, 0.5), (0.55, 0.62)], cell_m=[0.7, 0.7], shift_m=0.2
    ),
}
CROSS_M = np.array([(0.2, 0.0), (-0.2, 0.0), (0.0, 0.2), (0.0, -0.2)])
ANGLES = st.floats(0.0, 2.0 * math.pi)


def group_of(name, heading_rad=0.0, radius_m=0.05):
    """Return four antennas in a cross over a pattern."""
    return antenna_group(PATTERNS[name], CROSS_M, np.full(4, radius_m), heading_rad=heading_rad)


def sights():
    """Return single antennas whose discs do not meet, and do, and groups."""
    return {
        **{name: one_antenna(pattern, RADIUS_M) for name, pattern in PATTERNS.items()},
        "overlapping": one_antenna(PATTERNS["four tags"], 0.19),
        "group": group_of("tilted"),
        "turned group": group_of("four tags", heading_rad=0.6, radius_m=0.09),
    }


def monte_carlo(pattern, antenna_m, radius_m, length_m, direction_rad, heading_rad, count=40_000):
    """Return the share of random runs on which no antenna comes near a tag, and its standard error."""
    generator = np.random.Generator(np.random.Philox(5))
    start_m = generator.random((count, 2)) @ pattern.cell_m
    reach_m = length_m + radius_m + 1.0
    low, high = start_m.min(axis=0) - reach_m, start_m.max(axis=0) + reach_m
    tags_m = lattice_points(pattern.points_m, pattern.cell_m, (low[0], low[1], high[0], high[1]))
    way = np.array([math.cos(direction_rad), math.sin(direction_rad)])
    cos, sin = math.cos(heading_rad), math.sin(heading_rad)
    blind = np.ones(count, dtype=np.bool_)
    for x, y in antenna_m:
        from_m = start_m + np.array([cos * x - sin * y, sin * x + cos * y])
        for tag_m in tags_m:
            away_m = tag_m - from_m
            along_m = np.clip(away_m @ way, 0.0, length_m)
            blind &= np.hypot(*(away_m - along_m[:, None] * way).T) > radius_m
    share = float(blind.mean())
    return share, math.sqrt(max(share * (1.0 - share), 1.0 / count) / count)


@pytest.mark.parametrize("name", PATTERNS)
@given(direction_rad=ANGLES)
@settings(max_examples=15)
def test_santalo_in_every_direction(name, direction_rad):
    """Discs that do not meet: mean gap (A (1 - b) - N pi r²) / 2 r N, 45.5420 cm where there is no corridor."""
    pattern = PATTERNS[name]
    density = pattern.density_per_m2
    expected_m = (1.0 / density - math.pi * RADIUS_M**2) / (2.0 * RADIUS_M)
    along_rad = np.array([found.direction_rad for found in corridors(pattern, RADIUS_M)])
    away_rad = np.abs((direction_rad - along_rad + math.pi / 2.0) % math.pi - math.pi / 2.0)
    if away_rad.min() > 1e-9:
        assert mean_gap(pattern, RADIUS_M, direction_rad) == pytest.approx(expected_m, rel=1e-9)


def test_four_tags_a_tile_are_met_every_45_cm():
    """The mean gap of kim2010's floors, which no arrangement of four tags on 70 by 70 cm changes."""
    assert mean_gap(PATTERNS["tilted"], RADIUS_M, 0.3) == pytest.approx(0.455420, abs=5e-7)


def test_the_mean_gap_in_a_corridor_leaves_its_lines_out():
    """Along the rows of the square lattice 3/7 of all lines are blind; the others have gaps of d less a chord."""
    pattern = PATTERNS["square"]
    expected_m = (0.35**2 * (1.0 - 3.0 / 7.0) - math.pi * 0.01) / 0.2
    assert mean_gap(pattern, RADIUS_M, 0.0) == pytest.approx(expected_m, rel=1e-12)


@pytest.mark.parametrize("name", PATTERNS)
def test_short_runs_have_a_closed_form(name):
    """B_0 = 1 - n pi r², dB/dL = -2 r n, and linear until the nearest two discs, in every direction."""
    pattern = PATTERNS[name]
    density, nearest_m = pattern.density_per_m2, pattern.minimum_spacing_m() - 2.0 * RADIUS_M
    angle = np.linspace(0.0, math.pi, 17)
    for length_m in (0.0, 0.3 * nearest_m, nearest_m):
        expected = 1.0 - density * (math.pi * RADIUS_M**2 + 2.0 * RADIUS_M * length_m)
        np.testing.assert_allclose(blind_probability(pattern, RADIUS_M, length_m, angle), expected, atol=1e-12)


def test_square_corridors():
    """Two along the axes with 3/7 of the lines, two along the diagonals; none from half a pitch on."""
    found = corridors(PATTERNS["square"], RADIUS_M)
    assert [item.blind_fraction for item in found] == pytest.approx([3 / 7, 0.1918780, 3 / 7, 0.1918780], abs=1e-6)
    assert [item.direction_rad for item in found] == pytest.approx(np.arange(4) * math.pi / 4.0)
    assert corridors(PATTERNS["square"], 0.175) == ()
    assert corridors(equilateral(side_m=1.0), 0.434) == ()
    ways = {round(item.direction_rad, 9) for item in corridors(equilateral(side_m=1.0), 0.432)}
    assert sorted(ways) == pytest.approx(np.arange(3) * math.pi / 3.0, abs=1e-8)


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("rule", ["boxes", "diagonals"])
def test_every_latin_square_of_tilted_tiles_has_the_same_seams(seed, rule):
    """Along both axes 0.0098697 of all lines: twice the clearance of a disc from its tile's edge."""
    found = corridors(sudoku(tile_m=TILE_M, seed=seed, rule=rule), RADIUS_M)
    half_diagonal_m = TILE_M * math.sqrt(2.0) / 4.0
    seam_m = 2.0 * (TILE_M / 2.0 - half_diagonal_m * math.cos(math.radians(5.0)) - RADIUS_M)
    for direction_rad in (0.0, math.pi / 2.0):
        along = [item for item in found if item.direction_rad == pytest.approx(direction_rad, abs=1e-12)]
        assert along[0].blind_fraction == pytest.approx(seam_m / TILE_M, rel=1e-9)
        assert along[0].blind_fraction == pytest.approx(0.0098697, abs=1e-7)


def test_running_bond_closes_one_family_of_seams():
    """Rows moved by half a tile have seams along the rows only."""
    found = corridors(sudoku(tile_m=TILE_M, seed=1, bond="running"), RADIUS_M)
    assert {round(item.direction_rad, 9) for item in found} == {0.0}


@pytest.mark.parametrize("name", PATTERNS)
def test_every_corridor_is_free_and_bounded_by_discs(name):
    """Lines within it pass all tags by at least r, those just beyond do not; brute force over lines."""
    pattern = PATTERNS[name]
    tags_m = lattice_points(pattern.points_m, pattern.cell_m, (-9.0, -9.0, 9.0, 9.0))
    for item in corridors(pattern, RADIUS_M):
        aside = np.array([-math.sin(item.direction_rad), math.cos(item.direction_rad)])
        place_m = np.sort(tags_m[np.abs(tags_m @ aside) < 3.0] @ aside)
        free_m = [high - low - 2.0 * RADIUS_M for low, high in pairwise(place_m)]
        assert min(abs(np.array(free_m) - item.width_m)) < 1e-9


@pytest.mark.parametrize("name", sights())
@pytest.mark.parametrize("length_m", [0.31, 1.4])
def test_gaps_equal_their_plain_twin(name, length_m):
    """Free area, width of exits, and what stadia cover, by compiled code and by brute force in numpy."""
    sight = sights()[name]
    angle = np.array([0.0, 0.123, math.pi / 4.0, 1.9, 4.0])
    ours, truth = gap_pieces(sight, angle, length_m), gap_pieces_plain(sight, angle, length_m)
    np.testing.assert_allclose(ours.free_m2, truth.free_m2, atol=1e-12)
    np.testing.assert_allclose(ours.exposed_m, truth.exposed_m, atol=1e-9)
    for part in (0.1, 0.7, 1.0):
        for found, expected in zip(ours.within(part * length_m), truth.within_plain(part * length_m), strict=True):
            np.testing.assert_allclose(found, expected, atol=1e-9)
        for found, expected in zip(ours.within(part * length_m), ours.within_plain(part * length_m), strict=True):
            np.testing.assert_allclose(found, expected, atol=1e-12)


@given(st.integers(0, 2**32), st.integers(1, 7), st.floats(0.02, 0.5))
@settings(max_examples=40)
def test_outlines_equal_their_plain_twin(seed, count, radius_m):
    """Length of all uncovered arcs and free area of random discs of several sizes."""
    generator = np.random.Generator(np.random.Philox(seed))
    pattern = listed(points_m=generator.random((count, 2)), cell_m=[1.0, 1.2], shift_m=0.3)
    discs = antenna_group(pattern, np.zeros((1, 2)), np.array([radius_m])).facing(0.0)
    discs = distinct(discs)
    given_ = columns(discs)
    grid = bucket_counts(given_.cell, count)
    arcs, free_m2 = outline(given_.cell, *placed(given_.cell, *given_[1:4], 0.0, grid), grid)
    # Where discs touch an arc as short as the root of a rounding error may come or go.
    assert arcs[:, 2].sum() == pytest.approx(shown_arcs(discs)[:, 2].sum(), abs=1e-7)
    assert free_m2 == pytest.approx(free_area_m2(discs), abs=1e-11)


@pytest.mark.parametrize(
    ("name", "radius_m", "length_m", "direction_rad"),
    [
        ("square", 0.1, 0.8, 0.3),
        ("tilted", 0.1, 1.2, 0.0),
        ("four tags", 0.19, 0.15, 2.0),
        ("zigzag", 0.05, 0.9, 4.0),
    ],
)
def test_one_antenna_agrees_with_random_runs(name, radius_m, length_m, direction_rad):
    """Within 4.5 standard errors of 40,000 runs: a false alarm in 37,000 for all four."""
    share, error = monte_carlo(PATTERNS[name], np.zeros((1, 2)), radius_m, length_m, direction_rad, 0.0)
    found = blind_probability(PATTERNS[name], radius_m, length_m, direction_rad)
    assert abs(found - share) < 4.5 * error


@pytest.mark.parametrize(("direction_rad", "ahead_rad"), [(0.4, 0.0), (1.1, 0.7), (2.5, math.pi / 2.0)])
def test_a_group_agrees_with_random_runs(direction_rad, ahead_rad):
    """Direction of travel and heading apart; within 4.5 standard errors of 40,000 runs."""
    share, error = monte_carlo(
        PATTERNS["four tags"], CROSS_M, 0.05, 0.25, direction_rad, direction_rad + ahead_rad, 40_000
    )
    group = antenna_group(PATTERNS["four tags"], CROSS_M, np.full(4, 0.05), heading_rad=ahead_rad)
    found = float(blind_runs.blind_probabilities(group, 0.25, np.array([direction_rad]))[0])
    assert share > 0.01
    assert abs(found - share) < 4.5 * error


def test_a_group_of_one_antenna_is_one_antenna():
    """Wherever on the robot it sits, its runs are those of a point."""
    angle = np.linspace(0.0, 6.0, 13)
    group = antenna_group(PATTERNS["tilted"], np.array([(0.3, -0.2)]), np.array([RADIUS_M]), heading_rad=0.4)
    np.testing.assert_allclose(
        blind_runs.blind_probabilities(group, 0.7, angle),
        blind_probability(PATTERNS["tilted"], RADIUS_M, 0.7, angle),
        atol=1e-12,
    )


@pytest.mark.parametrize("name", PATTERNS)
@given(direction_rad=ANGLES, length_m=st.floats(0.0, 3.0))
@settings(max_examples=10)
def test_backwards_is_as_blind_as_forwards(name, direction_rad, length_m):
    """And symmetry of the pattern shows in the direction: quarter turns of the square and of tilted tiles."""
    pattern = PATTERNS[name]
    there, back = (blind_probability(pattern, RADIUS_M, length_m, direction_rad + turn) for turn in (0.0, math.pi))
    assert there == pytest.approx(back, abs=1e-10)
    if name in ("square", "tilted"):
        aside = blind_probability(pattern, RADIUS_M, length_m, direction_rad + math.pi / 2.0)
        assert there == pytest.approx(aside, abs=1e-10)


@given(st.floats(0.05, 0.7), ANGLES)
@settings(max_examples=15)
def test_mirror_images_are_mirrored(angle_rad, direction_rad):
    """Tiles tilted by phi and by 90 degrees less phi are mirror images of each other."""
    one = tilted(tile_m=TILE_M, angle_rad=angle_rad)
    other = tilted(tile_m=TILE_M, angle_rad=math.pi / 2.0 - angle_rad)
    there = blind_probability(one, RADIUS_M, 1.1, direction_rad)
    assert there == pytest.approx(blind_probability(other, RADIUS_M, 1.1, -direction_rad), abs=1e-10)


@pytest.mark.parametrize("name", ["square", "tilted", "four tags"])
def test_blind_probability_falls_with_the_length_by_the_gaps(name):
    """dB/dL = -(2 r N / A) P(gap > L), by central differences; P(gap > 0) = 1 and falls."""
    pattern, angle = PATTERNS[name], np.array([0.05, 0.6, 1.3])
    density, step_m = pattern.density_per_m2, 1e-6
    exceeded = []
    for length_m in (0.2, 0.5, 1.1):
        low, high = (blind_probability(pattern, RADIUS_M, length_m + sign * step_m, angle) for sign in (-1.0, 1.0))
        exceeded.append(gap_exceedance(pattern, RADIUS_M, length_m, angle))
        np.testing.assert_allclose(
            (high - low) / (2.0 * step_m), -2.0 * RADIUS_M * density * exceeded[-1], atol=2e-5
        )
    assert (gap_exceedance(pattern, RADIUS_M, 0.0, angle) == 1.0).all()
    assert (np.diff(exceeded, axis=0) <= 0.0).all()


def test_tail_of_the_square_lattice():
    """2 r C / d² tends to 2 / pi² (0.2012 at 10 mm, 0.2026 at 2 mm, d = 350 mm), and long runs fall as C / T."""
    pattern = PATTERNS["square"]
    scaled = [tail_constant(pattern, radius_m) * 2.0 * radius_m / 0.35**2 for radius_m in (0.01, 0.002)]
    assert scaled == pytest.approx([0.2012, 0.2026], abs=6e-5)
    assert scaled[1] == pytest.approx(2.0 / math.pi**2, abs=1e-4)
    long_m = 300.0
    free = 1.0 - math.pi * 0.01 / 0.35**2
    survival = blind_run_survival(pattern, RADIUS_M, np.array([long_m]))[0] / free
    assert survival * long_m == pytest.approx(tail_constant(pattern, RADIUS_M), rel=0.02)


def test_mean_blind_run():
    """Infinite where a corridor exists, with the reason; else half the mean squared gap, here by survival."""
    endless = mean_blind_run(PATTERNS["square"], RADIUS_M)
    assert endless.value_m == math.inf
    assert "4 corridors" in endless.reason
    pattern, radius_m = PATTERNS["square"], 0.2
    assert corridors(pattern, radius_m) == ()
    length_m = np.linspace(0.0, 2.5, 4001)
    survival = blind_run_survival(pattern, radius_m, length_m, 180)
    assert survival[-1] == pytest.approx(0.0, abs=1e-12)
    integral_m = float(((survival[1:] + survival[:-1]) / 2.0 * np.diff(length_m)).sum())
    assert mean_blind_run(pattern, radius_m, 180).value_m == pytest.approx(integral_m, rel=1e-4)
    assert tail_constant(pattern, radius_m) == 0.0


@pytest.mark.parametrize("name", ["square", "tilted"])
@pytest.mark.parametrize("probability", [0.0, 0.2, 0.9, 0.99])
def test_quantiles_invert_the_survival(name, probability):
    """Zero if that share sees a tag at once; else the survival there is what is left."""
    pattern = PATTERNS[name]
    found = blind_run_quantile(pattern, RADIUS_M, probability)
    left = blind_run_survival(pattern, RADIUS_M, np.array([found]))[0]
    if probability < pattern.density_per_m2 * math.pi * RADIUS_M**2:
        assert found == 0.0
    else:
        assert left == pytest.approx(1.0 - probability, rel=1e-6)


@pytest.mark.parametrize(("name", "tolerance"), [("square", 0.01), ("tilted", 0.01)])
def test_the_mean_over_directions_agrees_with_many_directions(name, tolerance):
    """The rule with nodes about the corridors against 20,000 even directions."""
    pattern = PATTERNS[name]
    angle = (np.arange(20_000) + 0.5) * math.pi / 20_000
    for length_m in (0.5, 2.0):
        many = blind_probability(pattern, RADIUS_M, length_m, angle)
        found = blind_probability_over_directions(pattern, RADIUS_M, length_m, 360)
        assert found.mean == pytest.approx(float(many.mean()), rel=tolerance)
        assert found.worst >= many.max() - 1e-12
        assert found.anisotropy == pytest.approx(found.worst / found.mean)


def test_what_kim2010_claims_and_where_it_fails():
    """The Sudoku floor is better in the worst direction and in the tail; a single good tilt on average."""
    floor, lattice = sudoku(tile_m=TILE_M, seed=1), PATTERNS["square"]
    worst = [blind_probability_over_directions(pattern, RADIUS_M, 2.0).worst for pattern in (lattice, floor)]
    assert 7.0 < worst[0] / worst[1] < 20.0
    tail = [blind_run_quantile(pattern, RADIUS_M, 0.99) for pattern in (lattice, floor)]
    assert 2.5 < tail[0] / tail[1] < 3.5
    means = [
        blind_probability_over_directions(pattern, RADIUS_M, 1.0).mean
        for pattern in (tilted(tile_m=TILE_M, angle_rad=math.radians(13.0)), floor)
    ]
    assert means[0] < means[1]


def test_a_group_has_corridors_of_its_own_for_each_way_round():
    """Directions lie in a full turn, and four antennas abreast leave fewer than one."""
    alone = corridors_of(one_antenna(PATTERNS["square"], 0.05))
    group = corridors_of(group_of("square"))
    assert 0 < len(group) < 2 * len(alone)
    assert all(0.0 <= item.direction_rad < 2.0 * math.pi for item in group)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: mean_gap(PATTERNS["square"], 0.0, 0.0), "positive and finite"),
        (lambda: corridors(PATTERNS["square"], -0.1), "positive and finite"),
        (lambda: tail_constant(PATTERNS["square"], math.inf), "positive and finite"),
        (lambda: blind_probability(PATTERNS["square"], 0.1, -1.0, 0.0), "zero or more and finite"),
        (lambda: blind_probability(PATTERNS["square"], 0.1, math.inf, 0.0), "zero or more and finite"),
        (lambda: blind_probability(PATTERNS["square"], 0.1, 1.0, math.nan), "direction must be finite"),
        (lambda: blind_run_quantile(PATTERNS["square"], 0.1, 1.0), "at least 0 and below 1"),
        (lambda: blind_run_quantile(PATTERNS["square"], 0.1, -0.1), "at least 0 and below 1"),
        (lambda: blind_probability_over_directions(PATTERNS["square"], 0.1, 1.0, 0), "at least one direction"),
        (lambda: corridors(listed(points_m=[(0.0, 0.0)]), 0.1), "laid once"),
        (lambda: antenna_group(PATTERNS["square"], np.empty((0, 2)), np.empty(0)), "at least one disc"),
    ],
)
def test_wrong_input_is_named(call, message):
    """Each with what would be right."""
    with pytest.raises(ValueError, match=message):
        call()
