"""The four arrays of mi2016.

The paper's figures with the coordinates are lost from the copies at hand. The positions below are
reconstructed from its text and from the detection counts that reproduce its tables; they are assumptions and
are labelled so wherever they are shown.
"""

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from layoutopt.identity import FloatArray
from layoutopt.layout import ReaderGroup
from layoutopt.protocols import Mount, ReaderCard
from layoutopt.readers.mounting import mounted

CARD: Final = ReaderCard(
    summary="The arrays of 8, 20, 24 and 96 readers of mi2016; coordinates reconstructed.",
    reference="mi2016, Fig. 4-6; coordinates reconstructed from the text",
    reconstructed=True,
)
_ALONG_M: Final = 0.0445
_ACROSS_M: Final = 0.0375


def eight(*, mount: Mount) -> ReaderGroup:
    """Return the 8 antennas of 60 mm at 100 and 200 mm on each half axis."""
    directions = np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)])
    xy_m = (np.array([0.1, 0.2])[:, None, None] * directions[None, :, :]).reshape(-1, 2)
    return mounted("mi2016_8", xy_m, mount, {})


def ninety_six(*, mount: Mount) -> ReaderGroup:
    """Return the 96 antennas of 30 mm: four arms of 2 by 12, 44.5 mm apart in x and 37.5 mm in y."""
    columns = _ALONG_M * (np.arange(1.5, 13.0))
    forward = _product(columns, _ACROSS_M * np.array([-0.5, 0.5]))
    rows = _ACROSS_M * (np.arange(1.5, 13.0))
    left = _product(_ALONG_M * np.array([-0.5, 0.5]), rows)
    return mounted("mi2016_96", np.concatenate([forward, -forward, left, -left]), mount, {})


def twenty_four(*, mount: Mount) -> ReaderGroup:
    """Return the 24 antennas of 60 mm that replace each 2 by 2 block of the 96: four arms of 6."""
    steps = np.arange(1.0, 7.0)
    forward = _product(2.0 * _ALONG_M * steps, np.zeros(1))
    left = _product(np.zeros(1), 2.0 * _ACROSS_M * steps)
    return mounted("mi2016_24", np.concatenate([forward, -forward, left, -left]), mount, {})


def twenty(*, mount: Mount) -> ReaderGroup:
    """Return the 20 antennas of 60 mm: four on each arm and four about the centre."""
    steps = np.arange(2.0, 6.0)
    forward = _product(2.0 * _ALONG_M * steps, np.zeros(1))
    left = _product(np.zeros(1), 2.0 * _ACROSS_M * steps)
    centre = _product(_ALONG_M * np.array([-1.0, 1.0]), _ACROSS_M * np.array([-1.0, 1.0]))
    return mounted("mi2016_20", np.concatenate([forward, -forward, left, -left, centre]), mount, {})


def _product(x_m: ArrayLike, y_m: ArrayLike) -> FloatArray:
    pairs = np.stack(np.meshgrid(np.asarray(x_m), np.asarray(y_m), indexing="ij"), axis=-1)
    return pairs.reshape(-1, 2).astype(np.float64)
