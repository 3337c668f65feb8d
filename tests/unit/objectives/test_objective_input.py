"""What no floor, reader or run can be ends in a message with the rule; what does not apply scores nothing."""

import math

import numpy as np
import pytest
from shapely.geometry import box

from layoutopt.antennas.disc import DiscAntenna
from layoutopt.layout import FloorTags, Layout, ReaderGroup, TagPattern, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.readers.profiles import COMMERCIAL
from layoutopt.robot import Robot
from layoutopt.scenario import Role, Scenario
from layoutopt.site import Site
from objectives import blind_runs
from objectives.coverage import random_runs
from objectives.heading_bound import HeadingBound, heading_bound
from objectives.invisibility import (
    Invisibility,
    blind_probability,
    blind_probability_over_directions,
    blind_run_quantile,
    blind_run_survival,
    corridors,
    gap_exceedance,
    mean_blind_run,
    mean_gap,
    tail_constant,
)
from objectives.periodic_discs import antenna_group, one_antenna
from objectives.position_bound import (
    ESTIMATORS,
    PositionBound,
    box_error,
    check_half_gap,
    covering_density,
    covering_radius,
    half_gap_bound,
    static_error,
)
from objectives.site_invisibility import blind_runs_on_site
from objectives.static_error import StaticErrors

FLOOR = square(pitch_m=0.35)
EMPTY = TagPattern(name="empty", points_m=np.empty((0, 2)), cell_m=np.eye(2))
TWICE = {
    "at once": TagPattern(name="twice", points_m=[(0.1, 0.2), (0.1, 0.2)], cell_m=np.eye(2)),
    "after a period": TagPattern(name="twice", points_m=[(0.0, 0.0), (1.0, 0.0)], cell_m=np.eye(2)),
    "after skewed periods": TagPattern(name="twice", points_m=[(0.2, 0.1), (2.2, 1.1)], cell_m=[(1, 0), (1, 1)]),
    "but for rounding": TagPattern(name="twice", points_m=[(0.3, 0.0), (0.1 + 0.2, 0.0)], cell_m=np.eye(2)),
}
NO_DIRECTION = [math.nan, math.inf, -math.inf]
PAIR_M = np.array([(0.0, 0.1), (0.0, -0.1)])


def layout(pattern, places=((0.2, 0.0), (-0.2, 0.0))):
    """Return a layout of two antennas that read 100 mm far."""
    readers = ReaderGroup(
        name="group",
        poses=[(x, y, 0.02, 0.0) for x, y in places],
        antenna=DiscAntenna(side_m=0.1, radius_m=0.1),
        profile=COMMERCIAL,
        slots=(0,) * len(places),
    )
    return Layout(floor_tags=FloorTags(zones=(ZonePattern(zone="", pattern=pattern),)), readers=(readers,))


def scenario():
    """Return a scenario on an empty floor."""
    robot = Robot(outline_m=[(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)])
    site = Site(name="floor", floor=box(0.0, 0.0, 5.0, 4.0))
    return Scenario(name="design", role=Role.DESIGN, site=site, robot=robot)


@pytest.mark.parametrize("estimator", ESTIMATORS)
@pytest.mark.parametrize("which", TWICE)
def test_two_tags_at_one_place_are_refused(which, estimator):
    """They are one circle twice, whose arcs have no sides."""
    with pytest.raises(ValueError, match="two points share a place"):
        static_error(TWICE[which], 0.3, estimator)


@pytest.mark.parametrize(
    ("call", "rule"),
    [
        *(
            (lambda which=which: static_error(EMPTY, 0.1, which), "cell of the pattern is empty")
            for which in ESTIMATORS
        ),
        (lambda: covering_radius(EMPTY), "cell of the pattern is empty"),
        (lambda: check_half_gap(EMPTY, 0.1), "does not apply, because"),
        (lambda: half_gap_bound(EMPTY), "has no tag"),
        (lambda: box_error(EMPTY, 0.1), "has no tag"),
        (lambda: mean_gap(EMPTY, 0.1, 0.3), "at least one tag a cell"),
        (lambda: corridors(EMPTY, 0.1), "at least one tag a cell"),
        (lambda: blind_probability(EMPTY, 0.1, 1.0, 0.3), "at least one tag a cell"),
        (lambda: blind_probability_over_directions(EMPTY, 0.1, 1.0), "at least one tag a cell"),
        (lambda: gap_exceedance(EMPTY, 0.1, 1.0, np.zeros(1)), "at least one tag a cell"),
        (lambda: blind_run_survival(EMPTY, 0.1, np.ones(1)), "at least one tag a cell"),
        (lambda: blind_run_quantile(EMPTY, 0.1, 0.9), "at least one tag a cell"),
        (lambda: tail_constant(EMPTY, 0.1), "at least one tag a cell"),
        (lambda: mean_blind_run(EMPTY, 0.1), "at least one tag a cell"),
        (lambda: one_antenna(EMPTY, 0.1), "at least one tag a cell"),
        (lambda: antenna_group(EMPTY, PAIR_M, np.full(2, 0.1)), "at least one tag a cell"),
    ],
)
def test_a_cell_without_tags_is_refused(call, rule):
    """Rather than a failure deep inside, or a zero."""
    with pytest.raises(ValueError, match=rule):
        call()


@pytest.mark.parametrize(
    "objective",
    [PositionBound(), StaticErrors(), HeadingBound(), Invisibility()],
    ids=lambda made: type(made).__name__,
)
def test_objectives_score_no_empty_cell(objective):
    """An objective that does not apply gives no scores; over a floor with tags all four give some."""
    assert objective(layout(EMPTY), scenario(), None) == {}
    assert objective(layout(FLOOR), scenario(), None) != {}


@pytest.mark.parametrize("direction_rad", NO_DIRECTION)
@pytest.mark.parametrize(
    "call",
    [
        lambda angle: mean_gap(FLOOR, 0.1, angle),
        lambda angle: gap_exceedance(FLOOR, 0.1, 0.5, np.array([0.1, angle])),
        lambda angle: blind_probability(FLOOR, 0.1, 0.5, np.array([angle, 0.1])),
        lambda angle: blind_runs.blind_probabilities(
            antenna_group(FLOOR, PAIR_M, np.full(2, 0.1)), 0.5, np.array([[0.1], [angle]])
        ),
        lambda angle: blind_runs_on_site(layout(FLOOR), scenario(), direction_rad=angle, runs=10),
    ],
    ids=["mean_gap", "gap_exceedance", "blind_probability", "group", "blind_runs_on_site"],
)
def test_a_direction_is_finite(call, direction_rad):
    """NaN and infinity point nowhere."""
    with pytest.raises(ValueError, match="a direction must be finite"):
        call(direction_rad)


@pytest.mark.parametrize("length_m", [-1.0, -1e-9, math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(
    "call",
    [
        lambda length_m: random_runs(scenario().site, scenario().robot, 5, length_m, 0),
        lambda length_m: blind_probability(FLOOR, 0.1, length_m, 0.3),
        lambda length_m: gap_exceedance(FLOOR, 0.1, length_m, np.zeros(1)),
        lambda length_m: blind_run_survival(FLOOR, 0.1, np.array([0.1, length_m])),
        lambda length_m: blind_probability_over_directions(FLOOR, 0.1, length_m),
    ],
    ids=["random_runs", "blind_probability", "gap_exceedance", "survival", "over_directions"],
)
def test_a_run_has_a_length(call, length_m):
    """Zero or more and finite, on a pattern and on a site."""
    with pytest.raises(ValueError, match="length of a run must be zero or more and finite"):
        call(length_m)


@pytest.mark.parametrize("k", [0, -1, 0.5, 2.5, math.nan, math.inf, -math.inf])
def test_whole_tags_are_seen(k):
    """A covering density is asked for one tag, two, and so on."""
    with pytest.raises(ValueError, match="at least one tag, and a whole number of them"):
        covering_density(0.1, k)
    assert covering_density(0.1, 2) > covering_density(0.1, 1.0) == covering_density(0.1)


@pytest.mark.parametrize("radius_m", [0.0, -0.1, math.nan, math.inf])
def test_a_read_radius_is_positive_and_finite(radius_m):
    """Of every measure of a disc."""
    for call in (static_error, check_half_gap, corridors, tail_constant, mean_blind_run, one_antenna):
        with pytest.raises(ValueError, match="radius must be positive and finite"):
            call(FLOOR, radius_m)
    with pytest.raises(ValueError, match="radius must be positive and finite"):
        covering_density(radius_m)
    with pytest.raises(ValueError, match="radius must be positive and finite"):
        antenna_group(FLOOR, PAIR_M, np.array([0.1, radius_m]))


@pytest.mark.parametrize(
    "error_m",
    [
        np.array([0.01, -0.01]),
        np.array([math.nan, 0.01]),
        np.array([0.01]),
        np.array([0.01, 0.01, 0.01]),
        np.full((2, 1), 0.01),
        np.empty(0),
    ],
    ids=["negative", "NaN", "too few", "too many", "in a column", "none"],
)
def test_each_antenna_has_one_error(error_m):
    """A negative error would make the bound smaller, and NaN none at all."""
    with pytest.raises(ValueError, match="each of 2 antennas needs an error of zero or more"):
        heading_bound(PAIR_M, error_m)


@pytest.mark.parametrize("place_m", [math.nan, math.inf])
def test_antennas_have_places(place_m):
    """A group with an antenna nowhere has no discs."""
    with pytest.raises(ValueError, match="finite"):
        antenna_group(FLOOR, np.array([(0.0, 0.1), (place_m, 0.0)]), np.full(2, 0.1))
    with pytest.raises(ValueError, match="heading must be finite"):
        antenna_group(FLOOR, PAIR_M, np.full(2, 0.1), heading_rad=place_m)
