"""The figures of the mi2016 page: ratios, antenna reach, speeds and paths."""

from typing import TYPE_CHECKING, Final

import numpy as np

from layoutopt.plots.curves import Curve, Panel, draw_curves
from layoutopt.plots.ratios import RatioRow, draw_ratios
from layoutopt.plots.trajectories import Paths, draw_trajectories
from layoutopt.protocols import Surroundings
from layoutopt.simulation.trials import record_trial
from layoutopt.streams import Streams
from studies.page import Picture
from studies.published import mi2016_setting as setting
from studies.published.comparison import Compared, half_width
from studies.published.mi2016_results import Results

if TYPE_CHECKING:
    from collections.abc import Sequence

    from layoutopt.identity import FloatArray
    from layoutopt.protocols import AntennaModel

_HEIGHTS_M: Final = np.linspace(0.0, 0.06, 121)
_DISTANCES_M: Final = np.linspace(0.0, 0.05, 501)
_PART_M: Final = 0.2
_DRIVE: Final = 0
"""Replication whose path is drawn."""


def ratio_pictures(name: str, items: "Sequence[Compared]") -> tuple[Picture, ...]:
    """Return the ratios of means to the printed ones, a row for each row of the paper; nothing without trials."""
    rows: dict[tuple[str, ...], dict[str, tuple[float, float, float]]] = {}
    for item in items:
        if item.ratio is not None:
            low, high = item.ratio.interval()
            ends = (item.ratio.value, max(low, 1e-3), high if np.isfinite(high) else item.ratio.value)
            rows.setdefault(item.row, {})[item.quantity.heading] = ends
    if not rows:
        return ()
    drawn = draw_ratios(
        [
            RatioRow(label=f"{readers} readers, {tags}/m², {likelihood}", ratios=ratios)
            for (readers, tags, likelihood), ratios in rows.items()
        ],
        x_label="ours / printed, mean error; grey: within 1.5 and within 2",
    )
    caption = "Mean errors: ours over printed, with 95 % intervals."
    return (Picture(name=name, caption=caption, drawn=drawn),)


def reach_picture() -> Picture:
    """Return read radius over antenna height, and detection over distance, as the antenna model has them."""
    antennas: dict[str, AntennaModel] = {
        f"{round(1000 * side_m)} mm antenna": setting.mount(readers).antenna
        for readers, (side_m, _) in ((8, setting.ARRAYS[8]), (96, setting.ARRAYS[96]))
    }
    large = setting.mount(8).antenna
    return Picture(
        name="antenna_reach",
        caption="Left: radius of the disc in which tags are read, over the height of the antenna. Right: share of "
        "tags read by the 60 mm antenna, over their horizontal distance. The model is the sphere of Eq. 5.",
        drawn=draw_curves(
            [
                Panel(
                    title="read radius",
                    x_label="height of the antenna (mm)",
                    y_label="radius (mm)",
                    curves=tuple(
                        Curve(
                            name=name,
                            x=1e3 * _HEIGHTS_M,
                            y=np.array([1e3 * antenna.read_radius_m(float(height)) for height in _HEIGHTS_M]),
                        )
                        for name, antenna in antennas.items()
                    ),
                    marks=((15.0, "real robot, 8 readers"), (24.0, "simulated, 8 readers")),
                ),
                Panel(
                    title="tags read, 60 mm antenna",
                    x_label="horizontal distance (mm)",
                    y_label="share read",
                    curves=tuple(
                        Curve(
                            name=f"{round(1e3 * height_m)} mm high", x=1e3 * _DISTANCES_M, y=_read(large, height_m)
                        )
                        for height_m in (0.015, 0.020)
                    ),
                ),
            ]
        ),
    )


def speed_picture(results: Results) -> Picture | None:
    """Return the mean position errors over speed for both meanings of the noise; nothing without trials."""
    panels = []
    for kind, title in (("time", "noise by the clock (Eq. 1)"), ("way", "noise by the way")):
        curves = []
        for likelihood in setting.LIKELIHOODS:
            for column, axis in (("x_error_mean", "x"), ("y_error_mean", "y")):
                found = results.speeds(kind, likelihood, column)
                if found:
                    curves.append(
                        Curve(
                            name=f"{likelihood}, {axis}",
                            x=np.array([1e3 * speed for speed, _ in found]),
                            y=np.array([1e3 * score.value for _, score in found]),
                            half_width=np.array([1e3 * half_width(score) for _, score in found]),
                        )
                    )
        panels.append(Panel(title=title, x_label="speed (mm/s)", y_label="mean error (mm)", curves=tuple(curves)))
    if not all(panel.curves for panel in panels):
        return None
    return Picture(
        name="speed",
        caption="Eight readers over 100 tags/m²: mean error over speed, with 95 % intervals.",
        drawn=draw_curves(panels),
    )


def path_picture(streams: Streams) -> Picture:
    """Return one drive with both likelihoods, as Fig. 14 and 15 have them; below, a part of it enlarged."""
    whole, parts = [], []
    layout = setting.layout(8, 100)
    tags_m = layout.floor_tags.lay_on(setting.site()).xy_m
    for speed_m_s in (0.05, 0.1, 0.35):
        scenario = setting.scenario(speed_m_s=speed_m_s)
        records = {
            likelihood: record_trial(layout, scenario, setting.particle_filter(likelihood), streams, _DRIVE)
            for likelihood in setting.LIKELIHOODS
        }
        lap = round(2.0 * np.pi * setting.CIRCLE_RADIUS_M / speed_m_s / setting.STEP_S)
        true_m = records["combination"].drive.poses[:lap, :2]
        middle_m = true_m[len(true_m) // 2]
        paths = {name: record.trajectory.poses[:lap, :2] for name, record in records.items()}
        title = f"{round(1e3 * speed_m_s)} mm/s"
        whole.append(Paths(title=title, true_m=true_m, estimated_m=paths, tags_m=tags_m))
        parts.append(
            Paths(
                title=f"{title}, enlarged",
                true_m=true_m,
                estimated_m=paths,
                tags_m=tags_m,
                window_m=(*(middle_m - _PART_M / 2.0), *(middle_m + _PART_M / 2.0)),
            )
        )
    return Picture(
        name="paths",
        caption="Eight readers over 100 tags/m²: true and estimated path of one drive, a lap or "
        f"{setting.DURATION_S:g} s of it; below, 200 mm by 200 mm enlarged.",
        drawn=draw_trajectories([*whole, *parts]),
    )


def _read(antenna: "AntennaModel", height_m: float) -> "FloatArray":
    offset_m = np.stack([_DISTANCES_M, np.zeros_like(_DISTANCES_M), np.full_like(_DISTANCES_M, -height_m)], axis=1)
    return antenna.read_probability(offset_m, Surroundings())
