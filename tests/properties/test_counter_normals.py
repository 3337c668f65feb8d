"""Counter-based normals: the published generator, the twin's numbers, and normal in every respect that is used.

The statistical tests look at fixed keys. Each states its false-alarm rate over the choice of the key, all of them
together 1e-4.
"""

import math

import numpy as np
import pytest
from scipy import stats

from layoutopt.estimators import counter_normals, counter_normals_kernels
from layoutopt.estimators.counter_normals import KEY_STEPS, MULTIPLIERS, ROUNDS, Draw, blocks, key_words

KEYS = [(0, 0), (1, 2), (0xFFFFFFFF, 0xFFFFFFFF), (0xA4093822, 0x299F31D0)]
FALSE_ALARM = 1e-5


def philox(counter, key):
    """Philox4x32-10 as it is defined, in Python's own integers."""
    (one, two, three, four), (first, second) = counter, key
    for _ in range(ROUNDS):
        left, right = MULTIPLIERS[0] * one, MULTIPLIERS[1] * three
        one, two = (right >> 32) ^ two ^ first, right & 0xFFFFFFFF
        three, four = (left >> 32) ^ four ^ second, left & 0xFFFFFFFF
        first, second = (first + KEY_STEPS[0]) & 0xFFFFFFFF, (second + KEY_STEPS[1]) & 0xFFFFFFFF
    return [one, two, three, four]


def compiled_words(key, step, draw, first, count):
    out = np.zeros((4, count), np.uint32)
    counter_normals_kernels.philox_words(*key, step, int(draw), first, out)
    return out


def compiled_normals(key, step, count):
    width = blocks(count)
    words, out = np.empty((4, width), np.uint32), np.empty((4, width), np.float32)
    counter_normals_kernels.normals(*key, step, words, out)
    return out.reshape(-1)


@pytest.mark.parametrize(
    ("counter", "key", "answer"),
    [
        ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
        ((0xFFFFFFFF,) * 4, (0xFFFFFFFF,) * 2, (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
        (
            (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
            (0xA4093822, 0x299F31D0),
            (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
        ),
    ],
)
def test_the_reference_of_these_tests_is_the_published_generator(counter, key, answer):
    """Known answers of Philox4x32-10 (Random123, ``kat_vectors``)."""
    assert philox(counter, key) == list(answer)


@pytest.mark.parametrize("key", KEYS)
@pytest.mark.parametrize("step", [0, 7, 2**31, 2**32 - 1])
@pytest.mark.parametrize("draw", list(Draw))
def test_words_are_those_of_the_published_generator(key, step, draw):
    """Bit for bit, in the plain form and in the kernel, for every purpose and over the whole range of steps."""
    expected = np.array([philox((column, step, int(draw), 0), key) for column in range(9)]).T
    np.testing.assert_array_equal(counter_normals.philox_words(key, step, draw, 9), expected)
    np.testing.assert_array_equal(compiled_words(key, step, draw, 0, 9), expected)


def test_a_column_is_the_same_wherever_a_block_begins():
    """Words depend on the counter alone, not on how many are asked for at a time."""
    whole = compiled_words((3, 4), 5, Draw.RESTART, 0, 100)
    for first, count in ((0, 1), (17, 1), (17, 33), (99, 1)):
        part = compiled_words((3, 4), 5, Draw.RESTART, first, count)
        np.testing.assert_array_equal(part, whole[:, first : first + count])


@pytest.mark.parametrize("key", KEYS)
@pytest.mark.parametrize("count", [1, 31, 32, 33, 1500, 30_000])
def test_normals_are_the_twin_s(key, count):
    """To 2e-6, relative or absolute, at any number of particles; room is made in eights of four."""
    expected = counter_normals.normals(key, 11, count)
    found = compiled_normals(key, 11, count)
    assert len(expected) == len(found) == 4 * blocks(count) >= count
    np.testing.assert_allclose(found, expected, rtol=2e-6, atol=2e-6)


def test_normals_of_extreme_words():
    """The least and the largest radius, and every multiple of an eighth of a turn."""
    radius_words = np.array(
        [0, 0xFF, 0x100, 0x7FFFFFFF, 0x80000000, 0xB504F300, 0xB504F400, 0xFFFFFFFF], np.uint32
    )
    angle_words = np.array([*range(0, 2**32, 2**29), 1, 2**31 - 1, 2**31 + 1, 2**32 - 1], np.uint32)
    radius_word, angle_word = (grid.ravel() for grid in np.meshgrid(radius_words, angle_words))
    cosines, sines = np.empty(len(radius_word), np.float32), np.empty(len(radius_word), np.float32)
    counter_normals_kernels.box_muller(radius_word, angle_word, cosines, sines)
    uniform = (np.floor(radius_word / 256.0) * 2.0**-24 + 2.0**-25).astype(np.float32)
    radius = np.sqrt(-2.0 * np.log(uniform.astype(np.float64)))
    angle_rad = 2.0 * np.pi * angle_word * 2.0**-32
    np.testing.assert_allclose(cosines, radius * np.cos(angle_rad), rtol=2e-6, atol=2e-6)
    np.testing.assert_allclose(sines, radius * np.sin(angle_rad), rtol=2e-6, atol=2e-6)
    assert 5.8 < np.hypot(cosines, sines).max() < 5.9
    assert np.hypot(cosines, sines).min() >= 0.0


@pytest.fixture(scope="module")
def sample():
    """1,000 steps of 1,536 normals of one key, shape (1000, 1536)."""
    return np.array([compiled_normals((20, 16), step, 1536) for step in range(1000)], dtype=np.float64)


def assert_standard(value, deviation):
    """Check that a sum that is normal with this deviation lies where it does but in ``FALSE_ALARM`` of cases."""
    assert abs(value) < stats.norm.isf(FALSE_ALARM / 2) * deviation


def test_moments(sample):
    """Mean, variance, skewness and kurtosis of 1.5 million numbers (false alarm 4e-5)."""
    count = sample.size
    assert_standard(sample.mean(), math.sqrt(1 / count))
    assert_standard((sample**2).mean() - 1.0, math.sqrt(2 / count))
    assert_standard((sample**3).mean(), math.sqrt(15 / count))
    assert_standard((sample**4).mean() - 3.0, math.sqrt(96 / count))


def test_distribution(sample):
    """Kolmogorov and Smirnov's distance of 1.5 million numbers (false alarm 1e-5)."""
    assert stats.kstest(sample.ravel(), "norm").pvalue > FALSE_ALARM


def test_tails(sample):
    """As many numbers beyond three, four and five deviations as there should be (false alarm 3e-5)."""
    for limit in (3.0, 4.0, 4.7):
        share = 2 * stats.norm.sf(limit)
        found = int((np.abs(sample) > limit).sum())
        assert stats.binomtest(found, sample.size, share).pvalue > FALSE_ALARM


def test_numbers_are_independent(sample):
    """Neighbours, the same place in the next step, the two of a pair, and their squares (false alarm 1e-5)."""
    half = sample.shape[1] // 4
    pairs = {
        "neighbour": (sample[:, :-1], sample[:, 1:]),
        "step": (sample[:-1], sample[1:]),
        "pair": (sample[:, :half], sample[:, half : 2 * half]),
        "words": (sample[:, :half], sample[:, 2 * half : 3 * half]),
    }
    limit = stats.norm.isf(FALSE_ALARM / (4 * len(pairs)))
    for left, right in pairs.values():
        assert abs((left * right).mean()) * math.sqrt(left.size) < limit
        squares = (left**2 - 1.0) * (right**2 - 1.0)
        assert abs(squares.mean()) * math.sqrt(left.size) / 2.0 < limit


def test_keys_steps_and_purposes_share_nothing():
    """Streams that differ in one word of key, step or purpose are uncorrelated (false alarm 1e-5)."""
    words = np.array(
        [
            compiled_words(key, step, draw, 0, 20_000).ravel() * 2.0**-32 - 0.5
            for key, step, draw in (
                ((0, 0), 0, 0), ((1, 0), 0, 0), ((0, 1), 0, 0), ((0, 0), 1, 0), ((0, 0), 0, 1), ((0, 0), 0, 2),
                ((0, 0), 0, 3),
            )
        ]
    )  # fmt: skip
    shared = (words @ words.T)[np.triu_indices(len(words), 1)] * 12.0 / math.sqrt(words.shape[1])
    assert np.abs(shared).max() < stats.norm.isf(FALSE_ALARM / (2 * len(shared)))


def test_a_key_comes_from_the_stream():
    """Two words of 32 bits, the same for the same stream and others for another."""
    first, again, other = (key_words(np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert first == again != other
    assert all(0 <= word < 2**32 for word in (*first, *other))
    drawn = np.array([key_words(np.random.default_rng(seed)) for seed in range(200)])
    assert (drawn.max(axis=0) > 2**31).all()
