"""The accuracy of mi2016 comes out of the whole loop of drive, sensing and filter.

The setting is that of the study: reconstructed reader coordinates, a circle of 0.5 m anywhere against the lattice,
60 s at 0.1 m/s, known start. It was chosen on the paper's own numbers, so this guards what was found and is no
blind prediction.
"""

from functools import lru_cache

import numpy as np
import pytest

from layoutopt.estimators.odometry import OdometryAlone
from layoutopt.scores import paired_difference
from layoutopt.simulation.trials import run_trials
from layoutopt.streams import Streams
from studies.published import mi2016_setting as setting
from studies.published.comparison import Compared, score_of
from studies.published.mi2016_cells import FRAMES, NOISES, QUICK, third_cells
from studies.published.mi2016_printed import QUANTITIES, SIMULATED, TABLE_3

STREAMS = Streams(seed=2016)
DRIVES = 12


@lru_cache(maxsize=64)
def outcomes(readers, tags, likelihood):
    layout, estimator = setting.layout(readers, tags), setting.particle_filter(likelihood)
    return run_trials(layout, setting.scenario(), estimator, STREAMS, 0, DRIVES)


@lru_cache(maxsize=4)
def third(likelihood, reinitialise, frame="floor"):
    cell = third_cells(QUICK)[likelihood, next(iter(NOISES)), frame, reinitialise]
    return run_trials(cell.layout, cell.scenario, cell.estimator, STREAMS, 0, DRIVES)


def means_of(row, table):
    return [
        Compared(table="", row=row.labels, quantity=quantity, printed=printed, ours=score_of(table, quantity))
        for quantity, printed in zip(QUANTITIES["mean"], row.mean, strict=True)
    ]


def all_means():
    return [
        item
        for rows in SIMULATED.values()
        for row in rows
        for item in means_of(row, outcomes(row.readers, row.tags_per_m2, row.likelihood))
    ]


def test_every_mean_lies_within_a_factor_of_the_tables():
    """Means of Tables 2 and 4: within 2 in x and y, within 2.2 in the heading.

    Over 32 drives the outermost are 1.61 in y and 0.52 in the heading, with standard errors over 12 drives of
    about 0.07 and 0.01: at least five of them from the limit, so fewer than one seed in 10,000 would fail.
    """
    for item in all_means():
        factor = 2.2 if item.quantity.heading == "θ" else 2.0
        assert item.within(factor), (item.row, item.quantity.column, item.ratio)


def test_most_means_lie_within_a_factor_of_one_and_a_half():
    """At least 38 of the 48; the study finds 41 over 32 drives.

    Only the five nearest to the limit change sides with the seed, so that fewer than 38 means a change of model.
    """
    assert sum(item.within(1.5) for item in all_means()) >= 38


@pytest.mark.parametrize(("readers", "tags"), [(8, 400), (8, 100), (8, 16), (96, 400), (96, 100)])
def test_the_combination_beats_the_gaussian(readers, tags):
    """Where the study decides it, the combination is better in x and y on the same drives.

    The weakest is 7 % at 16 tags with a standard error of 1.7 % over 12 drives; asked is below zero by one
    standard error, which fewer than one seed in 500 would miss.
    """
    pair = (outcomes(readers, tags, "combination"), outcomes(readers, tags, "gaussian"))
    for axis in ("x_error_mean", "y_error_mean"):
        difference = paired_difference(*pair, axis)
        assert difference.value + difference.standard_error < 0.0, axis


@pytest.mark.parametrize("readers", [96, 8])
def test_more_tags_are_better(readers):
    """400 tags are better than 100, these than 25 and 16 (0.49 to 0.60 each); ten standard errors lie between."""
    found = [
        outcomes(readers, tags, "combination").score("position_error_mean").value for tags in setting.DENSITIES
    ]
    assert found[0] < 0.8 * found[1]
    assert found[1] < 0.8 * min(found[2:])


def test_more_readers_are_better_and_any_beat_odometry():
    """96 beat 24 and 20, which beat 8 at 100 tags (by 1.3 and 1.5 at least); odometry alone is far behind."""
    most, more, some, few = (
        outcomes(readers, 100, "combination").score("position_error_mean").value for readers in (96, 24, 20, 8)
    )
    assert 1.1 * most < min(more, some)
    assert 1.2 * max(more, some) < few
    blind = run_trials(setting.layout(8, 16), setting.scenario(), OdometryAlone(), STREAMS, 0, DRIVES)
    assert (
        blind.score("position_error_mean").value
        > 3.0 * outcomes(8, 16, "combination").score("position_error_mean").value
    )


def test_the_filter_states_its_error_about_right():
    """NEES over its expectation is near 1 at 100 tags; by a factor of two off either way it would say nothing."""
    nees = outcomes(8, 100, "combination").score("nees")
    assert 0.5 < nees.value < 2.0
    assert np.isfinite(nees.standard_error)


@pytest.mark.parametrize("row", TABLE_3, ids=lambda row: row.likelihood)
def test_table_3_comes_out_of_a_wrong_start(row):
    """Without re-initialisation and from a start that is known wrongly, means lie within 1.8 of Table 3.

    Ours over printed are 0.71 to 0.82 with standard errors of 0.03 over 12 drives; the limit, 0.56, is five of
    them from the lowest: fewer than one seed in 100,000 would fail.
    """
    for item in means_of(row, third(row.likelihood, reinitialise=False)):
        assert item.within(1.8), (item.quantity.column, item.ratio)


def test_reinitialisation_repairs_a_wrong_start():
    """With re-initialisation the same start costs less than 4 mm on the mean, without it more than 10 mm.

    Means over 12 drives are about 2.9 and 23 mm with standard errors of 0.1 and 1.3 mm.
    """
    good = third("combination", reinitialise=True).score("position_error_mean").value
    bad = third("combination", reinitialise=False).score("position_error_mean").value
    assert good < 0.004
    assert bad > 0.010


def test_in_the_frame_of_the_wheels_a_wrong_heading_is_never_found_again():
    """Particles that all believe a wrong heading drive off: the error grows beyond 100 mm on the mean.

    It is about 450 mm over 12 drives with a standard error of 20 mm.
    """
    lost = third("gaussian", reinitialise=False, frame=FRAMES[1])
    assert lost.score("position_error_mean").value > 0.1
