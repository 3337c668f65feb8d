"""The accuracy of mi2016 comes out of the whole loop of drive, sensing and filter.

The paper leaves its route and reader coordinates open, so this is no exact reproduction: a circle of 0.5 m at
0.1 m/s, reconstructed coordinates, 60 s, known start, odometry noise of 1.5 mm and 2.5 mrad a step of 5 mm.
"""

import numpy as np
import pytest
from shapely.geometry import box

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.estimators.mcl import MonteCarloLocalisation
from layoutopt.estimators.odometry import OdometryAlone
from layoutopt.layout import FloorTags, Layout, ReaderProfile, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.protocols import Mount
from layoutopt.readers.mi2016 import eight
from layoutopt.readings import Prior
from layoutopt.robot import Odometry, Robot
from layoutopt.scenario import Judgement, Role, Routes, Scenario
from layoutopt.scores import paired_difference
from layoutopt.simulation.trials import knowledge_of, record_trial, run_trials
from layoutopt.site import Site
from layoutopt.streams import Streams

# Standard deviations after 1 m; a step of 5 mm has 0.0707 of them: 1.5 mm, 1.5 mm and 2.5 mrad.
ODOMETRY = Odometry(translation_share=0.0212, lateral_share=0.0212, rotation_rad_per_m=0.0354, half_track_m=0.0)
WORLD = Scenario(
    name="mi2016",
    role=Role.DESIGN,
    site=Site(name="laboratory", floor=box(-2.0, -2.0, 2.0, 2.0)),
    robot=Robot(
        outline_m=np.array([(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3)]), odometry=ODOMETRY, speed_m_s=0.1
    ),
    routes=Routes(kind="circle", circle_radius_m=0.5),
    judgement=Judgement(settle_s=0.0),
    start_sigma_m=0.0,
    start_sigma_rad=0.0,
)
PAPER = {
    (100, "combination"): (0.0044, 0.0031, 0.014),
    (100, "gaussian"): (0.0052, 0.0031, 0.012),
    (16, "combination"): (0.0062, 0.0049, 0.019),
    (16, "gaussian"): (0.0067, 0.0050, 0.015),
}
"""Table 4: mean errors in x (m), y (m) and heading (rad) by tags a square metre and likelihood."""
AXES = ("x_error_mean", "y_error_mean", "heading_error_mean")


def layout(tags_per_m2):
    mount = Mount(
        antenna=SphereAntenna(side_m=0.06),
        height_m=0.024,
        profile=ReaderProfile(name="mi2016", scan_period_s=0.05, tags_per_scan="several"),
    )
    pattern = square(pitch_m=tags_per_m2**-0.5)
    return Layout(
        floor_tags=FloorTags(zones=(ZonePattern(zone="", pattern=pattern, origin_m=(0.013, 0.007)),)),
        readers=(eight(mount=mount),),
    )


def outcomes(tags_per_m2, likelihood, count=12):
    estimator = MonteCarloLocalisation(likelihood=likelihood)
    return run_trials(layout(tags_per_m2), WORLD, estimator, Streams(seed=2016), 0, count)


@pytest.mark.parametrize(("tags_per_m2", "factor"), [(100, 1.5), (16, 2.0)])
def test_errors_are_those_of_the_paper(tags_per_m2, factor):
    """Mean errors of the combination likelihood lie within a factor of Table 4: 1.5 at 100 tags, 2 at 16.

    The mean of 12 drives has a standard error of 0.1 mm in x and y at 100 tags and 0.3 mm at 16 (heading 0.5
    and 1 mrad); the nearest limit is at least four of them away, so fewer than one seed in 10,000 would fail.
    """
    found = outcomes(tags_per_m2, "combination")
    for axis, paper in zip(AXES, PAPER[tags_per_m2, "combination"], strict=True):
        assert paper / factor < found.column(axis).mean() < paper * factor, axis
    assert found.column("lost_share").max() == 0.0


def test_the_combination_beats_the_gaussian():
    """At 100 tags the combination is better in x and y, on the same drives.

    The paired difference is 1.1 mm with a standard error below 0.1 mm; asked is a mean below zero by five of
    them, false alarm below one in a million.
    """
    combination, gaussian = outcomes(100, "combination"), outcomes(100, "gaussian")
    for axis in AXES[:2]:
        difference = paired_difference(combination, gaussian, axis)
        assert difference.value + 5.0 * difference.standard_error < 0.0


def test_more_tags_are_better_and_any_beat_odometry():
    """Mean position error: 100 tags below 16 tags below odometry alone (two- and fivefold in truth)."""
    dense, sparse = (outcomes(tags, "combination").score("position_error_mean").value for tags in (100, 16))
    blind = run_trials(layout(16), WORLD, OdometryAlone(), Streams(seed=2016), 0, 12)
    assert 1.4 * dense < sparse < blind.score("position_error_mean").value / 2.0


def test_the_filter_states_its_error_about_right():
    """NEES over its expectation is 0.75 at 100 tags; by a factor of two off either way it would say nothing."""
    nees = outcomes(100, "combination").score("nees")
    assert 0.5 < nees.value < 2.0
    assert np.isfinite(nees.standard_error)


@pytest.mark.parametrize("reinitialise", [True, False])
def test_reinitialisation_recovers_from_a_wrong_start(reinitialise):
    """From a start 165 and 153 mm and 1.5 rad off, sure of itself, the filter finds back only by starting
    particles anew: within 5 s in every drive then, and without it in less than half of them within 60 s.

    Of 12 drives with other seeds all recovered within 0.3 s with, and one of 12 without re-initialisation.
    """
    proposal = layout(100)
    estimator = MonteCarloLocalisation(reinitialise=reinitialise)
    knowledge = knowledge_of(proposal, WORLD, estimator)
    recovered = []
    for replication in range(8):
        record = record_trial(proposal, WORLD, OdometryAlone(), Streams(seed=2016), replication)
        x_m, y_m, heading_rad = record.drive.poses[0]
        wrong = Prior(pose=(x_m + 0.165, y_m + 0.153, heading_rad + 1.5), sigma_m=0.0, sigma_rad=0.0)
        run = estimator.run(wrong, knowledge, record.observations, np.random.default_rng(replication))
        off_m = np.hypot(*(run.poses - record.drive.poses[1:])[:, :2].T)
        recovered.append(off_m[100:].max() < 0.05 if reinitialise else off_m.min() < 0.03)
    assert all(recovered) if reinitialise else sum(recovered) < 4
