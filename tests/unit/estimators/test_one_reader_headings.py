"""Headings of one reader's robot (han2006): turns on the spot, arcs, other ways than ahead, unknown starts."""

import math
from dataclasses import replace

import numpy as np
import pytest
from reader_worlds import AHEAD, BACK, LEFT, RIGHT, driven, grid_m, one_antenna

from layoutopt.estimators.one_reader import OneReader
from layoutopt.estimators.one_reader_centroid import OneReaderCentroid
from layoutopt.estimators.one_reader_minimax import OneReaderMinimax
from layoutopt.geometry import wrapped
from layoutopt.readings import Prior

RADIUS_M = 0.125
ALL = [
    OneReader(),
    OneReader(orientation="arc"),
    OneReader(orientation="wheels"),
    OneReader(compensation="none"),
    OneReaderCentroid(),
    OneReaderMinimax(),
]
DENSE = one_antenna(grid_m(0.1, 2.5), RADIUS_M)


def found_on(settings, start, steps, known=DENSE, prior=None, **told):
    """Return the true poses of a drive, and those that an estimator makes of it."""
    poses, seen = driven(known, start, steps, **told)
    prior = prior or Prior(pose=start, sigma_m=0.01, sigma_rad=0.02)
    return poses, settings.run(prior, known, seen, np.random.default_rng(0)).poses


def off_deg(found, poses):
    """Return the absolute errors of headings, in degrees."""
    return np.degrees(np.abs(wrapped(found[:, 2] - poses[:, 2])))


@pytest.mark.parametrize("settings", ALL)
@pytest.mark.parametrize("turn_rad", [0.002, 0.01, 0.026, 0.04, 0.5])
@pytest.mark.parametrize("way_m", [0.002, 0.0125])
def test_a_turn_on_the_spot_is_one_at_any_rate(settings, turn_rad, way_m):
    """In steps of any length, the last of which drives on already: no arc leads over it."""
    ahead = [(way_m, 0.0, 0.0)] * round(1.2 / way_m)
    steps = ahead + [(0.0, 0.0, turn_rad)] * round(1.5 / turn_rad) + [(way_m, 0.0, min(turn_rad, 0.02))] + ahead
    poses, found = found_on(settings, (-0.8, -0.6, 0.3), steps)
    assert off_deg(found, poses).max() < 10.0
    assert off_deg(found, poses)[-1] < 5.0


def test_the_step_in_which_a_turn_ends_belongs_to_it():
    """Half turn, half way: over many drives the heading after it is off by nothing on average.

    A turn that is left over is smaller than what makes a way no arc.
    """
    steps = [AHEAD] * 80 + [(0.0, 0.0, 0.1)] * 10 + [(0.01, 0.0, 0.045)] + [AHEAD] * 80
    off_rad = []
    for shift_m in np.linspace(0.0, 0.1, 24):
        start = (-0.7 + shift_m, -0.5 + 3.0 * shift_m, 0.3)
        poses, found = found_on(OneReader(compensation="none"), start, steps)
        off_rad.append(float(wrapped(found[-1, 2] - poses[-1, 2])))
    assert abs(np.mean(off_rad)) < 0.02


@pytest.mark.parametrize("settings", ALL)
def test_a_read_of_a_tag_far_away_turns_nobody(settings):
    """A chord that the wheels deny tells nothing, and the next one is long enough again."""
    start = (-0.8, -0.6, 0.3)
    poses, seen = driven(DENSE, start, [AHEAD] * 160)
    tags = seen.read_tag.copy()
    tags[seen.read_start[40] : seen.read_start[41]] = len(DENSE.tags) - 1
    told = replace(seen, read_tag=tags)
    prior = Prior(pose=start, sigma_m=0.01, sigma_rad=0.02)
    found = settings.run(prior, DENSE, told, np.random.default_rng(0)).poses
    assert off_deg(found, poses).max() < 10.0


@pytest.mark.parametrize("settings", ALL)
@pytest.mark.parametrize("heading_rad", [0.0, 0.7])
def test_a_robot_may_move_sideways_and_back(settings, heading_rad):
    """Round a square with its heading kept: heading and place are as good as of one that drives ahead."""
    steps = [step for step in (AHEAD, LEFT, BACK, RIGHT) for _ in range(120)]
    poses, found = found_on(settings, (-0.6, -0.5, heading_rad), steps)
    assert off_deg(found, poses).max() < 10.0
    assert np.hypot(*(found - poses)[:, :2].T).mean() < 0.03


@pytest.mark.parametrize("settings", ALL)
def test_a_robot_may_turn_under_way_and_drive_back(settings):
    """Curves of several radii, none of them an arc from the begin, and the same way in reverse."""
    bend = [(0.01, 0.0, 0.02)] * 40
    steps = [AHEAD] * 80 + bend + [AHEAD] * 60 + bend + [AHEAD] * 40
    steps += [(-forward_m, 0.0, -turn_rad) for forward_m, _, turn_rad in reversed(steps)]
    poses, found = found_on(settings, (-0.8, -0.8, 0.0), steps)
    assert off_deg(found, poses).max() < 10.0
    assert np.hypot(*(found - poses)[:, :2].T).mean() < 0.03


def test_arcs_from_the_end_of_the_chord_before_turn_errors_over():
    """A heading that is wrong at first is wrong to the other side after each chord; from the begin, once."""
    start = (-1.8, 0.03, 0.0)
    wrong = Prior(pose=(-1.8, 0.03, 0.2), sigma_m=0.01, sigma_rad=0.1)
    ends = {}
    for orientation in ("arc", "start", "wheels"):
        settings = OneReader(orientation=orientation, compensation="none")
        _, found = found_on(settings, start, [AHEAD] * 220, prior=wrong)
        ends[orientation] = [float(found[step, 2]) for step in (30, 80, 135, 190)]
    assert ends["arc"] == pytest.approx([0.2, -0.2, 0.2, -0.2], abs=0.1)
    assert ends["start"] == pytest.approx([0.2, -0.2, -0.2, -0.2], abs=0.1)
    assert ends["wheels"] == pytest.approx([0.2, 0.0, 0.0, 0.0], abs=0.1)


@pytest.mark.parametrize(("orientation", "limit_deg"), [("arc", 9.0), ("start", 6.0)])
def test_on_an_arc_tags_alone_give_the_heading(orientation, limit_deg):
    """Wheels that know nothing of the turn leave it to Eq. 4-8; with the wheels' form the heading lags behind."""
    steps = [(0.01, 0.0, 0.01)] * 120
    straight = [(0.01, 0.0, 0.0)] * 120
    off = {}
    for kind in (orientation, "wheels"):
        settings = OneReader(orientation=kind, compensation="none")
        poses, found = found_on(settings, (0.0, -1.0, 0.0), steps, told=straight, sigma=(1e-4, 1e-4, 0.3))
        off[kind] = off_deg(found, poses)[-1]
    assert off[orientation] < limit_deg
    assert off["wheels"] > 12.0


def test_an_unknown_heading_is_found_once_and_arcs_lead_from_there():
    """Eq. 1-3 on the first chord, Eq. 4-8 after it: a turn that wheels pretend later is not believed."""
    start, lost = (-1.2, -0.6, 0.4), Prior(pose=(-1.2, -0.6, 0.0), sigma_m=0.01, sigma_rad=math.inf)
    pretended = [AHEAD] * 60 + [(0.01, 0.0, 0.005)] * 120
    off = {}
    for orientation in ("start", "wheels"):
        settings = OneReader(orientation=orientation, compensation="none")
        poses, found = found_on(
            settings, start, [AHEAD] * 180, prior=lost, told=pretended, sigma=(1e-4, 1e-4, 0.05)
        )
        off[orientation] = off_deg(found, poses)
    assert off["start"][60:].max() < 8.0
    assert off["start"][-20:].max() < 3.0
    assert off["wheels"][-20:].max() > 5.0


@pytest.mark.parametrize("settings", ALL)
def test_a_lever_does_not_spoil_a_heading_that_is_found(settings):
    """The antenna sits off the middle of a robot that does not know where it looks."""
    known = one_antenna(grid_m(0.1, 2.5), RADIUS_M, lever_m=(0.2, 0.1))
    start, lost = (-1.2, -0.6, 0.4), Prior(pose=(0.0, 0.0, -2.0), sigma_m=math.inf, sigma_rad=math.inf)
    poses, found = found_on(settings, start, [AHEAD] * 200, known=known, prior=lost)
    assert off_deg(found, poses)[100:].max() < 8.0
    assert np.hypot(*(found - poses)[100:, :2].T).max() < 0.06
