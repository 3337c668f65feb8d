"""Reader groups: functions that place antennas under a robot and return a `layoutopt.layout.ReaderGroup`.

A reader family takes keyword parameters with units in their names, and ``mount``, a
`layoutopt.protocols.Mount`, which says how the antennas are built; it raises ValueError for values that make
no group. ``base_link`` lies at the origin, x forward, y left (REP-103).
"""

from typing import Final

EXTENSION_POINT: Final = "readers"
ROWS: Final = {
    "cross": "layoutopt.readers.cross:cross",
    "ring": "layoutopt.readers.ring:ring",
    "two_rings": "layoutopt.readers.two_rings:two_rings",
    "grid": "layoutopt.readers.grid:grid",
    "listed": "layoutopt.readers.listed:listed",
    "mirrored": "layoutopt.readers.mirrored:mirrored",
    "mi2016_8": "layoutopt.readers.mi2016:eight",
    "mi2016_20": "layoutopt.readers.mi2016:twenty",
    "mi2016_24": "layoutopt.readers.mi2016:twenty_four",
    "mi2016_96": "layoutopt.readers.mi2016:ninety_six",
}
