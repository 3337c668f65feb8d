"""What the robustness study found, as plain values: both layouts, the price of robustness, the sweep."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from layoutopt.layout import Layout
from layoutopt.problem import Limit, Problem
from layoutopt.protocols import Group
from layoutopt.result import Evaluated, Status
from layoutopt.scenario import Scenario
from layoutopt.scores import Score
from layoutopt.tolerance import Tolerance
from solvers.robust import Combined

SWEEP: Final = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Shares of the tolerance at which the error of both layouts is shown."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged:
    """A contender: its scores in the nominal world and over the tolerance, and its goal in each world.

    ``scores`` begin with the nominal world.
    """

    evaluated: Evaluated
    nominal: Mapping[str, Combined]
    robust: Mapping[str, Combined]
    scores: tuple[Score, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """A layout chosen; ``held`` if its deciding drives met every limit, ``tried`` how many got such drives."""

    judged: Judged
    held: bool
    tried: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Price:
    """What robustness costs, in money and in the goal; differences are paired on common drives.

    Attributes
    ----------
    cost_eur
        The robust layout's cost less the nominal one's.
    loss
        What the nominal layout loses in the world that is worst for it, against the nominal world.
    gain
        By how much the robust layout is better in that world.
    nominal_gain
        By how much it is better in the nominal world.
    hardest
        That world.
    """

    cost_eur: float
    loss: Score
    gain: Score
    nominal_gain: Score
    hardest: Scenario


@dataclass(frozen=True, slots=True, kw_only=True)
class Sweep:
    """The goal of a layout at rising shares of the tolerance; ``None`` where a trial failed."""

    layout_key: str
    shares: tuple[float, ...]
    scores: tuple[Score, ...] | None


@dataclass(frozen=True, slots=True, kw_only=True)
class RobustnessFindings:
    """Everything that the robustness study hands to its readers.

    Attributes
    ----------
    limits
        Those on simulated scores.
    refusal
        Why no layout may be judged at all.
    trials
        Drives in all.
    choices
        ``nominal`` and ``robust``, as far as there is such a layout.
    """

    problem: Problem
    limits: tuple[Limit, ...]
    seed: int
    tolerance: Tolerance
    nominal: Scenario
    scenarios: tuple[Scenario, ...]
    refusal: str
    contenders: tuple[Judged, ...]
    choices: Mapping[str, Choice]
    price: Price | None
    sweeps: tuple[Sweep, ...]
    trials: int
    failures: Mapping[Group, str]

    @property
    def layouts(self) -> tuple[Layout, ...]:
        """The layouts chosen; one layout twice, if it is both."""
        return tuple(choice.judged.evaluated.layout for choice in self.choices.values())

    @property
    def status(self) -> Status:
        """How the study ended."""
        if self.refusal:
            return Status.INFEASIBLE
        robust = self.choices.get("robust")
        if robust is None or not robust.held:
            return Status.TARGET_NOT_MET
        return Status.TARGET_MET if self.limits else Status.SEARCHED
