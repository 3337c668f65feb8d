"""Priced parts: what a layout takes, and what that costs by a dated price list.

Money is exact: each line of a bill is rounded once, half up, to whole cents, and every total is a sum of lines.
Price lists are read in `layoutopt.prices`; their names are offered here too.
"""

import math
from dataclasses import dataclass
from enum import Enum, unique
from fractions import Fraction
from functools import lru_cache
from typing import Final

import numpy as np

from layoutopt.errors import did_you_mean
from layoutopt.feasibility import LARGEST_MULTIPLEXER_PORTS
from layoutopt.layout import Layout, ReaderGroup, TagMap
from layoutopt.prices import DEFAULT_LIST, READER_ITEMS, TAG_ITEMS, Price, PriceList, default_prices, read_prices

__all__ = [
    "READER_ITEMS",
    "TAG_ITEMS",
    "BillLine",
    "BillOfMaterial",
    "Need",
    "Price",
    "PriceList",
    "Scope",
    "bill_of_material",
    "bill_of_needs",
    "default_prices",
    "module_of_antennas",
    "needs",
    "read_prices",
]

_WORK: Final = {
    **dict.fromkeys(TAG_ITEMS, "place and scan"),
    "survey": "carry out",
    "survey_tag": "carry out",
    "uhf_tag": "encode and give out",
}


@unique
class Scope(Enum):
    """What a line of a bill is for: the floor and site, paid once; every robot; spares of both; labour."""

    FLOOR = "floor"
    ROBOT = "robot"
    SPARES = "spares"
    LABOUR = "labour"


@dataclass(frozen=True, slots=True, kw_only=True)
class Need:
    """How many of an item a layout takes, whatever the prices are; ``side_m`` for antennas."""

    item: str
    scope: Scope
    quantity: int
    side_m: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class BillLine:
    """One line of a bill; ``total_cents`` is quantity times price, rounded half up."""

    scope: Scope
    item: str
    description: str
    quantity: float
    unit: str
    price_eur: float
    total_cents: int
    source: str
    date: str

    @property
    def total_eur(self) -> float:
        """Total of the line."""
        return self.total_cents / 100


@dataclass(frozen=True, slots=True, kw_only=True)
class BillOfMaterial:
    """All that has to be bought and done for one site and a fleet of robots, by a named price list."""

    lines: tuple[BillLine, ...]
    price_list: str
    price_date: str
    robot_count: int
    currency: str = "EUR"

    @property
    def total_eur(self) -> float:
        """Sum of all lines."""
        return sum(line.total_cents for line in self.lines) / 100

    def total_of(self, scope: Scope) -> float:
        """Return the sum of the lines of a scope, EUR."""
        return sum(line.total_cents for line in self.lines if line.scope is scope) / 100


def module_of_antennas(group: ReaderGroup) -> tuple[int, ...]:
    """Return the module, from 0, that drives each antenna: the n-th antenna of a scan slot is on module n."""
    met = [0] * group.antennas_per_module
    modules = []
    for slot in group.slots:
        modules.append(met[slot])
        met[slot] += 1
    return tuple(modules)


def needs(
    layout: Layout, tag_count: int, robot_count: int, reader_part: str = "reader_module", equipped_count: int = 0
) -> tuple[Need, ...]:
    """Return what a layout takes; a bill is linear in it, so a front is priced anew without any trial.

    ``tag_count`` tags are to be laid, and of the robots ``equipped_count`` carry the readers already. A module of
    floor readers with more than one antenna needs a multiplexer, of 4 ports for up to 4 antennas, else of 8. A UHF
    reader has ports of its own. Transponders and UHF tags are paid once, like the floor. The laser scanner by
    which robots track is not counted: they carry it already.

    Raises
    ------
    ValueError
        If there is no robot, more are equipped than there are, there is no such part, or a module has more
        antennas than the largest multiplexer.
    """
    if robot_count < 1:
        raise ValueError(f"a fleet needs at least one robot, got {robot_count}")
    if not 0 <= equipped_count <= robot_count:
        raise ValueError(f"of {robot_count} robots {equipped_count} cannot be equipped")
    bare_count = robot_count - equipped_count
    tag_part = layout.floor_tags.tag_part
    for part, known, what in ((tag_part, TAG_ITEMS, "tag"), (reader_part, READER_ITEMS, "reader")):
        if part not in known:
            raise ValueError(f"price lists hold no {what} named '{part}'. {did_you_mean(part, known)}")
    modules, small, large = 0, 0, 0
    antennas: dict[float, int] = {}
    for group in layout.floor_readers:
        modules += group.module_count
        antennas[group.antenna.side_m] = antennas.get(group.antenna.side_m, 0) + group.count
        ports = np.bincount(module_of_antennas(group))
        if ports.max(initial=0) > LARGEST_MULTIPLEXER_PORTS:
            raise ValueError(
                f"no multiplexer with more than {LARGEST_MULTIPLEXER_PORTS} ports, "
                f"and a module of '{group.name}' has {ports.max()} antennas"
            )
        small += int(((ports > 1) & (ports <= 4)).sum())
        large += int((ports > 4).sum())
    on_site = ((tag_part, tag_count), ("transponder", len(layout.transponders)), ("uhf_tag", layout.target_tags))
    found = [Need(item=item, scope=Scope.FLOOR, quantity=count) for item, count in on_site]
    found += [
        Need(item=item, scope=Scope.ROBOT, quantity=count * bare_count)
        for item, count in ((reader_part, modules), ("multiplexer_4", small), ("multiplexer_8", large))
    ]
    found += [
        Need(item="antenna", scope=Scope.ROBOT, quantity=count * bare_count, side_m=side_m)
        for side_m, count in sorted(antennas.items())
    ]
    signals, directions = layout.readers_of("signal"), layout.readers_of("direction")
    found += [
        Need(item=item, scope=Scope.ROBOT, quantity=count * bare_count)
        for item, count in (
            ("uhf_reader", sum(group.module_count for group in signals)),
            ("uhf_antenna", sum(group.count for group in signals)),
            ("direction_receiver", sum(group.module_count for group in directions)),
        )
    ]
    found += [
        Need(item="survey", scope=Scope.LABOUR, quantity=min(tag_count, 1)),
        Need(item="survey_tag", scope=Scope.LABOUR, quantity=tag_count),
    ]
    return tuple(need for need in found if need.quantity)


def bill_of_material(
    layout: Layout,
    tag_map: TagMap,
    robot_count: int,
    prices: PriceList,
    reader_part: str = "reader_module",
) -> BillOfMaterial:
    """Return the bill of a layout with the tags of ``tag_map``, for ``robot_count`` robots.

    Tags that are installed cost nothing. The rest of the floor is paid once and readers once for each robot.
    Spares are shares of the whole fleet's need, rounded up to pieces. Labour is for what is placed, mounted and
    surveyed, not for spares on the shelf.

    Raises
    ------
    ValueError
        As `needs`.
    """
    return bill_of_needs(needs(layout, len(tag_map.to_lay()), robot_count, reader_part), robot_count, prices)


def bill_of_needs(found: tuple[Need, ...], robot_count: int, prices: PriceList) -> BillOfMaterial:
    """Return the bill of what `needs` found, ordered by scope: floor, robot, spares, labour.

    Raises
    ------
    ValueError
        If the price list lacks an item that is needed.
    """
    if missing := prices.missing(need.item for need in found):
        raise ValueError(
            f"the price list '{prices.name}' has no {', '.join(missing)}: add them to [items], or begin the list "
            f'with base = "{DEFAULT_LIST}"'
        )
    lines = [line for need in found for line in _lines(need, prices)]
    order = {scope: number for number, scope in enumerate(Scope)}
    return BillOfMaterial(
        lines=tuple(sorted(lines, key=lambda line: order[line.scope])),
        price_list=prices.name,
        price_date=prices.date,
        robot_count=robot_count,
        currency=prices.currency,
    )


@lru_cache(maxsize=4096)
def _lines(need: Need, prices: PriceList) -> tuple[BillLine, ...]:
    """Return the lines of one need: the pieces, their spares, and the labour on them.

    Remembered, because thousands of layouts of a study share few needs.
    """
    price, rate = prices.items[need.item], prices.items["labour"]
    one, description = _exact(price.price_eur), price.description
    if need.side_m is not None and price.base_side_m is not None:
        one *= max(Fraction(1), (_exact(need.side_m) / _exact(price.base_side_m)) ** 2)
        one = Fraction(_cents(one), 100)
        description += f", {need.side_m * 1000:g} mm × {need.side_m * 1000:g} mm"
    found = []
    for scope, pieces in ((need.scope, need.quantity), (Scope.SPARES, _spares(price, need.quantity))):
        # Survey is time alone in most lists; other things stay visible even if they are free.
        if pieces and not (scope is Scope.LABOUR and one == 0):
            found.append(_line(scope, price, description, Fraction(pieces), price.unit, one))
    if price.labour_s > 0.0:
        hours = _exact(price.labour_s) * need.quantity / 3600
        work = f"{_WORK.get(need.item, 'mount')}: {description}"
        found.append(_line(Scope.LABOUR, rate, work, hours, rate.unit, _exact(rate.price_eur)))
    return tuple(found)


def _line(scope: Scope, price: Price, description: str, quantity: Fraction, unit: str, one: Fraction) -> BillLine:
    return BillLine(
        scope=scope,
        item=price.name,
        description=description,
        quantity=float(quantity),
        unit=unit,
        price_eur=float(one),
        total_cents=_cents(quantity * one),
        source=price.source,
        date=price.date,
    )


def _spares(price: Price, quantity: int) -> int:
    return math.ceil(_exact(price.spare_share) * quantity)


def _exact(number: float) -> Fraction:
    """Return the decimal number that people wrote: 0.1 means a tenth, not the binary number next to it."""
    return Fraction(repr(float(number)))


def _cents(amount_eur: Fraction) -> int:
    return math.floor(amount_eur * 100 + Fraction(1, 2))
