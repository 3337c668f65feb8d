"""Reader profiles: how the readers that one can buy, and those of mi2016, scan and how close they may sit.

Commercial
    A module inventories the tags of one antenna at a time and a multiplexer takes it to the next. An inventory
    of ISO 15693 in 16 slots lasts 26.1 ms for four tags (`layoutopt.readers.inventory`); the host adds about
    10 ms (FEIG application note N11200: response time = inventory + 10 ms) and the switch a little. 50 ms a scan
    leaves that some room. Cheap modules answer to one tag only: such a reader is a profile of the user's own,
    with ``tags_per_scan = "one"``. Two tags in the field of such a reader collide and none is read, so
    `layoutopt.feasibility` refuses tags nearer than the diameter of its disc and a tag's length.

    Loops that transmit at the same time disturb each other: at least three antenna diameters between the
    nearest edges (V. Vega, NXP, in RFID Journal, "How can I avoid reader interference"), which is four sides
    between centres; fields that are switched one after the other need no such distance (Siemens SIMATIC RF300
    manual). Boards side by side need 1.1 sides.

mi2016
    Every antenna has a reader of its own, all listen every 50 ms, and neighbours do not disturb each other
    (Sensors 2016, 16, 1200, Sections 3 and 4). The authors built such arrays; what the coupling of loops so
    close costs they do not say, so the profile is for comparison with the paper.
"""

from collections.abc import Mapping
from typing import Final

from layoutopt.layout import ReaderProfile

COMMERCIAL: Final = ReaderProfile(
    name="commercial",
    scan_period_s=0.05,
    tags_per_scan="several",
    spacing_sides=1.1,
    simultaneous_spacing_sides=4.0,
)
MI2016: Final = ReaderProfile(
    name="mi2016",
    scan_period_s=0.05,
    tags_per_scan="several",
    spacing_sides=1.1,
    simultaneous_spacing_sides=1.1,
)
PROFILES: Final[Mapping[str, ReaderProfile]] = {profile.name: profile for profile in (COMMERCIAL, MI2016)}
"""Profiles by name; a spec may give one of its own as a table."""
