"""The difference of layouts: known answers, and the properties of a pseudometric on random layouts."""

import math
from itertools import permutations, product

import numpy as np
import pytest

from layoutopt import registry
from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.layout import FloorTags, Layout, ReaderGroup, ZonePattern
from layoutopt.readers.profiles import PROFILES
from solvers.layout_difference import (
    ANTENNA_CUTOFF_M,
    WEIGHTS,
    antenna_places_m,
    difference_matrix,
    layout_difference,
)


def readers(places_m, side_m=0.06, per_module=1):
    poses = np.array([(x, y, 0.02, 0.0) for x, y in places_m]).reshape(-1, 4)
    return ReaderGroup(
        name="listed",
        poses=poses,
        antenna=SphereAntenna(side_m=side_m),
        profile=PROFILES["mi2016"],
        slots=tuple(number % per_module for number in range(len(poses))),
        antennas_per_module=per_module,
    )


def on(zone, family, turn_rad=0.0, **parameters):
    return ZonePattern(zone=zone, pattern=registry.load("patterns", family)(**parameters), angle_rad=turn_rad)


def layout(places_m=((0.1, 0.0), (-0.1, 0.0)), *zones, **mount):
    return Layout(
        floor_tags=FloorTags(zones=zones or (on("", "square", pitch_m=0.1),)),
        readers=(readers(places_m, **mount),),
    )


def random_layout(generator):
    count = int(generator.integers(1, 6))
    zones = []
    for zone in ("", "dock", "bay"):
        if zone == "" or generator.random() < 0.5:
            family, turn_rad = str(generator.choice(["square", "triangular"])), generator.uniform(0.0, 3.0)
            zones.append(on(zone, family, turn_rad, pitch_m=float(generator.uniform(0.05, 0.4))))
    if generator.random() < 0.4:
        shift_m, form = float(generator.uniform(0.0, 0.05)), str(generator.choice(["zigzag", "sheared"]))
        zones[0] = on("", "parallelogram", tile_m=0.2, shift_m=shift_m, form=form)
    if len(zones) > 1 and generator.random() < 0.2:
        zones = zones[1:]
    side, modules = float(generator.choice([0.03, 0.05, 0.08])), int(generator.integers(1, 4))
    return layout(generator.uniform(-0.3, 0.3, (count, 2)), *zones, side_m=side, per_module=modules)


def test_identical_layouts_do_not_differ_and_the_weights_make_one():
    """Zero in every part; of weights that sum to one a total is a mean."""
    assert layout_difference(layout(), layout()).total == 0.0
    assert sum(WEIGHTS.values()) == pytest.approx(1.0)


def test_the_difference_is_a_pseudometric():
    """Symmetric, from 0 to 1, and no way is shorter by a third layout, in each part and in total."""
    generator = np.random.Generator(np.random.Philox(11))
    layouts = [random_layout(generator) for _ in range(16)]
    for part in ("total", *WEIGHTS):
        between = np.array([[getattr(layout_difference(a, b), part) for b in layouts] for a in layouts])
        assert (between == between.T).all()
        assert (np.diag(between) == 0.0).all()
        assert between.min() >= 0.0
        assert between.max() <= 1.0 + 1e-12
        assert (between[:, None, :] <= between[:, :, None] + between[None, :, :] + 1e-12).all(), part
        assert between.max() > 0.0


def test_the_matrix_holds_the_totals():
    """Made from parts of readers and of tags, it is the same as pair by pair."""
    generator = np.random.Generator(np.random.Philox(5))
    some = [random_layout(generator) for _ in range(3)]
    layouts = [Layout(floor_tags=a.floor_tags, readers=b.readers) for a, b in product(some, some)]
    expected = [[layout_difference(a, b).total for b in layouts] for a in layouts]
    np.testing.assert_allclose(difference_matrix(layouts), expected, atol=1e-12)
    assert difference_matrix([]).shape == (0, 0)


def test_antennas_are_paired_so_that_the_ways_are_shortest():
    """Against all pairings of a few antennas, with the antennas that stay alone."""
    generator = np.random.Generator(np.random.Philox(7))
    for few, many in ((1, 1), (2, 4), (3, 3), (4, 5)):
        one, other = (layout(generator.uniform(-0.2, 0.2, (count, 2))) for count in (few, many))
        ways = np.linalg.norm(
            antenna_places_m(one)[:, None, :] - antenna_places_m(other)[None, :, :], axis=2
        )  # fmt: skip
        cut = np.minimum(ways / ANTENNA_CUTOFF_M, 1.0)
        least = min(sum(cut[i, j] for i, j in enumerate(order)) for order in permutations(range(many), few))
        assert layout_difference(one, other).antennas == pytest.approx((least + many - few) / many)


@pytest.mark.parametrize(
    ("changed", "part", "expected"),
    [
        (layout(((0.1, 0.05), (-0.1, 0.0))), "antennas", 0.05 / 0.2 / 2),
        (layout(((0.1, 0.0), (-0.1, 0.0), (9.0, 9.0))), "antennas", 1 / 3),
        (layout(side_m=0.12), "antenna_side", 1.0),
        (layout(side_m=0.06 * math.sqrt(2)), "antenna_side", 0.5),
        (layout(per_module=2), "modules", 0.5),
        (layout(((0.1, 0.0), (-0.1, 0.0)), on("", "square", pitch_m=0.2)), "density", 1.0),
        (layout(((0.1, 0.0), (-0.1, 0.0)), on("", "square", pitch_m=0.1 * math.sqrt(2))), "density", 0.5),
        (layout(((0.1, 0.0), (-0.1, 0.0)), on("", "triangular", pitch_m=0.1)), "arrangement", 1.0),
        (layout(((0.1, 0.0), (-0.1, 0.0)), on("", "square", math.pi / 4, pitch_m=0.1)), "arrangement", 1.0),
        (
            layout(((0.1, 0.0), (-0.1, 0.0)), on("", "square", math.pi / 12, pitch_m=0.1)),
            "arrangement",
            math.sin(math.pi / 6),
        ),
    ],
)
def test_each_part_counts_what_it_says(changed, part, expected):
    """A change of one thing changes one part, by a known amount, and no other."""
    found = layout_difference(layout(), changed)
    for name in WEIGHTS:
        if name == part:
            assert getattr(found, name) == pytest.approx(expected)
        elif (name, part) not in {("modules", "antennas")}:
            assert getattr(found, name) == pytest.approx(0.0, abs=1e-12), name


def test_a_turn_that_the_pattern_does_not_show_is_none():
    """A square lattice turned by 90 degrees is the same; a pattern with two tags a cell is not."""
    places = ((0.1, 0.0), (-0.1, 0.0))
    turned = layout(places, on("", "square", math.pi / 2, pitch_m=0.1))
    assert layout_difference(layout(), turned).arrangement == pytest.approx(0.0, abs=1e-12)
    tile = {"tile_m": 0.2, "angle_rad": 0.3}
    first, second = (layout(places, on("", "tilted", angle, **tile)) for angle in (0.0, math.pi / 2))
    assert layout_difference(first, second).arrangement == pytest.approx(math.sqrt(0.5))


def test_a_zone_counts_half_and_a_zone_without_a_pattern_has_that_of_the_floor():
    """Spelling out the floor's own pattern on a zone is no difference; another family there is half of one."""
    places, floor = ((0.1, 0.0), (-0.1, 0.0)), on("", "square", pitch_m=0.1)
    spelt = layout(places, floor, on("dock", "square", pitch_m=0.1))
    assert layout_difference(layout(), spelt).total == 0.0
    other = layout(places, floor, on("dock", "triangular", pitch_m=0.1))
    assert layout_difference(layout(), other).arrangement == 0.5
    bare = layout(places, on("dock", "square", pitch_m=0.1))
    assert layout_difference(spelt, bare).density == 1.0


def test_listed_patterns_are_told_apart_by_their_points():
    """They share a name and nothing else."""
    places = ((0.1, 0.0), (-0.1, 0.0))
    first, second = (
        layout(places, on("", "listed", points_m=[[0.0, 0.0], [x, 0.3]])) for x in (0.1, 0.2)
    )  # fmt: skip
    assert layout_difference(first, second).arrangement == 1.0
    assert layout_difference(first, first).total == 0.0
