"""What snapping says and leaves: lines for the terminal, changed tags, cut tiles and price as tables, a layout."""

import re
from collections import Counter
from pathlib import Path
from typing import Final

from layoutopt.score_text import (
    NOT_KNOWN,
    counted_text,
    euros,
    limit_text,
    percent_text,
    score_name,
    score_text,
    shown_unit,
)
from layoutopt.snapping.cut_tiles import CutTile
from layoutopt.snapping.snapped import Fate, Snapped, TagFate
from layoutopt.spec.building import Spec
from layoutopt.spec.layout_file import write_layout
from layoutopt.tables.cells import text_cell, write_csv
from solvers.judging import trials_needed
from studies.alternatives import signed_euros
from studies.columns import number
from studies.snapping import AS_LAID, Change, SnappingPrice, finite

_MOST_SHOWN: Final = 10
_LAID: Final = (Fate.KEPT, Fate.SNAPPED, Fate.MOVED, Fate.ADDED)
_MOVING: Final = (Fate.SNAPPED, Fate.MOVED, Fate.ADDED)


def fate_lines(result: Snapped) -> list[str]:
    """Return what became of the tags, by which rules, and which tiles are cut."""
    counts = Counter(item.fate for item in result.fates)
    before = sum(counts[fate] for fate in (Fate.KEPT, Fate.SNAPPED, Fate.MOVED, Fate.DROPPED))
    lines = [
        f"to {result.words}: {counted_text(before, 'tag')} before, {len(result.of(*_LAID))} after: "
        + ", ".join(f"{counts[fate]} {fate.value}" for fate in Fate)
    ]
    ways_mm = [1000.0 * item.by_m for item in result.of(*_MOVING)]
    if ways_mm:
        lines.append(
            f"tags that go elsewhere go {sum(ways_mm) / len(ways_mm):.1f} mm on average, at most "
            f"{max(ways_mm):.1f} mm"
        )
    reasons = Counter((item.fate, _kind_of(item.why)) for item in result.of(Fate.DROPPED, Fate.NOT_LAID))
    ordered = sorted(reasons.items(), key=lambda entry: (-entry[1], entry[0][0].value, entry[0][1]))
    lines += [f"  {count} {fate.value}: {why}" for (fate, why), count in ordered[:_MOST_SHOWN]]
    if len(ordered) > _MOST_SHOWN:
        lines.append(f"  {len(ordered) - _MOST_SHOWN} more reasons: see snapping.csv")
    if result.cut_tiles:
        least = min(result.cut_tiles, key=lambda tile: tile.share)
        lines.append(
            f"{counted_text(len(result.cut_tiles), 'floor tile')} cut at walls, the smallest c{least.column}"
            f"r{least.row} with {percent_text(least.share)} left: see cut_tiles.csv"
        )
    return lines


def price_lines(price: SnappingPrice) -> list[str]:
    """Return the price of snapping in accuracy, coverage and money, and what it does to the limits."""
    same = price.snapped.key == price.layout.key
    becomes = "stays as it is: every tag lies on its mark" if same else f"becomes {price.snapped.short_key}"
    lines = [f"{price.layout.short_key} {becomes}"]
    if price.refusal:
        return [*lines, f"not judged: {price.refusal}"]
    last = price.first + price.trials - 1
    lines.append(
        f"both layouts on the same held-out drives {price.first} to {last} of each scenario, estimator "
        f"{price.problem.estimators[0].name}, seed {price.seed}; each interval holds at 95 % by itself"
    )
    for scenario, changes in price.by_scenario.items():
        lines += [scenario, *(f"  {change_text(change)}" for change in changes)]
    lines += [f"failed: {text}" for text in sorted(set(price.failures.values()))]
    if price.coverage:
        lines += [f"{AS_LAID}, the same random poses and runs of 1 m"]
        lines += [f"  {change_text(change)}" for change in price.coverage]
    if price.cost is not None:
        before, after = price.cost.before.value, price.cost.after.value
        lines.append(f"cost: {euros(before)} becomes {euros(after)}, {signed_euros(after - before)}")
    for item in price.limits:
        told = f"{limit_text(item.limit)} on {item.where}: {score_text(item.after, item.limit.score)}"
        if item.limit.met(item.after):
            lines.append(f"met: {told}")
        elif item.lost:
            lines.append(f"LOST BY SNAPPING: {told}, before {score_text(item.before, item.limit.score)}")
        else:
            more = trials_needed(item.limit, item.after)
            rare = f"; never seen, which {more} drives would show to be within the limit" if more else ""
            lines.append(f"missed before and after: {told}{rare}")
    lines += [
        f"not judged: {limit_text(limit)}, which speaks of the pattern and not of its tags as they are laid"
        for limit in price.unjudged
    ]
    return lines


def change_text(change: Change) -> str:
    """Return a score before and after, with the difference and its interval."""
    factor, unit = shown_unit(change.name)
    text = (
        f"{score_name(change.name)}: {score_text(change.before, change.name)} becomes "
        f"{score_text(change.after, change.name)}: "
    )
    if not finite(change.difference):
        return f"{text}difference {NOT_KNOWN}"
    low, high = (end * factor for end in change.difference.interval())
    unit = unit if unit == "°" else f" {unit}"
    return (
        f"{text}{change.difference.value * factor:+.3g}{unit} ({low:+.3g} to {high:+.3g}, "
        f"n = {change.difference.count})"
    )


def write_snapped(price: SnappingPrice, spec: Spec, folder: Path, *, quick_look: bool = False) -> tuple[Path, ...]:
    """Write the snapped layout, the changed tags, the cut tiles and the price; return the files.

    ``quick_look`` says that a quick look chose the layout that was snapped: its mark goes on to the new file.

    Raises
    ------
    InvalidInput
        If the layout cannot be written as a file.
    """
    folder.mkdir(parents=True, exist_ok=True)
    layout_file = folder / "snapped.toml"
    write_layout(price.snapped, spec, layout_file, quick_look=quick_look)
    return (layout_file, *_write_tables(price, folder))


def _write_tables(price: SnappingPrice, folder: Path) -> tuple[Path, ...]:
    tags, tiles, prices = folder / "snapping.csv", folder / "cut_tiles.csv", folder / "price.csv"
    write_csv(
        tags,
        ("tag_id", "what", "from_x_m", "from_y_m", "to_x_m", "to_y_m", "by_mm", "why"),
        [_fate_cells(item) for item in price.result.fates if item.fate is not Fate.KEPT],
    )
    write_csv(
        tiles,
        ("tile", "share_left", "width_mm", "height_mm", "middle_x_m", "middle_y_m"),
        [_tile_cells(tile) for tile in price.result.cut_tiles],
    )
    rows = [
        _price_cells(where, change)
        for where, changes in (*price.by_scenario.items(), (AS_LAID, price.coverage))
        for change in changes
    ]
    if price.cost is not None:
        rows.append(_price_cells(AS_LAID, price.cost))
    header = ("where", "score", "unit", "before", "after", "difference", "low_95", "high_95", "n", "seed")
    write_csv(prices, header, [[*row, str(price.seed)] for row in rows])
    return tags, tiles, prices


def _kind_of(why: str) -> str:
    """Return a reason without what is one tag's own: numbers of obstacles and tags, names of tiles."""
    why = re.sub(r"to tag \d+", "to another tag", re.sub(r"obstacle \d+", "an obstacle", why))
    return re.sub(r"cut tile [^;]*", "less than half of its floor tile is left", why)


def _fate_cells(item: TagFate) -> list[str]:
    to_m = ("", "") if item.to_m is None else tuple(f"{value:.6f}" for value in item.to_m)
    return [
        "" if item.tag_id is None else str(item.tag_id),
        item.fate.value,
        *(f"{value:.6f}" for value in item.from_m),
        *to_m,
        "" if item.to_m is None else f"{1000.0 * item.by_m:.3f}",
        text_cell(item.why),
    ]


def _tile_cells(tile: CutTile) -> list[str]:
    sides = (f"{1000.0 * side_m:.1f}" for side_m in (tile.width_m, tile.height_m))
    return [
        f"c{tile.column}r{tile.row}",
        f"{tile.share:.4f}",
        *sides,
        *(f"{value:.6f}" for value in tile.middle_m),
    ]


def _price_cells(where: str, change: Change) -> list[str]:
    low, high = change.difference.interval()
    values = (change.before.value, change.after.value, change.difference.value, low, high)
    count = change.difference.count
    return [text_cell(where), text_cell(change.name), change.before.unit, *map(number, values), str(count)]
