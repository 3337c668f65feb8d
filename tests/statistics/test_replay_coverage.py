"""Intervals of fitted noise and read rates hold the truth as often as they say, on simulated drives."""

import dataclasses

import numpy as np
import pytest

from layoutopt.commissioning.drive_log import write_log
from layoutopt.commissioning.evidence_fit import fit_scale
from layoutopt.commissioning.log_reading import read_log
from layoutopt.commissioning.motion_fit import TERMS, fit_motion
from layoutopt.commissioning.read_fit import fit_reads
from layoutopt.commissioning.replay import replay_log
from layoutopt.estimators.mcl import MonteCarloLocalisation
from layoutopt.estimators.odometry import OdometryAlone
from layoutopt.scenario import Faults
from layoutopt.simulation.trials import record_trial
from layoutopt.spec.reading import read_spec
from layoutopt.streams import Streams

FAULTS = Faults(missed_read_share=0.05, tag_placement_sigma_m=0.003)


@pytest.fixture
def drives(tmp_path, tiny_text):
    """Return function that gives logs of simulated drives, with truth or without, and the spec and layout."""
    (tmp_path / "tiny.toml").write_text(tiny_text.replace('duration = "15 s"', 'duration = "60 s"'))
    spec = read_spec(tmp_path / "tiny.toml")
    layout = next(iter(spec.space.layouts()))
    tag_map = layout.floor_tags.lay_on(spec.site)

    def logs(count, robot=spec.robot):
        scenario = dataclasses.replace(spec.design, faults=FAULTS, robot=robot)
        for replication in range(count):
            record = record_trial(layout, scenario, OdometryAlone(), Streams(seed=31), replication)
            write_log(tmp_path / "drive.csv", record, layout=layout, tag_map=tag_map)
            log = read_log(tmp_path / "drive.csv", layout=layout, tag_map=tag_map, robot=spec.robot)
            yield log, tuple(record.drive.poses[0])

    return spec, layout, logs


def least_hits(count):
    """Return the number of hits of 95 % intervals below which chance goes under 1e-4."""
    from scipy.stats import binom

    return int(binom.ppf(1e-4, count, 0.95))


@pytest.mark.long
def test_intervals_against_the_truth_hold_it(drives):
    """Of 40 drives 95 % of the intervals hold what was put in; the chance of a false alarm is 5e-4 for all five.

    The errors scatter as much as the stated ones say: their ratio lies within what 40 drives allow, four standard
    errors of a standard deviation.
    """
    spec, layout, logs = drives
    odometry = spec.robot.odometry
    true = {name: getattr(odometry, name) for name in TERMS}
    true |= {"missed": 0.05, "placement_sigma_m": 0.003}
    found = {name: [] for name in true}
    for log, _ in logs(40):
        reads = fit_reads(replay_log(log, spec, layout, OdometryAlone(), seed=0))
        motion = fit_motion(log, odometry)
        for name, rows in found.items():
            rows.append(motion.terms[name] if name in motion.terms else getattr(reads, name))
    for name, rows in found.items():
        hits = sum(row.low <= true[name] <= row.high for row in rows)
        assert hits >= least_hits(40), (name, hits)
        spread = np.std([(row.value - true[name]) / row.se for row in rows])
        assert 1.0 - 4.0 / np.sqrt(80) < spread < 1.0 + 4.0 / np.sqrt(80), (name, spread)


@pytest.mark.long
@pytest.mark.parametrize("factor", [1.0, 2.0])
def test_intervals_from_reads_alone_hold_the_scale(drives, factor):
    """Of 24 drives 95 % of the intervals hold the scale (false alarm 1e-4), and the mean is within 10 %."""
    spec, layout, logs = drives
    odometry = spec.robot.odometry
    real = dataclasses.replace(odometry, **{name: factor * getattr(odometry, name) for name in TERMS})
    rows = []
    for log, start in logs(24, robot=dataclasses.replace(spec.robot, odometry=real)):
        bare = dataclasses.replace(log, truth=np.empty((0, 3)), truth_time_s=np.empty(0))
        replayed = replay_log(bare, spec, layout, MonteCarloLocalisation(), seed=1, start=start)
        rows.append(fit_scale(replayed, 0.05).terms["translation_share"])
    hits = sum(row.low <= factor * 0.02 <= row.high for row in rows)
    assert hits >= least_hits(24)
    assert np.mean([row.value for row in rows]) == pytest.approx(factor * 0.02, rel=0.1)
