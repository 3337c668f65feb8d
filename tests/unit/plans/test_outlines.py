"""From cells to polygons."""

import numpy as np
import pytest
import shapely
from scipy import ndimage
from shapely.geometry import MultiPolygon, Point

from layoutopt.errors import InvalidInput
from layoutopt.plans.outlines import outlines, placed, simplified


@pytest.mark.parametrize("seed", range(20))
def test_outlines_are_the_cells_exactly(seed):
    """Random cells: same area, same parts as by counting, valid, and every cell on its own side."""
    draws = np.random.default_rng(seed)
    free = draws.random((draws.integers(1, 25), draws.integers(1, 25))) < draws.uniform(0.2, 0.9)
    free[0, 0] = True
    parts = outlines(free, "plan")
    labels, count = ndimage.label(free)
    assert sorted(part.area for part in parts) == sorted(np.bincount(labels.ravel())[1:].tolist())
    assert len(parts) == count
    assert all(part.is_valid for part in parts)
    row, column = np.indices(free.shape)
    union = MultiPolygon(parts).buffer(0)
    assert (shapely.contains_xy(union, column + 0.5, row + 0.5) == free).all()


def test_noise_is_refused():
    """An image whose outlines have more corners than any plan is no plan."""
    free = np.random.default_rng(1).random((900, 900)) < 0.5
    with pytest.raises(InvalidInput, match="speckle"):
        outlines(free, "plan")


def test_stairs_of_a_slanted_wall_become_straight():
    """The outline of a disc of cells loses most corners and moves by no more than the tolerance."""
    row, column = np.indices((120, 120))
    exact = MultiPolygon(outlines((row - 60.0) ** 2 + (column - 60.0) ** 2 < 50.0**2, "plan"))
    simple, used = simplified(exact, None)
    assert used == 1.0
    assert len(shapely.get_coordinates(simple)) < len(shapely.get_coordinates(exact)) / 3
    assert exact.hausdorff_distance(simple) <= used
    assert simple.area == pytest.approx(exact.area, rel=0.01)


def test_walls_of_one_cell_keep_rooms_apart():
    """Two rooms with a slanted wall one cell thick between them stay two."""
    row, column = np.indices((80, 80))
    exact = MultiPolygon(outlines(np.abs(row - column // 3 - 20) > 0, "plan"))
    assert len(exact.geoms) == 2
    simple, _ = simplified(exact, None)
    assert len(simple.geoms) == 2
    assert simple.is_valid


def test_table_legs_stay_as_they_are():
    """A hole of one cell keeps its area, although its corners are within the tolerance of each other."""
    free = np.ones((20, 20), dtype=bool)
    free[5, 7] = free[10:12, 10] = False
    simple, used = simplified(MultiPolygon(outlines(free, "plan")), None)
    assert used == 1.0
    assert simple.area == 397.0
    assert not simple.contains(Point(7.5, 5.5))


def test_tolerance_of_zero_changes_nothing():
    """Who asks for no simplification gets the cells."""
    exact = MultiPolygon(outlines(np.eye(9, dtype=bool) | np.eye(9, k=1, dtype=bool), "plan"))
    simple, used = simplified(exact, 0.0)
    assert used == 0.0
    assert simple.equals(exact)


def test_placing_turns_about_the_corner_of_the_first_cell():
    """With a yaw of 90 degrees the columns of the image run up."""
    free = np.zeros((2, 5), dtype=bool)
    free[0, 1:4] = True
    region = placed(MultiPolygon(outlines(free, "plan")), 0.5, (10.0, 20.0, np.pi / 2))
    assert region.bounds == pytest.approx((9.5, 20.5, 10.0, 22.0))
