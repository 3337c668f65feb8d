"""The bill of material as a table."""

from pathlib import Path
from typing import Final

from layoutopt.parts import BillOfMaterial
from layoutopt.tables.cells import text_cell, write_csv

_COLUMNS: Final = (
    "scope",
    "item",
    "description",
    "quantity",
    "unit",
    "price_eur",
    "total_eur",
    "source",
    "date",
)


def write_bill_csv(path: Path | str, bill: BillOfMaterial) -> None:
    """Write the bill of material as CSV; the last row holds the total, which is the sum of the rows above."""
    rows = [
        [
            line.scope.value,
            line.item,
            text_cell(line.description),
            quantity_text(line.quantity),
            text_cell(line.unit),
            _price(line.price_eur),
            f"{line.total_eur:.2f}",
            text_cell(line.source),
            text_cell(line.date),
        ]
        for line in bill.lines
    ]
    source = text_cell(f"sum of the rows, price list {bill.price_list}")
    robots = f"floor and {bill.robot_count} robot" + ("s" if bill.robot_count > 1 else "")
    date = text_cell(bill.price_date)
    rows.append(["total", "total", robots, "", "", "", f"{bill.total_eur:.2f}", source, date])
    write_csv(path, _COLUMNS, rows)


def quantity_text(number: float) -> str:
    """Return a quantity: pieces whole, hours with four decimals."""
    return f"{number:.0f}" if number == int(number) else f"{number:.4f}"


def _price(price_eur: float) -> str:
    """Return a price with at least two decimals, more where it has parts of a cent."""
    whole, _, decimals = f"{price_eur:.6f}".partition(".")
    return f"{whole}.{decimals.rstrip('0').ljust(2, '0')}"
