"""The figures of the liang2020 page: the learned sensor model, one walk with three approaches, error over ρ."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from layoutopt.estimators.sensor_model import SensorModel, likelihood
from layoutopt.identity import FloatArray
from layoutopt.plots.cell_maps import CellMap, draw_cell_maps
from layoutopt.plots.curves import Curve, Panel, draw_curves
from layoutopt.plots.trajectories import Paths, draw_trajectories
from layoutopt.simulation.calibration import calibrated, survivor_bias_db
from layoutopt.simulation.signals import signal_antenna
from layoutopt.simulation.tracking_trials import observe_target, target_knowledge, uhf_antennas
from layoutopt.streams import Purpose, Streams
from layoutopt.tracking_world import SignalWorld
from studies.page import Picture, Section, Table
from studies.published.liang2020_orderings import GOAL, Found
from studies.published.liang2020_printed import APPROACHES, FIGURE_6_RHO
from studies.published.liang2020_setting import BASE, INTERVAL_S, ROUNDS, Choice, layout, scenario, tracker
from studies.published.medians import median

if TYPE_CHECKING:
    from layoutopt.plots.figures import Drawn

STRENGTHS_DBM: Final = (-48.0, -55.0, -65.0)
"""Strengths of Fig. 3, (a) to (c)."""
_BOUNDS_M: Final = (-1.0, -4.5, 9.0, 4.5)
_AHEAD_M: Final = 0.5
"""Cells with a middle less than this beside the axis count as ahead of the antenna."""
_RINGS_M: Final = ((1.0, 2.0), (3.0, 4.0), (5.0, 6.0), (6.0, 7.0), (7.0, 8.0), (8.0, 9.0))
_WALK: Final = 0
"""Replication that is drawn."""
_SHOWN: Final = 2 * BASE.step_count // ROUNDS
"""Samples of which the error is drawn: two rounds."""
_WINDOW_M: Final = (-0.5, -3.0, 5.0, 3.0)
RHO_TRACKS_M2: Final = (0.001, 0.05, 1.0)
"""Values of ρ of Fig. 6, (b) to (d)."""


def sensor_section(streams: Streams) -> Section:
    """Return Fig. 3: likelihoods of three strengths, mean strength, and how much too high that is."""
    antenna = signal_antenna(uhf_antennas(layout(BASE), scenario(BASE)))
    signal = SignalWorld()
    model = calibrated(antenna, signal)
    columns, rows = model.mean_dbm.shape
    x_m, y_m = middles_m(model)
    places_m = np.stack(np.meshgrid(x_m, y_m, indexing="ij"), axis=-1).reshape(-1, 2)
    maps = [
        CellMap(
            title=f"({letter}) strength \N{MINUS SIGN}{-strength_dbm:g} dBm",
            label="likelihood, 1/dB",
            values=likelihood(model, places_m, strength_dbm).reshape(columns, rows),
            origin_m=model.origin_m,
            cell_m=model.cell_m,
        )
        for letter, strength_dbm in zip("abc", STRENGTHS_DBM, strict=True)
    ]
    maps.append(
        CellMap(
            title="(d) mean strength",
            label="mean strength of detections (dBm)",
            values=model.mean_dbm,
            origin_m=model.origin_m,
            cell_m=model.cell_m,
        )
    )
    bias_db = survivor_bias_db(model, antenna, signal)
    rows_told = []
    for low_m, high_m in _RINGS_M:
        cells = np.ix_((x_m > low_m) & (x_m < high_m), np.abs(y_m) < _AHEAD_M)
        readings, biased_db = model.readings[cells], bias_db[cells]
        heard = readings * model.detection[cells]
        known = np.isfinite(biased_db)
        mean_db = float(np.average(biased_db[known], weights=heard[known])) if known.any() else math.nan
        rows_told.append(
            (f"{low_m:g} to {high_m:g}", f"{100.0 * heard.sum() / readings.sum():.0f}", f"{mean_db:+.2f}")
        )
    return Section(
        heading="Fig. 3: the learned sensor model",
        paragraphs=(
            "Learned from "
            f"{model.readings.sum():.0f} simulated readings at random places about one antenna. The weaker the "
            "signal, the wider the ring of places from which it may come, as in the paper.",
            "Only readings that succeed have a strength, so near the edge of the range the learned mean is that "
            "of the lucky ones. The table has the difference to the true mean ahead of the antenna, weighted with "
            "the detections. Eq. 2 asks for the strength of what is detected, so the likelihood is none the worse "
            "for it; who takes the learned mean for the strength of the signal is.",
        ),
        parts=(
            Picture(
                name="sensor_model",
                caption="Likelihood of a detection with a strength of -48, -55 and -65 dBm, and mean strength, "
                "over the place of the tag; the antenna looks along x (paper: Fig. 3).",
                drawn=draw_cell_maps(maps, bounds_m=_BOUNDS_M),
            ),
            Table(
                caption="Learned mean strength above the true one, ahead of the antenna",
                head=("distance, m", "readings that succeed, %", "learned less true mean, dB"),
                rows=tuple(rows_told),
            ),
        ),
    )


def middles_m(model: SensorModel) -> tuple[FloatArray, FloatArray]:
    """Return the middles of the cells of a model along x and y, shapes (columns,) and (rows,), m."""
    columns, rows = model.mean_dbm.shape
    x_m = model.origin_m[0] + (np.arange(columns) + 0.5) * model.cell_m
    y_m = model.origin_m[1] + (np.arange(rows) + 0.5) * model.cell_m
    return np.asarray(x_m), np.asarray(y_m)


def walk_section(streams: Streams) -> Section:
    """Return Fig. 5: error over time and tracks of the three approaches on one walk."""
    walks = {approach: _tracked(replace(BASE, approach=approach), streams) for approach in APPROACHES}
    errors_m = {name: np.hypot(*(track_m - true_m).T) for name, (true_m, track_m) in walks.items()}
    time_s = np.asarray(INTERVAL_S * np.arange(1, _SHOWN + 1), dtype=np.float64)
    curves = tuple(Curve(name=name, x=time_s, y=error_m[:_SHOWN]) for name, error_m in errors_m.items())
    panel = Panel(title="two rounds", x_label="time (s)", y_label="error (m)", curves=curves)
    told = ", ".join(f"{name} {float(error_m.mean()):.2f} m" for name, error_m in errors_m.items())
    return Section(
        heading="Fig. 5: one walk",
        paragraphs=(f"The first walk of the study; mean error over all five rounds: {told}.",),
        parts=(
            Picture(
                name="error_over_time",
                caption="Error over the first two rounds (paper: Fig. 5a).",
                drawn=draw_curves([panel]),
            ),
            Picture(
                name="tracks",
                caption="True and estimated way over all five rounds (paper: Fig. 5b to 5d).",
                drawn=_draw_tracks(walks),
            ),
        ),
    )


def rho_tracks(streams: Streams) -> Picture:
    """Return Fig. 6 (b) to (d): tracks of the same walk under three values of ρ."""
    walks = {f"ρ = {rho_m2:g} m²": _tracked(replace(BASE, rho_m2=rho_m2), streams) for rho_m2 in RHO_TRACKS_M2}
    return Picture(
        name="tracks_rho",
        caption="True and estimated way over all five rounds of the first walk (paper: Fig. 6b to 6d).",
        drawn=_draw_tracks(walks),
    )


def _tracked(choice: Choice, streams: Streams) -> tuple[FloatArray, FloatArray]:
    """Return the true and the estimated places of one walk, shape (n, 2) each, m."""
    world, antennas, estimator = scenario(choice), layout(choice), tracker(choice)
    observations, true_m = observe_target(antennas, world, streams, _WALK)
    draws = streams.generator(world.name, _WALK, Purpose.FILTER)
    knowledge = target_knowledge(antennas, world, estimator)
    return true_m, estimator.run(knowledge, observations, draws).places_m


def _draw_tracks(walks: Mapping[str, tuple[FloatArray, FloatArray]]) -> "Drawn":
    return draw_trajectories(
        [
            Paths(title=title, true_m=true_m, estimated_m={"estimated": track_m}, window_m=_WINDOW_M)
            for title, (true_m, track_m) in walks.items()
        ]
    )


def rho_picture(found: Found) -> tuple[Picture, ...]:
    """Return the median error over ρ beside the paper's numbers; nothing with fewer than three values."""
    rhos = sorted(float(row) for part, row, _ in found if part == "6 rho")
    if len(rhos) < 3:
        return ()
    medians = [median(found["6 rho", f"{rho:g}", "fused"].column(GOAL)) for rho in rhos]
    half_m = np.array([(item.high - item.low) / 2.0 if math.isfinite(item.low) else 0.0 for item in medians])
    printed = {rho: value for rho, value in FIGURE_6_RHO.items() if value is not None}
    curves = (
        Curve(
            name="ours (median)",
            x=np.log10(rhos),
            y=np.array([item.value for item in medians]),
            half_width=half_m,
        ),
        Curve(name="paper", x=np.log10(list(printed)), y=np.array(list(printed.values()))),
    )
    panel = Panel(title="error over ρ", x_label="log10 of ρ in m²", y_label="error (m)", curves=curves)
    return (Picture(name="rho", caption="Error over ρ (paper: Fig. 6).", drawn=draw_curves([panel])),)
