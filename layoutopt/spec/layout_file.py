"""Layout files: a spec that stands alone, with a ``[layout]`` table for one layout of it.

The table names families and their parameters where these rebuild the layout bit by bit, and lists coordinates
where they do not. A short table written by hand works as well::

    [layout.readers]
    family = "cross"
    count = 8
    antenna_side = "60 mm"
    antenna_height = "24 mm"

    [[layout.tags]]
    family = "square"
    pitch = "100 mm"
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from layoutopt import registry
from layoutopt.errors import InvalidInput, did_you_mean
from layoutopt.layout import (
    WHOLE_FLOOR,
    EditKind,
    FloorTags,
    Layout,
    ReaderGroup,
    TagEdit,
    TagPattern,
    Transponder,
    ZonePattern,
)
from layoutopt.prices import TAG_ITEMS
from layoutopt.protocols import Mount
from layoutopt.spec.antenna_building import antenna_model
from layoutopt.spec.building import Spec
from layoutopt.spec.findings import Findings
from layoutopt.spec.installed_table import installed_of, installed_table
from layoutopt.spec.layout_schema import (
    EditTable,
    LaidTagsTable,
    LayoutTable,
    MountedReadersTable,
    TransponderTable,
)
from layoutopt.spec.lines import KeyPath
from layoutopt.spec.options import Entry, entry_of
from layoutopt.spec.quantities import in_si, point_in_m
from layoutopt.spec.reading import profile_of, spec_of
from layoutopt.spec.source import read_source
from layoutopt.spec.space_building import check_pattern
from layoutopt.spec.validation import validated
from layoutopt.spec.writing import antenna_table, document_of, parameter_table, profile_table, write_document
from layoutopt.spec.written_numbers import as_written

_TAG_KEYS = ("zone", "origin", "angle", "exact")
_READER_KEYS = ("antenna", "antenna_side", "antenna_height", "antennas_per_module", "reader_profile", "exact")
_QUICK_LOOK: Final = """\
# QUICK LOOK, NOT FOR INSTALLATION: a quick look at few layouts and drives chose this layout.
# Drawings and files made of it say so too, because of the line quick_look = true under [layout].
# If you have validated the layout yourself, remove that line and this comment.
"""
"""What stands at the top of a layout file that a quick look wrote."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FiledLayout:
    """What a layout file holds.

    Attributes
    ----------
    spec, layout
        The question and one layout of its space.
    quick_look
        Whether a quick look chose the layout, so that nobody should install it as it is.
    """

    spec: Spec
    layout: Layout
    quick_look: bool


def read_layout(path: str | os.PathLike[str]) -> tuple[Spec, Layout]:
    """Return the spec and the layout in a file; `read_filed_layout` also tells whether a quick look chose it.

    Raises
    ------
    InvalidInput
        With every fault of the spec, or of the layout; also if the layout is not the one whose key it carries.
    """
    file = read_filed_layout(path)
    return file.spec, file.layout


def read_filed_layout(path: str | os.PathLike[str]) -> FiledLayout:
    """Return everything that a layout file says.

    Raises
    ------
    InvalidInput
        As `read_layout`.
    """
    source = read_source(path)
    spec = spec_of(source)
    findings = Findings(str(source.path), source.text, source.document)
    if "layout" not in source.document:
        findings.add((), "the file has no [layout]", "Name a layout file, as a study writes to layouts/KEY.toml.")
    layout = _layout_of(source.document.get("layout", {}), spec, findings) if not findings.count else None
    findings.raise_any()
    if layout is None:
        raise InvalidInput.at(
            findings.file, "the layout cannot be read", "Write [layout.readers] and [[layout.tags]]."
        )
    return FiledLayout(spec=spec, layout=layout, quick_look=source.document["layout"].get("quick_look", False))


def write_layout(layout: Layout, spec: Spec, path: str | os.PathLike[str], *, quick_look: bool = False) -> None:
    """Write a layout with the frozen copy of its spec.

    Parameters
    ----------
    quick_look
        Whether a quick look chose the layout. The file then says so, to people and to those who draw it; the key
        of the layout stays the same.

    Raises
    ------
    InvalidInput
        If the layout could not be read back as it is, or the file would be too large.
    """
    table = {**({"quick_look": True} if quick_look else {}), **_layout_table(layout)}
    document = {**document_of(spec), "layout": table}
    findings = Findings(os.fspath(path), "", document)
    again = _layout_of({name: value for name, value in table.items() if name != "key"}, spec, findings)
    findings.raise_any()
    if again is None or again.key != layout.key:
        raise InvalidInput.at(
            os.fspath(path), f"layout {layout.short_key} would not read back as it is", "Build it from a family."
        )
    write_document(document, path, comment=_QUICK_LOOK if quick_look else "")


def _layout_of(given: Any, spec: Spec, findings: Findings) -> Layout | None:
    table = validated(LayoutTable, given, ("layout",), findings)
    if table is None:
        return None
    part = table.tag or spec.space.tag_part
    if part not in TAG_ITEMS:
        findings.add(("layout", "tag"), "no tag of that name in any price list", did_you_mean(part, TAG_ITEMS))
        return None
    size_m = spec.space.tag_size_m if part == spec.space.tag_part else spec.prices.items[part].size_m or (0.0, 0.0)
    if table.tag_size is not None:
        size_m = (in_si(table.tag_size[0], "length"), in_si(table.tag_size[1], "length"))
    sigma_m = (
        spec.space.placement_sigma_m if table.placement_sigma is None else in_si(table.placement_sigma, "length")
    )
    builder = _LayoutReader(spec, part, size_m, findings)
    zones = [builder.zone_pattern(entry, ("layout", "tags", number)) for number, entry in enumerate(table.tags)]
    groups = [
        builder.group(
            entry, ("layout", "readers", number) if isinstance(given["readers"], list) else ("layout", "readers")
        )
        for number, entry in enumerate(table.readers)
    ]
    edits = _edits(table.edits, findings)
    path = ("layout", "installed")
    installed = None if table.installed is None else installed_of(table.installed, path, findings)
    if findings.count:
        return None
    try:
        floor_tags = FloorTags(
            zones=tuple(zone for zone in zones if zone is not None),
            edits=edits,
            tag_part=part,
            tag_size_m=size_m,
            placement_sigma_m=sigma_m,
            installed=installed,
        )
        if edits:
            floor_tags.lay_on(spec.site)
    except ValueError as error:
        findings.add(
            ("layout", "edits" if edits else "tags"), str(error), "One pattern a zone; edits where tags lie."
        )
        return None
    layout = Layout(
        floor_tags=floor_tags,
        readers=tuple(group for group in groups if group is not None),
        transponders=tuple(_transponder(entry) for entry in table.transponders),
        target_tags=table.target_tags,
    )
    if table.key is not None and table.key != layout.key:
        findings.add(
            ("layout", "key"),
            f"the layout was changed since it was written: its key is now {layout.key[:10]}...",
            "Remove the key if the change is meant.",
        )
        return None
    return layout


class _LayoutReader:
    """Reads patterns and reader groups of one layout, in the light of its spec."""

    def __init__(self, spec: Spec, tag_part: str, tag_size_m: tuple[float, float], findings: Findings) -> None:
        self.spec = spec
        self.tag_part = tag_part
        self.tag_size_m = tag_size_m
        self.findings = findings

    def zone_pattern(self, given: Mapping[str, Any], path: KeyPath) -> ZonePattern | None:
        """Return a pattern on a zone, ``None`` after a fault."""
        table = validated(LaidTagsTable, given, path, self.findings)
        if table is None:
            return None
        site = self.spec.site
        if table.zone != WHOLE_FLOOR and table.zone not in site.zone_names:
            self.findings.add(
                (*path, "zone"), "the site has no such zone", did_you_mean(table.zone, site.zone_names)
            )
        pattern: TagPattern | None
        if table.exact is not None:
            exact = table.exact
            try:
                pattern = TagPattern(
                    name=exact.name,
                    points_m=np.array([point_in_m(point) for point in exact.points]).reshape(-1, 2),
                    cell_m=None if exact.cell is None else np.array([point_in_m(row) for row in exact.cell]),
                    parameters=exact.parameters,
                )
            except ValueError as error:
                self.findings.add((*path, "exact"), str(error), "Copy the table from a written layout.")
                return None
        else:
            pattern = self._built(given, "patterns", path, _TAG_KEYS)
        if pattern is None:
            return None
        check_pattern(pattern, path, self.tag_part, self.tag_size_m, site, self.findings)
        return ZonePattern(
            zone=table.zone,
            pattern=pattern,
            origin_m=point_in_m(table.origin),
            angle_rad=in_si(table.angle, "angle"),
        )

    def group(self, given: Mapping[str, Any], path: KeyPath) -> ReaderGroup | None:
        """Return a reader group, ``None`` after a fault."""
        table = validated(MountedReadersTable, given, path, self.findings)
        if table is None:
            return None
        kind = "tag_read" if table.exact is None else table.exact.kind
        model = antenna_model(table.antenna, (*path, "antenna"), self.findings, kind)
        if model is None:
            return None
        try:
            antenna = model(side_m=in_si(table.antenna_side, "length"))
        except (ValueError, TypeError) as error:
            self.findings.add(
                (*path, "antenna"), f"the antenna cannot be made: {error}", "Compare with the model."
            )
            return None
        profile = self.spec.reader_profile if table.reader_profile is None else profile_of(table.reader_profile)
        height_m = in_si(table.antenna_height, "length")
        if table.exact is None:
            mount = Mount(
                antenna=antenna, height_m=height_m, profile=profile, antennas_per_module=table.antennas_per_module
            )
            built: ReaderGroup | None = self._built(given, "readers", path, _READER_KEYS, mount=mount)
            return built
        exact = table.exact
        try:
            return ReaderGroup(
                name=exact.name,
                poses=np.array(exact.poses),
                antenna=antenna,
                profile=profile,
                slots=tuple(exact.slots),
                antennas_per_module=table.antennas_per_module,
                kind=exact.kind,
                parameters=exact.parameters,
            )
        except ValueError as error:
            self.findings.add((*path, "exact"), str(error), "Copy the table from a written layout.")
            return None

    def _built(
        self, given: Mapping[str, Any], point: str, path: KeyPath, own: tuple[str, ...], **fixed: Any
    ) -> Any:  # a pattern or a group, as the table has it
        entry = entry_of(given, point, path, self.findings, own)
        if entry is None:
            return None
        if entry.size != 1:
            self.findings.add(path, "a layout takes one value of each parameter", "Give one value, not a list.")
            return None
        return self._called(entry, fixed)

    def _called(self, entry: Entry, fixed: Mapping[str, Any]) -> Any:
        try:
            return entry.build(**next(entry.combinations()), **fixed)
        except ValueError as error:
            self.findings.add(entry.path, f"'{entry.name}': {error}", "Change that value.")
            return None


def _transponder(table: TransponderTable) -> Transponder:
    x_m, y_m, z_m = (in_si(value, "length") for value in table.position)
    return Transponder(name=table.name, position_m=(x_m, y_m, z_m))


def _edits(tables: list[EditTable], findings: Findings) -> tuple[TagEdit, ...]:
    edits = []
    for number, table in enumerate(tables):
        to_m = None if table.target is None else point_in_m(table.target)
        try:
            edits.append(TagEdit(kind=EditKind(table.kind), from_m=point_in_m(table.source), to_m=to_m))
        except ValueError as error:
            findings.add(("layout", "edits", number), str(error), "Write to = [x, y] beside it.")
    return tuple(edits)


def _layout_table(layout: Layout) -> dict[str, Any]:
    tags = layout.floor_tags
    table: dict[str, Any] = {
        "key": layout.key,
        "tag": tags.tag_part,
        "tag_size": [as_written(value, "length") for value in tags.tag_size_m],
        "placement_sigma": as_written(tags.placement_sigma_m, "length"),
        "readers": [_group_table(group) for group in layout.readers],
        "tags": [_zone_table(entry) for entry in tags.zones],
    }
    if layout.transponders:
        table["transponders"] = [
            {"name": transponder.name, "position": list(transponder.position_m)}
            for transponder in layout.transponders
        ]
    if layout.target_tags:
        table["target_tags"] = layout.target_tags
    if tags.installed is not None:
        table["installed"] = installed_table(tags.installed)
    if tags.edits:
        table["edits"] = [
            {"kind": edit.kind.value, "from": list(edit.from_m), **({"to": list(edit.to_m)} if edit.to_m else {})}
            for edit in tags.edits
        ]
    return table


def _zone_table(entry: ZonePattern) -> dict[str, Any]:
    pattern = entry.pattern
    place = {
        "zone": entry.zone,
        "origin": [float(value) for value in entry.origin_m],
        "angle": as_written(entry.angle_rad, "angle"),
    }
    again = _rebuilt("patterns", pattern.name, pattern.parameters, {})
    if again is not None and again.key == pattern.key:
        return {"family": pattern.name, **parameter_table(pattern.parameters), **place}
    exact: dict[str, Any] = {"name": pattern.name, "points": pattern.points_m.tolist()}
    if pattern.cell_m is not None:
        exact["cell"] = pattern.cell_m.tolist()
    return {**place, "exact": {**exact, "parameters": dict(pattern.parameters)}}


def _group_table(group: ReaderGroup) -> dict[str, Any]:
    height_m = float(group.poses[0, 2])
    place = {
        "antenna": antenna_table(group.antenna),
        "antenna_side": as_written(group.antenna.side_m, "length"),
        "antenna_height": as_written(height_m, "length"),
        "antennas_per_module": group.antennas_per_module,
        "reader_profile": profile_table(group.profile),
    }
    mount = Mount(
        antenna=group.antenna,
        height_m=height_m,
        profile=group.profile,
        antennas_per_module=group.antennas_per_module,
    )
    again = _rebuilt("readers", group.name, group.parameters, {"mount": mount})
    if again is not None and again.key == group.key:
        return {"family": group.name, **parameter_table(group.parameters), **place}
    exact = {
        "name": group.name,
        "poses": group.poses.tolist(),
        "slots": list(group.slots),
        "kind": group.kind,
        "parameters": dict(group.parameters),
    }
    return {**place, "exact": exact}


def _rebuilt(point: str, name: str, parameters: Mapping[str, Any], fixed: Mapping[str, Any]) -> Any:
    """Return what a family makes of the parameters, ``None`` if there is no such family or it refuses."""
    if name not in registry.names(point):
        return None
    try:
        return registry.load(point, name)(**parameters, **fixed)
    except (TypeError, ValueError):
        return None
