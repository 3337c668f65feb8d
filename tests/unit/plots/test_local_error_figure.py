"""The map of local errors colours what is certain, hatches what is not, and leaves the rest empty."""

import numpy as np
import pytest
from shapely.geometry import box

from layoutopt.error_map import ErrorMap
from layoutopt.plots.figures import new_axes
from layoutopt.plots.local_error import draw_local_error
from layoutopt.site import Site

SITE = Site(name="hall", floor=box(0.0, 0.0, 3.0, 2.0), obstacles=(box(0.2, 0.2, 0.4, 0.4),))


def errors(drives=((9, 9), (9, 2), (0, 9)), standard_error_mm=1.0):
    count = np.array(drives, dtype=np.int64)
    return ErrorMap(
        origin_m=(0.0, 0.0),
        cell_m=1.0,
        drives=count,
        mean_m=np.where(count > 0, 0.01, np.nan),
        standard_error_m=np.where(count > 1, standard_error_mm / 1000.0, np.nan),
        drive_count=10,
    )


def hatched(ax):
    return [patch for patch in ax.patches if set(patch.get_hatch() or "") == {"\\"}]


def test_cells_are_coloured_hatched_or_empty():
    left, right = draw_local_error(site=SITE, errors=errors(), title="mcl, seed 1").axes
    (shown,) = left.images
    assert np.isfinite(shown.get_array().filled(np.nan)).T.tolist() == [[True, True], [True, False], [False, True]]
    assert shown.get_array().max() == pytest.approx(10.0)
    assert shown.get_clim() == (0.0, pytest.approx(10.0))
    (cells,) = hatched(left)
    assert cells.get_path().get_extents().bounds == pytest.approx((1.0, 1.0, 1.0, 1.0))
    assert "fewer than 5 drives" in left.get_legend().get_texts()[0].get_text()
    assert left.get_title(loc="left").startswith(
        "mcl, seed 1: 10 drives, cells of 1 m; standard error: median 1 mm"
    )
    assert right.images[0].get_clim() == (0.0, 9.0)
    assert not hatched(right)


def test_a_map_without_a_certain_cell_has_no_scale_of_errors_and_says_so():
    left, _ = draw_local_error(site=SITE, errors=errors(standard_error_mm=9.0)).axes
    assert not left.images
    assert left.get_title(loc="left").endswith("no cell is certain")
    whole, _ = draw_local_error(site=SITE, errors=errors(((9, 9), (9, 9), (9, 9)))).axes
    assert whole.get_legend() is None
    assert not hatched(whole)


def test_a_map_without_drives_and_other_numbers_of_axes_are_refused():
    with pytest.raises(ValueError, match="needs two"):
        draw_local_error(site=SITE, errors=errors(), axes=(new_axes(80.0, 60.0),))
    with pytest.raises(ValueError, match="no drive came"):
        draw_local_error(site=SITE, errors=errors(((0, 0),)))
