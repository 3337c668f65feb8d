"""The page of sampling intervals: the longest that costs no accuracy, hard limits, ambiguous phases, tags."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from layoutopt.estimators.phase_velocity import wavelength_m
from layoutopt.plots.curves import Curve, Panel, draw_curves
from layoutopt.plots.front import known_interval
from layoutopt.readers.finders import LARGEST_UHF_PORTS
from layoutopt.score_text import percent_text
from layoutopt.scores import paired_difference
from studies import columns
from studies.antenna_yaw_page import world_text
from studies.antenna_yaw_setting import ERROR, choice_label
from studies.antenna_yaw_words import mm_text
from studies.cells import ENOUGH_TRIALS
from studies.page import Data, Page, Picture, Section, Table
from studies.published.comparison import half_width, scaled, with_interval
from studies.sampling_setting import READINGS, Place, Setting
from studies.sampling_words import (
    ALLOWANCE,
    Found,
    complete,
    exact_aliases,
    longest_without_loss,
    milliseconds,
    recommended_s,
    summary,
)

_MM: Final = 1000.0
_SIMULATED: Final = (
    "tracking_error_mean",
    "tracking_error_p95",
    "tracking_lost_share",
    "detection_share",
    "alias_share",
    "laser_match_share",
)
_FINE: Final = 31
"""Intervals at which the exact share of ambiguous pairs is drawn."""


def page_of(setting: Setting, found: Found, *, seed: int, failed: int) -> Page:
    """Return the whole page."""
    counts = sorted({len(table) for table in found.values()})
    sections = [_error_section(setting, found), _limit_section(setting), _alias_section(setting, found)]
    sections += [_turns_section(setting), _tag_section(setting, found)]
    return Page(
        study="sampling",
        title="Sampling interval of a tracked tag",
        summary=tuple(summary(setting, found)),
        found=recommended_s(setting, found) is not None,
        sections=tuple(sections),
        facts={
            "World": world_text(setting.tracking.world),
            "Antennas": choice_label(setting.tracking.counts[0], setting.tracking.yaws_rad[0]),
            "Tracker": setting.tracker.name,
            "Trials": f"{sum(map(len, found.values()))} of {setting.scenario.duration_s:g} s; "
            f"{' or '.join(map(str, counts))} a cell, the same random numbers for all cells",
            "Seed": str(seed),
            "Failed tasks": str(failed),
            "Intervals": "± is half the width of the two-sided 95 % interval over trials (Student); differences "
            "are paired by trial; a recommended interval was chosen and judged on the same trials",
        },
        data=(_data(setting, found),),
    )


def _error_section(setting: Setting, found: Found) -> Section:
    panels = [panel for speed in setting.speeds_m_s if (panel := _panel(setting, found, speed)) is not None]
    rows = []
    for speed in setting.speeds_m_s:
        for reading in setting.readings:
            places = setting.row(speed, reading)
            longest = None
            if complete(setting, found, speed, reading):
                longest = longest_without_loss(setting, found, speed, reading)
            rows.append(
                (
                    f"{speed:g} m/s",
                    reading,
                    *(mm_text(found[place]) if place in found else "–" for place in places),
                    "none" if longest is None else milliseconds(longest),
                )
            )
    picture = [
        Picture(
            name="error_by_interval",
            caption="Mean tracking error over the interval from one reading of an antenna to its next, by walking "
            "speed, with 95 % intervals. Vertical lines: up to there phases tell the speed on a radial way, with "
            "a sign (λ/4) and with an open sign (λ/2).",
            drawn=draw_curves(panels),
        )
        for _ in panels[:1]
    ]
    return Section(
        heading="Error against the interval",
        paragraphs=(
            "A phase repeats with every half wavelength of radial way. Signed: the displacement nearest to zero "
            "is believed. Two hypotheses: that and the next of the other sign are offered to what the laser sees. "
            "Three aliases: one more on either side. An interval costs no accuracy if it is within what phases "
            "can tell on a radial way, and the 95 % bound of what it adds to the least error of such intervals "
            f"is within {percent_text(ALLOWANCE)} of that. Beyond, a walk may be tracked well by the luck of its "
            "directions.",
            *_step_note(setting),
        ),
        parts=(
            *picture,
            Table(
                caption="Mean tracking error, mm",
                head=("walking", "phases read", *map(milliseconds, setting.intervals_s), "longest without loss"),
                rows=tuple(rows),
                words=2,
            ),
        ),
    )


def _step_note(setting: Setting) -> list[str]:
    """Return what else grows with the number of readings, for trackers of which it is known."""
    if getattr(setting.tracker, "sigma_per", "") != "step":
        return []
    return [
        "This tracker lets the target step at random by the same distance at every reading, whatever the "
        "interval. So more readings a second let it wander more, and short intervals err more too."
    ]


def _panel(setting: Setting, found: Found, speed_m_s: float) -> Panel | None:
    curves = []
    for reading in setting.readings:
        places = setting.row(speed_m_s, reading)
        known = [place for place in places if place in found]
        if not known:
            continue
        curves.append(
            _curve(
                reading,
                [_MM * place.interval_s for place in known],
                found,
                known,
                pointed_out=_longest(setting, found, known),
            )
        )
    marks = [
        (_MM * setting.longest_s(reading, speed_m_s), word)
        for reading, word in (("signed", "λ/4"), ("two hypotheses", "λ/2"))
        if reading in setting.readings and setting.longest_s(reading, speed_m_s) <= max(setting.intervals_s)
    ]
    if not curves:
        return None
    return Panel(
        title=f"walking at {speed_m_s:g} m/s",
        x_label="interval (ms)",
        y_label="mean tracking error (mm)",
        curves=tuple(curves),
        marks=tuple(marks),
        log=True,
    )


def _longest(setting: Setting, found: Found, places: Sequence[Place]) -> tuple[tuple[int, str], ...]:
    """Return which place of a speed is the longest without loss, for the reading of the spec and enough trials."""
    speed_m_s, reading = places[0].speed_m_s, places[0].reading
    enough = min(len(found[place]) for place in places) >= ENOUGH_TRIALS
    if reading != setting.own.reading or not enough or not complete(setting, found, speed_m_s, reading):
        return ()
    interval_s = longest_without_loss(setting, found, speed_m_s, reading)
    return tuple(
        (number, f"longest without\nloss: {milliseconds(place.interval_s)}")
        for number, place in enumerate(places)
        if place.interval_s == interval_s
    )


def _curve(
    name: str,
    x: Sequence[float],
    found: Found,
    places: Sequence[Place],
    pointed_out: tuple[tuple[int, str], ...] = (),
) -> Curve:
    """Return mean errors, mm, with their intervals, of width 0 where too few trials give one worth drawing."""
    scores = [found[place].score(ERROR) for place in places]
    halves = [0.0 if known_interval(score) is None else half_width(score) for score in scores]
    return Curve(
        name=name,
        x=np.array(x),
        y=_MM * np.array([score.value for score in scores]),
        half_width=_MM * np.array(halves),
        pointed_out=pointed_out,
    )


def _limit_section(setting: Setting) -> Section:
    highest_hz = max(setting.tracking.world.signal.channels_hz)
    readings = [reading for reading in setting.readings if reading in READINGS]
    speeds = tuple(
        (
            milliseconds(interval),
            *(f"{READINGS[reading] * wavelength_m(highest_hz) / 4.0 / interval:.3f}" for reading in readings),
        )
        for interval in setting.intervals_s
    )
    intervals = tuple(
        (f"{speed:g} m/s", *(milliseconds(setting.longest_s(reading, speed)) for reading in readings))
        for speed in setting.speeds_m_s
    )
    return Section(
        heading="What phases can tell at all",
        paragraphs=(
            f"At {highest_hz / 1e6:g} MHz a phase repeats every {_MM * wavelength_m(highest_hz) / 2.0:.1f} mm of "
            "radial way. Walking across the line of sight turns no phase, so a walk may be faster than its limit.",
        ),
        parts=(
            Table(
                caption="Largest radial speed, m/s: λ/(4 dt), λ/(2 dt), 3 λ/(4 dt)",
                head=("interval", *readings),
                rows=speeds,
            ),
            Table(caption="Longest interval on a radial way", head=("walking", *readings), rows=intervals),
        ),
    )


def _alias_section(setting: Setting, found: Found) -> Section:
    fine_s = np.linspace(setting.intervals_s[0], setting.intervals_s[-1], _FINE)
    curves = [
        Curve(
            name=f"{speed:g} m/s",
            x=_MM * fine_s,
            y=100.0 * np.array([exact_aliases(setting, _at(setting, speed, float(dt))) for dt in fine_s]),
        )
        for speed in setting.speeds_m_s
    ]
    rows = []
    for speed in setting.speeds_m_s:
        for interval in setting.intervals_s:
            place = _at(setting, speed, interval)
            trials = found[place].score("alias_share") if place in found else None
            rows.append(
                (
                    f"{speed:g} m/s",
                    milliseconds(interval),
                    f"{100.0 * exact_aliases(setting, place):.1f}",
                    "–" if trials is None else with_interval(scaled(trials, 100.0, unit="%")),
                )
            )
    return Section(
        heading="Ambiguous phases",
        paragraphs=(
            "Share of the pairs of readings in a row, both heard, between which the radial way changes by a "
            "quarter wavelength or more: a signed speed is then wrong. Exact by the geometry of the walk.",
        ),
        parts=(
            Picture(
                name="aliases",
                caption="Share of ambiguous pairs over the interval, by walking speed; exact.",
                drawn=draw_curves(
                    [
                        Panel(
                            title="",
                            x_label="interval (ms)",
                            y_label="ambiguous pairs (%)",
                            curves=tuple(curves),
                        )
                    ]
                ),
            ),
            Table(
                caption="Ambiguous pairs, %",
                head=("walking", "interval", "exact", "over trials"),
                rows=tuple(rows),
                words=2,
            ),
        ),
    )


def _at(setting: Setting, speed_m_s: float, interval_s: float) -> Place:
    return setting.own._replace(speed_m_s=speed_m_s, interval_s=interval_s)


def _turns_section(setting: Setting) -> Section:
    rows = tuple(
        (str(count), *(milliseconds(interval / count) for interval in setting.intervals_s))
        for count in range(1, LARGEST_UHF_PORTS + 1)
    )
    return Section(
        heading="Antennas take turns",
        paragraphs=(
            "One reader serves its antennas one after the other, so n antennas need n readings within an "
            "interval. How long a reading takes depends on the reader and on how many tags answer; measure it.",
        ),
        parts=(
            Table(
                caption="Time that each antenna has for its reading, by interval",
                head=("antennas", *map(milliseconds, setting.intervals_s)),
                rows=rows,
            ),
        ),
    )


def _tag_section(setting: Setting, found: Found) -> Section:
    curves, rows = [], []
    for mode in setting.modes:
        places = [setting.own._replace(mode=mode, offset_db=offset) for offset in setting.offsets_db]
        known = [place for place in places if place in found]
        if not known:
            continue
        curves.append(_curve(mode, [place.offset_db for place in known], found, known))
        rows += [_tag_row(setting, found, place) for place in known]
    picture = [
        Picture(
            name="error_by_tag",
            caption="Mean tracking error over how much stronger the tag answers than the calibrated type, with "
            "95 % intervals.",
            drawn=draw_curves(
                [
                    Panel(
                        title="",
                        x_label="strength against the calibrated type (dB)",
                        y_label="mean tracking error (mm)",
                        curves=tuple(curves),
                    )
                ]
            ),
        )
        for _ in rows[:1]
    ]
    return Section(
        heading="Which tag",
        paragraphs=(
            "The sensor model is learned with one type of tag. Another type, or another thing behind it, answers "
            "some decibels weaker or stronger, and the tracker is not told.",
        ),
        parts=(
            *picture,
            Table(
                caption="Mean tracking error by strength of the tag, and what it adds, paired by trial",
                head=("tracker goes by", "strength, dB", "error, mm", "error more, mm", "heard, %"),
                rows=tuple(rows),
            ),
        ),
    )


def _tag_row(setting: Setting, found: Found, place: Place) -> tuple[str, ...]:
    base = place._replace(offset_db=setting.own.offset_db)
    difference = paired_difference(found[place], found[base], ERROR) if base in found else None
    more = None if difference is None or place == base else scaled(difference, _MM, unit="mm")
    heard = found[place].score("detection_share")
    return (
        place.mode,
        f"{place.offset_db:+g}",
        mm_text(found[place]),
        "–" if more is None else with_interval(more),
        f"{100.0 * heard.value:.1f}",
    )


def _data(setting: Setting, found: Found) -> Data:
    rows = []
    for place, table in found.items():
        scores = [table.score(name) for name in _SIMULATED]
        cells = [f"{place.speed_m_s:g}", f"{place.interval_s:g}", place.reading, place.mode]
        cells += [f"{place.offset_db:g}", str(len(table)), columns.number(exact_aliases(setting, place))]
        cells += [text for score in scores for text in columns.pair(score)]
        rows.append(tuple(cells))
    head = ["walking_speed_m_s", "interval_s", "phases_read", "tracker_goes_by", "tag_offset_db", "trials"]
    head.append("expected_alias_share")
    for name in _SIMULATED:
        head += columns.named(name, columns.unit_of(name))
    return Data(name="sampling", head=tuple(head), rows=tuple(rows))
