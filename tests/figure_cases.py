"""A cheap example of every figure, with as many series as it may have."""

from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
from shapely.geometry import box
from tracking_cases import ROBOT as FOLLOWER
from tracking_cases import SITE as WALK
from tracking_cases import WORLD
from tracking_cases import layout as tracking_layout

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.error_map import error_map
from layoutopt.layout import FloorTags, Layout, ReaderProfile, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.plots.blind_rose import RoseCurve, draw_blind_rose
from layoutopt.plots.cell_maps import CellMap, draw_cell_maps
from layoutopt.plots.cost_bars import draw_cost_bars
from layoutopt.plots.coverage_front import draw_coverage_front
from layoutopt.plots.curves import Curve, Panel, draw_curves
from layoutopt.plots.detection_reach import draw_detection_reach
from layoutopt.plots.direction_maps import DirectionMap, draw_direction_maps
from layoutopt.plots.docking_map import DockingMap, draw_docking_map
from layoutopt.plots.docking_paths import DockingPanel, draw_docking_paths
from layoutopt.plots.drive_replay import draw_replay
from layoutopt.plots.error_by_yaw import YawCurve, draw_error_by_yaw
from layoutopt.plots.error_over_time import draw_error_over_time
from layoutopt.plots.fleet_shares import draw_fleet_shares
from layoutopt.plots.floor_cells import draw_floor_cells
from layoutopt.plots.floor_rooms import draw_floor_rooms
from layoutopt.plots.front import draw_front
from layoutopt.plots.layout_plan import draw_layout_plan
from layoutopt.plots.local_error import draw_local_error
from layoutopt.plots.pattern_cells import PatternPicture, draw_patterns
from layoutopt.plots.ratios import RatioRow, draw_ratios
from layoutopt.plots.trajectories import Paths, draw_trajectories
from layoutopt.plots.undersides import UndersidePicture, draw_undersides
from layoutopt.plots.whiskers import WhiskerPanel, WhiskerSeries, draw_whiskers
from layoutopt.protocols import Mount
from layoutopt.readers.ring import ring
from layoutopt.readings import Trajectory
from layoutopt.result import Evaluated, Front
from layoutopt.robot import Robot
from layoutopt.scores import Score
from layoutopt.site import Site, Tiling, Zone

SITE = Site(
    name="hall",
    floor=box(0.0, 0.0, 4.0, 3.0),
    obstacles=(box(2.0, 2.0, 2.5, 2.5),),
    zones=(Zone(name="dock", region=box(0.2, 0.2, 1.0, 1.0), target_error_m=0.01),),
    tiling=Tiling(size_m=0.5),
)
MOUNT = Mount(
    antenna=SphereAntenna(side_m=0.06),
    height_m=0.02,
    profile=ReaderProfile(name="own", scan_period_s=0.05, tags_per_scan="several"),
)
LAYOUT = Layout(
    floor_tags=FloorTags(zones=(ZonePattern(zone="", pattern=square(pitch_m=0.5)),)),
    readers=(ring(count=3, radius_m=0.1, mount=MOUNT),),
)
ROBOT = Robot(outline_m=0.15 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]))
TAGS = LAYOUT.floor_tags.lay_on(SITE)
PATH = np.stack([np.linspace(1.0, 3.0, 30), np.linspace(1.0, 2.0, 30)], axis=1)
SIX = ("one", "two", "three", "four", "five", "six")
X = np.array([1.0, 2.0, 3.0])


def _drive():
    return {
        "layout": LAYOUT,
        "site": SITE,
        "tag_map": TAGS,
        "read_tags": np.array([3, 3, 5]),
    }


def _replay(**axes):
    poses = np.concatenate([PATH, np.zeros((len(PATH), 1))], axis=1)
    covariance_m2 = np.tile(np.eye(2) * 1e-4, (len(PATH), 1, 1))
    trajectory = Trajectory(poses=poses, covariance=covariance_m2, lost=np.arange(len(PATH)) < 4)
    return draw_replay(**_drive(), step_s=0.1, trajectory=trajectory, true_poses=poses + 0.01, **axes)


def _scored(number, cost_eur, error_m):
    pattern = ZonePattern(zone="", pattern=square(pitch_m=0.1 + 0.01 * number))
    layout = Layout(floor_tags=FloorTags(zones=(pattern,)), readers=LAYOUT.readers)
    error = Score(value=error_m, unit="m", standard_error=0.001, count=50)
    return Evaluated(
        layout=layout, scores={"cost": Score(value=cost_eur, unit="EUR"), "position_error_mean": error}
    )


def _front(**axes):
    members = (_scored(1, 1000.0, 0.02), _scored(2, 2000.0, 0.01))
    other = _scored(3, 2500.0, 0.03)
    mark = SimpleNamespace(
        label="published",
        layout=other.layout,
        cost=Score(value=3000.0, unit="EUR"),
        error=members[1].scores["position_error_mean"],
    )
    return draw_front(
        designs=[SimpleNamespace(evaluated=other)],
        front=Front(goals=("cost", "position_error_mean"), members=members),
        recommended={"cheapest": members[1]},
        references=[mark],
        target_m=0.012,
        budget_eur=2800.0,
        **axes,
    )


def _whiskers(**axes):
    ones = np.ones(2)
    series = [WhiskerSeries(name=name, values=ones, low=0.5 * ones, high=2.0 * ones) for name in SIX]
    series.append(WhiskerSeries(name="paper", values=ones, low=ones, high=ones, printed=True))
    panel = WhiskerPanel(title="", categories=("0", "1"), series=tuple(series))
    return draw_whiskers([panel, panel], x_label="obstacles", y_label="docked (%)", joined=True, **axes)


def _curves(**axes):
    curves = tuple(Curve(name=name, x=X, y=X, half_width=0.1 * X) for name in SIX)
    panel = Panel(title="", x_label="speed (mm/s)", y_label="error (mm)", curves=curves)
    return draw_curves([panel, panel], **axes)


def _direction_maps(**axes):
    item = DirectionMap(
        title="(a)",
        error_deg=np.array([[10.0, 84.0], [84.1, 170.0]]),
        bounds_m=(-1.0, -1.0, 1.0, 1.0),
        transponder_m=(0.2, 0.3),
        scatterers_m=np.array([(0.5, -0.5)]),
    )
    return draw_direction_maps([item, item], columns=2, limit_deg=84.0, **axes)


def _docking_map(**axes):
    shown = DockingMap(
        places_m=np.array([(0.5, 2.0), (1.0, 2.0)]),
        success=np.array([0.0, 0.9]),
        refused_m=np.array([(0.0, 0.0)]),
        side_m=0.5,
        scatterers_m=np.array([(3.0, 1.0)]),
        clearance_m=0.5,
        best_m=(1.0, 2.0),
        given_m=(0.5, 2.0),
    )
    return draw_docking_map(SITE, shown, **axes)


def _docking_paths(**axes):
    panel = DockingPanel(
        title="(a)",
        bounds_m=(-2.0, -2.0, 2.0, 2.0),
        obstacles_m=np.array([(0.0, 0.0)]),
        radius_m=0.1,
        transponder_m=(1.5, 1.5),
        stop_m=0.5,
        paths_m={name: np.array([(-1.5, -1.5), (0.1 * number, 1.0)]) for number, name in enumerate(SIX[:3])},
    )
    return draw_docking_paths([panel, panel], **axes)


def _reach(**axes):
    x_m, y_m = np.linspace(-1.0, 5.0, 31), np.linspace(-3.0, 3.0, 21)
    chance = np.tile(np.exp(-0.4 * np.abs(x_m)), (len(y_m), 1))
    world = {"site": WALK, "robot": FOLLOWER, "world": WORLD, "antennas": tracking_layout().readers[0]}
    return draw_detection_reach(**world, x_m=x_m, y_m=y_m, chance=chance, **axes)


def _yaw(**axes):
    curves = [YawCurve(name=name, yaw_deg=X, error_mm=X, low_mm=0.9 * X, high_mm=1.1 * X) for name in SIX]
    return draw_error_by_yaw(curves, limit_mm=2.0, **axes)


def _over_time(**axes):
    errors = {name: 0.001 * X for name in SIX}
    return draw_error_over_time(time_s=X, position_error_m=errors, heading_error_rad={}, **axes)


def _local_error(**axes):
    drives = [
        (np.array([(0.6, 0.6), (3.5, 2.5)])[: 1 + number], np.full(1 + number, 0.01)) for number in (0, 0, 0, 0, 1)
    ]
    return draw_local_error(site=SITE, errors=error_map(SITE, drives, cell_m=0.5), **axes)


def _rose(**axes):
    turn_rad = np.linspace(0.0, 6.0, 20)
    curves = [RoseCurve(label=name, direction_rad=turn_rad, probability=np.full(20, 0.1)) for name in SIX]
    return draw_blind_rose(curves, **axes)


def _cells(**axes):
    item = CellMap(title="", label="chance (%)", values=np.array([[1.0, 2.0]]), origin_m=(0.0, 0.0), cell_m=0.5)
    return draw_cell_maps([item, item], bounds_m=(0.0, 0.0, 0.5, 1.0), **axes)


def _ratios(**axes):
    ratios = {name: (1.0, 0.9, 1.1) for name in SIX}
    return draw_ratios([RatioRow(label="a", ratios=ratios)], x_label="ours / printed", **axes)


def _trajectories(**axes):
    item = Paths(title="", true_m=PATH, estimated_m=dict.fromkeys(SIX, PATH), tags_m=PATH)
    return draw_trajectories([item, item], **axes)


def _coverage(**axes):
    tags = np.array([1.0, 2.0])
    return draw_coverage_front(tags=tags, served=tags / 3.0, asked=tags, most=tags / 2.5, **axes)


def _patterns(**axes):
    item = PatternPicture(label="square", pattern=square(pitch_m=0.2), radius_m=0.05)
    return draw_patterns([item, item], **axes)


def _undersides(**axes):
    item = UndersidePicture(label="ring", group=LAYOUT.readers[0])
    return draw_undersides(ROBOT, [item, item], **axes)


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """How a figure is drawn, into how many axes of the caller's, and whether these are polar."""

    draw: Callable
    axes: int = 1
    polar: bool = False


CASES = {
    "draw_blind_rose": Case(draw=_rose, polar=True),
    "draw_cell_maps": Case(draw=_cells, axes=2),
    "draw_cost_bars": Case(draw=lambda **axes: draw_cost_bars({"a": dict.fromkeys(SIX, 1.0)}, **axes)),
    "draw_coverage_front": Case(draw=_coverage),
    "draw_curves": Case(draw=_curves, axes=2),
    "draw_detection_reach": Case(draw=_reach),
    "draw_direction_maps": Case(draw=_direction_maps, axes=2),
    "draw_docking_map": Case(draw=_docking_map),
    "draw_docking_paths": Case(draw=_docking_paths, axes=2),
    "draw_error_by_yaw": Case(draw=_yaw),
    "draw_error_over_time": Case(draw=_over_time),
    "draw_fleet_shares": Case(draw=lambda **axes: draw_fleet_shares([1], [1.0], [2.0], **axes)),
    "draw_floor_cells": Case(
        draw=lambda **axes: draw_floor_cells(SITE, [(0.0, 0.0), (1.0, 1.0)], [1, 5], 0.5, "runs", **axes)
    ),
    "draw_floor_rooms": Case(
        draw=lambda **axes: draw_floor_rooms(
            site=SITE, rooms=(box(1, 1, 2, 2),), reachable=box(1, 1, 3, 2), **axes
        )
    ),
    "draw_front": Case(draw=_front),
    "draw_layout_plan": Case(
        draw=lambda **axes: draw_layout_plan(layout=LAYOUT, site=SITE, robot=ROBOT, tag_map=TAGS, **axes)
    ),
    "draw_local_error": Case(draw=_local_error, axes=2),
    "draw_patterns": Case(draw=_patterns, axes=2),
    "draw_ratios": Case(draw=_ratios),
    "draw_replay": Case(draw=_replay, axes=4),
    "draw_trajectories": Case(draw=_trajectories, axes=2),
    "draw_undersides": Case(draw=_undersides, axes=2),
    "draw_whiskers": Case(draw=_whiskers, axes=2),
}
"""By name of the function; a new figure needs its own."""
