"""What UHF antennas hear: known strengths and phases, statistics of fading, detection, phases and channels.

Statistical tests take fixed seeds; each has a false-alarm rate below 1e-6 over the choice of the seed: limits are
five standard deviations of a normal statistic (6e-7), or a p-value of 1e-6.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chisquare, kstest
from tracking_cases import layout

from layoutopt.antennas.disc import DiscAntenna
from layoutopt.antennas.uhf_patch import UhfPatch
from layoutopt.errors import InvalidInput
from layoutopt.geometry import turned
from layoutopt.readers.finders import docking_antennas
from layoutopt.simulation.signals import (
    channels,
    detection_chance,
    faded,
    hear,
    mean_strength_dbm,
    offsets_m,
    reach_m,
    signal_antenna,
    ways_m,
    within_reach,
)
from layoutopt.streams import Purpose, Streams
from layoutopt.tracking_world import SPEED_OF_LIGHT_M_S, SignalWorld

WORLD = SignalWorld()
PATCH = UhfPatch()
ALWAYS = replace(WORLD, half_range_m=1e6)
"""A world in which every reading succeeds."""
SIGMAS = 5.0


def group(count=2, yaw_deg=45.0):
    """Return UHF antennas."""
    return layout(count, yaw_deg).readers[0]


def stream(seed=0, replication=0):
    """Return the stream of signals of one trial."""
    return Streams(seed=seed).generator("tracking", replication, Purpose.SIGNAL)


def ahead(distance_m, readings, antennas=1):
    """Return offsets straight ahead of antennas, and times of reading."""
    offset_m = np.zeros((readings, antennas, 3))
    offset_m[..., 0] = distance_m
    return offset_m, np.tile(0.4 * (np.arange(readings) + 1.0)[:, None], (1, antennas))


def test_the_pattern_counts_twice_and_the_way_once():
    """Half a beam aside and 2 m off it is 6 dB and 30 dB times log 2 less than at 1 m; a tag's offset adds."""
    aside_m = 2.0 * np.array([math.cos(math.radians(35.0)), math.sin(math.radians(35.0)), 0.0])
    assert mean_strength_dbm(PATCH, WORLD, np.array([1.0, 0.0, 0.0])) == pytest.approx(-42.0)
    assert mean_strength_dbm(PATCH, WORLD, aside_m) == pytest.approx(-42.0 - 6.0 - 30.0 * math.log10(2.0))
    weak = replace(WORLD, tag_offset_db=-4.0)
    assert mean_strength_dbm(PATCH, weak, aside_m) == pytest.approx(mean_strength_dbm(PATCH, WORLD, aside_m) - 4.0)


def test_offsets_turn_the_floor_into_the_frame_of_each_antenna():
    """A place made from a known offset, antenna after antenna, by the turns forth, comes back as that offset."""
    antennas = replace(group(3, 60.0), poses=np.array([(0.1, 0.2, 0.8, 1.1), (0, 0, 0.8, 0), (-0.3, 0, 0.8, -2)]))
    draws = np.random.default_rng(1)
    expected_m = draws.normal(0.0, 3.0, (50, 3, 2))
    pose = (1.5, -0.7, 2.3)
    places_m = np.empty_like(expected_m)
    for antenna, (x_m, y_m, _, yaw_rad) in enumerate(antennas.poses):
        in_robot_m = turned(expected_m[:, antenna], yaw_rad) + np.array([x_m, y_m])
        places_m[:, antenna] = turned(in_robot_m, pose[2]) + pose[:2]
    found_m = offsets_m(antennas, pose, places_m)
    assert found_m[..., :2] == pytest.approx(expected_m, abs=1e-12)
    assert (found_m[..., 2] == 0.0).all()


def test_half_of_the_readings_succeed_at_half_range_straight_ahead():
    """Exactly without fading; of 200,000 independent readings with fading and noise, within five deviations."""
    offset_m, times_s = ahead(WORLD.half_range_m, 200_000)
    chance = detection_chance(WORLD, mean_strength_dbm(PATCH, WORLD, offset_m[0, 0]))
    assert float(chance) == pytest.approx(0.5, abs=1e-12)
    signal = replace(WORLD, fading_correlation=0.0)
    heard = ~np.isnan(hear(group(1), signal, offset_m, times_s, stream()).strength_dbm)
    assert abs(heard.mean() - 0.5) < SIGMAS * math.sqrt(0.25 / heard.size)


def test_fading_has_its_deviation_and_its_correlation():
    """Of 200,000 readings of two antennas, noise apart; the antennas fade independently.

    The variance of an autoregression's sample variance is 2 sigma^4 (1 + rho^2) / (1 - rho^2) / n, that of its
    correlation at lag 1 is (1 - rho^2) / n, and that of the correlation of two is (1 + rho^2) / (1 - rho^2) / n
    (Bartlett's formula).
    """
    signal = replace(ALWAYS, noise_sigma_db=0.0)
    offset_m, times_s = ahead(2.0, 200_000, antennas=2)
    heard = hear(group(2), signal, offset_m, times_s, stream())
    fading_db = heard.strength_dbm - mean_strength_dbm(PATCH, signal, offset_m[0])
    rho, sigma, count = signal.fading_correlation, signal.fading_sigma_db, len(fading_db)
    spread = (1.0 + rho**2) / (1.0 - rho**2) / count
    for antenna in fading_db.T:
        assert abs(antenna.var() / sigma**2 - 1.0) < SIGMAS * math.sqrt(2.0 * spread)
        assert abs(np.corrcoef(antenna[1:], antenna[:-1])[0, 1] - rho) < SIGMAS * math.sqrt((1.0 - rho**2) / count)
    assert abs(np.corrcoef(fading_db.T)[0, 1]) < SIGMAS * math.sqrt(spread)


def test_fading_starts_in_balance():
    """The first of 20,000 beginnings spread as much as any later one; a start at nought would not."""
    draws = np.random.default_rng(2)
    first = np.array([faded(2.0, 0.9, draws.standard_normal(1))[0] for _ in range(20_000)])
    assert abs(first.var() / 4.0 - 1.0) < SIGMAS * math.sqrt(2.0 / len(first))


def test_noise_is_new_in_each_reading():
    """Without fading the strengths have the deviation of the noise and no correlation."""
    signal = replace(ALWAYS, fading_sigma_db=0.0)
    offset_m, times_s = ahead(2.0, 100_000)
    noise_db = hear(group(1), signal, offset_m, times_s, stream()).strength_dbm[:, 0]
    noise_db -= mean_strength_dbm(PATCH, signal, offset_m[0, 0])
    assert abs(noise_db.var() / signal.noise_sigma_db**2 - 1.0) < SIGMAS * math.sqrt(2.0 / len(noise_db))
    assert abs(np.corrcoef(noise_db[1:], noise_db[:-1])[0, 1]) < SIGMAS / math.sqrt(len(noise_db))


def test_phase_differences_are_those_of_equation_8():
    """Without noise, words of two readings differ by twice the way over the wavelength, to half a word each."""
    signal = replace(ALWAYS, phase_sigma_rad=0.0)
    draws = np.random.default_rng(3)
    offset_m, times_s = ahead(0.0, 400, antennas=2)
    offset_m[..., :2] = draws.uniform(0.5, 4.0, (400, 2, 2))
    heard = hear(group(2), signal, offset_m, times_s, stream())
    words = 2**signal.phase_bits
    turns = 2.0 * np.hypot(offset_m[..., 0], offset_m[..., 1]) * 920e6 / SPEED_OF_LIGHT_M_S
    off = np.diff(heard.phase_word, axis=0) / words - np.diff(turns, axis=0)
    assert np.abs(off - np.round(off)).max() <= 1.0 / words + 1e-9
    assert ((heard.phase_word >= 0) & (heard.phase_word < words)).all()


def test_start_phases_are_even_over_the_turn_and_new_in_each_trial():
    """Of 800 trials and two antennas (Kolmogorov and Smirnov); the two have phases of their own."""
    signal = replace(ALWAYS, phase_bits=24)
    offset_m, times_s = ahead(2.0, 1, antennas=2)
    words = np.array(
        [hear(group(2), signal, offset_m, times_s, stream(5, trial)).phase_word[0] for trial in range(800)]
    )
    turns = words / 2.0**24
    for antenna in turns.T:
        assert kstest(antenna, "uniform").pvalue > 1e-6
    assert kstest((turns[:, 0] - turns[:, 1]) % 1.0, "uniform").pvalue > 1e-6


def test_phase_noise_has_its_deviation():
    """Of 50,000 readings of a tag at rest."""
    offset_m, times_s = ahead(2.0, 50_000)
    signal = replace(ALWAYS, phase_bits=24)
    phase_rad = hear(group(1), signal, offset_m, times_s, stream()).phase_word[:, 0] / 2.0**24 * 2.0 * math.pi
    off_rad = np.angle(np.exp(1j * (phase_rad - phase_rad[0])))
    assert abs(off_rad.var() / signal.phase_sigma_rad**2 - 1.0) < SIGMAS * math.sqrt(2.0 / len(off_rad))


def test_what_is_not_heard_has_neither_strength_nor_phase():
    """At half range both happen."""
    offset_m, times_s = ahead(WORLD.half_range_m, 500)
    heard = hear(group(1), WORLD, offset_m, times_s, stream())
    silent = np.isnan(heard.strength_dbm)
    assert 100 < silent.sum() < 400
    assert ((heard.phase_word == -1) == silent).all()


def test_the_reader_hops_to_another_channel_after_every_dwell():
    """It never stays, all others are as likely (chi-square of 20,000 hops), and antennas are on one channel."""
    signal = replace(WORLD, channels_hz=(866e6, 902e6, 915e6, 927e6), dwell_s=0.2)
    times_s = np.array([0.05, 0.15]) + 0.2 * np.arange(20_001)[:, None]
    found = channels(signal, times_s, np.random.default_rng(4))
    assert (found[:, 0] == found[:, 1]).all()
    hops = np.diff(found[:, 0]) % 4
    assert (hops != 0).all()
    counts = np.zeros((4, 4))
    np.add.at(counts, (found[:-1, 0], hops), 1)
    assert chisquare(counts[:, 1:].ravel()).pvalue > 1e-6


def test_a_reading_at_the_end_of_a_dwell_belongs_to_the_next_whatever_sums_round():
    """Sums of 0.1 s land on both sides of whole dwells; one channel or an endless dwell never changes."""
    signal = replace(WORLD, channels_hz=(866e6, 915e6), dwell_s=0.3)
    found = channels(signal, np.cumsum(np.full(3000, 0.1)), np.random.default_rng(4))
    assert (found == (found[0] + (np.arange(3000) + 1) // 3) % 2).all()
    assert len(set(channels(replace(signal, dwell_s=math.inf), np.arange(99.0), stream()).tolist())) == 1
    assert channels(replace(WORLD, dwell_s=0.3), np.arange(9.0), stream()).tolist() == [0] * 9


def test_a_channel_has_one_phase_offset_for_each_antenna_throughout_a_trial():
    """Without noise a tag at rest has one word a channel, and the offsets of two channels differ by any angle."""
    signal = replace(ALWAYS, phase_sigma_rad=0.0, channels_hz=(866e6, 915e6), dwell_s=0.4)
    offset_m, times_s = ahead(2.0, 6)
    apart = []
    for trial in range(300):
        heard = hear(group(1), signal, offset_m, times_s, stream(6, trial))
        words = [set(heard.phase_word[heard.frequency_hz == channel].tolist()) for channel in signal.channels_hz]
        assert [len(of_channel) for of_channel in words] == [1, 1]
        apart.append((words[0].pop() - words[1].pop()) / 2.0**signal.phase_bits)
    assert kstest(np.array(apart) % 1.0, "uniform").pvalue > 1e-6


def test_more_antennas_longer_drives_and_other_tags_change_no_random_number():
    """The first two of four antennas hear the same; so do the first 50 of 80 readings; a stronger tag adds dB."""
    offset_m, times_s = ahead(5.0, 80, antennas=4)
    signal = replace(WORLD, channels_hz=(866e6, 915e6), dwell_s=1.0)
    few = hear(group(2), signal, offset_m[:50, :2], times_s[:50, :2], stream())
    many = hear(group(4), signal, offset_m, times_s, stream())
    for column in ("strength_dbm", "phase_word", "frequency_hz"):
        np.testing.assert_array_equal(getattr(few, column), getattr(many, column)[:50, :2])
    strong = hear(group(4), replace(signal, tag_offset_db=3.0), offset_m, times_s, stream())
    heard = ~np.isnan(many.strength_dbm)
    assert strong.strength_dbm[heard] == pytest.approx(many.strength_dbm[heard] + 3.0)
    assert (strong.phase_word[heard] == many.phase_word[heard]).all()


def test_reach_is_where_the_chance_of_a_lucky_reading_is_one_percent():
    """Straight ahead just within and just beyond; aside it is less."""
    edge_m = reach_m(WORLD)
    offset_m = np.array([(0.999 * edge_m, 0, 0), (1.001 * edge_m, 0, 0), (0, 0.5 * edge_m, 0)])
    assert within_reach(PATCH, WORLD, offset_m).tolist() == [True, False, False]
    assert edge_m == pytest.approx(7.0 * 10 ** ((math.log(99.0) + 2.0 * math.sqrt(5.0)) / 30.0), rel=1e-12)


@pytest.mark.parametrize("change", [{"path_exponent": 0.001}, {"fading_sigma_db": 100.0}])
def test_a_reach_without_end_is_refused(change):
    """Where ten to that power would be no number, too."""
    with pytest.raises(InvalidInput, match=r"beyond 10 km.*path_exponent"):
        reach_m(replace(WORLD, **change))


def test_a_tag_in_the_antenna_is_heard_as_one_at_its_face():
    """No infinite strength at a distance of nought."""
    assert float(ways_m(np.zeros(3))) == 0.1
    assert np.isfinite(mean_strength_dbm(PATCH, WORLD, np.zeros(3)))


def test_what_hears_no_tags_and_places_that_are_none_are_refused():
    """Crossed antennas, a group that claims more than its model can, and a NaN."""
    with pytest.raises(ValueError, match="hear no UHF tags"):
        signal_antenna(docking_antennas(antenna=PATCH))
    with pytest.raises(ValueError, match="hear no UHF tags"):
        signal_antenna(replace(group(1), antenna=DiscAntenna(side_m=0.1, radius_m=0.1)))
    offset_m, times_s = ahead(math.nan, 3)
    with pytest.raises(ValueError, match="the tag must be somewhere"):
        hear(group(1), WORLD, offset_m, times_s, stream())
