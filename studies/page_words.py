"""Words of the field that pages of studies use, and what they mean."""

import re
from collections.abc import Iterable, Mapping
from typing import Final

_WORDS: Final[Mapping[str, tuple[str, str]]] = {
    "± and 95 % interval": (
        r"±|95 %|\(\S+ to \S+\)|interval",
        "Drawn again and again, 95 of 100 such intervals would hold the true mean of the simulation. It says "
        "nothing of what the simulation leaves out.",
    ),
    "paired": (
        r"paired",
        "Both sides of a difference or ratio met the same drives with the same random numbers: luck cancels.",
    ),
    "trial, drive": (
        r"[Tt]rial|[Dd]rives?\b|[Ww]alks\b|[Tt]ours\b",
        "One simulated run of a robot (or of a person who is tracked) from start to end, with faults of its own.",
    ),
    "held-out": (r"held-out", "Drives, routes or faults that the search for a layout never saw."),
    "optimism": (
        r"[Oo]ptimism",
        "Held-out score less search score. A search picks lucky layouts, and held-out drives differ in routes and "
        "faults too, so some of it is to be expected.",
    ),
    "estimator": (
        r"[Ee]stimator",
        "The program on the robot that makes a place of what readers and wheels tell, such as mcl_adaptive.",
    ),
    "not shown": (
        r"not shown|no difference shown|undecided|neither",
        "The interval leaves both answers open; it is not a no. More trials may decide it.",
    ),
    "position error": (
        r"[Pp]osition error|mean error",
        "Distance between where the robot is and where it believes to be, averaged over the steps of a drive.",
    ),
    "heading error": (
        r"[Hh]eading error",
        "Angle between where the robot looks and where it believes to look, averaged over the steps of a drive.",
    ),
    "95 % error": (
        r"95 % error|p95",
        "The error that is exceeded in 5 % of the steps of a drive, averaged over drives.",
    ),
    "lost": (
        r"\b[Ll]ost\b",
        "More than 250 mm from where it believes to be, if no other limit is named; a share is that of the time.",
    ),
    "localised, recovery": (
        r"[Ll]ocalised|[Rr]ecover",
        "The estimate has come within the limit on place, and stayed there for the time demanded.",
    ),
    "kidnapped": (r"[Kk]idnapped", "Lifted to another place without being told."),
    "odometry": (r"odometry", "Place and heading as the turns of the wheels tell them, without any tag."),
    "read radius": (
        r"read radius|[Rr]ead dis[ck]s?",
        "Horizontal distance at which an antenna just reads a tag; a tag is read while it is within this disc.",
    ),
    "pitch": (r"\bpitch\b", "Distance from one tag of a regular pattern to the next."),
    "tag density": (r"tags/m²|densit", "Tags for each square metre of floor."),
    "blind run, blind direction": (
        r"[Bb]lind",
        "A straight way over the floor on which a robot meets no tag, and the direction of such ways.",
    ),
    "front": (r"\b[Ff]ront\b", "The layouts to which no other was found that is both cheaper and more accurate."),
    "bound, gap": (
        r"\b[Bb]ound|\b[Gg]ap\b",
        "A bound is a proven side of a number, such as the least cost that any solution has; the gap is how far "
        "the best one found lies from it.",
    ),
    "slot": (r"\b[Ss]lots?\b", "A place where a tag or an antenna may go."),
    "D-optimal, A-optimal": (
        r"[DA]-optimal|\bD\b.*\bA\b",
        "Places that make the volume (D) or the sum of squared axes (A) of the ellipsoid of uncertainty smallest.",
    ),
    "transponder": (r"[Tt]ransponder", "An active tag whose direction the robot measures, and at which it docks."),
    "RSS": (r"\bRSS\b|[Ss]ignal strength", "Received signal strength: how strong an antenna hears a tag."),
    "phase": (
        r"\b[Pp]hases?\b",
        "Where in its wave a tag's answer arrives: two of them tell by how much the distance changed, up to half "
        "wavelengths.",
    ),
    "alias, ambiguous": (r"alias|ambiguous", "Readings that more than one motion or place explains."),
    "yaw": (r"\byaws?\b", "The direction in which an antenna looks, against that of the robot."),
    "gain": (r"\bgains?\b", "Share of a measured error by which an estimate is corrected at once."),
    "RMSE": (r"\bRMSE\b", "Root of the mean of squared errors."),
    "short key": (
        r"\b[0-9a-f]{10}\b",
        "Letters and digits in brackets name a layout, and its file in layouts/.",
    ),
}
"""By what stands on the page: how to find it in a text, and its meaning."""


def meanings_of(words: Iterable[str]) -> Mapping[str, str]:
    """Return words of the list with their meanings, in their order.

    Raises
    ------
    KeyError
        If a word is not in the list.

    >>> list(meanings_of(["front", "lost"]))
    ['front', 'lost']
    """
    return {word: _WORDS[word][1] for word in words}


def words_in(text: str) -> Mapping[str, str]:
    """Return the words of the field that a text uses, with their meanings, in the order of the list.

    >>> list(words_in("differences are paired by drive"))
    ['paired', 'trial, drive']
    """
    return {word: meaning for word, (pattern, meaning) in _WORDS.items() if re.search(pattern, text)}
