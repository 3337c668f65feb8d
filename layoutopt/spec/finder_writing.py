"""The tables ``[tracking]`` and ``[docking]`` of a frozen copy, from which the settings read back bit for bit."""

import math
from collections.abc import Mapping
from typing import Any

from layoutopt.spec.finders import DockingSettings, TrackingSettings
from layoutopt.spec.written_numbers import as_written


def finder_tables(
    tracking: TrackingSettings | None, docking: DockingSettings | None
) -> dict[str, Mapping[str, Any]]:
    """Return the tables of a frozen copy.

    Defaults are written out too, so that the copy says where robot and target are. Those that do not fit the site
    are left to the reader, who finds that out again.
    """
    tables: dict[str, Mapping[str, Any]] = {}
    if tracking is not None and not tracking.lack:
        tables["tracking"] = _tracking(tracking)
    if docking is not None:
        tables["docking"] = _docking(docking)
    return tables


def _tracking(tracking: TrackingSettings) -> dict[str, Any]:
    world, signal, laser = tracking.world, tracking.world.signal, tracking.world.laser
    x_m, y_m, heading_rad = world.robot_pose
    table: dict[str, Any] = {
        "fitted": tracking.fitted,
        "antennas": list(tracking.counts),
        "yaw": [as_written(yaw_rad, "angle") for yaw_rad in tracking.yaws_rad],
        "interval": [as_written(interval_s, "time") for interval_s in tracking.intervals_s],
        "beam": as_written(tracking.beam_rad, "angle"),
        "height": as_written(tracking.height_m, "length"),
        "tags": tracking.target_tags,
        "robot_at": [x_m, y_m, as_written(heading_rad, "angle")],
        "walk": world.walk_m.tolist(),
        "walking_speed": as_written(world.walking_speed_m_s, "speed"),
        "person_radius": as_written(world.person_radius_m, "length"),
        "bystanders": world.bystanders,
        "clutter": world.clutter_count,
        "clutter_radius": as_written(world.clutter_radius_m, "length"),
        "strength_at_1m_dbm": signal.strength_at_1m_dbm,
        "path_exponent": signal.path_exponent,
        "fading_db": signal.fading_sigma_db,
        "fading_correlation": signal.fading_correlation,
        "noise_db": signal.noise_sigma_db,
        "half_range": as_written(signal.half_range_m, "length"),
        "detection_width_db": signal.detection_width_db,
        "tag_offset_db": signal.tag_offset_db,
        "phase_noise": as_written(signal.phase_sigma_rad, "angle"),
        "phase_bits": signal.phase_bits,
        "channels": [as_written(channel_hz, "frequency") for channel_hz in signal.channels_hz],
        "laser_noise": as_written(laser.range_sigma_m, "length"),
        "laser_range": as_written(laser.range_m, "length"),
        "laser_step": as_written(laser.step_rad, "angle"),
        "laser_field": as_written(laser.field_rad, "angle"),
        "estimator": tracking.estimator,
        "trials": tracking.trials,
        "duration": as_written(tracking.duration_s, "time"),
    }
    return table if math.isinf(signal.dwell_s) else {**table, "dwell": as_written(signal.dwell_s, "time")}


def _docking(docking: DockingSettings) -> dict[str, Any]:
    world = docking.world
    table: dict[str, Any] = {
        "fitted": docking.fitted,
        "scatterers": docking.scatterers_m.tolist(),
        "random_scatterers": world.random_scatterers,
        "reflection": as_written(world.reflection, "share"),
        "wall_reflection": as_written(world.wall_reflection, "share"),
        "scatterer_radius": as_written(world.scatterer_radius_m, "length"),
        "blocks_wave": world.blocks_wave,
        "frequency": as_written(world.frequency_hz, "frequency"),
        "clearance": as_written(world.clearance_m, "length"),
        "least_start": as_written(world.least_start_m, "length"),
        "noise": as_written(docking.noise_rad, "angle"),
        "step": as_written(world.step_m, "length"),
        "stop": as_written(world.stop_m, "length"),
        "steps": world.steps,
        "detour": world.detour,
        "candidate_pitch": as_written(docking.candidate_pitch_m, "length"),
        "estimator": docking.estimator,
        "trials": docking.trials,
    }
    return table if docking.transponder_m is None else {"transponder": list(docking.transponder_m), **table}
