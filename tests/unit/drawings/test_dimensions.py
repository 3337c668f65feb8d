"""Running dimensions, grid lines and labels of marks: true values, one datum, no text over another."""

from itertools import combinations, pairwise

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from layoutopt.drawings.dimensions import grid_lines, label_places, letters, mark_labels, running_dimensions
from layoutopt.drawings.lettering import width_mm
from layoutopt.drawings.sheet import Box, Circle, Line, Marks, Text
from layoutopt.drawings.text_boxes import text_box

VALUES = st.lists(st.floats(min_value=-20_000, max_value=20_000), min_size=1, max_size=60)
SCALE = st.sampled_from([1, 20, 50, 200])


def labels(entities):
    return [entity for entity in entities if isinstance(entity, Text)]


def overlaps(entities, scale):
    boxes = [(entity.text, text_box(entity, scale)) for entity in labels(entities)]
    return [(one[0], other[0]) for one, other in combinations(boxes, 2) if one[1].overlaps(other[1])]


@given(positions=VALUES, gap=st.floats(min_value=0.1, max_value=5000))
def test_label_places_keep_their_distance_and_both_ends(positions, gap):
    """First and last are labelled, neighbours keep the gap, and only a pair too close moves from its place."""
    ascending = sorted(set(positions))
    places = label_places(ascending, gap)
    assert places[0][0] == 0
    assert places[-1][0] == len(ascending) - 1
    assert all(after[1] - before[1] >= gap * (1 - 1e-6) for before, after in pairwise(places))
    if len(places) > 2:
        assert all(ascending[index] == place for index, place in places)


@given(positions=VALUES, gap=st.floats(min_value=0.1, max_value=5000))
def test_label_places_leave_no_room_unused(positions, gap):
    """Thinning drops a label only where it would come too close to one that stays."""
    ascending = sorted(set(positions))
    places = label_places(ascending, gap)
    for index, position in enumerate(ascending):
        if index not in dict(places):
            assert any(abs(position - place) < gap for _, place in places)


def test_label_places_prefer_what_is_wanted():
    """A wanted position keeps its label and its neighbours give way."""
    positions = [0.0, 10.0, 11.0, 12.0, 30.0]
    assert 1 in dict(label_places(positions, 5.0))
    assert [index for index, _ in label_places(positions, 5.0, wanted=[2])] == [0, 2, 4]


@settings(max_examples=150, deadline=None)
@given(
    values=VALUES,
    datum=st.floats(-20_000, 20_000),
    axis=st.sampled_from("xy"),
    scale=SCALE,
    side=st.sampled_from([-1, 1]),
)
def test_running_dimensions_never_overlap_and_keep_both_ends(values, datum, axis, scale, side):
    """Whatever the values, labels leave each other free, and the first and last value are written."""
    entities = running_dimensions(values, datum_mm=datum, axis=axis, line_mm=-300.0, scale=scale, side=side)
    assert overlaps(entities, scale) == []
    written = [float(label.text) for label in labels(entities)]
    for end in (min(values), max(values)):
        assert min(abs(number - (end - datum)) for number in written) <= 0.0501
    assert all(entity.layer == "A-DIMS" for entity in entities)


@settings(max_examples=100, deadline=None)
@given(values=VALUES, datum=st.floats(-20_000, 20_000), axis=st.sampled_from("xy"), scale=SCALE)
def test_every_label_states_the_distance_of_its_line_from_the_datum(values, datum, axis, scale):
    """The line that leads to a label begins where its number says, measured from the one datum."""
    entities = running_dimensions(values, datum_mm=datum, axis=axis, line_mm=-300.0, scale=scale)
    along = 0 if axis == "x" else 1
    for leader, label in pairwise(entities):
        if isinstance(label, Text):
            assert isinstance(leader, Line)
            assert leader.start_mm[along] - datum == pytest.approx(float(label.text), abs=0.0501)
            assert leader.end_mm[along] == pytest.approx(label.position_mm[along])


def test_running_dimensions_of_a_plain_row():
    """Tags before, at and after the datum are written with their signed distance, on one line."""
    entities = running_dimensions(
        [2000.0, 250.0, 3250.5], datum_mm=2000.0, axis="x", line_mm=-400.0, scale=50, witness_mm=-50.0
    )
    assert [label.text for label in labels(entities)] == ["-1750", "0", "1250.5"]
    assert all(label.angle_deg == 90.0 for label in labels(entities))
    (origin,) = [entity for entity in entities if isinstance(entity, Circle)]
    assert origin.centre_mm == (2000.0, -400.0)
    lines = [entity for entity in entities if isinstance(entity, Line)]
    assert (lines[0].start_mm, lines[0].end_mm) == ((250.0, -400.0), (3250.5, -400.0))
    witnesses = [line for line in lines if line.start_mm[1] == -50.0]
    assert [line.end_mm for line in witnesses] == [(250.0, -400.0), (2000.0, -400.0), (3250.5, -400.0)]


def test_running_dimensions_run_from_the_datum_when_it_lies_outside():
    """The dimension line begins at a datum outside the values, and the datum is written as 0."""
    entities = running_dimensions([1000.0, 2000.0], datum_mm=0.0, axis="y", line_mm=-400.0, scale=20)
    assert sorted(label.text for label in labels(entities)) == ["0", "1000", "2000"]
    assert entities[0].start_mm == (-400.0, 0.0)
    assert entities[0].end_mm == (-400.0, 2000.0)


def test_crowded_values_keep_their_strokes_only_where_these_can_be_told_apart():
    """Values 4 mm apart on paper all get a stroke; values 0.1 mm apart get one for each label only."""

    def strokes(values):
        entities = running_dimensions(values, datum_mm=0.0, axis="x", line_mm=0.0, scale=50)
        found = [entity for entity in entities if isinstance(entity, Line)]
        return len([line for line in found if line.end_mm[0] - line.start_mm[0] == pytest.approx(100.0)]), entities

    wide, _ = strokes(np.arange(0, 4000, 200.0))
    assert wide == 20
    dense, entities = strokes(np.arange(0, 4000, 5.0))
    assert dense == len(labels(entities)) < 30


def test_no_values_give_no_dimensions():
    """A layout without tags is drawn without dimensions rather than refused."""
    assert running_dimensions([], datum_mm=0.0, axis="x", line_mm=0.0, scale=50) == ()


@settings(max_examples=60, deadline=None)
@given(columns=VALUES, rows=VALUES, scale=SCALE)
def test_grid_labels_never_overlap(columns, rows, scale):
    """Bubbles of neighbouring grid lines do not touch, and every line is drawn whether labelled or not."""
    box = Box(min(columns), min(rows), max(columns) + 1, max(rows) + 1)
    entities = grid_lines(columns, rows, extent_mm=box, scale=scale)
    assert overlaps(entities, scale) == []
    circles = [entity for entity in entities if isinstance(entity, Circle)]
    for one, other in combinations(circles, 2):
        distance = np.hypot(*np.subtract(one.centre_mm, other.centre_mm))
        assert distance >= one.radius_mm + other.radius_mm
    lines = [entity for entity in entities if entity.layer == "A-GRID"]
    assert len(lines) == len(distinct(columns)) + len(distinct(rows))


def distinct(values):
    ascending = sorted(values)
    kept = ascending[:1]
    for value in ascending[1:]:
        if value - kept[-1] > 1e-6:
            kept.append(value)
    return kept


def test_grid_names_columns_by_number_and_rows_by_letter():
    """Columns are 1, 2, 3 from the left, rows A, B from below, each bubble at the end of its own line."""
    entities = grid_lines([0, 2000, 4000], [0, 3000], extent_mm=Box(0, 0, 4000, 3000), scale=50)
    places = {label.text: label.position_mm for label in labels(entities)}
    assert {name: place[0] for name, place in places.items() if name.isdigit()} == {
        "1": 0.0,
        "2": 2000.0,
        "3": 4000.0,
    }
    assert {name: place[1] for name, place in places.items() if name.isalpha()} == {"A": 0.0, "B": 3000.0}
    assert all(place[1] > 3000.0 for name, place in places.items() if name.isdigit())


def test_letters_are_distinct_and_never_look_like_digits():
    """A thousand rows have a thousand names without I and O."""
    names = [letters(number) for number in range(1000)]
    assert len(set(names)) == 1000
    assert not {"I", "O"} & set("".join(names))


def grid_of_marks(pitch_mm, count=12):
    places = [(x * pitch_mm, y * pitch_mm) for y in range(count) for x in range(count)]
    names = tuple(f"T{number:04d}" for number in range(len(places)))
    return Marks(layer="A-TAGS", points_mm=places, symbol="target", size_mm=50.0, ids=names)


@pytest.mark.parametrize("pitch", [60.0, 150.0, 300.0, 600.0])
def test_mark_labels_touch_neither_marks_nor_texts(pitch):
    """Identities are written only where they are free of every mark, of each other and of texts already there."""
    marks = grid_of_marks(pitch)
    there = Text(layer="A-ZONE", text="DOCK", position_mm=(0.0, 40.0), height_mm=5.0)
    written = mark_labels(marks, scale=50, taken=[there])
    assert overlaps([there, *written], 50) == []
    for label in written:
        box = text_box(label, 50)
        for x, y in marks.points_mm / 50:
            assert not box.overlaps(Box(x - 0.5, y - 0.5, x + 0.5, y + 0.5))


def test_mark_labels_are_complete_where_there_is_room_and_true_everywhere():
    """With a wide pitch every mark is labelled, and each label stands beside the mark whose name it bears."""
    marks = grid_of_marks(600.0)
    written = mark_labels(marks, scale=50)
    assert [label.text for label in written] == list(marks.ids)
    for label, point in zip(written, marks.points_mm, strict=True):
        assert np.hypot(*(np.array(label.position_mm) - point)) <= 56.0


def test_labels_give_way_to_edges_and_keep_their_distance():
    """A label that a wall would strike through stands below its mark or left of its column, the others above."""
    marks = grid_of_marks(600.0, count=3)
    wall = shapely.union_all(
        [shapely.LineString([(-900, 1260), (2000, 1260)]), shapely.LineString([(50, -900), (50, 700)])]
    )
    written = {label.text: label for label in mark_labels(marks, scale=50, edges_mm=wall)}
    assert len(written) == 9
    assert [label.anchor for label in written.values()] == [
        "right",
        *2 * ["left"],
        "right",
        *2 * ["left"],
        *3 * ["top-left"],
    ]
    for label in written.values():
        assert not shapely.box(*(50 * edge for edge in text_box(label, 50))).intersects(wall)
    boxes = sorted(text_box(label, 50) for label in mark_labels(grid_of_marks(310.0), scale=50))
    gaps = [
        after.xmin - one.xmax
        for one in boxes
        for after in boxes
        if one.ymin == after.ymin and after.xmin > one.xmin
    ]
    assert min(gaps) > 0.3


def test_marks_without_identities_have_no_labels():
    """Nothing is invented for marks that have no names."""
    marks = Marks(layer="A-TAGS", points_mm=[(0, 0)], symbol="ring", size_mm=5.0)
    assert mark_labels(marks, scale=50) == ()


def test_close_grid_lines_are_drawn_only_where_they_have_a_label():
    """Lines closer on paper than asked for are thinned to the labelled ones, which keep their number."""
    columns = [100.0 * number for number in range(41)]
    box = Box(0, 0, 4000, 1000)
    everything = grid_lines(columns, [], extent_mm=box, scale=50)
    thinned = grid_lines(columns, [], extent_mm=box, scale=50, closest_mm=4.0)
    lines, names = ([item for item in thinned if isinstance(item, kind)] for kind in (Line, Text))
    assert sum(isinstance(item, Line) for item in everything) == 41
    assert {int(name.text): name.position_mm[0] for name in names} == {
        columns.index(line.start_mm[0]) + 1: line.start_mm[0] for line in lines
    }
    assert 5 < len(lines) < 15


def test_bubbles_grow_until_the_longest_name_is_whole():
    """With 12 345 columns the last label is its whole number and lies within its circle."""
    entities = grid_lines(range(0, 12_345_000, 1000), [], extent_mm=Box(0, 0, 1.3e7, 1e6), scale=1000)
    names = [item for item in entities if isinstance(item, Text)]
    radius_mm = min(item.radius_mm for item in entities if isinstance(item, Circle))
    assert names[-1].text == "12345"
    assert all(width_mm(name.text, name.height_mm) * 1000 < 2 * radius_mm for name in names)
