"""How scattered waves turn a direction of arrival, and the published correction from three positions.

Angles are counter-clockwise. What a robot measures is a ratio of two signal strengths, and what follows from it is
a bearing, so nothing here is an estimator of the robot's own pose. The strength of a wave falls with the way that
it went (far field).
"""

import math
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from layoutopt.identity import BoolArray, FloatArray, by_content, read_only

TRIALS_RAD: Final = np.radians(np.arange(-70.0, 70.1, 5.0))
"""Errors that the published correction tries (kim2009, Algorithm 1)."""
_PARALLEL: Final = 1e-9
"""Sine of the angle below which two lines are taken as parallel: rounding alone makes as much."""


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DirectionError:
    """What scattered waves do to the direction of arrival, in the shape of the receivers.

    Attributes
    ----------
    error_rad
        Direction that the antennas show less the true one, in [-pi, pi] (eta of Eq. 11b).
    amplitude_ratio
        Amplitude of all waves together over that of an undisturbed direct wave (A / a0 of Eq. 11a).
    """

    error_rad: FloatArray
    amplitude_ratio: FloatArray
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        object.__setattr__(self, "error_rad", read_only(self.error_rad))
        object.__setattr__(self, "amplitude_ratio", read_only(self.amplitude_ratio))


def direction_error(
    receiver_m: ArrayLike,
    transponder_m: ArrayLike,
    scatterers_m: ArrayLike,
    reflection: ArrayLike,
    wavelength_m: float,
    *,
    images_m: ArrayLike = (),
    image_reflection: ArrayLike = 0.0,
    direct: ArrayLike = 1.0,
) -> DirectionError:
    """Return how far scattered waves turn the direction of arrival, and what they do to its amplitude.

    A wave by way of scatterer i has, against the direct one, the amplitude R_i r0 / (r0 + dr_i) cos(2 pi dr_i /
    lambda) and the direction gamma_i; r0 + dr_i is the whole way from transponder over scatterer to receiver. The
    paper's Eq. 7 leaves the phase to the instant; the cosine is the part in phase with the direct wave, and the
    reading under which Table I comes out. Directions are told over the full circle (arctan of two arguments),
    where the printed Eq. 11b ends at a right angle.

    Parameters
    ----------
    receiver_m
        Places of the receiver, shape (..., 2), m.
    transponder_m
        Place of the transponder, shape (2,), m.
    scatterers_m
        Places where waves scatter, shape (k, 2), or (..., k, 2) if each receiver has its own, m.
    reflection
        Share R of the amplitude that a scatterer sends on, 0 to 1, one number, shape (k,), or (..., k) if it
        differs from receiver to receiver, as where walls hide scatterers.
    wavelength_m
        Wavelength, m.
    images_m, image_reflection
        Mirror images of the transponder in walls, shape (w, 2), m, and the share that a wall reflects, one number,
        shape (w,) or (..., w).
    direct
        Share of the direct wave that arrives, 0 to 1, one number or in the shape of the receivers.

    Raises
    ------
    ValueError
        If a number is not finite or outside its range, shapes differ, a receiver lies on the transponder or a
        scatterer, the transponder on a scatterer, or all waves together are nothing.

    References
    ----------
    kim2009, Eq. 4-11.

    Examples
    --------
    >>> found = direction_error([3.0, 0.0], [0.0, 0.0], [[1.0, 1.0]], 0.5, 0.988761)
    >>> round(math.degrees(float(found.error_rad)), 3), round(float(found.amplitude_ratio), 3)
    (7.189, 0.805)
    """
    receiver, transponder = _places("receiver_m", receiver_m), _places("transponder_m", transponder_m)
    scatterers, images = _places("scatterers_m", scatterers_m), _places("images_m", images_m)
    wavelength = float(finite("wavelength_m", wavelength_m))
    if wavelength <= 0.0:
        raise ValueError(f"wavelength_m is {wavelength!r}, but a wave has a positive length")
    if transponder.shape != (2,):
        raise ValueError(f"transponder_m is one place, shape (2,), got shape {transponder.shape}")
    if scatterers.ndim < 2 or scatterers.shape[:-2] not in ((), receiver.shape[:-1]):
        raise ValueError(
            f"scatterers_m has shape {scatterers.shape}, but needs (k, 2), or one such set for each receiver"
        )
    if images.ndim != 2:
        raise ValueError(f"images_m has shape {images.shape}, but needs (w, 2)")
    received = _share("direct", direct, receiver.shape[:-1])
    to_transponder = transponder - receiver
    straight_m = np.hypot(to_transponder[..., 0], to_transponder[..., 1])
    _check_apart(straight_m, "receiver", "the transponder")
    ahead = to_transponder / straight_m[..., None]
    along, across = np.broadcast_to(received, straight_m.shape).copy(), np.zeros(straight_m.shape)
    first_m = np.hypot(*np.moveaxis(scatterers - transponder, -1, 0))
    _check_apart(first_m, "transponder", "a scatterer")
    sent_on = _share("reflection", reflection, scatterers.shape[-2:-1], receiver.shape[:-1])
    mirrored = _share("image_reflection", image_reflection, images.shape[:1], receiver.shape[:-1])
    for places, before_m, share in (
        (scatterers, first_m, sent_on),
        (images, np.zeros(len(images)), mirrored),
    ):
        way = places - receiver[..., None, :]
        last_m = np.hypot(way[..., 0], way[..., 1])
        _check_apart(last_m, "receiver", "a scatterer")
        whole_m = before_m + last_m
        phase = (whole_m - straight_m[..., None]) * (2.0 * math.pi / wavelength)
        wave = share * straight_m[..., None] / whole_m * np.cos(phase) / last_m
        along += (wave * (ahead[..., None, 0] * way[..., 0] + ahead[..., None, 1] * way[..., 1])).sum(axis=-1)
        across += (wave * (ahead[..., None, 0] * way[..., 1] - ahead[..., None, 1] * way[..., 0])).sum(axis=-1)
    amplitude = np.hypot(along, across)
    if (amplitude == 0.0).any():
        raise ValueError(
            f"no wave is left at {int((amplitude == 0.0).sum())} of the receivers, so no direction either; "
            "a blocked direct wave needs something that reflects"
        )
    return DirectionError(error_rad=np.arctan2(across, along), amplitude_ratio=amplitude)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DirectionCorrection:
    """What the published correction finds, in the leading shape of its input.

    Attributes
    ----------
    error_rad
        What to add to the last direction (eta_i, since phi_i = theta_i + eta_i); zero where nothing was found.
    found
        Whether any trial value made a triangle; three readings at one place make none.
    size_m
        Size of the smallest triangle, |x| of Eq. 17, m; zero where nothing was found.
    """

    error_rad: FloatArray
    found: BoolArray
    size_m: FloatArray
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        object.__setattr__(self, "error_rad", read_only(self.error_rad))
        object.__setattr__(self, "size_m", read_only(self.size_m))
        found = np.array(self.found, dtype=np.bool_)
        found.setflags(write=False)
        object.__setattr__(self, "found", found)


def correct_direction(
    directions_rad: ArrayLike, ranges_m: ArrayLike, moves_m: ArrayLike, turns_rad: ArrayLike
) -> DirectionCorrection:
    """Return the error of the last of three directions of arrival after the published correction.

    It tries errors from -70 to 70 degrees. Each follows, by the law of sines, back to the two positions before;
    the error is right whose three lines cross nearest to one point. Three repairs of the printed text: the
    smallest size |x| wins, where the printed signed x ends at the border of the range; Eq. 14b holds theta_{i-1},
    not theta_{i+1}, and the turn that the robot really made takes its place there, in Eq. 13b and in Eq. 16b,
    since a corrected robot does not follow what it measured; trial values without an arc sine and parallel lines
    are left out, but for three lines that are one, which agree. Ranges that break the bound of Eq. 19 are replaced
    as in Algorithm 1.

    The correction is ill-conditioned: near the true error |x| is almost flat. See `bearing_filter` for a robust
    one.

    Parameters
    ----------
    directions_rad
        Directions of arrival against the heading at positions i-2, i-1 and i, shape (..., 3). The paper lists all
        three as input; its equations use the last, and the middle one only through the turn.
    ranges_m
        Distances to the transponder at the three positions, shape (..., 3), m.
    moves_m
        Ways from i-2 to i-1 and from i-1 to i, shape (..., 2), m.
    turns_rad
        Turns that the robot made at i-2 and i-1 before it moved on, shape (..., 2); only the last enters.

    Raises
    ------
    ValueError
        If a number is not finite, a range is not positive, a move negative, or shapes do not fit.

    References
    ----------
    kim2009, Eq. 12-19, Algorithm 1.
    """
    directions, ranges = _rows("directions_rad", directions_rad, 3), _rows("ranges_m", ranges_m, 3)
    moves, turns = _rows("moves_m", moves_m, 2), _rows("turns_rad", turns_rad, 2)
    if not directions.shape[:-1] == ranges.shape[:-1] == moves.shape[:-1] == turns.shape[:-1]:
        raise ValueError("directions_rad, ranges_m, moves_m and turns_rad need the same number of rows")
    if (ranges <= 0.0).any():
        raise ValueError(
            "ranges_m holds a distance that is not positive; a transponder at the reader has no direction"
        )
    if (moves < 0.0).any():
        raise ValueError("moves_m holds a negative way; turn the robot by pi instead")
    latest_m = ranges[..., 2]
    middle_m = _bounded(ranges[..., 1], latest_m, moves[..., 1])
    oldest_m = _bounded(ranges[..., 0], middle_m, moves[..., 0])
    # Trial values on a new last axis; angles clockwise from the line of the trial value, as in Fig. 10.
    heading = directions[..., 2, None] + TRIALS_RAD
    turn = turns[..., 1, None]
    middle_sine = (latest_m / middle_m)[..., None] * np.sin(heading)
    middle_error = np.arcsin(np.clip(middle_sine, -1.0, 1.0))
    oldest_sine = (middle_m / oldest_m)[..., None] * np.sin(turn + middle_error)
    oldest_error = np.arcsin(np.clip(oldest_sine, -1.0, 1.0))
    middle_x = -moves[..., 1, None] * np.sin(heading)
    back_x, back_y = -moves[..., 0, None] * np.sin(heading + turn), -moves[..., 0, None] * np.cos(heading + turn)
    one, two = heading - middle_error, heading + turn - oldest_error
    # Lines through (x, y) along (sin, cos): Eq. 17 without its cotangents, which are infinite on the y axis.
    crossing = np.sin(two - one)
    parallel = np.abs(crossing) < _PARALLEL
    along = (np.sin(two) * back_y - np.cos(two) * back_x) / np.where(parallel, 1.0, crossing)
    size_m = np.abs(middle_x + along * np.sin(one))
    # Three lines that are one agree: a straight drive at the transponder. Other parallels have no crossing.
    aside = np.maximum(np.maximum(np.abs(middle_x), np.abs(middle_x + back_x)), np.abs(np.sin(one)))
    size_m = np.where(parallel, np.where(aside < _PARALLEL, 0.0, np.inf), size_m)
    stood = (moves == 0.0).all(axis=-1)[..., None]
    size_m = np.where(stood | (np.abs(middle_sine) > 1.0) | (np.abs(oldest_sine) > 1.0), np.inf, size_m)
    best = size_m.argmin(axis=-1)
    smallest_m = np.take_along_axis(size_m, best[..., None], axis=-1)[..., 0]
    found = np.isfinite(smallest_m)
    return DirectionCorrection(
        error_rad=np.where(found, TRIALS_RAD[best], 0.0),
        found=found,
        size_m=np.where(found, smallest_m, 0.0),
    )


def _bounded(before_m: FloatArray, after_m: FloatArray, move_m: FloatArray) -> FloatArray:
    """Return the range before a move, replaced where it exceeds the range after it by more than the move."""
    return np.where(before_m - after_m > move_m, after_m + move_m / 2.0, before_m)


def finite(name: str, values: ArrayLike) -> FloatArray:
    """Return values as float64.

    Raises
    ------
    ValueError
        If one is NaN or infinite, or no number.
    """
    array = np.asarray(values, dtype=np.float64)
    if not np.isfinite(array).all():
        raise ValueError(
            f"{name} holds {int((~np.isfinite(array)).sum())} numbers that are not finite; leave them out"
        )
    return array


def _places(name: str, values: ArrayLike) -> FloatArray:
    """Return places, shape (..., 2); an empty list is no place."""
    places = finite(name, values)
    if places.shape == (0,):
        return places.reshape(0, 2)
    if places.ndim == 0 or places.shape[-1] != 2:
        raise ValueError(f"{name} needs x and y on its last axis, got shape {places.shape}")
    return places


def _rows(name: str, values: ArrayLike, count: int) -> FloatArray:
    """Return numbers with so many on the last axis."""
    rows = finite(name, values)
    if rows.ndim == 0 or rows.shape[-1] != count:
        raise ValueError(f"{name} needs {count} numbers on its last axis, got shape {rows.shape}")
    return rows


def _share(name: str, values: ArrayLike, shape: tuple[int, ...], receivers: tuple[int, ...] = ()) -> FloatArray:
    """Return shares of an amplitude, one for all, each its own, or each its own at each receiver."""
    share = finite(name, values)
    if share.shape not in ((), shape, (*receivers, *shape)):
        each = f" or {(*receivers, *shape)}" if receivers else ""
        raise ValueError(f"{name} is one number or has shape {shape}{each}, got shape {share.shape}")
    if ((share < 0.0) | (share > 1.0)).any():
        raise ValueError(
            f"{name} is the share of an amplitude, so between 0 and 1, got {share.min():g} to {share.max():g}"
        )
    return share


def _check_apart(distance_m: FloatArray, what: str, other: str) -> None:
    """Refuse places that are one."""
    if (distance_m == 0.0).any():
        raise ValueError(f"a {what} lies on {other}, where a wave has no direction; move it")
