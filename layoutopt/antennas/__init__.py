"""Antenna models: the volume in which an antenna reads a tag.

An antenna model is a frozen value with its own fields that follows `layoutopt.protocols.AntennaModel`. Axis
convention: antenna frame with z up, tags below it at negative z.
"""

from typing import Final

EXTENSION_POINT: Final = "antennas"
ROWS: Final = {
    "sphere": "layoutopt.antennas.sphere:SphereAntenna",
    "biot_savart": "layoutopt.antennas.biot_savart:BiotSavartAntenna",
    "measured": "layoutopt.antennas.measured:MeasuredAntenna",
    "disc": "layoutopt.antennas.disc:DiscAntenna",
    "uhf_patch": "layoutopt.antennas.uhf_patch:UhfPatch",
    "crossed_loops": "layoutopt.antennas.crossed_loops:CrossedLoops",
}
