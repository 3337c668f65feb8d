"""Antennas in columns, and the bucket grid over tags."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hypothesis_numpy

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.detection import antennas_of, bucket_grid
from layoutopt.layout import FloorTags, Layout, ReaderGroup, ReaderProfile, ZonePattern
from layoutopt.patterns.square import square

PLACE = st.floats(-3.0, 3.0, width=32)


def layout(*groups):
    """Return a layout with these reader groups."""
    floor_tags = FloorTags(zones=(ZonePattern(zone="", pattern=square(pitch_m=0.1)),))
    return Layout(floor_tags=floor_tags, readers=groups)


def group(places_m, *, slots, ports, side_m=0.06, scan_s=0.05, tags="several"):
    """Return a group of antennas 20 mm above the floor."""
    return ReaderGroup(
        name="row",
        poses=[(x_m, y_m, 0.02, 0.0) for x_m, y_m in places_m],
        antenna=SphereAntenna(side_m=side_m),
        profile=ReaderProfile(name="test", scan_period_s=scan_s, tags_per_scan=tags),
        slots=slots,
        antennas_per_module=ports,
    )


@given(
    points_m=hypothesis_numpy.arrays(np.float64, st.tuples(st.integers(0, 40), st.just(2)), elements=PLACE),
    built_m=st.floats(0.0, 2.0),
    place_m=st.tuples(PLACE, PLACE),
    radius_m=st.floats(0.0, 4.0),
)
def test_near_equals_brute_force(points_m, built_m, place_m, radius_m):
    """The grid finds exactly the points closer than the radius, for any radius it was or was not built for."""
    expected = np.flatnonzero(((points_m - np.array(place_m)) ** 2).sum(axis=1) < radius_m**2)
    assert bucket_grid(points_m, built_m).near(place_m, radius_m).tolist() == expected.tolist()


def test_near_is_open_at_the_radius():
    """A tag at the distance of the radius is not read (mi2016, Eq. 5 is strict)."""
    grid = bucket_grid(np.array([(0.0, 0.0), (0.5, 0.0)]), 0.5)
    assert grid.near((0.0, 0.0), 0.5).tolist() == [0]
    assert grid.near((0.0, 0.0), np.nextafter(0.5, 1.0)).tolist() == [0, 1]


def test_near_far_from_all_points():
    """Far outside the grid there is nothing."""
    grid = bucket_grid(np.array([(0.0, 0.0), (1.0, 1.0)]), 0.1)
    assert grid.near((50.0, -20.0), 0.5).tolist() == []


def test_the_grid_of_a_row_stays_small():
    """A row of a thousand tags has no more cells than a few a tag."""
    row = np.stack([np.arange(1000) * 0.1, np.zeros(1000)], axis=1)
    grid = bucket_grid(row, 0.001)
    assert grid.columns * grid.rows <= 4 * 4096
    assert grid.near((50.0, 0.0), 0.15).tolist() == [499, 500, 501]


def test_antennas_are_counted_through_the_groups():
    """Groups follow one another; height and radius are those of each antenna."""
    wide = group([(0.1, 0.0), (-0.1, 0.0)], slots=(0, 0), ports=1)
    small = group([(0.0, 0.1)], slots=(0,), ports=1, side_m=0.03, tags="one")
    antennas = antennas_of(layout(wide, small), step_s=0.05)
    assert len(antennas) == 3
    assert antennas.xy_m.tolist() == [[0.1, 0.0], [-0.1, 0.0], [0.0, 0.1]]
    assert antennas.radius_m == pytest.approx([0.02973214, 0.02973214, 0.009], abs=1e-7)
    assert antennas.one_tag.tolist() == [False, False, True]


def test_an_antenna_hung_too_high_reads_less():
    """The height error is added to every antenna; out of reach the radius is zero."""
    one = layout(group([(0.0, 0.0)], slots=(0,), ports=1))
    assert antennas_of(one, 0.05, height_error_m=0.02).height_m == pytest.approx([0.04])
    assert antennas_of(one, 0.05, height_error_m=0.04).radius_m.tolist() == [0.0]


@pytest.mark.parametrize(
    ("scan_s", "step_s", "period", "phases"),
    [
        (0.05, 0.05, 3, [0, 1, 2]),
        (0.05, 0.025, 6, [0, 2, 4]),
        (0.06, 0.05, 6, [0, 2, 4]),
        (0.01, 0.05, 3, [0, 1, 2]),
    ],
)
def test_a_module_scans_in_turn(scan_s, step_s, period, phases):
    """A scan takes whole steps, rounded up, and each antenna listens once a cycle, one after the other."""
    row = group([(0.0, 0.0), (0.1, 0.0), (0.2, 0.0)], slots=(0, 1, 2), ports=3, scan_s=scan_s)
    antennas = antennas_of(layout(row), step_s)
    assert antennas.period_steps.tolist() == [period] * 3
    assert antennas.phase_steps.tolist() == phases
