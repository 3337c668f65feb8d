"""Floor plans from DXF drawings of any version that ezdxf reads.

References
----------
ezdxf 1.4 documentation: *recover* (what it mends), *DXF Units* (``$INSUNITS``; nothing is converted on insertion),
*Insert* (``virtual_entities``).
"""

import itertools
import logging
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from layoutopt.errors import InvalidInput
from layoutopt.identity import FloatArray
from layoutopt.plans.drawing import Linework, floor_of_linework
from layoutopt.plans.floor import Floor, file_bytes, reason_of, within_bounds
from layoutopt.plans.placing import LENGTH_UNITS, Layers, length_unit_m, listed
from layoutopt.protocols import Card

if TYPE_CHECKING:
    from ezdxf.document import Drawing

CARD: Final = Card(
    summary="DXF drawing: lines, curves and blocks on named layers become walls, doors, obstacles and zones.",
    reference="ezdxf 1.4 documentation: recover, DXF Units, Insert",
)
_MOST_ENTITIES: Final = 300_000
_MOST_CORNERS: Final = 1_000_000
_DEEPEST_BLOCK: Final = 16
_FINEST_M: Final = 1e-5  # a tenth of the grid on which lines are joined
_MOST_MESSAGES: Final = 5
_EXPORT: Final = "Export it as DXF R2010 (ASCII)."
_FOREIGN: Final = {
    b"AC10": "a DWG drawing",
    b"AC1.": "a DWG drawing",
    b"%PDF": "a PDF document",
    b"\x89PNG": "a PNG image",
    b"\xff\xd8\xff": "a JPEG image",
    b"PK\x03\x04": "a zip archive",
    b"II*\x00": "a TIFF image",
    b"ISO-10303-21": "an IFC or STEP model",
    b"<?xml": "an XML document",
    b"<svg": "an SVG image",
}
# The group code of the first section or of a comment; a binary drawing has a sentinel.
_BEGINNINGS: Final = (b"0", b"999", b"AutoCAD Binary DXF")
# Codes of $INSUNITS whose unit is one of ours; the others (miles, parsecs) draw no building.
_INSUNITS: Final = {1: "in", 2: "ft", 4: "mm", 5: "cm", 6: "m"}
_POLYLINES: Final = ("LWPOLYLINE", "POLYLINE")
_CURVES: Final = ("ARC", "CIRCLE", "ELLIPSE", "SPLINE")


def read_dxf(
    path: Path,
    *,
    place: str,
    units: str | None = None,
    layers: Layers | None = None,
    gap_m: float = 0.0,
    thickest_wall_m: float = 0.5,
    line_wall_m: float = 0.1,
    smallest_room_m2: float = 1.0,
    tolerance_m: float = 0.001,
    accept_recovered: bool = False,
) -> Floor:
    """Return the floor that the model space of a drawing shows.

    Read are LINE, LWPOLYLINE and POLYLINE with bulges, ARC, CIRCLE, ELLIPSE, SPLINE and INSERT, nested up to 16
    deep; what else lies on the named layers is counted in a note. Entities on layer 0 of a block take the layer
    of its insertion. Heights are dropped. Arcs on door layers are doors.

    Parameters
    ----------
    path
        The file.
    place
        Where the path was given, for messages.
    units
        Unit of the drawing; by default that of its header, which is often wrong.
    layers
        What its layers show.
    gap_m, thickest_wall_m, line_wall_m, smallest_room_m2
        How lines become rooms, see `layoutopt.plans.drawn_rooms.drawn_floor`.
    tolerance_m
        How far a line may be from the curve that it replaces.
    accept_recovered
        Whether a damaged drawing is read as far as ezdxf can recover it.

    Raises
    ------
    InvalidInput
        If the file is no drawing, damaged, too large, has no unit, its layers are not named, or its walls enclose
        no room.
    """
    if not tolerance_m >= _FINEST_M:
        raise InvalidInput.at(
            place, f"the tolerance is {tolerance_m} m", f"Curves need one of at least {_FINEST_M * 1000.0:g} mm."
        )
    content = file_bytes(path, place)
    kind = next((kind for start, kind in _FOREIGN.items() if content.startswith(start)), None)
    if kind is not None:
        raise InvalidInput.at(place, f"{path.name} is {kind}", _EXPORT)
    if not content.lstrip().startswith(_BEGINNINGS):
        raise InvalidInput.at(place, f"{path.name} is no DXF drawing: it begins with {content[:20]!r}", _EXPORT)
    try:
        linework = _linework(path, place, units, tolerance_m, accept_recovered)
    except InvalidInput:
        raise
    except Exception as error:
        # ezdxf raises whatever a damaged entity leads it to, from AttributeError to RecursionError.
        raise InvalidInput.at(place, f"{path.name} cannot be read: {reason_of(error)}", _EXPORT) from error
    with within_bounds(path.name, place):
        return floor_of_linework(
            linework,
            layers,
            gap_m=gap_m,
            thickest_wall_m=thickest_wall_m,
            line_wall_m=line_wall_m,
            smallest_room_m2=smallest_room_m2,
            place=place,
        )


def _linework(path: Path, place: str, units: str | None, tolerance_m: float, accept_recovered: bool) -> Linework:
    drawing, notes = _loaded(path, place, accept_recovered)
    unit, source = (units, "the spec") if units is not None else _unit_of(drawing, path.name, place)
    collector = _Collector(
        name=path.name, place=place, tolerance=tolerance_m / length_unit_m(unit, place), notes=notes
    )
    _refuse_bombs(drawing, path.name, place)
    collector.walk(drawing.modelspace())
    if not collector.lines:
        elsewhere = sum(len(layout) for layout in drawing.layouts if layout.is_any_paperspace)
        raise InvalidInput.at(
            place,
            f"the model space of {path.name} has no lines, only {collector.passed_over_text() or 'empty space'}"
            + (f"; paper space holds {elsewhere} entities" if elsewhere else ""),
            "Draw the walls in the model space, and bind external references.",
        )
    return collector.linework(unit, source, drawing)


def _loaded(path: Path, place: str, accept_recovered: bool) -> tuple["Drawing", list[str]]:
    """Return the drawing, and notes on what was wrong with it if that was accepted."""
    from ezdxf import recover
    from ezdxf.filemanagement import readfile

    with _Messages() as messages:
        notes = []
        try:
            drawing = readfile(path)
            auditor = drawing.audit()
            mended = [(entry.message, _draws(entry)) for entry in auditor.fixes]
            found = [entry.message for entry in auditor.errors] + [message for message, draws in mended if draws]
            others = [message for message, draws in mended if not draws]
            if others:
                notes.append(f"ezdxf mended what draws nothing, in {len(others)} place(s): {_some(others)}")
        except Exception as error:
            drawing, auditor = recover.readfile(path)
            found = [f"it cannot be read as it is: {reason_of(error)}"]
            found += [entry.message for entry in itertools.chain(auditor.errors, auditor.fixes)]
        found += [text for text in messages.texts if "invalid" in text]
    if found and not accept_recovered:
        raise InvalidInput.at(
            place,
            f"{path.name} is damaged: {_some(found).rstrip('.')}",
            "Repair it in the program that wrote it, or write accept_recovered = true to read what is left.",
        )
    if found:
        notes.append(f"repaired {path.name}: {_some(found)}")
    return drawing, notes


def _unit_of(drawing: "Drawing", name: str, place: str) -> tuple[str, str]:
    code = drawing.header.get("$INSUNITS", 0)
    if code in _INSUNITS:
        return _INSUNITS[code], f"$INSUNITS = {code} of the header"
    metric = {0: "inches", 1: "metric"}.get(drawing.header.get("$MEASUREMENT", -1), "neither inches nor metric")
    raise InvalidInput.at(
        place,
        f"the header of {name} names no unit of a building ($INSUNITS = {code}, $MEASUREMENT: {metric})",
        'Write units = "mm", or what the drawing was made in.',
    )


def _refuse_bombs(drawing: "Drawing", name: str, place: str) -> None:
    """Refuse blocks that draw too much before any is taken apart; each block is counted once."""
    of_block: dict[str, int] = {}

    def count(entities: Iterable[Any], depth: int) -> int:
        total = 0
        for entity in entities:
            total += 1
            # Blocks within themselves are refused where they are taken apart.
            if entity.dxftype() == "INSERT" and depth < _DEEPEST_BLOCK:
                key = f"{depth} {entity.dxf.name}"
                if key not in of_block:
                    of_block[key] = count(entity.block() or (), depth + 1)
                total += max(entity.mcount, 1) * of_block[key]
        return total

    _refuse_more(count(drawing.modelspace(), 0), name, place)


def _refuse_more(entity_count: int, name: str, place: str) -> None:
    if entity_count > _MOST_ENTITIES:
        raise InvalidInput.at(
            place,
            f"{name} draws more than {_MOST_ENTITIES:,} entities, those of blocks counted each time",
            "Delete what is not part of the building, and purge the file.",
        )


@dataclass(slots=True)
class _Collector:
    """Walks through entities and gathers their lines by layer, in drawing units."""

    name: str
    place: str
    tolerance: float
    notes: list[str]
    lines: dict[str, list[FloatArray]] = field(default_factory=dict)
    arcs: dict[str, list[FloatArray]] = field(default_factory=dict)
    kinds: dict[str, Counter[str]] = field(default_factory=dict)
    passed_over: Counter[str] = field(default_factory=Counter)
    entity_count: int = 0
    corner_count: int = 0
    highest: float = 0.0

    def walk(self, entities: Iterable[Any]) -> None:
        """Take entities and what they are made of; deeper levels wait on a stack, not in the interpreter's."""
        waiting: list[tuple[Iterator[Any], str]] = [(iter(entities), "")]
        while waiting:
            entity = next(waiting[-1][0], None)
            if entity is None:
                waiting.pop()
                continue
            self._count_entities(1)
            kind = entity.dxftype()
            layer = str(entity.dxf.layer)
            if layer == "0" and waiting[-1][1]:
                layer = waiting[-1][1]
            if kind == "INSERT":
                if len(waiting) > _DEEPEST_BLOCK:
                    raise InvalidInput.at(
                        self.place,
                        f"blocks of {self.name} are nested more than {_DEEPEST_BLOCK} deep, or within themselves",
                        "Explode them in the drawing.",
                    )
                waiting.append((self._parts(entity), layer))
            elif kind in _POLYLINES:
                self._count(layer, kind)
                waiting.append((iter(entity.virtual_entities()), layer))
            elif kind == "LINE":
                self._count(layer, kind)
                self._take(layer, [entity.dxf.start, entity.dxf.end])
            elif kind in _CURVES:
                self._count(layer, kind)
                self._curve(layer, kind, entity)
            else:
                self.passed_over[f"{kind} on {layer}"] += 1

    def linework(self, unit: str, unit_source: str, drawing: "Drawing") -> Linework:
        """Return what was gathered."""
        if self.highest > self.tolerance:
            self.notes.append(f"heights up to {self.highest * LENGTH_UNITS[unit]:.4g} m were dropped")
        hidden = [layer.dxf.name for layer in drawing.layers if layer.is_off() or layer.is_frozen()]
        return Linework(
            name=self.name,
            unit=unit,
            unit_source=unit_source,
            lines=self.lines,
            arcs=self.arcs,
            kinds=self.kinds,
            passed_over=self.passed_over,
            hidden=tuple(hidden),
            notes=tuple(self.notes),
        )

    def passed_over_text(self) -> str:
        """Return in words what was not read."""
        return ", ".join(f"{count} {kind}" for kind, count in self.passed_over.most_common(_MOST_MESSAGES))

    def _parts(self, insert: Any) -> Iterator[Any]:
        block = insert.block()
        if block is None or block.block.is_xref:
            self.passed_over[f"external or missing block {str(insert.dxf.name)[:40]}"] += 1
            return iter(())
        self._count_entities(max(insert.mcount, 1) - 1)
        copies = insert.multi_insert() if insert.mcount > 1 else (insert,)
        return itertools.chain.from_iterable(
            copy.virtual_entities(skipped_entity_callback=self._skipped) for copy in copies
        )

    def _count_entities(self, more: int) -> None:
        self.entity_count += more
        _refuse_more(self.entity_count, self.name, self.place)

    def _skipped(self, entity: Any, _: str) -> None:
        self.passed_over[f"{entity.dxftype()} that could not be placed"] += 1

    def _curve(self, layer: str, kind: str, entity: Any) -> None:
        tolerance = self.tolerance
        if kind in ("ARC", "CIRCLE"):
            radius = abs(float(entity.dxf.radius))
            if radius == 0.0:
                return
            tolerance = min(tolerance, radius / 4.0)
        self._take(layer, entity.flattening(tolerance))
        if kind == "ARC":
            points = [entity.ocs().to_wcs(entity.dxf.center), entity.start_point, entity.end_point]
            self.arcs.setdefault(layer, []).append(np.array([(point.x, point.y) for point in points]))

    def _take(self, layer: str, points: Iterable[Any]) -> None:
        allowed = _MOST_CORNERS - self.corner_count
        corners = np.array([tuple(point) for point in itertools.islice(points, allowed + 1)], dtype=np.float64)
        if len(corners) > allowed:
            raise InvalidInput.at(
                self.place,
                f"the curves of {self.name} need more than {_MOST_CORNERS:,} corners",
                "Check the unit, or raise the tolerance.",
            )
        if len(corners) < 2:
            return
        self.corner_count += len(corners)
        if corners.shape[1] > 2:
            self.highest = max(self.highest, float(np.abs(corners[:, 2]).max()))
        self.lines.setdefault(layer, []).append(corners[:, :2])

    def _count(self, layer: str, kind: str) -> None:
        self.kinds.setdefault(layer, Counter())[kind] += 1


class _Messages(logging.Handler):
    """Gathers what ezdxf logs while a file is read: that is where it tells of numbers that it made up."""

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self.texts: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Keep one message."""
        self.texts.append(record.getMessage())

    def __enter__(self) -> "_Messages":
        """Begin to listen, and keep the messages from the terminal."""
        logger = logging.getLogger("ezdxf")
        self._before = (logger.level, logger.propagate)
        logger.setLevel(logging.INFO)
        logger.propagate = False
        logger.addHandler(self)
        return self

    def __exit__(self, *_: object) -> None:
        """Stop listening."""
        logger = logging.getLogger("ezdxf")
        logger.removeHandler(self)
        logger.level, logger.propagate = self._before


def _draws(entry: Any) -> bool:
    """Return whether what was mended shows; tables and settings of a drawing do not, a missing block does."""
    from ezdxf.audit import AuditError
    from ezdxf.entities.dxfgfx import is_graphic_entity

    if entry.code in (AuditError.UNDEFINED_BLOCK, AuditError.UNDEFINED_BLOCK_NAME):
        return True
    return entry.entity is not None and is_graphic_entity(entry.entity)


def _some(texts: list[str]) -> str:
    return listed([text[:200] for text in texts], _MOST_MESSAGES, "; ")
