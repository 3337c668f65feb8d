"""What a running study tells whoever watches."""

from typing import Protocol

from layoutopt.protocols import Evaluation, Failure


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
