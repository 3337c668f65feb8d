"""Compiled normal numbers from a counter; the plain twin and truth is `counter_normals`."""

import math
from typing import Any, Final

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

from layoutopt.identity import Float32Array, WordArray

# In kernels every constant has its width: a plain Python number would widen the sum, and halve the lanes.
_F: Final = np.float32
_W: Final = np.uint32
_SHIFT: Final = np.uint64(32)
_MULTIPLIER_0: Final = np.uint64(0xD2511F53)
_MULTIPLIER_1: Final = np.uint64(0xCD9E8D57)
_KEY_STEP_0: Final = np.uint32(0x9E3779B9)
_KEY_STEP_1: Final = np.uint32(0xBB67AE85)
_compiled = njit(cache=True, error_model="numpy")


def _float_of(context: Any, word: Any) -> Any:
    """Return the float32 that has the bits of a word."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.bitcast(arguments[0], ir.FloatType())

    return types.float32(types.uint32), generate


def _word_of(context: Any, number: Any) -> Any:
    """Return the bits of a float32 as a word."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.bitcast(arguments[0], ir.IntType(32))

    return types.uint32(types.float32), generate


def _fused(context: Any, factor: Any, other: Any, term: Any) -> Any:
    """Return factor * other + term, rounded once: one instruction, and the same bits wherever it is compiled."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.fma(*arguments)

    return types.float32(types.float32, types.float32, types.float32), generate


fused: Final[Any] = intrinsic(_fused)
float_of: Final[Any] = intrinsic(_float_of)
word_of: Final[Any] = intrinsic(_word_of)


@_compiled
def philox_words(key_0: int, key_1: int, step: int, draw: int, first: int, out: WordArray) -> None:
    """Write the words of the counters from ``first`` on, as many as ``out``, shape (4, n), has columns."""
    for column in range(out.shape[1]):
        word_0, word_1, word_2, word_3 = _W(first + column), _W(step), _W(draw), _W(0)
        round_0, round_1 = _W(key_0), _W(key_1)
        for _ in range(10):
            left, right = _MULTIPLIER_0 * np.uint64(word_0), _MULTIPLIER_1 * np.uint64(word_2)
            word_0, word_1, word_2, word_3 = (
                _W(_W(right >> _SHIFT) ^ word_1 ^ round_0),
                _W(right),
                _W(_W(left >> _SHIFT) ^ word_3 ^ round_1),
                _W(left),
            )
            round_0, round_1 = _W(round_0 + _KEY_STEP_0), _W(round_1 + _KEY_STEP_1)
        out[0, column], out[1, column], out[2, column], out[3, column] = word_0, word_1, word_2, word_3


@_compiled
def box_muller(for_radius: WordArray, for_angle: WordArray, cosines: Float32Array, sines: Float32Array) -> None:
    """Write two normals for each pair of words: products and sums only, eight pairs at a time."""
    for m in range(for_radius.size):
        uniform = fused(_F(np.int32(for_radius[m] >> _W(8))), _F(2.0**-24), _F(2.0**-25))
        bits = word_of(uniform)
        exponent = _F(np.int32(bits >> _W(23)) - np.int32(127))
        mantissa = float_of(_W((bits & _W(0x7FFFFF)) | _W(0x3F800000)))
        large = mantissa > _F(1.41421356)
        x = (mantissa * _F(0.5) if large else mantissa) - _F(1.0)
        exponent += _F(1.0) if large else _F(0.0)
        # ln(1 + x) for sqrt(1/2) < 1 + x < sqrt(2), by the polynomial of Cephes' logf.
        series = _F(7.0376836292e-2)
        series = fused(series, x, -_F(1.1514610310e-1))
        series = fused(series, x, _F(1.1676998740e-1))
        series = fused(series, x, -_F(1.2420140846e-1))
        series = fused(series, x, _F(1.4249322787e-1))
        series = fused(series, x, -_F(1.6668057665e-1))
        series = fused(series, x, _F(2.0000714765e-1))
        series = fused(series, x, -_F(2.4999993993e-1))
        series = fused(series, x, _F(3.3333331174e-1))
        logarithm = fused(exponent, _F(0.693147180559945), fused(fused(series, x, -_F(0.5)), x * x, x))
        radius = math.sqrt(_F(-2.0) * logarithm)
        turns = _F(np.int32(for_angle[m])) * _F(2.0**-32)
        away = abs(turns)
        folded = _F(0.5) - away if away > _F(0.25) else away
        sine = _sine_of_turns(folded)
        cosines[m] = radius * _sine_of_turns(_F(0.25) - away)
        sines[m] = radius * (-sine if turns < _F(0.0) else sine)


@njit(inline="always")
def _sine_of_turns(turns: Any) -> Any:
    """Return sin(2 pi t) for up to a quarter turn, by its Taylor series."""
    q = turns * turns
    series = fused(q, fused(q, _F(-15.09464258), _F(42.05869394)), _F(-76.70585975))
    return turns * fused(q, fused(q, fused(q, series, _F(81.60524928)), _F(-41.34170224)), _F(6.28318531))


@_compiled
def normals(key_0: int, key_1: int, step: int, words: WordArray, out: Float32Array) -> None:
    """Write the normals of a step to ``out``, shape (4, n); ``words``, as large, is scratch."""
    philox_words(key_0, key_1, step, 0, 0, words)
    box_muller(words[0], words[1], out[0], out[1])
    box_muller(words[2], words[3], out[2], out[3])
