"""The page of the kim2010 study: homing errors beside the paper's, one tour in pictures, and what was chosen."""

import math
from collections.abc import Mapping
from typing import Final

import numpy as np

from layoutopt.commissioning.estimated import wilson
from layoutopt.estimators.crossing_time import CrossingTime, RunningCrossingTime
from layoutopt.estimators.crossing_velocity import sensitivity, velocity
from layoutopt.identity import FloatArray
from layoutopt.plots.curves import Curve, Panel, draw_curves
from layoutopt.plots.trajectories import Paths, draw_trajectories
from layoutopt.readings import Prior
from layoutopt.scores import TrialOutcomes
from layoutopt.simulation.trials import TrialRecord, knowledge_of, record_trial
from layoutopt.streams import Streams
from objectives.invisibility import (
    blind_probability_over_directions,
    blind_run_quantile,
    corridors,
)
from studies.page import Data, Page, Picture, Section, Table
from studies.published.comparison import scaled, with_interval
from studies.published.kim2010_setting import (
    RADIUS_M,
    SPEED_M_S,
    SUDOKU_SEED,
    TILT_RAD,
    Choice,
    layout,
    patterns,
    scenario,
)

Found = Mapping[tuple[str, str, Choice], TrialOutcomes]
GOAL: Final = "position_error_mean"
PAPERS_M: Final = 0.05
"""Fig. 15: all homing errors of 50 tours lie below 5 cm."""
PAPERS_TOURS: Final = 50
_BASE: Final = Choice()
_LENGTHS_M: Final = (0.4, 1.0, 2.0)


def below(table: TrialOutcomes) -> tuple[int, int]:
    """Return how many tours came home within 5 cm, and of how many."""
    errors_m = table.column(GOAL)
    return int((errors_m < PAPERS_M).sum()), len(errors_m)


def share_text(table: TrialOutcomes) -> str:
    """Return the share of tours within 5 cm with its 95 % interval after Wilson."""
    hits, count = below(table)
    low, high = wilson(hits, count)
    return f"{100.0 * hits / count:.1f} ({100.0 * low:.1f} to {100.0 * high:.1f})"


def summary(found: Found) -> list[str]:
    """Return what the paper's method does on the paper's floor, and beside it on others."""
    lines = []
    for floor in patterns():
        table = found.get((floor, "paper", _BASE))
        if table is not None:
            lines.append(
                f"{floor} floor, the paper's method: homing error "
                f"{with_interval(scaled(table.score(GOAL), 1e3, unit='mm'))} mm on average, "
                f"{share_text(table)} % of {len(table)} tours within 50 mm (paper: all of {PAPERS_TOURS}, Sudoku)"
            )
    return lines or ["no cell is finished"]


def page_of(found: Found, streams: Streams, *, failed: int) -> Page:
    """Return the whole page."""
    return Page(
        title="kim2010: crossing times over pseudorandom tiles, run again",
        question="Does a robot that measures crossing times come home within 5 cm, and on what does it depend?",
        summary=tuple(summary(found)),
        sections=(
            _choices(),
            _homing(found),
            _open_choices(found),
            _one_tour(streams),
            _formula(),
            _invisibility(),
            _not_reproduced(),
        ),
        facts={
            "Paper": "S. Kim and others: Pseudorandom RFID tag arrangement for improved mobile robot localization "
            "(book chapter, 2010)",
            "Command": "layoutopt study published/kim2010",
            "Seed": str(streams.seed),
            "Tours": f"{sum(map(len, found.values()))}, {max(map(len, found.values()), default=0)} a cell",
            "Failed tasks": str(failed),
            "Intervals": "± is half the width of the two-sided 95 % interval of the mean (Student); shares have "
            "95 % intervals after Wilson; the same tours for all floors and estimators",
        },
        data=(_data(found),),
    )


def _choices() -> Section:
    return Section(
        heading="What the paper states, and what was chosen",
        paragraphs=(
            "Stated: Eq. 3 to 6 (1, 2, 4 and 5 are lost in the copy at hand and were restored from the geometry), "
            "the read disc of 100 mm, the antenna 15 mm above the floor, four tags on each tile of 70 cm, sixteen "
            "tiles of a Sudoku floor side by side, and the tour at 10 cm/s.",
            f"Chosen: which Sudoku (ours, seed {SUDOKU_SEED}, no repeats on the diagonals; the paper's is in a "
            f"figure only), a scan every {_BASE.scan_s:g} s, and a heading that is off by {_BASE.heading_deg:g}° "
            "(standard deviation) after the turn of 135° and at the start. The heading counts only where it "
            "decides between mirror branches. Speed within a leg is constant, as the paper assumes.",
            "The paper steers by the estimate and measures where the robot comes to stand. Here the robot follows "
            "the tour exactly, and the homing error is that of the estimate at its end; to first order they are "
            "the same. A sampled reader sees a tag late and loses it early: half a scan is taken off and added.",
            "Beside the paper's method stands least squares over all crossings of a leg, started on every mirror "
            "branch, once with the paper's clock (time at constant speed) and once with the way of the wheels, "
            "which wander by 1 % after 1 m.",
        ),
    )


def _row(labels: tuple[str, ...], table: TrialOutcomes) -> tuple[str, ...]:
    errors_mm = 1e3 * table.column(GOAL)
    hits, count = below(table)
    return (
        *labels,
        with_interval(scaled(table.score(GOAL), 1e3, unit="mm")),
        f"{float(np.median(errors_mm)):.1f}",
        f"{float(errors_mm.max()):.0f}",
        share_text(table),
        f"{100.0 * (hits / count) ** PAPERS_TOURS:.3g}",
    )


_HEAD: Final = (
    "mean, mm",
    "median, mm",
    "largest, mm",
    "within 50 mm, %",
    f"chance that {PAPERS_TOURS} of {PAPERS_TOURS} are, %",
)


def _homing(found: Found) -> Section:
    rows = [_row((floor, name), table) for (floor, name, choice), table in found.items() if choice == _BASE]
    return Section(
        heading="Fig. 15: homing errors",
        paragraphs=(
            f"The paper reports that all of {PAPERS_TOURS} tours came home within 50 mm. The last column is what "
            "the simulated share makes of that claim, as a point estimate.",
            "On the square floor both legs along the axes lead through blind corridors: the robot meets no tag on "
            "them and is left with its wheels. That is the paper's case for tiles that are tilted. One tilt for "
            "all tiles does as well on this tour as nine in a Sudoku.",
        ),
        parts=(Table(caption="Homing error", head=("floor", "estimator", *_HEAD), rows=tuple(rows), words=2),),
    )


def _open_choices(found: Found) -> Section:
    items = [
        (choice, name, table)
        for (floor, name, choice), table in found.items()
        if floor == "Sudoku" and name != "wheels alone"
    ]
    names = list(dict.fromkeys(name for _, name, _ in items))
    items.sort(key=lambda item: (item[0].scan_s, item[0].heading_deg, names.index(item[1])))
    rows = [_row((f"{c.heading_deg:g}", f"{1e3 * c.scan_s:g}", name), table) for c, name, table in items]
    return Section(
        heading="What the open choices do",
        paragraphs=(
            "Heading error after the turn, and time between scans, one at a time, on the Sudoku floor. A heading "
            "that is off by a degree or more lets the paper's method take the wrong mirror branch now and then; "
            "such a tour ends decimetres away, and the paper's claim needs half a degree or better. Least squares "
            "over all crossings of a leg finds back.",
        ),
        parts=(
            Table(
                caption="Homing error, Sudoku floor",
                head=("heading error, °", "scan, ms", "estimator", *_HEAD),
                rows=tuple(rows),
                words=3,
            ),
        ),
    )


def _tour(streams: Streams) -> tuple[TrialRecord, FloatArray]:
    """Return one tour with the paper's method, and rows of (time, speed, direction) of its fits."""
    floor, world = layout(patterns()["Sudoku"], _BASE), scenario(_BASE)
    record = record_trial(floor, world, CrossingTime(), streams, 0)
    start = record.drive.poses[0]
    running = RunningCrossingTime(
        Prior(pose=(float(start[0]), float(start[1]), float(start[2])), sigma_m=0.001, sigma_rad=0.01),
        knowledge_of(floor, world, CrossingTime()),
    )
    fits: list[tuple[float, float, float]] = []
    latest = None
    for step, (motion, reads) in enumerate(record.observations.steps()):
        running.step(motion, reads)
        if running.fit is not None and running.fit is not latest:
            latest = running.fit
            fits.append(((step + 1) * _BASE.scan_s, latest.speed / _BASE.scan_s, latest.direction_rad))
    return record, np.asarray(fits, dtype=np.float64).reshape(-1, 3)


def _one_tour(streams: Streams) -> Section:
    record, fits = _tour(streams)
    true_m, found_m = record.drive.poses[1:, :2], record.trajectory.poses[:, :2]
    time_s = np.asarray(_BASE.scan_s * np.arange(1, len(true_m) + 1), dtype=np.float64)
    off_mm = 1e3 * (found_m - true_m)
    directions_deg = np.degrees(fits[:, 2])
    tags_m = layout(patterns()["Sudoku"], _BASE).floor_tags.lay_on(scenario(_BASE).site).xy_m
    return Section(
        heading="Fig. 12 to 14: one tour",
        paragraphs=(
            f"The first simulated tour over the Sudoku floor with the paper's method: {len(fits)} crossings gave "
            f"speeds of {1e3 * fits[:, 1].min():.1f} to {1e3 * fits[:, 1].max():.1f} mm/s "
            f"(true: {1e3 * SPEED_M_S:g}).",
        ),
        parts=(
            Picture(
                name="velocity",
                caption="Speed and direction of the legs, at each crossing (paper: Fig. 12).",
                drawn=draw_curves(
                    [
                        Panel(
                            title="speed",
                            x_label="time, s",
                            y_label="speed, mm/s",
                            curves=(Curve(name="estimated", x=fits[:, 0], y=1e3 * fits[:, 1]),),
                        ),
                        Panel(
                            title="direction",
                            x_label="time, s",
                            y_label="direction, °",
                            curves=(Curve(name="estimated", x=fits[:, 0], y=directions_deg % 360.0),),
                        ),
                    ]
                ),
            ),
            Picture(
                name="deviation",
                caption="Deviation of the estimated place, in absolute value (paper: Fig. 13).",
                drawn=draw_curves(
                    [
                        Panel(
                            title="deviation",
                            x_label="time, s",
                            y_label="deviation, mm",
                            curves=(
                                Curve(name="x", x=time_s, y=np.abs(off_mm[:, 0])),
                                Curve(name="y", x=time_s, y=np.abs(off_mm[:, 1])),
                            ),
                        )
                    ]
                ),
            ),
            Picture(
                name="tour",
                caption="True and estimated path (paper: Fig. 14).",
                drawn=draw_trajectories(
                    [Paths(title="Sudoku floor", true_m=true_m, estimated_m={"paper": found_m}, tags_m=tags_m)]
                ),
            ),
        ),
    )


def _formula() -> Section:
    entry_s, inside_s = 9.134183401606, 1.704223891880
    found = velocity(100.0, 10.0, entry_s, inside_s)
    slopes = sensitivity(100.0, 10.0, entry_s, inside_s)
    rows = [
        (
            word,
            f"{0.05 * to_speed:+.4f}",
            f"{math.degrees(0.05 * to_heading):+.3f}",
        )
        for word, to_speed, to_heading in (
            ("to entry", slopes.speed_to_entry, slopes.heading_to_entry),
            ("inside", slopes.speed_to_inside, slopes.heading_to_inside),
        )
    ]
    return Section(
        heading="Eq. 4 to 6",
        paragraphs=(
            "A start 100 cm from a tag, a disc of 10 cm, 10 cm/s at 3°: the times "
            f"{entry_s:.6f} and {inside_s:.6f} s give back {found.speed_m_s:.6f} cm/s and "
            f"±{math.degrees(found.headings_rad[0]):.6f}°. What 50 ms more do, to first order:",
        ),
        parts=(Table(caption="50 ms more", head=("on the time", "speed, cm/s", "heading, °"), rows=tuple(rows)),),
    )


def _invisibility() -> Section:
    rows = []
    for floor, pattern in patterns().items():
        found = corridors(pattern, RADIUS_M)
        cells = [
            f"{100.0 * value:.2f}"
            for length in _LENGTHS_M
            for mean in [blind_probability_over_directions(pattern, RADIUS_M, length)]
            for value in (mean.mean, mean.worst)
        ]
        quantiles = [f"{blind_run_quantile(pattern, RADIUS_M, share):.2f}" for share in (0.95, 0.99)]
        worst = max(item.blind_fraction for item in found)
        rows.append((floor, f"{100.0 * worst:.3f}", *cells, *quantiles))
    return Section(
        heading="Section 4: tag invisibility, exactly",
        paragraphs=(
            "Chance that a straight run from a random start meets no disc, mean and worst over direction, and the "
            "blind runs that 95 and 99 % do not exceed. The Sudoku floor is far better than the square one in the "
            "worst direction and in the tail, as the paper says. On short runs it is worse on average, because "
            f"its tags come closer to each other; and one tilt of {math.degrees(TILT_RAD):g}° for all tiles has a "
            "smaller mean at 1 m: most of the gain comes from tilting tiles at all.",
            "Tiles that hold their discs, laid side by side, keep a blind line along every seam, whatever is on "
            "them: the worst share of blind lines of a Sudoku floor is that of its seams.",
        ),
        parts=(
            Table(
                caption="Invisibility at four tags a tile of 70 cm, r = 100 mm",
                head=(
                    "floor",
                    "worst share of blind lines, %",
                    *(f"B at {length:g} m, {what}, %" for length in _LENGTHS_M for what in ("mean", "worst")),
                    "95 % run, m",
                    "99 % run, m",
                ),
                rows=tuple(rows),
            ),
        ),
    )


def _not_reproduced() -> Section:
    return Section(
        heading="What is not reproduced",
        paragraphs=(
            "The figures' values cannot be read from the copy at hand, so that Fig. 12 to 14 are compared in "
            "words. The paper's own Sudoku is lost. How well its robot kept heading and speed is not told; the "
            "table above says how good the heading must have been for 50 of 50. A speed that changes within a "
            "leg, which breaks Eq. 3, is not simulated.",
        ),
    )


def _data(found: Found) -> Data:
    rows = []
    for (floor, name, choice), table in found.items():
        score, (hits, count) = table.score(GOAL), below(table)
        rows.append(
            (
                floor,
                name,
                f"{choice.heading_deg:g}",
                f"{choice.scan_s:g}",
                str(count),
                f"{score.value:.9g}",
                f"{score.standard_error:.9g}",
                f"{float(table.column(GOAL).max()):.9g}",
                str(hits),
            )
        )
    head = (
        "floor",
        "estimator",
        "heading_error_deg",
        "scan_s",
        "tours",
        "homing_error_m",
        "homing_error_se_m",
        "largest_m",
        "within_50_mm",
    )
    return Data(name="homing", head=head, rows=tuple(rows))
