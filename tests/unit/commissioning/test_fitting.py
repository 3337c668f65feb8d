"""Fitted values: with and without truth, and as tables that a spec reads."""

import dataclasses
import tomllib

import numpy as np
import pytest

from layoutopt.commissioning import evidence_fit
from layoutopt.commissioning.drive_log import write_log
from layoutopt.commissioning.evidence_fit import fit_scale
from layoutopt.commissioning.fitting import VALUES, fit_drive, write_fitted
from layoutopt.commissioning.log_reading import read_log
from layoutopt.commissioning.output import PATH_COLUMNS, replay_lines, write_replay
from layoutopt.commissioning.replay import estimator_of, pose_in, replay_log
from layoutopt.errors import InvalidInput
from layoutopt.estimators.mcl import MonteCarloLocalisation
from layoutopt.estimators.midrange import Midrange
from layoutopt.estimators.odometry import OdometryAlone
from layoutopt.robot import Odometry
from layoutopt.simulation.motion import integrate
from layoutopt.spec.layout_file import read_layout
from layoutopt.spec.reading import read_spec

POOR = Odometry(translation_share=0.04, lateral_share=0.01, rotation_rad_per_m=2.0 * Odometry().rotation_rad_per_m)
"""Twice the noise that the tiny spec assumes."""


@pytest.fixture(scope="module")
def replayed(tiny, driven, tmp_path_factory):
    spec, layouts = tiny

    def of(estimator, truth=True, start=False, spec=spec, **given):
        path = tmp_path_factory.mktemp("log") / "drive.csv"
        tag_map = layouts[0].floor_tags.lay_on(spec.site)
        record = driven(0, **given)
        write_log(path, record, layout=layouts[0], tag_map=tag_map)
        log = read_log(path, layout=layouts[0], tag_map=tag_map, robot=spec.robot)
        if not truth:
            log = dataclasses.replace(log, truth=np.empty((0, 3)), truth_time_s=np.empty(0))
        pose = tuple(record.drive.poses[0]) if start else None
        return replay_log(log, spec, layouts[0], estimator, seed=2, start=pose)

    return of


def test_a_replay_is_the_simulated_trial(driven, replayed):
    """An estimator that adds up odometry makes the same path of the log as of the drive itself."""
    found, record = replayed(OdometryAlone()), driven(0)
    path = integrate(record.drive.poses[0], record.observations.increments)[1:]
    assert found.with_truth
    assert found.trajectory.poses[:, :2] == pytest.approx(path[:, :2], abs=1e-6)
    error_m = np.linalg.norm(path[:, :2] - record.drive.poses[1:, :2], axis=1)
    assert found.position_error_m == pytest.approx(error_m, abs=1e-6)


def test_an_unknown_start_is_found_from_the_reads(replayed):
    """Without truth and start the filter is lost at first and then within centimetres of the true path."""
    known = replayed(MonteCarloLocalisation())
    found = replayed(MonteCarloLocalisation(), truth=False)
    assert np.isinf(found.prior.sigma_m)
    assert found.lost[0]
    away_m = np.linalg.norm(found.trajectory.poses[-400:, :2] - known.drive.truth[-400:, :2], axis=1)
    assert away_m.mean() < 0.03


def test_dead_reckoning_needs_a_start_and_says_so(replayed):
    """The message says how to give one; the midrange finds its start from the reads."""
    with pytest.raises(InvalidInput, match="--start"):
        replayed(OdometryAlone(), truth=False)
    assert np.isfinite(replayed(Midrange(), truth=False).trajectory.poses).all()


def test_an_estimator_that_gives_no_pose_is_refused(replayed, monkeypatch):
    """Steps without a pose are counted in the message, which says how to give a start."""
    plain = Midrange.run

    def broken(self, prior, knowledge, observations, draws):
        trajectory = plain(self, prior, knowledge, observations, draws)
        trajectory.poses[:7] = np.nan
        return trajectory

    monkeypatch.setattr(Midrange, "run", broken)
    with pytest.raises(InvalidInput, match=r"'midrange' gives no pose in 7 of"):
        replayed(Midrange(), truth=False)


@pytest.mark.parametrize("text", ["1, 2", "1, 2, 3, 4", "a, 2, 3", "1 kg, 2, 3", "1, 2, nan", "", "1,2,inf"])
def test_a_start_that_is_no_pose_is_refused(text):
    """Three finite numbers with fitting units or none make a pose, and nothing else does."""
    with pytest.raises(InvalidInput, match="X, Y, HEADING"):
        pose_in(text)


def test_the_scale_of_odometry_is_found_without_truth(replayed):
    """Noise twice that of the layout file lies within the 95 % interval of this drive, and once does not."""
    fit = fit_scale(replayed(MonteCarloLocalisation(), truth=False, start=True, odometry=POOR), 0.0)
    fitted = fit.terms["translation_share"]
    assert fitted.low < POOR.translation_share < fitted.high
    assert fitted.low > Odometry().translation_share
    ratio = fit.terms["rotation_rad_per_m"].value / fitted.value
    assert ratio == pytest.approx(POOR.rotation_rad_per_m / POOR.translation_share)


def test_all_noise_of_the_layout_file_is_scaled(tiny, replayed):
    """Noise over time moves by the same factor as noise over the way."""
    robot = dataclasses.replace(tiny[0].robot, odometry=Odometry(translation_m_per_sqrt_s=0.004))
    found = replayed(
        MonteCarloLocalisation(),
        truth=False,
        start=True,
        spec=dataclasses.replace(tiny[0], robot=robot),
        steps=600,
    )
    terms = fit_scale(found, 0.0).terms
    assert terms["translation_m_per_sqrt_s"].value / 0.004 == pytest.approx(
        terms["translation_share"].value / 0.02
    )
    assert "rotation_rad_per_sqrt_s" not in terms


def test_a_truth_in_a_few_steps_does_not_stand_in_for_the_path(replayed):
    """With the truth of one second the errors are told, and the noise is fitted from the reads."""
    full = replayed(MonteCarloLocalisation(), steps=600)
    log = dataclasses.replace(full.log, truth=full.log.truth[:20], truth_time_s=full.log.truth_time_s[:20])
    found = replay_log(log, full.spec, full.layout, MonteCarloLocalisation(), seed=2)
    assert not found.with_truth
    assert any("position error" in line for line in replay_lines(found, fit_drive(found)))


@pytest.mark.parametrize(
    ("estimator", "reason"),
    [(OdometryAlone(), "no scale of motion noise"), (Midrange(), "no scale of motion noise")],
)
def test_estimators_without_evidence_fit_no_noise(replayed, estimator, reason):
    """Only the path is estimated, and the note says why."""
    fit = fit_scale(replayed(estimator, truth=False, start=True), 0.0)
    assert not fit.terms
    assert reason in fit.notes[0]


def test_a_long_drive_is_cut_for_the_scale(monkeypatch, replayed):
    """More steps than are used are told."""
    monkeypatch.setattr(evidence_fit, "MOST_STEPS", 400)
    fit = fit_scale(replayed(MonteCarloLocalisation(), truth=False, start=True), 0.0)
    assert any("400 steps were used, from step 1" in note for note in fit.notes)


@pytest.mark.parametrize("truth", [True, False])
def test_fitted_values_are_read_by_a_spec(tmp_path, tiny, tiny_text, replayed, truth):
    """The tables, put into a spec without its own, and the layout file read back to the fitted values."""
    found = replayed(
        MonteCarloLocalisation(),
        truth=truth,
        steps=2000,
        odometry=POOR,
        missed_read_share=0.05,
        tag_placement_sigma_m=0.003,
    )
    fit = fit_drive(found)
    write_fitted(found, fit, tmp_path / "fitted.toml")
    fragment = (tmp_path / "fitted.toml").read_text(encoding="utf-8")
    assert tomllib.loads(fragment)
    (tmp_path / "pasted.toml").write_text(tiny_text + fragment, encoding="utf-8")
    pasted = read_spec(tmp_path / "pasted.toml")
    wanted = fit.spec(found.spec)
    assert pasted.robot == wanted.robot
    assert pasted.study.design_faults == wanted.study.design_faults
    for name, fitted in fit.written.items():
        place = pasted.robot.odometry if VALUES[name].table == "odometry" else pasted.study.design_faults
        assert getattr(place, name) == pytest.approx(fitted.value, rel=1e-3)
    assert {"translation_share", "missed_read_share"} <= set(fit.written)
    write_replay(found, fit, tmp_path / "out")
    spec, layout = read_layout(tmp_path / "out" / "fitted_layout.toml")
    assert layout == found.layout
    assert spec.robot == wanted.robot


def test_the_path_is_written_with_gaps_where_nothing_is_known(tmp_path, replayed):
    """A row a step; without truth and stated deviation those cells are empty."""
    found = replayed(OdometryAlone(), truth=False, start=True)
    write_replay(found, fit_drive(found), tmp_path)
    lines = (tmp_path / "path.csv").read_text().splitlines()
    assert lines[0] == ",".join(PATH_COLUMNS)
    assert len(lines) == 1 + len(found.drive.observations)
    cells = lines[-1].split(",")
    assert cells[4:6] == ["", ""]
    assert cells[7:] == [""] * 5
    assert float(cells[1]) == pytest.approx(found.trajectory.poses[-1, 0], abs=1e-6)


def test_every_change_and_every_gap_is_told(replayed):
    """The lines for the terminal hold all notes, the errors against the truth and each fitted value."""
    found = replayed(MonteCarloLocalisation())
    fit = fit_drive(found)
    text = "\n".join(replay_lines(found, fit))
    assert all(note in text for note in (*found.notes, *fit.notes))
    assert "position error: mean" in text
    assert all(VALUES[name].key in text for name in fit.written)


def test_a_fused_gyro_is_not_fused_twice(tiny, replayed):
    """Once the fused turn is fitted, the robot written no longer adds its gyro to it."""
    spec = dataclasses.replace(tiny[0], robot=dataclasses.replace(tiny[0].robot, gyro_fitted=True))
    found = replayed(OdometryAlone(), spec=spec)
    assert not fit_drive(found).spec(spec).robot.gyro_fitted


def test_estimators_get_the_particles_of_the_spec(tiny):
    """An estimator with particles takes the spec's number, and one without is made as it is."""
    assert estimator_of("mcl", tiny[0]).particles == 200
    assert estimator_of("midrange", tiny[0]) == Midrange()
