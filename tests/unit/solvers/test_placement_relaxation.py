"""What gives where tags cannot be placed: cells, and the cheapest ways out."""

from dataclasses import replace

import numpy as np
from placement_cases import ROUGH, antennas_at, hall, plate

from layoutopt.result import Status
from solvers.demands import Demand, Runs
from solvers.placement import place_tags, sampled
from solvers.placement_model import served
from solvers.placement_relaxation import unserved_cells, ways_out


def test_cells_are_counted_by_where_runs_begin():
    """By hand: the cell with most runs first, then from left to right."""
    poses = np.array([(0.1, 0.1, 0.0), (0.6, 0.1, 0.0), (0.7, 0.2, 1.0), (-0.1, 0.4, 0.0)])
    cells = unserved_cells(Runs(poses=poses, way_m=np.zeros((4, 2))), 0.5)
    assert [(cell.corner_m, cell.runs) for cell in cells] == [((0.5, 0.0), 2), ((-0.5, 0.0), 1), ((0.0, 0.0), 1)]


def test_every_way_out_makes_the_question_one_that_has_an_answer():
    """More tags in view than there are slots: fewer tags, denser slots or a larger disc help."""
    question = hall(demands=(Demand(length_m=0.3, tags=6),))
    assert place_tags(question, effort=ROUGH).status is Status.INFEASIBLE
    ways = ways_out(question, ROUGH)
    assert len(ways) >= 3
    assert len({way.text for way in ways}) == len(ways)
    for way in ways:
        runs = sampled(way.question, ROUGH)
        assert len(served(way.question, runs).lost) <= way.question.unserved_share * sum(map(len, runs))
        assert way.tags > 0
        assert way.left_out == way.question.unserved_share
    whole = [way.tags for way in ways if way.left_out == 0.0]
    assert whole
    assert whole == sorted(whole)
    assert [way.left_out > 0.0 for way in ways] == sorted(way.left_out > 0.0 for way in ways)


def test_forbidden_slots_that_are_allowed_again_are_a_way_out():
    """So are spacing and tiles; here nothing but the marks is in the way."""
    question = hall(demands=(Demand(length_m=0.3),))
    marks = np.ones(len(question.slots), dtype=np.bool_)
    marks[0] = False
    ways = ways_out(replace(question, forbidden=marks), ROUGH)
    assert "the forbidden slots allowed" in {way.text for way in ways}


def test_runs_over_a_plate_left_out_are_a_way_out():
    """On a plate nothing can be laid; the runs that touch it are left out, and the rest is served."""
    question = hall(
        2.4,
        zones=(plate(0.9, 0.2, 1.5, 1.0),),
        demands=(Demand(length_m=0.1),),
        antennas=antennas_at([(0.0, 0.0)], 0.3),
    )
    ways = ways_out(question, ROUGH)
    assert any("runs over 'plate' left out" in way.text for way in ways)
