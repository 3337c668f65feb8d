"""Cost against the goal of accuracy: every simulated layout, the front, the recommended, published layouts."""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from layoutopt.plots.figures import (
    FAINT,
    INK,
    PAPER,
    SERIES,
    SMALL_PT,
    grouped,
    label_log_axis,
    new_axes,
    rasterised,
    spans_decade,
)
from layoutopt.plots.labels import PointLabel, place_labels
from layoutopt.result import Evaluated, Front
from layoutopt.score_text import score_name, shown_unit
from layoutopt.scores import Score

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from studies.findings import Design, ReferenceMark

COST: Final = "cost"
ERROR: Final = "position_error_mean"
REFERENCE_NOTE: Final = "mi2016: reconstructed arrays, own chassis on\nclear floor, not members of the front"
LEAST_REPLICATIONS: Final = 5
"""Fewer give no interval that is worth drawing: it would reach below zero."""
_MANY: Final = 400
_MARK_PT: Final = 4.4
"""Side of a mark of the front: large enough for its tone to be seen."""


def known_interval(score: Score) -> tuple[float, float] | None:
    """Return the 95 % interval of a score, or nothing if it rests on too few replications to have one."""
    low, high = score.interval()
    if score.exact or (score.count >= LEAST_REPLICATIONS and math.isfinite(low) and math.isfinite(high)):
        return low, high
    return None


def draw_front(
    *,
    designs: Sequence["Design"],
    front: Front,
    recommended: Mapping[str, Evaluated],
    references: Sequence["ReferenceMark"],
    target_m: float | None,
    budget_eur: float | None = None,
    membership: Mapping[str, float] | None = None,
    ax: "Axes | None" = None,
) -> "Axes":
    """Draw the cost of layouts against the second goal of the front, such as their mean position error.

    Simulated layouts are faint points, members of the front marks with 95 % intervals joined by steps (what a
    budget buys), recommended layouts larger marks with their role, published layouts open diamonds. An axis is
    logarithmic where its values reach over more than a decade. A mark whose interval is not known, because it
    rests on fewer than `LEAST_REPLICATIONS` trials, has none. Layouts without a known score are not drawn.

    Parameters
    ----------
    recommended
        Layouts by role, such as ``"cheapest"``.
    target_m
        Demanded mean position error, m, drawn as a dashed line if that is the goal.
    budget_eur
        Most money to be spent, EUR, drawn as a line of dashes and dots.
    membership
        Probability that a layout is on the true front, by key: the mark of a member is the fuller the surer it is.
    """
    ax = new_axes(170.0, 115.0) if ax is None else ax
    goal = front.goals[1]
    target_m = target_m if goal == ERROR else None
    cloud = _points([design.evaluated for design in designs], goal)
    members = [member for member in front.members if _known(member, goal)]
    marked = {role: chosen for role, chosen in recommended.items() if _known(chosen, goal)}
    published = [mark for mark in references if math.isfinite(mark.cost.value) and math.isfinite(mark.error.value)]
    corners = [_place(member, goal) for member in [*members, *marked.values()]]
    corners += [_mark_place(mark, goal) for mark in published]
    scores = [member.scores[goal] for member in members] + [mark.error for mark in published]
    places = np.array([*cloud, *corners]).reshape(-1, 2)
    _set_limits(ax, places, _ends(scores, goal), bool(published), target_m, budget_eur)
    if len(cloud):
        many = len(cloud) > _MANY
        ax.plot(
            cloud[:, 0],
            cloud[:, 1],
            linestyle="none",
            marker=".",
            markersize=3.0 if many else 4.5,
            color=FAINT,
            alpha=0.45 if many else 0.7,
            markeredgewidth=0.0,
            rasterized=rasterised(len(cloud)),
            label="simulated layout",
            zorder=2,
        )
    _draw_front_line(ax, members, goal, membership or {})
    for role, chosen in marked.items():
        ax.plot(
            *_place(chosen, goal), marker="o", markersize=9.5, color="none", markeredgecolor=SERIES[1], zorder=5
        )
        ax.lines[-1].set(
            markeredgewidth=1.5, label="recommended" if role == next(iter(marked)) else "_recommended"
        )
    _draw_references(ax, published, goal)
    _draw_limits(ax, target_m, budget_eur)
    unit = shown_unit(goal)[1]
    ax.set_xlabel("cost (EUR)")
    ax.set_ylabel(f"{score_name(goal)} ({unit})" if unit else score_name(goal), parse_math=False)
    ax.grid(visible=True, which="major", color=FAINT, alpha=0.3, linewidth=0.4)
    _legend(ax)
    labels = _role_labels(marked, goal, target_m)
    labels += [
        PointLabel(x=x, y=y, text=mark.label)
        for mark, (x, y) in ((mark, _mark_place(mark, goal)) for mark in published)
    ]
    place_labels(ax, labels, [_place(member, goal) for member in members])
    return ax


def _points(layouts: Sequence[Evaluated], goal: str) -> np.ndarray:
    return np.array([_place(item, goal) for item in layouts if _known(item, goal)]).reshape(-1, 2)


def _known(evaluated: Evaluated, goal: str) -> bool:
    return all(name in evaluated.scores and math.isfinite(evaluated.scores[name].value) for name in (COST, goal))


def _place(evaluated: Evaluated, goal: str) -> tuple[float, float]:
    return evaluated.scores[COST].value, evaluated.scores[goal].value * shown_unit(goal)[0]


def _mark_place(mark: "ReferenceMark", goal: str) -> tuple[float, float]:
    return mark.cost.value, mark.error.value * shown_unit(goal)[0]


def _ends(scores: Sequence[Score], goal: str) -> np.ndarray:
    """Return the ends of the intervals that are known, in the unit of the axis."""
    known = [interval for interval in map(known_interval, scores) if interval is not None]
    return np.array(known).reshape(-1) * shown_unit(goal)[0]


def _set_limits(
    ax: "Axes",
    places: np.ndarray,
    ends: np.ndarray,
    room_below: bool,
    target_m: float | None,
    budget_eur: float | None,
) -> None:
    """Show every mark and every known interval; a wild interval must not squeeze the rest."""
    costs = [*places[:, 0], *([budget_eur] if budget_eur is not None else [])]
    errors = [*places[:, 1], *([target_m * 1000.0] if target_m is not None else [])]
    if not costs or not errors:
        return
    label_log_axis(ax, x=spans_decade(costs), y=spans_decade(errors))
    ends = ends[(ends < 3.0 * max(errors)) & (ends > min(errors) / 3.0)]
    errors += [float(end) for end in ends]
    # Published layouts mostly lie below the front; their names need some room there.
    ax.set_xlim(*_with_room(costs, ax.get_xscale(), 1.0))
    ax.set_ylim(*_with_room(errors, ax.get_yscale(), 2.0 if room_below else 1.0))


def _with_room(values: Sequence[float], scale: str, below: float) -> tuple[float, float]:
    low, high = min(values), max(values)
    if scale == "log":
        room = (high / low) ** 0.08
        return low / room**below, high * room
    room = 0.08 * (high - low or high or 1.0)
    return (max(0.0, low - below * room) if low >= 0.0 else low - below * room), high + room


def _draw_front_line(ax: "Axes", members: Sequence[Evaluated], goal: str, membership: Mapping[str, float]) -> None:
    if not members:
        return
    # Imported here: matplotlib costs more than all the rest of a short command.
    from matplotlib.colors import to_rgba

    places = np.array([_place(member, goal) for member in members])
    scores = [member.scores[goal] for member in members]
    # Steps, not slopes: a budget between two layouts buys the cheaper of the two.
    ax.plot(places[:, 0], places[:, 1], color=SERIES[0], linewidth=0.9, drawstyle="steps-post", zorder=3)
    _error_bars(ax, places, scores, goal, SERIES[0])
    known = sum(known_interval(score) is not None for score in scores)
    words = "with 95 % interval" if known else "intervals not known"
    words += " where known" if 0 < known < len(scores) else ""
    told = "\nthe fuller, the surer to be on it" if membership else ""
    ax.plot(
        places[:, 0],
        places[:, 1],
        linestyle="none",
        marker="s",
        markersize=_MARK_PT,
        color=SERIES[0],
        # Below a tone that lets through what lies under it stands paper, not bars and steps.
        markerfacecolor=PAPER if membership else SERIES[0],
        markeredgewidth=0.8,
        label=f"front, {words}{told}",
        zorder=4,
    )
    if membership:
        shares = [membership.get(member.layout.key, 0.0) for member in members]
        tones = [to_rgba(SERIES[0], share) for share in shares]
        ax.scatter(places[:, 0], places[:, 1], marker="s", s=_MARK_PT**2, c=tones, linewidths=0.0, zorder=4.1)


def _error_bars(ax: "Axes", places: np.ndarray, scores: Sequence[Score], goal: str, colour: str) -> None:
    """Draw the intervals that are known."""
    for (cost, error), score in zip(places, scores, strict=True):
        interval = known_interval(score)
        if interval is None:
            continue
        low, high = (end * shown_unit(goal)[0] for end in interval)
        ax.errorbar(
            [cost], [error], [[error - low], [high - error]], color=colour, capsize=2.0, elinewidth=0.9, zorder=3
        )


def _draw_references(ax: "Axes", published: Sequence["ReferenceMark"], goal: str) -> None:
    if not published:
        return
    places = np.array([_mark_place(mark, goal) for mark in published])
    _error_bars(ax, places, [mark.error for mark in published], goal, INK)
    ax.plot(
        places[:, 0],
        places[:, 1],
        linestyle="none",
        marker="D",
        markersize=6.0,
        markerfacecolor=PAPER,
        markeredgecolor=INK,
        label=REFERENCE_NOTE,
        zorder=4,
    )


def _draw_limits(ax: "Axes", target_m: float | None, budget_eur: float | None) -> None:
    if target_m is not None:
        ax.axhline(
            target_m * 1000.0,
            color=INK,
            linestyle=(0, (5, 3)),
            linewidth=0.9,
            label=f"target, {target_m * 1000.0:g} mm",
            zorder=1,
        )
    if budget_eur is not None:
        ax.axvline(
            budget_eur,
            color=INK,
            linestyle=(0, (6, 2, 1, 2)),
            linewidth=0.9,
            label=f"budget, {grouped(budget_eur)} EUR",
            zorder=1,
        )


def _legend(ax: "Axes") -> None:
    handles, names = ax.get_legend_handles_labels()
    if handles:
        ax.legend(
            handles,
            names,
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            ncols=3,
            frameon=False,
            fontsize=SMALL_PT,
            labelcolor=INK,
            borderaxespad=0.2,
        )


def _role_labels(recommended: Mapping[str, Evaluated], goal: str, target_m: float | None) -> list[PointLabel]:
    """Return one label a layout, with all of its roles."""
    roles: dict[str, list[str]] = {}
    chosen = {evaluated.layout.key: evaluated for evaluated in recommended.values()}
    for role, evaluated in recommended.items():
        meets = target_m is not None and evaluated.scores[goal].value <= target_m
        words = "cheapest that meets the target" if role == "cheapest" and meets else role
        roles.setdefault(evaluated.layout.key, []).append(words)
    labels = []
    for key, words_of_one in roles.items():
        cost, error = _place(chosen[key], goal)
        text = f"{', '.join(words_of_one)}\n{grouped(round(cost))} EUR, {error:.3g} {shown_unit(goal)[1]}".rstrip()
        labels.append(PointLabel(x=cost, y=error, text=text, bold=True))
    return labels
