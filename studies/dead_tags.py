"""How many tags may fail before the robots notice: error and time lost against the share of dead tags."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import ClassVar, Final

import numpy as np

from layoutopt import registry
from layoutopt.identity import FloatArray
from layoutopt.layout import TagMap
from layoutopt.plots.curves import Panel
from layoutopt.protocols import StudyCard
from layoutopt.scenario import Faults, Scenario, TruePlaces
from layoutopt.score_text import percent_text
from layoutopt.spec.building import Spec
from layoutopt.workers import Workers
from studies.cells import UNFINISHED
from studies.swept import Axis, Found, Place, Sweep, SweepStudy, first_layout, point_of, sweep_of
from studies.swept_page import ends_shown, error_text, growth_lines, panel_of, shown

CARD: Final = StudyCard(
    summary="Error and share of time lost against the share of dead tags, strewn over the floor or in one patch.",
    reference="own",
    question="How many tags may fail before my robots lose their way?",
    adaptive=False,
    rests_on="Errors are simulated in your world with one layout; differences are paired by drive. "
    "Robots are not told which tags are dead.",
    next_step="Plan spares and inspections for the share that is told, and set dead_tag_share of the "
    "held-out faults to it; cost_vs_accuracy then judges by it.",
    guide="study_dead_tags",
)
SHARES: Final = (0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7)
QUICK_SHARES: Final = (0.0, 0.1, 0.5)
STREWN: Final = "strewn"
PATCH: Final = "in one patch"
NONE_LEFT: Final = "no tag at all (odometry)"


@dataclass(frozen=True, slots=True, kw_only=True)
class DeadTags(SweepStudy):
    """The spec's first layout with ever more tags that never answer; ``patch_m`` is the middle of the patch."""

    sweep: Sweep
    patch_m: tuple[float, float]
    title: ClassVar[str] = "Error against dead tags"
    command: ClassVar[str] = "dead_tags"
    card: ClassVar[StudyCard] = CARD

    @classmethod
    def for_spec(cls, spec: Spec, *, quick: bool, workers: Workers | None = None) -> "DeadTags":
        """Return the study of a spec; a quick one has three shares and two drives of each.

        Raises
        ------
        InvalidInput
            If no layout of the space can be built.
        """
        layout, estimator, scenario = first_layout(spec), spec.problem().estimators[0], spec.design
        shares = QUICK_SHARES if quick else SHARES
        tags = layout.floor_tags.lay_on(spec.site)
        middle_m = np.array(spec.site.floor.centroid.coords[0])
        points = [
            point_of(Place(series, share), layout, world, estimator, quick=quick)
            for share in shares
            for series, world in worlds(scenario, tags, share, middle_m)
        ]
        odometry = registry.load("estimators", "odometry")()
        points += [
            point_of(Place(NONE_LEFT, share), layout, scenario, odometry, quick=quick)
            for share in (shares[0], shares[-1])
        ]
        return cls(
            sweep=sweep_of(
                spec,
                layout.label,
                axis=Axis(name="dead_tag_share", words="share of dead tags", unit="%", factor=100.0),
                points=points,
                base={STREWN: Place(STREWN, 0.0), PATCH: Place(PATCH, 0.0)},
                estimators=f"{estimator.name}, which is not told; odometry",
            ),
            patch_m=(float(middle_m[0]), float(middle_m[1])),
        )

    def summary(self, found: Found) -> list[str]:
        """Return up to which share the error stays, and what is lost at the end."""
        lines = []
        for series in (STREWN, PATCH):
            lines += growth_lines(self.sweep, found, series)
            last = self.sweep.of(series)[-1].place
            if last in found:
                lost = shown(found[last].score("lost_share"), "lost_share")
                lines.append(f"{series}: with {percent_text(last.value)} dead the share of time lost is {lost} %.")
        odometry = self.sweep.of(NONE_LEFT)[-1].place
        if lines and odometry in found:
            lines.append(f"Without any tag, by odometry alone, the mean error is {error_text(found, odometry)}.")
        return lines or [UNFINISHED]

    def panels(self, found: Found) -> list[Panel]:
        """Return the error and the time lost over the share of dead tags."""
        return [
            panel_of(
                self.sweep,
                found,
                "position_error_mean",
                "Position error",
                log=True,
                pointed_out=ends_shown(self.sweep, found),
            ),
            panel_of(self.sweep, found, "lost_share", "Time lost"),
        ]

    def words(self) -> tuple[str, ...]:
        """Return how tags fail here, and who knows of it."""
        x_m, y_m = self.patch_m
        return (
            "Strewn: each tag is dead by chance, others in every drive. In one patch: the tags nearest to "
            f"({x_m:.2f}, {y_m:.2f}) m, the middle of the floor, are dead in every drive, as after a new floor "
            "covering or a flood. The estimator is told of neither.",
            "Lost is a robot whose position is off by more than 250 mm. A patch hurts where robots pass it: what "
            "it does elsewhere on the floor is another question.",
        )


def worlds(scenario: Scenario, tags: TagMap, share: float, middle_m: FloatArray) -> Iterator[tuple[str, Scenario]]:
    """Yield both worlds in which a share of the tags is dead: strewn, and in a patch about a place.

    Dead tags that the spec's own faults already have are replaced by these.
    """
    faults = replace(scenario.faults, dead_tag_share=share)
    yield STREWN, replace(scenario, faults=faults)
    yield PATCH, replace(scenario, faults=with_patch(replace(faults, dead_tag_share=0.0), tags, share, middle_m))


def with_patch(faults: Faults, tags: TagMap, share: float, middle_m: FloatArray) -> Faults:
    """Return faults in which the share of the tags nearest to a place never answers."""
    count = round(share * len(tags))
    if not count:
        return faults
    distance_m = np.linalg.norm(tags.xy_m - middle_m, axis=1)
    silent = np.sort(tags.ids[np.argsort(distance_m, kind="stable")[:count]])
    known = faults.true_places
    moved_id, moved_m = (np.empty(0, np.int64), np.empty((0, 2))) if known is None else (known.tag_id, known.xy_m)
    if known is not None:
        silent = np.union1d(silent, known.silent)
    return replace(faults, true_places=TruePlaces(tag_id=moved_id, xy_m=moved_m, silent=silent))
