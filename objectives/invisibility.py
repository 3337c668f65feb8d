"""Invisibility of tags: how probable it is that a robot drives on blind, how long, and in which direction.

The functions below speak of one antenna of a read radius over a periodic pattern (kim2010, Section 3, where the
antenna is a point and a tag has the disc). For antennas that move together make a sight with
`objectives.periodic_discs.antenna_group` and call the functions of `objectives.blind_runs` and
`objectives.corridors`, of which these are the short forms.
"""

from dataclasses import dataclass, field
from functools import lru_cache
from typing import ClassVar, Final, overload

import numpy as np

from layoutopt.detection import antennas_of
from layoutopt.identity import FloatArray, by_content
from layoutopt.layout import WHOLE_FLOOR, Layout, TagPattern
from layoutopt.protocols import Antennas, ObjectiveCard
from layoutopt.scenario import Scenario
from layoutopt.scores import SCORE_UNITS, Score, Scores, TrialOutcomes
from objectives import blind_runs
from objectives.blind_runs import DIRECTIONS, MeanBlindRun, OverDirections
from objectives.corridors import Corridor, corridors_of
from objectives.directions import direction_rule
from objectives.periodic_discs import AntennaGroup, antenna_group, one_antenna

CARD: Final = ObjectiveCard(
    summary=(
        "Blind probability of a straight run of 1 m, driven ahead, mean and worst over direction; "
        "quantiles and tail of the blind run."
    ),
    reference="kim2010, Section 3; Santaló, Integral Geometry and Geometric Probability, 2nd ed. 2004",
    scores={
        name: SCORE_UNITS[name]
        for name in (
            "blind_probability_mean",
            "blind_probability_worst",
            "blind_run_p95",
            "blind_run_p99",
            "tail_constant",
        )
    },
    fidelity="exact",
    per_zone=True,
)
RUN_LENGTH_M: Final = 1.0
"""The run of which the scores ``blind_probability_mean`` and ``blind_probability_worst`` speak."""
_QUANTILES: Final = (0.95, 0.99)
_REMEMBERED: Final = 4096


def mean_gap(pattern: TagPattern, radius_m: float, direction_rad: float) -> float:
    """Return the mean way between two sightings on lines in one direction, m; lines in corridors do not count.

    Discs that do not overlap give (A - N pi r²) / (2 r N) in every direction without a corridor, whatever the
    pattern, so no arrangement of as many tags makes the mean gap shorter.

    Raises
    ------
    ValueError
        If the radius is not positive and finite, or the pattern has no period or no tag.

    References
    ----------
    Santaló, Integral Geometry and Geometric Probability, 2nd ed. 2004, Chapter 8.

    Examples
    --------
    >>> from layoutopt.patterns.square import square
    >>> round(mean_gap(square(pitch_m=0.35), 0.1, 0.3), 6)
    0.45542
    """
    return blind_runs.mean_gap(one_antenna(pattern, radius_m), direction_rad)


def corridors(pattern: TagPattern, radius_m: float) -> tuple[Corridor, ...]:
    """Return all strips that no disc enters, sorted by direction in [0, pi); see `objectives.corridors`.

    Raises
    ------
    ValueError
        If the radius is not positive and finite, or the pattern has no period or no tag.

    Examples
    --------
    >>> from layoutopt.patterns.square import square
    >>> [round(found.blind_fraction, 6) for found in corridors(square(pitch_m=0.35), 0.1)]
    [0.428571, 0.191878, 0.428571, 0.191878]
    """
    return corridors_of(one_antenna(pattern, radius_m))


@overload
def blind_probability(pattern: TagPattern, radius_m: float, length_m: float, direction_rad: float) -> float: ...
@overload
def blind_probability(
    pattern: TagPattern, radius_m: float, length_m: float, direction_rad: FloatArray
) -> FloatArray: ...
def blind_probability(
    pattern: TagPattern, radius_m: float, length_m: float, direction_rad: FloatArray | float
) -> FloatArray | float:
    """Return B_L: the probability that a straight run with a uniform start meets no disc, exact up to rounding.

    ``direction_rad`` is a number, or an array of any shape, which the answer then has too. The longer the run, the
    narrower the peaks of B_L about the directions of corridors; it is continuous, but no coarse set shows it.

    Raises
    ------
    ValueError
        If the radius is not positive and finite, the length negative or not finite, a direction not finite, or the
        pattern has no period or no tag.
    """
    found = blind_runs.blind_probabilities(one_antenna(pattern, radius_m), length_m, np.asarray(direction_rad))
    return float(found) if found.ndim == 0 else found


def blind_probability_over_directions(
    pattern: TagPattern, radius_m: float, length_m: float, count: int = DIRECTIONS
) -> OverDirections:
    """Return mean and worst of B_L over direction, the worst direction, and worst over mean as ``anisotropy``.

    Raises
    ------
    ValueError
        As `blind_probability`, or if ``count`` is not positive.
    """
    return blind_runs.over_directions(one_antenna(pattern, radius_m), length_m, count)


def gap_exceedance(pattern: TagPattern, radius_m: float, length_m: float, direction_rad: FloatArray) -> FloatArray:
    """Return the probability that the gap between two sightings is longer than a length, -(A / 2 r N) dB_L / dL.

    Where discs overlap, the width over which they can be left takes the place of 2 r N. ``direction_rad`` is an
    array of any shape.

    Raises
    ------
    ValueError
        As `blind_probability`.
    """
    return blind_runs.gap_exceedance(one_antenna(pattern, radius_m), length_m, direction_rad)


def blind_run_survival(
    pattern: TagPattern, radius_m: float, length_m: FloatArray, count: int = DIRECTIONS
) -> FloatArray:
    """Return the mean over direction of B_L for lengths, shape (k,): the survival function of the blind run.

    Raises
    ------
    ValueError
        As `blind_probability`, or if ``count`` is not positive.
    """
    return blind_runs.survival(one_antenna(pattern, radius_m), length_m, count)


def blind_run_quantile(pattern: TagPattern, radius_m: float, probability: float, count: int = DIRECTIONS) -> float:
    """Return the blind run, m, that only a share 1 - ``probability`` of starts and directions exceeds.

    The start is uniform over the plane; one in sight of a tag is a run of zero. ``count`` directions make the
    mean; 360 give quantiles up to 0.99 to about 0.5 % where tags are read over a tenth of the pitch or more.

    Raises
    ------
    ValueError
        If the probability is not at least 0 and below 1, the radius not positive and finite, ``count`` not
        positive, or the pattern has no period or no tag.
    """
    return blind_runs.run_quantile(one_antenna(pattern, radius_m), probability, count)


def tail_constant(pattern: TagPattern, radius_m: float) -> float:
    """Return C, m: a blind run that starts blind is longer than T with a probability of about C / T for large T.

    Zero without corridors. On the square lattice of pitch d, 2 r C / d² tends to 2 / pi² for small discs.

    Raises
    ------
    ValueError
        If the radius is not positive and finite, or the pattern has no period or no tag.

    References
    ----------
    Bourgain, Golse and Wennberg, Commun. Math. Phys. 190, 1998 (the tail falls as 1 / T); Boca and Zaharescu,
    Commun. Math. Phys. 269, 2007 (its limit for small discs).
    """
    return blind_runs.tail_constant_of(one_antenna(pattern, radius_m))


def mean_blind_run(pattern: TagPattern, radius_m: float, count: int = DIRECTIONS) -> MeanBlindRun:
    """Return the mean blind run, infinite wherever a corridor exists, with the reason.

    Raises
    ------
    ValueError
        If the radius is not positive and finite, ``count`` not positive, or the pattern has no period or no tag.
    """
    return blind_runs.mean_run(one_antenna(pattern, radius_m), count)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Invisibility:
    """Blind runs of a robot that drives ahead over the base pattern, and over each zone with a periodic pattern.

    Every antenna of the layout sees its disc all the time, whatever its turn in the scan, and nothing is missed;
    the run lies wholly on one pattern. ``directions`` is about the number of directions of the means. The worst
    direction is the worst of those and of all corridors'. A pattern that is laid once has no scores. Antennas that
    do not reach the floor see nothing; if none does, every run is blind, and there is no length to score.

    Raises
    ------
    ValueError
        If there is no direction.
    """

    directions: int = 64
    key: str = field(init=False, repr=False, default="")
    card: ClassVar[ObjectiveCard] = CARD

    def __post_init__(self) -> None:
        """Check the number of directions."""
        if self.directions < 1:
            raise ValueError(f"a mean over directions needs at least one direction, got {self.directions}")

    def __call__(self, layout: Layout, scenario: Scenario, outcomes: TrialOutcomes | None) -> Scores:
        """Return the scores of every periodic pattern, those of a zone as ``zone.name``; none without antennas."""
        antennas = antennas_of(layout, scenario.step_s)
        if len(antennas) == 0:
            return {}
        floor_tags = layout.floor_tags
        named = [(f"{entry.zone}.", entry.pattern) for entry in floor_tags.zones if entry.zone != WHOLE_FLOOR]
        scores: dict[str, Score] = {}
        for prefix, pattern in [("", floor_tags.base.pattern), *named]:
            if pattern.cell_m is not None and len(pattern.points_m):
                for name, value in self._values(pattern, antennas).items():
                    scores[prefix + name] = Score(value=value, unit=CARD.scores[name])
        return scores

    def _values(self, pattern: TagPattern, antennas: Antennas) -> dict[str, float]:
        reaching = antennas.radius_m > 0.0
        if not reaching.any():
            return {"blind_probability_mean": 1.0, "blind_probability_worst": 1.0}
        group = antenna_group(pattern, antennas.xy_m[reaching], antennas.radius_m[reaching])
        return dict(zip(CARD.scores, _group_scores(group, self.directions), strict=True))


@lru_cache(maxsize=_REMEMBERED)
def _group_scores(group: AntennaGroup, count: int) -> tuple[float, ...]:
    """Return the values of the scores in their order; remembered, because many layouts differ only in modules."""
    found = corridors_of(group)
    rule = direction_rule(group, found, count)
    gaps = blind_runs.gaps_until(group, max(_QUANTILES), rule, RUN_LENGTH_M)
    blind = blind_runs.blind_in(gaps, RUN_LENGTH_M)
    along_rad = np.unique(np.round([corridor.direction_rad % rule.turn_rad for corridor in found], 9))
    in_corridors = blind_runs.blind_probabilities(group, RUN_LENGTH_M, along_rad)
    return (
        rule.mean(blind, RUN_LENGTH_M),
        float(max(blind.max(), in_corridors.max(initial=0.0))),
        *(blind_runs.crossing(gaps, rule, 1.0 - share) for share in _QUANTILES),
        blind_runs.tail_of(group, found, float(rule.weight @ gaps.free_m2)),
    )
