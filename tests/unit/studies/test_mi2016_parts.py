"""Parts of the mi2016 study: its printed numbers, its setting, the filters of Eq. 1, and the fit."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from layoutopt.estimators.odometry import OdometryAlone
from layoutopt.protocols import Evaluation
from layoutopt.scenario import Faults
from layoutopt.scores import TrialOutcomes
from layoutopt.simulation.trials import knowledge_of, record_trial
from layoutopt.streams import Streams
from studies.published import mi2016_cells, mi2016_real, mi2016_tour
from studies.published import mi2016_setting as setting
from studies.published.floor_frame import FloorFrame
from studies.published.mi2016_cells import FULL, QUICK
from studies.published.mi2016_printed import REAL, SIMULATED, TABLE_3, TABLE_4, TABLE_5
from studies.published.timed_noise import TimedNoise

STREAMS = Streams(seed=11)


def test_printed_numbers_are_those_of_the_paper():
    """Rows, order and units of Tables 2 to 6; the heading in milliradians."""
    assert [len(rows) for rows in (*SIMULATED.values(), *REAL.values(), TABLE_3)] == [8, 8, 4, 4, 2]
    row = TABLE_4[3]
    assert row.labels == ("8", "100", "combination")
    assert row.mean == (4.4, 3.1, 14)
    assert row.max == (18.3, 16.1, 86)
    assert row.variance == (14.3, 6.8, 0)
    assert TABLE_5[3].max == (2699.0, 820.2, 248)
    assert TABLE_3[0].variance == (737.8, 750.6, 211)


@pytest.mark.parametrize(("readers", "radius_m"), [(96, 0.009), (24, 0.030), (20, 0.030), (8, 0.030)])
def test_arrays_read_the_discs_of_the_paper(readers, radius_m):
    """The sphere of Eq. 5 cuts the floor in 9 mm with 96 readers and 30 mm with the larger antennas."""
    layout = setting.layout(readers, 100)
    knowledge = knowledge_of(layout, setting.scenario(), setting.particle_filter("gaussian"))
    assert len(knowledge.antennas) == readers
    assert knowledge.antennas.radius_m == pytest.approx(radius_m, abs=1e-9)


def test_the_real_eight_hang_lower():
    """At 15 mm the disc has a radius of 28.6 mm."""
    row = REAL["6"][0]
    cell = mi2016_tour.cell(row, COMMON, CARPETS[100], name="test", trials=1)
    knowledge = knowledge_of(cell.layout, cell.scenario, cell.estimator)
    assert knowledge.antennas.radius_m == pytest.approx(0.0286, abs=5e-5)


@pytest.mark.parametrize("odometry", [setting.odometry_by_time, setting.odometry_by_way])
def test_noise_of_a_step_is_that_of_eq_1(odometry):
    """30 mm/s and 0.05 rad/s over 50 ms are 1.5 mm and 2.5 mrad at 100 mm/s, whichever way they grow."""
    sigma = odometry(*setting.NOISE).sigma(np.array([[0.005, 0.0, 0.0]]), setting.STEP_S)
    assert sigma[0] == pytest.approx([0.0015, 0.0015, 0.0025])


def test_other_arrays_keep_their_numbers():
    """The other readings of the lost figures have as many antennas, none at the same place as another."""
    for readers in (8, 96):
        poses = setting.other_array(readers).poses[:, :2]
        assert len(poses) == readers
        assert len(np.unique(np.round(poses, 6), axis=0)) == readers


def test_every_phase_of_every_lattice_is_as_likely():
    """The spread of places, one metre in all, is a multiple of every pitch."""
    for tags_per_m2 in setting.DENSITIES:
        pitches = 2.0 * setting.HALF_METRE * math.sqrt(tags_per_m2)
        assert pitches == pytest.approx(round(pitches))


def record(estimator, **changes):
    scenario = setting.scenario(duration_s=5.0, **changes)
    return record_trial(setting.layout(8, 100), scenario, estimator, STREAMS, 0)


def test_the_noise_by_the_clock_replaces_the_odometrys_own():
    """With the deviations that the odometry has anyway, nothing changes; with others, the estimates do."""
    inner = setting.particle_filter("combination")
    plain = record(inner).trajectory.poses
    translation_m_s, rotation_rad_s = setting.NOISE
    same = TimedNoise(inner=inner, translation_m_s=translation_m_s, rotation_rad_s=rotation_rad_s)
    assert record(same).trajectory.poses == pytest.approx(plain, abs=1e-6)
    other = replace(same, translation_m_s=0.001)
    assert np.abs(record(other).trajectory.poses - plain).max() > 1e-4
    with pytest.raises(ValueError, match="must not be negative"):
        replace(same, translation_m_s=-1.0)


def test_the_step_by_step_form_is_told_the_same_noise():
    """The plain twin of a filter gets the deviations of Eq. 1 in every step."""
    told = []

    class Listening:
        def step(self, motion, readings):
            told.append(motion.sigma)

    class Inner(OdometryAlone):
        def start(self, prior, knowledge, draws):
            return Listening()

    found = record(OdometryAlone())
    estimator = TimedNoise(inner=Inner(), translation_m_s=0.02, rotation_rad_s=0.03)
    running = estimator.start(None, None, np.random.default_rng(0))
    for motion, readings in found.observations.steps():
        running.step(motion, readings)
    assert len(set(told)) == 1
    assert told[0] == pytest.approx((0.001, 0.001, 0.0015))


def test_in_the_floor_frame_a_wrong_heading_leads_nowhere_else():
    """Told a start that is wrong by a quarter turn, dead reckoning keeps its error in the floor frame.

    In the robot's frame it drives off at a right angle.
    """
    routes = replace(setting.CIRCLE, heading_rad=0.0)
    faults = Faults(start_offset=(0.1, 0.0, math.pi / 2.0))
    errors = []
    for estimator in (FloorFrame(inner=OdometryAlone()), OdometryAlone()):
        found = record(estimator, odometry=setting.EXACT, routes=routes, faults=faults)
        off_m = found.trajectory.poses[:, :2] - found.drive.poses[1:, :2]
        errors.append(np.abs(off_m - [0.1, 0.0]).max())
    assert errors[0] == pytest.approx(0.0, abs=1e-9)
    assert errors[1] > 0.3


def test_the_two_frames_agree_where_the_heading_is_right():
    """With a start known rightly the filter is about as accurate in either frame: both stay within 2 cm."""
    routes = replace(setting.CIRCLE, heading_rad=0.0)
    inner = setting.particle_filter("combination")
    for estimator in (inner, FloorFrame(inner=inner)):
        found = record(estimator, routes=routes)
        off_m = np.hypot(*(found.trajectory.poses - found.drive.poses[1:])[:, :2].T)
        assert off_m.mean() < 0.02


def test_whole_drives_only_in_the_floor_frame():
    """Step by step the velocity over the floor is not to be had."""
    with pytest.raises(ValueError, match="whole drive"):
        FloorFrame(inner=OdometryAlone()).start(None, None, np.random.default_rng(0))


def test_cells_of_the_study():
    """All cells of the tables and changes are there, and what is compared meets the same random numbers."""
    assert len(mi2016_cells.table_cells(FULL)) == 4 * 4 * 2
    changed = mi2016_cells.changed_cells(FULL)
    assert len(changed) == 4 * (1 + len(mi2016_cells.change_names()))
    assert {cell.scenario.name for cell in mi2016_cells.all_cells(FULL)} == {"mi2016"}
    keys = [cell.group for cell in changed.values()]
    assert len(set(keys)) == len(keys)
    assert all(cell.trials >= 24 for cell in mi2016_cells.table_cells(FULL).values())


COMMON = mi2016_tour.Common(sigma_m=0.015, missed=0.3)
CARPETS = {
    100: mi2016_tour.Carpet(place="over tags", offset_m=(0.004, 0.020)),
    16: mi2016_tour.Carpet(place="anywhere", offset_m=(0.008, 0.005)),
}


def invented(task):
    """Return outcomes as a robot would give them whose faults are COMMON and CARPETS: printed times a miss."""
    tags = round(task.layout.floor_tags.base.pattern.density_per_m2)
    row = next(row for row in mi2016_real.FITTED if row.tags_per_m2 == tags)
    faults, carpet = task.scenario.faults, CARPETS[tags]
    place = "anywhere" if task.scenario.routes.centre_spread_m else "over tags"
    miss = (
        abs(faults.tag_placement_sigma_m - COMMON.sigma_m) * 20.0
        + abs(faults.missed_read_share - COMMON.missed)
        + abs(faults.tag_offset_m[0] - carpet.offset_m[0]) * 20.0
        + abs(faults.tag_offset_m[1] - carpet.offset_m[1]) * 20.0
        + (0.0 if place == carpet.place else 0.5)
    )
    means = np.array([row.mean[0] / 1e3, row.mean[1] / 1e3, row.mean[2] / 1e3]) * math.exp(miss)
    variances = np.array(row.variance[:2]) / 1e6
    columns = (*(f"{axis}_error_mean" for axis in ("x", "y", "heading")), "x_error_variance", "y_error_variance")
    values = np.tile(np.concatenate([means, variances]), (task.count, 1))
    replications = np.arange(task.first, task.first + task.count)
    outcomes = TrialOutcomes(replications=replications, columns=columns, values=values)
    return Evaluation(group=task.group, first=task.first, outcomes=outcomes, seconds=0.0)


def test_the_fit_finds_the_faults_that_made_the_numbers(monkeypatch):
    """From outcomes that are the printed ones for one set of faults and worse for all others, that set is found.

    Its offset lies on no point of the first grid, so the second round must have refined it.
    """
    # Each round makes the cells of all rounds before it again, which here would take most of the time.
    monkeypatch.setattr(mi2016_real, "cell", cache(mi2016_real.cell))
    effort = replace(FULL, fit=(1, 1, 2), real=1, spread=1)
    evaluations = []
    names = []
    while tasks := (batch := mi2016_real.next_round(evaluations, effort)).tasks:
        names.append(batch.name)
        evaluations += [invented(task) for task in tasks]
    fit = mi2016_real.best_fit(evaluations, effort)
    assert fit.common == COMMON
    assert fit.carpets == CARPETS
    assert fit.loss == pytest.approx(0.0, abs=1e-9)
    assert [name.rpartition(": ")[2] for name in names] == [
        "grid",
        "finer offsets",
        "best candidates",
        "real robot, predictions",
    ]
    assert mi2016_real.best_fit(evaluations[:100], effort) is None


def test_the_loss_counts_factors_alike():
    """Half and double of a printed mean cost the same; a variance counts as its root does."""
    row = mi2016_real.FITTED[0]
    task_like = dict(x=row.mean[0] / 1e3, y=row.mean[1] / 1e3, heading=row.mean[2] / 1e3)
    exact = [*task_like.values(), row.variance[0] / 1e6, row.variance[1] / 1e6]

    def loss(values):
        columns = (
            *(f"{axis}_error_mean" for axis in ("x", "y", "heading")),
            *(f"{axis}_error_variance" for axis in ("x", "y")),
        )
        table = TrialOutcomes(replications=np.arange(1), columns=columns, values=np.array([values]))
        return mi2016_real.loss(row, table)

    assert loss(exact) == pytest.approx(0.0, abs=1e-12)
    doubled, halved, wider = ([*exact] for _ in range(3))
    doubled[0] *= 2.0
    halved[0] /= 2.0
    wider[3] *= 4.0
    assert loss(doubled) == pytest.approx(math.log(2.0) ** 2)
    assert loss(halved) == pytest.approx(loss(doubled))
    assert loss(wider) == pytest.approx(loss(doubled))


def test_the_quick_study_is_small():
    """A quick run has few trials, and every one of its parts."""
    assert sum(cell.trials for cell in mi2016_cells.all_cells(QUICK)) < 400
    assert len(list(mi2016_real.plan_cells(QUICK))) < 150
