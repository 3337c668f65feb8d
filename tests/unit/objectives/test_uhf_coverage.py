"""Coverage by UHF antennas against trials, symmetries, and what is known of the best yaw."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from shapely.geometry import box
from tracking_cases import SCENARIO, WORLD, Standing, layout, world

from layoutopt.antennas.uhf_patch import UhfPatch
from layoutopt.scores import TRACKING_UNITS, TrialOutcomes
from layoutopt.simulation.signals import detection_chance, mean_strength_dbm
from layoutopt.simulation.trials import run_trials
from layoutopt.site import Site
from layoutopt.streams import Streams
from layoutopt.tracking_world import SPEED_OF_LIGHT_M_S, SignalWorld
from objectives.tracking import Tracking
from objectives.uhf_coverage import UhfCoverage, chance_somewhere, hearing_chance, reach_lattice

HALL = replace(SCENARIO, site=Site(name="hall", floor=box(-10, -10, 10, 10)))
QUARTER_M = SPEED_OF_LIGHT_M_S / 920e6 / 4.0
FALSE_ALARM = 5.0
"""Standard errors: two-sided, a chance of 6e-7."""


def scores(candidate, scenario=HALL):
    """Return the values of the scores by name."""
    return {name: score.value for name, score in UhfCoverage()(candidate, scenario, None).items()}


def test_two_antennas_cover_most_floor_at_about_45_degrees():
    """A beam of 70 degrees on either side of the middle then fills the half circle ahead (45 ± 8 degrees)."""
    yaws_deg = np.arange(30, 61, 2)
    covered = [scores(layout(2, float(yaw_deg)))["area_coverage"] for yaw_deg in yaws_deg]
    assert 37 <= yaws_deg[int(np.argmax(covered))] <= 53
    assert max(covered) > 1.3 * scores(layout(2, 0.0))["area_coverage"]


def test_two_antennas_aside_beat_one_ahead_and_that_one_aside():
    for name in ("area_coverage", "walk_coverage"):
        two, ahead, aside = (scores(layout(*choice))[name] for choice in ((2, 45.0), (1, 0.0), (1, 45.0)))
        assert two > ahead > aside


def test_scores_are_what_trials_give_on_average():
    """Detections and aliases of 16 trials lie within five standard errors, for one antenna, two, and hopping."""
    hopping = replace(WORLD.signal, channels_hz=(866e6, 928e6), dwell_s=2.0)
    cases = [(layout(1, 30.0), HALL), (layout(2, 60.0), HALL)]
    cases.append((layout(2, 60.0), replace(HALL, tracking=replace(WORLD, signal=hopping))))
    for candidate, scenario in cases:
        found = run_trials(candidate, scenario, Standing(), Streams(seed=4), 0, 16)
        exact = scores(candidate, scenario)
        for column, name in (("detection_share", "walk_coverage"), ("alias_share", "expected_alias_share")):
            score = found.score(column)
            assert 0.0 < score.standard_error < 0.05
            assert abs(score.value - exact[name]) < FALSE_ALARM * score.standard_error


def test_antennas_to_the_left_and_to_the_right_cover_alike():
    """Floor and walk are the same on both sides of the robot, so the mirror image has the same scores."""
    for count, yaw_deg in ((1, 40.0), (2, 40.0)):
        left, right = scores(layout(count, yaw_deg)), scores(layout(count, -yaw_deg))
        assert left == pytest.approx(right, rel=1e-6)


def test_what_turns_with_the_robot_changes_nothing():
    turn = math.radians(37.0)
    matrix = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    moved = replace(WORLD, robot_pose=(1.0, -0.5, turn), walk_m=WORLD.walk_m @ matrix + (1.0, -0.5))
    turned = scores(layout(), replace(HALL, tracking=moved))
    assert turned == pytest.approx(scores(layout()), rel=1e-9)


def test_without_fading_the_chance_is_that_of_the_strength():
    still = replace(WORLD, signal=SignalWorld(fading_sigma_db=0.0, noise_sigma_db=0.0))
    places_m = np.array([[2.0, 0.0], [5.0, 3.0], [-4.0, 1.0], [6.9, 0.1]])
    group = layout(1, 0.0).readers[0]
    offset_m = np.column_stack([places_m, np.zeros(4)])
    plain = detection_chance(still.signal, mean_strength_dbm(UhfPatch(), still.signal, offset_m))
    assert hearing_chance(group, still, places_m)[:, 0] == pytest.approx(plain, rel=1e-12)


def test_half_of_the_readings_succeed_at_half_range_with_fading_too():
    chance = hearing_chance(layout(1, 0.0).readers[0], WORLD, np.array([[WORLD.signal.half_range_m, 0.0]]))
    assert chance[0, 0] == pytest.approx(0.5, abs=1e-12)


def test_one_antenna_more_never_covers_less():
    chance = np.random.Generator(np.random.Philox(3)).random((50, 4))
    each = [chance_somewhere(chance[:, :count]) for count in (1, 2, 3, 4)]
    assert all((more >= less).all() for less, more in pairwise(each))


def test_a_radial_walk_is_ambiguous_from_a_quarter_wavelength_an_interval_on():
    """Straight to the robot and back all of the way is radial: no pair below the limit, nearly all above it."""
    line = replace(WORLD, walk_m=[(1.0, 0.0), (6.0, 0.0)])
    shares = [
        scores(
            layout(1, 0.0, interval_s=0.4),
            replace(HALL, tracking=replace(line, walking_speed_m_s=factor * QUARTER_M / 0.4)),
        )["expected_alias_share"]
        for factor in (0.99, 1.01)
    ]
    assert shares[0] == 0.0
    assert shares[1] > 0.95


def test_a_longer_interval_leaves_more_pairs_ambiguous():
    shares = [scores(layout(interval_s=interval_s))["expected_alias_share"] for interval_s in (0.1, 0.2, 0.4, 0.8)]
    assert shares == sorted(shares)
    assert shares[0] == 0.0 < shares[-1]


def test_the_area_is_the_open_floor_ahead_within_half_range():
    site = Site(name="room", floor=box(-1, -3, 5, 3), obstacles=(box(2, -1, 3, 1),))
    places_m = reach_lattice(replace(SCENARIO, site=site), WORLD)
    assert (places_m[:, 0] > 0.0).all()
    assert (np.hypot(*places_m.T) <= WORLD.signal.half_range_m).all()
    assert not ((places_m > (2, -1)) & (places_m < (3, 1))).all(axis=1).any()
    reach_m = math.hypot(5.0, 3.0)
    assert len(places_m) * (reach_m / 100) ** 2 == pytest.approx(5 * 6 - 2, rel=0.01)


def test_what_does_not_apply_has_no_scores():
    """No antennas, nobody to track; a robot before a wall has no area, but still a walk."""
    assert scores(layout(), replace(HALL, tracking=None)) == {}
    floor_only = layout().replace(readers=tuple(replace(group, kind="tag_read") for group in layout().readers))
    assert scores(floor_only) == {}
    before_wall = replace(SCENARIO, site=Site(name="room", floor=box(-5, -3, -0.001, 3)))
    assert set(scores(layout(), before_wall)) == {"walk_coverage", "expected_alias_share"}


def test_trials_of_other_kinds_have_no_scores_of_tracking():
    other = TrialOutcomes(replications=np.arange(2), columns=("lost_share",), values=np.zeros((2, 1)))
    assert Tracking()(layout(), world(), other) == {}
    values = np.arange(14.0).reshape(2, 7)
    table = TrialOutcomes(replications=np.arange(2), columns=tuple(TRACKING_UNITS), values=values)
    found = Tracking()(layout(), world(), table)
    assert [score.value for score in found.values()] == [3.5, 4.5, 5.5, 6.5, 7.5, 8.5, 9.5]
