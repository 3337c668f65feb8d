"""Logs of real drives: one CSV file of odometry, tag reads and, where it is known, the true path.

The first line names the columns, in any order:

``time_s``
    Time stamp, s, from any origin. Rows are in the order of time; two rows of odometry never share a time.
``odom_x_m``, ``odom_y_m``, ``odom_theta_rad``
    Pose by odometry alone, in a frame of its own, as ``nav_msgs/Odometry`` has it. Or instead:
``forward_m``, ``left_m``, ``turn_rad``
    Motion since the previous row of odometry in the robot's frame before it; that of the first row does not count.
``gyro_turn_rad``
    Optional: turn since the previous row of odometry by the gyro alone.
``reads``
    Tags read since the previous row as ``antenna:tag``, separated by spaces; antennas as numbered in
    ``readers.yaml`` and on the sheet, from 0, tags by their ``tag_id`` in ``tags.csv``; ``3:?`` for a tag that is
    not in the tag map.
``scans``
    Optional: antennas that scanned since the previous row, read or not, separated by spaces.
``truth_x_m``, ``truth_y_m``, ``truth_theta_rad``
    Optional: true pose of ``base_link`` in the frame ``map``, in any rows.

Cells may be empty: a row brings odometry, reads, scans, truth or several of them, so that exports of several
topics can be merged by time.
"""

import csv
import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from layoutopt.atomic_file import replacing
from layoutopt.identity import FloatArray, IntArray
from layoutopt.layout import Layout, TagMap
from layoutopt.readings import UNKNOWN_TAG
from layoutopt.simulation.motion import integrate

if TYPE_CHECKING:
    from layoutopt.simulation.trials import TrialRecord

POSE: Final = ("odom_x_m", "odom_y_m", "odom_theta_rad")
MOTION: Final = ("forward_m", "left_m", "turn_rad")
TRUTH: Final = ("truth_x_m", "truth_y_m", "truth_theta_rad")
COLUMNS: Final = ("time_s", *POSE, *MOTION, "gyro_turn_rad", "reads", "scans", *TRUTH)
FOREIGN_TAG: Final = "?"


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveLog:
    """One logged drive, in columns.

    Attributes
    ----------
    file
        Name of the file, for messages.
    time_s, poses
        Times of the rows with odometry, shape (n,), and the poses by odometry alone, shape (n, 3), from the first
        pose (0, 0, 0) and with a continuous heading. Jumps that no robot makes are taken out.
    jumps
        Rows before which such a jump was taken out, shape (j,).
    gyro_rad
        Heading by the gyro alone at those times, from 0, shape (n,), or ``None``.
    read_time_s, read_antenna, read_tag
        Time of each read, index of its antenna among those that read tags, and index of the tag in the tag map or
        `UNKNOWN_TAG`.
    scan_time_s, scan_antenna
        Time and antenna of each scan, or ``None`` if the log does not say which antennas scanned.
    truth_time_s, truth
        Times, shape (k,), and true poses, shape (k, 3), with a continuous heading; empty if not known.
    notes
        What was left out, one sentence each.
    """

    file: str
    time_s: FloatArray
    poses: FloatArray
    jumps: IntArray
    gyro_rad: FloatArray | None
    read_time_s: FloatArray
    read_antenna: IntArray
    read_tag: IntArray
    scan_time_s: FloatArray | None
    scan_antenna: IntArray | None
    truth_time_s: FloatArray
    truth: FloatArray
    notes: tuple[str, ...] = ()


def antenna_indices(layout: Layout) -> Mapping[int, int]:
    """Return number (on the sheet, through all groups) and index (in readings) of each antenna that reads tags."""
    kinds = [group.kind for group in layout.readers for _ in range(group.count)]
    numbers = [number for number, kind in enumerate(kinds) if kind == "tag_read"]
    return {number: index for index, number in enumerate(numbers)}


def write_log(path: str | os.PathLike[str], record: "TrialRecord", *, layout: Layout, tag_map: TagMap) -> None:
    """Write a simulated trial as the log that its robot would have left, with truth and scans."""
    observations, true = record.observations, record.drive.poses
    numbers = {index: number for number, index in antenna_indices(layout).items()}
    identity = {UNKNOWN_TAG: FOREIGN_TAG, **{row: str(tag) for row, tag in enumerate(tag_map.ids.tolist())}}
    poses = integrate((0.0, 0.0, 0.0), observations.increments)
    with_gyro = bool(np.isfinite(observations.gyro_sigma_rad).all())
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as stream:
        out = csv.writer(stream, lineterminator="\n")
        out.writerow(["time_s", *POSE, *(["gyro_turn_rad"] if with_gyro else []), "reads", "scans", *TRUTH])
        for row in range(len(poses)):
            first, last = (0, 0) if row == 0 else observations.read_start[row - 1 : row + 1]
            reads = [
                f"{numbers[int(observations.read_antenna[read])]}:{identity[int(observations.read_tag[read])]}"
                for read in range(int(first), int(last))
            ]
            scans = (
                [] if row == 0 else [str(numbers[int(a)]) for a in np.flatnonzero(observations.active[row - 1])]
            )
            gyro = [] if not with_gyro else [_cell(observations.gyro_turn_rad[row - 1]) if row else "0"]
            out.writerow(
                [
                    _cell(row * observations.step_s),
                    *(_cell(value) for value in poses[row]),
                    *gyro,
                    " ".join(reads),
                    " ".join(scans),
                    *(_cell(value) for value in true[row]),
                ]
            )


def _cell(value: float) -> str:
    # Twelve digits are below a nanometre on every floor, and short where the number is.
    return f"{float(value):.12g}"
