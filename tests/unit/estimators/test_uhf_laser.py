"""The tracker on UHF and laser: settings, what it makes of aliases, hops and floors, and what it refuses."""

import math
from dataclasses import replace

import numpy as np
import pytest
from shapely.geometry import box

from layoutopt.antennas.uhf_patch import UhfPatch
from layoutopt.estimators import phase_velocity, uhf_laser
from layoutopt.estimators.sensor_model import learn_sensor_model, likelihood
from layoutopt.estimators.targets import TargetKnowledge, TargetObservations
from layoutopt.estimators.uhf_laser import UhfLaser
from layoutopt.estimators.uhf_laser_filter import (
    Matches,
    cloud_at_start,
    moved,
    seeded,
    velocity_log_weight,
    within_reach,
)
from layoutopt.estimators.uhf_laser_heading import UhfLaserHeading
from layoutopt.geometry import covers
from layoutopt.readers.finders import yawed_antennas
from layoutopt.tracking_world import LaserScanner

NAN, INF = math.nan, math.inf
INTERVAL_S = 0.4
WAVE_M = phase_velocity.wavelength_m(920e6)
FLOOR = box(0.2, -3.0, 4.0, 3.0)
FAULTS = {
    "mode": ("", "laser"),
    "particles": (0, -1),
    "matches": (0,),
    "sigma_m": (-0.1, NAN, INF),
    "sigma_per": ("minute",),
    "rho_m2": (0.0, NAN, INF),
    "aliases": ("both",),
    "motion": ("walk",),
    "turn_sigma_rad": (-1.0, NAN),
    "speed_sigma_m_s": (-1.0, INF),
    "fresh_per_s": (-1.0, NAN),
    "fastest_m_s": (0.0, INF),
    "seeded_share": (-0.1, 1.0, NAN),
    "largest_radius_m": (0.0, NAN),
}


def scanner(sigma_m=0.0):
    """Return the scanner of the tests."""
    return LaserScanner(range_sigma_m=sigma_m)


def discs_seen(discs_m):
    """Return exact ranges to discs of a person's size at places, shape (n, 2)."""
    ranges_m = np.full(len(scanner().beam_rad), np.inf)
    cos, sin = np.cos(scanner().beam_rad), np.sin(scanner().beam_rad)
    for x_m, y_m in discs_m:
        along_m = x_m * cos + y_m * sin
        under = 0.22**2 - (x_m**2 + y_m**2 - along_m**2)
        hit = (under >= 0.0) & (along_m > 0.0)
        ranges_m = np.where(hit, np.minimum(ranges_m, along_m - np.sqrt(np.maximum(under, 0.0))), ranges_m)
    return ranges_m


def knowledge(floor=FLOOR):
    """Return what a tracker knows beforehand; strengths fall with the distance, alike in all directions."""
    draws = np.random.Generator(np.random.Philox(3))
    places_m = draws.uniform(-6.0, 6.0, (20_000, 2))
    strength_dbm = -42.0 - 30.0 * np.log10(np.hypot(*places_m.T)) + 2.0 * draws.standard_normal(20_000)
    return TargetKnowledge(
        antennas=yawed_antennas(antenna=UhfPatch(), count=2, yaw_rad=0.8),
        robot_pose=(0.0, 0.0, 0.0),
        floor=floor,
        laser=scanner(),
        phase_bits=12,
        sensor_model=learn_sensor_model(places_m, strength_dbm),
    )


def observed(places_m, others_m=(), hop=False):
    """Return what a robot hears and sees of a target at places, one an instant, beside others that stand."""
    count = len(places_m)
    range_m = np.hypot(*places_m.T)[:, None].repeat(2, axis=1)
    frequency_hz = np.full((count, 2), 920e6)
    if hop:
        frequency_hz[1::2] = 922e6
    return TargetObservations(
        interval_s=INTERVAL_S,
        read_time_s=(np.arange(count)[:, None] + 1.0) * INTERVAL_S + np.zeros(2),
        strength_dbm=-42.0 - 30.0 * np.log10(range_m),
        phase_word=np.floor(2.0 * range_m / WAVE_M % 1.0 * 4096).astype(np.int64),
        frequency_hz=frequency_hz,
        ranges_m=np.array([discs_seen([place_m, *others_m]) for place_m in places_m]),
    )


def away(speed_m_s, count=15):
    """Return places of a target that goes straight away from the robot at an angle, from 1.2 m on."""
    range_m = 1.2 + speed_m_s * INTERVAL_S * np.arange(count)
    return range_m[:, None] * [math.cos(0.5), math.sin(0.5)]


@pytest.mark.parametrize(("name", "value"), [(name, value) for name in FAULTS for value in FAULTS[name]])
def test_settings_out_of_range_are_refused(name, value):
    """By name, with what was given."""
    with pytest.raises(ValueError, match=name) as refused:
        UhfLaser(**{name: value})
    assert str(value) in str(refused.value)


def test_the_papers_functions_are_found_beside_the_tracker():
    """Under the names that others use."""
    for name in ("phase_displacement", "speed_limit", "similarity"):
        assert getattr(uhf_laser, name) is getattr(phase_velocity, name)


def test_a_row_with_other_defaults_is_another_value():
    """Even with the same settings, because it has another name."""
    settings = {
        name: getattr(UhfLaserHeading(), name) for name in ("motion", "aliases", "sigma_m", "seeded_share")
    }
    assert UhfLaser(**settings, steps_unread=True).key != UhfLaserHeading().key


@pytest.mark.parametrize(
    ("aliases", "speed_m_s", "found"),
    [
        ("signed", 0.15, True),
        ("signed", 0.35, False),
        ("two hypotheses", 0.15, True),
        ("two hypotheses", 0.35, True),
        ("three aliases", 0.35, True),
        ("three aliases", 0.55, True),
    ],
)
def test_the_target_is_found_among_people_who_stand_up_to_the_limit_of_its_aliases(aliases, speed_m_s, found):
    """By velocities alone; beyond the limit, where it seems to come nearer, it is not."""
    places_m = away(speed_m_s)
    told = observed(places_m, others_m=[(1.5, -1.5), (2.8, -0.5)])
    tracker = UhfLaser(mode="velocity", aliases=aliases, particles=400, on_floor=False)
    track = tracker.run(knowledge(), told, np.random.default_rng(0))
    error_m = np.hypot(*(track.places_m - places_m).T)[-5:]
    assert (error_m.max() < 0.4) == found


def test_phases_of_two_channels_are_no_pair():
    """A reader that hops between all readings tells no velocity: such a tracker is blind."""
    places_m = away(0.3)
    tracker = UhfLaser(mode="velocity")
    still = tracker.run(knowledge(), observed(places_m, hop=True), np.random.default_rng(0))
    assert still.blind.all()
    assert not tracker.run(knowledge(), observed(places_m), np.random.default_rng(0)).blind[1:].any()


def test_no_step_without_a_reading_leaves_the_estimate_as_it_is():
    """With ``steps_unread`` the estimate goes on moving."""
    told = observed(away(0.3))
    told.strength_dbm[5:9], told.phase_word[5:9] = NAN, -1
    for unread in (False, True):
        track = UhfLaser(steps_unread=unread).run(knowledge(), told, np.random.default_rng(0))
        assert track.blind[5:9].all()
        assert (track.places_m[5:9] == track.places_m[4]).all() != unread


def test_the_filter_of_strengths_is_the_bayesian_answer():
    """One reading: the weighted mean over a fine lattice of the floor is what many particles say."""
    known, told = knowledge(), observed(away(0.0, count=1))
    x_m, y_m = np.meshgrid(np.arange(0.205, 4.0, 0.01), np.arange(-2.995, 3.0, 0.01))
    places_m = np.column_stack([x_m.ravel(), y_m.ravel()])
    weight = np.ones(len(places_m))
    for yaw_rad in known.antennas.poses[:, 3]:
        cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
        weight *= likelihood(
            known.sensor_model, places_m @ np.array([[cos, -sin], [sin, cos]]), told.strength_dbm[0, 0]
        )
    mean_m = weight @ places_m / weight.sum()
    spread_m = np.sqrt((weight @ (places_m - mean_m) ** 2 / weight.sum()).max())
    particles = 40_000
    tracker = UhfLaser(mode="strength", particles=particles, sigma_m=0.0)
    found_m = tracker.run(known, told, np.random.default_rng(0)).places_m[0]
    # Effective particles are at least a twentieth here; six standard errors: a false alarm in 1e8.
    assert np.abs(found_m - mean_m).max() < 6.0 * spread_m / math.sqrt(particles / 20.0)


def test_particles_stay_on_a_floor_with_a_hole_and_start_within_reach():
    """Whatever the step; and on a hall of 200 m they begin where the robot can hear."""
    floor = FLOOR.difference(box(1.5, -1.0, 2.5, 1.0))
    draws = np.random.default_rng(1)
    motion = UhfLaserHeading(sigma_m=1.0).motion_in(INTERVAL_S)
    cloud = cloud_at_start(knowledge(floor), 500, 1.5, draws)
    for _ in range(20):
        before = cloud
        cloud = moved(cloud, motion, draws.standard_normal((4, 500)), draws.random((4, 500)), floor)
        assert covers(floor, cloud[:2].T).all()
        assert (cloud[:2] != before[:2]).any(axis=0).mean() > 0.7
    hall = knowledge(box(-100.0, -100.0, 100.0, 100.0))
    assert within_reach(hall).area < math.pi * 9.0**2
    assert within_reach(knowledge(box(50.0, 50.0, 60.0, 60.0))).area == 100.0


def test_without_a_floor_particles_go_where_they_step():
    """The random walk alone: its spread is that of Eq. 12, within 5.5 standard errors."""
    draws = np.random.default_rng(2)
    cloud = np.zeros((4, 20_000))
    motion = UhfLaser(sigma_m=0.7, on_floor=False).motion_in(INTERVAL_S)
    step_m = moved(cloud, motion, draws.standard_normal((4, 20_000)), draws.random((4, 20_000)), FLOOR)[:2]
    assert np.abs(step_m.std(axis=1) - 0.7).max() < 5.5 * 0.7 / math.sqrt(40_000)


def test_steps_grow_with_the_interval_as_told():
    """Not at all, in proportion, or with its root."""
    sigma_m = {per: UhfLaser(sigma_per=per).motion_in(0.25).sigma_m for per in uhf_laser.SIGMA_UNITS}
    assert sigma_m == {"step": 1.0, "second": 0.25, "root second": 0.5}


def test_velocity_weights_are_eq_13():
    """Near the clusters, in logarithms; and far from all of them no particle has a weight of nought."""
    clusters = Matches(np.array([[1.0, 0.0], [0.0, 1.0]]), np.zeros((2, 2)), np.array([0.9, 0.3]))
    cloud = np.array([[0.9, 0.2, 1e3], [0.1, 0.8, 1e3], [0.0] * 3, [0.0] * 3])
    found = velocity_log_weight(cloud, clusters, 0.05)
    squares = ((cloud[:2, :2].T[:, None] - clusters.centres_m) ** 2).sum(axis=2) / 0.05
    np.testing.assert_allclose(np.exp(found[:2]), (clusters.similarities * np.exp(-0.5 * squares)).sum(axis=1))
    assert np.isfinite(found[2])


def test_seeded_particles_go_to_clusters_in_proportion_to_their_similarity():
    """With the velocity of the cluster; bounds are 5.5 standard errors."""
    draws = np.random.default_rng(4)
    clusters = Matches(
        np.array([[1.0, 0.0], [3.0, 1.0]]), np.array([[0.0, 0.5], [-3.0, 0.0]]), np.array([0.9, 0.3])
    )
    motion, count = UhfLaserHeading().motion_in(INTERVAL_S), 20_000
    cloud = np.full((4, count), 0.25)
    normal, uniform = draws.standard_normal((4, count)), draws.random((4, count))
    found = seeded(cloud, clusters, 0.2, 0.1, normal, uniform, motion, FLOOR)
    first, second = np.abs(found[0] - 1.0) < 0.4, np.abs(found[0] - 3.0) < 0.6
    first &= (found != cloud).all(axis=0)
    for chosen, share in ((first, 0.15), (second, 0.05)):
        assert abs(chosen.mean() - share) < 5.5 * math.sqrt(share / count)
    np.testing.assert_allclose(found[2:, first].T, np.tile([math.pi / 2.0, 0.5], (first.sum(), 1)))
    np.testing.assert_allclose(found[2:, second].T, np.tile([math.pi, 1.5], (second.sum(), 1)))


def test_a_filter_on_the_wrong_person_recovers_only_if_it_is_seeded():
    """All are with somebody who walks as well, but slowly. Small steps do not get away, seeded ones do at once."""
    places_m, errors_m = away(0.3), {}
    others_m = 3.4 / math.hypot(2.8, 1.9) * np.array([2.8, -1.9]) * np.linspace(1.0, 1.1, len(places_m))[:, None]
    told = observed(places_m)
    told.ranges_m[:] = [discs_seen(both_m) for both_m in zip(places_m, others_m, strict=True)]
    for share in (0.0, 0.1):
        tracker = UhfLaserHeading(mode="velocity", seeded_share=share, fastest_m_s=0.1)
        running = tracker.start(knowledge(), np.random.default_rng(0))
        running.cloud[:2], running.cloud[3] = others_m[:1].T, 0.0
        found_m = np.array([running.step(sample).values for sample in told.samples()])
        errors_m[share] = np.hypot(*(found_m - places_m).T)[-8:].mean()
    assert errors_m[0.1] < 0.4
    assert errors_m[0.0] > 1.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"strength_dbm": np.full((3, 2), INF)}, "strength is finite"),
        ({"phase_word": np.full((3, 2), 4096)}, "between 0 and 4095"),
        ({"phase_word": np.full((3, 2), -2)}, "-1 where there is none"),
        ({"strength_dbm": np.zeros((3, 1))}, "column for each antenna"),
        ({"frequency_hz": np.zeros((3, 2))}, "no wavelength"),
        ({"read_time_s": np.ones((3, 2))}, "no later than"),
        ({"ranges_m": np.zeros((3, 5))}, "541 beams"),
    ],
)
def test_readings_that_contradict_each_other_are_refused(changes, message):
    """Each with what is wrong."""
    told = replace(observed(away(0.3, count=3)), **changes)
    with pytest.raises(ValueError, match=message):
        UhfLaser().run(knowledge(), told, np.random.default_rng(0))


def test_long_drives_are_drawn_in_blocks_without_a_seam(monkeypatch):
    """However many random numbers are drawn at once, the track is the same."""
    told = observed(away(0.1, count=12))
    whole = UhfLaser().run(knowledge(), told, np.random.default_rng(0))
    monkeypatch.setattr(uhf_laser, "_NUMBERS_AT_ONCE", 4 * 800)
    np.testing.assert_array_equal(
        UhfLaser().run(knowledge(), told, np.random.default_rng(0)).places_m, whole.places_m
    )
