"""The simulated cells of mi2016: its tables, what the paper leaves open, and the speeds."""

import itertools
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Final, cast

import numpy as np

from layoutopt.scenario import Faults, Routes, Scenario
from studies.cells import Cell
from studies.published import mi2016_setting as setting
from studies.published.floor_frame import FloorFrame
from studies.published.timed_noise import TimedNoise

if TYPE_CHECKING:
    from layoutopt.protocols import Estimator
    from layoutopt.robot import Odometry

SPEEDS_M_S: Final = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35)
PROBED: Final = ((8, 100), (8, 16), (96, 100), (96, 16))
"""Readers and tags a square metre at which open choices are varied."""
_BASE: Final = "the setting of Tables 2 and 4"


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """Trials a cell of each part and of each round of the fit; ``fit_thinning`` makes the fit's grid coarser."""

    tables: int
    changes: int
    speeds: int
    fit: tuple[int, int, int]
    real: int
    spread: int
    fit_thinning: int


FULL: Final = Effort(tables=32, changes=16, speeds=24, fit=(2, 6, 24), real=24, spread=12, fit_thinning=1)
QUICK: Final = Effort(tables=3, changes=2, speeds=2, fit=(1, 1, 2), real=2, spread=1, fit_thinning=5)

TableKey = tuple[int, int, str]
"""Readers, tags a square metre, likelihood."""
ThirdKey = tuple[str, str, str, bool]
"""Likelihood, name of the motion noise, frame of the odometry, whether particles are re-initialised."""
SpeedKey = tuple[float, str, str]
"""Speed in m/s, how the noise grows, likelihood."""
ChangeKey = tuple[str, int, int]
"""What is changed, readers, tags a square metre."""


def table_cells(effort: Effort) -> dict[TableKey, Cell]:
    """Return the cells of Tables 2 and 4, and the same for the arrays of 24 and 20 readers."""
    return {
        (readers, tags, likelihood): Cell(
            layout=setting.layout(readers, tags),
            scenario=setting.scenario(),
            estimator=setting.particle_filter(likelihood),
            trials=effort.tables,
        )
        for readers in setting.ARRAYS
        for tags in setting.DENSITIES
        for likelihood in setting.LIKELIHOODS
    }


NOISES: Final = {"20 mm/s, 0.03 rad/s": setting.NOISE_OF_TABLE_3, "30 mm/s, 0.05 rad/s": setting.NOISE}
"""Motion noises under which Table 3 is tried; the first is the one compared with the paper."""


FRAMES: Final = ("floor", "robot")
"""Frame in which particles move: that of Eq. 1, and that of wheels."""


def third_cells(effort: Effort) -> dict[ThirdKey, Cell]:
    """Return the cells of Table 3: a start that is known wrongly, without and with re-initialisation."""
    found = {}
    routes = replace(setting.CIRCLE, heading_rad=0.0)
    for likelihood, (name, noise), frame, reinitialise in itertools.product(
        setting.LIKELIHOODS, NOISES.items(), FRAMES, (False, True)
    ):
        estimator = setting.particle_filter(likelihood, reinitialise=reinitialise)
        found[likelihood, name, frame, reinitialise] = Cell(
            layout=setting.layout(96, 100),
            scenario=setting.scenario(
                odometry=setting.odometry_by_time(*noise),
                routes=routes,
                faults=Faults(start_offset=setting.WRONG_START),
            ),
            estimator=FloorFrame(inner=estimator) if frame == "floor" else estimator,
            trials=effort.tables,
        )
    return found


def right_start_cells(effort: Effort) -> dict[bool, Cell]:
    """Return the cell of Table 3 with the start known rightly, without and with re-initialisation."""
    return {
        reinitialise: Cell(
            layout=setting.layout(96, 100),
            scenario=setting.scenario(),
            estimator=setting.particle_filter("combination", reinitialise=reinitialise),
            trials=effort.tables,
        )
        for reinitialise in (False, True)
    }


def speed_cells(effort: Effort) -> dict[SpeedKey, Cell]:
    """Return the cells of the eight readers at 100 tags a square metre, by speed and meaning of the noise."""
    kinds: dict[str, Odometry] = {
        "time": setting.odometry_by_time(*setting.NOISE),
        "way": setting.odometry_by_way(*setting.NOISE),
    }
    return {
        (speed_m_s, kind, likelihood): Cell(
            layout=setting.layout(8, 100),
            scenario=setting.scenario(odometry=odometry, speed_m_s=speed_m_s),
            estimator=setting.particle_filter(likelihood),
            trials=effort.speeds,
        )
        for speed_m_s in SPEEDS_M_S
        for kind, odometry in kinds.items()
        for likelihood in setting.LIKELIHOODS
    }


def changed_cells(effort: Effort) -> dict[ChangeKey, Cell]:
    """Return the cells in which one open choice is made otherwise, the unchanged one among them."""
    return {
        (name, readers, tags): change(
            Cell(
                layout=setting.layout(readers, tags),
                scenario=setting.scenario(),
                estimator=setting.particle_filter("combination"),
                trials=effort.changes,
            ),
            readers,
            tags,
        )
        for name, change in _changes().items()
        for readers, tags in PROBED
    }


def change_names() -> tuple[str, ...]:
    """Return what is changed, one thing at a time, without the unchanged setting."""
    return tuple(name for name in _changes() if name != _BASE)


def unchanged(readers: int, tags: int) -> ChangeKey:
    """Return the key of the cell with which changes are compared."""
    return (_BASE, readers, tags)


def all_cells(effort: Effort) -> Iterable[Cell]:
    """Return every simulated cell."""
    parts = (table_cells, third_cells, right_start_cells, speed_cells, changed_cells)
    return [cell for part in parts for cell in part(effort).values()]


_Change = Callable[[Cell, int, int], Cell]


def _changes() -> dict[str, _Change]:
    square_m = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])
    aligned = Routes(kind="way_points", way_points_m=square_m, centre_spread_m=setting.HALF_METRE, heading_rad=0.0)
    half, double = (
        setting.odometry_by_time(*(factor * sigma for sigma in setting.NOISE)) for factor in (0.5, 2.0)
    )
    return {
        _BASE: lambda cell, readers, tags: cell,
        "motion noise of robot and filter halved": partial(_other_scenario, setting.scenario(odometry=half)),
        "motion noise of robot and filter doubled": partial(_other_scenario, setting.scenario(odometry=double)),
        "odometry exact, filter unchanged": _exact_odometry,
        "filter assumes 0.3 of the noise": partial(_other_filter, {"motion_scale": 0.3}),
        "filter assumes 3 times the noise": partial(_other_filter, {"motion_scale": 3.0}),
        "σ = 0.7 of the read radius": partial(_other_filter, {"sigma_scale": 0.7}),
        "σ = 1.5 times the read radius": partial(_other_filter, {"sigma_scale": 1.5}),
        "β = 0.1": partial(_other_filter, {"beta": 0.1}),
        "α = 0.1 a detection": partial(_other_filter, {"alpha": 0.1}),
        "α = 0.5 a detection": partial(_other_filter, {"alpha": 0.5}),
        "100 particles": partial(_other_filter, {"particles": 100}),
        "square of 1 m along the lattice, heading 0": partial(_other_scenario, setting.scenario(routes=aligned)),
        "circle, heading 0 throughout": partial(
            _other_scenario, setting.scenario(routes=replace(setting.CIRCLE, heading_rad=0.0))
        ),
        "readers elsewhere: 8 at 50 and 150 mm, 96 as four arms of 4 by 6": _other_array,
    }


def _other_scenario(scenario: Scenario, cell: Cell, readers: int, tags: int) -> Cell:
    return replace(cell, scenario=scenario)


def _other_filter(settings: dict[str, float], cell: Cell, readers: int, tags: int) -> Cell:
    estimator: Estimator = replace(setting.particle_filter("combination"), **settings)  # type: ignore[arg-type]
    return replace(cell, estimator=estimator)


def _exact_odometry(cell: Cell, readers: int, tags: int) -> Cell:
    translation_m_s, rotation_rad_s = setting.NOISE
    return replace(
        cell,
        scenario=setting.scenario(odometry=setting.EXACT),
        estimator=TimedNoise(
            inner=cast("Estimator", cell.estimator),
            translation_m_s=translation_m_s,
            rotation_rad_s=rotation_rad_s,
        ),
    )


def _other_array(cell: Cell, readers: int, tags: int) -> Cell:
    return replace(cell, layout=setting.layout_of(setting.other_array(readers), tags))
