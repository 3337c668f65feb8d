"""Words that several parts of the main study's report share: verdicts on demands, intervals, faults of a world."""

from collections.abc import Mapping, Sequence
from typing import Final

from layoutopt.plots.front import known_interval
from layoutopt.problem import Limit
from layoutopt.scenario import Faults, Scenario
from layoutopt.score_text import NOT_KNOWN, interval_text, limit_text, score_text
from layoutopt.scores import SCORE_UNITS, Score, Scores
from layoutopt.units import format_length

PLAIN: Final[Mapping[str, str]] = {
    "cost": "all of it costs {}",
    "position_error_mean": "a robot is on average {} from where it believes to be",
    "position_error_p95": "in 95 of 100 moments a robot is {} from where it believes to be",
    "heading_error_mean": "a robot looks on average {} past where it believes to look",
    "heading_error_p95": "in 95 of 100 moments a robot looks {} past where it believes to look",
    "lost_share": "a robot is lost {} of the time",
}
"""Scores as sentences without a term of statistics; the gap takes the value."""
_ROUTES: Final[Mapping[str, str]] = {
    "patrol": "tours of the whole floor",
    "point_to_point": "errands from place to place",
    "circle": "circles",
    "way_points": "the routes of the file",
}


def interval_words(score: Score | None, name: str = "", *, signed: bool = False) -> str:
    """Return the 95 % interval, or that it is not known: Student's is absurd for a handful of replications."""
    if score is not None and known_interval(score) is None:
        return f"interval {NOT_KNOWN} (n = {score.count})"
    return interval_text(score, name, signed=signed)


def plain_limit(limit: Limit) -> str:
    """Return a demand in everyday words, in those of `limit_text` where there are none for its score."""
    zone, _, quantity = limit.score.rpartition(".")
    if quantity not in PLAIN:
        return limit_text(limit)
    end = score_text(Score(value=limit.end, unit=SCORE_UNITS[quantity]), quantity)
    words = PLAIN[quantity].format(f"{'at most' if limit.upper is not None else 'at least'} {end}")
    return f"in the zone “{zone}” {words}" if zone else words


def number_text(count: float) -> str:
    """Return a number of things, at most two decimals, with thin spaces between thousands as in amounts of money.

    >>> number_text(1292).replace(chr(0x202f), "_"), number_text(21.5333)
    ('1_292', '21.53')
    """
    return f"{round(count, 2):,.15g}".replace(",", "\u202f")


def counted_words(count: int, word: str) -> str:
    """Return a number with what it counts, thousands apart.

    >>> counted_words(1, "tag"), counted_words(3, "tag")
    ('1 tag', '3 tags')
    """
    return f"{number_text(count)} {word}{'s' if count != 1 else ''}"


def world_words(scenario: Scenario) -> str:
    """Return how robots drive in a world and what goes wrong there, in words."""
    return f"{_ROUTES[scenario.routes.kind]}; {fault_words(scenario.faults)}"


def bare_text(score: Score | None, name: str = "", *, signed: bool = False) -> str:
    """Return a score as `score_text` does, without the number of drives where its standard error is known.

    >>> bare_text(Score(value=0.0, unit="", count=200, share=True), "lost_share")
    '0 % (at most 1.5 %)'
    """
    text = score_text(score, name, signed=signed)
    if score is None:
        return text
    text = text.removesuffix(f" (n = {score.count})").replace(f"(n = {score.count}, at ", "(at ")
    return text.replace(" at 95 % confidence)", ")")


def with_exact(search: Scores, held_out: Scores | None) -> dict[str, Score]:
    """Return held-out scores with the exact ones of the search, which hold in every world."""
    return {**{name: score for name, score in search.items() if score.exact}, **(held_out or {})}


def verdict(limit: Limit, scores: Scores) -> str:
    """Return ``"met"``, ``"broken"``, ``"undecided"``, or that the score is not known."""
    score = scores.get(limit.score)
    if score is None:
        return NOT_KNOWN
    return "met" if limit.met(score) else "broken" if limit.broken(score) else "undecided"


def verdict_of_all(limits: Sequence[Limit], scores: Scores) -> str:
    """Return the worst verdict over all limits: broken, not known, undecided, met; empty without limits."""
    return worst_verdict([verdict(limit, scores) for limit in limits])


def worst_verdict(verdicts: Sequence[str]) -> str:
    """Return the worst of some verdicts; empty if there are none."""
    return next((word for word in ("broken", NOT_KNOWN, "undecided", "met") if word in verdicts), "")


def fault_words(faults: Faults) -> str:
    """Return what goes wrong in a world, in words."""
    words = []
    for value, text in (
        (faults.tag_placement_sigma_m, f"tags {format_length(faults.tag_placement_sigma_m)} off on each axis"),
        (faults.dead_tag_share, f"{_percent(faults.dead_tag_share)} of the tags dead"),
        (faults.missed_read_share, f"{_percent(faults.missed_read_share)} of the reads missed"),
        (
            faults.wrong_identity_share,
            f"{_percent(faults.wrong_identity_share)} of the reads with a wrong identity",
        ),
        (faults.antenna_height_error_m, f"antennas {format_length(faults.antenna_height_error_m)} too high"),
        (faults.read_edge_m, f"read discs with a soft edge of {format_length(faults.read_edge_m)}"),
        (faults.direction_noise_rad, f"directions {faults.direction_noise_rad:.3g} rad off"),
        (faults.clock_error_s, f"readings {faults.clock_error_s:g} s late"),
    ):
        if value != 0.0:
            words.append(text)
    if faults.tag_offset_m != (0.0, 0.0):
        words.append(f"all tags shifted by {' and '.join(format_length(shift) for shift in faults.tag_offset_m)}")
    if faults.kidnapped_at_s is not None:
        words.append(f"the robot lifted to another place after {faults.kidnapped_at_s:g} s")
    return "; ".join(words) or "nothing goes wrong"


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"
