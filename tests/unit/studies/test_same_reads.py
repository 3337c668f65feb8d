"""Poses with the same reads: known answers for one antenna, a plain comparison for several, and the bound."""

import math

import numpy as np
import pytest

from layoutopt.geometry import reduced_cell
from layoutopt.layout import TagPattern
from layoutopt.patterns.square import square
from layoutopt.patterns.triangular import triangular
from layoutopt.protocols import Antennas
from studies.same_reads import farthest_m, likeness

RADIUS_M = 0.019


def antennas(places_m, radius_m=RADIUS_M):
    count = len(places_m)
    return Antennas(
        xy_m=np.array(places_m, dtype=np.float64),
        height_m=np.full(count, 0.02),
        radius_m=np.full(count, radius_m),
        period_steps=np.ones(count, dtype=np.int64),
        phase_steps=np.zeros(count, dtype=np.int64),
        one_tag=np.zeros(count, dtype=np.bool_),
    )


def test_an_antenna_in_the_middle_leaves_the_disc_of_its_tag():
    """It reads on pi r² of a cell (five standard errors), and poses with its reads are 2 r apart at most."""
    count, share = 20_000, math.pi * RADIUS_M**2 / 0.01
    found = likeness(square(pitch_m=0.1), antennas([(0.0, 0.0)]), count, 1)
    assert found.share(1, 1) == pytest.approx(share, abs=5.0 * math.sqrt(share * (1.0 - share) / count))
    assert found.share(2, 9) == 0.0
    assert 0.98 * 2.0 * RADIUS_M < found.largest_m(1, 1) < 2.0 * RADIUS_M == farthest_m(antennas([(0.0, 0.0)]))
    assert math.isnan(found.mean_m(2, 9))


def test_an_antenna_ahead_leaves_a_ring_about_its_tag():
    group = antennas([(0.1, 0.0)])
    assert farthest_m(group) == pytest.approx(2.0 * (0.1 + RADIUS_M))
    found = likeness(square(pitch_m=0.1), group, 20_000, 1)
    assert 0.98 * farthest_m(group) < found.largest_m(1, 1) < farthest_m(group)
    assert found.mean_rad(1, 1) > math.pi


@pytest.mark.parametrize("pattern", [square(pitch_m=0.05), triangular(pitch_m=0.05)], ids=["square", "triangular"])
def test_sets_of_reads_are_those_of_a_plain_comparison(pattern):
    """Distances are at most 0.5 % below those of all pairs, and never above."""
    places_m = [(0.07, 0.0), (0.0, 0.07), (-0.06, 0.01)]
    group, poses, seed = antennas(places_m), 150, 5
    found = likeness(pattern, group, poses, seed)
    draws = np.random.Generator(np.random.Philox([seed, 1]))
    cell_m = reduced_cell(pattern.cell_m)
    xy_m, heading_rad = draws.random((poses, 2)) @ cell_m, 2.0 * math.pi * draws.random(poses)
    sets = []
    for place_m, angle in zip(xy_m, heading_rad, strict=True):
        reads = []
        turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
        for number, offset_m in enumerate(np.array(places_m) @ turn):
            near = pattern.points_in(tuple(np.concatenate([place_m - 0.2, place_m + 0.2])))
            gap_m = np.linalg.norm(near - place_m - offset_m, axis=1)
            reads += [(number, *tag) for tag in near[gap_m < RADIUS_M]]
        sets.append(reads)
    assert [len({read[0] for read in reads}) for reads in sets] == found.antennas_reading.tolist()
    # Two poses are alike if one is moved by whole periods so that all their tags agree.
    apart_m = np.zeros(poses)
    for one in range(poses):
        for other in range(poses):
            a, b = np.array(sets[one]), np.array(sets[other])
            if not len(a) or a.shape != b.shape or (np.sort(a[:, 0]) != np.sort(b[:, 0])).any():
                continue
            shift_m = a[0, 1:] - b[0, 1:]
            steps = shift_m @ np.linalg.inv(cell_m)
            moved = b + np.array([0.0, *shift_m])
            same = sorted(map(tuple, np.round(moved, 7))) == sorted(map(tuple, np.round(a, 7)))
            if same and np.allclose(steps, np.round(steps), atol=1e-6):
                apart_m[one] = max(apart_m[one], float(np.linalg.norm(xy_m[one] - xy_m[other] - shift_m)))
    # A pose knows the largest distance within its set, not only from itself.
    assert (found.apart_m >= 0.995 * apart_m - 1e-9).all()
    assert found.apart_m.max() <= apart_m.max() + 1e-9
    assert (found.apart_m > 0.0).sum() == (apart_m > 0.0).sum() > 10


def test_a_pattern_that_does_not_repeat_has_no_cell_to_stand_for_the_floor():
    pattern = TagPattern(name="listed", points_m=np.array([[0.0, 0.0]]))
    with pytest.raises(ValueError, match="does not repeat"):
        likeness(pattern, antennas([(0.0, 0.0)]), 10, 0)
