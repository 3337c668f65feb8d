"""What geometry alone says of the floors of han2006: exact errors of one reading by its radius, and its bounds."""

import math
from typing import Final

import numpy as np

from layoutopt.plots.curves import Curve, Panel, draw_curves
from objectives.position_bound import ESTIMATORS, check_half_gap, half_gap_failures, static_error
from studies.page import Picture, Section, Table
from studies.published.han2006_setting import PITCH_M, Choice, patterns

RADII_M: Final = np.linspace(0.055, 0.2, 117)
_BASE: Final = Choice()
_BOUNDED: Final = ("square", "isosceles")
"""Floors to which the half-gap rule of the paper applies."""


def static_section() -> Section:
    """Return the section: curves over the radius, where the bounds fail, and errors at the fitted radius."""
    means_m = {
        floor: np.array([static_error(pattern, float(radius_m)).mean_m for radius_m in RADII_M])
        for floor, pattern in patterns().items()
    }
    worst_m = {
        floor: np.array([static_error(pattern, float(radius_m)).worst_m for radius_m in RADII_M])
        for floor, pattern in patterns().items()
    }
    step_mm = 1e3 * float(RADII_M[1] - RADII_M[0])
    better = {floor: _ranges(means_m[floor] < means_m["square"]) for floor in patterns() if floor != "square"}
    told = "; ".join(f"{floor} at {ranges}" for floor, ranges in better.items())
    return Section(
        heading="What geometry says of one reading",
        paragraphs=(
            "Exact errors of the midrange of a disc, over all places where it sees a tag, by its radius. They do "
            "not fall with the radius but swing, and which floor is better on average depends on it. Smaller than "
            f"on the square floor, in steps of {step_mm:.2f} mm from {1e3 * RADII_M[0]:g} to "
            f"{1e3 * RADII_M[-1]:g} mm: {told} mm. The radius is a design choice of its own.",
            "The bounds of Eq. 16 and 20 take the reading area for a box that always holds tags. The table says "
            "at which radii of a disc the worst place errs by more.",
        ),
        parts=(
            Picture(
                name="radius",
                caption="Static error of the midrange, exactly: mean, and worst place.",
                drawn=draw_curves(
                    [
                        Panel(
                            title=title,
                            x_label="read radius (mm)",
                            y_label=f"{title} (mm)",
                            curves=tuple(
                                Curve(name=floor, x=1e3 * RADII_M, y=1e3 * values)
                                for floor, values in errors_m.items()
                            ),
                            marks=((1e3 * _BASE.radius_m, "fitted"),),
                        )
                        for title, errors_m in (("mean error", means_m), ("worst error", worst_m))
                    ]
                ),
            ),
            _failures(),
            _at_fitted(),
        ),
    )


def _ranges(holds: "np.ndarray[tuple[int], np.dtype[np.bool_]]") -> str:
    """Return the ranges of radii, mm, at which something holds."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], holds, [False]]).astype(int)))
    ranges = [f"{1e3 * RADII_M[a]:.0f}–{1e3 * RADII_M[b - 1]:.0f}" for a, b in edges.reshape(-1, 2)]
    return ", ".join(ranges) or "no radius"


def _failures() -> Table:
    rows = []
    for floor in _BOUNDED:
        pattern = patterns()[floor]
        for words, published in (("printed", True), ("derived", False)):
            check = check_half_gap(pattern, _BASE.radius_m)
            bound_m = check.half_gap.published_m if published else check.half_gap.derived_m
            found = half_gap_failures(pattern, float(RADII_M[0]), float(RADII_M[-1]), published=published)
            ranges = ", ".join(f"{1e3 * low:.1f}–{1e3 * high:.1f}" for low, high in found)
            rows.append((floor, words, f"{1e3 * (bound_m or math.nan):.1f}", ranges or "nowhere"))
    return Table(
        caption=f"Where the half-gap bound fails for a disc, {1e3 * RADII_M[0]:g} to {1e3 * RADII_M[-1]:g} mm",
        head=("floor", "bound", "mm", "fails at radii, mm"),
        rows=tuple(rows),
        words=2,
    )


def _at_fitted() -> Table:
    rows = []
    for floor, pattern in patterns().items():
        errors = [static_error(pattern, _BASE.radius_m, name) for name in ESTIMATORS]
        rows.append(
            (floor, *(f"{1e3 * value:.1f}" for error in errors for value in (error.worst_m, error.mean_m)))
        )
    return Table(
        caption=f"Static error at {1e3 * _BASE.radius_m:g} mm with tags every {1e3 * PITCH_M:g} mm, mm",
        head=("floor", *(f"{name}, {what}" for name in ESTIMATORS for what in ("worst", "mean"))),
        rows=tuple(rows),
    )
