"""Which antenna can read which tag: a layout's antennas in columns, and one bucket grid over all tags."""

from dataclasses import dataclass

import numpy as np

from layoutopt.identity import FloatArray, IntArray
from layoutopt.layout import Layout
from layoutopt.protocols import Antennas


def antennas_of(layout: Layout, step_s: float, height_error_m: float = 0.0) -> Antennas:
    """Return all HF antennas of a layout, counted through its groups in order.

    A scan takes whole time steps: the cycle of a module is rounded up to the next step, so a reader is never
    modelled faster than it is. ``height_error_m`` is added to every antenna's height.
    """
    groups = layout.floor_readers
    xy_m, height_m, radius_m, period, phase, one_tag = [], [], [], [], [], []
    for group in groups:
        slot_steps = max(1, int(np.ceil(group.profile.scan_period_s / step_s - 1e-9)))
        for pose, slot in zip(group.poses, group.slots, strict=True):
            xy_m.append(pose[:2])
            height_m.append(pose[2] + height_error_m)
            radius_m.append(group.antenna.read_radius_m(float(pose[2]) + height_error_m))
            period.append(group.antennas_per_module * slot_steps)
            phase.append(slot * slot_steps)
            one_tag.append(group.profile.tags_per_scan == "one")
    return Antennas(
        xy_m=np.array(xy_m, dtype=np.float64).reshape(-1, 2),
        height_m=np.array(height_m, dtype=np.float64),
        radius_m=np.array(radius_m, dtype=np.float64),
        period_steps=np.array(period, dtype=np.int64),
        phase_steps=np.array(phase, dtype=np.int64),
        one_tag=np.array(one_tag, dtype=np.bool_),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class BucketGrid:
    """Points sorted into square cells, so that a search near a place looks at few of them.

    Cell (i, j) holds the points ``order[start[c]:start[c + 1]]`` with c = i + j * columns; ``xy_m`` is sorted
    the same way, so that a cell's points lie side by side in memory.
    """

    origin_m: tuple[float, float]
    cell_m: float
    columns: int
    rows: int
    start: IntArray
    order: IntArray
    xy_m: FloatArray

    def near(self, place_m: tuple[float, float], radius_m: float) -> IntArray:
        """Return the indices, ascending, of the points closer than ``radius_m`` (Eq. 5 of mi2016: open disc)."""
        low = np.floor((np.array(place_m) - radius_m - self.origin_m) / self.cell_m).astype(int)
        high = np.floor((np.array(place_m) + radius_m - self.origin_m) / self.cell_m).astype(int)
        found = []
        for row in range(max(low[1], 0), min(high[1], self.rows - 1) + 1):
            first, last = max(low[0], 0), min(high[0], self.columns - 1)
            if first > last:
                continue
            cells = slice(self.start[first + row * self.columns], self.start[last + row * self.columns + 1])
            offset_m = self.xy_m[cells] - place_m
            found.append(self.order[cells][(offset_m**2).sum(axis=1) < radius_m**2])
        return np.sort(np.concatenate(found)) if found else np.empty(0, dtype=np.int64)


def bucket_grid(xy_m: FloatArray, radius_m: float) -> BucketGrid:
    """Return the grid over points, shape (n, 2), for searches of about ``radius_m``.

    Cells are no smaller than twice the radius, and never so small that there are many more cells than points.
    """
    count = max(len(xy_m), 1)
    low = xy_m.min(axis=0) if len(xy_m) else np.zeros(2)
    size = (xy_m.max(axis=0) if len(xy_m) else np.zeros(2)) - low
    cell_m = max(2.0 * radius_m, float(np.sqrt(size.prod() / (4.0 * count))), float(size.max()) / 4096.0, 1e-3)
    columns, rows = (int(extent // cell_m) + 1 for extent in size)
    index = np.floor((xy_m - low) / cell_m).astype(np.int64)
    cell = np.minimum(index[:, 0], columns - 1) + np.minimum(index[:, 1], rows - 1) * columns
    order = np.argsort(cell, kind="stable")
    start = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=columns * rows))])
    return BucketGrid(
        origin_m=(float(low[0]), float(low[1])),
        cell_m=cell_m,
        columns=columns,
        rows=rows,
        start=start.astype(np.int64),
        order=order.astype(np.int64),
        xy_m=np.ascontiguousarray(xy_m[order]),
    )
