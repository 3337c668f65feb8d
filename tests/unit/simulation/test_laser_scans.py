"""Scans: known rooms, occlusion by brute force, noise within five standard deviations (false alarms 6e-7)."""

import math
from dataclasses import replace

import numpy as np
import pytest
from tracking_cases import SITE

from layoutopt.simulation.laser import scans
from layoutopt.simulation.ray_casting import plain_cast, walls_of
from layoutopt.streams import Purpose, Streams
from layoutopt.tracking_world import LaserScanner

EXACT = LaserScanner(range_sigma_m=0.0)
NOBODY = np.empty((3, 0, 2))
NOTHING = np.empty((0, 3))


def stream():
    """Return the stream of the scanner in one trial."""
    return Streams(seed=1).generator("tracking", 0, Purpose.LASER)


def test_an_empty_room_is_seen_as_it_is():
    """541 beams; ahead, to both sides and at the ends of the field, from a pose turned by a right angle."""
    seen_m = scans(EXACT, (0.0, 0.0, math.pi / 2), walls_of(SITE), NOTHING, NOBODY, 0.22, stream())
    assert seen_m.shape == (3, 541)
    assert (seen_m == seen_m[0]).all()
    degrees = np.rad2deg(EXACT.beam_rad)
    found = {angle: seen_m[0, np.argmin(np.abs(degrees - angle))] for angle in (-135, -90, 0, 90, 135)}
    expected = {-135: 3.0 * math.sqrt(2.0), -90: 5.0, 0: 3.0, 90: 1.0, 135: math.sqrt(2.0)}
    assert found == pytest.approx(expected, rel=1e-9)


def test_the_nearest_of_walls_things_and_people_is_seen_on_every_beam():
    """Against a plain cast instant by instant, with every person as one more disc."""
    draws = np.random.default_rng(2)
    people_m = draws.uniform((0.5, -2.5), (4.5, 2.5), (20, 3, 2))
    things = np.column_stack([draws.uniform((0.5, -2.5), (4.5, 2.5), (6, 2)), np.full(6, 0.15)])
    pose = (0.2, -0.3, 0.4)
    seen_m = scans(EXACT, pose, walls_of(SITE), things, people_m, 0.22, stream())
    origins_m, angles_rad = np.tile(pose[:2], (541, 1)), pose[2] + EXACT.beam_rad
    for instant, places_m in enumerate(people_m):
        bodies = np.column_stack([places_m, np.full(3, 0.22)])
        expected_m = plain_cast(origins_m, angles_rad, walls_of(SITE), np.concatenate([things, bodies]), 20.0)
        np.testing.assert_allclose(seen_m[instant], expected_m, rtol=1e-12)


def test_a_person_behind_a_thing_is_not_seen_and_one_before_it_is():
    """A thing of 0.3 m at 1.5 m hides somebody at 3 m, and is hidden by somebody at 0.9 m."""
    things = np.array([(1.5, 0.0, 0.3)])
    people_m = np.array([[(3.0, 0.0)], [(0.9, 0.0)]])
    seen_m = scans(EXACT, (0.0, 0.0, 0.0), walls_of(SITE), things, people_m, 0.22, stream())
    alone_m = scans(EXACT, (0.0, 0.0, 0.0), walls_of(SITE), things, NOBODY[:1], 0.22, stream())
    assert (seen_m[0] == alone_m[0]).all()
    assert seen_m[1, 270] == pytest.approx(0.9 - 0.22)
    assert alone_m[0, 270] == pytest.approx(1.5 - 0.3)


def test_noise_has_its_deviation_and_is_independent():
    """Of 400 scans of 541 beams, from beam to beam and from scan to scan."""
    laser = replace(EXACT, range_sigma_m=0.02)
    nobody = np.empty((400, 0, 2))
    noise_m = scans(laser, (1.0, 0.0, 0.3), walls_of(SITE), NOTHING, nobody, 0.22, stream())
    noise_m -= scans(EXACT, (1.0, 0.0, 0.3), walls_of(SITE), NOTHING, nobody[:1], 0.22, stream())
    count = noise_m.size
    assert abs(noise_m.mean()) < 5.0 * 0.02 / math.sqrt(count)
    assert abs(noise_m.var() / 0.02**2 - 1.0) < 5.0 * math.sqrt(2.0 / count)
    for first, second in ((noise_m[1:], noise_m[:-1]), (noise_m[:, 1:], noise_m[:, :-1])):
        assert abs(np.corrcoef(first.ravel(), second.ravel())[0, 1]) < 5.0 / math.sqrt(count)


def test_noise_is_the_same_whoever_walks_and_however_long():
    """Beams that meet a wall with and without a person have the same range; a longer drive begins alike."""
    laser = replace(EXACT, range_sigma_m=0.02)
    person_m = np.tile((2.0, 0.0), (5, 1, 1))
    empty_m = scans(laser, (0.0, 0.0, 0.0), walls_of(SITE), NOTHING, np.empty((5, 0, 2)), 0.22, stream())
    seen_m = scans(laser, (0.0, 0.0, 0.0), walls_of(SITE), NOTHING, person_m, 0.22, stream())
    short_m = scans(laser, (0.0, 0.0, 0.0), walls_of(SITE), NOTHING, person_m[:2], 0.22, stream())
    behind = np.abs(LaserScanner().beam_rad) > 0.2
    assert (seen_m[:, behind] == empty_m[:, behind]).all()
    assert (seen_m[:, 270] < empty_m[:, 270]).all()
    assert (short_m == seen_m[:2]).all()


def test_no_range_is_negative_or_beyond_the_scanner():
    """A body at the scanner, a wall at the edge of the range, and noise of half a metre."""
    laser = LaserScanner(range_m=3.0, range_sigma_m=0.5)
    person_m = np.tile((0.25, 0.0), (50, 1, 1))
    seen_m = scans(laser, (0.0, 0.0, 0.0), walls_of(SITE), NOTHING, person_m, 0.22, stream())
    assert (seen_m >= 0.0).all()
    assert (seen_m == 0.0).any()
    assert (seen_m[np.isfinite(seen_m)] <= 3.0).all()
    assert np.isinf(seen_m).any()


def test_people_that_are_nowhere_are_refused():
    """A NaN, and a row too few."""
    with pytest.raises(ValueError, match="every person must be somewhere"):
        scans(EXACT, (0.0, 0.0, 0.0), walls_of(SITE), NOTHING, np.full((2, 1, 2), math.nan), 0.22, stream())
    with pytest.raises(ValueError, match=r"needed is \(n, people, 2\)"):
        scans(EXACT, (0.0, 0.0, 0.0), walls_of(SITE), NOTHING, np.zeros((2, 2)), 0.22, stream())
