"""Two crossed antennas on a platform that turns, and the direction of arrival that a scan of them shows.

Angles are counter-clockwise. The transponder is in the far field, so that only the direction of a wave counts.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from layoutopt.estimators.direction_of_arrival import finite
from layoutopt.identity import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class CrossedAntennas:
    """Two antennas on a platform that turns; their voltages are equal where the platform faces the transponder.

    Attributes
    ----------
    crossing_rad
        Angle between the planes of the antennas; the paper crosses them at a right angle.
    beam_rad
        Full width of each antenna's lobe, from null to null; a loop hears on half the horizon.

    Raises
    ------
    ValueError
        If an angle is outside its range, or no direction lies in both lobes.

    References
    ----------
    kim2009, Eq. 1-3; Fig. 3 sets the zero of the scan where the curves meet.
    """

    crossing_rad: float = math.pi / 2.0
    beam_rad: float = math.pi

    def __post_init__(self) -> None:
        if not 0.0 < self.crossing_rad < math.pi:
            raise ValueError(
                f"crossing_rad is {self.crossing_rad!r}: antennas in one plane have the same voltage everywhere, "
                "so the angle must lie between 0 and pi, both excluded"
            )
        if not 0.0 < self.beam_rad <= math.pi:
            raise ValueError(f"beam_rad is {self.beam_rad!r}, but a lobe is wider than 0 and at most pi")
        apart_rad = math.pi - self.crossing_rad
        if self.beam_rad <= apart_rad:
            raise ValueError(
                f"the antennas do not overlap: their lobes face {math.degrees(apart_rad):.6g} degrees apart and "
                f"are {math.degrees(self.beam_rad):.6g} wide; widen the lobes or cross the antennas more"
            )

    def voltages(self, scan_rad: ArrayLike, bearings_rad: ArrayLike, amplitudes: ArrayLike) -> FloatArray:
        """Return both voltages at each angle of a scan, shape (2, scans).

        Parameters
        ----------
        scan_rad
            Where the platform faces, shape (scans,).
        bearings_rad, amplitudes
            The waves that arrive: directions that they come from, and signed amplitudes, shape (waves,).

        Raises
        ------
        ValueError
            If a number is not finite or the waves do not fit together.

        References
        ----------
        kim2009, Eq. 2 and 4: fluxes add up with their signs, a voltage is the size of the sum.
        """
        scan = finite("scan_rad", scan_rad)
        bearings, waves = finite("bearings_rad", bearings_rad), finite("amplitudes", amplitudes)
        if scan.ndim != 1 or bearings.ndim != 1 or bearings.shape != waves.shape:
            raise ValueError(
                f"scan_rad needs one axis, and bearings_rad and amplitudes one of the same length, "
                f"got shapes {scan.shape}, {bearings.shape} and {waves.shape}"
            )
        off = scan[:, None] - bearings[None, :]
        volts = []
        for side in (0.5, -0.5):
            angle = off + side * self.crossing_rad
            # A lobe's middle is where the flux is largest; the antenna hears alike from both of its sides.
            from_middle = np.abs(np.angle(np.exp(2j * (angle - math.pi / 2.0)))) / 2.0
            heard = from_middle < self.beam_rad / 2.0
            volts.append(np.abs(np.where(heard, np.sin(angle), 0.0) @ waves))
        return np.array(volts)


def scanned_direction(scan_rad: ArrayLike, first: ArrayLike, second: ArrayLike) -> float:
    """Return the direction of arrival that a scan shows, rad: where the ratio of two voltages rises through one.

    Between neighbouring angles (V1 - V2) / (V1 + V2) is taken as straight, which for antennas at right angles is
    the tangent of the angle off. Of several such crossovers, as noise may make, the strongest counts.

    Parameters
    ----------
    scan_rad
        Angles of the platform, rising, shape (scans,).
    first, second
        Voltages of the antennas at these angles, shape (scans,), zero or positive.

    Raises
    ------
    ValueError
        If a number is not finite or negative, shapes differ, the antennas do not overlap, or the ratio does not
        rise through one within the scan.

    References
    ----------
    kim2009, Section II and Fig. 3: minimum, crossover and maximum of the ratio.

    Examples
    --------
    >>> scan_rad = np.radians(np.arange(-90.0, 91.0))
    >>> volts = CrossedAntennas().voltages(scan_rad, [math.radians(20.25)], [1.0])
    >>> round(math.degrees(scanned_direction(scan_rad, *volts)), 3)
    20.25
    """
    scan, one, two = finite("scan_rad", scan_rad), finite("first", first), finite("second", second)
    if scan.ndim != 1 or len(scan) < 2 or scan.shape != one.shape or scan.shape != two.shape:
        raise ValueError(
            "a scan needs two angles or more with both voltages, "
            f"got shapes {scan.shape}, {one.shape} and {two.shape}"
        )
    if not (np.diff(scan) > 0.0).all():
        raise ValueError("the angles of a scan must rise; sort them with their voltages")
    if (one < 0.0).any() or (two < 0.0).any():
        raise ValueError("a voltage is negative; take its size, or remove the offset of the receiver with care")
    both = (one > 0.0) & (two > 0.0)
    if not both.any():
        raise ValueError("the antennas do not overlap: at no angle of the scan do both receive the transponder")
    total = one + two
    tilt = np.divide(one - two, total, out=np.zeros_like(total), where=total > 0.0)
    # A null of one antenna may fall on an angle, so one end of a step may have a single voltage, not both ends.
    rising = (
        (tilt[:-1] < 0.0) & (tilt[1:] >= 0.0) & (both[:-1] | both[1:]) & (total[:-1] > 0.0) & (total[1:] > 0.0)
    )
    steps = np.flatnonzero(rising)
    if not len(steps):
        raise ValueError("the ratio does not rise through one within the scan; turn the platform and scan again")
    step = steps[np.argmax((total[:-1] + total[1:])[steps])]
    share = -tilt[step] / (tilt[step + 1] - tilt[step])
    return float(scan[step] + share * (scan[step + 1] - scan[step]))
