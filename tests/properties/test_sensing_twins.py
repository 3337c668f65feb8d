"""The compiled search for tags finds exactly what the plain one finds."""

import numpy as np
import pytest

from layoutopt.detection import bucket_grid
from layoutopt.protocols import Antennas
from layoutopt.simulation.sensing import antenna_centres, compiled_detections, plain_detections


def antennas_at_random(draws, count):
    return Antennas(
        xy_m=draws.uniform(-0.3, 0.3, (count, 2)),
        height_m=np.full(count, 0.02),
        radius_m=np.where(draws.random(count) < 0.1, 0.0, draws.uniform(0.005, 0.2, count)),
        period_steps=np.ones(count, dtype=np.int64),
        phase_steps=np.zeros(count, dtype=np.int64),
        one_tag=np.zeros(count, dtype=bool),
    )


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("tags", [0, 1, 2, 40, 2000])
def test_twins_find_the_same(seed, tags):
    """Random tags, antennas and poses, a third of them off the floor: the same detections in the same order."""
    draws = np.random.default_rng([seed, tags])
    xy_m = draws.uniform([-1.0, 2.0], [1.0, 2.5], (tags, 2))
    if seed % 3 == 0:
        xy_m = np.round(xy_m, 1)  # many on one spot and on the borders of cells
    poses = np.column_stack([draws.uniform(-2, 2, 60), draws.uniform(1.5, 3, 60), draws.uniform(-9, 9, 60)])
    antennas = antennas_at_random(draws, int(draws.integers(1, 9)))
    centre_m = antenna_centres(poses, antennas)
    # A grid made for another radius, too fine or too coarse, changes nothing but the time.
    grid = bucket_grid(xy_m, float(draws.choice([0.001, 0.1, 1.0])))
    active = draws.random((60, len(antennas))) < 0.7
    plain = plain_detections(centre_m, active, antennas.radius_m, grid)
    compiled = compiled_detections(centre_m, active, antennas.radius_m, grid)
    for left, right in zip(plain, compiled, strict=True):
        np.testing.assert_array_equal(left, right)
    distance_m = np.linalg.norm(xy_m[compiled[2]] - centre_m[compiled[0], compiled[1]], axis=1)
    assert (distance_m < antennas.radius_m[compiled[1]] + 1e-12).all()
    assert tags < 2000 or len(plain[0]) > 0


@pytest.mark.parametrize("place", [np.nan, np.inf, -np.inf, 1e300, -1e18])
def test_a_place_that_is_nowhere_reads_nothing(place):
    """Not a number, infinity and places beyond the range of integers stay within the grid's arrays."""
    draws = np.random.default_rng(1)
    antennas = antennas_at_random(draws, 3)
    grid = bucket_grid(draws.uniform(0.0, 1.0, (50, 2)), 0.1)
    centre_m = np.full((4, 3, 2), 0.5)
    centre_m[:, :, 0] = place
    step, _, _ = compiled_detections(centre_m, np.ones((4, 3), dtype=bool), antennas.radius_m, grid)
    assert len(step) == 0


def test_the_kernel_is_compiled_once():
    """Every way to call the kernel shares one signature, so nothing is compiled twice."""
    from layoutopt.simulation.sensing_kernels import detections

    draws = np.random.default_rng(2)
    antennas = antennas_at_random(draws, 3)
    for array in (antennas.xy_m, antennas.radius_m):
        array.setflags(write=False)
    for xy_m in (np.empty((0, 2)), draws.uniform(0.0, 1.0, (50, 2))):
        xy_m.setflags(write=False)
        centre_m = antenna_centres(np.zeros((2, 3)), antennas)
        active = np.ones((2, 3), dtype=bool)
        compiled_detections(centre_m, active, antennas.radius_m, bucket_grid(xy_m, 0.1))
    assert len(detections.signatures) == 1
