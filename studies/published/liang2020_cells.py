"""What liang2020 varies, what it leaves open, and what goes beyond it: choices by their place in the report."""

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Final

from studies.published.liang2020_printed import APPROACHES, FIGURE_6_RHO, FIGURE_6_SIGMA, TABLE_3, TABLE_4, TABLE_5
from studies.published.liang2020_setting import ANTENNAS, BASE, PHASES, TAG_OFFSETS_DB, Choice

Place = tuple[str, str, str]
"""Part of the report, row, and approach or reading."""
SIGMA_PER: Final = ("step", "second")
BASE_PLACE: Final[Place] = ("1", "Squiggle", "fused")
EXTRA_RHO_M2: Final = (0.01, 0.2)
PAPERS: Final = "as the paper"
"""Random walk of 1 m a sample, two hypotheses."""
HEADING_SIGMA_M: Final = 0.1
"""Random step on top of a heading, that of the tracker ``uhf_laser_heading``."""
SEEDED_SHARE: Final = 0.1
"""Of the particles, put to the matched clusters at each sample; that of ``uhf_laser_heading``."""
OFFSETS_DB: Final = (-6.0, -4.0, -2.0, 2.0, 4.0)
"""Offsets of the tag beyond those of Table 1, among which these were chosen."""


def variants() -> Mapping[str, Mapping[str, object]]:
    """Return what goes beyond the paper, as changes of a choice, by name."""
    aliases: dict[str, object] = {"phase": "three aliases"}
    shorter: dict[str, object] = {"sigma_m": 0.4}
    heading: dict[str, object] = {"motion": "heading", "sigma_m": HEADING_SIGMA_M}
    return {
        PAPERS: {},
        "three aliases": aliases,
        "σ = 0.4 m": shorter,
        "σ = 0.4 m, three aliases": shorter | aliases,
        "heading": heading,
        "heading, three aliases": heading | aliases,
        "uhf_laser_heading": heading | aliases | {"seeded_share": SEEDED_SHARE, "unread": True},
    }


def open_choices() -> Mapping[str, Mapping[str, object]]:
    """Return what the paper leaves open, one change of the base choice at a time, by name."""
    return {
        "ranges within 5 mm": {"range_sigma_m": 0.005},
        "ranges within 20 mm": {"range_sigma_m": 0.02},
        "6 things stand about": {"clutter": 6},
        "20 things stand about": {"clutter": 20},
        "things may hide the person": {"clutter_hides": True},
        "particles may leave the room": {"bounded": False},
        "particles move without a reading too": {"unread": True},
        "rectangle half a metre farther": {"nearest_m": 1.5},
        "beams of 90°": {"beam_deg": 90.0},
        "beams of 110°": {"beam_deg": 110.0},
    }


@lru_cache(maxsize=1)
def choices() -> Mapping[Place, Choice]:
    """Return every choice of the full study by its place; places may share one."""
    found: dict[Place, Choice] = {}
    for tag, offset_db in TAG_OFFSETS_DB.items():
        for approach in APPROACHES:
            found["1", tag, approach] = replace(BASE, tag_offset_db=offset_db, approach=approach)
    for offset_db in OFFSETS_DB:
        for approach in APPROACHES:
            found["offset", f"{offset_db:g}", approach] = replace(BASE, tag_offset_db=offset_db, approach=approach)
    for antennas in ANTENNAS:
        found["2", antennas, "fused"] = replace(BASE, antennas=antennas)
        found["2", antennas, "clockwise"] = replace(BASE, antennas=antennas, clockwise=True)
        found["2", antennas, "unread"] = replace(BASE, antennas=antennas, unread=True)
    for matches in TABLE_3:
        found["3", str(matches), "fused"] = replace(BASE, matches=matches)
    for particles in TABLE_4:
        found["4", str(particles), "fused"] = replace(BASE, particles=particles)
    for speed_m_s in TABLE_5:
        for phase in PHASES:
            found["5", f"{speed_m_s:g}", phase] = replace(BASE, speed_m_s=speed_m_s, phase=phase)
    for rho_m2 in sorted((*FIGURE_6_RHO, *EXTRA_RHO_M2)):
        found["6 rho", f"{rho_m2:g}", "fused"] = replace(BASE, rho_m2=rho_m2)
    for sigma_m in FIGURE_6_SIGMA:
        for per in SIGMA_PER:
            found["6 sigma", f"{sigma_m:g}", per] = replace(BASE, sigma_m=sigma_m, sigma_per=per)
    for speed_m_s in TABLE_5:
        for name, changes in variants().items():
            found["beside", f"{speed_m_s:g}", name] = replace(BASE, speed_m_s=speed_m_s, **changes)  # type: ignore[arg-type]
    for name, changes in open_choices().items():
        for approach in APPROACHES:
            found["open", name, approach] = replace(BASE, approach=approach, **changes)  # type: ignore[arg-type]
        found["open", name, "right"] = replace(BASE, antennas="right", **changes)  # type: ignore[arg-type]
    return found


def quick_choices() -> Mapping[Place, Choice]:
    """Return what a quick look takes: Tables 1 (one tag), 2, and two rows of Tables 3 to 5 and of Fig. 6."""
    wanted = {
        "1": ("Squiggle",),
        "2": ANTENNAS,
        "3": ("1", "9"),
        "4": ("10", "100"),
        "5": ("0.2", "0.4"),
        "6 rho": ("0.001", "0.05", "1"),
    }
    return {
        place: choice
        for place, choice in choices().items()
        if place[1] in wanted.get(place[0], ()) and place[2] in (*APPROACHES, "two hypotheses", "signed")
    }
