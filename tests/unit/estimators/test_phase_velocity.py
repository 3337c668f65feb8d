"""Radial velocity from phases: known answers, limits, aliases, and what is refused."""

import math

import numpy as np
import pytest

from layoutopt.estimators.phase_velocity import (
    ALIASES,
    phase_displacement,
    phase_velocities,
    similarity,
    speed_limit,
    wavelength_m,
)

FREQUENCY_HZ = 920e6
HALF_M = wavelength_m(FREQUENCY_HZ) / 2.0


def word(range_m, bits=12, offset=0.3):
    """Return the phase word at a range, after Eq. 8."""
    turns = 2.0 * range_m / wavelength_m(FREQUENCY_HZ) + offset
    return np.floor((turns % 1.0) * (1 << bits)).astype(np.int64)


def test_a_thousand_and_twenty_four_steps_are_an_eighth_of_a_wavelength():
    """Reference figures: 40.73 mm, and 0.0398 mm for one step of a word."""
    assert phase_displacement(0, 1024, FREQUENCY_HZ) == pytest.approx(0.04073, abs=5e-6)
    assert phase_displacement(7, 8, FREQUENCY_HZ) == pytest.approx(0.0000398, abs=5e-8)


@pytest.mark.parametrize("bits", [8, 12, 16])
def test_displacements_below_a_quarter_wavelength_are_found_wherever_the_phase_starts(bits):
    """Moves of either sign over many start ranges, to within the step of a word."""
    start_m = np.linspace(1.0, 1.4, 501)[:, None]
    move_m = np.linspace(-0.49, 0.49, 41) * HALF_M
    found_m = phase_displacement(word(start_m, bits), word(start_m + move_m, bits), FREQUENCY_HZ, bits=bits)
    assert np.abs(found_m - move_m).max() <= HALF_M / (1 << bits) * (1.0 + 1e-9)


def test_taken_literally_a_passed_zero_costs_half_a_wavelength():
    """Eq. 9 without wrapping errs for the share |d| / (lambda / 2) of start phases, by half a wavelength."""
    start_m = np.linspace(1.0, 1.0 + HALF_M, 4001)[:-1]
    before, after = word(start_m), word(start_m + 0.3 * HALF_M)
    off_m = phase_displacement(before, after, FREQUENCY_HZ, literal=True) - 0.3 * HALF_M
    wrong = np.abs(off_m) > 1e-3
    assert wrong.mean() == pytest.approx(0.3, abs=1e-3)
    assert np.abs(off_m[wrong]) == pytest.approx(HALF_M, abs=1e-4)


def test_speed_limits_are_those_of_the_reference():
    """0.2037 m/s with the sign from the phase at 920 MHz and 0.4 s, twice that without; other channels too."""
    for frequency_hz, limit_m_s in ((920e6, 0.2037), (865e6, 0.2166), (928e6, 0.2019)):
        assert speed_limit(frequency_hz, 0.4) == pytest.approx(limit_m_s, abs=5e-5)
        assert speed_limit(frequency_hz, 0.4, signed=False) == 2.0 * speed_limit(frequency_hz, 0.4)


@pytest.mark.parametrize(("aliases", "reach"), [("signed", 0.5), ("two hypotheses", 1.0), ("three aliases", 1.5)])
def test_one_of_the_velocities_is_the_true_one_up_to_its_limit(aliases, reach):
    """In half wavelengths an interval; beyond the limit none of them is."""

    def off(move):
        displacement_m = float(phase_displacement(word(2.0), word(2.0 + move * HALF_M), FREQUENCY_HZ))
        return np.abs(phase_velocities(displacement_m, 0.4, FREQUENCY_HZ, aliases) * 0.4 / HALF_M - move).min()

    moves = np.linspace(-1.6, 1.6, 160)
    inside = np.abs(moves) < reach - 0.01
    assert max(off(move) for move in moves[inside]) < 1e-3
    assert min(off(move) for move in moves[np.abs(moves) > reach + 0.01]) > 0.9


def test_literal_velocity_is_eq_10():
    """One velocity, displacement over time."""
    assert phase_velocities(0.12, 0.4, FREQUENCY_HZ, "literal").tolist() == pytest.approx([0.3])


def test_similarity_is_one_only_for_equals_and_zero_for_opposites():
    """Symmetric, within 0 and 1; two zeros are equal."""
    draws = np.random.Generator(np.random.Philox(2))
    one, other = draws.normal(size=(2, 1000))
    found = similarity(one, other)
    assert ((found >= 0.0) & (found < 1.0)).all()
    np.testing.assert_array_equal(found, similarity(other, one))
    assert np.abs(found[one * other < 0.0]).max() < 1e-15
    assert (similarity(one, one) == 1.0).all()
    assert similarity(0.0, 0.0) == 1.0
    assert similarity(0.0, 0.3) == 0.0


@pytest.mark.parametrize("frequency_hz", [0.0, -920e6, math.inf, math.nan])
def test_a_frequency_without_a_wavelength_is_refused(frequency_hz):
    """Everywhere, as what it is."""
    for call in (
        lambda: phase_displacement(0, 1, frequency_hz),
        lambda: speed_limit(frequency_hz, 0.4),
        lambda: phase_velocities(0.0, 0.4, frequency_hz),
    ):
        with pytest.raises(ValueError, match="no wavelength"):
            call()


def test_words_intervals_and_names_out_of_range_are_refused():
    """With what would be right."""
    for before, after in ((-1, 0), (0, 4096), (0.5, 1), (0, math.nan)):
        with pytest.raises(ValueError, match="from 0 to 4095"):
            phase_displacement(before, after, FREQUENCY_HZ)
    with pytest.raises(ValueError, match="a bit or more"):
        phase_displacement(0, 0, FREQUENCY_HZ, bits=0)
    for interval_s in (0.0, -1.0, math.inf, math.nan):
        with pytest.raises(ValueError, match="interval"):
            speed_limit(FREQUENCY_HZ, interval_s)
    with pytest.raises(ValueError, match=ALIASES[1]):
        phase_velocities(0.0, 0.4, FREQUENCY_HZ, "both")
    with pytest.raises(ValueError, match="finite"):
        similarity(math.nan, 0.1)
