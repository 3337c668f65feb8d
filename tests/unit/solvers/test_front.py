"""Non-dominated sets and knees against brute force and hand-made cases."""

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
    pattern = registry.load("patterns", "square")(pitch_m=0.1 + error)
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


def test_knee_of_nothing_is_refused():
    """An empty front has no knee."""
    with pytest.raises(ValueError, match="at least one member"):
        knee(front_of([], ("cost", "error")))
