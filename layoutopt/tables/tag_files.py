"""Three files of one tag map, written in one pass from the same rows: CSV, YAML and JSON.

CSV is for spreadsheets, YAML for ROS, JSON for programs. YAML and JSON begin with what the numbers mean: frame,
units, datum, and which layout on which site they are of. Their rows are the same text, because JSON is YAML. The
JSON schema lies beside this file, `tags.schema.json`.
"""

import json
import math
import re
import reprlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import asdict, dataclass, fields
from functools import lru_cache
from pathlib import Path
from typing import Final, TextIO, get_args

import orjson

from layoutopt import __version__
from layoutopt.atomic_file import replacing
from layoutopt.errors import Fault, InvalidInput
from layoutopt.layout import Layout
from layoutopt.site import Site
from layoutopt.tables.cells import KINDS, csv_lines, plain_cell, quoted, shown, text_cell, text_of
from layoutopt.tables.frames import MAP_FRAME
from layoutopt.tables.tags import TAG_COLUMNS, TagRow

TAGS_SCHEMA: Final = 1
_LARGEST_TABLE: Final = 500_000_000
_LARGEST_YAML: Final = 5_000_000
_READ_CSV: Final = "Give the CSV of the same map."
_AS_WRITTEN: Final = "Take the value from the tag map that layoutopt draw wrote."
_ASTRAL: Final = re.compile(r"\\ud([89ab]..)\\ud([c-f]..)")
# 0x7f and what is not ASCII: partly no character of YAML, so written as an escape.
_NEEDS_ESCAPE: Final = re.compile(r"[^\x20-\x7e]")


@dataclass(frozen=True, slots=True, kw_only=True)
class TagHeader:
    """What the numbers of a tag map mean.

    Attributes
    ----------
    frame_id
        Frame of all places, ``map``, whose origin is that of the plan.
    datum_x_m, datum_y_m, datum
        The point from which the installer measures, in that frame and in words.
    site, plan, site_key, layout_key
        Name and content key of what the map belongs to, and where the plan came from.
    """

    schema: int = TAGS_SCHEMA
    frame_id: str = MAP_FRAME
    length_unit: str = "m"
    angle_unit: str = "rad"
    datum_x_m: float
    datum_y_m: float
    datum: str
    site: str
    plan: str
    site_key: str
    layout_key: str
    tag_count: int
    generator: str = f"layoutopt {__version__}"


def tag_header(layout: Layout, site: Site, tag_count: int) -> TagHeader:
    """Return the header of a layout's tag map on a site."""
    x_m, y_m = site.datum_m
    return TagHeader(
        datum_x_m=round(x_m, 6) + 0.0,
        datum_y_m=round(y_m, 6) + 0.0,
        datum="lower left corner of the box around the floor",
        site=site.name,
        plan=site.source,
        site_key=site.key,
        layout_key=layout.key,
        tag_count=tag_count,
    )


def write_tag_files(folder: Path, header: TagHeader, rows: Iterable[TagRow]) -> tuple[Path, Path, Path]:
    """Write ``tags.csv``, ``tags.yaml`` and ``tags.json`` into a folder; all of them, or none is replaced.

    Rows are taken one by one, so that a million tags need no more memory than one.

    Raises
    ------
    ValueError
        If there are not as many rows as the header says.
    """
    paths = folder / "tags.csv", folder / "tags.yaml", folder / "tags.json"
    with ExitStack() as stack:
        as_csv, as_yaml, as_json = (
            stack.enter_context(stack.enter_context(replacing(path)).open("w", encoding="utf-8", newline="\n"))
            for path in paths
        )
        _begin(header, as_csv, as_yaml, as_json)
        count = 0
        for count, row in enumerate(rows, start=1):
            as_csv.write(_csv_row(row))
            text = _json_row(row)
            as_json.write(f"    {text}" if count == 1 else f",\n    {text}")
            as_yaml.write(f"- {_yaml_text(text)}\n")
        as_json.write("\n  ]\n}\n" if count else "]\n}\n")
        if not count:
            as_yaml.write("[]\n")
        if count != header.tag_count:
            raise ValueError(f"the header says {header.tag_count} tags, and {count} came")
    return paths


def write_tags_csv(path: Path, rows: Iterable[TagRow]) -> None:
    """Write the rows of a tag map as CSV alone, such as those of a part of it."""
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as stream:
        stream.write(",".join(TAG_COLUMNS) + "\n")
        stream.writelines(_csv_row(row) for row in rows)


def read_tag_file(path: Path | str) -> tuple[TagRow, ...]:
    """Return the rows of a tag map by rising identity; the ending says whether it is CSV, YAML or JSON.

    Raises
    ------
    InvalidInput
        With every fault of the table at once.
    """
    reader = {".csv": _csv_values, ".json": _json_values, ".yaml": _yaml_values, ".yml": _yaml_values}.get(
        Path(path).suffix.lower()
    )
    if reader is None:
        raise InvalidInput.at(str(path), "is no tag map by its name", "It ends in .csv, .yaml or .json.")
    faults: list[Fault] = []
    rows: list[TagRow] = []
    seen: dict[int, str] = {}
    for place, values in reader(path, faults):
        row = TagRow(**values)  # type: ignore[arg-type]
        if row.tag_id in seen:
            problem = f"tag {row.tag_id} was already given at {seen[row.tag_id]}"
            faults.append(Fault(place=place, problem=problem, repair="Keep one of the two."))
        seen[row.tag_id] = place
        rows.append(row)
    if faults:
        raise InvalidInput(faults)
    return tuple(sorted(rows, key=lambda row: row.tag_id))


def _begin(header: TagHeader, as_csv: TextIO, as_yaml: TextIO, as_json: TextIO) -> None:
    as_csv.write(",".join(TAG_COLUMNS) + "\n")
    entries = [(name, json.dumps(value)) for name, value in asdict(header).items()]
    as_json.write("{\n" + "".join(f'  "{name}": {value},\n' for name, value in entries) + '  "tags": [')
    if header.tag_count:
        as_json.write("\n")
    as_yaml.write("".join(f"{name}: {_yaml_text(value)}\n" for name, value in entries))
    as_yaml.write("tags:\n" if header.tag_count else "tags: ")


def _csv_row(row: TagRow) -> str:
    surveyed = ",".join(
        "" if place_m is None else f"{place_m:.6f}" for place_m in (row.surveyed_x_m, row.surveyed_y_m)
    )
    return (
        f"{row.tag_id},{_text(row.uid or '')},{row.x_m:.6f},{row.y_m:.6f},{row.z_m:.6f},{row.yaw_rad:.6f},"
        f"{_text(row.type)},{_text(row.tile)},{_text(row.zone)},{_text(row.install_status)},{surveyed},"
        f"{row.sigma_m:.6f}\n"
    )


@lru_cache(maxsize=65_536)
def _text(text: str) -> str:
    return quoted(text_cell(text))


def _json_row(row: TagRow) -> str:
    return orjson.dumps(row).decode()


def _yaml_text(text: str) -> str:
    """Return JSON text as YAML, which has no pairs of surrogates and fewer characters."""
    if not _NEEDS_ESCAPE.search(text) and "\\ud" not in text:
        return text
    return _ASTRAL.sub(_astral, _NEEDS_ESCAPE.sub(lambda match: json.dumps(match[0])[1:-1], text))


def _astral(match: re.Match[str]) -> str:
    high, low = int("d" + match[1], 16), int("d" + match[2], 16)
    return f"\\U{0x10000 + ((high - 0xD800) << 10) + (low - 0xDC00):08x}"


Values = Iterator[tuple[str, dict[str, object]]]
"""Place of each row that can be used, and its values by column."""


def _csv_values(path: Path | str, faults: list[Fault]) -> Values:
    lines = csv_lines(path, _LARGEST_TABLE)
    header = lines[0][1] if lines else []
    if tuple(header) != TAG_COLUMNS:
        needed = f"It is {','.join(TAG_COLUMNS)}."
        raise InvalidInput.at(f"{path}:1", "the header is not that of a tag map", needed)
    for number, cells in lines[1:]:
        place = f"{path}:{number}"
        if len(cells) != len(TAG_COLUMNS):
            problem = f"{len(cells)} cells where {len(TAG_COLUMNS)} are needed"
            faults.append(Fault(place=place, problem=problem, repair="Check the commas."))
            continue
        values, wrong = {}, []
        for entry, cell in zip(fields(TagRow), cells, strict=True):
            value = _of_cell(cell, entry.type)
            if value is _WRONG:
                problem = f"{reprlib.repr(cell)} is no {_words(entry.type)}"
                wrong.append(Fault(place=f"{place} {entry.name}", problem=problem, repair=_AS_WRITTEN))
            values[entry.name] = value
        faults += wrong
        if not wrong:
            yield place, values


def _json_values(path: Path | str, faults: list[Fault]) -> Values:
    try:
        table = orjson.loads(text_of(path, _LARGEST_TABLE))
    except orjson.JSONDecodeError as error:
        raise InvalidInput.at(f"{path}:{error.lineno}", f"this is no JSON: {error.msg}", _READ_CSV) from error
    return _table_values(path, table, faults)


def _yaml_values(path: Path | str, faults: list[Fault]) -> Values:
    import yaml

    try:
        table = yaml.safe_load(text_of(path, _LARGEST_YAML, _READ_CSV))
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        problem = f"this is no YAML that can be read ({type(error).__name__})"
        raise InvalidInput.at(str(path), problem, _READ_CSV) from error
    return _table_values(path, table, faults)


def _table_values(path: Path | str, table: object, faults: list[Fault]) -> Values:
    if (
        not isinstance(table, dict)
        or table.get("schema") != TAGS_SCHEMA
        or table.get("frame_id") != MAP_FRAME
        or not isinstance(table.get("tags"), list)
    ):
        needed = f"It has schema: {TAGS_SCHEMA}, frame_id: {MAP_FRAME} and a list of tags."
        raise InvalidInput.at(str(path), "this is no tag map", needed)
    for number, entry in enumerate(table["tags"]):
        place = f"{path} tags[{number}]"
        if not isinstance(entry, Mapping) or entry.keys() != set(TAG_COLUMNS):
            needed = f"It has {', '.join(TAG_COLUMNS)}."
            faults.append(Fault(place=place, problem="this is no tag", repair=needed))
            continue
        values = {column.name: _of_value(entry[column.name], column.type) for column in fields(TagRow)}
        wrong = [
            Fault(
                place=f"{place} {column.name}",
                problem=f"{shown(entry[column.name])} is no {_words(column.type)}",
                repair=_AS_WRITTEN,
            )
            for column in fields(TagRow)
            if values[column.name] is _WRONG
        ]
        faults += wrong
        if not wrong:
            yield place, values


def _of_cell(cell: str, kind: object) -> object:
    """Return a cell as what its column holds, or `_WRONG`."""
    needed, may_be_empty = _kind(kind)
    if cell == "" and may_be_empty:
        return None
    if needed is str:
        return plain_cell(cell)
    try:
        return _of_value(int(cell) if needed is int else float(cell), kind)
    except ValueError:
        return _WRONG


def _of_value(value: object, kind: object) -> object:
    """Return a value as what its column holds, or `_WRONG`."""
    needed, may_be_empty = _kind(kind)
    if value is None and may_be_empty:
        return None
    if needed is float and type(value) is int:
        value = float(value)
    return value if type(value) is needed and (needed is not float or math.isfinite(value)) else _WRONG  # type: ignore[arg-type]


_WRONG: Final = object()


def _kind(kind: object) -> tuple[object, bool]:
    """Return the type of a column's values, and whether there may be none."""
    parts = get_args(kind)
    return (parts[0], True) if parts else (kind, False)


def _words(kind: object) -> str:
    return KINDS[_kind(kind)[0]]
