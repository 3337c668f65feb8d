"""Everything that layoutopt raises on purpose: one base class, one exit code each."""

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum, unique


class LayoutoptError(Exception):
    """Base of all errors that a person can act on; the command line prints it as one message."""

    exit_code = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """One thing that is wrong with what the user gave.

    ``place`` names file, line and key as far as they are known, ``problem`` says what is wrong with which
    value, ``repair`` what would be right.
    """

    place: str
    problem: str
    repair: str = ""

    def __str__(self) -> str:
        repair = f" {self.repair}" if self.repair else ""
        return f"{self.place}: {self.problem}.{repair}"


class InvalidInput(LayoutoptError):
    """A file, key or value that cannot be used; carries every fault that was found, not only the first."""

    def __init__(self, faults: Fault | Sequence[Fault]) -> None:
        self.faults: tuple[Fault, ...] = (faults,) if isinstance(faults, Fault) else tuple(faults)
        super().__init__("\n".join(str(fault) for fault in self.faults))

    @classmethod
    def at(cls, place: str, problem: str, repair: str = "") -> "InvalidInput":
        """Return the error for a single fault."""
        return cls(Fault(place=place, problem=problem, repair=repair))

    def __reduce__(self) -> tuple[type["InvalidInput"], tuple[tuple[Fault, ...]]]:
        """Keep the faults when a worker process sends the error home."""
        return (type(self), (self.faults,))


class UnknownName(InvalidInput):
    """A name that no table of an extension point knows."""


class NotInstalled(LayoutoptError):
    """A package that an optional feature needs is missing, or another package hides one of ours."""


class StudyDamaged(LayoutoptError):
    """A study folder that cannot be continued or read as it is."""


class StudyStopped(LayoutoptError):
    """A study that ended before its answer was complete; what was finished is kept."""

    exit_code = 3


class WorkerDied(StudyStopped):
    """No worker process can be had or kept alive."""


class JournalNotWritten(StudyStopped):
    """The journal takes no more lines, for want of room or right; those that it has are whole."""


class AnswerNotWritten(StudyStopped):
    """Tables and report find no room; the trials that they are made of are kept."""


class StoppedByLimit(StudyStopped):
    """A limit on time or trials was reached before there was an answer."""


class Interrupted(StudyStopped):
    """Somebody asked the study to stop."""

    exit_code = 130


class NotANumber(ValueError):
    """Something that was computed is no number, and must not drop out of a mean without a word."""


@unique
class FailureKind(StrEnum):
    """Why a task has no result."""

    RAISED = "raised an error"
    NOT_A_NUMBER = "gave no number"
    MEMORY = "out of memory"
    KILLED = "killed its worker"
    HUNG = "never ended"
    NOT_SENT = "could not be sent to a worker"


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return ``"Did you mean 'x'?"``, or the list of known names when none is near.

    >>> did_you_mean("sqare", ["square", "triangular"])
    "Did you mean 'square'?"
    """
    names = sorted(known)
    near = difflib.get_close_matches(name, names, n=1)
    return f"Did you mean '{near[0]}'?" if near else f"Known: {', '.join(names)}."
