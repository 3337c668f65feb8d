"""Sensor models learned from simulated calibration drives, against chances and means by quadrature.

The readings have one fixed seed; limits are five standard deviations of a normal statistic (false alarms 6e-7).
"""

import functools
import math
from dataclasses import replace

import numpy as np
import pytest

from layoutopt.antennas.uhf_patch import UhfPatch
from layoutopt.simulation.calibration import READINGS_PER_CELL, calibrated, calibration_places, survivor_bias_db
from layoutopt.simulation.signals import detection_chance, mean_strength_dbm, reach_m, spread_db
from layoutopt.tracking_world import SignalWorld

PATCH, WORLD = UhfPatch(), SignalWorld()
NODES, WEIGHTS = np.polynomial.hermite_e.hermegauss(24)
WEIGHTS = WEIGHTS / WEIGHTS.sum()


@functools.cache
def expected():
    """Return the chance of a detection and the mean strength of detections in each cell, by quadrature."""
    model = calibrated(PATCH, WORLD)
    inside_m = model.cell_m * (np.arange(10) + 0.5) / 10.0
    axes_m = [
        origin_m + model.cell_m * np.arange(size)[:, None] + inside_m
        for origin_m, size in zip(model.origin_m, model.detection.shape, strict=True)
    ]
    chance, strength = (np.zeros(model.detection.shape) for _ in range(2))
    for column, x_m in enumerate(axes_m[0]):
        places_m = np.zeros((10, *axes_m[1].shape, 3))
        places_m[..., 0], places_m[..., 1] = x_m[:, None, None], axes_m[1]
        mean_dbm = mean_strength_dbm(PATCH, WORLD, places_m)
        for node, weight in zip(NODES, WEIGHTS, strict=True):
            heard = weight * detection_chance(WORLD, mean_dbm + spread_db(WORLD) * node)
            chance[column] += heard.mean(axis=(0, 2))
            strength[column] += (heard * (mean_dbm + spread_db(WORLD) * node)).mean(axis=(0, 2))
    return chance, strength / chance


def test_the_model_covers_all_places_in_reach_with_about_600000_readings():
    """Cells of 0.25 m, as many readings in each as promised on average, and none out of the square."""
    model = calibrated(PATCH, WORLD)
    assert model.cell_m == 0.25
    assert model.origin_m[0] == model.origin_m[1] <= -reach_m(WORLD)
    assert model.detection.shape[0] * model.cell_m == pytest.approx(-2.0 * model.origin_m[0])
    assert model.readings.mean() == READINGS_PER_CELL
    assert 550_000 < model.readings.sum() < 650_000
    assert (model.readings > 0).all()


def test_shares_of_detection_are_the_chances_of_the_world():
    """All cells together, by the squared deviations of counts, and the mean strengths where much is heard."""
    model = calibrated(PATCH, WORLD)
    chance, strength_dbm = expected()
    expected_count, count = chance * model.readings, model.detection * model.readings
    variance = expected_count * (1.0 - chance)
    likely = variance > 5.0
    assert likely.sum() > 400
    squares = ((count - expected_count) ** 2 / variance)[likely]
    # Counts of readings spread within a cell vary less than binomial ones, never more.
    assert squares.mean() - 1.0 < 5.0 * math.sqrt(2.0 / likely.sum())
    assert squares.mean() > 0.7
    unlikely = ~likely
    assert abs((count - expected_count)[unlikely].sum()) < 5.0 * math.sqrt(variance[unlikely].sum())
    much = likely & (count > 10.0)
    off = (model.mean_dbm - strength_dbm)[much] * np.sqrt(count[much]) / model.sigma_db[much]
    assert abs(off.mean()) < 5.0 * math.sqrt(1.5 / much.sum())


def test_the_mean_strength_is_that_of_survivors_at_the_edge_of_the_range():
    """Hardly any bias within 3 m, more than 1 dB from 7.5 m on, ever more; as the quadrature says."""
    model = calibrated(PATCH, WORLD)
    bias_db = survivor_bias_db(model, PATCH, WORLD)
    _, strength_dbm = expected()
    middle = model.detection.shape[1] // 2
    ahead = {
        distance_m: (slice(column, column + 4), slice(middle - 2, middle + 2))
        for distance_m in (2.0, 5.0, 7.5, 9.0)
        for column in [int((distance_m - model.origin_m[0]) / model.cell_m)]
    }
    found = {distance_m: float(np.nanmean(bias_db[cells])) for distance_m, cells in ahead.items()}
    assert abs(found[2.0]) < 0.3
    assert found[7.5] > 1.0
    assert found[2.0] < found[5.0] < found[7.5] < found[9.0]
    spread = 5.0 * 2.3 / math.sqrt(16 * READINGS_PER_CELL)
    for distance_m, cells in ahead.items():
        true_db = float(np.mean(strength_dbm[cells] - (model.mean_dbm - bias_db)[cells]))
        heard = float(np.nanmean(model.detection[cells]))
        assert abs(found[distance_m] - true_db) < spread / math.sqrt(heard)
    assert np.isnan(bias_db[model.detection == 0.0]).all()


def test_a_model_is_made_once_for_all_worlds_that_it_does_not_depend_on():
    """Another tag, phase, channel or correlation is the same calibration; another beam or noise is not."""
    model = calibrated(PATCH, WORLD)
    other = replace(WORLD, tag_offset_db=-4.0, phase_bits=8, channels_hz=(866e6,), fading_correlation=0.0)
    assert calibrated(UhfPatch(), other) is model
    assert calibrated(PATCH, replace(WORLD, noise_sigma_db=2.0)) != model
    assert calibrated(UhfPatch(beam_rad=1.0), WORLD) != model


def test_far_reaching_antennas_get_larger_cells():
    """The grid never has more than 240 cells a side, however far half of the readings succeed."""
    far = replace(WORLD, half_range_m=40.0)
    places_m, cell_m = calibration_places(far, np.random.default_rng(1))
    assert cell_m == pytest.approx(2.0 * reach_m(far) / 240)
    assert np.abs(places_m).max() == pytest.approx(reach_m(far), rel=0.01)
    assert len(places_m) == pytest.approx(READINGS_PER_CELL * 240**2, rel=0.02)
