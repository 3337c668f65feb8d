"""The price list within a frozen copy: ``[parts.price_list]``, in both directions."""

from typing import TYPE_CHECKING, Any

from layoutopt.prices import Price, PriceList
from layoutopt.spec.written_numbers import as_written

if TYPE_CHECKING:
    from layoutopt.spec.findings import Findings
    from layoutopt.spec.lines import KeyPath
    from layoutopt.spec.schema import PriceListTable


def price_list_of(table: "PriceListTable", path: "KeyPath", findings: "Findings") -> PriceList | None:
    """Return the price list that a frozen copy holds, ``None`` after a fault."""
    from layoutopt.spec.quantities import in_si

    items = {}
    for name, item in table.items.items():
        size_m = tuple(in_si(value, "length") for value in item.size) if item.size is not None else None
        items[name] = Price(
            name=name,
            description=item.description,
            price_eur=in_si(item.price, "price"),
            unit=item.unit,
            source=item.source,
            date=item.date,
            labour_s=in_si(item.labour, "time"),
            spare_share=in_si(item.spare, "share"),
            size_m=(size_m[0], size_m[1]) if size_m is not None else None,
            base_side_m=None if item.base_side is None else in_si(item.base_side, "length"),
        )
    try:
        return PriceList(name=table.name, date=table.date, items=items, currency=table.currency)
    except ValueError as error:
        findings.add(path, str(error), "Copy the table from a frozen spec, or name a price file instead.")
        return None


def price_table(prices: PriceList) -> dict[str, Any]:
    """Return a price list as the table of a frozen copy."""
    items: dict[str, Any] = {}
    for name, price in prices.items.items():
        item: dict[str, Any] = {
            "description": price.description,
            "price": as_written(price.price_eur, "price"),
            "unit": price.unit,
            "source": price.source,
            "date": price.date,
            "labour": as_written(price.labour_s, "time"),
            "spare": as_written(price.spare_share, "share"),
        }
        if price.size_m is not None:
            item["size"] = [as_written(value, "length") for value in price.size_m]
        if price.base_side_m is not None:
            item["base_side"] = as_written(price.base_side_m, "length")
        items[name] = item
    return {"name": prices.name, "date": prices.date, "currency": prices.currency, "items": items}
