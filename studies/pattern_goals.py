"""What a tag pattern is searched for: exact goals, how each is descended on, and the patterns of the papers."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Final

import numpy as np

from layoutopt import registry
from layoutopt.circles import arrangement
from layoutopt.layout import TagPattern
from layoutopt.protocols import Estimator
from objectives.blind_runs import OverDirections
from objectives.invisibility import blind_probability, blind_probability_over_directions
from objectives.position_bound import static_error
from solvers.pattern_search import FoundPattern, PatternSpace, Value, laid_at, search_pattern
from studies.pattern_setting import SEED, Setting, one_antenna, patterns, settings

TILE_M: Final = 0.7
PITCH_M: Final = TILE_M / 2.0
DENSITY_PER_M2: Final = 4.0 / TILE_M**2
GRID_M: Final = 0.001
"""Patterns that were found are rounded to whole millimetres before they are judged."""
DIRECTIONS: Final = 360
FINE_DIRECTIONS: Final = 1440
"""Directions from which a pattern is judged at last, beside those of all corridors."""
BEST_TILT: Final = "best tilted tile"
BEST_SUDOKU: Final = "diagonal Sudoku, best of 5 grids"
_DISC_M: Final = 0.1
_APART_M: Final = 2.0 * _DISC_M + 3.0 * GRID_M
"""Discs of the invisibility goals do not overlap, as kim2010 wants it, after rounding too."""
_CLOSEST_M: Final = 0.05
_BLIND_SCALE: Final = 20.0
_ERROR_SCALE: Final = 10.0
_GRIDS: Final = 5
_TILTS: Final = 46


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """Something of which a pattern is to have as little as possible.

    Attributes
    ----------
    name, words
        File name, and what it is in words.
    unit, factor
        Unit in which it is told, and its factor from SI.
    value
        The goal of a pattern with a number of directions.
    stages
        What a search descends on, of a size of about one.
    setting
        Robot over the floors.
    estimators
        What drives over the floors are judged with: what the goal speaks of, and what learns from silence too.
    least_spacing_m
        How close two tags may lie.
    by_axes
        Whether the axes of the floor count, so that the tilt of the tiles does.
    valleys
        How many times as many starts a search takes as one of a goal with few valleys.
    """

    name: str
    words: str
    unit: str
    factor: float
    value: Callable[[TagPattern, int], float]
    stages: tuple[Value, ...]
    setting: Setting
    estimators: tuple[Estimator, ...]
    least_spacing_m: float
    by_axes: bool
    valleys: int = 1

    def space(self, count: int) -> PatternSpace:
        """Return the patterns of so many tags a tile."""
        return PatternSpace(
            count=count,
            density_per_m2=DENSITY_PER_M2,
            least_spacing_m=self.least_spacing_m,
            tilted=self.by_axes,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Laid:
    """A pattern and the angle at which its tiles lie on the floor."""

    pattern: TagPattern
    angle_rad: float = 0.0
    on_floor: TagPattern = field(init=False)

    def __post_init__(self) -> None:
        """Turn the pattern."""
        object.__setattr__(self, "on_floor", laid_at(self.pattern, self.angle_rad))


def judged(goal: Goal, laid: Laid, count: int = FINE_DIRECTIONS) -> float:
    """Return the goal of a pattern as it lies, by default with the finer set of directions."""
    return _judged(goal.name, laid, count)


@lru_cache(maxsize=1024)
def _judged(name: str, laid: Laid, count: int) -> float:
    return goals()[name].value(laid.on_floor, count)


@lru_cache(maxsize=1)
def goals() -> Mapping[str, Goal]:
    """Return the goals by name."""
    sparse = settings()[0]
    blind = (
        registry.load("estimators", "crossing_time_branches")(),
        registry.load("estimators", "mcl_adaptive")(),
    )
    placed = (registry.load("estimators", "one_reader")(), registry.load("estimators", "mcl_adaptive")())
    wide = Setting(
        name="wide",
        words="one antenna with a disc of 350 mm, 4 tags per tile of 0.7 m",
        pitch_m=PITCH_M,
        radius_m=PITCH_M,
        readers=one_antenna(side_m=0.25, radius_m=PITCH_M),
        inside_tiles=False,
    )
    found = (
        *(
            Goal(
                name=name,
                words=words,
                unit="%",
                factor=100.0,
                value=value,
                stages=stages,
                setting=sparse,
                estimators=blind,
                least_spacing_m=_APART_M,
                by_axes=False,
                valleys=4,
            )
            for name, words, value, stages in (
                (
                    "mean_blind_1m",
                    "chance that a run of 1 m is blind, mean over direction, discs of 100 mm",
                    lambda pattern, count: _blind_over(pattern, 1.0, count).mean,
                    tuple(_blind_mean(1.0, 1.0, count) for count in (24, 96)),
                ),
                (
                    "worst_blind_2m",
                    "chance that a run of 2 m is blind, in the worst direction, discs of 100 mm",
                    lambda pattern, count: _blind_over(pattern, 2.0, count).worst,
                    tuple(_blind_mean(2.0, power, count) for power, count in ((4.0, 40), (8.0, 120), (32.0, 240))),
                ),
            )
        ),
        *(
            Goal(
                name=f"mean_midrange{name}",
                words=f"mean error of the midrange of one reading, disc as large as the pitch of 350 mm, {words}",
                unit="mm",
                factor=1000.0,
                value=lambda pattern, _: static_error(pattern, PITCH_M).mean_m,
                stages=(_midrange,),
                setting=wide,
                estimators=placed,
                least_spacing_m=_CLOSEST_M,
                by_axes=by_axes,
            )
            for name, words, by_axes in (
                ("", "tiles along the axes", False),
                ("_at_an_angle", "tiles at any angle", True),
            )
        ),
    )
    return {goal.name: goal for goal in found}


def _blind_over(pattern: TagPattern, length_m: float, count: int) -> OverDirections:
    return blind_probability_over_directions(pattern, _DISC_M, length_m, count)


def _blind_mean(length_m: float, power: float, count: int) -> Value:
    """Return the power mean over even directions of the blind probability of a run, scaled."""
    direction_rad = (np.arange(count) + 0.5) * math.pi / count

    def value(pattern: TagPattern) -> float:
        blind = blind_probability(pattern, _DISC_M, length_m, direction_rad)
        return _BLIND_SCALE * float((blind**power).mean() ** (1.0 / power))

    return value


def _midrange(pattern: TagPattern) -> float:
    # Not by static_error, which would remember every pattern of a descent.
    assert pattern.cell_m is not None
    circles = arrangement(pattern.points_m, pattern.cell_m, PITCH_M)
    return _ERROR_SCALE * circles.mean_distance_m(circles.middles())


@lru_cache(maxsize=8)
def rivals(name: str) -> Mapping[str, Laid]:
    """Return the patterns of the papers that the results of a goal are compared with, by label.

    Of tilted tiles the best angle, of diagonal Sudokus the best of five grids; where axes count, also the square
    pattern laid at its best angle, which no paper has.
    """
    goal = goals()[name]

    def value(laid: Laid) -> float:
        return judged(goal, laid, DIRECTIONS)

    family = registry.load("patterns", "tilted")
    tilts = [
        Laid(pattern=family(tile_m=TILE_M, angle_rad=float(angle_rad)))
        for angle_rad in np.linspace(0.0, math.pi / 4.0, _TILTS)
    ]
    sudoku = registry.load("patterns", "sudoku")
    grids = [
        Laid(pattern=sudoku(tile_m=TILE_M, seed=seed, radius_m=_DISC_M, rule="diagonals"))
        for seed in range(SEED, SEED + _GRIDS)
    ]
    found = {
        label: Laid(pattern=pattern)
        for label, pattern in patterns(settings()[0]).items()
        if label not in ("tilted", "diagonal Sudoku")
    }
    found[BEST_TILT] = min(tilts, key=value)
    found[BEST_SUDOKU] = min(grids, key=value)
    if goal.by_axes:
        square = found["square"].pattern
        turns = [Laid(pattern=square, angle_rad=float(angle)) for angle in np.linspace(0.0, math.pi / 4.0, _TILTS)]
        found["square, at its best angle"] = min(turns, key=value)
    return found


def label_of(count: int) -> str:
    """Return the label of what is found with so many tags a tile.

    >>> label_of(1), label_of(9)
    ('1 tag a tile', '9 tags a tile')
    """
    return f"{count} tag{'s' if count > 1 else ''} a tile"


@lru_cache(maxsize=64)
def search(name: str, count: int, starts: int, kept: int, seed: int, fewer: tuple[int, ...] = ()) -> FoundPattern:
    """Return what the search for a goal finds with so many tags a tile; remembered, because it takes a while.

    It also starts from what it finds for those of ``fewer`` tags that go into so many two or three times.
    """
    goal = goals()[name]
    known = [
        goal.space(less).repeated(search(name, less, starts, kept, seed, fewer).unknowns, count // less)
        for less in fewer
        if count in (2 * less, 3 * less)
    ]
    return search_pattern(
        goal.stages,
        lambda pattern: goal.value(pattern, DIRECTIONS),
        goal.space(count),
        starts=starts * goal.valleys,
        kept=kept * goal.valleys,
        seed=seed,
        known=known,
    )
