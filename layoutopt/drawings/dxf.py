"""Sheets as DXF: views 1:1 in model space, the sheet as a paper-space layout with viewports at exact scale.

Model space holds real millimetres. The first view keeps its own coordinates; each further view is moved along
x by whole metres, so that views do not cover each other. `model_offsets` returns these shifts, and the document
carries them as custom properties (``OFFSET_2`` = name, dx, dy). Marks become blocks: the attribute of a block
holds the identity, its insertion point less the offset of the view is the place. CAD programs list both.
"""

import math
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from layoutopt.atomic_file import replacing
from layoutopt.drawings.layers import PENS
from layoutopt.drawings.sheet import Circle, Entity, Line, Marks, Polyline, Sheet, Text, extent
from layoutopt.drawings.symbols import SYMBOLS, Point, SymbolName
from layoutopt.drawings.text_boxes import base_line

if TYPE_CHECKING:
    from ezdxf.document import Drawing
    from ezdxf.entities.dxfentity import DXFEntity
    from ezdxf.entities.insert import Insert
    from ezdxf.layouts.base import BaseLayout

_STYLE = "LETTERS"
_WINDOWS = "A-WINDOWS"
_METRE_MM = 1000.0
_SOMEWHERE = (0.123456789, 0.987654321)  # place and identity of the model of all marks, found again in its text
_SOMETHING = "identity-of-the-mark"


def render_dxf(sheet: Sheet, path: str | os.PathLike[str]) -> None:
    """Write the sheet to ``path`` as DXF R2010 in millimetres.

    Raises
    ------
    OSError
        If the file cannot be written; what was there before stays.
    """
    from ezdxf import units
    from ezdxf.filemanagement import new

    with replacing(path) as temporary, _without_dates():
        document = new("R2010", units=units.MM)
        document.header["$PSLTSCALE"] = 1  # dashes are millimetres on paper in every viewport
        document.header["$LTSCALE"] = 1.0
        document.header.custom_vars.append("TITLE", _escaped(sheet.title))
        _add_layers(document)
        _add_blocks(document, sheet)
        layout = document.paperspace()
        document.layouts.rename(layout.name, f"Sheet {sheet.paper}")
        layout.page_setup(size=sheet.size_mm, margins=(0, 0, 0, 0), units="mm", scale=(1, 1))
        model = document.modelspace()
        shifts = model_offsets(sheet)
        for number, (view, shift) in enumerate(zip(sheet.views, shifts, strict=True), start=1):
            note = f"{_escaped(view.name)}, {shift[0]:.0f}, {shift[1]:.0f}"
            document.header.custom_vars.append(f"OFFSET_{number}", note)
            _add_entities(model, view.entities, shift, view.scale)
            middle = view.in_world(view.window_mm.centre)
            if number == 1:  # what CAD programs show when the file is opened
                document.set_modelspace_vport(view.window_mm.height * view.scale, middle)
            layout.add_viewport(
                center=view.window_mm.centre,
                size=(view.window_mm.width, view.window_mm.height),
                view_center_point=(middle[0] + shift[0], middle[1] + shift[1]),
                view_height=view.window_mm.height * view.scale,
                status=number + 1,  # 1 is the layout itself
                dxfattribs={"layer": _WINDOWS},
            )
        _add_entities(layout, sheet.entities, (0.0, 0.0), 1)
        # The writer would register these classes in the order of a set, which changes from run to run.
        for kind in sorted(document.entitydb.dxf_types_in_use()):
            document.classes.add_class(kind)
        document.saveas(temporary)


def model_offsets(sheet: Sheet) -> tuple[Point, ...]:
    """Return the shift of each view in model space, mm: none for the first, whole metres along x for others."""
    shifts: list[Point] = []
    free_from = 0.0
    for view in sheet.views:
        lower, upper = view.in_world(view.window_mm[:2]), view.in_world(view.window_mm[2:])
        left, right = lower[0], upper[0]
        if any(not isinstance(entity, Text) for entity in view.entities):
            box = extent(view.entities, view.scale)
            left, right = min(left, box.xmin), max(right, box.xmax)
        shift = math.ceil((free_from - left) / _METRE_MM) * _METRE_MM if shifts else 0.0
        shifts.append((shift, 0.0))
        free_from = right + shift + _METRE_MM
    return tuple(shifts)


@contextmanager
def _without_dates() -> Iterator[None]:
    """Keep dates and random identifiers out of the file, so that equal sheets give equal bytes."""
    from ezdxf._options import options

    before = options.write_fixed_meta_data_for_testing
    options.write_fixed_meta_data_for_testing = True
    try:
        yield
    finally:
        options.write_fixed_meta_data_for_testing = before


def _rgb(colour: str) -> tuple[int, int, int]:
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def _add_layers(document: "Drawing") -> None:
    document.styles.add(_STYLE, font="arial.ttf")
    for name, pen in PENS.items():
        line_type = "Continuous"
        if pen.dash_mm:
            line_type = f"{name}-LINE"
            signs = [length if place % 2 == 0 else -length for place, length in enumerate(pen.dash_mm)]
            document.linetypes.add(line_type, pattern=[sum(pen.dash_mm), *signs])
        layer = document.layers.add(name, color=7, linetype=line_type, lineweight=round(pen.width_mm * 100))
        if _rgb(pen.colour) != (0, 0, 0):  # colour 7 is black on white and white on black screens
            layer.rgb = _rgb(pen.colour)
    document.layers.add(_WINDOWS, plot=False)


def _block_name(kind: str, symbol: SymbolName) -> str:
    return f"{kind}_{symbol}".upper()


def _add_blocks(document: "Drawing", sheet: Sheet) -> None:
    """Define one block of unit size per kind and symbol; on layer 0 it takes the pen of the layer it is put on."""
    everything = [*sheet.entities, *(entity for view in sheet.views for entity in view.entities)]
    for entity in everything:
        if not isinstance(entity, Marks) or _block_name(entity.kind, entity.symbol) in document.blocks:
            continue
        block = document.blocks.new(_block_name(entity.kind, entity.symbol))
        symbol = SYMBOLS[entity.symbol]
        for polygon in symbol.polygons:
            block.add_hatch(color=256).paths.add_polyline_path(polygon, is_closed=True)
        for centre, radius in symbol.discs:
            block.add_hatch(color=256).paths.add_polyline_path(_round(centre, radius), is_closed=True)
        for line in symbol.lines:
            block.add_lwpolyline(line)
        for outline in symbol.outlines:
            block.add_lwpolyline(outline, close=True)
        for centre, radius in symbol.circles:
            block.add_circle(centre, radius)
        tag = _attribute_name(entity.kind)
        block.add_attdef(tag, (0.5, 0.5), height=0.5, dxfattribs={"flags": 1, "prompt": tag, "style": _STYLE})


def _attribute_name(kind: str) -> str:
    """Return the attribute of a mark; CAD programs know only capitals."""
    return f"{kind}_id".upper()


def _round(centre: Point, radius: float) -> list[tuple[float, float, float]]:
    """Return a circle as two half circles (x, y, bulge)."""
    return [(centre[0] - radius, centre[1], 1.0), (centre[0] + radius, centre[1], 1.0)]


def _add_entities(layout: "BaseLayout", entities: Sequence[Entity], shift: Point, scale: int) -> None:
    """Add fills first, since later entities cover earlier ones, then layer by layer as the other formats do."""
    for entity in entities:
        if isinstance(entity, Polyline | Circle) and entity.fill is not None:
            hatch = layout.add_hatch(color=7, dxfattribs={"layer": entity.layer})
            hatch.rgb = _rgb(entity.fill)
            if isinstance(entity, Circle):
                centre = (entity.centre_mm[0] + shift[0], entity.centre_mm[1] + shift[1])
                hatch.paths.add_polyline_path(_round(centre, entity.radius_mm), is_closed=True)
            else:
                hatch.paths.add_polyline_path((entity.points_mm + shift).tolist(), is_closed=True)
    for layer in PENS:
        for entity in entities:
            if entity.layer == layer:
                _add_entity(layout, entity, shift, scale)


def _add_entity(layout: "BaseLayout", entity: Entity, shift: Point, scale: int) -> None:
    attributes = {"layer": entity.layer}
    if isinstance(entity, Line):
        ends = np.array([entity.start_mm, entity.end_mm]) + shift
        layout.add_line(ends[0].tolist(), ends[1].tolist(), dxfattribs=attributes)
    elif isinstance(entity, Polyline):
        corners = (entity.points_mm + shift).tolist()
        layout.add_lwpolyline(corners, close=entity.closed, dxfattribs=attributes)
    elif isinstance(entity, Circle):
        centre = (entity.centre_mm[0] + shift[0], entity.centre_mm[1] + shift[1])
        layout.add_circle(centre, entity.radius_mm, dxfattribs=attributes)
    elif isinstance(entity, Marks):
        _add_marks(layout, entity, shift, scale)
    elif entity.text.strip():
        _add_text(layout, entity, shift, scale)


def _add_marks(layout: "BaseLayout", marks: Marks, shift: Point, scale: int) -> None:
    """Add one block reference for each mark.

    ezdxf takes about 0.2 ms for each of them. So it makes one as a model, and all are written as the text of
    that one with their own place, identity and handles, which is some forty times as fast.
    """
    places = marks.points_mm + shift
    if not len(places):
        return
    size = marks.drawn_size_mm(scale)
    look = {"layer": marks.layer, "xscale": size, "yscale": size, "zscale": size}
    model = layout.add_blockref(_block_name(marks.kind, marks.symbol), _SOMEWHERE, dxfattribs=look)
    if marks.ids is not None:
        hidden = {"layer": marks.layer, "height": size / 2, "flags": 1, "style": _STYLE}
        model.add_attrib(_attribute_name(marks.kind), _SOMETHING, _SOMEWHERE, dxfattribs=hidden)
    values = [str(value) for value in places.ravel().tolist()]
    ids = [""] * len(places) if marks.ids is None else [_escaped(identity) for identity in marks.ids]
    layout.entity_space.add(_copies(model, list(zip(values[::2], values[1::2], ids, strict=True))))
    layout.delete_entity(model)


def _copies(model: "Insert", marks: Sequence[tuple[str, str, str]]) -> "DXFEntity":
    """Return an entity that is written as a copy of ``model`` for each x, y and identity."""
    import io

    from ezdxf.entities.dxfentity import DXFEntity
    from ezdxf.lldxf.tagwriter import AbstractTagWriter, TagWriter

    assert model.doc is not None
    stream = io.StringIO()
    model.export_dxf(TagWriter(stream, dxfversion=model.doc.dxfversion))
    lines = stream.getvalue().splitlines()
    parts = [model, *model.attribs, *([model.seqend] if model.attribs and model.seqend else [])]
    handles = {part.dxf.handle: f"{{handles[{number}]}}" for number, part in enumerate(parts)}
    places = {str(_SOMEWHERE[0]): "{x}", str(_SOMEWHERE[1]): "{y}"}
    pattern = ""
    for code, value in zip(lines[::2], lines[1::2], strict=True):
        kind = int(code)
        changing = handles if kind in (5, 330) else places if 10 <= kind < 30 else {_SOMETHING: "{identity}"}
        pattern += f"{code}\n{changing.get(value, value)}\n"
    following = model.doc.entitydb.handles.next
    text = "".join(
        pattern.format(x=x, y=y, identity=identity, handles=[following() for _ in parts])
        for x, y, identity in marks
    )

    class Copies(DXFEntity):
        DXFTYPE = model.DXFTYPE

        def export_dxf(self, tagwriter: AbstractTagWriter) -> None:
            tagwriter.write_str(text)

    return Copies()


def _add_text(layout: "BaseLayout", text: Text, shift: Point, scale: int) -> None:
    from ezdxf.enums import TextEntityAlignment

    start, share = base_line(text, scale)
    alignment = {
        0.0: TextEntityAlignment.LEFT,
        0.5: TextEntityAlignment.CENTER,
        1.0: TextEntityAlignment.RIGHT,
    }[share]
    entity = layout.add_text(
        _escaped(text.text),
        height=text.height_mm * scale,
        rotation=text.angle_deg,
        dxfattribs={"layer": text.layer, "style": _STYLE},
    )
    entity.set_placement((start[0] + shift[0], start[1] + shift[1]), align=alignment)


def _escaped(text: str) -> str:
    """Return ``text`` so that CAD programs show it as it is: DXF has codes that begin with %%, ^ and U+."""
    # A backslash first: the codes put in below have backslashes of their own.
    for code in ("U+", "M+"):
        text = text.replace(f"\\{code}", f"\\U+005C{code}")
    return text.replace("^", "^ ").replace("%%", "%%%%%%")
