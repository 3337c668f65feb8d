"""Antennas that a user measured."""

import pytest

from layoutopt.antennas.measured import MeasuredAntenna

TABLE = [(0.06, 0.01, 0.026), (0.06, 0.03, 0.03), (0.06, 0.05, 0.0), (0.04, 0.01, 0.02), (0.04, 0.02, 0.018)]


def test_measured_discs_and_what_lies_between():
    """Linear between two heights, the other side's rows left alone."""
    antenna = MeasuredAntenna(side_m=0.06, table_m=TABLE)
    found = [antenna.read_radius_m(height_m) for height_m in (0.01, 0.02, 0.03, 0.04, 0.05)]
    assert found == pytest.approx([0.026, 0.028, 0.03, 0.015, 0.0])
    assert MeasuredAntenna(side_m=0.04, table_m=TABLE).read_radius_m(0.015) == pytest.approx(0.019)


def test_nothing_is_read_where_nothing_was_measured():
    """Neither nearer than the lowest height nor beyond the highest."""
    antenna = MeasuredAntenna(side_m=0.04, table_m=TABLE)
    assert [antenna.read_radius_m(height_m) for height_m in (0.0, 0.0099, 0.0201)] == [0.0, 0.0, 0.0]


def test_the_order_of_rows_makes_no_other_antenna():
    """Rows are a set."""
    turned = MeasuredAntenna(side_m=0.06, table_m=[list(row) for row in reversed(TABLE)])
    assert turned == MeasuredAntenna(side_m=0.06, table_m=TABLE)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ([], "0 heights for a side of 60 mm.*none"),
        (TABLE[3:], "0 heights for a side of 60 mm.*40 mm"),
        (TABLE[:1], "1 heights.*two or more"),
        ([*TABLE, (0.06, 0.01, 0.02)], "two radii"),
        ([*TABLE, (0.06, 0.06)], "side, height and radius"),
        ([*TABLE, (0.06, 0.06, -0.01)], "none negative"),
        ([*TABLE, (0.06, 0.06, float("nan"))], "none negative"),
        ([*TABLE, (0.06, 0.18, 0.0)], "less than 3 sides"),
    ],
)
def test_tables_that_say_nothing_are_refused(table, words):
    """And the message says what is there."""
    with pytest.raises(ValueError, match=words):
        MeasuredAntenna(side_m=0.06, table_m=table)
