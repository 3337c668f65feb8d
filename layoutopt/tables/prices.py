"""The items of a price list as lines for people and as a table, each with its date and source."""

from collections.abc import Sequence
from typing import Final

from layoutopt.prices import Price, PriceList
from layoutopt.score_text import euros, percent_text
from layoutopt.tables.cells import quoted, text_cell
from layoutopt.units import format_duration, format_length

COLUMNS: Final = (
    "item",
    "description",
    "price_eur",
    "unit",
    "labour_s",
    "spare_share",
    "width_m",
    "height_m",
    "base_side_m",
    "date",
    "source",
)
_ESTIMATE: Final = "estimate"


def price_lines(prices: PriceList) -> list[str]:
    """Return the list in words: an item a line, and how many are estimates."""
    rows = [
        (price.name, _price_text(price), _rest(price), f"{price.date}, {price.source}") for price in _all(prices)
    ]
    widths = [max(len(row[column]) for row in rows) for column in range(3)]
    guessed = sum(_is_estimate(price) for price in prices.items.values())
    return [
        f"{prices.name} of {prices.date}, in {prices.currency} without tax",
        *(
            "  ".join([name.ljust(widths[0]), cost.rjust(widths[1]), rest.ljust(widths[2]), source])
            for name, cost, rest, source in rows
        ),
        f"{guessed} of {len(rows)} prices are estimates: they compare layouts, and are no quotes to order by",
    ]


def price_csv(prices: PriceList) -> list[str]:
    """Return the list as lines of CSV: SI units, empty where an item has no such value."""
    rows = [COLUMNS, *(_cells(price) for price in _all(prices))]
    return [",".join(quoted(text_cell(cell)) for cell in row) for row in rows]


def _cells(price: Price) -> tuple[str, ...]:
    width_m, height_m = ("", "") if price.size_m is None else map(repr, price.size_m)
    return (
        price.name,
        price.description,
        repr(price.price_eur),
        price.unit,
        repr(price.labour_s),
        repr(price.spare_share),
        width_m,
        height_m,
        "" if price.base_side_m is None else repr(price.base_side_m),
        price.date,
        price.source,
    )


def _is_estimate(price: Price) -> bool:
    """Whether nobody has offered the item at this price: its source says so."""
    return price.source.lower().startswith(_ESTIMATE)


def _all(prices: PriceList) -> Sequence[Price]:
    return tuple(prices.items.values())


def _price_text(price: Price) -> str:
    return f"{euros(price.price_eur)} / {price.unit}"


def _rest(price: Price) -> str:
    """Return what else bears on the cost: time, spares, size."""
    parts = [f"{format_duration(price.labour_s)} of work"] if price.labour_s else []
    parts += [f"{percent_text(price.spare_share)} spare"] if price.spare_share else []
    if price.size_m is not None:
        parts.append(" × ".join(format_length(side) for side in price.size_m))
    if price.base_side_m is not None:
        parts.append(f"up to {format_length(price.base_side_m)}, then by area")
    return ", ".join(parts)
