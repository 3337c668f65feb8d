"""What the study of sampling intervals found, in sentences."""

from collections.abc import Mapping
from typing import Final

from layoutopt.score_text import percent_text
from layoutopt.scores import TrialOutcomes, paired_difference
from objectives.uhf_coverage import alias_share
from studies.antenna_yaw_setting import ERROR, tracking_layout
from studies.antenna_yaw_words import difference_text, mm_text
from studies.sampling_setting import READINGS, Place, Setting

Found = Mapping[Place, TrialOutcomes]
ALLOWANCE: Final = 0.1
"""Share of the least error that a longer interval may cost: curves that vary by less pass for flat in liang2020
(Tables 2 and 3, from K = 9 and N = 100 on)."""


def longest_without_loss(setting: Setting, found: Found, speed_m_s: float, reading: str) -> float | None:
    """Return the longest interval that is shown to cost no accuracy, ``None`` while cells are missing.

    It is the longest at which the 95 % bound of the paired difference in mean error from the interval of the least
    error is within `ALLOWANCE` of that error; the interval of the least error itself is always one.
    """
    places = setting.row(speed_m_s, reading)
    if any(place not in found for place in places):
        return None
    best = min(places, key=lambda place: found[place].score(ERROR).value)
    allowed_m = ALLOWANCE * found[best].score(ERROR).value
    fit = [
        place.interval_s
        for place in places
        if place == best or paired_difference(found[place], found[best], ERROR).upper() <= allowed_m
    ]
    return max(fit)


def summary(setting: Setting, found: Found) -> list[str]:
    """Return the answer in a few sentences."""
    own = setting.own
    interval_s = longest_without_loss(setting, found, own.speed_m_s, own.reading)
    if interval_s is None:
        return ["Not every cell is finished, so no interval can be recommended."]
    chosen = own._replace(interval_s=interval_s)
    lines = [
        f"Take {milliseconds(interval_s)}: the longest interval at which a person who walks at "
        f"{own.speed_m_s:g} m/s is tracked within {percent_text(ALLOWANCE)} of the least error (phases read with "
        f"{own.reading}); mean error {mm_text(found[chosen])} mm over {len(found[chosen])} trials."
    ]
    if own.interval_s != interval_s:
        difference = paired_difference(found[own], found[chosen], ERROR)
        lines.append(f"The spec's {milliseconds(own.interval_s)} errs {difference_text(difference)}.")
    limits = [
        f"{milliseconds(setting.longest_s(reading, own.speed_m_s))} with {reading}"
        for reading in setting.readings
        if reading in READINGS
    ]
    if limits:
        lines.append(
            f"Where that person walks straight towards the robot or away, phases tell the speed up to "
            f"{', '.join(limits)}; of the walk {percent_text(exact_aliases(setting, chosen))} of the phase pairs "
            "are then beyond the first of these."
        )
    for speed in setting.speeds_m_s:
        if speed != own.speed_m_s:
            other = longest_without_loss(setting, found, speed, own.reading)
            if other is not None:
                error = mm_text(found[own._replace(speed_m_s=speed, interval_s=other)])
                lines.append(f"At {speed:g} m/s: {milliseconds(other)}, mean error {error} mm.")
    count = setting.tracking.counts[0]
    lines.append(
        f"{count} antennas take turns, so each has {milliseconds(interval_s / count)} of the interval: a reading "
        "that takes longer cannot keep it."
        if count > 1
        else f"One antenna has the whole interval for a reading: {milliseconds(interval_s)}."
    )
    return [*lines, *_tag_lines(setting, found)]


def _tag_lines(setting: Setting, found: Found) -> list[str]:
    """Return how much a tag of another strength costs at worst."""
    own = setting.own
    others = [own._replace(offset_db=offset) for offset in setting.offsets_db if offset != own.offset_db]
    known = [place for place in others if place in found]
    if not known or own not in found:
        return []
    worst = max(known, key=lambda place: found[place].score(ERROR).value)
    difference = paired_difference(found[worst], found[own], ERROR)
    return [
        f"A tag that answers {worst.offset_db:+g} dB against the calibrated type is the worst of those tried: it "
        f"errs {difference_text(difference)}."
    ]


def milliseconds(time_s: float) -> str:
    """Return a time in milliseconds.

    >>> milliseconds(0.4), milliseconds(0.20366)
    ('400 ms', '204 ms')
    """
    return f"{1000.0 * time_s:.0f} ms"


def exact_aliases(setting: Setting, place: Place) -> float:
    """Return the exact share of ambiguous phase pairs of a cell."""
    groups = tracking_layout(setting.tracking, interval_s=place.interval_s).readers_of("signal")
    return alias_share(groups, setting.world(place))
