"""Tile schedules: what is made, where it goes, and that together it is the pattern."""

import math
from functools import cache

import numpy as np
import pytest

from layoutopt.geometry import lattice_points
from layoutopt.layout import TagPattern
from layoutopt.patterns.equilateral import equilateral
from layoutopt.patterns.line import line
from layoutopt.patterns.listed import listed
from layoutopt.patterns.parallelogram import parallelogram
from layoutopt.patterns.random import random
from layoutopt.patterns.square import square
from layoutopt.patterns.sudoku import sudoku
from layoutopt.patterns.sudoku_grid import sudoku_grid
from layoutopt.patterns.tiles import tile_schedule
from layoutopt.patterns.tilted import least_tile_m, tilted
from layoutopt.patterns.triangular import triangular

TILE_M = 0.7
PATTERNS = {
    "square": square(pitch_m=0.35),
    "isosceles": triangular(pitch_m=0.35),
    "equilateral": equilateral(side_m=0.376),
    "zigzag": parallelogram(tile_m=TILE_M, shift_m=0.05),
    "sheared": parallelogram(tile_m=TILE_M, shift_m=0.05, form="sheared"),
    "line": line(spacing_m=0.376),
    "tilted": tilted(tile_m=TILE_M, angle_rad=0.3),
    "sudoku": sudoku(tile_m=TILE_M, seed=3),
    "diagonal": sudoku(tile_m=TILE_M, seed=3, rule="diagonals"),
    "bond": sudoku(tile_m=TILE_M, seed=3, bond="running"),
    "random": random(tile_m=TILE_M, radius_m=0.1, seed=1),
    "listed": listed(points_m=[(0.1, 0.1), (0.3, 0.5)], cell_m=[0.7, 0.6], shift_m=0.2),
}


@cache
def scheduled(name):
    return tile_schedule(PATTERNS[name])


@pytest.mark.parametrize("name", PATTERNS)
def test_tiles_make_the_pattern(name):
    """Each laid tag is one of the pattern's, and a period of tiles has as many as its area demands."""
    pattern = PATTERNS[name]
    schedule = scheduled(name)
    laid_m = schedule.laid_m()
    low, high = laid_m.min(axis=0) - 0.01, laid_m.max(axis=0) + 0.01
    tags_m = lattice_points(pattern.points_m, pattern.cell_m, (low[0], low[1], high[0], high[1]))
    away_m = np.hypot(*(laid_m[:, None] - tags_m).transpose(2, 0, 1))
    assert away_m.min(axis=1).max() < 1e-9
    apart_m = np.hypot(*(laid_m[:, None] - laid_m).transpose(2, 0, 1)) + 9.0 * np.eye(len(laid_m))
    assert apart_m.min() > 0.9 * pattern.minimum_spacing_m()
    area_m2 = schedule.kind.size * schedule.size_m[0] * schedule.size_m[1]
    assert len(laid_m) == pytest.approx(area_m2 * pattern.density_per_m2, rel=1e-9)
    assert schedule.counts().sum() == schedule.kind.size


@pytest.mark.parametrize(
    ("name", "kinds"),
    [("square", 1), ("tilted", 1), ("zigzag", 1), ("line", 1), ("sudoku", 9), ("diagonal", 9), ("random", 81)],
)
def test_numbers_of_kinds(name, kinds):
    """A Sudoku floor takes nine kinds of tiles, nine of each; a random floor has no two alike."""
    schedule = scheduled(name)
    assert len(schedule.tiles_m) == kinds
    if kinds == 9:
        assert schedule.counts().tolist() == [9] * 9


def test_sizes_and_bond():
    """Three tags in a row on the line tile, and rows of tiles moved by half a spacing or half a tile."""
    schedule = scheduled("line")
    assert schedule.size_m == pytest.approx((3.0 * 0.376, math.sqrt(0.75) * 0.376))
    assert len(schedule.tiles_m[0]) == 3
    assert schedule.row_offset_m == pytest.approx([0.0, 0.188])
    assert scheduled("bond").row_offset_m[:2] == pytest.approx([0.0, 0.35])


def test_mirror_images():
    """A tilt's mirror image is the tilt to the other side: of Sudoku tiles K and 11 - K, and 1 is its own."""
    schedule = scheduled("sudoku")
    mirror = np.array(schedule.mirror_of)
    assert (mirror[mirror] == np.arange(9)).all()
    assert (mirror == np.arange(9)).sum() == 1
    assert scheduled("square").mirror_of == (0,)
    assert scheduled("tilted").mirror_of == (-1,)


def test_quarter_turns_are_one_kind():
    """Two tiles of one cell that differ by a turn are made alike."""
    corner = np.array([(0.1, 0.1), (0.3, 0.12)])
    turned = np.column_stack([0.5 - corner[:, 1], corner[:, 0]])
    pattern = listed(points_m=[*corner, *(turned + np.array([0.5, 0.0]))], cell_m=[1.0, 0.5])
    pattern = type(pattern)(
        name="listed", points_m=pattern.points_m, cell_m=pattern.cell_m, parameters={"tile_m": 0.5}
    )
    schedule = tile_schedule(pattern)
    assert len(schedule.tiles_m) == 1
    assert schedule.quarter_turns.tolist() == [[0, 1]]


def test_a_pattern_laid_once_has_no_tiles():
    """And says so."""
    with pytest.raises(ValueError, match="laid once"):
        tile_schedule(listed(points_m=[(0.0, 0.0)]))


@pytest.mark.parametrize("angle_deg", [0.0, 10.0, 45.0, 77.0])
def test_the_least_tile_just_holds_its_discs(angle_deg):
    """4 r at 0 degrees, 6.83 r at 45: discs touch an edge, or each other, and a smaller tile is refused."""
    angle_rad, radius_m = math.radians(angle_deg), 0.05
    least_m = least_tile_m(radius_m, angle_rad)
    pattern = tilted(tile_m=least_m * (1.0 + 1e-12), angle_rad=angle_rad, radius_m=radius_m)
    clearance_m = np.minimum(pattern.points_m, least_m - pattern.points_m).min()
    assert min(clearance_m, pattern.minimum_spacing_m() / 2.0) == pytest.approx(radius_m, rel=1e-9)
    with pytest.raises(ValueError, match="inside a tile tilted by"):
        tilted(tile_m=0.999 * least_m, angle_rad=angle_rad, radius_m=radius_m)
    assert least_tile_m(1.0, math.pi / 4.0) == pytest.approx(2.0 / (1.0 - math.sqrt(0.5)), rel=1e-12)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: square(pitch_m=0.0), "positive"),
        (lambda: equilateral(side_m=math.nan), "positive"),
        (lambda: line(spacing_m=-0.1), "positive"),
        (lambda: parallelogram(tile_m=0.7, shift_m=0.2), "between 0 and a quarter of the tile"),
        (lambda: tilted(tile_m=0.7, angle_rad=2.0), "between 0 and 90"),
        (lambda: sudoku(tile_m=0.7, seed=1, radius_m=0.11), "6.83 r"),
        (lambda: sudoku(tile_m=0.7, seed=-1), "seed"),
        (lambda: random(tile_m=0.7, radius_m=0.18, seed=1), "4 r"),
        (lambda: listed(points_m=[]), "at least one point"),
        (lambda: listed(points_m=[(0.1, 0.1), (0.1, 0.1)]), "share a place"),
        (lambda: listed(points_m=[(0.1, 0.1), (1.1, 0.1)], cell_m=(1.0, 1.0)), "share a place"),
        (lambda: listed(points_m=[(0.0, 0.0, 0.0), (0.1, 0.1, 0.0)]), "has an x and a y"),
        (lambda: listed(points_m=[0.1, 0.2]), "has an x and a y"),
        (lambda: square(pitch_m=math.inf), "pitch must be positive and finite"),
        (lambda: triangular(pitch_m=math.inf), "pitch must be positive and finite"),
        (lambda: triangular(pitch_m=0.1, row_gap_m=math.inf), "row gap must be positive and finite"),
        (lambda: triangular(pitch_m=0.1, row_gap_m=-0.1), "row gap must be positive and finite"),
        (lambda: tilted(tile_m=0.7, angle_rad=math.nan), "between 0 and 90"),
        (lambda: tilted(tile_m=0.7, angle_rad=0.1, radius_m=math.nan), "radius must be positive"),
        (lambda: parallelogram(tile_m=0.7, shift_m=math.nan), "between 0 and a quarter of the tile"),
    ],
)
def test_impossible_patterns_name_the_rule(call, message):
    """Never a silent clamp."""
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize("seed", [1.0, 1.5, -1, -1.0, math.nan, math.inf, True, None, "1"])
@pytest.mark.parametrize(
    "call",
    [
        lambda seed: sudoku(tile_m=0.7, seed=seed),
        lambda seed: random(tile_m=0.7, radius_m=0.1, seed=seed),
        lambda seed: sudoku_grid(seed, diagonals=True),
    ],
    ids=["sudoku", "random", "grid"],
)
def test_a_seed_is_a_whole_number(call, seed):
    """Zero or more, and no float that happens to be whole: a file would hold another pattern."""
    with pytest.raises(ValueError, match="a seed is zero or a positive whole number"):
        call(seed)


@pytest.mark.parametrize(
    "cell_m",
    [
        [(1.0, 0.5), (0.0, 1.0)],
        [(1.0, 1e-3), (0.2, 1.0)],
        [(0.0, 1.0), (1.0, 0.0)],
        [(-1.0, 0.0), (0.0, 1.0)],
        [(1.0, 0.0), (0.5, -1.0)],
        [(0.8, 0.6), (-0.6, 0.8)],
    ],
    ids=["sheared up", "a little up", "exchanged", "to the left", "downwards", "turned"],
)
def test_tiles_lie_along_the_axes(cell_m):
    """A cell that leans or is turned is none of tiles in rows."""
    pattern = TagPattern(name="any", points_m=[(0.1, 0.2), (0.6, 0.7)], cell_m=cell_m)
    with pytest.raises(ValueError, match=r"a cell is \(width, 0\) and \(shift, height\)"):
        tile_schedule(pattern)


def tilts_of(pattern, bond):
    """Return the tilt of each tile in ninths of a right angle, shape (9, 9), as its four tags show it."""
    row = np.floor(pattern.points_m[:, 1] / TILE_M).astype(int)
    moved_m = pattern.points_m[:, 0] - (row % 2 * TILE_M / 2.0 if bond == "running" else 0.0)
    column = np.floor(moved_m / TILE_M).astype(int)
    away_m = np.column_stack([moved_m, pattern.points_m[:, 1]]) - TILE_M * (np.column_stack([column, row]) + 0.5)
    tilts = np.full((9, 9), -1)
    for place in np.ndindex(9, 9):
        four_m = away_m[(row == place[0]) & (column == place[1])]
        assert np.hypot(*four_m.T) == pytest.approx(np.full(4, math.sqrt(0.125) * TILE_M))
        angle = np.sort(np.arctan2(four_m[:, 1], four_m[:, 0]))
        assert np.diff(angle) == pytest.approx(np.full(3, math.pi / 2.0))
        ninths = (angle[0] - math.pi / 4.0) % (math.pi / 2.0) * 18.0 / math.pi
        assert ninths == pytest.approx(round(ninths), abs=1e-9)
        tilts[place] = round(ninths) % 9
    return tilts


@pytest.mark.parametrize("bond", ["stack", "running"])
@pytest.mark.parametrize("rule", ["boxes", "diagonals"])
@pytest.mark.parametrize("seed", range(6))
def test_each_tilt_comes_once_a_row_column_and_box(seed, rule, bond):
    """Nine tilts 10 degrees apart, once in each row, column and box of tiles, and on both diagonals if asked."""
    tilts = tilts_of(sudoku(tile_m=TILE_M, seed=seed, rule=rule, bond=bond), bond)
    boxes = tilts.reshape(3, 3, 3, 3).swapaxes(1, 2).reshape(9, 9)
    groups = [*tilts, *tilts.T, *boxes]
    if rule == "diagonals":
        groups += [np.diagonal(tilts), np.diagonal(tilts[:, ::-1])]
    for group in groups:
        assert sorted(group.tolist()) == list(range(9))


def test_seeds_give_different_grids():
    """The same one each time."""
    grids = {sudoku_grid(seed, diagonals=True).tobytes() for seed in range(20)}
    assert len(grids) == 20
    assert sudoku_grid(3, diagonals=True).tobytes() in grids


def test_running_bond_moves_every_second_row_of_tiles():
    """By half a tile against the row below, over the seam of two periods too, where row nine meets row one."""
    stack, bond = (sudoku(tile_m=TILE_M, seed=5, bond=bond) for bond in ("stack", "running"))
    width_m = 9.0 * TILE_M
    for row in range(20):
        # The period above lies half a tile to the right, so that row 9, an even one, is moved against row 8.
        moved_m = TILE_M / 2.0 * (row % 9 % 2 + row // 9)
        low_m, high_m = row * TILE_M + 1e-6, (row + 1) * TILE_M - 1e-6
        laid_m = stack.points_in((0.0, low_m, 3.0 * width_m, high_m)) + np.array([moved_m, 0.0])
        found_m = bond.points_in((0.0, low_m, 3.0 * width_m, high_m))
        inner = [points_m[np.abs(points_m[:, 0] - 1.5 * width_m) < width_m] for points_m in (laid_m, found_m)]
        assert len(inner[0]) == len(inner[1]) > 60
        assert inner[1] == pytest.approx(inner[0], abs=1e-9)
    offsets_m = tile_schedule(bond).row_offset_m
    steps_m = np.diff([*offsets_m, offsets_m[0] + tile_schedule(bond).shift_m])
    assert np.abs(steps_m) == pytest.approx(np.full(9, TILE_M / 2.0))


@pytest.mark.parametrize("radius_m", [0.02, 0.1, 0.14])
@pytest.mark.parametrize("seed", range(5))
def test_random_discs_lie_in_their_tile_without_overlap(seed, radius_m):
    """Four in each of 81 tiles, no two closer than two radii anywhere, and tiles that differ."""
    pattern = random(tile_m=TILE_M, radius_m=radius_m, seed=seed)
    corner = np.floor(pattern.points_m / TILE_M)
    in_tile_m = pattern.points_m - corner * TILE_M
    assert in_tile_m.min() >= radius_m - 1e-12
    assert in_tile_m.max() <= TILE_M - radius_m + 1e-12
    _, count = np.unique(corner, axis=0, return_counts=True)
    assert count.tolist() == [4] * 81
    assert pattern.minimum_spacing_m() >= 2.0 * radius_m - 1e-12
    assert len(np.unique(np.round(in_tile_m, 9), axis=0)) == 324
    assert pattern == random(tile_m=TILE_M, radius_m=radius_m, seed=seed)
    assert pattern != random(tile_m=TILE_M, radius_m=radius_m, seed=seed + 1)


def test_random_places_are_even_over_the_tile():
    """Small discs: coordinates have the mean and the spread of uniform ones, within 4.5 standard errors."""
    radius_m = 0.005
    pattern = random(tile_m=TILE_M, radius_m=radius_m, seed=11)
    share = (pattern.points_m % TILE_M - radius_m) / (TILE_M - 2.0 * radius_m)
    assert np.abs(share.mean(axis=0) - 0.5).max() < 4.5 / math.sqrt(12.0 * 324)
    assert np.abs(((share - 0.5) ** 2).mean(axis=0) - 1.0 / 12.0).max() < 4.5 / math.sqrt(180.0 * 324)


@pytest.mark.parametrize("angle_deg", [0.0, 5.0, 17.2, 30.0, 45.0, 60.0, 77.0, 90.0])
def test_the_spacing_of_tilted_tiles(angle_deg):
    """Half a tile within one, or less across a seam: the nearer of the two, neither more nor less."""
    half_m, angle_rad = TILE_M / 4.0 * math.sqrt(2.0), math.radians(angle_deg)
    across_m = 2.0 * half_m * math.cos(math.pi / 4.0 - angle_rad)
    seam_m = math.hypot(TILE_M - across_m, 2.0 * half_m * math.sin(math.pi / 4.0 - angle_rad))
    spacing_m = tilted(tile_m=TILE_M, angle_rad=angle_rad).minimum_spacing_m()
    assert spacing_m == pytest.approx(min(TILE_M / 2.0, seam_m), rel=1e-12)


def test_closed_form_spacings():
    """Least distances between tags and densities of the families."""
    side_m = 0.35 * math.sqrt(2.0 / math.sqrt(3.0))
    assert line(spacing_m=side_m).density_per_m2 == pytest.approx(square(pitch_m=0.35).density_per_m2)
    assert line(spacing_m=side_m).minimum_spacing_m() == pytest.approx(side_m)
    assert PATTERNS["isosceles"].minimum_spacing_m() == pytest.approx(0.35)
    shear = parallelogram(tile_m=TILE_M, shift_m=0.35 / 4.0, form="sheared")
    zigzag = parallelogram(tile_m=TILE_M, shift_m=0.35 / 4.0)
    assert shear.minimum_spacing_m() == zigzag.minimum_spacing_m() == pytest.approx(0.35)
