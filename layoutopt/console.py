"""What the command line prints while a study runs: a live line on a terminal, plain or JSON lines elsewhere."""

import json
import math
import sys
import time
from types import TracebackType
from typing import Final, Self

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TaskID, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from layoutopt.progress import Tally
from layoutopt.protocols import Evaluation, Failure
from layoutopt.score_text import counted_text
from layoutopt.units import printable

_LOG_EVERY_S: Final = 10.0
_JSON_EVERY_S: Final = 1.0


class ConsoleProgress:
    """Shows round, rate, time left, best so far and failures by kind; writes to standard error."""

    def __init__(self, *, live: bool | None = None) -> None:
        self._console = Console(stderr=True)
        self._live = self._console.is_terminal if live is None else live
        self._bar: Bar | None = None
        self._task: TaskID | None = None
        self._tally = Tally()
        self._logged = time.monotonic()

    def __enter__(self) -> Self:
        """Start the live line, if there is a terminal to show it on."""
        if self._live:
            self._bar = Bar(
                TextColumn("{task.description}"),
                BarColumn(),
                MofNCompleteColumn(),
                TextColumn("{task.fields[told]}"),
                TimeRemainingColumn(),
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
            self._bar = None

    def round(self, name: str, tasks: int, trials: int) -> None:
        """Begin a new line for a round."""
        self._tally.round(name, tasks, trials)
        self._logged = time.monotonic()
        if self._bar is not None:
            if self._task is not None:
                self._bar.remove_task(self._task)
            self._task = self._bar.add_task(name, total=trials, told=self._tally.snapshot.best)
        else:
            self._log(f"{name}: {counted_text(trials, 'trial')} in {counted_text(tasks, 'task')}")

    def result(self, evaluation: Evaluation | Failure) -> None:
        """Count one finished task."""
        self._tally.result(evaluation)
        if isinstance(evaluation, Failure):
            kind = evaluation.kind.value
            self._log(f"failed: layout {evaluation.group.layout_key[:10]} {kind}: {evaluation.message}")
        snapshot = self._tally.snapshot
        if self._bar is not None and self._task is not None:
            told = (snapshot.rate_text, snapshot.failures_text, snapshot.best)
            self._bar.update(self._task, completed=snapshot.trials_done, told=", ".join(filter(None, told)))
        elif time.monotonic() - self._logged >= _LOG_EVERY_S:
            self._logged = time.monotonic()
            self._log(snapshot.text)

    def best(self, text: str) -> None:
        """Show the best answer so far."""
        news = text and text != self._tally.snapshot.best
        self._tally.best(text)
        if news and self._bar is None:
            self._log(f"best so far: {text}")

    def note(self, text: str) -> None:
        """Show something that the user should know."""
        self._log(f"note: {text}")

    def _log(self, text: str) -> None:
        line = printable(text)
        if self._bar is not None:
            self._bar.console.print(line, markup=False, highlight=False)
        else:
            print(line, file=sys.stderr, flush=True)


class JsonProgress:
    """Writes a JSON object a line to standard error, for programs that run studies.

    ``event`` is ``"round"``, ``"progress"`` (at most one a second, and one at the end of a round), ``"failure"``,
    ``"best"`` or ``"note"``; the fields of the first two are those of `layoutopt.progress.Snapshot`.
    """

    def __init__(self) -> None:
        self._tally = Tally()
        self._told = -math.inf

    def __enter__(self) -> Self:
        """Return the progress itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Have nothing to end."""

    def round(self, name: str, tasks: int, trials: int) -> None:
        """Write that a round begins."""
        self._tally.round(name, tasks, trials)
        self._tell("round")

    def result(self, evaluation: Evaluation | Failure) -> None:
        """Write a failure at once, progress at times."""
        self._tally.result(evaluation)
        if isinstance(evaluation, Failure):
            group = evaluation.group
            _json_line(
                event="failure",
                layout=group.layout_key,
                scenario=group.scenario,
                estimator=group.estimator,
                kind=evaluation.kind.value,
                message=evaluation.message,
            )
        snapshot = self._tally.snapshot
        if time.monotonic() - self._told >= _JSON_EVERY_S or snapshot.trials_done == snapshot.trials:
            self._tell("progress")

    def best(self, text: str) -> None:
        """Write the best answer so far."""
        self._tally.best(text)
        if text:
            _json_line(event="best", text=text)

    def note(self, text: str) -> None:
        """Write something that the user should know."""
        _json_line(event="note", text=text)

    def _tell(self, event: str) -> None:
        self._told = time.monotonic()
        _json_line(event=event, **self._tally.snapshot.as_json())


def _json_line(**fields: object) -> None:
    print(json.dumps(fields, allow_nan=False), file=sys.stderr, flush=True)
