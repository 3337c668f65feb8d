"""The page of the kim2009 study: what the paper states and what was chosen, its tables and figures beside ours."""

import math
from typing import Final

from layoutopt.simulation.kim2009_rooms import FITTED_CELLS, FITTED_TRANSPONDER_M, WAVELENGTH_M, docking_room
from layoutopt.streams import Streams
from studies.page import Page, Section, Table
from studies.published import kim2009_docking as docking
from studies.published.kim2009_docking import Found
from studies.published.kim2009_maps import map_data, map_section, stated_summary
from studies.published.kim2009_paths import paths_section

TITLE: Final = "kim2009: docking by direction of arrival, run again"


def summary(found: Found) -> list[str]:
    """Return Table I, Table II and the gain of the better estimator in a sentence each."""
    return [stated_summary(), *docking.summary(found)]


def page_of(found: Found, streams: Streams, *, rooms: int, failed: int) -> Page:
    """Return the whole page; ``rooms`` is the number of random rooms in row (d) of Table I."""
    return Page(
        study="published/kim2009",
        title=TITLE,
        lead="docked",
        summary=tuple(summary(found)),
        sections=(
            map_section(streams, rooms),
            docking.table_section(found),
            docking.better_section(found),
            paths_section(streams),
            docking.error_section(found),
            docking.choices_section(found),
            docking.experiment_section(found),
            _choices(),
            _not_reproduced(),
        ),
        facts={
            "Paper": "M. Kim, N. Y. Chong: Direction Sensing RFID Reader for Mobile Robot Navigation, IEEE "
            "Transactions on Automation Science and Engineering 6(1), 2009",
            "Seed": str(streams.seed),
            "Trials": f"{sum(map(len, found.values()))}; {max(map(len, found.values()), default=0)} a cell",
            "Random rooms of Table I": str(rooms),
            "Failed tasks": str(failed),
            "Intervals": "shares have 95 % intervals after Wilson; differences are paired by drive, with 95 % "
            "intervals that count what no drive showed; ± is half the width of the 95 % interval of a mean "
            "(Student)",
        },
        data=(map_data(streams, rooms), docking.docking_data(found)),
    )


def _choices() -> Section:
    room = docking_room(blocking=True)
    rows = (
        ("phase of a scattered wave", "cos(2π Δr/λ)", "Eq. 7 leaves it to the instant; refuted: t = 0, no phase"),
        ("arctan in Eq. 11b", "of two arguments", "as printed, no error could exceed 90°"),
        (
            "transponder of Fig. 5",
            f"({FITTED_TRANSPONDER_M[0]:g}, {FITTED_TRANSPONDER_M[1]:g}) m",
            "fitted to rows b and c of Table I at R = 0.5",
        ),
        (
            "width of the map",
            f"{FITTED_CELLS} cells of 0.1 m",
            "fitted: the printed shares are none of the 2500 cells of the room",
        ),
        ("seventh scatterer (0, 2.2)", "left out", "missing in the printed list"),
        (
            "start and transponder for docking",
            f"({room.start_m[0]:g}, {room.start_m[1]:g}) and ({room.transponder_m[0]:g}, "
            f"{room.transponder_m[1]:g}) m",
            "5 m apart, as stated",
        ),
        ("direction", "known over the full circle", "the antennas alone tell it up to half a turn"),
        ("noise", f"standard deviation {math.degrees(room.noise_rad):g}°", "the printed ±4° as two of them"),
        (
            "obstacles",
            f"at random, {room.world.clearance_m:g} m or more from start and transponder",
            "how they were placed is not told",
        ),
        (
            "what an obstacle does",
            f"scatters; “blocking” ones also stop the robot within {room.world.scatterer_radius_m:g} m",
            "scattering alone gives another table",
        ),
        ("R", f"{room.world.reflection:g}", "the paper also says that rates are random"),
        ("step and limit", f"{room.world.step_m:g} m, {room.world.steps} steps", "a “certain time limit”"),
        ("walls", "stop the robot and reflect nothing", "their reflection is not told"),
        ("ranges of the correction", "from signal strength, true ones beside them", "as the paper"),
        ("odometry", "without error", "none is named for the simulation"),
    )
    return Section(
        heading="What the paper states, and what was chosen",
        paragraphs=(
            f"Stated: 303.2 MHz (a wave of {100.0 * WAVELENGTH_M:.1f} cm), R = 0.2 and 0.5, the scatterers of "
            "Fig. 5(a) to (c), a room of 5 m by 5 m, 5 m to dock, an end within 0.5 m, noise of ±4°, Algorithm 1.",
            "Algorithm 1 needs three repairs. The smallest |x| wins, not the smallest x, which is always an end "
            "of the range. Eq. 14b holds θ of position i-1, not i+1; where a robot drove a corrected direction, "
            "the turn that it made takes that place, also in Eq. 13b and 16b. Trial values without an arc sine "
            "and parallel lines are left out, but for three lines that are one. Three readings at one place are "
            "not corrected; the paper does not say what its robot does where it stands still.",
        ),
        parts=(Table(caption="Choices", head=("what", "choice", "why"), rows=rows, words=3),),
    )


def _not_reproduced() -> Section:
    return Section(
        heading="What is not reproduced",
        paragraphs=(
            "Few failures among one to three obstacles together with 38 % among nine: no setting of this page "
            "gives both, so Table II comes out as an ordering only. R is 0.5 for all obstacles, though the paper "
            "also says that rates are random.",
            "Fig. 5 to 7, 13 and 14 are drawings of which the copy at hand has no values; ours stand here without "
            "the paper's beside them, and can only be held against what the text says of them. The room of "
            "Fig. 5(d) and the lines of Fig. 7 are not known. Table III and Fig. 16 and 17 are measurements.",
            "An antenna that tells directions up to half a turn is not simulated in drives, nor are errors of the "
            "odometry, reflections of reflections, or waves that bend round things.",
        ),
    )
