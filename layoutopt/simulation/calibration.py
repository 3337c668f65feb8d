"""Calibration drives, simulated: readings from all about an antenna, and the sensor model that they teach."""

import math
from dataclasses import replace
from functools import lru_cache
from typing import Final

import numpy as np

from layoutopt.estimators.sensor_model import SensorModel, learn_sensor_model
from layoutopt.identity import FloatArray
from layoutopt.simulation.signals import SignalAntenna, detection_chance, mean_strength_dbm, reach_m, spread_db
from layoutopt.tracking_world import SignalWorld

CELL_M: Final = 0.25
"""Side of a cell; that of the simulation by which liang2020 was reproduced, the paper states none."""
READINGS_PER_CELL: Final = 48
"""At the defaults 600,000 readings; nine hours of driving past 65 tags (liang2020, Section 4.1) give that many."""
MOST_CELLS: Final = 240
"""Cells along a side of the grid at most: antennas that reach farther than 30 m get larger cells."""
SEED: Final = 2020
"""Calibration happens once, before all trials, and belongs to none of their streams."""


def calibrated(antenna: SignalAntenna, signal: SignalWorld) -> SensorModel:
    """Return the sensor model of an antenna that simulated calibration drives teach.

    Readings are even over a square about the antenna that holds all places in reach of it, about
    `READINGS_PER_CELL` in each cell, with a tag of no offset. Fading is drawn anew for each reading: drives of
    hours pass a place again and again, and each time it has changed. So no reading depends on the one before.
    What the world says of the tag's offset, of phases, channels and the correlation of fading changes nothing.
    The model is made once for each antenna and world of signals.

    Notes
    -----
    Only readings that succeed have a strength, so at the edge of the range the model's mean strength is that of
    the lucky ones: see `survivor_bias_db`. Trackers that learn from real drives have the same bias.
    """
    standard = SignalWorld()
    same = ("tag_offset_db", "fading_correlation", "phase_sigma_rad", "phase_bits", "channels_hz", "dwell_s")
    return _calibrated(antenna, replace(signal, **{name: getattr(standard, name) for name in same}))


@lru_cache(maxsize=16)
def _calibrated(antenna: SignalAntenna, signal: SignalWorld) -> SensorModel:
    draws = np.random.Generator(np.random.Philox(SEED))
    places_m, cell_m = calibration_places(signal, draws)
    offset_m = np.column_stack([places_m, np.zeros(len(places_m))])
    strength_dbm = mean_strength_dbm(antenna, signal, offset_m)
    strength_dbm += spread_db(signal) * draws.standard_normal(len(places_m))
    heard = draws.random(len(places_m)) < detection_chance(signal, strength_dbm)
    return learn_sensor_model(places_m, np.where(heard, strength_dbm, np.nan), cell_m=cell_m)


def calibration_places(signal: SignalWorld, draws: np.random.Generator) -> tuple[FloatArray, float]:
    """Return where the tag is in calibration readings, shape (n, 2), m, and the side of a cell.

    Places are in the antenna's frame.
    """
    cell_m = max(CELL_M, 2.0 * reach_m(signal) / MOST_CELLS)
    half = math.ceil(reach_m(signal) / cell_m)
    count = READINGS_PER_CELL * (2 * half) ** 2
    return draws.uniform(-half * cell_m, half * cell_m, (count, 2)), cell_m


def survivor_bias_db(model: SensorModel, antenna: SignalAntenna, signal: SignalWorld) -> FloatArray:
    """Return by how much a model's mean strength is above the true one, cell by cell, shape (columns, rows), dB.

    The true one is the mean strength in the middle of the cell of a tag of no offset, heard or not. NaN in cells
    without a detection. Beside the luck of what was heard it holds the error of a mean of few readings, and close
    to the antenna the curvature of the strength over a cell.
    """
    columns, rows = model.mean_dbm.shape
    middle_m = np.zeros((columns, rows, 3))
    middle_m[..., 0] = (model.origin_m[0] + (np.arange(columns) + 0.5) * model.cell_m)[:, None]
    middle_m[..., 1] = model.origin_m[1] + (np.arange(rows) + 0.5) * model.cell_m
    return np.asarray(model.mean_dbm - mean_strength_dbm(antenna, replace(signal, tag_offset_db=0.0), middle_m))
