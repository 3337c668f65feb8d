"""The constraints of a whole drive are those that the step-by-step filter meets on its way."""

import math

import numpy as np
import pytest
from filter_worlds import SIGMA, antennas, by_steps, drive, knowledge, lattice_m, observations, tag_map

from layoutopt.estimators.crossings import antenna_ways_m
from layoutopt.estimators.disc_filter import DiscFilter
from layoutopt.estimators.disc_localisation import DiscLocalisation
from layoutopt.estimators.evidence import origin_of
from layoutopt.estimators.mcl_crossings import CrossingConstraints
from layoutopt.estimators.mcl_negative_information import NegativeInformation
from layoutopt.protocols import FloorKnowledge
from layoutopt.readings import Prior

STEPS = 200
PRIOR = Prior(pose=(0.0, 0.0, 0.0), sigma_m=0.5, sigma_rad=3.0)


def rings_by_steps(monkeypatch, estimator, known, told):
    """Return (step, antenna, tag, inner, outer, floor) of every ring that the plain filter asks for, in order."""
    asked, plain = [], DiscFilter._ring

    def ring(self, antenna, tag, inner_m, outer_m, least):
        asked.append((self._step, antenna, tag, inner_m, outer_m, math.log(least)))
        return plain(self, antenna, tag, inner_m, outer_m, least)

    monkeypatch.setattr(DiscFilter, "_ring", ring)
    by_steps(estimator, PRIOR, known, told, seed=0)
    return asked


def rings_of_the_drive(estimator, known, told):
    """Return the same from the columns, and check those that say the same twice."""
    origin_m = origin_of(known, (0.0, 0.0))
    columns = estimator.constraints(told, known, origin_m)
    step = np.repeat(np.arange(len(told)), np.diff(columns.start))
    np.testing.assert_array_equal(columns.read_end - columns.start[:-1], np.diff(told.read_start))
    np.testing.assert_allclose(columns.place[:, :2], known.antennas.xy_m[columns.antenna], atol=1e-7)
    np.testing.assert_allclose(columns.place[:, 2:] + origin_m, known.tags.xy_m[columns.tag], atol=1e-6)
    width_m = np.hypot(
        estimator.edge_share * known.antennas.radius_m[columns.antenna], known.tags.sigma_m[columns.tag]
    )
    np.testing.assert_allclose(columns.shape[:, 2], 1.0 / np.maximum(width_m, 0.0005), rtol=1e-6)
    return [
        (int(step[row]), int(columns.antenna[row]), int(columns.tag[row]), *columns.shape[row, [0, 1, 3]].tolist())
        for row in range(len(step))
    ]


@pytest.mark.parametrize("period", [1, 2, 4])
@pytest.mark.parametrize("missed", [0.0, 0.3])
@pytest.mark.parametrize("one_tag", [False, True])
@pytest.mark.parametrize("estimator", [CrossingConstraints(particles=3), NegativeInformation(particles=3)])
def test_columns_are_what_the_steps_meet(monkeypatch, estimator, period, missed, one_tag):
    """Every read and every crossing, with its ring, its floor and in its step: multiplexed, with missed scans."""
    draws = np.random.default_rng(period)
    carried = antennas(radius_m=np.linspace(0.02, 0.05, 8), period=period, one_tag=one_tag)
    tags_m = lattice_m(0.08)
    known = knowledge(tags_m, carried, sigma_m=draws.uniform(0.0, 0.01, len(tags_m)))
    _, told = drive(draws, known, STEPS, missed=missed)
    expected = rings_by_steps(monkeypatch, estimator, known, told)
    found = rings_of_the_drive(estimator, known, told)
    assert len(expected) == len(found) > 40
    if estimator.crossings:
        assert len(found) > 1.1 * len(told.read_tag)
        # Within a step the order of crossings counts for nothing.
        expected, found = sorted(expected), sorted(found)
    np.testing.assert_allclose(np.array(found), np.array(expected), rtol=1e-6, atol=1e-7)


def lone(scans, reads, step_m=0.01, period=1):
    """One antenna in the middle of a robot that drives straight on, and one tag with the steps that read it."""
    known = FloorKnowledge(tags=tag_map([[0.0, 0.0]]), antennas=antennas([[0.0, 0.0]], 0.05, period))
    active = (np.arange(scans) % period == 0)[:, None]
    increments = np.tile([step_m, 0.0, 0.0], (scans, 1))
    return known, observations(increments, np.tile(SIGMA, (scans, 1)), active, [(step, 0, 0) for step in reads])


@pytest.mark.parametrize(
    ("scans", "reads", "period", "step_m", "rings"),
    [
        # The scan before the first one is unknown: what it reads is no crossing.
        (3, [0, 1, 2], 1, 0.01, []),
        # What goes on to the end has not vanished.
        (4, [1, 2, 3], 1, 0.01, [(1, 0.04, 0.05)]),
        (4, [1, 2], 1, 0.01, [(1, 0.04, 0.05), (3, 0.05, 0.06)]),
        # A scan that missed is a tag that vanished and came back.
        (4, [0, 1, 3], 1, 0.01, [(2, 0.05, 0.06), (3, 0.04, 0.05)]),
        # Between two scans of a multiplexed antenna it moves four steps.
        (9, [4], 4, 0.01, [(4, 0.01, 0.05), (8, 0.05, 0.09)]),
        # The last scan has none after it.
        (6, [4], 4, 0.01, [(4, 0.01, 0.05)]),
        # Faster than a disc is wide: anywhere in it.
        (3, [1], 1, 0.2, [(1, 0.0, 0.05), (2, 0.05, 0.25)]),
        # Standing still it lies on the edge itself.
        (3, [1], 1, 0.0, [(1, 0.05, 0.05), (2, 0.05, 0.05)]),
        (3, [], 1, 0.01, []),
    ],
)
def test_known_crossings(monkeypatch, scans, reads, period, step_m, rings):
    """Appearances and disappearances of one tag, by hand."""
    estimator = CrossingConstraints(particles=2)
    known, told = lone(scans, reads, step_m, period)
    for found in (
        rings_of_the_drive(estimator, known, told),
        rings_by_steps(monkeypatch, estimator, known, told),
    ):
        crossings = [(row[0], *row[3:5]) for row in found if row[5] == pytest.approx(math.log(estimator.doubt))]
        np.testing.assert_allclose(np.array(crossings).reshape(-1, 3), np.array(rings).reshape(-1, 3), atol=1e-7)


def test_reads_of_unknown_tags_are_no_constraints():
    """A read that the map does not hold counts for nothing, and moves no other read to another step."""
    draws = np.random.default_rng(3)
    known = knowledge(lattice_m(0.08))
    _, told = drive(draws, known, STEPS, unknown=0.5)
    assert (told.read_tag < 0).any()
    columns = NegativeInformation().constraints(told, known, np.zeros(2))
    step = np.repeat(np.arange(STEPS), np.diff(told.read_start))
    kept = told.read_tag >= 0
    np.testing.assert_array_equal(columns.tag, told.read_tag[kept])
    np.testing.assert_array_equal(np.repeat(np.arange(STEPS), np.diff(columns.start)), step[kept])


def test_ways_of_antennas():
    """Forward, left and turn of the robot, seen from an antenna beside its centre."""
    increments = np.array([[0.03, 0.04, 0.0], [0.0, 0.0, 0.1], [0.1, 0.0, -1.0]])
    ways_m = antenna_ways_m(increments, np.array([[0.0, 0.0], [0.0, 0.2], [-0.3, 0.0]]))
    np.testing.assert_allclose(ways_m, [[0.05, 0.05, 0.05], [0.0, 0.02, 0.03], [0.1, 0.3, math.hypot(0.1, 0.3)]])


def test_no_deviation_is_less_than_the_roughening():
    """Deviations add as independent errors do, the heading over its lever."""
    estimator = NegativeInformation(roughening_m=0.003, motion_scale=2.0)
    found = estimator.motion_sigma(np.array([[0.002, 0.0, 0.0], [0.0, 0.002, 0.01]]))
    np.testing.assert_allclose(found, [[0.005, 0.003, 0.015], [0.003, 0.005, 0.025]])
    assert isinstance(estimator, DiscLocalisation)
