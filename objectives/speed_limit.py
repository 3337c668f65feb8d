"""How fast a robot may drive so that its antennas still read the tags that they pass.

An antenna that scans every T seconds reads a tag for certain while the tag is in its read disc for T or longer,
and with the chance t / T while it is there for a shorter time t, because the scans fall anywhere. A tag crosses a
disc of radius r on a chord, any distance from the centre alike: its mean is pi r / 2. Straight ahead at v a
crossing is read with the chance A(v T) / (2 r v T), where A(w) is the floor that a disc covers after a way w and
did not before (`objectives.expected_reads.swept_area_m2`).

T is the time after which the same antenna listens again, so a module with four antennas divides the speed by four.
Faults are left out, and so is that another antenna of the robot may read what one has missed. A simulated drive
rounds every scan up to whole time steps, so it may find readers slower than this.
"""

import math
from dataclasses import dataclass, field
from typing import ClassVar, Final

import numpy as np

from layoutopt.identity import FloatArray, by_content
from layoutopt.layout import Layout
from layoutopt.protocols import ObjectiveCard
from layoutopt.scenario import Scenario
from layoutopt.scores import SPEED_UNITS, Score, Scores, TrialOutcomes
from objectives.expected_reads import swept_area_m2

CARD: Final = ObjectiveCard(
    summary=(
        "Speed at which the slowest antenna still reads a tag once a crossing on average, or for certain under "
        "its middle, and the share of crossings missed at cruising speed; no faults."
    ),
    reference="own; mean chord of a circle (Crofton), uniform phase of the scans",
    scores=SPEED_UNITS,
    fidelity="exact",
)


def mean_chord_m(radius_m: FloatArray) -> FloatArray:
    """Return the mean length of the way of a tag through a read disc, shape as given, m.

    Examples
    --------
    >>> float(mean_chord_m(np.array(0.009)).round(4))
    0.0141
    """
    return np.asarray(math.pi / 2.0 * np.asarray(radius_m, dtype=np.float64))


def missed_share(radius_m: FloatArray, way_m: FloatArray) -> FloatArray:
    """Return the share of crossings in which no scan meets the tag, shape as given.

    Parameters
    ----------
    radius_m
        Radii of the read discs; where one is zero nothing is ever read and the share is 1.
    way_m
        Ways that the antennas go from one scan to the next, above zero, m.

    Examples
    --------
    >>> missed_share(np.array([0.009, 0.009, 0.0]), np.array([0.0001, 0.018, 0.01])).round(4).tolist()
    [0.0, 0.2146, 1.0]
    """
    radius_m, way_m = np.asarray(radius_m, dtype=np.float64), np.asarray(way_m, dtype=np.float64)
    strip_m2 = 2.0 * radius_m * way_m
    read = np.divide(swept_area_m2(radius_m, way_m), strip_m2, out=np.zeros_like(strip_m2), where=strip_m2 > 0.0)
    # Rounding must not make a share of less than nothing.
    return np.asarray(np.maximum(1.0 - read, 0.0))


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpeedLimit:
    """Speed limits of the slowest antenna, and missed crossings of all antennas together.

    ``speed_limit`` is the speed at which a crossing takes one scan period on average: 11.5 % of the crossings are
    missed there, those near the rim. ``speed_limit_centre`` is that up to which a tag that passes under the middle
    is never missed. ``missed_crossing_share`` counts every crossing of every antenna at the cruising speed.
    """

    key: str = field(init=False, repr=False, default="")
    card: ClassVar[ObjectiveCard] = CARD

    def __post_init__(self) -> None:
        """Nothing to check: the objective has no settings."""

    def __call__(self, layout: Layout, scenario: Scenario, outcomes: TrialOutcomes | None) -> Scores:
        """Return the scores; none without an HF antenna."""
        antennas = [
            (group.antenna.read_radius_m(float(height_m)), group.cycle_s)
            for group in layout.floor_readers
            for height_m in group.poses[:, 2]
        ]
        if not antennas:
            return {}
        radius_m, period_s = np.array(antennas).T
        missed = missed_share(radius_m, scenario.robot.speed_m_s * period_s)
        # A disc twice as wide is crossed by twice as many tags.
        crossings = radius_m.sum()
        values = {
            "speed_limit": float((mean_chord_m(radius_m) / period_s).min()),
            "speed_limit_centre": float((2.0 * radius_m / period_s).min()),
            "missed_crossing_share": float((missed * radius_m).sum() / crossings) if crossings > 0.0 else 1.0,
        }
        return {name: Score(value=value, unit=CARD.scores[name]) for name, value in values.items()}
