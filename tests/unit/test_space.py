"""The design space: every combination once, and the unit cube over it."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.patterns.square import square
from layoutopt.patterns.triangular import triangular
from layoutopt.protocols import Mount
from layoutopt.readers.cross import cross
from layoutopt.readers.profiles import COMMERCIAL
from layoutopt.readers.ring import ring
from layoutopt.space import DesignSpace, Family, Interval

MOUNT = Mount(antenna=SphereAntenna(side_m=0.04), height_m=0.02, profile=COMMERCIAL)
SPACE = DesignSpace(
    readers=(
        Family(name="cross", build=cross, values={"count": (4, 8), "spacing_m": (0.1, 0.2), "mount": (MOUNT,)}),
        Family(name="ring", build=ring, values={"count": (3, 5, 7), "radius_m": (0.2,), "mount": (MOUNT,)}),
    ),
    patterns={
        "": (
            Family(name="square", build=square, values={"pitch_m": (0.1, 0.2)}),
            Family(name="triangular", build=triangular, values={"pitch_m": (0.15,)}),
        ),
        "dock": (Family(name="square", build=square, values={"pitch_m": (0.05, 0.06)}),),
    },
    tag_part="disc",
    tag_size_m=(0.03, 0.03),
)


def test_the_size_is_the_product_of_the_axes():
    """Seven reader groups, three patterns for the floor and two for the dock make 42 layouts."""
    assert SPACE.axis_sizes == (7, 3, 2)
    assert SPACE.size == 42


def test_every_layout_comes_once():
    """As many layouts as the size says, all different, in the same order every time."""
    keys = [layout.key for layout in SPACE.layouts()]
    assert len(set(keys)) == len(keys) == SPACE.size
    assert keys == [layout.key for layout in SPACE.layouts()]


def test_the_part_of_the_space_is_on_every_floor():
    """Every layout carries the tag that the space names."""
    assert all(layout.floor_tags.tag_part == "disc" for layout in SPACE.layouts())
    assert all(layout.floor_tags.tag_size_m == (0.03, 0.03) for layout in SPACE.layouts())


@pytest.mark.parametrize("family", [*SPACE.readers, *SPACE.patterns[""]], ids=lambda family: family.name)
def test_an_option_is_the_one_of_its_number(family):
    """Option n is the n-th of all options: the last parameter varies fastest in both."""
    assert [option.key for option in family.options()] == [family.option(n).key for n in range(family.size)]


def test_the_unit_cube_reaches_every_layout_and_no_other():
    """Points on a fine grid of the cube decode to all 42 layouts and to nothing else."""
    assert [(axis.part, axis.zone, axis.name) for axis in SPACE.axes] == [
        ("readers", "", "family"),
        ("readers", "", "count"),
        ("readers", "", "spacing_m"),
        ("patterns", "", "family"),
        ("patterns", "", "pitch_m"),
        ("patterns", "dock", "pitch_m"),
    ]
    grids = [np.linspace(0.0, 1.0, 7 if axis.name == "count" else 3) for axis in SPACE.axes]
    decoded = {SPACE.decode(unit).key for unit in itertools.product(*grids)}
    assert decoded == {layout.key for layout in SPACE.layouts()}


@given(st.tuples(*[st.floats(0.0, 1.0)] * 6))
def test_every_point_of_the_closed_cube_decodes(unit):
    """Both ends of every axis included."""
    assert SPACE.decode(unit).readers[0].count in (3, 4, 5, 7, 8)


@pytest.mark.parametrize(
    "unit", [(), (0.5,) * 5, (0.5,) * 5 + (1.1,), (-0.1,) + (0.5,) * 5, (0.5,) * 5 + (float("nan"),)]
)
def test_points_outside_the_cube_are_refused(unit):
    """Too few coordinates, or one outside [0, 1]."""
    with pytest.raises(ValueError, match="6 coordinates"):
        SPACE.decode(unit)


def test_a_family_shares_the_coordinate_of_a_parameter_over_its_own_values():
    """The same share of the pitch is 0.2 m of the square pattern, and the only pitch of the triangular one."""
    first, second = (SPACE.decode((0.0, 0.0, 0.0, family, 0.9, 0.0)) for family in (0.0, 0.9))
    assert first.floor_tags.zones[0].pattern.parameters["pitch_m"] == 0.2
    assert second.floor_tags.zones[0].pattern.parameters["pitch_m"] == 0.15


def mounted(*, side_m, height_m):
    """Return a mount of a side and a height."""
    return Mount(antenna=SphereAntenna(side_m=side_m), height_m=height_m, profile=COMMERCIAL)


FREE = DesignSpace(
    readers=(
        Family(
            name="ring",
            build=ring,
            values={
                "count": (3, 5),
                "radius_m": Interval(low=0.1, high=0.2),
                "mount": Family(
                    name="mount",
                    build=mounted,
                    values={"side_m": (0.04, 0.06), "height_m": Interval(low=0.01, high=0.03, levels=3)},
                ),
            },
        ),
    ),
    patterns={"": (Family(name="square", build=square, values={"pitch_m": Interval(low=0.1, high=0.3)}),)},
)


def test_enumeration_takes_the_levels_of_each_interval():
    """Five radii, three heights, five pitches, two counts and two sides, all different, each at its number."""
    assert FREE.axis_sizes == (60, 5)
    layouts = list(FREE.layouts())
    assert len({layout.key for layout in layouts}) == len(layouts) == FREE.size == 300
    pitches = {layout.floor_tags.zones[0].pattern.parameters["pitch_m"] for layout in layouts}
    assert pitches == {0.1, 0.15, 0.2, 0.25, 0.3}
    assert {layout.readers[0].poses[0, 2] for layout in layouts} == {0.01, 0.02, 0.03}
    family = FREE.readers[0]
    assert [option.key for option in family.options()] == [family.option(n).key for n in range(family.size)]


def test_every_free_parameter_has_a_coordinate_and_says_whether_it_is_continuous():
    """Those of the mount among them; what has one value has none."""
    assert [(axis.name, axis.continuous) for axis in FREE.axes] == [
        ("count", False),
        ("radius_m", True),
        ("mount.side_m", False),
        ("mount.height_m", True),
        ("pitch_m", True),
    ]


@given(st.tuples(*[st.floats(0.0, 1.0)] * 5))
def test_a_point_decodes_to_its_share_of_each_interval(unit):
    """To the grid of a tenth of a millimetre, and never beyond the ends."""
    layout = FREE.decode(unit)
    group, pattern = layout.readers[0], layout.floor_tags.zones[0].pattern
    got_m = (group.parameters["radius_m"], group.poses[0, 2], pattern.parameters["pitch_m"])
    for value_m, share, (low_m, high_m) in zip(
        got_m, (unit[1], unit[3], unit[4]), ((0.1, 0.2), (0.01, 0.03), (0.1, 0.3)), strict=True
    ):
        assert low_m <= value_m <= high_m
        assert value_m == pytest.approx(low_m + share * (high_m - low_m), abs=0.51e-4)
    assert group.antenna.side_m == (0.04 if unit[2] < 0.5 else 0.06)


@pytest.mark.parametrize(
    "ends", [{"low": 1.0, "high": 1.0}, {"low": 2.0, "high": 1.0}, {"low": 0.0, "high": float("inf")}]
)
def test_an_interval_rises_between_finite_ends(ends):
    """Anything else is no interval."""
    with pytest.raises(ValueError, match="finite ends that rise"):
        Interval(**ends)


def test_ends_that_lie_off_the_grid_are_never_passed():
    """A value is the nearest of the grid of a tenth of a millimetre, or the end of the interval before it."""
    narrow = Interval(low=0.10004, high=0.10023)
    assert (narrow.at(0.0), narrow.at(0.5), narrow.at(1.0)) == (0.10004, 0.1001, 0.1002)
    assert Interval(low=0.10006, high=0.10014).values() == (0.1001,) * 5
    assert Interval(low=0.10001, high=0.10004).at(1.0) == 0.10001


def test_an_interval_has_a_level():
    """Its only one is the middle."""
    assert Interval(low=0.0, high=1.0, levels=1).values() == (0.5,)
    with pytest.raises(ValueError, match="at least one level"):
        Interval(low=0.0, high=1.0, levels=0)
