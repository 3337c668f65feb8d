"""How carefully tags must be laid: error of each estimator against the standard deviation of their places."""

from dataclasses import dataclass, replace
from typing import ClassVar, Final

from layoutopt.plots.curves import Panel
from layoutopt.protocols import StudyCard
from layoutopt.spec.building import Spec
from layoutopt.workers import Workers
from studies.cells import UNFINISHED
from studies.swept import (
    Axis,
    Found,
    Place,
    Sweep,
    SweepStudy,
    first_layout,
    point_of,
    sweep_of,
    tag_estimators,
)
from studies.swept_page import ends_shown, growth_lines, panel_of

CARD: Final = StudyCard(
    summary="Error of the spec's estimators against the standard deviation of the places of laid tags.",
    reference="own",
    question="How carefully must the tags be laid?",
    adaptive=False,
    rests_on="Errors are simulated in your world with one layout, every tag off by a normal error of "
    "its own; a whole sheet of tags that is shifted is not looked at.",
    next_step="Hand the tolerance to the installer, or survey the tags after laying and bring the "
    "survey back with layoutopt commission.",
    guide="study_placement_tolerance",
)
SIGMAS_M: Final = (0.0, 0.001, 0.002, 0.003, 0.005, 0.008, 0.012, 0.02)
"""From tags that are surveyed one by one to those that are laid by eye."""
QUICK_SIGMAS_M: Final = (0.0, 0.005, 0.02)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacementTolerance(SweepStudy):
    """The spec's first layout with tags beside their places, for every estimator of the spec that reads tags."""

    sweep: Sweep
    title: ClassVar[str] = "Error against the placement of tags"
    command: ClassVar[str] = "placement_tolerance"
    card: ClassVar[StudyCard] = CARD

    @classmethod
    def for_spec(cls, spec: Spec, *, quick: bool, workers: Workers | None = None) -> "PlacementTolerance":
        """Return the study of a spec; a quick one has three deviations and two drives of each.

        Raises
        ------
        InvalidInput
            If no layout of the space can be built.
        """
        layout, scenario = first_layout(spec), spec.design
        estimators, refused = tag_estimators(spec, layout)
        names = [estimator.name for estimator in estimators]
        worlds = {
            sigma_m: replace(scenario, faults=replace(scenario.faults, tag_placement_sigma_m=sigma_m))
            for sigma_m in (QUICK_SIGMAS_M if quick else SIGMAS_M)
        }
        points = [
            point_of(Place(estimator.name, sigma_m), layout, world, estimator, quick=quick)
            for estimator in estimators
            for sigma_m, world in worlds.items()
        ]
        return cls(
            sweep=sweep_of(
                spec,
                layout.label,
                axis=Axis(name="tag_placement_sigma_m", words="placement deviation", unit="mm", factor=1000.0),
                points=points,
                base={name: Place(name, 0.0) for name in names},
                estimators=", ".join(names),
                refused=refused,
            )
        )

    def summary(self, found: Found) -> list[str]:
        """Return for each estimator up to which deviation the error stays."""
        lines = [line for series in self.sweep.series for line in growth_lines(self.sweep, found, series)]
        return lines or [UNFINISHED]

    def panels(self, found: Found) -> list[Panel]:
        """Return position and heading error over the deviation."""
        return [
            panel_of(
                self.sweep,
                found,
                "position_error_mean",
                "Position error",
                pointed_out=ends_shown(self.sweep, found),
            ),
            panel_of(self.sweep, found, "heading_error_mean", "Heading error"),
        ]

    def words(self) -> tuple[str, ...]:
        """Return what the deviation is, and who knows of it."""
        return (
            "The placement deviation is the standard deviation of the true place of a tag about its planned one, "
            "along x and along y; every tag is off by its own amount, "
            "others in every drive. No estimator is told, and the tag map holds the "
            "planned places: a floor that is surveyed after it was laid errs by the survey instead.",
        )
