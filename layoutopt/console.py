"""What the command line prints while a study runs: a live line on a terminal, plain log lines elsewhere."""

import sys
import time
from types import TracebackType
from typing import Final, Self

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from layoutopt.protocols import Evaluation, Failure

_LOG_EVERY_S: Final = 10.0


class ConsoleProgress:
    """Shows round, rate, time left, best so far and failures; writes to standard error."""

    def __init__(self, *, live: bool | None = None) -> None:
        self._console = Console(stderr=True)
        self._live = self._console.is_terminal if live is None else live
        self._bar: Progress | None = None
        self._task: TaskID | None = None
        self._name = ""
        self._trials = 0
        self._done = 0
        self._failures = 0
        self._best = ""
        self._began = self._logged = time.monotonic()

    def __enter__(self) -> Self:
        """Start the live line, if there is a terminal to show it on."""
        if self._live:
            self._bar = Progress(
                TextColumn("{task.description}"),
                BarColumn(),
                MofNCompleteColumn(),
                TextColumn("{task.fields[rate]}"),
                TimeRemainingColumn(),
                TextColumn("{task.fields[best]}"),
                console=self._console,
                transient=True,
            )
            self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Take the live line down."""
        if self._bar is not None:
            self._bar.stop()

    def round(self, name: str, tasks: int, trials: int) -> None:
        """Begin a new line for a round."""
        self._name, self._trials, self._done = name, trials, 0
        self._began = self._logged = time.monotonic()
        if self._bar is not None:
            if self._task is not None:
                self._bar.remove_task(self._task)
            self._task = self._bar.add_task(name, total=trials, rate="", best=self._best)
        else:
            self._log(f"{name}: {trials} trials in {tasks} tasks")

    def result(self, evaluation: Evaluation | Failure) -> None:
        """Count one finished task."""
        if isinstance(evaluation, Failure):
            self._failures += 1
            self._log(f"failed: layout {evaluation.group.layout_key[:10]}: {evaluation.message}")
        else:
            self._done += len(evaluation.outcomes)
        seconds = max(time.monotonic() - self._began, 1e-6)
        rate = f"{self._done / seconds:.0f} trials/s"
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, completed=self._done, rate=rate, best=self._best)
        elif time.monotonic() - self._logged >= _LOG_EVERY_S:
            self._logged = time.monotonic()
            left_s = (self._trials - self._done) * seconds / max(self._done, 1)
            failures = f", {self._failures} failed" if self._failures else ""
            best = f", {self._best}" if self._best else ""
            self._log(f"{self._name}: {self._done} of {self._trials}, {rate}, {left_s:.0f} s left{failures}{best}")

    def best(self, text: str) -> None:
        """Show the best answer so far."""
        if text and text != self._best:
            self._best = text
            if self._bar is None:
                self._log(f"best so far: {text}")

    def note(self, text: str) -> None:
        """Show something that the user should know."""
        self._log(f"note: {text}")

    def _log(self, line: str) -> None:
        if self._bar is not None:
            self._bar.console.print(line, markup=False, highlight=False)
        else:
            print(line, file=sys.stderr, flush=True)
