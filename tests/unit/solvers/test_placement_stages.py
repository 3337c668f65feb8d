"""Stages of a placement: what was laid stays."""

import numpy as np
import pytest
from placement_cases import ROUGH, hall
from shapely.geometry import box

from layoutopt.result import Status
from layoutopt.site import Zone
from solvers.demands import Demand
from solvers.placement import place_tags
from solvers.placement_stages import staged

HALF = Zone(name="left", region=box(0.0, 0.0, 0.8, 1.2))


def test_stages_keep_what_was_laid_and_take_no_fewer_than_all_at_once():
    """Each stage holds the tags of the one before; together they have at least as many as one answer for all."""
    question = hall(zones=(HALF,), demands=(Demand(length_m=0.3, zone="left"), Demand(length_m=0.3)))
    first, second = (stage.placed for stage in staged(question, [["left"], [""]], effort=ROUGH))
    laid = {tuple(place) for place in first.xy_m}
    assert laid <= {tuple(place) for place in second.xy_m}
    assert len(second.xy_m) == first.new + second.new
    at_once = place_tags(question, effort=ROUGH)
    assert at_once.status is Status.OPTIMAL
    assert len(second.xy_m) >= at_once.new
    with pytest.raises(ValueError, match="no stage equips the whole floor"):
        staged(question, [["left"]], effort=ROUGH)
    with pytest.raises(ValueError, match="there is no stage"):
        staged(question, [], effort=ROUGH)
    with pytest.raises(ValueError, match="nothing is demanded"):
        staged(question, [["right"], ["left", ""]], effort=ROUGH)


def test_required_slots_get_their_tags_in_the_first_stage_and_are_paid_for_once():
    """In the second stage they are installed."""
    question = hall(zones=(HALF,), demands=(Demand(length_m=0.3, zone="left"), Demand(length_m=0.3)))
    required = np.zeros(len(question.slots), dtype=np.bool_)
    required[-1] = True
    question = hall(zones=(HALF,), demands=question.demands, required=required)
    first, second = (stage.placed for stage in staged(question, [["left"], [""]], effort=ROUGH))
    for placed in (first, second):
        assert (placed.xy_m == question.slots.xy_m[-1]).all(axis=1).sum() == 1
    assert len(second.xy_m) == first.new + second.new


def test_stages_end_with_the_first_that_has_no_answer():
    """It says why, and what it was asked beside the tags that lie."""
    question = hall(zones=(HALF,), demands=(Demand(length_m=0.3, zone="left"), Demand(length_m=0.3, tags=40)))
    first, second = staged(question, [["left"], [""]], effort=ROUGH)
    assert first.placed.xy_m is not None
    assert second.placed.status is Status.INFEASIBLE
    assert np.array_equal(second.question.installed_m, first.placed.xy_m)
    only = staged(question, [["", "left"], ["right"]], effort=ROUGH)
    assert [stage.placed.status for stage in only] == [Status.INFEASIBLE]
