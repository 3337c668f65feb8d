"""Non-dominated sets and knees against brute force and hand-made cases."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from layoutopt import registry
from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.layout import FloorTags, Layout, ZonePattern
from layoutopt.protocols import Mount
from layoutopt.readers.profiles import PROFILES
from layoutopt.result import Evaluated
from layoutopt.scores import Score
from solvers.front import front_of, knee, non_dominated


def _evaluated(cost: float, error: float) -> Evaluated:
    mount = Mount(antenna=SphereAntenna(side_m=0.06), height_m=0.024, profile=PROFILES["mi2016"])
    group = registry.load("readers", "cross")(count=4, mount=mount)
    pattern = registry.load("patterns", "square")(pitch_m=0.1 + cost)
    layout = Layout(floor_tags=FloorTags(zones=(ZonePattern(zone="", pattern=pattern),)), readers=(group,))
    scores = {"cost": Score(value=cost, unit="EUR"), "error": Score(value=error, unit="m")}
    return Evaluated(layout=layout, scores=scores)


@given(st.lists(st.tuples(*[st.integers(0, 6) | st.just(float("nan"))] * 2), min_size=0, max_size=30))
def test_front_equals_brute_force(rows):
    """A row is on the front if and only if no other row dominates it and no earlier row equals it."""
    goals = np.array(rows, dtype=np.float64).reshape(-1, 2)
    expected = set()
    for i, row in enumerate(goals):
        if np.isnan(row).any():
            continue
        beaten = any((other <= row).all() and (other < row).any() for other in goals)
        repeated = any((goals[j] == row).all() for j in range(i))
        if not beaten and not repeated:
            expected.add(i)
    assert set(non_dominated(goals).tolist()) == expected


def test_front_is_sorted_by_the_first_goal():
    """Members come by rising cost and falling error."""
    front = front_of([_evaluated(3, 0.1), _evaluated(1, 0.5), _evaluated(2, 0.7)], ("cost", "error"))
    assert [member.scores["cost"].value for member in front.members] == [1, 3]


def test_knee_is_the_corner_of_a_bent_front():
    """Of three members the one far below the chord is the knee."""
    front = front_of([_evaluated(1, 1.0), _evaluated(2, 0.1), _evaluated(100, 0.09)], ("cost", "error"))
    assert knee(front).scores["cost"].value == 2


@pytest.mark.parametrize("scale", [1.0, 1e-3, 1e6])
def test_the_knee_does_not_depend_on_units(scale):
    """On the logarithmic scale of both goals; four members, the third farthest below the chord."""
    rows = [(1, 1.0), (2, 0.7), (4, 0.1), (100, 0.05)]
    front = front_of([_evaluated(cost, scale * error) for cost, error in rows], ("cost", "error"))
    assert knee(front).scores["cost"].value == 4


def test_a_front_that_ends_at_zero_has_its_knee_on_the_plain_scale_of_that_goal():
    """The logarithm of nothing would make every other member look alike."""
    front = front_of(
        [_evaluated(1, 1.0), _evaluated(2, 0.1), _evaluated(4, 0.09), _evaluated(5, 0.0)], ("cost", "error")
    )
    assert knee(front).scores["cost"].value == 2


def test_a_member_with_an_infinite_goal_is_no_end_of_a_front():
    """The cheapest layout that never localises does not bend the chord, and is the knee only of itself."""
    rows = [(1, math.inf), (2, 1.0), (3, 0.1), (100, 0.09)]
    front = front_of([_evaluated(*row) for row in rows], ("cost", "error"))
    assert len(front) == 4
    assert knee(front).scores["cost"].value == 3
    assert knee(front_of([_evaluated(*row) for row in rows[:2]], ("cost", "error"))).scores["cost"].value == 2
    assert knee(front_of([_evaluated(*rows[0])], ("cost", "error"))).scores["cost"].value == 1


def test_knee_of_nothing_is_refused():
    """An empty front has no knee."""
    with pytest.raises(ValueError, match="at least one member"):
        knee(front_of([], ("cost", "error")))
