"""The page of poses that look alike: how far apart they are, by pattern, and what repeated identities would do."""

import math
from collections.abc import Mapping
from typing import Final

import numpy as np

from layoutopt.geometry import reduced_cell
from layoutopt.identity import FloatArray
from layoutopt.layout import TagPattern
from layoutopt.plots.curves import Curve, Panel, draw_curves
from layoutopt.scores import wilson
from studies import columns
from studies.aliasing import Aliasing
from studies.page import Data, Page, Picture, Section, Table
from studies.published.comparison import percent_text
from studies.recovery import UNKNOWN_START, Place
from studies.recovery_page import Found, pattern_text, times_s
from studies.same_reads import MOST_ANTENNAS, Likeness, farthest_m

Alike = Mapping[int, Likeness]
_MM: Final = 1000.0


def summary(study: Aliasing, alike: Alike, found: Found) -> list[str]:
    """Return whether there is any alias, what remains, and how often a start is never found."""
    lost = study.lost
    bound = _MM * max(farthest_m(study.antennas(layout)) for layout in lost.layouts)
    lines = [
        "No: every tag has an identity of its own, so a robot that reads a tag cannot take its place for one far "
        f"away. Poses with the same reads are at most {bound:.0f} mm apart (proven for reads that name the right "
        "tag), whatever the pattern."
    ]
    for number, item in alike.items():
        text = (
            f"{pattern_text(lost, number)}: in {100.0 * item.share(0, 0):.0f} % of all poses no antenna reads a "
            f"tag, and a robot that stands knows nothing; in {100.0 * item.share(1, 1):.0f} % one does"
        )
        if item.share(1, 1):
            text += f", and poses with these reads are up to {_MM * item.mean_m(1, 1):.0f} mm apart on average"
        if item.share(2, MOST_ANTENNAS):
            text += (
                f"; in {100.0 * item.share(2, MOST_ANTENNAS):.2g} % two or more do, up to "
                f"{_MM * item.mean_m(2, MOST_ANTENNAS):.0f} mm and "
                f"{math.degrees(item.mean_rad(2, MOST_ANTENNAS)):.0f}°"
            )
        lines.append(f"{text} ({study.poses} poses drawn).")
    starts = [
        f"{_never_text(study, found, number)} % with {pattern_text(lost, number)}"
        for number in range(len(lost.layouts))
        if _place(study, number) in found
    ]
    if starts:
        lines.append(
            f"From an unknown start, {lost.estimators[0].name} had not found itself after "
            f"{lost.limit_s(UNKNOWN_START):g} s in {'; '.join(starts)} of the drives (95 % after Wilson)."
        )
    periods = [
        f"{_MM * period_m(layout.floor_tags.base.pattern):g} mm with {pattern_text(lost, number)}"
        for number, layout in enumerate(lost.layouts)
        if number in alike
    ]
    if periods:
        lines.append(
            "Were identities the same in every period, as on tiles that are delivered with repeated numbers, "
            f"every reading would come again at {'; '.join(periods)}."
        )
    return lines


def period_m(pattern: TagPattern) -> float:
    """Return the shortest period of a pattern, m; infinite for one that does not repeat."""
    if pattern.cell_m is None:
        return math.inf
    return float(np.linalg.norm(reduced_cell(pattern.cell_m)[0]))


def page_of(study: Aliasing, alike: Alike, found: Found, *, failed: int) -> Page:
    """Return the whole page."""
    lost = study.lost
    counts = sorted({len(table) for table in found.values()})
    return Page(
        study="aliasing",
        title="Places that look alike",
        summary=tuple(summary(study, alike, found)),
        sections=(
            Section(
                heading="Poses with the same reads",
                paragraphs=_words(),
                parts=(*_pictures(study, alike), _table(study, alike, found)),
            ),
        ),
        facts={
            "Layout": f"{lost.layouts[0].floor_readers[0].label}, as the first layout of the design space has "
            "that can be built; the patterns are those of the space for the whole floor",
            "World": lost.world,
            "Poses": f"{study.poses} over each pattern, evenly over its cell and all headings, without borders",
            "Trials": f"{sum(map(len, found.values()))}; {' or '.join(map(str, counts)) or 'none'} a cell",
            "Seed": str(lost.seed),
            "Failed tasks": str(failed),
        },
        data=(_data(study, alike, found),),
    )


def _words() -> tuple[str, ...]:
    return (
        "A robot stands still and all its antennas listen. Two poses with the same reads, the same tags by the "
        "same antennas, cannot be told apart. A read tag lies within the read radius of its antenna in both, so "
        "both lie within that and the antenna's distance from the middle of the robot of the tag: that gives the "
        "bound. With one antenna reading, the robot may be turned about its tag by any angle. With two, place and "
        "heading are tied. A robot that drives leaves most of this behind: odometry links its readings.",
        "Distances are the largest found between the poses drawn, averaged over the poses: more poses would find "
        "slightly larger ones, and a pose whose reads no other one drawn has counts as zero. Where no antenna "
        "reads a tag, all such poses of the floor are alike, and only the way tells them apart.",
        "Tags here have identities of their own. If these came again with every cell of the pattern, a shift by a "
        "period would give the same readings everywhere, however long the robot drives; only borders, zones with "
        "another pattern, walls and a known start would break the tie. Such floors are not simulated.",
    )


def _place(study: Aliasing, number: int) -> Place:
    return Place(UNKNOWN_START, study.lost.estimators[0].name, number)


def _never(study: Aliasing, found: Found, number: int) -> tuple[int, int]:
    times = times_s(study.lost, found[_place(study, number)], UNKNOWN_START)
    return int((~np.isfinite(times)).sum()), len(times)


def _never_text(study: Aliasing, found: Found, number: int) -> str:
    return percent_text(*_never(study, found, number))


def _pictures(study: Aliasing, alike: Alike) -> list[Picture]:
    if not alike:
        return []
    numbers = sorted(alike, key=lambda number: _density(study, number))
    x = np.array([_density(study, number) for number in numbers])

    def values(of: str, least: int, most: int, factor: float) -> FloatArray:
        return factor * np.array([getattr(alike[number], of)(least, most) for number in numbers])

    bound = np.array([_MM * farthest_m(study.antennas(study.lost.layouts[number])) for number in numbers])
    periods = np.array([_MM * period_m(study.lost.layouts[number].floor_tags.base.pattern) for number in numbers])
    curves = [
        Curve(name="one antenna reads", x=x, y=values("mean_m", 1, 1, _MM)),
        Curve(name="two or more read", x=x, y=values("mean_m", 2, MOST_ANTENNAS, _MM)),
        Curve(name="proven bound", x=x, y=bound),
        Curve(name="period, if identities repeated", x=x, y=periods),
    ]
    shares = [
        Curve(name="one antenna reads", x=x, y=values("share", 1, 1, 100.0)),
        Curve(name="two or more read", x=x, y=values("share", 2, MOST_ANTENNAS, 100.0)),
        Curve(name="none reads", x=x, y=values("share", 0, 0, 100.0)),
    ]
    label, log_x = "density (tags/m²)", len(x) > 1
    drawn = [
        Panel(
            title=f"Same reads: at most {bound.max():.0f} mm apart",
            x_label=label,
            y_label="distance (mm)",
            curves=tuple(curve for curve in curves if np.isfinite(curve.y).any()),
            log_x=log_x,
        ),
        Panel(
            title="How many antennas read",
            x_label=label,
            y_label="share of poses (%)",
            curves=tuple(shares),
            log_x=log_x,
        ),
    ]
    return [
        Picture(
            name="aliasing",
            caption="Distance of poses that give the same reads, and how many antennas read a tag, by density.",
            drawn=draw_curves(drawn),
        )
    ]


def _density(study: Aliasing, number: int) -> float:
    return study.lost.layouts[number].floor_tags.base.pattern.density_per_m2


def _numbers(study: Aliasing, alike: Alike, number: int) -> tuple[float, ...]:
    """Return what is known of a pattern: shares, distances, heading and period, in SI units."""
    item, layout = alike[number], study.lost.layouts[number]
    return (
        item.share(0, 0),
        item.share(1, 1),
        item.share(2, MOST_ANTENNAS),
        item.mean_m(1, 1),
        item.largest_m(1, 1),
        item.mean_m(2, MOST_ANTENNAS),
        item.largest_m(2, MOST_ANTENNAS),
        item.mean_rad(2, MOST_ANTENNAS),
        item.alone_share,
        farthest_m(study.antennas(layout)),
        period_m(layout.floor_tags.base.pattern),
    )


_FACTORS: Final = (100.0, 100.0, 100.0, _MM, _MM, _MM, _MM, 180.0 / math.pi, 100.0, _MM, _MM)


def _table(study: Aliasing, alike: Alike, found: Found) -> Table:
    rows = []
    for number in range(len(study.lost.layouts)):
        cells = ["does not repeat", *["–"] * (len(_FACTORS) - 1)]
        if number in alike:
            values = zip(_numbers(study, alike, number), _FACTORS, strict=True)
            cells = [f"{factor * value:.3g}" if math.isfinite(value) else "–" for value, factor in values]
        never = _never_text(study, found, number) if _place(study, number) in found else "–"
        rows.append((pattern_text(study.lost, number), *cells, never))
    return Table(
        caption="Static ambiguity by pattern: mean and largest distance of poses with the same reads",
        head=(
            "pattern",
            "no antenna reads, %",
            "one reads, %",
            "two or more, %",
            "one reads: mean, mm",
            "largest, mm",
            "two or more: mean, mm",
            "largest, mm",
            "heading, °",
            "compared with none, %",
            "proven bound, mm",
            "period, mm",
            "start never found, %",
        ),
        rows=tuple(rows),
    )


def _data(study: Aliasing, alike: Alike, found: Found) -> Data:
    rows = []
    for number, layout in enumerate(study.lost.layouts):
        known = _numbers(study, alike, number) if number in alike else (math.nan,) * len(_FACTORS)
        never, count = _never(study, found, number) if _place(study, number) in found else (0, 0)
        low, high = wilson(never, count)
        rows.append(
            (
                layout.short_key,
                columns.number(_density(study, number)),
                *map(columns.number, known),
                str(count),
                columns.number(never / count) if count else "",
                columns.number(low),
                columns.number(high),
            )
        )
    return Data(
        name="aliasing",
        head=(
            "layout",
            "tags_per_m2",
            "none_reads_share",
            "one_reads_share",
            "two_read_share",
            "one_reads_mean_m",
            "one_reads_largest_m",
            "two_read_mean_m",
            "two_read_largest_m",
            "two_read_heading_rad",
            "alone_share",
            "bound_m",
            "period_m",
            "trials",
            "never_found_share",
            "never_found_low",
            "never_found_high",
        ),
        rows=tuple(rows),
    )
