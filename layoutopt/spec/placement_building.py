"""From ``[placement]`` to the question of the study of single tags, with what does not fit together noted."""

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from layoutopt.errors import did_you_mean
from layoutopt.geometry import covers
from layoutopt.identity import FloatArray
from layoutopt.layout import WHOLE_FLOOR
from layoutopt.site import Site
from layoutopt.space import DesignSpace
from layoutopt.spec.building import PlacementDemand, PlacementSettings
from layoutopt.spec.findings import Findings
from layoutopt.spec.lines import KeyPath
from layoutopt.spec.quantities import in_si, point_in_m
from layoutopt.spec.schema import DemandTable, PlacementTable

LARGEST_SLOTS: Final = 200_000
"""Slots of a grid over the floor's bounds; more are a wrong unit, and no search ends on them."""
_PLACEMENT: Final = ("placement",)


def placement_of(
    table: PlacementTable, written: frozenset[str], site: Site, space: DesignSpace, findings: Findings
) -> PlacementSettings | None:
    """Return the question of single tags, ``None`` after a fault; ``written`` are the keys that the file has."""
    before = findings.count
    demands = tuple(_demand(demand, number, site, space, findings) for number, demand in enumerate(table.demand))
    listed_m = () if isinstance(table.slots, str) else _points(table.slots)
    installed_m = _points(table.installed)
    _slots_fit(table, written, listed_m, site, space, findings)
    _installed_fit(installed_m, site, space, findings)
    _goals_fit(table, findings)
    _stages_fit(table, demands, site, findings)
    options = sum(family.size for family in space.readers)
    if table.reader is not None and table.reader > options:
        findings.add(
            (*_PLACEMENT, "reader"),
            f"the space has {options} reader options, counted from 1",
            f"Write a number from 1 to {options}.",
        )
    if findings.count > before:
        return None
    return PlacementSettings(
        slots=table.slots if isinstance(table.slots, str) else "listed",
        listed_m=listed_m,
        pitch_m=in_si(table.pitch, "length"),
        demands=demands,
        spacing_m=in_si(table.spacing, "length"),
        tags_per_tile=table.tags_per_tile,
        installed_m=installed_m,
        forbidden_m=_points(table.forbidden),
        required_m=_points(table.required),
        unserved_share=in_si(table.unserved, "share"),
        aim=table.aim,
        budget_eur=None if table.budget is None else in_si(table.budget, "price"),
        stages=tuple(tuple(stage) for stage in table.stages),
        reader=table.reader,
    )


def too_many_slots(site: Site, pitch_m: float) -> tuple[str, str] | None:
    """Return in words why a grid has too many slots to be searched, and what to do; ``None`` if it has not."""
    xmin, ymin, xmax, ymax = site.bounds_m
    slots = (xmax - xmin) * (ymax - ymin) / pitch_m**2
    if slots <= LARGEST_SLOTS:
        return None
    least_m = math.sqrt((xmax - xmin) * (ymax - ymin) / LARGEST_SLOTS)
    return (
        f"that makes about {slots:.3g} slots, and at most {LARGEST_SLOTS} can be searched",
        f"Write {math.ceil(least_m * 1000.0)} mm or more.",
    )


def _demand(
    table: DemandTable, number: int, site: Site, space: DesignSpace, findings: Findings
) -> PlacementDemand:
    path = (*_PLACEMENT, "demand", number)
    if table.zone != WHOLE_FLOOR:
        _known_zone(table.zone, (*path, "zone"), site, findings)
    if table.without is None:
        without = tuple(zone.name for zone in site.zones if zone.rule_against(space.tag_part))
    else:
        without = tuple(table.without)
        for place, name in enumerate(without):
            _known_zone(name, (*path, "without", place), site, findings)
    if table.zone != WHOLE_FLOOR and table.zone in without:
        rule = "without names it" if table.without is not None else "no tag may lie there, so it is left out"
        findings.add(
            (*path, "zone"),
            f"nothing is left to demand in zone '{table.zone}': {rule}",
            "Name another zone, or write without = [].",
        )
    return PlacementDemand(
        zone=table.zone,
        length_m=in_si(table.length, "length"),
        tags=table.tags,
        along_routes=table.along == "routes",
        without=without,
    )


def _known_zone(name: str, path: KeyPath, site: Site, findings: Findings) -> None:
    if name not in site.zone_names:
        findings.add(path, "the site has no such zone", did_you_mean(name, site.zone_names))


def _slots_fit(
    table: PlacementTable,
    written: frozenset[str],
    listed_m: Sequence[tuple[float, float]],
    site: Site,
    space: DesignSpace,
    findings: Findings,
) -> None:
    path = (*_PLACEMENT, "slots")
    if table.slots in ("joints", "centres") and site.tiling is None:
        findings.add(path, "the site has no floor tiles", 'Add tiling = { size = "0.5 m" } to [site].')
    if table.tags_per_tile is not None and site.tiling is None:
        findings.add(
            (*_PLACEMENT, "tags_per_tile"),
            "the site has no floor tiles",
            'Add tiling = { size = "0.5 m" } to [site], or leave this out.',
        )
    if "pitch" in written and table.slots != "grid":
        findings.add(
            (*_PLACEMENT, "pitch"), "only a grid has a pitch", 'Write slots = "grid", or leave the pitch out.'
        )
    elif table.slots == "grid":
        pitch_m = in_si(table.pitch, "length")
        # A floor too large for the default pitch is no fault of a spec that asks nothing of single tags.
        if pitch_m != in_si(PlacementTable().pitch, "length") and (said := too_many_slots(site, pitch_m)):
            findings.add((*_PLACEMENT, "pitch"), *said)
    if not listed_m:
        return
    places_m = np.array(listed_m)
    _refuse_outside(places_m, path, site, space, findings)
    _refuse_twins(places_m, path, findings)


def _refuse_outside(
    places_m: FloatArray, path: KeyPath, site: Site, space: DesignSpace, findings: Findings
) -> None:
    margin_m = max(space.tag_size_m) / 2.0
    region = site.taggable_region(WHOLE_FLOOR, margin_m, space.tag_part)
    for number in np.flatnonzero(~covers(region, places_m)).tolist():
        findings.add(
            (*path, number),
            "no tag may lie here: off the floor, on an obstacle, in a zone without tags, or within "
            f"{1000.0 * margin_m:g} mm of their borders",
            "Move the place, or leave it out.",
        )


def _installed_fit(
    installed_m: Sequence[tuple[float, float]], site: Site, space: DesignSpace, findings: Findings
) -> None:
    path, tag_size_m = (*_PLACEMENT, "installed"), max(space.tag_size_m)
    if not installed_m:
        return
    places_m = np.array(installed_m)
    _refuse_outside(places_m, path, site, space, findings)
    if _refuse_twins(places_m, path, findings):
        return
    from scipy.spatial import cKDTree

    for first, second in sorted(cKDTree(places_m).query_pairs(tag_size_m - 1e-9)):
        findings.add(
            (*path, second),
            f"this tag would overlap installed[{first}]: tags are {1000.0 * tag_size_m:g} mm long",
            "Measure again, or leave one out.",
        )


def _refuse_twins(places_m: FloatArray, path: KeyPath, findings: Findings) -> bool:
    """Note places that are there twice; return whether there are any."""
    _, first = np.unique(places_m, axis=0, return_index=True)
    twins = np.setdiff1d(np.arange(len(places_m)), first)
    for number in twins.tolist():
        findings.add((*path, number), "this place stands twice", "Remove one of them.")
    return bool(len(twins))


def _goals_fit(table: PlacementTable, findings: Findings) -> None:
    if table.aim in ("coverage", "gap") and table.budget is None:
        findings.add(
            (*_PLACEMENT, "aim"), f'the aim "{table.aim}" needs a budget', 'Write budget = "800 EUR" beside it.'
        )
    if table.aim == "gap" and not any(in_si(demand.length, "length") > 0.0 for demand in table.demand):
        findings.add(
            (*_PLACEMENT, "aim"), "the smallest gap is sought among runs, and every length is 0", "Give a length."
        )
    if in_si(table.unserved, "share") >= 1.0:
        findings.add((*_PLACEMENT, "unserved"), "then nothing is demanded", 'Write less, such as "1 %".')
    if table.stages and (table.aim != "cost" or table.budget is not None):
        findings.add(
            (*_PLACEMENT, "stages"),
            "stages are planned for the least cost, without a budget",
            'Write aim = "cost" without a budget, or leave the stages out.',
        )


def _stages_fit(table: PlacementTable, demands: Sequence[PlacementDemand], site: Site, findings: Findings) -> None:
    path = (*_PLACEMENT, "stages")
    wanted = [demand.zone for demand in demands]
    met: set[str] = set()
    for number, stage in enumerate(table.stages):
        for place, name in enumerate(stage):
            if name != WHOLE_FLOOR:
                _known_zone(name, (*path, number, place), site, findings)
            if name in met:
                findings.add((*path, number, place), "this zone stands in two stages", "Remove one of them.")
            met.add(name)
        if not any(zone in met for zone in wanted):
            findings.add(
                (*path, number),
                "nothing is demanded up to this stage",
                "Give a demand for one of its zones, or leave it out.",
            )
    for number, zone in enumerate(wanted):
        if table.stages and zone not in met:
            named = f"zone '{zone}'" if zone else 'the whole floor ("")'
            findings.add(
                (*_PLACEMENT, "demand", number), f"no stage equips {named}", "Add it to one of the stages."
            )


def _points(points: Sequence[Any]) -> tuple[tuple[float, float], ...]:
    return tuple(point_in_m(point) for point in points)
