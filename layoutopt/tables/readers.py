"""Antennas under the robot, for the people who mount them and the robot that uses them: YAML and URDF."""

import math
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Final

from layoutopt.atomic_file import replacing
from layoutopt.errors import Fault, InvalidInput
from layoutopt.layout import Layout
from layoutopt.parts import module_of_antennas
from layoutopt.tables.cells import KINDS, rounded, shown, text_of
from layoutopt.tables.frames import MAP_FRAME, ROBOT_FRAME

READERS_SCHEMA: Final = 1
_LARGEST_YAML: Final = 5_000_000
_AGAIN: Final = "Take it from the readers.yaml that layoutopt draw wrote."


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


_COLUMNS: Final = tuple(entry.name for entry in fields(AntennaRow))


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
                "frame_id": _link(row),
                **{name: rounded(getattr(row, name)) for name in _COLUMNS},
            }
            for row in antenna_rows(layout)
        ],
    }
    text = yaml.safe_dump(table, sort_keys=False, allow_unicode=True, width=100, line_break="\n")
    with replacing(path) as temporary:
        temporary.write_bytes(text.encode())


def write_readers_urdf(path: Path | str, layout: Layout) -> None:
    """Write a fragment of URDF: for each antenna a link and a fixed joint to ``base_link``.

    It is meant to be included in the description of the robot, which has ``base_link``.
    """
    lines = ['<?xml version="1.0"?>', '<robot name="rfid_antennas">']
    for row in antenna_rows(layout):
        # All that is written are numbers and names of ours, so there is nothing to be escaped.
        place = " ".join(_decimals(value) for value in (row.x_m, row.y_m, row.z_m))
        lines += [
            f'  <link name="{_link(row)}"/>',
            f'  <joint name="rfid_antenna_{row.antenna}_joint" type="fixed">',
            f'    <parent link="{ROBOT_FRAME}"/>',
            f'    <child link="{_link(row)}"/>',
            f'    <origin xyz="{place}" rpy="0 0 {_decimals(row.yaw_rad)}"/>',
            "  </joint>",
        ]
    lines += ["</robot>", ""]
    with replacing(path) as temporary:
        temporary.write_bytes("\n".join(lines).encode())


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
        table = yaml.safe_load(text_of(path, _LARGEST_YAML))
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        problem = f"this is no YAML that can be read ({type(error).__name__})"
        raise InvalidInput.at(name, problem, _AGAIN) from error
    if (
        not isinstance(table, dict)
        or table.get("schema") != READERS_SCHEMA
        or table.get("frame_id") != ROBOT_FRAME
    ):
        needed = f"schema: {READERS_SCHEMA} and frame_id: {ROBOT_FRAME}"
        raise InvalidInput.at(name, "this is no table of readers", f"It begins with {needed}.")
    antennas = table.get("antennas")
    if not isinstance(antennas, list):
        raise InvalidInput.at(f"{name} antennas", "is no list", _AGAIN)
    return tuple(_antenna(entry, f"{name} antennas[{number}]") for number, entry in enumerate(antennas))


def _antenna(entry: object, place: str) -> AntennaRow:
    if not isinstance(entry, dict):
        raise InvalidInput.at(place, "is no table", _AGAIN)
    faults: list[Fault] = []
    values: dict[str, object] = {}
    for column in fields(AntennaRow):
        value = entry.get(column.name)
        if column.type is float and type(value) is int:
            value = float(value)
        if type(value) is not column.type or (isinstance(value, float) and not math.isfinite(value)):
            problem = f"{shown(value)} is no {KINDS[column.type]}"
            faults.append(Fault(place=f"{place} {column.name}", problem=problem, repair=_AGAIN))
        values[column.name] = value
    if faults:
        raise InvalidInput(faults)
    return AntennaRow(**values)  # type: ignore[arg-type]


def _link(row: AntennaRow) -> str:
    return f"rfid_antenna_{row.antenna}_link"


def _decimals(value: float) -> str:
    return f"{rounded(value):.6f}"
