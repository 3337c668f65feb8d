"""Rules that say when enough effort was spent."""

from dataclasses import dataclass

from layoutopt.protocols import Stop


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


@dataclass(frozen=True, slots=True, kw_only=True)
class TimeLimit:
    """Stops after a time; results then depend on the machine."""

    seconds: float

    def __call__(self, trials: int, seconds: float) -> bool:
        """Return whether the time is up."""
        return seconds >= self.seconds


@dataclass(frozen=True, slots=True, kw_only=True)
class Either:
    """Stops as soon as one of several rules does."""

    rules: tuple[Stop, ...]

    def __call__(self, trials: int, seconds: float) -> bool:
        """Return whether any rule stops."""
        return any(rule(trials, seconds) for rule in self.rules)
