"""The rooms of kim2009: the maps of Fig. 5 and Table I, and the docking of Table II.

The paper leaves out where the transponder of its maps is and how wide they are. Both were fitted to rows (b) and
(c) of Table I at R = 0.5; so these rows show only that the model can give them, and the others are predictions.
"""

import math
from types import MappingProxyType
from typing import Final

import numpy as np

from layoutopt.docking_world import DockingWorld
from layoutopt.errors import InvalidInput
from layoutopt.identity import FloatArray
from layoutopt.simulation.docking import DockingRoom

FREQUENCY_HZ: Final = 303.2e6
"""Of Section II."""
WAVELENGTH_M: Final = DockingWorld(frequency_hz=FREQUENCY_HZ).wavelength_m
ROOM_M: Final = (-2.5, -2.5, 2.5, 2.5)
"""The room of Section V-A, 5 m by 5 m, about its middle."""
_SINGLE: Final = ((-1.0, 0.0),)
_AROUND: Final = ((-2.2, -2.2), (-2.2, 0.0), (-2.2, 2.2), (0.0, -2.2), (2.2, -2.2), (2.2, 0.0), (2.2, 2.2))
SCATTERERS_M: Final = MappingProxyType(
    {"a": _SINGLE, "b": _AROUND, "c": (*_AROUND, (-1.0, -0.2), (-1.0, 0.0), (-1.0, 0.2))}
)
"""Scatterers of Fig. 5(a) to (c) as printed; (0, 2.2) is missing there and is left out here too."""
FITTED_TRANSPONDER_M: Final = (0.4, 1.0)
FITTED_CELLS: Final = 58
"""Cells a side. Table I's 0.06, 2.85 and 1.84 % are no shares of the 2500 cells of the room, but of 58 by 58."""
_CELL_M: Final = 0.1
STEP_SHARE: Final = 0.2
"""Share of the distance that the robot of Table I moves."""


def cells_m() -> FloatArray:
    """Return the middles of the cells of a map as fitted, shape (cells, 2), m."""
    axis = (np.arange(FITTED_CELLS) - (FITTED_CELLS - 1) / 2.0) * _CELL_M
    return np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)


def share_not_nearer(error_rad: FloatArray, step_share: float = STEP_SHARE) -> float:
    """Return the share of directions along which a step does not bring a robot nearer to the transponder.

    A step of share s of the distance leads to a distance of sqrt(1 + s² - 2 s cos(error)) times the old one, which
    is no less than one where cos(error) is at most s / 2.

    Raises
    ------
    InvalidInput
        If there is no direction, one is not finite, or the share is not between 0 and 1.

    References
    ----------
    kim2009, Table I.

    Examples
    --------
    >>> share_not_nearer(np.radians([0.0, 84.2, 84.3, -120.0]))
    0.5
    """
    errors = np.asarray(error_rad, dtype=np.float64)
    if not errors.size or not np.isfinite(errors).all():
        raise InvalidInput.at(
            "error_rad", "it holds no direction, or one that is not finite", "Give finite angles."
        )
    if not 0.0 < step_share <= 1.0:
        raise InvalidInput.at(
            "step_share", f"it is {step_share!r}", "It is a share of the distance, above 0 and at most 1."
        )
    return float((np.cos(errors) <= step_share / 2.0).mean())


def docking_room(*, blocking: bool, detour: bool = False) -> DockingRoom:
    """Return the room of Table II: 5 m to dock, scatterers that halve the amplitude, a reading every 0.5 m.

    The paper states room, distance, R and the 0.5 m at which docking ends. Corners of start and end, 2 degrees of
    noise (its 4 taken as two standard deviations) and the limit of 40 steps are chosen, and so are obstacles that
    stop the robot within 0.1 m of their middle: with ``blocking`` false they only scatter. Its robots make no
    ``detour``.
    """
    return DockingRoom(
        bounds_m=ROOM_M,
        start_m=(-2.0, -1.5),
        transponder_m=(2.0, 1.5),
        world=DockingWorld(
            frequency_hz=FREQUENCY_HZ,
            reflection=0.5,
            scatterer_radius_m=0.1 if blocking else 0.0,
            steps=40,
            detour=detour,
        ),
        noise_rad=math.radians(2.0),
    )
