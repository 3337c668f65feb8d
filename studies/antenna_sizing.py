"""Which antenna to buy and how high to hang it: error, read radius and cost against side and height."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Final

import numpy as np

from layoutopt.layout import Layout, ReaderGroup
from layoutopt.plots.curves import Panel
from layoutopt.protocols import Mount, StudyCard
from layoutopt.readers.mounting import MountBuilder, mounted
from layoutopt.readers.ring import ring
from layoutopt.score_text import euros
from layoutopt.spec.building import Spec
from layoutopt.workers import Workers
from studies.cells import UNFINISHED
from studies.reader_count import widest_radius_m, with_readers
from studies.reader_group_setting import mount_of
from studies.swept import (
    GOAL,
    Axis,
    Found,
    Place,
    Point,
    Sweep,
    SweepStudy,
    change,
    costs_eur,
    first_layout,
    point_of,
    reason_against,
    sweep_of,
)
from studies.swept_page import change_text, cheapest_line, error_text, exact_curves, panel_of

CARD: Final = StudyCard(
    summary="Error, read radius and cost against side and height of the antennas.",
    reference="own; mi2016, Section 3, for the read radius",
    question="Which antenna shall I buy, and how high shall it hang?",
    adaptive=False,
    rests_on="Errors are simulated in your world with one arrangement and one pattern; differences "
    "are paired by drive. Read radii are those of the antenna model: measure one antenna before you "
    "buy many.",
    next_step="Put the sides and heights that do well into [space], and run cost_vs_accuracy, which "
    "varies all at once.",
    guide="study_antenna_sizing",
)
SIDES: Final = (0.5, 0.75, 1.0, 1.5, 2.0)
"""Multiples of the layout's side, for a spec that lists one side only."""
HEIGHTS: Final = (0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0)
"""Multiples of the layout's height above the tags."""
QUICK_HEIGHTS: Final = (0.5, 1.0)
_Placer = Callable[[Mount], ReaderGroup]


@dataclass(frozen=True, slots=True, kw_only=True)
class AntennaSizing(SweepStudy):
    """The spec's first layout with antennas of several sides and heights; ``places`` says where they sit."""

    sweep: Sweep
    places: str
    title: ClassVar[str] = "Error against side and height of the antennas"
    command: ClassVar[str] = "antenna_sizing"
    card: ClassVar[StudyCard] = CARD

    @classmethod
    def for_spec(cls, spec: Spec, *, quick: bool, workers: Workers | None = None) -> "AntennaSizing":
        """Return the study of a spec; a quick one has two heights and two drives of each.

        Raises
        ------
        InvalidInput
            If no layout of the space can be built.
        """
        layout, estimator = first_layout(spec), spec.problem().estimators[0]
        own = mount_of(layout.floor_readers[0])
        sides_m = sides_of(spec, own)
        build = MountBuilder(antenna=own.antenna, profile=own.profile)
        put, where = _placer(spec, layout, own, max(sides_m))
        points, refused = [], []
        for side_m in sides_m:
            for multiple in QUICK_HEIGHTS if quick else HEIGHTS:
                height_m = round(multiple * own.height_m, 6)
                series = side_text(side_m)
                try:
                    mount = build(side_m=side_m, height_m=height_m, antennas_per_module=own.antennas_per_module)
                    made = with_readers(layout, put(mount))
                    reason = reason_against(made, spec.design, estimator)
                except ValueError as error:
                    reason = str(error)
                if reason:
                    refused.append((f"{series}, {1000.0 * height_m:g} mm high", reason))
                    continue
                exact = {"read_radius_m": mount.antenna.read_radius_m(height_m), **costs_eur(spec, made)}
                if made.extrapolated:
                    exact["beyond_calibration"] = 1.0
                place = Place(series, height_m)
                points.append(point_of(place, made, spec.design, estimator, quick=quick, exact=exact))
        base = Place(side_text(own.antenna.side_m), own.height_m)
        return cls(
            sweep=sweep_of(
                spec,
                f"{layout.label}, of which the floor and the number of antennas are kept",
                axis=Axis(name="antenna_height_m", words="height", unit="mm", factor=1000.0),
                points=points,
                base={point.place.series: base for point in points},
                estimators=estimator.name,
                refused=refused,
            ),
            places=where,
        )

    def best(self, found: Found) -> Point | None:
        """Return the point of the least mean error; ``None`` while there is none."""
        known = (point for point in self.sweep.points if point.place in found)
        return min(known, key=lambda point: found[point.place].score(GOAL).value, default=None)

    def summary(self, found: Found) -> list[str]:
        """Return the best antenna and height that were tried, beside the layout's own."""
        known, best = [point for point in self.sweep.points if point.place in found], self.best(found)
        if best is None:
            return [UNFINISHED]
        least = f"Least mean error of {len(known)} choices: {_choice(self.sweep, found, best)}."
        lines = [*cheapest_line(self.sweep, found), least]
        difference = change(self.sweep, found, best.place)
        if difference is not None:
            base = self.sweep.base[best.place.series]
            own = next(point for point in known if point.place == base)
            lines.append(
                f"The layout's own: {_choice(self.sweep, found, own)}; the best has {change_text(difference)}. It "
                "was chosen on the same drives, which flatters it a little."
            )
        for series in self.sweep.series:
            points = [point for point in self.sweep.of(series) if point in known]
            low = min(points, key=lambda point: found[point.place].score(GOAL).value, default=None)
            if low is None:
                continue
            if low is not best:
                lines.append(f"Best with {series}: {_choice(self.sweep, found, low)}.")
            if low is points[-1] and len(points) > 1:
                lines.append(f"That is the greatest height tried with {series}: still higher may be better.")
        return lines

    def panels(self, found: Found) -> list[Panel]:
        """Return error and read radius over the height; the cost does not depend on it."""
        radius = Panel(
            title="Read radius",
            x_label=self.sweep.axis.label,
            y_label="read radius, exact (mm)",
            curves=exact_curves(self.sweep, "read_radius_m", factor=1000.0),
        )
        best = self.best(found)
        told = {}
        if best is not None:
            told[best.place] = f"least error: {best.place.series},\n{self.sweep.axis.text(best.place.value)} high"
        return [panel_of(self.sweep, found, GOAL, "Position error", pointed_out=told), radius]

    def words(self) -> tuple[str, ...]:
        """Return what is kept, and what the model of the antennas knows."""
        beyond = any("beyond_calibration" in point.exact for point in self.sweep.points)
        told = "Where the table says 1 under beyond calibration, the model goes beyond what was measured."
        return (
            f"The height is that above the tags. {self.places} Errors are compared with the layout's own side "
            "and height.",
            "A large read disc meets more tags and tells less of where it met them; a small one the other way "
            "round. Read radii are those of the spec's antenna model.",
            *([told] if beyond else []),
        )


def sides_of(spec: Spec, own: Mount) -> tuple[float, ...]:
    """Return the sides to compare: those of the space, or multiples of the layout's if there is only one."""
    sides_m = {mount.antenna.side_m for mounts in spec.mounts for mount in mounts}
    if len(sides_m) < 2:
        sides_m = {round(multiple * own.antenna.side_m, 6) for multiple in SIDES}
    return tuple(sorted(sides_m))


def side_text(side_m: float) -> str:
    """Return the name of the antennas of a side.

    >>> side_text(0.06)
    'antennas of 60 mm'
    """
    return f"antennas of {1000.0 * side_m:g} mm"


def _placer(spec: Spec, layout: Layout, own: Mount, largest_m: float) -> tuple[_Placer, str]:
    """Return what puts antennas under the robot, and where: as in the layout, or wide if that is too tight."""
    group = layout.floor_readers[0]
    gap_m = np.linalg.norm(group.poses[:, None, :2] - group.poses[None, :, :2], axis=2)
    np.fill_diagonal(gap_m, np.inf)
    radius_m = widest_radius_m(spec.robot, largest_m)
    if float(gap_m.min()) < own.profile.spacing_sides * largest_m and radius_m > 0.0:
        return (
            lambda mount: ring(count=group.count, radius_m=radius_m, mount=mount),
            f"The layout has no room for the largest antennas, so all sit on a ring of {1000.0 * radius_m:g} mm.",
        )
    return (
        lambda mount: mounted(group.name, group.poses[:, :2], mount, {}),
        "Antennas sit where the layout has them.",
    )


def _choice(sweep: Sweep, found: Found, point: Point) -> str:
    """Return side, height, error, read radius and cost of a point."""
    return (
        f"{point.place.series} {sweep.axis.text(point.place.value)} high, {error_text(found, point.place)}, read "
        f"radius {1000.0 * point.exact['read_radius_m']:.3g} mm, {euros(point.exact['cost_eur'])}"
    )
