"""Floor plans from the occupancy maps of ROS: a YAML file beside a portable grey map (PGM) or a PNG image.

A cell is free where the map server says so, with one exception. Map savers write 205 for *unknown*; ROS 1 pairs
that with ``free_thresh: 0.196``, but nav2 wrote 0.25 until 2025, with which every unknown cell reads as free
(navigation2 pull request 5278, which fixed the saver). An image that holds nothing but the savers' three values
therefore keeps 205 for unknown whatever the threshold, and a note says so.

References
----------
nav2_map_server, ``map_io.cpp``: keys, modes and thresholds. Netpbm, *PGM Format Specification*.
"""

import math
import reprlib
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import yaml

from layoutopt.errors import Fault, InvalidInput, did_you_mean
from layoutopt.identity import BoolArray
from layoutopt.plans.floor import LARGEST_COORDINATE_M, Floor, file_bytes, reason_of
from layoutopt.plans.grey_map import GreyMap, read_grey_map
from layoutopt.plans.outlines import check_cells, floor_of_cells
from layoutopt.plans.png import read_png
from layoutopt.protocols import Card

CARD: Final = Card(
    summary="ROS occupancy map (YAML beside PGM or PNG): cells that the map server calls free become the floor.",
    reference="nav2_map_server, map_io.cpp; Netpbm, PGM Format Specification",
)
_KEYS: Final = ("image", "mode", "resolution", "origin", "negate", "occupied_thresh", "free_thresh")
_LINES: Final = "A map has lines such as 'image: map.pgm', 'resolution: 0.05' and 'origin: [0, 0, 0]'."
_MODES: Final = ("trinary", "scale", "raw")
_LARGEST_YAML_BYTES: Final = 100_000
_UNKNOWN_GREY: Final = 205
_SAVED_GREYS: Final = frozenset({0, _UNKNOWN_GREY, 254})


@dataclass(frozen=True, slots=True, kw_only=True)
class _Settings:
    """What the YAML file says; ``origin`` is x, y and yaw of the image's lower left corner."""

    image: str
    resolution_m: float
    origin: tuple[float, float, float]
    mode: str
    negate: bool
    occupied_threshold: float
    free_threshold: float
    unknown_keys: tuple[str, ...]


def read_occupancy_map(
    path: Path, *, place: str, tolerance_m: float | None = None, smallest_room_m2: float = 0.25
) -> Floor:
    """Return the free space of a ROS map as polygons in the frame ``map``.

    Occupied and unknown cells are no floor. Outlines follow the cells and are then simplified so that no point
    moves by more than ``tolerance_m``; by default one pixel, halved until the area changes by less than 1 %.
    Holes of up to 25 pixels, such as table legs, stay as they are. Parts below ``smallest_room_m2`` are left
    out. Size, tolerance, change of area and what was left out stand in the notes.

    Parameters
    ----------
    path
        The YAML file; the image is looked for beside it.
    place
        Where the path was given, for messages.

    Raises
    ------
    InvalidInput
        If one of the two files cannot be used, the map holds no free part of that area, or the floor's sides
        are not within 0.5 m to 1000 m.
    """
    if tolerance_m is not None and not 0.0 <= tolerance_m < math.inf:
        raise InvalidInput.at(place, f"the tolerance is {tolerance_m} m", "Give zero or a positive length.")
    settings = _read_settings(path, place)
    grey = _image(path.parent / settings.image, f"{place} -> image")
    free, notes = _free_cells(settings, grey, place)
    floor, told = floor_of_cells(
        free,
        settings.resolution_m,
        settings.origin,
        tolerance_m=tolerance_m,
        minimum_area_m2=smallest_room_m2,
        place=place,
    )
    notes = [f"{grey.name}: {grey.width} x {grey.height} pixels of {settings.resolution_m:g} m", *notes, *told]
    if settings.unknown_keys:
        notes.append(f"keys of {path.name} that were not used: {', '.join(settings.unknown_keys)}")
    return Floor(polygon=floor, notes=tuple(notes), source=path.name, pixel_m=settings.resolution_m)


def _image(path: Path, place: str) -> GreyMap:
    if path.suffix.lower() != ".png":
        return read_grey_map(path, place=place)
    picture = read_png(path, place=place)
    if not picture.painted.all():
        raise InvalidInput.at(
            place, f"{path.name} has transparent pixels, of which map servers make different things", "Fill them."
        )
    return GreyMap(name=picture.name, values=picture.lightness, largest=255)


def _read_settings(path: Path, place: str) -> _Settings:
    content = file_bytes(path, place)
    if content.startswith((b"P5", b"P2", b"\x89PNG", b"\xff\xd8", b"BM")):
        raise InvalidInput.at(
            place, f"{path.name} is an image", "Give the map's YAML file, which names the image."
        )
    if len(content) > _LARGEST_YAML_BYTES:
        raise InvalidInput.at(place, f"{path.name} has {len(content)} bytes", "A map's YAML file has a few lines.")
    return _Reader(path.name, place, content).settings()


class _Reader:
    """Reads the keys of a map's YAML file and gathers every fault.

    The file is composed but never constructed: all scalars stay text, so no tag can make an object, and
    ``resolution: 5e-2``, which YAML 1.1 takes for a string, is the number that was meant.
    """

    def __init__(self, name: str, place: str, content: bytes) -> None:
        self._place = f"{place} -> {name}"
        self._faults: list[Fault] = []
        self._nodes: dict[str, yaml.Node] = {}
        try:
            node = yaml.compose(content, Loader=yaml.SafeLoader)
        except (yaml.YAMLError, RecursionError, ValueError) as error:
            raise InvalidInput.at(
                f"{self._place}{_line_of(error)}", f"this is no YAML: {reason_of(error)}", _LINES
            ) from error
        if not isinstance(node, yaml.MappingNode):
            raise InvalidInput.at(self._place, "the file holds no keys", _LINES)
        for key, value in node.value:
            # A key of lists within lists may be written with references: as a text it would have no end.
            name = str(key.value)[:80] if isinstance(key, yaml.ScalarNode) else "a list as a key"
            if name in self._nodes:
                self._fault(name, "the key stands twice", "Drop one of the two.")
            self._nodes[name] = value

    def settings(self) -> _Settings:
        """Return the settings, or raise with all faults."""
        image = self._text("image", None)
        resolution_m = self._number("resolution", None)
        if not 0.0 < resolution_m < math.inf:
            self._fault("resolution", f"{resolution_m} m per pixel", "Give a positive length such as 0.05.")
        mode = self._text("mode", "trinary")
        if mode not in _MODES:
            self._fault("mode", f"{mode[:80]!r} is no mode", did_you_mean(mode[:80], _MODES))
        negate = self._text("negate", "0").lower()
        if negate not in ("0", "1", "false", "true"):
            self._fault("negate", f"{negate[:80]!r} is neither 0 nor 1", "Write negate: 0.")
        if mode == "raw" and negate in ("1", "true"):
            self._fault("negate", "ROS 1 and ROS 2 read a negated raw map differently", "Save it as trinary.")
        occupied, free = self._number("occupied_thresh", 0.65), self._number("free_thresh", 0.25)
        if not 0.0 < free <= occupied <= 1.0:
            self._fault(
                "free_thresh", f"free {free:g} and occupied {occupied:g}", "Needed: 0 < free <= occupied <= 1."
            )
        origin = self._origin()
        if self._faults:
            raise InvalidInput(self._faults)
        return _Settings(
            image=image,
            resolution_m=resolution_m,
            origin=origin,
            mode=mode,
            negate=negate in ("1", "true"),
            occupied_threshold=occupied,
            free_threshold=free,
            unknown_keys=tuple(sorted(repr(name)[1:-1] for name in self._nodes if name not in _KEYS)),
        )

    def _origin(self) -> tuple[float, float, float]:
        node = self._nodes.get("origin")
        values = node.value if isinstance(node, yaml.SequenceNode) else []
        numbers = [_float(item) for item in values]
        if len(numbers) != 3 or not all(abs(number) < LARGEST_COORDINATE_M for number in numbers):
            given = "is missing" if node is None else f"is {_shown(node)}"
            self._fault("origin", f"the origin {given}", "Give [x, y, yaw] of the lower left corner, m and rad.")
            return (0.0, 0.0, 0.0)
        return (numbers[0], numbers[1], numbers[2])

    def _text(self, name: str, default: str | None) -> str:
        node = self._nodes.get(name)
        if isinstance(node, yaml.ScalarNode) and node.value:
            return str(node.value)
        if node is None and default is not None:
            return default
        self._fault(name, "the key is missing" if node is None else f"{_shown(node)} is no text", _LINES)
        return default or ""

    def _number(self, name: str, default: float | None) -> float:
        node = self._nodes.get(name)
        if node is None and default is not None:
            return default
        number = math.nan if node is None else _float(node)
        if math.isnan(number):
            self._fault(name, "the key is missing" if node is None else f"{_shown(node)} is no number", _LINES)
            return 1.0 if default is None else default
        return number

    def _fault(self, name: str, problem: str, repair: str) -> None:
        node = self._nodes.get(name)
        line = "" if node is None else f":{node.start_mark.line + 1}"
        self._faults.append(Fault(place=f"{self._place}{line} {name}", problem=problem, repair=repair))


def _line_of(error: Exception) -> str:
    """Return the line at which YAML gave up, as a place has it; empty if it does not say."""
    mark = getattr(error, "problem_mark", None)
    return "" if mark is None else f":{mark.line + 1}"


def _float(node: yaml.Node) -> float:
    try:
        return float(node.value) if isinstance(node, yaml.ScalarNode) else math.nan
    except ValueError:
        return math.nan


def _shown(node: yaml.Node) -> str:
    value = node.value
    if isinstance(node, yaml.SequenceNode):
        value = [item.value if isinstance(item, yaml.ScalarNode) else "..." for item in value[:6]]
    return reprlib.repr(value) if isinstance(node, yaml.ScalarNode | yaml.SequenceNode) else "a group of keys"


def _free_cells(settings: _Settings, grey: GreyMap, place: str) -> tuple[BoolArray, list[str]]:
    """Return which cells are free, shape (height, width), bottom row first, and what has to be said of them."""
    values = grey.values[::-1]
    shade = np.arange(grey.largest + 1) / grey.largest
    notes = []
    if settings.mode == "raw":
        percent = np.rint(shade * 255.0)
        free_level = percent < 100.0 * settings.free_threshold
        occupied_level = (percent <= 100.0) & (percent > 100.0 * settings.occupied_threshold)
    else:
        occupancy = shade if settings.negate else 1.0 - shade
        free_level = occupancy < settings.free_threshold
        occupied_level = occupancy > settings.occupied_threshold
    counts = np.bincount(values.ravel(), minlength=grey.largest + 1)
    if settings.mode == "trinary" and not settings.negate and grey.largest == 255:
        saved = set(np.flatnonzero(counts).tolist()) <= _SAVED_GREYS
        if saved and counts[_UNKNOWN_GREY] and free_level[_UNKNOWN_GREY]:
            free_level[_UNKNOWN_GREY] = False
            notes.append(
                f"{counts[_UNKNOWN_GREY]} cells of grey {_UNKNOWN_GREY}, which map savers write for unknown, are "
                f"left out although free_thresh = {settings.free_threshold:g} takes them for free"
            )
    free_count, occupied_count = int(counts[free_level].sum()), int(counts[occupied_level].sum())
    if not free_count:
        raise InvalidInput.at(
            place, "the map has no free cell", "Check negate, free_thresh and the mode against the image."
        )
    free = free_level[values]
    check_cells(free, settings.resolution_m, place)
    shares = {
        "free": free_count,
        "occupied": occupied_count,
        "unknown or between": values.size - free_count - occupied_count,
    }
    cell_m2 = settings.resolution_m**2
    notes.append(", ".join(f"{name} {count * cell_m2:.4g} m²" for name, count in shares.items()))
    return free, notes
