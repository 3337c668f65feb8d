"""Radial velocity of a UHF tag from the phases of two readings, and how far such a velocity can be told."""

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from layoutopt.identity import FloatArray
from layoutopt.tracking_world import SPEED_OF_LIGHT_M_S

PHASE_BITS: Final = 12
"""Bits of the word in which readers of the class that liang2020 uses tell a phase (Eq. 9)."""
ALIASES: Final = ("signed", "two hypotheses", "three aliases", "literal")
"""How many velocities are read from a pair of phases; see `phase_velocities`."""


def wavelength_m(frequency_hz: float) -> float:
    """Return the wavelength of a frequency.

    Raises
    ------
    ValueError
        If the frequency is not positive and finite, so that there is no wavelength.
    """
    if not 0.0 < frequency_hz < math.inf:
        raise ValueError(
            f"a phase is measured at a positive, finite frequency, such as 920e6 Hz, not at {frequency_hz!r} Hz, "
            "which has no wavelength"
        )
    return SPEED_OF_LIGHT_M_S / frequency_hz


def phase_displacement(
    word_before: ArrayLike,
    word_after: ArrayLike,
    frequency_hz: float,
    *,
    bits: int = PHASE_BITS,
    literal: bool = False,
) -> FloatArray:
    """Return by how much a tag went away between two readings on one channel, as their phases tell it.

    The way to the tag and back makes the phase repeat with every half wavelength, so the answer is that of the
    displacements half a wavelength apart which is nearest to zero: in [-lambda / 4, lambda / 4). The difference
    of two words wraps where the word does; Eq. 9 does not say so, and taken literally (``literal``) it is off by
    half a wavelength whenever the phase passes zero.

    Parameters
    ----------
    word_before, word_after
        Phase words, in steps of a turn over 2^bits; of any shapes that go together.
    frequency_hz
        Channel of both.
    bits
        Bits of a word.
    literal
        Whether to leave the difference as it is, in (-lambda / 2, lambda / 2).

    Raises
    ------
    ValueError
        If a word does not lie in [0, 2^bits), it has no bit, or the frequency is not positive and finite.

    References
    ----------
    liang2020, Eq. 8-9.

    Examples
    --------
    >>> phase_displacement(4000, 100, 920e6).round(6).item()
    0.007796
    """
    half_m = wavelength_m(frequency_hz) / 2.0
    if bits < 1:
        raise ValueError(f"a phase word has a bit or more, got {bits}")
    steps = 1 << bits
    before, after = np.asarray(word_before), np.asarray(word_after)
    for word in (before, after):
        if not ((word == np.floor(word)) & (word >= 0) & (word < steps)).all():
            raise ValueError(f"phase words of {bits} bits are whole numbers from 0 to {steps - 1}")
    turn = after.astype(np.int64) - before.astype(np.int64)
    if not literal:
        turn = (turn + steps // 2) % steps - steps // 2
    return np.asarray(turn / steps * half_m)


def phase_velocities(
    displacement_m: float, interval_s: float, frequency_hz: float, aliases: str = "two hypotheses"
) -> FloatArray:
    """Return the radial velocities that a displacement from phases may stand for, shape (hypotheses,).

    ``"signed"`` believes the displacement nearest to zero, right up to lambda / (4 dt). ``"two hypotheses"``
    adds the one of the other sign: together right up to lambda / (2 dt), as far as liang2020's bound on the
    displacement goes. ``"three aliases"`` adds half a wavelength on either side, right up to 3 lambda / (4 dt).
    ``"literal"`` takes the displacement of Eq. 9 as it stands.

    Raises
    ------
    ValueError
        If the interval or the frequency is not positive and finite, or ``aliases`` is none of `ALIASES`.

    References
    ----------
    liang2020, Eq. 10.
    """
    _check_interval(interval_s)
    half_m = wavelength_m(frequency_hz) / 2.0
    if aliases in ("signed", "literal"):
        shifts = [0.0]
    elif aliases == "two hypotheses":
        shifts = [0.0, -math.copysign(half_m, displacement_m)]
    elif aliases == "three aliases":
        shifts = [0.0, -half_m, half_m]
    else:
        raise ValueError(f"aliases are one of {', '.join(ALIASES)}, not {aliases!r}")
    return (displacement_m + np.array(shifts)) / interval_s


def speed_limit(frequency_hz: float, interval_s: float, signed: bool = True) -> float:
    """Return the radial speed below which two phases an interval apart tell the velocity, m/s.

    With the sign of the displacement told by the phases alone (``signed``) it is lambda / (4 dt); lambda / (2 dt)
    where the sign is known or left open.

    Raises
    ------
    ValueError
        If the interval or the frequency is not positive and finite.

    References
    ----------
    liang2020, Eq. 9, d_r < lambda / 2; the signed limit follows from the wrapping.

    Examples
    --------
    >>> round(speed_limit(920e6, 0.4), 4), round(speed_limit(920e6, 0.4, signed=False), 4)
    (0.2037, 0.4073)
    """
    _check_interval(interval_s)
    return wavelength_m(frequency_hz) / ((4.0 if signed else 2.0) * interval_s)


def similarity(speed_laser_m_s: ArrayLike, speed_phase_m_s: ArrayLike) -> FloatArray:
    """Return how well radial velocities from laser and phase agree: 1 if equal, 0 if of opposite sign.

    Two that are both zero, 0 / 0 in Eq. 11, are equal: 1.

    Raises
    ------
    ValueError
        If a velocity is not finite.

    References
    ----------
    liang2020, Eq. 11.

    Examples
    --------
    >>> similarity([0.3, 0.0, 0.0, -0.1], [0.1, 0.1, 0.0, 0.1]).tolist()
    [0.5, 0.0, 1.0, 0.0]
    """
    laser, phase = np.asarray(speed_laser_m_s, dtype=np.float64), np.asarray(speed_phase_m_s, dtype=np.float64)
    if not (np.isfinite(laser).all() and np.isfinite(phase).all()):
        raise ValueError("velocities that are compared must be finite")
    apart, total = np.abs(laser - phase), np.abs(laser) + np.abs(phase)
    return np.asarray(1.0 - np.divide(apart, total, out=np.zeros_like(total), where=total > 0.0))


def _check_interval(interval_s: float) -> None:
    if not 0.0 < interval_s < math.inf:
        raise ValueError(f"an interval must be positive and finite, got {interval_s!r} s")
