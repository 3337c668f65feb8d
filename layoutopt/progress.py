"""What a running study tells whoever watches, and the tally that watchers keep of it."""

import dataclasses
import math
import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from layoutopt.protocols import Evaluation, Failure
from layoutopt.units import format_duration


class Progress(Protocol):
    """Receives news of a study; the command line prints them, a test collects them."""

    def round(self, name: str, tasks: int, trials: int) -> None:
        """Take note that a round of so many tasks and trials begins."""
        ...

    def result(self, evaluation: Evaluation | Failure) -> None:
        """Take note of one finished task."""
        ...

    def best(self, text: str) -> None:
        """Take note of the best answer so far."""
        ...

    def note(self, text: str) -> None:
        """Take note of something that the user should know."""
        ...


class Silent:
    """Progress that nobody watches."""

    def round(self, name: str, tasks: int, trials: int) -> None:
        """Do nothing."""

    def result(self, evaluation: Evaluation | Failure) -> None:
        """Do nothing."""

    def best(self, text: str) -> None:
        """Do nothing."""

    def note(self, text: str) -> None:
        """Do nothing."""


class Together:
    """Progress that several watch."""

    def __init__(self, *watchers: Progress) -> None:
        self._watchers = watchers

    def round(self, name: str, tasks: int, trials: int) -> None:
        """Tell everyone of a round."""
        for watcher in self._watchers:
            watcher.round(name, tasks, trials)

    def result(self, evaluation: Evaluation | Failure) -> None:
        """Tell everyone of a finished task."""
        for watcher in self._watchers:
            watcher.result(evaluation)

    def best(self, text: str) -> None:
        """Tell everyone of the best answer so far."""
        for watcher in self._watchers:
            watcher.best(text)

    def note(self, text: str) -> None:
        """Tell everyone of something to know."""
        for watcher in self._watchers:
            watcher.note(text)


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshot:
    """How a study stands.

    Attributes
    ----------
    round, rounds
        Name and number of the round at work.
    trials, trials_done
        Trials of that round that were still to be run when it began, and how many of them are done; a failed
        task's trials count as done.
    trials_run
        Trials of all rounds of this run, without failed ones.
    trials_per_s, left_s
        Rate of the round, and the time that the rest of the round takes at that rate; NaN before anything is done.
    failures
        Failed tasks of this run by kind.
    best
        The best answer so far, in words.
    """

    round: str
    rounds: int
    trials: int
    trials_done: int
    trials_run: int
    trials_per_s: float
    left_s: float
    failures: Mapping[str, int]
    best: str

    def as_json(self) -> dict[str, object]:
        """Return the fields in plain types; what is not known is null."""
        fields = dataclasses.asdict(self)
        return {
            name: None if isinstance(value, float) and not math.isfinite(value) else value
            for name, value in fields.items()
        }

    @property
    def text(self) -> str:
        """The snapshot as one line."""
        parts = [f"{self.round}: {self.trials_done} of {self.trials} trials"]
        if not math.isnan(self.left_s):
            parts += [self.rate_text, f"{format_duration(self.left_s)} left in this round"]
        parts += [text for text in (self.failures_text, self.best) if text]
        return ", ".join(parts)

    @property
    def rate_text(self) -> str:
        """The rate in words."""
        return "" if math.isnan(self.trials_per_s) else f"{self.trials_per_s:.3g} trials/s"

    @property
    def failures_text(self) -> str:
        """The failures in words; empty without any."""
        kinds = ", ".join(f"{count} {kind}" for kind, count in sorted(self.failures.items()))
        return f"failed tasks: {kinds}" if kinds else ""


class Tally:
    """Counts what a study tells."""

    def __init__(self) -> None:
        self._round, self._rounds, self._best = "", 0, ""
        self._trials = self._tasks = self._tasks_done = self._trials_done = self._trials_run = 0
        self._failures: Counter[str] = Counter()
        self._began = time.monotonic()

    def round(self, name: str, tasks: int, trials: int) -> None:
        """Begin to count a round."""
        self._round, self._rounds = name, self._rounds + 1
        self._tasks, self._trials = tasks, trials
        self._tasks_done = self._trials_done = 0
        self._began = time.monotonic()

    def result(self, evaluation: Evaluation | Failure) -> None:
        """Count a finished task."""
        self._tasks_done += 1
        if isinstance(evaluation, Failure):
            self._failures[evaluation.kind.value] += 1
            # How many trials a failed task was to have is not told; the mean of the round is near enough.
            self._trials_done += round(self._trials / max(self._tasks, 1))
        else:
            self._trials_done += len(evaluation.outcomes)
            self._trials_run += len(evaluation.outcomes)
        if self._tasks_done >= self._tasks:
            self._trials_done = self._trials
        self._trials_done = min(self._trials_done, self._trials)

    def best(self, text: str) -> None:
        """Keep the best answer so far."""
        self._best = text or self._best

    def note(self, text: str) -> None:
        """Take no note."""

    @property
    def snapshot(self) -> Snapshot:
        """How the study stands now."""
        seconds = time.monotonic() - self._began
        rate = self._trials_done / seconds if self._trials_done and seconds > 0.0 else math.nan
        return Snapshot(
            round=self._round,
            rounds=self._rounds,
            trials=self._trials,
            trials_done=self._trials_done,
            trials_run=self._trials_run,
            trials_per_s=rate,
            left_s=(self._trials - self._trials_done) / rate,
            failures=dict(sorted(self._failures.items())),
            best=self._best,
        )
