"""Which pattern is best at equal density: errors over those on the square pattern, robot by robot, at a glance."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

from layoutopt.plots.figures import TEXT_PT, figure_of, legend_below, panel_axes
from layoutopt.plots.ratios import RatioRow, draw_ratios
from layoutopt.score_text import percent_text
from layoutopt.scores import Score, TrialOutcomes
from studies.cells import shown_on
from studies.pattern_setting import settings
from studies.published.comparison import paired_ratio

if TYPE_CHECKING:
    from layoutopt.plots.figures import Drawn

Found = Mapping[tuple[str, str, str], TrialOutcomes]
"""Outcomes by setting, pattern and estimator."""
Ratios = Mapping[tuple[str, str], Score]
"""Error on a pattern over that on the square one, by setting and pattern."""
GOAL: Final = "position_error_mean"
BASE: Final = "square"
FILTER: Final = ("mcl_adaptive",)
"""What remembers its way; the first that a robot can use."""
SINGLE: Final = ("midrange", "one_reader")
"""What takes each reading by itself."""
_SIZE_MM: Final = (170.0, 88.0)
_RISK: Final = 0.05
_LEAST_RATIO: Final = 1e-3
"""A ratio has a logarithm; few drives give intervals that end below zero."""


def ratios_to_square(found: Found, names: tuple[str, ...]) -> dict[tuple[str, str], Score]:
    """Return the ratio of every pattern for every robot with the first of these estimators that it can use."""
    ratios = {}
    for setting in settings():
        name = next((name for name in names if (setting.name, BASE, name) in found), None)
        for (where, label, estimator), table in found.items():
            if where == setting.name and estimator == name and label != BASE:
                ratios[where, label] = paired_ratio(table, found[where, BASE, estimator], GOAL)
    return ratios


def verdict_lines(found: Found) -> list[str]:
    """Return which patterns are shown to err less than the square one, all intervals of an estimator together."""
    return [
        *_verdict(ratios_to_square(found, FILTER), "With a filter that remembers its way"),
        *_verdict(ratios_to_square(found, SINGLE), "With each reading taken by itself"),
    ]


def _verdict(ratios: Ratios, how: str) -> list[str]:
    if not ratios:
        return []
    together = 1.0 - _RISK / len(ratios)
    better = {place: score for place, score in ratios.items() if score.interval(together)[1] < 1.0}
    shown = shown_on(min(score.count for score in ratios.values()))
    told = f"{shown} to err less than the square one (95 % for all {len(ratios)} comparisons together)"
    if not better:
        return [f"{how}, no pattern is {told}."]
    texts = [
        f"{label} for the robot “{where}” ({percent_text(1.0 - score.value)} less)"
        for (where, label), score in sorted(better.items(), key=lambda item: item[1].value)
    ]
    return [f"{how}, these are {told}: {'; '.join(texts)}."]


def draw_verdict(found: Found) -> "Drawn | None":
    """Draw the ratios of both kinds of estimators side by side, a row a pattern; ``None`` while there is none."""
    panels = {
        "a filter that remembers its way": ratios_to_square(found, FILTER),
        "each reading by itself": ratios_to_square(found, SINGLE),
    }
    drawn = {title: ratios for title, ratios in panels.items() if ratios}
    if not drawn:
        return None
    axes = panel_axes(None, len(drawn), columns=len(drawn), width_mm=_SIZE_MM[0], height_mm=_SIZE_MM[1])
    for ax, (title, ratios) in zip(axes, drawn.items(), strict=True):
        rows = [
            RatioRow(
                label=label,
                ratios={where: interval_ends(score) for (where, other), score in ratios.items() if other == label},
            )
            for label in dict.fromkeys(label for _, label in ratios)
        ]
        draw_ratios(rows, bands=(), x_label="error over that on the square pattern", ax=ax)
        ax.set_title(title, loc="left", fontsize=TEXT_PT)
        if (legend := ax.get_legend()) is not None:
            legend.remove()  # for one that serves both
    if len({tuple(text.get_text() for text in ax.get_yticklabels()) for ax in axes}) == 1:
        for ax in axes[1:]:
            ax.tick_params(labelleft=False)
    legend_below(axes)
    return figure_of(axes[0])


def interval_ends(score: Score) -> tuple[float, float, float]:
    """Return a ratio and the ends of its 95 % interval, as far as these can be drawn."""
    low, high = score.interval()
    return score.value, max(low, _LEAST_RATIO), high if math.isfinite(high) else score.value
