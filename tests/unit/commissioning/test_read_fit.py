"""Read rates: shares and scatter that were put into a simulated drive come out of its log."""

import dataclasses

import numpy as np
import pytest
from scipy.stats import ncx2

from layoutopt.commissioning.drive_log import write_log
from layoutopt.commissioning.estimated import fitted_share
from layoutopt.commissioning.log_reading import read_log
from layoutopt.commissioning.read_chances import between_reads, chances_of
from layoutopt.commissioning.read_fit import fit_reads, read_chance
from layoutopt.commissioning.replay import replay_log
from layoutopt.estimators.mcl import MonteCarloLocalisation
from layoutopt.estimators.odometry import OdometryAlone
from layoutopt.scores import wilson


@pytest.fixture
def replayed(tiny, driven, tmp_path):
    spec, layouts = tiny

    def of(number=0, truth=True, estimator=None, spec=spec, **faults):
        layout = layouts[number]
        path = tmp_path / "drive.csv"
        tag_map = layout.floor_tags.lay_on(spec.site)
        record = driven(number, **faults)
        write_log(path, record, layout=layout, tag_map=tag_map)
        log = read_log(path, layout=layout, tag_map=tag_map, robot=spec.robot)
        if not truth:
            log = dataclasses.replace(log, truth=np.empty((0, 3)), truth_time_s=np.empty(0))
        start = tuple(record.drive.poses[0])
        return replay_log(log, spec, layout, estimator or OdometryAlone(), seed=2, start=start)

    return of


def test_a_perfect_drive_is_perfect(replayed):
    """Without any fault every scan with a tag in the disc brought it, and no tag scatters, is dead or wrong."""
    fit = fit_reads(replayed(steps=2400))
    assert fit.planned.value == 1.0
    assert fit.missed.value == 0.0
    assert fit.missed.high < 0.03
    assert fit.placement_sigma_m.value == 0.0
    assert fit.placement_sigma_m.high < 0.001
    assert fit.wrong.value == 0.0


def test_chances_are_the_planned_discs(replayed):
    """Where nothing goes wrong a pair is read if and only if the tag lies within the disc."""
    chances, _, notes = chances_of(replayed())
    assert np.array_equal(chances.hit, chances.beyond_m < 0.0)
    assert not notes


def test_faults_come_back(replayed):
    """Missed scans, scatter, wrong and dead tags lie within four of their stated errors of what was put in.

    A false alarm has a chance of about 3e-4.
    """
    fit = fit_reads(
        replayed(
            steps=6000,
            missed_read_share=0.08,
            tag_placement_sigma_m=0.003,
            wrong_identity_share=0.02,
            dead_tag_share=0.1,
        )
    )
    for fitted, true in (
        (fit.missed, 0.08),
        (fit.placement_sigma_m, 0.003),
        (fit.wrong, 0.02),
        (fit.dead, 0.1),
    ):
        assert fitted.value == pytest.approx(true, abs=4.0 * fitted.se)
    assert fit.planned.high < 0.9


def test_a_known_read_edge_is_taken_off(tiny, replayed):
    """Scatter of 3 mm and a soft edge of 2 mm come out as 3 mm if the layout file has the edge, else as more."""
    spec = tiny[0]
    study = dataclasses.replace(
        spec.study, design_faults=dataclasses.replace(spec.study.design_faults, read_edge_m=0.002)
    )
    faults = {"steps": 6000, "tag_placement_sigma_m": 0.003, "read_edge_m": 0.002}
    told = fit_reads(replayed(spec=dataclasses.replace(spec, study=study), **faults)).placement_sigma_m
    not_told = fit_reads(replayed(**faults)).placement_sigma_m
    assert told.value == pytest.approx(0.003, abs=4.0 * told.se)
    assert not_told.value == pytest.approx(np.hypot(0.003, 0.002 * np.pi / np.sqrt(3.0)), rel=0.1)


def test_without_truth_the_missed_share_needs_no_path(replayed):
    """Scans between two reads of one pass give the missed share, and the scatter is not guessed."""
    without = replayed(truth=False, estimator=MonteCarloLocalisation(), steps=6000, missed_read_share=0.08)
    fit = fit_reads(without)
    assert fit.missed.value == pytest.approx(0.08, abs=4.0 * fit.missed.se)
    assert fit.placement_sigma_m is None
    assert any("scatter of tag places is not fitted" in note for note in fit.notes)


def test_between_reads_of_a_perfect_drive_nothing_is_missing(replayed):
    """A pass over a disc brings a read in every scan between its first and its last."""
    missed, count = between_reads(replayed(steps=2400))
    assert missed == 0
    assert count > 100


def test_an_estimator_that_states_no_error_gives_no_wrong_reads(replayed):
    """Dead reckoning strays: reads far from its path are no wrong reads."""
    assert fit_reads(replayed(truth=False)).wrong is None


def test_too_few_scans_are_told(replayed):
    """A short drive gives notes instead of numbers."""
    fit = fit_reads(replayed(steps=60))
    assert fit.missed is None
    assert any(note.startswith("reads are not fitted") for note in fit.notes)


@pytest.mark.parametrize("scatter_m", [0.001, 0.003, 0.006])
def test_the_chance_of_a_read_is_that_of_a_scattered_tag(scatter_m):
    """The approximation is near the exact chance that a normal place lies in the disc (Rice)."""
    radius_m = 0.02
    beyond_m = np.linspace(-0.019, 0.02, 79)
    exact = ncx2.cdf((radius_m / scatter_m) ** 2, 2, ((radius_m + beyond_m) / scatter_m) ** 2)
    assert read_chance(beyond_m, np.full(79, radius_m), scatter_m, 0.0) == pytest.approx(
        exact, abs=0.05 * scatter_m / radius_m
    )


def test_wilson_intervals_are_the_published_ones():
    """Values of Newcombe, Statistics in Medicine 17 (1998) 857, table I."""
    for hits, count, low, high in ((81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611)):
        assert wilson(hits, count) == pytest.approx((low, high), abs=5e-5)
    assert fitted_share(29, 29, "things").high == 1.0
    assert wilson(0, 0) == (0.0, 1.0)


def test_readers_that_read_nothing_are_told(replayed):
    """A drive on which no tag answered gives dead tags, a planned share of zero, and no missed share."""
    fit = fit_reads(replayed(steps=6000, dead_tag_share=1.0))
    assert fit.planned.value == 0.0
    assert fit.missed is None
    assert fit.wrong is None
    assert any("no tag answered" in note for note in fit.notes)
