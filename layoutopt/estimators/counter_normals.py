"""Normal numbers from a counter: the plain form, and the truth for `counter_normals_kernels`.

A counter-based generator has no state: the numbers of a step follow from seed, step and purpose alone, in any
order, and eight of them at a time fit a vector register.
"""

from enum import IntEnum, unique
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray, WordArray

ROUNDS: Final = 10
MULTIPLIERS: Final = (0xD2511F53, 0xCD9E8D57)
KEY_STEPS: Final = (0x9E3779B9, 0xBB67AE85)
"""Constants of Philox4x32-10."""


@unique
class Draw(IntEnum):
    """What a filter draws numbers for; the third word of the counter."""

    NORMALS = 0
    RESAMPLING = 1
    RESTART = 2
    RESTART_PARTNER = 3


def philox_words(key: tuple[int, int], step: int, draw: Draw, count: int) -> WordArray:
    """Return the words of the counters (0, step, draw, 0) to (count - 1, step, draw, 0), shape (4, count).

    ``key`` are two 32-bit words.

    References
    ----------
    Salmon, Moraes, Dror, Shaw: Parallel random numbers: as easy as 1, 2, 3, SC 2011: Philox4x32-10, which
    passes the BigCrush tests.

    Examples
    --------
    >>> [hex(word) for word in philox_words((0, 0), 0, Draw.NORMALS, 1)[:, 0].tolist()]
    ['0x6627e8d5', '0xe169c58d', '0xbc57ac4c', '0x9b00dbd8']
    """
    mask = np.uint64(0xFFFFFFFF)
    counter = [np.arange(count, dtype=np.uint64), *(np.full(count, word, np.uint64) for word in (step, draw, 0))]
    first, second = key
    for _ in range(ROUNDS):
        left, right = (
            np.uint64(factor) * counter[place] for factor, place in zip(MULTIPLIERS, (0, 2), strict=True)
        )
        counter = [
            (right >> np.uint64(32)) ^ counter[1] ^ np.uint64(first),
            right & mask,
            (left >> np.uint64(32)) ^ counter[3] ^ np.uint64(second),
            left & mask,
        ]
        first, second = ((word + step) & 0xFFFFFFFF for word, step in zip((first, second), KEY_STEPS, strict=True))
    return np.array(counter).astype(np.uint32)


def normals(key: tuple[int, int], step: int, count: int) -> FloatArray:
    """Return at least ``count`` standard normal numbers of a step, a multiple of 32 of them.

    The first and second words of all counters give one half, the third and fourth the other, by the polar
    coordinates of Box and Muller (Ann. Math. Statist. 29, 1958). A radius comes from 24 bits, so no number lies
    beyond 5.9.
    """
    words = philox_words(key, step, Draw.NORMALS, blocks(count)).astype(np.float64)
    # The one rounding of the kernel that counts: close to 1 a float32 has no room for the last bit.
    uniform = (np.floor(words[0::2] / 256.0) * 2.0**-24 + 2.0**-25).astype(np.float32).astype(np.float64)
    radius = np.sqrt(-2.0 * np.log(uniform))
    angle_rad = 2.0 * np.pi * words[1::2] * 2.0**-32
    return np.stack([radius * np.cos(angle_rad), radius * np.sin(angle_rad)], axis=1).reshape(-1)


def blocks(count: int) -> int:
    """Return how many counters give ``count`` numbers: four each, in eights.

    Examples
    --------
    >>> blocks(1500)
    376
    """
    return -(-count // 32) * 8


def key_words(draws: np.random.Generator) -> tuple[int, int]:
    """Return the key of a filter's own numbers, drawn from the stream that a trial gives it."""
    first, second = draws.integers(0, 2**32, size=2).tolist()
    return first, second
