"""The design space of a spec: its product, ranges without steps, and the rule of ports."""

import numpy as np
from spec_texts import FULL, HALL

RANGES = """
[space]
antenna_side = ["40 mm", "60 mm"]
antenna_height = { from = "5 mm", to = "40 mm" }
antennas_per_module = [1, 4]
readers = [
    { family = "ring", count = { from = 3, to = 6 }, radius = { from = "80 mm", to = "120 mm" } },
    { family = "listed", points = [[0.1, { from = -0.1, to = "50 mm" }], [-0.1, 0]] },
]
patterns = [{ family = "square", pitch = { from = "100 mm", to = "300 mm" } }]
"""


def test_a_range_without_steps_is_continuous(read):
    """Lengths become intervals, whole numbers all in between; a point's range is a coordinate of its own."""
    space = read(HALL + RANGES).space
    assert [(axis.name, axis.continuous) for axis in space.axes] == [
        ("family", False),
        ("radius_m", True),
        ("mount.side_m", False),
        ("mount.height_m", True),
        ("count", False),
        ("mount.antennas_per_module", False),
        ("points_m.at_0_1", True),
        ("pitch_m", True),
    ]
    # Three antennas take no multiplexer of four, so theirs is a family without that choice.
    assert [dict(family.values)["count"] for family in space.readers[:2]] == [(3,), (4, 5, 6)]
    group = space.decode((0.9, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.25)).readers[0]
    np.testing.assert_allclose(group.poses[:, :3], [[0.1, 0.05, 0.04], [-0.1, 0.0, 0.04]], atol=1e-12)


def test_enumeration_of_a_range_without_steps_takes_five_levels(read):
    """Five pitches and heights, five radii; a free point stands in the middle of its range."""
    space = read(HALL + RANGES).space
    # Rings of 3 have one kind of module, of 4 to 6 two; times 5 radii, 2 sides, 5 heights. Two antennas have one.
    assert space.axis_sizes == ((1 + 3 * 2) * 5 * 10 + 10, 5)
    assert space.size == len({layout.key for layout in space.layouts()})
    assert space.readers[-1].option(0).poses[0, 1] == -0.025


def test_space_is_the_product_of_what_is_listed(read):
    """Values, lists and ranges with both ends are axes; a pattern of a zone is an axis of its own."""
    space = read(FULL).space
    assert list(space.patterns) == ["", "dock"]
    square, triangular = space.patterns[""]
    np.testing.assert_allclose(square.values["pitch_m"], np.linspace(0.06, 0.3, 9), rtol=0, atol=1e-12)
    assert triangular.values == {"pitch_m": (0.1,), "row_gap_m": (0.08, 0.1)}
    # Cross 4 takes two of the three multiplexers, cross 8 and mi2016_8 all: (2 + 3 + 3) by 2 sides by 2 heights.
    assert space.axis_sizes == (32, 11, 1)
    assert space.size == len({layout.key for layout in space.layouts()}) == 352
    assert space.tag_part == "disc"
    assert space.tag_size_m == (0.025, 0.025)
    assert space.origin_m == (0.05, 0.0)
    assert space.placement_sigma_m == 0.002


def test_no_module_has_more_ports_than_antennas(read):
    """Options with idle multiplexer ports are left out, the rest is complete, and a note counts both and helps."""
    spec = read(FULL)
    groups = [group for family in spec.space.readers for group in family.options()]
    assert all(group.antennas_per_module <= group.count for group in groups)
    assert {(group.count, group.antennas_per_module) for group in groups if group.name == "cross"} == {
        (4, 1), (4, 2), (8, 1), (8, 2), (8, 8),
    }  # fmt: skip
    assert spec.notes == (
        "left out 4 of 36 reader options with more antennas a module than in all; "
        "list antennas_per_module = 4 to let 4 antennas share a module",
    )
    told = read(FULL.replace("antennas_per_module = [1, 2, 8]", "antennas_per_module = [1, 2, 4, 8]"))
    assert [note.partition("; ")[2] for note in told.notes] == [""]
    assert (4, 4) in {
        (group.count, group.antennas_per_module) for family in told.space.readers for group in family.options()
    }


def test_combinations_that_are_no_product_survive_the_ports_rule(read):
    """A grid of 2 by 2 and one of 3 by 1 lose different multiplexers; no other combination is lost or added."""
    spec = read(
        HALL + '[space]\nantennas_per_module = [1, 4, 6]\nantenna_side = "40 mm"\n'
        'readers = [{ family = "grid", rows = [1, 2], columns = [2, 3, 4], spacing = "100 mm" }]'
    )
    built = [
        (group.parameters["rows"], group.parameters["columns"], group.antennas_per_module)
        for family in spec.space.readers
        for group in family.options()
    ]
    wanted = {
        (rows, columns, m) for rows in (1, 2) for columns in (2, 3, 4) for m in (1, 4, 6) if m <= rows * columns
    }
    assert len(built) == len(wanted)
    assert set(built) == wanted
