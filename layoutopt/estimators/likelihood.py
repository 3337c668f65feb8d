"""How well a pose explains that an antenna saw a tag: the two likelihoods of mi2016, and their width."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray, IntArray
from layoutopt.layout import Layout
from layoutopt.protocols import FloorKnowledge
from layoutopt.readings import Observations, Reading, TagRead

LIKELIHOODS: Final = ("combination", "gaussian")
LEAST_WIDTH_M: Final = 0.0005
"""Least width of a soft edge: a disc of no radius, of an antenna that should not reach the floor, has one too."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Detections:
    """Reads of known tags in columns, with all that a likelihood needs of them.

    Attributes
    ----------
    start
        Detections of step i are the rows ``start[i]`` to ``start[i + 1]``, shape (steps + 1,).
    antenna_m
        Antenna centres in ``base_link``, shape (n, 2), m.
    tag_m
        Planned places of the tags in the floor frame, shape (n, 2), m.
    radius_m, tag_sigma_m
        Radius of the antenna's read disc, and standard deviation of the tag's place, shape (n,), m.
    """

    start: IntArray
    antenna_m: FloatArray
    tag_m: FloatArray
    radius_m: FloatArray
    tag_sigma_m: FloatArray

    def __len__(self) -> int:
        """Return the number of detections."""
        return len(self.tag_m)


def without_tag_readers(layout: Layout) -> str:
    """Return why an estimator of tag reads cannot work with a layout, or an empty string."""
    if all(group.kind != "tag_read" for group in layout.readers):
        return "it needs readers of floor tags, and the layout has none"
    return ""


def detections_of(observations: Observations, knowledge: FloorKnowledge) -> Detections:
    """Return the reads of a whole drive whose tags the map holds."""
    known = observations.read_tag >= 0
    start = np.concatenate([[0], np.cumsum(known)])[observations.read_start]
    return _looked_up(
        start.astype(np.int64), observations.read_antenna[known], observations.read_tag[known], knowledge
    )


def detections_in(readings: Sequence[Reading], knowledge: FloorKnowledge) -> Detections:
    """Return the reads of one step whose tags the map holds; other kinds of readings do not count."""
    reads = [reading for reading in readings if isinstance(reading, TagRead) and reading.tag >= 0]
    antenna = np.array([read.antenna for read in reads], dtype=np.int64)
    tag = np.array([read.tag for read in reads], dtype=np.int64)
    return _looked_up(np.array([0, len(reads)]), antenna, tag, knowledge)


def _looked_up(start: IntArray, antenna: IntArray, tag: IntArray, knowledge: FloorKnowledge) -> Detections:
    return Detections(
        start=start,
        antenna_m=knowledge.antennas.xy_m[antenna],
        tag_m=knowledge.tags.xy_m[tag],
        radius_m=knowledge.antennas.radius_m[antenna],
        tag_sigma_m=knowledge.tags.sigma_m[tag],
    )


def likelihood_sigma_m(radius_m: FloatArray, tag_sigma_m: FloatArray, scale: float, floor_m: float) -> FloatArray:
    """Return sigma of Eq. 6 for each read, shape (n,), m; it is also the radius of the flat top.

    With sigma equal to the radius of the read disc on the floor (``scale`` 1) the published tables come out
    best. A tag laid with a tolerance widens it as independent errors add; ``floor_m`` keeps it positive where
    an antenna should not reach the floor at all and yet reports a tag.
    """
    return np.maximum(np.hypot(scale * radius_m, tag_sigma_m), floor_m)


def log_likelihood(
    distance_squared_m2: FloatArray, sigma_m: float, likelihood: str, log_beta: float
) -> FloatArray:
    """Return the logarithm of Eq. 6 ("combination") or of its Gaussian part alone ("gaussian").

    ``distance_squared_m2`` is the squared horizontal distance of antenna and tag, any shape. The combination
    is 1 closer than ``sigma_m`` and beta exp(-d²/2σ²) beyond.

    References
    ----------
    mi2016, Eq. 6. The paper's norm is taken as horizontal: with heights in it, its own 96-reader array would
    never reach the flat top.
    """
    gaussian = -distance_squared_m2 / (2.0 * sigma_m**2)
    if likelihood == "gaussian":
        return gaussian
    return np.where(distance_squared_m2 < sigma_m**2, 0.0, log_beta + gaussian)


def ring_log_likelihood(
    distance_m: FloatArray, *, inner_m: float, outer_m: float, width_m: float, log_floor: float
) -> FloatArray:
    """Return the logarithm of how well distances of antenna and tag fit between two radii, any shape.

    Zero between them, beyond either -e² / 2 in widths e of the soft edge, and never below ``log_floor``: a read
    may be wrong, a scan may miss. With an inner radius of zero it is a read, with an infinite outer one a silence.
    """
    beyond_m = np.maximum(np.maximum(inner_m - distance_m, distance_m - outer_m), 0.0)
    return np.maximum(-0.5 * (beyond_m / width_m) ** 2, log_floor)


def silence_log_likelihood(
    centre_m: FloatArray,
    tag_m: FloatArray,
    width_m: FloatArray,
    *,
    radius_m: float,
    log_miss: float,
    one_tag_alone: bool,
) -> FloatArray:
    """Return the logarithm of how well it fits that an antenna did not read any of some tags, shape (n,).

    Parameters
    ----------
    centre_m
        Where the antenna may be, shape (2, n).
    tag_m, width_m
        The tags, shape (k, 2), and the width of the soft edge for each, shape (k,).
    one_tag_alone
        Whether two tags in the field would have silenced each other: then only one alone speaks against a place.
    """
    distance_m = np.hypot(centre_m[0][:, None] - tag_m[:, 0], centre_m[1][:, None] - tag_m[:, 1])
    within = distance_m < radius_m
    penalty = np.maximum(-0.5 * ((radius_m - distance_m) / width_m) ** 2, log_miss)
    total = np.where(within, penalty, 0.0).sum(axis=1)
    return np.where(within.sum(axis=1) == 1, total, 0.0) if one_tag_alone else total
