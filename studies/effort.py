"""What a spec describes, in numbers, and what a study of it would take."""

import functools
import math
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import shapely

from layoutopt.errors import Interrupted, WorkerDied
from layoutopt.layout import WHOLE_FLOOR
from layoutopt.plans.placing import listed
from layoutopt.plans.rooms import PASSAGE_M, rooms_of
from layoutopt.protocols import Plan, Task
from layoutopt.reach import reach_m
from layoutopt.score_text import limit_text
from layoutopt.simulation.routes import CLEARANCE_M, reachable_region
from layoutopt.simulation.trials import run_trials, warm_up
from layoutopt.site import CORNERS, INLINE
from layoutopt.spec.building import Spec
from layoutopt.streams import Streams
from layoutopt.units import format_duration, format_length
from layoutopt.workers import Lost, Workers

if TYPE_CHECKING:
    from shapely.geometry import Polygon

START_AND_END_S: Final = 8.0
"""What a study takes beside its trials: to start workers, to score what is exact, to draw and to write."""
LITTLE_SHARE: Final = 0.25
"""Where robots reach a smaller share of the floor, it is told: plan and outline may not fit each other."""
_SHOWN_M2: Final = 0.05
"""What one decimal of a square metre shows."""
_ROUNDED_M: Final = 0.01
"""Outlines of maps are ragged; by so much a corner may hold a larger circle than that of straight walls."""
_LEAST_POCKET_M2: Final = 0.1
"""A smaller one takes a tag or two."""
_PILOT_TRIALS: Final = 3
_MOST_ROOMS: Final = 30
_NO_DEMAND: Final = (
    'A study then shows what accuracy costs; target_error = "20 mm" in [goal] asks for the cheapest.'
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """Mean time of a planned trial, and the run time predicted from a pilot on this machine."""

    trial_s: float
    seconds: float


def describe(spec: Spec) -> list[str]:
    """Return the lines that ``layoutopt check`` prints of site, robots and design space."""
    site, robot = spec.site, spec.robot
    xmin, ymin, xmax, ymax = site.bounds_m
    reachable, for_tags = reachable_region(site, robot), site.taggable_region(tag_part=spec.space.tag_part)
    lines = [
        f"site: {site.name}, from {CORNERS if site.source == INLINE else site.source}",
        f"extents: {xmax - xmin:.2f} m x {ymax - ymin:.2f} m, "
        f"from ({xmin:.2f}, {ymin:.2f}) to ({xmax:.2f}, {ymax:.2f})",
        f"floor: {site.floor.area:.1f} m², free of obstacles {site.open_floor.area:.1f} m², "
        f"for tags {for_tags.area:.1f} m², for the robot's centre {reachable.area:.1f} m²",
        f"robots: {spec.robot_count}, {robot.drive.value}, turning circle {format_length(2 * robot.radius_m)}, "
        f"{robot.speed_m_s:g} m/s",
    ]
    lines += _rooms(spec)
    if reachable.area < LITTLE_SHARE * site.floor.area:
        lines.append(
            f"note: the robot's centre reaches only {reachable.area / site.floor.area:.0%} of the floor; "
            "check plan, map mode and outline"
        )
    for zone in site.zones:
        rules = [
            f"target {format_length(zone.target_error_m)}" if zone.target_error_m is not None else "",
            "" if zone.tags else "no tags",
            "metal" if zone.metal else "",
            "" if zone.drill else "no drilling",
        ]
        lines.append(
            f"zone {zone.name}: {zone.region.area:.2f} m² {', '.join(rule for rule in rules if rule)}".rstrip()
        )
    lines += finder_lines(spec)
    lines += _pockets(spec, reachable)
    lines += [f"note: {note}" for note in spec.notes]
    demand = "; ".join(limit_text(limit) for limit in spec.limits)
    lines.append(f"demand: {demand}" if demand else f"demand: none. {_NO_DEMAND}")
    lines.append(f"prices: {spec.prices.name} of {spec.prices.date}")
    return lines


def finder_lines(spec: Spec) -> list[str]:
    """Return what the tables of tracking and docking say, where layouts carry what they are about."""
    lines = []
    tracking, docking = spec.tracking, spec.docking
    if tracking is not None and tracking.fitted:
        world = tracking.world
        x_m, y_m, heading_rad = world.robot_pose
        choices = len(tracking.counts) * len(tracking.yaws_rad) * len(tracking.intervals_s)
        more = f" (the first of {choices} choices)" if choices > 1 else ""
        lines += [
            f"tracking: every robot carries {tracking.antennas().label}{more}, a sample every "
            f"{format_duration(tracking.intervals_s[0])}; UHF tags given out: {tracking.target_tags}",
            f"  judged by {tracking.estimator} in {tracking.trials} trials of "
            f"{tracking.duration_s:g} s: robot at ({x_m:.2f}, {y_m:.2f}) m, heading "
            f"{math.degrees(heading_rad):.0f}°, walk of {len(world.walk_m)} corners at "
            f"{world.walking_speed_m_s:g} m/s; bystanders {world.bystanders}, things that stand about "
            f"{world.clutter_count}",
            "  the robots' laser scanner is taken as there and is not priced",
        ]
    if docking is not None and docking.fitted:
        place = docking.transponder_m
        where = (
            "no place yet, layoutopt study transponder_placement seeks one"
            if place is None
            else f"at ({place[0]:.2f}, {place[1]:.2f}) m"
        )
        lines += [
            f"docking: every robot carries crossed antennas; transponder of "
            f"{docking.world.frequency_hz / 1e6:g} MHz: {where}",
            f"  judged by {docking.estimator} in {docking.trials} drives: scatterers {len(docking.scatterers_m)}, "
            f"and {docking.world.random_scatterers} at random places",
        ]
    lines += [f"limit not looked at by searches of floor tags: {text}" for text in spec.limits_elsewhere]
    return lines


def draw_plan(spec: Spec, path: Path) -> tuple[Path, Path]:
    """Write a picture of plan, rooms and free space as ``path`` with .svg and .png, and return both names."""
    from layoutopt.plots.figures import save
    from layoutopt.plots.floor_rooms import draw_floor_rooms

    axes = draw_floor_rooms(
        site=spec.site, rooms=rooms_to_show(spec), reachable=reachable_region(spec.site, spec.robot)
    )
    return save(axes, path.with_suffix("") if path.suffix in (".png", ".svg") else path)


def rooms_to_show(spec: Spec) -> "tuple[Polygon, ...]":
    """Return the rooms that the plan draws or, if it draws none, those that narrow passages divide."""
    return spec.rooms or rooms_of(spec.site.open_floor)


def _rooms(spec: Spec) -> list[str]:
    rooms = rooms_to_show(spec)
    if not rooms:
        return []
    areas = listed([f"{room.area:.1f}" for room in rooms], _MOST_ROOMS)
    how = (
        "as the plan draws them"
        if spec.rooms
        else f"where passages below {format_length(PASSAGE_M)} divide the floor"
    )
    passages_m2 = spec.site.open_floor.area - sum(room.area for room in rooms)
    rest = f"; {passages_m2:.1f} in no room" if passages_m2 >= _SHOWN_M2 else ""
    return [f"rooms: {len(rooms)}, {how}, m²: {areas}{rest}"]


def _pockets(spec: Spec, reachable: "Polygon") -> list[str]:
    """Return what lies on the floor where no reader of the space ever comes, strips along walls aside.

    A robot that keeps off a wall leaves a strip, which is widest in a corner: what holds a larger circle than that
    corner is a pocket. Patterns are laid there too, and the studies of costs do not leave their tags out.
    """
    groups = [group for family in spec.space.readers for group in family.options()]
    patterns = spec.space.patterns.get(WHOLE_FLOOR, ())
    densities = [pattern.density_per_m2 for family in patterns for pattern in family.options()]
    if not groups or not densities:
        return []
    farthest_m = max(reach_m(group) for group in groups)
    beyond = spec.site.taggable_region(tag_part=spec.space.tag_part).difference(reachable.buffer(farthest_m))
    # The circle in a right corner that touches both walls and the reach about the robot's nearest place.
    corner_m = (math.sqrt(2.0) * (spec.robot.radius_m + CLEARANCE_M) - farthest_m) / (1.0 + math.sqrt(2.0))
    kept_m = max(corner_m, 0.0) + _ROUNDED_M
    opened = beyond.buffer(-kept_m).buffer(kept_m, join_style="mitre").intersection(beyond)
    pockets = [part for part in shapely.get_parts(opened) if part.area >= _LEAST_POCKET_M2]
    if not pockets:
        return []
    area_m2 = sum(part.area for part in pockets)
    fewest, most = (round(area_m2 * density) for density in (min(densities), max(densities)))
    count = f"{fewest} tags" if fewest == most else f"{fewest} to {most} tags, by the pattern,"
    largest = max(pockets, key=lambda part: part.area).representative_point()
    where = f"the largest near ({largest.x:.2f}, {largest.y:.2f}) m"
    return [
        f"note: {area_m2:.2f} m² in {len(pockets)} pocket(s), {where}, are in reach of no antenna: about {count} "
        "are laid and paid there that no robot reads; a zone with tags = false over a pocket saves them, and "
        "so does closing it in the plan"
    ]


def predict(plan: Plan, seed: int, workers: Workers) -> Effort:
    """Return the effort of a study's trials, measured on the tasks of its pilot by those who would run them.

    The pilot must have a task.

    Raises
    ------
    Interrupted
        If the workers were asked to stop.
    WorkerDied
        If a task of the pilot has no result.
    """
    tasks = [task for task, _ in plan.pilot]
    measured = dict(workers.map(functools.partial(_trial_seconds, seed=seed), tasks))
    total_s = 0.0
    for number, (_, trials) in enumerate(plan.pilot):
        if number not in measured:
            raise Interrupted("stopped as asked")
        trial_s = measured[number]
        if isinstance(trial_s, Lost):
            raise WorkerDied(f"a task of the pilot {trial_s.kind.value}: {trial_s.message}")
        total_s += trials * trial_s
    return Effort(trial_s=total_s / sum(trials for _, trials in plan.pilot), seconds=total_s / workers.jobs)


def plan_lines(plan: Plan, seed: int, workers: Workers) -> list[str]:
    """Return what a study would run, and how long that takes here; without a pilot nothing is predicted."""
    if not plan.pilot:
        return list(plan.lines)
    effort = predict(plan, seed, workers)
    by = f"{workers.jobs} workers" if workers.jobs != 1 else "1 worker"
    return [
        *plan.lines,
        f"predicted: {format_duration(effort.seconds + START_AND_END_S)} with {by}: "
        f"{effort.trial_s * 1000.0:.0f} ms a trial, measured on a pilot of {len(plan.pilot)} tasks, and "
        f"{START_AND_END_S:g} s to start and to write",
    ]


def _trial_seconds(task: Task, seed: int) -> float:
    """Return the mean time of a trial, once what a process keeps of site and layout is there.

    A task of more trials than `_PILOT_TRIALS` is run whole: they may cost less together than alone.
    """
    warm_up()
    streams = Streams(seed=seed)
    run_trials(task.layout, task.scenario, task.estimator, streams, 0, 1)
    began = time.perf_counter()
    count = max(_PILOT_TRIALS, task.count)
    run_trials(task.layout, task.scenario, task.estimator, streams, 0, count)
    return (time.perf_counter() - began) / count
