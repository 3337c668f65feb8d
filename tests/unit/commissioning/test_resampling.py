"""Logs on the time step of a layout: nothing is lost on the way, and what is changed is told."""

import dataclasses

import numpy as np
import pytest

from layoutopt.commissioning.drive_log import DriveLog
from layoutopt.commissioning.resampling import resampled
from layoutopt.detection import antennas_of
from layoutopt.errors import InvalidInput
from layoutopt.simulation.motion import integrate


def made(time_s, poses, **given):
    """Return a log of that path; reads as (time, antenna, tag)."""
    reads = np.array(given.pop("reads", []), dtype=float).reshape(-1, 3)
    scans = given.pop("scans", None)
    scan_columns = (
        {}
        if scans is None
        else dict(zip(("scan_time_s", "scan_antenna"), np.array(scans, dtype=float).T, strict=True))
    )
    if scan_columns:
        scan_columns["scan_antenna"] = scan_columns["scan_antenna"].astype(np.int64)
    return DriveLog(
        **{
            "file": "drive.csv",
            "time_s": np.asarray(time_s, dtype=float),
            "poses": np.asarray(poses, dtype=float),
            "jumps": np.empty(0, dtype=np.int64),
            "gyro_rad": None,
            "read_time_s": reads[:, 0],
            "read_antenna": reads[:, 1].astype(np.int64),
            "read_tag": reads[:, 2].astype(np.int64),
            "scan_time_s": None,
            "scan_antenna": None,
            "truth_time_s": np.empty(0),
            "truth": np.empty((0, 3)),
            **scan_columns,
            **given,
        }
    )


@pytest.fixture
def on_steps(tiny):
    spec, layouts = tiny

    def of(log, number=0):
        return resampled(log, spec, antennas_of(layouts[number], spec.study.step_s))

    return of


@pytest.mark.parametrize("rate_hz", [7.0, 20.0, 90.0])
def test_the_way_is_kept_at_any_rate(on_steps, rate_hz):
    """Steps of 50 ms lead along the logged path from its first to its last pose."""
    time_s = 100.0 + np.arange(0.0, 10.0, 1.0 / rate_hz)
    angle = 0.2 * (time_s - 100.0)
    poses = np.stack([np.sin(angle), 1.0 - np.cos(angle), angle], axis=1)
    drive = on_steps(made(time_s, poses))
    path = integrate(poses[0], drive.observations.increments)
    assert path[-1] == pytest.approx(poses[-1], abs=1e-9)
    assert np.hypot(path[:, 0], path[:, 1] - 1.0) == pytest.approx(1.0, abs=1e-3)


def test_irregular_rows_and_gaps_are_told(on_steps):
    """The note says how far apart the rows are, and how many gaps were bridged."""
    drive = on_steps(made([0.0, 0.02, 0.1, 3.0], np.zeros((4, 3))))
    assert "20 to 2900 ms apart" in drive.notes[0]
    assert "1 gaps of over 1 s" in drive.notes[0]


def test_reads_go_to_the_step_in_which_they_fall(on_steps):
    """A step holds its end and not its beginning; repeats count once, and reads outside are told."""
    reads = [(0.0, 0, 5), (0.05, 0, 6), (0.0501, 0, 7), (0.1, 0, 7), (0.1, 0, 7), (-1.0, 0, 8), (9.0, 0, 8)]
    drive = on_steps(made([0.0, 0.1], np.zeros((2, 3)), reads=reads))
    assert drive.observations.read_start.tolist() == [0, 2, 3]
    assert drive.observations.read_tag.tolist() == [5, 6, 7]
    assert any(note.startswith("2 reads before or after") for note in drive.notes)
    assert any(note.startswith("2 reads of a tag by the same antenna") for note in drive.notes)


def test_turns_of_antennas_are_taken_from_their_reads(on_steps):
    """A recording that began within a scan cycle shifts all turns, and the note says so."""
    time_s = np.arange(0.0, 5.0, 0.05)
    # Layout 9 has modules of four antennas, so that each scans in every fourth step; here all are one step late.
    reads = [(0.05 * (step + 1), (step - 1) % 4, 3) for step in range(60)]
    drive = on_steps(made(time_s, np.zeros((len(time_s), 3)), reads=reads), 9)
    assert drive.steady.all()
    assert any("4 of 4 antennas read in other steps" in note for note in drive.notes)
    assert drive.observations.active[1:61].argmax(axis=1).tolist() == [step % 4 for step in range(60)]


def test_antennas_without_a_fixed_turn_are_told(on_steps):
    """Where reads keep to no turn it is not known when an antenna scanned in vain."""
    time_s = np.arange(0.0, 5.0, 0.05)
    reads = [(0.05 * (step + 1), 0, 3) for step in range(0, 60, 3)]
    drive = on_steps(made(time_s, np.zeros((len(time_s), 3)), reads=reads), 9)
    assert drive.steady.tolist() == [False, True, True, True]
    assert any("1 of 4 antennas keep no fixed turn" in note for note in drive.notes)


def test_scans_in_the_log_say_who_scanned(on_steps):
    """With scans nothing is guessed."""
    drive = on_steps(made([0.0, 0.1, 0.2], np.zeros((3, 3)), scans=[(0.05, 2), (0.15, 1)], reads=[(0.2, 3, 4)]), 9)
    assert np.argwhere(drive.observations.active).tolist() == [[0, 2], [2, 1], [3, 3]]


def test_truth_is_not_made_up(on_steps):
    """Outside the truth, and in its long gaps, the true pose is unknown."""
    log = made(
        np.arange(0.0, 6.0, 0.5),
        np.zeros((12, 3)),
        truth_time_s=np.array([1.0, 1.5, 4.0]),
        truth=np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]),
    )
    drive = on_steps(log)
    known = drive.time_s[np.isfinite(drive.truth[:, 0])]
    assert known.min() == pytest.approx(1.0)
    assert known[known < 2.0].max() == pytest.approx(1.5)
    assert known[known > 2.0] == pytest.approx([4.0])
    assert drive.truth[24, 0] == pytest.approx(0.5)


def test_a_drive_of_a_year_is_refused(on_steps):
    """Time stamps in another unit end in a message and not in a table without end."""
    with pytest.raises(InvalidInput, match="Check the unit of time_s"):
        on_steps(made([0.0, 3e7], np.zeros((2, 3))))


def test_a_fused_gyro_lowers_the_stated_error_of_the_turn(tiny, on_steps):
    """A robot that fuses its gyro states the deviation of both together, as in simulated drives."""
    spec, layouts = tiny
    log = made([0.0, 0.05, 0.1], [[0, 0, 0], [0.01, 0, 0], [0.02, 0, 0]])
    fused = dataclasses.replace(spec, robot=dataclasses.replace(spec.robot, gyro_fitted=True))
    plain = on_steps(log).observations.sigma
    both = resampled(log, fused, antennas_of(layouts[0], 0.05)).observations.sigma
    gyro_rad = spec.robot.gyro.sigma(0.05)
    assert both[:, 2] ** -2 == pytest.approx(plain[:, 2] ** -2 + gyro_rad**-2)
    assert np.array_equal(both[:, :2], plain[:, :2])
