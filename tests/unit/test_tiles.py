"""Tile schedules: what is made, where it goes, and that together it is the pattern."""

import math

import numpy as np
import pytest

from layoutopt.geometry import lattice_points
from layoutopt.patterns.equilateral import equilateral
from layoutopt.patterns.line import line
from layoutopt.patterns.listed import listed
from layoutopt.patterns.parallelogram import parallelogram
from layoutopt.patterns.random import random
from layoutopt.patterns.square import square
from layoutopt.patterns.sudoku import sudoku
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


@pytest.mark.parametrize("name", PATTERNS)
def test_tiles_make_the_pattern(name):
    """Each laid tag is one of the pattern's, and a period of tiles has as many as its area demands."""
    pattern = PATTERNS[name]
    schedule = tile_schedule(pattern)
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
    schedule = tile_schedule(PATTERNS[name])
    assert len(schedule.tiles_m) == kinds
    if kinds == 9:
        assert schedule.counts().tolist() == [9] * 9


def test_sizes_and_bond():
    """Three tags in a row on the line tile, and rows of tiles moved by half a spacing or half a tile."""
    schedule = tile_schedule(PATTERNS["line"])
    assert schedule.size_m == pytest.approx((3.0 * 0.376, math.sqrt(0.75) * 0.376))
    assert len(schedule.tiles_m[0]) == 3
    assert schedule.row_offset_m == pytest.approx([0.0, 0.188])
    assert tile_schedule(PATTERNS["bond"]).row_offset_m[:2] == pytest.approx([0.0, 0.35])


def test_mirror_images():
    """A tilt's mirror image is the tilt to the other side: of Sudoku tiles K and 11 - K, and 1 is its own."""
    schedule = tile_schedule(PATTERNS["sudoku"])
    mirror = np.array(schedule.mirror_of)
    assert (mirror[mirror] == np.arange(9)).all()
    assert (mirror == np.arange(9)).sum() == 1
    assert tile_schedule(PATTERNS["square"]).mirror_of == (0,)
    assert tile_schedule(PATTERNS["tilted"]).mirror_of == (-1,)


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
    ],
)
def test_impossible_patterns_name_the_rule(call, message):
    """Never a silent clamp."""
    with pytest.raises(ValueError, match=message):
        call()


def test_closed_form_spacings():
    """Least distances between tags and densities of the families."""
    side_m = 0.35 * math.sqrt(2.0 / math.sqrt(3.0))
    assert line(spacing_m=side_m).density_per_m2 == pytest.approx(square(pitch_m=0.35).density_per_m2)
    assert line(spacing_m=side_m).minimum_spacing_m() == pytest.approx(side_m)
    assert PATTERNS["isosceles"].minimum_spacing_m() == pytest.approx(0.35)
    shear = parallelogram(tile_m=TILE_M, shift_m=0.35 / 4.0, form="sheared")
    zigzag = parallelogram(tile_m=TILE_M, shift_m=0.35 / 4.0)
    assert shear.minimum_spacing_m() == zigzag.minimum_spacing_m() == pytest.approx(0.35)
    # Across the seam the nearest tags of tilted tiles come closer than within a tile.
    angle = 0.3
    half = TILE_M / 4.0 * math.sqrt(2.0)
    seam_m = math.hypot(
        TILE_M - 2.0 * half * math.cos(math.pi / 4.0 - angle), 2.0 * half * math.sin(math.pi / 4.0 - angle)
    )
    nearest = min(TILE_M / 2.0, seam_m)
    assert PATTERNS["tilted"].minimum_spacing_m() <= nearest + 1e-12
