"""Symbols of marks, drawn once in a unit square and repeated by every renderer alike.

Coordinates are multiples of the mark's size, measured from its centre: a symbol of size 1 fills -0.5 .. 0.5.
"""

import math
from dataclasses import dataclass
from typing import Literal

Point = tuple[float, float]
SymbolName = Literal["ring", "disc", "target", "square", "cross", "datum", "cross_square", "arrow"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Symbol:
    """Shapes that make up one symbol: drawn lines, closed outlines and circles, filled discs and polygons."""

    lines: tuple[tuple[Point, ...], ...] = ()
    outlines: tuple[tuple[Point, ...], ...] = ()
    circles: tuple[tuple[Point, float], ...] = ()
    discs: tuple[tuple[Point, float], ...] = ()
    polygons: tuple[tuple[Point, ...], ...] = ()


def _sector(start_deg: float) -> tuple[Point, ...]:
    """Return a quarter of the inner disc, as a polygon, beginning at ``start_deg``."""
    turns = [math.radians(start_deg + 7.5 * step) for step in range(13)]
    return ((0.0, 0.0), *((0.35 * math.cos(turn), 0.35 * math.sin(turn)) for turn in turns))


_SQUARE: tuple[Point, ...] = ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))
_PLUS: tuple[tuple[Point, ...], ...] = (((-0.5, 0.0), (0.5, 0.0)), ((0.0, -0.5), (0.0, 0.5)))

SYMBOLS: dict[SymbolName, Symbol] = {
    "ring": Symbol(circles=(((0.0, 0.0), 0.5),)),
    "disc": Symbol(discs=(((0.0, 0.0), 0.5),)),
    "target": Symbol(circles=(((0.0, 0.0), 0.5),), lines=_PLUS),
    "square": Symbol(outlines=(_SQUARE,)),
    "cross": Symbol(lines=_PLUS),
    "cross_square": Symbol(outlines=(_SQUARE,), lines=_PLUS),
    "arrow": Symbol(
        lines=(((-0.5, -0.5), (-0.5, 0.5)), ((-0.5, 0.0), (0.2, 0.0))),
        polygons=(((0.2, -0.25), (0.5, 0.0), (0.2, 0.25)),),
    ),
    "datum": Symbol(circles=(((0.0, 0.0), 0.35),), lines=_PLUS, polygons=(_sector(0.0), _sector(180.0))),
}
