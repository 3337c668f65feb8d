"""The page of the han2006 study: its tables beside ours, and what its open choices do."""

import math
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from layoutopt.estimators.one_reader import OneReader
from layoutopt.identity import FloatArray
from layoutopt.plots.curves import Curve, Panel, draw_curves
from layoutopt.plots.trajectories import Paths, draw_trajectories
from layoutopt.scores import TrialOutcomes
from layoutopt.simulation.trials import record_trial
from layoutopt.streams import Streams
from objectives.position_bound import box_error
from studies.cells import UNFINISHED
from studies.page import Data, Page, Picture, Section, Table
from studies.published.comparison import (
    Compared,
    Quantity,
    comparison_data,
    comparison_table,
    paired_ratio,
    score_of,
    with_interval,
)
from studies.published.han2006_setting import (
    CIRCLE_M,
    PITCH_M,
    SIDE_M,
    SPEED_M_S,
    STEP_S,
    Choice,
    layout,
    patterns,
    scenario,
)
from studies.published.han2006_static import static_section

Found = Mapping[tuple[str, str, str, Choice], TrialOutcomes]
POSITION: Final = Quantity(column="position_error_mean", heading="position", unit="m")
HEADING: Final = Quantity(column="heading_error_mean", heading="orientation", unit="°", factor=180.0 / math.pi)
PRINTED: Final = {
    ("line", "square"): (0.02, 1.72),
    ("line", "equilateral"): (0.016, 1.12),
    ("line", "isosceles"): (0.016, 1.12),
    ("circle", "square"): (0.02, None),
    ("circle", "equilateral"): (0.015, None),
    ("circle", "isosceles"): (0.015, None),
}
"""Table 1: Path-1 and Path-2; of Path-2 the orientation is lost."""
AFTER_M: Final = 0.009
BEFORE_M: Final = 0.016
ORIENTATION_DEG: Final = 1.36
"""Table 2: position before and after the compensation; orientation before, that after is lost."""
_BASE: Final = Choice()
_FITTED_GAIN: Final = "midrange, gain 0.3"
_HEADLINE: Final = "isosceles"
"""The triangular floor by the paper's words: tags every 0.1 m in a row, as on the square one."""


def summary(found: Found) -> list[str]:
    """Return the two tables in a sentence each."""
    lines = []
    parts = []
    for floor in patterns():
        table = found.get(("line", floor, "midrange", _BASE))
        if table is not None:
            printed = PRINTED["line", floor][0]
            parts.append(f"{floor} {with_interval(score_of(table, POSITION))} m (paper: {printed:g})")
    if parts:
        lines.append(f"One reader errs on a straight line, by the midrange of the tags read: {', '.join(parts)}.")
    before, after = (found.get(("circle", _HEADLINE, name, _BASE)) for name in ("midrange", _FITTED_GAIN))
    if before is not None and after is not None:
        ratio = paired_ratio(after, before, POSITION.column)
        lines.append(
            f"Compensation with a gain of 0.3 takes the error on the {_HEADLINE} floor from "
            f"{with_interval(score_of(before, POSITION))} to {with_interval(score_of(after, POSITION))} m "
            f"(paper: {BEFORE_M:g} to {AFTER_M:g}), a ratio of {with_interval(ratio)}."
        )
    return lines or [UNFINISHED]


def page_of(found: Found, streams: Streams, *, failed: int) -> Page:
    """Return the whole page."""
    compared = _first_table(found) + _second_table(found)
    return Page(
        study="published/han2006",
        title="han2006: one reader over square and triangular tags, run again",
        summary=tuple(summary(found)),
        sections=(
            static_section(),
            _tables(found),
            _paths(streams),
            _radii(found),
            _orientation(found),
            _compensation(found),
            _better(found),
            _choices(),
            _not_reproduced(),
        ),
        facts={
            "Paper": "S. Han, H. Lim, J. Lee and co-workers: an efficient localization scheme for a mobile robot "
            "using RFID; in journal form IEEE Trans. Ind. Electron. 54(6), 2007",
            "Seed": str(streams.seed),
            "Trials": f"{sum(map(len, found.values()))}; {max(map(len, found.values()), default=0)} a cell",
            "Failed tasks": str(failed),
            "Intervals": "± is half the width of the two-sided 95 % interval of the mean over drives (Student); "
            "ratios are paired by drive",
        },
        data=(comparison_data("tables", ("path", "floor", "estimator"), compared), _all_cells(found)),
    )


def _choices() -> Section:
    return Section(
        heading="What the paper states, and what was chosen",
        paragraphs=(
            f"Stated: tags every {PITCH_M:g} m in a row on both floors, an antenna of 0.1 m, {SPEED_M_S:g} m/s, a "
            f"sample every {1e3 * STEP_S:g} ms, tags read one after another (Fig. 3), the midrange (Eq. 9, 10), "
            "headings from chords and arcs (Eq. 1 to 8), a prediction by the wheels that a measurement corrects "
            "(Eq. 21 to 24), and a correct place at the start.",
            "Fitted: the read radius of 125 mm. A box of 0.1 m that reads point tags would always hold one tag of "
            "the square and of the isosceles floor and err by "
            f"{box_error(patterns()['square'], PITCH_M).mean_m:.4f} and "
            f"{box_error(patterns()['isosceles'], PITCH_M).mean_m:.4f} m on average; the printed errors need a "
            "larger field. And the gain: the paper prints none, and 0.3 is the one of those tried that comes "
            "nearest to the printed 0.009 m on the isosceles floor.",
            f"Chosen: Path-1 is a straight line and Path-2 a circle of {CIRCLE_M:g} m, each in another place "
            "against the tags in every drive (their shapes are in a figure only); all tags in the field are told "
            "in each sample, because the printed errors cannot be had otherwise (see the slower reader below); "
            "wheels that are off by 2 % after 1 m, and sideways by a quarter of that; a start known to 5 mm and "
            "0.5°; headings from chords of half a metre and more.",
            "“Triangular” by the paper's words is isosceles: rows one pitch apart, tags a pitch apart in a row, a "
            "stagger of half a pitch (Fig. 9, Eq. 17 to 19). Equilateral triangles of the same density, with a "
            f"side of {1e3 * SIDE_M:.1f} mm, stand beside it, because their static error at the fitted radius is "
            "the printed one.",
        ),
    )


def _compared(
    found: Found, table: str, place: tuple[str, str, str], printed: Sequence[float | None]
) -> list[Compared]:
    outcomes = found.get((*place, _BASE))
    return [
        Compared(table=table, row=place, quantity=quantity, printed=value, ours=score_of(outcomes, quantity))
        for quantity, value in zip((POSITION, HEADING), printed, strict=True)
    ]


def _first_table(found: Found) -> list[Compared]:
    return [
        item
        for (path, floor), printed in PRINTED.items()
        for item in _compared(found, "1", (path, floor, "midrange"), printed)
    ]


def _second_table(found: Found) -> list[Compared]:
    return [
        item
        for floor in ("equilateral", "isosceles")
        for name, printed in (("midrange", (BEFORE_M, ORIENTATION_DEG)), (_FITTED_GAIN, (AFTER_M, None)))
        for item in _compared(found, "2", ("circle", floor, name), printed)
    ]


def _tables(found: Found) -> Section:
    lines = []
    for path in ("line", "circle"):
        for floor in ("isosceles", "equilateral"):
            pair = [found.get((path, name, "midrange", _BASE)) for name in (floor, "square")]
            if pair[0] is not None and pair[1] is not None:
                lines.append(
                    f"{floor} over square on the {path}: "
                    f"{with_interval(paired_ratio(pair[0], pair[1], POSITION.column))}"
                )
    head = ("path", "floor", "estimator")
    return Section(
        heading="Tables 1 and 2",
        paragraphs=(
            "Table 1 without compensation. The paper's ratio of triangular to square is 0.8 and 0.75. "
            f"Ours: {'; '.join(lines)}."
            if lines
            else "No drive is finished.",
            "Table 2 on the circle; the row of the paper reads as position before, position after, orientation "
            "before (that after is lost).",
        ),
        parts=(
            comparison_table("Table 1", head, _first_table(found)),
            comparison_table("Table 2", head, _second_table(found)),
        ),
    )


def _paths(streams: Streams) -> Section:
    """Return one drive of each path, without and with compensation."""
    ways, curves = [], []
    pattern = patterns()[_HEADLINE]
    for path in ("line", "circle"):
        world = scenario(path, _BASE)
        records = {
            words: record_trial(layout(pattern, _BASE), world, estimator, streams, 0)
            for words, estimator in (
                ("midrange", OneReader(compensation="none")),
                ("gain 0.3", OneReader(gain=0.3)),
            )
        }
        true_m = records["midrange"].drive.poses[1:, :2]
        ways.append(
            Paths(
                title=path,
                true_m=true_m,
                estimated_m={words: record.trajectory.poses[:, :2] for words, record in records.items()},
                tags_m=layout(pattern, _BASE).floor_tags.lay_on(world.site).xy_m,
            )
        )
        time_s = np.asarray(STEP_S * np.arange(1, len(true_m) + 1), dtype=np.float64)
        curves.append(
            Panel(
                title=path,
                x_label="time (s)",
                y_label="position error (mm)",
                curves=tuple(
                    Curve(
                        name=words,
                        x=time_s,
                        y=_over_a_second(1e3 * np.hypot(*(record.trajectory.poses[:, :2] - true_m).T)),
                    )
                    for words, record in records.items()
                ),
            )
        )
    return Section(
        heading="One drive on each path",
        paragraphs=(f"The first simulated drive on each path over the {_HEADLINE} floor.",),
        parts=(
            Picture(name="paths", caption="True and estimated paths over tags.", drawn=draw_trajectories(ways)),
            Picture(
                name="errors",
                caption="Position error, mean over 1 s, without and with compensation (paper: Fig. 15, 17).",
                drawn=draw_curves(curves),
            ),
        ),
    )


def _over_a_second(values: FloatArray) -> FloatArray:
    """Return the running mean over a second about each step, over fewer steps at the ends; shape (n,)."""
    window = np.ones(round(1.0 / STEP_S))
    return np.convolve(values, window, mode="same") / np.convolve(np.ones(len(values)), window, mode="same")


def _radii(found: Found) -> Section:
    tables = {
        (choice.radius_m, floor): table
        for (path, floor, name, choice), table in found.items()
        if path == "circle" and name == "midrange" and choice.wheels == _BASE.wheels
    }
    rows = tuple(
        (
            f"{1e3 * radius_m:g}",
            *(
                with_interval(score_of(tables.get((radius_m, floor)), quantity))
                for floor in patterns()
                for quantity in (POSITION, HEADING)
            ),
        )
        for radius_m in sorted({radius_m for radius_m, _ in tables})
    )
    head = [f"{floor}, {quantity.unit}" for floor in patterns() for quantity in (POSITION, HEADING)]
    return Section(
        heading="What the radius does on drives",
        paragraphs=("The open choice that matters most, on the circle without compensation.",),
        parts=(Table(caption="Mean errors by read radius", head=("radius, mm", *head), rows=rows),),
    )


def _rows(found: Found, names: Sequence[str]) -> tuple[tuple[str, ...], ...]:
    return tuple(
        (path, floor, name, *(with_interval(score_of(table, quantity)) for quantity in (POSITION, HEADING)))
        for (path, floor, name, choice), table in found.items()
        if choice == _BASE and name in names
    )


_ROW_HEAD: Final = ("path", "floor", "estimator", "position, m", "orientation, °")


def _orientation(found: Found) -> Section:
    return Section(
        heading="Orientation from one reader",
        paragraphs=(
            "“midrange” takes Eq. 4 to 8 by the letter: an arc from the begin of the drive to where the robot is, "
            "once that is half a metre away (headings of shorter chords are off by tens of degrees). That works "
            "on a path of one curvature only. Chaining arcs, each from the end of the one before, does not work: "
            "an error of the heading comes back with the other sign at every link and never fades. Half of what "
            "the wheels turned, added to the chord's direction, has no such memory.",
        ),
        parts=(
            Table(
                caption="Mean errors without compensation",
                head=_ROW_HEAD,
                rows=_rows(found, ("midrange", "midrange, chained arcs", "midrange, wheels")),
                words=3,
            ),
        ),
    )


def _compensation(found: Found) -> Section:
    names = [name for _, _, name, choice in found if choice == _BASE and "gain" in name]
    names = ["midrange", *dict.fromkeys(names), "midrange, variances"]
    rows = []
    for (path, floor, name, choice), table in found.items():
        told = path == "circle" and floor == _HEADLINE and name in names
        if told and choice.radius_m == _BASE.radius_m:
            rows.append((f"{100.0 * choice.wheels:g}", name, with_interval(score_of(table, POSITION))))
    return Section(
        heading="What the gain does",
        paragraphs=(
            "Circle, isosceles floor. What the best gain is depends on the wheels: good ones want a small gain, "
            "and with poor ones a small gain brings little or even harm. The printed 0.009 m says as much of the "
            "paper's wheels and gain as of its method. By variances the gain is computed from the stated noise of "
            "the wheels, and each set of tags counts once, because the error of a set that is read again is the "
            "same error. That asks for no tuning, but no gain of this form is best for every noise.",
        ),
        parts=(
            Table(
                caption="Mean position error",
                head=("wheels, % after 1 m", "estimator", "position, m"),
                rows=tuple(sorted(rows, key=lambda row: float(row[0]))),
                words=2,
            ),
        ),
    )


def _better(found: Found) -> Section:
    names = (
        "midrange",
        "centroid",
        "minimax",
        "midrange, variances",
        "centroid, variances",
        "minimax, variances",
        "midrange, tags one by one",
    )
    return Section(
        heading="Better estimators, and a slower reader",
        paragraphs=(
            "Centroid and minimax (the centre of all places that read the same tags) in place of the midrange, "
            "alone and compensated by variances. And the midrange with a reader that takes a whole sample for "
            "each tag (Fig. 3): while it gathers the tags of one field, the robot has left it. At 0.25 m/s the "
            "printed 0.016 m needs all tags within one sample.",
        ),
        parts=(Table(caption="Mean errors", head=_ROW_HEAD, rows=_rows(found, names), words=3),),
    )


def _not_reproduced() -> Section:
    return Section(
        heading="What is not reproduced",
        paragraphs=(
            "Radius and gain are fitted, so that the positions of both tables show that one plausible setting "
            "gives the paper's numbers, not that it is the authors'. Orientations of Table 1 (1.72° and 1.12°) "
            "come out smaller by the letter of Eq. 4 to 8; chords that begin at the end of the one before, with "
            "half of what the wheels turned, come nearer. Path-1, Path-2 and the curves of Fig. 15 and 17 are "
            "lost from the copy at hand. The real robot's odometry is unknown.",
        ),
    )


def _all_cells(found: Found) -> Data:
    rows = []
    for (path, floor, name, choice), table in found.items():
        cells = [path, floor, name, f"{choice.radius_m:g}", f"{choice.wheels:g}", str(len(table))]
        for column in (POSITION.column, HEADING.column):
            score = table.score(column)
            cells += [f"{score.value:.9g}", f"{score.standard_error:.9g}"]
        rows.append(tuple(cells))
    head = ("path", "floor", "estimator", "radius_m", "wheels_share", "drives")
    columns = ("position_error_m", "position_error_se_m", "heading_error_rad", "heading_error_se_rad")
    return Data(name="cells", head=(*head, *columns), rows=tuple(rows))
