"""The learned sensor model of UHF strengths: known answers, what it says where nobody drove, what it refuses."""

import math
import pickle

import numpy as np
import pytest

from layoutopt.estimators.sensor_model import SensorModel, learn_sensor_model, likelihood

NAN = math.nan


def field(draws, count):
    """Return readings of a field in which shares and strengths are known: 1.5 m ahead, strengths fall 10 dB/m."""
    places_m = draws.uniform([0.0, -0.5], [1.5, 0.5], (count, 2))
    share = np.where(places_m[:, 0] < 1.0, 0.8, 0.2)
    strength_dbm = -40.0 - 10.0 * np.floor(places_m[:, 0] / 0.5) + 2.0 * draws.standard_normal(count)
    return places_m, np.where(draws.random(count) < share, strength_dbm, NAN)


def test_shares_means_and_spreads_are_learned_cell_by_cell():
    """Against the field that made the readings; every bound lies 5.5 standard errors away (false alarm < 1e-6)."""
    places_m, strengths_dbm = field(np.random.Generator(np.random.Philox(1)), 60_000)
    model = learn_sensor_model(places_m, strengths_dbm, cell_m=0.5)
    assert model.detection.shape == (3, 2)
    assert model.origin_m == (0.0, -0.5)
    assert model.readings.sum() == 60_000
    share = np.array([[0.8], [0.8], [0.2]])
    detections = share * model.readings
    assert (np.abs(model.detection - share) < 5.5 * np.sqrt(share * (1.0 - share) / model.readings)).all()
    assert (np.abs(model.mean_dbm - [[-40.0], [-50.0], [-60.0]]) < 5.5 * 2.0 / np.sqrt(detections)).all()
    assert (np.abs(model.sigma_db - 2.0) < 5.5 * 2.0 / np.sqrt(2.0 * detections)).all()


def test_likelihood_is_share_times_gaussian():
    """Eq. 2 to 4 in a cell with many readings, by hand; the density of a strength integrates to the share."""
    strengths_dbm = np.concatenate([np.tile([-52.0, -48.0], 400), np.full(200, NAN), np.full(10, NAN)])
    places_m = np.concatenate([np.full((1000, 2), 0.1), np.full((10, 2), 0.3)])
    model = learn_sensor_model(places_m, strengths_dbm)
    place_m = [[0.1, 0.2]]
    assert likelihood(model, place_m, NAN) == pytest.approx(0.2)
    sigma_db = model.sigma_db[0, 0]
    assert sigma_db == pytest.approx(2.0, rel=2e-3)
    peak = 0.8 / (math.sqrt(2.0 * math.pi) * sigma_db)
    assert likelihood(model, place_m, -50.0) == pytest.approx(peak)
    assert likelihood(model, place_m, -50.0 + sigma_db) == pytest.approx(peak * math.exp(-0.5))
    strengths_dbm = np.arange(-80.0, -20.0, 0.01)
    density = [likelihood(model, place_m, strength_dbm)[0] for strength_dbm in strengths_dbm]
    assert np.trapezoid(density, strengths_dbm) == pytest.approx(0.8, rel=1e-6)


def test_one_detection_has_the_common_spread_and_never_none():
    """A cell with one detection takes the spread within other cells; with no such cell that of all detections."""
    places_m = [[0.1, 0.1]] * 3 + [[0.3, 0.1]]
    model = learn_sensor_model(places_m, [-50.0, -54.0, -58.0, -70.0])
    assert model.sigma_db[1, 0] == pytest.approx(4.0)
    alone = learn_sensor_model([[0.1, 0.1], [0.3, 0.1]], [-50.0, NAN])
    assert alone.sigma_db[0, 0] == 0.5
    assert np.isnan(alone.sigma_db[1, 0])
    wide = learn_sensor_model([[0.1, 0.1], [0.3, 0.1]], [-50.0, -54.0], sigma_floor_db=3.0)
    assert wide.sigma_db.ravel().tolist() == [3.0, 3.0]


def test_a_share_of_nought_or_one_leaves_a_chance():
    """By Laplace's rule of succession, so that one lost reading rules out no place."""
    model = learn_sensor_model([[0.1, 0.1]] * 8 + [[0.3, 0.1]] * 8, [-50.0] * 8 + [NAN] * 8)
    assert likelihood(model, [[0.1, 0.1], [0.3, 0.1]], NAN) == pytest.approx([0.1, 0.9])
    assert likelihood(model, [[0.3, 0.1]], -50.0) == pytest.approx(0.1 / 60.0)


def test_a_cell_that_nobody_visited_is_taken_for_the_nearest():
    """Between two visited cells lies a hole; off the grid a tag is out of range."""
    places_m = [[0.1, 0.1]] * 4 + [[1.1, 0.1]] * 4
    model = learn_sensor_model(places_m, [-40.0, -42.0, NAN, NAN, -60.0, -62.0, -61.0, NAN])
    assert np.isnan(model.detection[1:4, 0]).all()
    same = likelihood(model, [[0.1, 0.1], [0.3, 0.1], [0.9, 0.1], [1.1, 0.1]], -41.0)
    assert same[0] == same[1] > same[2] == same[3]
    off = [[-0.1, 0.1], [1.3, 0.1], [0.1, 9.0], [1e12, -1e12]]
    assert likelihood(model, off, NAN) == pytest.approx(np.full(4, 0.9))
    assert likelihood(model, off, -41.0) == pytest.approx(np.full(4, 0.1 / 60.0))


def test_equal_models_have_one_key_and_survive_a_pickle():
    """Whatever bits their NaN have."""
    model = learn_sensor_model([[0.1, 0.1], [0.8, 0.1]], [-50.0, NAN])
    grids = {name: -getattr(model, name) * -1.0 for name in ("detection", "mean_dbm", "sigma_db", "readings")}
    other = SensorModel(cell_m=model.cell_m, origin_m=model.origin_m, **grids)
    assert pickle.loads(pickle.dumps(model)) == model == other
    with pytest.raises(ValueError, match="read-only"):
        model.mean_dbm[0, 0] = 0.0


@pytest.mark.parametrize(
    ("places_m", "strengths_dbm", "message"),
    [
        ([], [], "no readings"),
        ([[0.1, 0.1]], [-50.0], "1 cell tells no place from another"),
        ([[0.01, 0.01], [0.2, 0.2]], [-50.0, -51.0], "cells smaller than 0.25 m"),
        ([[0.1, 0.1], [0.3, 0.1]], [NAN, NAN], "none of 2 calibration readings"),
        ([[0.1, 0.1], [NAN, 0.1]], [-50.0, -50.0], "the first in row 1"),
        ([[0.1, math.inf]], [-50.0], "not finite"),
        ([[0.1, 0.1]], [-math.inf], "strength is finite"),
        ([[0.1, 0.1]], [-50.0, -50.0], "1 places need as many"),
        ([0.1, 0.1], [-50.0, -50.0], "rows of x and y"),
        ([[0.1, 0.1], [1e6, 1e6]], [-50.0, -50.0], "place that is wrong"),
    ],
)
def test_what_cannot_be_learned_from_is_refused(places_m, strengths_dbm, message):
    """Each with the reason."""
    with pytest.raises(ValueError, match=message):
        learn_sensor_model(places_m, strengths_dbm)


@pytest.mark.parametrize("settings", [{"cell_m": 0.0}, {"cell_m": NAN}, {"sigma_floor_db": 0.0}])
def test_settings_out_of_range_are_refused(settings):
    """By name or by what they are."""
    with pytest.raises(ValueError, match="positive"):
        learn_sensor_model([[0.1, 0.1], [0.3, 0.1]], [-50.0, -50.0], **settings)


def test_places_and_strengths_that_are_no_numbers_have_no_likelihood():
    """A NaN place is an error, not a place off the grid."""
    model = learn_sensor_model([[0.1, 0.1], [0.8, 0.1]], [-50.0, NAN])
    with pytest.raises(ValueError, match="first in row 1"):
        likelihood(model, [[0.1, 0.1], [NAN, 0.1]], -50.0)
    with pytest.raises(ValueError, match="strength is finite"):
        likelihood(model, [[0.1, 0.1]], math.inf)


@pytest.mark.parametrize(
    "changes",
    [
        {"cell_m": 0.0},
        {"mean_dbm": [[-50.0, -50.0]]},
        {"sigma_db": [[0.0, NAN]]},
        {"detection": [[1.2, 0.0]]},
        {"readings": [[1.0, 0.0]]},
        {"readings": [[1.0]]},
        {"origin_m": (0.0, NAN)},
    ],
)
def test_grids_that_contradict_each_other_are_no_model(changes):
    """A model is checked when it is made, wherever it comes from."""
    grids = {
        "cell_m": 0.25,
        "origin_m": (0.0, 0.0),
        "detection": [[1.0, 0.0]],
        "mean_dbm": [[-50.0, NAN]],
        "sigma_db": [[1.0, NAN]],
        "readings": [[1.0, 1.0]],
    }
    SensorModel(**grids)
    with pytest.raises(ValueError, match=r"contradict|one shape|positive, finite side"):
        SensorModel(**{**grids, **changes})
