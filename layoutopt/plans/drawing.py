"""From the lines of a drawing, by layer, to a floor: what the layers show, where it lies, how large it is."""

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.errors import Fault, InvalidInput, did_you_mean
from layoutopt.identity import FloatArray
from layoutopt.plans.drawn_rooms import DoorSymbol, closed_areas, drawn_floor
from layoutopt.plans.floor import LARGEST_COORDINATE_M, Floor
from layoutopt.plans.placing import LENGTH_UNITS, Layers, listed, on_floor, shift_of, shifted_source, zones_of

_MOST_TOLD: Final = 12
# Words in the names of layers, in the languages in which drawings most often reach us.
_MEANINGS: Final[Mapping[str, re.Pattern[str]]] = {
    "doors": re.compile(r"DOOR|T(UE|Ü)R(EN|$)|PORTE|PUERTA|PORTA", re.IGNORECASE),
    "walls": re.compile(r"WALL|WAND|W(AE|Ä)NDE|MAUER|MUR|PARED|PARETE|WINDOW|GLAZ|FENSTER|FENETRE", re.IGNORECASE),
    "obstacles": re.compile(
        r"FURN|M(OE|Ö)BEL|EQUIP|COLUMN|COLS|PILLAR|ST(UE|Ü)TZE|RACK|SHEL[FV]|REGAL", re.IGNORECASE
    ),
    "metal": re.compile(r"METAL|STEEL|STAHL", re.IGNORECASE),
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Linework:
    """What a drawing holds, in its own unit.

    Attributes
    ----------
    name
        Of the file.
    unit, unit_source
        Unit of length, and who says so.
    lines
        For each layer, lines with their corners, shape (k, 2) each.
    arcs
        For each layer, centre, start and end of every arc, shape (3, 2) each.
    kinds
        For each layer, how many entities of which type.
    passed_over
        Types that were not read, and how many of each.
    hidden
        Layers that are switched off or frozen.
    notes
        What has to be said of the file.
    """

    name: str
    unit: str
    unit_source: str
    lines: Mapping[str, Sequence[FloatArray]]
    arcs: Mapping[str, Sequence[FloatArray]]
    kinds: Mapping[str, Counter[str]]
    passed_over: Counter[str]
    hidden: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def floor_of_linework(
    linework: Linework,
    layers: Layers | None,
    *,
    gap_m: float,
    thickest_wall_m: float,
    line_wall_m: float,
    smallest_room_m2: float,
    place: str,
) -> Floor:
    """Return the floor of a drawing whose layers are named; see `drawn_floor` for the other parameters.

    Raises
    ------
    InvalidInput
        If the layers are not named, with a proposal; if a name is none of the drawing's; if a coordinate is no
        number or far from the others; or if the walls enclose no room.
    """
    if layers is None:
        raise InvalidInput.at(
            place,
            f"it is not stated what the layers of {linework.name} show; {_extents(linework)}; layers with lines: "
            f"{_described(linework)}",
            f'Write plan = {{ file = "{linework.name}", layers = {{ {_proposal(linework)} }} }}.',
        )
    chosen = _chosen(layers, linework, place)
    _refuse_unusable(linework, chosen, place)
    unit_m = LENGTH_UNITS[linework.unit]
    used = [line for names in chosen.values() for name in names for line in linework.lines[name]]
    shift_m = shift_of(np.concatenate(used) * unit_m)
    segments_m = {kind: _segments(linework, names, unit_m, shift_m) for kind, names in chosen.items()}
    # A stray entity far off would put everything else beyond the range of exact geometry.
    reach_m = max((float(np.abs(lines).max()) for lines in segments_m.values() if len(lines)), default=0.0)
    if reach_m >= LARGEST_COORDINATE_M:
        raise InvalidInput.at(
            place,
            f"the lines of {linework.name} lie {reach_m / 1000.0:.4g} km apart",
            "Check units, and delete what lies far from the building.",
        )
    notes = [_extents(linework), *linework.notes]
    drawn = drawn_floor(
        segments_m["walls"],
        _doors(linework, chosen["doors"], unit_m, shift_m),
        gap_m=gap_m,
        thickest_wall_m=thickest_wall_m,
        line_wall_m=line_wall_m,
        smallest_room_m2=smallest_room_m2,
        place=place,
    )
    notes += drawn.notes
    areas = {
        kind: closed_areas(segments_m[kind], f"layers.{kind}", place, notes)
        for kind in ("obstacles", "no_tags", "metal")
    }
    obstacles = on_floor(areas["obstacles"], drawn.polygon, notes)
    zones = zones_of({kind: areas[kind] for kind in ("no_tags", "metal")}, drawn.polygon, notes)
    notes += _left_out(linework, chosen)
    source = shifted_source(linework.name, shift_m, notes)
    return Floor(
        polygon=drawn.polygon,
        obstacles=obstacles,
        zones=zones,
        rooms=drawn.rooms,
        notes=tuple(notes),
        source=source,
    )


def _chosen(layers: Layers, linework: Linework, place: str) -> dict[str, list[str]]:
    """Return for each kind the layers with lines that the drawing knows by the given names, in any case."""
    # The case of letters does not count in DXF, so entities of one layer may write it in several ways.
    known: dict[str, list[str]] = {}
    for name in linework.lines:
        known.setdefault(name.casefold(), []).append(name)
    chosen: dict[str, list[str]] = {}
    faults: list[Fault] = []
    taken: dict[str, str] = {}
    for kind in ("walls", "doors", "obstacles", "no_tags", "metal"):
        chosen[kind] = []
        for name in getattr(layers, kind):
            key = name.casefold()
            if key not in known:
                problem = f"{linework.name} has no lines on a layer '{name}', named for {kind}"
                faults.append(Fault(place=place, problem=problem, repair=did_you_mean(name, linework.lines)))
            elif key in taken:
                problem = f"layer '{name}' is named for {taken[key]} and for {kind}"
                faults.append(Fault(place=place, problem=problem, repair="Name it once."))
            else:
                taken[key] = kind
                chosen[kind] += known[key]
    if faults:
        raise InvalidInput(faults)
    return chosen


def _refuse_unusable(linework: Linework, chosen: Mapping[str, Sequence[str]], place: str) -> None:
    for names in chosen.values():
        for name in names:
            wrong = sum(int((~np.isfinite(line)).any()) for line in linework.lines[name])
            if wrong:
                raise InvalidInput.at(
                    place,
                    f"{wrong} entities on layer '{name}' have coordinates that are no numbers",
                    "Delete them.",
                )


def _segments(linework: Linework, names: Sequence[str], unit_m: float, shift_m: FloatArray) -> FloatArray:
    pieces = [np.stack([line[:-1], line[1:]], axis=1) for name in names for line in linework.lines[name]]
    if not pieces:
        return np.empty((0, 2, 2))
    return np.asarray(np.concatenate(pieces) * unit_m - shift_m)


def _doors(linework: Linework, names: Sequence[str], unit_m: float, shift_m: FloatArray) -> list[DoorSymbol]:
    doors = []
    for arc in (arc for name in names for arc in linework.arcs.get(name, ())):
        hinge, start, end = (tuple(point) for point in (arc * unit_m - shift_m).tolist())
        doors.append(DoorSymbol(hinge_m=hinge, ends_m=(start, end)))
    return doors


def _extents(linework: Linework) -> str:
    """Return in words how large the drawing is, in the unit that was taken."""
    corners = np.concatenate([line for lines in linework.lines.values() for line in lines])
    corners = corners[np.isfinite(corners).all(axis=1)] * LENGTH_UNITS[linework.unit]
    if not len(corners):
        return "its lines have no finite coordinates"
    width_m, height_m = np.ptp(corners, axis=0)
    source = f"{linework.unit}, from {linework.unit_source}"
    return f"{linework.name} measures {width_m:.2f} m x {height_m:.2f} m, drawn in {source}"


def _described(linework: Linework) -> str:
    """Return the layers with lines in words, those with most lines first."""
    unit_m = LENGTH_UNITS[linework.unit]
    length_m = {
        name: sum(float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum()) for line in lines) * unit_m
        for name, lines in linework.lines.items()
    }
    names = sorted(length_m, key=lambda name: (-length_m[name] if math.isfinite(length_m[name]) else 0.0, name))
    texts = [
        f"{name} ({', '.join(f'{count} {kind}' for kind, count in linework.kinds[name].most_common())}, "
        f"{length_m[name]:.4g} m)"
        for name in names
    ]
    return listed(texts, _MOST_TOLD)


def _proposal(linework: Linework) -> str:
    """Return the layers by what their names seem to mean, as a spec would write them."""
    found: dict[str, list[str]] = {"walls": []}
    for name in sorted(linework.lines):
        meaning = next((kind for kind, words in _MEANINGS.items() if words.search(name)), None)
        if meaning is not None:
            found.setdefault(meaning, []).append(name)
    if not found["walls"]:
        found["walls"] = ["NAME OF THE LAYER WITH THE WALLS"]
    return ", ".join(f"{kind} = [{', '.join(_quoted(name) for name in names)}]" for kind, names in found.items())


def _quoted(name: str) -> str:
    return f"'{name}'" if "'" not in name else '"' + name.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _left_out(linework: Linework, chosen: Mapping[str, Sequence[str]]) -> list[str]:
    named = {name for names in chosen.values() for name in names}
    notes = []
    others = sorted(set(linework.lines) - named)
    if others:
        notes.append(f"layers that were left out: {listed(others, _MOST_TOLD)}")
    if linework.passed_over:
        texts = [f"{count} {kind}" for kind, count in linework.passed_over.most_common()]
        notes.append(f"passed over, since only lines and curves are read: {listed(texts, _MOST_TOLD)}")
    dark = {name.casefold() for name in linework.hidden}
    if hidden := sorted(name for name in named if name.casefold() in dark):
        notes.append(f"layers that are read although they are switched off or frozen: {', '.join(hidden)}")
    return notes
