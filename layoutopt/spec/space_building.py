"""From ``[space]`` to the `layoutopt.space.DesignSpace`, with every option built and checked once."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from layoutopt import feasibility
from layoutopt.errors import did_you_mean
from layoutopt.feasibility import LARGEST_MULTIPLEXER_PORTS
from layoutopt.layout import WHOLE_FLOOR, FloorTags, Layout, ReaderGroup, ReaderProfile, TagPattern, ZonePattern
from layoutopt.protocols import AntennaModel, Mount
from layoutopt.readers.mounting import MountBuilder
from layoutopt.robot import Robot
from layoutopt.scenario import Role, Scenario
from layoutopt.site import Site
from layoutopt.space import DesignSpace, Family, Interval, Values, size_of, values_of
from layoutopt.spec.antenna_building import antenna_model, disc_notes, heights_read
from layoutopt.spec.findings import Findings
from layoutopt.spec.lines import KeyPath, written
from layoutopt.spec.options import MAXIMUM_OPTIONS, Entry, Parameter, axis, build_all, entries
from layoutopt.spec.quantities import in_si
from layoutopt.spec.schema import SpaceTable
from layoutopt.units import format_length

MAXIMUM_LAYOUTS: Final = 10_000_000
"""Most combinations of readers and patterns that a spec may ask for."""
MAXIMUM_TAGS: Final = 5_000_000
_SMALLEST_SIDE_M: Final = 0.005
_LARGEST_SIDE_M: Final = 1.0
_DEFAULT_RING_M: Final = 0.25
_SPACE: Final = ("space",)


@dataclass(slots=True)
class SpaceBuilder:
    """Builds the design space of one spec; what it left out is told in ``notes``.

    ``site`` and ``robot`` are ``None`` where they have faults of their own; checks that need them wait.
    """

    table: SpaceTable
    profile: ReaderProfile
    tag_part: str
    tag_size_m: tuple[float, float]
    site: Site | None
    robot: Robot | None
    findings: Findings
    notes: list[str] = field(default_factory=list)

    def space(self) -> DesignSpace | None:
        """Return the design space, ``None`` after a fault."""
        before = self.findings.count
        mounts = self._mounts()
        readers = entries(self._listed_readers(mounts), "readers", (*_SPACE, "readers"), self.findings)
        patterns = entries(self.table.patterns, "patterns", (*_SPACE, "patterns"), self.findings)
        if self._too_large(readers, patterns, 1 if mounts is None else mounts.size):
            return None
        pattern_families = self._pattern_families(patterns)
        reader_families = () if mounts is None else self._reader_families(readers, mounts)
        if self.findings.count > before:
            return None
        x_m, y_m = (in_si(value, "length") for value in self.table.origin)
        return DesignSpace(
            readers=reader_families,
            patterns=pattern_families,
            tag_part=self.tag_part,
            tag_size_m=self.tag_size_m,
            placement_sigma_m=in_si(self.table.placement_sigma, "length"),
            origin_m=(x_m, y_m),
        )

    def _mounts(self) -> Family[Mount] | None:
        """Return the ways to build the antennas: sides by heights by antennas a module; ``None`` after a fault."""
        findings, before = self.findings, self.findings.count
        lengths = [
            axis(getattr(self.table, word), _parameter(word, "length"), (*_SPACE, word), findings)
            for word in ("antenna_side", "antenna_height")
        ]
        ports = axis(
            self.table.antennas_per_module,
            _parameter("antennas_per_module", None),
            (*_SPACE, "antennas_per_module"),
            findings,
        )
        for number in () if ports is None else values_of(ports):
            if not 1 <= number <= LARGEST_MULTIPLEXER_PORTS:
                findings.add(
                    (*_SPACE, "antennas_per_module"),
                    f"no multiplexer drives {number} antennas",
                    f"Choose from 1 to {LARGEST_MULTIPLEXER_PORTS}.",
                )
        sides_m, heights_m = lengths
        for side_m in () if sides_m is None else values_of(sides_m):
            if not _SMALLEST_SIDE_M <= side_m <= _LARGEST_SIDE_M:
                findings.add(
                    (*_SPACE, "antenna_side"),
                    f"an antenna side of {format_length(side_m)} is out of reason",
                    "Choose from 25 to 80 mm, for which antennas are calibrated.",
                )
        for height_m in () if heights_m is None else values_of(heights_m):
            if not 0.0 <= height_m <= _LARGEST_SIDE_M:
                findings.add(
                    (*_SPACE, "antenna_height"),
                    f"an antenna height of {format_length(height_m)} is out of reason",
                    "HF antennas hang 5 to 60 mm above the floor.",
                )
        if sides_m is None or heights_m is None or ports is None or findings.count > before:
            return None
        size = size_of(sides_m) * size_of(heights_m) * size_of(ports)
        if size > MAXIMUM_OPTIONS:
            findings.add(
                (*_SPACE, "antenna_side"),
                f"with heights and antennas a module these are {size} ways to build an antenna",
                f"List at most {MAXIMUM_OPTIONS}.",
            )
            return None
        model = antenna_model(self.table.antenna, (*_SPACE, "antenna"), findings)
        antennas = () if model is None else self._antennas(model, values_of(sides_m))
        if model is None or not antennas:
            return None
        heights = values_of(heights_m)
        if not any(antenna.read_radius_m(height_m) > 0.0 for antenna in antennas for height_m in heights):
            findings.add(
                (*_SPACE, "antenna_height"),
                "no antenna of the list reads the floor from there",
                f"Choose other heights or antennas: {heights_read(antennas)}.",
            )
            return None
        self.notes += disc_notes(antennas, heights)
        return Family(
            name="mount",
            build=MountBuilder(antenna=antennas[0], profile=self.profile),
            values={"side_m": sides_m, "height_m": heights_m, "antennas_per_module": ports},
        )

    def _listed_readers(self, mounts: Family[Mount] | None) -> list[dict[str, Any]]:
        """Return the reader entries of the spec; without any, rings as wide as the robot allows, and half that.

        The widest ring for the largest antenna and that for the smallest are both there.
        """
        if self.table.readers is not None:
            return self.table.readers
        room_m = _DEFAULT_RING_M if self.robot is None else self.robot.inner_radius_m
        sides_m = [0.0] if mounts is None else values_of(mounts.values["side_m"])
        # Whole centimetres; an antenna that does not fit even so is refused like any other.
        widest = [
            max(math.floor((room_m - side_m * math.sqrt(0.5)) * 100.0), 4) / 100.0
            for side_m in (min(sides_m), max(sides_m))
        ]
        counts, radii_m = [3, 4, 6, 8], sorted({*widest, widest[0] / 2.0}, reverse=True)
        self.notes.append(
            f"no readers listed: rings of {', '.join(map(str, counts))} antennas, "
            f"radius {' and '.join(format_length(value) for value in radii_m)}"
        )
        return [{"family": "ring", "count": counts, "radius": radii_m}]

    def _antennas(self, model: Callable[..., Any], sides_m: Sequence[float]) -> list[AntennaModel]:
        """Return the antenna of each side; none after a fault."""
        try:
            antennas = [model(side_m=side_m) for side_m in sides_m]
        except (ValueError, TypeError) as error:
            self.findings.add(
                (*_SPACE, "antenna"),
                f"the antenna cannot be made: {error}",
                "Compare with the model's parameters.",
            )
            return []
        beyond = [format_length(antenna.side_m) for antenna in antennas if antenna.extrapolated]
        if beyond:
            self.notes.append(f"the antenna model extrapolates for sides of {', '.join(beyond)}")
        return antennas

    def _too_large(self, readers: Sequence[Entry], patterns: Sequence[Entry], mounts: int) -> bool:
        """Note an axis or a space that is too large, before anything of it is built."""
        before = self.findings.count
        zones: dict[str, int] = {}
        for entry in patterns:
            zones[entry.zone] = zones.get(entry.zone, 0) + entry.size
        sizes = {"readers": sum(entry.size for entry in readers) * max(mounts, 1), **zones}
        for name, size in sizes.items():
            if size > MAXIMUM_OPTIONS:
                key = "readers" if name == "readers" else "patterns"
                where = f" for zone '{name}'" if key == "patterns" and name else ""
                self.findings.add(
                    (*_SPACE, key), f"these are {size} options{where}", f"List at most {MAXIMUM_OPTIONS}."
                )
        total = math.prod(sizes.values())
        if total > MAXIMUM_LAYOUTS:
            product = " × ".join(str(size) for size in sizes.values())
            self.findings.add(
                _SPACE,
                f"the design space has {total} layouts ({product})",
                f"At most {MAXIMUM_LAYOUTS} can be searched: drop values that you would not build.",
            )
        return self.findings.count > before

    def _pattern_families(self, found: Sequence[Entry]) -> dict[str, tuple[Family[TagPattern], ...]]:
        zones: dict[str, tuple[Family[TagPattern], ...]] = {}
        keys: dict[str, dict[str, Entry]] = {}
        for entry in sorted(found, key=lambda entry: entry.zone != WHOLE_FLOOR):
            self._zone_fits(entry)
            built = build_all(entry, self.findings)
            self._once(entry, [pattern.key for _, pattern in built or ()], keys.setdefault(entry.zone, {}))
            for arguments, pattern in built or ():
                culprit = next((word for word in ("pitch", "points") if f"{word}_m" in arguments), None)
                path = (*entry.path, culprit) if culprit else entry.path
                check_pattern(pattern, path, self.tag_part, self.tag_size_m, self.site, self.findings)
            family = Family(name=entry.name, build=entry.build, values=entry.values)
            zones[entry.zone] = (*zones.get(entry.zone, ()), family)
        return zones

    def _once(self, entry: Entry, keys: Sequence[str], known: dict[str, Entry]) -> None:
        """Note an entry with an option that stands in the list already: it would race against itself."""
        for key in keys:
            if key in known:
                earlier = "it twice" if known[key] is entry else f"an option of {written(known[key].path)} again"
                self.findings.add(entry.path, f"this entry has {earlier}", "Keep one of the two.")
                return
            known[key] = entry

    def _zone_fits(self, entry: Entry) -> None:
        if self.site is None or entry.zone == WHOLE_FLOOR:
            return
        path = (*entry.path, "zone")
        if entry.zone not in self.site.zone_names:
            self.findings.add(path, "the site has no such zone", did_you_mean(entry.zone, self.site.zone_names))
        elif rule := self.site.zone(entry.zone).rule_against(self.tag_part):
            self.findings.add(
                path,
                f"no tags of the part '{self.tag_part}' may be laid in this zone ({rule})",
                "Drop the pattern, or the zone's rule, or lay another part (parts.tag).",
            )

    def _reader_families(self, found: Sequence[Entry], mounts: Family[Mount]) -> tuple[Family[ReaderGroup], ...]:
        families: list[Family[ReaderGroup]] = []
        left_out, unshared = 0, set[int]()
        all_ports = values_of(mounts.values["antennas_per_module"])
        keys: dict[str, Entry] = {}
        smallest = min(mounts.options(), key=lambda mount: mount.antenna.side_m)
        plain = Mount(antenna=smallest.antenna, height_m=smallest.height_m, profile=self.profile)
        for entry in found:
            built = build_all(entry, self.findings, mount=plain)
            if built is None:
                continue
            self._once(entry, [group.key for _, group in built], keys)
            self._fits_under_robot(entry, [group for _, group in built])
            made = _by_mounts(entry, [(arguments, group.count) for arguments, group in built], mounts)
            kept = sum(family.size for family in made)
            left_out += entry.size * mounts.size - kept
            counts = {group.count for _, group in built if group.count < max(all_ports)}
            unshared |= {count for count in counts if count > 1 and count not in all_ports}
            if not made:
                self.findings.add(
                    entry.path,
                    "every value of antennas_per_module is larger than the number of antennas",
                    "Add a smaller antennas_per_module, such as 1.",
                )
            families += made
        if left_out:
            listed = sum(entry.size for entry in found) * mounts.size
            way_out = "".join(
                f"; list antennas_per_module = {count} to let {count} antennas share a module"
                for count in sorted(unshared)
            )
            self.notes.append(
                f"left out {left_out} of {listed} reader options with more antennas a module than in all{way_out}"
            )
        return tuple(families)

    def _fits_under_robot(self, entry: Entry, groups: Sequence[ReaderGroup]) -> None:
        """Note an entry of which no option fits under the robot even with the smallest antenna."""
        if self.site is None or self.robot is None:
            return
        scenario = Scenario(name="check", role=Role.DESIGN, site=self.site, robot=self.robot)
        tags = FloorTags(
            zones=(ZonePattern(zone=WHOLE_FLOOR, pattern=TagPattern(name="one", points_m=np.zeros((1, 2)))),)
        )
        least_m = math.inf
        for group in groups:
            layout = Layout(floor_tags=tags, readers=(group,))
            beyond_m = [
                violation.shortfall_m
                for violation in feasibility.check(layout, scenario)
                if violation.rule == "robot outline"
            ]
            if not beyond_m:
                return
            least_m = min(least_m, *beyond_m)
        self.findings.add(
            entry.path,
            f"no option of '{entry.name}' fits under the robot: the nearest reaches {format_length(least_m)} "
            "beyond robots.outline",
            "Use fewer or closer antennas, or correct the outline.",
        )


def check_pattern(
    pattern: TagPattern,
    path: KeyPath,
    tag_part: str,
    tag_size_m: tuple[float, float],
    site: Site | None,
    findings: Findings,
) -> None:
    """Note a pattern whose tags would overlap, or of which the floor would take absurdly many."""
    spacing_m, need_m = pattern.minimum_spacing_m(), max(tag_size_m)
    tags = pattern.density_per_m2 * site.open_floor.area if site is not None else 0.0
    if spacing_m < need_m - 1e-9:
        findings.add(
            path,
            f"tags would be {format_length(spacing_m)} apart, but a '{tag_part}' is {format_length(need_m)} long",
            f"Start at {format_length(need_m)} or more.",
        )
    elif tags > MAXIMUM_TAGS:
        findings.add(
            path,
            f"the floor would take {tags:.3g} tags, more than {MAXIMUM_TAGS:.3g}",
            "Use a wider pitch, or check the unit of the floor.",
        )


def _by_mounts(
    entry: Entry, counts: Sequence[tuple[dict[str, Any], int]], mounts: Family[Mount]
) -> list[Family[ReaderGroup]]:
    """Return families in which no module has more ports than the group has antennas.

    Combinations that may have the same mounts stay one family where they are a full product of values, and
    become a family each where they are not. No interval changes a count, so intervals stay as they are.
    """
    made: list[Family[ReaderGroup]] = []
    all_ports = values_of(mounts.values["antennas_per_module"])
    listed = [name for name, values in entry.values.items() if isinstance(values, tuple)]
    allowed = {count: tuple(ports for ports in all_ports if ports <= count) for _, count in counts}
    for ports in dict.fromkeys(allowed.values()):
        if not ports:
            continue
        members = {
            tuple(arguments[name] for name in listed): arguments
            for arguments, count in counts
            if allowed[count] == ports
        }.values()
        values = {name: tuple(dict.fromkeys(one[name] for one in members)) for name in listed}
        whole = math.prod(len(options) for options in values.values()) == len(members)
        products = [values] if whole else [{name: (one[name],) for name in listed} for one in members]
        made += [
            Family(
                name=entry.name,
                build=entry.build,
                values={
                    **{name: product.get(name, values) for name, values in entry.values.items()},
                    "mount": _mount_values(mounts, ports),
                },
            )
            for product in products
        ]
    return made


def _mount_values(mounts: Family[Mount], ports: tuple[int, ...]) -> Values:
    """Return the mounts with these antennas a module: a list of them, or a family where an interval is free."""
    some = replace(mounts, values={**mounts.values, "antennas_per_module": ports})
    free = any(isinstance(values, Interval) for values in some.values.values())
    return some if free else values_of(some)


def _parameter(word: str, dimension: Any) -> Parameter:
    kind = "number" if dimension else "whole"
    return Parameter(name=word, word=word, dimension=dimension, kind=kind, required=True, default=None)
