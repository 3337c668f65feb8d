"""Pictures of the explanations: particles, the race, errors of one reading, what drives without a loss show."""

import csv
import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.patches import Circle

from layoutopt.estimators.likelihood import ring_log_likelihood, silence_log_likelihood
from layoutopt.estimators.particles import antenna_places, moved, systematic_parents, weighted_mean
from layoutopt.identity import FloatArray
from layoutopt.layout import TagPattern
from layoutopt.patterns.square import square
from layoutopt.patterns.triangular import triangular
from layoutopt.plots.figures import (
    FAINT,
    INK,
    SERIES,
    TEXT_PT,
    add_axes,
    label_log_axis,
    legend_below,
    new_figure,
)
from layoutopt.readings import Motion
from objectives.half_gap import half_gap_bound
from objectives.position_bound import static_error

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DPI = 200
SEED = 4
PARTICLES = 20_000
DRAWN = 10
"""Every so many particles are drawn."""
RADIUS_M = 0.06
ANTENNAS_M = np.array([(0.12, 0.0), (0.0, 0.12), (-0.12, 0.0), (0.0, -0.12)])
TAGS_M = square(pitch_m=0.25).points_in((-0.01, -0.01, 1.51, 0.76))
START = (0.3, 0.28, 0.25)
STEP_M = 0.02
SPREAD_M = 0.1
SHOWN = {0: "at the start", 1: "first read", 12: "after 240 mm", 50: "after 1 m"}
"""Steps that are drawn, each with its words."""


def draw_explanations(pictures: Path, study: Path) -> None:
    """Draw all of them; that of the race needs the folder of a finished `cost_vs_accuracy`."""
    draw_particles(pictures / "particles.png")
    draw_static_errors(pictures / "static_errors.png")
    draw_shares_shown(pictures / "shares_shown.png")
    if (study / "designs.csv").exists():
        draw_race(pictures / "race.png", study / "designs.csv")
    else:
        print(f"left out: the race ({study / 'designs.csv'} is not there)")


def _save(figure: "Figure", path: Path) -> None:
    figure.savefig(path, dpi=DPI, metadata={"Software": None})


def draw_particles(path: Path) -> None:
    """Draw a cloud of particles that finds a robot: of heading unknown, and of a place known to 100 mm."""
    draws = np.random.Generator(np.random.Philox(SEED))
    true = np.array(START)[:, None]
    cloud = np.array(START)[:, None] + np.array([[SPREAD_M], [SPREAD_M], [0.0]]) * draws.standard_normal(
        (3, PARTICLES)
    )
    cloud[2] = math.pi * (2.0 * draws.random(PARTICLES) - 1.0)
    # 2 % and 1 degree after 1 m, as variances that grow with the way.
    sigma = np.array([0.02, 0.02, math.radians(1.0)]) * math.sqrt(STEP_M)
    figure = new_figure(170.0, 100.0)
    panels = iter(add_axes(figure, 2, 2, number) for number in range(1, 5))
    for step in range(max(SHOWN) + 1):
        if step > 0:
            motion = Motion(forward_m=STEP_M, left_m=0.0, turn_rad=0.0, sigma=(0.0, 0.0, 0.0))
            true = moved(true, motion, np.zeros(3), np.zeros((3, 1)))
            cloud = moved(cloud, motion, sigma, draws.standard_normal((3, PARTICLES)))
            log_weight = _evidence(true, cloud)
            weight = np.exp(log_weight - log_weight.max())
            cloud = cloud[:, systematic_parents(weight, PARTICLES, float(draws.random()))]
        if step in SHOWN:
            _draw_cloud(next(panels), SHOWN[step], true, cloud)
    _save(figure, path)


def _reads(true: FloatArray, antenna_m: FloatArray) -> FloatArray:
    """Return whether each tag lies in the disc of an antenna of the robot, shape (tags,)."""
    return np.asarray(np.linalg.norm(TAGS_M - antenna_places(true, antenna_m)[:, 0], axis=1) < RADIUS_M)


def _evidence(true: FloatArray, cloud: FloatArray) -> FloatArray:
    """Return the log weight of each particle by what the antennas read, and by what they did not."""
    log_weight = np.zeros(cloud.shape[1])
    width_m = 0.15 * RADIUS_M
    for antenna_m in ANTENNAS_M:
        place_m, read = antenna_places(cloud, antenna_m), _reads(true, antenna_m)
        for tag_m in TAGS_M[read]:
            distance_m = np.hypot(*(place_m - tag_m[:, None]))
            log_weight += ring_log_likelihood(
                distance_m, inner_m=0.0, outer_m=RADIUS_M, width_m=width_m, log_floor=math.log(0.001)
            )
        silent_m = TAGS_M[~read]
        log_weight += silence_log_likelihood(
            place_m,
            silent_m,
            np.full(len(silent_m), width_m),
            radius_m=RADIUS_M,
            log_miss=math.log(0.1),
            one_tag_alone=False,
        )
    return log_weight


def _draw_cloud(ax: "Axes", words: str, true: FloatArray, cloud: FloatArray) -> None:
    pose, covariance = weighted_mean(cloud, np.ones(cloud.shape[1]))
    off_mm = 1000.0 * math.hypot(pose[0] - true[0, 0], pose[1] - true[1, 0])
    spread_mm = 1000.0 * math.sqrt(float(np.trace(covariance)))
    ax.scatter(cloud[0, ::DRAWN], cloud[1, ::DRAWN], s=1.5, color=SERIES[0], alpha=0.5, linewidths=0.0)
    ax.scatter(TAGS_M[:, 0], TAGS_M[:, 1], s=9.0, marker="s", color=FAINT, linewidths=0.0)
    for antenna_m in ANTENNAS_M:
        (x_m,), (y_m,) = antenna_places(true, antenna_m)
        read = _reads(true, antenna_m).any()
        ax.add_patch(
            Circle((x_m, y_m), RADIUS_M, facecolor=SERIES[1] if read else "none", alpha=0.35 if read else 1.0)
        )
        ax.add_patch(Circle((x_m, y_m), RADIUS_M, fill=False, edgecolor=SERIES[1], linewidth=0.8))
    ahead_m = 0.18 * np.array([math.cos(true[2, 0]), math.sin(true[2, 0])])
    ax.annotate(
        "", xy=true[:2, 0] + ahead_m, xytext=true[:2, 0], arrowprops={"arrowstyle": "->", "color": INK, "lw": 1.2}
    )
    ax.set_title(f"{words}: deviation {spread_mm:.0f} mm, off by {off_mm:.0f} mm", loc="left", fontsize=TEXT_PT)
    ax.set(xlim=(-0.05, 1.55), ylim=(-0.05, 0.8), aspect="equal", xlabel="x (m)", ylabel="y (m)")


def draw_static_errors(path: Path) -> None:
    """Draw worst and mean error of one reading over the radius of the disc, with what the half-gap says."""
    figure = new_figure(170.0, 75.0)
    first = add_axes(figure, 1, 2, 1)
    cases = (
        ("square", square(pitch_m=1.0), first),
        ("triangular", triangular(pitch_m=1.0), add_axes(figure, 1, 2, 2)),
    )
    for name, pattern, ax in cases:
        _draw_static_errors(ax, name, pattern)
    legend_below([first])
    _save(figure, path)


def _draw_static_errors(ax: "Axes", name: str, pattern: TagPattern) -> None:
    radii = np.linspace(0.2, 2.0, 181)
    errors = [static_error(pattern, float(radius)) for radius in radii]
    worst = np.array([error.worst_m for error in errors])
    bound = half_gap_bound(pattern)
    printed, derived = bound.published_m, bound.derived_m
    assert printed is not None
    ax.plot(radii, worst, color=SERIES[0], label="worst, of a disc that reads")
    ax.plot(radii, [error.mean_m for error in errors], color=SERIES[2], linestyle=(0, (6, 2)), label="mean")
    ax.axhline(printed, color=SERIES[1], linewidth=1.0, linestyle=(0, (2, 1.5)), label="half-gap as printed")
    if not math.isclose(printed, derived, abs_tol=1e-3):
        ax.axhline(derived, color=INK, linewidth=0.7, linestyle=(0, (1, 2)))
        ax.text(0.2, derived - 0.012, f"{derived:.3f} as derived", ha="left", va="top", fontsize=7.0, color=INK)
    ax.text(2.0, printed + 0.012, f"{printed:.3f}", ha="right", va="bottom", fontsize=7.0, color=SERIES[1])
    ax.fill_between(radii, printed, worst, where=worst > printed, color=SERIES[1], alpha=0.35, linewidth=0.0)
    ax.set_title(f"{name} pattern", loc="left", fontsize=TEXT_PT)
    ax.set(xlabel="radius of the read disc (pitches)", ylabel="error of one reading (pitches)", ylim=(0.0, 0.8))


def draw_shares_shown(path: Path) -> None:
    """Draw the upper 95 % bound of a share by the drives without a loss, with one, two and four of them."""
    from scipy.stats import beta

    figure = new_figure(120.0, 75.0)
    ax = add_axes(figure)
    drives = np.unique(np.geomspace(10, 1000, 200).round().astype(int))
    for number, lost in enumerate((0, 1, 2, 4)):
        bound = beta.ppf(0.95, lost + 1, drives - lost)
        ax.plot(
            drives,
            100.0 * bound,
            color=SERIES[number],
            label=f"{lost} lost",
            linestyle=("-", "--", ":", "-.")[number],
        )
        enough = int(drives[np.argmax(bound < 0.02)])
        ax.plot([enough], [2.0], marker="o", color=SERIES[number], markersize=3.5)
    ax.axhline(2.0, color=INK, linewidth=0.7)
    ax.text(10.0, 2.1, "demand: less than 2 %", fontsize=7.0, color=INK)
    label_log_axis(ax, x=True, y=True)
    ax.set(xlabel="drives", ylabel="share lost at most, 95 % sure (%)", xlim=(10, 1000))
    legend_below([ax])
    _save(figure, path)


def draw_race(path: Path, designs: Path) -> None:
    """Draw every layout of a race at its cost and error, the larger the more drives it got."""
    with designs.open(encoding="utf-8", newline="") as lines:
        rows = [row for row in csv.DictReader(lines) if row["position_error_mean_m"]]
    cost_eur, error_mm, trials = (
        np.array([scale * float(row[name]) for row in rows])
        for name, scale in (("cost_eur", 1.0), ("position_error_mean_m", 1000.0), ("trials", 1.0))
    )
    figure = new_figure(150.0, 90.0)
    ax = add_axes(figure)
    bands = ((2, 3), (4, 7), (8, 15), (16, 31), (32, math.inf))
    for number, (low, high) in enumerate(bands):
        chosen = (trials >= low) & (trials <= high)
        words = f"{low} to {high}" if math.isfinite(high) else f"{low} to {int(trials.max())}"
        shade = 0.25 + 0.15 * number
        ax.scatter(
            cost_eur[chosen],
            error_mm[chosen],
            s=3.0 + 6.0 * number,
            color=SERIES[0] if low >= 32 else INK,
            alpha=1.0 if low >= 32 else shade,
            marker="os^vD"[number],
            linewidths=0.0,
            label=f"{words} drives: {int(chosen.sum())}",
        )
    label_log_axis(ax, x=True, y=True)
    ax.set(xlabel="cost (EUR)", ylabel="mean position error in the search (mm)")
    legend_below([ax], columns=3)
    _save(figure, path)
