"""Writes the frozen copy of a spec: resolved, with plan and prices inside, so that the file stands alone.

The copy is made of the resolved values, not of the text that was read, so it also holds what was changed since,
and reads back to an equal problem: numbers get a unit only where that loses no bit.
"""

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
import tomli_w
from shapely.geometry import MultiPolygon, Polygon

from layoutopt import registry
from layoutopt.atomic_file import replacing
from layoutopt.errors import InvalidInput
from layoutopt.identity import FloatArray
from layoutopt.layout import ReaderProfile
from layoutopt.problem import Limit
from layoutopt.scenario import Faults
from layoutopt.scores import SCORE_UNITS
from layoutopt.site import Site
from layoutopt.space import Family, Interval, Values
from layoutopt.spec.building import PlacementSettings, Spec
from layoutopt.spec.finder_writing import finder_tables
from layoutopt.spec.goals import UNIT_DIMENSIONS
from layoutopt.spec.price_table import price_table
from layoutopt.spec.source import MAXIMUM_BYTES
from layoutopt.spec.written_numbers import as_written
from layoutopt.tolerance import Tolerance
from layoutopt.units import dimension_of, without_unit

_PLAIN_LIST = re.compile(r"\[\n((?: +[^\[\]\n]+,\n)+) *\]")
_LIST_WIDTH: Final = 90
HEADER: Final = (
    "# Written by layoutopt: a complete spec, with floor and prices inside. It can be read like any other.\n\n"
)


def write_spec(spec: Spec, path: str | os.PathLike[str]) -> None:
    """Write the frozen copy of a spec.

    Raises
    ------
    InvalidInput
        If the copy would be larger than a spec may be.
    """
    write_document(document_of(spec), path)


def write_document(document: Mapping[str, Any], path: str | os.PathLike[str], *, comment: str = "") -> None:
    """Write a document as TOML, by way of a file beside it, so that a kill leaves no half file.

    ``comment`` goes to the top: whole lines that begin with ``#``.

    Raises
    ------
    InvalidInput
        If the text would be larger than a spec may be.
    """
    content = (comment + HEADER + _compact(tomli_w.dumps(document))).encode()
    if len(content) > MAXIMUM_BYTES:
        raise InvalidInput.at(
            os.fspath(path),
            f"the frozen copy would have {len(content) / 1e6:.1f} MB, more than a spec may have",
            "Simplify the outlines of the plan.",
        )
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    with replacing(target) as temporary:
        temporary.write_bytes(content)


def _compact(text: str) -> str:
    """Return TOML with short lists on one line; a text in it never holds a line break of its own."""

    def joined(match: re.Match[str]) -> str:
        items = ", ".join(line.strip().rstrip(",") for line in match[1].strip("\n").split("\n"))
        return f"[{items}]" if len(items) <= _LIST_WIDTH else match[0]

    return _PLAIN_LIST.sub(joined, text)


def document_of(spec: Spec) -> dict[str, Any]:
    """Return a spec as a TOML document that stands alone."""
    space = spec.space
    return {
        "schema": 1,
        "seed": spec.seed,
        "site": _site(spec.site),
        "robots": _robots(spec),
        "parts": {
            "tag": space.tag_part,
            "reader": spec.reader_part,
            "reader_profile": profile_table(spec.reader_profile),
            "price_list": price_table(spec.prices),
        },
        "space": _space(spec),
        "goal": _goal(spec),
        "study": _study(spec),
        "placement": _placement(spec.placement),
        **finder_tables(spec.tracking, spec.docking),
    }


def profile_table(profile: ReaderProfile) -> dict[str, Any]:
    """Return a reader profile as a table."""
    return {
        "name": profile.name,
        "scan_period": as_written(profile.scan_period_s, "time"),
        "tags_per_scan": profile.tags_per_scan,
        "spacing_sides": profile.spacing_sides,
        "simultaneous_spacing_sides": profile.simultaneous_spacing_sides,
    }


def parameter_table(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parameters of a family, each one value, as a spec writes them."""
    return {
        without_unit(name): _written_value(value, name) for name, value in parameters.items() if value is not None
    }


def antenna_table(antenna: Any) -> dict[str, Any]:
    """Return an antenna as the model's name and its parameters without the side.

    Raises
    ------
    KeyError
        If no model of the table makes such antennas.
    """
    for name in registry.names("antennas"):
        model = registry.load("antennas", name)
        if type(antenna) is model:
            import inspect

            own = {key: getattr(antenna, key) for key in inspect.signature(model).parameters if key != "side_m"}
            return {"model": name, **parameter_table(own)}
    raise KeyError(type(antenna).__name__)


def _site(site: Site) -> dict[str, Any]:
    table: dict[str, Any] = {"name": site.name, "source": site.source, "floor": _floor(site.floor)}
    if site.obstacles:
        table["obstacles"] = [_ring(obstacle.exterior.coords) for obstacle in site.obstacles]
    if site.tiling is not None:
        table["tiling"] = {
            "size": as_written(site.tiling.size_m, "length"),
            "origin": list(site.tiling.origin_m),
            "angle": as_written(site.tiling.angle_rad, "angle"),
        }
    zones = []
    for zone in site.zones:
        entry: dict[str, Any] = {"name": zone.name, "region": _ring(zone.region.exterior.coords)}
        if zone.target_error_m is not None:
            entry["target_error"] = as_written(zone.target_error_m, "length")
        zones.append({**entry, "tags": zone.tags, "metal": zone.metal, "drill": zone.drill})
    return {**table, "zone": zones} if zones else table


def _floor(floor: Polygon | MultiPolygon) -> list[Any]:
    """Return a ring where that is enough, else the outline and its holes, else a list of such parts."""
    if isinstance(floor, MultiPolygon):
        return [_rings(part) for part in floor.geoms]
    rings = _rings(floor)
    return rings if len(rings) > 1 else rings[0]


def _rings(polygon: Polygon) -> list[Any]:
    return [_ring(ring.coords) for ring in (polygon.exterior, *polygon.interiors)]


def _ring(coordinates: Any) -> list[list[float]]:
    """Return the corners of a ring, the first one not repeated."""
    return [[float(x_m), float(y_m)] for x_m, y_m in list(coordinates)[:-1]]


def _points(points_m: FloatArray) -> list[list[float]]:
    return [[float(value) for value in point] for point in np.asarray(points_m)]


def _robots(spec: Spec) -> dict[str, Any]:
    robot, odometry = spec.robot, spec.robot.odometry
    routes = _points(spec.routes.way_points_m) if spec.routes.kind == "way_points" else spec.routes.kind
    heading_rad = spec.routes.heading_rad
    heading = {} if heading_rad is None else {"heading": as_written(heading_rad, "angle")}
    return {
        "count": spec.robot_count,
        "drive": robot.drive.value,
        "outline": _points(robot.outline_m),
        "speed": as_written(robot.speed_m_s, "speed"),
        "turn_rate": as_written(robot.turn_rate_rad_s, "angular_speed"),
        "odometry": {
            "translation": as_written(odometry.translation_share, "share"),
            "rotation": as_written(odometry.rotation_rad_per_m, "angle_per_length"),
            "lateral": as_written(odometry.lateral_share, "share"),
            "half_track": as_written(odometry.half_track_m, "length"),
            "translation_after_1s": as_written(odometry.translation_m_per_sqrt_s, "length"),
            "rotation_after_1s": as_written(odometry.rotation_rad_per_sqrt_s, "angle"),
        },
        "gyro": {
            "random_walk_after_1s": as_written(robot.gyro.random_walk_rad_per_sqrt_s, "angle"),
            "bias": as_written(robot.gyro.bias_sigma_rad_s, "angular_speed"),
            "fitted": robot.gyro_fitted,
        },
        "routes": routes,
        "pause": as_written(spec.routes.pause_s, "time"),
        **heading,
    }


def _space(spec: Spec) -> dict[str, Any]:
    space = spec.space
    # A family with few antennas lacks the larger multiplexers; the one with most was allowed all of them.
    mounts = max(spec.mounts, key=len)
    built = space.readers[0].values["mount"]
    lengths: dict[str, Values] = {
        "side_m": tuple(dict.fromkeys(mount.antenna.side_m for mount in mounts)),
        "height_m": tuple(dict.fromkeys(mount.height_m for mount in mounts)),
    }
    if isinstance(built, Family):
        lengths = {name: built.values[name] for name in lengths}
    return {
        "antenna": antenna_table(mounts[0].antenna),
        **{f"antenna_{without_unit(name)}": _written_values(values, name) for name, values in lengths.items()},
        "antennas_per_module": list(dict.fromkeys(mount.antennas_per_module for mount in mounts)),
        "origin": list(space.origin_m),
        "placement_sigma": as_written(space.placement_sigma_m, "length"),
        "readers": [_family(family) for family in space.readers],
        "patterns": [
            {**_family(family), **({"zone": zone} if zone else {})}
            for zone, families in space.patterns.items()
            for family in families
        ],
    }


def _family(family: Family[Any]) -> dict[str, Any]:
    table: dict[str, Any] = {"family": family.name}
    for name, values in family.values.items():
        if name == "mount":
            continue
        written = _written_values(values, name)
        single = isinstance(values, tuple) and len(values) == 1
        table[without_unit(name)] = written[0] if single else written
    return table


def _written_values(values: Values, parameter: str) -> Any:
    """Return the values of a parameter as a list, a range, or a list with ranges for numbers within."""
    if isinstance(values, Interval):
        return {"from": _written_value(values.low, parameter), "to": _written_value(values.high, parameter)}
    if isinstance(values, Family):
        ranges = {name: _written_values(inner, parameter) for name, inner in values.values.items()}
        return _written_value(values.build(**ranges), parameter)
    return [_written_value(value, parameter) for value in values]


def _written_value(value: Any, parameter: str) -> Any:
    if isinstance(value, (tuple, list)):
        return [_written_value(item, parameter) for item in value]
    if isinstance(value, (str, bool, int, dict)):
        return value
    return as_written(float(value), dimension_of(parameter))


def _goal(spec: Spec) -> dict[str, Any]:
    table: dict[str, Any] = {
        "minimise": list(spec.goals),
        "limits": [_limit(limit) for limit in spec.own_limits],
    }
    if spec.target_error_m is not None:
        table["target_error"] = as_written(spec.target_error_m, "length")
    if spec.budget_eur is not None:
        table["budget"] = as_written(spec.budget_eur, "price")
    return table


def _limit(limit: Limit) -> str:
    unit = SCORE_UNITS[limit.score.rpartition(".")[2]]
    # Shares and the units that a limit cannot name, such as rad², are bare numbers.
    end = as_written(limit.end, UNIT_DIMENSIONS[unit]) if unit and unit in UNIT_DIMENSIONS else limit.end
    named = f" {unit}" if unit in UNIT_DIMENSIONS and not isinstance(end, str) else ""
    sign = "<=" if limit.upper is not None else ">="
    return f"{limit.score} {sign} {end}{named}".rstrip()


def _study(spec: Spec) -> dict[str, Any]:
    study = spec.study
    return {
        "search_trials": study.search_trials,
        "validate_with": list(study.validate_with),
        "validation_trials": study.validation_trials,
        "alternatives": study.alternatives,
        "least_difference": as_written(study.least_difference, "share"),
        "alternative_tolerance": as_written(study.alternative_tolerance, "share"),
        "step": as_written(study.step_s, "time"),
        "duration": as_written(study.duration_s, "time"),
        "start_known": study.start_known,
        "start_uncertainty": {
            "position": as_written(study.start_sigma_m, "length"),
            "heading": as_written(study.start_sigma_rad, "angle"),
        },
        **({} if study.particles is None else {"particles": study.particles}),
        "design_faults": _faults(study.design_faults),
        "held_out_faults": _faults(study.held_out_faults),
        "tolerance": _tolerance(study.tolerance),
    }


def _placement(placement: PlacementSettings) -> dict[str, Any]:
    listed = placement.slots == "listed"
    table: dict[str, Any] = {
        "slots": [list(place_m) for place_m in placement.listed_m] if listed else placement.slots,
        **({"pitch": as_written(placement.pitch_m, "length")} if placement.slots == "grid" else {}),
        "spacing": as_written(placement.spacing_m, "length"),
        "installed": [list(place_m) for place_m in placement.installed_m],
        "forbidden": [list(place_m) for place_m in placement.forbidden_m],
        "required": [list(place_m) for place_m in placement.required_m],
        "unserved": as_written(placement.unserved_share, "share"),
        "aim": placement.aim,
        "stages": [list(stage) for stage in placement.stages],
        "demand": [
            {
                "zone": demand.zone,
                "length": as_written(demand.length_m, "length"),
                "tags": demand.tags,
                "along": "routes" if demand.along_routes else "everywhere",
                "without": list(demand.without),
            }
            for demand in placement.demands
        ],
    }
    if placement.budget_eur is not None:
        table["budget"] = as_written(placement.budget_eur, "price")
    optional = {"tags_per_tile": placement.tags_per_tile, "reader": placement.reader}
    return {**table, **{key: value for key, value in optional.items() if value is not None}}


def _tolerance(tolerance: Tolerance) -> dict[str, Any]:
    return {
        "placement": [as_written(value, "length") for value in tolerance.placement_m],
        "dead_tags": [as_written(value, "share") for value in tolerance.dead_tags],
        "missed_reads": [as_written(value, "share") for value in tolerance.missed_reads],
        "antenna_height": [as_written(value, "length") for value in tolerance.antenna_height_m],
        "combine": tolerance.combine,
        "quantile": tolerance.quantile,
    }


def _faults(faults: Faults) -> dict[str, Any]:
    x_m, y_m, heading_rad = faults.start_offset
    kidnapped = (
        {} if faults.kidnapped_at_s is None else {"kidnapped_at": as_written(faults.kidnapped_at_s, "time")}
    )
    return {
        **kidnapped,
        "tag_placement_sigma": as_written(faults.tag_placement_sigma_m, "length"),
        "tag_offset": list(faults.tag_offset_m),
        "dead_tag_share": as_written(faults.dead_tag_share, "share"),
        "missed_read_share": as_written(faults.missed_read_share, "share"),
        "wrong_identity_share": as_written(faults.wrong_identity_share, "share"),
        "antenna_height_error": as_written(faults.antenna_height_error_m, "length"),
        "read_edge": as_written(faults.read_edge_m, "length"),
        "clock_error": as_written(faults.clock_error_s, "time"),
        "slips_per_m": faults.slips_per_m,
        "slip_sigma": as_written(faults.slip_sigma_m, "length"),
        "asynchronous": faults.asynchronous,
        "start_offset": {
            "x": as_written(x_m, "length"),
            "y": as_written(y_m, "length"),
            "heading": as_written(heading_rad, "angle"),
        },
    }
