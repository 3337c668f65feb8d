"""Loose lines: crossings, loose ends, gaps."""

import numpy as np
import pytest
import shapely
from plan_drawings import as_segments, rectangle, two_rooms

from layoutopt.errors import InvalidInput
from layoutopt.plans import joining
from layoutopt.plans.joining import closings, loose_ends, noded

WALL_M = 0.5


def gaps(pairs, gap_m):
    return closings(noded(as_segments(pairs)), gap_m, WALL_M, "site.plan")


def lengths(lines_m):
    return sorted(np.linalg.norm(lines_m[:, 1] - lines_m[:, 0], axis=1))


def test_lines_are_cut_at_crossings_and_counted_once():
    """A cross has four pieces; a line drawn twice, once backwards and once in part, adds none."""
    pieces = noded(as_segments([(-1, 0, 1, 0), (0, -1, 0, 1), (1, 0, -1, 0), (0, 0, 0, 1)]))
    assert len(pieces) == 4
    assert lengths(pieces) == pytest.approx([1.0] * 4)
    assert {tuple(point) for point in loose_ends(pieces)} == {(-1, 0), (1, 0), (0, -1), (0, 1)}


def test_ends_within_the_grid_are_one_point():
    """Rounding of a drawing program does not open a room, and points are not counted as lines."""
    off = 0.3 * joining.GRID_M
    pieces = noded(
        as_segments([(0, 0, 4, off), (4, 0, 4, 3), (4 + off, 3, 0, 3), (0, 3 - off, off, 0), (9, 9, 9, 9)])
    )
    assert len(pieces) == 4
    assert not len(loose_ends(pieces))


def test_a_door_between_two_ends_is_closed_within_the_gap_only():
    walls = [*rectangle(0, 0, 8, 3), (4, 0, 4, 1), (4, 1.9, 4, 3)]
    assert not len(gaps(walls, 0.8))
    (line,) = gaps(walls, 0.95)
    assert sorted(line[:, 1]) == pytest.approx([1.0, 1.9])
    assert line[:, 0] == pytest.approx([4.0, 4.0])


def test_a_wall_that_stops_short_of_another_is_led_on_to_it():
    (line,) = gaps([*rectangle(0, 0, 8, 3), (4, 0, 4, 2.2)], 1.0)
    assert line.ravel() == pytest.approx([4.0, 2.2, 4.0, 3.0])


def test_a_door_with_jambs_is_closed_by_one_line_in_the_middle_of_the_wall():
    walls = np.array(two_rooms()) / 1000.0
    (line,) = gaps(walls, 1.0)
    assert line[:, 0] == pytest.approx([4.1, 4.1])
    assert sorted(line[:, 1]) == pytest.approx([1.05, 1.95])
    faces = shapely.polygonize(shapely.linestrings(noded(np.concatenate([as_segments(walls), [line]]))))
    areas = sorted(face.area for face in faces.geoms)
    # Two rooms, each with its half of the opening, and the walls, which hang together.
    assert areas[-2:] == pytest.approx([12.09, 12.09])


def test_two_lines_of_one_wall_are_joined_across_it_before_a_door_is_crossed():
    """Without jambs four ends face a door; the short sides of the walls are closed, then the door once."""
    walls = [
        *rectangle(-0.2, -0.2, 8.6, 3.4),
        (0, 0, 4, 0), (4, 0, 4, 1), (4.2, 1, 4.2, 0), (4.2, 0, 8.2, 0), (8.2, 0, 8.2, 3), (8.2, 3, 4.2, 3),
        (4.2, 3, 4.2, 1.9), (4, 1.9, 4, 3), (4, 3, 0, 3), (0, 3, 0, 0),
    ]  # fmt: skip
    closed = gaps(walls, 1.0)
    assert lengths(closed) == pytest.approx([0.2, 0.2, 0.9])


def test_no_gap_is_closed_through_a_wall():
    """Two ends that look at each other with a wall between them are each led to that wall."""
    closed = gaps([*rectangle(0, 0, 8, 3), (0, 1.5, 3.7, 1.5), (8, 1.5, 4.3, 1.5), (4, 0, 4, 3)], 1.0)
    assert lengths(closed) == pytest.approx([0.3, 0.3])


def test_a_short_line_alone_is_not_closed_onto_itself():
    assert not len(gaps([(0, 0, 0.3, 0)], 1.0))


@pytest.mark.parametrize("turn", [0.3, 1.0, 2.5])
def test_what_is_closed_does_not_depend_on_how_the_drawing_is_turned(turn):
    walls = as_segments(np.array(two_rooms()) / 1000.0)
    cos, sin = np.cos(turn), np.sin(turn)
    turned = walls @ np.array([[cos, sin], [-sin, cos]])
    assert lengths(closings(noded(turned), 1.0, WALL_M, "p")) == pytest.approx([0.9], abs=5e-4)


def test_hatching_among_the_walls_is_refused(monkeypatch):
    monkeypatch.setattr(joining, "MOST_LOOSE_ENDS", 50)
    hatch = [(0.1 * number, 0, 0.1 * number + 0.05, 0.05) for number in range(40)]
    with pytest.raises(InvalidInput, match="80 loose ends"):
        gaps(hatch, 0.01)


def test_ends_crowded_within_the_gap_are_refused(monkeypatch):
    monkeypatch.setattr(joining, "_MOST_PAIRS", 1000)
    crowd = [(0.02 * number, 0, 0.02 * number, 0.3) for number in range(60)]
    assert len(gaps(crowd, 0.005)) == 0
    with pytest.raises(InvalidInput, match="joins almost any of them"):
        gaps(crowd, 0.6)


def test_lines_that_cross_each_other_everywhere_are_refused_before_they_are_cut():
    """Two combs of 2,500 lines each cross 6 million times."""
    place = np.linspace(0.0, 50.0, 2500)
    comb = np.stack([np.stack([place, 0 * place], 1), np.stack([place, 0 * place + 50.0], 1)], axis=1)
    with pytest.raises(InvalidInput, match="cross each other more than 100,000 times"):
        joining.check_crossings(np.concatenate([comb, comb[:, :, ::-1]]), "site.plan")
    joining.check_crossings(as_segments(two_rooms()), "site.plan")


@pytest.mark.parametrize("shift", np.linspace(0.0, 1.0, 11))
def test_ends_within_the_grid_are_one_point_wherever_they_lie_on_it(shift):
    """Two ends 0.06 mm apart are joined, also where rounding alone would part them."""
    at = (1.0 + shift) * joining.GRID_M
    near = at + 0.6 * joining.GRID_M
    assert len(loose_ends(noded(as_segments([(0, 0, 4, at), (4, near, 4, 3), (4, 3, 0, 0)])))) == 0


def test_a_line_drawn_twice_in_other_pieces_falls_together():
    """A slanted line and its pieces enclose no sliver, whatever their ends were rounded to."""
    draws = np.random.default_rng(3)
    for _ in range(50):
        start, end = draws.uniform(-5.0, 5.0, (2, 2))
        share = np.sort(draws.random(4))[:, None]
        points = np.concatenate([[start], start + share * (end - start), [end]])
        pieces = np.stack([points[:-1], points[1:]], axis=1)
        joined = noded(np.concatenate([[[start, end]], pieces]))
        assert len(joined) == 5
        assert len(loose_ends(joined)) == 2


def test_a_line_of_pieces_shorter_than_the_grid_stays_a_line():
    """Its ends follow each other within the grid, but they are no single point."""
    x = np.arange(0.0, 1.0, 0.3 * joining.GRID_M)
    points = np.stack([x, 0.2 * x], axis=1)
    joined = noded(np.stack([points[:-1], points[1:]], axis=1))
    assert np.ptp(joined[:, :, 0]) == pytest.approx(1.0, abs=1e-3)
    assert np.abs(joined[:, :, 1] - 0.2 * joined[:, :, 0]).max() < 1.5 * joining.GRID_M
    assert len(loose_ends(joined)) == 2


def test_a_crowd_of_points_within_the_grid_costs_little():
    """A hundred thousand lines that begin in one cell of the grid have no hundred million pairs of ends."""
    draws = np.random.default_rng(1)
    starts = draws.uniform(0.0, 0.4 * joining.GRID_M, (100_000, 2))
    assert len(noded(np.stack([starts, np.full_like(starts, 1.0)], axis=1))) == 1
