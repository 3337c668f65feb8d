"""How fast robots may drive before accuracy suffers, beside the speed limits of their readers."""

from dataclasses import dataclass, replace
from typing import ClassVar, Final

from layoutopt.plots.curves import Panel
from layoutopt.protocols import StudyCard
from layoutopt.spec.building import Spec
from layoutopt.workers import Workers
from objectives.speed_limit import SpeedLimit
from studies.cells import UNFINISHED
from studies.swept import Axis, Found, Place, Sweep, SweepStudy, first_layout, point_of, sweep_of
from studies.swept_page import ends_shown, exact_curves, growth_lines, panel_of

CARD: Final = StudyCard(
    summary="Error and missed crossings against the speed of the robots, with the speed limits of the readers.",
    reference="own; mean chord of a circle (Crofton)",
    question="How fast may my robots drive before the error grows?",
    adaptive=False,
    rests_on="Errors are simulated in your world with one layout; differences are paired by drive, "
    "and one that is not shown may still be there. Slip that grows with speed is not modelled.",
    next_step="Set the speed under [robots] and run cost_vs_accuracy: a faster robot may need another layout.",
    guide="study_speed",
)
MULTIPLES: Final = (0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0, 4.0, 6.0, 10.0)
"""Of the spec's cruising speed: from half of it to a tenfold, which for 0.3 m/s is the pace of a running man."""
QUICK_MULTIPLES: Final = (0.5, 1.0, 4.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Speed(SweepStudy):
    """The spec's first layout with robots of several speeds."""

    sweep: Sweep
    limit_m_s: float
    centre_m_s: float
    title: ClassVar[str] = "Error against speed"
    command: ClassVar[str] = "speed"
    card: ClassVar[StudyCard] = CARD

    @classmethod
    def for_spec(cls, spec: Spec, *, quick: bool, workers: Workers | None = None) -> "Speed":
        """Return the study of a spec; a quick one has three speeds and two drives of each.

        Raises
        ------
        InvalidInput
            If no layout of the space can be built.
        """
        layout, estimator, scenario = first_layout(spec), spec.problem().estimators[0], spec.design
        own_m_s = scenario.robot.speed_m_s
        points = []
        for multiple in QUICK_MULTIPLES if quick else MULTIPLES:
            robot = replace(scenario.robot, speed_m_s=own_m_s * multiple)
            world = replace(scenario, robot=robot)
            scores = SpeedLimit()(layout, world, None)
            exact = {"missed_crossing_share": scores["missed_crossing_share"].value}
            place = Place(estimator.name, own_m_s * multiple)
            points.append(point_of(place, layout, world, estimator, quick=quick, exact=exact))
        limits = SpeedLimit()(layout, scenario, None)
        return cls(
            sweep=sweep_of(
                spec,
                layout.label,
                axis=Axis(name="speed_m_s", words="speed", unit="m/s"),
                points=points,
                base={estimator.name: Place(estimator.name, own_m_s)},
                estimators=estimator.name,
            ),
            limit_m_s=limits["speed_limit"].value,
            centre_m_s=limits["speed_limit_centre"].value,
        )

    def summary(self, found: Found) -> list[str]:
        """Return up to which speed the error stays, and how many crossings are missed."""
        lines = [line for series in self.sweep.series for line in growth_lines(self.sweep, found, series)]
        if not lines:
            return [UNFINISHED]
        own, fastest = self.sweep.base[self.sweep.series[0]].value, self.sweep.points[-1]
        missed = {p.place.value: p.exact["missed_crossing_share"] for p in self.sweep.points}
        lines.append(
            f"The slowest antenna reads a tag once a crossing on average up to {self.limit_m_s:.3g} m/s, and for "
            f"certain under its middle up to {self.centre_m_s:.3g} m/s. An antenna misses "
            f"{100.0 * missed[own]:.2g} % of the tags that it crosses at {own:g} m/s and "
            f"{100.0 * missed[fastest.place.value]:.2g} % at {fastest.place.value:g} m/s (exact, without faults)."
        )
        return lines

    def panels(self, found: Found) -> list[Panel]:
        """Return the error and the missed crossings over the speed."""
        most = self.sweep.points[-1].place.value
        limits = ((self.limit_m_s, "mean crossing"), (self.centre_m_s, "under the middle"))
        marks = tuple((value, word) for value, word in limits if value <= most)
        # The words stand in one panel alone: in the other they would meet that of the demand.
        bare = tuple((value, "") for value, _ in marks)
        missed = Panel(
            title="Crossings missed by an antenna",
            x_label=self.sweep.axis.label,
            y_label="crossings missed, exact (%)",
            curves=exact_curves(self.sweep, "missed_crossing_share", factor=100.0),
            marks=marks,
            log_x=True,
        )
        return [
            panel_of(
                self.sweep,
                found,
                "position_error_mean",
                "Position error",
                marks=bare,
                log_x=True,
                pointed_out=ends_shown(self.sweep, found),
            ),
            missed,
        ]

    def words(self) -> tuple[str, ...]:
        """Return what is kept and what the limits say."""
        return (
            "Drives last as long at every speed, over the same routes, so a faster robot comes farther. Its turns "
            "on the spot are as fast as before.",
            "Vertical lines are the limits of the slowest antenna: the speed at which a crossing takes one scan "
            "cycle on average, and that up to which a tag under the middle is never missed. They are of one "
            "antenna; other antennas may read what it missed, and the filter lives on fewer reads for a while.",
        )
