"""What every antenna model promises; and the two antennas that mi2016 measured."""

import math
import pickle

import numpy as np
import pytest

from layoutopt import registry
from layoutopt.antennas.disc import DiscAntenna
from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.protocols import Surroundings

EXAMPLES = {
    "sphere": [{"side_m": 0.03}, {"side_m": 0.045}, {"side_m": 0.06}, {"side_m": 0.12}],
    "biot_savart": [
        {"side_m": 0.03},
        {"side_m": 0.06, "disc": "equal_area"},
        {"side_m": 0.045, "tag_tilt_rad": 0.1, "metal_depth_m": 0.05, "covering_loss_share": 0.1},
        {"side_m": 0.12},
        {"side_m": 0.12, "ampere_turns_a": 0.15, "least_field_a_m": 0.12},
    ],
    "measured": [
        {"side_m": 0.06, "table_m": [(0.06, 0.005, 0.024), (0.06, 0.03, 0.03), (0.06, 0.05, 0.0)]},
        {"side_m": 0.1, "table_m": [(0.06, 0.01, 0.03), (0.06, 0.02, 0.03), (0.1, 0.01, 0.1), (0.1, 0.06, 0.1)]},
    ],
    "uhf_patch": [{"side_m": 0.26}, {"side_m": 0.2, "beam_rad": 1.5}, {"front_to_back_db": 15.0}],
    "crossed_loops": [{"side_m": 0.3}, {"side_m": 0.2}],
    "disc": [{"side_m": 0.15, "radius_m": 0.1}, {"side_m": 0.1, "radius_m": 0.125, "reach_m": 0.05}],
}
"""Arguments for each row of the table, calibrated sides and others; a new row needs its own."""

EVERY_EXAMPLE = [(name, number) for name, rows in EXAMPLES.items() for number in range(len(rows))]
OF_THE_FLOOR = [entry for entry in EVERY_EXAMPLE if registry.card("antennas", entry[0]).reads == "tag_read"]
OF_OTHERS = [entry for entry in EVERY_EXAMPLE if entry not in OF_THE_FLOOR]
AIR = Surroundings()


def build(name, number):
    """Return the antenna of an example."""
    return registry.load("antennas", name)(**EXAMPLES[name][number])


def test_every_model_has_an_example():
    """A new row without an example would go untested."""
    assert set(EXAMPLES) == set(registry.names("antennas"))


@pytest.mark.parametrize(("name", "number"), EVERY_EXAMPLE)
def test_probabilities_are_probabilities(name, number):
    """Between 0 and 1 wherever the tag is, in the shape of what was asked."""
    antenna = build(name, number)
    offsets_m = np.random.Generator(np.random.Philox(3)).uniform(-0.2, 0.2, (40, 50, 3))
    chance = antenna.read_probability(offsets_m, AIR)
    assert chance.shape == (40, 50)
    assert chance.dtype == np.float64
    assert ((chance >= 0.0) & (chance <= 1.0)).all()
    assert antenna.read_probability(offsets_m[0, 0], AIR).shape == ()


@pytest.mark.parametrize(("name", "number"), OF_OTHERS)
def test_antennas_of_other_kinds_read_no_floor(name, number):
    """Whatever the height and wherever the tag, UHF antennas and crossed loops leave floor tags alone."""
    antenna = build(name, number)
    offsets_m = np.random.Generator(np.random.Philox(4)).uniform(-3.0, 3.0, (200, 3))
    assert (antenna.read_probability(offsets_m, AIR) == 0.0).all()
    for height_m in (0.0, 0.02, 1.0):
        assert antenna.read_radius_m(height_m) == antenna.disc_error_m(height_m) == 0.0
        assert not antenna.reads_beside_disc(height_m)


def test_there_are_models_of_every_kind():
    """The split of the examples leaves no side empty."""
    assert {registry.card("antennas", name).reads for name in EXAMPLES} == {"tag_read", "signal", "direction"}


@pytest.mark.parametrize(("name", "number"), OF_THE_FLOOR)
def test_the_read_disc_is_where_tags_are_read(name, number):
    """Inside a tag is more likely read than not, outside it is not, but for the error that the model states."""
    antenna = build(name, number)
    heights_m = np.linspace(0.001, 0.1, 34)
    radius_m = np.array([antenna.read_radius_m(float(height_m)) for height_m in heights_m])
    error_m = np.array([antenna.disc_error_m(float(height_m)) for height_m in heights_m]) + 1e-6
    assert (radius_m >= 0.0).all()
    for angle in (0.0, 0.7, 3.0):

        def chance(away_m, angle=angle):
            place_m = np.stack([away_m * math.cos(angle), away_m * math.sin(angle), -heights_m], axis=1)
            return antenna.read_probability(place_m, AIR)

        assert (chance(radius_m + error_m) < 0.5).all()
        within = radius_m > error_m
        assert within.sum() > 3
        assert (chance(radius_m - error_m)[within] > 0.5).all()


@pytest.mark.parametrize(("name", "number"), EVERY_EXAMPLE)
def test_nothing_is_read_far_away(name, number):
    """Three sides away, sideways or below, the chance is zero."""
    antenna = build(name, number)
    far_m = 3.0 * antenna.side_m * np.array([(1, 0, 0), (0, 1, 0), (0, 0, -1), (0, 0, 1), (1, 1, -1)])
    assert (antenna.read_probability(far_m, AIR) == 0.0).all()
    assert antenna.read_radius_m(3.0 * antenna.side_m) == 0.0


@pytest.mark.parametrize(("name", "number"), EVERY_EXAMPLE)
def test_extrapolation_is_marked(name, number):
    """A side outside the card's range is marked, and only that, unless the drive is the user's own."""
    antenna = build(name, number)
    low_m, high_m = registry.card("antennas", name).valid_side_m
    stated = "ampere_turns_a" in EXAMPLES[name][number]
    assert antenna.extrapolated is (not stated and not low_m <= antenna.side_m <= high_m)


@pytest.mark.parametrize("name", EXAMPLES)
def test_both_sides_of_the_calibrated_range_are_tried(name):
    """The examples hold a calibrated side and one that is not, unless every side is as good."""
    if registry.card("antennas", name).valid_side_m == (0.0, math.inf):
        assert not any(build(name, number).extrapolated for number in range(len(EXAMPLES[name])))
        return
    assert {build(name, number).extrapolated for number in range(len(EXAMPLES[name]))} == {False, True}


@pytest.mark.parametrize(("name", "number"), EVERY_EXAMPLE)
def test_antennas_are_values(name, number):
    """Equal arguments, equal antennas: in sets, in keys and after the way to a worker."""
    antenna = build(name, number)
    assert pickle.loads(pickle.dumps(antenna)) == antenna == build(name, number)
    assert len({antenna, build(name, number)}) == 1
    assert len({build(name, other).key for other in range(len(EXAMPLES[name]))}) == len(EXAMPLES[name])


@pytest.mark.parametrize("side_m", [0.0, -0.03, float("nan"), float("inf")])
@pytest.mark.parametrize("name", EXAMPLES)
def test_a_side_is_a_positive_length(name, side_m):
    """What is no length makes no antenna."""
    with pytest.raises(ValueError, match=r"positive|finite"):
        registry.load("antennas", name)(**{**EXAMPLES[name][0], "side_m": side_m})


@pytest.mark.parametrize(
    ("side_m", "radius_m", "depth_m", "height_m", "disc_m"),
    [(0.030, 0.015, 0.008, 0.020, 0.009), (0.060, 0.030, 0.024, 0.024, 0.030)],
    ids=["96 readers", "8 readers"],
)
def test_the_two_antennas_of_mi2016(side_m, radius_m, depth_m, height_m, disc_m):
    """R 15 and h_c 8 mm for the 30 mm antenna, R 30 and h_c 24 mm for the 60 mm one: discs of 9.0 and 30 mm."""
    antenna = SphereAntenna(side_m=side_m)
    assert antenna.radius_m == pytest.approx(radius_m)
    assert antenna.centre_depth_m == pytest.approx(depth_m, abs=1e-12)
    assert antenna.read_radius_m(height_m) == pytest.approx(disc_m, abs=1e-9)


def test_the_robot_of_mi2016():
    """On the real robot the 60 mm antennas hung at 15 mm: a disc of 28.6 mm."""
    assert SphereAntenna(side_m=0.060).read_radius_m(0.015) == pytest.approx(0.0286, abs=5e-5)


def test_the_sphere_is_open():
    """Eq. 5 of mi2016 is strict: a tag exactly on the sphere is not read, one bit inside it is."""
    antenna = SphereAntenna(side_m=0.0625)  # R = 1/32 m, exact in binary
    on_it = np.array([antenna.radius_m, 0.0, -antenna.centre_depth_m])
    inside = np.array([np.nextafter(antenna.radius_m, 0.0), 0.0, -antenna.centre_depth_m])
    assert antenna.read_probability(on_it, AIR) == 0.0
    assert antenna.read_probability(inside, AIR) == 1.0


@pytest.mark.parametrize("surroundings", [Surroundings(metal_depth_m=0.1), Surroundings(tag_tilt_rad=0.1)])
@pytest.mark.parametrize("name", ["sphere", "measured", "disc"])
def test_models_refuse_what_they_do_not_know(name, surroundings):
    """Metal and tilt are not passed over in silence."""
    with pytest.raises(ValueError, match="neither metal nor tilted"):
        build(name, 0).read_probability(np.zeros(3), surroundings)


@pytest.mark.parametrize(
    "wrong",
    [{"radius_m": 0.0}, {"radius_m": float("nan")}, {"reach_m": -0.01}, {"radius_m": 0.45}, {"reach_m": 0.5}],
)
def test_a_measured_disc_is_possible(wrong):
    """Lengths are positive and no more than a loop's field carries."""
    with pytest.raises(ValueError, match=r"positive|three sides"):
        DiscAntenna(**{"side_m": 0.15, "radius_m": 0.1, **wrong})


def test_a_measured_disc_is_the_same_at_every_height():
    """Up to its reach, which is one side where it was not measured."""
    antenna = DiscAntenna(side_m=0.15, radius_m=0.1)
    assert [antenna.read_radius_m(height_m) for height_m in (0.0, 0.015, 0.15, 0.16)] == [0.1, 0.1, 0.1, 0.0]
