"""Layouts one step away: each differs in one thing, and is what a builder would build."""

import itertools
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from layoutopt import feasibility, registry
from layoutopt.layout import EditKind, Layout, TagEdit
from layoutopt.spec.reading import read_spec
from studies.explain_variants import PLACES, places_for_one_more, variants_of, without_rows


@pytest.fixture(scope="module")
def spec(tiny_text, tmp_path_factory):
    """The tiny spec."""
    path = tmp_path_factory.mktemp("variants") / "tiny.toml"
    path.write_text(tiny_text, encoding="utf-8")
    return read_spec(path)


@pytest.fixture(scope="module")
def layout(spec):
    """A ring of four antennas of 40 mm on one module over a pitch of 200 mm."""
    labels = {layout.label: layout for layout in spec.space.layouts()}
    return labels["ring 4 × 40 mm (4 a module), square 200 mm"]


def _of_kind(found, kind):
    return [variant for variant in found if variant.kind == kind]


def test_every_antenna_is_left_out_once_and_the_others_stay(spec, layout):
    """Three of the four remain where they were, each on a port of the same module; they are numbered from 0."""
    less = _of_kind(variants_of(spec, layout), "antenna less")
    places = {tuple(row) for row in layout.readers[0].poses[:, :2].tolist()}
    gone = []
    for number, variant in enumerate(less):
        assert variant.change.startswith(f"without antenna {number} at ")
        assert tuple(layout.readers[0].poses[number, :2]) not in {
            tuple(row) for row in variant.layout.readers[0].poses[:, :2].tolist()
        }
        (group,) = variant.layout.readers
        left = {tuple(row) for row in group.poses[:, :2].tolist()}
        assert left < places
        assert group.count == 3
        assert group.antennas_per_module == 3
        assert sorted(group.slots) == [0, 1, 2]
        gone += places - left
    assert set(gone) == places
    assert len(gone) == 4


def test_steps_are_those_of_the_space_and_round_ones_beyond_it(spec, layout):
    """60 mm is the next size listed, 30 mm a step of 10 mm; heights and pitches likewise."""
    changes = {variant.change for variant in variants_of(spec, layout)}
    assert "antennas of 60 mm instead of 40 mm" in changes
    assert "antennas of 30 mm instead of 40 mm" in changes
    assert "antennas 15 mm above the floor instead of 20 mm" in changes
    assert "tags denser: square 100 mm instead of square 200 mm" in changes
    assert "tags sparser: square 300 mm instead of square 200 mm" in changes
    assert "antennas a module: 1 instead of 4" in changes


def test_at_the_end_of_the_space_the_next_pitch_is_a_tenth_away(spec, layout):
    """The widest pitch listed is 300 mm; an installer could also lay 330."""
    widest = next(item for item in spec.space.layouts() if "300 mm" in item.label)
    changes = {variant.change for variant in variants_of(spec, widest)}
    assert "tags sparser: square 330 mm instead of square 300 mm" in changes
    assert "tags denser: square 200 mm instead of square 300 mm" in changes


def test_each_variant_changes_one_thing(spec, layout):
    """Either tags or readers are those of the layout, and no two variants are one layout."""
    found = variants_of(spec, layout)
    for variant in found:
        same_tags = variant.layout.floor_tags.key == layout.floor_tags.key
        same_readers = variant.layout.readers == layout.readers
        assert same_tags != same_readers, variant.change
    assert len({variant.layout.key for variant in found}) == len(found)


def test_a_measured_disc_gets_no_other_size(spec, layout):
    """What was measured for one antenna says nothing of a larger one."""
    antenna = registry.load("antennas", "disc")(side_m=0.04, radius_m=0.02)
    measured = layout.replace(readers=(replace(layout.readers[0], antenna=antenna),))
    assert not _of_kind(variants_of(spec, measured), "antenna side")


def test_a_zone_of_its_own_is_varied_by_itself(spec, layout):
    """Patterns of floor and dock change one at a time."""
    tags = layout.floor_tags
    dock = replace(tags.zones[0], zone="dock", pattern=registry.load("patterns", "square")(pitch_m=0.1))
    both = Layout(floor_tags=replace(tags, zones=(*tags.zones, dock)), readers=layout.readers)
    found = [item for item in variants_of(spec, both) if item.kind in ("tag pattern", "tag row")]
    changed = Counter(item.change.endswith("in zone 'dock'") for item in found)
    assert changed[True] >= 3
    assert changed[False] >= 3
    for item in found:
        keys = [entry.pattern.key for entry in item.layout.floor_tags.zones]
        assert sum(a != b.pattern.key for a, b in zip(keys, both.floor_tags.zones, strict=True)) == 1


@pytest.mark.parametrize("every", [2, 4])
@pytest.mark.parametrize(
    ("family", "parameters"),
    [("square", {"pitch_m": 0.1}), ("triangular", {"pitch_m": 0.12}), ("equilateral", {"side_m": 0.13})],
)
def test_a_row_in_so_many_is_gone_and_the_rest_stays(family, parameters, every):
    """Rows counted on a floor: exactly every second or fourth one has vanished, no tag has moved."""
    pattern = registry.load("patterns", family)(**parameters)
    thinned = without_rows(pattern, every)
    # Borders between rows, so that rounding takes none in or out.
    bounds_m = (-1.003, -1.003, 1.003, 1.003)
    before, after = ({tuple(row) for row in np.round(item.points_in(bounds_m), 6)} for item in (pattern, thinned))
    assert after < before
    rows = sorted({y_m for _, y_m in before})
    kept = {y_m for _, y_m in after}
    gone = [number for number, y_m in enumerate(rows) if y_m not in kept]
    assert gone
    assert all(b - a == every for a, b in itertools.pairwise(gone))
    assert after == {(x_m, y_m) for x_m, y_m in before if y_m in kept}
    assert thinned.density_per_m2 == pytest.approx(pattern.density_per_m2 * (every - 1) / every)


def test_patterns_without_rows_are_left_alone():
    """Tags laid once have no period, tiles of a Sudoku no rows."""
    assert without_rows(registry.load("patterns", "listed")(points_m=((0.0, 0.0), (1.0, 0.0))), 2) is None
    assert without_rows(registry.load("patterns", "sudoku")(tile_m=0.7, seed=1), 2) is None


def test_one_antenna_more_goes_where_it_can_be_built(spec, layout):
    """Each place obeys every rule, and none is offered twice."""
    problem = spec.problem()
    found = places_for_one_more(layout, problem.design)
    assert 1 <= len(found) <= PLACES
    assert len({item.layout.key for item in found}) == len(found)
    for item in found:
        assert item.layout.readers[0].count == 5
        assert not feasibility.check(item.layout, problem.design)


def test_a_full_robot_takes_no_antenna_more(spec, layout):
    """Under a robot of 0.4 m one antenna of 250 mm leaves no place for another 1.1 sides away."""
    antenna = replace(layout.readers[0].antenna, side_m=0.25)
    group = replace(layout.readers[0], antenna=antenna, poses=np.zeros((1, 4)), slots=(0,), antennas_per_module=1)
    assert places_for_one_more(layout.replace(readers=(group,)), spec.problem().design) == ()


def test_edits_that_another_pattern_cannot_take_are_refused_later_not_here(spec, layout):
    """A dropped tag stays dropped in the variant; whether that can be laid is for the judge to say."""
    place = tuple(layout.floor_tags.lay_on(spec.site).xy_m[0].tolist())
    edited = layout.replace(
        floor_tags=replace(layout.floor_tags, edits=(TagEdit(kind=EditKind.DROPPED, from_m=place),))
    )
    assert all(item.layout.floor_tags.edits for item in variants_of(spec, edited))
