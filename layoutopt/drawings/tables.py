"""Tables for the people who install and use a layout: tag map, reader poses, bill of material.

Tags are given in the frame ``map``, readers in ``base_link``, both after REP-103: metres and radians,
right-handed, x forward and y left on a robot, z up. Numbers have six decimals, rows are in the order of their
identity and lines end in a line feed, so equal layouts give equal bytes. Spreadsheets take a text that begins
like a formula for one; such a text gets an apostrophe in front, which the readers here take away again.
"""

import csv
import io
import math
import re
import reprlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Final

import numpy as np

from layoutopt.atomic_file import replacing
from layoutopt.errors import Fault, InvalidInput
from layoutopt.identity import FloatArray
from layoutopt.layout import Layout, TagMap
from layoutopt.parts import BillOfMaterial, module_of_antennas
from layoutopt.site import Site

READERS_SCHEMA: Final = 1
MAP_FRAME: Final = "map"
ROBOT_FRAME: Final = "base_link"
_LARGEST_TABLE: Final = 500_000_000
_LARGEST_YAML: Final = 5_000_000
_FORMULA: Final = re.compile(r"'*[\t\r\n]|[\s'\u200b\ufeff]*[=+\-@＝＋－＠]")
_WORDS: Final[Mapping[object, str]] = {str: "text", int: "whole number", float: "finite number"}
_BILL_COLUMNS: Final = (
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


@dataclass(frozen=True, slots=True, kw_only=True)
class TagRow:
    """One tag as an installer and a robot need it; the names of the fields are the columns of the table.

    ``tile`` is column and row of the floor tile, such as ``c3r12``, empty without a tiling; ``uid`` is empty
    until the tag is scanned, and ``surveyed_x_m`` and ``surveyed_y_m`` are ``None`` until it is measured.
    """

    tag_id: int
    uid: str
    x_m: float
    y_m: float
    z_m: float
    yaw_rad: float
    type: str
    tile: str
    zone: str
    install_status: str
    surveyed_x_m: float | None
    surveyed_y_m: float | None
    sigma_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class AntennaRow:
    """One antenna under the robot, numbered as readings number it: from 0, through all groups.

    ``module`` counts the reader modules of the robot from 0, ``slot`` the turn in the module's scan cycle.
    """

    antenna: int
    group: str
    kind: str
    side_m: float
    x_m: float
    y_m: float
    z_m: float
    yaw_rad: float
    profile: str
    scan_period_s: float
    tags_per_scan: str
    module: int
    slot: int


TAG_COLUMNS: Final = tuple(entry.name for entry in fields(TagRow))
_ANTENNA_COLUMNS: Final = tuple(entry.name for entry in fields(AntennaRow))


def tag_rows(
    tag_map: TagMap, site: Site, tag_part: str, surveyed_m: FloatArray | None = None
) -> tuple[TagRow, ...]:
    """Return a row for each tag, by rising identity.

    ``surveyed_m``, shape (n, 2), holds measured places in the order of the map, NaN where there is none. Tags
    lie on the floor (z 0) with their longer side along x (yaw 0).
    """
    places_m = np.full((len(tag_map), 2), np.nan) if surveyed_m is None else surveyed_m
    rows = []
    for index in np.argsort(tag_map.ids, kind="stable"):
        zone = int(tag_map.zone[index])
        column, row = (int(number) for number in tag_map.tile[index])
        surveyed_x_m, surveyed_y_m = (None if math.isnan(place) else float(place) for place in places_m[index])
        rows.append(
            TagRow(
                tag_id=int(tag_map.ids[index]),
                uid=tag_map.uid[index] or "",
                x_m=float(tag_map.xy_m[index, 0]),
                y_m=float(tag_map.xy_m[index, 1]),
                z_m=0.0,
                yaw_rad=0.0,
                type=tag_part,
                tile="" if site.tiling is None else f"c{column}r{row}",
                zone="" if zone < 0 else site.zone_names[zone],
                install_status=tag_map.status[index],
                surveyed_x_m=surveyed_x_m,
                surveyed_y_m=surveyed_y_m,
                sigma_m=float(tag_map.sigma_m[index]),
            )
        )
    return tuple(rows)


def antenna_rows(layout: Layout) -> tuple[AntennaRow, ...]:
    """Return a row for each antenna, in the order in which readings count them."""
    rows: list[AntennaRow] = []
    modules = 0
    for group in layout.readers:
        for pose, module, slot in zip(group.poses, module_of_antennas(group), group.slots, strict=True):
            x_m, y_m, z_m, yaw_rad = (float(value) for value in pose)
            rows.append(
                AntennaRow(
                    antenna=len(rows),
                    group=group.name,
                    kind=group.kind,
                    side_m=group.antenna.side_m,
                    x_m=x_m,
                    y_m=y_m,
                    z_m=z_m,
                    yaw_rad=yaw_rad,
                    profile=group.profile.name,
                    scan_period_s=group.profile.scan_period_s,
                    tags_per_scan=group.profile.tags_per_scan,
                    module=modules + module,
                    slot=slot,
                )
            )
        modules += group.module_count
    return tuple(rows)


def write_tags_csv(
    path: Path | str, tag_map: TagMap, site: Site, tag_part: str, surveyed_m: FloatArray | None = None
) -> None:
    """Write the tag map as CSV with a header and no comments; see `TagRow` for the columns."""
    rows = tag_rows(tag_map, site, tag_part, surveyed_m)
    write_csv(path, TAG_COLUMNS, ([_cell(getattr(row, name)) for name in TAG_COLUMNS] for row in rows))


def write_bill_csv(path: Path | str, bill: BillOfMaterial) -> None:
    """Write the bill of material as CSV; the last row holds the total, which is the sum of the rows above."""
    rows = [
        [
            line.scope.value,
            line.item,
            text_cell(line.description),
            _quantity(line.quantity),
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
    write_csv(path, _BILL_COLUMNS, rows)


def write_readers_yaml(path: Path | str, layout: Layout) -> None:
    """Write the poses of all antennas in ``base_link``, with side, profile, module and slot, as YAML."""
    import yaml

    table = {
        "schema": READERS_SCHEMA,
        "layout": layout.key,
        "frame_id": ROBOT_FRAME,
        "tag_frame_id": MAP_FRAME,
        "antennas": [
            {
                "frame_id": f"rfid_antenna_{row.antenna}_link",
                **{name: _rounded(getattr(row, name)) for name in _ANTENNA_COLUMNS},
            }
            for row in antenna_rows(layout)
        ],
    }
    text = yaml.safe_dump(table, sort_keys=False, allow_unicode=True, width=100, line_break="\n")
    with replacing(path) as temporary:
        temporary.write_bytes(text.encode())


def read_tags_csv(path: Path | str) -> tuple[TagRow, ...]:
    """Return the rows of a tag map, by rising identity.

    Raises
    ------
    InvalidInput
        With every fault of the table at once.
    """
    name = str(path)
    lines = list(_csv_lines(path))
    header = lines[0][1] if lines else []
    if tuple(header) != TAG_COLUMNS:
        raise InvalidInput.at(
            f"{name}:1", "the header is not that of a tag map", f"It is {','.join(TAG_COLUMNS)}."
        )
    faults: list[Fault] = []
    rows = []
    seen: dict[int, int] = {}
    for number, cells in lines[1:]:
        place = f"{name}:{number}"
        if len(cells) != len(TAG_COLUMNS):
            problem = f"{len(cells)} cells where {len(TAG_COLUMNS)} are needed"
            faults.append(Fault(place=place, problem=problem))
            continue
        before = len(faults)
        values: dict[str, object] = {}
        for entry, cell in zip(fields(TagRow), cells, strict=True):
            try:
                values[entry.name] = _value(cell, entry.type)
            except ValueError as error:
                faults.append(Fault(place=f"{place} {entry.name}", problem=str(error)))
        if len(faults) > before:
            continue
        row = TagRow(**values)  # type: ignore[arg-type]
        if row.tag_id in seen:
            problem = f"tag {row.tag_id} was already given in line {seen[row.tag_id]}"
            faults.append(Fault(place=place, problem=problem))
        seen[row.tag_id] = number
        rows.append(row)
    if faults:
        raise InvalidInput(faults)
    return tuple(sorted(rows, key=lambda row: row.tag_id))


def read_readers_yaml(path: Path | str) -> tuple[AntennaRow, ...]:
    """Return the antennas of a file that `write_readers_yaml` wrote.

    Raises
    ------
    InvalidInput
        If the file is no such table.
    """
    import yaml

    name = str(path)
    try:
        table = yaml.safe_load(_text_of(path, _LARGEST_YAML))
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise InvalidInput.at(name, f"this is no YAML that can be read ({type(error).__name__})") from error
    if (
        not isinstance(table, dict)
        or table.get("schema") != READERS_SCHEMA
        or table.get("frame_id") != ROBOT_FRAME
    ):
        needed = f"schema: {READERS_SCHEMA} and frame_id: {ROBOT_FRAME}"
        raise InvalidInput.at(name, "this is no table of readers", f"It begins with {needed}.")
    antennas = table.get("antennas")
    if not isinstance(antennas, list):
        raise InvalidInput.at(f"{name} antennas", "is no list")
    return tuple(_antenna(entry, f"{name} antennas[{number}]") for number, entry in enumerate(antennas))


def _antenna(entry: object, place: str) -> AntennaRow:
    if not isinstance(entry, dict):
        raise InvalidInput.at(place, "is no table")
    faults: list[Fault] = []
    values: dict[str, object] = {}
    for column in fields(AntennaRow):
        value = entry.get(column.name)
        if column.type is float and type(value) is int:
            value = float(value)
        if type(value) is not column.type or (isinstance(value, float) and not math.isfinite(value)):
            problem = f"{reprlib.repr(value)} is no {_WORDS[column.type]}"
            faults.append(Fault(place=f"{place} {column.name}", problem=problem))
        values[column.name] = value
    if faults:
        raise InvalidInput(faults)
    return AntennaRow(**values)  # type: ignore[arg-type]


def _value(cell: str, kind: object) -> object:
    """Return a cell of a tag map as what its column holds."""
    if kind is str:
        return _plain(cell)
    if cell == "" and kind not in (int, float):
        return None
    try:
        number = int(cell) if kind is int else float(cell)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ValueError(f"{reprlib.repr(cell)} is no {_WORDS[int if kind is int else float]}")
    return number


def _csv_lines(path: Path | str) -> list[tuple[int, list[str]]]:
    """Return the rows of a CSV file, each with the number of its last line."""
    reader = csv.reader(io.StringIO(_text_of(path, _LARGEST_TABLE), newline=""), strict=True)
    try:
        return [(reader.line_num, cells) for cells in reader if cells]
    except csv.Error as error:
        raise InvalidInput.at(f"{path}:{reader.line_num}", f"this is no CSV: {error}") from error


def _text_of(path: Path | str, largest: int) -> str:
    path = Path(path)
    try:
        if not path.is_file():
            raise InvalidInput.at(str(path), "there is no such file")
        if path.stat().st_size > largest:
            raise InvalidInput.at(str(path), f"the file has over {largest} bytes")
        return path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InvalidInput.at(str(path), f"byte {error.start} is not UTF-8", "Save it as UTF-8 text.") from error
    except (OSError, ValueError) as error:
        raise InvalidInput.at(str(path), f"cannot be read ({error})") from error


def write_csv(path: Path | str, header: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Write a table of finished cells as CSV, all at once; texts of the user's go through `text_cell` first.

    The header is guarded here: a zone's name may stand in it.
    """
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as stream:
        for cells in ([text_cell(name) for name in header], *rows):
            stream.write(",".join(_quoted(cell) for cell in cells) + "\n")


def _quoted(cell: str) -> str:
    # The csv module leaves a carriage return bare where lines end in a line feed alone.
    return '"' + cell.replace('"', '""') + '"' if re.search(r'[,"\r\n]', cell) else cell


def _cell(value: float | str | None) -> str:
    if value is None:
        return ""
    if isinstance(value, str):
        return text_cell(value)
    return str(value) if isinstance(value, int) else f"{_rounded(value):.6f}"


def text_cell(text: str) -> str:
    """Return a text cell that no spreadsheet takes for a formula."""
    return f"'{text}" if _FORMULA.match(text) else text


def _plain(cell: str) -> str:
    """Return the text that `text_cell` made a cell of."""
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell[1:]) else cell


def _rounded(value: float | int | str) -> float | int | str:
    # Adding zero turns -0.0 into 0.0.
    return round(value, 6) + 0.0 if isinstance(value, float) else value


def _quantity(number: float) -> str:
    return f"{number:.0f}" if number == int(number) else f"{number:.4f}"


def _price(price_eur: float) -> str:
    """Return a price with at least two decimals, more where it has parts of a cent."""
    whole, _, decimals = f"{price_eur:.6f}".partition(".")
    return f"{whole}.{decimals.rstrip('0').ljust(2, '0')}"
