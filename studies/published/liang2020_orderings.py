"""What of liang2020 an implementation can be held to: ratios of medians, and the bands in which they lie."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from layoutopt.identity import FloatArray
from layoutopt.scores import TrialOutcomes
from studies.published.liang2020_cells import BASE_PLACE, Place
from studies.published.medians import Median, median, ratio_of_medians

GOAL: Final = "tracking_error_mean"
Found = Mapping[Place, TrialOutcomes]
HOLDS, FAILS, NOT_SHOWN = "holds", "does not hold", "not shown"


@dataclass(frozen=True, slots=True, kw_only=True)
class Ordering:
    """A median, or a ratio of two, with the band in which it is to lie; ``unit`` is empty for a ratio.

    Attributes
    ----------
    demanded
        Whether the paper's point stands or falls with it; the other bands rest on choices as well.
    """

    claim: str
    found: Median
    least: float
    most: float
    unit: str = ""
    demanded: bool = True

    @property
    def verdict(self) -> str:
        """What the 95 % interval says, which for a ratio is that of pairs of walks.

        It is `HOLDS` if the interval lies in the band, `FAILS` if it lies outside, `NOT_SHOWN` if it does both;
        too few walks for an interval show nothing.
        """
        if self.least <= self.found.low and self.found.high <= self.most:
            return HOLDS
        if self.found.high < self.least or self.found.low > self.most:
            return FAILS
        return NOT_SHOWN

    @property
    def band(self) -> str:
        """The band in words."""
        if math.isinf(self.most):
            return f"≥ {self.least:g}"
        return f"≤ {self.most:g}" if self.least == 0.0 else f"{self.least:g} to {self.most:g}"


def errors_m(found: Found, place: Place) -> FloatArray | None:
    """Return the mean errors of the trials at a place, shape (n,), m; ``None`` while it has none."""
    table = found.get(place)
    return None if table is None else table.column(GOAL)


def orderings(found: Found) -> list[Ordering]:
    """Return all orderings and bands whose trials are there."""
    made = (make(found) for make in (*_RATIOS, *_BANDS))
    return [item for item in made if item is not None]


_Make = Callable[[Found], Ordering | None]


def _ratio(
    claim: str,
    first: Place,
    second: Place,
    *,
    least: float = 0.0,
    most: float = math.inf,
    demanded: bool = True,
) -> _Make:
    def make(found: Found) -> Ordering | None:
        above, below = errors_m(found, first), errors_m(found, second)
        if above is None or below is None:
            return None
        ratio = ratio_of_medians(above, below)
        return Ordering(claim=claim, found=ratio, least=least, most=most, demanded=demanded)

    return make


def _band(claim: str, place: Place, least_m: float, most_m: float) -> _Make:
    def make(found: Found) -> Ordering | None:
        values_m = errors_m(found, place)
        if values_m is None:
            return None
        return Ordering(claim=claim, found=median(values_m), least=least_m, most=most_m, unit="m", demanded=False)

    return make


_RSS: Final[Place] = ("1", "Squiggle", "RSS")
_VELOCITY: Final[Place] = ("1", "Squiggle", "velocity")
_TWO: Final = "two hypotheses"
_RATIOS: Final[tuple[_Make, ...]] = (
    _ratio("fused over RSS alone", BASE_PLACE, _RSS, most=1.0),
    _ratio("fused over velocity alone", BASE_PLACE, _VELOCITY, most=1.0),
    _ratio("velocity alone over RSS alone", _VELOCITY, _RSS, most=1.0, demanded=False),
    _ratio("right antenna over both", ("2", "right", "fused"), BASE_PLACE, least=1.8),
    _ratio("left antenna over both", ("2", "left", "fused"), BASE_PLACE, least=1.8),
    _ratio(
        "right antenna over both, particles move unread",
        ("2", "right", "unread"),
        ("2", "both", "unread"),
        least=1.8,
        demanded=False,
    ),
    _ratio(
        "left antenna over both, particles move unread",
        ("2", "left", "unread"),
        ("2", "both", "unread"),
        least=1.8,
        demanded=False,
    ),
    _ratio(
        "left antenna, over right one clockwise",
        ("2", "left", "fused"),
        ("2", "right", "clockwise"),
        least=0.8,
        most=1.25,
        demanded=False,
    ),
    _ratio("K = 1 over K = 9", ("3", "1", "fused"), ("3", "9", "fused"), least=1.05),
    _ratio("K = 13 over K = 9", ("3", "13", "fused"), ("3", "9", "fused"), least=0.9, most=1.1),
    _ratio("K = 100 over K = 9", ("3", "100", "fused"), ("3", "9", "fused"), least=0.9, most=1.1),
    _ratio("N = 10 over N = 100", ("4", "10", "fused"), ("4", "100", "fused"), least=1.4),
    _ratio("N = 200 over N = 100", ("4", "200", "fused"), ("4", "100", "fused"), least=0.85, most=1.15),
    _ratio("ρ = 0.001 over ρ = 0.05", ("6 rho", "0.001", "fused"), ("6 rho", "0.05", "fused"), least=1.0),
    _ratio("ρ = 1 over ρ = 0.05", ("6 rho", "1", "fused"), ("6 rho", "0.05", "fused"), least=1.0),
    _ratio("0.02 m/s over 0.4 m/s", ("5", "0.02", _TWO), ("5", "0.4", _TWO), least=2.0),
    _ratio("0.6 m/s over 0.4 m/s", ("5", "0.6", _TWO), ("5", "0.4", _TWO), least=1.0),
    _ratio("K = 1 over K = 9, upper end", ("3", "1", "fused"), ("3", "9", "fused"), most=1.8, demanded=False),
    _ratio(
        "N = 10 over N = 100, upper end", ("4", "10", "fused"), ("4", "100", "fused"), most=4.0, demanded=False
    ),
    _ratio("0.02 m/s over 0.4 m/s, upper end", ("5", "0.02", _TWO), ("5", "0.4", _TWO), most=5.0, demanded=False),
    _ratio(
        "signed phases: 0.4 m/s over 0.2 m/s",
        ("5", "0.4", "signed"),
        ("5", "0.2", "signed"),
        least=2.0,
        demanded=False,
    ),
)
_BANDS: Final[tuple[_Make, ...]] = (
    _band("RSS alone", _RSS, 0.45, 1.1),
    _band("fused", BASE_PLACE, 0.15, 0.35),
    _band("right antenna alone", ("2", "right", "fused"), 0.3, 2.0),
    _band("left antenna alone", ("2", "left", "fused"), 0.3, 2.0),
)
