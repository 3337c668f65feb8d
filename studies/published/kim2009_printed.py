"""What kim2009 prints in its three tables."""

from types import MappingProxyType
from typing import Final

NOT_NEARER_PERCENT: Final = MappingProxyType(
    {
        (0.2, "a"): 0.0,
        (0.2, "b"): 0.0,
        (0.2, "c"): 0.0,
        (0.2, "d"): 0.0,
        (0.5, "a"): 0.0,
        (0.5, "b"): 0.06,
        (0.5, "c"): 2.85,
        (0.5, "d"): 1.84,
    }
)
"""Table I, by R and case of Fig. 5: share of directions that lead no nearer to the transponder, %."""
MEAN_BELOW_DEG: Final = 30.0
"""Section III, of Fig. 6: the mean error does not exceed it."""
OBSTACLES: Final = (0, 1, 3, 5, 7, 9)
TRIALS: Final = 50
WITHOUT: Final = MappingProxyType(dict(zip(OBSTACLES, (50, 50, 50, 40, 28, 19), strict=True)))
"""Table II, simulation: drives of 50 that docked as they measured, by number of obstacles."""
WITH: Final = MappingProxyType(dict(zip(OBSTACLES, (50, 50, 49, 46, 42, 37), strict=True)))
"""Table II, simulation: the same with the correction."""
CHAIRS: Final = (0, 6)
DRIVES: Final = 10
DROVE_WITHOUT: Final = MappingProxyType(dict(zip(CHAIRS, (10, 7), strict=True)))
"""Table III, experiment: drives of 10 that docked as they measured, by number of folding chairs."""
DROVE_WITH: Final = MappingProxyType(dict(zip(CHAIRS, (10, 9), strict=True)))
"""Table III, experiment: the same with the correction."""
