"""Errors by cell of the floor: means and standard errors over drives, and which of them can be relied on."""

import numpy as np
import pytest
from shapely.geometry import box

import layoutopt as lo
from layoutopt.error_map import cell_side_m, error_map
from layoutopt.simulation.local_error import simulated_error_map
from layoutopt.site import Site

SITE = Site(name="hall", floor=box(1.0, -2.0, 4.3, 0.0))


def random_drives(count, seed):
    draws = np.random.Generator(np.random.Philox(seed))
    low, high = (1.0, -2.0), (4.3, 0.0)
    drives = []
    for _ in range(count):
        errors_m = draws.exponential(0.01, 40)
        errors_m[::7] = np.nan
        drives.append((draws.uniform(low, high, (40, 2)), errors_m))
    return drives


def test_means_and_standard_errors_are_those_of_the_means_of_the_drives_by_brute_force():
    """Every cell by nested loops: a drive is one value, however long it stays; unknown errors do not count."""
    drives = random_drives(6, seed=3)
    found = error_map(SITE, drives, cell_m=0.5)
    assert found.drives.shape == found.mean_m.shape == (7, 4)
    for column in range(7):
        for row in range(4):
            own = []
            for places_m, errors_m in drives:
                inside = [
                    error_m
                    for (x_m, y_m), error_m in zip(places_m, errors_m, strict=True)
                    if int((x_m - 1.0) / 0.5) == column and int((y_m + 2.0) / 0.5) == row and error_m == error_m
                ]
                own += [np.mean(inside)] if inside else []
            assert found.drives[column, row] == len(own)
            mean_m = np.mean(own) if own else np.nan
            error_m = np.std(own, ddof=1) / np.sqrt(len(own)) if len(own) > 1 else np.nan
            assert found.mean_m[column, row] == pytest.approx(mean_m, nan_ok=True)
            assert found.standard_error_m[column, row] == pytest.approx(error_m, nan_ok=True)


def test_the_upper_edges_belong_to_the_last_cells_and_nothing_lies_beyond():
    corner = (np.array([(4.3, 0.0)]), np.array([0.01]))
    assert error_map(SITE, [corner], cell_m=0.5).drives[6, 3] == 1
    with pytest.raises(ValueError, match=r"leaves the bounds of site 'hall' at \(4\.4, -1\) m"):
        error_map(SITE, [(np.array([(2.0, -1.0), (4.4, -1.0)]), np.zeros(2))])
    with pytest.raises(ValueError, match="1 places and 2 errors"):
        error_map(SITE, [(np.array([(2.0, -1.0)]), np.zeros(2))])
    with pytest.raises(ValueError, match="positive side"):
        error_map(SITE, [corner], cell_m=0.0)


@pytest.mark.parametrize(
    ("errors_mm", "certain"),
    [
        ([10.0, 10.0, 10.0, 10.0], False),  # four drives are too few, however well they agree
        ([10.0, 10.0, 10.0, 10.0, 10.0], True),
        ([6.0, 8.0, 10.0, 12.0, 14.0], True),  # 10 ± 3.9
        ([2.0, 6.0, 10.0, 14.0, 18.0], False),  # 10 ± 7.9
    ],
)
def test_a_mean_is_certain_with_five_drives_and_an_interval_within_half_of_it(errors_mm, certain):
    place_m = np.array([(2.0, -1.0)])
    found = error_map(SITE, [(place_m, np.array([error / 1000.0])) for error in errors_mm], cell_m=10.0)
    assert found.certain.tolist() == [[certain]]


def test_sides_are_round_and_give_at_most_forty_cells():
    sides_m = [
        cell_side_m(Site(name="s", floor=box(0, 0, length, 1.0))) for length in (1.0, 6.0, 15.0, 40.0, 90.0)
    ]
    assert sides_m == [0.1, 0.2, 0.5, 1.0, 5.0]


def test_one_cell_over_the_whole_site_holds_what_the_trials_hold():
    """With a cell as large as the site, mean and standard error are those of the trials of the same numbers."""
    spec = lo.read_spec(lo.built_in("small_hall"))
    scenario, estimator, streams = (
        spec.problem().held_out[0],
        lo.load("estimators", "midrange")(),
        lo.Streams(seed=4),
    )
    layout = next(iter(spec.space.layouts()))
    found = simulated_error_map(layout, scenario, estimator, streams, 6, cell_m=100.0)
    errors_m = lo.run_trials(layout, scenario, estimator, streams, 0, 6).column("position_error_mean")
    assert found.drives.tolist() == [[6]]
    assert found.mean_m[0, 0] == pytest.approx(errors_m.mean(), rel=1e-12)
    assert found.standard_error_m[0, 0] == pytest.approx(errors_m.std(ddof=1) / np.sqrt(6.0), rel=1e-9)
