"""Labels beside points of a figure, placed where they cover little."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.plots.figures import INK, PAPER, SMALL_PT, figure_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Box = tuple[float, float, float, float]

_DIRECTIONS: Final = tuple(
    (float(np.cos(turn)), float(np.sin(turn))) for turn in np.pi / 4.0 + np.pi / 8.0 * np.arange(16)
)
_REACHES_PT: Final = (8.0, 16.0, 28.0, 44.0, 64.0, 90.0)
_PASSES: Final = 3
_LINE_SAMPLES: Final = 24
ALONG: Final = 8
"""Places between two points of a line at which a label must not lie."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PointLabel:
    """Text that belongs to a point, in data coordinates."""

    x: float
    y: float
    text: str
    bold: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class _Place:
    """A place for a text: offset from its point, alignment, and what it covers in pixels, ``hull`` in all."""

    offset_pt: tuple[float, float]
    horizontal: str
    vertical: str
    box: Box
    line: FloatArray
    hull: Box


def place_labels(ax: "Axes", labels: Sequence[PointLabel], avoid: Sequence[tuple[float, float]]) -> None:
    """Write labels beside their points, where they cover neither each other nor the points to ``avoid``.

    Call it last: the places depend on the limits of the axes. Each label in turn takes the place round its
    point that covers least; this is repeated with all others known, from several orders, and the best kept. A
    thin line leads from a label to its point. Data coordinates throughout.
    """
    if not labels:
        return
    figure = figure_of(ax)
    figure.draw_without_rendering()
    extent = ax.get_window_extent()
    frame = (extent.x0 + 4.0, extent.y0 + 4.0, extent.x1 - 4.0, extent.y1 - 4.0)
    points = [(label.x, label.y) for label in labels] + list(avoid)
    pixels = ax.transData.transform(np.array(points).reshape(-1, 2))
    choices = [
        _places(_size(ax, label), anchor, figure.dpi / 72.0)
        for label, anchor in zip(labels, pixels[: len(labels)], strict=True)
    ]
    alone = [np.array([_badness(place, frame, pixels) for place in places]) for places in choices]
    numbers = range(len(labels))
    orders = (
        list(numbers),
        list(reversed(numbers)),
        sorted(numbers, key=lambda number: pixels[number, 0]),
        sorted(numbers, key=lambda number: pixels[number, 1]),
    )
    _, chosen = min((_settle(order, choices, alone) for order in orders), key=lambda result: result[0])
    for number, label in enumerate(labels):
        _write(ax, label, choices[number][chosen[number]])


def points_along(ax: "Axes", x: FloatArray, y: FloatArray, *, between: int = ALONG) -> list[tuple[float, float]]:
    """Return places along a line that is drawn straight from point to point, in data coordinates, to be avoided.

    Call it once the axes have their scales, linear or logarithmic. Points that are not finite are passed over.
    """
    points = np.column_stack([x, y])
    pixels = ax.transData.transform(points[np.isfinite(points).all(axis=1)])
    if not len(pixels):
        return []
    at = np.linspace(0.0, len(pixels) - 1.0, between * (len(pixels) - 1) + 1)
    numbers = np.arange(len(pixels))
    found = np.column_stack([np.interp(at, numbers, column) for column in pixels.T])
    return [(float(place[0]), float(place[1])) for place in ax.transData.inverted().transform(found)]


def _size(ax: "Axes", label: PointLabel) -> tuple[float, float]:
    """Return width and height of a label, in pixels."""
    probe = ax.text(0.0, 0.0, label.text, fontsize=SMALL_PT, fontweight=_weight(label), parse_math=False)
    extent = probe.get_window_extent()
    probe.remove()
    return extent.width, extent.height


def _weight(label: PointLabel) -> str:
    return "bold" if label.bold else "normal"


def _write(ax: "Axes", label: PointLabel, place: _Place) -> None:
    relative = {"left": 0.0, "bottom": 0.0, "center": 0.5, "right": 1.0, "top": 1.0}
    note = ax.annotate(
        label.text,
        (label.x, label.y),
        xytext=place.offset_pt,
        textcoords="offset points",
        ha=place.horizontal,
        va=place.vertical,
        fontsize=SMALL_PT,
        fontweight=_weight(label),
        color=INK,
        parse_math=False,
        zorder=6,
        annotation_clip=False,
        arrowprops={
            "arrowstyle": "-",
            "color": INK,
            "linewidth": 0.5,
            "shrinkA": 0.0,
            "shrinkB": 4.0,
            "relpos": (relative[place.horizontal], relative[place.vertical]),
        },
        bbox={"boxstyle": "square,pad=0.1", "facecolor": PAPER, "edgecolor": "none", "alpha": 0.75},
    )
    # The axes must keep their size, or every label would be where it was not measured.
    note.set_in_layout(False)


def _places(size: tuple[float, float], anchor: FloatArray, pixels_per_pt: float) -> list[_Place]:
    """Return the places to try, nearest first."""
    width, height = size
    found = []
    for reach_pt in _REACHES_PT:
        for dx, dy in _DIRECTIONS:
            horizontal = "left" if dx > 0.3 else "right" if dx < -0.3 else "center"
            vertical = "bottom" if dy > 0.3 else "top" if dy < -0.3 else "center"
            x = float(anchor[0]) + dx * reach_pt * pixels_per_pt
            y = float(anchor[1]) + dy * reach_pt * pixels_per_pt
            x -= {"left": 0.0, "right": width, "center": width / 2.0}[horizontal]
            y -= {"bottom": 0.0, "top": height, "center": height / 2.0}[vertical]
            box = (x, y, x + width, y + height)
            line = np.linspace(anchor, np.clip(anchor, box[:2], box[2:]), _LINE_SAMPLES)
            low, high = np.minimum(box[:2], anchor) - 4.0, np.maximum(box[2:], anchor) + 4.0
            found.append(
                _Place(
                    offset_pt=(dx * reach_pt, dy * reach_pt),
                    horizontal=horizontal,
                    vertical=vertical,
                    box=box,
                    line=line,
                    hull=(float(low[0]), float(low[1]), float(high[0]), float(high[1])),
                )
            )
    return found


def _settle(
    order: Sequence[int], choices: Sequence[Sequence[_Place]], alone: Sequence[FloatArray]
) -> tuple[float, dict[int, int]]:
    """Place the labels in that order, again and again; return how bad the result is, and each one's place."""
    chosen: dict[int, int] = {}
    for _ in range(_PASSES):
        for number in order:
            bad = alone[number].copy()
            for other, place in chosen.items():
                if other != number:
                    bad += [_clash(mine, choices[other][place]) for mine in choices[number]]
            chosen[number] = int(bad.argmin())
    total = sum(float(alone[number][place]) for number, place in chosen.items())
    total += sum(
        _clash(choices[first][chosen[first]], choices[second][chosen[second]])
        for first in order
        for second in order
        if first != second
    )
    return total, chosen


def _badness(place: _Place, frame: Box, pixels: FloatArray) -> float:
    """Return how bad a place is by itself: far off, out of the axes, over points, its line through points."""
    x0, y0, x1, y1 = place.box
    reach_pt = float(np.hypot(*place.offset_pt))
    bad = reach_pt * (1.0 + reach_pt / 60.0) + 1000.0 * (1.0 - _shared(place.box, frame) / _area(place.box))
    bad += 60.0 * _count_inside((x0 - 7.0, y0 - 7.0, x1 + 7.0, y1 + 7.0), pixels)
    # The line may touch its own point, which is where it starts, but should miss the others.
    reach = np.linalg.norm(place.line[:, None, :] - pixels[None, :, :], axis=2).min(axis=0)
    own = np.linalg.norm(pixels - place.line[0], axis=1) < 1.0
    return bad + 60.0 * float(((reach < 7.0) & ~own).sum())


def _clash(one: _Place, other: _Place) -> float:
    """Return how much two labels and their lines are in each other's way."""
    if _shared(one.hull, other.hull) == 0.0:
        return 0.0
    x0, y0, x1, y1 = one.box
    bad = 2000.0 * _shared((x0 - 3.0, y0 - 3.0, x1 + 3.0, y1 + 3.0), other.box) / _area(one.box)
    bad += 150.0 * (_count_inside(other.box, one.line) > 0) + 150.0 * (_count_inside(one.box, other.line) > 0)
    gaps = np.abs(one.line[:, None, :] - other.line[None, :, :]).max(axis=2)
    return bad + 80.0 * float(gaps.min() < 3.0)


def _shared(one: Box, other: Box) -> float:
    width = min(one[2], other[2]) - max(one[0], other[0])
    height = min(one[3], other[3]) - max(one[1], other[1])
    return max(0.0, width) * max(0.0, height)


def _area(box: Box) -> float:
    return max(1.0, (box[2] - box[0]) * (box[3] - box[1]))


def _count_inside(box: Box, pixels: FloatArray) -> int:
    x, y = pixels[:, 0], pixels[:, 1]
    return int(((x > box[0]) & (x < box[2]) & (y > box[1]) & (y < box[3])).sum())
