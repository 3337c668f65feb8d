"""Blind runs as long as a gap, over discs that just touch, at the lengths that people write down."""

import math

import numpy as np
import pytest

from layoutopt.patterns.equilateral import equilateral
from layoutopt.patterns.parallelogram import parallelogram
from layoutopt.patterns.square import square
from layoutopt.patterns.sudoku import sudoku
from layoutopt.patterns.tilted import tilted
from layoutopt.patterns.triangular import triangular
from objectives.gap_pieces import gap_pieces, gap_pieces_plain
from objectives.invisibility import (
    blind_probability,
    blind_probability_over_directions,
    gap_exceedance,
    mean_gap,
)
from objectives.periodic_discs import one_antenna

FAMILIES = {
    "square": lambda pitch_m: square(pitch_m=pitch_m),
    "isosceles": lambda pitch_m: triangular(pitch_m=pitch_m),
    "equilateral": lambda pitch_m: equilateral(side_m=pitch_m),
    "parallelogram": lambda pitch_m: parallelogram(tile_m=2.0 * pitch_m, shift_m=pitch_m / 4.0),
    "sheared": lambda pitch_m: parallelogram(tile_m=2.0 * pitch_m, shift_m=pitch_m / 8.0, form="sheared"),
    "untilted": lambda pitch_m: tilted(tile_m=2.0 * pitch_m, angle_rad=0.0),
    "tilted": lambda pitch_m: tilted(tile_m=2.0 * pitch_m, angle_rad=0.22),
}
PITCHES_M = [
    millimetres / 1000.0 for millimetres in (10, 20, 30, 35, 40, 50, 70, 90, 100, 120, 150, 350, 700, 1000)
]
TWENTIETHS = range(1, 11)
"""Radii in twentieths of the pitch."""
ALONG_ROWS_RAD = np.concatenate(
    [
        np.radians([0, 30, 45, 60, 90, 120, 135, 150, 180, 270]),
        [math.atan2(1.0, 0.5), math.atan2(0.5, 1.0), math.atan2(0.25, 1.0), -math.atan2(1.0, 0.5)],
        np.linspace(0.013, 3.0, 6),
    ]
)


def without_overlap():
    """Yield pitches and radii in whole tenths of a millimetre of which discs touch at most."""
    for pitch_m in PITCHES_M:
        for twentieths in TWENTIETHS:
            yield pitch_m, round(twentieths * pitch_m / 20.0, 7)


@pytest.mark.parametrize("family", FAMILIES)
def test_runs_up_to_the_least_gap_meet_no_second_disc(family):
    """B_L = 1 - n (pi r² + 2 r L) in every direction, just at the least gap too, and where discs touch."""
    for pitch_m, radius_m in without_overlap():
        pattern = FAMILIES[family](pitch_m)
        least_m = pattern.minimum_spacing_m() - 2.0 * radius_m
        if least_m < -1e-9 * pitch_m:
            continue
        least_m = max(least_m, 0.0)
        for length_m in {0.0, 0.5 * least_m, round(least_m, 9), least_m}:
            wanted = 1.0 - pattern.density_per_m2 * (math.pi * radius_m**2 + 2.0 * radius_m * length_m)
            found = blind_probability(pattern, radius_m, length_m, ALONG_ROWS_RAD)
            np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-8, err_msg=f"{pitch_m} {radius_m}")


@pytest.mark.parametrize("family", FAMILIES)
def test_no_gap_is_shorter_than_the_least(family):
    """P(gap > L) is one up to the least gap, which it leaves like a root, and less beyond in some directions."""
    for pitch_m, radius_m in without_overlap():
        pattern = FAMILIES[family](pitch_m)
        least_m = pattern.minimum_spacing_m() - 2.0 * radius_m
        if least_m < 1e-3 * pitch_m:
            continue
        shorter = gap_exceedance(pattern, radius_m, 0.999 * least_m, ALONG_ROWS_RAD)
        np.testing.assert_allclose(shorter, 1.0, rtol=0.0, atol=1e-12)
        just = gap_exceedance(pattern, radius_m, least_m, ALONG_ROWS_RAD)
        np.testing.assert_allclose(just, 1.0, rtol=0.0, atol=1e-6)
        longer = gap_exceedance(pattern, radius_m, least_m + pitch_m, ALONG_ROWS_RAD)
        assert longer.min() < 1.0 - 1e-3


@pytest.mark.parametrize("part", [0.5, 1.0])
@pytest.mark.parametrize("twentieths", [4, 7, 10])
@pytest.mark.parametrize("family", ["square", "isosceles", "equilateral", "untilted"])
def test_kernel_and_plain_twin_agree_at_lengths_of_gaps(family, twentieths, part):
    """Along rows and diagonals, where the run is as long as the least gap or half of it, and discs touch."""
    pattern, radius_m = FAMILIES[family](0.35), round(twentieths * 0.35 / 20.0, 7)
    least_m = max(pattern.minimum_spacing_m() - 2.0 * radius_m, 0.0)
    angle = np.array([0.0, math.pi / 4.0, math.pi / 3.0, math.pi / 2.0, math.atan2(1.0, 0.5), 1.9])
    sight = one_antenna(pattern, radius_m)
    ours, truth = gap_pieces(sight, angle, 0.35), gap_pieces_plain(sight, angle, 0.35)
    np.testing.assert_allclose(ours.free_m2, truth.free_m2, atol=1e-10)
    np.testing.assert_allclose(ours.exposed_m, truth.exposed_m, atol=1e-7)
    for length_m in (part * least_m, part * 0.35):
        (area_m2, width_m), (plain_m2, plain_m) = ours.within(length_m), truth.within_plain(length_m)
        np.testing.assert_allclose(area_m2, plain_m2, atol=1e-9)
        # Widths leave the least gap like a root, and so keep half the digits.
        np.testing.assert_allclose(width_m, plain_m, atol=1e-6)


@pytest.mark.parametrize("family", FAMILIES)
def test_nothing_jumps_where_discs_touch(family):
    """Blind probability and mean gap at half the least spacing are those of discs a little smaller and larger."""
    for pitch_m in (0.035, 0.1, 0.35):
        pattern = FAMILIES[family](pitch_m)
        radius_m = pattern.minimum_spacing_m() / 2.0
        for length_m in (0.0, 0.3 * pitch_m, pitch_m, 2.0 * pitch_m):
            found, less, more = (
                blind_probability(pattern, radius_m * share, length_m, ALONG_ROWS_RAD)
                for share in (1.0, 1.0 - 1e-9, 1.0 + 1e-9)
            )
            np.testing.assert_allclose(found, less, rtol=0.0, atol=1e-7)
            np.testing.assert_allclose(found, more, rtol=0.0, atol=1e-7)
        for direction_rad in (0.123, 0.777, 1.9):
            gaps_m = [mean_gap(pattern, radius_m * share, direction_rad) for share in (1.0, 1.0 - 1e-9)]
            assert gaps_m[0] == pytest.approx(gaps_m[1], abs=1e-6 * pitch_m)


def test_short_runs_over_a_sudoku_floor():
    """The same closed form over 324 tags, up to the gap of the nearest two."""
    pattern, radius_m = sudoku(tile_m=0.7, seed=2, rule="diagonals"), 0.1
    least_m = pattern.minimum_spacing_m() - 2.0 * radius_m
    wanted = 1.0 - pattern.density_per_m2 * (math.pi * radius_m**2 + 2.0 * radius_m * least_m)
    assert blind_probability(pattern, radius_m, least_m, ALONG_ROWS_RAD) == pytest.approx(
        np.full(len(ALONG_ROWS_RAD), wanted), abs=1e-9
    )


@pytest.mark.parametrize(
    ("pattern", "radius_m"), [(tilted(tile_m=0.7, angle_rad=0.22), 0.16), (square(pitch_m=0.35), 0.3)]
)
def test_where_no_run_is_blind_there_is_no_anisotropy(pattern, radius_m):
    """Worst over mean of rounding errors would be any number."""
    found = blind_probability_over_directions(pattern, radius_m, 2.0)
    assert math.isnan(found.anisotropy)
    assert found.mean == pytest.approx(0.0, abs=1e-14)
    assert found.worst == pytest.approx(0.0, abs=1e-14)
    assert blind_probability_over_directions(pattern, 0.05, 2.0).anisotropy > 1.0
