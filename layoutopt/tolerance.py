"""How far an installation may be off from its plan: ranges of faults, and the scenarios that they span."""

import itertools
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from layoutopt.scenario import Scenario

COMBINES: Final = ("worst", "quantile")
"""How scores over the scenarios of a tolerance become one."""
_RANGES: Final = ("placement_m", "dead_tags", "missed_reads", "antenna_height_m")


@dataclass(frozen=True, slots=True, kw_only=True)
class Tolerance:
    """Ranges, lowest and highest value, in which faults may turn out; other faults stay as they are.

    Attributes
    ----------
    placement_m
        Standard deviation of a tag's place about its planned one, per axis.
    dead_tags, missed_reads
        Shares of tags that never answer, and of scans in range that bring nothing.
    antenna_height_m
        Error of the height of all antennas; may be negative.
    combine
        ``"worst"``: a layout is judged by the worst corner of the ranges; ``"quantile"``: by a quantile over
        scenarios drawn evenly from the ranges.
    quantile
        Share of installations, drawn from the ranges, that are to be at least so good.

    Raises
    ------
    ValueError
        If a range falls, the quantile lies outside 0 to 1, or there is no such way to combine. That the faults
        themselves are possible is checked where a scenario gets them.
    """

    placement_m: tuple[float, float] = (0.0, 0.005)
    dead_tags: tuple[float, float] = (0.0, 0.05)
    missed_reads: tuple[float, float] = (0.02, 0.10)
    antenna_height_m: tuple[float, float] = (0.0, 0.0)
    combine: str = "worst"
    quantile: float = 0.9

    def __post_init__(self) -> None:
        """Check the ranges."""
        for name in _RANGES:
            low, high = getattr(self, name)
            if not low <= high:
                raise ValueError(f"{name} of a tolerance goes from low to high, got {low!r} to {high!r}")
        if self.combine not in COMBINES:
            raise ValueError(f"a tolerance combines by one of {', '.join(COMBINES)}, not {self.combine!r}")
        if not 0.0 < self.quantile < 1.0:
            raise ValueError(f"a quantile lies between 0 and 1, got {self.quantile!r}")


def scenario_at(scenario: Scenario, tolerance: Tolerance, share: float) -> Scenario:
    """Return the scenario in which every range is used to the same share: 0 is its low end, 1 its high end."""
    ends = {name: getattr(tolerance, name) for name in _RANGES}
    return _with(scenario, {name: low + share * (high - low) for name, (low, high) in ends.items()})


def corner_scenarios(scenario: Scenario, tolerance: Tolerance) -> tuple[Scenario, ...]:
    """Return the scenarios at all corners of the ranges, the all-low one first.

    A range without width has one end.
    """
    ends = {name: tuple(dict.fromkeys(getattr(tolerance, name))) for name in _RANGES}
    return tuple(
        _with(scenario, dict(zip(ends, corner, strict=True))) for corner in itertools.product(*ends.values())
    )


def drawn_scenarios(scenario: Scenario, tolerance: Tolerance, *, count: int, seed: int) -> tuple[Scenario, ...]:
    """Return scenarios whose faults are independent even draws from the ranges.

    Even draws favour no part of a range; who knows more of the installers narrows it.
    """
    draws = np.random.Generator(np.random.Philox(seed)).random((count, len(_RANGES)))
    ends = np.array([getattr(tolerance, name) for name in _RANGES])
    values = ends[:, 0] + draws * (ends[:, 1] - ends[:, 0])
    return tuple(_with(scenario, dict(zip(_RANGES, map(float, row), strict=True))) for row in values)


def tolerance_scenarios(
    scenario: Scenario, tolerance: Tolerance, *, count: int, seed: int
) -> tuple[Scenario, ...]:
    """Return the scenarios over which layouts are judged: the corners, or ``count`` draws for a quantile.

    All keep the scenario's name, which keys the random streams: in all of them a robot meets the same drives and
    the same random numbers, and only the size of the faults differs.
    """
    if tolerance.combine == "worst":
        return corner_scenarios(scenario, tolerance)
    return drawn_scenarios(scenario, tolerance, count=count, seed=seed)


def _with(scenario: Scenario, values: dict[str, float]) -> Scenario:
    faults = replace(
        scenario.faults,
        tag_placement_sigma_m=values["placement_m"],
        dead_tag_share=values["dead_tags"],
        missed_read_share=values["missed_reads"],
        antenna_height_error_m=values["antenna_height_m"],
    )
    return replace(scenario, faults=faults)
