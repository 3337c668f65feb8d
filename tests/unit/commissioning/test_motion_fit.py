"""Noise of odometry from true poses: known numbers come back, also under a noisy truth."""

import dataclasses

import numpy as np
import pytest

from layoutopt.commissioning.drive_log import DriveLog
from layoutopt.commissioning.motion_fit import fit_motion, increments_of
from layoutopt.robot import Odometry
from layoutopt.simulation.motion import integrate

TERMS = {"translation_share": 0.03, "lateral_share": 0.01, "rotation_rad_per_m": 0.02}
REAL = Odometry(**TERMS)


def logged(steps=2000, seed=1, truth_noise=0.0, step_s=0.05, every=1, scale=1.0, real=REAL):
    """Return the log of a drive in wide bends whose odometry errs as told."""
    draws = np.random.Generator(np.random.Philox(seed))
    true = np.stack([np.full(steps, 0.015), np.zeros(steps), 0.02 * np.sin(np.arange(steps) / 40.0)], axis=1)
    said = true * [scale, 1.0, 1.0] + real.sigma(true, step_s) * draws.standard_normal(true.shape)
    time_s = 1e9 + step_s * np.arange(steps + 1)
    truth = integrate((1.0, 2.0, 3.0), true)
    none = np.empty(0)
    return DriveLog(
        file="drive.csv",
        time_s=time_s,
        poses=integrate((0.0, 0.0, 0.0), said),
        jumps=np.empty(0, dtype=np.int64),
        gyro_rad=None,
        read_time_s=none,
        read_antenna=none.astype(np.int64),
        read_tag=none.astype(np.int64),
        scan_time_s=None,
        scan_antenna=None,
        truth_time_s=time_s[::every],
        truth=(truth + truth_noise * draws.standard_normal(truth.shape))[::every],
    )


def test_known_noise_comes_back_with_its_error():
    """Each term lies within four of its stated errors, which are those of chi-square (false alarm 2e-4)."""
    fit = fit_motion(logged(), Odometry())
    for name, value in TERMS.items():
        fitted = fit.terms[name]
        assert fitted.se == pytest.approx(value / np.sqrt(2 * 2000), rel=0.1)
        assert fitted.value == pytest.approx(value, abs=4.0 * fitted.se)
        assert fitted.low < fitted.value < fitted.high
    assert not fit.notes


@pytest.mark.parametrize("noise", [0.002, 0.01])
def test_a_noisy_truth_is_told_apart(noise):
    """Noise of the truth of 2 mm and 2 mrad, or of 10, does not count as noise of the odometry."""
    fit = fit_motion(logged(truth_noise=noise, steps=6000), Odometry())
    for name in ("translation_share", "rotation_rad_per_m"):
        assert fit.terms[name].value == pytest.approx(TERMS[name], abs=4.0 * fit.terms[name].se)
        assert fit.truth_sigma[name] == pytest.approx(noise, rel=0.3)


def test_a_slower_truth_gives_the_same_noise():
    """A truth in every fifth row gives fewer and longer increments with the same terms."""
    log = logged(every=5, steps=5000)
    assert len(increments_of(log, Odometry()).error) == 1000
    fit = fit_motion(log, Odometry())
    assert fit.terms["translation_share"].value == pytest.approx(0.03, abs=4.0 * 0.03 / np.sqrt(2000))


def test_a_faster_truth_does_not_count_one_row_twice():
    """Between two rows of odometry there is one increment, however often the truth was taken."""
    log = logged(steps=400)
    fine_s = np.linspace(log.time_s[0], log.time_s[-1], 4 * 400 + 1)
    truth = np.stack([np.interp(fine_s, log.truth_time_s, axis) for axis in log.truth.T], axis=1)
    fast = dataclasses.replace(log, truth_time_s=fine_s, truth=truth)
    assert len(increments_of(fast, Odometry()).error) == 400


def test_a_systematic_error_is_told():
    """Wheels that count 5 % too much are named with their error, which is not noise."""
    fit = fit_motion(logged(scale=1.05), Odometry())
    assert any(
        "systematic error forward of 4" in note or "systematic error forward of 5" in note for note in fit.notes
    )
    assert fit.terms["translation_share"].value == pytest.approx(0.03, rel=0.15)


def test_noise_over_time_is_held():
    """What the layout file says of noise over time is taken off before the rest is fitted, and told."""
    real = dataclasses.replace(REAL, translation_m_per_sqrt_s=0.01)
    assumed = Odometry(translation_m_per_sqrt_s=0.01)
    fit = fit_motion(logged(real=real), assumed)
    assert fit.terms["translation_share"].value == pytest.approx(0.03, abs=4.0 * fit.terms["translation_share"].se)
    assert fit_motion(logged(real=real), Odometry()).terms["translation_share"].value > 0.034
    assert any("over time" in note for note in fit.notes)
    assert fit.odometry(assumed).translation_m_per_sqrt_s == 0.01


def test_jumps_and_gaps_do_not_count():
    """An increment across a reset of the encoders, or a second without truth, is passed over."""
    log = logged(steps=200)
    assert len(increments_of(dataclasses.replace(log, jumps=np.array([50, 100])), Odometry()).error) == 198
    keep = np.r_[0:80, 130:201]
    gap = dataclasses.replace(log, truth_time_s=log.truth_time_s[keep], truth=log.truth[keep])
    assert len(increments_of(gap, Odometry()).error) == 149


def test_what_cannot_be_told_is_not_fitted():
    """Too few increments, a robot that stands, and a truth that drowns the odometry give notes and no numbers."""
    assert "10 increments" in fit_motion(logged(steps=10), Odometry()).notes[0]
    log = logged(steps=200)
    still = dataclasses.replace(log, truth=np.zeros_like(log.truth), poses=np.zeros_like(log.poses))
    assert not fit_motion(still, Odometry()).terms
    drowned = fit_motion(logged(steps=100, truth_noise=0.05), Odometry())
    assert "lateral_share" not in drowned.terms
    assert any(note.startswith("lateral_share is not fitted") for note in drowned.notes)
