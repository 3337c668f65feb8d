"""Where the money goes for each number of robots: shares of floor and readers, with the whole cost."""

from collections.abc import Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Final

from layoutopt.plots.figures import HATCHES, INK, PAPER, SERIES, SMALL_PT, TEXT_PT, new_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_WIDTH_MM: Final = 170.0
_HEIGHT_MM: Final = 80.0


def draw_fleet_shares(
    robots: Sequence[int],
    floor_eur: Sequence[float],
    readers_eur: Sequence[float],
    *,
    bought: Sequence[str] = (),
    ax: "Axes | None" = None,
) -> "Axes":
    """Draw a bar for each number of robots: the share of the floor below, that of the readers above.

    Parameters
    ----------
    floor_eur, readers_eur
        Cost of the floor and of the readers of all robots, EUR, one for each number of robots.
    bought
        What is bought for each number of robots, in a few words; bars in a row that buy the same share one brace
        above them. Nothing is told of it by default.
    ax
        Axes to draw into; by default those of a new figure.

    Raises
    ------
    ValueError
        If there is no bar, or the numbers differ in length.
    """
    lengths = {len(robots), len(floor_eur), len(readers_eur), *([len(bought)] if bought else [])}
    if not robots or len(lengths) > 1:
        raise ValueError("a figure of fleets needs costs and, if any, what is bought for each number of robots")
    ax = new_axes(_WIDTH_MM, _HEIGHT_MM) if ax is None else ax
    places = range(len(robots))
    totals = [floor + readers for floor, readers in zip(floor_eur, readers_eur, strict=True)]
    below = [100.0 * floor / total for floor, total in zip(floor_eur, totals, strict=True)]
    above = [100.0 - share for share in below]
    look = {"width": 0.74, "edgecolor": PAPER, "linewidth": 0.8}
    ax.bar(places, below, color=SERIES[0], label="floor", **look)  # type: ignore[arg-type]
    ax.bar(places, above, bottom=below, color=SERIES[1], hatch=HATCHES[1], label="readers of all robots", **look)  # type: ignore[arg-type]
    for place, total in zip(places, totals, strict=True):
        text = f"{total / 1000.0:.1f}"
        ax.annotate(text, (place, 101.5), ha="center", va="bottom", fontsize=SMALL_PT, color=INK)
    beside = (len(robots) - 0.55, 101.5)
    ax.annotate("thousand EUR\nin all", beside, ha="left", va="center", fontsize=SMALL_PT, color=INK)
    _draw_braces(ax, bought)
    ax.set_xticks(places, [str(count) for count in robots], fontsize=TEXT_PT)
    ax.set_xlabel("robots", fontsize=TEXT_PT)
    ax.set_ylabel("share of the cost (%)", fontsize=TEXT_PT)
    ax.set_xlim(-0.6, len(robots) + 0.9)
    ax.set_ylim(0.0, 132.0 if bought else 112.0)
    ax.set_yticks([0, 20, 40, 60, 80, 100])
    ax.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=2,
        frameon=False,
        fontsize=SMALL_PT,
        labelcolor=INK,
    )
    return ax


def _draw_braces(ax: "Axes", bought: Sequence[str]) -> None:
    """Draw a line over bars in a row that buy the same, with the words above it."""
    for words, run in groupby(range(len(bought)), key=lambda place: bought[place]):
        places = list(run)
        ax.plot([places[0] - 0.37, places[-1] + 0.37], [111.0, 111.0], color=INK, linewidth=0.8)
        middle = (places[0] + places[-1]) / 2.0
        ax.annotate(words, (middle, 112.5), ha="center", va="bottom", fontsize=SMALL_PT, color=INK)
