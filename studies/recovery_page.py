"""The page of lost robots: share localised over time, by pattern and by estimator."""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.labels import pattern_label
from layoutopt.plots.curves import Curve, Panel, draw_curves
from layoutopt.scores import TrialOutcomes, paired_difference, wilson
from studies import columns
from studies.cells import UNFINISHED
from studies.page import Data, Page, Picture, Section, Table
from studies.published.comparison import percent_text, with_interval
from studies.published.medians import median
from studies.recovery import COLUMNS, KIDNAPPED, UNKNOWN_START, Place, Recovery

Found = Mapping[Place, TrialOutcomes]
_TIMES: Final = 13
"""Moments at which the share localised is drawn with its interval."""


_AFTER: Final = {KIDNAPPED: "lifted to another place", UNKNOWN_START: "switched on somewhere"}


def summary(study: Recovery, found: Found) -> list[str]:
    """Return for both ways to be lost how soon the estimator of the search finds itself, by pattern."""
    lines = []
    for situation in COLUMNS:
        search = study.estimators[0].name
        places = [Place(situation, search, number) for number in range(len(study.layouts))]
        known = [place for place in places if place in found]
        if not known:
            continue
        medians = [f"{_median_text(study, found, place)} {_pattern(study, place)}" for place in known]
        lines.append(
            f"Half of the robots {_AFTER[situation]} find themselves after {'; '.join(medians)} ({search})."
        )
        shares = [f"{_share_text(study, found, place)} {_pattern(study, place)}" for place in known]
        limit_s = study.limit_s(situation)
        lines.append(f"{situation.capitalize()}, {search}: localised within {limit_s:g} s in {'; '.join(shares)}.")
        others = [Place(situation, estimator.name, known[0].pattern) for estimator in study.estimators[1:]]
        for place in others:
            if place not in found:
                continue
            lines.append(
                f"{situation.capitalize()}, {place.estimator}: {_share_text(study, found, place)} "
                f"{_pattern(study, place)}, half of the robots after {_median_text(study, found, place)}."
            )
    return lines or [UNFINISHED]


def page_of(study: Recovery, found: Found, *, failed: int) -> Page:
    """Return the whole page."""
    counts = sorted({len(table) for table in found.values()})
    return Page(
        study="recovery",
        title="Lost robots",
        summary=tuple(summary(study, found)),
        sections=(
            Section(
                heading="Share localised over time",
                paragraphs=_words(study),
                parts=(*_pictures(study, found), _table(study, found), *_refused(study)),
            ),
        ),
        facts={
            "Layout": f"{study.layouts[0].floor_readers[0].label}, as the first layout of the design space has "
            "that can be built; the patterns are those of the space for the whole floor",
            "World": study.world,
            "Trials": f"{sum(map(len, found.values()))}; {' or '.join(map(str, counts)) or 'none'} a cell",
            "Seed": str(study.seed),
            "Failed tasks": str(failed),
            "Intervals": "95 %: of shares after Wilson, of medians by order statistics, of means and of paired "
            "differences after Student",
        },
        data=(_data(study, found),),
    )


def _words(study: Recovery) -> tuple[str, ...]:
    judgement = study.design.judgement
    return (
        f"Kidnapped: after {study.kidnapped_at_s:g} s of a drive with a known start the robot is lifted and put "
        "down at the start of another route, and nobody tells it. Unknown start: it is switched on somewhere and "
        "told nothing. It drives on in both.",
        f"A robot is localised once its error stays within {1000.0 * judgement.localised_within_m:g} mm for "
        f"{judgement.hold_s:g} s. One that never is counts in the mean time with all the time that the drive "
        "leaves. Drives are the same for all cells.",
    )


def times_s(study: Recovery, table: TrialOutcomes, situation: str) -> FloatArray:
    """Return the time of each robot, s, infinite for one that was never localised."""
    times = table.column(COLUMNS[situation]).copy()
    times[times >= study.limit_s(situation) - study.design.step_s / 2.0] = np.inf
    return times


def _share_text(study: Recovery, found: Found, place: Place) -> str:
    times = times_s(study, found[place], place.situation)
    return f"{percent_text(int(np.isfinite(times).sum()), len(times))} %"


def _median_text(study: Recovery, found: Found, place: Place) -> str:
    """Return the median time with its interval, as far as half of the robots were localised."""
    times = times_s(study, found[place], place.situation)
    limit_s = study.limit_s(place.situation)
    value = median(np.minimum(times, limit_s))
    if value.value >= limit_s:
        return f"more than {limit_s:g} s"
    if not np.isfinite(value.low):
        return f"{value.value:.3g} s"
    high = f"{value.high:.3g}" if value.high < limit_s else f"more than {limit_s:g}"
    return f"{value.value:.3g} s ({value.low:.3g} to {high})"


def _pattern(study: Recovery, place: Place) -> str:
    return f"with {pattern_text(study, place.pattern)}"


def pattern_text(study: Recovery, number: int) -> str:
    """Return a pattern and its density, such as ``square 100 mm (100 tags/m²)``."""
    pattern = study.layouts[number].floor_tags.base.pattern
    return f"{pattern_label(pattern)} ({pattern.density_per_m2:.3g} tags/m²)"


def _curve(study: Recovery, found: Found, place: Place, name: str, until_s: float) -> Curve:
    times = times_s(study, found[place], place.situation)
    moments_s = np.linspace(0.0, until_s, _TIMES)
    hits = [int((times <= moment).sum()) for moment in moments_s]
    ends = np.array([wilson(count, len(times)) for count in hits]).T
    shares = np.array(hits) / len(times)
    reach = np.abs(np.stack([shares - ends[0], ends[1] - shares]))
    return Curve(name=name, x=moments_s, y=100.0 * shares, half_width=100.0 * reach)


def _until_s(study: Recovery, found: Found, places: Sequence[Place]) -> float:
    """Return when the last robot was localised, s, or the end of the drive if one never was."""
    latest = [float(times_s(study, found[place], place.situation).max()) for place in places]
    limits = [study.limit_s(place.situation) for place in places]
    return min(max(latest, default=0.0), max(limits, default=0.0))


def _panels(study: Recovery, found: Found, named: Mapping[str, tuple[str, int]]) -> list[Panel]:
    panels = []
    for situation in COLUMNS:
        places = {name: Place(situation, *rest) for name, rest in named.items()}
        until_s = _until_s(study, found, [place for place in places.values() if place in found])
        since = "since the robot was lifted" if situation == KIDNAPPED else "since the start"
        panels.append(
            Panel(
                title=situation.capitalize(),
                x_label=f"time {since} (s)",
                y_label="localised (%)",
                curves=tuple(
                    _curve(study, found, place, name, until_s) for name, place in places.items() if place in found
                ),
            )
        )
    return [panel for panel in panels if panel.curves]


def _pictures(study: Recovery, found: Found) -> list[Picture]:
    search = study.estimators[0].name
    patterns = {
        pattern_label(layout.floor_tags.base.pattern): (search, number)
        for number, layout in enumerate(study.layouts)
    }
    estimators = {estimator.name: (estimator.name, 0) for estimator in study.estimators}
    pictures = []
    for name, caption, named in (
        ("recovery", f"Share of robots localised by {search}, by pattern, with 95 % intervals.", patterns),
        ("recovery_estimators", "The same on the densest pattern, by estimator.", estimators),
    ):
        panels = _panels(study, found, named)
        if panels:
            pictures.append(Picture(name=name, caption=caption, drawn=draw_curves(panels)))
    return pictures


def _table(study: Recovery, found: Found) -> Table:
    rows = []
    for place, table in found.items():
        column = COLUMNS[place.situation]
        densest = found.get(place._replace(pattern=0))
        more = None if densest is None or place.pattern == 0 else paired_difference(table, densest, column)
        rows.append(
            (
                place.situation,
                place.estimator,
                pattern_text(study, place.pattern),
                _share_text(study, found, place).removesuffix(" %"),
                _median_text(study, found, place),
                with_interval(table.score(column)),
                "–" if more is None else with_interval(more),
            )
        )
    head = ("what happened", "estimator", "pattern", "localised, %", "median time", "mean time, s")
    return Table(
        caption="Time to be localised; what it adds to the densest pattern is paired by drive",
        head=(*head, "mean time more, s"),
        rows=tuple(rows),
        words=3,
    )


def _refused(study: Recovery) -> Sequence[Table]:
    if not study.refused:
        return ()
    return (Table(caption="Left out", head=("what", "why"), rows=study.refused, words=2),)


def _data(study: Recovery, found: Found) -> Data:
    rows = []
    for place, table in found.items():
        times = times_s(study, table, place.situation)
        low, high = wilson(int(np.isfinite(times).sum()), len(times))
        pattern = study.layouts[place.pattern].floor_tags.base.pattern
        rows.append(
            (
                place.situation,
                place.estimator,
                study.layouts[place.pattern].short_key,
                columns.number(pattern.density_per_m2),
                str(len(times)),
                columns.number(float(np.isfinite(times).mean())),
                columns.number(low),
                columns.number(high),
                *columns.pair(table.score(COLUMNS[place.situation])),
            )
        )
    head = ("situation", "estimator", "layout", "tags_per_m2", "trials", "localised", "localised_low")
    return Data(
        name="recovery", head=(*head, "localised_high", *columns.named("mean_time", "s")), rows=tuple(rows)
    )
