"""What a laser scanner sees from a robot that stands still: walls, things and people, the nearest on each beam."""

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.simulation.ray_casting import cast, disc_distances
from layoutopt.tracking_world import LaserScanner


def scans(
    laser: LaserScanner,
    robot_pose: tuple[float, float, float],
    walls_m: FloatArray,
    clutter: FloatArray,
    people_m: FloatArray,
    person_radius_m: float,
    draws: np.random.Generator,
) -> FloatArray:
    """Return one scan an instant: on each beam the nearest of walls, clutter and people, with noise.

    Noise is normal and independent from beam to beam and from scan to scan; it makes no range negative, and a
    range that it takes beyond that of the scanner is none. The numbers drawn are the same whatever stands and
    walks about, and a longer drive begins with those of a shorter one. The robot itself hides nothing.

    Parameters
    ----------
    laser
        The scanner, in the middle of the robot.
    robot_pose
        x, y (m) and heading (rad).
    walls_m, clutter
        Walls, shape (w, 4), and discs that stand still, shape (k, 3), as `layoutopt.simulation.ray_casting.cast`
        takes them.
    people_m
        Where the middle of each person is at each instant, shape (n, people, 2), m.
    person_radius_m
        Radius of a person at the height of the beams.
    draws
        Random stream of the scanner.

    Returns
    -------
    numpy.ndarray
        Shape (n, beams), m; infinite where nothing is within range.

    Raises
    ------
    ValueError
        If a place is no finite number, or people have another shape.
    """
    people_m = np.asarray(people_m, dtype=np.float64)
    if people_m.ndim != 3 or people_m.shape[2] != 2:
        raise ValueError(f"people_m has shape {people_m.shape}, needed is (n, people, 2)")
    if not np.isfinite(people_m).all():
        raise ValueError("people_m holds what is no finite number; every person must be somewhere")
    place_m = np.array(robot_pose[:2])
    angles_rad = robot_pose[2] + laser.beam_rad
    at_rest_m = cast(np.tile(place_m, (len(angles_rad), 1)), angles_rad, walls_m, clutter, laser.range_m)
    ranges_m = np.tile(at_rest_m, (len(people_m), 1))
    ahead_x, ahead_y = np.cos(angles_rad), np.sin(angles_rad)
    for person in range(people_m.shape[1]):
        middle_m = people_m[:, person] - place_m
        away_m = disc_distances(ahead_x, ahead_y, middle_m[:, :1], middle_m[:, 1:], person_radius_m)
        np.minimum(ranges_m, away_m, out=ranges_m)
    ranges_m[ranges_m > laser.range_m] = np.inf
    noisy_m = np.maximum(ranges_m + laser.range_sigma_m * draws.standard_normal(ranges_m.shape), 0.0)
    return np.where(noisy_m <= laser.range_m, noisy_m, np.inf)
