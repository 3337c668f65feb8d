"""What the study of sampling intervals found, in sentences."""

from collections.abc import Mapping
from typing import Final

from layoutopt.score_text import percent_text
from layoutopt.scores import TrialOutcomes, paired_difference
from objectives.uhf_coverage import alias_share
from studies.antenna_yaw_setting import ERROR, tracking_layout
from studies.antenna_yaw_words import difference_text, mm_text
from studies.cells import shown_on
from studies.finder_scores import elsewhere_lines, laser_lines
from studies.sampling_setting import READINGS, Place, Setting

Found = Mapping[Place, TrialOutcomes]
ALLOWANCE: Final = 0.1
"""Share of the least error that a longer interval may cost: curves that vary by less pass for flat in liang2020
(Tables 3 and 4, from K = 9 and N = 100 on)."""


def complete(setting: Setting, found: Found, speed_m_s: float, reading: str) -> bool:
    """Return whether every interval of a speed and a reading has its trials."""
    return all(place in found for place in setting.row(speed_m_s, reading))


def longest_without_loss(setting: Setting, found: Found, speed_m_s: float, reading: str) -> float | None:
    """Return the longest interval that is shown to cost no accuracy, s; ``None`` if none of them is short enough.

    Only intervals count at which phases tell the speed on a radial way: beyond, a walk may be tracked well by the
    luck of its directions. Of these it is the longest at which the 95 % bound of the paired difference in mean
    error from the one of the least error is within `ALLOWANCE` of that error; that one itself always fits.

    Raises
    ------
    KeyError
        If a cell is not `complete`.
    """
    limit_s = setting.longest_s(reading, speed_m_s)
    places = [place for place in setting.row(speed_m_s, reading) if not place.interval_s > limit_s]
    if not places:
        return None
    best = min(places, key=lambda place: found[place].score(ERROR).value)
    allowed_m = ALLOWANCE * found[best].score(ERROR).value
    return max(
        place.interval_s
        for place in places
        if place == best or paired_difference(found[place], found[best], ERROR).upper() <= allowed_m
    )


def recommended_s(setting: Setting, found: Found) -> float | None:
    """Return the interval for the spec's own person and reading, s; ``None`` if none is known or short enough."""
    own = setting.own
    if not complete(setting, found, own.speed_m_s, own.reading):
        return None
    return longest_without_loss(setting, found, own.speed_m_s, own.reading)


def summary(setting: Setting, found: Found) -> list[str]:
    """Return the answer in a few sentences."""
    own = setting.own
    if not complete(setting, found, own.speed_m_s, own.reading):
        return ["Not every cell is finished, so no interval can be recommended."]
    interval_s = recommended_s(setting, found)
    if interval_s is None:
        return [
            f"No interval that was tried is short enough: where a person walks straight towards the robot at "
            f"{own.speed_m_s:g} m/s, phases read with {own.reading} tell the speed up to "
            f"{milliseconds(setting.longest_s(own.reading, own.speed_m_s))}. List shorter ones under "
            "tracking.interval."
        ]
    chosen = own._replace(interval_s=interval_s)
    lines = [
        f"Take {milliseconds(interval_s)}: the longest interval at which a person who walks at "
        f"{own.speed_m_s:g} m/s is {shown_on(len(found[chosen]), what='trial')} to be tracked within "
        f"{percent_text(ALLOWANCE)} of the least error (phases read with "
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
    others = [(own.speed_m_s, reading) for reading in setting.readings if reading != own.reading]
    others += [(speed, own.reading) for speed in setting.speeds_m_s if speed != own.speed_m_s]
    lines += [
        _row_line(setting, found, speed, reading)
        for speed, reading in others
        if complete(setting, found, speed, reading)
    ]
    count = setting.tracking.counts[0]
    lines.append(
        f"{count} antennas take turns, so each has {milliseconds(interval_s / count)} of the interval: a reading "
        "that takes longer cannot keep it."
        if count > 1
        else f"One antenna has the whole interval for a reading: {milliseconds(interval_s)}."
    )
    return [
        *lines,
        *_tag_lines(setting, found),
        *laser_lines(found[chosen]),
        *elsewhere_lines(setting.elsewhere),
    ]


def _row_line(setting: Setting, found: Found, speed_m_s: float, reading: str) -> str:
    """Return the longest interval of another speed or reading in a sentence."""
    interval_s = longest_without_loss(setting, found, speed_m_s, reading)
    row = f"At {speed_m_s:g} m/s with {reading}"
    if interval_s is None:
        limit = milliseconds(setting.longest_s(reading, speed_m_s))
        return f"{row}: none that was tried; phases tell the speed up to {limit}."
    place = setting.own._replace(speed_m_s=speed_m_s, reading=reading, interval_s=interval_s)
    return f"{row}: {milliseconds(interval_s)}, mean error {mm_text(found[place])} mm."


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
