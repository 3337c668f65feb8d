"""The world in which robots dock by the direction of a transponder's waves."""

import math
from dataclasses import dataclass

from layoutopt.identity import check_not_negative
from layoutopt.tracking_world import SPEED_OF_LIGHT_M_S


@dataclass(frozen=True, slots=True, kw_only=True)
class DockingWorld:
    """How waves and robots meet what stands on a site, beside the ``scatterers_m`` of its scenario.

    Attributes
    ----------
    frequency_hz
        Of the transponder.
    reflection, wall_reflection
        Shares of the amplitude that scatterers send on and walls reflect, 0 to 1.
    scatterer_radius_m
        Radius about a scatterer's middle that a robot cannot enter, m; zero for things that only scatter.
    blocks_wave
        Whether walls take away every wave that would have to cross them, and scatterers of that radius across the
        straight line the direct one.
    random_scatterers
        How many scatterers more stand at random places, drawn anew for every trial.
    clearance_m
        How far scatterers stay at least from transponder and start, m.
    least_start_m
        Least distance between where a drive starts and the transponder, m.
    start_m
        Where every drive starts, m; ``None`` for another random place in every trial.
    step_m, stop_m
        Way between two readings, and distance to the transponder at which a robot has docked, m.
    steps
        Steps after which a robot that has not docked has failed.
    detour
        Whether a robot that was stopped goes aside for one step.

    Raises
    ------
    ValueError
        If a number is not finite or outside its range.
    """

    frequency_hz: float = 303.2e6
    reflection: float = 0.5
    wall_reflection: float = 0.0
    scatterer_radius_m: float = 0.1
    blocks_wave: bool = False
    random_scatterers: int = 0
    clearance_m: float = 0.5
    least_start_m: float = 1.0
    step_m: float = 0.5
    stop_m: float = 0.5
    steps: int = 40
    detour: bool = True
    start_m: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        """Check every number."""
        for name in ("frequency_hz", "step_m", "stop_m"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be positive and finite, got {getattr(self, name)!r}")
        for name in ("reflection", "wall_reflection"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"{name} is a share between 0 and 1, got {getattr(self, name)!r}")
        sizes = ("scatterer_radius_m", "clearance_m", "least_start_m")
        check_not_negative("docking", **{name: getattr(self, name) for name in sizes})
        if self.start_m is not None and not all(math.isfinite(value) for value in self.start_m):
            raise ValueError(f"start_m needs x and y, both finite, got {self.start_m!r}")
        if self.random_scatterers < 0 or self.steps < 1:
            raise ValueError("docking has no fewer than 0 random scatterers and at least one step")
        if self.clearance_m <= self.scatterer_radius_m and self.random_scatterers:
            raise ValueError("random scatterers need a clearance beyond their radius")

    @property
    def wavelength_m(self) -> float:
        """Wavelength of the transponder's waves."""
        return SPEED_OF_LIGHT_M_S / self.frequency_hz
