"""How many antennas, and how far apart: position and heading error against number and spread, with the cost."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import ClassVar, Final

from layoutopt.layout import Layout, ReaderGroup
from layoutopt.plots.curves import Panel
from layoutopt.protocols import Mount, StudyCard
from layoutopt.readers.cross import cross
from layoutopt.readers.ring import ring
from layoutopt.robot import Robot
from layoutopt.score_text import counted_text, euros
from layoutopt.spec.building import Spec
from layoutopt.workers import Workers
from studies.cells import UNFINISHED
from studies.reader_group_setting import mount_of
from studies.swept import (
    Axis,
    Found,
    Place,
    Sweep,
    SweepStudy,
    change,
    cheapest_meeting,
    costs_eur,
    first_layout,
    point_of,
    reason_against,
    sweep_of,
)
from studies.swept_page import change_text, cheapest_line, error_text, exact_curves, panel_of, shown

CARD: Final = StudyCard(
    summary="Position and heading error and cost against the number of antennas and how far apart they are.",
    reference="own; mi2016, Section 4, for the question",
    question="How many antennas does a robot need, and how far apart?",
    adaptive=False,
    rests_on="Errors are simulated in your world with one pattern and one kind of antenna; "
    "differences are paired by drive, and one that is not shown may still be there. Costs are exact "
    "for your prices.",
    next_step="Put the numbers and spreads that are worth their price into the readers of [space], "
    "and run cost_vs_accuracy, which varies all at once.",
    guide="study_reader_count",
)
COUNTS: Final = (1, 2, 3, 4, 6, 8, 12)
QUICK_COUNTS: Final = (1, 4, 8)
SPREADS: Final = (1 / 3, 2 / 3, 1.0)
"""Radii of rings, as shares of the widest that the robot has room for."""
HEADING: Final = "heading_error_mean"


@dataclass(frozen=True, slots=True, kw_only=True)
class ReaderCount(SweepStudy):
    """Rings and crosses with the mount of the spec's first layout over its floor."""

    sweep: Sweep
    title: ClassVar[str] = "Error against number and spread of antennas"
    command: ClassVar[str] = "reader_count"
    card: ClassVar[StudyCard] = CARD

    @classmethod
    def for_spec(cls, spec: Spec, *, quick: bool, workers: Workers | None = None) -> "ReaderCount":
        """Return the study of a spec; a quick one has three numbers and two drives of each.

        Raises
        ------
        InvalidInput
            If no layout of the space can be built.
        """
        layout, estimator = first_layout(spec), spec.problem().estimators[0]
        own = layout.floor_readers[0]
        points, refused = [], []
        for series, count, group in groups_of(mount_of(own), spec.robot, counts=QUICK_COUNTS if quick else COUNTS):
            made = with_readers(layout, group)
            if reason := reason_against(made, spec.design, estimator):
                refused.append((f"{series}, {counted_text(count, 'antenna')}", reason))
                continue
            exact = {**costs_eur(spec, made), "spread_m": spread_m(group)}
            points.append(point_of(Place(series, count), made, spec.design, estimator, quick=quick, exact=exact))
        base = _base_of([point.place for point in points], own.count)
        return cls(
            sweep=sweep_of(
                spec,
                f"{layout.label}, of which floor and mount are kept",
                axis=Axis(name="antennas", words="number of antennas"),
                points=points,
                base={} if base is None else {point.place.series: base for point in points},
                estimators=estimator.name,
                refused=refused,
            )
        )

    def summary(self, found: Found) -> list[str]:
        """Return what more antennas and a wider ring bring, and what they cost."""
        bases = set(self.sweep.base.values())
        if not bases or not bases <= found.keys():
            return [UNFINISHED]
        (base,) = bases
        cost = {point.place: point.exact["cost_eur"] for point in self.sweep.points}
        wide = [point.place for point in self.sweep.of(base.series) if point.place in found]
        ends = [
            f"{counted_text(int(place.value), 'antenna')} {error_text(found, place)} and "
            f"{shown(found[place].score(HEADING), HEADING)}° for {euros(cost[place])}"
            for place in dict.fromkeys((wide[0], base, wide[-1]))
        ]
        widest = f"Mean error and heading error on a {base.series}: {'; '.join(ends)}."
        lines = [*cheapest_line(self.sweep, found), widest]
        others = [place for place in (wide[0], wide[-1]) if place != base]
        same = [
            p.place for p in self.sweep.points if p.place.value == base.value and p.place.series != base.series
        ]
        others += [place for place in same if place in found]
        for place in others:
            position, heading = change(self.sweep, found, place), change(self.sweep, found, place, HEADING)
            if position is None or heading is None:
                continue
            more = cost[place] - cost[base]
            money = "the same cost" if not more else f"{euros(abs(more))} {'more' if more > 0.0 else 'less'}"
            lines.append(
                f"Against {counted_text(int(base.value), 'antenna')} on the {base.series}: "
                f"{counted_text(int(place.value), 'antenna')}, {place.series}, {money}: position "
                f"{change_text(position)}; heading {change_text(heading, HEADING)}."
            )
        return lines

    def panels(self, found: Found) -> list[Panel]:
        """Return position and heading error and the cost over the number of antennas."""
        cost = Panel(
            title="Readers of one robot",
            x_label=self.sweep.axis.label,
            y_label="cost (EUR)",
            curves=exact_curves(self.sweep, "readers_of_a_robot_eur"),
        )
        cheapest = cheapest_meeting(self.sweep, found)
        told = {} if cheapest is None else {cheapest.place: "cheapest that\nmeets the demand"}
        return [
            panel_of(self.sweep, found, "position_error_mean", "Position error", pointed_out=told),
            panel_of(self.sweep, found, HEADING, "Heading error"),
            cost,
        ]

    def words(self) -> tuple[str, ...]:
        """Return what is kept, and what else changes with the number of antennas."""
        return (
            "Floor, antennas and their height are those of the layout. Antennas that share a module take turns: "
            "with ports for four, one antenna alone listens all the time, and of four each listens in every "
            "fourth scan. So few antennas lose less than their number says. The whole cost is that of all "
            "robots and the floor.",
            "Spread is the distance of the outermost antenna from the middle of the robot. An antenna of a ring "
            "is ahead. Errors are compared with the widest ring of about as many antennas as the layout has.",
        )


def widest_radius_m(robot: Robot, side_m: float) -> float:
    """Return the radius of the widest ring for which a robot has room whatever the number, in whole mm, m."""
    return math.floor(1000.0 * (robot.inner_radius_m - side_m / 2.0) + 1e-6) / 1000.0


def groups_of(mount: Mount, robot: Robot, *, counts: tuple[int, ...]) -> Iterator[tuple[str, int, ReaderGroup]]:
    """Yield rings of three radii, the widest first, and crosses, each under its series and number of antennas.

    A module has as many ports as the mount says, or as there are antennas.
    """
    widest_m = widest_radius_m(robot, mount.antenna.side_m)
    for share in reversed(SPREADS):
        radius_m = math.floor(1000.0 * share * widest_m) / 1000.0
        for count in counts:
            if radius_m > 0.0:
                yield (
                    f"ring of {1000.0 * radius_m:g} mm",
                    count,
                    ring(count=count, radius_m=radius_m, mount=_for(mount, count)),
                )
    for count in counts:
        # Of four antennas the cross is the ring.
        if count % 4 == 0 and count > 4 and widest_m > 0.0:
            spacing_m = widest_m / (count // 4)
            group = cross(count=count, spacing_m=spacing_m, mount=_for(mount, count))
            yield f"cross to {1000.0 * widest_m:g} mm", count, group


def _for(mount: Mount, count: int) -> Mount:
    return replace(mount, antennas_per_module=min(mount.antennas_per_module, count))


def with_readers(layout: Layout, group: ReaderGroup) -> Layout:
    """Return a layout whose floor readers are this group; what reads no floor stays."""
    rest = tuple(own for own in layout.readers if own not in layout.floor_readers)
    return layout.replace(readers=(group, *rest))


def spread_m(group: ReaderGroup) -> float:
    """Return the distance of the outermost antenna from the middle of the robot, m."""
    return max(math.hypot(x_m, y_m) for x_m, y_m in group.poses[:, :2].tolist())


def _base_of(places: list[Place], count: int) -> Place | None:
    """Return the place of the first series, the widest ring, with about so many antennas."""
    return min(
        (place for place in places if place.series == places[0].series),
        key=lambda place: (abs(place.value - count), place.value),
        default=None,
    )
