"""The design space: every combination once, and the unit cube over it."""

import itertools

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
from layoutopt.space import DesignSpace, Family

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
    """The middles of the cells of the unit cube decode to all 42 layouts."""
    sizes = SPACE.axis_sizes
    cells = itertools.product(*(range(size) for size in sizes))
    decoded = {
        SPACE.decode([(number + 0.5) / size for number, size in zip(cell, sizes, strict=True)]).key
        for cell in cells
    }
    assert decoded == {layout.key for layout in SPACE.layouts()}


@given(st.tuples(*[st.floats(0.0, 1.0)] * 3))
def test_every_point_of_the_closed_cube_decodes(unit):
    """Both ends of every axis included."""
    assert SPACE.decode(unit).readers[0].count in (3, 4, 5, 7, 8)


@pytest.mark.parametrize("unit", [(), (0.5, 0.5), (0.5, 0.5, 1.1), (-0.1, 0.5, 0.5), (0.5, 0.5, float("nan"))])
def test_points_outside_the_cube_are_refused(unit):
    """Too few coordinates, or one outside [0, 1]."""
    with pytest.raises(ValueError, match="3 coordinates"):
        SPACE.decode(unit)
