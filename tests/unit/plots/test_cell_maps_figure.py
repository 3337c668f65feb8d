"""Maps of cells lie where the cells do, and each has the scale of what it shows."""

import numpy as np
import pytest

from layoutopt.plots.cell_maps import CellMap, draw_cell_maps

BOUNDS_M = (0.0, 0.0, 1.0, 1.0)


def cell_map(values, title="(a)"):
    return CellMap(title=title, label="dBm", values=np.array(values), origin_m=(-0.5, 0.0), cell_m=0.5)


def test_cells_lie_where_they_are():
    """Three columns from x = -0.5, two rows from y = 0; the first index goes along x."""
    figure = draw_cell_maps([cell_map([[9.0, 1.0], [2.0, 3.0], [4.0, np.nan]])], bounds_m=BOUNDS_M)
    image = figure.axes[0].images[0]
    assert image.get_extent() == [-0.5, 1.0, 0.0, 1.0]
    assert image.origin == "lower"
    assert image.get_array()[1, 0] == 1.0
    assert figure.axes[0].get_xlim() == (0.0, 1.0)


def test_the_scale_is_that_of_what_is_shown():
    """The cell with 9 lies off the bounds, and NaN is nothing."""
    figure = draw_cell_maps([cell_map([[9.0, 1.0], [2.0, 3.0], [4.0, np.nan]])], bounds_m=BOUNDS_M)
    norm = figure.axes[0].images[0].norm
    assert (norm.vmin, norm.vmax) == (2.0, 4.0)


def test_a_map_of_nothing_is_refused_by_name():
    """Rather than drawn blank."""
    with pytest.raises(ValueError, match=r"map '\(b\)': nothing is known within the bounds"):
        draw_cell_maps([cell_map([[1.0, 1.0], [np.nan] * 2, [np.nan] * 2], title="(b)")], bounds_m=BOUNDS_M)
    with pytest.raises(ValueError, match="at least one map"):
        draw_cell_maps([], bounds_m=BOUNDS_M)
