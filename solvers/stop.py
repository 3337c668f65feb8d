"""Rules that say when enough effort was spent."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Never:
    """Lets the solver come to its own end."""

    def __call__(self, trials: int, seconds: float) -> bool:
        """Return false."""
        return False


@dataclass(frozen=True, slots=True, kw_only=True)
class MaxTrials:
    """Stops after a number of trials; results stay reproducible."""

    trials: int

    def __call__(self, trials: int, seconds: float) -> bool:
        """Return whether the trials are used up."""
        return trials >= self.trials
