"""Exact error of one static reading of one antenna, and how often it reads nothing."""

from dataclasses import dataclass, field
from typing import ClassVar, Final

from layoutopt.detection import antennas_of
from layoutopt.identity import by_content
from layoutopt.layout import Layout
from layoutopt.protocols import ObjectiveCard
from layoutopt.scenario import Scenario
from layoutopt.scores import SCORE_UNITS, Score, Scores, TrialOutcomes
from objectives.position_bound import static_error

CARD: Final = ObjectiveCard(
    summary=(
        "Worst and mean error of the midrange of one static reading of the antenna that reads farthest, and the "
        "share of places where it reads nothing."
    ),
    reference="han2006, Eq. 9-10, for a disc by circle arrangement; own",
    scores={name: SCORE_UNITS[name] for name in ("static_error_worst", "static_error_mean", "no_detection_share")},
    fidelity="exact",
    per_zone=True,
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StaticErrors:
    """Static error of the base pattern, and of each zone with a pattern of its own.

    Errors are in the axes of the pattern, which the midrange goes by. A pattern that is laid once, or an antenna
    that does not reach the floor, has no scores.
    """

    key: str = field(init=False, repr=False, default="")
    card: ClassVar[ObjectiveCard] = CARD

    def __post_init__(self) -> None:
        """Nothing to check: the objective has no settings."""

    def __call__(self, layout: Layout, scenario: Scenario, outcomes: TrialOutcomes | None) -> Scores:
        """Return the scores of every periodic pattern; those of a zone are ``zone.name``."""
        radius_m = float(antennas_of(layout, scenario.step_s).radius_m.max(initial=0.0))
        scores: dict[str, Score] = {}
        for prefix, pattern in layout.floor_tags.patterns():
            if pattern.cell_m is None or len(pattern.points_m) == 0 or radius_m == 0.0:
                continue
            error = static_error(pattern, radius_m)
            values = {
                "static_error_worst": error.worst_m,
                "static_error_mean": error.mean_m,
                "no_detection_share": 1.0 - error.detection_probability,
            }
            scores |= {prefix + name: Score(value=value, unit=CARD.scores[name]) for name, value in values.items()}
        return scores
