"""Settings of particle filters: what they refuse, with the reason, and what goes to the kernel."""

import math
from dataclasses import fields, replace

import pytest

from layoutopt.estimators.bayes_limit import BayesLimit
from layoutopt.estimators.mcl import MonteCarloLocalisation
from layoutopt.estimators.mcl_adaptive import AdaptiveParticles
from layoutopt.estimators.mcl_crossings import CrossingConstraints
from layoutopt.estimators.mcl_negative_information import NegativeInformation
from layoutopt.estimators.particles import Likelihood

DISC_ROWS = (CrossingConstraints, NegativeInformation, AdaptiveParticles, BayesLimit)
NAN, INF = math.nan, math.inf
MCL_FAULTS = {
    "particles": (0, -3),
    "likelihood": ("", "Gaussian", "rings"),
    "beta": (0.0, -1.0, NAN, INF),
    "alpha": (0.0, -0.1, 1.1, NAN, INF),
    "sigma_scale": (-0.1, NAN, INF),
    "sigma_floor_m": (0.0, -1.0, NAN, INF),
    "motion_scale": (-0.1, NAN, INF),
}
WORDS = {
    "particles": "at least one particle",
    "sigma_scale": "sigma needs a scale",
    "sigma_floor_m": "positive floor",
    "least_particles": "particle",
}
SHARES = (0.0, 1.0, -0.1, 1.5, NAN, INF)
POSITIVE = (0.0, -1.0, NAN, INF)
NOT_NEGATIVE = (-1e-9, NAN, INF)
DISC_FAULTS = {
    "particles": (0, -3),
    "least_particles": (0, -3),
    "edge_share": POSITIVE,
    "miss_share": SHARES,
    "doubt": SHARES,
    "outlier": SHARES,
    "alpha": SHARES,
    "patience": (0, -1),
    "roughening_m": NOT_NEGATIVE,
    "motion_scale": NOT_NEGATIVE,
    "bin_m": POSITIVE,
    "kld_error": POSITIVE,
}


@pytest.mark.parametrize(("name", "value"), [(name, value) for name in MCL_FAULTS for value in MCL_FAULTS[name]])
def test_what_monte_carlo_localisation_refuses(name, value):
    """The message names the setting and repeats what it was given."""
    with pytest.raises(ValueError, match=WORDS.get(name, name)) as refused:
        MonteCarloLocalisation(**{name: value})
    assert str(value) in str(refused.value)


@pytest.mark.parametrize("row", DISC_ROWS)
@pytest.mark.parametrize(("name", "value"), [(name, value) for name in DISC_FAULTS for value in DISC_FAULTS[name]])
def test_what_filters_on_discs_refuse(row, name, value):
    """The message names the setting and repeats what it was given."""
    with pytest.raises(ValueError, match=WORDS.get(name, name)) as refused:
        row(**{name: value})
    assert str(value) in str(refused.value)


@pytest.mark.parametrize("row", DISC_ROWS)
def test_every_setting_is_checked(row):
    """A setting that is added must be added above too."""
    assert {one.name for one in fields(row) if one.init} == set(DISC_FAULTS)
    assert {one.name for one in fields(MonteCarloLocalisation) if one.init} == {*MCL_FAULTS, "reinitialise"}


def test_the_least_number_binds_only_where_the_number_adapts():
    """Fewer particles than the least are a fixed number; filters that do not adapt do not ask for the least."""
    assert AdaptiveParticles(particles=50).kernel_settings().least_particles == 50
    assert AdaptiveParticles(particles=500, least_particles=40).kernel_settings().least_particles == 40
    for row in DISC_ROWS:
        if not row.adaptive:
            settings = row(particles=50).kernel_settings()
            assert settings.particles == settings.least_particles == 50


def test_settings_of_the_kernel_have_one_type_each():
    """Kernels are compiled anew for other types: every row and every default gives the same ones."""
    every = [row().kernel_settings() for row in (MonteCarloLocalisation, *DISC_ROWS)]
    every.append(MonteCarloLocalisation(likelihood="gaussian", reinitialise=False).kernel_settings())
    assert len({tuple(type(value) for value in settings) for settings in every}) == 1


def test_what_each_row_asks_for():
    """Crossings or silence, adaptive or not, and mi2016's two likelihoods."""
    asks = {row.row: (row.crossings, row.silence, row.adaptive) for row in DISC_ROWS}
    assert asks == {
        "mcl_crossings": (True, False, False),
        "mcl_negative_information": (False, True, False),
        "mcl_adaptive": (False, True, True),
        "bayes_limit": (False, True, False),
    }
    for likelihood in ("gaussian", "combination"):
        settings = MonteCarloLocalisation(likelihood=likelihood, beta=0.5, alpha=0.1).kernel_settings()
        assert Likelihood(settings.likelihood).name == likelihood.upper()
        assert (settings.log_beta, settings.log_alpha) == (math.log(0.5), math.log(0.1))


@pytest.mark.parametrize("row", [MonteCarloLocalisation, *DISC_ROWS])
def test_settings_are_values(row):
    """Equal settings are equal, others are not, and the key says which."""
    assert row() == row()
    other = replace(row(), motion_scale=1.5)
    assert other != row()
    assert other.key != row().key
