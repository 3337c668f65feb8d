"""The field of loops against integrals, closed forms of other shapes, and the laws of magnetostatics."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import minimize_scalar
from scipy.special import ellipe, ellipk

from layoutopt.antennas.loop_field import field_on_axis, polygon_loop_field, square_loop_field

SIDE_M = 0.06
PLACES_M = np.random.Generator(np.random.Philox(11)).uniform(-0.1, 0.1, (60, 3))


def integrated(place_m, side_m):
    """Return the field by numerical integration of the law of Biot and Savart along the four sides."""
    corners = side_m / 2.0 * np.array([(1, 1, 0), (-1, 1, 0), (-1, -1, 0), (1, -1, 0)])
    total = np.zeros(3)
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        way = end - start

        def piece(share, axis, start=start, way=way):
            arm = place_m - (start + share * way)
            return np.cross(way, arm)[axis] / (4.0 * np.pi * np.linalg.norm(arm) ** 3)

        total += [quad(piece, 0.0, 1.0, args=(axis,), epsabs=1e-10, epsrel=1e-10)[0] for axis in range(3)]
    return total


@pytest.mark.parametrize("place_m", PLACES_M[:12].tolist())
def test_the_four_sides_are_the_integral_along_them(place_m):
    """Every component agrees with numerical integration."""
    place_m = np.array(place_m)
    assert square_loop_field(place_m, SIDE_M) == pytest.approx(integrated(place_m, SIDE_M), rel=1e-8, abs=1e-8)


def test_many_sides_are_a_circle():
    """A loop of 2000 sides has the field of a circular one, which complete elliptic integrals give."""
    radius_m = 0.04
    angle_rad = np.linspace(0.0, 2.0 * np.pi, 2000, endpoint=False)
    corners_m = radius_m * np.stack([np.cos(angle_rad), np.sin(angle_rad)], axis=1)
    for place_m in PLACES_M[:20]:
        away_m, z_m = np.hypot(*place_m[:2]), place_m[2]
        far2 = (radius_m + away_m) ** 2 + z_m**2
        near2 = (radius_m - away_m) ** 2 + z_m**2
        square = 4.0 * radius_m * away_m / far2
        ratio = (radius_m**2 - away_m**2 - z_m**2) / near2
        along = (ellipk(square) + ratio * ellipe(square)) / (2.0 * np.pi * np.sqrt(far2))
        assert polygon_loop_field(place_m, corners_m)[2] == pytest.approx(along, rel=1e-4, abs=1e-4)


def test_far_away_the_loop_is_a_dipole():
    """Beyond 50 sides the field is that of the moment a² to a thousandth, and it falls with the third power."""
    direction = PLACES_M / np.linalg.norm(PLACES_M, axis=1)[:, None]
    for sides in (50.0, 500.0):
        place_m = sides * SIDE_M * direction
        moment = np.array([0.0, 0.0, SIDE_M**2])
        dipole = (3.0 * (direction @ moment)[:, None] * direction - moment) / (4.0 * np.pi * (sides * SIDE_M) ** 3)
        size = np.linalg.norm(dipole, axis=1)
        off = np.linalg.norm(square_loop_field(place_m, SIDE_M) - dipole, axis=1)
        assert (off / size).max() < 2.0 / sides**2


def test_the_field_has_the_symmetry_of_a_square():
    """A quarter of a turn turns the field; below the loop it is what it is above, but outward is inward."""
    field = square_loop_field(PLACES_M, SIDE_M)
    quarter = np.array([(0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)])
    assert square_loop_field(PLACES_M @ quarter.T, SIDE_M) == pytest.approx(
        field @ quarter.T, rel=1e-11, abs=1e-12
    )
    below = square_loop_field(PLACES_M * (1, 1, -1), SIDE_M)
    assert below == pytest.approx(field * (-1, -1, 1), rel=1e-11, abs=1e-12)
    across = square_loop_field(PLACES_M[:, [1, 0, 2]], SIDE_M)
    assert across == pytest.approx(field[:, [1, 0, 2]], rel=1e-11, abs=1e-12)


def test_the_way_round_a_wire_is_its_current():
    """The field along a circle about one side adds up to 1 A, along one beside the wire to nothing (Ampère)."""
    angle_rad = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False)
    circle = np.stack([np.cos(angle_rad), np.zeros(720), np.sin(angle_rad)], axis=1)
    along = np.stack([-np.sin(angle_rad), np.zeros(720), np.cos(angle_rad)], axis=1)
    for centre_m, current in (((0.03, 0.004, 0.0), -1.0), ((0.06, 0.004, 0.0), 0.0)):
        field = square_loop_field(np.array(centre_m) + 0.01 * circle, SIDE_M)
        total = (field * along).sum(axis=1).mean() * 2.0 * np.pi * 0.01
        assert total == pytest.approx(current, abs=1e-9)


@given(st.floats(0.005, 0.5), st.floats(0.0, 1.0))
def test_the_closed_form_on_the_axis_is_the_field_of_the_sides(side_m, depth_m):
    """Above and below alike, and nothing sideways."""
    for z_m in (depth_m, -depth_m):
        field = square_loop_field(np.array([0.0, 0.0, z_m]), side_m)
        assert field[2] == pytest.approx(field_on_axis(side_m, depth_m), rel=1e-9)
        assert abs(field[:2]).max() <= 1e-9 * field[2]


def test_the_best_side_for_a_given_reach_is_two_and_a_half_times_it():
    """With the ampere-turns fixed a side of 2.54 z has the strongest field at the depth z: larger is worse."""
    best = minimize_scalar(lambda side_m: -field_on_axis(side_m, 1.0), bounds=(0.5, 10.0), method="bounded")
    assert best.x == pytest.approx(2.54, abs=0.005)
