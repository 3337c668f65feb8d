"""The page of the pattern search: what was found, by how much it is better, how to lay it, and drives over it."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.plots.blind_rose import RoseCurve, draw_blind_rose
from layoutopt.plots.pattern_cells import PatternPicture, draw_patterns
from layoutopt.scores import TrialOutcomes
from objectives.corridors import Corridor
from objectives.invisibility import blind_probability, corridors
from studies.page import Data, Listing, Page, Picture, Section, Table
from studies.pattern_goals import (
    BEST_SUDOKU,
    BEST_TILT,
    DIRECTIONS,
    FINE_DIRECTIONS,
    GRID_M,
    Goal,
    Laid,
    goals,
    judged,
    label_of,
    rivals,
)
from studies.published.comparison import paired_ratio, scaled, with_interval

Driven = Mapping[tuple[str, str, str], TrialOutcomes]
ERROR: Final = "position_error_mean"
_LENGTH_M: Final = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Searched:
    """What one search found: goal, tags a tile, the pattern in whole millimetres, and patterns looked at."""

    goal: str
    count: int
    laid: Laid
    evaluated: int

    @property
    def label(self) -> str:
        """Label of the pattern."""
        return label_of(self.count)


def best_of(searched: Iterable[Searched], goal: Goal) -> Searched:
    """Return the best pattern that was found for a goal."""
    return min((item for item in searched if item.goal == goal.name), key=lambda item: judged(goal, item.laid))


def _goals(searched: Iterable[Searched]) -> list[Goal]:
    """Return the goals that were searched for, in their order."""
    return [goals()[name] for name in dict.fromkeys(item.goal for item in searched)]


def summary(searched: Sequence[Searched]) -> list[str]:
    """Return for each goal the best pattern found, beside the best tilted tile and the diagonal Sudoku."""
    lines, beaten, goals = [], 0, _goals(searched)
    for goal in goals:
        best = best_of(searched, goal)
        value = judged(goal, best.laid)
        beaten += value < min(judged(goal, laid) for laid in rivals(goal.name).values())
        beside = ", ".join(
            f"{_less(value, judged(goal, rivals(goal.name)[label]))} than the {label} "
            f"({_told(goal, judged(goal, rivals(goal.name)[label]))})"
            for label in (BEST_TILT, BEST_SUDOKU)
        )
        lines.append(
            f"{goal.words[0].upper()}{goal.words[1:]}: {_told(goal, value)} {goal.unit} "
            f"with {best.label}, {beside}."
        )
    told = "goal" if len(goals) == 1 else "goals"
    return [f"For {beaten} of {len(goals)} {told} a pattern was found that beats every one of the papers.", *lines]


def page_of(searched: Sequence[Searched], driven: Driven, *, facts: Mapping[str, str]) -> Page:
    """Return the whole page."""
    return Page(
        study="pattern_search",
        title="Tag patterns found by search",
        summary=tuple(summary(searched)),
        sections=(
            _pictures(searched),
            *(_goal(goal, searched) for goal in _goals(searched)),
            _roses(searched),
            _laying(searched),
            _drives(searched, driven),
        ),
        facts={
            **facts,
            "Density": "at most 4 tags on each square of 0.7 m, for all patterns",
            "Intervals": "goals are exact; of drives, ± is half the width of the two-sided 95 % interval "
            "(Student), and ratios are paired by drive",
        },
        data=(_values(searched), _places(searched)),
    )


def _pictures(searched: Sequence[Searched]) -> Section:
    best = {goal.name: best_of(searched, goal) for goal in _goals(searched)}
    return Section(
        heading="What was found",
        paragraphs=(
            "The unknowns are the shape of a rectangular tile, how far each row of tiles is moved on against the "
            "one below, and the places of the tags on it; one search goes over the angle of the tiles to the axes "
            "of the floor too. Blind runs are counted over all directions, so that this angle does not bear on "
            "them.",
        ),
        parts=(
            Picture(
                name="found",
                caption="The best pattern for each goal: tags, read discs and tiles.",
                drawn=draw_patterns(
                    [
                        PatternPicture(
                            label=name.replace("_", " "),
                            pattern=item.laid.pattern,
                            radius_m=goals()[name].setting.radius_m,
                        )
                        for name, item in best.items()
                    ]
                ),
            ),
        ),
    )


def _goal(goal: Goal, searched: Sequence[Searched]) -> Section:
    known = rivals(goal.name)
    tilted, sudoku = judged(goal, known[BEST_TILT]), judged(goal, known[BEST_SUDOKU])
    rows = []
    for label, laid, evaluated in [
        *((label, laid, "–") for label, laid in known.items()),
        *((f"found: {item.label}", item.laid, str(item.evaluated)) for item in searched if item.goal == goal.name),
    ]:
        value = judged(goal, laid)
        rows.append(
            (
                label,
                _told(goal, judged(goal, laid, DIRECTIONS)),
                _told(goal, value),
                _percent(value / tilted),
                _percent(value / sudoku),
                f"{1e3 * laid.pattern.minimum_spacing_m():.0f}",
                str(len({round(item.direction_rad, 9) for item in _corridors(goal, laid)})),
                evaluated,
            )
        )
    tilt_deg = math.degrees(float(known[BEST_TILT].pattern.parameters["angle_rad"]))
    return Section(
        heading=f"{goal.name.replace('_', ' ').capitalize()}",
        paragraphs=(
            f"The goal is the {goal.words}. The best tilted tile has {tilt_deg:g}°. "
            + (
                "The value has no sampling, so that both columns agree; the tiles lie at the angle that was found."
                if goal.by_axes
                else f"Found with {DIRECTIONS} directions, judged with {FINE_DIRECTIONS}, and with those of all "
                "corridors both times."
                if goal.unit == "%"
                else "The value has no sampling, so that both columns agree."
            ),
        ),
        parts=(
            Table(
                caption=f"{goal.words[0].upper()}{goal.words[1:]}",
                head=(
                    "pattern",
                    f"as searched, {goal.unit}",
                    f"judged, {goal.unit}",
                    "over the best tilted tile",
                    "over the diagonal Sudoku",
                    "least spacing, mm",
                    "corridor directions",
                    "patterns looked at",
                ),
                rows=tuple(rows),
            ),
        ),
    )


def _corridors(goal: Goal, laid: Laid) -> Sequence[Corridor]:
    return corridors(laid.pattern, goal.setting.radius_m)


def _roses(searched: Sequence[Searched]) -> Section:
    shown = [goal for goal in _goals(searched) if goal.unit == "%"]
    direction_rad = np.linspace(0.0, 2.0 * math.pi, 720, endpoint=False)
    rival = rivals(shown[-1].name)
    patterns = {
        **{label: rival[label] for label in (BEST_TILT, BEST_SUDOKU)},
        **{f"found: {goal.name.replace('_', ' ')}": best_of(searched, goal).laid for goal in shown},
    }
    return Section(
        heading="By direction",
        parts=(
            Picture(
                name="rose",
                caption=f"Chance that a run of {_LENGTH_M:g} m is blind, by direction.",
                drawn=draw_blind_rose(
                    [
                        RoseCurve(
                            label=label,
                            direction_rad=direction_rad,
                            probability=blind_probability(
                                laid.pattern, shown[-1].setting.radius_m, _LENGTH_M, direction_rad
                            ),
                        )
                        for label, laid in patterns.items()
                    ]
                ),
            ),
        ),
    )


def _laying(searched: Sequence[Searched]) -> Section:
    parts = []
    for goal in _goals(searched):
        best = best_of(searched, goal)
        parts.append(Listing(caption=f"The best for the {goal.words}.", text=layout_lines(best.laid)))
    return Section(
        heading="How to lay them",
        paragraphs=(
            f"Each is one kind of tile, with places rounded to {1e3 * GRID_M:g} mm and measured from its lower "
            "left corner. Lay the tiles side by side, and every row moved to the right by “shift” against the one "
            "below. The lines stand in a layout file as one [[layout.tags]]; the line of an axis-parallel pattern "
            "also stands in the list “patterns” of [space] in a spec.",
        ),
        parts=tuple(parts),
    )


def layout_lines(laid: Laid) -> str:
    """Return a listed pattern as a layout file and, if it lies along the axes, as a spec take it."""
    assert laid.pattern.cell_m is not None
    (width_m, _), (shift_m, height_m) = laid.pattern.cell_m.tolist()
    points = ", ".join(f"[{x:.3f}, {y:.3f}]" for x, y in laid.pattern.points_m.tolist())
    values = f'points = [{points}]\ncell = [{width_m:.3f}, {height_m:.3f}]\nshift = "{1e3 * shift_m:g} mm"'
    table = f'[[layout.tags]]\nzone = ""\nfamily = "listed"\n{values}'
    if laid.angle_rad != 0.0:
        return f'{table}\nangle = "{math.degrees(laid.angle_rad):.3f} deg"'
    inline = values.replace("\n", ", ")
    return f'{table}\n\n[space]\npatterns = [{{ family = "listed", {inline} }}]'


def _drives(searched: Sequence[Searched], driven: Driven) -> Section:
    parts = []
    for goal in _goals(searched):
        names = [estimator.name for estimator in goal.estimators]
        own = {(label, name): table for (where, label, name), table in driven.items() if where == goal.name}
        rows = []
        for label in dict.fromkeys(label for label, _ in own):
            cells = [label]
            for name in names:
                table, base = own.get((label, name)), own.get((BEST_SUDOKU, name))
                cells.append("–" if table is None else with_interval(scaled(table.score(ERROR), 1e3, unit="mm")))
                cells.append(
                    "–" if table is None or base is None else with_interval(paired_ratio(table, base, ERROR), 2)
                )
            rows.append(tuple(cells))
        heads = [head for name in names for head in (f"{name}, mm", "over the diagonal Sudoku")]
        parts.append(
            Table(
                caption=f"Searched for {goal.name.replace('_', ' ')}", head=("pattern", *heads), rows=tuple(rows)
            )
        )
    return Section(
        heading="Does it show on drives?",
        paragraphs=(
            "A goal of one reading, or of a chance to see nothing, is not the error of a robot that drives. The "
            "same drives through an empty hall of 6.3 m for all patterns, mean position error of robots with one "
            "antenna.",
        ),
        parts=tuple(parts),
    )


def _told(goal: Goal, value: float) -> str:
    return f"{goal.factor * value:.3g}"


def _less(value: float, other: float) -> str:
    return (
        f"{100.0 * (1.0 - value / other):.0f} % less"
        if value <= other
        else f"{100 * (value / other - 1):.0f} % more"
    )


def _percent(ratio: float) -> str:
    return f"{100.0 * ratio:.1f} %"


def _values(searched: Sequence[Searched]) -> Data:
    rows = []
    for goal in _goals(searched):
        for label, laid in rivals(goal.name).items():
            rows.append((goal.name, label, *_numbers(goal, laid), "0"))
        rows += [
            (goal.name, item.label, *_numbers(goal, item.laid), str(item.evaluated))
            for item in searched
            if item.goal == goal.name
        ]
    head = ("goal", "pattern", "density_per_m2", "spacing_m", "angle_rad", "as_searched", "judged", "evaluated")
    return Data(name="patterns", head=head, rows=tuple(rows))


def _numbers(goal: Goal, laid: Laid) -> tuple[str, ...]:
    values = (
        laid.pattern.density_per_m2,
        laid.pattern.minimum_spacing_m(),
        laid.angle_rad,
        judged(goal, laid, DIRECTIONS),
        judged(goal, laid),
    )
    return tuple(f"{value:.9g}" for value in values)


def _places(searched: Sequence[Searched]) -> Data:
    rows = []
    for item in searched:
        assert item.laid.pattern.cell_m is not None
        (width_m, _), (shift_m, height_m) = item.laid.pattern.cell_m.tolist()
        rows += [
            (item.goal, item.label, *(f"{value:.3f}" for value in (x, y, width_m, height_m, shift_m)))
            for x, y in item.laid.pattern.points_m.tolist()
        ]
    head = ("goal", "pattern", "x_m", "y_m", "tile_width_m", "tile_height_m", "shift_m")
    return Data(name="places", head=head, rows=tuple(rows))
