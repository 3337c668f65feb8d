"""The page of the pattern comparison: pictures, bounds, blind runs, and each estimator's error, robot by robot."""

import math
from collections.abc import Collection, Mapping
from typing import Final

from layoutopt.plots.blind_rose import RoseCurve, draw_blind_rose
from layoutopt.plots.curves import Curve, Panel, draw_curves
from layoutopt.plots.pattern_cells import PatternPicture, draw_patterns
from layoutopt.plots.ratios import RatioRow, draw_ratios
from objectives.position_bound import covering_density
from studies.cells import UNFINISHED
from studies.page import Data, Page, Picture, Section, Table
from studies.pattern_scores import LENGTHS_M, STATIC_ESTIMATORS, PatternScores, pattern_scores
from studies.pattern_setting import Setting, patterns, settings
from studies.pattern_verdict import BASE, GOAL, Found, draw_verdict, interval_ends, verdict_lines
from studies.published.comparison import paired_ratio, scaled, with_interval

_DRAWN: Final = ("square", "isosceles", "equilateral", "tilted", "diagonal Sudoku", "random")
_SHOWN: Final = ("one_reader", "crossing_time_branches", "mcl_adaptive")


def summary(found: Found) -> list[str]:
    """Return for each robot which pattern gives its best estimator the least error, with its interval."""
    lines = verdict_lines(found)
    for setting in settings():
        errors = {
            (label, name): table.score(GOAL)
            for (where, label, name), table in found.items()
            if where == setting.name
        }
        if not errors:
            continue
        label, name = min(errors, key=lambda place: errors[place].value)
        square = errors.get((BASE, name))
        beside = "" if square is None else f"; over the square {with_interval(scaled(square, 1e3, unit='mm'))} mm"
        lines.append(
            f"{setting.name} ({setting.words}): least mean error "
            f"{with_interval(scaled(errors[label, name], 1e3, unit='mm'))} mm with {name} over the pattern "
            f"“{label}”{beside}"
        )
    return lines or [UNFINISHED]


def page_of(found: Found, labels: Collection[str], *, seed: int, failed: int) -> Page:
    """Return the whole page of the patterns with these labels."""
    scores = {
        setting.name: {
            label: pattern_scores(pattern, setting.radius_m)
            for label, pattern in patterns(setting).items()
            if label in labels
        }
        for setting in settings()
    }
    counts = sorted({len(table) for table in found.values()})
    return Page(
        study="pattern_comparison",
        title="Tag patterns at equal density",
        summary=tuple(summary(found)),
        sections=(
            *_which(found),
            _pictures(labels),
            *(section for setting in settings() for section in _sections(setting, scores[setting.name], found)),
        ),
        facts={
            "World": "a robot of 0.3 m that drives errands through an empty hall of 6.3 m at 0.25 m/s for 60 s; "
            "known start (20 mm, 2°), the odometry of the default robot, no faults",
            "Seed": str(seed),
            "Trials": f"{sum(map(len, found.values()))}; {' or '.join(map(str, counts))} a cell",
            "Failed tasks": str(failed),
            "Intervals": "± is half the width of the two-sided 95 % interval over trials (Student); ratios are "
            "paired by drive; bounds and blind runs are exact",
        },
        data=(_exact_data(scores), _simulated_data(found)),
    )


def _which(found: Found) -> list[Section]:
    figure = draw_verdict(found)
    if figure is None:
        return []
    return [
        Section(
            heading="Which pattern",
            paragraphs=(
                "Left of 1 a pattern errs less than the square one with as many tags, on the same drives. An "
                "interval that holds 1 shows no difference, and of twenty intervals one leaves 1 out by chance.",
            ),
            parts=(
                Picture(
                    name="which_pattern",
                    caption="Mean position error over that on the square pattern, paired by drive, with 95 % "
                    "intervals, for three robots.",
                    drawn=figure,
                ),
            ),
        )
    ]


def _pictures(labels: Collection[str]) -> Section:
    sparse = settings()[0]
    return Section(
        heading="The patterns",
        paragraphs=(
            "All have one tag per square of one pitch. Discs are those of the sparse setting; thin lines are the "
            "tiles on which tags are laid.",
        ),
        parts=(
            Picture(
                name="patterns",
                caption="Tags, read discs and tiles, at 4 tags per tile of 0.7 m.",
                drawn=draw_patterns(
                    [
                        PatternPicture(label=label, pattern=pattern, radius_m=sparse.radius_m)
                        for label, pattern in patterns(sparse).items()
                        if label in labels
                    ]
                ),
            ),
        ),
    )


def _sections(setting: Setting, scores: Mapping[str, PatternScores], found: Found) -> list[Section]:
    return [
        _bounds(setting, scores),
        *([_blind(setting, scores)] if any(item.blindness for item in scores.values()) else []),
        _errors(setting, found),
    ]


def _bounds(setting: Setting, scores: Mapping[str, PatternScores]) -> Section:
    need = covering_density(setting.radius_m)
    density = next(iter(scores.values())).density_per_m2
    rows = []
    for label, item in scores.items():
        gap = item.half_gap
        rows.append(
            (
                label,
                f"{1e3 * item.spacing_m:.1f}",
                "–" if gap is None or gap.published_m is None else f"{1e3 * gap.published_m:.1f}",
                "–" if gap is None or gap.derived_m is None else f"{1e3 * gap.derived_m:.1f}",
                *(
                    f"{1e3 * value:.1f}"
                    for name in STATIC_ESTIMATORS
                    for value in (item.static[name].worst_m, item.static[name].mean_m)
                ),
                f"{100.0 * item.detection:.1f}",
                f"{1e3 * item.covering_m:.1f}",
            )
        )
    heads = [f"{name}, {what}" for name in STATIC_ESTIMATORS for what in ("worst", "mean")]
    return Section(
        heading=f"{setting.name.capitalize()}: one static reading",
        paragraphs=(
            f"{setting.words[0].upper()}{setting.words[1:]}. The floor has {density:.1f} tags/m²; so that an "
            f"antenna sees a tag everywhere, any pattern needs at least {need:.1f} (Kershner). Errors are those "
            "of a point antenna of this disc that stands still, over the places where it sees a tag; half-gaps "
            "are the rules of han2006 and bound nothing.",
        ),
        parts=(
            Table(
                caption="Static error, mm, and where a tag is in view",
                head=(
                    "pattern",
                    "least spacing, mm",
                    "half-gap printed",
                    "derived",
                    *heads,
                    "in view, %",
                    "covering radius, mm",
                ),
                rows=tuple(rows),
            ),
        ),
    )


def _blind(setting: Setting, scores: Mapping[str, PatternScores]) -> Section:
    rows = []
    known = {label: item.blindness for label, item in scores.items() if item.blindness is not None}
    for label, item in known.items():
        cells = [f"{100.0 * value:.2f}" for pair in zip(item.means, item.worst, strict=True) for value in pair]
        rows.append(
            (
                label,
                str(item.corridors),
                f"{1e3 * item.widest_m:.1f}",
                *cells,
                *(f"{quantile:.2f}" for quantile in item.quantile_m),
                f"{1e3 * item.tail_m:.2f}",
                "infinite" if item.corridors else "finite",
            )
        )
    shown = {label: item for label, item in known.items() if label in _DRAWN}
    return Section(
        heading=f"{setting.name.capitalize()}: blind runs",
        paragraphs=(
            "A run of one antenna is blind if it meets no disc; start and, for the means, direction are anywhere. "
            "A corridor is a straight way without end on which no tag is ever seen: where there is one, the mean "
            "blind run is infinite, whatever its quantiles.",
        ),
        parts=(
            Picture(
                name=f"rose_{_file(setting)}",
                caption=f"Chance that a run of {LENGTHS_M[0]:g} m is blind, by direction.",
                drawn=draw_blind_rose(
                    [
                        RoseCurve(label=label, direction_rad=item.direction_rad, probability=item.probability)
                        for label, item in shown.items()
                    ]
                ),
            ),
            Picture(
                name=f"runs_{_file(setting)}",
                caption="Chance that a run is blind, over all starts and directions, by its length.",
                drawn=draw_curves(
                    [
                        Panel(
                            title=setting.name,
                            x_label="length of the run (m)",
                            y_label="chance that it is blind (%)",
                            curves=tuple(
                                Curve(name=label, x=item.run_m, y=100.0 * item.run_probability)
                                for label, item in shown.items()
                            ),
                            log=True,
                        )
                    ]
                ),
            ),
            Table(
                caption="Blind runs",
                head=(
                    "pattern",
                    "corridor directions",
                    "widest, mm",
                    *(f"B at {length:g} m, {what}, %" for length in LENGTHS_M for what in ("mean", "worst")),
                    "95 % run, m",
                    "99 % run, m",
                    "tail C, mm",
                    "mean run",
                ),
                rows=tuple(rows),
            ),
        ),
    )


def _errors(setting: Setting, found: Found) -> Section:
    own = {(label, name): table for (where, label, name), table in found.items() if where == setting.name}
    names = list(dict.fromkeys(name for _, name in own))
    labels = list(dict.fromkeys(label for label, _ in own))
    rows = tuple(
        (
            name,
            *(
                with_interval(scaled(own[label, name].score(GOAL), 1e3, unit="mm"))
                if (label, name) in own
                else "–"
                for label in labels
            ),
        )
        for name in names
    )
    ratios = []
    for label in labels:
        series = {}
        for name in _SHOWN:
            if label != BASE and (label, name) in own and (BASE, name) in own:
                series[name] = interval_ends(paired_ratio(own[label, name], own[BASE, name], GOAL))
        if series:
            ratios.append(RatioRow(label=label, ratios=series))
    picture = [
        Picture(
            name=f"errors_{_file(setting)}",
            caption="Mean position error over that on the square pattern, paired by drive, with 95 % intervals.",
            drawn=draw_ratios(rows_of_ratios, bands=(), x_label="error over that on the square pattern"),
        )
        for rows_of_ratios in filter(None, [ratios])
    ]
    return Section(
        heading=f"{setting.name.capitalize()}: error on drives",
        paragraphs=(
            "Every cell meets the same drives. An estimator that does not apply to the readers is left out.",
        ),
        parts=(
            *picture,
            Table(caption="Mean position error, mm", head=("estimator", *labels), rows=rows),
        ),
    )


def _file(setting: Setting) -> str:
    return setting.name.replace(" ", "_")


def _exact_data(scores: Mapping[str, Mapping[str, PatternScores]]) -> Data:
    head = ["setting", "pattern", "density_per_m2", "spacing_m", "covering_radius_m", "detection_probability"]
    head += [f"{name}_{what}_m" for name in STATIC_ESTIMATORS for what in ("worst", "mean")]
    head += [f"blind_{length:g}m_{what}" for length in LENGTHS_M for what in ("mean", "worst")]
    head += ["blind_run_p95_m", "blind_run_p99_m", "corridor_directions", "widest_corridor_m", "tail_constant_m"]
    rows = []
    for name, items in scores.items():
        for label, item in items.items():
            values = [item.density_per_m2, item.spacing_m, item.covering_m, item.detection]
            values += [value for error in item.static.values() for value in (error.worst_m, error.mean_m)]
            blind = item.blindness
            if blind is None:
                values += [0.0] * (2 * len(LENGTHS_M) + 5)
            else:
                values += [value for pair in zip(blind.means, blind.worst, strict=True) for value in pair]
                values += [*blind.quantile_m, float(blind.corridors), blind.widest_m, blind.tail_m]
            rows.append((name, label, *(f"{value:.9g}" for value in values)))
    return Data(name="exact", head=tuple(head), rows=tuple(rows))


def _simulated_data(found: Found) -> Data:
    columns = (GOAL, "position_error_p95", "heading_error_mean", "lost_share")
    rows = []
    for place, table in found.items():
        cells = [*place, str(len(table))]
        for column in columns:
            score = table.score(column)
            cells += [
                f"{value:.9g}" if math.isfinite(value) else "" for value in (score.value, score.standard_error)
            ]
        rows.append(tuple(cells))
    head = ("setting", "pattern", "estimator", "trials", *(f"{c}{s}" for c in columns for s in ("", "_se")))
    return Data(name="errors", head=head, rows=tuple(rows))
