"""Statistics that tell streams of random words from dependent, overlapping or uneven ones.

Each check takes words, shape (streams, n), uint64, and returns a bound on the chance with which independent
uniform words would look as bad: the smallest of its p-values times their number (Bonferroni), or a union bound. A
check that alarms below a chance a so has a false-alarm rate of at most a, however its comparisons depend on each
other.
"""

import numpy as np
from scipy import special, stats

_BITS = 64


def uniform(words):
    """Each of the eight bytes in 256 cells (chi-square), and the values as a whole (Kolmogorov and Smirnov).

    Cells that are filled too evenly are an alarm as well, here and in all that counts cells.
    """
    bytes_of = np.ascontiguousarray(words).reshape(-1).view(np.uint8).reshape(-1, 8)
    chances = [_chi_square(np.bincount(bytes_of[:, place], minlength=256)) for place in range(8)]
    chances.append(stats.kstest(units(words).ravel(), "uniform").pvalue)
    return _bonferroni(min(chances), len(chances))


def uncorrelated(words):
    """Every pair of streams at every shift of one against the other, and each stream against itself.

    The product of two uniforms is so little peaked (excess 0.24) that its sum over thousands of words is normal to
    a twentieth of the chance even at 8 deviations.
    """
    values = (units(words) - 0.5) * np.sqrt(12.0)
    streams, count = values.shape
    spectra = np.fft.rfft(values, axis=1)
    largest, looks = 0.0, 0
    for row in range(streams):
        shared = np.abs(np.fft.irfft(spectra[row].conj() * spectra[row + 1 :], n=count, axis=1))
        # Against itself, shift s is shift n - s once more, and shift 0 is no comparison.
        own = np.abs(np.fft.irfft(np.abs(spectra[row]) ** 2, n=count)[1 : count // 2])
        largest = max(largest, shared.max(initial=0.0), own.max())
        looks += shared.size + own.size
    return _bonferroni(2.0 * stats.norm.sf(largest / np.sqrt(count)), looks)


def independent_pairs(words):
    """Every pair of streams, word by word, in 8 × 8 cells (chi-square): dependence of any form, at shift 0."""
    cells = (words >> np.uint64(61)).astype(np.int64)
    counts = [
        np.bincount(8 * cells[row] + cells[other], minlength=64)
        for row in range(len(cells))
        for other in range(row + 1, len(cells))
    ]
    return _bonferroni(_chi_square(np.array(counts)).min(), len(counts))


def unlike_bits(words):
    """Every pair of streams, each of 64 bits: how often the XOR is set (binomial); sees what low bits share."""
    streams, count = words.shape
    words = np.ascontiguousarray(words)
    first, second = np.triu_indices(streams, 1)
    extreme = 0
    for bit in range(_BITS):
        plane = np.packbits(((words >> np.uint64(bit)) & np.uint64(1)).astype(np.bool_), axis=1).view(np.uint64)
        unlike = np.bitwise_count(plane[first] ^ plane[second]).sum(axis=1, dtype=np.int64)
        extreme = max(extreme, unlike.max(), count - unlike.min())
    return _bonferroni(2.0 * stats.binom.sf(extreme - 1, count, 0.5), _BITS * len(first))


def serial(words):
    """Streams interleaved to one: disjoint pairs in 32 × 32 cells, and disjoint triples in 8 × 8 × 8 (Knuth)."""
    mixed = words.T.ravel()
    chances = []
    for size, bits in ((2, 5), (3, 3)):
        groups = (mixed[: len(mixed) // size * size] >> np.uint64(64 - bits)).astype(np.int64).reshape(-1, size)
        cells = groups @ (2 ** (bits * np.arange(size)))
        chances.append(_chi_square(np.bincount(cells, minlength=2 ** (bits * size))))
    return _bonferroni(min(chances), len(chances))


def no_overlap(words):
    """No word occurs twice, in any streams at any places, and so no window does.

    Among m independent words of 64 bits two are equal with a chance below m² / 2^65.
    """
    return min(1.0, words.size**2 / 2.0**65) if len(np.unique(words)) < words.size else 1.0


def normal(values):
    """Standard normal numbers: 256 equally likely cells, moments up to the fourth, numbers beyond 4 deviations."""
    values = np.asarray(values, dtype=np.float64).ravel()
    count = len(values)
    cells = np.minimum((special.ndtr(values) * 256.0).astype(np.int64), 255)
    chances = [_chi_square(np.bincount(cells, minlength=256))]
    for power, mean, variance in ((1, 0.0, 1.0), (2, 1.0, 2.0), (3, 0.0, 15.0), (4, 3.0, 96.0)):
        away = ((values**power).mean() - mean) / np.sqrt(variance / count)
        chances.append(2.0 * stats.norm.sf(abs(away)))
    beyond = int((np.abs(values) > 4.0).sum())
    chances.append(stats.binomtest(beyond, count, 2.0 * stats.norm.sf(4.0)).pvalue)
    return _bonferroni(min(chances), len(chances))


CHECKS = (uniform, uncorrelated, independent_pairs, unlike_bits, serial, no_overlap)
"""The checks of words; `normal` is that of numbers."""


def units(words):
    """Return numbers from 0 up to 1, of 53 bits."""
    return (words >> np.uint64(11)) * 2.0**-53


def words_of(numbers):
    """Return words with the same place among words as standard normal numbers have among normal ones."""
    return (special.ndtr(np.asarray(numbers, dtype=np.float64)) * 2.0**53).astype(np.uint64) << np.uint64(11)


def _chi_square(counts):
    """Return the chance of cells as uneven or as even, shape (..., cells), given 64 words a cell or more."""
    expected = counts.sum(axis=-1, keepdims=True) / counts.shape[-1]
    statistic = ((counts - expected) ** 2 / expected).sum(axis=-1)
    degrees = counts.shape[-1] - 1
    return 2.0 * np.minimum(special.chdtr(degrees, statistic), special.chdtrc(degrees, statistic))


def _bonferroni(chance, looks):
    return min(1.0, float(chance) * looks)
