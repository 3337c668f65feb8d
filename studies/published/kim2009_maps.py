"""Maps of the direction's error after kim2009: Table I, Fig. 5 to 7."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from layoutopt.estimators.direction_of_arrival import direction_error
from layoutopt.identity import FloatArray
from layoutopt.plots.curves import Curve, Panel, draw_curves
from layoutopt.plots.direction_maps import DirectionMap, draw_direction_maps
from layoutopt.plots.whiskers import WhiskerPanel, WhiskerSeries, draw_whiskers
from layoutopt.simulation.kim2009_rooms import (
    FITTED_CELLS,
    FITTED_TRANSPONDER_M,
    ROOM_M,
    SCATTERERS_M,
    STEP_SHARE,
    WAVELENGTH_M,
    cells_m,
    share_not_nearer,
)
from layoutopt.streams import Purpose, Streams
from studies.page import Data, Picture, Section, Table
from studies.published.comparison import percent_text
from studies.published.kim2009_printed import MEAN_BELOW_DEG, NOT_NEARER_PERCENT

if TYPE_CHECKING:
    from layoutopt.plots.figures import Drawn

REFLECTIONS: Final = (0.2, 0.5)
STATED: Final = ("a", "b", "c")
"""Cases of Fig. 5 whose scatterers are printed; those of (d) are random."""
RANDOM_SCATTERERS: Final = 9
_ROOMS_STREAM: Final = "kim2009, Fig. 5(d)"
_LIMIT_DEG: Final = math.degrees(math.acos(STEP_SHARE / 2.0))
"""Error from which a step of Table I leads no nearer."""
_HALF_M: Final = float(cells_m().max()) * FITTED_CELLS / (FITTED_CELLS - 1)
"""Half the width of a map: half a cell beyond the middle of its last cell."""
_PAST_ROW_M: Final = (-1.0, 0.1)
"""Between two scatterers of the row of (c), so that a line behind them meets neither."""
_FAILING_X_M: Final = 1.1
"""Where the lower border of (c) at R = 0.5 is met behind a region in which directions fail."""
_LINE_POINTS: Final = 300
_FIRST_M: Final = 0.1
"""Where a line begins: at the transponder itself a wave has no direction."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MapScores:
    """Of the errors on one map: share that lead no nearer, mean, 10th and 90th percentile of their size, deg."""

    not_nearer: float
    mean_deg: float
    low_deg: float
    high_deg: float

    @classmethod
    def of(cls, error_rad: FloatArray) -> "MapScores":
        """Return the scores of a map."""
        size_deg = np.degrees(np.abs(error_rad))
        low, high = np.percentile(size_deg, (10.0, 90.0))
        return cls(
            not_nearer=share_not_nearer(error_rad),
            mean_deg=float(size_deg.mean()),
            low_deg=float(low),
            high_deg=float(high),
        )


def map_rad(scatterers_m: FloatArray, reflection: float) -> FloatArray:
    """Return the direction error in every cell of the fitted map, shape (cells,)."""
    places_m = np.asarray(scatterers_m)
    return direction_error(cells_m(), FITTED_TRANSPONDER_M, places_m, reflection, WAVELENGTH_M).error_rad


@lru_cache(maxsize=2)
def stated_scores() -> Mapping[tuple[float, str], MapScores]:
    """Return the scores of the maps without a random part, by R and case."""
    return {
        (reflection, case): MapScores.of(map_rad(np.array(SCATTERERS_M[case]), reflection))
        for reflection in REFLECTIONS
        for case in STATED
    }


def random_room_m(streams: Streams, room: int) -> FloatArray:
    """Return the scatterers of one random room, shape (9, 2), m."""
    draws = streams.generator(_ROOMS_STREAM, room, Purpose.SCATTERERS)
    return draws.uniform(ROOM_M[:2], ROOM_M[2:], (RANDOM_SCATTERERS, 2))


@lru_cache(maxsize=2)
def random_scores(streams: Streams, rooms: int) -> Mapping[float, tuple[MapScores, ...]]:
    """Return the scores of random rooms by R; a room has the same scatterers under each."""
    return {
        reflection: tuple(MapScores.of(map_rad(random_room_m(streams, room), reflection)) for room in range(rooms))
        for reflection in REFLECTIONS
    }


def nearest_room(streams: Streams, rooms: int) -> int:
    """Return the random room whose share at R = 0.5 comes nearest to the printed one."""
    shares = np.array([scores.not_nearer for scores in random_scores(streams, rooms)[0.5]])
    return int(np.abs(100.0 * shares - NOT_NEARER_PERCENT[0.5, "d"]).argmin())


def stated_summary() -> str:
    """Return rows a to c of Table I at R = 0.5 in a sentence, and what R = 0.2 gives."""
    found = stated_scores()
    strong = ", ".join(
        f"({case}) {100.0 * found[0.5, case].not_nearer:.2f} (paper: {NOT_NEARER_PERCENT[0.5, case]:g})"
        for case in STATED
    )
    weak = [100.0 * found[0.2, case].not_nearer for case in STATED]
    return (
        f"Directions that lead no nearer, in % (Table I): where waves scatter with R = 0.5 {strong}; transponder "
        "and width of the map are fitted to (b) and (c). With R = 0.2 "
        f"{', '.join(f'{value:g}' for value in weak)} (paper: 0, 0, 0)."
    )


def map_section(streams: Streams, rooms: int) -> Section:
    """Return Table I and Fig. 5 to 7."""
    found = random_scores(streams, rooms)
    room = nearest_room(streams, rooms)
    means_deg = np.array([scores.mean_deg for scores in found[0.5]])
    reach = int(sum(100.0 * scores.not_nearer >= NOT_NEARER_PERCENT[0.5, "d"] for scores in found[0.5]))
    return Section(
        heading="Table I and Fig. 5 to 7: directions that lead no nearer",
        paragraphs=(
            "Share of the cells of a map in which a step of a fifth of the distance, along the direction found, "
            f"brings the robot no nearer: those with an error of {_LIMIT_DEG:.1f}° or more. Rows a to c have no "
            "random part and so no interval. Transponder and width of the map were fitted to rows b and c at "
            "R = 0.5, two choices for two numbers: these two show that the model can give the table, not that it "
            "is the authors'. All others are predictions.",
            f"Row d: {rooms} rooms with {RANDOM_SCATTERERS} scatterers at random, transponder and map as in the "
            f"other rows. At R = 0.5 {percent_text(reach, rooms)} % of the rooms have the printed 1.84 % or more; "
            "which room the paper drew is not told. The drawn one is the room, of all these, that comes nearest "
            f"to the printed share (number {room}).",
            f"The paper says that mean errors stay below {MEAN_BELOW_DEG:g}°. So they do in a to c, and in "
            f"{int((means_deg <= MEAN_BELOW_DEG).sum())} of the {rooms} random rooms at R = 0.5 (largest mean: "
            f"{means_deg.max():.1f}°).",
            "The paper's lines (i) to (iii) of Fig. 7 are in a drawing only. Ours lead from the transponder to "
            "the border of the map: (i) just past the row of scatterers of (c), (ii) to where directions fail in "
            "(c), (iii) to the right. They show what the paper says of its own: errors swing with the way, and "
            "are small near the transponder.",
        ),
        parts=(
            _table(found, rooms),
            Picture(
                name="maps",
                caption="Error of the direction in each cell of 0.1 m (paper: Fig. 5), above with R = 0.2, below "
                "with R = 0.5. The dashed lines are those of the next figure but one.",
                drawn=draw_direction_maps(
                    _maps(random_room_m(streams, room)), columns=len(STATED) + 1, limit_deg=_LIMIT_DEG
                ),
            ),
            Picture(
                name="map_errors",
                caption="Mean error with 10th and 90th percentile over the map (paper: Fig. 6); of (d) the "
                f"means of these over {rooms} rooms.",
                drawn=_statistics(found),
            ),
            Picture(
                name="lines",
                caption="Error along three lines from the transponder, R = 0.5 (paper: Fig. 7, on other lines).",
                drawn=_along_lines(random_room_m(streams, room)),
            ),
        ),
    )


def _table(found: Mapping[float, Sequence[MapScores]], rooms: int) -> Table:
    rows = []
    stated = stated_scores()
    for reflection in REFLECTIONS:
        for case in STATED:
            scores = stated[reflection, case]
            cells = round(scores.not_nearer * FITTED_CELLS**2)
            fitted = ", fitted" if reflection == 0.5 and case in ("b", "c") else ""
            rows.append(
                (
                    f"{reflection:g}",
                    case,
                    f"{NOT_NEARER_PERCENT[reflection, case]:g}",
                    f"{100.0 * scores.not_nearer:.2f} ({cells} cells){fitted}",
                    f"{scores.mean_deg:.1f}",
                    f"{scores.high_deg:.1f}",
                )
            )
        shares = np.array([100.0 * scores.not_nearer for scores in found[reflection]])
        low, middle, high = np.percentile(shares, (25.0, 50.0, 75.0))
        none = int((shares == 0.0).sum())
        rows.append(
            (
                f"{reflection:g}",
                f"d, {rooms} rooms",
                f"{NOT_NEARER_PERCENT[reflection, 'd']:g}",
                f"median {middle:.2f}, quartiles {low:.2f} and {high:.2f}; none in {none} rooms",
                f"{float(np.mean([scores.mean_deg for scores in found[reflection]])):.1f}",
                f"{float(np.mean([scores.high_deg for scores in found[reflection]])):.1f}",
            )
        )
    return Table(
        caption="Table I: share of directions that lead no nearer, %, and sizes of the errors",
        head=("R", "case", "paper, %", "ours, %", "ours: mean error, °", "90th percentile, °"),
        rows=tuple(rows),
        words=2,
    )


def _lines_m() -> FloatArray:
    """Return both ends of three lines from the transponder to the border of the map, shape (3, 2, 2), m.

    The first leads just past the row of scatterers of (c), the second where directions of (c) fail.
    """
    x, y = FITTED_TRANSPONDER_M
    past_x, past_y = _PAST_ROW_M
    border = (-_HALF_M, y + (past_y - y) * (x + _HALF_M) / (x - past_x))
    return np.array([[(x, y), end] for end in (border, (_FAILING_X_M, -_HALF_M), (_HALF_M, y))])


def _maps(random_m: FloatArray) -> list[DirectionMap]:
    maps = []
    for reflection in REFLECTIONS:
        for case, places_m in _cases(random_m).items():
            lined = reflection == 0.5 and case in ("c", "d")
            maps.append(
                DirectionMap(
                    title=f"({case}) R = {reflection:g}",
                    error_deg=np.degrees(np.abs(map_rad(places_m, reflection))).reshape(
                        FITTED_CELLS, FITTED_CELLS
                    ),
                    bounds_m=(-_HALF_M, -_HALF_M, _HALF_M, _HALF_M),
                    transponder_m=FITTED_TRANSPONDER_M,
                    scatterers_m=places_m,
                    lines_m=_lines_m() if lined else np.empty((0, 2, 2)),
                )
            )
    return maps


def _cases(random_m: FloatArray) -> Mapping[str, FloatArray]:
    return {**{case: np.array(SCATTERERS_M[case]) for case in STATED}, "d": random_m}


def _statistics(found: Mapping[float, Sequence[MapScores]]) -> "Drawn":
    stated = stated_scores()
    panels = []
    for reflection in REFLECTIONS:
        rows = [
            (scores.mean_deg, scores.low_deg, scores.high_deg)
            for scores in (stated[reflection, case] for case in STATED)
        ]
        rooms = [(scores.mean_deg, scores.low_deg, scores.high_deg) for scores in found[reflection]]
        values = np.array([*rows, np.mean(rooms, axis=0)])
        series = WhiskerSeries(name="ours", values=values[:, 0], low=values[:, 1], high=values[:, 2])
        panels.append(
            WhiskerPanel(title=f"R = {reflection:g}", categories=("(a)", "(b)", "(c)", "(d)"), series=(series,))
        )
    return draw_whiskers(panels, x_label="case of Fig. 5", y_label="error of the direction (°)", joined=False)


def _along_lines(random_m: FloatArray) -> "Drawn":
    panels = []
    for case in ("c", "d"):
        places_m = _cases(random_m)[case]
        curves = []
        for name, (start_m, end_m) in zip(("i", "ii", "iii"), _lines_m(), strict=True):
            length_m = float(np.hypot(*(end_m - start_m)))
            along_m = np.linspace(_FIRST_M, length_m, _LINE_POINTS)
            points_m = start_m + along_m[:, None] / length_m * (end_m - start_m)
            error = direction_error(points_m, FITTED_TRANSPONDER_M, places_m, 0.5, WAVELENGTH_M).error_rad
            curves.append(Curve(name=f"line {name}", x=along_m, y=np.degrees(np.abs(error))))
        panels.append(
            Panel(
                title=f"({case}) R = 0.5",
                x_label="distance to the transponder (m)",
                y_label="error of the direction (°)",
                curves=tuple(curves),
            )
        )
    return draw_curves(panels)


def map_data(streams: Streams, rooms: int) -> Data:
    """Return the scores of every map, a row a map."""
    rows = [
        (f"{reflection:g}", case, "", *_cells(scores)) for (reflection, case), scores in stated_scores().items()
    ]
    for reflection, found in random_scores(streams, rooms).items():
        rows += [(f"{reflection:g}", "d", str(room), *_cells(scores)) for room, scores in enumerate(found)]
    head = ("reflection", "case", "room", "not_nearer_share", "mean_rad", "p10_rad", "p90_rad")
    return Data(name="maps", head=head, rows=tuple(rows))


def _cells(scores: MapScores) -> tuple[str, ...]:
    sizes_rad = (math.radians(value) for value in (scores.mean_deg, scores.low_deg, scores.high_deg))
    return (f"{scores.not_nearer:.9g}", *(f"{value:.9g}" for value in sizes_rad))
