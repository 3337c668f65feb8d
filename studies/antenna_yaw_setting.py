"""Which numbers and yaws of UHF antennas are compared, with what is exact of each: cost, coverage, aliases."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, TypeVar

from layoutopt import registry
from layoutopt.errors import InvalidInput
from layoutopt.estimators.targets import TargetEstimator
from layoutopt.layout import FloorTags, Layout
from layoutopt.problem import Limit, Problem
from layoutopt.readers.finders import LARGEST_UHF_PORTS
from layoutopt.result import Evaluated
from layoutopt.scenario import Scenario
from layoutopt.score_text import counted_text, limit_text
from layoutopt.scores import TRACKING_UNITS
from layoutopt.simulation.tracking_trials import uhf_antennas
from layoutopt.simulation.walking import clutter
from layoutopt.spec.building import Spec
from layoutopt.spec.finders import TrackingSettings
from layoutopt.streams import Purpose, Streams
from objectives.cost import Cost
from objectives.tracking import Tracking
from objectives.uhf_coverage import UhfCoverage
from solvers.judging import exact_scores

COST: Final = "cost"
ERROR: Final = "tracking_error_mean"
CHEAP: Final = ("walk_coverage", "area_coverage", "expected_alias_share")
"""Exact scores that might stand in for the simulated error."""
EVERY_COUNT: Final = tuple(range(1, LARGEST_UHF_PORTS + 1))
EVERY_YAW_RAD: Final = tuple(math.radians(yaw_deg) for yaw_deg in range(0, 91, 15))
QUICK_DURATION_S: Final = 60.0
"""Two rounds of a walk of 12 m at 0.4 m/s."""
_QUICK_VALUES: Final = 3
_Item = TypeVar("_Item")


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """Some antennas at a yaw; ``evaluated`` holds the layout with its exact scores."""

    count: int
    yaw_rad: float
    evaluated: Evaluated

    @property
    def layout(self) -> Layout:
        """The layout: antennas on the robot, a tag on the target, nothing on the floor."""
        return self.evaluated.layout

    @property
    def label(self) -> str:
        """Words such as ``2 antennas at ±45°``."""
        return choice_label(self.count, self.yaw_rad)


def choice_label(count: int, yaw_rad: float) -> str:
    """Return number and yaw of antennas in words.

    >>> choice_label(1, 0.0), choice_label(2, math.pi / 4.0), choice_label(3, math.pi / 4.0)
    ('1 antenna at 0°', '2 antennas at ±45°', '3 antennas from −45° to 45°')
    """
    yaw_deg = math.degrees(yaw_rad)
    antennas = counted_text(count, "antenna")
    if count == 1 or yaw_deg == 0.0:
        return f"{antennas} at {yaw_deg:.4g}°"
    side_deg = f"{abs(yaw_deg):.4g}°"
    return f"{antennas} at ±{side_deg}" if count == 2 else f"{antennas} from −{side_deg} to {side_deg}"


def settings_of(spec: Spec) -> TrackingSettings:
    """Return what a spec says of tracking.

    Raises
    ------
    InvalidInput
        If the site has no room for the robot and the walk that are taken where a spec names none.
    ValueError
        If it was not read from a file, and nobody has filled that in.
    """
    if spec.tracking is None:
        raise ValueError("the spec says nothing of tracking; specs that are read from a file always do")
    if spec.tracking.lack:
        raise InvalidInput.at(
            "tracking",
            spec.tracking.lack,
            "Say under [tracking] where the robot stands (robot_at) and the corners of the walk (walk).",
        )
    return spec.tracking


def scenario_of(spec: Spec, *, quick: bool) -> Scenario:
    """Return the world in which a spec's target is tracked; a quick one lasts a minute at most."""
    scenario = spec.tracking_scenario
    most = max(1, round(QUICK_DURATION_S / scenario.step_s))
    return replace(scenario, step_count=min(scenario.step_count, most)) if quick else scenario


def problem_of(spec: Spec, scenario: Scenario) -> Problem:
    """Return the question for solvers and judges: cost against tracking error, and the spec's limits on either.

    Limits on scores of floor tags and docking belong to other studies and stand under ``elsewhere``.
    """
    limits = limits_of(spec)
    cost = Cost(prices=spec.prices, robot_count=spec.robot_count, reader_part=spec.reader_part)
    return Problem(
        space=spec.space,
        design=scenario,
        held_out=(),
        objectives=(cost, UhfCoverage(), Tracking()),
        goals=(COST, ERROR),
        limits=limits,
        estimators=(),
        elsewhere=tuple(limit_text(limit) for limit in spec.limits if limit not in limits),
    )


def limits_of(spec: Spec) -> tuple[Limit, ...]:
    """Return the limits of a spec on cost, coverage by UHF and tracking."""
    known = {COST, *CHEAP, *TRACKING_UNITS}
    return tuple(limit for limit in spec.limits if limit.score in known)


def tracker_of(settings: TrackingSettings, **changes: object) -> TargetEstimator:
    """Return the tracker that a spec names, with some of its settings changed."""
    tracker: TargetEstimator = registry.load("estimators", settings.estimator)(**changes)
    return tracker


def tracking_layout(
    settings: TrackingSettings,
    *,
    count: int | None = None,
    yaw_rad: float | None = None,
    interval_s: float | None = None,
) -> Layout:
    """Return antennas on the robot and tags on targets, with nothing on the floor."""
    antennas = settings.antennas(count=count, yaw_rad=yaw_rad, interval_s=interval_s)
    return Layout(floor_tags=FloorTags(zones=()), readers=(antennas,), target_tags=settings.target_tags)


def check_world(scenario: Scenario, layouts: Sequence[Layout], seed: int) -> None:
    """Raise before any trial what all of them would raise.

    Raises
    ------
    InvalidInput
        If robot or walk do not fit the site, what stands about finds no room, or no layout's antennas reach the
        walk.
    """
    clutter(scenario, Streams(seed=seed).generator(scenario.name, 0, Purpose.CLUTTER))
    reasons = []
    for layout in layouts:
        try:
            uhf_antennas(layout, scenario)
        except InvalidInput as error:
            reasons.append(error)
    if len(reasons) == len(layouts):
        raise reasons[0]


def choices_of(spec: Spec, problem: Problem, *, quick: bool) -> tuple[Choice, ...]:
    """Return the choices with their exact scores, by number and yaw; a quick look takes three of each at most.

    A spec that lists one number only, or one yaw only, leaves it open: then all numbers that a reader has ports
    for are compared, or all yaws from straight ahead to 90 degrees by 15, and the spec's own among them.

    Raises
    ------
    InvalidInput
        As `check_world`.
    """
    settings = settings_of(spec)
    counts: Sequence[int] = settings.counts if len(settings.counts) > 1 else EVERY_COUNT
    yaws: Sequence[float] = settings.yaws_rad if len(settings.yaws_rad) > 1 else EVERY_YAW_RAD
    if quick:
        counts, yaws = thinned(counts), thinned(yaws)
    own = (settings.counts[0],), (settings.yaws_rad[0],)
    counts, yaws = sorted({*counts, *own[0]}), sorted({*yaws, *own[1]})
    layouts = [tracking_layout(settings, count=count, yaw_rad=yaw_rad) for count in counts for yaw_rad in yaws]
    check_world(problem.design, layouts, spec.seed)
    found: dict[str, Choice] = {}
    for count in counts:
        for yaw_rad in yaws:
            layout = tracking_layout(settings, count=count, yaw_rad=yaw_rad)
            item = Evaluated(layout=layout, scores=exact_scores(problem, layout))
            found.setdefault(layout.key, Choice(count=count, yaw_rad=yaw_rad, evaluated=item))
    return tuple(found.values())


def thinned(values: Sequence[_Item]) -> list[_Item]:
    """Return at most three of some values: the first, the middle one and the last.

    >>> thinned([1, 2, 3, 4, 5]), thinned([1, 2])
    ([1, 3, 5], [1, 2])
    """
    if len(values) <= _QUICK_VALUES:
        return list(values)
    return [values[0], values[(len(values) - 1) // 2], values[-1]]
