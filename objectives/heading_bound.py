"""How far a heading may be off that several antennas take from one static reading."""

import math
from dataclasses import dataclass, field
from typing import ClassVar, Final

import numpy as np

from layoutopt.detection import antennas_of
from layoutopt.identity import FloatArray, by_content
from layoutopt.layout import Layout
from layoutopt.protocols import ObjectiveCard
from layoutopt.scenario import Scenario
from layoutopt.scores import SCORE_UNITS, Score, Scores, TrialOutcomes
from objectives.position_bound import static_error

CARD: Final = ObjectiveCard(
    summary=(
        "Bound of the heading that follows from one static reading of all antennas, each with its worst midrange "
        "error. No bound of a filtered heading."
    ),
    reference="own; least-squares turn after Kabsch, Acta Cryst. A32, 1976",
    scores={"heading_bound": SCORE_UNITS["heading_bound"]},
    fidelity="exact",
    per_zone=True,
)


def heading_bound(antenna_m: FloatArray, error_m: FloatArray) -> float | None:
    """Return the largest error of a heading that lays antennas over estimates of their places, rad.

    Parameters
    ----------
    antenna_m
        Antenna centres in the robot's frame, shape (n, 2).
    error_m
        Largest distance of each antenna's estimated place from its true one, shape (n,).

    Returns
    -------
    float or None
        ``None`` if there is no bound: errors as large as the antennas' spread, or fewer than two antennas.

    Raises
    ------
    ValueError
        If there is not one error for each antenna, or one is negative or no number.

    Notes
    -----
    Write places as complex numbers, a for the antennas about their centroid and e for the errors. The turn of
    least squares is the argument of sum conj(a) (a + e) = S + Z, with S = sum |a|² and |Z| <= E = sum |a| |e|. If
    E < S no error turns it by more than arcsin(E / S). A common shift of all estimates drops out.

    Examples
    --------
    >>> round(heading_bound(np.array([(-0.2, 0.0), (0.2, 0.0)]), np.array([0.02, 0.02])), 6)
    0.100167
    """
    if np.shape(error_m) != (len(antenna_m),) or not (np.asarray(error_m) >= 0.0).all():
        raise ValueError(f"each of {len(antenna_m)} antennas needs an error of zero or more, got {error_m}")
    if len(antenna_m) == 0:
        return None
    centred_m = antenna_m - antenna_m.mean(axis=0)
    arm_m = np.hypot(centred_m[:, 0], centred_m[:, 1])
    spread_m2, reach_m2 = float((arm_m**2).sum()), float((arm_m * error_m).sum())
    return math.asin(reach_m2 / spread_m2) if reach_m2 < spread_m2 else None


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HeadingBound:
    """Bound of the static heading over the base pattern, and over each zone with a pattern of its own.

    It holds where every antenna reads a tag. Layouts without a bound have no score.
    """

    key: str = field(init=False, repr=False, default="")
    card: ClassVar[ObjectiveCard] = CARD

    def __post_init__(self) -> None:
        """Nothing to check: the objective has no settings."""

    def __call__(self, layout: Layout, scenario: Scenario, outcomes: TrialOutcomes | None) -> Scores:
        """Return the bound of every periodic pattern that has one; that of a zone is ``zone.heading_bound``."""
        antennas = antennas_of(layout, scenario.step_s)
        scores: dict[str, Score] = {}
        if len(antennas) == 0 or not antennas.radius_m.min() > 0.0:
            return scores
        for prefix, pattern in layout.floor_tags.patterns():
            if pattern.cell_m is None or len(pattern.points_m) == 0:
                continue
            worst_m = {
                radius_m: static_error(pattern, radius_m).worst_m for radius_m in set(antennas.radius_m.tolist())
            }
            bound_rad = heading_bound(
                antennas.xy_m, np.array([worst_m[radius_m] for radius_m in antennas.radius_m.tolist()])
            )
            if bound_rad is not None:
                scores[f"{prefix}heading_bound"] = Score(value=bound_rad, unit=CARD.scores["heading_bound"])
        return scores
