"""What a replay says and leaves: lines for the terminal, and the estimated path as a table."""

import csv
import math
from pathlib import Path
from typing import Final

import numpy as np

from layoutopt.atomic_file import replacing
from layoutopt.commissioning.fitting import VALUES, DriveFit, fitted_text, write_fitted
from layoutopt.commissioning.replay import Replay
from layoutopt.geometry import wrapped
from layoutopt.identity import FloatArray
from layoutopt.spec.layout_file import write_layout

PATH_COLUMNS: Final = (
    "time_s",
    "x_m",
    "y_m",
    "heading_rad",
    "sigma_m",
    "lost",
    "reads",
    "truth_x_m",
    "truth_y_m",
    "truth_heading_rad",
    "position_error_m",
    "heading_error_rad",
)
"""Columns of the table of the path; a cell is empty where nothing is known."""


def write_replay(replayed: Replay, fit: DriveFit, folder: Path, *, quick_look: bool = False) -> tuple[Path, ...]:
    """Write path, fitted values, and the layout file with them in place; return the names.

    ``quick_look`` says that a quick look chose the layout: its mark goes on to the new file.

    Raises
    ------
    InvalidInput
        If the layout cannot be written as a file.
    """
    folder.mkdir(parents=True, exist_ok=True)
    names = (folder / "path.csv", folder / "fitted.toml", folder / "fitted_layout.toml")
    write_path(replayed, names[0])
    write_fitted(replayed, fit, names[1])
    write_layout(replayed.layout, fit.spec(replayed.spec), names[2], quick_look=quick_look)
    return names


def write_path(replayed: Replay, path: Path) -> None:
    """Write the estimated pose at the end of each step, with stated deviation, health, reads and error."""
    trajectory, drive = replayed.trajectory, replayed.drive
    steps = len(trajectory.poses)
    sigma_m = np.full(steps, np.nan) if replayed.stated_sigma_m is None else replayed.stated_sigma_m
    headings = wrapped(np.stack([trajectory.poses[:, 2], drive.truth[:, 2]]))
    numbers = np.column_stack(
        [
            drive.time_s,
            trajectory.poses[:, :2],
            headings[0],
            sigma_m,
            drive.truth[:, :2],
            headings[1],
            replayed.position_error_m,
            replayed.heading_error_rad,
        ]
    )
    lost = [""] * steps if trajectory.lost is None else [str(int(flag)) for flag in trajectory.lost]
    reads = np.diff(drive.observations.read_start)
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as stream:
        out = csv.writer(stream, lineterminator="\n")
        out.writerow(PATH_COLUMNS)
        for row, values in enumerate(numbers):
            cells = [_cell(value) for value in values]
            out.writerow([*cells[:5], lost[row], int(reads[row]), *cells[5:]])


def replay_lines(replayed: Replay, fit: DriveFit) -> list[str]:
    """Return what the command line prints."""
    log, observations = replayed.log, replayed.drive.observations
    known = replayed.read_tags
    foreign = len(observations.read_tag) - len(known)
    lines = [
        f"{log.file}: {len(observations) * observations.step_s:.4g} s, {len(known)} reads of "
        f"{len(np.unique(known))} of {len(replayed.knowledge.tags)} tags"
        + (f", {foreign} reads of tags that are not in the map" if foreign else ""),
        *(f"note: {note}" for note in replayed.notes),
    ]
    lines.append(f"estimator {replayed.estimator.name}, seed {replayed.seed}: " + _health(replayed))
    if np.isfinite(replayed.position_error_m).any():
        lines += [
            f"position error: {_errors(replayed.position_error_m * 1000.0, 'mm')}",
            f"heading error:  {_errors(np.rad2deg(replayed.heading_error_rad), 'deg')}",
        ]
    reference = "the truth" if replayed.with_truth else "the reads alone"
    lines.append(f"fitted against {reference} (± standard error):")
    lines += [f"  {VALUES[name].key:20} {fitted_text(name, fitted)}" for name, fitted in fit.written.items()]
    if not fit.written:
        lines.append("  nothing")
    planned = fit.reads.planned
    if planned is not None:
        lines.append(
            f"  of {planned.count} scans with a tag in the planned disc {planned.value * 100.0:.3g} % brought it "
            f"(95 %: {planned.low * 100.0:.3g} to {planned.high * 100.0:.3g} %), scatter of the tags included"
        )
    lines += [f"note: {note}" for note in fit.notes]
    return lines


def _health(replayed: Replay) -> str:
    trajectory, sigma_m = replayed.trajectory, replayed.stated_sigma_m
    parts = []
    if sigma_m is not None:
        parts.append(f"stated deviation {float(np.median(sigma_m)) * 1000.0:.3g} mm (median of the steps)")
    if trajectory.lost is not None:
        parts.append(f"lost in {float(trajectory.lost.mean()) * 100.0:.3g} % of the steps")
    return ", ".join(parts) or "states neither deviation nor health"


def _errors(error: FloatArray, unit: str) -> str:
    known = error[np.isfinite(error)]
    return (
        f"mean {float(known.mean()):.3g} {unit}, 95 % {float(np.quantile(known, 0.95)):.3g} {unit}, largest "
        f"{float(known.max()):.3g} {unit} (n = {len(known)} steps)"
    )


def _cell(value: float) -> str:
    return "" if math.isnan(value) else f"{value + 0.0:.6f}"
