"""What a spec says, resolved: a frozen value that makes the problem to be solved."""

import dataclasses
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final

from layoutopt import registry
from layoutopt.layout import WHOLE_FLOOR
from layoutopt.parts import PriceList
from layoutopt.problem import Limit, Problem
from layoutopt.robot import Robot
from layoutopt.scenario import Faults, Role, Routes, Scenario
from layoutopt.score_text import limit_text
from layoutopt.scores import DOCKING_UNITS, TRACKING_UNITS
from layoutopt.site import Site
from layoutopt.space import DesignSpace, values_of
from layoutopt.tolerance import Tolerance

if TYPE_CHECKING:
    from shapely.geometry import Polygon

    from layoutopt.layout import ReaderProfile
    from layoutopt.protocols import Estimator, Mount, Objective
    from layoutopt.spec.finders import DockingSettings, TrackingSettings

DEFAULT_ESTIMATORS: Final = ("mcl_adaptive", "mcl", "midrange", "odometry", "odometry_gyro")
"""What a study validates with unless told otherwise; the first is also the estimator of the search."""

_JUDGED_BY: Final = {
    **dict.fromkeys((*TRACKING_UNITS, "area_coverage", "walk_coverage", "expected_alias_share"), "antenna_yaw"),
    **dict.fromkeys(
        (*DOCKING_UNITS, "direction_error_mean", "direction_bad_share", "scatterer_clearance"),
        "transponder_placement",
    ),
}
"""The study that looks at limits on scores of tracking and docking."""
_FIDELITIES: Final = ("exact", "published", "sampled", "simulated")


@dataclass(frozen=True, slots=True, kw_only=True)
class StudySettings:
    """Effort and trials of a study.

    Attributes
    ----------
    search_trials
        Trials of all layouts together; validation is not counted.
    validation_trials
        Held-out replications of each recommended layout, in each scenario and with each estimator.
    validate_with
        Names of the estimators; the first is also that of the search.
    alternatives
        How many layouts that truly differ the main study offers beside the recommended one.
    least_difference
        How much every two of them differ at least, 0 to 1 as `solvers.layout_difference` counts it.
    alternative_tolerance
        How much worse than the recommended layout an alternative may be, as a share of cost and error.
    particles
        Particles of every estimator that has some, at most; ``None`` leaves each its own number.
    step_s, duration_s
        Time step and length of one trial.
    start_known
        Whether the estimators know anything of the start.
    start_sigma_m, start_sigma_rad
        Standard deviations of the start that the estimators are told, if they know it.
    design_faults, held_out_faults
        What goes wrong in the search, and in the second held-out scenario.
    tolerance
        How far the installation may be off, for robust layouts.
    """

    search_trials: int = 4000
    validation_trials: int = 200
    validate_with: tuple[str, ...] = DEFAULT_ESTIMATORS
    alternatives: int = 3
    least_difference: float = 0.2
    alternative_tolerance: float = 0.2
    particles: int | None = None
    step_s: float = 0.05
    duration_s: float = 60.0
    start_known: bool = True
    start_sigma_m: float = 0.05
    start_sigma_rad: float = 0.05
    design_faults: Faults = field(default_factory=Faults)
    held_out_faults: Faults = field(default_factory=Faults)
    tolerance: Tolerance = field(default_factory=Tolerance)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacementDemand:
    """At least ``tags`` tags in view on every straight run of ``length_m``; a length of zero is a pose.

    ``zone`` is where runs begin (``""``: anywhere), ``along_routes`` asks for runs along the routes only, and runs
    that touch a zone of ``without`` are not asked for.
    """

    zone: str = WHOLE_FLOOR
    length_m: float = 1.0
    tags: int = 1
    along_routes: bool = True
    without: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacementSettings:
    """Where single tags may lie, and what robots must see of them.

    Attributes
    ----------
    slots
        ``"grid"``, ``"joints"``, ``"centres"``, or ``"listed"`` with the places in ``listed_m``.
    pitch_m
        Of a grid.
    spacing_m, tags_per_tile
        Least distance of two tags, and most tags on one floor tile.
    installed_m, forbidden_m, required_m
        Tags that lie there already, slots not to be used, and slots that get a tag in any case.
    unserved_share
        Share of the runs that may be left out because no slot could serve them.
    aim
        ``"cost"``, ``"coverage"``, ``"gap"`` or ``"front"``.
    budget_eur
        For the new tags laid; ``None`` for none.
    stages
        Zones of each stage; empty for all at once.
    reader
        Number, from 1, of the reader group among the options of the space; ``None`` for the first that can be
        built.
    """

    slots: str = "grid"
    listed_m: tuple[tuple[float, float], ...] = ()
    pitch_m: float = 0.047
    demands: tuple[PlacementDemand, ...] = (PlacementDemand(),)
    spacing_m: float = 0.0
    tags_per_tile: int | None = None
    installed_m: tuple[tuple[float, float], ...] = ()
    forbidden_m: tuple[tuple[float, float], ...] = ()
    required_m: tuple[tuple[float, float], ...] = ()
    unserved_share: float = 0.01
    aim: str = "cost"
    budget_eur: float | None = None
    stages: tuple[tuple[str, ...], ...] = ()
    reader: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Spec:
    """A question as the user wrote it, with every name resolved.

    Attributes
    ----------
    prices, reader_part
        Price list, and its item that reads: ``"reader_module"`` or ``"industrial_reader"``.
    goals
        Scores to minimise, cost first.
    own_limits
        Demands listed under ``limits``; `limits` adds target and budget.
    target_error_m, budget_eur
        Demand on ``position_error_mean`` over the whole floor, and on ``cost``; ``None`` for none.
    placement
        The question of the study of single tags.
    tracking, docking
        The questions of finding things off the floor; a spec that was read has both. ``None`` for a spec that was
        made by hand.
    rooms
        Rooms that the plan draws one by one; empty if it draws none, or for corners in the spec.
    notes
        What plan reader and spec reader read, left out or simplified, one sentence each.
    """

    seed: int
    site: Site
    robot: Robot
    robot_count: int
    routes: Routes
    prices: PriceList
    reader_part: str
    space: DesignSpace
    goals: tuple[str, ...]
    own_limits: tuple[Limit, ...]
    target_error_m: float | None
    budget_eur: float | None
    study: StudySettings
    placement: PlacementSettings = field(default_factory=PlacementSettings)
    tracking: "TrackingSettings | None" = None
    docking: "DockingSettings | None" = None
    rooms: tuple["Polygon", ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def mounts(self) -> tuple[tuple["Mount", ...], ...]:
        """For each family of readers, every way that is enumerated in which its antennas may be built."""
        return tuple(values_of(family.values["mount"]) for family in self.space.readers)

    @property
    def reader_profile(self) -> "ReaderProfile":
        """The profile under which all readers are built."""
        return self.mounts[0][0].profile

    @property
    def limits(self) -> tuple[Limit, ...]:
        """All demands: the target first, then each zone's own, the budget, and those listed."""
        found = []
        if self.target_error_m is not None:
            found.append(Limit(score="position_error_mean", upper=self.target_error_m))
        for zone in self.site.zones:
            if zone.target_error_m is not None:
                found.append(Limit(score=f"{zone.name}.position_error_mean", upper=zone.target_error_m))
        if self.budget_eur is not None:
            found.append(Limit(score="cost", upper=self.budget_eur))
        return (*found, *self.own_limits)

    @property
    def design(self) -> Scenario:
        """The scenario to search in."""
        return self._scenario(f"design/{self.routes.kind}", Role.DESIGN, self.routes, self.study.design_faults)

    @property
    def held_out(self) -> tuple[Scenario, ...]:
        """Two scenarios for validation only: other routes, and other routes with more faults."""
        kind = "point_to_point" if self.routes.kind != "point_to_point" else "patrol"
        other = Routes(kind=kind, heading_rad=self.routes.heading_rad)
        return (
            self._scenario(f"held-out/{other.kind}", Role.HELD_OUT, other, self.study.design_faults),
            self._scenario("held-out/faults", Role.HELD_OUT, other, self.study.held_out_faults),
        )

    @property
    def tracking_scenario(self) -> Scenario:
        """The scenario in which a robot tracks a target.

        Raises
        ------
        ValueError
            If the spec says nothing of tracking.
        """
        if self.tracking is None:
            raise ValueError("the spec says nothing of tracking")
        return replace(
            self._scenario("tracking", Role.HELD_OUT, self.routes, self.study.design_faults),
            step_count=max(1, round(self.tracking.duration_s / self.study.step_s)),
            tracking=self.tracking.world,
        )

    @property
    def docking_scenario(self) -> Scenario:
        """The scenario in which robots dock; its noise of directions is that of the docking settings.

        Raises
        ------
        ValueError
            If the spec says nothing of docking.
        """
        if self.docking is None:
            raise ValueError("the spec says nothing of docking")
        faults = replace(self.study.design_faults, direction_noise_rad=self.docking.noise_rad)
        return replace(
            self._scenario("docking", Role.HELD_OUT, self.routes, faults),
            scatterers_m=self.docking.scatterers_m,
            docking=self.docking.world,
        )

    def problem(self) -> Problem:
        """Return the question for a solver, with objectives and estimators loaded."""
        return Problem(
            space=self.space,
            design=self.design,
            held_out=self.held_out,
            objectives=self._objectives(),
            goals=self.goals,
            limits=tuple(limit for limit in self.limits if limit.score not in _JUDGED_BY),
            estimators=tuple(self._estimator(name) for name in self.study.validate_with),
            elsewhere=self.limits_elsewhere,
        )

    @property
    def limits_elsewhere(self) -> tuple[str, ...]:
        """Limits at which searches of floor tags do not look, each with the study that does, in words."""
        return tuple(
            f"{limit_text(limit)} (layoutopt study {_JUDGED_BY[limit.score]})"
            for limit in self.limits
            if limit.score in _JUDGED_BY
        )

    def _scenario(self, name: str, role: Role, routes: Routes, faults: Faults) -> Scenario:
        return Scenario(
            name=name,
            role=role,
            site=self.site,
            robot=self.robot,
            routes=routes,
            faults=faults,
            step_s=self.study.step_s,
            step_count=max(1, round(self.study.duration_s / self.study.step_s)),
            start_known=self.study.start_known,
            start_sigma_m=self.study.start_sigma_m,
            start_sigma_rad=self.study.start_sigma_rad,
        )

    def _objectives(self) -> tuple["Objective", ...]:
        """Return every objective of the table, exact ones first; only cost needs to be told anything."""
        money = {"prices": self.prices, "robot_count": self.robot_count, "reader_part": self.reader_part}
        made: list[Objective] = [
            registry.load("objectives", name)(**(money if name == "cost" else {}))
            for name in registry.names("objectives")
        ]
        return tuple(sorted(made, key=lambda objective: _FIDELITIES.index(objective.card.fidelity)))

    def _estimator(self, name: str) -> "Estimator":
        estimator = registry.load("estimators", name)
        settings = {field.name for field in dataclasses.fields(estimator)}
        told = self.study.particles is not None and "particles" in settings
        made: Estimator = estimator(particles=self.study.particles) if told else estimator()
        return made
