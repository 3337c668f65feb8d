"""From ``[tracking]`` and ``[docking]`` to their questions, with what does not fit together noted."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np
import shapely
from shapely.geometry import LineString, Point

from layoutopt import registry
from layoutopt.docking_world import DockingWorld
from layoutopt.errors import did_you_mean
from layoutopt.geometry import covers
from layoutopt.identity import FloatArray, read_only
from layoutopt.prices import DEFAULT_LIST, PriceList
from layoutopt.readers.finders import LARGEST_UHF_PORTS
from layoutopt.robot import Robot
from layoutopt.site import Site
from layoutopt.space import DesignSpace, values_of
from layoutopt.spec.finder_places import FinderPlace, default_place, standing_place
from layoutopt.spec.finder_schema import DockingTable, TrackingTable
from layoutopt.spec.finders import DockingSettings, TrackingSettings
from layoutopt.spec.findings import Findings
from layoutopt.spec.lines import KeyPath
from layoutopt.spec.options import Parameter, axis
from layoutopt.spec.quantities import in_si, point_in_m
from layoutopt.tracking_world import UHF_BAND_HZ, LaserScanner, SignalWorld, TrackingWorld
from layoutopt.units import Dimension, format_length

_TRACKING: Final = ("tracking",)
_DOCKING: Final = ("docking",)
_LONGEST_INTERVAL_S: Final = 3600.0
_MOST_CHOICES: Final = 1_000
_MOST_RANGES: Final = 10_000_000
"""Ranges that the laser measures in one trial: all are in memory at once, 80 MB and as much for their noise."""
_TRACKING_ITEMS: Final = ("uhf_reader", "uhf_antenna", "uhf_tag")
_DOCKING_ITEMS: Final = ("direction_receiver", "transponder")
"""Items of a price list that the tables take."""
_ANSWERS: Final = {"robot": "study.validate_with", "target": "tracking.estimator", "bearing": "docking.estimator"}
"""Where a spec names estimators, by what they estimate."""


def tracking_of(
    table: TrackingTable, *, fitted: bool, site: Site, robot: Robot, findings: Findings
) -> TrackingSettings | None:
    """Return the question of tracking, ``None`` after a fault; ``fitted`` if the spec has the table."""
    before = findings.count
    counts = _choices(table.antennas, "antennas", None, findings)
    yaws_rad = _choices(table.yaw, "yaw", "angle", findings)
    intervals_s = _choices(table.interval, "interval", "time", findings)
    _choices_fit(counts, yaws_rad, intervals_s, findings)
    duration_s = in_si(table.duration, "time")
    if intervals_s and duration_s < 2.0 * max(intervals_s):
        findings.add(
            (*_TRACKING, "duration"),
            f"in {duration_s:g} s there are no two samples {max(intervals_s):g} s apart",
            'Write duration = "150 s".',
        )
    check_estimator(table.estimator, "target", (*_TRACKING, "estimator"), findings)
    channels_hz = tuple(in_si(channel, "frequency") for channel in table.channels)
    _channels_fit(channels_hz, findings)
    laser_step_rad, laser_field_rad = in_si(table.laser_step, "angle"), in_si(table.laser_field, "angle")
    if laser_step_rad > laser_field_rad:
        findings.add((*_TRACKING, "laser_step"), "no two beams would lie in laser_field", 'Write "0.5 deg".')
    elif intervals_s and min(intervals_s) > 0.0:
        ranges = duration_s / min(intervals_s) * laser_field_rad / laser_step_rad
        if ranges > _MOST_RANGES:
            findings.add(
                (*_TRACKING, "laser_step"),
                f"in a trial of {duration_s:g} s it makes {ranges / 1e6:.3g} million ranges, more than "
                f"{_MOST_RANGES // 1_000_000} million",
                "Widen laser_step or interval, or shorten duration.",
            )
    place = _place(table, fitted, site, robot, findings)
    if place is None or findings.count > before:
        return None
    return TrackingSettings(
        world=TrackingWorld(
            robot_pose=place.robot_pose,
            walk_m=place.walk_m,
            walking_speed_m_s=in_si(table.walking_speed, "speed"),
            person_radius_m=in_si(table.person_radius, "length"),
            bystanders=table.bystanders,
            clutter_count=table.clutter,
            clutter_radius_m=in_si(table.clutter_radius, "length"),
            signal=SignalWorld(
                strength_at_1m_dbm=table.strength_at_1m_dbm,
                path_exponent=table.path_exponent,
                fading_sigma_db=table.fading_db,
                fading_correlation=table.fading_correlation,
                noise_sigma_db=table.noise_db,
                half_range_m=in_si(table.half_range, "length"),
                detection_width_db=table.detection_width_db,
                tag_offset_db=table.tag_offset_db,
                phase_sigma_rad=in_si(table.phase_noise, "angle"),
                phase_bits=table.phase_bits,
                channels_hz=channels_hz,
                dwell_s=math.inf if table.dwell is None else in_si(table.dwell, "time"),
            ),
            laser=LaserScanner(
                step_rad=laser_step_rad,
                field_rad=laser_field_rad,
                range_m=in_si(table.laser_range, "length"),
                range_sigma_m=in_si(table.laser_noise, "length"),
            ),
        ),
        fitted=fitted and table.fitted,
        counts=tuple(int(count) for count in counts),
        yaws_rad=yaws_rad,
        intervals_s=intervals_s,
        beam_rad=in_si(table.beam, "angle"),
        height_m=in_si(table.height, "length"),
        target_tags=table.tags,
        estimator=table.estimator,
        trials=table.trials,
        duration_s=duration_s,
        lack=place.lack,
    )


def hopping_notes(tracking: TrackingSettings) -> tuple[str, ...]:
    """Return that a reader leaves its channel before phases can be compared, if it does."""
    dwell_s, interval_s = tracking.world.signal.dwell_s, max(tracking.intervals_s)
    if dwell_s > interval_s:
        return ()
    return (
        f"the UHF reader stays {dwell_s:g} s on a channel, and an antenna reads every {interval_s:g} s: phases "
        "are compared on one channel only, so few pairs or none are left, and trackers go by strength",
    )


def near_field_notes(docking: DockingSettings) -> tuple[str, ...]:
    """Return that a robot drives where waves are not yet those of the model, if it does.

    References
    ----------
    Balanis, Antenna Theory, Section 5.2: the near field of a small loop ends at a wavelength over 2 pi.
    """
    near_m = docking.world.wavelength_m / (2.0 * math.pi)
    if near_m <= docking.world.stop_m:
        return ()
    return (
        f"waves of {docking.world.frequency_hz / 1e6:g} MHz are taken as far from the transponder, but up to "
        f"{format_length(near_m)} it is near, and robots drive on to {format_length(docking.world.stop_m)}: there "
        "directions and strengths are others",
    )


def docking_of(table: DockingTable, *, fitted: bool, site: Site, findings: Findings) -> DockingSettings | None:
    """Return the question of docking, ``None`` after a fault; ``fitted`` if the spec has the table."""
    before = findings.count
    check_estimator(table.estimator, "bearing", (*_DOCKING, "estimator"), findings)
    scatterers_m = read_only([point_in_m(point) for point in table.scatterers], (-1, 2))
    radius_m = in_si(table.scatterer_radius, "length")
    for number in np.flatnonzero(~covers(site.floor, scatterers_m)).tolist():
        findings.add((*_DOCKING, "scatterers", number), "this lies off the floor", "Move it, or leave it out.")
    transponder_m = None if table.transponder is None else point_in_m(table.transponder)
    if transponder_m is not None:
        path = (*_DOCKING, "transponder")
        _off_the_floor(np.array([transponder_m]), (path,), site, findings)
        away_m = np.hypot(*(scatterers_m - np.array(transponder_m)).T)
        for number in np.flatnonzero(away_m <= radius_m).tolist():
            findings.add(path, f"the transponder stands within scatterers[{number}]", "Move one of them.")
    if findings.count > before:
        return None
    return DockingSettings(
        world=DockingWorld(
            frequency_hz=in_si(table.frequency, "frequency"),
            reflection=in_si(table.reflection, "share"),
            wall_reflection=in_si(table.wall_reflection, "share"),
            scatterer_radius_m=radius_m,
            blocks_wave=table.blocks_wave,
            random_scatterers=table.random_scatterers,
            clearance_m=in_si(table.clearance, "length"),
            least_start_m=in_si(table.least_start, "length"),
            step_m=in_si(table.step, "length"),
            stop_m=in_si(table.stop, "length"),
            steps=table.steps,
            detour=table.detour,
        ),
        fitted=fitted and table.fitted,
        transponder_m=transponder_m,
        scatterers_m=scatterers_m,
        candidate_pitch_m=in_si(table.candidate_pitch, "length"),
        noise_rad=in_si(table.noise, "angle"),
        estimator=table.estimator,
        trials=table.trials,
    )


def equipped_space(
    space: DesignSpace,
    tracking: TrackingSettings,
    docking: DockingSettings,
    prices: PriceList,
    findings: Findings,
) -> DesignSpace:
    """Return the space whose layouts carry what the tables fit; note what the price list lacks for it."""
    finders = [settings.antennas() for settings in (tracking, docking) if settings.fitted]
    transponder = docking.transponder() if docking.fitted else None
    space = replace(
        space,
        finders=tuple(finders),
        transponders=() if transponder is None else (transponder,),
        target_tags=tracking.target_tags if tracking.fitted else 0,
    )
    items = [*(_TRACKING_ITEMS if tracking.fitted else ()), *(_DOCKING_ITEMS if docking.fitted else ())]
    if missing := prices.missing(items):
        findings.add(
            ("parts", "prices"),
            f"the price list '{prices.name}' has no {', '.join(missing)}, and every layout takes them",
            f'Add [items.{missing[0]}] and the like, or begin the list with base = "{DEFAULT_LIST}".',
        )
    return space


def check_estimator(name: str, estimates: str, path: KeyPath, findings: Findings) -> None:
    """Note an estimator that is unknown or estimates something else; the message says where that belongs."""
    known = registry.names("estimators")
    if name not in known:
        able = [other for other in known if registry.card("estimators", other).estimates == estimates]
        findings.add(path, "no such estimator", did_you_mean(name, able))
        return
    found = registry.card("estimators", name).estimates
    if found != estimates:
        able = [other for other in known if registry.card("estimators", other).estimates == estimates]
        what = "a bearing" if found == "bearing" else f"the place of a {found}"
        findings.add(
            path,
            f"this estimator estimates {what}, so it belongs under {_ANSWERS[found]}",
            f"Known here: {', '.join(able)}.",
        )


def _choices(value: Any, word: str, dimension: Dimension | None, findings: Findings) -> tuple[Any, ...]:
    """Return the values of a key to choose from, as ``[space]`` would take them; none after a fault."""
    parameter = Parameter(
        name=word,
        word=word,
        dimension=dimension,
        kind="number" if dimension else "whole",
        required=True,
        default=None,
    )
    chosen = axis(value, parameter, (*_TRACKING, word), findings)
    return () if chosen is None else values_of(chosen)


def _choices_fit(
    counts: Sequence[int], yaws_rad: Sequence[float], intervals_s: Sequence[float], findings: Findings
) -> None:
    if any(not 1 <= count <= LARGEST_UHF_PORTS for count in counts):
        findings.add(
            (*_TRACKING, "antennas"),
            f"a UHF reader has 1 to {LARGEST_UHF_PORTS} antennas",
            "Write antennas = 2.",
        )
    if any(not -math.pi <= yaw_rad <= math.pi for yaw_rad in yaws_rad):
        findings.add((*_TRACKING, "yaw"), "a yaw lies within half a turn", 'Write yaw = "45 deg".')
    if any(not 0.0 < interval_s <= _LONGEST_INTERVAL_S for interval_s in intervals_s):
        findings.add(
            (*_TRACKING, "interval"),
            f"samples are taken more than 0 s and at most {_LONGEST_INTERVAL_S:g} s apart",
            'Write interval = "0.4 s".',
        )
    choices = len(counts) * len(yaws_rad) * len(intervals_s)
    if choices > _MOST_CHOICES:
        findings.add(
            _TRACKING,
            f"antennas, yaws and intervals make {choices} choices",
            f"List values for at most {_MOST_CHOICES}.",
        )


def _channels_fit(channels_hz: Sequence[float], findings: Findings) -> None:
    low_hz, high_hz = UHF_BAND_HZ
    for number, channel_hz in enumerate(channels_hz):
        if not low_hz <= channel_hz <= high_hz:
            findings.add(
                (*_TRACKING, "channels", number),
                f"UHF tags answer at {low_hz / 1e6:g} to {high_hz / 1e6:g} MHz",
                'Write "920 MHz".',
            )


def _place(table: TrackingTable, fitted: bool, site: Site, robot: Robot, findings: Findings) -> FinderPlace | None:
    """Return where the robot stands and the target walks, as told or by default; ``None`` after a fault."""
    before = findings.count
    radius_m = in_si(table.person_radius, "length")
    pose = None
    if table.robot_at is not None:
        pose = (*point_in_m(table.robot_at[:2]), in_si(table.robot_at[2], "angle"))
        _robot_stands(pose, site, robot, findings)
    if table.walk is None:
        place = default_place(site, robot, radius_m, pose)
        if fitted and place.lack and findings.count == before:
            findings.add(_TRACKING, place.lack, "Give robot_at and walk.")
        return place if findings.count == before else None
    walk_m = read_only([point_in_m(point) for point in table.walk], (-1, 2))
    _walk_fits(walk_m, site, findings)
    if pose is None:
        x_m, y_m = standing_place(site, robot)
        ahead_m = walk_m.mean(axis=0) - (x_m, y_m)
        pose = (x_m, y_m, float(np.arctan2(ahead_m[1], ahead_m[0])))
    if findings.count > before:
        return None
    closed_m = np.concatenate([walk_m, walk_m[:1]])
    gap_m = float(shapely.distance(LineString(closed_m), Point(pose[:2])))
    if gap_m < robot.radius_m + radius_m:
        findings.add(
            (*_TRACKING, "walk"),
            f"the walk comes within {format_length(gap_m)} of the middle of the robot, which with a person takes "
            f"{format_length(robot.radius_m + radius_m)}",
            "Move the walk, or robot_at.",
        )
        return None
    return FinderPlace(robot_pose=pose, walk_m=walk_m)


def _robot_stands(pose: tuple[float, float, float], site: Site, robot: Robot, findings: Findings) -> None:
    path = (*_TRACKING, "robot_at")
    place_m = np.array([pose[:2]])
    before = findings.count
    _off_the_floor(place_m, (path,), site, findings)
    if findings.count == before and not covers(site.robot_region(robot.radius_m), place_m)[0]:
        findings.add(
            path,
            f"a robot that turns here touches a wall or an obstacle: it needs {format_length(robot.radius_m)} "
            "about its middle",
            "Move it.",
        )


def _walk_fits(walk_m: FloatArray, site: Site, findings: Findings) -> None:
    before, path = findings.count, (*_TRACKING, "walk")
    _off_the_floor(walk_m, [(*path, number) for number in range(len(walk_m))], site, findings)
    if not (np.ptp(walk_m, axis=0) > 0.0).any():
        findings.add(path, "all corners of the walk are one place", "Write [[3, 1], [3, 4]].")
    if findings.count > before:
        return
    for number, (start_m, end_m) in enumerate(zip(walk_m, np.roll(walk_m, -1, axis=0), strict=True)):
        if not site.open_floor.covers(LineString([start_m, end_m])):
            findings.add(
                (*path, number),
                "the straight way from here to the next corner leaves the floor or crosses an obstacle",
                "Add corners that lead around it; the walk closes itself.",
            )


def _off_the_floor(places_m: FloatArray, paths: Sequence[KeyPath], site: Site, findings: Findings) -> None:
    """Note places that do not lie on the open floor."""
    for number in np.flatnonzero(~covers(site.open_floor, places_m)).tolist():
        place = Point(places_m[number])
        within = (count for count, obstacle in enumerate(site.obstacles, 1) if obstacle.intersects(place))
        obstacle = next(within, None) if site.floor.intersects(place) else None
        where = "off the floor" if obstacle is None else f"in obstacle {obstacle}"
        findings.add(paths[number], f"this place lies {where}", "Move it.")
