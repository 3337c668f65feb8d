"""The square loop as an antenna: what was measured, what is known of loops, and what the disc leaves out."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from layoutopt.antennas.biot_savart import LEAST_FIELD_A_M, BiotSavartAntenna, drive_law_m
from layoutopt.antennas.loop_field import field_on_axis, square_loop_field
from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.protocols import Surroundings

AIR = Surroundings()


def below(*places_mm):
    """Return places in the antenna frame from x, y and depth in mm."""
    return np.array(places_mm, dtype=np.float64) * (1e-3, 1e-3, -1e-3)


def reach_of(side_m, drive_m):
    """Return where the field on the axis has fallen to one, by brute force."""
    depths_m = np.linspace(0.0, 0.2, 200_001)
    return float(depths_m[np.array([drive_m * field_on_axis(side_m, z_m) >= 1.0 for z_m in depths_m])].max())


@pytest.mark.parametrize(
    ("side_mm", "reach_mm"), [(30, 23.0), (60, 54.0), (20, 13.8), (25, 18.3), (40, 32.8), (50, 43.2), (80, 76.6)]
)
def test_reaches_of_the_drive_law(side_mm, reach_mm):
    """The two antennas of mi2016 exactly, and the values computed from the same law for other sides."""
    antenna = BiotSavartAntenna(side_m=side_mm / 1000.0)
    assert 1000.0 * antenna.reach_m == pytest.approx(reach_mm, abs=1e-9 if side_mm in (30, 60) else 0.05)
    if 25 <= side_mm <= 80:
        assert antenna.reach_m == pytest.approx(SphereAntenna(side_m=antenna.side_m).reach_m, abs=0.001)


def test_beyond_80_mm_power_is_constant():
    """The bare law would carry a 100 mm antenna to 100 mm; at constant power it reaches 81.8 mm."""
    assert reach_of(0.1, drive_law_m(0.1)) == pytest.approx(0.100, abs=0.0005)
    antenna = BiotSavartAntenna(side_m=0.1)
    assert antenna.drive_m == pytest.approx(drive_law_m(0.08) * math.sqrt(0.8))
    assert antenna.reach_m == pytest.approx(reach_of(0.1, antenna.drive_m), abs=2e-6)
    assert antenna.reach_m == pytest.approx(0.0818, abs=5e-5)
    at_the_end = [BiotSavartAntenna(side_m=side_m).drive_m for side_m in (0.08, np.nextafter(0.08, 1.0))]
    assert at_the_end[0] == pytest.approx(at_the_end[1], rel=1e-12)


@pytest.mark.parametrize(("side_m", "ampere_turns_ma"), [(0.03, 25.0), (0.06, 69.0)])
def test_the_drive_is_what_small_modules_give(side_m, ampere_turns_ma):
    """At the field that the standard asks tags to work in."""
    assert 1e3 * LEAST_FIELD_A_M * drive_law_m(side_m) == pytest.approx(ampere_turns_ma, abs=0.5)
    stated = BiotSavartAntenna(side_m=side_m, ampere_turns_a=LEAST_FIELD_A_M * drive_law_m(side_m))
    assert stated.read_radius_m(0.015) == pytest.approx(BiotSavartAntenna(side_m=side_m).read_radius_m(0.015))


@pytest.mark.parametrize(("side_m", "across_mm", "equal_mm"), [(0.03, 10.4, 10.5), (0.06, 34.7, 37.5)])
def test_discs_at_20_mm(side_m, across_mm, equal_mm):
    """10.4 and 34.7 mm across the middle of a side; the sphere's 9.0 and 29.7 mm lie within them."""
    inscribed = BiotSavartAntenna(side_m=side_m)
    equal = BiotSavartAntenna(side_m=side_m, disc="equal_area")
    assert 1e3 * inscribed.read_radius_m(0.02) == pytest.approx(across_mm, abs=0.05)
    assert 1e3 * equal.read_radius_m(0.02) == pytest.approx(equal_mm, abs=0.05)
    assert SphereAntenna(side_m=side_m).read_radius_m(0.02) < inscribed.read_radius_m(0.02)


@settings(max_examples=12)
@given(st.floats(0.025, 0.08), st.floats(0.02, 0.95))
def test_discs_against_counting(side_m, share):
    """The inscribed disc touches the outline, and the other has the area of the cells that are read."""
    antenna = BiotSavartAntenna(side_m=side_m)
    height_m = share * antenna.reach_m
    grid_m = np.linspace(-1.2 * side_m, 1.2 * side_m, 241)
    x_m, y_m = np.meshgrid(grid_m, grid_m)
    read = antenna.field_ratio(np.stack([x_m, y_m, np.full_like(x_m, -height_m)], axis=-1)) >= 1.0
    away_m = np.hypot(x_m, y_m)
    cell_m = grid_m[1] - grid_m[0]
    assert read[away_m < antenna.read_radius_m(height_m) - 1e-9].all()
    assert away_m[~read].min() == pytest.approx(antenna.read_radius_m(height_m), abs=1.5 * cell_m)
    assert away_m[read].max() <= antenna.read_radius_m(height_m) + antenna.disc_error_m(height_m) + 1e-9
    equal_m = BiotSavartAntenna(side_m=side_m, disc="equal_area").read_radius_m(height_m)
    # Cells on the border are in or out: of about 2 pi r / cell of them, half a cell each at worst.
    assert read.sum() * cell_m**2 == pytest.approx(np.pi * equal_m**2, abs=np.pi * equal_m * cell_m + cell_m**2)


@pytest.mark.parametrize(("side_m", "percent"), [(0.03, 4.0), (0.06, 36.0)])
def test_no_ring_beside_the_antenna_at_20_mm(side_m, percent):
    """The field that has turned over is 4 and 36 % of what tags need, so nothing is read there."""
    antenna = BiotSavartAntenna(side_m=side_m)
    away_m = np.linspace(0.0, 0.3, 3001)
    turned_over = -antenna.field_ratio(np.stack([away_m, 0.0 * away_m, np.full(3001, -0.02)], axis=1)).min()
    assert 100.0 * turned_over == pytest.approx(percent, abs=0.7)
    assert not antenna.reads_beside_disc(0.02)


@pytest.mark.parametrize("side_m", [0.03, 0.06])
def test_a_ring_beside_the_antenna_near_the_floor(side_m):
    """Below about a fifth of the side the ring is read, and from there up it is not."""
    antenna = BiotSavartAntenna(side_m=side_m)
    assert antenna.reads_beside_disc(0.15 * side_m)
    assert not antenna.reads_beside_disc(0.25 * side_m)


@pytest.mark.parametrize("side_m", [0.025, 0.044, 0.08])
def test_beyond_its_widest_height_the_disc_shrinks(side_m):
    """The dome closes: higher up never more is read, and nothing from the reach on."""
    antenna = BiotSavartAntenna(side_m=side_m)
    radii_m = np.array(
        [antenna.read_radius_m(height_m) for height_m in np.linspace(0.0, 1.1, 23) * antenna.reach_m]
    )
    widest = int(radii_m.argmax())
    assert (np.diff(radii_m[widest:]) <= 1e-12).all()
    assert (np.diff(radii_m[: widest + 1]) >= -1e-12).all()
    assert (radii_m[:20] > 0.0).all()
    assert (radii_m[21:] == 0.0).all()


@settings(max_examples=25)
@given(st.floats(0.025, 0.08), st.floats(0.0, 0.06), st.floats(-0.1, 0.1), st.floats(-0.1, 0.1))
def test_a_tag_on_metal_sees_no_field(side_m, depth_m, x_m, y_m):
    """Loop and image cancel on the plane, so no tag lying on it is read."""
    antenna = BiotSavartAntenna(side_m=side_m, metal_depth_m=0.0)
    assert antenna.field_ratio(np.array([x_m, y_m, -depth_m])) == 0.0
    assert antenna.read_radius_m(depth_m) == 0.0


@pytest.mark.parametrize("side_m", [0.03, 0.06])
def test_metal_takes_the_field_of_the_image(side_m):
    """On the axis the field is f(z) - f(2 z_m - z); twice the reach below the antenna it costs 5 to 7 %."""
    reach_m = BiotSavartAntenna(side_m=side_m).reach_m
    for plane_m in (1.1 * reach_m, 2.0 * reach_m):
        antenna = BiotSavartAntenna(side_m=side_m, metal_depth_m=plane_m - reach_m)
        ratio = float(antenna.field_ratio(np.array([0.0, 0.0, -reach_m])))
        lost = field_on_axis(side_m, 2.0 * plane_m - reach_m) / field_on_axis(side_m, reach_m)
        assert ratio == pytest.approx(1.0 - lost, rel=1e-9)
    assert 0.05 < lost < 0.07


def test_metal_nearer_the_tags_leaves_less():
    """The disc shrinks steadily as the plane comes up, and far metal changes nothing."""
    radii_m = [
        BiotSavartAntenna(side_m=0.06, metal_depth_m=depth_m).read_radius_m(0.02)
        for depth_m in (0.0, 0.005, 0.01, 0.02, 0.05, 0.1, 1.0)
    ]
    assert (np.diff(radii_m) >= 0.0).all()
    assert radii_m[0] == 0.0
    assert radii_m[-1] == pytest.approx(BiotSavartAntenna(side_m=0.06).read_radius_m(0.02), rel=1e-4)


@pytest.mark.parametrize("tilt_deg", [5.0, 30.0, 60.0])
def test_a_tilted_tag_on_the_axis_loses_a_cosine(tilt_deg):
    """And beside the axis the least of all directions of the tilt counts, found here by trying them."""
    tilt_rad = math.radians(tilt_deg)
    antenna = BiotSavartAntenna(side_m=0.06, tag_tilt_rad=tilt_rad)
    flat = BiotSavartAntenna(side_m=0.06)
    axis = below((0, 0, 20))
    assert antenna.field_ratio(axis) == pytest.approx(math.cos(tilt_rad) * flat.field_ratio(axis), rel=1e-12)
    direction = np.linspace(0.0, 2.0 * np.pi, 36001)
    normals = np.stack([np.cos(direction), np.sin(direction), np.zeros(36001)], axis=1) * math.sin(tilt_rad)
    normals[:, 2] = math.cos(tilt_rad)
    for place in below((10, 5, 20), (25, 0, 15), (30, 30, 20), (60, 0, 20)):
        least = np.abs(normals @ square_loop_field(place, 0.06)).min() * flat.drive_m
        assert abs(float(antenna.field_ratio(place))) == pytest.approx(least, abs=1e-3 * flat.drive_m)


def test_a_tag_on_edge_is_not_counted():
    """Its normal may point across the field, whatever the place."""
    on_edge = Surroundings(tag_tilt_rad=math.pi / 2.0)
    places = below((0, 0, 10), (30, 0, 5), (30, 0, 20), (20, 20, 10))
    assert BiotSavartAntenna(side_m=0.06).read_probability(places, on_edge).max() == 0.0


def test_a_covering_takes_its_share():
    """A share of the field that is lost is a weaker drive, no more and no less."""
    covered = BiotSavartAntenna(side_m=0.06, covering_loss_share=0.2)
    weaker = BiotSavartAntenna(side_m=0.06, ampere_turns_a=0.8 * LEAST_FIELD_A_M * drive_law_m(0.06))
    assert covered.read_radius_m(0.02) == pytest.approx(weaker.read_radius_m(0.02), rel=1e-9)
    assert covered.reach_m < BiotSavartAntenna(side_m=0.06).reach_m


def test_surroundings_take_the_place_of_the_antennas_own():
    """What the floor is like at a place is said there; without a word the antenna's own floor holds."""
    over_metal = BiotSavartAntenna(side_m=0.06, metal_depth_m=0.01)
    place = below((0, 0, 20))
    assert over_metal.field_ratio(place) == over_metal.field_ratio(place, AIR)
    deeper = over_metal.field_ratio(place, Surroundings(metal_depth_m=0.05))
    assert deeper == BiotSavartAntenna(side_m=0.06, metal_depth_m=0.05).field_ratio(place)


def test_the_edge_is_soft():
    """One half on the outline, a logistic curve of 2 mm along the floor, nothing above or far beyond."""
    antenna = BiotSavartAntenna(side_m=0.06)
    outline_m = antenna.outline_m(0.02)
    corner = np.array([math.cos(math.pi / 4.0), math.sin(math.pi / 4.0), 0.0])
    for off_m, chance in (
        (0.0, 0.5),
        (0.002, 1.0 / (1.0 + math.e)),
        (-0.002, math.e / (1.0 + math.e)),
        (0.0281, 0.0),
    ):
        across = np.array([outline_m[0] + off_m, 0.0, -0.02])
        diagonal = (outline_m[-1] + off_m) * corner - (0.0, 0.0, 0.02)
        assert antenna.read_probability(across, AIR) == pytest.approx(chance, abs=1e-9)
        assert antenna.read_probability(diagonal, AIR) == pytest.approx(chance, abs=1e-9)
    assert antenna.read_probability(np.array([0.0, 0.0, 0.01]), AIR) == 0.0
    assert antenna.read_probability(below((0, 0, 54.1)), AIR) == 0.0
    assert antenna.read_probability(below((0, 0, 5)), AIR) > 0.99


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"least_field_a_m": 0.1}, "state both or neither"),
        ({"ampere_turns_a": -1.0}, "positive"),
        ({"ampere_turns_a": 5.0}, "three sides|3 sides"),
        ({"ampere_turns_a": 0.05, "least_field_a_m": float("nan")}, "positive"),
        ({"tag_tilt_rad": 2.0}, "0 to 90 degrees"),
        ({"metal_depth_m": -0.01}, "zero or positive"),
        ({"covering_loss_share": 1.0}, "below 1"),
        ({"disc": "outer"}, "inscribed, equal_area"),
    ],
)
def test_impossible_antennas_are_refused(wrong, words):
    """With a sentence that says what would be right."""
    with pytest.raises(ValueError, match=words):
        BiotSavartAntenna(**{"side_m": 0.06, **wrong})
